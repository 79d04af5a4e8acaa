"""Solver moreau: closed forms at first order, and exactly where nothing is left to the step (g = 9.81)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sympy
from fmpy.fmi1 import FMICallException
from stepping import Stepping

from lag2fmu import simulate
from lag2fmu.dynamics import derive
from lag2fmu.errors import ExportError
from lag2fmu.fmu.advice import steps_over_impacts
from lag2fmu.fmu.deriving import chosen_solver
from lag2fmu.fmu.method_check import check_solver
from lag2fmu.formats.loading import load
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Body, Contact, Damper, Energy, Mechanism, coordinate
from lag2fmu.reference import Trajectory
from lag2fmu.solvers.methods import METHODS

pytestmark = pytest.mark.fmu

G = 9.81
OPEN, STICKS, SLIDES, FORWARD = 1, 2, 3, 4
ANGLE = 0.4
"""Of the incline, rad."""

WORKSHOP = read(
    """
[mechanism]
name = "workshop"
title = "A ball, blocks on an incline, a table, a tower, a rubbing oscillator and a latch, none touching another"
[parameters]
g = { value = 9.81, unit = "m/s2" }
a = { value = 0.4, unit = "rad", doc = "angle of the incline" }
[coordinates]
y = { unit = "m", start = 1.0 }
held = { unit = "m" }
over = { unit = "m" }
sliding = { unit = "m" }
above = { unit = "m" }
high = { unit = "m" }
tilt = { unit = "rad" }
low = { unit = "m", start = 0.1 }
top = { unit = "m", start = 0.3 }
x = { unit = "m", start = 5.0 }
p = { unit = "m", velocity = 1.0 }
q = { unit = "m", start = 0.5 }
[bodies]
ball = { mass = 0.5, position = [0, "y"] }
resting = { mass = 1, position = ["cos(a)*held + sin(a)*over", "cos(a)*over - sin(a)*held"] }
sledge = { mass = 1, position = ["cos(a)*sliding + sin(a)*above", "cos(a)*above - sin(a)*sliding"] }
table = { mass = 8, inertia = 1, position = [0, "high"], angle = "tilt" }
lower = { mass = 1, position = [0, "low"] }
upper = { mass = 2, position = [0, "top"] }
mass = { mass = 1, position = ["x", 0] }
thrown = { mass = 1, position = ["p", 0] }
caught = { mass = 1, position = ["q", 0] }
[gravity]
acceleration = "g"
[springs.spring]
stiffness = 1
elongation = "x"
[contacts]
floor = { gap = "y", restitution = 0.8 }
rough = { gap = "over", slip = "held_dot", friction = 0.5 }
smooth = { gap = "above", slip = "sliding_dot", friction = 0.2 }
left = { gap = "high - sin(tilt)" }
middle = { gap = "high" }
right = { gap = "high + sin(tilt)" }
below = { gap = "low" }
between = { gap = "top - low" }
[frictions.bearing]
on = "x_dot"
force = 0.3
[constraints.holonomic]
catch = { expression = "q - p", while = "t - 0.25" }
[experiment]
stop_time = 30.0
step = 0.1
""",
    "workshop",
)

WEDGED = read(
    """
[mechanism]
name = "wedged"
title = "A box in a shaft, which a press leans on one wall, and a box on four feet that is pulled along two walls"
[parameters]
a = { value = 0.3, unit = "m", doc = "half the width of the box in the shaft" }
h = { value = 0.5, unit = "m", doc = "half its height" }
mu = { value = 0.3, unit = "1" }
b = { value = 0.2, unit = "m", doc = "half the distance of the feet" }
[coordinates]
across = { unit = "m" }
up = { unit = "m" }
lean = { unit = "rad" }
x = { unit = "m" }
y = { unit = "m" }
z = { unit = "m" }
yaw = { unit = "rad" }
roll = { unit = "rad" }
tilt = { unit = "rad" }
[inputs]
press = { unit = "N", start = 1.0 }
pull = { unit = "N", start = 15.0 }
[definitions]
turning = "0.1*lean_dot**2 + 0.05*(yaw_dot**2 + roll_dot**2 + tilt_dot**2)"
[energy]
kinetic = "across_dot**2 + up_dot**2 + x_dot**2 + y_dot**2 + z_dot**2 + turning"
potential = "19.62*(up + z)"
[forces]
across = "-press"
y = "pull"
[contacts]
left_top = { gap = "across - h*sin(lean)", slip = "up_dot - a*lean_dot", friction = "mu" }
left_bottom = { gap = "across + h*sin(lean)", slip = "up_dot - a*lean_dot", friction = "mu" }
right_top = { gap = "h*sin(lean) - across", slip = "up_dot + a*lean_dot", friction = "mu" }
right_bottom = { gap = "-across - h*sin(lean)", slip = "up_dot + a*lean_dot", friction = "mu" }
foot_1 = { gap = "z + b*roll + b*tilt", slip = ["x_dot - b*yaw_dot", "y_dot + b*yaw_dot"], friction = "mu" }
foot_2 = { gap = "z + b*roll - b*tilt", slip = ["x_dot + b*yaw_dot", "y_dot + b*yaw_dot"], friction = "mu" }
foot_3 = { gap = "z - b*roll + b*tilt", slip = ["x_dot - b*yaw_dot", "y_dot - b*yaw_dot"], friction = "mu" }
foot_4 = { gap = "z - b*roll - b*tilt", slip = ["x_dot + b*yaw_dot", "y_dot - b*yaw_dot"], friction = "mu" }
left = { gap = "x", slip = ["y_dot", "z_dot"], friction = "mu" }
right = { gap = "-x", slip = ["y_dot", "z_dot"], friction = "mu" }
[experiment]
stop_time = 1.0
step = 0.01
""",
    "wedged",
)

TIPPING = read(
    """
[mechanism]
name = "tipping"
title = "A rod of length 1 m that tips over on its end"
[coordinates]
x = { unit = "m" }
y = { unit = "m", start = 1.0 }
theta = { unit = "rad", start = 0.3, velocity = 0.5, doc = "from the vertical" }
[bodies]
rod = { mass = 1, inertia = "1/12", position = ["x", "y"], angle = "theta" }
[gravity]
acceleration = 9.81
[contacts]
tip = { gap = "y - cos(theta)/2", slip = "x_dot - cos(theta)*theta_dot/2", friction = 5 }
""",
    "tipping",
)


DRAG = read(
    """
[mechanism]
name = "drag"
title = "A block and a bead whose friction follows their speeds"
[parameters]
metre = { value = 1.0, unit = "m" }
second = { value = 1.0, unit = "s" }
[coordinates]
x = { unit = "m", velocity = 3.0 }
y = { unit = "m" }
p = { unit = "m", velocity = 3.0 }
[bodies]
block = { mass = 1, position = ["x", "y"] }
bead = { mass = 1, position = ["p", 0] }
[gravity]
acceleration = 9.81
[contacts]
floor = { gap = "y", slip = "x_dot", friction = "0.05 + 0.3*abs(x_dot)*second/metre" }
[frictions]
wire = { on = "p_dot", force = "9.81*(0.05 + 0.3*abs(p_dot)*second/metre)" }
""",
    "drag",
)

TUG = """
[mechanism]
name = "tug"
title = "A block on three feet that is pulled until they slip together"
[coordinates]
x = { unit = "m" }
y = { unit = "m" }
p = { unit = "rad" }
[bodies]
block = { mass = 1, inertia = 0.2, position = ["x", "y + 0.2"], angle = "p" }
[gravity]
acceleration = 9.81
[forces]
x = "t"
"""
FEET = {-0.3: 0.2, 0.3: 0.45, 0.1: 0.07}
"""The friction of the feet in the places (m) along the block."""

SLED = """
[mechanism]
name = "sled"
title = "A sled on level ground that turns about the last of its feet as long as that holds"
[coordinates]
x = { unit = "m", velocity = 0.7862443735418032 }
y = { unit = "m", velocity = 0.20452696464222309 }
z = { unit = "m" }
c = { unit = "rad", start = -0.9019736501621699, velocity = -1.9467783322008616 }
[gravity]
acceleration = 9.81
direction = [0.278, 0.079, -0.95]
[frames.sled]
origin = ["x", "y", "z"]
rotations = [["z", "c"]]
[bodies.sled]
frame = "sled"
mass = 1
inertia = [0.1, 0.15, 0.2, 0, 0, 0]
"""
UNDER_SLED = {(-0.332, -0.001): 0.39, (0.334, 0.025): 0.368, (0.269, -0.18): 0.672, (0.382, -0.168): 0.61}


REVERSED = """
[mechanism]
name = "reversed"
title = "A block on three feet that is pushed to and fro"
[parameters]
s = { value = 1.0, unit = "s" }
l = { value = 1.0, unit = "m" }
[coordinates]
x = { unit = "m", velocity = -0.734 }
y = { unit = "m" }
p = { unit = "rad" }
[gravity]
acceleration = 9.81
[bodies]
b = { mass = 1.038, inertia = 0.144, position = ["x", "y + 0.437"], angle = "p" }
[forces]
x = "5.216*sin(3.65*t/s)"
"""


def sled(copies: int) -> Mechanism:
    """The sled with so many equal feet in the place of each."""
    text = SLED
    for i, ((x, y), friction) in enumerate([*UNDER_SLED.items()] * copies):
        text += f"""
[points.p{i}]
frame = "sled"
position = [{x}, {y}, 0]
[contacts.f{i}]
kind = "point_plane"
between = ["p{i}", "world"]
normal = "z"
friction = {friction}
"""
    return read(text, "sled")


def run_of(exported, step: float, stop: float, count: int = 100) -> Trajectory:
    modes = ["floor_mode", "rough_mode", "smooth_mode", "bearing_mode"]
    forces = ["rough_force", "rough_friction", "left_force", "middle_force", "right_force", "below_force"]
    names = [*(c.name for c in WORKSHOP.coordinates), "y_dot", "x_dot", "p_dot", "between_gap", "bearing_force"]
    outputs = [*names, *modes, *forces, "between_force", "floor_impacts", "total_energy", "dissipated_energy"]
    path = exported(WORKSHOP, solver="moreau").path
    return simulate(path, stop_time=stop, step=stop / count, values={"solver_step": step}, outputs=outputs)


def ball(t: float, e: float = 0.8) -> float:
    """The height of the ball: arcs between the impacts."""
    start, speed = np.sqrt(2 / G), e * np.sqrt(2 * G)
    if t < start:
        return 1 - G * t**2 / 2
    while t > start + 2 * speed / G and speed > 1e-9:
        start, speed = start + 2 * speed / G, e * speed
    return max(speed * (t - start) - G * (t - start) ** 2 / 2, 0.0)


def rubbing(t: np.ndarray) -> np.ndarray:
    """The oscillator: half swings about 0.3 and -0.3; it rests at 0.2 from 8 pi on."""
    half = np.minimum(np.floor(t / np.pi), 8.0)
    amplitude = np.where(half < 8, 5.0 - 0.3 - 0.6 * half, 0.0)
    return np.where(half < 8, 0.3 * (-1) ** half, 0.2) + amplitude * np.cos(t)


def test_errors_are_of_first_order(exported) -> None:
    """About 3 s for the export, which all tests here share."""
    errors = []
    for step in (2e-3, 5e-4):
        run = run_of(exported, step, 30.0, 300)
        errors.append(
            [
                np.abs(run["y"] - [ball(t) for t in run.time]).max(),
                np.abs(run["x"] - rubbing(run.time)).max(),
                np.abs(run["p_dot"][run.time > 0.3] - 0.5).max() + step,
            ]
        )
    assert errors[0] == pytest.approx([0.01, 0.002, 0.002], rel=1.0)
    assert (np.array(errors[0]) / errors[1] > 2.5).all()


def test_what_rests_rests_exactly(exported) -> None:
    """The ball after its last impact, the block on the incline, the oscillator; nothing creeps or chatters."""
    run = run_of(exported, 1e-3, 30.0, 300)
    late = run.time > 26.0
    assert (run["y"][late] == 0.0).all()
    assert (run["y_dot"][late] == 0.0).all()
    assert (run["floor_mode"][late] == SLIDES).all()
    assert (run["floor_impacts"][late] < 60).all()
    assert (run["held"] == 0.0).all()
    assert (run["over"] == 0.0).all()
    assert (run["rough_mode"][1:] == STICKS).all()
    assert run["rough_force"] == pytest.approx(np.full(301, G * np.cos(ANGLE)), rel=1e-12)
    assert run["rough_friction"] == pytest.approx(np.full(301, -G * np.sin(ANGLE)), rel=1e-12)
    assert (run["x_dot"][late] == 0.0).all()
    assert run["bearing_force"][-1] == pytest.approx(run["x"][-1], rel=1e-12)
    assert (run["bearing_mode"][late] == STICKS).all()


TOWER = read(
    """[mechanism]
name = "tower"
[coordinates]
a = { unit = "m" }
b = { unit = "m" }
c = { unit = "m", start = 0.05 }
[gravity]
acceleration = 9.81
[bodies]
A = { mass = 1, position = [0, "a"] }
B = { mass = 2, position = [0, "b"] }
C = { mass = 1, position = [0, "c"] }
[contacts]
floor = { gap = "a", restitution = 0.3 }
on_a = { gap = "b - a", restitution = 0.3 }
on_b = { gap = "c - b", restitution = 0.3 }
""",
    "tower.toml",
)
"""The topmost block drops onto the two others."""


@pytest.mark.parametrize("step", [1e-3, 1e-4])
def test_a_block_that_drops_on_others_comes_to_rest(exported, step: float) -> None:
    """All of them fall alike without their supports, so that nothing seemed to press on a contact: it rattled on."""
    names = ["a", "b", "c", "a_dot", "b_dot", "c_dot", "on_b_impacts", "on_b_force", "on_a_force", "floor_force"]
    fmu = exported(TOWER, solver="moreau")
    run = simulate(fmu, stop_time=1.0, step=0.01, values={"solver_step": step}, outputs=names)
    first = np.sqrt(2 * 0.05 / G)
    before, late = run.time < first, run.time > first * 1.3 / 0.7 + 2 * step
    assert run["c"][before] == pytest.approx(0.05 - G * run.time[before] ** 2 / 2, abs=1e-12)
    assert run.columns(names[:3])[late] == pytest.approx(0.0, abs=1e-15)
    assert (run.columns(names[3:6])[late] == 0.0).all()
    assert 2 <= run["on_b_impacts"][-1] < 12
    assert run.values[-1, 7:] == pytest.approx([G, 3 * G, 4 * G], rel=1e-12)


def test_uniform_slides_are_exact_whatever_the_step(exported) -> None:
    """sliding = (sin a - mu cos a) g t^2/2."""
    run = run_of(exported, 0.03, 3.0)
    expected = (np.sin(ANGLE) - 0.2 * np.cos(ANGLE)) * G * run.time**2 / 2
    assert run["sliding"] == pytest.approx(expected, rel=1e-12)
    assert (run["smooth_mode"][1:] == FORWARD).all()


def test_friction_that_follows_the_speed_is_of_second_order(exported) -> None:
    """v' = -g (0.05 + 0.3 v) for both."""
    rate, rest, errors = 0.3 * G, 0.05 / 0.3, []
    for step in (1e-2, 5e-3):
        path = exported(DRAG, solver="moreau").path
        run = simulate(path, stop_time=0.9, step=0.01, values={"solver_step": step}, outputs=["x_dot", "p_dot"])
        speed = (3.0 + rest) * np.exp(-rate * run.time) - rest
        errors.append([np.abs(run[name] - speed).max() for name in ("x_dot", "p_dot")])
    assert errors[0] == pytest.approx([1.72e-4, 1.72e-4], rel=0.01)
    assert np.array(errors[0]) / errors[1] == pytest.approx([4.0, 4.0], rel=0.05)


def turning(exported, copies: int, solver: str) -> Trajectory:
    """Of the sled, from where its last foot holds to where it slips."""
    path, own = exported(sled(copies), solver=solver).path, {"solver_step": 1e-3} if solver == "moreau" else {}
    outputs = [f"{c}_{rate}" for c in "xyc" for rate in ("dot", "ddot")]
    return simulate(path, stop_time=0.03, step=1e-3, values=own, outputs=[*outputs, "f3_mode"])


@pytest.mark.parametrize("copies", [1, 2])
def test_a_foot_breaks_loose_beside_feet_that_slide_on(exported, copies: int) -> None:
    """The sliding feet share the load in equal parts, and so does the foot that holds; it takes no more to hold on."""
    run, expected = (turning(exported, copies, solver) for solver in ("moreau", "dopri5"))
    assert run["f3_mode"][[1, -1]] == pytest.approx([STICKS, SLIDES])
    assert np.sum(run["f3_mode"] != expected["f3_mode"]) <= 1
    for c in "xyc":
        late = 1e-3 * np.abs(expected[f"{c}_ddot"]).max()
        assert np.abs(run[f"{c}_dot"] - expected[f"{c}_dot"]).max() < late


@pytest.mark.parametrize("copies", [1, 2])
def test_friction_of_slow_slips_is_that_of_the_steps(exported, copies: int) -> None:
    """Velocities follow accelerations, also of a foot that turns by more than it slips in a step, and breaks loose."""
    run = turning(exported, copies, "moreau")
    for c in "xyc":
        assert np.abs(run[f"{c}_ddot"][2:] - np.diff(run[f"{c}_dot"])[1:] / 1e-3).max() < 0.03


def test_a_foot_that_bore_nothing_takes_its_share(exported) -> None:
    """Feet slide by least norm of their loads from the reversal on, also one that touches and bears nothing there."""
    text = REVERSED
    for i, (place, friction) in enumerate({-0.3: "0.477", 0.3: "0.112 + 0.1*abs(x)/l", 0.1: "0.106"}.items()):
        text += f"""
[points.p{i}]
position = ["x + {place}*cos(p) + 0.437*sin(p)", "y + 0.437 + {place}*sin(p) - 0.437*cos(p)"]
[contacts.f{i}]
kind = "point_line"
between = ["p{i}", "world"]
normal = "y"
friction = "{friction}"
"""
    mechanism = read(text, "reversed")
    ends = [
        simulate(exported(mechanism, solver=solver).path, stop_time=1.2, step=0.01, values=values)["x_dot"][-1]
        for solver, values in (("dopri5", {}), ("moreau", {"solver_step": 1e-3}))
    ]
    assert ends[1] == pytest.approx(ends[0], abs=2e-3)


@pytest.mark.parametrize("beyond", [1e-7, 6e-7])
def test_forces_make_the_accelerations_just_beyond_all_ways_to_hold(exported, beyond: float) -> None:
    """Force, load and moment on the first two feet at the limit, where the third bears nothing, tell the last pull."""
    text, (one, two, _) = TUG, FEET.items()
    for i, (place, friction) in enumerate(FEET.items()):
        text += f"""
[points.p{i}]
position = ["x + {place}*cos(p) + 0.2*sin(p)", "y + 0.2 + {place}*sin(p) - 0.2*cos(p)"]
[contacts.f{i}]
kind = "point_line"
between = ["p{i}", "world"]
normal = "y"
friction = {friction}
"""
    equations = [[1, 1, 0], [one[0], two[0], -0.2], [one[1], two[1], -1]]
    stop = (1 + beyond) * np.linalg.solve(equations, [G, 0, 0])[2]
    path = exported(read(text, "tug"), solver="moreau").path
    outputs = ["f0_mode", "y_ddot", *(f"f{i}_force" for i in range(3))]
    run = simulate(path, stop_time=stop, step=stop / 50, values={"solver_step": stop / 50}, outputs=outputs)
    assert run["f0_mode"][-1] == STICKS
    assert sum(run[f"f{i}_force"][-1] for i in range(3)) == pytest.approx(G + run["y_ddot"][-1], abs=1e-8)


def test_redundant_contacts_and_towers_bear_the_weight(exported) -> None:
    """Three legs bear 8 g, those at the sides the same; what falls on a tower stays there."""
    run = run_of(exported, 1e-3, 2.0)
    assert run["left_force"][-1] == pytest.approx(run["right_force"][-1], rel=1e-9)
    assert sum(run[f"{leg}_force"][-1] for leg in ("left", "middle", "right")) == pytest.approx(8 * G, rel=1e-12)
    assert run["below_force"][-1] == pytest.approx(3 * G, rel=1e-12)
    assert run["between_force"][-1] == pytest.approx(2 * G, rel=1e-12)
    assert np.abs([run["high"], run["tilt"]]).max() < 1e-12
    assert np.abs([run["low"][-1], run["between_gap"][-1]]).max() < 1e-12


@pytest.mark.parametrize("step", [1e-3, 1e-2])
def test_redundant_contacts_stick_if_there_is_any_way(exported, step: float) -> None:
    """What presses on the walls bears a tenth of the loads; that both walls press back bears all of them."""
    path = exported(WEDGED, solver="moreau").path
    names = [*(c.name for c in WEDGED.coordinates), *(f"{c.name}_dot" for c in WEDGED.coordinates)]
    run = simulate(path, stop_time=1.0, step=0.01, values={"solver_step": step}, outputs=names)
    for name in names:
        assert (run[name] == 0.0).all(), name


def test_a_foot_stays_closed_while_its_body_turns_about_it(exported) -> None:
    """Without the forces of a step the tip would rise by the curvature of its path; it must not lift off by that."""
    path = exported(TIPPING, solver="moreau").path
    sine, cosine = np.sin(0.3), np.cos(0.3)
    values = {"solver_step": 1e-3, "x": sine / 2, "y": cosine / 2, "x_dot": cosine / 4, "y_dot": -sine / 4}
    names = ["theta", "theta_dot", "tip_force", "tip_mode"]
    run = simulate(path, stop_time=0.3, step=1e-3, outputs=names, values=values)
    theta, rate = run["theta"], run["theta_dot"]
    turning = 1.5 * G * np.sin(theta)
    load = G - (np.sin(theta) * turning + np.cos(theta) * rate**2) / 2
    assert (run["tip_mode"][1:] == STICKS).all()
    np.testing.assert_allclose(run["tip_force"][1:], load[1:], rtol=1e-3)
    np.testing.assert_allclose(rate**2, 0.25 + 3 * G * (cosine - np.cos(theta)), atol=3e-3)  # first order


def test_a_rim_of_many_points_lands_and_rests_on_two_of_them(exported) -> None:
    """Within one step more points of a round body stop than can touch together.

    A wheel of 26 corners comes to rest on one of its sides, and all its energy but that of its height is gone.
    """
    corners, radius, height = 26, 0.02, 0.3
    contacts = "".join(
        f'[contacts.p{k}]\ngap = "y + {radius}*sin(a + {turn!s})"\n'
        f'slip = "x_dot - {radius}*sin(a + {turn!s})*a_dot"\nfriction = 0.6\n'
        for k, turn in enumerate(2 * np.pi * np.arange(corners) / corners)
    )
    wheel = read(
        f"""
[mechanism]
name = "wheel"
[coordinates]
x = {{ unit = "m" }}
y = {{ unit = "m", start = {height}, velocity = -3.0 }}
a = {{ unit = "rad", velocity = 50.0 }}
[gravity]
acceleration = {G}
[bodies]
wheel = {{ mass = 0.5, inertia = 1e-4, position = ["x", "y"], angle = "a" }}
{contacts}""",
        "wheel",
    )
    outputs = ["y", "y_dot", "a_dot", "total_energy", "dissipated_energy"]
    run = simulate(exported(wheel, solver="moreau"), stop_time=1, step=0.01, outputs=outputs)
    side = radius * np.cos(np.pi / corners)
    assert run.values[-1, :4] == pytest.approx([side, 0, 0, 0.5 * G * side], abs=1e-9)
    energy = run["total_energy"]
    assert energy + run["dissipated_energy"] == pytest.approx(np.full(len(run), energy[0]), abs=1e-11)
    assert np.diff(energy).max() <= 1e-5 * energy[0]


@pytest.mark.parametrize("heights", [("y", "y + 2e-4"), ("y + 2e-4", "y")])
def test_of_points_at_almost_one_height_the_lowest_ones_touch(exported, heights: tuple[str, str]) -> None:
    """Both stop within one step, and only one of them can be closed."""
    contacts = "".join(
        f'[contacts.p{k}]\ngap = "{gap}"\nslip = "x_dot"\nfriction = 0.5\n' for k, gap in enumerate(heights)
    )
    block = read(
        f"""
[mechanism]
name = "block"
[coordinates]
x = {{ unit = "m", velocity = 0.5 }}
y = {{ unit = "m", start = 0.3, velocity = -3.0 }}
[gravity]
acceleration = {G}
[bodies]
block = {{ mass = 1, position = ["x", "y"] }}
{contacts}""",
        "block",
    )
    run = simulate(exported(block, solver="moreau"), stop_time=0.2, step=0.01, outputs=["y", "y_dot", "x_dot"])
    assert run.values[-1] == pytest.approx([0, 0, 0], abs=1e-12)


def test_the_energy_is_balanced(exported) -> None:
    """What impacts, friction and the latch take: all but the latch's quarter is in dissipated_energy."""
    for step in (1e-2, 1e-3):
        run = run_of(exported, step, 10.0)
        before = run.time < 0.25
        balance = run["total_energy"] + run["dissipated_energy"]
        assert balance[before] == pytest.approx(np.full(before.sum(), balance[0]), rel=2e-5 * (step / 1e-3) ** 2)
        assert balance[-1] == pytest.approx(balance[0] - 0.25, rel=2e-5 * (step / 1e-3) ** 2)
        assert (np.diff(run["total_energy"]) < 1e-4 * (step / 1e-3) ** 2).all()


def test_a_run_rolled_back_over_impacts_repeats_bit_for_bit(exported) -> None:
    with Stepping(exported(WORKSHOP, solver="moreau").path) as workshop:
        workshop.start(stop_time=20.0)
        for _ in range(15):
            assert workshop.repeats(3, 0.07)


def test_model_exchange_is_as_ever(exported) -> None:
    run = simulate(
        exported(WORKSHOP, solver="moreau").path, stop_time=2.0, step=0.1, tolerance=1e-9, kind="model-exchange"
    )
    assert run["y"] == pytest.approx([ball(t) for t in run.time], abs=1e-5)


def test_impacts_with_friction_in_space(exported) -> None:
    """The sphere rolls from 2 v0/(7 mu g) on, with 5/7 v0: M of its quaternion is singular."""
    path = exported("sliding_sphere", solver="moreau").path
    run = simulate(path, stop_time=1.0, step=0.1, values={"solver_step": 1e-4}, outputs=["x_dot", "table_mode", "z"])
    assert run["x_dot"] == pytest.approx(np.maximum(5 - 0.2 * G * run.time, 25 / 7), abs=5e-4)
    assert (run["table_mode"][1:] == np.where(run.time[1:] < 0.72811998, SLIDES, STICKS)).all()
    assert np.abs(run["z"]).max() < 1e-12


@pytest.mark.parametrize(("model", "reason"), [("double_pendulum", "no ideal contacts"), ("crane", "")])
def test_what_has_no_contacts_is_refused(model: str, reason: str) -> None:
    mechanism = derive(load(model)).mechanism
    if reason:
        with pytest.raises(ExportError, match=f"solver 'moreau' .*{reason}.* take dopri5"):
            check_solver(mechanism, METHODS["moreau"])
    else:
        check_solver(mechanism, METHODS["moreau"])


def test_impacts_in_turn_become_impacts_at_once() -> None:
    cradle = load("newtons_cradle")
    assert "at once" in steps_over_impacts(cradle, METHODS["moreau"])
    assert steps_over_impacts(replace(cradle, impacts="simultaneous"), METHODS["moreau"]) == ""
    assert steps_over_impacts(cradle, METHODS["dopri5"]) == ""


@pytest.mark.parametrize(("pull", "solver"), [(0.0, "moreau"), (1900.0, "moreau"), (2e4, "radau5")])
def test_many_contacts_are_stepped_over_unless_the_steps_are_unstable(pull: float, solver: str) -> None:
    """24 balls, one of them in oil of c/m = 2e4/s, which no step is too long for. A pull that is no linear damper, c/m
    in 1/s, makes steps of 1 ms grow beyond 2000/s.
    """
    height = coordinate("height", "m", start=1.0, velocity=-0.5)
    balls = [coordinate(f"x{i}", "m", start=0.1 + 0.01 * i) for i in range(24)]
    bodies = [Body(f"ball{i}", 1, (i, x)) for i, x in enumerate(balls)]
    contacts = [Contact(f"floor{i}", gap=x) for i, x in enumerate(balls)]
    swing = Energy(kinetic=height.dot**2 / 2, potential=50 * height**2)
    dampers = [
        Damper("oil", damping=2e4, rate=balls[0].dot),
        Damper("tar", force=pull * sympy.sinh(balls[1].dot), rate=balls[1].dot),
    ]
    row = Mechanism(
        "row", coordinates=[height, *balls], bodies=bodies, contacts=contacts, dampers=dampers, energy=swing
    )
    assert chosen_solver(derive(row), None)[0] == solver


STIFFLY_DAMPED = read(
    """
[mechanism]
name = "servo"
title = "A light arm whose joint is damped and driven by a servo, above a floor that it does not reach"
[parameters]
m = { value = 0.01, unit = "kg" }
r = { value = 0.1, unit = "m" }
oil = { value = 0.3, unit = "N.m.s/rad" }
gain = { value = 2.0, unit = "N.m.s/rad" }
stiffness = { value = 5.0, unit = "N.m/rad" }
[coordinates]
a = { unit = "rad" }
b = { unit = "rad", start = 0.2 }
[inputs]
wanted = { unit = "rad", start = 0.5 }
[frames.upper]
rotations = [["z", "a"]]
[frames.lower]
parent = "upper"
origin = ["r", 0, 0]
rotations = [["z", "b"]]
[bodies]
upper = { mass = "m", inertia = [1e-5, 1e-5, 1e-5, 0, 0, 0], frame = "upper", center = ["r/2", 0, 0] }
lower = { mass = "m", inertia = [1e-5, 1e-5, 1e-5, 0, 0, 0], frame = "lower", center = ["r/2", 0, 0] }
[dampers.elbow]
damping = "oil*(1 + b**2)"
rate = "b_dot"
[forces]
a = "stiffness*(wanted - a) - gain*a_dot"
[springs.elbow]
stiffness = "0.1*stiffness"
elongation = "b"
[contacts.floor]
gap = "r*(a + 10)"
[experiment]
stop_time = 1.0
step = 0.05
""",
    "servo",
)


def test_steps_are_never_too_long_for_linear_dampers(exported) -> None:
    """Decays of up to 6e4/s against radau5. Explicit steps grow beyond 3e-5 s; these are of second order at 8 ms."""
    exact = simulate(exported(STIFFLY_DAMPED, solver="radau5").path, values={"solver_tolerance": 1e-10})
    path, errors = exported(STIFFLY_DAMPED, solver="moreau").path, []
    for step in (8e-3, 1e-3):
        run = simulate(path, values={"solver_step": step})
        errors.append(max(np.abs(run[q] - exact[q]).max() for q in ("a", "b")))
    assert errors[0] < 2e-4
    assert errors[1] < 2e-6


FADING_BRAKE = read(
    """
[mechanism]
name = "fading_brake"
[coordinates.a]
unit = "rad"
velocity = 2.0
[bodies]
wheel = { mass = 1, inertia = 1, position = [0, 0], angle = "a" }
[frictions.brake]
on = "a_dot"
force = "max(0, 1 - t)"
[experiment]
stop_time = 2.0
step = 0.1
""",
    "fading_brake",
)


def test_a_friction_that_fades_is_the_one_in_the_middle_of_the_step(exported) -> None:
    """2 - t + t^2/2 rad/s until 1 s. With the branch of max from the step's begin it was negative, and the run ended.

    The mean of a line over a step is that in its middle; one step has the kink inside.
    """
    run = simulate(exported(FADING_BRAKE, solver="moreau").path, values={"solver_step": 0.03})
    time = np.minimum(run.time, 1.0)
    errors = np.abs(run["a_dot"] - (2.0 - time + 0.5 * time**2))
    assert errors[run.time < 0.95].max() < 1e-12
    assert errors.max() < 0.03**2


FALLING_FRICTION = read(
    """
[mechanism]
name = "falling_friction"
[coordinates]
x = { unit = "m", velocity = 2.0 }
y = { unit = "m", start = 0.05 }
[gravity]
acceleration = 9.81
[bodies.block]
mass = 1
position = ["x", "y"]
[contacts.floor]
gap = "y"
slip = "x_dot"
friction = "0.5*exp(-abs(x_dot))"
""",
    "falling_friction",
)


def test_an_impact_has_the_friction_of_the_velocity_before_it(exported) -> None:
    """As located impacts have. With that of the mean of both velocities the error was 2 % whatever the step."""
    fall = np.sqrt(2 * 0.05 / G)
    stop = 1.002 * fall
    path = exported(FALLING_FRICTION, solver="moreau").path
    run = simulate(path, stop_time=stop, step=stop, values={"solver_step": 1e-3 * fall})
    assert 2.0 - run["x_dot"][-1] == pytest.approx(0.5 * np.exp(-2.0) * G * fall, rel=5e-3)


def test_friction_that_becomes_negative_is_refused(exported) -> None:
    """A negative coefficient would drive what slides, and its energy would grow."""
    fmu = exported(load("sliding_sphere"), solver="moreau")
    with Stepping(fmu.path) as sphere:
        sphere.start().step(0.1)
        sphere.set({"mu": -1.0})
        with pytest.raises(FMICallException):
            sphere.step(0.1)
        assert "coefficient of friction of table is -1; expected 0 or more" in sphere.log[-1][2]


def test_a_static_friction_below_the_sliding_one_counts_as_that(exported) -> None:
    """As with located events: a block on an incline that 0.5 holds and 0.1 would not stays there."""
    mechanism = read(
        f"""
        [mechanism]
        name = "held_block"
        [parameters]
        g = {{ value = {G}, unit = "m/s2" }}
        mu_s = {{ value = 0.6 }}
        [coordinates]
        x = {{ unit = "m" }}
        y = {{ unit = "m" }}
        [gravity]
        acceleration = "g"
        direction = ["sin({ANGLE})", "-cos({ANGLE})"]
        [bodies]
        block = {{ mass = 1, position = ["x", "y"] }}
        [contacts.floor]
        gap = "y"
        slip = "x_dot"
        friction = 0.5
        static_friction = "mu_s"
        """,
        "held_block",
    )
    with Stepping(exported(mechanism, solver="moreau").path) as fmu:
        fmu.start().step(0.1)
        fmu.set({"mu_s": 0.1})
        fmu.steps(10, 0.1)
        assert fmu.get(["x", "floor_friction"]) == pytest.approx([0.0, -G * np.sin(ANGLE)], abs=1e-13)
