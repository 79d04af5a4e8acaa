"""The equations of a small mechanism as formulas to read: T, V, M(q) and the equations of motion, LaTeX and MathML.

The graph shares subexpressions; a reader wants them written out. Hence formulas are multiplied out and products of
sines and cosines are taken together by the addition theorems, as one does on paper; nothing else is simplified.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import sympy as sp

from lag2fmu.dynamics.graph import Graph
from lag2fmu.dynamics.lagrange import EquationsOfMotion
from lag2fmu.dynamics.operations import CONSTANT, NEGATE, OPERATIONS, SYMBOL
from lag2fmu.dynamics.translate import FUNCTIONS
from lag2fmu.mechanism import names

MAX_OPERATIONS = 500
"""Mechanisms whose formulas have more operations, written out, are not printed."""

_SYMPY = {name: function for function, name in FUNCTIONS.items()} | {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "multiply": lambda a, b: a * b,
    "divide": lambda a, b: a / b,
    "negate": lambda a: -a,
    "sqrt": sp.sqrt,
    "power": sp.Pow,
}
_OTHER = {sp.sin: sp.cos, sp.cos: sp.sin}


@dataclass(frozen=True)
class Formula:
    """A formula in two languages, both without delimiters."""

    latex: str
    mathml: str


@dataclass(frozen=True)
class Formulas:
    """T and V as far as they are apart, M(q), one equation of motion for each coordinate, and the constraints."""

    energies: tuple[Formula, ...]
    mass_matrix: Formula
    motion: tuple[Formula, ...]
    constraints: tuple[Formula, ...]


def formulas(equations: EquationsOfMotion) -> Formulas | None:
    """The formulas of ``equations``; None if they have more than MAX_OPERATIONS operations, written out."""
    g, v = equations.graph, equations.variables
    n = len(v.q)
    energies = [(letter, equations.energies.get(name)) for letter, name in _ENERGIES.items()]
    known = [(letter, node) for letter, node in energies if node is not None]
    reactions = [g.dot(v.multipliers, [row[i] for row in equations.constraints.jacobian]) for i in range(n)]
    rest = [g.subtract(g.subtract(Q, f), R) for Q, f, R in zip(v.Q, equations.forcing, reactions, strict=True)]
    residuals = equations.constraints.residuals
    mass = [equations.mass_matrix[i][j] for i in range(n) for j in range(i + 1)]
    nodes = [*(node for _, node in known), *mass, *rest, *residuals]
    if _written_operations(g, nodes) > MAX_OPERATIONS:
        return None
    written = iter([_tidy(e) for e in _written(g, nodes)])
    paper = _Paper(equations)
    printed = tuple(paper.equation(sp.Symbol(letter), next(written)) for letter, _ in known)
    lower = {(i, j): next(written) for i in range(n) for j in range(i + 1)}
    matrix = sp.ImmutableMatrix(n, n, lambda i, j: lower[max(i, j), min(i, j)])
    motion = []
    for i in range(n):
        terms = [matrix[i, j] * paper.symbol(v.qdd[j]) for j in range(n)]
        motion.append(paper.equation(sp.Add(*terms, next(written)), paper.symbol(v.Q[i])))
    constraints = tuple(paper.equation(next(written), sp.S.Zero) for _ in residuals)
    return Formulas(printed, paper.equation(sp.Symbol("M"), matrix), tuple(motion), constraints)


_ENERGIES = {"T": "kinetic_energy", "V": "potential_energy"}


def _written_operations(graph: Graph, nodes: Iterable[int]) -> int:
    """The number of operations of ``nodes`` if every formula is written out, shared parts as often as they stand."""
    nodes = list(nodes)
    count: dict[int, int] = {}
    for node in graph.cone(nodes):
        operands = graph.operands(node)
        count[node] = sum(count[o] for o in operands) + bool(operands)
    return sum(count[node] for node in nodes)


def _written(graph: Graph, nodes: Sequence[int]) -> list[sp.Expr]:
    """``nodes`` as SymPy expressions."""
    found: dict[int, sp.Expr] = {}
    for node in graph.cone(nodes):
        code = graph.code[node]
        if code == CONSTANT:
            found[node] = sp.sympify(graph.value(node))
        elif code == SYMBOL:
            found[node] = sp.Symbol(str(graph.first[node]), real=True)
        else:
            operands = [found[o] for o in graph.operands(node)]
            if code > NEGATE:  # what stands below a root or in a function is not reached by tidying the whole
                operands = [_tidy(operand) for operand in operands]
            found[node] = _SYMPY[OPERATIONS[code].name](*operands)
    return [found[node] for node in nodes]


def _tidy(expression: sp.Expr) -> sp.Expr:
    """``expression`` multiplied out, with sin a sin b + cos a cos b and the like taken together."""
    terms = dict(sp.expand(expression).as_coefficients_dict())
    while (pair := _addition_theorem(terms)) is not None:
        one, other, result = pair
        del terms[one], terms[other]
        factor, core = result.as_coeff_Mul()
        terms[core] = terms.get(core, 0) + factor
    return sp.Add(*(coefficient * core for core, coefficient in terms.items()))


def _addition_theorem(terms: Mapping[sp.Expr, sp.Expr]) -> tuple[sp.Expr, sp.Expr, sp.Expr] | None:
    """Two of ``terms`` {product: coefficient} and what both are together by an addition theorem; None without such two.

    cos(a - b) = cos a cos b + sin a sin b, sin(a + b) = sin a cos b + cos a sin b; Abramowitz and Stegun, 4.3.16-17.
    """
    for core, coefficient in terms.items():
        for f, g in combinations(_circular_factors(core), 2):
            a, b = f.args[0], g.args[0]
            other = core / (f * g) * _OTHER[f.func](a) * _OTHER[g.func](b)
            partner = terms.get(other)
            if partner is None or other == core or partner not in (coefficient, -coefficient):
                continue
            same = partner == coefficient
            if f.func == g.func:
                sign = 1 if same or f.func is sp.cos else -1
                together = sign * sp.cos(a - b if same else a + b)
            elif f.func is sp.sin:
                together = sp.sin(a + b if same else a - b)
            else:
                together = sp.sin(a + b) if same else sp.sin(b - a)
            return core, other, coefficient * core / (f * g) * together
    return None


def _circular_factors(core: sp.Expr) -> list[sp.Expr]:
    """The sines and cosines that ``core`` is a product of, squares twice."""
    found: list[sp.Expr] = []
    for factor in sp.Mul.make_args(core):
        base, exponent = factor.as_base_exp()
        if base.func in _OTHER and exponent in (1, 2):
            found += [base] * int(exponent)
    return found


class _Paper:
    """Prints formulas with dots for velocities and accelerations."""

    def __init__(self, equations: EquationsOfMotion) -> None:
        from sympy.printing.latex import LatexPrinter
        from sympy.printing.mathml import MathMLPresentationPrinter

        self.graph = equations.graph
        coordinates = [q.name for q in equations.mechanism.coordinates]
        moving = [*coordinates, *(motion.name for motion in equations.mechanism.motions)]
        dotted = {names.velocity(name): (name, 1) for name in moving}
        dotted |= {names.acceleration(name): (name, 2) for name in moving}
        forces = {names.generalized_force(name): name for name in coordinates}

        class Latex(LatexPrinter):  # type: ignore[misc]
            def _print_Symbol(self, symbol: sp.Symbol, style: str = "plain") -> str:
                if symbol.name in forces:
                    return f"Q_{{{self._print_Symbol(sp.Symbol(forces[symbol.name]))}}}"
                name, dots = dotted.get(symbol.name, (symbol.name, 0))
                plain: str = super()._print_Symbol(sp.Symbol(name), style)
                return (plain, f"\\dot{{{plain}}}", f"\\ddot{{{plain}}}")[dots]

        class MathML(MathMLPresentationPrinter):  # type: ignore[misc]
            def _print_Symbol(self, symbol: sp.Symbol, style: str = "plain") -> Any:
                if symbol.name in forces:
                    return self._pair("msub", self._leaf("mi", "Q"), self._print(sp.Symbol(forces[symbol.name])))
                name, dots = dotted.get(symbol.name, (symbol.name, 0))
                plain = super()._print_Symbol(sp.Symbol(name), style)
                return self._pair("mover", plain, self._leaf("mo", "\u02d9\u00a8"[dots - 1])) if dots else plain

            def _leaf(self, tag: str, text: str) -> Any:
                leaf = self.dom.createElement(tag)
                leaf.appendChild(self.dom.createTextNode(text))
                return leaf

            def _pair(self, tag: str, first: Any, second: Any) -> Any:
                pair = self.dom.createElement(tag)
                pair.appendChild(first)
                pair.appendChild(second)
                return pair

        self._latex = Latex({"mat_delim": "(", "mat_str": "matrix"})
        self._mathml = MathML({"mat_delim": "("})

    def symbol(self, node: int) -> sp.Symbol:
        """The symbol of a variable."""
        return sp.Symbol(str(self.graph.first[node]), real=True)

    def equation(self, left: sp.Expr, right: sp.Expr) -> Formula:
        """left = right"""
        sides = [self._mathml._print(side).toxml().replace("&InvisibleTimes;", "\u2062") for side in (left, right)]
        latex = " = ".join(self._latex.doprint(side) for side in (left, right))
        return Formula(latex, f"<mrow>{sides[0]}<mo>=</mo>{sides[1]}</mrow>")
