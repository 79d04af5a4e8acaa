"""The equations of motion as plain functions: the derivative of the states, and its Jacobians entry by entry.

The columns of the Jacobians follow from M dqdd = -dr, see ``tangent``, under constraints from the same with the KKT
matrix. All columns use one factorisation, which is that of the accelerations.
Source: A. Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, section 15.3 (implicit functions).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from lag2fmu.description.names import rate, residual
from lag2fmu.dynamics.elimination import solve
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.functions import Array, Function, Program
from lag2fmu.dynamics.program import lower
from lag2fmu.dynamics.schur_complement import Saddle, factorised
from lag2fmu.errors import DerivationError
from lag2fmu.graph.autodiff import forward
from lag2fmu.graph.nodes import Node
from lag2fmu.language.identifiers import suggestion
from lag2fmu.mechanism.leaving_out import what_could_be_left_out
from lag2fmu.mechanism.record import Mechanism

KNOWNS = ("t", "x", "u", "p")
"""What the functions depend on: time, states, inputs, independent parameters."""


@dataclass(frozen=True)
class PlainFunctions:
    """``program`` has two functions of t, x, u, p: ``derivative`` and ``jacobian``; both also give the pivots of M.

    ``derivative`` gives f = dx/dt, (N,), and behind it the o outputs asked for; ``jacobian`` the entries J that are not
    always zero, column by column, the columns of t, x, u, p in turn. ``sparsity`` {known: (row, column) of each of
    its entries, in that order}.
    """

    program: Program
    sparsity: Mapping[str, tuple[tuple[int, int], ...]]


def plain_functions(
    equations: EquationsOfMotion, *, jacobian: bool = True, outputs: Sequence[str] = ()
) -> PlainFunctions:
    """The functions of ``equations``, on a copy of their graph.

    Without ``jacobian`` there is only the function ``derivative``, which takes a tenth of the time. ``outputs`` are
    names of variables of any kind, which become further entries of both.

    Raises DerivationError for a mechanism with events or with coordinates without mass, for one without a closed
    formula of its accelerations, and for an unknown output. Source: A. Griewank, A. Walther, Evaluating Derivatives,
    SIAM 2008, section 15.3.
    """
    whole = lower(equations)
    name = equations.mechanism.name
    if whole.hybrid or any(c.massless for c in equations.mechanism.constraints):
        raise DerivationError(f"'{name}' has {_refused(equations.mechanism, hybrid=whole.hybrid)}")
    equations = equations.apart()
    g, v = equations.graph, equations.variables
    saddle, unknowns, pivots = _solution(equations)
    known = dict(zip(v.unknowns, unknowns, strict=True))
    held = dict.fromkeys(v.rates, g.zero)
    wanted = _outputs(equations, outputs)
    shown = g.substitute((*v.further_rates, *wanted), known)
    rates = g.substitute((*v.qd, *unknowns[: len(v.q)], *shown), held)
    arrays = (Array("t", (v.t,), True), Array("x", v.states), Array("u", v.inputs), Array("p", v.parameters))
    doc = "Derivatives f = dx/dt and the pivots of the solution."
    functions = [_filling("derivative", doc, arrays, "f", rates, pivots)]
    sparsity: dict[str, tuple[tuple[int, int], ...]] = {}
    if jacobian:
        entries, sparsity = _entries(equations, saddle, known, arrays, wanted)
        doc = "Entries J of the Jacobians of f, see PlainFunctions."
        functions.append(_filling("jacobian", doc, arrays, "J", entries, pivots))
    checked = tuple(f.check(g) for f in functions)
    return PlainFunctions(whole._replace(graph=g, signals=len(v.inputs), functions=checked), sparsity)


def _refused(mechanism: Mechanism, *, hybrid: bool) -> str:
    """What of ``mechanism`` no plain function has, and what helps."""
    found = list(what_could_be_left_out(mechanism))
    what = " and ".join(phrase for _, phrase in found) if found else "events of constraints, or of kinks in expressions"
    if not hybrid:
        found, what = [], "coordinates without mass that forces determine"
    words = ", ".join(f'"{word}"' for word, _ in found)
    remedy = f"leave out what may be, by without = {words if len(found) == 1 else f'[{words}]'}; or " if found else ""
    return f"{what}: no plain function has that; {remedy}use an Ensemble, or export an FMU"


def _outputs(equations: EquationsOfMotion, names: Sequence[str]) -> list[Node]:
    """The nodes of the variables ``names``; raises DerivationError for an unknown one.

    The rate of a residual is known too, by ``names.rate``: what a holonomic constraint demands of the velocities.
    """
    g, v, c = equations.graph, equations.variables, equations.permanent
    known = {str(g.leaf[node]): node for node in (*v.states, *v.unknowns, *v.inputs)} | dict(equations.locals())
    rates = zip((rate(residual(x.name)) for x in equations.mechanism.holonomic), c.velocities, strict=False)
    every = known | dict(rates)
    for name in names:
        if name not in every:
            raise DerivationError(f"'{equations.mechanism.name}' has no variable '{name}'; {suggestion(name, known)}")
    return [every[name] for name in names]


def _entries(
    equations: EquationsOfMotion,
    saddle: Saddle | None,
    known: Mapping[Node, Node],
    arrays: Sequence[Array],
    outputs: Sequence[Node],
) -> tuple[list[Node], dict[str, tuple[tuple[int, int], ...]]]:
    """The entries of the Jacobians by ``arrays`` that are not always zero, and ``PlainFunctions.sparsity``."""
    g, held = equations.graph, dict.fromkeys(equations.variables.rates, equations.graph.zero)
    entries, sparsity = [], {}
    for array in arrays:
        columns = [g.substitute(_column(equations, saddle, known, node, outputs), held) for node in array.entries]
        places = [(i, j) for j, column in enumerate(columns) for i, entry in enumerate(column) if entry != g.zero]
        sparsity[array.name] = tuple(places)
        entries += [columns[j][i] for i, j in places]
    return entries, sparsity


def _filling(
    name: str, doc: str, arguments: tuple[Array, ...], array: str, nodes: Sequence[Node], pivots: Sequence[Node]
) -> Function:
    results = [(array, i, node) for i, node in enumerate(nodes)]
    results += [("pivots", i, node) for i, node in enumerate(pivots)]
    return Function(name, doc, arguments, (array, "pivots"), tuple(results))


def _solution(equations: EquationsOfMotion) -> tuple[Saddle | None, tuple[Node, ...], tuple[Node, ...]]:
    """The KKT matrix of constraints, accelerations with multipliers behind them, (n + m,), and pivots.

    The solution is valid where the pivots are positive.
    """
    if len(equations.constraints):
        saddle = factorised(equations)
        if saddle is not None:
            found = saddle.accelerations((equations.graph.zero,) * len(equations.constraints))
            return saddle, found.unknowns, (*found.pivots, *found.margins)
    elif equations.solution is not None:
        return None, tuple(equations.solution.x), tuple(equations.solution.pivots)
    raise DerivationError(
        f"'{equations.mechanism.name}' has no closed formula for its accelerations; use an Ensemble, or export an FMU"
    )


def _column(
    equations: EquationsOfMotion,
    saddle: Saddle | None,
    known: Mapping[Node, Node],
    variable: Node,
    outputs: Sequence[Node],
) -> tuple[Node, ...]:
    """The derivatives of (dq/dt, dqd/dt, dz/dt) and the ``outputs`` (o,) by one variable, (N + o,) nodes."""
    g, v = equations.graph, equations.variables
    direction = {variable: g.one}
    answers = _answers(equations, saddle, known, direction)
    moving = direction | dict(zip(v.unknowns, answers, strict=True))
    further = g.substitute(forward(g, (*v.further_rates, *outputs), moving), known)
    return (*forward(g, v.qd, direction), *answers[: len(v.q)], *further)


def _answers(
    equations: EquationsOfMotion, saddle: Saddle | None, known: Mapping[Node, Node], direction: Mapping[Node, Node]
) -> Sequence[Node]:
    """The derivatives of accelerations and multipliers, (n + m,)."""
    g, v, n = equations.graph, equations.variables, len(equations.forcing)
    missing = [g.negate(node) for node in g.substitute(forward(g, equations.residual, direction), known)]
    if all(node == g.zero for node in missing):
        return missing
    if saddle is not None:
        return saddle.unknowns(missing[:n], [g.negate(node) for node in missing[n:]])
    found = solve(g, equations.entries, v.qd, missing, equations.method == "elimination")
    if found is None:  # M is the one that gave the accelerations
        raise DerivationError(f"mechanism '{equations.mechanism.name}': the mass matrix is singular; give masses")
    return list(found.x)
