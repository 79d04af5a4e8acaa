"""Particles with forces between them, Lagrangians that add, a Lagrangian that is changed, and the phase flow."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest
from quadrature import cycle
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipj

import lag2fmu

pytestmark = pytest.mark.fmu

G = 9.81
EPSILON, RANGE = 0.25, 0.4  # sigma is 1


def potential(r):
    return EPSILON * ((1 - mp.exp((1 - r) / RANGE)) ** 2 - 1)


def slope(r):
    """dU/dr: the force with which two particles attract each other."""
    far = np.exp((1 - r) / RANGE)
    return 2 * EPSILON / RANGE * (1 - far) * far


def test_three_particles_breathe(motion) -> None:
    """An equilateral triangle of radius R stays one, and R moves in one dimension: Mechanics, sections 5 and 11.

    For each particle (R_dot^2 + p^2/R^2)/2 + U(sqrt(3) R) is the energy; m = 1.
    """
    start = mp.mpf(1.1) / mp.sqrt(3)
    p = start**2 / 2

    def effective(R):
        return potential(mp.sqrt(3) * R) + p**2 / (2 * R**2)

    def rate(R):
        return 2 * (effective(start) - effective(R))

    other = brentq(lambda R: float(rate(mp.mpf(R))), 0.3, 0.99 * float(start))
    period = cycle(rate, other, float(start))
    turned = cycle(rate, other, float(start), lambda R: p / R**2)
    run = motion("particles", period)
    places = [run[f"x{i}"] + 1j * run[f"y{i}"] for i in (1, 2, 3)]
    for i, place in enumerate(places):
        assert place == pytest.approx(places[0] * np.exp(2j * np.pi * i / 3), abs=1e-8)
    assert np.abs(places[0][[10, -1]]) == pytest.approx([other, float(start)], rel=1e-8)
    assert np.unwrap(np.angle(places[0]))[-1] == pytest.approx(-turned, rel=1e-8)


@pytest.mark.parametrize("n", [2, 5])
def test_a_polygon_of_particles_turns(n: int, exported) -> None:
    """Rigidly, with Omega^2 R = sum of U'(2 R sin(pi j/n)) sin(pi j/n) over the others, m = 1."""
    j, R = np.arange(1, n), 1.15 / (2 * np.sin(np.pi / n))
    Omega = np.sqrt((slope(2 * R * np.sin(np.pi * j / n)) * np.sin(np.pi * j / n)).sum() / R)
    values, corners = {}, R * np.exp(2j * np.pi * np.arange(n) / n)
    for i, corner in enumerate(corners, start=1):
        velocity = 1j * Omega * corner
        values |= {f"x{i}": float(corner.real), f"y{i}": float(corner.imag)}
        values |= {f"x{i}_dot": float(velocity.real), f"y{i}_dot": float(velocity.imag)}
    run = lag2fmu.simulate(exported("particles", n=n), stop_time=3.0, step=0.1, tolerance=1e-11, values=values)
    for i, corner in enumerate(corners, start=1):
        assert run[f"x{i}"] + 1j * run[f"y{i}"] == pytest.approx(corner * np.exp(1j * Omega * run.time), abs=1e-8)


def test_lagrangians_of_distant_systems_add(exported) -> None:
    """lim L = L_A + L_B (Mechanics, formula 2.7), of two pairs of particles on a line.

    Each pair swings as if it were alone, but for the force between the nearest ends, which fades as exp(-distance/a).
    """

    def alone(_: float, z: np.ndarray) -> list[float]:  # the distance in a pair of equal masses
        return [z[1], -2 * slope(z[0])]

    def deviation(gap: float) -> float:
        values = {f"{name}{i}_dot": 0.0 for name in "xy" for i in range(1, 5)} | {f"y{i}": 0.0 for i in range(1, 5)}
        values |= {f"x{i}": x for i, x in enumerate([0.0, 1.1, 1.1 + gap, 2.3 + gap], start=1)}
        run = lag2fmu.simulate(exported("particles", n=4), stop_time=2.0, step=0.1, tolerance=1e-13, values=values)
        off = []
        for first, second, length in ((1, 2, 1.1), (3, 4, 1.2)):
            expected = solve_ivp(alone, (0, 2), [length, 0], "DOP853", run.time, rtol=1e-13, atol=1e-14).y[0]
            off.append(np.abs(run[f"x{second}"] - run[f"x{first}"] - expected).max())
        return max(off)

    assert deviation(1e3) < 1e-11
    near, far = deviation(5.0), deviation(8.0)
    assert near > 1e-5
    assert np.log(near / far) == pytest.approx(3.0 / RANGE, rel=1e-2)


@pytest.mark.parametrize("strength", [0.0, 5.0, -40.0])
def test_a_total_derivative_changes_nothing(strength: float, exported) -> None:
    """The pendulum's motion, sin(theta/2) = k cd(t sqrt(g/l), k), whatever is added; p and h do change."""
    fmu = exported("changed_lagrangian", outputs=("p_theta", "generalized_energy"))
    run = lag2fmu.simulate(fmu, stop_time=5.0, step=0.1, tolerance=1e-11, values={"s": strength})
    k = np.sin(0.5)
    _, cn, dn, _ = ellipj(np.sqrt(G) * run.time, k**2)
    theta = 2 * np.arcsin(k * cn / dn)
    assert run["theta"] == pytest.approx(theta, abs=1e-8)
    usual = run["theta_dot"]
    assert run["p_theta"] == pytest.approx(usual + strength * run.time * np.cos(theta), abs=1e-6)
    assert run["generalized_energy"] == pytest.approx(-G * np.cos(1.0) - strength * np.sin(theta), abs=1e-6)


# ----------------------------------------------------------------------------------------------- Liouville's theorem


def flow(motion, model: str, start: dict[str, float], stop: float, **others: float) -> tuple[np.ndarray, np.ndarray]:
    """(end, derivatives of the end by the start), each over the names in ``start``; differences of fourth order."""

    def end(**changed: float) -> np.ndarray:
        run = motion(model, stop, steps=1, tolerance=1e-12, **(start | others | changed))
        return np.array([run[name][-1] for name in start])

    columns, h = [], 1e-3
    for name, x in start.items():
        near, far = (end(**{name: x + s * h}) - end(**{name: x - s * h}) for s in (1, 2))
        columns.append((8 * near - far) / (12 * h))
    return end(), np.array(columns).T


def test_the_phase_volume_of_a_double_pendulum_stays(motion) -> None:
    """d(q, p) at the end is d(q, p) at the start: that of (q, qd), times det M (Mechanics, section 46)."""
    start = {"theta1": 0.5, "theta2": -0.4, "theta1_dot": 1.0, "theta2_dot": 0.5}
    end, change = flow(motion, "double_pendulum", start, 2.0)

    def mass(theta1: float, theta2: float) -> float:  # det M for masses and lengths 1
        return 2 - np.cos(theta1 - theta2) ** 2

    assert abs(np.linalg.det(change) - 1) > 1e-3, "velocities alone do not keep the volume"
    assert np.linalg.det(change) * mass(*end[:2]) / mass(0.5, -0.4) == pytest.approx(1.0, abs=1e-8)


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_the_phase_volume_of_a_forced_oscillator(friction: float, motion) -> None:
    """The force does not change it, friction lets it shrink as exp(-c t/m); here with a cubic part of the spring."""
    _, change = flow(motion, "forced_oscillator", {"x": 0.3, "x_dot": -0.2}, 3.0, c=friction, beta=2.0)
    assert np.linalg.det(change) == pytest.approx(np.exp(-3 * friction), rel=1e-8)
