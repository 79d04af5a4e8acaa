"""Newton's method for the forces of joints in one step, by their values at the two Gauss points.

Two forces f1, f2 give the impulse (f1 + f2) h/2, and move what they push by (late f1 + early f2) h^2/2. A multiple of
the quadratic function that is 0 at both points adds to neither. In between the joints are Hermite's polynomials of
time, by their states at both ends of the step and at the begin of the last one. Source: E. Hairer, C. Lubich,
G. Wanner, Geometric Numerical Integration, section II.1.2, for the Gauss points.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from lag2fmu.systems.joint_system import JointState, JointSystem
from lag2fmu.verify.run import Floats

GAUSS = 0.5 + np.array([-1.0, 1.0]) * np.sqrt(3.0) / 6
EARLY, LATE = GAUSS.tolist()
"""The Gauss points, as parts of a step."""


class Passing(NamedTuple):
    """The joints within a step: ``directions`` (n, k), ``turned`` (n, n) as of a JointState, gaps (k,), their rates."""

    directions: Floats
    turned: Floats
    places: Floats
    rates: Floats


class Course:
    """The joints by the time (s) in a step, from their ``states`` at ``times`` (s), of which the last is its end."""

    def __init__(self, states: Sequence[JointState], times: Sequence[float]) -> None:
        """Look up what is interpolated."""
        self._scale, powers = times[-1] - times[0], np.arange(2 * len(times))
        x = np.array(times)[:, None] / self._scale
        # rows: the monomials and their derivatives, at all times
        self._weights = np.linalg.inv(np.vstack([x**powers, powers * x ** np.maximum(powers - 1, 0)]))
        self._powers = powers
        self._known = [
            np.array([getattr(state, name) for state in states] + [self._scale * getattr(s, rate) for s in states])
            for name, rate in (("directions", "rates"), ("turned", "turning"), ("gap", "speed"))
        ]

    def at(self, time: float) -> Passing:
        """The joints at a ``time`` (s) of the step."""
        by, change = self._by(time)
        directions, turned, places = ((by @ x.reshape(len(by), -1)).reshape(x.shape[1:]) for x in self._known)
        return Passing(directions, turned, places, change @ self._known[2])

    def slopes(self, time: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """How gap and rate at a ``time`` (s) follow (gap, speed) at the end of the step."""
        count = len(self._powers) // 2
        (gap, speed), (gap_rate, speed_rate) = (x[count - 1 :: count].tolist() for x in self._by(time))
        return (gap, self._scale * speed), (gap_rate, self._scale * speed_rate)

    def _by(self, time: float) -> tuple[Floats, Floats]:
        """What a value and its rate at a ``time`` (s) are of the values, and the scaled rates, that are known."""
        x, powers = time / self._scale, self._powers
        return x**powers @ self._weights, powers * x ** np.maximum(powers - 1, 0) @ self._weights / self._scale


class Learned:
    """What the runs of steps tell of Newton's matrix beyond what was measured, by Broyden's update.

    Steps that follow each other miss in nearly the same way, so that it is kept from step to step. Source: C. G.
    Broyden, A class of methods for solving nonlinear simultaneous equations, Mathematics of Computation 19 (1965).
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """The matrix is measured anew."""
        self._known: Floats = np.zeros((0, 0))
        self._last: tuple[Floats, Floats] | None = None

    def begin(self) -> None:
        """A step begins, whose first run follows no change."""
        self._last = None

    def change(self, matrix: Floats, right: Floats, h: float) -> Floats:
        """The x (n,) that solves ``matrix`` x = ``right`` (n,), with what is known better of the matrix (n, n).

        After it was applied to the step ``h`` (s), the next ``right`` tells what it did.
        """
        if self._known.shape != matrix.shape:
            self._known = np.zeros(matrix.shape)
        whole: Floats = matrix + h * self._known
        if self._last is not None:
            x, before = self._last
            update: Floats = np.outer(before - right - whole @ x, x) / float(x @ x)
            self._known += update / h
            whole += update
        found: Floats = np.asarray(np.linalg.solve(whole, right), dtype=np.float64)
        self._last = found, right
        return found


def correction(
    joints: JointSystem,
    learned: Learned,
    end: JointState,
    forces: Floats,
    before: Sequence[Passing],
    after: Course,
    h: float,
) -> tuple[Floats, Floats]:
    """The change (2, k) of the ``forces`` (2, k) that closes the ``joints`` after a step ``h`` (s) with this ``end``.

    ``before`` is what the forces were given along at the Gauss points, ``after`` what the joints did. The joints' own
    forces have to be what the motion there makes them. The second value (2, k) is what the change is to close: speeds
    of joints, and gaps by ``h``; of own forces the speeds that they miss.
    """
    own, excess = ~joints.held, np.zeros_like(forces)
    speeds = [joints.effect(end, x.turned, x.directions) * h / 2 for x in before]
    gaps = [LATE * speeds[0], EARLY * speeds[1]]
    missed = np.array([end.speed, end.gap / h]) * joints.held
    rows = np.array([speeds, gaps])
    if own.any():
        passed = map(after.at, GAUSS * h)
        told = [f - joints.own_forces(x.places, x.rates) for f, x in zip(forces, passed, strict=True)]
        excess = np.array(told) * own
        rows[:, :, own] = _own_rows(joints, speeds, gaps, after, h)[:, :, own]
    basis = joints.basis
    matrix = np.swapaxes(basis.T @ rows @ basis, 1, 2).reshape(2 * len(basis.T), -1)
    right = -(missed + excess) @ basis
    found = learned.change(matrix, right.ravel(), h).reshape(2, -1) @ basis.T
    reached = missed @ joints.shared
    reached[0] += sum(change @ force for change, force in zip(speeds, excess, strict=True)) * own
    return found, reached


def _own_rows(joints: JointSystem, speeds: Sequence[Floats], gaps: Sequence[Floats], after: Course, h: float) -> Floats:
    """What the excess (2, k) of the ``joints``' own forces is of the forces (2, k) in a step ``h`` (s), (2, 2, k, k).

    ``speeds`` and ``gaps`` (2, k, k) at the end, by ``h``, are those that the forces change, ``after`` is the course.
    """
    found = []
    for n, c in enumerate(GAUSS):
        place, rate = after.slopes(c * h)
        for i in (0, 1):
            by_place, by_rate = (a * h * gaps[i] + b * speeds[i] for a, b in (place, rate))
            change = joints.damping[:, None] * by_rate + joints.stiffness[:, None] * by_place
            found.append(change + (n == i) * np.eye(len(change)))
    return np.array(found).reshape(2, 2, *found[0].shape)


def wrenches_of(directions: Sequence[Floats], forces: Floats, bend: Floats, h: float) -> Floats:
    """The wrenches on all places at the begin of a step ``h`` (s), with two derivatives (3, n).

    ``forces`` (2, k) are those at the Gauss points, ``bend`` (k,) their second derivative, ``directions`` (n, k) those
    at the first Gauss point, in the middle, and at the second one.
    """
    d = (LATE - EARLY) / 2 * h
    middle = forces.mean(axis=0) - d**2 / 2 * bend
    early, half, late = (x @ force for x, force in zip(directions, (forces[0], middle, forces[1]), strict=True))
    slope, curve = (late - early) / (2 * d), (early - 2 * half + late) / d**2
    return np.array([half - slope * h / 2 + curve * h**2 / 8, slope - curve * h / 2, curve])
