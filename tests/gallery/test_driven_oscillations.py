"""Oscillations with friction, under a periodic force, a periodic stiffness, a fast drive: the formulas of the book."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import mathieu_a, mathieu_b, mathieu_cem, mathieu_sem

pytestmark = pytest.mark.fmu

# ------------------------------------------------------------------------------------------------ damped (section 25)


@pytest.mark.parametrize("c", [0.5, 2 * np.sqrt(40.0), 30.0], ids=["periodic", "critical", "aperiodic"])
def test_damped_oscillation(c: float, motion) -> None:
    """From x = 0.1 at rest, m = 1, k = 40; x0 (1 + lambda t) exp(-lambda t) between the two kinds."""
    run = motion("spring_mass_damper", 3.0, c=float(c))
    rate, w = c / 2, np.sqrt(complex(40.0 - c**2 / 4))
    sine = np.sin(w * run.time) / w if abs(w) > 1e-6 else run.time
    expected = 0.1 * np.exp(-rate * run.time) * (np.cos(w * run.time) + rate * sine).real
    assert run["x"] == pytest.approx(expected, abs=1e-9)


# ------------------------------------------------------------------------------- forced, m = F0 = 1, w0 = 2 (22, 26)

W0 = 2.0


def test_forced_with_friction(motion) -> None:
    """From rest: the settled oscillation and a damped one that starts opposite to it."""
    rate, Omega, run = 0.2, 1.5, motion("forced_oscillator", 20.0)
    settled = 1 / (W0**2 - Omega**2 + 2j * rate * Omega)
    w = np.sqrt(W0**2 - rate**2)
    start, velocity = -settled.real, -(1j * Omega * settled).real
    free = start * np.cos(w * run.time) + (velocity + rate * start) / w * np.sin(w * run.time)
    forced = (settled * np.exp(1j * Omega * run.time)).real
    assert run["x"] == pytest.approx(forced + np.exp(-rate * run.time) * free, abs=1e-9)


@pytest.mark.parametrize("Omega", [0.5, 2.0, 3.5])
def test_amplitude_and_phase_under_friction(Omega: float, motion) -> None:
    """Mechanics, section 26; after 120 s: x = b cos(Omega t + delta), tan(delta) = 2 lambda Omega/(Omega^2 - w0^2)."""
    period, rate = 2 * np.pi / Omega, 0.2
    before = int(np.ceil(120.0 / period))
    run = motion("forced_oscillator", (before + 1) * period, steps=(before + 1) * 4, Omega=Omega)
    cosine, sine = run["x"][-5], -run["x"][-4]  # at whole periods and a quarter later
    b = 1 / np.sqrt((W0**2 - Omega**2) ** 2 + 4 * rate**2 * Omega**2)
    delta = np.arctan2(-2 * rate * Omega, W0**2 - Omega**2)
    assert np.hypot(cosine, sine) == pytest.approx(b, rel=1e-8)
    assert np.arctan2(sine, cosine) == pytest.approx(delta, abs=1e-8)


def test_resonance_without_friction(motion) -> None:
    """The oscillation grows as t; beside the resonance it beats with the difference of the frequencies (section 22)."""
    run = motion("forced_oscillator", 50.0, c=0.0, Omega=W0)
    assert run["x"] == pytest.approx(run.time / (2 * W0) * np.sin(W0 * run.time), abs=1e-8)
    run = motion("forced_oscillator", 50.0, c=0.0, Omega=1.9)
    beats = 2 * np.sin(0.05 * run.time) * np.sin(1.95 * run.time) / (W0**2 - 1.9**2)
    assert run["x"] == pytest.approx(beats, abs=1e-8)


# -------------------------------------------------------------------------------- nonlinear resonance, m = w0 = 1 (29)

RATE, FORCE, BETA = 1e-3, 4e-3, 4e-3
KAPPA = 3 * BETA / 8


def amplitudes(epsilon: float) -> list[float]:
    """Those of Mechanics, section 29, b^2 ((epsilon - kappa b^2)^2 + lambda^2) = (f/2)^2, from small to large."""
    cubic = [KAPPA**2, -2 * KAPPA * epsilon, epsilon**2 + RATE**2, -((FORCE / 2) ** 2)]
    return sorted(float(np.sqrt(x.real)) for x in np.roots(cubic) if abs(x.imag) < 1e-9)


def settled(motion, epsilon: float, b: float) -> float:
    """The amplitude after 10/lambda, from the start that would settle at the amplitude ``b``."""
    Omega = 1 + epsilon
    start = b * np.exp(1j * np.angle(1 / (KAPPA * b**2 - epsilon + 1j * RATE)))
    values = {"k": 1.0, "c": 2 * RATE, "beta": BETA, "F0": FORCE, "Omega": Omega}
    values |= {"x": float(start.real), "x_dot": float((1j * Omega * start).real)}
    periods = int(10 / RATE * Omega / (2 * np.pi))
    run = motion("forced_oscillator", periods * 2 * np.pi / Omega, steps=periods, tolerance=1e-8, **values)
    return float(np.hypot(run["x"][-1], run["x_dot"][-1] / Omega))


def test_resonance_of_a_nonlinear_oscillation(motion) -> None:
    """Two amplitudes are stable within a range of frequencies, at its ends the amplitude jumps (section 29).

    The formula is of first order in beta b^2/w0^2, which is up to 0.016 here; its middle root is not stable.
    """
    small, middle, large = amplitudes(4.5e-3)
    assert settled(motion, 4.5e-3, small) == pytest.approx(small, rel=1e-2)
    assert settled(motion, 4.5e-3, large) == pytest.approx(large, rel=1e-2)
    assert settled(motion, 4.5e-3, 1.1 * middle) == pytest.approx(large, rel=1e-2)
    (above,), (below,) = amplitudes(6.6e-3), amplitudes(2.9e-3)
    assert settled(motion, 6.6e-3, large) == pytest.approx(above, rel=1e-2), "jumped down"
    assert settled(motion, 2.9e-3, 0.8) == pytest.approx(below, rel=1e-2), "jumped up"
    assert above < 0.2 * large
    assert below > 1.9 * 0.8


# ------------------------------------------------------------------------------------------ parametric resonance (27)


def monodromy(motion, model: str, name: str, period: float, rest: float = 0.0, **values: float) -> np.ndarray:
    """The state after a period from the unit states, (2, 2); for linear motions about ``rest``."""
    size, columns = 1e-5 if rest else 1.0, []
    for place, rate in ((size, 0.0), (0.0, size)):
        start = {name: rest + place, f"{name}_dot": rate}
        run = motion(model, period, steps=1, tolerance=1e-12, **start, **values)
        columns.append([(run[name][-1] - rest) / size, run[f"{name}_dot"][-1] / size])
    return np.array(columns).T


def hill(a: float, q: float) -> float:
    """The trace for x'' + (a - 2 q cos(2 tau)) x = 0 over the period pi, by Hill's determinant.

    E. T. Whittaker, G. N. Watson, A Course of Modern Analysis, section 19.42.
    """
    n = 2.0 * np.arange(-800, 801)
    beside = q / (n**2 - a)
    determinant = np.linalg.det(np.eye(len(n)) + np.diag(beside[:-1], 1) + np.diag(beside[1:], -1))
    return float(2 - 4 * determinant * np.sin(np.pi * np.sqrt(a) / 2) ** 2)


@pytest.mark.parametrize(("h", "gamma"), [(0.3, 4.0), (0.3, 3.7), (0.5, 2.1), (1.5, 5.0)])
def test_parametric_oscillator(h: float, gamma: float, motion) -> None:
    found = monodromy(motion, "parametric_oscillator", "x", 2 * np.pi / gamma, h=h, gamma=gamma)
    a = (2 * W0 / gamma) ** 2
    assert np.trace(found) == pytest.approx(hill(a, a * h / 2), abs=1e-8)
    assert np.linalg.det(found) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("epsilon", [0.0, 0.008, 0.03])
def test_growth_in_parametric_resonance(epsilon: float, motion) -> None:
    """s^2 = ((h w0/2)^2 - epsilon^2)/4 about gamma = 2 w0 (Mechanics, section 27), to first order in h = 0.02."""
    gamma, h = 2 * W0 + epsilon, 0.02
    found = monodromy(motion, "parametric_oscillator", "x", 2 * np.pi / gamma, h=h, gamma=gamma)
    exponent = np.log(complex(np.linalg.eigvals(-found)[0])) * gamma / (2 * np.pi)
    expected = ((h * W0 / 2) ** 2 - epsilon**2) / 4
    assert (exponent**2).real == pytest.approx(expected, abs=2e-2 * abs(expected) + 1e-8)
    assert (exponent**2).imag == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("edge", "function", "start"), [(mathieu_a, mathieu_cem, "x"), (mathieu_b, mathieu_sem, "x_dot")]
)
def test_periodic_motions_on_the_borders_of_resonance(edge, function, start: str, motion) -> None:
    """Mathieu's functions ce_1 and se_1 (M. Abramowitz, I. A. Stegun, section 20.2) as motions; q = 0.6."""
    q, gamma = 0.6, 3.0
    a = float(edge(1, q))
    places = {"x": 0.0, "x_dot": 0.0} | {start: 1.0}
    values = {"k": a * gamma**2 / 4, "h": -2 * q / a, "gamma": gamma}
    run = motion("parametric_oscillator", 4 * np.pi / gamma, **values, **places)
    tau = gamma * run.time / 2
    value, derivative = function(1, q, np.rad2deg(tau))
    unit = value[0] if start == "x" else derivative[0] * gamma / 2
    assert run["x"] == pytest.approx(value / unit, abs=1e-7)


def test_friction_sets_a_threshold(motion) -> None:
    """At gamma = 2 w0 oscillations grow where h w0/4 > lambda, to first order in h (section 27)."""
    for factor, grows in ((0.98, True), (1.02, False)):
        c = 2 * factor * 0.02 * W0 / 4
        found = monodromy(motion, "parametric_oscillator", "x", np.pi / W0, h=0.02, c=c)
        assert (np.abs(np.linalg.eigvals(found)).max() > 1) == grows


# ----------------------------------------------------------------------------- a rapidly oscillating field (section 30)


def test_the_slow_motion_of_a_fast_driven_pendulum(motion) -> None:
    """About the upright, omega^2 = A^2 Omega^2/(2 l^2) - g/l; seen once a period it is a cosine. (A/l)^2 = 1e-4."""
    drive, period = 1000.0, 2 * np.pi / 1000.0
    values = {"A": 0.01, "Omega": drive, "theta": np.pi + 1e-4}
    run = motion("vertically_driven_pendulum", 100 * period, steps=100, tolerance=1e-11, **values)
    slow = np.sqrt(0.01**2 * drive**2 / 2 - 9.81)
    assert (run["theta"] - np.pi) / 1e-4 == pytest.approx(np.cos(slow * run.time), abs=1e-2)
    frequency = np.arccos((run["theta"][50] - np.pi) / 1e-4) / run.time[50]
    assert frequency == pytest.approx(slow, rel=1e-3)
