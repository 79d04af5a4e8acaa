"""The variables on which each calculated variable of an FMU depends, by the structure of its equations."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from lag2fmu.description import names
from lag2fmu.dynamics.blocks import united
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.massless import continuous_states
from lag2fmu.dynamics.variables import integrated_states
from lag2fmu.graph.graph import Graph, Node


def dependencies(equations: EquationsOfMotion) -> dict[str, frozenset[str]]:
    """{variable: names of states, inputs, parameters and time on which it depends}.

    The variables are states, derivatives, and everything that is calculated. A state among the outputs depends on
    itself. Multipliers and coordinates without mass are no states, so they are replaced by the variables on which they
    depend. Source: FMI 2.0.5 specification, section 2.2.8 (ModelStructure).
    """
    graph = equations.graph
    states, following = _states(equations)
    blocks, everything = _blocks(equations)
    known = {name: _without(found, following) for name, found in blocks.items()} | following
    found = {name: _without(used, known) for name, used in _symbols(graph, equations.locals())}
    found |= {name: frozenset(used) for name, used in _symbols(graph, equations.dependent.items())}
    found |= known
    found |= _derivatives(equations, known)
    if len(equations.rows):
        found[names.derivative(names.DISSIPATED_ENERGY)] = everything
    found |= {state: frozenset([state]) for state in states}
    return _named(equations, found)


def _symbols(graph: Graph, named: Iterable[tuple[str, Node]]) -> Iterator[tuple[str, set[str]]]:
    """(name, variables that its node depends on) of ``named`` nodes."""
    found = tuple(named)
    return zip((name for name, _ in found), graph.symbols_of_each([[node] for _, node in found]), strict=True)


def start_dependencies(equations: EquationsOfMotion) -> dict[str, frozenset[str]]:
    """{state: names on which its value at the start depends} of the states that constraints with mass may move there.

    Starts that are all given, but miss the constraints by little, are moved: each by all of those that its constraints
    tie it to.
    """
    states, following = _states(equations)
    tied = _solved(equations, states, massless=False)
    return _named(equations, {name: _without(uses, following) for name, uses in tied.items()})


def _named(equations: EquationsOfMotion, found: Mapping[str, frozenset[str]]) -> dict[str, frozenset[str]]:
    """The same by names of variables of the FMU: rates of inputs are none."""
    moving = {str(equations.graph.leaf[rate]) for rate in equations.variables.rates}
    return {name: frozenset("time" if used == "t" else used for used in uses - moving) for name, uses in found.items()}


def _states(equations: EquationsOfMotion) -> tuple[list[str], dict[str, frozenset[str]]]:
    """The continuous states, and {name: its dependencies} of coordinates and velocities that are no states."""
    m = equations.mechanism
    coordinates = [q.name for q in m.coordinates]
    x = [*coordinates, *map(names.velocity, coordinates), *(state.name for state in integrated_states(m))]
    states = [x[i] for i in continuous_states(m)]
    return states, _solved(equations, {*x} - {*states}, massless=True)


def _blocks(equations: EquationsOfMotion) -> tuple[dict[str, frozenset[str]], frozenset[str]]:
    """{unknown: names that it depends on} of accelerations, multipliers and forces along rows; all these names."""
    m = equations.mechanism
    unknowns = (
        *(names.acceleration(q.name) for q in m.coordinates),
        *(names.multiplier(c.name) for c in m.constraints),
    )
    found = dict(zip(unknowns, equations.unknown_dependencies(), strict=True))
    everything = frozenset().union(*found.values(), equations.rows.symbols(equations.graph))
    if len(equations.rows):  # impacts and modes make everything depend on everything
        found = dict.fromkeys((*unknowns, *equations.forces), everything)
    return found, everything


def _derivatives(equations: EquationsOfMotion, known: Mapping[str, frozenset[str]]) -> dict[str, frozenset[str]]:
    """{derivative of a state: names that it depends on}; ``known`` are those of unknowns."""
    found = {}
    for q in (coordinate.name for coordinate in equations.mechanism.coordinates):
        found[names.derivative(q)] = _without([names.velocity(q)], known)
        found[names.derivative(names.velocity(q))] = known[names.acceleration(q)]
    further = (state.name for state in integrated_states(equations.mechanism))
    rates = zip(further, equations.variables.further_rates, strict=False)
    return found | {names.derivative(x): _without(equations.graph.symbols([node]), known) for x, node in rates}


def _solved(equations: EquationsOfMotion, wanted: Iterable[str], *, massless: bool) -> dict[str, frozenset[str]]:
    """{name: variables that it depends on} of the ``wanted`` coordinates and velocities that constraints determine.

    They are all the variables in the equations that determine the coordinate or velocity: constraints of coordinates
    that are ``massless``, or the others, which move all that they tie from where it is. Coordinates are solved for
    first, those of one equation together, and then velocities. Rates of inputs are left out, because they are no
    variables of the FMU.
    """
    graph, m, c = equations.graph, equations.mechanism, equations.constraints
    wanted = {*wanted}
    found: dict[str, frozenset[str]] = {}
    coordinates = [q.name for q in m.coordinates]
    rows = [k for k, constraint in enumerate(m.constraints) if bool(constraint.massless) == massless]
    rates = {str(graph.leaf[rate]) for rate in equations.variables.rates}
    for level, nodes in (
        (coordinates, [c.positions[k] for k in rows if k < len(c.positions)]),
        (map(names.velocity, coordinates), [c.velocities[k] for k in rows]),
    ):
        unknowns = wanted.intersection(level)
        uses = [graph.symbols([node]) - rates for node in nodes]
        determined: dict[str, frozenset[str]] = {}
        for tied in united(map(unknowns.intersection, uses)):
            others = [used.difference(unknowns if massless else ()) for used in uses if used & tied]
            solved = frozenset().union(*(_without(rest, found) for rest in others))
            determined |= dict.fromkeys(sorted(tied), solved)
        found |= determined
    return found


def _without(found: Iterable[str], known: Mapping[str, frozenset[str]]) -> frozenset[str]:
    """``found`` with the names in ``known`` replaced by what they depend on."""
    return frozenset().union(*(known.get(name, {name}) for name in found))
