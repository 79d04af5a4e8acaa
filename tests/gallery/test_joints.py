"""Joints against closed forms and against the same mechanisms in other coordinates; what they bear, in N and N.m."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from sympy import cos, sin

import lag2fmu
from lag2fmu.fmu import Fmu
from lag2fmu.formats.loading import load
from lag2fmu.language.expressions import TIME, symbol
from lag2fmu.mechanism import Body, Frame, Gravity, Joint, Mechanism, Output, Point, coordinate, parameter
from lag2fmu.reference import Trajectory, integrate

pytestmark = pytest.mark.fmu

G = 9.81
BALL = (0.01, 0.01, 0.01, 0, 0, 0)


def about(axis: int, angle: float) -> tuple[float, ...]:
    """The quaternion of a turn about the axis x, y or z."""
    return (np.cos(angle / 2), *(np.sin(angle / 2) * (k == axis) for k in range(3)))


def free(name: str, place: Any = (0, 0, 0), turn: Any = (1, 0, 0, 0), rate: Any = (0,) * 7) -> tuple[list[Any], Frame]:
    """Seven coordinates, all of them guesses, and the frame that they move."""
    labels, guesses = [*"xyz", "e0", "e1", "e2", "e3"], [*place, *turn]
    q = [
        coordinate(f"{name}_{k}", "m" if k in "xyz" else "1", guess=float(guess), guess_velocity=float(v))
        for k, guess, v in zip(labels, guesses, rate, strict=True)
    ]
    return q, Frame(name, origin=q[:3], quaternion=q[3:])


def run(mechanism: Mechanism | Fmu, stop: float, steps: int = 20) -> Trajectory:
    return lag2fmu.simulate(mechanism, stop_time=stop, step=stop / steps, tolerance=1e-10)


# --------------------------------------------------------------------------------------------- loops and reactions


@pytest.mark.parametrize("axes", ["world", "frame"])
def test_a_free_body_on_a_revolute_joint_is_a_pendulum(axes: str) -> None:
    """Tension m g cos + m l w^2; across the rod m g sin (1 - m l^2/J), since the body turns with m g l sin/J."""
    m, l, I, start, tilt = 2.0, 0.7, 0.05, 0.9, 0.3  # noqa: E741
    q, bob = free("bob", (-l * np.sin(start), 0, -l * np.cos(start)), about(1, start))
    first, axis = ("world", "y") if axes == "world" else ("wall", (0, np.cos(tilt), -np.sin(tilt)))
    pendulum = Mechanism(
        "hinged",
        coordinates=q,
        frames=[bob, Frame("wall", rotations=[("x", tilt)])],
        bodies=[Body("weight", m, frame=bob, inertia=(I, I, I, 0, 0, 0))],
        points=[Point("pivot", (0, 0, l), bob)],
        gravity=G,
        joints=[Joint("hinge", "revolute", (first, "pivot"), axis=axis, second_axis="y", reactions=True, axes=axes)],
    )
    found, J = run(pendulum, 2.0), m * l**2 + I
    rates = lambda t, z: [z[1], -m * G * l / J * np.sin(z[0])]  # noqa: E731
    angle, rate = solve_ivp(rates, (0, 2), [start, 0], "DOP853", found.time, rtol=1e-12, atol=1e-12).y
    assert found["bob_x"] == pytest.approx(-l * np.sin(angle), abs=1e-8)
    tension, across = m * G * np.cos(angle) + m * l * rate**2, m * G * np.sin(angle) * (1 - m * l**2 / J)
    x, z = tension * np.sin(angle) - across * np.cos(angle), tension * np.cos(angle) + across * np.sin(angle)
    along = {"x": x, "y": 0 * x, "z": z} if axes == "world" else {"x": x, "y": np.sin(tilt) * z, "z": np.cos(tilt) * z}
    for k, force in along.items():
        assert found[f"hinge_force_{k}"] == pytest.approx(force, abs=1e-6)
    assert np.abs(found.columns([f"hinge_torque_{k}" for k in "xyz"])).max() < 1e-7


def test_a_fixed_joint_bears_the_weight_and_its_moment() -> None:
    """A body clamped at the end of an arm that turns with w: m l w^2 towards the axis, m g up, m g l back about y."""
    m, l, w = 2.0, 0.5, 3.0  # noqa: E741
    q, body = free("body", (l, 0, 0), rate=(0, l * w, 0, 0, 0, 0, w / 2))
    turn = Joint("turn", "revolute", parent="world", axis="z", coordinates=[coordinate("angle", start=0.0, velocity=w)])
    clamped = Mechanism(
        "clamped",
        coordinates=q,
        frames=[body],
        bodies=[Body("weight", m, frame=body, inertia=BALL), Body("wheel", 1, frame="turn", inertia=BALL)],
        points=[Point("end", (-l, 0, 0), body)],
        gravity=G,
        joints=[turn, Joint("clamp", "fixed", ("turn", "end"), reactions=True, axes="frame")],
    )
    found = run(clamped, 1.0)
    wanted = {"force_x": -m * l * w**2, "force_y": 0, "force_z": m * G, "torque_x": 0, "torque_y": 0, "torque_z": 0}
    # about the joint: the weight at l turns with +m g l about y, and the clamp holds against it
    wanted["torque_y"] = -m * G * l
    for name, value in wanted.items():
        assert found[f"clamp_{name}"] == pytest.approx(np.full(21, value), abs=1e-6), name
    assert found["angle"] == pytest.approx(w * found.time, abs=1e-9)


def linkage(**tables: Any) -> Mechanism:
    own = load("four_bar_linkage")
    return Mechanism("joined", **{"coordinates": own.coordinates, "parameters": own.parameters, **tables})


def in_space(frames: list[Frame], joints: list[Joint], **tables: Any) -> Mechanism:
    """The linkage on frames, in the plane x-y: the crank and the rocker from their pivots, the coupler from A on."""
    l1, l2, l3, d, rho = (symbol(name) for name in ("l1", "l2", "l3", "d", "rho"))
    bodies = [
        Body(f"{frame.name}_rod", rho * x, frame=frame, center=(x / 2, 0, 0), inertia=(*[rho * x**3 / 12] * 3, 0, 0, 0))
        for frame, x in zip(frames, (l1, 2 * l2, l3), strict=True)
    ]
    places = zip(("A1", "A2", "B2", "B3"), (l1, 0, l2, l3), (0, 1, 1, 2), strict=True)
    points = [Point(name, (x, 0, 0), frames[k]) for name, x, k in places] + [Point("C", (-d, 0, 0))]
    gravity = Gravity(G, (0, -1, 0))
    return linkage(frames=frames, bodies=bodies, points=points, gravity=gravity, joints=joints, **tables)


def test_four_bars_in_the_plane_and_in_space_are_the_bundled_linkage(exported) -> None:
    """Closed by a joint of two bodies' points, and by one of frames that turn about z; the rocker bears the same."""
    own = load("four_bar_linkage")
    (a, b, c), (l1, l2, l3, d) = (symbol(q.name) for q in own.coordinates), map(symbol, ("l1", "l2", "l3", "d"))
    A = (l1 * cos(a), l1 * sin(a))
    places = [Point("B2", (A[0] + l2 * cos(b), A[1] + l2 * sin(b))), Point("B3", (-d + l3 * cos(c), l3 * sin(c)))]
    closing = Joint("B", "revolute", ("B3", "B2"), reactions=True)
    planar = linkage(bodies=own.bodies, points=places, gravity=G, joints=[closing])
    frames = [
        Frame("crank", rotations=[("z", a)]),
        Frame("coupler", "crank", (l1, 0, 0), [("z", b - a)]),
        Frame("rocker", origin=(-d, 0, 0), rotations=[("z", c)]),
    ]
    bears = [Output(f"force_{k}", symbol(f"multiplier_B_{k}")) for k in "xy"]
    spatial = in_space(frames, [Joint("B", "revolute", ("B3", "B2"), axis="z")], outputs=bears)
    assert [constraint.name for constraint in spatial.constraints] == ["B_x", "B_y"]
    wanted, flat, framed = (run(m, 0.6) for m in (exported("four_bar_linkage"), planar, spatial))
    for found in (flat, framed):
        assert found.columns(["a", "b", "c"]) == pytest.approx(wanted.columns(["a", "b", "c"]), abs=1e-8)
    assert flat.columns(["B_force_x", "B_force_y"]) == pytest.approx(framed.columns(["force_x", "force_y"]), abs=1e-6)


@pytest.mark.slow
def test_four_bars_of_free_bodies_have_more_equations_than_needed(exported) -> None:
    """Three bodies of 7 coordinates and four hinges of 5 equations, of which 17 beside the norms are independent."""
    wanted = run(exported("four_bar_linkage"), 0.3, 6)
    values = {p.name: p.value for p in load("four_bar_linkage").parameters}
    l1, d = values["l1"], values["d"]
    start = {name: float(wanted[name][0]) for name in ("a", "b", "c", "a_dot", "b_dot", "c_dot")}
    a, rate = start["a"], start["a_dot"]
    places = [(0, 0, 0), (l1 * np.cos(a), l1 * np.sin(a), 0), (-d, 0, 0)]
    coordinates, frames = [], []
    for name, place, angle in zip(("crank", "coupler", "rocker"), places, "abc", strict=True):
        pace, turn = start[f"{angle}_dot"], about(2, start[angle])
        speed = (-l1 * np.sin(a) * rate, l1 * np.cos(a) * rate, 0) if name == "coupler" else (0, 0, 0)
        q, frame = free(name, place, turn, (*speed, -pace / 2 * turn[3], 0, 0, pace / 2 * turn[0]))
        coordinates += q
        frames.append(frame)
    ends = {"O": ("world", "crank"), "A": ("A1", "A2"), "B": ("B3", "B2"), "C": ("C", "rocker")}
    hinges = [Joint(name, "revolute", between, axis="z") for name, between in ends.items()]
    mechanism = in_space(frames, hinges, coordinates=coordinates)
    assert len(mechanism.constraints) == 3 + 20
    found = run(mechanism, 0.3, 6)
    for name, angle in (("crank", "a"), ("coupler", "b"), ("rocker", "c")):
        half = np.unwrap(np.arctan2(found[f"{name}_e3"], found[f"{name}_e0"]))
        assert 2 * half == pytest.approx(wanted[angle], abs=1e-7)


# ----------------------------------------------------------------------------------------------- relative coordinates


def test_a_double_pendulum_of_relative_joints(exported) -> None:
    """As the bundled one, whose second angle is counted from the vertical too."""
    own = load("double_pendulum")
    values = {p.name: p.value for p in own.parameters}
    starts = [q.start for q in own.coordinates]
    first = coordinate("q1", "rad", start=starts[0])
    upper = Joint("upper", "revolute", parent="world", axis=(0, -3, 0), coordinates=[first])
    lower = Joint("lower", "revolute", parent="upper", origin=(0, 0, -values["l1"]), axis=(0, -1, 0))
    chain = Mechanism(
        "chain",
        coordinates=[coordinate("lower_angle", "rad", start=starts[1] - starts[0])],
        bodies=[
            Body("bob1", values["m1"], frame=upper.frame, center=(0, 0, -values["l1"])),
            Body("bob2", values["m2"], frame=lower.frame, center=(0, 0, -values["l2"])),
        ],
        gravity=values["g"],
        joints=[upper, lower],
    )
    wanted, found = run(exported("double_pendulum"), 2.0), run(chain, 2.0)
    one, two = (q.name for q in own.coordinates)
    assert found["q1"] == pytest.approx(wanted[one], abs=1e-7)
    assert found["q1"] + found["lower_angle"] == pytest.approx(wanted[two], abs=1e-7)


RELATIVE: dict[str, dict[str, Any]] = {
    "revolute": {"axis": (1, 2, 2)},
    "prismatic": {"axis": (1, 2, 2)},
    "cylindrical": {"axis": (1, 2, 2)},
    "planar": {"axis": (1, 2, 2)},
    "screw": {"axis": (1, 2, 2), "pitch": 0.4},
    "spherical": {},
    "universal": {"axis": "x", "second_axis": "y"},
}


@pytest.mark.parametrize("kind", RELATIVE)
def test_both_forms_of_a_joint_move_alike(kind: str) -> None:
    """A body on a joint of a swinging arm: on a parent, integrated directly, and as the FMU of a free body."""
    keys, origin, center = RELATIVE[kind], (0.0, 0.3, -0.5), (0.1, 0.0, -0.2)
    arm = Joint("arm", "revolute", parent="world", axis="x", coordinates=[coordinate("swing", start=0.5, velocity=0.5)])
    tensor = (0.02, 0.03, 0.04, 0, 0, 0)
    swinging = Body("beam", 1, frame="arm", center=(0, 0, -0.3), inertia=tensor)
    hanging = Body("load", 0.7, frame="body", center=center, inertia=tensor)
    outputs = [
        Output("at", point="load", quantity="position"),
        Output("R", frame="body", quantity="rotation"),
    ]

    def build(joint: Joint, **tables: Any) -> Mechanism:
        bodies = [swinging, hanging]
        return Mechanism("two_forms", bodies=bodies, gravity=G, joints=[arm, joint], outputs=outputs, **tables)

    short = build(Joint("body", kind, parent="arm", origin=origin, **keys), coordinates=[])
    place = (0.0, 0.3 * np.cos(0.5) + 0.5 * np.sin(0.5), 0.3 * np.sin(0.5) - 0.5 * np.cos(0.5))
    turning = (0.25 * x for x in (-np.sin(0.25), np.cos(0.25), 0, 0))
    q, frame = free("body", place, about(0, 0.5), (0, -0.5 * place[2], 0.5 * place[1], *turning))
    ends = ("seat", "body")
    long = build(Joint("j", kind, ends, **keys), coordinates=q, frames=[frame], points=[Point("seat", origin, "arm")])
    assert len(long.coordinates) - len(long.constraints) == len(short.coordinates) - len(short.constraints)
    names = [*(f"at_{k}" for k in "xyz"), *(f"R_{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3))]
    found = run(long, 0.5, 5)
    wanted = integrate(short, found.time).trajectory
    assert np.ptp(wanted.columns(names), axis=0).max() > 0.1
    assert found.columns(names) == pytest.approx(wanted.columns(names), abs=1e-7)


# -------------------------------------------------------------------------------------------- universal, screw, gear


def test_a_universal_joint_turns_unevenly() -> None:
    """w2/w1 = cos b/(1 - sin^2 b cos^2 a), a from where the first fork lies across the plane of the shafts."""
    b = 0.5
    drive = Joint("drive", "revolute", parent="world", axis="z", coordinates=[coordinate("a", start=0.0, velocity=3.0)])
    other = Joint("other", "revolute", parent="tilted", axis="z", coordinates=[coordinate("d", guess=0.0)])
    cardan = Mechanism(
        "cardan",
        coordinates=[],
        frames=[Frame("tilted", rotations=[("x", b)])],
        bodies=[Body("one", 1, frame="drive", inertia=BALL), Body("two", 1, frame="other", inertia=BALL)],
        joints=[drive, other, Joint("cross", "universal", ("drive", "other"), axis="y", second_axis="x")],
    )
    found = run(cardan, 3.0)
    ratio = np.cos(b) / (1 - np.sin(b) ** 2 * np.cos(found["a"]) ** 2)
    assert np.ptp(ratio) > 0.2
    assert found["d_dot"] == pytest.approx(ratio * found["a_dot"], rel=1e-9)


@pytest.mark.parametrize("pitch", [0.05, -0.08])
def test_a_nut_falls_along_its_screw(pitch: float) -> None:
    """m z'' = F - m g, C turn'' = T, z = pitch turn/(2 pi), and the thread does no work: many turns in a second."""
    m, C, k = 2.0, 1e-4, 2 * np.pi / pitch
    q, nut = free("nut")
    body = Body("weight", m, frame=nut, inertia=(C, C, C, 0, 0, 0))
    thread = Joint("thread", "screw", ("world", "nut"), axis="z", pitch=pitch, reactions=True)
    found = run(Mechanism("nut", coordinates=q, frames=[nut], bodies=[body], gravity=G, joints=[thread]), 1.0)
    fall = -m * G / (m + C * k**2)
    assert abs(fall / pitch) > 5
    assert found["nut_z"] == pytest.approx(fall * found.time**2 / 2, abs=1e-8)
    assert found["thread_force_z"] == pytest.approx(np.full(21, m * (G + fall)), rel=1e-7)
    assert found["thread_torque_z"] == pytest.approx(np.full(21, C * k * fall), rel=1e-7)


def test_a_gear_adds_inertia_by_the_square_of_its_ratio() -> None:
    """I1 + r^2 I2 turns with the torque; the wheels press with r I2 acceleration on the first, in its coordinate."""
    I1, I2, ratio, torque = 0.3, 0.02, -0.25, 1.5
    shafts = [Joint(name, "revolute", parent="world", axis="z") for name in ("one", "two")]
    pair = Mechanism(
        "gears",
        coordinates=[],
        bodies=[
            Body("wheel1", 1, frame="one", inertia=(I1, I1, I1, 0, 0, 0)),
            Body("wheel2", 1, frame="two", inertia=(I2, I2, I2, 0, 0, 0)),
        ],
        joints=[*shafts, Joint("pair", "gear", ("one", shafts[1]), ratio=ratio)],
        forces={symbol("one_angle"): torque},
        outputs=[Output("on_one", symbol("multiplier_pair"))],
    )
    found = run(pair, 1.0)
    acceleration = torque / (I1 + I2 / ratio**2)
    assert found["one_angle"] == pytest.approx(acceleration * found.time**2 / 2, abs=1e-8)
    assert found["two_angle"] == pytest.approx(found["one_angle"] / ratio, abs=1e-9)
    assert found["on_one"] == pytest.approx(np.full(21, I1 * acceleration - torque), abs=1e-8)


# ------------------------------------------------------------------------------------------------------------ rolling


def test_a_sphere_rolls_down_a_slope() -> None:
    """5/7 g sin down the slope of 3 : 4; the slope bears m g cos and rubs with 2/7 m g sin."""
    m, R = 0.5, parameter("R", 0.1, "m")
    q, ball = free("ball", (0.06, 0, 0.08))
    I = 2 * m * 0.01 / 5  # noqa: E741
    body = Body("sphere", m, frame=ball, inertia=(I, I, I, 0, 0, 0))
    rolling = Joint("slope", "rolling_sphere", ("world", "ball"), axis=(3, 0, 4), radius=R, reactions=True)
    slope = Mechanism("slope", coordinates=q, parameters=[R], frames=[ball], bodies=[body], gravity=G, joints=[rolling])
    found = run(slope, 1.0)
    way = 5 / 7 * G * 0.6 * found.time**2 / 2
    assert found["ball_x"] == pytest.approx(0.06 + 0.8 * way, abs=1e-8)
    assert found["ball_z"] == pytest.approx(0.08 - 0.6 * way, abs=1e-8)
    normal, rubbing = m * G * 0.8, 2 / 7 * m * G * 0.6
    assert found["slope_force_x"] == pytest.approx(np.full(21, 0.6 * normal - 0.8 * rubbing), abs=1e-7)
    assert found["slope_force_z"] == pytest.approx(np.full(21, 0.8 * normal + 0.6 * rubbing), abs=1e-7)


def test_a_sphere_on_a_frame_that_turns_is_on_the_turntable(exported) -> None:
    """A circle with 2/7 of the table's rate; the table stands 0.2 m high and turns by a law of time."""
    m, R, rate = 0.2, 0.03, 5.0
    x = [coordinate("x", "m", start=0.2, velocity=0.0), coordinate("y", "m", start=0.0, velocity=0.1)]
    z = coordinate("z", "m", guess=0.2 + R)
    e = [coordinate(f"e{i}", "1", guess=float(i == 0)) for i in range(4)]
    ball, table = Frame("ball", origin=(*x, z), quaternion=e), Frame("table", rotations=[("z", rate * TIME)])
    I = 2 * m * R**2 / 5  # noqa: E741
    turntable = Mechanism(
        "turning",
        coordinates=[*x, z, *e],
        frames=[ball, table],
        bodies=[Body("sphere", m, frame=ball, inertia=(I, I, I, 0, 0, 0))],
        points=[Point("top", (0.1, 0.2, 0.2), table)],
        gravity=G,
        joints=[Joint("contact", "rolling_sphere", ("top", "ball"), axis="z", radius=R)],
    )
    stop = 2 * np.pi / (2 / 7 * rate)
    wanted = run(exported("sphere_on_turntable"), stop)
    assert run(turntable, stop).columns(["x", "y"]) == pytest.approx(wanted.columns(["x", "y"]), abs=1e-8)


def test_a_rolling_disc_is_the_bundled_one(exported) -> None:
    """With the centre and its height as coordinates instead of the contact; the plane bears what moves the centre."""
    own = load("rolling_disc")
    wanted = run(exported("rolling_disc"), 2.0)
    phi, theta, psi = (q for q in own.coordinates if q.name in ("phi", "theta", "psi"))
    start = [float(wanted[f"centre_{k}"][0]) for k in "xyz"]
    c = [coordinate(f"c{k}", "m", guess=x) for k, x in zip("xyz", start, strict=True)]
    turns = [("z", symbol("phi")), ("x", symbol("theta")), ("y", symbol("psi"))]
    disc = Frame("disc", origin=c, rotations=turns)
    contact = Joint(
        "contact", "rolling_disc", ("world", "disc"), axis="z", second_axis="y", radius=symbol("R"), reactions=True
    )
    free_disc = Mechanism(
        "free_disc",
        coordinates=[*c, phi, theta, psi],
        parameters=own.parameters,
        frames=[disc],
        bodies=[Body("coin", symbol("m"), frame=disc, inertia=own.bodies[0].inertia)],
        gravity=own.gravity,
        joints=[contact],
    )
    fmu = exported(free_disc)
    found = run(fmu, 2.0)
    assert found.columns(["cx", "cy", "cz"]) == pytest.approx(wanted.columns([f"centre_{k}" for k in "xyz"]), abs=1e-8)
    assert found.columns(["phi", "theta", "psi"]) == pytest.approx(wanted.columns(["phi", "theta", "psi"]), abs=1e-7)
    fine, m = run(fmu, 0.002, 2), 0.1
    for k, weight in (("x", 0), ("y", 0), ("z", m * G)):
        acceleration = (fine[f"c{k}_dot"][2] - fine[f"c{k}_dot"][0]) / 0.002
        assert fine[f"contact_force_{k}"][1] == pytest.approx(weight + m * acceleration, abs=1e-5)
