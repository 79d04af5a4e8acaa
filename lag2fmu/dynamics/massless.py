"""Coordinates without mass: the forces on them are in equilibrium at every instant.

Where M has a null vector n(q) that no constraint restricts, M qdd = forcing says n . forcing = 0: an equation without
accelerations. Without velocities it ties the coordinates like a holonomic constraint, with velocities (friction on what
has no mass) like a nonholonomic one; the force that keeps to it is zero by itself, n being the direction of the motion
that costs nothing. The mechanism gets these equations as constraints; everything else follows.
Source: P. Rabier, W. Rheinboldt, Nonholonomic Motion of Rigid Mechanical Systems from a DAE Viewpoint, SIAM 2000,
chapter 5, for equations of motion with a singular mass matrix.
"""

from __future__ import annotations

from dataclasses import replace

from lag2fmu.dynamics.autodiff import forward
from lag2fmu.dynamics.elimination import Entries, null_vectors
from lag2fmu.dynamics.graph import Graph
from lag2fmu.dynamics.variables import Variables
from lag2fmu.dynamics.written import written
from lag2fmu.errors import DerivationError
from lag2fmu.mechanism import Constraint, Mechanism, names

_PREFERENCE = {True: 0, None: 1, False: 2}
"""The later a coordinate comes, by whether its start is given, the rather it is solved for."""


def with_equilibria(
    mechanism: Mechanism, graph: Graph, v: Variables, entries: Entries, forcing: tuple[int, ...]
) -> Mechanism:
    """``mechanism`` with an equation of equilibrium for every null vector of M; itself if there is none.

    ``entries`` are the quadratic form of T over the velocity graph, ``forcing`` (n,) at the same graph. The coordinate
    that each equation is solved for has no start value of its own; of several, it is one whose start is a guess.
    Raises DerivationError for an equation that determines no coordinate.
    """
    order = sorted(range(len(v.qd)), key=lambda i: _PREFERENCE[mechanism.coordinates[i].given])
    found = null_vectors(graph, entries, [v.qd[i] for i in order])
    equilibria, solved = [], set()
    for last, vector in found.items():
        coordinate = mechanism.coordinates[v.qd.index(last)]
        by_velocity = dict(zip([v.qd[i] for i in order], vector, strict=True))
        force = graph.dot([by_velocity[velocity] for velocity in v.qd], forcing)
        equilibria.append(_equilibrium(mechanism, graph, v, coordinate.name, force, by_velocity))
        solved.add(coordinate.name)
    coordinates = [
        replace(q, given=False, velocity_given=False) if q.name in solved else q for q in mechanism.coordinates
    ]
    if not equilibria:
        return mechanism
    constraints = [*mechanism.constraints, *equilibria]
    return replace(mechanism, coordinates=coordinates, constraints=constraints)  # type: ignore[arg-type]


def _equilibrium(
    mechanism: Mechanism, graph: Graph, v: Variables, coordinate: str, force: int, direction: dict[int, int]
) -> Constraint:
    """``force`` = 0 as a constraint; ``direction`` {velocity: rate} is the motion without mass."""
    where = f"mechanism '{mechanism.name}': the motion along {coordinate} has no mass, and the force on it"
    remedy = "give what moves there a mass or inertia, or leave out coordinates"
    moving = v.moves(graph, force)
    along = direction if moving else {q: direction[qd] for q, qd in zip(v.q, v.qd, strict=True)}
    (slope,) = forward(graph, [force], along)
    if slope == graph.zero:
        raise DerivationError(f"{where} depends on no {'velocity' if moving else 'coordinate'} along it; {remedy}")
    if moving and v.moves(graph, slope):
        raise DerivationError(f"{where} is not affine in the velocities, which is not supported; {remedy}")
    (expression,) = written(graph, [force])
    kind = "damped_equilibrium" if moving else "equilibrium"
    return Constraint(names.massless(coordinate), expression, kind)
