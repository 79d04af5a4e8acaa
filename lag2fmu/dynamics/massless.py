"""Coordinates without mass: the forces on them are in equilibrium at every instant.

Where M has a null vector n(q) that no constraint restricts, M qdd = forcing says n . forcing = 0, an equation without
accelerations. If it has no velocities either, it ties the coordinates like a holonomic constraint. With velocities,
which friction brings in, it is like a nonholonomic one. Its multiplier is zero by itself, because motion along n takes
no energy. The mechanism gets these equations as constraints; the rest of the derivation treats them like all others.
Source: P. Rabier, W. Rheinboldt, Nonholonomic Motion of Rigid Mechanical Systems from a DAE Viewpoint, SIAM 2000,
chapter 5, for equations of motion with a singular mass matrix.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.parts import Constraint
from lag2fmu.dynamics.elimination import null_vectors
from lag2fmu.dynamics.parts import Entries, Variables
from lag2fmu.dynamics.variables import integrated_states
from lag2fmu.errors import DerivationError
from lag2fmu.graph.autodiff import forward
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.to_sympy import tidy, written, written_operations
from lag2fmu.mechanism.name_check import check_names
from lag2fmu.mechanism.record import Mechanism

_LONG = 300
"""Expressions with more operations are not simplified."""

_PREFERENCE = {True: 0, None: 1, False: 2}
"""Rank of a coordinate by whether its start is given. An equation is solved for the coordinate of highest rank."""

MOST_SHOWN = 50
"""Forces with more operations are not written out in an error."""


def with_equilibria(
    mechanism: Mechanism, graph: Graph, v: Variables, entries: Entries, forcing: tuple[Node, ...]
) -> Mechanism:
    """``mechanism`` with an equation of equilibrium for every null vector of M; itself if there is none.

    ``entries`` is the quadratic form of T over the velocity graph, ``forcing`` (n,) are nodes of the same graph. Each
    equation is solved for one coordinate; where there is a choice, for one whose start is a guess. This coordinate
    loses its own start value; if the equation contains velocities, it loses its start velocity instead. Raises
    DerivationError for an equation that determines no coordinate, MechanismError for a name of the user that an
    equilibrium takes. Source: P. Rabier, W. Rheinboldt, Nonholonomic Motion of Rigid Mechanical Systems from a DAE
    Viewpoint, SIAM 2000, chapter 5.
    """
    order = sorted(range(len(v.qd)), key=lambda i: _PREFERENCE[mechanism.coordinates[i].given])
    found = null_vectors(graph, entries, [v.qd[i] for i in order])
    if not found:
        return mechanism
    equilibria: list[Constraint] = []
    coordinates = list(mechanism.coordinates)
    left = order[::-1]
    for last, vector in found.items():
        direction = dict(zip([v.qd[i] for i in order], vector, strict=True))
        moved = [i for i in left if direction[v.qd[i]] != graph.zero]
        force = graph.dot([direction[velocity] for velocity in v.qd], forcing)
        name = coordinates[v.qd.index(last)].name
        i, equilibrium = _equilibrium(mechanism, graph, v, name, force, direction, moved)
        left.remove(i)
        equilibria.append(equilibrium)
        given = False if equilibrium.holonomic else coordinates[i].given
        coordinates[i] = replace(coordinates[i], given=given, velocity_given=False)
    completed = mechanism.with_equilibria(equilibria, coordinates)
    check_names(completed)
    return completed


def determined(mechanism: Mechanism) -> tuple[int | None, ...]:
    """For each of the m constraints the index of the coordinate without mass that it determines, else None: (m,)."""
    place = {q.name: i for i, q in enumerate(mechanism.coordinates)}
    return tuple(None if c.coordinate is None else place[c.coordinate] for c in mechanism.constraints)


def continuous_states(mechanism: Mechanism) -> tuple[int, ...]:
    """The indices in x of the continuous states: all entries but those that equilibria determine.

    x is (q, qd), and behind them stand the further states.
    """
    n = len(mechanism.coordinates)
    pairs = list(zip(mechanism.constraints, determined(mechanism), strict=True))
    following = {i for c, i in pairs if c.holonomic} | {n + i for _, i in pairs if i is not None}
    return tuple(i for i in range(2 * n + len(integrated_states(mechanism))) if i not in following)


def _shortest(expression: sp.Expr) -> sp.Expr:
    """``expression``, or its form after multiplying out and cancelling if that is shorter."""
    if expression.count_ops() > _LONG:
        return expression
    return min(expression, tidy(expression), key=lambda e: e.count_ops())


def _waits_for_accelerations(graph: Graph, v: Variables, force: Node) -> bool:
    """Whether the rate of ``force`` contains accelerations or multipliers, through the rates of further states.

    The further states are those in ``force``, and those in the rates of such states.
    """
    rates = dict(zip(v.further, v.further_rates, strict=True))
    met: set[Node] = set()
    left = [force]
    while left:
        cone = set(graph.cone([left.pop()]))
        if met and cone & set(v.unknowns):
            return True
        new = (cone & rates.keys()) - met
        met |= new
        left += [rates[z] for z in new]
    return False


def _equilibrium(
    mechanism: Mechanism,
    graph: Graph,
    v: Variables,
    name: str,
    force: Node,
    direction: dict[Node, Node],
    moved: Sequence[int],
) -> tuple[int, Constraint]:
    """The constraint ``force`` = 0, and the index of the coordinate that it determines.

    This is the first of the coordinates ``moved`` that the equation can be solved for. ``direction`` {velocity: rate}
    is the motion without mass, ``name`` the coordinate that it goes along.
    """
    where = f"mechanism '{mechanism.name}': the motion along {name} has no mass, and the force on it"
    remedy = "give what moves there a mass or inertia, or leave out coordinates"
    moving = v.moves(graph, force)
    along = direction if moving else {q: direction[qd] for q, qd in zip(v.q, v.qd, strict=True)}
    (slope,) = forward(graph, [force], along)
    if _waits_for_accelerations(graph, v, force):
        raise DerivationError(
            f"{where} depends on a further state whose derivative contains what constraints bear, which is not "
            f"supported; {remedy}"
        )
    kind, unknowns = ("damped_equilibrium", v.qd) if moving else ("equilibrium", v.q)
    solvable = [i for i in moved if forward(graph, [force], {unknowns[i]: graph.one}) != [graph.zero]]
    shown = _shown(graph, force)
    if slope == graph.zero or not solvable:
        what = "velocity" if moving else "coordinate"
        raise DerivationError(f"{where} depends on no {what} along it: it is {shown}; {remedy}")
    if moving and v.moves(graph, slope):
        raise DerivationError(f"{where}, {shown}, is not affine in the velocities, which is not supported; {remedy}")
    solved = solvable[0]
    expression = _shortest(written(graph, [force])[0])
    return solved, Constraint(names.massless(mechanism.coordinates[solved].name), expression, kind)


def _shown(graph: Graph, force: Node) -> str:
    """``force`` for a message: written out if it is short, else its number of operations, which may be millions."""
    count = written_operations(graph, [force])
    return str(_shortest(written(graph, [force])[0])) if count <= MOST_SHOWN else f"a formula of {count} operations"
