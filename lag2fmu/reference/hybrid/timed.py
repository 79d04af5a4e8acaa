"""Where functions of the time alone come down to zero: by samples so close that cubics between them tell the rest.

These functions cost next to nothing, so that they are sampled as often as they need, whatever the steps of a solver.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lag2fmu.reference.hybrid.roots import Function, bottom, dips, root
from lag2fmu.reference.state import Floats

FEWEST, MOST = 16, 1 << 17
"""The numbers of intervals between samples; there are never more than MOST."""
RESOLVED = 1e-8
"""Relative to the greatest value of a function: how far cubics may be from it."""
BETWEEN = (0.38, 0.77)
"""Where in an interval this is tried; no whole multiple of a short period hides at both places."""
ROUNDING = 16 * np.finfo(float).eps
"""The greatest relative rounding error of times and of phases that are made of them."""


def first_descent(function: Callable[[Floats], Floats], a: float, b: float, floor: float, armed: bool) -> float | None:
    """The first time in (a, b], in s, at which ``function`` (m,) of times (m,) comes down to 0; None if it does not.

    ``armed``: it is positive at ``a``. If it is not, it first has to rise above ``floor``, or to be clearly below 0.
    """

    def value(t: float) -> float:
        return float(function(np.array([t]))[0])

    times, values = _samples(function, a, b)
    slope = abs(float(values[1] - values[0])) / max(float(times[1] - times[0]), float(np.spacing(b)))
    floor = max(floor, ROUNDING * max(abs(a), abs(b)) * slope)
    if not armed:
        positive, negative = np.flatnonzero(values > floor), np.flatnonzero(values < -10 * floor)
        if negative.size and not (positive.size and positive[0] < negative[0]):
            return _after_a_hump(value, a, float(times[negative[0]]), floor)
        if not positive.size:
            return None
        times, values = times[positive[0] :], values[positive[0] :]
    below = np.flatnonzero(values <= 0)
    end = int(below[0]) if below.size else len(values)
    for j in np.flatnonzero(dips(values, np.gradient(values))[: max(end - 1, 0)]):
        low = bottom(value, float(times[j]), float(times[j + 1]))
        if low is not None:
            return root(value, float(times[j]), low)
    if end == len(values):
        return None
    return root(value, float(times[end - 1]), float(times[end])) if end else float(times[0])


def _samples(function: Callable[[Floats], Floats], a: float, b: float) -> tuple[Floats, Floats]:
    """Times (n + 1,) from ``a`` to ``b`` that resolve ``function``, and its values there."""
    n = FEWEST
    while True:
        times = a + (b - a) * np.arange(n + 1) / n
        times[-1] = b
        values = function(times)
        bound = RESOLVED * float(np.abs(values).max())
        if n >= MOST or all(_error(function, times, values, part) <= bound for part in BETWEEN):
            return times, values
        n *= 2


def _error(function: Callable[[Floats], Floats], times: Floats, values: Floats, part: float) -> float:
    """The greatest difference of ``function`` from cubics through four samples each, at a ``part`` of the inner ones.

    Source: Lagrange's interpolation at the nodes -1, 0, 1, 2.
    """
    s = part
    weights = [-s * (s - 1) * (s - 2) / 6, (s * s - 1) * (s - 2) / 2, -s * (s + 1) * (s - 2) / 2, s * (s * s - 1) / 6]
    cubic = sum(w * values[k : len(values) - 3 + k] for k, w in enumerate(weights))
    found = np.abs(function(times[1:-2] + s * np.diff(times[1:-1])) - cubic)
    return float(found.max())


def _after_a_hump(function: Function, left: float, right: float, floor: float) -> float:
    """The root behind a hump between two samples; ``left`` if the function does not rise above ``floor`` there."""
    peak = bottom(lambda t: floor - function(t), left, right)
    return left if peak is None else root(function, peak, right)
