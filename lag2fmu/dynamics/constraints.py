"""Constraints on the graph.

A holonomic constraint phi(t, q) = 0 restricts the velocities by its derivative, G qd + phi_t = 0 with G = dphi/dq. A
nonholonomic constraint restricts them as it stands, G qd + b = 0. One more derivative, and the forces G^T multiplier of
d'Alembert's principle, give

    [M  -G^T] [qdd       ]   [forcing]
    [G    0 ] [multiplier] = [-gamma ],     gamma = d/dt (G qd + b) at qdd = 0.

Source: Hand, Finch, Analytical Mechanics, sections 2.5 and 2.6; Goldstein, Classical Mechanics, section 2.4.
"""

from __future__ import annotations

from lag2fmu.dynamics.parts import Constraints, Variables
from lag2fmu.errors import DerivationError
from lag2fmu.graph.autodiff import forward, reverse
from lag2fmu.graph.from_sympy import Translator
from lag2fmu.graph.graph import Graph
from lag2fmu.mechanism.record import Mechanism


def compose(graph: Graph, mechanism: Mechanism, put: Translator, v: Variables) -> Constraints:
    """The m constraints of ``mechanism`` as nodes, differentiated along the motion once and twice.

    ``put`` translates expressions, ``v`` are the variables. Raises DerivationError for one that is not affine in the
    velocities.
    """
    direction = v.direction(graph, accelerating=False)
    values = [put(c.expression) for c in mechanism.constraints]
    holonomic = len(mechanism.holonomic)
    velocities = [*forward(graph, values[:holonomic], direction), *values[holonomic:]]
    jacobian = [tuple(reverse(graph, {velocity: graph.one}, v.qd)) for velocity in velocities]
    moving = graph.depending((entry for row in jacobian for entry in row), v.qd)
    for constraint, row in zip(mechanism.constraints, jacobian, strict=True):
        if not moving.isdisjoint(row):
            raise DerivationError(
                f"constraints.{constraint.kind}.{constraint.name}: '{constraint.expression}' is not affine in the "
                "velocities; write it as a sum of velocities with factors that contain none"
            )
    return Constraints(
        tuple(values[:holonomic]), tuple(velocities), tuple(forward(graph, velocities, direction)), tuple(jacobian)
    )
