"""The mechanism drawn on a canvas: ground, links, bodies and points; with forces and annotations, the whole scene."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lag2fmu.description.places import WORLD
from lag2fmu.graph.batches import Floats, Values
from lag2fmu.picture import glyphs
from lag2fmu.picture.annotations import annotate
from lag2fmu.picture.forces import draw_forces
from lag2fmu.picture.frictions import draw_frictions, draw_hinge_stops
from lag2fmu.picture.labels import pretty
from lag2fmu.picture.layout import BACK_TO_FRONT, BOX, Layout, rail_of, supports
from lag2fmu.picture.scene import Canvas, Disc, Scene, Stroke
from lag2fmu.picture.shapes import BALL, DISC, PARTICLE, ROD, Shape
from lag2fmu.picture.walls import draw_walls

_NAMED = 8
"""If there are more bodies than this, their names are left out. The same holds for the points."""


def draw(layout: Layout) -> Scene:
    """The whole scene at the start, back to front."""
    canvas = _things(layout, layout)
    if layout.shift:
        canvas.notes.insert(0, "Coordinates are displacements: the bodies are drawn apart.")
    annotate(canvas, layout)
    return canvas.finished(layout.mechanism.title, layout.unit)


def posture(layout: Layout, values: Values) -> tuple[Stroke | Disc, ...]:
    """Links and bodies alone at the state ``values``, to be drawn over the scene."""
    positions = layout.skeleton.positions(values)
    canvas, flat = Canvas(), layout.at(positions)
    _links(canvas, layout, flat)
    _bodies(canvas, layout, flat, layout.shapes_at(values, positions))
    return tuple(canvas.marks)


def frame(layout: Layout, values: Mapping[str, float]) -> tuple[Stroke | Disc, ...]:
    """The whole scene without text at the state ``values``, back to front: one picture of an animation."""
    return tuple(_things(layout, layout.moved(values)).marks)


def _things(start: Layout, layout: Layout) -> Canvas:
    """All things without text: ropes, ground and walls as at the ``start``; links, bodies, points, springs, loads."""
    canvas, flat = Canvas(), layout.at_start
    if layout.pulley is not None:
        from lag2fmu.picture.pulleys import draw_pulley

        canvas.notes.append("Ropes and pulleys are drawn as the bodies move; they have no mass.")
        draw_pulley(canvas, layout.pulley, flat, BOX[0])
    _grounds(canvas, start)
    draw_walls(canvas, start)
    draw_hinge_stops(canvas, start)
    _links(canvas, layout, flat)
    for part, ends in layout.ropes:
        canvas.stroke(part, "rope", [flat[list(ends)]])
    _surfaces(canvas, layout)
    _bodies(canvas, layout, flat, layout.shapes)
    _points(canvas, layout)
    draw_forces(canvas, layout)
    draw_frictions(canvas, layout)
    return canvas


def _grounds(canvas: Canvas, layout: Layout) -> None:
    """Supports at fixed ends of links and springs, crosses at places that are only referred to, and rails."""
    s, flat = layout.skeleton, layout.at_start
    pivots, crosses = supports(layout)
    for i in pivots:
        canvas.stroke("ground", "ground", glyphs.support(flat[i]))
    for i in crosses:
        canvas.stroke("ground", "axis", glyphs.cross(flat[i]))
    for coordinate, i in s.sliders.items():
        _rail(canvas, layout, coordinate, i)


def _rail(canvas: Canvas, layout: Layout, coordinate: str, spot: int) -> None:
    """The ground under a body that slides or rolls."""
    rail = rail_of(layout, spot)
    if rail is not None:
        middle, along, reach = rail
        lines = glyphs.hatched(middle - reach * along, middle + reach * along)
        canvas.stroke(f"coordinates.{coordinate}", "ground", lines)


def _links(canvas: Canvas, layout: Layout, flat: Floats) -> None:
    """Every link once."""
    seen: set[tuple[tuple[float, float], ...]] = set()
    for link in layout.links:
        ends = flat[list(link.ends)]
        key = tuple(sorted((round(float(x), 3), round(float(y), 3)) for x, y in ends))
        if key[0] != key[1] and key not in seen:
            canvas.stroke(f"links.{link.part}", "link" if link in layout.skeleton.rigid else "guide", [ends])
        seen.add(key)


def _surfaces(canvas: Canvas, layout: Layout) -> None:
    """The silhouettes of visuals, the farthest first."""
    s, positions, view = layout.skeleton, layout.positions, layout.view
    found = []
    for surface in layout.seen:
        places = surface.outline
        if surface.frame != WORLD:
            places = positions[s.origins[surface.frame]] + places @ positions[list(s.axes[surface.frame])]
        found.append((float(places.mean(axis=0) @ view.normal), surface.frame, glyphs.hull(view.flat(places))))
    for _, name, line in sorted(found, key=lambda item: item[0]):
        canvas.stroke(f"visuals.{name}", "shape", [line / layout.unit])


def _bodies(canvas: Canvas, layout: Layout, flat: Floats, shapes: Mapping[str, Shape]) -> None:
    """All bodies at one state; a particle without a size gets a radius that shows its mass."""
    s, bodies = layout.skeleton, layout.mechanism.placed_bodies
    heaviest, room = max(s.masses.values(), default=0.0) or 1.0, layout.room
    shown = [name for name in s.masses if s.place[name] not in layout.hidden]
    for name in sorted(shown, key=lambda name: BACK_TO_FRONT.index(shapes[name].kind)):
        radius = room * (1.3 + 1.4 * (max(s.masses[name], 0.0) / heaviest) ** (1 / 3))
        _body(canvas, layout, name, shapes[name], flat[s.place[name]], radius)
    for body in bodies if len(bodies) <= _NAMED else ():
        canvas.name(f"bodies.{body.name}", "name", body.name, flat[s.place[body.name]], 3.2, inside=True)


def _body(canvas: Canvas, layout: Layout, name: str, shape: Shape, center: Floats, radius: float) -> None:
    part, spot = f"bodies.{name}", layout.skeleton.place[name]
    lines = [layout.view.flat(line) / layout.unit + layout.shift.get(spot, 0.0) for line in shape.outline()]
    if shape.kind == PARTICLE and layout.falls(spot):
        canvas.disc(part, "shape", center, layout.half(spot))
    elif shape.kind == PARTICLE and layout.half(spot):
        canvas.stroke(
            part, "shape", [glyphs.box(center, BOX[0] * layout.direction(spot), BOX[1] * layout.across(spot))]
        )
    elif shape.kind == PARTICLE:
        canvas.disc(part, "mass", center, float(shape.size[0]) / layout.unit or radius)
    elif shape.kind == ROD:
        canvas.stroke(part, "rod edge", lines)
        canvas.stroke(part, "rod", lines)
    elif shape.kind == BALL:
        canvas.disc(part, "shape", center, max(float(shape.size[0]) / layout.unit, 1.6))
    else:
        canvas.stroke(part, "shape", lines if shape.kind == DISC else _facing(layout, shape, lines))
    if shape.kind != PARTICLE:
        canvas.disc(part, "center", center, 0.7)


def _facing(layout: Layout, shape: Shape, lines: list[Floats]) -> list[Floats]:
    """The faces of a box that the viewer sees."""
    towards = shape.axes @ layout.view.normal
    faces = [(axis, sign) for axis in range(3) for sign in (1, -1)]
    return [line for (axis, sign), line in zip(faces, lines, strict=True) if sign * towards[axis] > 1e-9]


def _points(canvas: Canvas, layout: Layout) -> None:
    """Joints, where no body is drawn over them, and points."""
    s, flat = layout.skeleton, layout.at_start
    joints = {link.ends[0] for link in s.links if link.arm} - set(s.place.values()) - layout.hidden
    bodies = [flat[s.place[body.name]] for body in layout.mechanism.placed_bodies]
    for i in sorted(joints):
        if not any(np.allclose(flat[i], body, atol=0.5) for body in bodies):
            canvas.disc("joint", "joint", flat[i], 1.0)
    points = [point for point in layout.mechanism.points if s.place[point.name] not in layout.hidden]
    for point in points:
        canvas.disc(f"points.{point.name}", "joint", flat[s.place[point.name]], 0.8)
        if len(points) <= _NAMED:
            canvas.name(f"points.{point.name}", "name", pretty(point.name), flat[s.place[point.name]])
