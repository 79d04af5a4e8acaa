"""From space to the plane of the picture: a planar mechanism in its plane, a spatial one from the side and above."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lag2fmu.graph.batches import Floats
from lag2fmu.picture.skeleton import Skeleton

AZIMUTH, ELEVATION = np.radians(30.0), np.radians(18.0)
"""The direction from which mechanisms in space are seen, rad."""
_FLAT = 1e-9
"""Mechanisms whose extent along an axis is below this part of their size lie in a plane."""


@dataclass(frozen=True, eq=False)
class View:
    """A view; ``right`` and ``up`` (3,) are the axes of the picture in world axes.

    - ``plane``: the world axis (0, 1, 2) that is normal to a planar mechanism, None for a spatial one.
    - ``down`` (3,): the direction of gravity.
    """

    right: Floats
    up: Floats
    plane: int | None
    down: Floats | None

    @property
    def normal(self) -> Floats:
        """The unit vector (3,) towards the viewer."""
        return np.cross(self.right, self.up)

    def flat(self, points: Floats) -> Floats:
        """The vectors ``points`` (..., 3) in m, projected on the picture: (..., 2) in m."""
        return np.stack([points @ self.right, points @ self.up], axis=-1)


def view_of(skeleton: Skeleton) -> View:
    """The view that shows the mechanism best."""
    down = _down(skeleton)
    plane = _plane(skeleton)
    if plane is None:
        upward = np.array([0.0, 0.0, 1.0]) if down is None else -down
        first = _square(np.array([1.0, 0.0, 0.0]), upward, np.array([0.0, 1.0, 0.0]))
        second = np.cross(upward, first)
        right = np.cos(AZIMUTH) * first + np.sin(AZIMUTH) * second
        depth = np.cos(AZIMUTH) * second - np.sin(AZIMUTH) * first
        return View(right, np.cos(ELEVATION) * upward + np.sin(ELEVATION) * depth, None, down)
    i, j = (k for k in range(3) if k != plane)
    right, up = np.eye(3)[i], np.eye(3)[j]
    if down is not None and abs(down[plane]) < 0.5:
        up = -down
        right = _square(right, up, np.eye(3)[j])
    return View(right, up, plane, down)


def _square(wanted: Floats, to: Floats, otherwise: Floats) -> Floats:
    """The unit vector nearest to ``wanted`` at a right angle to ``to``; ``otherwise`` if both are parallel."""
    for candidate in (wanted, otherwise):
        rest = candidate - (candidate @ to) * to
        length = float(np.linalg.norm(rest))
        if length > 0.1:
            return np.asarray(rest / length, dtype=np.float64)
    return wanted


def _down(skeleton: Skeleton) -> Floats | None:
    gravity = skeleton.mechanism.gravity
    if gravity is None:
        return None
    size = skeleton.mechanism.dimension
    direction = np.zeros(3)
    if gravity.direction is None:
        direction[size - 1] = -1.0
    else:
        direction[: len(gravity.direction)] = skeleton.vector(gravity.direction, skeleton.start())
    length = float(np.linalg.norm(direction))
    return direction / length if length > 0 else None


def _plane(skeleton: Skeleton) -> int | None:
    """The normal axis of a planar mechanism, along which nothing lies or moves; None for a spatial mechanism."""
    positions = skeleton.positions(skeleton.samples)
    used = sorted({*skeleton.place.values(), *skeleton.origins.values(), *(i for x in skeleton.links for i in x.ends)})
    extent = np.ptp(positions[used], axis=(0, 2))
    for axis in (2, 1, 0):
        if extent[axis] > _FLAT * max(float(extent.max()), 1e-300):
            continue
        normals = [[positions[number][axis] for number in axes] for axes in skeleton.axes.values()]
        if all(np.ptp(entry) <= _FLAT for normal in normals for entry in normal):
            return axis
    return None
