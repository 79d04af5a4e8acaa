"""The scene, a picture as strokes, discs and labels in the plane, and the canvas that collects them.

A scene is pure data without a drawing library: the page in the FMU and the plots show the same one. Lengths are in
units of the picture, and about 60 units are as long as the mechanism; y points up.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from lag2fmu.graph.batches import Floats
from lag2fmu.picture import glyphs
from lag2fmu.picture.labels import Label, Wish, half_of, placed

_LARGE, _SMALL, _MANY = 3.2, 2.5, 16
"""The heights of large and small letters; scenes with more labels than this get small ones."""
_FAR = 8.0
"""A label that is farther than this from the thing it names is joined to it by a line."""
_SIDES = np.array([[1.2, 0.0], [-1.2, 0.0], [0.0, 1.2], [0.0, -1.2]])
"""The distance of the edges of a rod from its middle line."""


class Style(NamedTuple):
    """How a stroke looks: colour of line and ``fill`` ('' for none), ``width`` in units, dashed or not."""

    color: str
    width: float
    fill: str = ""
    dashed: bool = False


STYLES: Mapping[str, Style] = {
    "ground": Style("#7d8b99", 0.35),
    "axis": Style("#9aa7b4", 0.4, "#9aa7b4"),
    "guide": Style("#9aa7b4", 0.35, dashed=True),
    "link": Style("#44525f", 0.9),
    "rope": Style("#44525f", 0.45),
    "rod edge": Style("#27435c", 2.7),
    "rod": Style("#a9c6df", 2.0),
    "shape": Style("#27435c", 0.5, "#cfdfec"),
    "mass": Style("#27435c", 0.5, "#4c86b8"),
    "center": Style("#27435c", 0.3, "#27435c"),
    "joint": Style("#44525f", 0.5, "#ffffff"),
    "spring": Style("#c05f1f", 0.55),
    "damper": Style("#6b4fa0", 0.55),
    "friction": Style("#8a6d1f", 0.45, "#d9c58a"),
    "load": Style("#b3261e", 0.6, "#b3261e"),
    "gravity": Style("#5a6b7b", 0.55, "#5a6b7b"),
    "coordinate": Style("#1d7a4c", 0.45, "#1d7a4c"),
    "name": Style("#1b2733", 0.3),
    "leader": Style("#9aa7b4", 0.2),
}


class Stroke(NamedTuple):
    """A polyline (k, 2) of ``part``; it is filled if its style has a filling and it is closed."""

    part: str
    style: str
    points: tuple[tuple[float, float], ...]

    @property
    def closed(self) -> bool:
        """Whether the polyline ends where it begins."""
        return len(self.points) > 3 and self.points[0] == self.points[-1]


class Disc(NamedTuple):
    """A filled circle of ``part``."""

    part: str
    style: str
    center: tuple[float, float]
    radius: float


class Scene(NamedTuple):
    """A picture: its marks, back to front, within ``box`` (left, bottom, right, top), with ``notes`` below.

    ``unit`` is the length (m) of one unit of the picture.
    """

    title: str
    marks: tuple[Stroke | Disc, ...]
    labels: tuple[Label, ...]
    notes: tuple[str, ...]
    box: tuple[float, float, float, float]
    unit: float

    def parts(self) -> frozenset[str]:
        """The names of all parts that are drawn, such as 'bodies.bob' and 'springs.wall'."""
        return frozenset(mark.part for mark in self.marks)


@dataclass
class Canvas:
    """Collects marks, and wishes for labels, in the order in which they are drawn."""

    marks: list[Stroke | Disc] = field(default_factory=list)
    wishes: list[Wish] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def stroke(self, part: str, style: str, lines: Iterable[Floats]) -> None:
        """Add polylines (k, 2)."""
        for line in lines:
            points = tuple((round(float(x), 3) + 0.0, round(float(y), 3) + 0.0) for x, y in line)
            self.marks.append(Stroke(part, style, points))

    def disc(self, part: str, style: str, center: Floats, radius: float) -> None:
        """Add a filled circle around ``center`` (2,); lengths in units of the picture."""
        x, y = (round(float(c), 3) + 0.0 for c in center)
        self.marks.append(Disc(part, style, (x, y), round(radius, 3)))

    def name(self, part: str, style: str, text: str, near: Floats, away: float = 2.0, inside: bool = False) -> None:
        """Ask for a label ``text`` at the distance ``away`` from the place ``near`` (2,), or on the thing ``inside``.

        Lengths are in units of the picture.
        """
        self.wishes.append(Wish(part, style, text, (float(near[0]), float(near[1])), _LARGE, away, inside))

    def finished(self, title: str, unit: float) -> Scene:
        """The scene, with the labels where there is room."""
        size = _LARGE if len(self.wishes) <= _MANY else _SMALL
        wishes = [w._replace(size=size) for w in self.wishes]
        strokes = [m for m in self.marks if isinstance(m, Stroke)]
        lines = [np.array(m.points) for m in strokes]
        lines += [line + side for line, m in zip(lines, strokes, strict=True) if m.style == "rod" for side in _SIDES]
        lines += [glyphs.circle(np.array(m.center), m.radius, 16) for m in self.marks if isinstance(m, Disc)]
        labels = tuple(placed(wishes, lines))
        self._lead(labels)
        left, bottom, right, top = bounds(self.marks, labels)
        return Scene(
            title,
            tuple(self.marks),
            labels,
            tuple(self.notes),
            (left - 2.0, bottom - 2.0, right + 2.0, top + 2.0),
            unit,
        )

    def _lead(self, labels: Sequence[Label]) -> None:
        """Add a thin line for each label that is far from the thing it names; ``labels`` are in the wishes' order."""
        for wish, label in zip(self.wishes, labels, strict=True):
            near, middle, half = np.array(wish.near), np.array(label.at), half_of(label.text, label.size)
            edge = middle + np.clip(near - middle, -half, half)
            if float(np.linalg.norm(near - edge)) > _FAR:
                self.stroke(label.part, "leader", [np.array([edge, near])])


def bounds(marks: Iterable[Stroke | Disc], labels: Iterable[Label] = ()) -> tuple[float, float, float, float]:
    """(left, bottom, right, top) of ``marks`` and ``labels``, in units of the picture."""
    low, high = [], []
    for mark in marks:
        points = np.array(mark.points if isinstance(mark, Stroke) else [mark.center])
        reach = 0.0 if isinstance(mark, Stroke) else mark.radius
        low.append(points.min(axis=0) - reach)
        high.append(points.max(axis=0) + reach)
    for label in labels:
        half = np.array([0.3 * len(label.text), 0.6]) * label.size
        low.append(np.array(label.at) - half)
        high.append(np.array(label.at) + half)
    (left, bottom), (right, top) = np.min(low, axis=0), np.max(high, axis=0)
    return float(left), float(bottom), float(right), float(top)
