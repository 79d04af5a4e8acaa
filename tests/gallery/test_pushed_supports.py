"""A body on a support: a force lifts it off, and the support moves as an input does."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from stepping import Stepping

from lag2fmu import simulate
from lag2fmu.fmu import Fmu
from lag2fmu.formats.text import read
from lag2fmu.reference import Trajectory
from lag2fmu.verify.run import Run
from lag2fmu.verify.simulate import simulate_fmu

pytestmark = pytest.mark.fmu

G = 9.81

SUPPORTED = """
[mechanism]
name = "supported"
[coordinates]
y = { unit = "m", start = 0 }
[inputs]
F = { unit = "N" }
s = { unit = "m", motion = true }
[gravity]
acceleration = 9.81
[forces]
y = "F"
[bodies.ball]
mass = 1
position = ["0", "y"]
[contacts.support]
gap = "y - s"
restitution = 0.5
"""


@pytest.fixture(scope="module")
def supported(exported: Callable[..., Fmu]) -> Fmu:
    """The FMU of FMI 3.0. About 2 s."""
    return exported(read(SUPPORTED, "supported"), fmi="3.0")


def run(fmu: Fmu, stop: float, steps: int, inputs: Trajectory, **chosen: Any) -> Trajectory:
    """The run with event mode and early return."""
    outputs = ["y", "y_dot", "support_gap", "support_force", "support_mode"]
    return simulate_fmu(fmu.path, Run(stop, stop / steps, 1e-9, inputs=inputs, outputs=outputs, events=True, **chosen))


@pytest.mark.parametrize("steps", [7, 50])
def test_a_force_that_grows_lifts_off_once(supported: Fmu, steps: int) -> None:
    """The importer sets the force that is equal to the weight anew in event mode, up to rounding."""
    ramp = Trajectory(np.array([0.0, 4.0]), ("F", "s"), np.array([[0.0, 0.0], [16.0, 0.0]]))
    last = run(supported, 4.0, steps, ramp)
    t = 4.0 - G / 4
    assert (last["y"][-1], last["y_dot"][-1]) == pytest.approx((4 * t**3 / 6, 4 * t**2 / 2), abs=1e-8)


def test_nothing_sinks_into_a_support_whose_velocity_is_not_that_of_its_position(supported: Fmu) -> None:
    """Straight lines between samples of position and velocity: the bounces end on the support, which bears the ball."""
    t = np.linspace(0.0, 3.0, 31)
    lines = Trajectory(t, ("F", "s", "s_dot", "s_ddot"), np.stack([0 * t, 0.1 * t**2, 0.2 * t, 0.2 + 0 * t], axis=1))
    last = run(supported, 3.0, 50, lines, values={"y": 1.0})
    assert last["support_gap"].min() > -3e-4, "the sagitta of the lines is 2.5e-4 m"
    assert (last["y"][-1], last["y_dot"][-1]) == pytest.approx((0.9, 0.6), abs=1e-9)
    assert last["support_force"][-1] == pytest.approx(G + 0.2, rel=1e-9)


PRESSED = """
[mechanism]
name = "pressed"
[coordinates]
x = { unit = "m" }
[bodies.slide]
mass = 1
position = ["x", 0]
[forces]
x = "t - 0.5"
[stops.end]
of = "x"
lower = 0
"""


@pytest.mark.parametrize("solver", ["verlet", "ros2"])
def test_a_stop_opens_once_with_a_method_of_second_order(solver: str, exported: Callable[..., Fmu]) -> None:
    """The force on the stop vanishes at 0.5 s. The error of a step is as great as what the gap rises by in it."""
    last = simulate(exported(read(PRESSED, "pressed"), solver=solver), stop_time=2, step=0.02)
    assert (last["x"][-1], last["x_dot"][-1]) == pytest.approx((1.5**3 / 6, 1.5**2 / 2), rel=2e-6)


GUIDE = """
[parameters]
strength = { value = 0.3 }
[frictions.guide]
on = "x_dot"
force = "strength"
"""


@pytest.mark.parametrize(("solver", "own"), [("dopri5", {}), ("rk4", {"solver_step": 0.125})])
def test_a_stop_and_a_friction_that_share_a_load_give_way_together(
    solver: str, own: dict[str, float], exported: Callable[..., Fmu]
) -> None:
    """Also where the friction has no force. One step goes from a load that is small to the slip."""
    guided = exported(read(PRESSED + GUIDE, "pressed"), solver=solver)
    for strength in (0.0, 0.01, 0.3):
        last = simulate(guided, stop_time=4, step=0.25, values={"strength": strength} | own)
        t = 3.5 - strength
        assert (last["x"][-1], last["x_dot"][-1]) == pytest.approx((t**3 / 6, t**2 / 2), rel=1e-9)


def test_a_foot_lifted_for_less_than_a_step_lands(exported: Callable[..., Fmu]) -> None:
    """Its landing is not seen on the parabola of a whole step; the height is that of other solvers with short steps."""
    leg = exported("hopper_leg", solver="ros2")
    for step, error in ((2e-3, 1e-4), (1e-3, 1e-5)):
        last = simulate(leg, stop_time=1.6, step=0.1, values={"solver_step": step})
        assert last["y"][-1] == pytest.approx(0.57117654, abs=error)


def test_a_load_swings_on_its_rope_with_midpoint(exported: Callable[..., Fmu]) -> None:
    """The trolley rests on its stop: changes of its velocity far below rounding do not keep the iteration going."""
    last = simulate(exported("crane", solver="midpoint"), stop_time=0.7, step=0.01)
    assert last["x"][-1] == pytest.approx(0, abs=1e-12)
    assert np.hypot(last["a"], last["b"])[-1] == pytest.approx(1.5, rel=1e-9)


def shaken_boxes() -> str:
    """A smooth box and a rough one that slide, on two feet each, on a table that is shaken up and down."""
    text = 'mechanism.name = "shaken_boxes"\ngravity.acceleration = 9.81\n'
    for i, (w, h, friction) in enumerate(((0.134, 0.222, 0.0), (0.25, 0.126, 0.6))):
        text += f"""
coordinates.x{i} = {{ velocity = -0.943 }}
coordinates.y{i} = {{ start = {h}, velocity = 0.6536 }}
coordinates.a{i} = {{ unit = "rad" }}
bodies.b{i} = {{ mass = {1.487 + i}, inertia = 0.02, position = ["x{i}", "y{i}"], angle = "a{i}" }}
"""
        for k, x in enumerate((w, -w)):
            text += f'contacts.c{i}{k}.gap = "y{i} + ({x})*sin(a{i}) - {h}*cos(a{i}) - 0.038*sin(17.2*t)"\n'
            text += f'contacts.c{i}{k}.slip = "x{i}_dot - a{i}_dot*(({x})*sin(a{i}) - {h}*cos(a{i}))"\n'
            text += f"contacts.c{i}{k}.friction = {friction}\n"
    return text


def test_boxes_leave_a_table_at_one_time_however_short_the_steps_are(exported: Callable[..., Fmu]) -> None:
    """Where the table falls by g; what opens there first stays open beside what opens a rounding error later."""
    leaves, rng = np.arcsin(G / (0.038 * 17.2**2)) / 17.2, np.random.default_rng(0)
    with Stepping(exported(read(shaken_boxes(), "shaken_boxes")).path) as stepping:
        stepping.start(tolerance=1e-6)
        stepping.step(leaves - 1e-6)
        state = stepping.unit.getFMUState()
        for length in 10 ** rng.uniform(-13, -8, 400):
            before = length * rng.uniform(0.01, 1)
            stepping.unit.setFMUState(state)
            stepping.time = leaves - 1e-6
            stepping.step(1e-6 - before)
            stepping.step(length)
        stepping.unit.freeFMUState(state)
    assert stepping.sentences == []
