"""Annotations of the picture: coordinates, axes, gravity, constraints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lag2fmu.description.places import WORLD
from lag2fmu.graph.batches import Floats
from lag2fmu.language.writer import to_text
from lag2fmu.picture import glyphs
from lag2fmu.picture.labels import pretty
from lag2fmu.picture.layout import BOX, Layout
from lag2fmu.picture.scene import Canvas, bounds

_ARCS, _TRIADS, _NAMED, _LETTERS = 8, 8, 8, 9
"""The largest numbers of hinges with an arrow, frames with axes, constraints with a name, and letters of gravity."""
_MOVING = 12
"""The largest number of coordinates and motions with a name."""
_SEEN = 0.15
"""The least length of the image of a unit vector that gets an arrow."""


def annotate(canvas: Canvas, layout: Layout) -> None:
    """Draw all annotations; the world's axes and gravity come last, because they stand beside everything else."""
    _coordinates(canvas, layout)
    _frames(canvas, layout)
    _beside(canvas, layout)
    _constraints(canvas, layout)


def _coordinates(canvas: Canvas, layout: Layout) -> None:
    """Names at the hinges and arrows along the rails, for coordinates and prescribed motions."""
    s, m = layout.skeleton, layout.mechanism
    names = {c.name for c in m.coordinates} | {*m.driven}
    if len(names) > _MOVING:
        canvas.notes.append(f"The names of {len(names)} coordinates are left out.")
        return
    turning: dict[int, list[str]] = {}
    for name in filter(names.__contains__, s.hinges):
        turning.setdefault(s.hinges[name], []).append(name)
    for spot, group in turning.items():
        _turning(canvas, layout, spot, group, arrow=layout.planar and len(turning) <= _ARCS)
    for name, spot in s.sliders.items():
        if name in names and name not in s.hinges:
            _sliding(canvas, layout, spot, name)
    for name in filter(names.__contains__, s.stretches):
        middle = layout.at_start[list(s.stretches[name])].mean(axis=0)
        canvas.name(f"coordinates.{name}", "coordinate", pretty(name), middle, 2.5)
    for together, spot in s.floating.items():
        canvas.name(f"coordinates.{together}", "coordinate", pretty(together), layout.at_start[spot], 3.0)


def _turning(canvas: Canvas, layout: Layout, spot: int, group: Sequence[str], arrow: bool) -> None:
    """The names of the coordinates ``group`` that turn something about one ``spot``."""
    part, text, place, away = f"coordinates.{group[0]}", pretty(", ".join(group)), layout.at_start[spot], 1.5
    if arrow:
        lines = glyphs.arc(place, 9.5 if layout.half(spot) else 5.0, *_swing(layout, spot))
        canvas.stroke(part, "coordinate", lines)
        place, away = lines[0][len(lines[0]) // 2], 1.0
    canvas.name(part, "coordinate", text, place, away)


def _swing(layout: Layout, spot: int) -> tuple[float, float]:
    """The angles (rad) between which the arrow about a hinge runs, beside the link that turns about it."""
    for link in layout.skeleton.links:
        if link.ends[0] == spot:
            along = layout.at_start[link.ends[1]] - layout.at_start[spot]
            angle = float(np.arctan2(along[1], along[0]))
            return angle + 0.25, angle + 1.1
    return 0.4, 2.0


def _sliding(canvas: Canvas, layout: Layout, spot: int, name: str) -> None:
    """An arrow beside the place that a coordinate or a motion shifts."""
    round_ = layout.half(spot) if layout.falls(spot) else layout.radius(spot)
    beside, forward = max(BOX[1], round_) + 3.0, _forward(layout, spot, name)
    across = layout.across(spot) if spot in layout.rails else np.array([-forward[1], forward[0]])
    start = layout.at_start[spot] + beside * across
    end = start + 8.0 * forward
    canvas.stroke(f"coordinates.{name}", "coordinate", glyphs.arrow(start, end, 1.6))
    canvas.name(f"coordinates.{name}", "coordinate", pretty(name), end, 1.0)


def _forward(layout: Layout, spot: int, name: str) -> Floats:
    """The direction (2,) in which the spot slides as the coordinate, or motion, grows."""
    along, s = layout.direction(spot), layout.skeleton
    coordinates = [c.name for c in layout.mechanism.coordinates]
    if name in coordinates:
        moved = layout.view.flat(s.spot_slopes[spot][:, coordinates.index(name), 0])
        return -along if float(moved @ along) < 0 else along
    later = s.positions({**layout.values, name: layout.values[name] + 1e-3 * layout.unit})
    shift = layout.view.flat(later[spot] - layout.positions[spot])
    length = float(np.linalg.norm(shift))
    return shift / length if np.isfinite(length) and length > 0 else along


def _frames(canvas: Canvas, layout: Layout) -> None:
    """The axes of the frames of a spatial mechanism."""
    if layout.planar or len(layout.mechanism.frames) > _TRIADS:
        return
    for name, axes in layout.skeleton.axes.items():
        _axes(
            canvas,
            layout,
            f"frames.{name}",
            layout.at_start[layout.skeleton.origins[name]],
            layout.positions[list(axes)],
        )


def _axes(canvas: Canvas, layout: Layout, part: str, origin: Floats, axes: Floats, size: float = 5.0) -> list[Floats]:
    """Draws arrows along the rows of ``axes`` (3, 3), as far as they can be seen; returns their tips, (2,) each."""
    tips = [origin + size * layout.view.flat(axis) for axis in axes]
    for tip in tips:
        if float(np.linalg.norm(tip - origin)) > _SEEN * size:
            canvas.stroke(part, "axis", glyphs.arrow(origin, tip, 0.24 * size))
    return tips


def _beside(canvas: Canvas, layout: Layout) -> None:
    """The world's axes at the lower left, gravity at the upper right of everything else."""
    left, bottom, right, top = bounds(canvas.marks)
    origin = np.array([left - 10.0, bottom])
    for letter, tip in zip("xyz", _axes(canvas, layout, WORLD, origin, np.eye(3), 7.0), strict=True):
        if float(np.linalg.norm(tip - origin)) > _SEEN * 7.0:
            canvas.name(WORLD, "axis", letter, tip, 0.4)
    gravity, down = layout.mechanism.gravity, layout.view.down
    if gravity is None or down is None or float(np.linalg.norm(layout.view.flat(down))) < _SEEN:
        return
    corner, along = np.array([right + 5.0, top]), 9.0 * layout.view.flat(down)
    canvas.stroke("gravity", "gravity", glyphs.arrow(corner, corner + along))
    letter = to_text(gravity.acceleration)
    canvas.name("gravity", "gravity", pretty(letter) if len(letter) <= _LETTERS else "g", corner + along / 2, 1.2)


def _constraints(canvas: Canvas, layout: Layout) -> None:
    """The names of the constraints, below the picture."""
    names = [c.name for c in layout.mechanism.constraints]
    if names:
        rest = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
        canvas.notes.append(f"Constraints: {', '.join(names[:_NAMED])}{rest}.")
