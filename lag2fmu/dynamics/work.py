"""The power that changes the energy of a mechanism, on the graph of its equations."""

from __future__ import annotations

from collections.abc import Iterator

from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.terms import generalized_forces
from lag2fmu.graph.autodiff import forward, reverse
from lag2fmu.graph.nodes import Node


def power_of_work(equations: EquationsOfMotion) -> Node:
    """dh/dt of the generalized energy, in W: Q.qd - qd.dR/dqd - dL/dt - multiplier.b, constraints being G qd + b = 0.

    A hybrid mechanism has a variable for its dissipated energy; the power of its dampers and of friction is left out
    here. The graph of ``equations`` is one to which nodes can be added. Source: Goldstein, Classical Mechanics, section
    2.7 (the energy function h).
    """
    g, v, parts = equations.graph, equations.variables, equations.parts
    power = g.dot(v.qd, generalized_forces(g, v, parts))
    if equations.mechanism.hybrid:
        power = g.add(power, parts.resistance)
    else:
        drag = reverse(g, {parts.dissipation: g.one}, v.qd)
        power = g.subtract(power, g.dot(v.qd, drag))
    still = {q: rate for q, rate in v.direction(g, accelerating=False).items() if q not in v.q}
    (changing,) = forward(g, [parts.lagrangian(g)], still)
    power = g.subtract(power, changing)
    for multiplier, moved in _supports(equations):
        power = g.subtract(power, g.multiply(multiplier, moved))
    return power


def moving_supports(equations: EquationsOfMotion) -> Node:
    """The sum of b^2 of all constraints and rows G qd + b; it is 0 if none of them is driven by the time or a motion.

    The graph of ``equations`` is one to which nodes can be added.
    """
    g = equations.graph
    return g.total(g.multiply(moved, moved) for _, moved in _supports(equations))


def _supports(equations: EquationsOfMotion) -> Iterator[tuple[Node, Node]]:
    """(multiplier, b) of the constraints and rows G qd + b."""
    g, v = equations.graph, equations.variables
    bearing = list(_bearing(equations))
    moved = g.substitute([velocity for _, velocity in bearing], dict.fromkeys(v.qd, g.zero))
    yield from zip((multiplier for multiplier, _ in bearing), moved, strict=True)


def _bearing(equations: EquationsOfMotion) -> Iterator[tuple[Node, Node]]:
    """(multiplier, G qd + b) of constraints and rows, without the equilibria of coordinates without mass.

    The multipliers of such equilibria are 0.
    """
    constraints = zip(equations.mechanism.constraints, equations.variables.multipliers, strict=True)
    for (constraint, multiplier), velocity in zip(constraints, equations.permanent.velocities, strict=True):
        if not constraint.massless:
            yield multiplier, velocity
    yield from zip(equations.rows.forces, equations.rows.velocities, strict=True)
