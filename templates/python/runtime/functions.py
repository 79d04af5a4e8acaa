"""Functions that return the limit where those of the module math raise, and some that math does not have."""

from __future__ import annotations

import math
from collections.abc import Callable


def _unbounded(function: Callable[[float], float]) -> Callable[[float], float]:
    """``function`` with an infinite value of the right sign where it exceeds the range of float."""

    def limited(x: float) -> float:
        try:
            return function(x)
        except OverflowError:
            return function(math.copysign(1.0, x)) * math.inf

    limited.__doc__ = f"{function.__name__}(x), infinite where it overflows"
    return limited


exp = _unbounded(math.exp)
sinh = _unbounded(math.sinh)
cosh = _unbounded(math.cosh)


def log(x: float) -> float:
    """The natural logarithm, -inf at 0; raises ValueError below."""
    return math.log(x) if x else -math.inf


def power(base: float, exponent: float) -> float:
    """base to the power of exponent, infinite where it overflows; raises ValueError where it is not real."""
    try:
        return math.pow(base, exponent)
    except OverflowError:
        return math.inf if base > 0 or exponent % 2 == 0 else -math.inf


def power_or_zero(base: float, exponent: float) -> float:
    """base to the power of exponent, 0 where base is 0; raises ValueError where it is not real."""
    return power(base, exponent) if base else 0.0


def sloped(slope: float, rate: float) -> float:
    """slope times rate; 0 where rate is 0, however steep the slope is."""
    return slope * rate if rate else 0.0


def sign(x: float) -> float:
    """-1, 0 or 1."""
    return float((x > 0) - (x < 0))


def choice(margin: float, a: float, b: float) -> float:
    """a for a positive margin, else b."""
    return a if margin > 0 else b


def passed(x: float) -> float:
    """x itself; no event is located at its kinks."""
    return x


def heaviside(x: float) -> float:
    """0 for negative x, 1 for positive x, 1/2 at 0."""
    return 0.5 * (1.0 + sign(x))
