"""A mechanism cut into FMUs moves as it does in one piece."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from click.testing import CliRunner

import lag2fmu
from lag2fmu.cli import main
from lag2fmu.errors import MechanismError
from lag2fmu.formats.loading import with_settings
from lag2fmu.mechanism import Body, Damper, Frame, Load, Mechanism, Output, Point, Spring, coordinate, parameter, signal
from lag2fmu.systems.cutting import cut

pytestmark = pytest.mark.fmu

INERTIA = (2e-2, 3e-2, 2.5e-2, 1e-3, 0, 2e-3)


def chain() -> Mechanism:
    """An arm that turns, a slide on it, a ball joint at its end, a plate that is fixed there, and forces on all.

    The arm's angle has the name of a frame in another piece.
    """
    a, s = coordinate("ball", "rad", start=0.4, velocity=1.0), coordinate("s", "m", start=0.1)
    turns = [coordinate(f"w{i}", "rad", start=0.2 * i, velocity=0.5) for i in (1, 2, 3)]
    k, c, F = parameter("k", 40.0, "N/m"), parameter("c", 0.5, "N.s/m"), signal("F", "N", start=0.7)
    arm = Frame("arm", rotations=[("y", a)])
    slide = Frame("slide", arm, (0.6 * s + 0.3, 0, 0.8 * s), [("x", 0.3)])
    ball = Frame("ball", slide, (0.2, 0, 0), [("x", turns[0]), ("y", turns[1]), ("z", turns[2])])
    plate = Frame("plate", ball, (0, 0, -0.2), [("z", 0.5)])
    return Mechanism(
        "chain",
        coordinates=[a, s, *turns],
        parameters=[k, c],
        inputs=[F],
        gravity=9.81,
        frames=[arm, slide, ball, plate],
        bodies=[
            Body(f"part_{f.name}", 1.0, frame=f, center=(0.05, 0.02, -0.1), inertia=INERTIA)
            for f in (arm, slide, ball, plate)
        ],
        springs=[Spring("own", k, elongation=2 * s - 0.05), Spring("other", 20.0, elongation=s)],
        dampers=[Damper("own", c, rate=s.dot), Damper("bearing", 0.1, rate=a.dot)],
        loads=[Load("push", body="part_plate", force=(F, 0, 0))],
        outputs=[Output("angle", a + turns[0], "rad"), Output("plate", frame=plate, quantity="quaternion")],
    )  # fmt: skip


def error_of(mechanism: Mechanism, at: list[str], whole: Path, folder: Path, *, stop: float, fmi: str = "2.0") -> float:
    """The largest difference of an output from that of the ``whole``, with steps of 2 ms."""
    cut(mechanism, at, folder / "pieces.ssp", fmi=fmi)
    run, expected = (
        lag2fmu.simulate(path, stop_time=stop, step=0.002, tolerance=1e-11) for path in (folder / "pieces.ssp", whole)
    )
    shared = [name for name in run.names if name.partition(".")[2] in expected.names]
    assert shared
    return max(float(np.abs(run[name] - expected[name.partition(".")[2]]).max()) for name in shared)


@pytest.mark.parametrize(
    ("at", "fmi"),
    [(["slide"], "2.0"), (["ball"], "3.0"), (["plate"], "2.0"), (["s", "plate", "ball"], "2.0")],
)
def test_every_kind_of_joint_can_be_cut(at: list[str], fmi: str, exported, tmp_path: Path) -> None:
    """The slide has a spring with an offset, a second one and a damper of its own, which go with the joint."""
    whole = exported(chain()).path
    assert error_of(chain(), at, whole, tmp_path, stop=0.5, fmi=fmi) < 1e-7


def rods(relative: bool) -> Mechanism:
    """Four rods in the plane, each hinged to the one above, with springs in the hinges of relative angles."""
    q = [coordinate(f"q{i}", "rad", start=0.3 * i, velocity=0.5) for i in range(4)]
    k = parameter("k", 3.0, "N.m/rad")
    x, y, angle, bodies = sp.S.Zero, sp.S.Zero, sp.S.Zero, []
    for i in range(4):
        angle = angle + q[i] if relative else q[i]
        bodies.append(Body(f"rod{i}", 1.0, (x + sp.sin(angle) / 2, y - sp.cos(angle) / 2), angle=angle, inertia=0.08))
        x, y = x + sp.sin(angle), y - sp.cos(angle)
    springs = [Spring(f"hinge{i}", k, elongation=q[i] - 0.1) for i in range(1, 4)] if relative else []
    points = [Point("end", (x, y), angle=angle)]
    return Mechanism(
        "rods", coordinates=q, parameters=[k], gravity=9.81, bodies=bodies, springs=springs, points=points,
        outputs=[Output("end", point="end", quantity="position")],
    )  # fmt: skip


@pytest.mark.parametrize(("relative", "at"), [(True, ["q1", "q3"]), (False, ["q2"])])
def test_hinges_in_the_plane(relative: bool, at: list[str], exported, tmp_path: Path) -> None:
    """The hinge is where the rod's position does not follow its angle, whichever angle is the coordinate."""
    mechanism = rods(relative)
    assert error_of(mechanism, at, exported(mechanism).path, tmp_path, stop=0.5) < 1e-7


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "at"),
    [
        ("furuta_pendulum", ["beta"]),
        ("humanoid_planar", ["shank_l", "forearm_r"]),
        ("bricard", ["q3"]),
        ("cart_pole", ["theta"]),
        ("acrobot", ["q2"]),
    ],
)
def test_bundled_mechanisms_in_pieces(model: str, at: list[str], exported, tmp_path: Path) -> None:
    """One of them has a loop with more equations than it needs: forces of the cut joint are then not unique."""
    assert error_of(lag2fmu.load(model), at, exported(model).path, tmp_path, stop=0.5) < 1e-6


@pytest.mark.slow
def test_a_linkage_that_turns_fast(exported, tmp_path: Path) -> None:
    """At 150 rad/s steps of 1 ms are divided until two runs close the joints, mostly: what forces do is foreseen."""
    mechanism = lag2fmu.load("slider_crank")
    cut(mechanism, ["x"], tmp_path / "pieces.ssp")
    run, whole = (
        lag2fmu.simulate(path, stop_time=0.05, step=0.001, tolerance=1e-12)
        for path in (tmp_path / "pieces.ssp", exported(mechanism).path)
    )
    assert (run.coupling.joints.median, run.coupling.joints.most) == (2, 3)
    assert run.coupling.steps < 400
    for name in run.names:
        other = name.partition(".")[2]
        assert other not in whole.names or run[name] == pytest.approx(whole[other], rel=1e-7, abs=1e-7)


@pytest.mark.slow
def test_a_pose_in_which_a_joint_holds_nothing(exported, tmp_path: Path) -> None:
    """The cranks of a parallelogram pass the line of all links: there a force along it moves nothing.

    How the linear algebra of a processor rounds decides on the last digits: errors are 1e-7 to 2e-6.
    """
    starts = {"a0": "0.15", "a0_dot": "-6", "a1": "0.15"}
    one = with_settings(lag2fmu.load("n_four_bar", {"n": 1}), starts)
    assert error_of(one, ["a0"], exported(one).path, tmp_path, stop=0.05) < 5e-6


@pytest.mark.parametrize(
    ("at", "message"),
    [
        (["slid"], "no frame or coordinate 'slid'; did you mean 'slide'"),
        (["slide", "s"], "--at slide: is given twice"),
        ([], "nothing is cut; give --at"),
    ],
)
def test_places_that_cannot_be_cut(at: list[str], message: str, tmp_path: Path) -> None:
    with pytest.raises(MechanismError, match=message):
        cut(chain(), at, tmp_path / "pieces.ssp")
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize(
    ("model", "at", "message"),
    [
        ("double_atwood", "x", "no rigid body turns about a hinge by this coordinate, and nothing is shifted"),
        ("andrews_squeezer", "Theta", r"constraints\.B_x: works across a cut, on 'andrews_squeezer' and 'joint K2'"),
        (
            "moving_frame",
            "x",
            "the piece 'moving_frame' does not move by itself: .* along y has no mass.* or cut where both sides",
        ),
        ("six_axis_arm", "theta_3", r"energy.kinetic: the term .*theta_3_dot\*\*2.* belongs to several pieces"),
    ],
)
def test_mechanisms_that_cannot_be_cut(model: str, at: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(MechanismError, match=message):
        cut(lag2fmu.load(model), [at], tmp_path / "pieces.ssp")


def test_what_works_across_a_cut_is_named(tmp_path: Path) -> None:
    q, r = coordinate("q", "rad"), coordinate("r", "rad")
    one, two = Frame("one", rotations=[("x", q)]), Frame("two", "one", (0, 0, -1), [("x", r)])
    bodies = [Body(f"b_{f.name}", 1.0, frame=f, inertia=INERTIA) for f in (one, two)]
    dampers = [Damper("d", 0.1, rate=q.dot - r.dot)]
    both = Mechanism("both", coordinates=[q, r], frames=[one, two], bodies=bodies, dampers=dampers)
    with pytest.raises(MechanismError, match=r"dampers\.d: works across a cut"):
        cut(both, ["two"], tmp_path / "pieces.ssp")


def test_the_command_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(main, ["cut", "furuta_pendulum", "--at", "pendulum"])
    assert result.exit_code == 0, result.output
    assert "wrote furuta_pendulum.ssp: furuta_pendulum, pendulum" in result.output
    assert "revolute joint between furuta_pendulum and pendulum" in result.output
    again = CliRunner().invoke(main, ["cut", "furuta_pendulum", "--at", "pendulum"])
    assert again.exit_code == 2
    assert "exists; overwrite it with --force" in again.output
