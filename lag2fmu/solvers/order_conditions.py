"""The order of a Runge-Kutta method and of its interpolant, derived from the coefficients by rooted trees.

Numbers are integers in units of 10**-DIGITS, so that published coefficients of any length keep all their digits.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition, section II.2,
theorem 2.13 (the method), and section II.6, equation 6.9 (the interpolant).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from functools import cache
from itertools import count
from operator import mul

Row = Sequence[Fraction]
Tree = tuple["Tree", ...]
Fixed = list[int]
"""Numbers in units of 10**-DIGITS. In a polynomial the constant coefficient comes first."""
Holds = Callable[[Fixed, int, int], bool]
"""(coefficients of sum b_i(theta) Phi_i(tree), 1 / density(tree), size of the tree) -> whether the condition holds."""

DIGITS = 50
UNIT: int = 10**DIGITS
MET: int = 10**26
"""The tolerance, 10**-24, within which a condition holds; published coefficients of 28 digits are within it."""


def order_of(a: Sequence[Row], b: Row, limit: int) -> int:
    """The order of the method (a, b) of s stages, at most ``limit``: sum b_i Phi_i(tree) = 1 / density(tree).

    ``a`` is (s, s), ``b`` (s,). Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.2.
    """
    polynomials = [[0, weight] for weight in _fixed(b)]  # at the end of the step all powers of theta are 1
    return _highest_order(a, polynomials, limit, lambda sums, goal, _: abs(sum(sums) - goal) < MET)


def dense_order_of(a: Sequence[Row], b: Row, rows: Sequence[Row], limit: int) -> int:
    """The order, at most ``limit``, of the interpolant that continues Hermite's cubic by ``rows`` (r, s).

    The last row of ``a`` (s, s) that equals b is the stage at the end of the step. With theta = 0 ... 1 in a step of
    length h the interpolant is the nested expression

        x + theta (F_0 + (1 - theta) (F_1 + theta (F_2 + (1 - theta) (F_3 + theta (F_4 + ...)))))

    F_0 = x_new - x, F_1 = h f - F_0, F_2 = F_0 - h f_new - F_1, F_(3+j) = h sum_i rows_ji k_i. In the conditions
    b_i becomes a polynomial b_i(theta) and the right side theta^size / density. Source: Hairer, Norsett, Wanner,
    Solving Ordinary Differential Equations I, section II.6.
    """

    def holds(sums: Fixed, goal: int, size: int) -> bool:
        return all(abs(total - (goal if power == size else 0)) < MET for power, total in enumerate(sums))

    return _highest_order(a, _interpolant(a, b, rows), limit, holds)


def stability_interval(a: Sequence[Row], b: Row) -> float:
    """The largest x with |R| <= 1 on [-x, 0], where R(z) = 1 + sum_k z^k b a^(k-1) (1, ..., 1) of an explicit method.

    Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd edition, section IV.2.
    """
    coefficients, powers = [1.0], [Fraction(1)] * len(b)
    for _ in b:
        coefficients.append(float(_product(b, powers)))
        powers = [_product(row, powers) for row in a]

    def grows(x: float) -> bool:
        return abs(sum(c * (-x) ** k for k, c in enumerate(coefficients))) > 1 + 1e-12

    inside = next(number for number in count() if grows((number + 1) * 1e-2)) * 1e-2
    outside = inside + 1e-2
    while outside - inside > 1e-9:
        middle = (inside + outside) / 2
        inside, outside = (inside, middle) if grows(middle) else (middle, outside)
    return inside


def _product(row: Row, column: Row) -> Fraction:
    return sum((x * y for x, y in zip(row, column, strict=False) if x and y), Fraction(0))


def _interpolant(a: Sequence[Row], b: Row, rows: Sequence[Row]) -> list[Fixed]:
    """b_i(theta) for each stage."""
    stages = len(a)
    last = max(i for i, row in enumerate(a) if [*row][: len(b)] == [*b])
    weights = [*_fixed(b), *[0] * (stages - len(b))]
    first, end = ([UNIT * (i == at) for i in range(stages)] for at in (0, last))
    terms = [
        weights,
        [f - w for f, w in zip(first, weights, strict=True)],
        [2 * w - f - e for w, f, e in zip(weights, first, end, strict=True)],
        *map(_fixed, rows),
    ]
    result = [[0] * (len(terms) + 1) for _ in range(stages)]
    basis = [0, 1, *[0] * (len(terms) - 1)]
    for number, term in enumerate(terms):
        for polynomial, weight in zip(result, term, strict=True):
            for power, factor in enumerate(basis):
                polynomial[power] += weight * factor
        shifted = [0, *basis[:-1]]
        basis = shifted if number % 2 else [x - y for x, y in zip(basis, shifted, strict=True)]
    return result


# --------------------------------------------------------------------------------------------------------- conditions


def _highest_order(a: Sequence[Row], polynomials: Sequence[Fixed], limit: int, holds: Holds) -> int:
    """The highest order, at most ``limit``, such that all trees up to this order satisfy ``holds``."""
    stages = _Stages(a)
    powers = range(len(polynomials[0]))
    for order in range(1, limit + 1):
        for tree in trees(order):
            weights = stages.weights(tree)
            sums = [_dot([p[power] for p in polynomials[: len(weights)]], weights) for power in powers]
            if not holds(sums, UNIT // density(tree), order):
                return order - 1
    return limit


class _Stages:
    """The elementary weights Phi of trees for each stage, kept because trees share subtrees."""

    def __init__(self, a: Sequence[Row]) -> None:
        self.a = [_fixed(row) for row in a]
        self.sums: dict[Tree, Fixed] = {}

    def weights(self, tree: Tree) -> Fixed:
        """The product over the subtrees of a times their own weights, (s,)."""
        product = [UNIT] * len(self.a)
        for subtree in tree:
            if subtree not in self.sums:
                inner = self.weights(subtree)
                self.sums[subtree] = [_dot(row, inner) for row in self.a]
            product = [x * y // UNIT for x, y in zip(product, self.sums[subtree], strict=True)]
        return product


def _dot(x: Sequence[int], y: Sequence[int]) -> int:
    total: int = sum(map(mul, x, y))
    return total // UNIT


def _fixed(row: Row) -> Fixed:
    return [round(entry * UNIT) for entry in row]


# -------------------------------------------------------------------------------------------------------------- trees


@cache
def trees(order: int) -> tuple[Tree, ...]:
    """All rooted trees with ``order`` nodes, each as the sorted tuple of its subtrees: Hairer et al. I, II.2."""
    return tuple(sorted(set(_forests(order - 1, order - 1))))


def _forests(total: int, largest: int) -> Iterator[Tree]:
    """All multisets of trees with ``total`` nodes together, none larger than ``largest``."""
    if total == 0:
        yield ()
    for size in range(1, min(total, largest) + 1):
        for tree in trees(size):
            for rest in _forests(total - size, size):
                yield tuple(sorted((tree, *rest)))


def _size(tree: Tree) -> int:
    return 1 + sum(_size(subtree) for subtree in tree)


def density(tree: Tree) -> int:
    """The number of nodes times the densities of the subtrees: gamma in Hairer et al. I, II.2."""
    result = _size(tree)
    for subtree in tree:
        result *= density(subtree)
    return result
