"""Equations of motion of two coordinates, derived on paper, and their integration."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.integrate import solve_ivp

Terms = Callable[[float, float, float, float, float], tuple[list[list[float]], list[float]]]


def by_hand(terms: Terms, start: Sequence[float], times: np.ndarray) -> np.ndarray:
    """The coordinates (len(times), 2) from ``start`` (q1, q2, qd1, qd2).

    ``terms(t, q1, q2, qd1, qd2)`` returns the mass matrix and the right sides of M qdd = f.
    """

    def rates(t: float, z: np.ndarray) -> list[float]:
        return [*z[2:], *np.linalg.solve(*terms(t, *z))]

    return solve_ivp(rates, (0, times[-1]), start, "DOP853", times, rtol=1e-12, atol=1e-13).y[:2].T
