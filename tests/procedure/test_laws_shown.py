"""The twelve steps tell the laws of contacts, stops, latches and dry friction, and the modes at the start."""

from __future__ import annotations

import pytest

from lag2fmu.formats.text import read
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.procedure.hybrid import Hybrid
from lag2fmu.procedure.steps import procedure

TEXT = """
[mechanism]
name = "ball"
[parameters]
r = { value = 100, unit = "mm" }
e = { value = 0.8, unit = "1" }
[coordinates]
x = { unit = "m", velocity = 0.3 }
y = { unit = "m", start = 0.1 }
phi = { unit = "rad" }
[inputs]
hold = { unit = "1" }
[bodies.ball]
mass = 2
inertia = 0.1
position = ["x", "y"]
angle = "phi"
[contacts.floor]
kind = "disc_line"
between = ["ball", "world"]
normal = "y"
radius = "r"
restitution = "e"
friction = 0.2
static_friction = 0.3
[contacts.soft]
gap = "x + 0.1"
slip = "y_dot"
law = "compliant"
stiffness = 1e6
damping = 0.5
friction = 0.1
slip_speed = 0.01
[stops.rail]
of = "x"
upper = 2
[frictions.bearing]
on = "phi_dot"
force = "0.1 + 0.05*floor_force"
static = 4
[constraints.holonomic]
catch = { expression = "x - y", while = "0.5 - hold" }
"""


@pytest.fixture(scope="module")
def ball() -> Mechanism:
    return read(TEXT, "ball")


def test_each_law_is_a_line_with_its_mode_at_the_start(ball: Mechanism) -> None:
    laws = [law.sentence for law in (*Hybrid(ball).contacts(), *Hybrid(ball).forces())]
    assert laws == [
        "impacts of several contacts are solved in rounds",
        "contact floor: gap and force are at least 0, and one of them is 0; restitution e; friction 0.2, sticking 0.3; "
        "closed at the start, slides at 0.3 m/s",
        "stop rail_upper: gap and force are at least 0, and one of them is 0; restitution 0; open at the start, by 2 m",
        "compliant contact soft: presses by 1000000*d**1.5*(1 + 0.5*d_dot), d being its penetration, and never pulls; "
        "friction 0.1, which fades below the slip speed 0.01; open at the start, by 0.1",
        "holonomic constraint catch, which holds while 1/2 - hold is above 0; holds at the start:",
        "dry friction bearing: 0.1 + 0.05*floor_force against the slip, up to 4 while it sticks; at rest at the start",
    ]


def test_their_forces_stand_in_the_equations_of_motion(ball: Mechanism) -> None:
    text = procedure(ball)
    for line in (
        "floor_gap = y - r",
        "slip_floor = x_dot + phi_dot*r",
        "slip_bearing = phi_dot",
        "x - y = 0",
        "2*x_ddot - 1000000*if(-0.1 - x > 0",
        " = Q_x + floor_friction + multiplier_catch - rail_upper_force",
        "0.1*phi_ddot = Q_phi + bearing_force + floor_friction*r",
    ):
        assert line in text, line


def test_a_table_is_told_by_its_size_and_a_state_by_its_equation() -> None:
    more = '[tables.f]\ncolumns = [[0, 1, 2], [0, 1, 4]]\ninterpolation = "cubic"\n'
    more += '[states]\ni = { derivative = "f(x) - i" }\n'
    more += '[forces]\nphi = "f(x) + if(i > 0, i, 0)"\n'
    mechanism = read(TEXT + more, "ball")
    hybrid = Hybrid(mechanism)
    assert list(hybrid.forces())[-1].sentence == "table f: 3 points, cubic between them, held outside"
    text = procedure(mechanism)
    for line in ("Q^np_phi = Q_phi + if(i > 0, i, 0) + f(x)", "i_dot = -i + f(x)"):
        assert line in text
    assert r"f\left(x\right)" in procedure(mechanism, "latex")


@pytest.mark.parametrize("height", ["abs(x)", "smooth(max(x, 0))", "x*heaviside(x)"])
def test_what_jumps_in_a_derivative_has_the_derivative_0(height: str) -> None:
    """It ended with KeyError: DiracDelta."""
    bend = f'[coordinates]\nx = {{}}\n[bodies.bead]\nmass = 2\nposition = ["x", "{height}"]\n'
    text = procedure(read(f'[mechanism]\nname = "bend"\n{bend}', "bend"))
    assert "d/dt dL/d(x_dot) = " in text
    assert "dL/d(x) = 0" in text
