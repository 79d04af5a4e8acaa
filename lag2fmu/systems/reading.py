"""What stands in the description of a system, and in those that it refers to: connectors, connections, parameters.

Source: System Structure and Parameterization 2.0, Modelica Association 2024, section 5.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace

from lag2fmu.errors import LoadError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.systems.components import (
    ANY,
    Component,
    Connector,
    EnumeratedType,
    LinearUnit,
    component_with,
    read_component,
)
from lag2fmu.systems.controller import FUNCTION, PYTHON, Controller
from lag2fmu.systems.joints import ANNOTATION, IdealJoint, read_joint
from lag2fmu.systems.parameters import Given, given_by, number, transformation, units_of
from lag2fmu.systems.source import Source, source_of
from lag2fmu.systems.structure import FMU, VERSIONS
from lag2fmu.systems.wires import SAME, Transformation, conversion
from lag2fmu.xml_tree import XmlElement

_SYSTEMS = ("application/x-ssp-definition", "application/x-ssp-package")
_DEEPEST = 20
"""The most systems within each other; a description that refers to itself ends there."""

_INWARD = ("input", "parameter", "structuralParameter")
"""The kinds of connectors that bring values into what they stand at; all others but those of _BOTH bring them out."""
_BOTH = ("inout", "unspecified", "")

Place = tuple[str, ...]
"""The names of the elements from the outermost system to an element."""
Node = tuple[Place, str]
"""A connector of the element at a place."""


def root_of(source: Source) -> XmlElement:
    """The root of a description; raises LoadError for what is none, or is of another version."""
    root = source.root()
    if root.tag != "SystemStructureDescription":
        raise LoadError(f"{source.label}: begins with <{root.tag}>; it is no system of SSP")
    if root.get("version") not in VERSIONS:
        raise LoadError(f"{source.label}: is of SSP {root.get('version')!r}; {' and '.join(VERSIONS)} are read")
    return root


def whole_of(root: XmlElement, source: Source) -> XmlElement:
    """The outermost system below ``root``; raises LoadError if there is none."""
    system = root.child("System")
    if system is None:
        raise LoadError(f"{source.label}: there is no System in it")
    return system


@dataclass
class Reading:
    """What stands in a description and in those that it refers to, by place."""

    opened: ExitStack
    components: dict[Place, Component] = field(default_factory=dict)
    systems: set[Place] = field(default_factory=set)
    kinds: dict[Node, str] = field(default_factory=dict)
    units: dict[Node, LinearUnit | None] = field(default_factory=dict)
    heard: dict[Node, list[tuple[Node, Transformation]]] = field(default_factory=dict)
    dictionaries: dict[Place, Place] = field(default_factory=dict)
    given: dict[Node, Given] = field(default_factory=dict)
    joints: list[IdealJoint] = field(default_factory=list)

    def read(
        self,
        system: XmlElement,
        place: Place,
        source: Source,
        units: Mapping[str, LinearUnit],
        known: Mapping[str, Place],
    ) -> None:
        """Read the ``system`` at ``place`` and what is in it; ``known`` {signal dictionary: its place}.

        What a system gives its elements counts more than what these give themselves, so that it comes later. Raises
        LoadError for what does not fit.
        """
        if len(place) > _DEEPEST:
            raise LoadError(f"{source.label}: there are more than {_DEEPEST} systems within each other")
        self.systems.add(place)
        known = {**known, **self._dictionaries(system, place, source, units)}
        self._connectors(system, place, units)
        for element in (e for group in system.all("Elements") for e in group.children):
            self._element(element, (*place, element.get("name")), source, units, known)
        self._bindings(system, place, source)
        for connection in system.all("Connections", "Connection"):
            self._connection(connection, place, source)
        notes = (x for x in system.all("Annotations", "Annotation") if x.get("type") == ANNOTATION)
        self.joints += [read_joint(x, place, source.label) for note in notes for x in note.all("Joints", "Joint")]

    def _element(
        self,
        element: XmlElement,
        place: Place,
        source: Source,
        units: Mapping[str, LinearUnit],
        known: Mapping[str, Place],
    ) -> None:
        if element.tag == "System":
            self.read(element, place, source, units, known)
        elif element.tag == "SignalDictionaryReference":
            name = element.get("dictionary")
            if name not in known:
                raise LoadError(f"{source.label}: there is no signal dictionary '{name}'; {suggestion(name, known)}")
            self.dictionaries[place] = known[name]
        elif element.tag == "Component":
            self._component(element, place, source, units)

    def _component(self, element: XmlElement, place: Place, source: Source, units: Mapping[str, LinearUnit]) -> None:
        kind, reference, name = element.get("type", FMU), element.get("source"), ".".join(place)
        named = replace(source, label=f"{source.label}: the component '{name}'")
        if kind in _SYSTEMS:
            inner = Source(named.file(reference), f"{source.label}:{reference}", source.within)
            if kind == _SYSTEMS[1] or inner.ssd.suffix == ".ssp":
                inner = self.opened.enter_context(source_of(inner.ssd))
            root = root_of(inner)
            self.read(whole_of(root, inner), place, inner, units_of(root), {})
        elif kind == FMU:
            kind = element.get("implementation") or ANY
            self.components[place] = read_component(name, named.file(reference), kind)
            self._connectors(element, place, units)
        elif kind == PYTHON:
            self.components[place] = _controller(element, name, named)
            self._connectors(element, place, units)
        else:
            raise LoadError(f"{named.label} is of type '{kind}', which is not run")
        self._bindings(element, place, source)

    def _connectors(self, element: XmlElement, place: Place, units: Mapping[str, LinearUnit]) -> None:
        for connector in element.all("Connectors", "Connector"):
            node = place, connector.get("name")
            self.kinds[node] = connector.get("kind")
            self.units[node] = _unit_of(connector, units)

    def _dictionaries(
        self, system: XmlElement, place: Place, source: Source, units: Mapping[str, LinearUnit]
    ) -> dict[str, Place]:
        """{name: place} of the signal dictionaries of the ``system``; their entries become nodes."""
        found = {}
        for dictionary in system.all("SignalDictionaries", "SignalDictionary"):
            name = dictionary.get("name")
            found[name] = (*place, f"dictionary {name}")
            reference = dictionary.get("source")
            written = source.xml(reference) if reference else dictionary.child("SignalDictionary") or dictionary
            own = {**units, **units_of(written)}
            for entry in written.all("DictionaryEntry"):
                self.units[found[name], entry.get("name")] = _unit_of(entry, own)
                self.kinds[found[name], entry.get("name")] = "inout"
        return found

    def _bindings(self, element: XmlElement, place: Place, source: Source) -> None:
        for binding in element.all("ParameterBindings", "ParameterBinding"):
            for name, given in given_by(binding, source):
                node = self._target(name, place)
                if node is None:
                    raise LoadError(f"{given.where} fits nothing in '{'.'.join(place) or 'the system'}'")
                self.given[node] = given

    def _target(self, name: str, place: Place) -> Node | None:
        """The node that the ``name`` of a parameter means at ``place``; None if there is none."""
        if place in self.components:
            component = self.components[place]
            return (place, name) if name in component.connectors or name in component.texts else None
        if (place, name) in self.kinds:
            return place, name
        head, _, rest = name.partition(".")
        inner = (*place, head)
        return self._target(rest, inner) if rest and (inner in self.components or inner in self.systems) else None

    def node(self, place: Place, connector: str, source: Source) -> Node:
        """The node of a connector; raises LoadError if there is none, or none that holds a number."""
        node = self.dictionaries.get(place, place), connector
        component = self.components.get(place)
        known = self.kinds if component is None else [(place, name) for name in component.connectors]
        if node not in known:
            named = ".".join((*place, connector))
            if component is not None and connector in component.texts:
                raise LoadError(f"{source.label}: '{named}' is a text; numbers are connected, texts are set")
            names = [".".join((*p, c)) for p, c in known]
            raise LoadError(f"{source.label}: there is no connector '{named}'; {suggestion(named, names)}")
        return node

    def _connection(self, connection: XmlElement, place: Place, source: Source) -> None:
        ends = []
        for side in ("start", "end"):
            element = connection.get(f"{side}Element")
            at = (*place, element) if element else place
            ends.append(self.node(at, connection.get(f"{side}Connector"), source))
        where = f"{source.label}: the connection of {said(ends[0])} with {said(ends[1])}"
        if connection.get("startIndices") or connection.get("endIndices"):
            raise LoadError(f"{where} has indices; whole connectors are connected here: leave the indices out")
        ends = self._in_flow(ends, place, where)
        own = transformation(connection, where, [self._items(node) for node in ends])
        keeps = connection.get("suppressUnitConversion") in ("true", "1")
        converted = SAME if keeps else conversion(where, self.unit(ends[0]), self.unit(ends[1]))
        self.heard.setdefault(ends[1], []).append((ends[0], own.after(converted)))

    def _in_flow(self, ends: list[Node], place: Place, where: str) -> list[Node]:
        """The ``ends`` of a connection of the system at ``place``, in the order in which the value goes.

        The kinds of the connectors tell it; the words start and end of the file do not. An input of an element hears,
        and an input of the system itself is heard by its elements. Source: SSP 2.0, section 5.3.2.
        """
        kinds = [self._kind(node) for node in ends]
        gives, hears = zip(*(_flow(k, own=node[0] == place) for k, node in zip(kinds, ends, strict=True)), strict=True)
        if gives[0] and hears[1]:
            return ends
        if gives[1] and hears[0]:
            return ends[::-1]
        told = " and ".join(f"{said(node)} is of kind {kind}" for kind, node in zip(kinds, ends, strict=True))
        raise LoadError(f"{where} passes nothing on: {told}; one end has to give what the other one hears")

    def _kind(self, node: Node) -> str:
        """The kind of a connector: the causality of the FMU's variable, else what the description says."""
        component = self.components.get(node[0])
        return component.connectors[node[1]].causality if component else self.kinds[node]

    def _items(self, node: Node) -> EnumeratedType | None:
        """What the numbers of an FMU's variable stand for; None for a connector of a system."""
        component = self.components.get(node[0])
        return component.connectors[node[1]].enumerated if component else None

    def unit(self, node: Node) -> LinearUnit | None:
        """The unit of a connector: the one that the description says, else that of the FMU's variable."""
        return self.units.get(node) or self.unit_inside(node)

    def unit_inside(self, node: Node) -> LinearUnit | None:
        """The unit of the FMU's variable; None for a connector of a system."""
        component = self.components.get(node[0])
        return component.connectors[node[1]].unit if component and node[1] in component.connectors else None


def _controller(element: XmlElement, name: str, source: Source) -> Component:
    """The Python function that an ``element`` describes; raises LoadError where it does not tell name and time.

    Messages begin with the label of the ``source``, which names the component.
    """
    said = next((a.child("controller") for a in element.all("Annotations", "Annotation")
                 if a.get("type") == FUNCTION), None) or XmlElement("", {}, 0)  # fmt: skip
    if not said.get("function"):
        raise LoadError(f"{source.label} has no annotation '{FUNCTION}' that tells the function and its sample time")
    file, time = source.file(element.get("source")), number(said.get("sampleTime"), source.label)
    connectors = {
        c.get("name"): Connector(c.get("name"), c.get("kind"), "Real", None, (), settable=c.get("kind") == "parameter")
        for c in element.all("Connectors", "Connector")
    }
    return component_with(name, Controller(f"{file}:{said.get('function')}", time), connectors)


def _flow(kind: str, *, own: bool) -> tuple[bool, bool]:
    """Whether a connector of a ``kind`` gives values, and whether it hears one; ``own``: of the system itself."""
    if kind in _BOTH:
        return True, True
    inward = kind in _INWARD
    return inward == own, inward != own


def _unit_of(element: XmlElement, units: Mapping[str, LinearUnit]) -> LinearUnit | None:
    """The unit in the type of a connector or of an entry of a dictionary; None if it has none."""
    named = [child.get("unit") for child in element.children if child.get("unit")]
    return units.get(named[0]) if named else None


def said(node: Node) -> str:
    """The name of a connector in messages."""
    return f"'{'.'.join((*node[0], node[1]))}'"
