"""Warnings of gaps that are no distances beside friction."""

from __future__ import annotations

import pytest

from lag2fmu.formats.text import read

PLANE = """
[mechanism]
name = "told"
[parameters]
b = {{ value = 0.5, unit = "rad" }}
a = {{ value = 2.0, unit = "1/m" }}
mu = {{ value = 0.3, unit = "1" }}
[coordinates]
x = {{ unit = "m" }}
y = {{ unit = "m" }}
phi = {{ unit = "rad" }}
[bodies]
disc = {{ mass = 1, inertia = 0.02, position = {position}, angle = "phi" }}
[contacts]
slope = {{ gap = "{gap}", slip = "{slip}", friction = "mu" }}
"""

SPACE = """
[mechanism]
name = "told"
[parameters]
a = {{ value = 2.0, unit = "1/m" }}
[coordinates]
x = {{ unit = "m", start = 0.1 }}
y = {{ unit = "m" }}
z = {{ unit = "m", start = 0.02 }}
[frames.ball]
origin = ["x", "y", "z"]
[bodies]
ball = {{ mass = 1, frame = "ball" }}
[contacts]
bowl = {{ gap = "{gap}", slip = [{slips}], friction = 0.2 }}
"""

UPRIGHT, ALONG = '["x", "y"]', '["x*cos(b) - y*sin(b)", "x*sin(b) + y*cos(b)"]'


@pytest.mark.parametrize(
    ("position", "gap", "slip"),
    [
        (UPRIGHT, "y + tan(b)*x", "x_dot"),
        (UPRIGHT, "(y + tan(b)*x)*cos(b)", "x_dot"),
        (UPRIGHT, "y - a*x**2", "x_dot"),
        (ALONG, "y", "x_dot*cos(b) - y_dot*sin(b)"),
    ],
    ids=["steep", "slip-lies-flat", "parabola", "turned-axes"],
)
def test_friction_that_would_be_wrong_is_told(position: str, gap: str, slip: str) -> None:
    """A block on a slope of 0.5 rad with the first gap slides 14 % farther than it should."""
    told = [x for x in read(PLANE.format(position=position, gap=gap, slip=slip), "told").warnings if "friction" in x]
    assert len(told) == 1
    assert "contacts.slope: friction is not slope_force times its coefficient" in told[0]


@pytest.mark.parametrize(
    ("position", "gap", "slip"),
    [
        (UPRIGHT, "(y + tan(b)*x)*cos(b)", "(x_dot - tan(b)*y_dot)*cos(b) + 0.1*phi_dot"),
        (UPRIGHT, "y - a*x**2", "x_dot + 2*a*x*y_dot"),
        (UPRIGHT, "(y - a*x**2)/sqrt(1 + (2*a*x)**2)", "(x_dot + 2*a*x*y_dot)/sqrt(1 + (2*a*x)**2)"),
        (UPRIGHT, "y + 0.1*sin(phi)", "x_dot - 0.1*sin(phi)*phi_dot"),
        (UPRIGHT, "0.7071*(x + y)", "0.7071*(x_dot - y_dot)"),
        (ALONG, "y", "x_dot"),
        ('["x*cos(phi) + y", "x*sin(phi)"]', "2*x", "3*y_dot"),
    ],
    ids=["slope", "both-alike", "curve", "corner", "wrong-by-rounding", "turned-axes", "no-translations"],
)
def test_distances_are_taken(position: str, gap: str, slip: str) -> None:
    found = read(PLANE.format(position=position, gap=gap, slip=slip), "told").warnings
    assert not [x for x in found if "friction" in x]


def test_a_bowl_is_looked_at_where_it_is_touched() -> None:
    """Away from the bowl (z - a r**2)/sqrt(1 + (2 a r)**2) is no distance, but nothing rubs there."""
    gap, slips = "z - a*(x**2 + y**2)", '"x_dot", "y_dot"'
    (told,) = read(SPACE.format(gap=gap, slips=slips), "told").warnings
    assert "grows by 1.077 m for each metre along its normal" in told
    assert "not at right angles" in told
    slopes = "2*a*sqrt(x**2 + y**2)"
    around, down = "(x*y_dot - y*x_dot)/sqrt(x**2 + y**2)", "(x*x_dot + y*y_dot)/sqrt(x**2 + y**2)"
    slips = f'"{around}", "({down} + {slopes}*z_dot)/sqrt(1 + ({slopes})**2)"'
    right = SPACE.format(gap=f"({gap})/sqrt(1 + ({slopes})**2)", slips=slips)
    assert read(right, "told").warnings == ()
    assert read(SPACE.format(gap="z", slips='"x_dot", "y_dot"'), "told").warnings == ()
