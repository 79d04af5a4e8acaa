"""A table on four feet that is pushed from rest: their load is not unique, and slips turn with how it is shared."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import fsolve

import lag2fmu
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Mechanism
from lag2fmu.reference.direct_integration import integrate
from lag2fmu.verify.located import located
from lag2fmu.verify.run import Run

pytestmark = pytest.mark.fmu

WEIGHT, MU, INERTIA = 9.81, 0.3, 0.1
FEET = [(a, b) for a in (0.3, -0.3) for b in (0.2, -0.2)]
RATES = ["x_dot", "y_dot", "w_dot"]


def _table(forces: list[str], tilt: str = "0") -> Mechanism:
    """A table of 1 kg whose centre is in the plane of its feet, with ``forces`` along x and y (N) and about z (N.m).

    ``tilt`` (N.m) is about the x axis.
    """
    feet = "".join(
        f"""
        [contacts.foot{k}]
        gap = "z + metre*({a}*p + {b}*r)"
        slip = ["x_dot - metre*{b}*w_dot", "y_dot + metre*{a}*w_dot"]
        friction = "{MU}"
        """
        for k, (a, b) in enumerate(FEET)
    )
    return read(
        f"""
        [mechanism]
        name = "table"
        [parameters]
        metre = {{ value = 1.0, unit = "m" }}
        second = {{ value = 1.0, unit = "s" }}
        m = {{ value = 1.0, unit = "kg" }}
        I = {{ value = {INERTIA}, unit = "kg.m2" }}
        g = {{ value = {WEIGHT}, unit = "m/s2" }}
        [coordinates]
        x = {{ unit = "m" }}
        y = {{ unit = "m" }}
        z = {{ unit = "m" }}
        p = {{ unit = "rad" }}
        r = {{ unit = "rad" }}
        w = {{ unit = "rad" }}
        [energy]
        kinetic = "m*(x_dot**2 + y_dot**2 + z_dot**2)/2 + I*(p_dot**2 + r_dot**2 + w_dot**2)/2"
        potential = "m*g*z"
        [forces]
        x = "{forces[0]}"
        y = "{forces[1]}"
        w = "{forces[2]}"
        p = "{tilt}"
        {feet}""",
        "table",
    )


def _begins(forces: np.ndarray) -> np.ndarray:
    """Accelerations (3,) in m/s2 and rad/s2 from rest: each foot bears a quarter and rubs against its acceleration."""

    def rest(a: np.ndarray) -> np.ndarray:
        left = forces - a * [1.0, 1.0, INERTIA]
        for x, y in FEET:
            slip = np.array([a[0] - y * a[2], a[1] + x * a[2]])
            f = -MU * WEIGHT / 4 * slip / np.hypot(*slip)
            left = left + np.array([*f, x * f[1] - y * f[0]])
        return left

    return fsolve(rest, forces / [1.0, 1.0, INERTIA], xtol=1e-13)


@pytest.mark.parametrize("way", ["dopri5", "radau5", "model-exchange", "judge"])
@pytest.mark.parametrize("forces", [(1.37, -2.3, -1.38), (-4.83, 3.13, 1.24)])
def test_a_pushed_table_turns_under_equal_loads(forces: tuple[float, float, float], way: str) -> None:
    """Accelerations are 20 % wrong with the loads that would hold the table best. They stay for slips along lines."""
    mechanism, times = _table([str(f) for f in forces]), np.linspace(0.0, 1e-3, 3)
    if way == "judge":
        run = integrate(mechanism, times, rtol=1e-10).trajectory
    else:
        kind = {"kind": "model-exchange"} if way == "model-exchange" else {"solver": way}
        outputs = [*RATES, "x_ddot", "y_ddot", "w_ddot"]
        run = lag2fmu.simulate(mechanism, stop_time=1e-3, step=5e-4, tolerance=1e-10, outputs=outputs, **kind)
        start = [run[name][0] for name in ("x_ddot", "y_ddot", "w_ddot")]
        assert start == pytest.approx(_begins(np.array(forces)), rel=1e-8)
    assert run.columns(RATES)[-1] / times[-1] == pytest.approx(_begins(np.array(forces)), rel=1e-5)


def test_a_table_gives_way_at_once() -> None:
    """Pushed more and more, it slides as soon as no loads hold it, and as the direct integration does.

    With a slip in the direction of the loads at the limit, feet turn back at once, and the table is late by 0.14 ms.
    """
    mechanism = _table(["3.5*sin(30*t/second)", "1.6*sin(20*t/second)", "0.5*sin(40*t/second)"])
    times = np.linspace(0.0, 0.05, 6)
    told = integrate(mechanism, times, rtol=1e-9).trajectory.columns(RATES)
    for solver in ("dopri5", "radau5"):
        run = lag2fmu.simulate(mechanism, stop_time=0.05, step=0.01, tolerance=1e-9, outputs=RATES, solver=solver)
        assert run.columns(RATES) == pytest.approx(told, abs=2e-7)


def test_feet_of_a_table_come_to_rest_together() -> None:
    """Where one foot stops, all do: the table is at rest until its forces are too great once more.

    Two feet stuck, and held two others that went on to slide, for good: their friction was that of a slip, and the
    load of a cone that came to its limit changed no mode, in events without end.
    """
    mechanism = _table(
        ["3.153*sin(3*t/second)", "2.373*sin(2*t/second + 0.4)", "0.25*sin(4*t/second)"], "0.495*sin(1.3*t/second)"
    )
    reference = integrate(mechanism, np.linspace(0.0, 1.4, 8), rtol=1e-8)
    assert reference.method == "DOP853"
    stops = [event.time for event in reference.events if event.kind == "sticks" and event.time > 0]
    assert stops == [stops[0]] * len(FEET)


FOUR = [(0.01, 0.56), (0.387, -0.067), (0.057, -0.441), (-0.279, 0.065)]
"""m: y and x of feet that stand unevenly."""


def _uneven(frictions: tuple[float, ...]) -> Mechanism:
    """A table of 2.41 kg on four uneven feet with these coefficients, under a force that grows and turns."""
    feet = "".join(
        f"""
        [contacts.foot{k}]
        gap = "z + a*({y}) - b*({x})"
        slip = ["x_dot - p_dot*({x}*sin(p) + ({y})*cos(p))", "y_dot + p_dot*({x}*cos(p) - ({y})*sin(p))"]
        friction = {mu}
        restitution = 0
        """
        for k, ((y, x), mu) in enumerate(zip(FOUR, frictions, strict=True))
    )
    return read(
        f"""
        [mechanism]
        name = "uneven"
        [coordinates]
        x = {{ }}
        y = {{ }}
        z = {{ }}
        a = {{ }}
        b = {{ }}
        p = {{ }}
        [energy]
        kinetic = "2.41*(x_dot**2 + y_dot**2 + z_dot**2)/2 + 0.129*(a_dot**2 + b_dot**2 + p_dot**2)/2"
        potential = "2.41*9.81*z"
        [forces]
        x = "(0.2 + 0.94*t)*2.41*9.81*0.528*cos(1.18*t)"
        y = "0.34*(0.2 + 0.94*t)*2.41*9.81*0.528*sin(1.31*t)"
        p = "0.01*2.41*sin(3*t)*t"
        a = "0.024*0.34*(0.2 + 0.94*t)*2.41*9.81*0.528*sin(1.31*t)"
        {feet}""",
        "uneven",
    )


def test_normal_forces_of_feet_that_hold_need_not_be_unique() -> None:
    """Near the end all ways to share have one margin, and a normal force from the tip of its cone on."""
    ends = [
        lag2fmu.simulate(_uneven((0.528,) * 4), stop_time=1.8, step=step, outputs=["x", "y", "p"]).columns(
            ["x", "y", "p"]
        )
        for step in (0.01, 0.002)
    ]
    assert ends[0][-1] == pytest.approx(ends[1][-1], abs=1e-7)
    assert abs(ends[0][-1][0]) > 1e-6


@pytest.mark.parametrize("frictions", [(0.528,) * 4, (0.184, 0.346, 0.523, 0.441)])
def test_loads_that_are_shown_obey_the_laws_until_a_table_gives_way(exported, frictions: tuple[float, ...]) -> None:
    """On both sides of the event the friction of each foot is within its limit."""
    fmu = exported(_uneven(frictions))
    names = [f"foot{k}_{what}" for k in range(4) for what in ("force", "friction_1", "friction_2")]
    modes = [f"foot{k}_mode" for k in range(4)]
    run = located(fmu.path, Run(stop_time=2.0, step=0.05, outputs=[*names, *modes]), modes, ())
    assert run is not None
    loads = run.columns(names).reshape(len(run), 4, 3)
    assert len(run) > 41
    assert (np.hypot(loads[..., 1], loads[..., 2]) - np.array(frictions) * loads[..., 0]).max() < 1e-8
