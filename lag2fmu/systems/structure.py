"""SystemStructure.ssd and parameter sets as XML.

Sources: System Structure and Parameterization 1.0, Modelica Association 2019, and 2.0, 2024.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, count
from typing import Generic, TypeVar

from lag2fmu.errors import ExportError
from lag2fmu.fmu.xml_text import document
from lag2fmu.language.units import BASE_UNITS
from lag2fmu.systems.components import Component, Connector, EnumeratedType, LinearUnit
from lag2fmu.systems.connections import Connection, End
from lag2fmu.systems.controller import FUNCTION, PYTHON
from lag2fmu.systems.joints import ANNOTATION, SPACE, IdealJoint, attributes_of
from lag2fmu.version import VERSION

SSD, PARAMETERS = "SystemStructure.ssd", "resources/parameters.ssv"
VERSIONS = ("1.0", "2.0")
"""The versions of SSP that are written; importers such as fmpy read 1.0 alone."""
_SINCE_2 = frozenset({"Float32", "Int8", "UInt8", "Int16", "UInt16", "UInt32", "Int64", "UInt64"})
"""Types of connectors that version 1.0 does not know."""
_SPACES = {
    "ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
    "ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
    "ssv": "http://ssp-standard.org/SSP1/SystemStructureParameterValues",
}
"""Prefix -> namespace, which versions 1.0 and 2.0 share."""
FMU = "application/x-fmu-sharedlibrary"
"""The type (MIME) of a component that is an FMU."""
_FLOATS = ("Real", "Float64", "Float32")
T = TypeVar("T", LinearUnit, EnumeratedType)
_WIDTH, _GAP, _ROW = 30.0, 20.0, 4.0
"""In the diagram: the size of a component, the gap between two components, and the height of a connector."""


@dataclass(frozen=True)
class System:
    """FMUs and their connections.

    - ``sources``: {component: the path of its FMU in the archive}.
    - ``values``: {connector: value}, in the units of the connectors.
    - ``stop_time``: in s; ``version``: that of SSP.
    """

    name: str
    components: Mapping[str, Component]
    sources: Mapping[str, str]
    connections: Sequence[Connection]
    values: Mapping[End, float]
    stop_time: float
    version: str = VERSIONS[0]
    joints: Sequence[IdealJoint] = ()


class _Names(Generic[T]):
    """What is in use of one kind, each under its own name: FMUs of different tools may give one name to several."""

    def __init__(self) -> None:
        self.found: dict[T, str] = {}

    def of(self, one: T) -> str:
        """The name under which ``one`` is written."""
        taken = {*self.found.values()} - {self.found.get(one)}
        numbered = (f"{one.name}_{i}" for i in count(2))
        free = next(name for name in chain([one.name], numbered) if name not in taken)
        return self.found.setdefault(one, free)

    def listed(self) -> list[tuple[T, str]]:
        """All that is in use, by name."""
        return sorted(self.found.items(), key=lambda item: item[1])


class _Definitions:
    """The units and enumerations that a document defines."""

    def __init__(self) -> None:
        self._units, self._enumerations = _Names[LinearUnit](), _Names[EnumeratedType]()

    def attributes(self, connector: Connector) -> dict[str, str]:
        """The attributes that refer to the unit or the enumeration of the ``connector``."""
        unit, enumerated = connector.unit, connector.enumerated
        if enumerated is not None:
            return {"name": self._enumerations.of(enumerated)}
        return {"unit": self._units.of(unit)} if unit is not None and unit.exponents else {}

    def write(self, root: ET.Element, prefix: str) -> None:
        """Add the elements Enumerations and Units to ``root``, where such are in use."""
        if enumerations := self._enumerations.listed():
            parent = ET.SubElement(root, f"{prefix}:Enumerations")
            for enumeration, name in enumerations:
                element = ET.SubElement(parent, "ssc:Enumeration", {"name": name})
                for item, value in enumeration.items:
                    ET.SubElement(element, "ssc:Item", {"name": item, "value": str(value)})
        if units := self._units.listed():
            parent = ET.SubElement(root, f"{prefix}:Units")
            for unit, name in units:
                base = {symbol: str(e) for symbol, e in zip(BASE_UNITS, unit.exponents, strict=True) if e}
                base |= {"factor": repr(unit.factor)} if unit.factor != 1.0 else {}
                base |= {"offset": repr(unit.offset)} if unit.offset else {}
                ET.SubElement(ET.SubElement(parent, "ssc:Unit", {"name": name}), "ssc:BaseUnit", base)


def ssd(system: System) -> bytes:
    """The content of SystemStructure.ssd. Raises ExportError for connectors that its version does not know."""
    _check_version(system)
    root, definitions = _root("ssd:SystemStructureDescription", system.name, system.version), _Definitions()
    whole = ET.SubElement(root, "ssd:System", {"name": system.name})
    if system.values:
        bindings = ET.SubElement(whole, "ssd:ParameterBindings")
        ET.SubElement(bindings, "ssd:ParameterBinding", {"source": PARAMETERS})
    elements = ET.SubElement(whole, "ssd:Elements")
    for place, component in enumerate(system.components.values()):
        used = {end.connector for c in system.connections for end in c[:2] if end.component == component.name}
        own = component.controller is not None  # the file does not tell the connectors of a function
        shown = [c for name, c in component.connectors.items() if own or c.causality == "output" or name in used]
        _component(elements, component, system.sources[component.name], shown, place, definitions)
    if system.connections:
        parent = ET.SubElement(whole, "ssd:Connections")
        for source, target, factor in system.connections:
            start = {"startElement": source.component, "startConnector": source.connector}
            end = {"endElement": target.component, "endConnector": target.connector}
            element = ET.SubElement(parent, "ssd:Connection", start | end)
            if factor != 1.0:
                ET.SubElement(element, "ssc:LinearTransformation", {"factor": repr(factor)})
    if system.joints:
        annotation = ET.SubElement(ET.SubElement(whole, "ssd:Annotations"), "ssc:Annotation", {"type": ANNOTATION})
        parent = ET.SubElement(annotation, "joints:Joints", {"xmlns:joints": SPACE})
        for joint in system.joints:
            ET.SubElement(parent, "joints:Joint", attributes_of(joint))
    definitions.write(root, "ssd")
    ET.SubElement(root, "ssd:DefaultExperiment", {"startTime": "0.0", "stopTime": repr(system.stop_time)})
    return document(root)


def ssv(system: System) -> bytes:
    """The content of the parameter set; its names are COMPONENT.VARIABLE."""
    root, definitions = _root("ssv:ParameterSet", "parameters", system.version), _Definitions()
    parent = ET.SubElement(root, "ssv:Parameters")
    for end, value in system.values.items():
        connector = system.components[end.component].connectors[end.connector]
        parameter = ET.SubElement(parent, "ssv:Parameter", {"name": str(end)})
        written = {"value": _text(connector, value), **definitions.attributes(connector)}
        ET.SubElement(parameter, f"ssv:{_type(connector)}", written)
    definitions.write(root, "ssv")
    return document(root)


def _text(connector: Connector, value: float) -> str:
    """``value`` as a parameter set writes it: of an enumeration the name of its item, if it has one."""
    if _type(connector) in _FLOATS:
        return repr(value)
    if connector.enumerated is not None:
        return next((name for name, number in connector.enumerated.items if number == value), str(int(value)))
    return str(value != 0).lower() if _type(connector) == "Boolean" else str(int(value))


def _root(tag: str, name: str, version: str) -> ET.Element:
    spaces = {f"xmlns:{prefix}": uri for prefix, uri in _SPACES.items() if prefix in (tag[:3], "ssc")}
    return ET.Element(tag, {**spaces, "version": version, "name": name, "generationTool": f"lag2fmu {VERSION}"})


def _component(
    parent: ET.Element,
    component: Component,
    source: str,
    shown: Sequence[Connector],
    place: int,
    definitions: _Definitions,
) -> None:
    """Add a component with its outputs and its connected inputs, drawn beside the other components.

    Unconnected inputs are left out and keep their start values. Importers such as fmpy would set them to 0.
    """
    controller = component.controller
    kind = {"type": PYTHON} if controller else {"type": FMU, "implementation": component.kind}
    element = ET.SubElement(parent, "ssd:Component", {"name": component.name, "source": source, **kind})
    sides = {side: [c for c in shown if (c.causality != "output") == (side == "0.0")] for side in ("0.0", "1.0")}
    if shown:
        connectors = ET.SubElement(element, "ssd:Connectors")
    for side, listed in sides.items():
        for row, c in enumerate(listed):
            named = {"name": c.name, "kind": c.causality}
            connector = ET.SubElement(connectors, "ssd:Connector", named)
            ET.SubElement(connector, f"ssc:{_type(c)}", definitions.attributes(c))
            for size in c.sizes:
                ET.SubElement(connector, "ssc:Dimension", {"size": size} if size else {})
            height = 1.0 - (row + 1) / (len(listed) + 1)
            ET.SubElement(connector, "ssd:ConnectorGeometry", {"x": side, "y": f"{height:.4g}"})
    left = place * (_WIDTH + _GAP)
    top = _ROW * (1 + max(map(len, sides.values())))
    box = {"x1": left, "y1": 0.0, "x2": left + _WIDTH, "y2": top}
    ET.SubElement(element, "ssd:ElementGeometry", {key: repr(x) for key, x in box.items()})
    if controller is not None:
        annotation = ET.SubElement(ET.SubElement(element, "ssd:Annotations"), "ssc:Annotation", {"type": FUNCTION})
        said = {"function": controller.label, "sampleTime": repr(controller.sample_time)}
        ET.SubElement(annotation, "controller", said)


def _check_version(system: System) -> None:
    """Raise ExportError for a connector that is new in version 2.0 where an earlier one is written."""
    if system.version != VERSIONS[0]:
        return
    for name, component in system.components.items():
        for c in component.connectors.values():
            used = any(End(name, c.name) in connection[:2] for connection in system.connections)
            if (c.sizes or _type(c) in _SINCE_2) and (used or c.causality == "output"):
                what = "an array" if c.sizes else f"of type {c.type}"
                raise ExportError(
                    f"{name}.{c.name} is {what}, which SSP {VERSIONS[0]} does not know; write version {VERSIONS[1]}"
                )


def _type(connector: Connector) -> str:
    """The element of the connector's type. Scalars of FMI 3.0 get the names that SSP 1.0 knows, too."""
    scalar = {"Float64": "Real", "Int32": "Integer"}
    return scalar.get(connector.type, connector.type) if not connector.sizes else connector.type
