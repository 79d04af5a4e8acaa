"""Second derivatives by time along a motion: what the outputs of an FMU need beyond the tangent program.

First derivatives are tangents along (1, qd, qdd, du/dt). Differentiating M qdd - forcing = 0 twice along the motion
gives M d4q = -d2r, where d2r is the second derivative at d4q = 0: the factorisation of M serves once more.
Source: A. Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, chapter 13 (higher derivatives by nesting).
"""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.graph.autodiff import forward
from lag2fmu.graph.nodes import Node


class SecondDerivatives(NamedTuple):
    """Time derivatives as nodes: du, d2u of the inputs; d3q, d4q (n + m,) of accelerations and multipliers.

    Behind the derivatives of the inputs stand those of the inputs' rates, if the equations contain any.

    ``residual``: (n + m,), d2r with d4q = 0; ``locals``: {index in ``EquationsOfMotion.locals()``: second derivative};
    ``sliding``: those of the forces of rows that slide.
    """

    du: tuple[Node, ...]
    d2u: tuple[Node, ...]
    d3q: tuple[Node, ...]
    d4q: tuple[Node, ...]
    residual: tuple[Node, ...]
    locals: dict[int, Node]
    sliding: tuple[Node, ...] = ()


def differentiate_twice(
    equations: EquationsOfMotion, outputs: Collection[str], sliding: tuple[Node, ...] = ()
) -> SecondDerivatives:
    """The second total time derivatives of the residual, the locals named in ``outputs``, and the forces ``sliding``.

    Each input moves with a rate of its own, a motion y0 and its y0_dot too, for an importer gives each of them its
    own polynomial. The result has (n + m,) nodes for the residual and one for each local. Source: A. Griewank, A.
    Walther, Evaluating Derivatives, SIAM 2008, chapter 13 (Taylor coefficients).
    """
    g, v = equations.graph, equations.variables

    def rates(order: str, nodes: tuple[Node, ...]) -> tuple[Node, ...]:
        return tuple(g.symbol(f"{order} {g.leaf[node]}") for node in nodes)

    du, d2u = rates("d", v.signals), rates("dd", v.signals)
    d3q, d4q = rates("d", v.unknowns), rates("dd", v.unknowns)
    moving = (*v.q, *v.qd, *v.unknowns, *v.signals, *du)
    along = {v.t: g.one} | dict(zip(moving, (*v.qd, *v.qdd, *d3q, *du, *d2u), strict=True))
    along |= zip(v.further, v.further_rates, strict=True)
    chosen = {i: node for i, (name, node) in enumerate(equations.locals()) if name in outputs}
    further = along | dict(zip(d3q, d4q, strict=True))
    second = forward(g, forward(g, list(chosen.values()), further), further)
    return SecondDerivatives(
        du=du,
        d2u=d2u,
        d3q=d3q,
        d4q=d4q,
        residual=tuple(forward(g, forward(g, equations.residual, along), along)),
        locals=dict(zip(chosen, second, strict=True)),
        sliding=tuple(forward(g, forward(g, sliding, further), further)),
    )
