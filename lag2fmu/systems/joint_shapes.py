"""What a joint holds: the directions of its forces at both ends, and how far it is open.

All is in space; in the plane z is the normal. A direction w = (F, T) of the second end is a unit force F on the second
place with a torque T. The first place gets the opposite, w' = -(F, T + e x F), where e is the way from the first place
to the second. The gap is g = F.e + T.phi with the angle phi of one frame in the other, and its rate
w.(v, omega) + w'.(v', omega') by the motion of the two places.

Source: P. E. Nikravesh, Computer-Aided Analysis of Mechanical Systems, chapter 7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from lag2fmu.description.joints import across
from lag2fmu.errors import SimulationError
from lag2fmu.systems.joints import NUMBERS, Ends, groups_of, is_planar
from lag2fmu.verify.run import Floats

_POINT = 1e-9
"""A rod that is shorter (m) at the start joins two places at one point, but for rounding."""


class PlaceMotion(NamedTuple):
    """How a place lies and moves, in world axes: p (3,) in m, R (3, 3), v (3,) in m/s, omega (3,) in rad/s."""

    p: Floats
    R: Floats
    v: Floats
    omega: Floats


def skew(a: Floats) -> Floats:
    """The matrix (3, 3) of a x for a vector ``a`` (3,): a x b in a tenth of the time of numpy.cross."""
    x, y, z = a
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


@dataclass(frozen=True)
class JointShape:
    """A joint at one time.

    - ``directions`` (2, 6, k): those of the wrench on the first and the second place; ``rates``: their derivatives.
    - ``gap`` (k,) in m and rad, ``speed`` (k,): its rate.

    If the joint has a force of its own, one direction more, the last one, is that of this force. Its gap is the
    coordinate q of the joint then.
    """

    directions: Floats
    rates: Floats
    gap: Floats
    speed: Floats


class JointLaw:
    """What a joint demands, whatever the motion of its ends.

    - ``held`` (k,): which of its directions hold something; the joint's own force does not.
    - ``lengths`` (k,): which gaps are in m; others are in rad.
    - ``own``: the ``NUMBERS`` of its own force, if it ``acts``.
    """

    def __init__(self, ends: Ends) -> None:
        """Choose the directions of the joint: those of a common point are along the world's axes, others turn along."""
        axis = np.array(ends.joint.axis) / np.linalg.norm(ends.joint.axis)
        groups, columns = groups_of(ends), _columns(ends, axis)
        self.acts = ends.joint.acts
        self.held = np.arange(len(columns)) < len(columns) - self.acts
        self.own = np.array([getattr(ends.joint, name) for name in NUMBERS])
        self._normals, self._last = _across(columns[-1][1] + columns[-1][0]), 0.0
        self._forces, self._torques = (np.array([column[i] for column in columns]).T for i in (0, 1))
        self._still = self._forces * [column[2] for column in columns]
        self.lengths = self._forces.any(axis=0)
        self._axis, self._turns, self._tilts = axis, "turn" in groups, "axis" in groups
        self._joint, self._rod, self._length = ends.joint, "rod" in groups, 0.0

    def shape(self, first: PlaceMotion, second: PlaceMotion) -> JointShape:
        """The joint where its ends move like ``first`` and ``second``.

        Raises SimulationError for a rod without length.
        """
        if self._rod:
            return self._along(second.p - first.p, second.v - first.v)
        carried, T = first.R @ (self._forces - self._still), first.R @ self._torques
        F = self._still + carried
        e, e_dot = second.p - first.p, second.v - first.v
        turning, over, passing = map(skew, (first.omega, e, e_dot))
        F_dot, T_dot = turning @ carried, turning @ T
        arm, arm_dot = over @ F, passing @ F + over @ F_dot
        directions = np.array([[-F, -T - arm], [F, T]]).reshape(2, 6, -1)
        rates = np.array([[-F_dot, -T_dot - arm_dot], [F_dot, T_dot]]).reshape(2, 6, -1)
        gap = F.T @ e + T.T @ self._angle(first.R, second.R)
        twists = [np.concatenate([motion.v, motion.omega]) for motion in (first, second)]
        if self.acts and self._torques[:, -1].any():
            gap[-1] = self._turned(first.R.T @ second.R)
        speed = directions[0].T @ twists[0] + directions[1].T @ twists[1]
        return JointShape(directions, rates, gap, speed)

    def _along(self, e: Floats, e_dot: Floats) -> JointShape:
        """The rod that reaches over ``e`` (3,) in m, with its rate (3,): it keeps the length that it has first."""
        length = float(np.linalg.norm(e))
        if length < _POINT and not self._length:
            raise SimulationError(f"the joint {self._joint}: both places are at one point; a rod joins two")
        self._length = self._length or length
        u = e / length
        u_dot, none = (e_dot - u * (u @ e_dot)) / length, np.zeros(3)
        directions, rates = (np.array([[*-x, *none], [*x, *none]])[:, :, None] for x in (u, u_dot))
        return JointShape(directions, rates, np.array([length - self._length]), np.array([u @ e_dot]))

    def _turned(self, turn: Floats) -> float:
        """The angle (rad) by which the matrix ``turn`` (3, 3) turns about the axis, next to that of the last call."""
        x, y = self._normals
        angle = float(np.arctan2(y @ turn @ x - x @ turn @ y, x @ turn @ x + y @ turn @ y))
        self._last = angle + 2 * np.pi * round((self._last - angle) / (2 * np.pi))
        return self._last

    def _angle(self, first: Floats, second: Floats) -> Floats:
        """By how much the second frame, or its axis, is turned in the first one (3,), for small angles, in rad."""
        if self._turns:
            turn = first.T @ second
            found: Floats = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
            return first @ found
        return np.cross(first @ self._axis, second @ self._axis) if self._tilts else np.zeros(3)


def _columns(ends: Ends, axis: Floats) -> list[tuple[Floats, Floats, bool]]:
    """The directions (force, torque) of a joint, and whether they are along the world's axes; its own force is last."""
    planar, groups = is_planar(ends.first), groups_of(ends)
    unit, none = np.eye(3), np.zeros(3)
    normals = [np.cross(unit[2], axis)] if planar else _across(axis)
    forces = {"point": unit[: 2 if planar else 3], "line": normals, "plane": [axis], "rod": [axis]}
    torques = {"axis": normals, "turn": unit[2 if planar else 0 :]}
    columns = [(f, none, group == "point") for group in groups for f in forces.get(group, ())]
    columns += [(none, t, False) for group in groups for t in torques.get(group, ())]
    if ends.joint.acts and ends.joint.kind == "revolute":
        columns.append((none, unit[2] if planar else axis, False))
    elif ends.joint.acts:
        columns.append((axis, none, False))
    return columns


def _across(axis: Floats) -> Sequence[Floats]:
    """Two unit vectors across the unit vector ``axis`` and each other, those of a joint in a mechanism."""
    return [np.array(normal, dtype=float).ravel() for normal in across(tuple(axis.tolist()))]
