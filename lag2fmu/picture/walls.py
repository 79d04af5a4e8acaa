"""Walls, floors and stops in the picture: a body touches them along a direction that does not change.

The gap to a wall has the slope dgap/dq = n.dr/dq, where r is the place of the body and n the normal out of the wall.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import sympy as sp

from lag2fmu.description import names
from lag2fmu.graph.batches import Floats
from lag2fmu.picture import glyphs
from lag2fmu.picture.attachments import slopes_of_places
from lag2fmu.picture.layout import BOX, GAP, Layout
from lag2fmu.picture.scene import Canvas

_NEAR = 1e-6
"""Directions are equal up to this angle, rad, and slopes up to this part."""
_SAME_LEVEL = 1e-3
"""In units of the picture: parallel walls that are nearer to each other are one."""
_HALF_WALL, _PARTICLE = 9.0, 2.2
"""Half the length of a wall, and the radius of a point that touches one, in units of the picture."""


def draw_walls(canvas: Canvas, layout: Layout, farthest: float = GAP) -> None:
    """Draw a hatched line for every contact and stop between a body and something at rest.

    A wall stands where it is at the start, or ``farthest`` (units of the picture) from the body if it is farther away.
    Lines of one wall, which several places may touch, stand at one level.
    """
    walls = list(_walls(layout, farthest))
    for wall in walls:
        level = max(other.level for other in walls if other.is_of(wall))
        middle = wall.middle + (level - wall.level) * wall.along
        _, across = glyphs.axes(np.zeros(2), wall.along)
        canvas.stroke(wall.part, "ground", glyphs.hatched(middle - _HALF_WALL * across, middle + _HALF_WALL * across))


class _Wall(NamedTuple):
    """The line of a contact or stop: its ``middle`` (2,), drawn ``nearer`` than it is, in units of the picture."""

    part: str
    middle: Floats
    along: Floats
    nearer: float

    @property
    def level(self) -> float:
        """How far away from the bodies it is drawn."""
        return float(self.middle @ self.along)

    def is_of(self, other: _Wall) -> bool:
        """Whether both are lines of the same wall."""
        parallel = float(np.abs(self.along - other.along).max()) < _NEAR
        return parallel and abs(self.level + self.nearer - other.level - other.nearer) < _SAME_LEVEL


def _walls(layout: Layout, farthest: float) -> Iterator[_Wall]:
    """The walls of contacts and stops between a body and something at rest."""
    gaps = list(_gaps(layout))
    places = slopes_of_places(layout.skeleton) if gaps and layout.planar else {}
    for part, gap in gaps if places else []:
        node = layout.skeleton.put(gap)
        found = _touching(layout.skeleton.slopes([node])[0], places)
        if found is None:
            continue
        spot, normal = found
        along = -layout.view.flat(normal)
        away = float(layout.skeleton.vector((gap,), layout.values)[0]) / layout.unit
        drawn = float(np.clip(away, 0.0, farthest))
        middle = layout.at_start[spot] + (_reach(layout, spot, along) + drawn) * along
        yield _Wall(part, middle, along, away - drawn)


def _gaps(layout: Layout) -> Iterator[tuple[str, sp.Expr]]:
    """(part, gap) of every contact and stop."""
    m = layout.mechanism
    for unilateral in m.unilaterals:
        yield unilateral.where, unilateral.gap
    definitions = {d.name: d.expression for d in m.definitions}
    for contact in m.contacts:
        if contact.law == "compliant":
            yield f"contacts.{contact.name}", definitions[names.gap(contact.name)]


def _touching(slope: Floats, places: dict[int, Floats]) -> tuple[int, Floats] | None:
    """(spot, unit vector (3,)): the gap with the ``slope`` (n, samples) changes as the spot moves along the vector."""
    if not np.isfinite(slope).all():
        return None
    for spot, found in places.items():
        normal = np.linalg.lstsq(found.reshape(3, -1).T, slope.ravel(), rcond=None)[0]
        if (
            abs(float(np.linalg.norm(normal)) - 1.0) < _NEAR
            and np.abs(normal @ found.reshape(3, -1) - slope.ravel()).max() < _NEAR
        ):
            return spot, normal
    return None


def _reach(layout: Layout, spot: int, along: Floats) -> float:
    """How far the shape at the spot reaches in the direction ``along`` (2,), in units of the picture."""
    if layout.half(spot):
        return BOX[0] if abs(float(layout.direction(spot) @ along)) > 0.5 else BOX[1]
    return layout.radius(spot) or _PARTICLE * layout.room
