"""What each calculated variable of an FMU depends on, by the structure of the equations (FMI 2.0.5, section 2.2.8)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from lag2fmu.description import names
from lag2fmu.dynamics import EquationsOfMotion
from lag2fmu.dynamics.massless import continuous_states
from lag2fmu.dynamics.variables import further_states


def dependencies(equations: EquationsOfMotion) -> dict[str, frozenset[str]]:
    """{variable: names of states, inputs, parameters and time} of states, derivatives and all that is calculated.

    A state among the outputs depends on itself. Multipliers and coordinates without mass are no states, so they are
    replaced by the variables that they depend on.
    Source: FMI 2.0.5, section 2.2.8 (ModelStructure).
    """
    graph, m = equations.graph, equations.mechanism
    unknowns = (
        *(names.acceleration(q.name) for q in m.coordinates),
        *(names.multiplier(c.name) for c in m.constraints),
    )
    x = [q.name for q in m.coordinates] + [names.velocity(q.name) for q in m.coordinates]
    further = [state.name for state in further_states(m)]
    x += further
    states = [x[i] for i in continuous_states(m)]
    following = _following(equations, {*x} - {*states})
    blocks = dict(zip(unknowns, equations.unknown_dependencies(), strict=True))
    blocks = {name: _without(found, following) for name, found in blocks.items()}
    known = blocks | following
    found = {name: _without(graph.symbols([node]), known) for name, node in equations.locals()}
    found |= {name: frozenset(graph.symbols([node])) for name, node in equations.dependent.items()}
    found |= known
    found |= {names.derivative(q.name): _without([names.velocity(q.name)], known) for q in m.coordinates}
    found |= {names.derivative(names.velocity(q.name)): blocks[names.acceleration(q.name)] for q in m.coordinates}
    rates = zip(further, equations.variables.further_rates, strict=True)
    found |= {names.derivative(name): _without(graph.symbols([node]), known) for name, node in rates}
    found |= {state: frozenset([state]) for state in states}
    return {name: frozenset("time" if used == "t" else used for used in uses) for name, uses in found.items()}


def _following(equations: EquationsOfMotion, massless: Iterable[str]) -> dict[str, frozenset[str]]:
    """{name: variables that it depends on} of the coordinates and velocities ``massless``.

    These are all the variables in the equations that determine them. The coordinates are solved for first, those of one
    equation together, and then the velocities. Rates of inputs are left out, for they are no variables of the FMU.
    """
    graph, m, c = equations.graph, equations.mechanism, equations.constraints
    wanted = {*massless}
    found: dict[str, frozenset[str]] = {}
    positions = [q.name for q in m.coordinates if q.name in wanted]
    velocities = [v for q in m.coordinates if (v := names.velocity(q.name)) in wanted]
    rows = [k for k, constraint in enumerate(m.constraints) if constraint.massless]
    for unknowns, nodes in (
        (positions, [c.positions[k] for k in rows if k < len(c.positions)]),
        (velocities, [c.velocities[k] for k in rows]),
    ):
        groups: list[tuple[set[str], frozenset[str]]] = []
        for node in nodes:
            used = graph.symbols([node]) - {str(graph.leaf[rate]) for rate in equations.variables.rates}
            tied, rest = used & {*unknowns}, _without(used - {*unknowns}, found)
            joined = [group for group in groups if group[0] & tied]
            groups = [group for group in groups if not group[0] & tied]
            groups.append((tied.union(*(g[0] for g in joined)), rest.union(*(g[1] for g in joined))))
        found |= {name: rest for tied, rest in groups for name in sorted(tied)}
    return found


def _without(found: Iterable[str], known: Mapping[str, frozenset[str]]) -> frozenset[str]:
    """``found`` with the names in ``known`` replaced by what they depend on."""
    return frozenset().union(*(known.get(name, {name}) for name in found))
