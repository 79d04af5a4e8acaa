"""The FMU's icon: the mechanism's sketch as a small picture.

Pixels are covered by an edge as far as their middles are behind it. So they need not be drawn finer, and a library for
pictures, which takes longer to be imported than all of this, is not needed.
"""

from __future__ import annotations

import struct
import zlib
from itertools import pairwise

import numpy as np

from lag2fmu.graph.batches import Floats
from lag2fmu.picture.scene import STYLES, Disc, Scene, Stroke, bounds
from lag2fmu.resources import resource_folder

SIZE = 100
"""The side of the icon in pixels; the value is that of FMI 2.0.5, section 2.3."""
_MARGIN, _THINNEST, _SMALLEST = 4, 1.2, 0.25
"""The margin, the width of the thinnest line and the radius of the smallest disc, in pixels."""
_LEAST = 20.0
"""The icon shows at least so many units of the picture, so that one small body stays small."""
_LEFT_OUT = ("coordinate", "axis", "gravity", "name", "leader")
"""Styles that are left out, because in an icon they are too small to be read."""


def icon(scene: Scene | None) -> bytes:
    """``scene`` as a PNG of SIZE x SIZE pixels on white; without a scene, a picture for any mechanism."""
    marks = [] if scene is None else [mark for mark in scene.marks if mark.style not in _LEFT_OUT]
    if not marks:
        return (resource_folder("templates") / "documentation" / "model.png").read_bytes()
    left, bottom, right, top = bounds(marks)
    scale = (SIZE - 2 * _MARGIN) / max(right - left, top - bottom, _LEAST)
    pen = _Pen(scale, ((left + right) / 2, (bottom + top) / 2))
    for mark in marks:
        pen.draw(mark)
    return _png(pen.colors)


class _Pen:
    """Draws marks, ``scale`` pixels for a unit of the picture, its ``middle`` in the middle of the icon."""

    def __init__(self, scale: float, middle: tuple[float, float]) -> None:
        self.scale = scale
        self.corner = middle[0] - SIZE / 2 / scale, middle[1] + SIZE / 2 / scale
        self.colors = np.full((SIZE, SIZE, 3), 255.0)

    def draw(self, mark: Stroke | Disc) -> None:
        """Draw ``mark`` over what is there."""
        style = STYLES[mark.style]
        half = max(style.width * self.scale, _THINNEST) / 2
        if isinstance(mark, Disc):
            (x, y), radius = self._pixel(mark.center), max(mark.radius * self.scale, _SMALLEST)
            area = _Area(x - radius, y - radius, x + radius, y + radius)
            beyond = np.sqrt((area.x - x) ** 2 + (area.y - y) ** 2) - radius
            self._cover(area, beyond, style.fill)
            self._cover(area, np.abs(beyond + half) - half, style.color)
            return
        points = np.array([self._pixel(point) for point in mark.points])
        area = _Area(*(points.min(axis=0) - half), *(points.max(axis=0) + half))
        beside, inside = area.beside(points)
        if mark.closed:
            self._cover(area, np.where(inside, -beside, beside), style.fill)
        self._cover(area, beside - half, style.color)

    def _pixel(self, point: tuple[float, float]) -> tuple[float, float]:
        return self.scale * (point[0] - self.corner[0]), self.scale * (self.corner[1] - point[1])

    def _cover(self, area: _Area, beyond: Floats, color: str) -> None:
        """Put ``color``, if any, on the pixels of ``area`` (h, w), whose middles are ``beyond`` (h, w) an edge."""
        if color:
            there = self.colors[area.rows, area.columns]
            there += np.clip(0.5 - beyond, 0.0, 1.0)[..., None] * (list(bytes.fromhex(color[1:])) - there)


class _Area:
    """The pixels of a rectangle, with those that its edges touch: their middles are ``x`` (w,) and ``y`` (h, 1)."""

    def __init__(self, left: float, top: float, right: float, bottom: float) -> None:
        self.columns, self.rows = (
            slice(max(0, int(begin) - 1), max(0, int(end) + 2)) for begin, end in ((left, right), (top, bottom))
        )
        middles = np.arange(SIZE) + 0.5
        self.x, self.y = middles[self.columns], middles[self.rows, None]

    def beside(self, points: Floats) -> tuple[Floats, Floats]:
        """The distance (h, w) of pixels to the line through ``points`` (k, 2), and whether it goes round them."""
        shape = (self.y.size, self.x.size)
        nearest, inside = np.full(shape, np.inf), np.zeros(shape, dtype=bool)
        for (ax, ay), (bx, by) in pairwise(points):
            x, y, dx, dy = self.x - ax, self.y - ay, bx - ax, by - ay
            share = np.clip((x * dx + y * dy) / ((dx * dx + dy * dy) or 1.0), 0.0, 1.0)
            nearest = np.minimum(nearest, (x - share * dx) ** 2 + (y - share * dy) ** 2)
            if dy:
                inside ^= ((y >= 0) != (self.y >= by)) & (x < y / dy * dx)
        return np.sqrt(nearest), inside


def _png(colors: Floats) -> bytes:
    """The picture with these ``colors`` (h, w, 3), 0 to 255, as PNG. Source: W3C, PNG, third edition, chapter 11."""
    height, width, _ = colors.shape
    lines = np.round(colors).astype(np.uint8).reshape(height, -1)
    content = zlib.compress(b"".join(b"\0" + line.tobytes() for line in lines), 9)
    head = struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)  # 8 bits for each of red, green and blue
    chunks = (b"IHDR" + head, b"IDAT" + content, b"IEND")
    packed = (struct.pack(">I", len(chunk) - 4) + chunk + struct.pack(">I", zlib.crc32(chunk)) for chunk in chunks)
    return b"\x89PNG\r\n\x1a\n" + b"".join(packed)
