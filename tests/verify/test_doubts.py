"""A run tells what is doubtful in it: runs that obey the laws are silent, and each law that is broken is named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from lag2fmu import load, simulate
from lag2fmu.cli import main
from lag2fmu.formats.text import read
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference import Trajectory
from lag2fmu.reference.hybrid.modes import Mode
from lag2fmu.verify import doubts as laws
from lag2fmu.verify import watched_runs as module
from lag2fmu.verify.doubts import DoubtWatch
from lag2fmu.verify.watched_runs import doubts_of

TOLERANCE = 1e-6
TIMES = np.linspace(0.0, 1.0, 51)
BLOCK = """
[mechanism]
name = "block"
[parameters]
m = { value = 2, unit = "kg" }
l = { value = 0.5, unit = "m" }
[coordinates]
x = { unit = "m", velocity = 0 }
y = { unit = "m" }
a = { unit = "rad" }
[gravity]
acceleration = 10
[bodies.block]
mass = "m"
inertia = 1
position = ["x", "y"]
angle = "a"
[contacts.floor]
gap = "y"
slip = "x_dot"
friction = 0.2
static_friction = 0.3
[frictions.bearing]
on = "a_dot"
force = 4
static = 5
[constraints.holonomic]
bar = "x - l*a"
"""


def block() -> Mechanism:
    """A block on a floor that rolls along a bar, in a bearing with friction."""
    return read(BLOCK, "block")


def at_rest(mechanism: Mechanism, **changed: np.ndarray) -> Trajectory:
    """A run in which everything rests, sticks and obeys, but for what is ``changed``."""
    columns = dict.fromkeys(DoubtWatch(mechanism).outputs, np.zeros_like(TIMES))
    columns |= {"floor_mode": np.full_like(TIMES, Mode.STICKS), "bearing_mode": np.full_like(TIMES, Mode.STICKS)}
    columns["floor_force"] = np.full_like(TIMES, 20.0)
    return Trajectory.of(TIMES, columns | changed)


def told(run: Trajectory) -> str:
    return " ".join(DoubtWatch(block()).doubts(run, TOLERANCE))


LATER = np.where(TIMES > 0.5, 1.0, 0.0)
BROKEN = {
    "a dry friction that holds too much": (
        {"bearing_force": -5.5 * LATER},
        "the friction of bearing is 5.5 where 5",
    ),
    "one that slides with what only holds": (
        {"bearing_force": 4.5 * LATER, "bearing_mode": np.full_like(TIMES, Mode.FORWARD)},
        "the friction of bearing is 4.5 where 4 is its limit, at t = 0.52 s",
    ),
    "a contact that holds too much": ({"floor_friction": 6.5 * LATER}, "the friction of floor is 6.5 where 6 is"),
    "a constraint that is open": ({"residual_bar": 2e-3 * LATER}, "the constraint bar is left open by 0.002"),
    "a stick that slips": ({"a_dot": 1e-3 * LATER}, "bearing sticks and slips by 0.001"),
    "a coordinate that moves at rest": ({"a": 1e-2 * TIMES}, "a creeps by 0.01 (SI) at rest, from t = 0 s on"),
}


@pytest.mark.parametrize("what", BROKEN)
def test_what_is_broken_is_named_with_a_remedy(what: str) -> None:
    changed, sentence = BROKEN[what]
    found = told(at_rest(block(), **changed))
    assert sentence in found
    assert "compare with a run at a sharper tolerance" in found


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_what_obeys_is_silent(share: float) -> None:
    """Forces up to their limits, and errors of the size of the tolerance, in random directions."""
    draw = np.random.default_rng(int(10 * share))
    noise = TOLERANCE * draw.uniform(-1, 1, (3, len(TIMES)))
    holding = {"bearing_force": share * 5.0 * np.sign(noise[0]), "floor_friction": share * 6.0 * np.sign(noise[1])}
    assert told(at_rest(block(), **holding, a_dot=noise[0], residual_bar=noise[1], x=noise[2])) == ""
    falling = {"floor_mode": np.full_like(TIMES, Mode.OPEN), "y": 5 * TIMES**2, "y_dot": 10 * TIMES}
    gone = np.zeros_like(TIMES)
    assert told(at_rest(block(), **falling, floor_force=gone, x_dot=gone + 3, a_dot=gone + 6, **_sliding())) == ""


def test_what_slips_between_two_points_has_not_crept() -> None:
    """The bearing lets go, slides and sticks again between the same two points, which takes 4 N.m times the angle."""
    slipped = {"a": 1e-2 * LATER, "dissipated_energy": 4e-2 * LATER}
    assert told(at_rest(block(), **slipped)) == ""
    assert "a creeps by 0.0098" in told(at_rest(block(), a=1e-2 * (LATER + TIMES), dissipated_energy=4e-2 * LATER))


@pytest.mark.parametrize(("weight", "normal", "over", "silent"), [
    (20.0, 1e-8, 1e-8, True),
    (20.0, 0.0, 1e-6, True),
    (20.0, 20.0, 1e-2, False),
    (20.0, 0.1, 1e-3, False),
    (0.0, 1e-8, 1e-8, False),
])  # fmt: skip
def test_rounding_in_a_corner_is_no_doubt(weight: float, normal: float, over: float, silent: bool) -> None:
    """A wall that bears a force of rounding limits friction to as little, which means nothing beside the weight."""
    wall = '[contacts.wall]\ngap = "x + 0.5*y"\nslip = "y_dot - 0.5*x_dot + a_dot"\nfriction = 0.2\n'
    corner = read(BLOCK.replace("acceleration = 10", f"acceleration = {weight / 2}") + wall, "block")
    still = np.full_like(TIMES, Mode.STICKS)
    forces = {"wall_force": normal + 0 * TIMES, "wall_friction": 0.2 * normal + over * LATER, "wall_mode": still}
    found = [*DoubtWatch(corner).doubts(at_rest(corner, **forces, floor_force=weight + 0 * TIMES), TOLERANCE)]
    assert (found == []) is silent


def test_a_limit_that_jumps_at_a_point_holds_on_both_sides() -> None:
    """At t = 0.5 s the limit falls from 8 to 4; the run may show the force of before there, but not a point later."""
    jumping = read(BLOCK.replace("force = 4", 'force = "if(t < 0.5, 8, 4)"').replace("static = 5\n", ""), "block")
    for last, silent in ((0.5, True), (0.52, False)):
        force = np.where(last + 1e-9 >= TIMES, 7.9, 3.9)
        found = [*DoubtWatch(jumping).doubts(at_rest(jumping, bearing_force=force), TOLERANCE)]
        assert (found == []) is silent


@pytest.mark.fmu
def test_rounding_lets_no_freewheel_go() -> None:
    """It holds two speeds equal that differ in the last place; where they differ by more, it holds nothing."""
    wheel = '[coordinates.b]\nunit = "rad"\n[bodies.hub]\nmass = 1\ninertia = 1\nposition = [0, 0]\nangle = "b"\n'
    holds = 'on = "a_dot - b_dot"\nforce = "if(a_dot < b_dot, 0, 5)"\n'
    free = read(BLOCK.replace('on = "a_dot"\nforce = 4\nstatic = 5\n', holds) + wheel, "block")
    speed = np.full_like(TIMES, 2.0)
    for other, silent in ((np.nextafter(2.0, 3.0), True), (2.0 + 1e-9, False)):
        turning = {"a_dot": speed, "x_dot": speed / 2, "b_dot": other + 0 * TIMES, "bearing_force": speed}
        found = " ".join(DoubtWatch(free).doubts(at_rest(free, **turning), TOLERANCE))
        assert ("friction of bearing" not in found) is silent


def test_what_sticks_in_the_middle_of_steps_turns_until_their_end(exported) -> None:
    """A block rocks on its corners: with time stepping these stick half a step before each communication point."""
    block = load("rocking_block")
    watch = DoubtWatch(block)
    run = simulate(exported("rocking_block", solver="moreau"), step=0.01, outputs=watch.outputs)
    (slips,) = watch.doubts(run, 1e-9)
    assert "sticks and slips by" in slips
    assert [*watch.doubts(run, 1e-9, solver="moreau")] == []
    slipping = Trajectory(run.time, run.names, run.values + 1e-3 * np.eye(len(run.names))[run.names.index("x_dot")])
    (creeps,) = watch.doubts(slipping, TOLERANCE, solver="moreau")
    assert "sticks and slips by" in creeps
    assert "a smaller solver_step" in creeps


def _sliding() -> dict[str, np.ndarray]:
    return {"bearing_mode": np.full_like(TIMES, Mode.FORWARD), "bearing_force": np.full_like(TIMES, -4.0)}


@pytest.mark.parametrize("model", ["coulomb_oscillator", "four_bar_linkage", "woodpecker"])
def test_bundled_mechanisms_have_no_doubts(model: str, exported) -> None:
    assert doubts_of(load(model), exported(model).path) == []


def test_nothing_is_looked_at_where_nothing_can_be_doubtful(exported) -> None:
    assert doubts_of(load("pendulum"), exported("pendulum").path) == []


@pytest.mark.fmu
def test_export_and_simulate_warn_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """With bars far below rounding every run is doubtful; both verbs say so in one line, beside their result."""
    monkeypatch.setattr(laws, "BEYOND", -0.5)
    fmu = str(tmp_path / "x.fmu")
    exporting = CliRunner().invoke(main, ["export", "coulomb_oscillator", "-o", fmu])
    running = CliRunner().invoke(main, ["simulate", fmu, "-o", "-"])
    assert [exporting.exit_code, running.exit_code] == [0, 0]
    for told in (exporting.stderr, caplog.text):
        assert told.count("warning: the run is doubtful: the friction of floor is ") == 1
    assert running.stdout.splitlines()[0].startswith("time,x [m],x_dot [m/s]")
    assert "floor" not in running.stdout.splitlines()[0]


@pytest.mark.fmu
def test_a_run_in_python_warns_too(exported, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    """With the parameters that are set, and without columns that nobody asked for."""
    fmu, told = exported("coulomb_oscillator"), lambda: [r.getMessage() for r in caplog.records]
    plain = simulate(fmu, values={"F": 0.5})
    assert told() == []
    monkeypatch.setattr(laws, "BEYOND", -0.5)
    found = simulate(fmu, values={"F": 0.5}, beside=["floor_force"])
    assert [message for message in told() if "warning: the run is doubtful: the friction of floor is 0.5" in message]
    assert found.names == (*plain.names, "floor_force")
    assert (found.without(["floor_force"]).values == plain.values).all()


@pytest.mark.fmu
def test_a_run_is_not_waited_for(exported, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(laws, "BEYOND", -0.5)
    monkeypatch.setattr(module, "PATIENCE", -1.0)
    assert doubts_of(load("coulomb_oscillator"), exported("coulomb_oscillator").path) == []
