"""Tables of numbers as piecewise polynomials of one or two arguments, with exact derivatives of any order.

Between two knots an interpolant of one argument is a polynomial of ``degree`` in the distance from the lower knot. An
interpolant of two arguments is a tensor product of such polynomials. Source: C. de Boor, A Practical Guide to Splines,
chapters VII and XVII.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Interpolant:
    """The table ``name``, in SI units.

    - ``knots``: one increasing sequence for each argument.
    - ``coefficients``: of ascending powers, (n - 1, d + 1) for one argument of n knots and ``degree`` d, and
      (n - 1, m - 1, d + 1, d + 1) for two arguments.
    - ``outside``: what holds beyond the knots: "hold" (the value at the nearest knot), "extrapolate" (the polynomial of
      the nearest interval) or "error" (no value).
    - ``smooth``: the greatest order of derivatives that are continuous at the inner knots.
    """

    name: str
    knots: tuple[Floats, ...]
    coefficients: Floats
    outside: str
    smooth: int
    degree: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "degree", self.coefficients.shape[-1] - 1)

    @property
    def arity(self) -> int:
        """The number of arguments, 1 or 2."""
        return len(self.knots)

    @property
    def listed(self) -> tuple[list[list[float]], list[object]]:
        """Knots and coefficients as lists of numbers."""
        return [knots.tolist() for knots in self.knots], self.coefficients.tolist()

    def in_intervals(self, order: int) -> bool:
        """Whether a derivative of this ``order`` is pieced together at the inner knots.

        It is where it jumps: lines, the curvature of monotone pieces. So are lines themselves, whose slope jumps.
        """
        return order > self.smooth or self.degree == 1

    def kinks(self, axis: int = 0, order: int = 0) -> Floats:
        """The knots (k,) of the argument ``axis`` where a derivative of this ``order`` is pieced together.

        These are inner knots, see ``in_intervals``, and both ends if the value is held outside.
        """
        inside = self.knots[axis][1:-1] if self.in_intervals(order) else np.empty(0)
        ends = self.knots[axis][[0, -1]] if self.outside == "hold" else np.empty(0)
        return np.sort(np.concatenate([inside, ends]))

    def __call__(self, orders: Sequence[int], *arguments: ArrayLike) -> Floats:
        """The partial derivative (*batch) at ``arguments``, which broadcast to (*batch); nan where there is no value.

        ``orders`` has the order of the derivative by each argument. A knot belongs to the interval above it.
        """
        given = np.broadcast_arrays(*(np.asarray(x, dtype=np.float64) for x in arguments))
        cells, powers, lost = [], [], np.zeros(given[0].shape, dtype=bool)
        flat = np.zeros(given[0].shape, dtype=bool)
        for x, knots, order in zip(given, self.knots, orders, strict=True):
            beyond = (x < knots[0]) | (x > knots[-1])
            lost |= np.isnan(x) | (beyond if self.outside == "error" else False)
            flat |= beyond & (order > 0) & (self.outside == "hold")
            at = np.clip(x, knots[0], knots[-1]) if self.outside == "hold" else x
            cell = np.clip(np.searchsorted(knots, at, side="right") - 1, 0, len(knots) - 2)
            cells.append(cell)
            powers.append(self._powers(at - knots[cell], order))
        value = self.coefficients[tuple(cells)]
        for weights in reversed(powers):
            value = (value * (weights if value.ndim == weights.ndim else weights[..., None, :])).sum(axis=-1)
        return np.where(lost, np.nan, np.where(flat, 0.0, value))

    def _powers(self, s: Floats, order: int) -> Floats:
        """The derivatives of s^0 ... s^d, (*shape, d + 1)."""
        factors = [math.perm(k, order) for k in range(self.degree + 1)]
        return np.stack([f * s ** max(k - order, 0) for k, f in enumerate(factors)], axis=-1)
