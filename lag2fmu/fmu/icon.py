"""The FMU's icon: the mechanism's sketch as a small picture.

Each mark is painted by the distances of the pixels from it. This is less than to import a library for pictures.
"""

from __future__ import annotations

import struct
import zlib
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lag2fmu.graph.batches import Floats
from lag2fmu.picture.scene import STYLES, Disc, Scene, Stroke, bounds
from lag2fmu.resources import resource_folder

SIZE = 100
"""The side of the icon in pixels; the value is that of FMI 2.0.5, section 2.3."""
_MARGIN, _THINNEST = 4, 1.2
"""The margin and the thinnest line in pixels."""
_LEAST = 20.0
"""The least width and height of what the icon shows, in units of the picture, so that one small body stays small."""
_LEFT_OUT = ("coordinate", "axis", "gravity", "name", "leader")
"""Styles that are left out, because in an icon they are too small to be read."""

Places = NDArray[np.complex128]
"""Places x + iy in units of the picture."""


def icon(scene: Scene | None) -> bytes:
    """``scene`` as a PNG of SIZE x SIZE pixels on white; without a scene, a picture for any mechanism."""
    marks = [] if scene is None else [mark for mark in scene.marks if mark.style not in _LEFT_OUT]
    if not marks:
        return (resource_folder("templates") / "documentation" / "model.png").read_bytes()
    left, bottom, right, top = bounds(marks)
    pixel = max(right - left, top - bottom, _LEAST) / (SIZE - 2 * _MARGIN)  # its side in units of the picture
    across = pixel * (np.arange(float(SIZE)) - (SIZE - 1) / 2)
    x, y = (left + right) / 2 + across, (bottom + top) / 2 - across
    image = np.full((3, SIZE, SIZE), 255.0)
    for mark in marks:
        _draw(mark, image, x, y, pixel)
    return _png(np.rint(image).astype(np.uint8))


def _draw(mark: Stroke | Disc, image: Floats, x: Floats, y: Floats, pixel: float) -> None:
    """Draw ``mark`` over ``image`` (3, SIZE, SIZE), whose columns are at ``x`` and rows at ``y`` (SIZE,)."""
    style = STYLES[mark.style]
    half = max(style.width / pixel, _THINNEST) / 2
    left, bottom, right, top = bounds([mark])
    reach = (half + 1) * pixel
    columns = slice(*np.searchsorted(x, (left - reach, right + reach)))
    rows = slice(*np.searchsorted(-y, (-top - reach, -bottom + reach)))
    near = image[:, rows, columns]
    outside = _outside(mark, x[columns] + 1j * y[rows, np.newaxis]) / pixel
    if style.fill and (isinstance(mark, Disc) or mark.closed):
        _paint(near, style.fill, -outside)
    _paint(near, style.color, half - np.abs(outside))


def _outside(mark: Stroke | Disc, places: Places) -> Floats:
    """How far each of ``places`` is outside of ``mark``: its distance from the line, negative within a closed one."""
    if isinstance(mark, Disc):
        return np.abs(places - complex(*mark.center)) - mark.radius
    distance, within = np.full(places.shape, np.inf), np.zeros(places.shape, bool)
    for begin, end in pairwise(complex(*point) for point in mark.points):
        beside = places - begin
        along = beside * (end - begin).conjugate()
        part = np.clip(along.real / max(abs(end - begin) ** 2, 1e-12), 0, 1)
        distance = np.minimum(distance, np.abs(beside - part * (end - begin)))
        level = (begin.imag > places.imag) != (end.imag > places.imag)
        within ^= level & ((along.imag > 0) == (end.imag > begin.imag))  # what lies on its left is crossed once more
    return np.where(within & mark.closed, -distance, distance)


def _paint(image: Floats, color: str, depth: Floats) -> None:
    """Paint the pixels of ``image`` whose middle is at the ``depth`` (pixels) within an area, its rim in part."""
    red_green_blue = np.array([*bytes.fromhex(color.removeprefix("#"))])
    image += np.clip(depth + 0.5, 0, 1) * (red_green_blue[:, np.newaxis, np.newaxis] - image)


def _png(pixels: NDArray[np.uint8]) -> bytes:
    """``pixels`` (3, height, width), red, green and blue, as a PNG. Source: ISO/IEC 15948, sections 5 and 11."""
    _, height, width = pixels.shape
    rows = np.moveaxis(pixels, 0, 2).reshape(height, 3 * width)
    filtered = np.insert(rows, 0, 0, axis=1)  # 0: each row as it is
    chunks = {
        b"IHDR": struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0),
        b"IDAT": zlib.compress(filtered.tobytes()),
        b"IEND": b"",
    }
    framed = (
        struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
        for kind, content in chunks.items()
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(framed)
