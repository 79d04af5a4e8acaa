"""Accelerations and multipliers under constraints as one formula, by the Schur complement of M in the KKT matrix.

From M qdd = forcing + G^T multiplier and G qdd = below, where below is -gamma, follows

    S multiplier = below - G M^-1 forcing,   S = G M^-1 G^T,   qdd = M^-1 forcing + M^-1 G^T multiplier.

M^-1 is applied by the same elimination as without constraints, so that zeros in M and G cost nothing. S is solved by
L D L^T; the order of its rows is the best one at the start. Rows that are redundant at the start are left out. The
formula also returns numbers that say where it does not hold: where M or S has a pivot near zero, and where a row that
was left out becomes independent. There the engine factorises with pivoting instead.
Source: R. Featherstone, Rigid Body Dynamics Algorithms, section 3.6; Golub, Van Loan, Matrix Computations, section 4.1.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from lag2fmu.dynamics.elimination import solve
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.parts import Solution
from lag2fmu.dynamics.starts import start_values
from lag2fmu.errors import DerivationError
from lag2fmu.graph.batches import Floats
from lag2fmu.graph.graph import Graph, Node

CLEAR = 1e-3
"""Relative to its diagonal entry in S: a row with a greater pivot is clearly independent."""

MOST_OPERATIONS = 8000
"""The most operations of a formula. A longer one compiles slowly and is no faster than the engine's loops."""

_LEAST = 1e-8
"""Relative to its diagonal entry in S: a row with a smaller pivot at the start is redundant."""


@dataclass(frozen=True)
class ConstrainedSolution:
    """``unknowns``: qdd and multipliers, (n + m,).

    The unknowns hold under three conditions. The ``pivots`` (n,) of M are positive. All ``margins`` (m,) are positive:
    they say by how far each row is still as independent, or as redundant, as at the start. The ``squares`` (m,) have
    not shrunk: they are the squared distances of each row from the span of the rows before it, in the metric M^-1. The
    squares of rows that are left out are 0.
    """

    unknowns: tuple[Node, ...]
    pivots: tuple[Node, ...]
    margins: tuple[Node, ...]
    squares: tuple[Node, ...]


def solve_constrained(equations: EquationsOfMotion, drift: Sequence[Node]) -> ConstrainedSolution | None:
    """The solution with G qdd + gamma + ``drift`` = 0, (m,) nodes.

    None if M is singular everywhere, if a row has nothing to act on at the start, or if the formula has more than
    MOST_OPERATIONS. Source: see ``Saddle``.
    """
    saddle = factorised(equations)
    found = saddle and saddle.accelerations(drift)
    return found if found and equations.graph.operations((*found.unknowns, *found.margins)) <= MOST_OPERATIONS else None


def factorised(equations: EquationsOfMotion) -> Saddle | None:
    """The KKT matrix of ``equations``; None if M is singular everywhere or a row has nothing to act on at the start."""
    graph, jacobian = equations.graph, equations.constraints.jacobian
    rights = (equations.forcing, *jacobian)
    solutions = [x for right in rights if (x := _without_constraints(equations, right)) is not None]
    if len(solutions) < len(rights):
        return None
    free, *responses = solutions
    matrix = [[graph.dot(row, response.x) for response in responses[: i + 1]] for i, row in enumerate(jacobian)]
    values = graph.evaluate([entry for row in matrix for entry in row], start_values(equations.mechanism))
    ranked = _ranked(np.array(values), len(jacobian))
    return Saddle(equations, free, responses, _Decomposition(graph, matrix, *ranked)) if ranked else None


def _without_constraints(equations: EquationsOfMotion, right: Sequence[Node]) -> Solution | None:
    """x of M x = ``right``, (n,) nodes."""
    early = equations.method == "elimination"
    return solve(equations.graph, equations.entries, equations.variables.qd, right, early)


class Saddle:
    """The KKT matrix of M a - G^T b = force, G a + rest = 0, factorised by its Schur complement.

    Source: S of the module's head; its rows are ordered by pivoting as in Golub, Van Loan, Matrix Computations, section
    4.2 (positive semidefinite systems).
    """

    def __init__(
        self, equations: EquationsOfMotion, free: Solution, responses: Sequence[Solution], work: _Decomposition
    ) -> None:
        """Keep M^-1 forcing, M^-1 G^T, a solution for each row of G, and S."""
        self._equations, self._free, self._responses, self._work = equations, free, responses, work

    def accelerations(self, drift: Sequence[Node]) -> ConstrainedSolution:
        """The solution of the equations with G qdd + gamma + ``drift`` = 0, (m,) nodes."""
        work = self._work
        unknowns = self._bound(self._free, zip(drift, self._equations.constraints.accelerations, strict=True))
        return ConstrainedSolution(unknowns, self._free.pivots, work.margins(), work.squares())

    def unknowns(self, forces: Sequence[Node], rests: Sequence[Node]) -> tuple[Node, ...]:
        """a and b, (n + m,), for ``forces`` (n,) and ``rests`` (m,) nodes.

        Raises DerivationError where the mass matrix is singular.
        """
        free = _without_constraints(self._equations, forces)
        if free is None:  # M is the one that gave the responses
            name = self._equations.mechanism.name
            raise DerivationError(f"mechanism '{name}': the mass matrix is singular; give masses")
        return self._bound(free, ((rest,) for rest in rests))

    def _bound(self, free: Solution, rests: Iterable[Sequence[Node]]) -> tuple[Node, ...]:
        """a and b, (n + m,), from M^-1 force and the terms of each entry of rest."""
        graph, work = self._equations.graph, self._work
        rows = zip(rests, self._equations.constraints.jacobian, strict=True)
        found = work.solve([graph.negate(graph.total([*rest, graph.dot(row, free.x)])) for rest, row in rows])
        used = [(found[k], self._responses[k].x) for k in work.order[: work.rank]]
        qdd = (graph.total([x, *(graph.multiply(b, held[i]) for b, held in used)]) for i, x in enumerate(free.x))
        return (*qdd, *found)


def _ranked(triangle: Floats, m: int) -> tuple[list[int], int] | None:
    """The order of the rows that pivoting gives, and how many are independent; S (m, m) is given by its lower triangle.

    S is scaled to a unit diagonal first. None if an entry is not finite or a diagonal entry is not positive.
    """
    S = np.zeros((m, m))
    S[np.tril_indices(m)] = triangle
    if not np.isfinite(S).all() or not (np.diag(S) > 0).all():
        return None
    S = S + np.tril(S, -1).T
    S /= np.sqrt(np.outer(np.diag(S), np.diag(S)))
    order: list[int] = []
    while len(order) < m:
        left = [k for k in range(m) if k not in order]
        best = max(left, key=lambda k: (round(float(S[k, k]), 9), -k))
        if not S[best, best] > _LEAST:
            return [*order, *left], len(order)
        S = S - np.outer(S[best], S[best]) / S[best, best]
        order.append(best)
    return order, m


class _Decomposition:
    """L D L^T of the first ``rank`` rows of S in the ``order``; the other rows get a pivot only."""

    def __init__(self, graph: Graph, matrix: Sequence[Sequence[Node]], order: Sequence[int], rank: int) -> None:
        self.g, self.order, self.rank = graph, order, rank
        self.whole = [matrix[k][k] for k in order]
        self.lower: list[list[Node]] = []
        self.pivots: list[Node] = []
        self.inverses: list[Node] = []
        for i, row in enumerate(order):
            scaled: list[Node] = []  # (L D)_ij
            factors: list[Node] = []  # L_ij
            for j in range(min(i, rank)):
                known = matrix[max(row, order[j])][min(row, order[j])]
                entry = graph.subtract(known, graph.dot(scaled, self.lower[j]))
                scaled.append(entry)
                factors.append(graph.multiply(entry, self.inverses[j]))
            self.lower.append(factors)
            self.pivots.append(graph.subtract(self.whole[i], graph.dot(scaled, factors)))
            if i < rank:
                self.inverses.append(graph.divide(graph.one, self.pivots[i]))

    def solve(self, right: Sequence[Node]) -> list[Node]:
        """x of S x = ``right``, (m,), zero in the rows that were left out."""
        g, rank = self.g, self.rank
        forward: list[Node] = []
        for i in range(rank):
            forward.append(g.subtract(right[self.order[i]], g.dot(self.lower[i], forward)))
        found = [g.zero] * len(self.order)
        for i in reversed(range(rank)):
            above = [g.multiply(self.lower[j][i], found[self.order[j]]) for j in range(i + 1, rank)]
            found[self.order[i]] = g.subtract(g.multiply(forward[i], self.inverses[i]), g.total(above))
        return found

    def margins(self) -> tuple[Node, ...]:
        """How far the pivot of each row is above CLEAR of its diagonal entry, or below it for rows left out, (m,)."""
        g, clear = self.g, self.g.constant(CLEAR)
        margins = [g.zero] * len(self.order)
        for i, (row, pivot, whole) in enumerate(zip(self.order, self.pivots, self.whole, strict=True)):
            bar = g.multiply(clear, whole)
            margins[row] = g.subtract(pivot, bar) if i < self.rank else g.subtract(bar, pivot)
        return tuple(margins)

    def squares(self) -> tuple[Node, ...]:
        """The pivot of each row, 0 for rows that are left out, (m,)."""
        pivots = dict(zip(self.order[: self.rank], self.pivots, strict=False))
        return tuple(pivots.get(row, self.g.zero) for row in range(len(self.order)))
