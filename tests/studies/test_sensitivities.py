"""Derivatives through time: closed forms, differences of tight runs, jumps at events, refusals."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import lag2fmu
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.mechanism import Body, Mechanism, Spring, coordinate, parameter
from lag2fmu.studies.library import Study, compiled
from lag2fmu.studies.requests import references_of

pytestmark = pytest.mark.fmu


def differences(
    model: object, over: str, outputs: list[str], times: Any, values: Mapping[str, float] | None = None
) -> Any:
    """d outputs / d over, (m, k), by central differences with one extrapolation, of runs at the tightest tolerance."""
    library = compiled(model, solver="dop853")
    study, references = Study(library), library.readable(outputs)
    centre = (values or {}).get(over, library.variables[over].start or 0.0)
    width = 1e-4 * (abs(centre) or 1.0)

    def run(value: float) -> Any:
        found, _, reason = study.run(
            references_of(library, {**(values or {}), over: value}), times, references, tolerance=1e-13
        )
        assert not reason
        return found

    def slope(h: float) -> Any:
        return (run(centre + h) - run(centre - h)) / (2 * h)

    return (4 * slope(width / 2) - slope(width)) / 3


def oscillator() -> Mechanism:
    """M x'' + k x = Q, in a few lines; x(0) = 1, x'(0) = 0.5."""
    m, k = parameter("m", 2.0, "kg"), parameter("k", 8.0, "N/m")
    x = coordinate("x", "m", start=1.0, velocity=0.5)
    spring = Spring("spring", stiffness=k, elongation=x)
    return Mechanism(
        "oscillator", coordinates=[x], parameters=[m, k], bodies=[Body("block", m, (x, 0))], springs=[spring]
    )


def test_the_oscillator_has_its_closed_form() -> None:
    """x = x0 cos wt + v0/w sin wt + Q/k (1 - cos wt): by x0, v0, k and a constant force."""
    times = np.linspace(0, 5, 21)
    found = lag2fmu.sensitivities(
        oscillator(), over=["x", "x_dot", "k", "Q_x"], outputs=["x", "x_dot"], times=times, tolerance=1e-11
    )
    w, m, x0, v0 = 2.0, 2.0, 1.0, 0.5
    c, s = np.cos(w * times), np.sin(w * times)
    by_w = -x0 * times * s + v0 * (times * c / w - s / w**2)
    np.testing.assert_allclose(found["x"], x0 * c + v0 / w * s, atol=1e-9)
    np.testing.assert_allclose(found["x", "x"], c, atol=1e-9)
    np.testing.assert_allclose(found["x", "x_dot"], s / w, atol=1e-9)
    np.testing.assert_allclose(found["x_dot", "x"], -w * s, atol=1e-9)
    np.testing.assert_allclose(found["x", "k"], by_w / (2 * w * m), atol=1e-9)
    np.testing.assert_allclose(found["x", "Q_x"], (1 - c) / 8.0, atol=1e-9)
    assert found.unit("x", "k").name in {"m/(N/m)", "m2/N", "s2.m/kg", "m.s2/kg"}
    with pytest.raises(LoadError, match="no output 'y'"):
        found["y"]
    with pytest.raises(LoadError, match="'m' of 'oscillator' stands twice"):
        lag2fmu.sensitivities(oscillator(), over=["m", "m"])
    with pytest.raises(LoadError, match="'moreau' carries no derivatives"):
        lag2fmu.sensitivities(oscillator(), over=["m"], solver="moreau")


def test_inputs_over_time_are_followed() -> None:
    """A ramp Q = r t on the oscillator, in two pieces of one slope: x = r/k (t - sin wt / w) from rest."""
    times = np.linspace(0, 3, 13)
    ramp = {"time": [0.0, 1.3, 3.0], "Q_x": [0.0, 1.3, 3.0]}
    found = lag2fmu.sensitivities(
        oscillator(), over=["k"], outputs=["x"], times=times, inputs=ramp, values={"x": 0.0, "x_dot": 0.0},
        tolerance=1e-11,
    )  # fmt: skip
    w, k = 2.0, 8.0
    np.testing.assert_allclose(found["x"], (times - np.sin(w * times) / w) / k, atol=1e-9)
    by_w = (np.sin(w * times) / w**2 - times * np.cos(w * times) / w) / k
    exact = -(times - np.sin(w * times) / w) / k**2 + by_w / (2 * w * 2.0)
    np.testing.assert_allclose(found["x", "k"], exact, atol=1e-9)


@pytest.mark.slow
def test_a_ball_bounces_as_its_closed_form() -> None:
    """After the first impact at t1 = sqrt(2 h / g): y = v (t - t1) - g/2 (t - t1)^2 with v = e g t1."""
    library = compiled("bouncing_ball")
    h, g, e = (library.variables[name].start for name in ("y", "g", "e"))
    t = np.array([0.3, 0.7, 1.0])
    found = lag2fmu.sensitivities("bouncing_ball", over=["y", "g", "e"], outputs=["y", "y_dot"], times=t)
    t1 = np.sqrt(2 * h / g)
    s, after = t - t1, t > t1
    by_t1 = e * g * s - e * g * t1 + g * s
    np.testing.assert_allclose(found["y", "y"], np.where(after, by_t1 * t1 / (2 * h), 1.0), atol=1e-8)
    np.testing.assert_allclose(found["y", "e"], np.where(after, g * t1 * s, 0.0), atol=1e-8)
    by_g = e * t1 * s - s**2 / 2 - by_t1 * t1 / (2 * g)
    np.testing.assert_allclose(found["y", "g"], np.where(after, by_g, -(t**2) / 2), atol=1e-8)


@pytest.mark.slow
def test_an_impact_at_the_start_moves_with_the_start() -> None:
    """A ball is thrown at the floor that it touches: from y it comes at tau = y/v, and leaves with e (v + g tau)."""
    e, g, v, t = 0.8, 9.81, 2.0, 0.1
    start = {"y": 0.0, "y_dot": -v}
    found = lag2fmu.sensitivities(
        "bouncing_ball", over=["e", "y_dot", "y"], outputs=["y", "y_dot"], times=[0.0, t], values=start
    )
    by_y = e * g / v
    expected = [[v * t, -e * t, by_y * t - e + g * t / v], [v, -e, by_y + g / v]]
    np.testing.assert_allclose(found.derivatives[1], expected, rtol=1e-9)
    np.testing.assert_allclose(found.derivatives[0], [[0, 0, -e], expected[1]], rtol=1e-9, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "over", "stop", "accuracy"),
    [
        ("double_pendulum", ["m1", "l2", "g", "theta1"], 5.0, 1e-8),
        ("slider_crank", ["l1", "J1", "a_dot"], 1.0, 1e-6),  # constraints, starts that follow
        ("rolling_disc", ["R", "g", "theta"], 1.0, 1e-7),  # nonholonomic
        ("coulomb_oscillator", ["k", "F", "x"], 10.0, 1e-8),  # dry friction: slides, sticks
        ("pendulum_with_stop", ["l", "wall", "e", "theta"], 2.9, 1e-8),  # the place of an impact varies
        ("woodpecker", ["c", "mu"], 0.3, 1e-7),  # slides, sticks, opens, with impacts in between
        ("impact_oscillator", ["k", "d", "Omega", "e"], 9.0, 1e-8),  # driven by time
    ],
)
def test_derivatives_are_those_of_differences(model: str, over: list[str], stop: float, accuracy: float) -> None:
    found = lag2fmu.sensitivities(model, over=over, stop_time=stop, step=stop / 37, tolerance=1e-11)
    for i, name in enumerate(over):
        expected = differences(model, name, list(found.outputs), found.time)
        size = abs(expected).max(axis=0) + 1e-3
        np.testing.assert_array_less(abs(found.derivatives[:, :, i] - expected) / size, accuracy)


@pytest.mark.slow
def test_what_has_no_derivative_is_refused() -> None:
    with pytest.raises(LoadError, match="is a guess that the constraints"):
        lag2fmu.sensitivities("four_bar_linkage", over=[_guess("four_bar_linkage")])
    with pytest.raises(LoadError, match="has no derivative: it is a number that events change"):
        lag2fmu.sensitivities("bouncing_ball", over=["e"], outputs=["floor_impacts"])
    with pytest.raises(SimulationError, match=r"newtons_cradle.*has no derivative"):  # the balls meet at once
        lag2fmu.sensitivities("newtons_cradle", over=["e"], stop_time=2.0)


def _guess(model: str) -> str:
    library = compiled(model)
    return next(name for name, v in library.variables.items() if v.initial == "approx")


@pytest.mark.slow
def test_derivatives_are_those_of_a_complex_step() -> None:
    """The pendulum with a length, gravity and start that have a tiny imaginary part, by SciPy in complex numbers."""
    times = np.linspace(0.0, 4.0, 9)
    found = lag2fmu.sensitivities(
        "pendulum", over=["l", "g", "theta"], outputs=["theta", "theta_dot"], times=times, tolerance=1e-12
    )
    library = compiled("pendulum")
    centre = [float(library.variables[name].start or 0.0) for name in found.over]
    for i in range(3):
        length, gravity, start = (value + (1e-30j if i == j else 0) for j, value in enumerate(centre))

        def slope(t: float, x: Any, ratio: complex = gravity / length) -> Any:
            return [x[1], -ratio * np.sin(x[0])]

        run = solve_ivp(slope, (0, 4), np.array([start, 0j]), "DOP853", times, rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(found.derivatives[:, :, i], run.y.T.imag / 1e-30, atol=1e-8)


@pytest.mark.toolchain
def test_derivatives_are_those_of_cvodes() -> None:
    """Forward sensitivities of the double pendulum; CasADi differentiates the Lagrangian and calls CVODES."""
    pytest.importorskip("casadi", reason="CasADi is not installed")
    from benchmarks import sensitivities as bench

    library = compiled("double_pendulum")
    expected = bench.cvodes(library, 1e-11, "adams")()
    found = bench.ours(library, 1e-11)()
    assert abs(found - expected).max() < 1e-7 * abs(expected).max()
