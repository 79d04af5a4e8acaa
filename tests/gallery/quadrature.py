"""Motion in one dimension by quadrature (L. D. Landau, E. M. Lifshitz, Mechanics, sections 11 and 14)."""

from __future__ import annotations

from collections.abc import Callable

import mpmath as mp

Function = Callable[[mp.mpf], mp.mpf]
NODES = 200


def cycle(rate: Function, low: float, high: float, weight: Function = lambda _: mp.mpf(1)) -> float:
    """The change of a quantity over one period between the turning points near ``low`` and ``high``.

    ``rate(u)`` is (du/dt)^2 and ``weight(u)`` the time derivative of the quantity (1: the period itself). With
    u = middle + half cos(s) the integrand is smooth and periodic, so that the midpoint rule converges exponentially;
    40 digits leave nothing to rounding near the turning points.
    """
    with mp.workdps(40):
        a, b = mp.findroot(rate, mp.mpf(low)), mp.findroot(rate, mp.mpf(high))
        middle, half, total = (a + b) / 2, (b - a) / 2, mp.mpf(0)
        for i in range(NODES):
            s = mp.pi * (2 * i + 1) / (2 * NODES)
            u = middle + half * mp.cos(s)
            total += weight(u) * half * mp.sin(s) / mp.sqrt(rate(u))
        return float(2 * total * mp.pi / NODES)
