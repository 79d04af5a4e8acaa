"""What validation says of hybrid mechanisms: times that compare, and each law by a run that breaks it."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sympy import cos, sin, sympify, tan

from lag2fmu.formats.text import read
from lag2fmu.mechanism import Body, Contact, Experiment, Mechanism, coordinate, parameter
from lag2fmu.reference import Reference, Trajectory, integrate
from lag2fmu.reference.hybrid.system import HybridSystem
from lag2fmu.verify.agreement import LOWER, comparable
from lag2fmu.verify.hybrid import extent, row_checks
from lag2fmu.verify.law_checks import accuracy_of
from lag2fmu.verify.laws.along import Along
from lag2fmu.verify.laws.points import at_points
from lag2fmu.verify.laws.spans import between_points
from lag2fmu.verify.report import Check
from lag2fmu.verify.task import Task
from lag2fmu.verify.validate import validate
from tests.reference import hybrid_mechanisms as known

pytestmark = pytest.mark.long

LABEL = "co-simulation"

SLACK_ROPE = """
[mechanism]
name = "slack_rope"
[coordinates]
y1 = { unit = "m", start = 0.8 }
y2 = { unit = "m", start = 0 }
[gravity]
acceleration = 9.81
[bodies]
heavy = { mass = 20, position = [0, "y1"] }
light = { mass = 1, position = [1, "y2"] }
[contacts.rope]
gap = "y1 + y2 - 0.8"
[contacts.floor]
gap = "y1"
"""
"""Atwood's machine: each time the rope pulls, the light body lifts the heavy one off the floor, less and less high."""


STRAIGHT = """
[mechanism]
name = "straight"
[coordinates]
z = { unit = "m", start = 0.15, velocity = -0.3 }
[bodies]
ball = { mass = 1, position = [0, "z"] }
[contacts.floor]
gap = "z"
restitution = 0.5
"""
"""Without gravity the ball is at the floor after 0.5 s."""


FREEWHEEL = """
[mechanism]
name = "freewheel"
[coordinates]
a = { unit = "rad", velocity = 1 }
b = { unit = "rad", velocity = 1 }
[bodies]
driver = { mass = 1, inertia = 1, position = [0, 0], angle = "a" }
driven = { mass = 1, inertia = 2, position = [0, 0], angle = "b" }
[forces]
a = "cos(t)"
[constraints.nonholonomic]
sprag = { expression = "a_dot - b_dot", while = "if(a_dot < b_dot, -1, cos(t))" }
"""
"""The driver takes the driven wheel along until t = pi/2; up to there the condition asks for the sign of 0."""


CATCH = """
[mechanism]
name = "catch"
[coordinates]
x = { unit = "m", start = 0, velocity = 1 }
y = { unit = "m", start = 1 }
[bodies]
a = { mass = 1, position = ["x", 0] }
b = { mass = 2, position = ["y", 0] }
[constraints.holonomic]
hold = { expression = "x - y", while = "x - y + 0.5" }
"""
"""At t = .5 s the second body is caught, which leaves 1/3 m/s, and the condition at 0."""


def compared(mechanism: Mechanism, end: float) -> tuple[Task, Reference]:
    """A task to ``end`` (s) and its direct integration; there is no FMU."""
    task = Task(mechanism, Path(), end, 1e-6, None)
    return task, integrate(mechanism, np.linspace(0, end, 1001), rtol=1e-9)


@pytest.fixture(scope="module")
def bouncing() -> tuple[Task, Reference]:
    return compared(known.ball(0.5), 2.0)


@pytest.fixture(scope="module")
def sliding() -> tuple[Task, Reference]:
    return compared(known.sliding_sphere(0.4), 1.5)


def other(reference: Reference, columns: dict[str, np.ndarray]) -> Trajectory:
    """The trajectory of the direct integration with other ``columns``."""
    own = reference.trajectory
    return Trajectory.of(own.time, {name: columns.get(name, own[name]) for name in own.names})


def checks(task: Task, reference: Reference, **columns: np.ndarray) -> list[Check]:
    """The checks of the direct integration itself with other ``columns``."""
    rows = np.arange(len(reference.trajectory))
    return list(row_checks(task, {LABEL: other(reference, columns)}, reference, {LABEL: rows}))


def failed(task: Task, reference: Reference, **columns: np.ndarray) -> set[str]:
    """The names of the ``checks`` that fail."""
    return {check.name for check in checks(task, reference, **columns) if not check.passed}


def broken(task: Task, reference: Reference, **columns: np.ndarray) -> set[str]:
    """The laws that the direct integration with other ``columns`` breaks at single times."""
    along = Along(HybridSystem(task.mechanism), other(reference, columns), {}, {})
    return {item.law for item in at_points(along, accuracy_of(task.tolerance)) if not item.value <= item.bar}


def test_a_run_that_obeys_the_laws_passes(bouncing: tuple[Task, Reference], sliding: tuple[Task, Reference]) -> None:
    assert failed(*bouncing) == set()
    assert failed(*sliding) == set()


def test_rounding_errors_of_what_rests_are_no_energy() -> None:
    """A body on a floor: nothing moves, so that rounding errors are all there is; a nanojoule is more than that."""
    resting = "[mechanism]\nname = 'resting'\n[coordinates]\nx = { unit = 'm' }\n[forces]\nx = '-9.81'\n[bodies.a]\n"
    text = resting + "mass = 1\nposition = ['x', 0]\n[contacts.floor]\ngap = 'x'\n"
    task, reference = compared(read(text, "resting.toml"), 1.0)
    noise = 1e-17 * np.random.default_rng(1).uniform(-1, 1, len(reference.trajectory))
    assert failed(task, reference, generalized_energy=noise) == set()
    assert failed(task, reference, generalized_energy=1e-9 * (noise > 0)) == {"energy never grows"}


def test_a_contact_that_counts_as_open_bears_the_mean_force_of_its_last_rebounds(
    bouncing: tuple[Task, Reference],
) -> None:
    task, reference = bouncing
    mode = reference.trajectory["floor_mode"].copy()
    mode[-6:] = 1
    assert failed(task, reference, floor_mode=mode) == set()


def test_a_margin_of_0_does_not_tell_whether_a_latch_holds() -> None:
    task, reference = compared(read(FREEWHEEL, "freewheel.toml"), 2.0)
    assert reference.trajectory["a_dot"][-1] == pytest.approx(4 / 3 + np.sin(2) - 1, abs=1e-9)
    rounded = reference.trajectory["a_dot"] - 4e-16
    assert broken(task, reference, a_dot=rounded) == set()


def test_a_latch_that_catches_at_a_communication_point_is_no_motion_without_a_cause() -> None:
    """The point itself shows what was before, and nothing tells that the latch catches right behind it."""
    task, reference = compared(read(CATCH, "catch.toml"), 1.0)
    at = reference.trajectory.time <= 0.5
    shown = {"x_dot": np.where(at, 1, 1 / 3), "y_dot": np.where(at, 0, 1 / 3)}
    along = Along(HybridSystem(task.mechanism), other(reference, shown), {}, {})
    spans = list(between_points(along, accuracy_of(task.tolerance)))
    assert [item.law for item in spans if not item.value <= item.bar] == []
    assert {item.law for item in spans} >= {"velocities follow accelerations"}
    assert along.quiet.sum() >= len(along.quiet) - 4


def test_times_around_impacts_and_low_rebounds_are_not_compared(bouncing: tuple[Task, Reference]) -> None:
    task, reference = bouncing
    seen, time = comparable(task, reference), reference.trajectory.time
    assert seen[time < 0.45].all()
    assert seen[(time > 1.4) & (time < 2.0)].all()
    assert not seen[(time > 1.351) & (time < 1.354)].any()
    (check,) = extent(task, reference, 2.0)
    assert 0 < check.value < 0.02
    impacts = [event for event in reference.events if event.kind == "impact"]
    low = sum(event.height <= LOWER * task.tolerance for event in impacts)
    assert 0 < low < len(impacts)
    assert f"({len(impacts)} impacts, {low} of them accumulating)" in check.detail


LIFTED = """
[mechanism]
name = "lifted"
[coordinates]
y = { unit = "m", start = 0.1 }
[bodies]
ball = { mass = 1, position = [0, "y"] }
[forces]
y = "if(t < 0.4275, -9.81, 5)"
[contacts.floor]
gap = "y"
restitution = 0.5
"""
"""A wind lifts the ball out of its eighth rebound, which is 6e-6 m high."""


def test_a_low_rebound_that_ends_in_flight_is_left_out_as_long_as_it_lasts() -> None:
    task, reference = compared(read(LIFTED, "lifted.toml"), 1.0)
    time = reference.trajectory.time[:-1]  # at the end nothing is compared
    left_out = time[~comparable(task, reference)[:-1]]
    assert 0.42 < left_out.max() < 0.45


def test_an_impact_right_behind_the_end_may_come_before_it() -> None:
    task, reference = compared(read(STRAIGHT, "straight.toml"), 0.5 * (1 - 1e-12))
    assert not reference.events
    seen = comparable(task, reference)
    assert seen[:-1].all()
    assert not seen[-1]


@pytest.mark.parametrize(("horizon", "outcome"), [(2.0, "ok"), (1.7, "ok"), (1.5, "not judged"), (0.3, "not judged")])
def test_a_fifth_may_be_left_out(bouncing: tuple[Task, Reference], horizon: float, outcome: str) -> None:
    (check,) = extent(*bouncing, horizon)
    assert check.outcome == outcome
    assert ("take a sharper --tolerance" in check.detail) is (outcome != "ok")


def test_impacts_are_counted_alike_in_a_report(bouncing: tuple[Task, Reference]) -> None:
    """Those that are compared one by one are told beside all of them."""
    task, reference = bouncing
    (share,) = extent(task, reference, 2.0)
    (counted,) = [check for check in checks(task, reference) if check.name == "impacts counted"]
    told = re.search(r"\d+ impacts, \d+ of them accumulating", share.detail)
    assert told is not None
    assert told[0] in counted.detail
    single = int(counted.detail.split(" compared one by one of ")[0])
    assert single + int(told[0].split()[2]) == int(told[0].split()[0])


def test_an_impact_behind_what_compares_leaves_the_times_before_it(bouncing: tuple[Task, Reference]) -> None:
    task, reference = bouncing
    time = reference.trajectory.time
    for size in (1e5, np.inf):
        amplified = replace(reference, amplification=np.where(time > 0.5, size, reference.amplification))
        assert (comparable(task, amplified) == comparable(task, reference))[time < 0.45].all()


def test_a_run_that_ends_at_its_start_is_judged(bouncing: tuple[Task, Reference]) -> None:
    """A run with longer steps than the direct integration reaches has one point."""
    task, reference = bouncing
    start = reference.trajectory.until(0.0)
    assert len(start) == 1
    found = list(row_checks(task, {LABEL: start}, reference, {LABEL: np.arange(1)}))
    assert all(check.passed for check in found)


def test_penetration_is_seen(bouncing: tuple[Task, Reference]) -> None:
    task, reference = bouncing
    gap = reference.trajectory["floor_gap"].copy()
    gap[100] = -1e-5
    assert "no penetration" in failed(task, reference, floor_gap=gap)


def test_pulling_forces_and_forces_at_open_contacts_are_seen(bouncing: tuple[Task, Reference]) -> None:
    task, reference = bouncing
    force = reference.trajectory["floor_force"].copy()
    force[10] = 1e-3
    assert "laws of contact" in failed(task, reference, floor_force=force)
    force[10], force[-1] = 0.0, -1e-3
    assert "laws of contact" in failed(task, reference, floor_force=force)


def test_friction_beyond_its_cone_is_seen(sliding: tuple[Task, Reference]) -> None:
    task, reference = sliding
    friction = reference.trajectory["plane_friction_1"].copy()
    friction[5] *= 1.01
    assert "laws of contact" in failed(task, reference, plane_friction_1=friction)


def test_an_impact_that_gains_energy_is_seen(bouncing: tuple[Task, Reference]) -> None:
    task, reference = bouncing
    energy = reference.trajectory["generalized_energy"].copy()
    energy[reference.trajectory.time > 1] += 0.1
    assert "energy never grows" in failed(task, reference, generalized_energy=energy)


def test_a_stream_may_bring_energy() -> None:
    """The dissipation function of a drag relative to a stream that rises: it takes a ball along."""
    text = "[mechanism]\nname = 'lifted'\n[coordinates]\ny = { unit = 'm', start = 1.0 }\n[energy]\n"
    text += "kinetic = 'y_dot**2/2'\npotential = '2*y'\ndissipation = '2*(y_dot - 1)**2'\n"
    task, reference = compared(read(text + "[contacts.floor]\ngap = 'y'\n", "lifted.toml"), 5.0)
    assert np.diff(reference.trajectory["dissipated_energy"]).min() < 0
    assert failed(task, reference) == set()


def test_late_and_missing_impacts_are_seen(bouncing: tuple[Task, Reference]) -> None:
    task, reference = bouncing
    late = np.interp(reference.trajectory.time - 0.005, reference.trajectory.time, reference.trajectory["floor_gap"])
    assert "times of impacts" in failed(task, reference, floor_gap=np.maximum(late, 0.0))
    fewer = np.maximum(reference.trajectory["floor_impacts"] - 1, 0)
    assert "impacts counted" in failed(task, reference, floor_impacts=fewer)


def test_two_contacts_that_lift_each_other_accumulate_without_restitution() -> None:
    task, reference = compared(read(SLACK_ROPE, "slack_rope.toml"), 1.4)
    time, counts = reference.trajectory.time, reference.trajectory["rope_impacts"]
    assert "impacts counted" not in failed(task, reference, rope_impacts=counts + 3 * (time > 1.28))
    assert "impacts counted" in failed(task, reference, rope_impacts=counts + 3 * (time > 1.25))


HOIST = """
[mechanism]
name = "hoist"
[coordinates]
x = {}
y = {}
[energy]
kinetic = "1.3*x_dot**2/2 + 2.2*y_dot**2/2"
potential = "2.2*9.81*y"
[contacts]
rope = { gap = "x + y", restitution = 0.3 }
stop = { gap = "1.5 - x", restitution = 0.3 }
"""


def test_a_taut_rope_takes_part_in_impacts_that_accumulate_elsewhere() -> None:
    """It bears a part of each, and each path ends them in its own way: the last two, or six."""
    task, reference = compared(read(HOIST, "hoist.toml"), 1.5)
    time, counts = reference.trajectory.time, reference.trajectory["rope_impacts"]
    assert counts[-1] > 5
    assert "impacts counted" not in failed(task, reference, rope_impacts=counts + 3 * (time > 1.295))
    assert "impacts counted" in failed(task, reference, rope_impacts=counts + 3 * (time > 1.2))


BELT = """
[mechanism]
name = "belt"
[coordinates]
x = { unit = "m" }
y = { unit = "m", start = 0.05 }
[gravity]
acceleration = 9.81
[bodies]
crate = { mass = 1, position = ["x", "y"] }
[contacts.belt]
gap = "y"
slip = "x_dot - 2"
friction = 0.3
restitution = 0.3
"""
"""A crate that is dropped onto a belt of 2 m/s: its rebounds accumulate while it slips."""


def test_a_moving_surface_does_work_where_impacts_accumulate() -> None:
    reference = compared(read(BELT, "belt.toml"), 0.5)[1]
    assert np.abs(reference.balance).max() < 1e-10  # J, of 4; the last rebound, which is taken back, has 3e-6


def test_another_acceleration_than_forces_make_is_seen(sliding: tuple[Task, Reference]) -> None:
    task, reference = sliding
    x = 1.001 * reference.trajectory["x_ddot"]
    assert "mass x acceleration = forces" in broken(task, reference, x_ddot=x)


HELD = """
[mechanism]
name = "held"
[coordinates]
x = {}
[energy]
kinetic = "x_dot**2/2"
[forces]
x = "3*sin(t)"
[frictions]
guide = { on = "x_dot", force = 3 }
seal = { on = "x_dot", force = 2 }
"""


def test_frictions_along_one_slip_are_judged_by_their_sum() -> None:
    """How they share what holds the block is not determined; their sum is."""
    task, reference = compared(read(HELD, "held.toml"), 1.0)
    guide, seal = (reference.trajectory[f"{name}_force"] for name in ("guide", "seal"))
    assert broken(task, reference, guide_force=guide + 0.1, seal_force=seal - 0.1) == set()
    assert "mass x acceleration = forces" in broken(task, reference, guide_force=guide + 1e-6)


@pytest.mark.fmu
def test_time_stepping_is_judged_by_its_order(exported) -> None:
    """What is up to a step late is no fault, and the error at the FMU's own step is told."""
    report = validate(exported("bouncing_ball", solver="moreau"), stop_time=0.6)
    assert report.outcome == "ok"
    assert [note for note in report.notes if "up to a step late" in note]
    assert [note for note in report.notes if note.startswith("At the FMU's own step of 0.001 s")]


@pytest.mark.slow
@pytest.mark.fmu
@pytest.mark.parametrize("model", ["woodpecker", "newtons_cradle", "crane", "falling_rod", "hopper_leg", "gripper"])
def test_time_stepping_of_bundled_models_gives_no_false_alarm(model: str, exported) -> None:
    assert validate(exported(model, solver="moreau")).outcome == "ok"


SHAKEN = """
[mechanism]
name = "shaken"
[coordinates]
x = { velocity = 100 }
[energy]
kinetic = "x_dot**2/2"
[forces]
x = "8*sin(300*t)"
[frictions]
guide = { on = "x_dot", force = 0.5 }
[experiment]
step = 0.02
"""


@pytest.mark.fmu
def test_a_motion_as_fast_as_the_communication_steps_breaks_no_law(exported) -> None:
    """At steps of 0.02 s a force of 300 rad/s looks like one of 14 rad/s, whose integrals are others."""
    report = validate(exported(read(SHAKEN, "shaken")), stop_time=0.4)
    assert report.outcome == "ok"


def test_a_gap_that_hardly_moves_is_shown_up_to_rounding() -> None:
    """A wall beside a body that falls, as far as quarter turns round: 1e-16 m were held against 1e-23 m."""
    x, w = coordinate("x", "m", start=0.1), parameter("w", 0.7, "rad")
    aside = (sin(w) + sin(3 * w) + cos(w) ** 3 + tan(w)) / 10
    contacts = [Contact("floor", gap=x), Contact("wall", gap=aside + sympify("1e-17") * x)]
    falling = Mechanism(
        "aside",
        coordinates=[x],
        parameters=[w],
        bodies=[Body("body", 1, (0, x))],
        contacts=contacts,
        gravity=sympify("9.81"),
        experiment=Experiment(0.3, 0.01),
    )
    report = validate(falling)
    assert report.passed, str(report)
