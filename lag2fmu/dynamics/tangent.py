"""The tangent program: directional derivatives of the accelerations and of everything calculated.

Differentiating M qdd - forcing = 0 at fixed qdd gives M dqdd = -dr, where dr is the directional derivative of the
residual r(t, q, qd, inputs, parameters; qdd) along the seeds. The factorisation of M is that of the function itself.
With constraints the multipliers stand beside qdd, and the factorisation is that of the whole KKT matrix.
Source: A. Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, section 15.3 (implicit functions).
"""

from __future__ import annotations

from typing import NamedTuple

from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.graph.autodiff import forward
from lag2fmu.graph.nodes import Node


class Tangent(NamedTuple):
    """Seeds and derivatives as nodes: seeds dt, dx (q, qd, further states), du (inputs), dp (parameters), dqdd (n + m).

    ``drates`` are the seeds of the inputs' rates; it is empty where the equations contain none.

    ``residual``: dr, (n + m,), and behind it the derivatives of the constraints' velocities (m,) and positions (h,);
    ``further``: derivatives of the further states' rates; ``locals``: derivatives of ``EquationsOfMotion.locals()`` in
    order; ``dependent``: those of dependent parameters; ``sliding``: those of the forces of rows that slide.
    """

    dt: Node
    dx: tuple[Node, ...]
    du: tuple[Node, ...]
    dp: tuple[Node, ...]
    dqdd: tuple[Node, ...]
    residual: tuple[Node, ...]
    locals: tuple[Node, ...]
    dependent: tuple[Node, ...]
    drates: tuple[Node, ...] = ()
    sliding: tuple[Node, ...] = ()
    further: tuple[Node, ...] = ()


def differentiate(equations: EquationsOfMotion, sliding: tuple[Node, ...] = ()) -> Tangent:
    """Derive the tangent program of ``equations`` on their graph, and of the forces ``sliding``; see the module.

    Source: A. Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, section 3.1 (propagation of tangents).
    """
    g, v = equations.graph, equations.variables

    def seeds(nodes: tuple[Node, ...]) -> tuple[Node, ...]:
        return tuple(g.symbol(f"d {g.leaf[node]}") for node in nodes)

    states, inputs, c = v.states, v.inputs, equations.constraints
    (dt,) = seeds((v.t,))
    dx, du, dp, dqdd = seeds(states), seeds(inputs), seeds(v.parameters), seeds(v.unknowns)
    drates = seeds(v.rates)
    variables = (v.t, *states, *inputs, *v.parameters, *v.rates)
    direction = dict(zip(variables, (dt, *dx, *du, *dp, *drates), strict=True))
    moving = direction | dict(zip(v.unknowns, dqdd, strict=True))
    with g.as_written():  # derivatives of dependent parameters then contain no variable but parameters
        dependent = forward(g, list(equations.dependent.values()), direction, steep=True)
    return Tangent(
        dt=dt,
        dx=dx,
        du=du,
        dp=dp,
        dqdd=dqdd,
        residual=tuple(forward(g, (*equations.residual, *c.velocities, *c.positions), direction, steep=True)),
        locals=tuple(forward(g, [node for _, node in equations.locals()], moving, steep=True)),
        dependent=tuple(dependent),
        drates=drates,
        sliding=tuple(forward(g, sliding, moving, steep=True)),
        further=tuple(forward(g, v.further_rates, moving, steep=True)),
    )
