"""A scene as a small SVG element, for pages and notebooks."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import groupby

from lag2fmu.codegen.templates import render
from lag2fmu.picture.scene import STYLES, Disc, Scene, Stroke

Mark = Stroke | Disc

_WIDTH, _HEIGHT = 640.0, 520.0
"""The most that the sketch takes of the page, in pixels."""


def sketch(scene: Scene) -> str:
    """``scene`` as an SVG element; the same scene gives the same text."""
    left, bottom, right, top = scene.box
    wide, high = right - left, top - bottom
    context: dict[str, object] = {
        "title": scene.title,
        "view_box": " ".join(map(_number, (left, -top, wide, high))),
        "width": _number(min(_WIDTH, _HEIGHT * wide / high, 8.0 * wide)),
        "paths": list(_paths(scene.marks)),
        "labels": [
            {
                "x": _number(label.at[0]),
                "y": _number(-label.at[1] + 0.35 * label.size),
                "size": _number(label.size),
                "color": STYLES[label.style].color,
                "text": label.text,
            }
            for label in scene.labels
        ],
    }
    return render("documentation/sketch.svg.jinja", context)


def _paths(marks: Iterable[Mark]) -> Iterator[dict[str, object]]:
    """Neighbours of one style as one path."""
    for (name, filled), group in groupby(marks, key=lambda mark: (mark.style, _filled(mark))):
        style = STYLES[name]
        yield {
            "d": "".join(map(_outline, group)),
            "style": style,
            "fill": style.fill if filled else "",
            "dashes": ' stroke-dasharray="1.6 1.6"' if style.dashed else "",
        }


def _filled(mark: Mark) -> bool:
    return isinstance(mark, Disc) or mark.closed


def _outline(mark: Mark) -> str:
    """The path of a polyline, or of a circle as two arcs."""
    if isinstance(mark, Disc):
        (x, y), r = mark.center, mark.radius
        half = f"a{_number(r)} {_number(r)} 0 1 0"
        return f"M{_number(x - r)} {_number(-y)}{half} {_number(2 * r)} 0{half} {_number(-2 * r)} 0z"
    points = mark.points[:-1] if mark.closed else mark.points
    return "M" + "L".join(f"{_number(x)} {_number(-y)}" for x, y in points) + ("z" if mark.closed else "")


def _number(x: float) -> str:
    """Two decimals at most: a hundredth of a unit is not seen."""
    return f"{round(x, 2) + 0.0:g}" if abs(x) < 1000 else f"{x:.0f}"
