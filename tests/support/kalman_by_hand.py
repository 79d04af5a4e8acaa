"""Kalman's filters as textbooks write them, with covariances and NumPy alone, for a pendulum seen from below."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from sympy import cos, sin

from lag2fmu.mechanism import Body, Mechanism, Output, coordinate

Floats = NDArray[np.float64]


def bob() -> Mechanism:
    """The pendulum, of 1 kg and 1 m; the place x of its bob is an output."""
    theta = coordinate("theta", "rad", start=1.0)
    place = (sin(theta), -cos(theta))
    return Mechanism(
        "bob", coordinates=[theta], bodies=[Body("b", 1, place)], gravity=9.81, outputs=[Output("x", place[0], "m")]
    )


def exponential(M: Floats) -> Floats:
    """The polynomial of the method of Runge and Kutta."""
    return np.eye(len(M)) + M @ (np.eye(len(M)) + M / 2 @ (np.eye(len(M)) + M / 3 @ (np.eye(len(M)) + M / 4)))


def falling(x: Floats) -> Floats:
    """The rates of a pendulum of 1 kg and 1 m, (2, ...)."""
    return np.array([x[1], -9.81 * np.sin(x[0])])


def slopes(x: Floats) -> Floats:
    return np.array([[0, 1], [-9.81 * np.cos(x[0]), 0]])


def one_step(x: Floats, h: float) -> tuple[Floats, Floats]:
    """A step of the method of Runge and Kutta, and the state in its middle."""
    a = falling(x)
    b = falling(x + h / 2 * a)
    c = falling(x + h / 2 * b)
    return x + h / 6 * (a + 2 * b + 2 * c + falling(x + h * c)), x + h / 2 * a


def flown(x: Floats, h: float, steps: int, density: float) -> tuple[Floats, Floats, Floats]:
    """The state after a sample, its derivative by complex steps, and the covariance that noise of the torque adds."""
    whole, Q = np.eye(2), np.zeros((2, 2))
    for _ in range(steps):
        moved = np.array([one_step(x + 1e-30j * e, h)[0].imag / 1e-30 for e in np.eye(2)]).T
        M = slopes(one_step(x, h)[1])
        Q = moved @ Q @ moved.T
        for node in (0.5 - np.sqrt(3) / 6, 0.5 + np.sqrt(3) / 6):
            g = exponential(M * (1 - node) * h) @ np.array([0, 1])
            Q += h / 2 * density**2 * np.outer(g, g)
        whole, x = moved @ whole, one_step(x, h)[0]
    return x, whole, Q


def count(x: Floats, span: float) -> int:
    """The steps that resolve the fastest pole."""
    return int(np.ceil(span * np.abs(np.linalg.eigvals(slopes(x))).max() / 0.1))


def points(method: str, x: Floats, P: Floats) -> Floats:
    """The cubature points, (2, 4), or the corners of a triangle, (2, 3)."""
    root = np.linalg.cholesky(P)
    pairs = np.sqrt(2) * np.array([[1, 0, -1, 0], [0, 1, 0, -1]])
    corners = np.array([[np.sqrt(1.5), -np.sqrt(1.5), 0], [np.sqrt(0.5), np.sqrt(0.5), -np.sqrt(2)]])
    return x[:, None] + root @ (corners if method == "ukf-simplex" else pairs)


def moved(method: str, x: Floats, P: Floats, span: float, steps: int) -> tuple[Floats, Floats]:
    """Estimate and covariance after ``span`` (s)."""
    x_ahead, whole, Q = flown(x, span / steps, steps, 0.3)
    if method == "ekf":
        return x_ahead, whole @ P @ whole.T + Q
    cloud = points(method, x, P)
    for _ in range(steps):
        cloud = one_step(cloud, span / steps)[0]
    return cloud.mean(axis=1), np.cov(cloud, bias=True) + Q


def corrected(method: str, x: Floats, P: Floats, z: float) -> tuple[Floats, Floats]:
    """Estimate and covariance after a sample of sin(theta), with a standard deviation of 0.1."""
    cloud = points(method, x, P)
    seen = np.sin(x[:1]) if method == "ekf" else np.sin(cloud[0])
    across = P[:, 0] * np.cos(x[0]) if method == "ekf" else (cloud - x[:, None]) @ (seen - seen.mean()) / len(seen)
    spread = P[0, 0] * np.cos(x[0]) ** 2 if method == "ekf" else np.var(seen)
    K = across / (spread + 0.1**2)
    return x + K * (z - seen.mean()), P - np.outer(K, K) * (spread + 0.1**2)


def by_hand(method: str, measured: Floats, span: float, steps: int | None = None) -> tuple[Floats, Floats]:
    """Of the textbook's equations with covariances: what is known after each sample, and what is then expected.

    Each is (m, 4), estimates and standard deviations of theta and its rate; NaN is no sample. Samples come every
    ``span`` (s), with as many solver ``steps`` between them.
    """
    x, P = np.array([1.0, 0.0]), np.diag([0.2**2, 0.5**2])
    after, ahead = [], []
    for z in measured.tolist():
        if np.isfinite(z):
            x, P = corrected(method, x, P, z)
        after.append(np.concatenate([x, np.sqrt(np.diag(P))]))
        x, P = moved(method, x, P, span, steps or count(x, span))
        ahead.append(np.concatenate([x, np.sqrt(np.diag(P))]))
    return np.array(after), np.array(ahead)
