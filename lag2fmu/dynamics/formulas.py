"""The equations of a small mechanism as formulas to read: T, V, M(q) and the equations of motion, LaTeX and MathML.

How expressions are written out is in ``graph.to_sympy``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import sympy as sp

from lag2fmu.description import names
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.graph.graph import Graph
from lag2fmu.graph.nodes import Node
from lag2fmu.graph.to_sympy import tidy, written, written_operations
from lag2fmu.language.vocabulary import symbol
from lag2fmu.language.writer import with_decimals

MAX_OPERATIONS = 500
"""Mechanisms whose formulas have more operations, written out, are not printed."""


@dataclass(frozen=True)
class Formula:
    """A formula in two languages, both without delimiters."""

    latex: str
    mathml: str


@dataclass(frozen=True)
class Formulas:
    """What is shown of a mechanism, in this order, each as a ``Formula``.

    T and V, if they are told apart; M(q); the equations of motion (n,); those of the further states (f,); the
    constraints (m,); the forces that carry the prescribed motions (k,).
    """

    energies: tuple[Formula, ...]
    mass_matrix: Formula
    motion: tuple[Formula, ...]
    further: tuple[Formula, ...]
    constraints: tuple[Formula, ...]
    drives: tuple[Formula, ...]


@dataclass(frozen=True)
class Expressions:
    """What ``Formulas`` prints, as SymPy expressions: equations are pairs of left and right side."""

    energies: tuple[tuple[str, sp.Expr], ...]
    mass_matrix: sp.ImmutableMatrix
    motion: tuple[tuple[sp.Expr, sp.Expr], ...]
    further: tuple[tuple[sp.Expr, sp.Expr], ...]
    constraints: tuple[sp.Expr, ...]
    drives: tuple[tuple[sp.Expr, sp.Expr], ...]


def formulas(equations: EquationsOfMotion) -> Formulas | None:
    """The formulas of ``equations``; None if they have more than MAX_OPERATIONS operations, written out."""
    found = expressions(equations, MAX_OPERATIONS)
    if found is None:
        return None
    paper = _Paper(equations)
    return Formulas(
        tuple(paper.equation(sp.Symbol(letter), energy) for letter, energy in found.energies),
        paper.equation(sp.Symbol("M"), found.mass_matrix),
        tuple(paper.equation(left, right) for left, right in found.motion),
        tuple(paper.equation(left, right) for left, right in found.further),
        tuple(paper.equation(residual, sp.S.Zero) for residual in found.constraints),
        tuple(paper.equation(left, right) for left, right in found.drives),
    )


def expressions(equations: EquationsOfMotion, most: int) -> Expressions | None:
    """The ``equations`` as expressions; None if they have more than ``most`` operations.

    Expressions of up to MAX_OPERATIONS operations are tidied. Values are in SI units.
    """
    equations = equations.apart()
    g, v = equations.graph, equations.variables
    letters = [letter for letter, name in _ENERGIES.items() if name in equations.energies]
    nodes = [
        *(equations.energies[_ENERGIES[letter]] for letter in letters),
        *(equations.mass_matrix[i][j] for i, j in _triangle(len(v.q))),
        *_without_inertia(equations),
        *equations.variables.further_rates,
        *equations.drives,
        *equations.constraints.residuals,
    ]
    operations = written_operations(g, nodes)
    if operations > most:
        return None
    texts = _read(g, nodes, operations, [*map(names.target, equations.mechanism.filtered)])
    printed = tuple((letter, next(texts)) for letter in letters)
    matrix, motion = _motion(equations, texts)
    rates = [sp.Symbol(names.derivative(str(g.leaf[node])), real=True) for node in v.further]
    told = {names.derivative(name) for name in equations.mechanism.filtered}  # y_dot = y_dot tells nothing
    further = tuple((rate, text) for rate, text in zip(rates, texts, strict=False) if rate.name not in told)
    carrying = [sp.Symbol(names.drive(name), real=True) for name in equations.mechanism.driven]
    drives = tuple((force, next(texts)) for force in carrying)
    return Expressions(printed, matrix, motion, further, tuple(texts), drives)


def _triangle(n: int) -> list[tuple[int, int]]:
    """The places in the lower triangle of a matrix (n, n), row by row."""
    return [(i, j) for i in range(n) for j in range(i + 1)]


def _motion(
    equations: EquationsOfMotion, texts: Iterator[sp.Expr]
) -> tuple[sp.ImmutableMatrix, tuple[tuple[sp.Expr, sp.Expr], ...]]:
    """M (n, n) and the sides (left, right) of the equations of motion (n,).

    Reads from ``texts`` the lower triangle of M, and then what stands beside M qdd.
    """
    g, v = equations.graph, equations.variables
    n = len(v.q)
    lower = {place: next(texts) for place in _triangle(n)}
    matrix = sp.ImmutableMatrix(n, n, lambda i, j: lower[max(i, j), min(i, j)])
    qdd, forces = ([sp.Symbol(str(g.leaf[node]), real=True) for node in group] for group in (v.qdd, v.Q))
    inertial = (sp.Add(*(matrix[i, j] * qdd[j] for j in range(n)), next(texts)) for i in range(n))
    return matrix, tuple(zip(inertial, forces, strict=True))


def _read(graph: Graph, nodes: Sequence[Node], operations: int, targets: Sequence[str]) -> Iterator[sp.Expr]:
    """The ``nodes`` as expressions, tidied if they have no more than MAX_OPERATIONS operations together.

    ``targets`` are what filtered motions follow; their time derivatives are named as those of coordinates are.
    """
    rates = {symbol(names.rate(t)): symbol(names.velocity(t)) for t in targets}
    rates |= {symbol(names.rate(names.rate(t))): symbol(names.acceleration(t)) for t in targets}
    found = [x.xreplace(rates) for x in written(graph, nodes)]
    return iter(found) if operations > MAX_OPERATIONS else map(tidy, found)


def _without_inertia(equations: EquationsOfMotion) -> list[Node]:
    """Q - forcing - G^T multiplier, (n,): what stands beside M qdd where the external forces Q are on the right."""
    g, v = equations.graph, equations.variables
    columns = zip(*equations.constraints.jacobian, strict=True) if len(equations.constraints) else [()] * len(v.q)
    reactions = [g.dot(v.multipliers, column) for column in columns]
    return [g.subtract(g.subtract(Q, f), R) for Q, f, R in zip(v.Q, equations.forcing, reactions, strict=True)]


_ENERGIES = {"T": "kinetic_energy", "V": "potential_energy"}


class _Paper:
    """Prints formulas with dots for velocities and accelerations."""

    def __init__(self, equations: EquationsOfMotion) -> None:
        from sympy.printing.latex import LatexPrinter
        from sympy.printing.mathml import MathMLPresentationPrinter

        coordinates = [q.name for q in equations.mechanism.coordinates]
        moving = [*coordinates, *equations.mechanism.driven, *map(names.target, equations.mechanism.filtered)]
        dotted = {names.velocity(name): (name, 1) for name in moving}
        dotted |= {names.acceleration(name): (name, 2) for name in moving}
        further = [z.name for z in equations.mechanism.states]
        dotted |= {names.derivative(name): (name, 1) for name in further}
        filtered = equations.mechanism.filtered
        dotted |= {names.derivative(names.velocity(name)): (name, 2) for name in filtered}
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

    def equation(self, left: sp.Expr, right: sp.Expr) -> Formula:
        """left = right"""
        left, right = with_decimals(left), with_decimals(right)
        sides = [self._mathml._print(side).toxml().replace("&InvisibleTimes;", "\u2062") for side in (left, right)]
        latex = " = ".join(self._latex.doprint(side) for side in (left, right))
        return Formula(latex, f"<mrow>{sides[0]}<mo>=</mo>{sides[1]}</mrow>")
