"""Equations of motion derived on paper, and their integration."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

Terms = Callable[..., tuple[ArrayLike, ArrayLike]]


def by_hand(terms: Terms, start: Sequence[float], times: np.ndarray) -> np.ndarray:
    """The n coordinates (len(times), n) from ``start`` (q1, q2, ..., qd1, qd2, ...).

    ``terms(t, q1, q2, ..., qd1, qd2, ...)`` returns the mass matrix and the right sides of M qdd = f.
    """
    n = len(start) // 2

    def rates(t: float, z: np.ndarray) -> list[float]:
        return [*z[n:], *np.linalg.solve(*terms(t, *z))]

    return solve_ivp(rates, (0, times[-1]), start, "DOP853", times, rtol=1e-12, atol=1e-13).y[:n].T
