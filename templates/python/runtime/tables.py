"""Tables of measured data as piecewise polynomials of one or two arguments."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Table:
    """``knots`` of each argument, and ``coefficients`` of ascending powers of the distance from the lower knot.

    One row for each interval; of two arguments, a row for each interval of the first with rows for those of the second,
    of a matrix (power of the first, power of the second). ``outside``: "hold", "extrapolate" or "error".
    """

    name: str
    knots: Sequence[Sequence[float]]
    coefficients: Sequence[Sequence[object]]
    outside: str


def lookup(table: Table, orders: Sequence[int], *arguments: float) -> float:
    """The derivative of ``orders`` at ``arguments``; raises ValueError outside a table that has no value there."""
    found: object = table.coefficients
    distances = []
    for position, (x, knots, order) in enumerate(zip(arguments, table.knots, orders, strict=True), start=1):
        beyond = not knots[0] <= x <= knots[-1]
        if beyond and table.outside == "error":
            raise ValueError(
                f"argument {position} of the table {table.name} is {x:.9g}, outside its data from {knots[0]:.9g} to "
                f"{knots[-1]:.9g} (SI)"
            )
        if beyond and table.outside == "hold" and order:
            return 0.0
        at = min(max(x, knots[0]), knots[-1]) if table.outside == "hold" else x
        interval = min(max(bisect_right(knots, at) - 1, 0), len(knots) - 2)
        found = found[interval]  # type: ignore[index]
        distances.append(at - knots[interval])
    if len(arguments) == 2:
        found = [_polynomial(row, orders[1], distances[1]) for row in found]  # type: ignore[attr-defined]
    return _polynomial(found, orders[0], distances[0])  # type: ignore[arg-type]


def _polynomial(coefficients: Sequence[float], order: int, s: float) -> float:
    value = 0.0
    for k in range(len(coefficients) - 1, order - 1, -1):
        value = value * s + math.perm(k, order) * coefficients[k]
    return value
