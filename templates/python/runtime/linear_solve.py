"""M a = b for the mass matrix: L D L^T without pivoting, or full pivoting if a pivot is doubtful.

Source: Golub and Van Loan, Matrix Computations, 4th edition, sections 4.1 and 3.4.
"""

from __future__ import annotations

import math
from sys import float_info

from .model import Matrix, Vector


def solve(mass: Matrix, rhs: Vector) -> tuple[list[float], list[int]]:
    """(a, undetermined) of M a = b: ``a`` (n,) and the coordinates that M does not determine; none if a is a solution.

    ``mass`` holds the rows of the lower triangle. A pivot below n eps times its scale counts as zero.
    """
    factor = _factorize(mass)
    return (_substitute(factor, rhs), []) if factor is not None else _solve_pivoted(mass, rhs)


def _factorize(mass: Matrix) -> list[list[float]] | None:
    """L below the diagonal and D on it; None if a pivot is not clearly positive."""
    least = len(mass) * float_info.epsilon
    factor: list[list[float]] = []
    for i, given in enumerate(mass):
        row = list(given)
        for j, other in enumerate(factor):
            row[j] -= sum(row[k] * other[k] for k in range(j))  # not yet divided by the pivots
        for j, other in enumerate(factor):
            weight, row[j] = row[j], row[j] / other[j]
            row[i] -= weight * row[j]
        if not row[i] > least * abs(given[i]):
            return None
        factor.append(row)
    return factor


def _substitute(factor: Matrix, rhs: Vector) -> list[float]:
    """The solution of L D L^T a = b by forward elimination, division by D and backward substitution."""
    x: list[float] = []
    for row, entry in zip(factor, rhs, strict=True):
        x.append(entry - sum(weight * known for weight, known in zip(row, x, strict=False)))
    x = [entry / factor[i][i] for i, entry in enumerate(x)]
    for i in range(len(x) - 1, 0, -1):
        for j in range(i):
            x[j] -= factor[i][j] * x[i]
    return x


def _solve_pivoted(mass: Matrix, rhs: Vector) -> tuple[list[float], list[int]]:
    """Gaussian elimination of S M S with full pivoting; S makes the diagonal 1, so that units do not matter."""
    n = len(mass)
    full = [[mass[max(i, j)][min(i, j)] for j in range(n)] for i in range(n)]
    concerned = [i for i in range(n) if not all(map(math.isfinite, full[i]))]
    if concerned:
        return [math.nan] * n, concerned
    scale = [
        1.0 / math.sqrt(abs(full[i][i])) if full[i][i] else 1.0 / (max(map(abs, full[i])) or 1.0) for i in range(n)
    ]
    a = [[full[i][j] * scale[i] * scale[j] for j in range(n)] + [rhs[i] * scale[i]] for i in range(n)]
    columns, largest = list(range(n)), 0.0
    for k in range(n):
        size, row, column = max((abs(a[i][j]), i, j) for i in range(k, n) for j in range(k, n))
        largest = largest or size
        if not size > n * float_info.epsilon * largest:
            return [math.nan] * n, _null_space(a, columns, k)
        a[k], a[row] = a[row], a[k]
        columns[k], columns[column] = columns[column], columns[k]
        for line in a:
            line[k], line[column] = line[column], line[k]
        for line in a[k + 1 :]:
            multiplier = line[k] / a[k][k]
            line[k:] = [x - multiplier * y for x, y in zip(line[k:], a[k][k:], strict=True)]
    x = [0.0] * n
    for k, entry in enumerate(_back_substitute(a, n, n)):
        x[columns[k]] = entry * scale[columns[k]]
    return x, []


def _back_substitute(a: Matrix, rank: int, column: int) -> list[float]:
    """The solution of the leading upper triangle for one column of ``a``."""
    z = [0.0] * rank
    for i in range(rank - 1, -1, -1):
        z[i] = (a[i][column] - sum(a[i][k] * z[k] for k in range(i + 1, rank))) / a[i][i]
    return z


def _null_space(a: Matrix, columns: list[int], rank: int) -> list[int]:
    """The coordinates that take part in a motion without inertia, given ``rank`` pivots."""
    concerned = set(columns[rank:])
    for column in range(rank, len(columns)):
        z = _back_substitute(a, rank, column)
        concerned |= {columns[i] for i, entry in enumerate(z) if abs(entry) > math.sqrt(float_info.epsilon)}
    return sorted(concerned)
