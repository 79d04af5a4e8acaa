"""Mechanisms with one degree of freedom, from their closed kinematics: places and angles of the bodies over s."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

Kinematics = Callable[[complex], np.ndarray]
STEP = 1e-30
_OFFSETS, _WEIGHTS = 1e-3 * np.array([-2, -1, 1, 2]), np.array([1, -8, 8, -1]) / 12e-3


@dataclass(frozen=True)
class OneDegree:
    """1/2 J(s) s_dot^2 + V(s), J = sum of inertia (dx/ds)^2 over what ``kinematics(s)`` returns (complex s allowed).

    ``weights`` are forces against its entries: V = sum weight x.
    """

    kinematics: Kinematics
    inertias: Sequence[float]
    weights: Sequence[float]

    def inertia(self, s: float) -> float:
        return float(np.dot(self.inertias, (self.kinematics(s + 1j * STEP).imag / STEP) ** 2))

    def slope(self, s: float) -> float:
        """dV/ds"""
        moved = s + 1j * STEP
        return float(np.dot(self.weights, self.kinematics(moved)).imag / STEP)

    def run(self, s: float, rate: float, times: np.ndarray) -> np.ndarray:
        """s at ``times`` from s_ddot = -(dV/ds + 1/2 dJ/ds s_dot^2)/J; dJ/ds by differences of fourth order."""

        def rates(_: float, z: np.ndarray) -> list[float]:
            change = np.dot(_WEIGHTS, [self.inertia(z[0] + h) for h in _OFFSETS])
            return [z[1], -(self.slope(z[0]) + change * z[1] ** 2 / 2) / self.inertia(z[0])]

        done = solve_ivp(rates, (0, times[-1]), [s, rate], "DOP853", times, rtol=1e-12, atol=1e-12)
        return done.y[0]
