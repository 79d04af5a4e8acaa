"""Explicit Runge-Kutta methods as Butcher tableaus: exact coefficients that check themselves.

A method is one entry of METHODS. Its order is derived from the coefficients by the order conditions (rooted trees up to
order 5) in exact arithmetic; an entry whose claim is false cannot be built.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache

Row = tuple[Fraction, ...]


@dataclass(frozen=True)
class Tableau:
    """An explicit method of s ``stages``: ``a`` (s, s) strictly lower triangular, ``b`` (s,), ``c`` = row sums of a.

    ``embedded`` (s,) are the weights of the method for the error estimate, of order ``error_order``; None for a fixed
    step. ``solver`` is the name on the command line, ``source`` where the coefficients come from.
    """

    solver: str
    title: str
    source: str
    order: int
    a: tuple[Row, ...]
    b: Row
    embedded: Row | None = None
    error_order: int = 0

    def __post_init__(self) -> None:
        """Raise ValueError unless the coefficients have the shape and the orders that are claimed."""
        if any(entry for i, row in enumerate(self.a) for entry in row[i:]):
            raise ValueError(f"tableau '{self.solver}': a is not strictly lower triangular")
        claims = [(self.b, self.order, "b")]
        if self.embedded is not None:
            claims.append((self.embedded, self.error_order, "embedded"))
        for weights, claimed, label in claims:
            derived = order_of(self.a, weights)
            if derived != claimed:
                raise ValueError(f"tableau '{self.solver}': {label} has order {derived}, not {claimed}")

    @property
    def stages(self) -> int:
        """The number of stages."""
        return len(self.b)

    @property
    def c(self) -> Row:
        """The abscissae, (s,)."""
        return tuple(sum(row, Fraction(0)) for row in self.a)

    @property
    def error_weights(self) -> Row | None:
        """b - embedded, (s,), the weights of the error estimate; None for a fixed step."""
        return None if self.embedded is None else tuple(x - y for x, y in zip(self.b, self.embedded, strict=True))

    @property
    def first_same_as_last(self) -> bool:
        """Whether the last stage is the first stage of the next step."""
        return self.a[-1] == self.b and self.c[-1] == 1


# ---------------------------------------------------------------------------------------------------- order conditions

Tree = tuple["Tree", ...]


@cache
def _trees(order: int) -> tuple[Tree, ...]:
    """All rooted trees with ``order`` nodes, each as the sorted tuple of its subtrees."""
    return tuple(sorted(_forests(order - 1, order - 1)))


def _forests(total: int, largest: int) -> set[Tree]:
    """All multisets of trees with ``total`` nodes together, none larger than ``largest``."""
    if total == 0:
        return {()}
    return {
        tuple(sorted((tree, *rest)))
        for size in range(1, min(total, largest) + 1)
        for tree in _trees(size)
        for rest in _forests(total - size, size)
    }


def _size(tree: Tree) -> int:
    return 1 + sum(_size(subtree) for subtree in tree)


def _density(tree: Tree) -> int:
    density = _size(tree)
    for subtree in tree:
        density *= _density(subtree)
    return density


def _elementary_weights(tree: Tree, a: Sequence[Row]) -> list[Fraction]:
    """The product over the subtrees of a times their own weights, for each stage."""
    weights = [Fraction(1)] * len(a)
    for subtree in tree:
        inner = _elementary_weights(subtree, a)
        weights = [
            w * sum((x * y for x, y in zip(row, inner, strict=True)), Fraction(0))
            for w, row in zip(weights, a, strict=True)
        ]
    return weights


def order_of(a: Sequence[Row], b: Row, limit: int = 6) -> int:
    """The order of the method (a, b), at most ``limit``: sum b_i Phi_i(tree) = 1 / density(tree) for all trees.

    Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.2, theorem 2.13.
    """
    for order in range(1, limit + 1):
        for tree in _trees(order):
            weights = _elementary_weights(tree, a)
            if sum((x * y for x, y in zip(b, weights, strict=True)), Fraction(0)) != Fraction(1, _density(tree)):
                return order - 1
    return limit


# ----------------------------------------------------------------------------------------------------------- the data


def _rows(text: str) -> tuple[Row, ...]:
    """Rows of fractions, one a line, padded with zeros to a square."""
    rows = [[Fraction(entry) for entry in line.split()] for line in text.strip().splitlines()]
    size = len(rows) + 1
    return tuple(tuple(row + [Fraction(0)] * (size - len(row))) for row in [[], *rows])


def _row(text: str) -> Row:
    return tuple(Fraction(entry) for entry in text.split())


METHODS: dict[str, Tableau] = {
    tableau.solver: tableau
    for tableau in (
        Tableau(
            solver="dopri5",
            title="Dormand-Prince 5(4), adaptive",
            source="J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6 (1980) 19-26, table 2",
            order=5,
            error_order=4,
            a=_rows("""
                1/5
                3/40        9/40
                44/45      -56/15       32/9
                19372/6561 -25360/2187  64448/6561 -212/729
                9017/3168  -355/33      46732/5247  49/176  -5103/18656
                35/384      0           500/1113    125/192 -2187/6784   11/84
            """),
            b=_row("35/384 0 500/1113 125/192 -2187/6784 11/84 0"),
            embedded=_row("5179/57600 0 7571/16695 393/640 -92097/339200 187/2100 1/40"),
        ),
        Tableau(
            solver="rk4",
            title="classical Runge-Kutta method, fixed step",
            source="W. Kutta, Z. Math. Phys. 46 (1901) 435-453",
            order=4,
            a=_rows("1/2\n0 1/2\n0 0 1"),
            b=_row("1/6 1/3 1/3 1/6"),
        ),
    )
}
"""The solvers of co-simulation, by name."""

DEFAULT_SOLVER = "dopri5"
