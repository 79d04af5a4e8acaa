"""Frames, spatial bodies, their loads and outputs in the record and in the text format."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import Any

import pytest
from spatial_mechanisms import everything_spatial
from sympy import Rational, cos, pi, sin, sqrt

from lag2fmu.errors import MechanismError, UnitError
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.language.expressions import TIME, symbol
from lag2fmu.language.unit_parser import parse_unit
from lag2fmu.mechanism import (
    Body,
    Damper,
    Frame,
    Gravity,
    Load,
    Mechanism,
    Output,
    Point,
    Spring,
    coordinate,
    parameter,
    signal,
)
from lag2fmu.mechanism.geometry import principal_moments

q1, q2, l, y = coordinate("q1", "rad"), coordinate("q2", "rad"), parameter("l", 0.5, "m"), signal("y", motion=True)  # noqa: E741
I, m, g = parameter("I", 0.2, "kg.m2"), parameter("m", 2.0, "kg"), parameter("g", 9.81, "m/s2")  # noqa: E741
base = Frame("base", rotations=[("z", q1)])
arm = Frame("arm", base, (0, 0, l), [((0, l, 0), q2)])
rotor = Body("rotor", m, frame=arm, center=(0, 0, l), inertia=(I, I, I / 2, 0, 0, 0))
tip = Point("tip", (0, 0, l), arm)


def robot(**changes: Any) -> Mechanism:
    """A rotor on two joints with some tables replaced."""
    tables: dict[str, Any] = {
        "coordinates": [q1, q2],
        "parameters": [l, I, m, g],
        "inputs": [y],
        "frames": [arm, base],
        "bodies": [rotor],
        "points": [tip],
        "gravity": g,
    }
    return Mechanism("robot", **{**tables, **changes})


# ---------------------------------------------------------------------------------------------------------- the record


def test_frames_are_data_in_normal_form() -> None:
    mechanism = robot()
    assert mechanism.frame("arm") == mechanism.frames[0]
    assert (mechanism.frame("arm").parent, mechanism.frame("base").parent) == ("base", "world")
    (turn,) = mechanism.frame("arm").rotations
    assert turn == ((0, symbol("l"), 0), symbol("q2"))
    assert (turn.axis, turn.angle) == ((0, symbol("l"), 0), symbol("q2"))
    assert Frame("f", origin=(0.1, 0, 0)).origin == (Rational(1, 10), 0, 0)
    assert (mechanism.bodies[0].position, mechanism.bodies[0].frame) == (None, "arm")
    assert mechanism.dimension == 3
    assert mechanism.warnings == ()


def test_places_say_where_they_are() -> None:
    mechanism = robot(points=[tip, Point("hook", (1, 2, 3)), Point("nail", (1, 2, 4), "world")])
    assert mechanism.location("tip") == ("arm", (0, 0, symbol("l")))
    assert mechanism.location("rotor") == ("arm", (0, 0, symbol("l")))
    assert mechanism.location("hook") == ("world", (1, 2, 3))
    assert mechanism.place("nail") == (1, 2, 4)
    with pytest.raises(MechanismError, match="'tip' is on frame 'arm'"):
        mechanism.place("tip")
    with pytest.raises(MechanismError, match="there is no frame 'amr' in mechanism 'robot'; did you mean 'arm'"):
        mechanism.frame("amr")


def test_expressions_of_frames_have_places() -> None:
    places = dict(robot().expressions())
    assert places["frames.arm.rotations[0].axis[1]"] == symbol("l")
    assert places["frames.base.rotations[0].angle"] == symbol("q1")
    assert places["frames.arm.origin[2]"] == symbol("l")
    assert places["bodies.rotor.inertia[2]"] == symbol("I") / 2


def test_spatial_loads_bring_three_inputs() -> None:
    loads = [Load("push", tip, input=True, axes="frame"), Load("twist", body=rotor, input=True)]
    mechanism = robot(loads=loads)
    assert [u.name for u in mechanism.inputs[1:]] == [f"{n}_{x}" for n in ("push", "twist") for x in "xyz"]
    assert [str(u.unit.name) for u in mechanism.inputs[1:]] == ["N"] * 3 + ["N.m"] * 3
    assert mechanism.inputs[1].doc == "force 'push' at tip, along x of its frame"
    assert mechanism.loads[0].axes == "frame"
    assert mechanism.loads[1].torque == tuple(symbol(f"twist_{x}") for x in "xyz")


@pytest.mark.parametrize(
    ("output", "suffixes", "unit"),
    [
        (Output("o", frame=arm, quantity="angular_velocity", axes="frame"), "xyz", "rad/s"),
        (Output("o", frame=arm, quantity="angles"), "xyz", "rad"),
        (Output("o", frame=arm, quantity="angles", unit="deg"), "xyz", "deg"),
        (Output("o", frame=arm, quantity="quaternion"), "0123", "1"),
        (Output("o", frame=arm, quantity="y_axis"), ["x", "y", "z"], "1"),
        (Output("o", frame=arm, quantity="rotation"), ["11", "12", "13", "21", "22", "23", "31", "32", "33"], "1"),
        (Output("o", point=tip, quantity="position", unit="mm"), "xyz", "mm"),
        (Output("o", point="rotor", quantity="velocity"), "xyz", "m/s"),
        (Output("o", bodies=["rotor"], quantity="angular_momentum"), "xyz", "N.m.s/rad"),
        (Output("o", bodies=[rotor], frame=arm, quantity="holding_torque", axes="frame"), "xyz", "N.m/rad"),
    ],
)
def test_quantities_expand_into_names(output: Output, suffixes: str, unit: str) -> None:
    mechanism = robot(outputs=[output, Output("p", q1)], strict_units=False)
    assert mechanism.outputs[0].names == tuple(f"o_{x}" for x in suffixes)
    assert list(mechanism.output_names) == [*mechanism.outputs[0].names, "p"]
    assert mechanism.output_names[output.names[-1]].unit.exponents == parse_unit(unit).exponents
    assert read(write(mechanism), "robot") == mechanism


def test_a_planar_point_has_two_entries() -> None:
    bob = Body("bob", 1, (sin(q1), -cos(q1)))
    outputs = [Output("o", point="bob", quantity="velocity")]
    mechanism = Mechanism("p", coordinates=[q1], bodies=[bob], outputs=outputs)
    assert mechanism.outputs[0].names == ("o_x", "o_y")
    assert read(write(mechanism), "p") == mechanism


# -------------------------------------------------------------------------------------------------------- round trip


def test_everything_on_frames_reads_back_the_same() -> None:
    mechanism = everything_spatial()
    text = write(mechanism)
    assert read(text, "x") == mechanism
    assert write(read(text, "x")) == text
    assert 'rotations = [[[1, -2, 2], "q0"], ["x", 0.3]]' in text
    assert 'axes = "frame"' in text


def test_the_text_of_the_design_is_read() -> None:
    text = """
[mechanism]
name = "x"
[parameters]
h = { value = 1.0, unit = "m" }
[coordinates]
q1 = { unit = "rad" }
q2 = { unit = "rad" }
[frames.arm]
parent = "world"
origin = ["0", "0", "h"]
rotations = [["z", "q1"], ["y", "q2"]]
[points.A]
frame = "arm"
position = ["0", "0", "h"]
[bodies.rotor]
frame = "arm"
center = ["0", "0", "h/2"]
mass = "2"
inertia = ["1", "1", "1", "0", "0", "0"]
[loads.push]
point = "A"
force = ["1", "0", "0"]
axes = "frame"
[outputs]
A = { point = "A", quantity = "position", unit = "mm" }
w = { frame = "arm", quantity = "angular_velocity", axes = "frame" }
"""
    mechanism = read(text, "x")
    assert mechanism.frame("arm").rotations == (("z", symbol("q1")), ("y", symbol("q2")))
    assert mechanism.bodies[0].inertia == (1, 1, 1, 0, 0, 0)
    assert list(mechanism.output_names) == ["A_x", "A_y", "A_z", "w_x", "w_y", "w_z"]
    assert read(write(mechanism), "x") == mechanism


# --------------------------------------------------------------------------------------------------------- warnings


def test_a_tensor_that_no_body_has_is_a_warning() -> None:
    (warning,) = robot(bodies=[Body("rotor", m, frame=arm, inertia=(I, I, 3 * I, 0, 0, 0))]).warnings
    assert warning.startswith("bodies.rotor.inertia: [0.2, 0.2, 0.6")
    assert "violates the triangle inequality, its principal moments are 0.2, 0.2, 0.6 kg.m2" in warning
    assert robot(bodies=[Body("disc", m, frame=arm, inertia=(I, I, 2 * I, 0, 0, 0))]).warnings == ()
    assert robot(bodies=[Body("jib", 0, frame=arm, inertia=(0, 0, I, 0, 0, 0))]).warnings == ()  # turns about z only


def test_units_of_frames_are_checked() -> None:
    warnings = robot(frames=[Frame("base", origin=(q1, 0, 0), rotations=[("z", l * q1)]), arm]).warnings
    assert warnings[0] == "frames.base.origin[0]: 'q1' is in 1, expected m"
    assert warnings[1] == "frames.base.rotations[0].angle: 'l*q1' is in m, expected 1"
    with pytest.raises(UnitError, match=r"outputs\.o\.unit: the velocity is in m/s, not m"):
        robot(outputs=[Output("o", point=tip, quantity="velocity", unit="m")], strict_units=True)


def test_principal_moments_are_eigenvalues() -> None:
    assert principal_moments(2, 2, 3, 1, 0, 0) == pytest.approx([1, 3, 3], rel=1e-15)
    assert principal_moments(4, 5, 6, 0, 0, 0) == [4, 5, 6]
    xx, yy, zz, xy, xz, yz = 3.0, 2.5, 4.1, 0.3, -0.7, 0.2
    found = principal_moments(xx, yy, zz, xy, xz, yz)
    determinant = xx * (yy * zz - yz**2) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    assert sum(found) == pytest.approx(xx + yy + zz, rel=1e-15)
    assert found[0] * found[1] * found[2] == pytest.approx(determinant, rel=1e-14)


def test_quaternions_may_move_with_time_and_inputs() -> None:
    half = (TIME + y) / 2
    moving = Frame("base", quaternion=(cos(half), 0, 0, sin(half)))
    fixed = Frame("base", quaternion=(sqrt(Rational(1, 2)), 0, 0, -sqrt(Rational(1, 2))))
    for frame in (moving, fixed):
        mechanism = robot(frames=[frame, arm], bodies=[rotor, Body("b", 1, (q1, 0, 0))])
        assert read(write(mechanism), "x") == mechanism


# ------------------------------------------------------------------------------------------------------------- errors

REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"frames": [arm]}, "frames.arm.parent: there is no frame 'base'; the ground is called 'world'"),
    ({"frames": [arm, Frame("base", "arm")]}, "frames.arm.parent: is on itself: arm <- base <- arm; put one of them"),
    ({"frames": [arm, base, Frame("a", "b"), Frame("b", "b")]}, "frames.b.parent: is on itself: b <- b"),
    ({"frames": [arm, base, Frame("world")]}, "frames.world: 'world' is the fixed frame"),
    ({"frames": [arm, base, base]}, "frames: the name 'base' is used twice"),
    ({"frames": [arm, Frame("base", origin=(0, 0))]}, "frames.base.origin: has 2 entries; give 3"),
    ({"frames": [arm, Frame("base", quaternion=(1, 0, 0))]}, "frames.base.quaternion: has 3 entries; give 4"),
    (
        {"frames": [arm, Frame("base", rotations=[("z", q1)], quaternion=(1, 0, 0, 0))]},
        "frames.base: 'rotations' and 'quaternion' exclude each other",
    ),
    ({"frames": [arm, base, Frame("f", quaternion=(0.9, 0, 0, 0.1))]}, "frames.f.quaternion: has the norm 0.9055"),
    (
        {"frames": [arm, Frame("base", rotations=[((l - 0.5, 0, 0), q1)])]},
        "frames.base.rotations[0].axis:.*zero vector",
    ),
    ({"frames": [arm, Frame("base", rotations=[((q1, 0, 0), q1)])]}, "frames.base.rotations[0].axis[0]: 'q1' is a coo"),
    ({"frames": [arm, Frame("base", rotations=[("z", q1.dot)])]}, "frames.base.rotations[0].angle: 'q1_dot' is a velo"),
    ({"frames": [arm, Frame("base", origin=(symbol("u"), 0, 0))]}, "frames.base.origin[0]: undefined symbol 'u'"),
    ({"points": [Point("tip", (0, 0, l), "leg")]}, "points.tip.frame: there is no frame 'leg'"),
    ({"points": [Point("tip", (0, l), arm)]}, "points.tip.position: has 2 entries; on a frame it has 3"),
    ({"points": [Point("tip", (0, l))]}, "bodies and points: positions have 2 entries; beside frames they need 3"),
    ({"gravity": Gravity(9.81, (0, -1))}, "gravity.direction: has 2 entries, positions have 3"),
    ({"bodies": [Body("b", 1)]}, "bodies.b: 'position' is missing; give it, or the 'frame'"),
    ({"bodies": [Body("b", 1, frame="leg")]}, "bodies.b.frame: there is no frame 'leg'"),
    ({"bodies": [Body("b", 1, (0, 0, 0), frame=arm)]}, "bodies.b: 'position' and 'frame' exclude each other"),
    ({"bodies": [Body("b", 1, angle=q1, frame=arm)]}, "bodies.b: 'angle' and 'frame' exclude each other"),
    ({"bodies": [Body("b", 1, frame=arm, center=(0, 0))]}, "bodies.b.center: has 2 entries; give 3"),
    ({"bodies": [Body("b", 1, (q1, 0, 0), center=(0, 0, 1))]}, "bodies.b.center: goes with 'frame'"),
    ({"bodies": [Body("b", 1, frame=arm, inertia=3)]}, "bodies.b.inertia: a body of a frame has the 6 entries"),
    ({"bodies": [Body("b", 1, frame=arm, inertia=(1, 1, 1))]}, "bodies.b.inertia: a body of a frame has the 6 entries"),
    (
        {"bodies": [Body("b", 1, (q1, 0, 0), inertia=(1, 1, 1, 0, 0, 0))]},
        "bodies.b.inertia: an inertia tensor goes wit",
    ),
    ({"bodies": [Body("b", 1, frame=arm, inertia=(1, 1, q1, 0, 0, 0))]}, "bodies.b.inertia[2]: 'q1' is a coordinate"),
    (
        {"bodies": [Body("b", 1, frame=arm, inertia=(I, I, -I, 0, 0, 0))]},
        "bodies.b.inertia:.*principal moments are -0.2",
    ),
    ({"bodies": [Body("b", 1, frame=arm, inertia=(0, 0, 0, 0, 0, 0))]}, "bodies.b.inertia:.*kg.m2; leave it out"),
    ({"bodies": [Body("b", 1, frame=arm, inertia=(1, 1, -0.1, 0, 0, 0))]}, "bodies.b.inertia:.*not positive"),
    (
        {"bodies": [Body("b", 1, frame=arm, inertia=(1, 1, 1, 2, 0, 0))]},
        "bodies.b.inertia:.*moments are -1, 1, 3 kg.m2",
    ),
    ({"springs": [Spring("s", 1, between=("tip", "rotor"))]}, "springs.s.between: 'tip' and 'rotor' are at the same"),
    ({"dampers": [Damper("s", 1, between=("tip", "top"))]}, "dampers.s.between: there is no point or body 'top'"),
    ({"loads": [Load("f", tip, force=(1, 2))]}, "loads.f.force: has 2 entries, the position of 'tip' has 3"),
    ({"loads": [Load("f", tip, force=(1, 2, 3), axes="body")]}, "loads.f.axes: 'body' is unknown; give 'world' or"),
    ({"loads": [Load("f", body=rotor, torque=1)]}, "loads.f.torque: the torque on 'rotor' has 3 entries, got 1"),
    ({"loads": [Load("f", body=rotor, torque=(1, 2))]}, "loads.f.torque: the torque on 'rotor' has 3 entries"),
    ({"loads": [Load("f", body="tip", torque=1)]}, "loads.f.torque: the torque on 'tip' has 3 entries, got 1"),
    (
        {"points": [Point("p", (0, 0, 1))], "loads": [Load("f", "p", force=(1, 2, 3), axes="frame")]},
        "loads.f.axes: there is no frame to take the axes of",
    ),
    ({"outputs": [Output("o")]}, "outputs.o: give one of 'expression', 'frame', 'point' or 'bodies', got none"),
    ({"outputs": [Output("o", q1, frame=arm)]}, "outputs.o: give one of .* got 'expression' and 'frame'"),
    ({"outputs": [Output("o", q1, quantity="angles")]}, "outputs.o.quantity: 'angles' does not fit; it goes with"),
    ({"outputs": [Output("o", frame=arm)]}, "outputs.o.quantity: is missing; give one of angular_velocity, ang"),
    ({"outputs": [Output("o", frame=arm, quantity="position")]}, "outputs.o.quantity: 'position' does not fit"),
    ({"outputs": [Output("o", frame="leg", quantity="angles")]}, "outputs.o.frame: there is no frame 'leg'"),
    ({"outputs": [Output("o", point="toe", quantity="position")]}, "outputs.o.point: there is no point or body 'toe'"),
    (
        {"outputs": [Output("o", point=tip, bodies=["rotor"], quantity="position")]},
        "outputs.o: give one of .* got 'point' and 'bodies'",
    ),
    ({"outputs": [Output("o", bodies=["rotator"], quantity="mass_centre")]}, "outputs.o.bodies: no body with a place"),
    ({"outputs": [Output("o", bodies=[], quantity="mass_centre")]}, "outputs.o.bodies: expected one or more different"),
    (
        {"outputs": [Output("o", bodies=["rotor"] * 2, quantity="mass_centre")]},
        "outputs.o.bodies: expected one or more",
    ),
    (
        {"outputs": [Output("o", bodies=["rotor"], quantity="holding_force")]},
        "outputs.o.frame: does not fit .* name the",
    ),
    (
        {"outputs": [Output("o", bodies=["rotor"], frame=arm, quantity="mass_centre")]},
        "outputs.o.frame: does not fit to mass_centre; leave it out",
    ),
    (
        {"outputs": [Output("o", frame=arm, quantity="angles", axes="frame")]},
        "outputs.o.axes: there is no frame to take",
    ),
    (
        {"parameters": [l, I, m, g, parameter("o_y", 1)], "outputs": [Output("o", point=tip, quantity="position")]},
        "outputs.o: the name 'o_y' is already taken by parameters.o_y",
    ),
]


@pytest.mark.parametrize(("changes", "message"), REFUSED, ids=[message[:50] for _, message in REFUSED])
def test_what_is_wrong_is_named_with_place_and_value(changes: dict[str, Any], message: str) -> None:
    pattern = ".*".join(re.escape(part) for part in message.split(".*"))
    with pytest.raises(MechanismError, match=pattern):
        robot(**changes)


@pytest.mark.parametrize(
    ("rotations", "message"),
    [
        ([("w", q1)], "frames.f.rotations[0].axis: 'w' is no axis"),
        ([("z", q1), ((1, 0), q1)], "frames.f.rotations[1].axis: (1, 0) is no axis"),
        ([((0, 0, 0), q1)], "frames.f.rotations[0].axis: the zero vector is no axis"),
        ([(3, q1)], "frames.f.rotations[0].axis: 3 is no axis"),
        (("z", q1), "frames.f.rotations[0]: expected a pair of axis and angle, e.g. ('z', q), got 'z'"),
        ([("z", "q1")], "frames.f.rotations[0].angle: expected an expression, got 'q1'"),
        ([("z", q1, pi)], "frames.f.rotations[0]: expected a pair"),
        ("zx", "frames.f.rotations: expected pairs of axis and angle, got 'zx'"),
    ],
)
def test_rotations_that_are_none_are_refused_at_once(rotations: Any, message: str) -> None:
    with pytest.raises(MechanismError, match=re.escape(message)):
        Frame("f", rotations=rotations)


def test_a_long_chain_of_frames_is_no_recursion() -> None:
    frames = [Frame(f"f{i}", f"f{i - 1}" if i else "world", (Fraction(1, 7), 0, 0)) for i in range(1500)]
    assert len(robot(frames=[arm, base, *frames]).frames) == 1502


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Frame("f", origin=l), "frames.f.origin: expected a tuple of expressions, got l"),
        (lambda: Body("b", (1, 2), frame="f"), "bodies.b.mass: expected one expression, got (1, 2)"),
        (lambda: Body("b", 1, frame="f", center=0), "bodies.b.center: expected a tuple of expressions, got 0"),
        (lambda: Load("f", "tip", force=3), "loads.f.force: expected a tuple of expressions, got 3"),
        (
            lambda: Gravity((0, -9.81)),
            "gravity.acceleration: expected the size alone, got (0, -9.81); where gravity acts",
        ),
    ],
)
def test_vectors_and_single_expressions_are_told_apart(build: Any, message: str) -> None:
    with pytest.raises(MechanismError, match=re.escape(message)):
        build()
