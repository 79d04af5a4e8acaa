"""Ideal joints between FMUs: against the mechanism in one piece, in the plane and in space."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from lxml import etree
from sympy import cos, sin

import lag2fmu
from lag2fmu.errors import Lag2FmuError, SimulationError
from lag2fmu.mechanism import Body, Frame, Gravity, Mechanism, Point, Ports, coordinate
from lag2fmu.mechanism.record import complete
from lag2fmu.reference import Trajectory
from lag2fmu.systems.controller import Controller

pytestmark = pytest.mark.fmu

PLACE = ("forces", "torques", "poses", "velocities")
POSE = ("forces", "torques", "poses")
A, B = coordinate("a", "rad", start=1.0), coordinate("b", "rad", start=-0.5, velocity=2.0)
ARM = Frame("arm", rotations=[("z", A)])
G = Gravity(9.81)
PRECISE = {"tolerance": 1e-12, "stop_time": 1.0}


def ports(*places: str, keys: tuple[str, ...] = PLACE, **others: str) -> Ports:
    return Ports(**dict.fromkeys(keys, places), **others)  # type: ignore[arg-type]


def without_states(path: Path, target: Path) -> Path:
    """A copy of the FMU ``path`` that says that it cannot save its state."""
    with zipfile.ZipFile(path) as whole, zipfile.ZipFile(target, "w") as copy:
        for name in whole.namelist():
            data = whole.read(name)
            if name == "modelDescription.xml":
                data = data.replace(b'canGetAndSetFMUstate="true"', b'canGetAndSetFMUstate="false"')
            copy.writestr(name, data)
    return target


def rod(name: str, x, y, angle) -> Body:  # type: ignore[no-untyped-def]
    """A rod of 1 m and 2 kg below (x, y)."""
    return Body(name, 2.0, (x + sin(angle) / 2, y - cos(angle) / 2), angle=angle, inertia=0.3)


UPPER = rod("upper", 0, 0, A)
PENDULUM = Mechanism(
    "pendulum_of_rods", coordinates=[A, B], gravity=G, bodies=[UPPER, rod("lower", sin(A), -cos(A), B)]
)


def hung(keys: tuple[str, ...] = PLACE) -> Mechanism:
    """The upper rod with a place at its lower end."""
    return Mechanism(
        "hung", coordinates=[A], gravity=G, bodies=[UPPER],
        points=[Point("tip", (sin(A), -cos(A)), angle=A)], ports=ports("tip", keys=keys),
    )  # fmt: skip


HUNG = hung()


def loose(keys: tuple[str, ...] = PLACE) -> Mechanism:
    """The lower rod by itself, with a place at its upper end."""
    x, y = coordinate("x", "m", start=float(np.sin(1.0))), coordinate("y", "m", start=float(-np.cos(1.0)))
    return Mechanism(
        "loose", coordinates=[x, y, B], gravity=G, bodies=[rod("lower", x, y, B)],
        points=[Point("base", (x, y), angle=B)], ports=ports("base", keys=keys),
    )  # fmt: skip


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def pair(request: pytest.FixtureRequest, exported, tmp_path_factory) -> Path:
    """Both rods as FMUs that a hinge joins."""
    fmus = {"up": exported(HUNG, fmi=request.param), "low": exported(loose(), fmi=request.param)}
    path = tmp_path_factory.mktemp("joints") / "pair.ssp"
    return lag2fmu.ssp(fmus, path, join=["up.tip:low.base=revolute"])


def test_a_hinge_in_the_plane_is_of_order_4(pair: Path, exported) -> None:
    """In steps that are short enough not to be divided."""
    whole = lag2fmu.simulate(exported(PENDULUM), step=0.005, **PRECISE)
    errors = []
    for step, every in ((0.005, 1), (0.0025, 2)):
        run = lag2fmu.simulate(pair, step=step, **PRECISE)
        errors.append(max(np.abs(run[x][::every] - whole[y]).max() for x, y in (("up.a", "a"), ("low.b", "b"))))
        for axis in ("x", "y"):
            assert np.abs(run[f"up.tip_position_{axis}"] - run[f"low.base_position_{axis}"]).max() < 1e-10
            assert np.abs(run[f"up.tip_velocity_{axis}"] - run[f"low.base_velocity_{axis}"]).max() < 1e-7
        assert run.coupling.steps == round(1.0 / step)
    assert errors[0] < 1e-7
    assert np.log2(errors[0] / errors[1]) > 3.7


@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
def test_speeds_follow_from_poses_where_they_are_no_ports(fmi: str, exported, tmp_path: Path) -> None:
    whole = lag2fmu.simulate(exported(PENDULUM), step=0.005, **PRECISE)
    fmus = {"up": exported(hung(("forces", "poses")), fmi=fmi), "low": exported(loose(("forces", "poses")), fmi=fmi)}
    path = lag2fmu.ssp(fmus, tmp_path / "pair.ssp", join=["up.tip:low.base=revolute"])
    run = lag2fmu.simulate(path, step=0.005, **PRECISE)
    assert np.abs(run["low.b"] - whole["b"]).max() < 1e-7


def test_steps_are_repeated_twice_at_most(pair: Path) -> None:
    """At steps of 1 ms; what their quadratic forces miss is told."""
    found = lag2fmu.simulate(pair, step=0.001, tolerance=1e-9, stop_time=0.2).coupling
    assert found.steps == 200
    assert found.repeated <= 2 * found.steps
    assert found.joints.median == 2
    assert found.joints.most <= 3
    assert found.joints.gap < 1e-11
    assert 0 < found.joints.astray < 1e-9
    assert not found.unjudged


@pytest.mark.parametrize("pair", ["3.0"], indirect=True)
def test_without_a_step_the_error_chooses_the_steps(pair: Path, exported) -> None:
    """The upper rod starts with 25 rad/s: between recorded points there is more than one step.

    The error is the master's, whatever the version of FMI.
    """
    fast = {"up.a_dot": 25.0, "low.x_dot": float(25 * np.cos(1.0)), "low.y_dot": float(25 * np.sin(1.0))}
    whole = lag2fmu.simulate(exported(PENDULUM), step=0.02, stop_time=1.0, tolerance=1e-12, values={"a_dot": 25.0})
    for tolerance in (1e-4, 1e-6):
        run = lag2fmu.simulate(pair, stop_time=1.0, tolerance=tolerance, values=fast)
        every = round(0.02 / run.time[1])
        assert max(np.abs(run[x][::every] - whole[y]).max() for x, y in (("up.a", "a"), ("low.b", "b"))) < 3 * tolerance
        assert run.coupling.steps > len(run.time)
        assert run.coupling.joints.astray < tolerance
        assert run.coupling.joints.most <= 3


def test_the_description_is_valid(pair: Path) -> None:
    """Joints stand in an annotation, which the schema lets pass."""
    with zipfile.ZipFile(pair) as archive:
        text = archive.read("SystemStructure.ssd")
    assert b"org.lag2fmu.joints" in text
    folder = Path(fmpy.__file__).parent / "ssp" / "schema"
    etree.XMLSchema(file=str(folder / "SystemStructureDescription.xsd")).assertValid(etree.fromstring(text))


def test_the_forces_of_a_joint_are_those_of_the_whole(pair: Path) -> None:
    """At every recorded point, the first one included: what hangs on the hinge is accelerated by gravity and force."""
    run = lag2fmu.simulate(
        pair,
        step=0.005,
        **PRECISE,
        outputs=["low.base_force_x", "low.base_force_y", "low.b", "low.b_dot", "up.a", "up.a_dot"],
    )
    a, b, fx, fy = (run[name] for name in ("up.a", "low.b", "low.base_force_x", "low.base_force_y"))
    assert np.abs(run["low.base_force_x"][0]) > 1.0
    # the upper rod about its hinge: J a_ddot = -m g sin(a)/2 - (force on the lower rod) . (cos a, sin a)
    a_ddot = np.gradient(run["up.a_dot"], run.time, edge_order=2)
    inertia = 0.3 + 2.0 / 4
    expected = -2.0 * 9.81 * np.sin(a) / 2 - (fx * np.cos(a) + fy * np.sin(a))
    assert inertia * a_ddot == pytest.approx(expected, abs=5e-3 * np.abs(expected).max())
    assert b[0] == -0.5


# ------------------------------------------------------------------------------------------------------- in space

INERTIA = (6e-3, 5e-3, 2e-3, 1e-4, 0, 2e-4)
KINDS = {
    "revolute:x": Frame("load", ARM, (0.5, 0, 0), [("x", B)]),
    "prismatic:3,4,0": Frame("load", ARM, (0.5 + 0.6 * B, 0.8 * B, 0)),
    "fixed": Frame("load", ARM, (0.5, 0, 0)),
}
"""{joint: the frame of a load on an arm as it moves in one piece}."""


def load_on(frame: Frame) -> Body:
    return Body("plate", 0.3, frame=frame, center=(0.05, 0.02, -0.15), inertia=INERTIA)


def arm(*frames: Frame, ports_: Ports, more: tuple[Body, ...] = ()) -> Mechanism:
    beam = Body("beam", 0.6, frame=ARM, center=(0.2, 0, 0), inertia=(2e-2, 2e-2, 2e-2, 0, 0, 0))
    used = {x.name for f in frames for e in (*f.origin, *(turn.angle for turn in f.rotations)) for x in e.free_symbols}
    return Mechanism(
        "arm",
        coordinates=[A, B] if "b" in used else [A],
        frames=[ARM, *frames],
        gravity=G,
        bodies=[beam, *more],
        ports=ports_,
    )


def free_load(start: Trajectory, rotation: str, *more: Frame, keys: tuple[str, ...] = PLACE) -> Mechanism:
    """The load by itself, where and as fast as it is at the ``start`` of the whole."""
    p, v, e, w = (
        np.array([start[f"load_{name}_{x}"][0] for x in ends])
        for name, ends in (
            ("position", "xyz"),
            ("velocity", "xyz"),
            ("quaternion", "0123"),
            ("angular_velocity", "xyz"),
        )
    )
    rates = np.concatenate([[-e[1:] @ w], e[0] * w + np.cross(w, e[1:])]) / 2
    xyz = [coordinate(x, "m", start=p[i], velocity=v[i]) for i, x in enumerate("xyz")]
    e_ = [coordinate(f"e{i}", "1", start=e[i], velocity=rates[i]) for i in range(4)]
    frame = Frame("load", "world", xyz, quaternion=e_)
    names = ["load", *(f.name for f in more)]
    return Mechanism(
        "free_load", coordinates=[*xyz, *e_], frames=[frame, *more], gravity=G, bodies=[load_on(frame)],
        ports=ports(*names, keys=keys, rotation=rotation),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("joint", "rotation", "keys"),
    [("revolute:x", "quaternion", PLACE), ("prismatic:3,4,0", "rotation", POSE), ("fixed", "quaternion", POSE)],
)
def test_joints_in_space(joint: str, rotation: str, keys: tuple[str, ...], exported, tmp_path: Path) -> None:
    """Speeds that are no ports are the derivatives of the poses."""
    frame = KINDS[joint]
    whole = arm(frame, ports_=ports("load", keys=("poses", "velocities")), more=(load_on(frame),))
    expected = lag2fmu.simulate(exported(whole), step=0.01, **PRECISE)
    hook = Frame("hook", ARM, (0.5, 0, 0))
    fmus = {
        "arm": exported(arm(hook, ports_=ports("hook", keys=keys))),
        "load": exported(free_load(expected, rotation, keys=keys)),
    }
    path = lag2fmu.ssp(fmus, tmp_path / "arm.ssp", join=[f"arm.hook:load.load={joint}"])
    run = lag2fmu.simulate(path, step=0.01, **PRECISE)
    assert np.abs(run["arm.a"] - expected["a"]).max() < 2e-7
    for axis in "xyz":
        assert np.abs(run[f"load.load_position_{axis}"] - expected[f"load_position_{axis}"]).max() < 2e-7


def test_redundant_joints_share_forces(exported) -> None:
    """A door on two hinges moves as on one; ten equations leave it one of six freedoms.

    Along their axis the hinges could pull each other by any force. It does not grow beyond what they hold together.
    """
    frame = KINDS["revolute:x"]
    whole = arm(frame, ports_=ports("load", keys=("poses", "velocities")), more=(load_on(frame),))
    expected = lag2fmu.simulate(exported(whole), step=0.01, **PRECISE)
    hooks = [Frame(f"hook{i}", ARM, (0.5 + 0.1 * i, 0, 0)) for i in (0, 1)]
    hinges = [Frame(f"hinge{i}", "load", (0.1 * i, 0, 0)) for i in (0, 1)]
    fmus = {
        "arm": exported(arm(*hooks, ports_=ports("hook0", "hook1"))),
        "load": exported(free_load(expected, "quaternion", *hinges)),
    }
    join = [f"arm.hook{i}:load.hinge{i}=revolute:x" for i in (0, 1)]
    shares = [f"arm.hook{i}_force_{x}" for i in (0, 1) for x in "xy"]
    run = lag2fmu.simulate(fmus, join=join, step=0.01, outputs=["arm.a", *shares], **PRECISE)
    assert np.abs(run["arm.a"] - expected["a"]).max() < 2e-7
    one, other = (np.cos(run["arm.a"]) * run[x] + np.sin(run["arm.a"]) * run[y] for x, y in (shares[:2], shares[2:]))
    assert np.abs(one - other).max() < np.abs(one + other).max()


def test_a_function_in_a_system_with_joints(exported) -> None:
    """It hears the joined motion at its samples, and the steps, which end there too, are counted."""

    def double(t: float, inputs: dict[str, float]) -> dict[str, float]:
        return {"twice": 2 * inputs["a"]}

    parts = {"up": exported(HUNG), "low": exported(loose()), "watch": Controller(double, 0.015)}
    run = lag2fmu.simulate(
        parts, connect=["up.a:watch.a"], join=["up.tip:low.base=revolute"], step=0.01, stop_time=0.3,
        outputs=["up.a", "watch.twice"],
    )  # fmt: skip
    assert run["watch.twice"][::3] == pytest.approx(2 * run["up.a"][::3], abs=1e-12)
    assert run.coupling.steps >= 40
    assert run.coupling.repeated > 0


# ---------------------------------------------------------------------------------------------------------- errors


@pytest.mark.parametrize(
    ("join", "message"),
    [
        ("up.tip", "expected COMPONENT.PLACE:COMPONENT.PLACE=KIND"),
        ("up.tip:low.base=gear", "'gear' is no joint between FMUs"),
        ("up.tip:low.bse=revolute", "'low' has no terminal of a place 'bse'; did you mean 'base'"),
        ("up.tip:lo.base=revolute", "there is no component 'lo'; did you mean 'low'"),
        ("up.tip:low.base=prismatic:u", "'u' is no axis; give x, y, z or three numbers"),
        ("up.tip:low.base=prismatic:0,0,0", "has no direction"),
        ("up.tip:low.base=spherical", "there is no joint 'spherical' in the plane"),
        ("up.tip:up.tip=revolute", "both ends are one place"),
    ],
)
def test_joints_that_do_not_fit(join: str, message: str, exported, tmp_path: Path) -> None:
    fmus = {"up": exported(HUNG), "low": exported(loose())}
    with pytest.raises(Lag2FmuError, match=message):
        lag2fmu.ssp(fmus, tmp_path / "pair.ssp", join=[join])
    assert not [*tmp_path.iterdir()]


def test_a_place_without_torques_names_the_option(exported, tmp_path: Path) -> None:
    bare = hung(("forces", "poses"))
    fmus = {"up": exported(bare), "low": exported(loose())}
    with pytest.raises(Lag2FmuError, match="export that FMU with --port torques=tip"):
        lag2fmu.ssp(fmus, tmp_path / "pair.ssp", join=["up.tip:low.base=fixed"])


def test_joints_that_are_open_at_the_start(exported, tmp_path: Path) -> None:
    fmus = {"up": exported(HUNG), "low": exported(loose())}
    path = lag2fmu.ssp(fmus, tmp_path / "pair.ssp", join=["up.tip:low.base=revolute"], values={"low.x": 0.9})
    with pytest.raises(
        SimulationError, match=r"at t = 0 s the joint up.tip_port:low.base_port=revolute is open by 0.0585"
    ):
        lag2fmu.simulate(path, stop_time=1.0)


def test_a_rod_without_length(exported, tmp_path: Path) -> None:
    """Both places start at one point, but for rounding."""
    fmus = {"up": exported(HUNG), "low": exported(loose())}
    path = lag2fmu.ssp(fmus, tmp_path / "pair.ssp", join=["up.tip:low.base=rod"])
    with pytest.raises(SimulationError, match="=rod: both places are at one point; a rod joins two"):
        lag2fmu.simulate(path, stop_time=0.1)


def test_a_warning_of_a_repeated_step_is_told_once(exported, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Each step is run two or three times, and the lower rod leaves the range of its angle in one of them."""
    ranged = replace(
        loose().description, coordinates=(*loose().coordinates[:2], replace(loose().coordinates[2], maximum=0.0))
    )
    fmus = {"up": exported(HUNG), "low": exported(complete(ranged))}
    lag2fmu.simulate(
        lag2fmu.ssp(fmus, tmp_path / "pair.ssp", join=["up.tip:low.base=revolute"]), step=0.01, stop_time=0.5
    )
    assert len([r for r in caplog.records if "leaves its range" in r.message]) == 1


def test_fmus_that_cannot_go_back_are_refused(exported, tmp_path: Path) -> None:
    """The sentence names what is missing; nothing else in that FMU changes."""
    fmus = {"up": exported(HUNG), "low": without_states(exported(loose()).path, tmp_path / "low.fmu")}
    path = lag2fmu.ssp(fmus, tmp_path / "pair.ssp", join=["up.tip:low.base=revolute"])
    with pytest.raises(
        Lag2FmuError, match=r"the FMU of 'low' cannot save and restore its state \(canGetAndSetFMUstate\)"
    ):
        lag2fmu.simulate(path, stop_time=1.0)
