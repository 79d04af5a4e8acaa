"""The generalized force that carries each prescribed motion: the force that its drive has to exert.

A motion y is taken as one more coordinate. Its own Lagrange equation, with the forces of constraints, contacts and
friction, says what else acts on it:

    F = d/dt dL/dy_dot - dL/dy + dR/dy_dot - Q - sum of multiplier * d(velocity of the constraint)/dy_dot.

F y_dot is the power that the drive puts into the mechanism. Source: Goldstein, Classical Mechanics, sections 1.4 and
2.4 (virtual displacements of driven supports, multipliers).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from lag2fmu.dynamics.parts import Constraints, Energies, RowNumbers, Variables
from lag2fmu.dynamics.terms import unconstrained_residual
from lag2fmu.graph.autodiff import Forward, reverse
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.mechanism.record import Mechanism


def drive_forces(
    graph: Graph, mechanism: Mechanism, v: Variables, energies: Energies, constraints: Constraints, rows: RowNumbers
) -> tuple[Node, ...]:
    """F (k,) of what is carried in ``mechanism`` as nodes, each in J by the unit of its motion.

    These are the prescribed motions, and behind them the coordinates among the ports' drives. With such coordinates all
    drives stand in for the guides, constraints that motions move which are not among the ports' drives: F of a
    coordinate is what the guides exert along it, and that of another drive contains it.

    The forces contain accelerations and multipliers as variables. The fictitious energies that make M regular are left
    out, because they vanish along the motion. The equilibria of coordinates without mass are left out, because their
    multipliers are zero. Source: Goldstein, Classical Mechanics, section 2.4 (multipliers as forces).
    """
    if not v.driven:
        return ()
    y, y_dot = tuple(a for a, _ in v.driven), tuple(b for _, b in v.driven)
    own = replace(energies, direct=energies.on_motions, carried={})
    rate, accelerating = (Forward(graph, v.direction(graph, along)) for along in (False, True))
    residual = unconstrained_residual(graph, v._replace(q=y, qd=y_dot), own, rate, accelerating)
    bearing = zip(mechanism.constraints, constraints.velocities, v.multipliers, strict=True)
    pairs = [(velocity, force) for c, velocity, force in bearing if not c.massless]
    borne = _borne(graph, (*pairs, *zip(rows.velocities, rows.forces, strict=True)))
    forces = tuple(graph.subtract(a, b) for a, b in zip(residual, reverse(graph, borne, y_dot), strict=True))
    own_coordinates = carried_coordinates(mechanism)
    if not own_coordinates:
        return forces
    given = [name in mechanism.ports.drives for name in mechanism.driven]
    guided = reverse(graph, _guides(graph, mechanism, v, constraints), [*y_dot, *(v.qd[i] for i in own_coordinates)])
    held = zip(forces, given, guided, strict=False)
    along = (graph.add(force, guide) if drives else force for force, drives, guide in held)
    return (*along, *guided[len(forces) :])


def carried_coordinates(mechanism: Mechanism) -> tuple[int, ...]:
    """The indices of the coordinates among the ports' drives."""
    return tuple(i for i, q in enumerate(mechanism.coordinates) if q.name in mechanism.ports.drives)


def _guides(graph: Graph, mechanism: Mechanism, v: Variables, constraints: Constraints) -> dict[Node, Node]:
    """{velocity: multiplier} of the constraints that motions move which are not among the ports' drives."""
    others = {name for name in mechanism.driven if name not in mechanism.ports.drives}
    rows = zip(constraints.residuals, constraints.velocities, v.multipliers, strict=True)
    return _borne(graph, [(velocity, x) for residual, velocity, x in rows if graph.symbols([residual]) & others])


def _borne(graph: Graph, pairs: Iterable[tuple[Node, Node]]) -> dict[Node, Node]:
    """{velocity: sum of the multipliers along it}; several constraints may share a velocity."""
    found: dict[Node, Node] = {}
    for velocity, force in pairs:
        found[velocity] = graph.add(found.get(velocity, graph.zero), force)
    return found
