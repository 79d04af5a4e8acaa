"""Coefficients of restitution that change with speed, time and inputs; the motions are in closed form."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import lag2fmu
from lag2fmu.errors import SimulationError
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Mechanism
from lag2fmu.reference.direct_integration import integrate

pytestmark = pytest.mark.fmu

G = 9.81
WAYS = pytest.mark.parametrize("way", ["co-simulation", "model-exchange", "judge"])


def _ball(restitution: str, further: str = "", start: float = 2.0) -> Mechanism:
    """A ball of 1 kg at a height of ``start`` (m), and ``further`` tables."""
    return read(
        f"""
        [mechanism]
        name = "ball"
        [parameters]
        c = {{ value = 0.05, unit = "s/m" }}
        capture = {{ value = 0.4, unit = "m/s" }}
        second = {{ value = 1.0, unit = "s" }}
        metre = {{ value = 1.0, unit = "m" }}
        g = {{ value = {G}, unit = "m/s2" }}
        [coordinates]
        y = {{ unit = "m", start = {start} }}
        [gravity]
        acceleration = "g"
        [bodies]
        ball = {{ mass = 1, position = ["0", "y"] }}
        [contacts.floor]
        gap = "y"
        restitution = "{restitution}"
        {further}
        """,
        "ball",
    )


def _heights(times: np.ndarray, law: Callable[[float, float], float], start: float = 2.0) -> np.ndarray:
    """The heights (m) at ``times`` (m,), where ``law`` tells the coefficient by speed (m/s) and time (s)."""
    fall = np.sqrt(2.0 * start / G)
    impacts, speeds = [-fall], [G * fall]
    while impacts[-1] < times[-1] and speeds[-1] > 1e-12:
        impacts.append(impacts[-1] + 2.0 * speeds[-1] / G)
        speeds.append(law(speeds[-1], impacts[-1]) * speeds[-1])
    at = np.searchsorted(impacts, times, side="right") - 1
    since = times - np.array(impacts)[at]
    return np.maximum(np.array(speeds)[at] * since - 0.5 * G * since**2, 0.0)


def _motion(mechanism: Mechanism, way: str, names: list[str], stop: float, tolerance: float = 1e-10) -> np.ndarray:
    """Times (s) and ``names``, (1 + k, 101)."""
    times = np.linspace(0.0, stop, 101)
    if way == "judge":
        return np.vstack([times, integrate(mechanism, times, rtol=tolerance).trajectory.columns(names).T])
    run = lag2fmu.simulate(mechanism, stop_time=stop, step=stop / 100, tolerance=tolerance, outputs=names, kind=way)
    return np.vstack([run.time, run.columns(names).T])


@WAYS
@pytest.mark.parametrize(
    ("restitution", "law"),
    [
        ("0.9 - c*abs(y_dot)", lambda v, t: 0.9 - 0.05 * v),
        ("0.9 + c*y_dot", lambda v, t: 0.9 - 0.05 * v),
        ("0.95 - 0.05*sqrt(-y_dot/capture)", lambda v, t: 0.95 - 0.05 * np.sqrt(v / 0.4)),
        ("if(abs(y_dot) < capture, 0, 0.7)", lambda v, t: 0.0 if v < 0.4 else 0.7),
        ("0.9*exp(-0.3*t/second)", lambda v, t: 0.9 * np.exp(-0.3 * t)),
        ("(1 + 1e-12)*capture/(0.4*metre/second)", lambda v, t: 1.0),
    ],
    ids=[
        "falls with the speed",
        "means nothing upwards",
        "has no value upwards",
        "captures what is slow",
        "falls with time",
        "is 1 by rounding",
    ],
)
def test_a_ball_bounces_by_its_law(way: str, restitution: str, law: Callable[[float, float], float]) -> None:
    """Each flight lasts 2 v/g, and each impact leaves e v."""
    t, y = _motion(_ball(restitution), way, ["y"], 4.0)
    assert y == pytest.approx(_heights(t, law), abs=3e-8)


@WAYS
def test_each_round_of_a_cradle_has_its_own_speed(way: str) -> None:
    """Three equal balls, two of which touch: the rounds are those of balls that are apart."""
    contacts = "".join(
        f"""
        [contacts.c{i}]
        gap = "x{i + 1} - x{i} - d"
        restitution = "1 - c*abs(x{i + 1}_dot - x{i}_dot)"
        """
        for i in (1, 2)
    )
    mechanism = read(
        f"""
        [mechanism]
        name = "cradle"
        [parameters]
        c = {{ value = 0.3, unit = "s/m" }}
        d = {{ value = 1.0, unit = "m" }}
        [coordinates]
        x1 = {{ unit = "m", start = -1.0, velocity = 1.0 }}
        x2 = {{ unit = "m", start = 1.0 }}
        x3 = {{ unit = "m", start = 2.0 }}
        [bodies]
        ball1 = {{ mass = 1, position = ["x1", "0"] }}
        ball2 = {{ mass = 1, position = ["x2", "0"] }}
        ball3 = {{ mass = 1, position = ["x3", "0"] }}
        {contacts}
        """,
        "cradle",
    )
    found = _motion(mechanism, way, ["x1_dot", "x2_dot", "x3_dot"], 2.0)[1:, -1]
    v = np.array([1.0, 0.0, 0.0])
    for i in (0, 1, 0):
        e = 1 - 0.3 * (v[i] - v[i + 1])
        v[i : i + 2] = v[i : i + 2].mean() + np.array([-e, e]) * (v[i] - v[i + 1]) / 2
    assert found == pytest.approx(v, abs=1e-9)


def test_time_stepping_takes_the_speed_before() -> None:
    """The error of a moreau step: half a step of free fall."""
    mechanism = _ball("0.9 - c*abs(y_dot)")
    run = lag2fmu.simulate(mechanism, stop_time=1.5, step=1e-3, outputs=["y"], solver="moreau")
    assert run["y"] == pytest.approx(_heights(run.time, lambda v, t: 0.9 - 0.05 * v), abs=3e-3)


def test_the_height_has_derivatives_by_what_restitution_is_made_of() -> None:
    """By c behind one impact: v after it is (0.9 - c v) v, and y grows with it as time does."""
    times, v = np.array([0.0, 0.9]), np.sqrt(4.0 * G)
    found = lag2fmu.sensitivities(_ball("0.9 - c*abs(y_dot)"), over=["c"], outputs=["y"], times=times)
    assert found["y", "c"][-1] == pytest.approx(-(v**2) * (0.9 - v / G), rel=1e-7)


@pytest.mark.parametrize("solver", ["dopri5", "moreau"])
def test_a_coefficient_beyond_one_ends_the_run(solver: str) -> None:
    """Only where the contact is struck: in flight it may have any value."""
    mechanism = _ball("1.5 - c*abs(y_dot)/(1 + c*abs(y_dot))")
    with pytest.raises(
        SimulationError, match=r"restitution of floor is 1\.2.*expected 0 to 1: check what it is made of"
    ):
        lag2fmu.simulate(mechanism, stop_time=1.0, step=0.01, outputs=["y"], solver=solver)


def test_a_contact_that_is_not_struck_may_have_any_coefficient() -> None:
    """That of the ceiling, which the ball never reaches, is 2 where the floor is struck."""
    ceiling = '[contacts.ceiling]\ngap = "4*capture*second - y"\nrestitution = "2 - y/(capture*second)"'
    times, found = _motion(_ball("0.7", ceiling, start=1.5), "co-simulation", ["y"], 2.0)
    assert found == pytest.approx(_heights(times, lambda v, t: 0.7, start=1.5), abs=3e-8)
