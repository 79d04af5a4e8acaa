"""Canonical forms: Hamiltonian, Routhian, Poisson brackets, and the action along a run.

L = 1/2 qd.M qd + a.qd + L0, hence p = M qd + a, and

    H = p.qd - L = 1/2 (p - a).M^-1 (p - a) - L0,    R = (sum over cyclic c of p_c qd_c) - L.

SymPy makes closed forms of small mechanisms; numbers come from M qd = p - a at a state.
Source: Landau, Lifshitz, Mechanics, sections 40 to 43; Goldstein, Classical Mechanics, sections 8.1, 8.3 and 9.5.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import sympy as sp

from lag2fmu.analysis.conserved import lagrangian
from lag2fmu.analysis.evaluation import resting_inputs
from lag2fmu.description import names
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.errors import DerivationError
from lag2fmu.graph.autodiff import forward, reverse
from lag2fmu.graph.batches import Floats, Values, evaluate, matrix
from lag2fmu.graph.nodes import Node
from lag2fmu.graph.to_sympy import tidy, written, written_operations

MAX_COORDINATES, MAX_OPERATIONS = 3, 200
"""The most coordinates, and the most operations in M, a and L0, for which closed forms are made."""


def velocities(equations: EquationsOfMotion, values: Values, momenta: Floats) -> Floats:
    """qd (n,) of the ``momenta`` p (n,) at t, q and inputs in ``values``; raises DerivationError if M is singular.

    In SI units. Source: Goldstein, Classical Mechanics, section 8.1.
    """
    equations, n = equations.apart(), len(equations.forcing)
    M = matrix(equations.graph, inertia(equations), values, n)
    resting = dict.fromkeys((names.velocity(c.name) for c in equations.mechanism.coordinates), 0.0)
    linear = evaluate(equations.graph, equations.momenta, {**values, **resting})
    scale = 1 / np.sqrt(np.where(np.diagonal(M) > 0, np.diagonal(M), 1.0))
    scaled = scale[:, None] * M * scale
    if not np.isfinite(scaled).all() or np.linalg.cond(scaled) > 1e12:
        raise DerivationError(
            f"mechanism '{equations.mechanism.name}': the mass matrix is singular at the state, momenta do not "
            "determine velocities there"
        )
    found: Floats = scale * np.linalg.solve(scaled, scale * (momenta - linear))
    return found


def hamiltonian(equations: EquationsOfMotion, values: Values, momenta: Floats) -> float:
    """H in J at t, q and inputs in ``values`` and at ``momenta`` p (n,); raises DerivationError if M is singular.

    Source: Goldstein, Classical Mechanics, section 8.1.
    """
    coordinates = equations.mechanism.coordinates
    qd = velocities(equations, values, momenta)
    moving = {**values, **dict(zip((names.velocity(c.name) for c in coordinates), qd, strict=True))}
    return float(evaluate(equations.graph, [equations.energies["generalized_energy"]], moving)[0])


def poisson_bracket(equations: EquationsOfMotion, f: Node, g: Node, values: Values) -> float:
    """{f, g} = df/dq.dg/dp - df/dp.dg/dq of two nodes in t, q, qd, at the state ``values`` {variable: SI value}.

    The nodes ``f`` and ``g`` are on the graph of ``equations``, a copy (``apart``) to which their derivatives are
    added. With fixed p, dqd = -M^-1 (dp/dq) dq; with fixed q, dqd = M^-1 dp. Constraints are not taken into account.
    Source: Landau, Lifshitz, Mechanics, section 42 (with the opposite sign); Goldstein, Classical Mechanics, section
    9.5.
    """
    graph, v, n = equations.graph, equations.variables, len(equations.forcing)
    M = matrix(graph, inertia(equations), values, n)
    by_q = matrix(graph, [forward(graph, equations.momenta, {q: graph.one}) for q in v.q], values, n).T

    def slopes(node: Node) -> tuple[Floats, Floats]:
        gradient = evaluate(graph, reverse(graph, {node: graph.one}, [*v.q, *v.qd]), values)
        by_p: Floats = np.linalg.solve(M, gradient[n:]).astype(np.float64)
        return gradient[:n] - by_q.T @ by_p, by_p

    (f_q, f_p), (g_q, g_p) = slopes(f), slopes(g)
    return float(f_q @ g_p - f_p @ g_q)


def action(equations: EquationsOfMotion, time: Floats, states: Values) -> Floats:
    """The action S(t) = integral of L dt in J.s along a run: (k,) at the times ``time`` (k,) in s, S = 0 at the first.

    ``states`` {name: (k,)} has q, qd, qdd and inputs at these times, in SI units; parameters are the declared ones. The
    integral is by the trapezoidal rule with its correction by dL/dt, of fourth order in the distance of the times.
    Source: Landau, Lifshitz, Mechanics, section 43, for S; P. Davis, P. Rabinowitz, Methods of Numerical Integration,
    chapter 2, for the rule.
    """
    equations = equations.apart()
    g, v = equations.graph, equations.variables
    L = lagrangian(equations)
    (rate,) = forward(g, [L], v.direction(g, accelerating=True))
    value, slope = evaluate(g, [L, rate], {**resting_inputs(equations), **states, "t": time})
    h = np.diff(time)
    pieces = h * (value[:-1] + value[1:]) / 2 + h**2 * (slope[:-1] - slope[1:]) / 12
    return np.concatenate([[0.0], np.cumsum(pieces)])


# ------------------------------------------------------------------------------------------------------ closed forms


def hamiltonian_form(equations: EquationsOfMotion) -> sp.Expr | None:
    """H(q, p) in J as a formula with symbols p_NAME; None for mechanisms that are too large for one.

    H = 1/2 (p - a).M^-1 (p - a) - L0 of L = 1/2 qd.M qd + a.qd + L0: Goldstein, Classical Mechanics, section 8.1.
    """
    form = _quadratic(equations)
    if form is None:
        return None
    M, a, rest = form
    difference = sp.Matrix([sp.Symbol(names.momentum(c.name), real=True) for c in equations.mechanism.coordinates]) - a
    if M.is_diagonal():
        if 0 in M.diagonal():
            return None
        return sp.Add(*(d**2 / (2 * inertia) for d, inertia in zip(difference, M.diagonal(), strict=True))) - rest
    determinant = tidy(sp.simplify(M.det()))
    if determinant == 0:
        return None
    kinetic = (difference.T * M.adjugate() * difference)[0] / (2 * determinant)
    return _shortest(kinetic) - rest


def routhian_form(equations: EquationsOfMotion) -> tuple[tuple[str, ...], sp.Expr] | None:
    """The names of the cyclic coordinates, and the Routhian R, in J, as a formula.

    Cyclic are coordinates that L does not contain, whatever forces act. R = (sum over cyclic c of p_c qd_c) - L is a
    function of the p_c, and of q and qd of the other coordinates. None without cyclic coordinates, or if R is too long.
    Source: Landau, Lifshitz, Mechanics, section 41; Goldstein, Classical Mechanics, section 8.3.
    """
    cyclic = cyclic_coordinates(equations)
    form = _quadratic(equations)
    if form is None or not cyclic:
        return None
    M, a, rest = form
    symbols = [sp.Symbol(names.velocity(c.name), real=True) for c in equations.mechanism.coordinates]
    coordinates = [c.name for c in equations.mechanism.coordinates]
    inside = [coordinates.index(name) for name in cyclic]
    others = [i for i in range(len(coordinates)) if i not in inside]
    own, between = M.extract(inside, inside), M.extract(inside, others)
    moving = sp.Matrix(len(others), 1, [symbols[i] for i in others])
    p = sp.Matrix([sp.Symbol(names.momentum(name), real=True) for name in cyclic])
    determinant = tidy(sp.simplify(own.det()))
    if determinant == 0:
        return None
    push = p - a.extract(inside, [0]) - between * moving
    reduced = (push.T * own.adjugate() * push)[0] / (2 * determinant)
    outer = (moving.T * M.extract(others, others) * moving)[0] / 2 + (a.extract(others, [0]).T * moving)[0]
    return tuple(cyclic), _shortest(reduced) - tidy(outer) - rest


def cyclic_coordinates(equations: EquationsOfMotion) -> list[str]:
    """The names of the coordinates that L does not contain. Source: Goldstein, Classical Mechanics, section 2.6."""
    equations = equations.apart()
    g, v = equations.graph, equations.variables
    slopes = reverse(g, {lagrangian(equations): g.one}, v.q)
    return [c.name for c, slope in zip(equations.mechanism.coordinates, slopes, strict=True) if slope == g.zero]


def pushed_by_constraints(equations: EquationsOfMotion) -> set[str]:
    """The names of the coordinates along which constraints act, so that their momenta change without a force."""
    g, columns = equations.graph, zip(*equations.constraints.jacobian, strict=True)
    named = zip(equations.mechanism.coordinates, columns, strict=False)
    return {q.name for q, column in named if any(entry != g.zero for entry in column)}


def inertia(equations: EquationsOfMotion) -> list[list[Node]]:
    """The second derivatives of L by the velocities, (n, n) nodes: M without the terms that only make it regular.

    The nodes are added to the graph of ``equations``, which is a copy (``apart``).
    """
    g = equations.graph
    return [forward(g, equations.momenta, {velocity: g.one}) for velocity in equations.variables.qd]


def _quadratic(equations: EquationsOfMotion) -> tuple[sp.Matrix, sp.Matrix, sp.Expr] | None:
    """M (n, n), a (n, 1) and L0 as formulas; None if they are too long."""
    equations, n = equations.apart(), len(equations.forcing)
    g, v = equations.graph, equations.variables
    if n > MAX_COORDINATES:
        return None
    resting = dict.fromkeys(v.qd, g.zero)
    nodes = g.substitute(
        [*(x for row in inertia(equations) for x in row), *equations.momenta, lagrangian(equations)], resting
    )
    if written_operations(g, nodes) > MAX_OPERATIONS:
        return None
    found = [tidy(x) for x in written(g, nodes)]
    # a node may stand for an equal expression in which velocities cancel out
    found = [x.xreplace(dict.fromkeys((sp.Symbol(str(g.leaf[q]), real=True) for q in v.qd), sp.S.Zero)) for x in found]
    return sp.Matrix(n, n, found[: n * n]), sp.Matrix(n, 1, found[n * n : -1]), found[-1]


def _shortest(expression: sp.Expr) -> sp.Expr:
    """The shortest of a few equal forms of a fraction."""
    forms: Sequence[sp.Expr] = [expression, sp.cancel(expression), sp.factor(expression)]
    simple = sp.simplify(forms[1])
    return min([*forms, simple, sp.expand(simple)], key=lambda x: (sp.count_ops(x), len(str(x))))
