"""Pendulums with moving supports and lengths, rotating constraints: periods by quadrature, solutions of other kinds."""

from __future__ import annotations

from collections.abc import Callable

import mpmath as mp
import numpy as np
import pytest
from quadrature import cycle
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipk, jv, yv

pytestmark = pytest.mark.fmu

G = 9.81
Rates = Callable[[float, np.ndarray], list[float]]


def by_hand(rates: Rates, start: list[float], times: np.ndarray) -> np.ndarray:
    """The solution of equations that were derived by hand, (len(times), len(start))."""
    done = solve_ivp(rates, (0, times[-1]), start, "DOP853", times, rtol=1e-13, atol=1e-13)
    return done.y.T


def test_sliding_support(motion) -> None:
    """The horizontal momentum vanishes, so that phi moves in one dimension; m1 = 2, m2 = l = 1."""
    g = mp.mpf("9.81")
    period = cycle(lambda u: 2 * g * (mp.cos(u) - mp.cos(1)) / (1 - mp.cos(u) ** 2 / 3), -1.0, 1.0)
    run = motion("sliding_support_pendulum", period)
    assert run["phi"][[10, -1]] == pytest.approx([-1.0, 1.0], rel=1e-8)
    assert 3 * run["x"] + np.sin(run["phi"]) == pytest.approx(np.full(21, np.sin(1.0)), rel=1e-8)


def test_circling_support_without_weight(motion) -> None:
    """For g = 0 phi - gamma t - pi/2 swings as a pendulum with the frequency sqrt(a/l) gamma."""
    period = 4 * ellipk(np.sin(0.4) ** 2) / (np.sqrt(0.1) * 2.0)
    run = motion("circling_support_pendulum", period, g=0.0, phi=np.pi / 2 + 0.8, phi_dot=2.0)
    swing = run["phi"] - 2.0 * run.time - np.pi / 2
    assert swing[[10, -1]] == pytest.approx([-0.8, 0.8], rel=1e-8)


def test_circling_support(motion) -> None:
    """Against the Lagrangian of the book: l phi_ddot = a gamma^2 cos(phi - gamma t) - g sin(phi)."""
    run = motion("circling_support_pendulum", 5.0)
    a, gamma = 0.1, 2.0
    expected = by_hand(
        lambda t, x: [x[1], a * gamma**2 * np.cos(x[0] - gamma * t) - G * np.sin(x[0])], [0.5, 0.0], run.time
    )
    assert run["phi"] == pytest.approx(expected[:, 0], abs=1e-8)


def test_horizontally_driven(motion) -> None:
    """Against the Lagrangian of the book: l phi_ddot = a gamma^2 cos(gamma t) cos(phi) - g sin(phi)."""
    run = motion("horizontally_driven_pendulum", 5.0)
    a, gamma = 0.1, 2.0
    expected = by_hand(
        lambda t, x: [x[1], a * gamma**2 * np.cos(gamma * t) * np.cos(x[0]) - G * np.sin(x[0])], [0.3, 0.0], run.time
    )
    assert run["phi"] == pytest.approx(expected[:, 0], abs=1e-8)


def test_governor_rests(motion) -> None:
    rest = np.arccos((1 + 2) * G / (1 * 10.0**2 * 0.5))
    run = motion("governor", 1.0, theta=rest)
    assert run["theta"] == pytest.approx(np.full(21, rest), rel=1e-8)


def test_governor_swings(motion) -> None:
    """The effective potential of the book, by quadrature; m1 = 1, m2 = 2, a = 1/2, Omega = 10."""
    g, a = mp.mpf("9.81"), mp.mpf("0.5")

    def potential(u):
        return -(a**2) * 100 * mp.sin(u) ** 2 - 6 * g * a * mp.cos(u)

    def rate(u):
        return (potential(mp.mpf("0.7")) - potential(u)) / (a**2 * (1 + 4 * mp.sin(u) ** 2))

    other = brentq(lambda u: float(rate(mp.mpf(u))), 0.75, 2.5)
    run = motion("governor", cycle(rate, 0.7, other))
    assert run["theta"][[10, -1]] == pytest.approx([other, 0.7], rel=1e-8)


def test_bead_on_hoop(motion) -> None:
    """It rests at cos(theta) = g/(R Omega^2); from elsewhere it swings about that, by quadrature."""
    g, R, Omega = mp.mpf("9.81"), mp.mpf("0.2"), 9

    def potential(u):
        return -(R**2) * Omega**2 * mp.sin(u) ** 2 / 2 - g * R * mp.cos(u)

    def rate(u):
        return 2 * (potential(mp.mpf("0.5")) - potential(u)) / R**2

    other = brentq(lambda u: float(rate(mp.mpf(u))), 0.55, 3.0)
    run = motion("bead_on_hoop", cycle(rate, 0.5, other))
    assert run["theta"][[10, -1]] == pytest.approx([other, 0.5], rel=1e-8)
    rest = np.arccos(G / (0.2 * 81))
    assert motion("bead_on_hoop", 1.0, theta=rest)["theta"] == pytest.approx(np.full(21, rest), rel=1e-8)


def test_cylinder_in_cylinder(motion) -> None:
    """As a pendulum of the length 3 (R - a)/2."""
    run = motion("cylinder_in_cylinder", 4 * ellipk(np.sin(0.5) ** 2) * np.sqrt(1.5 * 0.4 / G))
    assert run["phi"][[10, -1]] == pytest.approx([-1.0, 1.0], rel=1e-8)


def test_shortened_pendulum(motion) -> None:
    """Small oscillations: theta = l^(-1/2) Z_1(2 sqrt(g l)/c), Bessel functions; the amplitude is 3e-5."""
    c, start = 0.1, 3e-5
    run = motion("shortened_pendulum", 10.0, tolerance=1e-13, theta=start)

    def basis(length: np.ndarray) -> np.ndarray:
        z = 2 * np.sqrt(G * length) / c
        return np.array([jv(1, z), yv(1, z)]) / np.sqrt(length)

    def slope(length: float) -> np.ndarray:  # d/dl, by d/dz (Z_1/z) = -Z_2/z
        z = 2 * np.sqrt(G * length) / c
        return -np.array([jv(2, z), yv(2, z)]) * z / (2 * length) / np.sqrt(length)

    weights = np.linalg.solve(np.array([basis(2.0), slope(2.0)]), [start, 0.0])
    assert run["theta"] == pytest.approx(weights @ basis(2.0 - c * run.time), abs=1e-8 * start)


def test_the_action_of_a_shortened_pendulum_is_invariant(motion) -> None:
    """energy/frequency ~ amplitude^2 l^(3/2) stays when the length halves slowly (Mechanics, section 49)."""
    run = motion("shortened_pendulum", 1000.0, steps=20000, tolerance=1e-9, c=0.001, theta=0.01)
    length, first, last = 2.0 - 0.001 * run.time, run.time < 20.0, run.time > 980.0
    action = [(np.abs(run["theta"][part]).max() ** 2 * length[part].mean() ** 1.5) for part in (first, last)]
    assert action[1] == pytest.approx(action[0], rel=0.02)
    assert np.abs(run["theta"][last]).max() > 1.6 * 0.01


def test_acrobot(motion) -> None:
    """Against the equations of the source in matrix form, with the torque 0.5 N.m of the motor."""
    run = motion("acrobot", 3.0, Q_q2=0.5)

    def rates(_: float, x: np.ndarray) -> list[float]:
        q1, q2, w1, w2 = x
        m1 = m2 = l1 = lc2 = 1.0
        lc1, I1, I2, b = 0.5, 0.083, 0.33, 0.1
        d11 = m1 * lc1**2 + m2 * (l1**2 + lc2**2 + 2 * l1 * lc2 * np.cos(q2)) + I1 + I2
        d12 = m2 * (lc2**2 + l1 * lc2 * np.cos(q2)) + I2
        d22 = m2 * lc2**2 + I2
        h1 = -m2 * l1 * lc2 * np.sin(q2) * (w2**2 + 2 * w1 * w2)
        h2 = m2 * l1 * lc2 * np.sin(q2) * w1**2
        f2 = m2 * lc2 * G * np.sin(q1 + q2)
        f1 = (m1 * lc1 + m2 * l1) * G * np.sin(q1) + f2
        qdd = np.linalg.solve([[d11, d12], [d12, d22]], [-b * w1 - h1 - f1, 0.5 - b * w2 - h2 - f2])
        return [w1, w2, *qdd]

    expected = by_hand(rates, [0.5, -0.3, 0.0, 0.0], run.time)
    assert run.columns(["q1", "q2"]) == pytest.approx(expected[:, :2], abs=1e-8)
