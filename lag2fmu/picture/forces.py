"""Springs, dampers and loads in the picture."""

from __future__ import annotations

import numpy as np

from lag2fmu.description.parts import Damper, Load, Spring
from lag2fmu.graph.batches import Floats
from lag2fmu.language.writer import to_text
from lag2fmu.picture import glyphs
from lag2fmu.picture.attachments import Attachment
from lag2fmu.picture.labels import pretty
from lag2fmu.picture.layout import GAP, Layout
from lag2fmu.picture.scene import Canvas

_FEW = 4
"""The most springs and dampers with which those in hinges are drawn large and with a letter."""
_LETTERS = 9
"""The most characters of a stiffness that is written beside its spring."""
_SOON, _SEEN = 0.37, 0.2
"""A time (s) at which loads that start at zero have a direction; the least length at which a load gets an arrow."""


def draw_forces(canvas: Canvas, layout: Layout) -> None:
    """Draw all springs, dampers and loads; a note names those whose place is unknown."""
    for part, attachment in layout.attached:
        _attached(canvas, layout, part, attachment)
    for load in layout.mechanism.loads:
        _load(canvas, layout, load)


def _attached(canvas: Canvas, layout: Layout, part: Spring | Damper, attachment: Attachment | None) -> None:
    kind = "spring" if isinstance(part, Spring) else "damper"
    label, measure = f"{kind}s.{part.name}", part.stiffness if isinstance(part, Spring) else part.damping
    letter = part.name if measure is None else to_text(measure)
    text = pretty(letter if len(letter) <= _LETTERS else part.name)
    if attachment is None:
        written = part.elongation if isinstance(part, Spring) else part.rate
        canvas.notes.append(f"Not drawn: {kind} {part.name}, {to_text(written)}.")
    elif attachment.hinge is not None:
        _at_hinge(canvas, layout, label, kind, text, attachment.hinge)
    else:
        a, b = _ends(canvas, layout, attachment)
        canvas.stroke(label, kind, glyphs.zigzag(a, b) if kind == "spring" else glyphs.pot(a, b))
        canvas.name(label, kind, text, (a + b) / 2, 3.4)


def _at_hinge(canvas: Canvas, layout: Layout, label: str, kind: str, text: str, spot: int) -> None:
    """A torsion spring as a spiral, a damper in a hinge as a ring."""
    many, center = len(layout.attached) > _FEW, layout.at_start[spot]
    reach = 1.9 if many else 3.2
    lines = glyphs.spiral(center, reach) if kind == "spring" else [glyphs.circle(center, 0.8 * reach)]
    canvas.stroke(label, kind, lines)
    if not many:
        canvas.name(label, kind, text, center, reach + 0.6)


def _ends(canvas: Canvas, layout: Layout, attachment: Attachment) -> tuple[Floats, Floats]:
    """Both ends (2,) in the picture; parts between the same ends are shifted to stand beside each other."""
    aside = beside(layout, attachment)
    if attachment.along is not None:
        return _to_wall(canvas, layout, attachment, aside)
    a, b = layout.at_start[list(attachment.ends)]
    along, across = glyphs.axes(a, b)
    first, second = (layout.half(i) for i in attachment.ends)
    return a + first * along + aside * across, b - second * along + aside * across


def _to_wall(canvas: Canvas, layout: Layout, attachment: Attachment, aside: float) -> tuple[Floats, Floats]:
    """Both ends (2,): at a body or a point of a link, and at a wall that is drawn at a distance."""
    along, across = glyphs.axes(np.zeros(2), layout.view.flat(np.array(attachment.along)))
    if attachment.link is not None:
        a, b = layout.at_start[list(attachment.link)]
        start, reach = a + attachment.share * (b - a), GAP
    else:
        spot = attachment.ends[0]
        start = layout.at_start[spot] + layout.half(spot) * along
        reach = GAP - layout.half(spot) + layout.radius(spot)
    start = start + aside * across
    wall = start + reach * along
    canvas.stroke("ground", "ground", glyphs.hatched(wall - 3.0 * across, wall + 3.0 * across))
    return start, wall


def beside(layout: Layout, attachment: Attachment) -> float:
    """The shift across the line, in units of the picture, of a spring or damper with a partner between its ends."""
    lines = [a for _, a in layout.attached if a is not None and a.hinge is None]
    same = [a for a in lines if (a.ends, a.along, a.link) == (attachment.ends, attachment.along, attachment.link)]
    return 4.6 * (next(k for k, a in enumerate(same) if a is attachment) - (len(same) - 1) / 2)


def _load(canvas: Canvas, layout: Layout, load: Load) -> None:
    """An arrow, an arc about a planar body, or a dot where the load points at the viewer or has no direction yet."""
    part, target = f"loads.{load.name}", str(load.point if load.point is not None else load.body)
    spot = layout.skeleton.place[target]
    place, end = layout.at_start[spot], layout.at_start[spot]
    vector = _direction_of(layout, load, target)
    if load.force is None and not isinstance(load.torque, tuple):
        canvas.stroke(part, "load", glyphs.arc(place, 5.5, -0.6, 1.6))
        end = place + np.array([5.5, 0.0])
    elif float(np.linalg.norm(vector)) < _SEEN:
        canvas.disc(part, "load", place, 1.0)
    else:
        along, reach = vector / float(np.linalg.norm(vector)), layout.half(spot) or 3.0
        end = place + (reach + 12.0) * along
        canvas.stroke(part, "load", glyphs.arrow(place + reach * along, end))
    canvas.name(part, "load", pretty(load.name), end)


def _direction_of(layout: Layout, load: Load, target: str) -> Floats:
    """The direction (2,) in which a load pulls if its inputs are positive, at the start or shortly afterwards."""
    given = load.force if load.force is not None else load.torque
    entries = tuple(given) if isinstance(given, tuple) else ()
    frame, _ = layout.mechanism.location(target)
    pulling = {u.name: 1.0 for u in layout.mechanism.plain_inputs if not u.start}
    for time in (0.0, _SOON):
        vector = np.zeros(3)
        vector[: len(entries)] = layout.skeleton.vector(entries, {**layout.values, **pulling, "t": time})
        if load.axes == "frame" and frame in layout.skeleton.axes:
            vector = vector @ layout.positions[list(layout.skeleton.axes[frame])]
        if np.isfinite(vector).all() and np.any(vector):
            return layout.view.flat(vector / float(np.linalg.norm(vector)))
    return np.zeros(2)
