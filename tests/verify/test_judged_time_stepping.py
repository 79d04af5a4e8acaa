"""Mechanisms on which time stepping is right by its order, and that ``validate`` has to pass."""

from __future__ import annotations

import pytest

from lag2fmu.formats.text import read
from lag2fmu.verify.validate import validate

pytestmark = pytest.mark.fmu

CARTS = """
[mechanism]
name = "carts"
[coordinates]
x0 = { unit = "m", start = 0.21, velocity = -0.789 }
x1 = { unit = "m", start = 0.434, velocity = 0.508 }
x2 = { unit = "m", start = 0.897, velocity = -0.676 }
x3 = { unit = "m", start = 1.091, velocity = 0.183 }
x4 = { unit = "m", start = 1.493, velocity = -1.769 }
[bodies]
b0 = { mass = 2.361, position = ["x0", 0] }
b1 = { mass = 1.112, position = ["x1", 0] }
b2 = { mass = 2.394, position = ["x2", 0] }
b3 = { mass = 0.523, position = ["x3", 0] }
b4 = { mass = 1.366, position = ["x4", 0] }
[contacts]
left = { gap = "x0", restitution = 1 }
c1 = { gap = "x1 - x0 - 0.1", restitution = 0.3 }
c3 = { gap = "x3 - x2 - 0.1" }
c4 = { gap = "x4 - x3 - 0.1", restitution = 0.9 }
[frictions]
f1 = { on = "x1_dot", force = 0.846 }
f2 = { on = "x2_dot", force = 0.12 }
[springs.s2]
stiffness = 452.055
elongation = "x2 - x1 - 0.2"
[experiment]
stop_time = 1
step = 0.01
"""
"""At .69 s c3 and c4 hit three times each within 1e-5 s. In model exchange they hit one after the other."""

BOX = """
[mechanism]
name = "box"
[coordinates]
x = { unit = "m", start = 0, velocity = 1.654 }
y = { unit = "m", start = 0.653, velocity = -0.869 }
q = { unit = "rad", start = 0.62, velocity = -1.525 }
[bodies.box]
mass = 2.729
inertia = 0.15359
position = ["x", "y"]
angle = "q"
[forces]
x = "0.0"
y = "-26.77149"
[contacts.c0]
gap = "y + (-0.319)*sin(q) + (-0.259)*cos(q)"
slip = "x_dot + q_dot*(-(-0.319)*sin(q) - (-0.259)*cos(q))"
friction = 0.595
restitution = 0
[contacts.c1]
gap = "y + (0.319)*sin(q) + (-0.259)*cos(q)"
slip = "x_dot + q_dot*(-(0.319)*sin(q) - (-0.259)*cos(q))"
friction = 0.595
restitution = 0
[contacts.c2]
gap = "y + (0.319)*sin(q) + (0.259)*cos(q)"
slip = "x_dot + q_dot*(-(0.319)*sin(q) - (0.259)*cos(q))"
friction = 0.595
restitution = 0
[contacts.c3]
gap = "y + (-0.319)*sin(q) + (0.259)*cos(q)"
slip = "x_dot + q_dot*(-(-0.319)*sin(q) - (0.259)*cos(q))"
friction = 0.595
restitution = 0
[experiment]
stop_time = 0.4
step = 0.01
"""
"""A corner comes down in a position that is off by what it moves in a step, and so is the impulse of the floor."""

ROLLED = """
[mechanism]
name = "rolled"
[coordinates]
x = { unit = "m" }
y = { unit = "m", start = 0.848 }
q = { unit = "rad" }
[bodies.block]
mass = 56.224
inertia = 13.755914
position = ["x", "y"]
angle = "q"
[gravity]
acceleration = 9.81
[forces]
x = "if(t < 0.435, 224.4462, 0)"
[contacts.c0]
gap = "y - 0.122*sin(q) - 0.848*cos(q)"
slip = "x_dot + q_dot*(0.122*sin(q) + 0.848*cos(q))"
friction = 0.917
[contacts.c1]
gap = "y + 0.122*sin(q) - 0.848*cos(q)"
slip = "x_dot + q_dot*(-0.122*sin(q) + 0.848*cos(q))"
friction = 0.917
[experiment]
stop_time = 2
step = 0.01
"""
"""A foot that bears moves by what its row turns in half a step: that is no slip."""

STRING = """
[mechanism]
name = "string"
[coordinates]
x = { unit = "m", start = 0.072, velocity = -1.043 }
y = { unit = "m", start = -0.277, velocity = 1.408 }
[gravity]
acceleration = 9.81
[bodies.bob]
mass = 0.894
position = ["x", "y"]
[contacts.string]
gap = "0.545 - sqrt(x**2 + y**2)"
restitution = 0.3
[experiment]
stop_time = 0.7
step = 0.01
"""
"""The string becomes taut 1.5e-8 s behind a communication point: it is apart there, though it all but touches."""

SEESAW = """
[mechanism]
name = "seesaw"
[coordinates]
a = { unit = "rad", start = 0.062, velocity = 1.929 }
y = { unit = "m", start = 0.489 }
[bodies]
beam = { mass = 2.727, inertia = 0.32, position = ["-0.035*cos(a)", "0.024*sin(a)"], angle = "a" }
ball = { mass = 1.905, position = ["0.1701", "y"] }
[gravity]
acceleration = 9.81
[contacts]
hit = { gap = "y*cos(a) - 0.3018*sin(a)" }
right = { gap = "0.2 + 0.486*sin(a)", restitution = 0.4 }
left = { gap = "0.2 - 0.486*sin(a)", restitution = 0.8 }
[experiment]
stop_time = 2
step = 0.01
"""
"""The right stop throws back the beam, on which the ball rests: they overlap for a step."""


@pytest.mark.parametrize(
    "text", [CARTS, BOX, ROLLED, STRING, SEESAW], ids=["carts", "box", "rolled", "string", "seesaw"]
)
def test_right_steps_pass(text: str, exported) -> None:
    report = validate(exported(read(text, "by_chance"), solver="moreau"))
    assert report.outcome == "ok", report


def test_many_contacts_are_compared(exported) -> None:
    """A stone falls on a stair of 70 steps: the integration goes as far as it gets, however many rows there are."""
    steps = "\n".join(f'step{k} = {{ gap = "z + {0.1 * k:.1f}" }}' for k in range(70))
    stone = f"""
[mechanism]
name = "stair"
[coordinates]
z = {{ unit = "m", start = 0.1 }}
[energy]
kinetic = "z_dot**2/2"
potential = "9.81*z"
[contacts]
{steps}
[experiment]
stop_time = 0.2
step = 0.01
"""
    report = validate(exported(read(stone, "stair"), solver="moreau"))
    assert report.outcome == "ok", report
    assert any(check.name.startswith("co-simulation, step") for check in report.checks), report


HUM = """
[mechanism]
name = "hum"
[coordinates]
x = { unit = "m", start = 0.01 }
[bodies.tongue]
mass = 1
position = ["x", 0]
[springs.reed]
stiffness = 98696.044
elongation = "x"
[dampers.air]
damping = 3
rate = "x_dot"
[contacts.block]
gap = "x + 1"
[experiment]
stop_time = 0.3
step = 0.01
"""


def test_a_tongue_that_hums_within_some_steps_passes(exported) -> None:
    """A period is 20 solver steps, of errors of second order, and 2 communication steps: its losses fall between."""
    report = validate(exported(read(HUM, "hum"), solver="moreau"))
    assert report.outcome == "ok", report
