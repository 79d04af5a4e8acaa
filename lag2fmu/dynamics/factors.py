"""The functions that solve M a = b together, M being factorised once for several b."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from lag2fmu.dynamics.elimination import solve
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.functions import Array, Function, filling
from lag2fmu.dynamics.parts import Entries
from lag2fmu.graph.graph import Graph

if TYPE_CHECKING:
    from lag2fmu.dynamics.row_tables import ImplicitDampers


def factor_and_solve(
    equations: EquationsOfMotion, entries: Entries, state: tuple[Array, ...]
) -> tuple[Function, Function]:
    """Two functions, of which the first computes w, which does not depend on b, and the second a.

    M is the Hessian of ``entries``, those of ``equations`` or others over the same velocity graph. ``state`` are the
    arrays of what M depends on.
    """
    g, n = equations.graph, len(equations.forcing)
    rhs = tuple(g.symbol(f"rhs {i}") for i in range(n))
    found = solve(g, entries, equations.variables.qd, rhs, early=equations.method == "elimination")
    x, pivots = (found.x, found.pivots) if found else (rhs, (g.zero,) * n)
    w = tuple(g.frontier(x, rhs))
    doc = "What the solution a of M a = b takes beside b, w, and the pivots."
    factor = filling("mechanism_factor", doc, state, w=w, pivots=pivots)
    return factor, filling("mechanism_solve", "The solution a of M a = b.", (Array("w", w), Array("b", rhs)), a=x)


def without_dampers(g: Graph, factor: Function, dampers: ImplicitDampers) -> Function:
    """Of what ``factor`` gives of M + half D, that of M alone."""
    nodes = g.substitute([node for *_, node in factor.results], {dampers.half: g.zero})
    results = tuple((array, i, node) for (array, i, _), node in zip(factor.results, nodes, strict=True))
    return replace(factor, results=results)
