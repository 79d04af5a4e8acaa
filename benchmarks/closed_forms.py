"""Motions of benchmark problems in closed form, or by a quadrature: nothing here integrates in time by steps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import ellipj, ellipk, ellipkinc

Floats = NDArray[np.float64]


def pendulum(times: Floats, start: float, rate: float, frequency: float) -> Floats:
    """The angle phi (rad) from the stable position at the times (s): phi'' = -frequency^2 sin(phi), (m,).

    ``frequency`` is that of small motions, in rad/s. Swings and full turns alike. Source: P. F. Byrd, M. D. Friedman,
    Handbook of Elliptic Integrals, 1971: sin(phi/2) = k sn(w (t + t0), k), and sn(w (t + t0)/m, m) beyond.
    """
    k2 = np.sin(start / 2) ** 2 + (rate / (2 * frequency)) ** 2
    sign = np.sign(rate) if rate else 1.0
    if k2 < 1:
        k = np.sqrt(k2)
        inner = np.arcsin(np.clip(np.sin(start / 2) / k, -1, 1))
        begun = ellipkinc(inner, k2) if rate >= 0 else 2 * ellipk(k2) - ellipkinc(inner, k2)
        sn, *_ = ellipj(frequency * times + begun, k2)
        return np.asarray(2 * np.arcsin(k * sn))
    begun = sign * ellipkinc(start / 2, 1 / k2)
    *_, amplitude = ellipj(np.sqrt(k2) * frequency * times + begun, 1 / k2)
    return np.asarray(2 * sign * amplitude)


def light_cart_pole(
    times: Floats, cart: float = 1e-6, bob: float = 1.0, length: float = 1.0, g: float = 9.81
) -> tuple[Floats, Floats]:
    """x (m) and theta (rad) of the cart with a pole that starts level at rest, each (m,), at the times (s).

    Momentum and energy leave dt/dtheta; with cos(theta) = sin(p)^2 it is dt/dp, which is smooth for all p, and grows
    over a width of 1e-3 alone. Gauss's rule with 20 nodes on panels that halve towards p = pi/2; masses in kg.
    """
    passed = _passed(cart, bob, length, g)
    quarter = passed(np.pi / 2)
    x, theta = np.empty(len(times)), np.empty(len(times))
    for i, t in enumerate(times):
        count, rest = divmod(t, quarter)
        rest = quarter - rest if count % 2 else rest
        p = brentq(lambda p, rest=rest: passed(p) - rest, -1e-9, np.pi / 2 + 1e-9, xtol=1e-15, rtol=1e-15)
        side = 1 if count % 4 in (0, 3) else -1
        sine = side * np.cos(p) * np.sqrt(1 + np.sin(p) ** 2)
        theta[i], x[i] = np.arctan2(sine, np.sin(p) ** 2), bob * length * (1 - sine) / (cart + bob)
    return x, theta


def quarter_of_light_cart_pole(cart: float = 1e-6, bob: float = 1.0, length: float = 1.0, g: float = 9.81) -> float:
    """The time (s) at which the pole first hangs down."""
    return _passed(cart, bob, length, g)(np.pi / 2)


def _passed(cart: float, bob: float, length: float, g: float) -> Callable[[float], float]:
    """The time (s) over p of `light_cart_pole`."""
    nodes, weights = np.polynomial.legendre.leggauss(20)
    edges = np.concatenate([np.pi / 2 * (1 - 2.0 ** -np.arange(14)), [np.pi / 2]])

    def slowness(p: Floats) -> Floats:
        c, s = np.cos(p) ** 2, np.sin(p) ** 2
        return np.asarray(2 * np.sqrt(length * (cart + bob * c * (1 + s)) / (2 * g * (cart + bob) * (1 + s))))

    def passed(p: float) -> float:
        ends = np.clip(edges, 0, p)
        half, middle = np.diff(ends) / 2, (ends[1:] + ends[:-1]) / 2
        return float(np.sum(half * (slowness(middle[:, None] + half[:, None] * nodes) @ weights)))

    return passed


def four_bar_poles(phi: float, k: float = 25.0, c: float = 1.0, g: float = 9.81) -> NDArray[np.complex128]:
    """Of the parallelogram of unit links with a diagonal spring of length sqrt(2) and a damper, at the angle phi, (2,).

    Energy in phi alone: T = 5/6 phi'^2, V = 2 g sin(phi) + k/2 (2 cos(phi/2) - sqrt(2))^2.
    """
    s, co, stretch = np.sin(phi / 2), np.cos(phi / 2), 2 * np.cos(phi / 2) - np.sqrt(2)
    stiffness = -2 * g * np.sin(phi) + k * (s**2 - stretch * co / 2)
    return np.asarray(np.roots([5 / 3, c * s**2, stiffness]), complex)


def four_bar_slope(phi: float, k: float = 25.0, g: float = 9.81) -> float:
    """dV/dphi of the same linkage, in N.m."""
    return float(2 * g * np.cos(phi) - k * (2 * np.cos(phi / 2) - np.sqrt(2)) * np.sin(phi / 2))
