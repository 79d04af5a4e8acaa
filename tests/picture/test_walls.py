"""Floors, walls and stops are drawn where a body would touch them."""

from __future__ import annotations

import numpy as np
import pytest

from lag2fmu.formats.text import read
from lag2fmu.picture import draw, layout_of
from lag2fmu.picture.scene import Stroke

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
