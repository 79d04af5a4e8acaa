"""The equations of a small mechanism as formulas to read: T, V, M(q) and the equations of motion, LaTeX and MathML.

How expressions are written out is in ``written``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import sympy as sp

from lag2fmu.dynamics.written import tidy, written, written_operations
from lag2fmu.mechanism import names

if TYPE_CHECKING:
    from lag2fmu.dynamics.lagrange import EquationsOfMotion

MAX_OPERATIONS = 500
"""Mechanisms whose formulas have more operations, written out, are not printed."""


@dataclass(frozen=True)
class Formula:
    """A formula in two languages, both without delimiters."""

    latex: str
    mathml: str


@dataclass(frozen=True)
class Formulas:
    """T and V as far as they are apart, M(q), (n, n), the equations of motion, (n,), and the constraints, (m,)."""

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
    if written_operations(g, nodes) > MAX_OPERATIONS:
        return None
    texts = iter([tidy(e) for e in written(g, nodes)])
    paper = _Paper(equations)
    printed = tuple(paper.equation(sp.Symbol(letter), next(texts)) for letter, _ in known)
    lower = {(i, j): next(texts) for i in range(n) for j in range(i + 1)}
    matrix = sp.ImmutableMatrix(n, n, lambda i, j: lower[max(i, j), min(i, j)])
    motion = []
    for i in range(n):
        terms = [matrix[i, j] * paper.symbol(v.qdd[j]) for j in range(n)]
        motion.append(paper.equation(sp.Add(*terms, next(texts)), paper.symbol(v.Q[i])))
    constraints = tuple(paper.equation(next(texts), sp.S.Zero) for _ in residuals)
    return Formulas(printed, paper.equation(sp.Symbol("M"), matrix), tuple(motion), constraints)


_ENERGIES = {"T": "kinetic_energy", "V": "potential_energy"}


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
        return sp.Symbol(str(self.graph.leaf[node]), real=True)

    def equation(self, left: sp.Expr, right: sp.Expr) -> Formula:
        """left = right"""
        sides = [self._mathml._print(side).toxml().replace("&InvisibleTimes;", "\u2062") for side in (left, right)]
        latex = " = ".join(self._latex.doprint(side) for side in (left, right))
        return Formula(latex, f"<mrow>{sides[0]}<mo>=</mo>{sides[1]}</mrow>")
