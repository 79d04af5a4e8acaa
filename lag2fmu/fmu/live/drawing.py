"""The sketch of a mechanism as data that a page draws at any state: its parts, and the spots between which they are.

The parts are those of ``picture.drawing``. Lengths are in units of the picture unless a docstring says otherwise.
``spots`` are numbers of places and directions, which the page evaluates.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lag2fmu.description.parts import Load, Spring
from lag2fmu.description.places import WORLD, Body
from lag2fmu.fmu.live.spots import Spots
from lag2fmu.graph.batches import Floats
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.picture.attachments import Attachment
from lag2fmu.picture.forces import beside
from lag2fmu.picture.layout import BACK_TO_FRONT, BOX, GAP, Layout, drawable, layout_of, rail_of, supports
from lag2fmu.picture.scene import Canvas, Stroke
from lag2fmu.picture.shapes import PARTICLE, ROD, Shape, own_link
from lag2fmu.picture.surfaces import Surface, packed, surfaces
from lag2fmu.picture.walls import draw_walls

if TYPE_CHECKING:
    from lag2fmu.picture.pulleys import Pulley

Item = dict[str, Any]
_FAR = 400.0
"""Walls that are farther from their body than this are drawn at this distance, in units of the picture; nearer ones
stay in place, because bodies move on the page and reach them."""
_NAMED = 8
"""If there are more bodies than this, their names are left out. The same holds for the points."""


class Drawing(NamedTuple):
    """The ``data`` for the page's script, the ``spots`` that they refer to, and the ``surfaces`` of visuals as bytes.

    ``notes`` are sentences on what is not drawn.
    """

    data: Item
    spots: Spots
    surfaces: bytes = b""
    notes: tuple[str, ...] = ()


def drawing(mechanism: Mechanism) -> Drawing | None:
    """The drawing of ``mechanism``, None if there is nothing to draw."""
    if not drawable(mechanism):
        return None
    seen, notes = surfaces(mechanism)
    layout = layout_of(mechanism, seen)
    spots = Spots(layout.skeleton)
    items = list(_items(layout, spots))
    view, s = layout.view, layout.skeleton
    handles = [[p.name, spots(s.place[p.name])] for p in (*mechanism.placed_bodies, *mechanism.points)]
    return Drawing(
        {
            "planar": layout.planar,
            "right": _rounded(view.right),
            "up": _rounded(view.up),
            "down": None if view.down is None else _rounded(view.down),
            "unit": layout.unit,
            "shift": {spots(i): _rounded(by) for i, by in layout.shift.items()},
            "items": items,
            "handles": handles,
            "count": len(spots.numbers),
            "residuals": len(spots.residuals()),
        },
        spots,
        b"" if layout.planar else packed(seen),
        tuple(notes),
    )


def _rounded(vector: Sequence[float] | Floats) -> list[float]:
    return [round(float(x), 9) + 0.0 for x in vector]


def _items(layout: Layout, spots: Spots) -> Iterator[Item]:
    """All parts of the picture, back to front."""
    if layout.pulley is not None:
        yield {"k": "pulley", "tree": _pulley(layout.pulley, spots), "height": BOX[0]}
    yield from _ground(layout, spots)
    yield from _links(layout, spots)
    yield from (_surface(layout, spots, surface) for surface in layout.seen)
    yield from _bodies(layout, spots)
    yield from _points(layout, spots)
    for part, attachment in layout.attached:
        if attachment is not None:
            kind = "spring" if isinstance(part, Spring) else "damper"
            yield {"k": kind, "name": part.name, **_attached(layout, spots, attachment)}
    for load in layout.mechanism.loads:
        yield from _load(layout, spots, load)


def _pulley(pulley: Pulley, spots: Spots) -> list[Any]:
    return [spots(end) if isinstance(end, int) else _pulley(end, spots) for end in pulley.ends]


def _ground(layout: Layout, spots: Spots) -> Iterator[Item]:
    """Supports and crosses at spots; rails, which grow with the motion; walls, which stay as at the start."""
    for kind, found in zip(("support", "cross"), supports(layout), strict=True):
        yield from ({"k": kind, "at": spots(i)} for i in found)
    for spot in layout.skeleton.sliders.values():
        rail = rail_of(layout, spot)
        if rail is not None:
            middle, along, reach = rail
            yield {"k": "rail", "of": spots(spot), "middle": _rounded(middle), "along": _rounded(along), "reach": reach}
    canvas = Canvas()
    draw_walls(canvas, layout, _FAR)
    lines = [[_rounded(p) for p in m.points] for m in canvas.marks if isinstance(m, Stroke)]
    if lines and layout.planar:
        yield {"k": "still", "style": "ground", "lines": lines}


def _surface(layout: Layout, spots: Spots, surface: Surface) -> Item:
    """A surface on its frame; in the plane by the places (k, 3) in its axes of which its silhouette is made."""
    s = layout.skeleton
    item: Item = {"k": "surface", "size": [float(f"{np.linalg.norm(surface.vertices, axis=1).max():.6g}")]}
    if surface.frame == WORLD:
        item["at"] = spots.vector((s.graph.zero,) * 3)
    else:
        item["at"] = spots(s.origins[surface.frame])
        item |= {"frame": [spots(i) for i in s.axes[surface.frame]], "axes": np.eye(3).tolist()}
    shape = {"outline": [_rounded(x) for x in surface.outline]} if layout.planar else surface.head()
    return item | {"color": surface.color} | shape


def _links(layout: Layout, spots: Spots) -> Iterator[Item]:
    for link in layout.links:
        style = "link" if link in layout.skeleton.rigid else "guide"
        yield {"k": "link", "ends": [spots(i) for i in link.ends], "style": style}


def _bodies(layout: Layout, spots: Spots) -> Iterator[Item]:
    s, bodies = layout.skeleton, {b.name: b for b in layout.mechanism.placed_bodies}
    heaviest, room = max(s.masses.values(), default=0.0) or 1.0, layout.room
    for name in sorted(s.masses, key=lambda name: BACK_TO_FRONT.index(layout.shapes[name].kind)):
        shape, spot = layout.shapes[name], s.place[name]
        if spot in layout.hidden:
            continue
        item: Item = {"k": shape.kind, "name": name, "at": spots(spot), "label": len(bodies) <= _NAMED}
        if shape.kind == PARTICLE and layout.half(spot) and _falls(layout, spot):
            item |= {"r": BOX[0], "real": True}
        elif shape.kind == PARTICLE and layout.half(spot):
            item |= {"k": "slider", "along": _rounded(layout.direction(spot)), "half": list(BOX)}
        elif shape.kind == PARTICLE and shape.size[0]:
            item |= {"r": round(float(shape.size[0]) / layout.unit, 3), "real": True}
        elif shape.kind == PARTICLE:
            item["r"] = round(room * (1.3 + 1.4 * (max(s.masses[name], 0.0) / heaviest) ** (1 / 3)), 3)
        else:
            item |= _extended(layout, spots, bodies[name], shape)
        yield item


def _falls(layout: Layout, spot: int) -> bool:
    """Whether the body that goes up and down at the spot hangs on nothing, so that it is a ball and no slider."""
    held = {i for _, a in layout.attached if a is not None for i in a.ends}
    return layout.upright(spot) and layout.pulley is None and spot not in held


def _extended(layout: Layout, spots: Spots, body: Body, shape: Shape) -> Item:
    """Size (m) and orientation of a body.

    ``ray`` has the spots between which a rod lies, ``turn`` is the direction of a disc's spoke, and ``frame`` with
    ``axes`` (3, 3) turns the body with a frame.
    """
    s = layout.skeleton
    found: Item = {"size": [float(f"{x:.6g}") for x in shape.size]}
    if body.frame is not None:
        frame = list(s.axes[str(body.frame)])
        turned = shape.axes @ layout.positions[frame].T
        return found | {"frame": [spots(i) for i in frame], "axes": [_rounded(row) for row in turned]}
    g = s.graph
    square = g.divide(s.put(body.inertia), s.put(body.mass))
    scale = g.apply("sqrt", g.multiply(g.constant(3 if shape.kind == ROD else 2), square))
    found["extent"] = spots.vector([scale])
    link = own_link(s, body)
    if link is not None and shape.kind == ROD:
        return found | {"ray": [spots(i) for i in link.ends]}
    if link is not None:  # it rolls about the first end
        found |= {"at": spots(link.ends[0]), "extent": spots.vector([g.constant(Fraction(float(shape.size[0])))])}
    angle = s.put(body.angle)
    return found | {"turn": spots.vector([g.apply("cos", angle), g.apply("sin", angle)])}


def _points(layout: Layout, spots: Spots) -> Iterator[Item]:
    """Joints, where no body is drawn over them, and points."""
    s, flat, m = layout.skeleton, layout.at_start, layout.mechanism
    joints = {link.ends[0] for link in s.links if link.arm} - set(s.place.values()) - layout.hidden
    bodies = [flat[s.place[body.name]] for body in m.placed_bodies]
    for i in sorted(joints):
        if not any(np.allclose(flat[i], body, atol=0.5) for body in bodies):
            yield {"k": "joint", "at": spots(i), "r": 1.0}
    for point in (x for x in m.points if s.place[x.name] not in layout.hidden):
        label = len(m.points) <= _NAMED
        yield {"k": "joint", "at": spots(s.place[point.name]), "r": 0.8, "name": point.name, "label": label}


def _attached(layout: Layout, spots: Spots, attachment: Attachment) -> Item:
    """The place of a spring or damper: at a hinge, between spots, or from a spot or a link to a wall at rest."""
    if attachment.hinge is not None:
        return {"hinge": spots(attachment.hinge), "reach": 1.9 if len(layout.attached) > 4 else 3.2}
    aside = beside(layout, attachment)
    if attachment.along is None:
        ends = [spots(i) for i in attachment.ends]
        return {"ends": ends, "half": [layout.half(i) for i in attachment.ends], "aside": aside}
    if attachment.link is not None:
        a, b = attachment.link
        start = layout.positions[a] + attachment.share * (layout.positions[b] - layout.positions[a])
        item: Item = {"link": [spots(a), spots(b)], "share": attachment.share, "half": [0.0]}
        reach = GAP
    else:
        (spot,) = attachment.ends
        start = layout.positions[spot]
        item = {"ends": [spots(spot)], "half": [layout.half(spot)]}
        reach = GAP + layout.radius(spot)
    wall = start + reach * layout.unit * np.array(attachment.along)
    return item | {"wall": _rounded(wall), "along": list(attachment.along), "aside": aside}


def _load(layout: Layout, spots: Spots, load: Load) -> Iterator[Item]:
    """An arrow for a force, or an arc for a torque; the page scales it by the present magnitude."""
    s = layout.skeleton
    target = str(load.point if load.point is not None else load.body)
    given = load.force if load.force is not None else load.torque
    nodes = s.put.vector(tuple(given) if isinstance(given, tuple) else (given,))
    if not spots.calculable(nodes):
        return
    frame, _ = layout.mechanism.location(target)
    item: Item = {"k": "load", "name": load.name, "at": spots(s.place[target]), "vector": spots.vector(nodes)}
    if load.axes == "frame" and frame in s.axes:
        item["frame"] = [spots(i) for i in s.axes[frame]]
    yield item | {"torque": load.force is None, "half": layout.half(s.place[target])}
