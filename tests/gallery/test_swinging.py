"""Pendulums on a cart, on an arm, on a spring, against equations derived on paper; the simple one in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from lagrange import by_hand
from scipy.special import ellipj, ellipk

pytestmark = pytest.mark.fmu

G = 9.81


def test_pendulum(motion) -> None:
    """sin(theta/2) = k cd(t sqrt(g/l) | k^2), and a pendulum that turns over goes as an amplitude function."""
    k, run = np.sin(0.5), motion("pendulum", 5.0, theta=1.0)
    _, cn, dn, _ = ellipj(np.sqrt(G) * run.time, k**2)
    assert run["theta"] == pytest.approx(2 * np.arcsin(k * cn / dn), abs=1e-8)
    speed = 8.0  # above 2 sqrt(g/l), the least for a whole turn
    turn = 4 / speed * ellipk(4 * G / speed**2)
    assert motion("pendulum", turn, theta=0.0, theta_dot=speed)["theta"][-1] == pytest.approx(2 * np.pi, rel=1e-8)


def test_cart_pole(motion) -> None:
    """With friction on the rail and in the hinge, pushed by 2 N."""
    M, m, l, c, d = 1.0, 0.3, 1.0, 0.1, 0.002  # noqa: E741

    def terms(_, x, theta, u, w):
        coupling = m * l / 2 * np.cos(theta)
        push = 2.0 - c * u + m * l / 2 * w**2 * np.sin(theta)
        return [[M + m, coupling], [coupling, m * l**2 / 3]], [push, -d * w - m * G * l / 2 * np.sin(theta)]

    run = motion("cart_pole", 5.0, F=2.0)
    assert run.columns(["x", "theta"]) == pytest.approx(by_hand(terms, [0.0, 0.5, 0.0, 0.0], run.time), abs=1e-8)


def test_elastic_pendulum(motion) -> None:
    """s_ddot = (l0 + s) theta_dot^2 - k s/m + g cos(theta), (l0 + s) theta_ddot = -2 s_dot theta_dot - g sin(theta)."""
    run = motion("elastic_pendulum", 5.0, m=0.8, k=50.0, l0=1.2)

    def terms(_, s, theta, u, w):
        r = 1.2 + s
        return [[1.0, 0.0], [0.0, r]], [r * w**2 - 50.0 * s / 0.8 + G * np.cos(theta), -2 * u * w - G * np.sin(theta)]

    assert run.columns(["s", "theta"]) == pytest.approx(by_hand(terms, [0.15, 0.3, 0.0, 0.0], run.time), abs=1e-8)


def test_furuta_pendulum(motion) -> None:
    """omega = (beta_dot, alpha_dot sin(beta), alpha_dot cos(beta)) in the axes of the pendulum."""
    m1, m2, L1, l1, l2, J1, J2, Ja, b1, b2 = 0.3, 0.08, 0.28, 0.14, 0.15, 2e-3, 6e-4, 1e-6, 1e-4, 3e-4
    lean = m2 * l2**2 + J2 - Ja

    def terms(_, alpha, beta, u, w):
        s, c = np.sin(beta), np.cos(beta)
        arm = J1 + m1 * l1**2 + m2 * L1**2 + Ja + lean * s**2
        coupling = m2 * L1 * l2 * c
        first = m2 * L1 * l2 * s * w**2 - 2 * lean * s * c * u * w - b1 * u
        return [[arm, coupling], [coupling, m2 * l2**2 + J2]], [first, lean * s * c * u**2 - m2 * G * l2 * s - b2 * w]

    run = motion("furuta_pendulum", 3.0)
    assert run.columns(["alpha", "beta"]) == pytest.approx(by_hand(terms, [0.0, 1.0, 2.0, 0.0], run.time), abs=1e-7)


def test_two_armed_robot(motion) -> None:
    """Two chains of two rods on a carriage, as sums of J^T m J and J^T (m g - m J' qd) over the rods."""
    M, d, m, h, c = 6.0, 3.0, 2.0, 0.35, 0.1
    arms = ((1, 0.45, 1.5), (3, 0.4, 2.5))  # where the shoulder stands among the coordinates, l, n

    def terms(_, *state):
        q, v = np.array(state[:5]), np.array(state[5:])
        inertia, force = np.diag([M, 0, 0, 0, 0.0]), np.array([2.0 - d * v[0], *(-c * v[1:])])
        for i, l, n in arms:  # noqa: E741
            lower, rate = q[i] + q[i + 1], v[i] + v[i + 1]
            for mass, length, reach, far in ((m, l, l / 2, 0.0), (n, h, l, h / 2)):
                s, k = reach * np.sin(q[i]), reach * np.cos(q[i])
                s2, k2 = far * np.sin(lower), far * np.cos(lower)
                turn = np.zeros(5)
                turn[i], turn[i + 1] = 1.0, 1.0 if far else 0.0
                J = np.zeros((2, 5))
                J[0, 0], J[:, i], J[:, i + 1] = 1.0, (k + k2, s + s2), (k2, s2)
                bias = np.array([-s * v[i] ** 2 - s2 * rate**2, k * v[i] ** 2 + k2 * rate**2])
                inertia = inertia + mass * (J.T @ J + length**2 / 12 * np.outer(turn, turn))
                force = force + mass * J.T @ (np.array([0.0, -G]) - bias)
        return inertia, force

    run = motion("two_armed_robot", 2.0, F=2.0)
    names = ["x", "left_shoulder", "left_elbow", "right_shoulder", "right_elbow"]
    start = [0.0, -0.6, -0.9, 0.8, 0.5, *[0.0] * 5]
    assert run.columns(names) == pytest.approx(by_hand(terms, start, run.time), abs=1e-7)
