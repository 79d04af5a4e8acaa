"""Central fields, the spherical pendulum and the cone: periods, precession, positions in time."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest
from quadrature import cycle
from scipy.optimize import brentq

pytestmark = pytest.mark.fmu

G = 9.81


def test_the_quadrature_finds_an_elliptic_integral() -> None:
    """So that the others mean something: the period of a pendulum of amplitude 1 is 4 K(sin(1/2)^2)."""
    period = cycle(lambda u: 2 * (mp.cos(u) - mp.cos(1)), -1.0, 1.0)
    assert period == pytest.approx(float(4 * mp.ellipk(mp.sin(0.5) ** 2)), rel=1e-14)


def test_spherical_pendulum(motion) -> None:
    """Period and precession between the parallels of turning; l = m = 1."""
    p = 2.0 * mp.sin(1) ** 2  # of phi_dot = 2 at theta = 1
    energy = p**2 / (2 * mp.sin(1) ** 2) - mp.mpf("9.81") * mp.cos(1)

    def rate(theta):
        return 2 * (energy - p**2 / (2 * mp.sin(theta) ** 2) + mp.mpf("9.81") * mp.cos(theta))

    other = brentq(lambda x: float(rate(mp.mpf(x))), 0.1, 0.9)
    period = cycle(rate, other, 1.0)
    turned = cycle(rate, other, 1.0, lambda theta: p / mp.sin(theta) ** 2)
    run = motion("spherical_pendulum", period)
    assert run["theta"][-1] == pytest.approx(1.0, rel=1e-8)
    assert run["phi"][-1] == pytest.approx(turned, rel=1e-8)
    assert run["theta"][10] == pytest.approx(other, rel=1e-8)


def test_conical_pendulum(motion) -> None:
    """theta stays where phi_dot^2 = g/(l cos(theta))."""
    run = motion("spherical_pendulum", 5.0, phi_dot=np.sqrt(G / np.cos(1.0)))
    assert run["theta"] == pytest.approx(np.ones(21), rel=1e-8)


def test_particle_on_cone(motion) -> None:
    alpha, p = mp.pi / 6, 7 * mp.sin(mp.pi / 6) ** 2
    g = mp.mpf("9.81")
    energy = p**2 / (2 * mp.sin(alpha) ** 2) + g * mp.cos(alpha)

    def rate(s):
        return 2 * (energy - p**2 / (2 * s**2 * mp.sin(alpha) ** 2) - g * s * mp.cos(alpha))

    root = brentq(lambda s: float(rate(mp.mpf(s))) / (s - 1), 0.05, 5.0)
    low, high = sorted((root, 1.0))
    run = motion("particle_on_cone", cycle(rate, low, high))
    assert run["s"][-1] == pytest.approx(1.0, rel=1e-8)
    turned = cycle(rate, low, high, lambda s: p / (s**2 * mp.sin(alpha) ** 2))
    assert run["phi"][-1] == pytest.approx(turned, rel=1e-8)
    assert run["s"][10] == pytest.approx(root, rel=1e-8)


def ellipse(t: float, near: float, speed: float, strength: float) -> tuple[float, float]:
    """(r, phi) in the field -strength/r of a particle of mass 1, a time t after its perihelion ``near``.

    Through Kepler's equation, e < 1: n t = E - e sin(E); e > 1: n t = e sinh(F) - F.
    """
    e = near * speed**2 / strength - 1
    a = near / (1 - e)
    mean = np.sqrt(strength / abs(a) ** 3) * t
    if e < 1:
        E = brentq(lambda x: x - e * np.sin(x) - mean, mean - 2, mean + 2, xtol=1e-15, rtol=1e-15)
        turns = 2 * np.pi * np.floor((E + np.pi) / (2 * np.pi))
        return a * (1 - e * np.cos(E)), turns + 2 * np.arctan2(
            np.sqrt(1 + e) * np.sin((E - turns) / 2), np.sqrt(1 - e) * np.cos((E - turns) / 2)
        )
    F = brentq(lambda x: e * np.sinh(x) - x - mean, 0, 20, xtol=1e-15, rtol=1e-15)
    return -a * (e * np.cosh(F) - 1), 2 * np.arctan(np.sqrt((e + 1) / (e - 1)) * np.tanh(F / 2))


@pytest.mark.parametrize("turning", [3.4, 5.0], ids=["ellipse", "hyperbola"])
def test_kepler(turning: float, motion) -> None:
    run = motion("kepler", 10.0, phi_dot=turning)
    for time, r, phi in zip(run.time, run["r"], run["phi"], strict=True):
        assert (r, phi) == pytest.approx(ellipse(time, 0.5, 0.5 * turning, 1.0), rel=1e-8)


@pytest.mark.parametrize("beta", [0.02, -0.02])
def test_the_perihelion_advances(beta: float, motion) -> None:
    """U = -alpha/r + beta/r^2: as Kepler's problem with M^2 + 2 m beta, while phi goes with M; m = alpha = 1."""
    M, energy = 0.5**2 * 3.4, (0.5 * 3.4) ** 2 / 2 - 1 / 0.5 + beta / 0.5**2
    period = np.pi / np.sqrt(2 * abs(energy) ** 3)
    run = motion("kepler", period, beta=beta)
    assert run["r"][-1] == pytest.approx(0.5, rel=1e-8)
    assert run["phi"][-1] == pytest.approx(2 * np.pi / np.sqrt(1 + 2 * beta / M**2), rel=1e-8)


def test_mechanical_similarity(motion) -> None:
    """Kepler's third law: paths 4 times as large take 8 times as long (Mechanics, section 10)."""
    small, large = motion("kepler", 2.0), motion("kepler", 16.0, r=2.0, phi_dot=3.4 / 8)
    assert large["r"] == pytest.approx(4 * small["r"], rel=1e-8)
    assert large["phi"] == pytest.approx(small["phi"], rel=1e-8)


def test_two_bodies(motion) -> None:
    """The distance as one particle of the reduced mass 2/3, the mass centre straight on; both start at an apsis."""
    run = motion("two_bodies", 8.0)
    for i, time in enumerate(run.time):
        r, phi = ellipse(time, 1.5, 2.5, 4.0 / (2.0 / 3.0))
        difference = (run["x2"][i] - run["x1"][i], run["y2"][i] - run["y1"][i])
        assert difference == pytest.approx((r * np.cos(phi), r * np.sin(phi)), rel=1e-8, abs=1e-8)
    assert run["x1"] + 2 * run["x2"] == pytest.approx(np.zeros(21), abs=1e-9)
    assert (run["y1"] + 2 * run["y2"]) / 3 == pytest.approx(run.time / 6, abs=1e-9)


def test_three_bodies_take_their_places_in_turn(motion) -> None:
    """After a third of the published period each is where another one was; the start values have 8 digits."""
    run = motion("three_bodies", 6.32591398, steps=3)
    start = {i: (run[f"x{i}"][0], run[f"y{i}"][0]) for i in (1, 2, 3)}
    for i in (1, 2, 3):
        assert (run[f"x{i}"][-1], run[f"y{i}"][-1]) == pytest.approx(start[i], abs=1e-6)
    visited = {j for j in (2, 3) if np.hypot(run["x1"][1] - start[j][0], run["y1"][1] - start[j][1]) < 1e-6}
    assert len(visited) == 1
