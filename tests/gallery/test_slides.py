"""The problems of the slides against equations of motion that were derived by hand; 2 stands in test_rolling.py."""

from __future__ import annotations

from dataclasses import replace

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from lagrange import by_hand
from quadrature import cycle
from scipy.linalg import eigh

from lag2fmu.analysis import linearized
from lag2fmu.formats.loading import load

G = 9.81


@pytest.mark.fmu
def test_problem_1(motion) -> None:
    """m l^2/9 phi_dot^2/2 + k (l/3)^2 sin(phi)^2/2 - m g l/6 cos(phi) is constant."""
    m, l, k, g = 2, mp.mpf("1.2"), 50, mp.mpf("9.81")  # noqa: E741

    def potential(phi):
        return k * (l / 3) ** 2 * mp.sin(phi) ** 2 / 2 - m * g * l / 6 * mp.cos(phi)

    period = cycle(lambda phi: 2 * (potential(mp.mpf("0.4")) - potential(phi)) / (m * l**2 / 9), -0.4, 0.4)
    assert motion("slides_problem_1", period)["phi"][[10, -1]] == pytest.approx([-0.4, 0.4], rel=1e-8)


@pytest.mark.fmu
def test_problem_3(motion) -> None:
    m1, m2, l, k = 4.0, 1.0, 0.8, 100.0  # noqa: E741

    def terms(_, x, phi, u, w):
        coupling = m2 * l / 2 * np.cos(phi)
        push = m2 * l / 2 * w**2 * np.sin(phi) - k * x
        return [[m1 + m2, coupling], [coupling, m2 * l**2 / 3]], [push, -m2 * G * l / 2 * np.sin(phi)]

    run = motion("slides_problem_3", 5.0)
    assert run.columns(["x", "phi"]) == pytest.approx(by_hand(terms, [0.05, 0.4, 0.0, 0.0], run.time), abs=1e-8)


M1, M2, R, L, K = 4.0, 1.0, 0.2, 0.5, 100.0


@pytest.mark.fmu
@pytest.mark.parametrize("further", [0.0, 0.5], ids=["built in", "port"])
def test_problem_4(further: float, motion) -> None:
    """With the moment M0 sin(Omega t), and a constant one at the port Q_phi."""

    def terms(t, phi, theta, u, w):
        c, s = np.cos(phi - theta), np.sin(phi - theta)
        moment = 0.5 * np.sin(3 * t) + further - K * R**2 * np.sin(phi) * np.cos(phi) - M2 * G * R * np.sin(phi)
        return (
            [[M1 * R**2 / 2 + M2 * R**2, M2 * R * L * c], [M2 * R * L * c, M2 * L**2]],
            [moment - M2 * R * L * w**2 * s, M2 * R * L * u**2 * s - M2 * G * L * np.sin(theta)],
        )

    run = motion("slides_problem_4", 5.0, Q_phi=further)
    assert run.columns(["phi", "theta"]) == pytest.approx(by_hand(terms, [0.0, 0.3, 0.0, 0.0], run.time), abs=1e-8)


@pytest.mark.fmu
def test_problem_4_small(motion) -> None:
    """Forced vibrations in the normal modes, from theta = 0.1 at rest."""
    M = np.array([[M1 * R**2 / 2 + M2 * R**2, M2 * R * L], [M2 * R * L, M2 * L**2]])
    stiffness = np.diag([K * R**2 + M2 * G * R, M2 * G * L])
    squares, modes = eigh(stiffness, M)
    run, Omega, w = motion("slides_problem_4_small", 5.0), 3.0, np.sqrt(squares)
    force, start = modes.T @ [0.5, 0.0], modes.T @ M @ [0.0, 0.1]
    t = run.time[:, None]
    settled = force / (squares - Omega**2)
    normal = settled * np.sin(Omega * t) + start * np.cos(w * t) - settled * Omega / w * np.sin(w * t)
    assert run.columns(["phi", "theta"]) == pytest.approx(normal @ modes.T, abs=1e-9)


def test_problem_4_small_is_problem_4_for_small_angles() -> None:
    """The energies written for small vibrations are those that the analysis finds from the exact form, unmoved."""
    small, exact = load("slides_problem_4_small").energy, replace(load("slides_problem_4"), forces={})
    form = linearized(exact).energy
    assert sp.expand(small.kinetic - form.kinetic) == 0
    assert sp.expand(small.potential - form.potential) == 0


@pytest.mark.fmu
@pytest.mark.parametrize("further", [0.0, -2.0], ids=["built in", "port"])
def test_problem_5(further: float, motion) -> None:
    """With the force F0 sin(Omega t), and a constant one at the port F."""
    m0, m, l, k = 0.1, 1.0, 0.5, 100.0  # noqa: E741

    def terms(t, x, phi, u, w):
        F = np.sin(3 * t) + further
        coupling = m * l * np.cos(phi)
        push = F + m * l * w**2 * np.sin(phi) - 2 * k * x
        return [[m0 + m, coupling], [coupling, m * l**2]], [push, F * l * np.cos(phi) - m * G * l * np.sin(phi)]

    run = motion("slides_problem_5", 5.0, F=further)
    assert run.columns(["x", "phi"]) == pytest.approx(by_hand(terms, [0.0, 0.2, 0.0, 0.0], run.time), abs=1e-8)


@pytest.mark.fmu
def test_problem_6(motion) -> None:
    """T = 3/4 m1 R^2 u^2 + m2 R^2 (1 - sin(phi)) u^2 + m2 l^2 w^2/6 + m2 R l u w h/2, h = cos(psi) - sin(phi + psi)."""
    m1, m2, l, k = 2.0, 0.5, 0.15, 200.0  # noqa: E741

    def terms(_, phi, psi, u, w):
        h, along, across = np.cos(psi) - np.sin(phi + psi), -np.cos(phi + psi), -np.sin(psi) - np.cos(phi + psi)
        coupling = m2 * R * l / 2
        M = [[1.5 * m1 * R**2 + 2 * m2 * R**2 * (1 - np.sin(phi)), coupling * h], [coupling * h, m2 * l**2 / 3]]
        first = m2 * R**2 * np.cos(phi) * u**2 - coupling * across * w**2 - k * R**2 * phi + m2 * G * R * np.cos(phi)
        return M, [first, -coupling * along * u**2 - m2 * G * l / 2 * np.sin(psi)]

    run = motion("slides_problem_6", 5.0)
    assert run.columns(["phi", "psi"]) == pytest.approx(by_hand(terms, [0.3, 0.2, 0.0, 0.0], run.time), abs=1e-7)
