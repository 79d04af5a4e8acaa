"""The icon: what its pixels cover is as large as what is drawn, and it is a PNG that others read."""

from __future__ import annotations

import io
import math

import matplotlib.image
import numpy as np
import pytest
from numpy.typing import NDArray

from lag2fmu.fmu.icon import SIZE, icon
from lag2fmu.picture.scene import STYLES, Disc, Scene, Stroke

EDGE = SIZE - 8
"""The pixels along the longer side of what is drawn."""
SIDE = 23.0
"""Units along it, so that a unit is 4 pixels."""
WIDTH = 4 * STYLES["load"].width
ENDS = (4 - math.pi) * (WIDTH / 2) ** 2
"""By how much a square around a line's end is larger than the disc there."""


FULL = np.array(list(bytes.fromhex(STYLES["load"].color[1:])))


def drawn(*marks: Stroke | Disc) -> NDArray[np.float64]:
    """The colours (SIZE, SIZE, 3), 0 to 255, of an icon of ``marks``."""
    content = icon(Scene("", marks, (), (), (0.0, 0.0, 1.0, 1.0), 1.0))
    colors = 255 * matplotlib.image.imread(io.BytesIO(content))[..., :3]
    assert colors.shape == (SIZE, SIZE, 3)
    return colors


def coverage(mark: Stroke | Disc) -> float:
    """The area (pixels) that ``mark`` in the colour of loads covers on white."""
    shares = (255 - drawn(mark)) / (255 - FULL)
    assert np.ptp(shares, axis=2).max() < 0.02  # all colours tell the same share
    return float(shares.mean(axis=2).sum())


def stroke(*points: tuple[float, float]) -> Stroke:
    return Stroke("", "load", points)


SQUARE = ((0.0, 0.0), (SIDE, 0.0), (SIDE, SIDE), (0.0, SIDE), (0.0, 0.0))
NOTCHED = (*SQUARE[:4], (SIDE / 2, SIDE / 2), SQUARE[0])


@pytest.mark.parametrize(
    ("mark", "area"),
    [
        (Disc("", "load", (5.0, -3.0), SIDE / 2), math.pi * (EDGE / 2) ** 2),
        (stroke(*SQUARE), (EDGE + WIDTH) ** 2 - ENDS),
        (stroke(*NOTCHED), 3 / 4 * EDGE**2 + (3 + math.sqrt(2)) * EDGE * WIDTH / 2),
        (stroke((0.0, 0.0), (SIDE, 0.0)), (EDGE + WIDTH) * WIDTH - ENDS),
        (stroke((0.0, 0.0), (SIDE, 7.0)), (4 * math.hypot(SIDE, 7.0) + WIDTH) * WIDTH - ENDS),
    ],
    ids=["disc", "square", "polygon with a notch", "level line", "slanted line"],
)
def test_pixels_cover_what_is_drawn(mark: Stroke | Disc, area: float) -> None:
    assert coverage(mark) == pytest.approx(area, rel=0.01)


def test_what_is_drawn_later_lies_above() -> None:
    disc, hole = Disc("", "load", (0.0, 0.0), SIDE / 2), Disc("", "joint", (0.0, 0.0), SIDE / 4)
    middle = SIZE // 2
    assert drawn(disc, hole)[middle, middle] == pytest.approx(255)
    assert drawn(hole, disc)[middle, middle] == pytest.approx(FULL)
