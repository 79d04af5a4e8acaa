"""FMI 3.0: modelDescription.xml by the rules of FMI 3.0.2, sections 2.4, 3.4 and 4.4."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from lag2fmu.fmu.elements import ENUMERATIONS
from lag2fmu.fmu.event_variables import CLOCK
from lag2fmu.fmu.model_description import Interface, ModelDescription, heeds_steps
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.fmu.structure import Unknown
from lag2fmu.fmu.versions.shared import (
    add_categories,
    add_experiment,
    add_units,
    head,
    number_attributes,
    unit_attributes,
)
from lag2fmu.fmu.versions.version import CATEGORIES, Version
from lag2fmu.fmu.xml_text import document

if TYPE_CHECKING:
    from lag2fmu.fmu.ports import Port

_DERIVATIVES = {"providesDirectionalDerivatives": "true", "providesAdjointDerivatives": "true"}
INTERFACE = Interface(
    capabilities={
        "ModelExchange": _DERIVATIVES,
        "CoSimulation": {
            **_DERIVATIVES,
            "canHandleVariableCommunicationStepSize": "true",
            "maxOutputDerivativeOrder": "2",
            "recommendedIntermediateInputSmoothness": "3",
            "providesIntermediateUpdate": "true",
            "mightReturnEarlyFromDoStep": "true",
            "canReturnEarlyAfterIntermediateUpdate": "true",
            "hasEventMode": "true",
        },
    },
    log_categories=CATEGORIES,
)
_TYPES = {"Real": "Float64", "Integer": "Int32", CLOCK: "Clock"}
"""The elements of variables by the type of the variable table; those of other types are enumerations."""
_INTERMEDIATE = ("input", "output", "local")
"""The causalities of variables that can be read or set in intermediate update mode, if they are continuous."""


def to_xml(description: ModelDescription) -> bytes:
    """modelDescription.xml, UTF-8: values in SI units with the user's unit as displayUnit; FMI 3.0.2, section 2.4."""
    root = ET.Element(
        "fmiModelDescription",
        {
            "fmiVersion": "3.0",
            "modelName": description.mechanism.title,
            "instantiationToken": description.guid,
            **head(description),
        },
    )
    _capabilities(root, description)
    add_units(root, description.variables)
    _types(root, description.variables)
    add_categories(root, description)
    add_experiment(root, description)
    variables = ET.SubElement(root, "ModelVariables")
    reference = {v.name: str(i) for i, port in enumerate(description.ports) for v in port.members}
    mechanism = description.mechanism
    jumps = bool(mechanism.unilaterals or mechanism.latches or mechanism.constraints)
    updates = "providesIntermediateUpdate" in description.interface.capabilities["CoSimulation"]
    for i, port in enumerate(description.ports):
        _variable(variables, port, str(i), reference, jumps, updates)
    _structure(root, description.ports)
    return document(root)


def _capabilities(root: ET.Element, description: ModelDescription) -> None:
    common = {
        "modelIdentifier": description.model_identifier,
        "canGetAndSetFMUState": "true",
        "canSerializeFMUState": "true",
    }
    for kind, offered in description.interface.capabilities.items():
        heeds = kind == "ModelExchange" and heeds_steps(description)
        needs = {"needsCompletedIntegratorStep": "true"} if heeds else {}
        ET.SubElement(root, kind, {**common, **offered, **needs})


def _types(root: ET.Element, variables: Iterable[ScalarVariable]) -> None:
    """TypeDefinitions of the enumerations in use, if any (section 2.4.4)."""
    used = sorted({v.type for v in variables} & {*ENUMERATIONS})
    if not used:
        return
    definitions = ET.SubElement(root, "TypeDefinitions")
    for name in used:
        parent = ET.SubElement(definitions, "EnumerationType", {"name": name, "description": ENUMERATIONS[name].doc})
        for item, (value, doc) in ENUMERATIONS[name].items.items():
            ET.SubElement(parent, "Item", {"name": item, "value": str(value), "description": doc})


# --------------------------------------------------------------------------------------------------------- variables


def _variable(
    parent: ET.Element, port: Port, reference: str, references: Mapping[str, str], jumps: bool, updates: bool
) -> None:
    """The element of ``port`` with its value ``reference``; ``jumps``: states may change at events.

    ``updates``: there are intermediate updates.
    """
    one = port.one
    doc = _array_doc(port) if port.is_array else one.doc
    attributes = {"name": port.name, "valueReference": reference} | ({"description": doc} if doc else {})
    attributes |= {"causality": one.causality, "variability": one.variability}
    attributes |= {} if one.initial is None else {"initial": one.initial}
    attributes |= _of_type(port, references)
    attributes |= {"reinit": "true"} if one.state and jumps else {}
    if updates and one.causality in _INTERMEDIATE and one.variability == "continuous":
        attributes["intermediateUpdate"] = "true"
    element = ET.SubElement(parent, _TYPES.get(one.type, "Enumeration"), attributes)
    if port.is_array:
        ET.SubElement(element, "Dimension", {"start": str(len(port.members))})
    for name, text in port.aliases.items():
        ET.SubElement(element, "Alias", {"name": name, "description": text})


def _of_type(port: Port, references: Mapping[str, str]) -> dict[str, str]:
    """The attributes that variables of the type of ``port`` have."""
    kind = port.one.type
    if kind == "Real":
        return _real(port, references)
    if kind == "Integer":
        return {} if port.one.minimum is None else {"min": str(int(port.one.minimum))}
    return {"intervalVariability": "triggered"} if kind == CLOCK else {"declaredType": kind}


def _array_doc(port: Port) -> str:
    """The names of the elements, with their units where these differ."""
    units = [v.unit.si_name if v.unit is not None else "" for v in port.members]
    named = [f"{v.name} in {unit}" if unit else v.name for v, unit in zip(port.members, units, strict=True)]
    return ", ".join(named if len({*units}) > 1 else [v.name for v in port.members])


def _real(port: Port, references: Mapping[str, str]) -> dict[str, str]:
    """The attributes of <Float64>. Those in which elements differ are left out; bounds of an array hold for all."""
    units = {v.unit for v in port.members}
    real = unit_attributes(units.pop()) if len(units) == 1 else {}
    low, high = _hull(port)
    nominals = {v.nominal for v in port.members}
    nominal = nominals.pop() if len(nominals) == 1 else None
    real |= number_attributes(min=low, max=high, nominal=None if nominal == 1.0 else nominal)
    starts = [v.start for v in port.members if v.start is not None]
    real |= {"start": " ".join(repr(float(x)) for x in starts)} if starts else {}
    derivative_of = port.one.derivative_of
    return real | ({} if derivative_of is None else {"derivative": references[derivative_of]})


def _hull(port: Port) -> tuple[float | None, float | None]:
    """The range that contains those of all elements; None where one of them has no bound."""
    lows = [v.minimum for v in port.members if v.minimum is not None]
    highs = [v.maximum for v in port.members if v.maximum is not None]
    count = len(port.members)
    return min(lows) if len(lows) == count else None, max(highs) if len(highs) == count else None


# --------------------------------------------------------------------------------------------------------- structure


def _structure(root: ET.Element, ports: Sequence[Port]) -> None:
    """ModelStructure (section 2.4.8). Indicators are no unknowns at initialization."""
    from lag2fmu.fmu.ports import port_structure

    found = port_structure(ports)
    indicators = {port.name for port in ports if port.kind == "VARIABLE_INDICATOR"}
    parent = ET.SubElement(root, "ModelStructure")
    reference = {port.name: str(i) for i, port in enumerate(ports)}
    for tag, unknowns in (
        ("Output", found.outputs),
        ("ContinuousStateDerivative", found.derivatives),
        ("InitialUnknown", found.initial),
        ("EventIndicator", [unknown for unknown in found.calculated if unknown.name in indicators]),
    ):
        for unknown in unknowns:
            ET.SubElement(parent, tag, {"valueReference": reference[unknown.name]} | _uses(unknown, reference))


def _uses(unknown: Unknown, reference: Mapping[str, str]) -> dict[str, str]:
    """The attributes dependencies and, where all enter with a constant factor, dependenciesKind."""
    listed = unknown.dependencies or ()
    kinds = {"dependenciesKind": " ".join("constant" for _ in listed)} if unknown.constant and listed else {}
    return {"dependencies": " ".join(reference[name] for name in listed)} | kinds


FMI3 = Version(
    "3.0",
    "fmi3",
    INTERFACE,
    to_xml,
    folders=lambda platform: platform.tuples,
    icon="terminalsAndIcons/icon.png",
    has_ports=True,
    has_adjoints=True,
)
