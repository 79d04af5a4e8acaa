"""From the description of a system to its network: FMUs, and what each of their inputs hears.

Systems within a system, their connectors and signal dictionaries are followed from end to end and are gone then.
Source: System Structure and Parameterization 2.0, Modelica Association 2024, section 5.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from lag2fmu.errors import LoadError
from lag2fmu.systems.components import Component
from lag2fmu.systems.connections import End
from lag2fmu.systems.joints import Ends, ends_of
from lag2fmu.systems.parameters import number, units_of
from lag2fmu.systems.reading import Node, Reading, root_of, said, whole_of
from lag2fmu.systems.source import source_of
from lag2fmu.systems.wires import SAME, Affine, Transformation, Wire, conversion
from lag2fmu.xml_tree import XmlElement

_STEPS = {"FixedStepMaster": "stepSize", "FixedStepAlgorithm": "baseStepSize"}
"""{element of an annotation: its attribute with the step}, of OMSimulator and of the Open Simulation Platform."""


@dataclass(frozen=True)
class Network:
    """A system that can run.

    - ``components``: {name: FMU}; the name of one within a system in the system is SYSTEM.COMPONENT.
    - ``wires``: what inputs and parameters of components hear.
    - ``outputs``: {output of the system: (source, map)}; ``inputs``: the names of its inputs.
    - ``joints``: what ideal joints hold together.
    - ``values``: parameters and start values that the description gives, in the units of the FMUs, or texts.
    - ``start_time``, ``stop_time``: of the default experiment, in s; None where it says nothing.
    - ``step``: the communication step (s) that the tool which wrote the description has noted in it, or None.
    """

    name: str
    components: Mapping[str, Component]
    wires: tuple[Wire, ...]
    outputs: Mapping[str, tuple[End, Transformation]]
    inputs: tuple[str, ...]
    values: Mapping[End, float | str]
    start_time: float
    stop_time: float | None
    joints: tuple[Ends, ...] = ()
    step: float | None = None


@contextmanager
def network_of_file(path: Path) -> Iterator[Network]:
    """The network of the system ``path``, an .ssp or .ssd; its FMUs exist as files as long as the context.

    Raises LoadError for files, references, connections and parameters that do not fit.
    """
    with ExitStack() as opened:
        source = opened.enter_context(source_of(path))
        root = root_of(source)
        reader = Reading(opened)
        reader.read(whole_of(root, source), (), source, units_of(root), {})
        experiment = root.child("DefaultExperiment") or XmlElement("", {}, 0)
        times = [experiment.get(name) for name in ("startTime", "stopTime")]
        start, stop = (number(t, f"{source.label}: DefaultExperiment") if t else None for t in times)
        found = _Follower(reader, source.label).network(root.get("name"), start or 0.0, stop)
        yield replace(found, step=_noted_step(root, source.label))


def _noted_step(root: XmlElement, label: str) -> float | None:
    """The shortest communication step (s) in annotations of OMSimulator or OSP; None without one."""
    noted = [(e, e.get(_STEPS[e.tag])) for e in root.walk() if e.tag in _STEPS]
    return min((number(text, f"{label}: {e.tag}") for e, text in noted if text), default=None)


@dataclass(frozen=True)
class _Follower:
    """Follows connections from each variable of an FMU, and from each output of the system, to where they begin."""

    reader: Reading
    label: str

    def network(self, name: str, start: float, stop: float | None) -> Network:
        """All wires, values, inputs and outputs. Raises LoadError for ends that do not fit."""
        wires: list[Wire] = []
        values: dict[End, float | str] = {}
        for node in dict.fromkeys((*self.reader.heard, *self.reader.given)):
            if node[0] in self.reader.components:
                self._follow(node, wires, values)
        components = {component.name: component for component in self.reader.components.values()}
        return Network(
            name,
            components,
            tuple(wires),
            self._outputs(),
            tuple(dict.fromkeys(wire.source.connector for wire in wires if not wire.source.component)),
            values,
            start,
            stop,
            tuple(ends_of(joint, components, f"{self.label}: the joint {joint}") for joint in self.reader.joints),
        )

    def _follow(self, node: Node, wires: list[Wire], values: dict[End, float | str]) -> None:
        """Add the wire to a variable of an FMU, or the value that it is given."""
        reader, target = self.reader, _end(node)
        inner = conversion(f"{self.label}: {target}", reader.unit(node), reader.unit_inside(node))
        origin, map_ = self._origin(node)
        given, connector = reader.given.get(origin), reader.components[node[0]].connectors.get(node[1])
        if given is not None and (origin == node or origin[0] not in reader.components):
            items = connector.enumerated if connector is not None else None
            found = given.in_unit(reader.unit(origin)) if items is None else given.item_of(items)
            values[target] = found if isinstance(found, str) else inner.after(map_)(found)
        elif origin != node and (origin[0] in reader.components or origin[0] == ()):
            self._check_ends(origin, node)
            wires.append(Wire(_end(origin), target, inner.after(map_.after(self._outward(origin)))))

    def _outputs(self) -> dict[str, tuple[End, Transformation]]:
        """{output of the system: (variable of an FMU, what becomes of it)}."""
        found = {}
        for place, connector in self.reader.kinds:
            origin, map_ = self._origin((place, connector))
            if place == () and origin[0] in self.reader.components:
                found[connector] = _end(origin), map_.after(self._outward(origin))
        return found

    def _outward(self, node: Node) -> Affine:
        """From the unit of the FMU's variable to that of its connector."""
        return conversion(f"{self.label}: {said(node)}", self.reader.unit_inside(node), self.reader.unit(node))

    def _origin(self, node: Node) -> tuple[Node, Transformation]:
        """(where the value of ``node`` comes from, what becomes of it on its way).

        Raises LoadError for two connections to one connector, and for a circle of connections that passes no FMU.
        """
        map_: Transformation = SAME
        passed = {node}
        while heard := self.reader.heard.get(node):
            if len(heard) > 1:
                raise LoadError(f"{self.label}: {said(node)} is connected with {len(heard)} sources; it hears one")
            node, own = heard[0]
            map_ = map_.after(own)
            if node in passed:
                raise LoadError(f"{self.label}: the connections of {said(node)} lead back to it")
            passed.add(node)
        return node, map_

    def _check_ends(self, origin: Node, target: Node) -> None:
        """Raise LoadError unless an FMU gives as many numbers as the other one hears."""
        components = self.reader.components
        (place, name), (other, of_other) = origin, target
        heard = components[other].connectors[of_other]
        given = components[place].connectors.get(name) if place in components else None
        if given is not None and given.sizes != heard.sizes:
            where = f"{self.label}: the connection of {said(origin)} with {said(target)}"
            raise LoadError(f"{where}: the sizes {given.sizes} and {heard.sizes} must agree")


def _end(node: Node) -> End:
    return End(".".join(node[0]), node[1])
