"""Where a function of the time comes down to zero: by a change of its sign, or in a dip between two samples.

Source: R. P. Brent, Algorithms for Minimization without Derivatives, 1973, chapters 4 and 5.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from lag2fmu.reference.state import Floats

Function = Callable[[float], float]

DEEP = 0.3
"""Relative to the lower one of two samples: where the tangents of both cross lower, the function may come down to 0
between them."""


def dips(values: Floats, slopes: Floats) -> NDArray[np.bool_]:
    """Between which neighbours of ``values`` (..., m) the function may come down to 0 and rise again, (..., m - 1).

    ``slopes`` (..., m) are those in units of the distance of two samples. What is convex is above its tangents.
    """
    left, right, falls, rises = values[..., :-1], values[..., 1:], slopes[..., :-1], slopes[..., 1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        lowest = left + falls * (right - rises - left) / (falls - rises)
    return np.asarray((falls < 0) & (rises > 0) & (lowest <= DEEP * np.minimum(left, right)))


def bottom(function: Function, left: float, right: float) -> float | None:
    """The time (s) of the least value between two times, None if it is positive."""
    from scipy.optimize import minimize_scalar

    found = minimize_scalar(function, bounds=(left, right), method="bounded", options={"xatol": 1e-14})
    return float(found.x) if found.fun <= 0 else None


def root(function: Function, left: float, right: float) -> float:
    """The time (s) at which the function comes down to 0 between two times, one of these where it does not."""
    from scipy.optimize import brentq

    if function(left) <= 0:
        return left
    if function(right) > 0:
        return right
    return float(brentq(function, left, right, xtol=1e-300, rtol=4 * np.finfo(float).eps))
