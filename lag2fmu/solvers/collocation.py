"""Implicit Runge-Kutta methods by collocation: coefficients from their abscissae, by exact integration of polynomials.

A method is one entry of COLLOCATIONS. Coefficients are derived when they are asked for, and tests derive orders from
them (``check``). Abscissae with roots are fractions of 50 digits; they are rounded to double precision once, when they
are printed.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from decimal import Context, Decimal
from fractions import Fraction
from functools import cache
from typing import NamedTuple, TypeVar

from lag2fmu.solvers.order_conditions import order_of

Row = tuple[Fraction, ...]
Number = TypeVar("Number", float, complex)


class Collocation(NamedTuple):
    """A method of s stages with the abscissae ``c`` (s,).

    - ``nodes`` (k,): the times from 0 to 1 in a step at which the constraints of a variational method hold. Such a
      method comes from a discrete action; it works on momenta, with steps of fixed length.
    - ``error_order``: the order of the error estimate of any other method.
    - ``solver``: the name on the command line; ``source``: the publication of the method.
    """

    solver: str
    title: str
    source: str
    order: int
    c: Row
    nodes: Row = ()
    error_order: int = 0
    safety: float = 0.9
    generated_files: tuple[str, ...] = ("collocation.c",)

    def check(self) -> None:
        """Raise ValueError unless the method has the order that is claimed; that of a pair follows from others."""
        if self.a == self.hat and (derived := order_of(self.a, self.b, self.order + 1)) != self.order:
            raise ValueError(f"method '{self.solver}': b has order {derived}, not {self.order}")

    @property
    def a(self) -> tuple[Row, ...]:
        """The matrix (s, s) of the collocation method."""
        return _integrals(self.c, self.c)

    @property
    def b(self) -> Row:
        """The weights (s,) of the collocation method."""
        return _weights(self.c)

    @property
    def hat(self) -> tuple[Row, ...]:
        """The ``a`` of the velocities (s, s): of a variational method the one that is a symplectic pair with ``a``.

        b_i hat_ij + b_j a_ji = b_i b_j: Hairer, Lubich, Wanner, Geometric Numerical Integration, VI.4.6.
        """
        a, b, size = self.a, self.b, range(self.stages)
        if not self.variational:
            return a
        hat = tuple(tuple(b[j] - b[j] * a[j][i] / b[i] for j in size) for i in size)
        own = all(abs(a[i][j] - hat[i][j]) < Fraction(1, 10**40) for i in size for j in size)
        return a if own else hat

    @property
    def variational(self) -> bool:
        """Whether the method comes from a discrete action."""
        return bool(self.nodes)

    @property
    def stages(self) -> int:
        """The number of stages."""
        return len(self.c)

    @property
    def all_stages(self) -> int:
        """The number of all stages; dense output needs none beside those of the method."""
        return self.stages

    @property
    def dense_order(self) -> int:
        """The order of the velocities in Hermite's quintic of the coordinates; 0 (no dense output) for fixed steps."""
        return 0 if self.variational else 4

    @property
    def dense_rows(self) -> int:
        """The terms of the quintic beyond the cubic."""
        return 0 if self.variational else 2

    @property
    def implicit(self) -> bool:
        """Whether Jacobians of the accelerations are needed."""
        return not self.variational

    @property
    def node_a(self) -> tuple[Row, ...]:
        """The matrix (k, s) that gives the positions at the nodes by the velocities at the stages."""
        return _integrals(self.c, self.nodes)

    @property
    def node_b(self) -> Row:
        """The weights of forces at the nodes over the whole step, (k,)."""
        return _weights(self.nodes)

    @property
    def node_hat(self) -> tuple[Row, ...]:
        """The matrix (s, k), of a symplectic method, that gives the momenta at the stages by forces at the nodes."""
        return tuple(
            tuple(d - d * row[i] / b for d, row in zip(self.node_b, self.node_a, strict=True))
            for i, b in enumerate(self.b)
        )

    @property
    def node_weights(self) -> tuple[Row, ...]:
        """The inverse (k - 1, k - 1) of the matrix from forces at nodes 1 ... k - 1 to positions at nodes 2 ... k.

        Source: L. O. Jay, SIAM J. Numer. Anal. 33 (1996), pp. 368-387 (Lobatto IIIA-IIIB) and 45 (2007), pp. 1814-1842
        (Gauss-Lobatto).
        """
        columns = list(zip(*self.node_hat, strict=True))[:-1]
        return _inverse([[_row_product(row, column) for column in columns] for row in self.node_a[1:]])

    @property
    def squared(self) -> tuple[Row, ...]:
        """The matrix a a (s, s), from the accelerations to the positions at the stages."""
        columns = list(zip(*self.a, strict=True))
        return tuple(tuple(_row_product(row, column) for column in columns) for row in self.a)

    @property
    def modes(self) -> StageModes | None:
        """The matrices that decouple the stages of radau5, see ``modes_of``; None for variational methods."""
        return None if self.variational else modes_of(self.a)

    @property
    def family(self) -> str:
        """The folder of templates/engine/integrate/methods that takes steps with these coefficients."""
        return "variational" if self.variational else "radau"


class StageModes(NamedTuple):
    """a = from_modes . diag(real, [[x, y], [-y, x]]) . to_modes for a of 3 stages; ``pair`` is (x, y).

    ``to_modes`` and ``from_modes`` are (3, 3).
    """

    real: float
    pair: tuple[float, float]
    to_modes: tuple[tuple[float, ...], ...]
    from_modes: tuple[tuple[float, ...], ...]


def modes_of(a: Sequence[Row]) -> StageModes:
    """The modes of ``a`` (3, 3), which has one real eigenvalue and a complex pair, with real and imaginary parts apart.

    The computation uses elementary operations only, so that the digits are the same on every machine. Source: Hairer,
    Wanner, Solving Ordinary Differential Equations II, 2nd edition, section IV.8.
    """
    rows = [[float(x) for x in row] for row in a]
    trace = sum(rows[i][i] for i in range(3))
    minors = sum(rows[i][i] * rows[j][j] - rows[i][j] * rows[j][i] for i, j in ((0, 1), (1, 2), (2, 0)))
    determinant = _dot(rows[0], _cross(rows[1], rows[2]))
    real = trace / 3
    for _ in range(50):  # Newton's method on the characteristic polynomial
        real -= (((real - trace) * real + minors) * real - determinant) / ((3 * real - 2 * trace) * real + minors)
    x = (trace - real) / 2
    pair = complex(x, math.sqrt(minors - 2 * real * x - x * x))
    u, v = _null_vector(rows, complex(real)), _null_vector(rows, pair)
    columns = [[z.real for z in u], [z.real for z in v], [z.imag for z in v]]
    volume = _dot(columns[0], _cross(columns[1], columns[2]))
    inverse = [[z / volume for z in _cross(columns[i - 2], columns[i - 1])] for i in range(3)]
    return StageModes(real, (pair.real, pair.imag), _frozen(inverse), _frozen(zip(*columns, strict=True)))


def _null_vector(rows: Sequence[Sequence[float]], value: complex) -> list[complex]:
    """An eigenvector: the first two rows of a - value I are independent."""
    first, second = ([x - value * (i == k) for k, x in enumerate(rows[i])] for i in range(2))
    return _cross(first, second)


def _cross(a: Sequence[Number], b: Sequence[Number]) -> list[Number]:
    return [a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)]


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))


def _frozen(rows: Iterable[Sequence[float]]) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in rows)


def _row_product(row: Sequence[Fraction], column: Sequence[Fraction]) -> Fraction:
    return sum((x * y for x, y in zip(row, column, strict=True)), Fraction(0))


def _inverse(matrix: Sequence[Sequence[Fraction]]) -> tuple[Row, ...]:
    """The exact inverse of ``matrix`` by Gauss-Jordan elimination; its leading minors must not be 0."""
    size = len(matrix)
    rows = [[*row, *(Fraction(i == j) for j in range(size))] for i, row in enumerate(matrix)]
    for k, pivot in enumerate(rows):
        pivot[:] = [x / pivot[k] for x in pivot]
        for row in rows[:k] + rows[k + 1 :]:
            row[:] = [x - row[k] * y for x, y in zip(row, pivot, strict=True)]
    return tuple(tuple(row[size:]) for row in rows)


def _root(number: int) -> Fraction:
    """The square root with 50 digits."""
    return Fraction(Context(prec=50).sqrt(Decimal(number)))


def _integral(nodes: Sequence[Fraction], j: int, end: Fraction) -> Fraction:
    """The integral from 0 to ``end`` of the polynomial that is 1 at node j and 0 at the others."""
    coefficients = [Fraction(1)]
    for k, node in enumerate(nodes):
        if k != j:
            scale = nodes[j] - node
            shifted = [Fraction(0), *coefficients]
            coefficients = [(x - node * y) / scale for x, y in zip(shifted, [*coefficients, Fraction(0)], strict=True)]
    return sum((x * end ** (power + 1) / (power + 1) for power, x in enumerate(coefficients)), Fraction(0))


@cache
def _integrals(nodes: Row, ends: Row) -> tuple[Row, ...]:
    """The weights (ends, nodes) of the integrals, from 0 to each of ``ends``, of a function known at the ``nodes``."""
    return tuple(tuple(_integral(nodes, j, end) for j in range(len(nodes))) for end in ends)


def _weights(nodes: Row) -> Row:
    """The weights of the integral from 0 to 1 of a function known at the ``nodes``."""
    return _integrals(nodes, (Fraction(1),))[0]


_ACTION = "J. E. Marsden, M. West, Discrete mechanics and variational integrators, Acta Numerica 2001"


def _variational(solver: str, title: str, order: int, nodes: Row) -> Collocation:
    """A method with stages at ``nodes``. Constraints hold there, or at Lobatto's nodes if 0 and 1 are no nodes."""
    ends = nodes if nodes[0] == 0 else _LOBATTO[len(nodes) + 1]
    return Collocation(solver, title, _ACTION, order, nodes, ends)


def _radau(solver: str, title: str, nodes: Row) -> Collocation:
    source = "E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd edition, section IV.8"
    return Collocation(solver, title, source, 2 * len(nodes) - 1, nodes, error_order=3)


_HALF, _THREE, _FIVE, _SIX, _FIFTEEN = Fraction(1, 2), _root(3), _root(5), _root(6), _root(15)
_LOBATTO = {
    2: (Fraction(0), Fraction(1)),
    3: (Fraction(0), _HALF, Fraction(1)),
    4: (Fraction(0), _HALF - _FIVE / 10, _HALF + _FIVE / 10, Fraction(1)),
}

COLLOCATIONS: dict[str, Collocation] = {
    method.solver: method
    for method in (
        _radau("radau5", "Radau IIA, adaptive, for stiff mechanisms", ((4 - _SIX) / 10, (4 + _SIX) / 10, Fraction(1))),
        _variational("verlet", "Stoermer-Verlet, variational, fixed step", 2, _LOBATTO[2]),
        _variational("lobatto4", "Lobatto IIIA-IIIB, variational, fixed step", 4, _LOBATTO[3]),
        _variational("midpoint", "implicit midpoint rule, variational, fixed step", 2, (_HALF,)),
        _variational("gauss4", "Gauss, variational, fixed step", 4, (_HALF - _THREE / 6, _HALF + _THREE / 6)),
        _variational(
            "gauss6", "Gauss, variational, fixed step", 6, (_HALF - _FIFTEEN / 10, _HALF, _HALF + _FIFTEEN / 10)
        ),
    )
}
"""Methods by the name that ``--solver`` takes."""
