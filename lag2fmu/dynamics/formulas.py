"""The equations of a small mechanism as formulas to read: T, V, M(q) and the equations of motion, LaTeX and MathML.

How expressions are written out is in ``graph.to_sympy``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import sympy as sp

from lag2fmu.description import names
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.graph.graph import Graph
from lag2fmu.graph.nodes import Node
from lag2fmu.graph.to_sympy import tidy, written, written_operations
from lag2fmu.language.letters import latex_name, letter, split
from lag2fmu.language.vocabulary import symbol
from lag2fmu.language.writer import with_decimals
from lag2fmu.mechanism.drives import carried
from lag2fmu.mechanism.record import Mechanism

MAX_OPERATIONS = 500
"""Mechanisms whose formulas have more operations, written out, are not printed."""


class Formula(NamedTuple):
    """A formula in two languages, both without delimiters."""

    latex: str
    mathml: str


class Formulas(NamedTuple):
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


class Expressions(NamedTuple):
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


def printed(equations: EquationsOfMotion, pairs: Iterable[tuple[str | sp.Expr, sp.Expr]]) -> tuple[Formula, ...]:
    """The equations of both sides of ``pairs``, in the names of the mechanism of ``equations``; a text is a name."""
    paper = _Paper(equations)
    sides = ((sp.Symbol(left) if isinstance(left, str) else left, right) for left, right in pairs)
    return tuple(paper.equation(left, right) for left, right in sides)


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
        *(g.subtract(Q, f) for Q, f in zip(v.Q, equations.forcing, strict=True)),
        *_borne(equations),
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
    carrying = [sp.Symbol(names.drive(name), real=True) for name in carried(equations.mechanism)]
    drives = tuple((force, next(texts)) for force in carrying)
    return Expressions(printed, matrix, motion, further, tuple(texts), drives)


def energies(equations: EquationsOfMotion, most: int) -> dict[str, sp.Expr]:
    """{'T': kinetic, 'V': potential energy}, in J; nothing if they have more than ``most`` operations together.

    There is none for a mechanism of which the Lagrangian alone is given.
    """
    equations = equations.apart()
    nodes = [equations.energies[name] for name in _ENERGIES.values() if name in equations.energies]
    operations = written_operations(equations.graph, nodes)
    if operations > most:
        return {}
    return dict(zip(_ENERGIES, _read(equations.graph, nodes, operations, ()), strict=len(nodes) == len(_ENERGIES)))


def _triangle(n: int) -> list[tuple[int, int]]:
    """The places in the lower triangle of a matrix (n, n), row by row."""
    return [(i, j) for i in range(n) for j in range(i + 1)]


def _motion(
    equations: EquationsOfMotion, texts: Iterator[sp.Expr]
) -> tuple[sp.ImmutableMatrix, tuple[tuple[sp.Expr, sp.Expr], ...]]:
    """M (n, n) and the sides (left, right) of the equations of motion (n,).

    Reads from ``texts`` the lower triangle of M, what stands beside M qdd, and what ``_borne`` lists. The left sides
    have inertia and potentials, the right ones the external forces Q and those of constraints and contacts.
    """
    g, v = equations.graph, equations.variables
    n = len(v.q)
    lower = {place: next(texts) for place in _triangle(n)}
    matrix = sp.ImmutableMatrix(n, n, lambda i, j: lower[max(i, j), min(i, j)])
    qdd, forces = ([sp.Symbol(str(g.leaf[node]), real=True) for node in group] for group in (v.qdd, v.Q))
    inertial = [sp.Add(*(matrix[i, j] * qdd[j] for j in range(n)), next(texts)) for i in range(n)]
    reactions = [next(texts) for _ in range(n)]
    borne = [[symbol(force) * next(texts) for _ in range(n)] for force in (str(g.leaf[node]) for node in v.forces)]
    right = (sp.Add(Q, R, *row) for Q, R, *row in zip(forces, reactions, *borne, strict=True))
    return matrix, tuple(zip(inertial, right, strict=True))


def _read(graph: Graph, nodes: Sequence[Node], operations: int, targets: Sequence[str]) -> Iterator[sp.Expr]:
    """The ``nodes`` as expressions, tidied if they have no more than MAX_OPERATIONS operations together.

    ``targets`` are what filtered motions follow; their time derivatives are named as those of coordinates are.
    """
    rates = {symbol(names.rate(t)): symbol(names.velocity(t)) for t in targets}
    rates |= {symbol(names.rate(names.rate(t))): symbol(names.acceleration(t)) for t in targets}
    found = [x.xreplace(rates) for x in written(graph, nodes)]
    return iter(found) if operations > MAX_OPERATIONS else map(tidy, found)


def _borne(equations: EquationsOfMotion) -> list[Node]:
    """G^T multiplier, (n,), and behind it the rows, (n,) each, along which contacts and their like act."""
    g, v = equations.graph, equations.variables
    columns = zip(*equations.constraints.jacobian, strict=True) if len(equations.constraints) else [()] * len(v.q)
    return [*(g.dot(v.multipliers, column) for column in columns), *(x for row in equations.rows.jacobian for x in row)]


_ENERGIES = {"T": "kinetic_energy", "V": "potential_energy"}


def _dotted(m: Mechanism) -> dict[str, tuple[str, int]]:
    """{name of a rate: (what it is the rate of, number of dots)}."""
    moving = [*(q.name for q in m.coordinates), *m.driven, *map(names.target, m.filtered)]
    found = {names.velocity(name): (name, 1) for name in moving}
    found |= {names.acceleration(name): (name, 2) for name in moving}
    found |= {names.derivative(z.name): (z.name, 1) for z in m.states}
    return found | {names.derivative(names.velocity(name)): (name, 2) for name in m.filtered}


class _Paper:
    """Prints formulas with dots for velocities and accelerations."""

    def __init__(self, equations: EquationsOfMotion) -> None:
        from sympy.printing.latex import LatexPrinter
        from sympy.printing.mathml import MathMLPresentationPrinter

        dotted = _dotted(equations.mechanism)

        class Latex(LatexPrinter):  # type: ignore[misc]
            def _print_Symbol(self, symbol: sp.Symbol, style: str = "plain") -> str:
                return latex_name(*dotted.get(symbol.name, (symbol.name, 0)))

        class MathML(MathMLPresentationPrinter):  # type: ignore[misc]
            def _print_Symbol(self, symbol: sp.Symbol, style: str = "plain") -> Any:
                name, dots = dotted.get(symbol.name, (symbol.name, 0))
                head, indices = split(name)
                plain = self._leaf("mn" if head[0].isdigit() else "mi", letter(head))
                plain = self._pair("mover", plain, self._leaf("mo", "\u02d9\u00a8"[dots - 1])) if dots else plain
                return self._pair("msub", plain, self._row(indices)) if indices else plain

            def _row(self, indices: tuple[str, ...]) -> Any:
                row = self.dom.createElement("mrow")
                for k, index in enumerate(indices):
                    if k:
                        row.appendChild(self._leaf("mo", ","))
                    row.appendChild(self._leaf("mn", index) if index.isdigit() else self._print(sp.Symbol(index)))
                return row

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
        left, right = with_decimals(left, alike=True), with_decimals(right, alike=True)
        sides = [self._mathml._print(side).toxml().replace("&InvisibleTimes;", "\u2062") for side in (left, right)]
        latex = " = ".join(self._latex.doprint(side) for side in (left, right))
        return Formula(latex, f"<mrow>{sides[0]}<mo>=</mo>{sides[1]}</mrow>")
