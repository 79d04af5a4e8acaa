"""Where links are and what they weigh: inertia, poses and turns as NumPy arrays.

Lengths are in m, angles in rad, masses in kg, inertias in kg.m2; vectors are (3,), matrices (3, 3).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class LinkInertia:
    """The ``mass`` of a rigid body, its ``center`` (3,) and the ``tensor`` (3, 3) about it, in the axes of its link."""

    mass: float
    center: Floats
    tensor: Floats

    def moved(self, turn: Floats, place: Floats) -> LinkInertia:
        """The inertia in the axes of a frame in which the link is at ``place`` (3,), turned by ``turn`` (3, 3)."""
        return LinkInertia(self.mass, place + turn @ self.center, turn @ self.tensor @ turn.T)

    def __add__(self, other: LinkInertia) -> LinkInertia:
        """Both as one body, by the parallel axis theorem: Goldstein, Classical Mechanics, section 5.3."""
        mass = self.mass + other.mass
        if not mass:
            return LinkInertia(0.0, self.center, self.tensor + other.tensor)
        center = (self.mass * self.center + other.mass * other.center) / mass
        tensors = (part.tensor + part.mass * _offset(part.center - center) for part in (self, other))
        return LinkInertia(mass, center, np.sum([*tensors], axis=0))


def _offset(d: Floats) -> Floats:
    """The tensor (3, 3) of a unit mass at a distance ``d`` (3,)."""
    tensor: Floats = d @ d * np.eye(3) - np.outer(d, d)
    return tensor


@dataclass(frozen=True)
class JointPose:
    """Where a joint stands in its parent link: ``origin`` (3,) and turns by (axis, angle) about the moving axes."""

    origin: Floats
    turns: tuple[tuple[str, float], ...] = ()

    @classmethod
    def of(cls, origin: Floats, matrix: Floats) -> JointPose:
        """The pose of an origin (3,) and a matrix (3, 3) of turns: by yaw, pitch and roll, about z, y and x.

        The roll is that of the matrix turned back by the yaw, so that the three are exact to rounding also where the
        pitch is nearly a quarter turn and yaw and roll are nearly the same.
        """
        cosine = math.hypot(matrix[0, 0], matrix[1, 0])
        pitch = math.atan2(-matrix[2, 0], cosine)
        if cosine > ROUNDING:
            yaw = math.atan2(matrix[1, 0], matrix[0, 0])
            c, s = math.cos(yaw), math.sin(yaw)
            roll = math.atan2(s * matrix[0, 2] - c * matrix[1, 2], c * matrix[1, 1] - s * matrix[0, 1])
        else:  # both turn about the same axis
            yaw, roll = math.atan2(-matrix[0, 1], matrix[1, 1]), 0.0
        return cls(origin, tuple((axis, angle) for axis, angle in zip("zyx", (yaw, pitch, roll), strict=True) if angle))

    @property
    def matrix(self) -> Floats:
        """The turns as one matrix (3, 3)."""
        return reduce(lambda product, turn: product @ about(*turn), self.turns, np.eye(3))


def about(axis: str, angle: float) -> Floats:
    """The matrix (3, 3) of a turn by ``angle`` (rad) about the ``axis`` x, y or z; quarter turns are exact."""
    quarters = round(angle / (np.pi / 2))
    exact = abs(angle - quarters * np.pi / 2) < QUARTER
    c, s = ((1, 0, -1, 0)[quarters % 4], (0, 1, 0, -1)[quarters % 4]) if exact else (np.cos(angle), np.sin(angle))
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    matrix = np.eye(3)
    matrix[[i, i, j, j], [i, j, i, j]] = c, -s, s, c
    return matrix


ROUNDING = 1e-14
"""The cosine of a pitch that is a quarter turn, to the rounding of products of some matrices."""
QUARTER = 6e-12
"""rad; an angle so near to quarter turns is one: files round them to 12 digits."""
