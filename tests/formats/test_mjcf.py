"""Robots in MJCF: accelerations as MuJoCo's own or closed forms, and what is wrong in a file is named."""

from __future__ import annotations

import builtins
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from kkt import solve

from lag2fmu import Ensemble, derive, export, function, linearize, load, simulate, start, sweep
from lag2fmu.errors import DerivationError, LoadError
from lag2fmu.formats.robots.poses import JointPose, about
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.mechanism.record import Mechanism

mujoco = pytest.importorskip("mujoco", reason="the optional package mujoco is not installed; 'make test-all' does so")

Robot = Callable[..., Mechanism]
ARM = """<mujoco model="arm"><compiler angle="radian"/><option gravity="0.3 0 -9.7"><flag contact="disable"/></option>
<worldbody><body name="upper" pos="0.1 0.2 1" euler="0.3 0.2 -0.4">
  <joint name="shoulder_1" axis="0 0 1" pos="0.05 0 0.02" armature="0.02" damping="0.3" ref="0.2"/>
  <joint name="shoulder_2" axis="1 0 1" pos="0 0.03 0" stiffness="4" springref="0.3"/>
  <geom type="capsule" fromto="0 0 0 0.3 0 0.1" size="0.05" contype="0" conaffinity="0"/>
  <body name="lower" pos="0.3 0 0.1"><joint name="elbow" axis="0 1 0"/><joint name="reach" type="slide" axis="1 0 0"/>
    <geom type="box" size="0.1 0.05 0.04" pos="0.1 0 0" contype="0" conaffinity="0"/></body></body></worldbody>
<tendon><fixed name="cable" stiffness="3" damping="0.2" springlength="0.1"><joint joint="elbow" coef="0.5"/>
  <joint joint="reach" coef="-1.5"/></fixed></tendon>
<actuator><motor name="lift" joint="shoulder_1" gear="3" ctrlrange="-1 1" ctrllimited="true"/>
  <position name="bend" joint="elbow" kp="7" kv="0.4"/>
  <motor name="pull" tendon="cable" gear="2"/>
  <general name="valve" joint="reach" gaintype="affine" gainprm="0.5 2 -3" gear="1.5"/></actuator></mujoco>"""


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    """What makes a mechanism of a text and options."""

    def made(text: str, **options: object) -> Mechanism:
        path = tmp_path / "robot.xml"
        path.write_text(text)
        return load(path, options)

    return made


def accelerations(mechanism: Mechanism, **values: float) -> dict[str, float]:
    """The accelerations, at 0 where nothing else is said."""
    names = [q.name for q in mechanism.coordinates]
    at = {f"{kind}{name}{rate}": 0.0 for name in names for kind, rate in (("", ""), ("", "_dot"), ("Q_", ""))}
    at |= {u.name: 0.0 for u in mechanism.inputs}
    at |= {p.name: p.value for p in mechanism.parameters} | {"t": 0.0} | values
    return dict(zip(names, solve(derive(mechanism), at)[0].tolist(), strict=True))


def test_numbers_have_the_units_of_their_use(robot: Robot) -> None:
    """A file has none. What is left open is a number: factors of joints first, then what a control stands for."""
    arm = robot(ARM)
    assert arm.strict_units
    units = {part.name: part.unit and (part.unit.name or "1") for part in (*arm.parameters, *arm.inputs)}
    expected = {"gear_u_lift": "1", "u_lift": "N.m", "gain_u_bend": "N.m", "position_gain_u_bend": "N.m", "u_bend": "1"}
    expected |= {"rate_gain_u_bend": "N.m.s", "gear_cable_1": "1", "gear_cable_2": "1/m", "stiffness_cable": "N.m"}
    expected |= {"damping_cable": "N.m.s", "u_pull": "N.m", "gain_u_valve": "N", "length_gain_u_valve": "N/m"}
    assert expected.items() <= units.items()
    assert None not in units.values()


def test_an_arm_moves_as_in_mujoco(robot: Robot) -> None:
    """Anchors, two joints a body, armature, springs, references, a tendon and four actuators; 1e-12."""
    mechanism, model = robot(ARM), mujoco.MjModel.from_xml_string(ARM)
    state = mujoco.MjData(model)
    rng = np.random.default_rng(0)
    state.qpos[:], state.qvel[:] = rng.uniform(-0.5, 0.5, (2, model.nv))
    state.ctrl[:] = rng.uniform(-1, 1, model.nu)
    mujoco.mj_forward(model, state)
    names = ["shoulder_1", "shoulder_2", "elbow", "reach"]
    values = dict(zip(names, state.qpos, strict=True)) | dict(zip((f"{x}_dot" for x in names), state.qvel, strict=True))
    values |= dict(zip(("u_lift", "u_bend", "u_pull", "u_valve"), state.ctrl, strict=True))
    found = accelerations(mechanism, **values)
    assert [found[name] for name in names] == pytest.approx(state.qacc.tolist(), rel=1e-12)


PART = "that compensation of gravity counts to the actuators' force on the joint j"
FREE = """<mujoco model="free"><option gravity="0.1 0 -9.81"><flag contact="disable"/></option><worldbody>
<site name="nail" pos="0.5 0 2"/><body name="hull" quat="0.9 0.1 0.2 0.3">
  <joint type="free" name="hull" damping="0.7" stiffness="3" armature="0.05"/>
  <inertial pos="0 0.1 0" mass="5" diaginertia="0.2 0.3 0.4"/>
  <body name="pod" pos="0.2 0 0.1" euler="0 30 40"><inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/>
    <site name="jet" pos="-0.3 0 0" euler="0 20 10"/><site name="hook" pos="0.1 0.1 0"/></body>
  <body name="leg" pos="0.3 0 -0.1" euler="10 0 0">
    <joint name="hip" type="ball" damping="0.3" stiffness="2" armature="0.02" pos="0 0 0.1"/>
    <inertial pos="0 0.05 -0.2" mass="0.8" diaginertia="0.02 0.02 0.01"/><site name="toe" pos="0 0 -0.3"/></body>
</body></worldbody>
<tendon>
  <spatial name="rope" stiffness="30" damping="0.2" springlength="0.4"><site site="nail"/><site site="hook"/></spatial>
  <spatial name="muscle"><site site="hook"/><site site="toe"/></spatial>
  <spatial name="winch"><site site="nail"/><site site="hook"/><site site="toe"/></spatial></tendon>
<actuator><general name="jet" site="jet" gear="1 0 2 0.3 0.1 -1" gainprm="2" biastype="affine" biasprm="0.5 0 0"/>
  <position name="muscle" tendon="muscle" kp="50" kv="2" gear="0.5"/><motor name="rope" tendon="rope" gear="2"/>
  <motor name="winch" tendon="winch" gear="-3"/>
  <motor name="hip" joint="hip" gear="0.5 0 1"/><motor name="hip_in_hull" jointinparent="hip" gear="0.5 0 1"/>
  <general name="brake" joint="hull" gear="1 0 0 0 0 1" biastype="affine" biasprm="0.1 0 -0.4"/></actuator></mujoco>"""


LIFTED = """<mujoco><worldbody>
<body name="lamp" gravcomp="1">
  <site name="wall" pos="0.2 0 0.4"/><inertial pos="0 0 1" mass="1" diaginertia="1 1 1"/></body>
<body name="rod" gravcomp="0.7"><joint name="a" axis="0 1 0"/><inertial pos="0 0 1" mass="2" diaginertia="1 1 1"/>
  <body name="pod" pos="0.2 0.3 0.1" euler="0 30 40" gravcomp="-1">
    <site name="knee" pos="0.3 0.2 0"/><inertial pos="0.1 0 0.2" mass="3" diaginertia="1 1 1"/>
    <body name="leg" gravcomp="1.5"><joint name="b" axis="1 0 0"/>
      <site name="toe" pos="0 0.6 0.1"/><inertial pos="0 0.5 0.4" mass="1" diaginertia="1 1 1"/>
    </body></body></body></worldbody></mujoco>"""


def test_compensated_weights_move_as_in_mujoco(robot: Robot) -> None:
    """Of bodies that move and one fixed in them, more than the whole weight and less than none; the lamp stands."""
    mechanism, model = robot(LIFTED), mujoco.MjModel.from_xml_string(LIFTED)
    assert mechanism.not_taken == ()
    assert [load.name for load in mechanism.loads] == ["lift_of_rod", "lift_of_pod", "lift_of_leg"]
    state = mujoco.MjData(model)
    state.qpos[:] = 0.4, -0.7
    mujoco.mj_forward(model, state)
    found = accelerations(mechanism, a=0.4, b=-0.7)
    assert [found["a"], found["b"]] == pytest.approx(state.qacc.tolist(), rel=1e-12)


def test_tendons_have_an_armature(robot: Robot) -> None:
    """Of two joints, between two sites, and over three, at a state that moves: its inertia turns with the sites.

    The springs of three more are too long, too short, and slack.
    """
    tendons = """<tendon><fixed name="two" armature="3"><joint joint="a" coef="1"/><joint joint="b" coef="-2"/></fixed>
        <spatial name="short" armature="2"><site site="wall"/><site site="toe"/></spatial>
        <spatial name="long" armature="4" stiffness="5">
        <site site="wall"/><site site="knee"/><site site="toe"/></spatial>
        <spatial name="rope" stiffness="7" springlength="0 0.3"><site site="wall"/><site site="knee"/></spatial>
        <fixed name="strut" stiffness="9" springlength="-0.2 0.6"><joint joint="b" coef="1"/></fixed>
        <spatial name="slack" stiffness="1e4" springlength="0 9"><site site="wall"/><site site="toe"/></spatial>
        </tendon></mujoco>"""
    text = LIFTED.replace("</mujoco>", tendons)
    mechanism, model = robot(text), mujoco.MjModel.from_xml_string(text)
    assert mechanism.not_taken == ()
    state = mujoco.MjData(model)
    state.qpos[:], state.qvel[:] = (0.4, -0.7), (1.1, 2.3)
    mujoco.mj_forward(model, state)
    found = accelerations(mechanism, a=0.4, b=-0.7, a_dot=1.1, b_dot=2.3)
    assert [found["a"], found["b"]] == pytest.approx(state.qacc.tolist(), rel=1e-12)


def test_the_armature_of_a_tendon_joins_branches(robot: Robot) -> None:
    """Two slides of 1 and 2 kg with I (x_dot - 1.5 y_dot)^2 / 2, pushed by gravity along both.

    MuJoCo leaves out the entry of its mass matrix that joins them, because they stand on different branches.
    """
    masses = "".join(
        f'<body pos="{m} 0 0"><joint name="{q}" type="slide" axis="0 0 1"/><geom size="0.1" mass="{m}"/></body>'
        for q, m in (("x", 1), ("y", 2))
    )
    ends = '<joint joint="x" coef="1"/><joint joint="y" coef="-1.5"/>'
    tendon = f'<tendon><fixed name="t" armature="0.8">{ends}</fixed></tendon></mujoco>'
    found = accelerations(robot(world(masses).replace("</mujoco>", tendon)))
    mass = np.diag([1.0, 2.0]) + 0.8 * np.outer([1, -1.5], [1, -1.5])
    exact = np.linalg.solve(mass, [-9.81, -2 * 9.81])
    assert [found["x"], found["y"]] == pytest.approx(exact.tolist(), rel=1e-12)


def test_a_rope_over_many_oblique_bodies_stays_short_as_text(robot: Robot) -> None:
    """From the world to the last of six: written out, each body made the length five times as long; it took minutes."""
    link = '<body name="b{k}" pos="0.3 0.1 0.2" euler="20 30 10"><joint name="q{k}" axis="{axis}"/><geom size="0.1"/>'
    axes = ("0 0 1", "0 1 0", "1 0 0", "1 1 0", "0 1 1", "1 0 1")
    arm = "".join(link.format(k=k, axis=axis) for k, axis in enumerate(axes))
    rope = """<tendon><spatial name="rope" stiffness="50" springlength="0 0.7" damping="2" armature="3">
        <site site="nail"/><site site="tip"/></spatial></tendon>
        <actuator><motor name="winch" tendon="rope" gear="2"/></actuator>"""
    text = world(f'<site name="nail" pos="0.1 0 0"/>{arm}<site name="tip" pos="0 0 0.1"/>{"</body>" * len(axes)}')
    text = text.replace("</mujoco>", f"{rope}</mujoco>")
    mechanism, model = robot(text), mujoco.MjModel.from_xml_string(text)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    assert len(write(mechanism)) < 100_000
    state = mujoco.MjData(model)
    state.qpos[:], state.qvel[:] = (0.4, -0.7, 0.2, 0.5, -0.3, 0.8), (1.1, 0.3, -0.6, 0.2, 0.9, -1.3)
    state.ctrl[:] = 1.5
    mujoco.mj_forward(model, state)
    names = [f"q{k}" for k in range(len(axes))]
    given = dict(zip(names, state.qpos, strict=True)) | {f"{n}_dot": v for n, v in zip(names, state.qvel, strict=True)}
    found = accelerations(mechanism, **given, u_winch=1.5)
    assert [found[name] for name in names] == pytest.approx(state.qacc.tolist(), rel=1e-11)


@pytest.mark.fmu
def test_tendons_rub_and_have_limits(robot: Robot) -> None:
    """5.5 N push 2 kg against 2 times 1.5 N of one tendon and 0.5 N of another: x = t^2/2 until 2 x = 0.3.

    The rope is 0.5 m long at the start and may be 0.7 m.
    """
    slide = (
        '<site name="a" pos="-0.5 0 0"/><body name="rod"><joint name="x" type="slide" axis="1 0 0"/><site name="b"/>'
    )
    text = body("").replace('<body name="rod">', slide).replace(
        "</mujoco>",
        """<default><tendon limited="true"/></default><tendon>
        <fixed name="two" frictionloss="1.5" range="-1 0.3"><joint joint="x" coef="2"/></fixed>
        <spatial name="rope" range="0.1 0.7" frictionloss="0.5"><site site="a"/><site site="b"/></spatial>
        </tendon><actuator><motor name="push" joint="x"/></actuator></mujoco>""",
    )  # fmt: skip
    assert robot(text).not_taken == (
        "limits of the tendon two (stops take them)",
        "limits of the tendon rope (stops take them)",
    )
    only = robot(text.replace(' frictionloss="1.5"', "").replace(' frictionloss="0.5"', ""))
    assert not [p.name for p in only.parameters if p.name.startswith("gear_two")]  # nothing uses it
    stopped = robot(text, stops=True)
    assert stopped.not_taken == ()
    run = simulate(stopped, stop_time=1.0, step=0.1, values={"u_push": 5.5}, outputs=["x"])
    assert run["x"][5] == pytest.approx(0.125, rel=1e-9)
    assert run["x"][-1] == pytest.approx(0.15, rel=1e-9)


def test_sensors_give_way_to_the_wrench_of_what_floats(robot: Robot) -> None:
    """The force at a site has three outputs that would be called as inputs of the body."""
    text = body('<freejoint/><body><joint/><site name="s"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>')
    mechanism = robot(text.replace("</mujoco>", '<sensor><force name="rod_force" site="s"/></sensor></mujoco>'))
    assert "rod_force_x" in [u.name for u in mechanism.inputs]
    assert [output.name for output in mechanism.outputs] == ["rod_force_2"]


@pytest.mark.parametrize(
    ("joint", "after", "told"),
    [('actuatorgravcomp="true"', "", ()),
     ('actuatorgravcomp="true" actuatorfrcrange="-1 1"', "", (PART,)),
     ('actuatorgravcomp="true"', '<sensor><jointactuatorfrc joint="j"/></sensor>', (PART,))],
)  # fmt: skip
def test_compensation_that_counts_to_actuators_is_told_where_it_matters(
    robot: Robot, joint: str, after: str, told: tuple[str, ...]
) -> None:
    """Where the joint limits the force of its actuators, and where a sensor shows it."""
    text = body(f'<joint name="j" axis="0 1 0" {joint}/>', after).replace("<body ", '<body gravcomp="1" ')
    assert robot(text).not_taken == told


def turning(quaternion: Any, rates: Any) -> Any:
    """Twice the vector part of the conjugate of a quaternion times ``rates``: of its derivative or the next one."""
    return 2 * (quaternion[0] * rates[1:] - rates[0] * quaternion[1:] - np.cross(quaternion[1:], rates[1:]))


@pytest.mark.parametrize("side", [1, -1])
def test_what_turns_freely_moves_as_in_mujoco(robot: Robot, side: int) -> None:
    """Dampers, springs, armature and actuators of free and ball joints, at sites and between them; 1e-12.

    Of the two quaternions of one orientation a spring is wound by the same angle, less than half a turn.
    """
    mechanism, model = robot(FREE), mujoco.MjModel.from_xml_string(FREE)
    assert mechanism.not_taken == ()
    state, rng = mujoco.MjData(model), np.random.default_rng(3)
    state.qpos[:], state.qvel[:], state.ctrl[:] = rng.normal(size=11), rng.normal(size=9), rng.normal(size=7)
    quaternions = {"hull": state.qpos[3:7], "hip": state.qpos[7:]}
    for q in quaternions.values():
        q[:] *= side / np.linalg.norm(q)
    mujoco.mj_forward(model, state)
    values = {
        f"u_{name}": u
        for name, u in zip(("jet", "muscle", "rope", "winch", "hip", "hip_in_hull"), state.ctrl, strict=False)
    }
    values["u_brake"] = state.ctrl[6]
    for k, axis in enumerate("xyz"):
        values |= {f"hull_{axis}": state.qpos[k], f"hull_{axis}_dot": state.qvel[k]}
    for (name, q), at in zip(quaternions.items(), (3, 6), strict=True):
        w = state.qvel[at : at + 3]
        rates = np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))]) / 2
        values |= {f"{name}_e{k}{dot}": x[k] for k in range(4) for dot, x in (("", q), ("_dot", rates))}
    found = accelerations(mechanism, **values)
    turns = [turning(q, np.array([found[f"{name}_e{k}"] for k in range(4)])) for name, q in quaternions.items()]
    calculated = [*(found[f"hull_{axis}"] for axis in "xyz"), *np.concatenate(turns)]
    assert calculated == pytest.approx(state.qacc.tolist(), rel=1e-12, abs=1e-12 * max(abs(state.qacc)))


def test_a_spring_of_a_ball_at_rest_is_smooth(robot: Robot) -> None:
    """At its rest no direction is special: the frequency is sqrt(k / J) about every axis, by exact derivatives."""
    text = body('<joint name="hip" type="ball" stiffness="4" pos="0 0 -0.5"/>').replace("<mujoco>", FLOATING)
    found = linearize(robot(text))
    frequencies = sorted({round(abs(p.imag), 9) for p in np.linalg.eigvals(found.state_space().A)})
    assert frequencies == pytest.approx([np.sqrt(4 / 0.2), np.sqrt(4 / 0.001)], rel=1e-6)


FLOATING = '<mujoco><option gravity="0 0 0"/>'


def test_what_a_flag_disables_is_left_out(robot: Robot) -> None:
    """Without gravity, springs and dampers a pendulum feels its motor alone, and none of a disabled group."""
    flags = (
        '<mujoco><option actuatorgroupdisable="2"><flag gravity="disable" spring="disable" damper="disable"/></option>'
    )
    motors = '<actuator><motor name="on" joint="phi"/><motor name="off" joint="phi" group="2"/></actuator>'
    text = body('<joint name="phi" axis="0 -1 0" stiffness="3" damping="1"/>', motors).replace("<mujoco>", flags)
    mechanism = robot(text)
    assert mechanism.not_taken == ("the actuator off: it is off, late, or has several controls",)
    found = accelerations(mechanism, phi=0.4, phi_dot=2.0, u_on=1.5)
    assert found == {"phi": pytest.approx(1.5 / (0.2 + 2 * 0.25), rel=1e-12)}


def test_a_tendon_may_join_angles_and_lengths(robot: Robot) -> None:
    """Its coefficients have units, also those that are 1: m z'' = -m g - k (z + phi)."""
    joints = '<joint joint="z" coef="1"/><joint joint="phi" coef="1"/>'
    cable = f'<tendon><fixed name="c" stiffness="6">{joints}</fixed></tendon>'
    found = accelerations(robot(body(SLIDES, cable)), z=0.2, phi=np.pi)
    assert found["z"] == pytest.approx(-9.81 - 6 * (0.2 + np.pi) / 2, rel=1e-9)


def test_text_keeps_the_robot(robot: Robot) -> None:
    for text in (FREE, ARM):
        mechanism = robot(text)
        assert read(write(mechanism), "text") == mechanism
    assert {u.minimum for u in mechanism.inputs} == {None}  # what saturates is no error


def body(inside: str, after: str = "") -> str:
    """A rod of 2 kg, its centre at 0 0 -0.5, with ``inside`` and what stands ``after`` the world."""
    inertial = '<inertial pos="0 0 -0.5" mass="2" diaginertia="0.2 0.2 0.001"/>'
    return f'<mujoco><worldbody><body name="rod">{inside}{inertial}</body></worldbody>{after}</mujoco>'


MEDIUM = "the medium (density, viscosity, wind)"
SLIDES = '<joint name="x" type="slide" axis="1 0 0"/><joint name="z" type="slide"/><joint name="phi" axis="0 -1 0"/>'


def test_a_connect_is_a_spherical_joint(robot: Robot) -> None:
    """A rod that slides and turns, its top connected to the world: phi'' = -m g l sin(phi) / (J + m l^2)."""
    connect = '<equality><connect name="pin" body1="rod" anchor="0 0 0"/></equality>'
    found = accelerations(robot(body(SLIDES, connect)), phi=0.4)
    assert found["phi"] == pytest.approx(-2 * 9.81 * 0.5 * np.sin(0.4) / (0.2 + 2 * 0.25), rel=1e-12)


def test_a_weld_is_a_fixed_joint(robot: Robot) -> None:
    """A rod welded to one that slides on a spring: both fall as one."""
    second = (
        '<body name="other" pos="1 0 0"><joint name="y" type="slide" axis="0 1 0"/><joint name="w" type="slide"/>'
        '<inertial pos="0 0 0" mass="3" diaginertia="1 1 1"/></body>'
    )
    text = body('<joint name="z" type="slide" stiffness="40"/>').replace("</worldbody>", f"{second}</worldbody>")
    weld = '<equality><weld name="glue" body1="rod" body2="other"/></equality></mujoco>'
    found = accelerations(robot(text.replace("</mujoco>", weld)), z=0.1, w=0.1)
    assert found["z"] == pytest.approx(-9.81 - 40 * 0.1 / 5, rel=1e-12)
    assert (found["w"], found["y"]) == (pytest.approx(found["z"], rel=1e-12), pytest.approx(0.0, abs=1e-12))


def test_numbers_in_the_pose_of_a_weld_are_lengths(robot: Robot) -> None:
    """x = 0.25 follows from the pose; a number beside a coordinate has no unit elsewhere."""
    weld = '<equality><weld name="glue" body1="rod" relpose="0.25 0 0 1 0 0 0"/></equality>'
    found = robot(body('<joint name="x" type="slide" axis="1 0 0"/><joint name="phi"/>', weld))
    assert found.warnings == ()
    with pytest.raises(DerivationError, match=r"the start cannot meet the constraints.* by x = "):
        derive(found)


def test_a_joint_equality_is_a_coupling(robot: Robot) -> None:
    """z = 2 x: forces along both are shared, (m + 4 m) x'' = -2 m g."""
    equality = '<equality><joint joint1="z" joint2="x" polycoef="0 2 0 0 0"/></equality>'
    text = body('<joint name="x" type="slide" axis="1 0 0"/><joint name="z" type="slide"/>', equality)
    assert accelerations(robot(text))["x"] == pytest.approx(-2 * 9.81 / 5, rel=1e-12)


def test_a_coupling_is_met_from_the_start(robot: Robot) -> None:
    """MuJoCo's start leaves couplings open, which are soft there: phi = 0.05 + 2 (x - 0.1)^2 and z = 3 phi."""
    equality = '<equality><joint joint1="z" joint2="phi" polycoef="0 3 0 0 0"/>'
    equality += '<joint joint1="phi" joint2="x" polycoef="0.05 0 2 0 0"/></equality>'
    found = robot(body(SLIDES.replace('axis="1 0 0"', 'axis="1 0 0" ref="0.1"'), equality))
    assert {q.name: q.start for q in found.coordinates} == pytest.approx({"x": 0.1, "z": 0.15, "phi": 0.05})
    assert derive(found).mechanism.coordinates == found.coordinates


DRIVEN = """<mujoco><compiler angle="radian"/><option><flag contact="disable"/></option><worldbody>
<body><joint name="p" axis="0 -1 0" damping="0.3" actuatorfrcrange="-4 5"/>
  <inertial pos="0 0 -0.5" mass="2" diaginertia="0.2 0.2 0.001"/>
  <body pos="0 0 -1"><joint name="q" axis="0 -1 0"/><inertial pos="0 0 -0.3" mass="1" diaginertia="0.1 0.1 0.01"/>
    <body pos="0 0 -0.5"><joint name="s" type="slide" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.01"/></body></body></body></worldbody>
<tendon><fixed name="cable"><joint joint="q" coef="0.5"/><joint joint="s" coef="-1.5"/></fixed></tendon><actuator>
<motor name="motor" joint="p" ctrlrange="-1 2" gear="3"/>
<position name="servo" joint="q" kp="7" kv="0.4" ctrlrange="-1 1" forcerange="-2 3"/>
<position name="unlimited" joint="p" kp="2" ctrlrange="-1 1" ctrllimited="false"/>
<velocity name="speed" joint="s" kv="5" forcerange="-1 1"/>
<damper name="damper" joint="s" kv="2" ctrlrange="0 3"/>
<cylinder name="cylinder" tendon="cable" timeconst="0.4" area="3" bias="1 2 3" ctrlrange="-1 1"/>
<intvelocity name="winding" joint="p" kp="3" actrange="-1 1" ctrlrange="-2 2"/>
<general name="integral" joint="q" dyntype="integrator" gainprm="2" forcerange="-1 1"/>
<general name="filter" joint="s" dyntype="filter" dynprm="0.2" gainprm="2" actrange="-0.5 0.6" actlimited="true"/>
<general name="exact" tendon="cable" dyntype="filterexact" dynprm="0.1" gaintype="affine" gainprm="1 2 -3" gear="2"/>
</actuator></mujoco>"""
STATES = ("cylinder", "winding", "integral", "filter", "exact")


def controls(model: Any, values: Iterable[float]) -> dict[str, float]:
    """{input: value} for the ``values`` of all actuators of ``model``."""
    return {f"u_{model.actuator(i).name}": float(value) for i, value in enumerate(values)}


def test_actuators_saturate_and_follow_their_controls_as_in_mujoco(robot: Robot) -> None:
    """Accelerations and rates of activations at 100 random states, most controls and forces beyond their ranges."""
    mechanism, model = robot(DRIVEN), mujoco.MjModel.from_xml_string(DRIVEN)
    assert mechanism.warnings == ()
    found, state, rng = function(mechanism), mujoco.MjData(model), np.random.default_rng(1)
    for _ in range(100):
        state.qpos[:], state.qvel[:], state.ctrl[:] = rng.normal(size=3), rng.normal(size=3), 3 * rng.normal(size=10)
        state.act[:] = rng.uniform(-0.49, 0.49, size=5)
        mujoco.mj_forward(model, state)
        names = ["p", "q", "s", "p_dot", "q_dot", "s_dot", *(f"act_{name}" for name in STATES)]
        at = dict(zip(names, [*state.qpos, *state.qvel, *state.act], strict=True)) | controls(model, state.ctrl)
        x, u = (np.array([at.get(name, 0.0) for name in found.names[kind]]) for kind in "xu")
        rates = dict(zip(found.names["x"], found(x, u), strict=True))
        calculated = [rates[name] for name in names[3:]]
        assert calculated == pytest.approx([*state.qacc, *state.act_dot], rel=1e-10, abs=1e-10 * abs(state.qacc).max())


def test_one_rule_for_controls_beyond_their_range_in_every_run(robot: Robot) -> None:
    """A run of MuJoCo with steps of 50 us; an FMU, an ensemble, a sweep and a step give what it gives."""
    mechanism, model = robot(DRIVEN), mujoco.MjModel.from_xml_string(DRIVEN)
    state, names = mujoco.MjData(model), ["p", "q", "s", *(f"act_{name}" for name in STATES)]
    model.opt.timestep = 5e-5
    state.qpos[:], state.ctrl[:] = [0.3, 0.2, 0.1], [5.0, 3.0, 0.7, 1.0, 2.0, -3.0, 3.0, 0.5, 4.0, 1.0]
    starts, given = dict(zip("pqs", state.qpos.tolist(), strict=True)), controls(model, state.ctrl)
    for _ in range(round(0.8 / model.opt.timestep)):
        mujoco.mj_step(model, state)
    expected = pytest.approx([*state.qpos, *state.act], abs=2e-4)
    with start(mechanism, values={**starts, **given}, tolerance=1e-9) as sim:
        sim.step(0.8)
        assert sim[names].tolist() == expected
    run = simulate(mechanism, stop_time=0.8, values=starts, inputs=lambda t: given, outputs=names, tolerance=1e-9)
    assert run.values[-1].tolist() == expected
    final = Ensemble(mechanism).run(starts=starts, inputs=given, stop_time=0.8, tolerance=1e-9).final
    assert [float(final[name][0]) for name in names] == expected
    swept = sweep(mechanism, {"u_motor": [5.0, 9.0]}, values={**starts, **given}, stop_time=0.8, tolerance=1e-9)
    assert all([float(swept[name][i, -1]) for name in names] == expected for i in range(2))


def test_a_coupling_of_tendons_is_one_of_their_joints(robot: Robot) -> None:
    """z + 2 x = 0.3 and phi = x^2 by tendons, met from the start; one in space is told."""
    tendons = (
        '<tendon><fixed name="a"><joint joint="z" coef="1"/><joint joint="x" coef="2"/></fixed>'
        '<fixed name="b"><joint joint="phi" coef="1"/></fixed><fixed name="c"><joint joint="x" coef="1"/></fixed>'
        '<spatial name="far"><site site="s"/><site site="t"/></spatial></tendon>'
        '<equality><tendon tendon1="a" polycoef="0.3 0 0 0 0"/><tendon tendon1="b" tendon2="c" polycoef="0 0 1 0 0"/>'
        '<tendon name="rope" tendon1="far"/></equality>'
    )
    text = body(SLIDES + '<site name="t" pos="0 0 -1"/>', tendons).replace("<worldbody>", '<worldbody><site name="s"/>')
    found = robot(text)
    assert found.not_taken == ("the equality rope",)
    start_of = {q.name: q.start for q in found.coordinates}
    assert start_of["z"] + 2 * start_of["x"] == pytest.approx(0.3)
    assert start_of["phi"] == pytest.approx(start_of["x"] ** 2)
    acting = accelerations(found, x=0.1, z=0.1, phi=0.01, x_dot=1.0, z_dot=-2.0, phi_dot=0.2)
    assert acting["z"] == pytest.approx(-2 * acting["x"], rel=1e-12)
    assert acting["phi"] == pytest.approx(2 * 1.0**2 + 2 * 0.1 * acting["x"], rel=1e-12)


SENSED = """<mujoco><compiler angle="radian"/><option gravity="0.3 -0.2 -9.7"><flag contact="disable"/></option>
<worldbody><body name="hull" pos="0.1 0.2 0.5" quat="0.9 0.1 -0.2 0.3"><freejoint name="free"/>
<geom name="box" type="box" size="0.2 0.1 0.05" pos="0.01 0.02 0.03" euler="0.1 0.2 0.3"/>
<site name="imu" pos="0.1 -0.05 0.02" euler="0.4 -0.3 0.8"/>
<body name="arm" pos="0.2 0 0.1"><joint name="p" axis="0 -1 0.2" damping="0.3" ref="0.1"
actuatorfrcrange="-3 4"/><geom size="0.05 0.2" type="capsule" pos="0 0 -0.3"/>
<site name="mid" pos="0 0.1 -0.2" euler="1 0 0.3"/>
<body name="tip" pos="0 0 -0.5"><joint name="s" type="slide" axis="0 0.3 1"/><geom size="0.04" pos="0.02 0 0"/>
<site name="end" pos="0.02 0 0.03"/><body name="hand" pos="0 0 -0.1" euler="0.2 0 0.4"><geom size="0.03 0.02 0.05"
type="box" pos="0.01 0 -0.02"/><site name="wrist" pos="0 0.01 0" euler="0 0.5 0"/></body></body></body></body>
</worldbody>
<tendon><fixed name="cable"><joint joint="p" coef="0.5"/><joint joint="s" coef="-1.5"/></fixed></tendon>
<actuator><position name="a" joint="p" kp="7" kv="0.4" ctrlrange="-1 1" forcerange="-2 3" gear="2"/></actuator>
<sensor><jointpos name="angle" joint="p"/><jointvel name="speed" joint="s"/><tendonpos name="cable" tendon="cable"/>
<tendonvel name="cable_rate" tendon="cable"/><actuatorpos name="a_at" actuator="a"/>
<actuatorvel name="a_rate" actuator="a"/><actuatorfrc name="a_force" actuator="a"/>
<jointactuatorfrc name="p_force" joint="p"/><jointactuatorfrc name="s_force" joint="s"/><gyro name="gyro" site="imu"/>
<velocimeter name="velocimeter" site="mid"/><accelerometer name="mid_accelerometer" site="mid"/>
<accelerometer name="end_accelerometer" site="end"/><framepos name="end_at" objtype="site" objname="end"/>
<framepos name="hull_center" objtype="body" objname="hull"/><framequat name="mid_turn" objtype="site" objname="mid"/>
<framexaxis name="mid_x" objtype="site" objname="mid"/><frameyaxis name="tip_y" objtype="body" objname="tip"/>
<framezaxis name="box_z" objtype="geom" objname="box"/><framequat name="box_turn" objtype="geom" objname="box"/>
<framelinvel name="tip_v" objtype="xbody" objname="tip"/>
<frameangvel name="imu_w" objtype="site" objname="imu"/><framelinacc name="imu_a" objtype="site" objname="imu"/>
<frameangacc name="arm_alpha" objtype="body" objname="arm"/><subtreecom name="whole" body="hull"/>
<subtreecom name="hand_at" body="hand"/><subtreelinvel name="arm_v" body="arm"/><subtreeangmom name="arm_h" body="arm"/>
<subtreeangmom name="hand_h" body="hand"/><force name="arm_force" site="mid"/><torque name="arm_torque" site="mid"/>
<force name="wrist_force" site="wrist"/><torque name="wrist_torque" site="wrist"/></sensor></mujoco>"""


def free_state(state: Any) -> dict[str, float]:
    """The values of the coordinates of SENSED and their velocities."""
    q, w, axes = state.qpos[3:7], state.qvel[3:6], "xyz"
    rates = np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))]) / 2
    values = {f"free_{x}": state.qpos[i] for i, x in enumerate(axes)} | {f"free_e{i}": q[i] for i in range(4)}
    values |= {f"free_{x}_dot": state.qvel[i] for i, x in enumerate(axes)}
    values |= {f"free_e{i}_dot": rates[i] for i in range(4)} | {"p": state.qpos[7], "s": state.qpos[8]}
    return {name: float(x) for name, x in (values | {"p_dot": state.qvel[6], "s_dot": state.qvel[7]}).items()}


@pytest.mark.fmu
def test_sensors_are_outputs_and_tell_what_mujocos_tell(robot: Robot, tmp_path: Path) -> None:
    """All of 33 kinds and places at 20 random states, controls beyond their range; e and -e are one orientation."""
    mechanism, model = robot(SENSED), mujoco.MjModel.from_xml_string(SENSED)
    assert mechanism.not_taken == ()
    fmu = export(mechanism, tmp_path / "sensed.fmu", page="static", without=["equations"])
    measured = {output.name: output for output in mechanism.outputs}
    assert len(measured) == model.nsensor == 33
    state, rng = mujoco.MjData(model), np.random.default_rng(2)
    for _ in range(20):
        state.qpos[:], state.qvel[:], state.ctrl[:] = rng.normal(size=9), rng.normal(size=8), 3 * rng.normal(size=1)
        state.qpos[3:7] /= np.linalg.norm(state.qpos[3:7])
        mujoco.mj_forward(model, state)
        with start(fmu, values=free_state(state) | {"u_a": float(state.ctrl[0])}) as sim:
            for k in range(model.nsensor):
                sensor, found = model.sensor(k), sim[measured[model.sensor(k).name].names]
                expected = state.sensordata[sensor.adr[0] : sensor.adr[0] + sensor.dim[0]]
                same = -1 if "turn" in sensor.name and found @ expected < 0 else 1
                assert same * found == pytest.approx(expected, rel=1e-10, abs=1e-10), sensor.name


def test_an_accelerometer_at_rest_shows_gravity(robot: Robot) -> None:
    """In its own axes: its x axis points up here."""
    site = '<joint name="z" type="slide" stiffness="0"/><site name="s" euler="0 -90 0"/>'
    text = body(site, '<sensor><accelerometer name="a" site="s"/></sensor>')
    lift = text.replace("</mujoco>", '<actuator><motor name="m" joint="z"/></actuator></mujoco>')
    with start(robot(lift), values={"u_m": 2 * 9.81}) as sim:
        assert sim[["a_x", "a_y", "a_z"]] == pytest.approx([9.81, 0.0, 0.0], abs=1e-12)
    with start(robot(lift)) as falling:
        assert falling[["a_x", "a_y", "a_z"]] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


STANDING = """<mujoco><option><flag contact="disable"/></option><worldbody><body name="base" pos="0.3 0 1">
<inertial pos="0.1 0 0" mass="2" diaginertia=".1 .1 .1"/><site name="s" pos="0 .1 0" euler="10 20 30"/>
<body name="post" pos="0 0 .2"><geom size=".1"/></body>
<body name="arm"><joint name="j" axis="0 1 0.2"/><inertial pos="0.2 0 0" mass="1.5" diaginertia=".1 .2 .3"/>
  <body pos=".4 0 0"><joint name="k" axis="1 0 0"/><geom size=".1" pos="0 .2 0"/></body></body></body></worldbody>
<sensor><subtreecom name="c" body="base"/><subtreelinvel name="v" body="base"/><subtreeangmom name="L" body="base"/>
<subtreecom name="all" body="world"/><subtreecom name="top" body="post"/>
<force name="F" site="s"/><torque name="T" site="s"/></sensor></mujoco>"""


def test_sensors_of_what_stands_count_its_mass(robot: Robot) -> None:
    """A robot on a base that does not move: centre of mass, momentum, and what the ground exerts on the base."""
    model = mujoco.MjModel.from_xml_string(STANDING)
    state = mujoco.MjData(model)
    state.qpos[:], state.qvel[:] = (0.4, -0.7), (1.3, 2.1)
    mujoco.mj_forward(model, state)
    mechanism = robot(STANDING)
    with start(mechanism, values={"j": 0.4, "k": -0.7, "j_dot": 1.3, "k_dot": 2.1}) as sim:
        found = np.concatenate([sim[output.names] for output in mechanism.outputs])
    assert found == pytest.approx(state.sensordata, rel=1e-10, abs=1e-10)


@pytest.mark.parametrize(("ends", "held"), [(("out", "in"), True), (("in", "far"), False)])
def test_sensors_of_what_spatial_tendons_hold_are_told(robot: Robot, ends: tuple[str, str], held: bool) -> None:
    """MuJoCo 4 does not count their pull, which the bodies' accelerations contain; one within the bodies is none."""
    tendon = "".join(f'<site site="{end}"/>' for end in ends)
    found = robot(
        world(
            '<site name="out" pos="0 0 2"/><body><joint name="a"/><geom size=".1"/><site name="in" pos="1 0 0"/>'
            '<body><joint name="b" axis="0 1 0"/><geom size=".1" pos="1 0 0"/>'
            '<site name="far" pos="1 1 0"/></body></body>'
        ).replace(
            "</mujoco>",
            f'<tendon><spatial name="t" stiffness="3">{tendon}</spatial></tendon>'
            '<sensor><force name="F" site="in"/></sensor></mujoco>',
        )
    )
    told = "the sensor F: spatial tendons hold its bodies, too"
    assert ((told in found.not_taken), ("F" in [x.name for x in found.outputs])) == (held, not held)


def test_sensors_that_nothing_is_made_of_are_told_last(robot: Robot) -> None:
    sensors = (
        '<sensor><touch name="touch" site="s"/><subtreecom name="com" body="still"/>'
        '<framepos name="relative" objtype="site" objname="s" reftype="body" refname="rod"/>'
        '<jointpos name="cut" joint="z" cutoff="0.5"/><ballquat name="ball" joint="b"/></sensor>'
    )
    text = body('<joint name="b" type="ball"/><site name="s" size="1"/>', sensors)
    still = '<body name="still"/>'
    others = f'<body><joint name="z"/><geom size="1"/></body>{still}</worldbody>'
    text = text.replace("</worldbody>", others)
    told = (
        "the sensor relative: framepos there has no output",
        "the sensor ball: ballquat has no output",
        "the sensor com: its bodies have no mass",
    )
    still = "the touch told by touch: it is 0, as no contact of their bodies is taken"
    assert robot(text).not_taken == ("the cutoff of the sensor cut", still, *told)


def test_what_floats_has_a_wrench_and_no_force_along_its_quaternion(robot: Robot) -> None:
    """A force of 3 N on a hull of 2 kg by its frame's origin, where its mass centre is."""
    hull = '<body name="hull"><freejoint name="free"/><inertial pos="0 0 0" mass="2" diaginertia="0.2 0.3 0.4"/></body>'
    found = robot(world(hull).replace("<mujoco>", FLOATING))
    with start(found) as sim:
        pushes = [f"hull_{kind}_{axis}" for kind in ("force", "torque") for axis in "xyz"]
        assert sim.inputs == tuple(pushes)
        sim.step(1.0, {"hull_force_x": 3.0})
        assert sim[["free_x", "free_y", "free_e0"]] == pytest.approx([0.75, 0.0, 1.0], abs=1e-9)


@pytest.mark.parametrize("short", [0.0, 1e-15, 1e-12, 1e-9, 3e-8, 1e-6, 1e-3])
def test_a_pitch_of_nearly_a_quarter_turn_is_exact_to_rounding(short: float) -> None:
    """Files round to some digits; by the arcsine of the sine a pitch that is short of it by 1e-8 would be lost."""
    for yaw, roll in ((0.3, -1.2), (2.9, 0.4), (-1.0, 0.0)):
        turns = (("z", yaw), ("y", np.pi / 2 - short), ("x", roll))
        matrix = about(*turns[0]) @ about("y", np.pi / 2) @ about("y", -short) @ about(*turns[2])
        assert JointPose.of(np.zeros(3), matrix).matrix == pytest.approx(matrix, abs=3e-14)


def test_what_is_not_taken_is_listed(robot: Robot) -> None:
    geoms = '<joint type="ball" range="0 40" limited="true"/><geom size="1"/><geom size="2"/>'
    slow = '<actuator><general name="slow" joint="hinge" dyntype="user" actdim="1"/>'
    slow += '<general name="still" joint="hinge" dyntype="filter" dynprm="0"/><position name="far" site="s"/>'
    slow += '<general name="early" joint="hinge" dyntype="integrator" actearly="true"/></actuator>'
    slow += (
        '<tendon><spatial name="long" damping="1"><site site="s"/><site site="t"/><site site="s"/></spatial></tendon>'
    )
    geoms += '<site name="s"/><site name="t" pos="0 0 1"/>'
    text = body(geoms, slow).replace('type="ball"', 'type="ball" name="ball"')
    text = text.replace("</body>", '<body><joint name="hinge"/><geom size="1"/></body></body>')
    state = "its state is neither a filter nor an integrator of its control"
    assert robot(text).not_taken == (
        f"the actuator slow: {state}",
        f"the actuator still: {state}",
        "the actuator far: along what it acts on, no force depends on control, length and rate as its own does",
        f"the actuator early: {state}",
        "limits of the joint ball",
        "contacts of 3 geoms (ground takes them)",
        "the tendon long: its ends do not move to each other",
    )


@pytest.mark.parametrize(("stiffness", "springs"), [("3", ("joint phi", "tendon t")), ("0", ())])
def test_springs_that_yield_are_told(robot: Robot, stiffness: str, springs: tuple[str, ...]) -> None:
    """MuJoCo's springs have had a threshold of yield since version 4; one without stiffness does not matter."""
    if not hasattr(mujoco.MjModel, "jnt_springyield"):
        pytest.skip("this MuJoCo has no such springs")
    spring = f'stiffness="{stiffness}" springyield="0.2"'
    cable = f'<tendon><fixed name="t" {spring}><joint joint="phi" coef="1"/></fixed></tendon>'
    found = robot(body(f'<joint name="phi" {spring}/>', cable))
    assert found.not_taken == tuple(f"yield of the spring of the {what}" for what in springs)


def test_what_is_not_taken_is_a_warning_each_in_python_too(robot: Robot, caplog: pytest.LogCaptureFixture) -> None:
    """One for each part, as it stands in the text; a text of before, in which all is one string, is read."""
    air = '<mujoco><option density="1.2"/>'
    found = robot(body('<joint/><geom size="1"/><geom size="2"/>').replace("<mujoco>", air))
    told = ("contacts of 2 geoms (ground takes them)", MEDIUM)
    assert [record.getMessage() for record in caplog.records] == [
        f"warning: not taken from the imported file: {what}" for what in told
    ]
    text = write(found)
    assert f'not_taken = [\n    "contacts of 2 geoms (ground takes them)",\n    "{MEDIUM}",\n]\n' in text
    assert read(text.replace('    "contacts of 2 geoms (ground takes them)",\n', ""), "text").not_taken == told[1:]
    before = text.replace(
        text[text.index("not_taken") : text.index("]\n", text.index("not_taken")) + 2], 'not_taken = "a, b"\n'
    )
    assert read(before, "text").not_taken == ("a, b",)


def test_a_tendon_called_as_a_joint_has_its_own_stiffness(robot: Robot) -> None:
    """J phi'' = -m g l sin phi - (k_joint + k_tendon) phi, each k the one of the file."""
    cable = '<tendon><fixed name="knee" stiffness="11" damping="0.6"><joint joint="knee" coef="1"/></fixed></tendon>'
    text = body('<joint name="knee" axis="0 -1 0" stiffness="3" damping="0.2"/>', cable)
    found = accelerations(robot(text), knee=0.4, knee_dot=0.5)["knee"]
    exact = (-2 * 9.81 * 0.5 * np.sin(0.4) - (3 + 11) * 0.4 - (0.2 + 0.6) * 0.5) / (0.2 + 2 * 0.25)
    assert found == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize(
    ("flag", "told"),
    [("", ["contacts of 2 geoms (ground takes them)", "contacts of 1 pairs of geoms (ground takes them)",
           MEDIUM]),
     ('<option><flag contact="disable"/></option>', [MEDIUM])],
)  # fmt: skip
def test_what_would_act_is_told_where_nothing_disables_it(robot: Robot, flag: str, told: list[str]) -> None:
    """Contacts of geoms and of pairs, and the medium, as the file is loaded by itself."""
    text = world(
        '<geom name="floor" type="plane" size="1 1 1"/><body><joint/><geom name="ball" size="1"/></body>'
    ).replace("</mujoco>", '<contact><pair geom1="floor" geom2="ball"/></contact></mujoco>')
    found = robot(text.replace("<mujoco>", f'<mujoco><option density="1.2"/>{flag}'))
    assert found.warnings == tuple(f"not taken from the imported file: {what}" for what in told)


def test_what_pushes_the_world_moves_nothing_and_is_told(robot: Robot) -> None:
    """A motor on a site of the world, and what pulls two sites of one body together, beside a motor that drives."""
    motors = (
        '<tendon><spatial name="inside" stiffness="3"><site site="s"/><site site="t"/></spatial></tendon>'
        '<actuator><motor name="idle" site="nail"/><motor name="pull" tendon="inside"/><motor name="on" joint="phi"/>'
        "</actuator>"
    )
    text = body('<joint name="phi" axis="0 -1 0"/><site name="s"/><site name="t" pos="0 0 1"/>', motors)
    found = robot(text.replace("<worldbody>", '<worldbody><site name="nail"/>'))
    assert [u.name for u in found.inputs] == ["u_on"]
    assert found.warnings == (
        "not taken from the imported file: the actuator idle: it acts on the world, which does not move",
        "not taken from the imported file: the actuator pull: its ends do not move to each other",
        "not taken from the imported file: the tendon inside: its ends do not move to each other",
    )
    assert accelerations(found, u_on=1.4)["phi"] == pytest.approx(1.4 / (0.2 + 2 * 0.25), rel=1e-12)


def test_what_has_no_name_gives_way(robot: Robot) -> None:
    """Joint 1 is called joint_1 if it has no name, unless another one is."""
    found = robot(body('<joint name="joint_1" type="slide"/><joint axis="0 -1 0"/>'))
    assert [q.name for q in found.coordinates] == ["joint_1", "joint_1_"]


REPEATED = '<body><joint/><geom size="1"/></body>'


@pytest.mark.parametrize(
    "inside",
    [
        f'<replicate count="100000" offset="0 0 1">{REPEATED}</replicate>',
        f'<replicate count="200"><frame><replicate count="200">{REPEATED}</replicate></frame></replicate>',
        '<composite type="cable" count="100000 1 1"/>',
        '<flexcomp name="f" count="100 100 100"/>',
        '<include file="many.xml"/>',
    ],
)
def test_copies_without_end_are_refused_at_once(robot: Robot, tmp_path: Path, inside: str) -> None:
    many = f'<mujoco><replicate count="100000">{REPEATED}</replicate><include file="robot.xml"/></mujoco>'
    (tmp_path / "many.xml").write_text(many)
    with pytest.raises(LoadError, match="more than 10000 copies of elements; lower their count"):
        robot(world(inside))


def test_few_copies_are_taken(robot: Robot) -> None:
    copied = '<replicate count="5" offset="0 0 1"><body><joint axis="0 -1 0"/><geom size="1"/></body></replicate>'
    assert len(robot(world(copied)).coordinates) == 5


NAN = '<mujoco><option gravity="0 0 nan"/><worldbody><body><joint/><geom size="1"/></body></worldbody></mujoco>'
HEAVY = '<body><joint/><inertial pos="0 0 0" mass="{}" diaginertia="{}"/></body>'
REFUSED = "MuJoCo refuses it: .*"


def world(inside: str) -> str:
    return f"<mujoco><worldbody>{inside}</worldbody></mujoco>"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no well-formed XML: no element found"),
        ("<mujoco/><mujoco/>", "no well-formed XML: junk after document element"),
        (NAN, "a number in gravity is not finite"),
        (body('<joint damping="nan"/>'), "a number in dof_damping is not finite"),
        (body('<joint damping="1e400"/>'), REFUSED + "damping"),
        (body('<joint axiss="0 0 1"/>'), REFUSED + "axiss"),
        (body('<joint type="screw"/>'), REFUSED + "screw"),
        (body('<joint axis="0 0 0"/>'), REFUSED + "axis"),
        (body('<joint axis="0 1"/>'), REFUSED + "axis"),
        (body('<joint axis="x"/>'), REFUSED + "axis"),
        (body('<joint class="big"/>'), REFUSED + "big"),
        (body('<joint range="1 -1" limited="true"/>'), REFUSED + "range"),
        (body('<joint name="a"/><joint name="a" type="slide"/>'), REFUSED + "repeated name 'a'"),
        (body("<joint/>", '<actuator><motor joint="knee"/></actuator>'), REFUSED + "knee"),
        (body("<joint/>", '<equality><connect body1="arm" anchor="0 0 0"/></equality>'), REFUSED + "arm"),
        (body("<joint/>", '<asset><mesh name="m" file="none.stl"/></asset>'), REFUSED + "none.stl"),
        (body("<joint/>", '<extension><plugin plugin="none"/></extension>'), REFUSED + "none"),
        (world("<bdy/>"), REFUSED + "bdy"),
        (world('<body quat="0 0 0 0"><joint/><geom size="1"/></body>'), REFUSED + "quaternion"),
        (world(HEAVY.format("-1", "1 1 1")), REFUSED + "mass"),
        (world(HEAVY.format("1", "1 1 3")), REFUSED + "inertia"),
        (world('<body><geom size="1"/></body>'), "nothing moves in this robot"),
        ("<mujoco", "no well-formed XML"),
        ("<robot/>", r"its top element is <robot>; a MJCF file has <mujoco>"),
        ("<mujoco><worldbody><body><joint/></body></worldbody></mujoco>", "MuJoCo refuses it: .*mass and inertia"),
        ('<mujoco><include file="none.xml"/></mujoco>', "MuJoCo refuses it: .*none.xml"),
        ("<mujoco/>", "nothing moves in this robot"),
        ('<!DOCTYPE x [<!ENTITY y "z">]><mujoco/>', "document type"),
    ],
)
def test_what_is_wrong_is_named(robot: Robot, text: str, message: str) -> None:
    with pytest.raises(LoadError, match=message) as caught:
        robot(text)
    assert "\n" not in str(caught.value)


def test_the_base_is_said_in_the_file(robot: Robot) -> None:
    with pytest.raises(LoadError, match="says itself what moves freely; leave base = floating out"):
        robot(ARM, base="floating")


def test_without_mujoco_the_remedy_is_named(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    own = builtins.__import__

    def refusing(name: str, *rest: Any, **options: Any) -> Any:
        if name == "mujoco":
            raise ImportError(name)
        return own(name, *rest, **options)

    monkeypatch.setattr(builtins, "__import__", refusing)
    with pytest.raises(LoadError, match=r"needs the package mujoco; pip install 'lag2fmu\[mujoco\]'"):
        robot(ARM)


def test_a_file_may_be_a_part(robot: Robot, tmp_path: Path) -> None:
    """Two pendulums of one file, each as it is alone: phi'' = -m g l sin(phi) / (J + m l^2)."""
    rod = '<joint name="phi" axis="0 -1 0"/>'
    alone = accelerations(robot(body(rod)), phi=0.4)["phi"]
    parts = "".join(f'[parts.{name}]\nfile = "robot.xml"\n' for name in ("left", "right"))
    (tmp_path / "pair.toml").write_text(f'[mechanism]\nname = "pair"\n[gravity]\nacceleration = 9.81\n{parts}')
    found = accelerations(load(tmp_path / "pair.toml"), left_phi=0.4, right_phi=-0.4)
    assert found == {"left_phi": pytest.approx(alone, rel=1e-12), "right_phi": pytest.approx(-alone, rel=1e-12)}


def test_limits_that_cannot_be_taken_are_told(robot: Robot) -> None:
    """Those of a spring between two sites, and of the sum of forces along a joint if some act between sites."""
    motors = (
        '<tendon><spatial name="rope"><site site="s"/><site site="t"/></spatial></tendon><actuator>'
        '<position name="winch" tendon="rope" forcerange="-1 1"/><motor name="on" joint="phi"/></actuator>'
    )
    text = body('<joint name="phi" axis="0 -1 0" actuatorfrcrange="-1 1"/><site name="t" pos="0 0 1"/>', motors)
    found = robot(text.replace("<worldbody>", '<worldbody><site name="s" pos="1 0 0"/>'))
    assert found.not_taken == ("limits of the actuators' force on the joint phi, as some act between sites",)
