"""The table [ports]: what it brings, under which names, and what is refused with place, value and remedy."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from lag2fmu.cli.porting import with_choices
from lag2fmu.errors import Lag2FmuError, MechanismError, TextError
from lag2fmu.formats.loading import with_values
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.language.expressions import symbol
from lag2fmu.language.units import NEWTON
from lag2fmu.mechanism import (
    Body,
    Frame,
    Input,
    Load,
    Mechanism,
    Part,
    Point,
    Ports,
    complete,
    coordinate,
    signal,
)
from lag2fmu.mechanism.ports import input_names

PLANAR = """
[mechanism]
name = "m"
[coordinates]
x = { unit = "m" }
a = { unit = "rad" }
[inputs]
F = { unit = "N", start = 2.0 }
y0 = { unit = "m", motion = true }
[forces]
x = "F"
[bodies.cart]
mass = 1
position = ["x", "y0"]
[bodies.rod]
mass = 2
inertia = 1
position = ["x + sin(a)", "y0"]
angle = "a"
[loads.push]
point = "cart"
input = true
[ports]
"""


def planar(text: str) -> Mechanism:
    return read(PLANAR + text, "m.toml")


def spatial(**ports: object) -> Mechanism:
    """A frame ``hand`` with a body of the same name beside its origin, and a point ``tip``."""
    q = coordinate("q", "rad")
    hand = Frame("hand", rotations=[("y", q)])
    body = Body("hand", 1, frame=hand, center=(1, 0, 0), inertia=(1, 2, 3, 0, 0, 0))
    return Mechanism(
        "m",
        coordinates=[q],
        frames=[hand],
        bodies=[body],
        points=[Point("tip", (0, 0, 1), frame=hand)],
        ports=Ports(**ports),
    )


def test_in_the_plane() -> None:
    found = planar('forces = ["cart"]\ntorques = ["rod"]\nposes = ["rod", "cart"]\naccelerations = ["rod"]\n')
    assert [u.name for u in found.inputs] == [
        "F",
        "y0",
        "cart_force_x",
        "cart_force_y",
        "rod_torque",
        "push_x",
        "push_y",
    ]
    rod = ["rod_position_x", "rod_position_y", "rod_angle"]
    rates = ["rod_acceleration_x", "rod_acceleration_y", "rod_angular_acceleration"]
    assert list(found.output_names) == [*rod, "cart_position_x", "cart_position_y", *rates]
    assert found.loads[1] == Load("cart_force", point="cart", force=(symbol("cart_force_x"), symbol("cart_force_y")))
    assert found.origins["inputs.rod_torque"] == "ports.torques.rod"
    assert read(write(found), "m.toml") == found


def test_in_space() -> None:
    found = spatial(
        forces={"frames.hand": "frame"}, torques=["tip"], poses=["tip"], velocities=["bodies.hand"], rotation="rotation"
    )
    forces, torques = ([f"{stem}_{x}" for x in "xyz"] for stem in ("hand_force", "tip_torque"))
    assert [u.name for u in found.inputs] == [*forces, *torques]
    assert [load.axes for load in found.loads] == ["frame", "world"]
    assert found.points[-1] == Point("hand_origin", (0, 0, 0), frame="hand")
    assert [(o.name, o.point, o.frame) for o in found.outputs] == [
        ("tip_position", "tip", None),
        ("tip_rotation", None, "hand"),
        ("hand_velocity", "hand", None),
        ("hand_angular_velocity", None, "hand"),
    ]
    assert read(write(found), "m.toml") == found


def test_python_may_give_the_parts_themselves() -> None:
    y = signal("y", "m", motion=True)
    q, tip = coordinate("q", "m"), Point("tip", (0, 0))
    ports = Ports("none", forces=[tip], poses=[tip], drives=[y])
    assert ports == Ports([], forces={"tip": "world"}, poses=["tip"], drives=["y"])
    found = Mechanism("m", coordinates=[q], inputs=[y], points=[tip], bodies=[Body("b", 1, (q, y))], ports=ports)
    assert read(write(found), "m.toml") == found


@pytest.mark.parametrize(
    ("text", "left"),
    [
        ("", None),
        ('inputs = "all"', None),
        ('inputs = "none"', set()),
        ("inputs = []", set()),
        ('inputs = ["F", "Q_a"]', {"F", "Q_a"}),
        ('inputs = ["push"]', {"push_x", "push_y"}),
        ('inputs = ["y0", "push_y"]', {"y0", "y0_dot", "y0_ddot", "push_y"}),
    ],
)
def test_which_inputs_there_are(text: str, left: set[str] | None) -> None:
    every = {"Q_x", "Q_a", "F", "y0", "y0_dot", "y0_ddot", "push_x", "push_y", "cart_force_x", "cart_force_y"}
    found = planar(text + '\nforces = ["cart"]\n')
    shown = every if left is None else left | {"cart_force_x", "cart_force_y"}  # those of ports are always there
    assert found.hidden_inputs == every - shown
    assert set(input_names(found)) == every
    assert read(write(found), "m.toml") == found


def test_a_declared_input_is_taken_for_that_of_the_port() -> None:
    declared = PLANAR.replace("[forces]", 'cart_force_x = { unit = "N", start = 3.0, doc = "wind" }\n[forces]')
    found = read(declared + 'forces = ["cart"]\n', "m.toml")
    assert [(u.name, u.start) for u in found.inputs if u.name.startswith("cart")] == [
        ("cart_force_x", 3.0),
        ("cart_force_y", 0.0),
    ]


def test_starts_of_ports_can_be_set() -> None:
    found = with_values(planar('forces = ["cart"]\n'), {"cart_force_y": 4.0})
    assert next(u.start for u in found.inputs if u.name == "cart_force_y") == 4.0
    assert [u.name for u in found.inputs].count("cart_force_y") == 1


def test_parts_bring_their_ports_under_new_names() -> None:
    part = spatial(inputs="none", forces={"frames.hand": "frame"}, poses=["tip"])
    whole = Mechanism("w", parts=[Part("left", part), Part("right", part)], ports=Ports(torques=["left_tip"]))
    assert {load.name for load in whole.loads} == {"left_tip_torque", "left_hand_force", "right_hand_force"}
    assert whole.hidden_inputs == set()
    assert {"left_tip_position", "right_tip_quaternion"} <= {o.name for o in whole.outputs}


def test_options_of_the_command_line() -> None:
    m = planar('poses = ["rod"]\n')
    found = with_choices(m, "F,push_x", ["forces=rod,cart:world,poses=cart", "drives=y0"])
    assert found.description.ports == Ports(["F", "push_x"], forces=["rod", "cart"], drives=["y0"], poses=["cart"])
    assert with_choices(m, "none", []).description.ports == replace(m.description.ports, inputs=())
    assert with_choices(found, "all", []).description.ports.inputs is None
    assert with_choices(m, None, []) is m


WRONG = {
    'inputs = ["G"]': r"m.toml: ports.inputs: there is no input 'G'; known are Q_x, Q_a, F",
    'inputs = ["Q_y"]': r"ports.inputs: there is no input 'Q_y'; did you mean 'Q_",
    'inputs = "some"': r"ports.inputs: expected an array of names, 'all' or 'none', got 'some'",
    "inputs = 3": r"ports.inputs: expected a string, got the number 3",
    'forces = ["carts"]': r"ports.forces: there is no point, body or frame 'carts'; did you mean 'cart'\?",
    'forces = { cart = "body" }': r"ports.forces.cart: 'body' is unknown; give 'world' or 'frame'",
    'forces = { cart = "frame" }': r"ports.forces.cart: 'cart' has no frame to take the axes of; give 'world'",
    'forces = ["cart", "cart"]': r"ports.forces: 'cart' stands twice; leave one out",
    'torques = ["cart"]': r"ports.torques.cart: 'cart' is not a rigid body with an angle or a frame.* let a force act",
    'poses = ["frames.cart"]': r"ports.poses: there is no point, body or frame 'frames.cart'",
    'velocities = ["x"]': r"ports.velocities: there is no point, body or frame 'x'",
    'drives = ["F"]': r"ports.drives: there is no prescribed motion or coordinate 'F'; known are y0",
    'rotation = "euler"': r"ports.rotation: 'euler' is unknown; give one of quaternion, rotation, angles",
    'outputs = ["x"]': r"ports.outputs: unknown key; did you mean",
}


@pytest.mark.parametrize("text", WRONG)
def test_what_is_wrong_is_named_with_place_and_value(text: str) -> None:
    with pytest.raises(TextError, match=WRONG[text]):
        planar(text + "\n")


def test_two_places_of_one_name_have_to_be_told_apart() -> None:
    with pytest.raises(
        MechanismError, match=r"ports.poses: 'hand' .* two places; write 'bodies.hand' or 'frames.hand'"
    ):
        spatial(poses=["hand"])


@pytest.mark.parametrize(
    ("items", "message"),
    [
        (["forces"], "--port forces: expected KEY=NAME,...; e.g. --port forces=tip,hand"),
        (["forces=cart,"], "--port forces=cart,: expected KEY=NAME"),
        (["force=cart"], "--port force=cart: there is no key 'force'; did you mean 'forces'"),
        (["torques=rod:body"], "ports.torques.rod: 'body' is unknown; give 'world' or 'frame'"),
    ],
)
def test_wrong_options(items: list[str], message: str) -> None:
    with pytest.raises(Lag2FmuError, match=re.escape(message)):
        with_choices(planar(""), None, items)


def test_a_rotor_takes_torques_only() -> None:
    phi = coordinate("phi", "rad")
    rotor = Body("rotor", inertia=1, angle=phi)
    found = Mechanism("m", coordinates=[phi], bodies=[rotor], ports=Ports(torques=[rotor], velocities=[rotor]))
    assert [u.name for u in found.inputs] == ["rotor_torque"]
    assert list(found.output_names) == ["rotor_angular_velocity"]
    with pytest.raises(MechanismError, match=r"ports.forces.rotor: 'rotor' only turns and is at no place"):
        complete(replace(found.description, ports=Ports(forces=[rotor])))


def test_an_input_of_another_unit_is_a_mismatch() -> None:
    odd = Input("b_force_x", NEWTON * NEWTON)
    q = coordinate("q", "m")
    found = Mechanism("m", coordinates=[q], inputs=[odd], bodies=[Body("b", 1, (q, 0))], ports=Ports(forces=["b"]))
    assert any("loads.b_force.force[0]" in warning for warning in found.warnings)
