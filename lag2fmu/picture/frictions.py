"""Dry friction and the stops of angles in the picture."""

from __future__ import annotations

import numpy as np
import sympy as sp

from lag2fmu.description.events import Friction, Stop
from lag2fmu.description.parts import Damper
from lag2fmu.graph.batches import Floats
from lag2fmu.language.writer import to_text
from lag2fmu.picture import glyphs
from lag2fmu.picture.attachments import Attachment, attach, slopes_of_places
from lag2fmu.picture.labels import pretty
from lag2fmu.picture.layout import BOX, Layout
from lag2fmu.picture.scene import Canvas

_SHOE, _LINING, _PAD = 0.5, 0.5, 1.6
"""Half the angle (rad) of a brake shoe, half the thickness of a lining, half the length of a pad."""
_REACH, _HALF_STOP = 0.6, 4.0
"""How far along an arm the line of its stop stands, and half the length of this line."""


def draw_frictions(canvas: Canvas, layout: Layout) -> None:
    """Draw all dry frictions: shoes about a hinge, a lining under a sliding body, pads between two bodies."""
    frictions = layout.mechanism.frictions
    places = slopes_of_places(layout.skeleton) if frictions and layout.skeleton.reads else {}
    for friction in frictions if layout.planar else ():
        alike = Damper(friction.name, sp.S.One, rate=friction.on)
        attachment = attach(layout.skeleton, alike, places)
        if attachment is None:
            canvas.notes.append(f"Not drawn: friction {friction.name}, {to_text(friction.on)}.")
        else:
            _friction(canvas, layout, friction, attachment)


def _friction(canvas: Canvas, layout: Layout, friction: Friction, at: Attachment) -> None:
    part = f"frictions.{friction.name}"
    if at.hinge is not None:
        center = layout.at_start[at.hinge]
        reach = layout.radius(at.hinge) + 2.6
        canvas.stroke(part, "friction", glyphs.shoes(center, reach, _SHOE))
        near = center + reach * np.array([0.0, -1.0])
    elif len(at.ends) == 1:
        near = _floor(canvas, layout, part, at.ends[0])
    else:
        i, j = at.ends or at.link or (0, 0)
        a, b = layout.at_start[[i, j]]
        near, (along, across) = (a + b) / 2, glyphs.axes(a, b)
        pads = [near + side * along + np.outer([-1, 1], _PAD * across) for side in (-0.5, 0.5)]
        canvas.stroke(part, "friction", pads)
    canvas.name(part, "friction", pretty(friction.name), near, 2.4)


def _floor(canvas: Canvas, layout: Layout, part: str, spot: int) -> Floats:
    """Draws a lining beside a body that slides along it, below the body if possible; returns its middle (2,)."""
    along, across = layout.direction(spot), layout.across(spot)
    if across[1] < 0:
        along, across = -along, -across
    reach = BOX[1] if layout.half(spot) else layout.radius(spot) or 2.2
    middle: Floats = layout.at_start[spot] - (reach + _LINING) * across
    canvas.stroke(part, "friction", [glyphs.box(middle, BOX[0] * along, _LINING * across)])
    return middle


def draw_hinge_stops(canvas: Canvas, layout: Layout) -> None:
    """Draw a hatched line for every stop of an angle, across the arm of that angle where the arm would touch it."""
    links = {link.ends[0]: link for link in reversed(layout.skeleton.links) if link.arm}
    for stop in layout.mechanism.stops if layout.planar else ():
        name = str(stop.of)
        link = links.get(layout.skeleton.hinges.get(name, -1))
        for side, sign in (("lower", -1.0), ("upper", 1.0)):
            limit = getattr(stop, side)
            if link is not None and limit is not None:
                _hinge_stop(canvas, layout, stop, side, sign, link.ends, limit)


def _hinge_stop(
    canvas: Canvas, layout: Layout, stop: Stop, side: str, sign: float, ends: tuple[int, int], limit: object
) -> None:
    """The stop of the arm between the spots ``ends`` at a ``limit`` of its angle; the hatching points away from it."""
    value = layout.skeleton.number(limit, layout.values)
    there = layout.moved({str(stop.of): value}).at_start[list(ends)]
    later = layout.moved({str(stop.of): value + 1e-3 * sign}).at_start[ends[1]]
    along, across = glyphs.axes(*there)
    beyond = across if float((later - there[1]) @ across) > 0 else -across
    middle = there[0] + _REACH * (there[1] - there[0]) + 0.6 * beyond
    line = [middle - _HALF_STOP * along, middle + _HALF_STOP * along]
    first, second = line if float(beyond @ glyphs.axes(*line)[1]) < 0 else line[::-1]
    canvas.stroke(f"stops.{stop.name}.{side}", "ground", glyphs.hatched(first, second))
