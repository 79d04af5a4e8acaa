"""Floors, walls and stops are drawn where a body would touch them."""

from __future__ import annotations

import numpy as np
import pytest

from lag2fmu.formats.loading import load
from lag2fmu.formats.text import read
from lag2fmu.picture import draw, layout_of
from lag2fmu.picture.scene import Stroke
from lag2fmu.picture.shapes import DISC

TEXT = """
[mechanism]
name = "block"
[coordinates]
x = { unit = "m", start = 1.0 }
y = { unit = "m", start = 2.0 }
phi = { unit = "rad" }
[parameters]
c = { value = 12.0, unit = "N/m" }
[bodies.a]
mass = 1
inertia = 1
angle = "phi"
position = ["x", "y"]
[bodies.b]
mass = 1
position = [0, 0]
"""

CASES = {
    "contacts.c": ('[contacts.c]\ngap = "y"', (0.0, -1.0)),
    "stops.s.upper": ('[stops.s]\nof = "x - 1"\nupper = 3', (1.0, 0.0)),
    "contacts.k": (
        '[contacts.k]\nkind = "point_line"\nbetween = ["a", "world"]\nnormal = [3, 4, 0]\n'
        'law = "compliant"\nstiffness = 1000',
        (-0.6, -0.8),
    ),
}


@pytest.mark.parametrize("part", CASES)
def test_a_wall_stands_across_the_direction_of_its_gap(part: str) -> None:
    lines, towards = CASES[part]
    layout = layout_of(read(TEXT + lines, "block"))
    scene = draw(layout)
    drawn = [mark for mark in scene.marks if isinstance(mark, Stroke) and mark.part == part]
    wall = np.array(drawn[0].points)
    place = layout.at_start[layout.skeleton.place["a"]]
    assert (wall[1] - wall[0]) @ np.array(towards) == pytest.approx(0.0, abs=1e-2)
    assert (wall.mean(axis=0) - place) @ np.array(towards) > 1.0
    assert not any("Not drawn" in note for note in scene.notes)


def test_what_is_no_wall_is_left_out() -> None:
    text = (
        TEXT + '[contacts.c]\nkind = "point_disc"\nbetween = ["a", "b"]\nradius = 0.1\n[stops.s]\nof = "phi"\nupper = 1'
    )
    assert not {part for part in draw(layout_of(read(text, "block"))).parts() if part[:5] in ("conta", "stops")}


ARM = """
[mechanism]
name = "arm"
[coordinates]
theta = { unit = "rad", start = 0.3 }
[bodies.bob]
mass = 1
position = ["2*sin(theta)", "-2*cos(theta)"]
"""


def test_the_stop_of_an_angle_stands_where_the_arm_strikes_it() -> None:
    """The arm at its limit lies beside the hatched line, whose hatching is on the other side."""
    scene = draw(layout_of(read(ARM + '[stops.s]\nof = "theta"\nupper = "pi/2"\nlower = 0', "arm")))
    walls = {m.part: np.array(m.points) for m in reversed(scene.marks) if m.part.startswith("stops.")}
    (left, right), (low, high) = (np.sort(walls[f"stops.s.{side}"], axis=0) for side in ("upper", "lower"))
    assert left[1] == pytest.approx(right[1])  # the arm lies along x at pi/2, and comes from below
    assert left[1] > 0.0
    assert low[0] == pytest.approx(high[0])  # it hangs at 0, and comes from the right
    assert low[0] < 0.0


@pytest.mark.parametrize(
    ("on", "count"), [("theta_dot", 2), ("2*cos(theta)*theta_dot", 1)], ids=["shoes at a hinge", "a lining"]
)
def test_dry_friction_is_drawn_where_it_acts(on: str, count: int) -> None:
    scene = draw(layout_of(read(ARM + f'[frictions.f]\non = "{on}"\nforce = 1', "arm")))
    drawn = [m for m in scene.marks if m.part == "frictions.f"]
    assert len(drawn) == count
    assert all(isinstance(m, Stroke) and m.closed for m in drawn)


def test_what_rolls_is_a_disc_of_the_radius_on_which_it_does() -> None:
    """A loaded cylinder: its mass centre is beside the axis, which moves by R for each radian."""
    layout = layout_of(load("rolling_cylinder", {}))
    shape = layout.shapes["cylinder"]
    assert shape.kind == DISC
    assert shape.size[0] == pytest.approx(0.2)
    np.testing.assert_allclose(shape.center, [-0.2 * 1.5, 0.2, 0.0], atol=1e-12)


def test_lines_of_one_floor_stand_at_one_level() -> None:
    """A body aslant over a floor that two of its points may touch: the lines are drawn nearer than it is, but level."""
    kind = 'kind = "point_line"\nnormal = "y"\n'
    text = TEXT.replace('phi = { unit = "rad" }', 'phi = { unit = "rad", start = 0.4 }').replace(
        "start = 2.0", "start = 9"
    )
    for end, sign in (("left", "-"), ("right", "+")):
        text += f'[points.{end}]\nposition = ["x {sign} cos(phi)", "y {sign} sin(phi)"]\n'
        text += f'[contacts.{end}_floor]\n{kind}between = ["{end}", "world"]\n'
    scene = draw(layout_of(read(text, "block")))
    lines = [m for m in scene.marks if isinstance(m, Stroke) and m.part.startswith("contacts.")]
    levels = {m.part: max(y for other in lines if other.part == m.part for _, y in other.points) for m in lines}
    assert levels["contacts.left_floor"] == pytest.approx(levels["contacts.right_floor"], abs=1e-9)
