"""The FMU's icon: the mechanism's sketch as a small picture."""

from __future__ import annotations

from io import BytesIO

from PIL import Image, ImageDraw

from lag2fmu.picture.scene import STYLES, Disc, Scene, Stroke, bounds
from lag2fmu.resources import resource_folder

SIZE = 100
"""The side of the icon in pixels; the value is that of FMI 2.0.5, section 2.3."""
_FINE, _MARGIN, _THINNEST = 4, 4, 1.2
"""By how much pixels are drawn finer along each side; the margin and the thinnest line in pixels of the icon."""
_LEAST = 20.0
"""The least width and height of what the icon shows, in units of the picture, so that one small body stays small."""
_LEFT_OUT = ("coordinate", "axis", "gravity", "name", "leader")
"""Styles that are left out, because in an icon they are too small to be read."""


def icon(scene: Scene | None) -> bytes:
    """``scene`` as a PNG of SIZE x SIZE pixels on white; without a scene, a picture for any mechanism."""
    marks = [] if scene is None else [mark for mark in scene.marks if mark.style not in _LEFT_OUT]
    if not marks:
        return (resource_folder("templates") / "documentation" / "model.png").read_bytes()
    left, bottom, right, top = bounds(marks)
    scale = (SIZE - 2 * _MARGIN) / max(right - left, top - bottom, _LEAST)
    middle = ((left + right) / 2, (bottom + top) / 2)
    image = Image.new("RGB", (_FINE * SIZE, _FINE * SIZE), "white")
    pen = _Pen(ImageDraw.Draw(image), _FINE * scale, middle)
    for mark in marks:
        pen.draw(mark)
    content = BytesIO()
    image.reduce(_FINE).save(content, "PNG")
    return content.getvalue()


class _Pen:
    """Draws marks, ``scale`` pixels for a unit of the picture, its ``middle`` in the middle of the icon."""

    def __init__(self, canvas: ImageDraw.ImageDraw, scale: float, middle: tuple[float, float]) -> None:
        self.canvas, self.scale, self.middle = canvas, scale, middle

    def draw(self, mark: Stroke | Disc) -> None:
        """Draw ``mark`` over what is there."""
        style = STYLES[mark.style]
        width = round(max(style.width * self.scale, _FINE * _THINNEST))
        if isinstance(mark, Disc):
            (x, y), r = self._pixel(mark.center), max(mark.radius * self.scale, 1.0)
            self.canvas.ellipse((x - r, y - r, x + r, y + r), fill=style.fill or None, outline=style.color, width=width)
            return
        points = [self._pixel(point) for point in mark.points]
        if mark.closed and style.fill:
            self.canvas.polygon(points, fill=style.fill)
        self.canvas.line(points, fill=style.color, width=width, joint="curve")

    def _pixel(self, point: tuple[float, float]) -> tuple[float, float]:
        half = _FINE * SIZE / 2
        return (
            half + self.scale * (point[0] - self.middle[0]),
            half - self.scale * (point[1] - self.middle[1]),
        )
