"""Joints in the record and in the text: what they bring, that it reads back, and what is refused."""

from __future__ import annotations

import re
from typing import Any

import pytest
from jsonschema import Draft7Validator
from sympy import Rational, cos, sin

from lag2fmu.description.joints import JOINTS, across, direction
from lag2fmu.errors import MechanismError
from lag2fmu.formats.loading import with_values
from lag2fmu.formats.schema import schema
from lag2fmu.formats.syntax import tomllib
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.language.expressions import symbol
from lag2fmu.mechanism import (
    Body,
    Constraint,
    Definition,
    Frame,
    Joint,
    Mechanism,
    Output,
    Point,
    coordinate,
    parameter,
)

R, p = parameter("R", 0.2, "m"), parameter("p", 0.01, "m")
r = [coordinate(k, "m") for k in "xyz"]
e = [coordinate(f"e{i}", "1", start=float(i == 0)) for i in range(4)]
free = Frame("free", origin=r, quaternion=e)
ball = Body("ball", 1, frame=free, inertia=(1, 1, 1, 0, 0, 0))
pin = Point("pin", (0, R, 0), free)
KEYS: dict[str, dict[str, Any]] = {
    "revolute": {"axis": "x", "second_axis": (0, 3, 4), "reactions": True},
    "prismatic": {"axis": (1, Rational(1, 3), -2), "reactions": True, "axes": "frame"},
    "cylindrical": {"axis": "z"},
    "screw": {"axis": "z", "pitch": p},
    "planar": {"axis": "y"},
    "universal": {"axis": "x", "second_axis": "y"},
    "rolling_disc": {"axis": "z", "second_axis": "y", "radius": R, "reactions": True},
    "rolling_sphere": {"axis": (0, 0.6, 0.8), "radius": 2 * R},
}


def body(**changes: Any) -> Mechanism:
    """A free body with some tables replaced."""
    tables = {"coordinates": [*r, *e], "parameters": [R, p], "frames": [free], "bodies": [ball], "points": [pin]}
    return Mechanism("body", **{**tables, **changes})


@pytest.mark.parametrize("kind", [kind for kind in JOINTS if kind != "gear"])
def test_a_joint_between_two_ends_reads_back_the_same(kind: str) -> None:
    mechanism = body(joints=[Joint("j", kind, ("world", pin), **KEYS.get(kind, {}))])
    text = write(mechanism)
    assert read(text, "x") == mechanism
    assert "[constraints" not in text
    assert mechanism.origins["constraints.free_norm"] == "frames.free.quaternion"
    assert set(mechanism.origins.values()) <= {"joints.j", "frames.free.quaternion"}
    assert "multiplier" not in text
    assert not list(Draft7Validator(schema()).iter_errors(tomllib.loads(text)))
    moved = with_values(mechanism, {"x": 0.1})
    assert [c.name for c in moved.constraints] == [c.name for c in mechanism.constraints]


@pytest.mark.parametrize("kind", [kind for kind, what in JOINTS.items() if what.coordinates is not None])
def test_a_joint_on_a_parent_brings_a_frame_and_coordinates(kind: str) -> None:
    keys = {key: value for key, value in KEYS.get(kind, {}).items() if key in JOINTS[kind].keys}
    joint = Joint("j", kind, parent=free, origin=(0, R, 0), **keys)
    mechanism = body(joints=[joint], bodies=[ball, Body("more", 1, frame="j", inertia=(1, 1, 1, 0, 0, 0))])
    assert [q.name for q in mechanism.coordinates[7:]] == [f"j_{suffix}" for suffix in JOINTS[kind].coordinates or ()]
    assert mechanism.frame("j").parent == "free"
    brought = {f"coordinates.{q.name}" for q in mechanism.coordinates[7:]} | {"frames.j"}
    assert {place for place, by in mechanism.origins.items() if by == "joints.j"} == brought
    text = write(mechanism)
    assert read(text, "x") == mechanism
    assert "[frames.j]" not in text


def test_coordinates_are_declared_with_the_joint_or_elsewhere() -> None:
    a, b = coordinate("a", "deg", start=30.0), coordinate("b", "m", start=0.2)
    joint = Joint("j", "cylindrical", parent="world", axis="z", coordinates=[a, "b"])
    bodies = [Body("c", 1, frame=joint.frame, center=(1, 0, 0))]
    mechanism = Mechanism("m", coordinates=[b], bodies=bodies, joints=[joint])
    assert [(q.name, q.start) for q in mechanism.coordinates] == [("b", 0.2), ("a", a.declaration.start)]
    assert mechanism.frame("j") == Frame("j", origin=(0, 0, b), rotations=[("z", a)])


def test_what_the_coordinates_meet_is_no_constraint() -> None:
    """Frames that all turn about z close a loop by two equations; turns about one axis are taken together."""
    a, b, c = (coordinate(name, "rad") for name in "abc")
    mechanism = Mechanism(
        "loop",
        coordinates=[a, b, c],
        frames=[Frame("one", rotations=[("z", a)]), Frame("two", "one", (1, 0, 0), [("z", b), ("z", c)])],
        bodies=[Body("rod", 1, frame="two", inertia=(1, 1, 1, 0, 0, 0))],
        points=[Point("end", (1, 0, 0), "two")],
        joints=[Joint("j", "revolute", ("world", "end"), axis="z")],
    )
    assert mechanism.constraints == (
        Constraint("j_x", cos(a) + cos(a + b + c)),
        Constraint("j_y", sin(a) + sin(a + b + c)),
    )


def test_definitions_are_written_out_before_they_are_differentiated() -> None:
    """An upright disc rolls R a of way for an angle a, both by definitions."""
    x, phi = coordinate("x", "m"), coordinate("phi", "rad")
    disc = Frame("disc", origin=(symbol("way"), 0, R), rotations=[("y", symbol("turn"))])
    mechanism = Mechanism(
        "disc",
        coordinates=[x, phi],
        parameters=[R],
        definitions=[Definition("turn", 2 * phi), Definition("way", 3 * x)],
        frames=[disc],
        bodies=[Body("coin", 1, frame=disc, inertia=(1, 1, 1, 0, 0, 0))],
        joints=[Joint("j", "rolling_disc", ("world", disc), axis="z", second_axis="y", radius=R)],
    )
    assert mechanism.constraints == (Constraint("j_slip_1", 3 * x.dot - 2 * R * phi.dot, "nonholonomic"),)


@pytest.mark.parametrize("axis", ["x", "y", "z", (1, 2, 3), (0, 0, -2), (0.1, 0, 0.3)])
def test_normals_and_axis_are_a_right_handed_triple(axis: Any) -> None:
    first, second = across(axis)
    assert (first.cross(second) - direction(axis)).norm() < 1e-12
    assert abs(first.norm() - 1) < 1e-12
    assert abs(second.norm() - 1) < 1e-12


# ------------------------------------------------------------------------------------------------------------- errors

BETWEEN = ("world", "pin")


def joint(kind: str, between: Any = BETWEEN, parent: Any = None, **keys: Any) -> Joint:
    return Joint("j", kind, between if parent is None else None, parent, **keys)


ALONE: list[tuple[Any, str]] = [
    (lambda: joint("hinge"), "joints.j.kind: 'hinge' is no joint; known are revolute"),
    (lambda: joint("revolut"), "joints.j.kind: 'revolut' is no joint; did you mean 'revolute'"),
    (lambda: joint("spherical", None), "joints.j: give either 'between', two ends, or 'parent'"),
    (lambda: Joint("j", "spherical", BETWEEN, "world"), "joints.j: give either 'between', two ends, or 'parent'"),
    (lambda: joint("spherical", ("world",)), "joints.j.between: 1 ends; name two"),
    (lambda: joint("revolute", axis=(0, 0, 0)), "joints.j.axis: the zero vector is no axis"),
    (lambda: joint("revolute", axis="w"), "joints.j.axis: 'w' is no axis; give 'x', 'y', 'z'"),
    (lambda: joint("revolute", axis=(R, 0, 0)), "joints.j.axis: [R, 0, 0] is not constant; give numbers"),
    (lambda: joint("spherical", axis="x"), "joints.j.axis: does not go with 'spherical'"),
    (lambda: joint("screw", axis="x"), "joints.j: 'pitch' is missing"),
    (lambda: joint("universal", axis="x"), "joints.j: 'second_axis' is missing"),
    (lambda: joint("universal", parent="world", axis="x", second_axis=(2, 0, 0)), "joints.j.second_axis: is parallel"),
    (lambda: joint("rolling_disc", parent="world"), "joints.j.parent: 'rolling_disc' carries no frame"),
    (lambda: joint("fixed", axes="body"), "joints.j.axes: 'body' is unknown; give 'world' or 'frame'"),
    (lambda: joint("fixed", origin=(1, 0, 0)), "joints.j.origin: goes with 'parent'"),
    (lambda: joint("fixed", coordinates=["a"]), "joints.j.coordinates: goes with 'parent'"),
    (lambda: joint("gear", ("x", "y"), ratio=2, reactions=True), "joints.j.reactions: this joint has none; mult"),
    (lambda: joint("fixed", parent="world", reactions=True), "joints.j.reactions: this joint has none; close it"),
    (
        lambda: joint("planar", parent="world", axis="z", coordinates=["a"]),
        "joints.j.coordinates: 1 names; 'planar' has x, y, angle",
    ),
]

IN_A_MECHANISM: list[tuple[Any, str]] = [
    (lambda: body(joints=[joint("revolute")]), "joints.j: 'axis' is missing"),
    (
        lambda: body(joints=[joint("spherical", ("world", "pim"))]),
        "joints.j.between: there is no frame, point or body 'pim'; did you mean 'pin'",
    ),
    (lambda: body(joints=[joint("spherical", (free, free))]), "joints.j.between: 'free' and 'free' are the same"),
    (
        lambda: body(joints=[joint("spherical", (pin, ball))]),
        "joints.j.between: 'pin' and 'ball' are both on 'free'; name two that move differently",
    ),
    (
        lambda: body(bodies=[Body("free", 1, frame=free, center=(R, 0, 0))], joints=[joint("fixed", ("world", free))]),
        "joints.j.between: 'free' is a frame, and a point or body elsewhere; rename one",
    ),
    (
        lambda: body(joints=[joint("rolling_sphere", axis="z", radius=-R)]),
        "joints.j.radius: '-R' is -0.2; give a positive length",
    ),
    (lambda: body(joints=[joint("screw", axis="z", pitch=p - 0.01)]), "' is 0.0; give a number that is not zero"),
    (lambda: body(joints=[joint("screw", axis="z", pitch=r[0])]), "joints.j.pitch: 'x' is a coordinate and cannot"),
    (lambda: body(joints=[joint("gear", ("x", "w"), ratio=2)]), "joints.j.between: 'w' is no coordinate, nor a joint"),
    (lambda: body(joints=[joint("gear", ("x", "x"), ratio=2)]), "joints.j.between: both are the coordinate 'x'"),
    (lambda: body(joints=[joint("gear", ("x", "y"), ratio=0)]), "joints.j.ratio: '0' is 0.0; give a number"),
    (lambda: body(joints=[joint("fixed")] * 2), "joints: the name 'j' is used twice"),
    (lambda: body(joints=[Joint("free", "fixed", parent="world")]), "frames.free: a joint brings one of this name too"),
    (
        lambda: body(joints=[joint("spherical")], constraints=[Constraint("j_x", r[0])]),
        "constraints.j_x: a joint brings one of this name too; rename",
    ),
    (
        lambda: body(joints=[joint("spherical", reactions=True)], outputs=[Output("j_force_x", r[0])]),
        "outputs.j_force_x: a joint brings one of this name too; rename",
    ),
    (
        lambda: body(
            coordinates=r[:2],
            frames=[Frame("free", origin=(*r[:2], R))],
            points=[],
            joints=[joint("rolling_sphere", ("world", "free"), axis="z", radius=R, reactions=True)],
        ),
        "joints.j.reactions: the coordinates meet 'normal' by themselves, so that what acts there is unknown; read "
        "multiplier_j_slip_1, multiplier_j_slip_2",
    ),
    (
        lambda: Mechanism(
            "flat",
            coordinates=r[:2],
            bodies=[Body("b", 1, r[:2])],
            points=[Point("o", (0, 0))],
            joints=[joint("spherical", ("o", "b"))],
        ),
        "joints.j.kind: positions have 2 entries; 'spherical' joins frames, which are spatial",
    ),
]


@pytest.mark.parametrize(("build", "message"), [*ALONE, *IN_A_MECHANISM], ids=lambda x: x[:60] if x is str else None)
def test_what_is_wrong_is_named_with_place_and_value(build: Any, message: str) -> None:
    with pytest.raises(MechanismError, match=re.escape(message)):
        build()
