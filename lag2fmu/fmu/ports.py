"""The variables of FMI 3.0, called ports: scalars with their aliases, and arrays of the coordinates.

The C code has the same slots as for FMI 2.0, and a port is a range of slots. Two ports may have the same slots, because
no value reference stands twice in FMI 3.0. The derivatives of qd, which are variables of their own in FMI 2.0, are
aliases of qdd here, and qdd has the attribute ``derivative``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from lag2fmu.codegen.tables import PortTable
from lag2fmu.description import names
from lag2fmu.fmu.builder import VariableTable
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.fmu.structure import KNOWN, Structure, Unknown, structure
from lag2fmu.mechanism.record import Mechanism


@dataclass(frozen=True)
class Port:
    """A variable of FMI 3.0: ``members`` are its elements, in slots of one ``kind`` from ``first`` on.

    ``is_array``: it has a dimension, of one element too. ``aliases`` are {name: description}.
    """

    name: str
    kind: str
    first: int
    members: tuple[ScalarVariable, ...]
    is_array: bool = False
    aliases: Mapping[str, str] = field(default_factory=dict)

    @property
    def one(self) -> ScalarVariable:
        """The first element, which shows what all elements have in common."""
        return self.members[0]


@dataclass(frozen=True)
class _Group:
    """A possible array: its name, the names of its elements, and the name of the array of their aliases."""

    name: str
    elements: tuple[str, ...]
    alias: str = ""


def ports_of(mechanism: Mechanism, table: VariableTable, *, arrays: bool) -> tuple[Port, ...]:
    """The ports of the variables of ``table`` in the order of their slots; a value reference is an index in it.

    With ``arrays`` coordinates, velocities, accelerations, forces and multipliers are arrays, as far as their elements
    are alike: see ``_can_join``.
    """
    ports = {port.name: port for port in _with_aliases(table)}
    for together in _groups(mechanism) if arrays else ():
        groups = [group for group in together if ports.keys() & {*group.elements}]
        if all(_can_join(group, ports) for group in groups):
            for group in groups:
                joined = _joined(group, [ports.pop(name) for name in group.elements])
                ports[joined.name] = joined
    return tuple(sorted(ports.values(), key=lambda port: (port.first, port.one.initial == "calculated")))


def _with_aliases(table: VariableTable) -> list[Port]:
    """A port for each variable that shares its slot with none before it, and aliases for those that do.

    An output has no alias, but a port beside it: CasADi 3.8 refuses outputs that are derivatives of states, as
    velocities are, and fmpy 0.3.32 counts aliases of outputs among the unknowns at initialization.
    """
    found: dict[int, Port] = {}
    beside: list[Port] = []
    for v in table.variables:
        kind, base = table.tables.slots[v.value_reference].kind, found.get(v.value_reference)
        if base is None:
            found[v.value_reference] = Port(v.name, kind, v.value_reference, (v,))
        elif base.one.causality == "output":
            beside.append(Port(v.name, kind, v.value_reference, (v,)))
        else:
            one = base.one._replace(derivative_of=v.derivative_of)
            found[v.value_reference] = replace(base, members=(one,), aliases={**base.aliases, v.name: v.doc})
    return [*found.values(), *beside]


def _groups(mechanism: Mechanism) -> list[list[_Group]]:
    """The possible arrays in lists; those of a list are made all or none, because one is the derivative of another."""
    q = tuple(c.name for c in mechanism.coordinates)
    qd, qdd = tuple(map(names.velocity, q)), tuple(map(names.acceleration, q))
    of_q, of_qd = names.derivative("q"), names.derivative("qd")
    motion = [
        _Group("q", q),
        _Group("qd", qd, of_q),
        _Group("qdd", qdd, of_qd),
        _Group(of_q, tuple(map(names.derivative, q))),
        _Group(of_qd, tuple(map(names.derivative, qd))),
    ]
    forces = _Group("Q", tuple(map(names.generalized_force, q)))
    multipliers = _Group("multiplier", tuple(names.multiplier(c.name) for c in mechanism.constraints))
    return [motion, [forces], [multipliers]]


def array_elements(mechanism: Mechanism) -> dict[str, tuple[str, ...]]:
    """{array: the scalars that it stands for} of all arrays that FMUs of ``mechanism`` may have, aliases among them."""
    groups = [group for together in _groups(mechanism) for group in together]
    return {group.name: group.elements for group in groups}


def _can_join(group: _Group, ports: Mapping[str, Port]) -> bool:
    """Whether the elements can be one variable: their slots are consecutive, and their attributes are equal.

    Attributes may differ: a coordinate without mass is no state, a start that constraints determine is a guess, some
    accelerations may be outputs. Then all elements of the group stay scalars. They also do if the name of the array is
    in use.
    """
    others = [port for name, port in ports.items() if name not in group.elements]
    taken = {name for port in others for name in (port.name, *port.aliases)}
    if taken & {group.name, group.alias} or not ports.keys() >= {*group.elements}:
        return False
    members = [ports[name] for name in group.elements]
    kinds = {(p.one.causality, p.one.variability, p.one.initial, p.one.state, len(p.aliases)) for p in members}
    first = members[0].first
    return len(kinds) == 1 and [p.first for p in members] == list(range(first, first + len(members)))


def _joined(group: _Group, elements: Sequence[Port]) -> Port:
    of = ", ".join(str(element.one.derivative_of) for element in elements)
    aliases = {group.alias: f"time derivatives of {of}"} if elements[0].aliases else {}
    members = tuple(element.one for element in elements)
    return Port(group.name, elements[0].kind, elements[0].first, members, True, aliases)


# ----------------------------------------------------------------------------------------------------- dependencies


def port_structure(ports: Sequence[Port]) -> Structure:
    """ModelStructure by the names of ports; an array has the dependencies of all its elements.

    An unknown that depends on everything lists all knowns, because CasADi 3.8 reads no FMU of FMI 3.0 that leaves a
    list out.
    """
    found = structure([v for port in ports for v in port.members], known_parameters=True)
    clocked = any("time" in (unknown.dependencies or ()) for unknown in found.calculated)
    candidates = [p for p in ports if p.kind != "VARIABLE_SETTING" and (clocked or p.one.causality != "independent")]
    knowns = [p.name for p in candidates if p.one.causality in KNOWN or p.one.state]
    exact = [p.name for p in candidates if p.one.causality in KNOWN or p.one.initial == "exact"]
    return Structure(
        _folded(found.outputs, ports, knowns),
        _folded(found.derivatives, ports, knowns),
        _folded(found.initial, ports, exact),
        _folded(found.calculated, ports, knowns),
    )


def _folded(unknowns: Sequence[Unknown], ports: Sequence[Port], everything: Sequence[str]) -> tuple[Unknown, ...]:
    """The unknowns of ``ports`` among ``unknowns``, which are those of their elements."""
    place = {v.name: i for i, port in enumerate(ports) for v in port.members}
    found: dict[int, list[Unknown]] = {}
    for unknown in unknowns:
        found.setdefault(place[unknown.name], []).append(unknown)

    def joined(i: int, elements: Sequence[Unknown]) -> Unknown:
        uses = [element.dependencies for element in elements]
        if None in uses:
            return Unknown(ports[i].name, tuple(everything))
        listed = sorted({place[used] for use in uses for used in use or ()})
        constant = all(element.constant for element in elements)
        return Unknown(ports[i].name, tuple(ports[k].name for k in listed), constant)

    return tuple(joined(i, elements) for i, elements in found.items())


def port_table(ports: Sequence[Port]) -> PortTable:
    """The ports and their dependencies as a table for the C code."""
    index = {port.name: i for i, port in enumerate(ports)}
    uses = {unknown.name: unknown for unknown in port_structure(ports).calculated}
    dependencies = []
    for port in ports:
        unknown = uses.get(port.name)
        listed = () if unknown is None else unknown.dependencies or ()
        dependencies.append(tuple((index[name], unknown is not None and unknown.constant) for name in listed))
    firsts = [port.first for port in ports]
    rows = ((p.name, p.first, len(p.members), p.first in firsts[:i]) for i, p in enumerate(ports))
    return PortTable(tuple(rows), tuple(dependencies))
