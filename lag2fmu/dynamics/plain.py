"""The equations of motion as plain functions: the derivative of the states, and its Jacobians entry by entry.

The columns of the Jacobians follow from M dqdd = -dr, see ``tangent``. All columns use one factorisation, which is that
of the accelerations. Under constraints the closed formula of the accelerations is differentiated.
Source: A. Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, section 15.3 (implicit functions).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from lag2fmu.dynamics.elimination import solve
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.functions import Array, Function, Program
from lag2fmu.dynamics.program import lower
from lag2fmu.dynamics.schur_complement import solve_constrained
from lag2fmu.errors import DerivationError
from lag2fmu.graph.autodiff import forward
from lag2fmu.graph.nodes import Node

KNOWNS = ("t", "x", "u", "p")
"""What the functions depend on: time, states, inputs, independent parameters."""


@dataclass(frozen=True)
class PlainFunctions:
    """``program`` has two functions of t, x, u, p: ``derivative`` and ``jacobian``; both also give the pivots of M.

    ``derivative`` gives f = dx/dt, (N,); ``jacobian`` the entries J that are not always zero, column by column, the
    columns of t, x, u, p in turn. ``sparsity`` {known: (row, column) of each of its entries, in that order}.
    """

    program: Program
    sparsity: Mapping[str, tuple[tuple[int, int], ...]]


def plain_functions(equations: EquationsOfMotion) -> PlainFunctions:
    """The functions of ``equations``, on a copy of their graph.

    Raises DerivationError for a mechanism with events or with coordinates without mass, and for one without a closed
    formula of its accelerations. Source: A. Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, section 15.3.
    """
    whole = lower(equations)
    name = equations.mechanism.name
    if whole.hybrid or any(c.massless for c in equations.mechanism.constraints):
        what = "events" if whole.hybrid else "coordinates without mass that forces determine"
        raise DerivationError(f"'{name}' has {what}: no plain function has that; use an Ensemble, or export an FMU")
    equations = equations.apart()
    g, v = equations.graph, equations.variables
    unknowns, pivots = _solution(equations)
    known = dict(zip(v.unknowns, unknowns, strict=True))
    held = dict.fromkeys(v.rates, g.zero)
    rates = g.substitute((*v.qd, *unknowns[: len(v.q)], *g.substitute(v.further_rates, known)), held)
    arrays = (Array("t", (v.t,), True), Array("x", v.states), Array("u", v.inputs), Array("p", v.parameters))
    entries, sparsity = [], {}
    for array in arrays:
        columns = [g.substitute(_column(equations, unknowns, known, node), held) for node in array.entries]
        places = [(i, j) for j, column in enumerate(columns) for i, entry in enumerate(column) if entry != g.zero]
        sparsity[array.name] = tuple(places)
        entries += [columns[j][i] for i, j in places]
    functions = (
        _filling("derivative", "Derivatives f = dx/dt and the pivots of the solution.", arrays, "f", rates, pivots),
        _filling("jacobian", "Entries J of the Jacobians of f, see PlainFunctions.", arrays, "J", entries, pivots),
    )
    checked = tuple(f.check(g) for f in functions)
    return PlainFunctions(replace(whole, graph=g, signals=len(v.inputs), functions=checked), sparsity)


def _filling(
    name: str, doc: str, arguments: tuple[Array, ...], array: str, nodes: Sequence[Node], pivots: Sequence[Node]
) -> Function:
    results = [(array, i, node) for i, node in enumerate(nodes)]
    results += [("pivots", i, node) for i, node in enumerate(pivots)]
    return Function(name, doc, arguments, (array, "pivots"), tuple(results))


def _solution(equations: EquationsOfMotion) -> tuple[tuple[Node, ...], tuple[Node, ...]]:
    """Accelerations with multipliers behind them, (n + m,), and pivots, which are positive where these are valid."""
    zeros = (equations.graph.zero,) * len(equations.constraints)
    if zeros:
        constrained = solve_constrained(equations, zeros)
        if constrained is not None:
            return constrained.unknowns, (*constrained.pivots, *constrained.margins)
    elif equations.solution is not None:
        return tuple(equations.solution.x), tuple(equations.solution.pivots)
    raise DerivationError(
        f"'{equations.mechanism.name}' has no closed formula for its accelerations; use an Ensemble, or export an FMU"
    )


def _column(
    equations: EquationsOfMotion, unknowns: tuple[Node, ...], known: Mapping[Node, Node], variable: Node
) -> tuple[Node, ...]:
    """The derivatives of (dq/dt, dqd/dt, dz/dt) by one variable, (N,) nodes."""
    g, v = equations.graph, equations.variables
    direction = {variable: g.one}
    answers = _answers(equations, unknowns, known, direction)
    moving = direction | dict(zip(v.unknowns, answers, strict=True))
    further = g.substitute(forward(g, v.further_rates, moving), known)
    return (*forward(g, v.qd, direction), *answers[: len(v.q)], *further)


def _answers(
    equations: EquationsOfMotion,
    unknowns: tuple[Node, ...],
    known: Mapping[Node, Node],
    direction: Mapping[Node, Node],
) -> list[Node]:
    """The derivatives of accelerations and multipliers, (n + m,)."""
    g, v = equations.graph, equations.variables
    if len(equations.constraints):
        return forward(g, unknowns, direction)
    missing = [g.negate(node) for node in g.substitute(forward(g, equations.residual, direction), known)]
    if all(node == g.zero for node in missing):
        return missing
    found = solve(g, equations.entries, v.qd, missing, equations.method == "elimination")
    if found is None:  # M is the one that gave the accelerations
        raise DerivationError(f"mechanism '{equations.mechanism.name}': the mass matrix is singular; give masses")
    return list(found.x)
