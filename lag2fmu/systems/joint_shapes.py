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

from lag2fmu.systems.joints import Ends, groups_of, is_planar
from lag2fmu.verify.run import Floats


class PlaceMotion(NamedTuple):
    """How a place lies and moves, in world axes: p (3,) in m, R (3, 3), v (3,) in m/s, omega (3,) in rad/s."""

    p: Floats
    R: Floats
    v: Floats
    omega: Floats


@dataclass(frozen=True)
class JointShape:
    """A joint at one time.

    - ``directions`` (2, 6, k): those of the wrench on the first and the second place; ``rates``: their derivatives.
    - ``gap`` (k,) in m and rad, ``speed`` (k,): its rate.
    """

    directions: Floats
    rates: Floats
    gap: Floats
    speed: Floats


class JointLaw:
    """What a joint demands, whatever the motion of its ends."""

    def __init__(self, ends: Ends) -> None:
        """Choose the directions of the joint: those of a common point are along the world's axes, others turn along."""
        planar, groups = is_planar(ends.first), groups_of(ends)
        axis = np.array(ends.joint.axis) / np.linalg.norm(ends.joint.axis)
        across = _across(axis)
        if planar:
            across = [np.array([-axis[1], axis[0], 0.0])] if "line" in groups else across
        world = np.eye(3)[:2] if planar else np.eye(3)
        forces = {"point": world, "line": across, "plane": [axis]}
        torques = {"axis": across, "turn": np.eye(3)[2:] if planar else np.eye(3)}
        columns = [(f, np.zeros(3), g == "point") for g in groups for f in forces.get(g, ())]
        columns += [(np.zeros(3), t, False) for g in groups for t in torques.get(g, ())]
        self._forces, self._torques = (np.array([column[i] for column in columns]).T for i in (0, 1))
        self._still = np.array([column[2] for column in columns])
        self._axis, self._turns, self._tilts = axis, "turn" in groups, "axis" in groups

    @property
    def count(self) -> int:
        """The number k of its equations."""
        return len(self._still)

    def lengths(self, size: float) -> Floats:
        """What the gaps are compared with (k,): ``size`` (m) for those that are lengths, 1 rad for angles."""
        found: Floats = np.where(self._forces.any(axis=0), size, 1.0)
        return found

    def shape(self, first: PlaceMotion, second: PlaceMotion) -> JointShape:
        """The joint where its ends move like ``first`` and ``second``."""
        F, T = (np.where(self._still, x, first.R @ x) for x in (self._forces, self._torques))
        turning = first.omega[:, None]
        F_dot = np.where(self._still, 0.0, np.cross(turning, F, axis=0))
        T_dot = np.cross(turning, T, axis=0)
        e, e_dot = second.p - first.p, second.v - first.v
        arm = np.cross(e[:, None], F, axis=0)
        arm_dot = np.cross(e_dot[:, None], F, axis=0) + np.cross(e[:, None], F_dot, axis=0)
        directions = np.array([-np.vstack([F, T + arm]), np.vstack([F, T])])
        rates = np.array([-np.vstack([F_dot, T_dot + arm_dot]), np.vstack([F_dot, T_dot])])
        gap = F.T @ e + T.T @ self._angle(first.R, second.R)
        twists = [np.concatenate([motion.v, motion.omega]) for motion in (first, second)]
        speed = directions[0].T @ twists[0] + directions[1].T @ twists[1]
        return JointShape(directions, rates, gap, speed)

    def _angle(self, first: Floats, second: Floats) -> Floats:
        """By how much the second frame, or its axis, is turned in the first one (3,), for small angles, in rad."""
        if self._turns:
            turn = first.T @ second
            found: Floats = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
            return first @ found
        return np.cross(first @ self._axis, second @ self._axis) if self._tilts else np.zeros(3)


def _across(axis: Floats) -> Sequence[Floats]:
    """Two unit vectors across the unit vector ``axis`` and each other."""
    first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    return [first, np.cross(axis, first)]
