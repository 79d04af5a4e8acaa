"""Newton's method for the forces of joints in one step, by their values at the two Gauss points.

Two forces f1, f2 give the impulse (f1 + f2) h/2, and move what they push by (late f1 + early f2) h^2/2. In between the
joints are cubic polynomials of time, by their state at both ends of the step. Source: E. Hairer, C. Lubich, G. Wanner,
Geometric Numerical Integration, section II.1.2, for the Gauss points.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
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


Course = Callable[[float], Passing]
"""The joints by the time (s) in a step."""


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
    after: Sequence[Passing],
    h: float,
) -> tuple[Floats, Floats]:
    """The change (2, k) of the ``forces`` (2, k) that closes the ``joints`` after a step ``h`` (s) with this ``end``.

    ``before`` is what the forces were given along at the Gauss points, ``after`` what was there. Forces of the joints'
    own have to be what the motion there makes them. The second value (2, k) is what the change is to close: speeds of
    joints, and gaps by ``h``; of own forces the speeds that they miss.
    """
    own = ~joints.held
    speeds = [joints.effect(end, x.turned, x.directions) * h / 2 for x in before]
    gaps = [LATE * speeds[0], EARLY * speeds[1]]
    missed = np.array([end.speed, end.gap / h]) * joints.held
    excess = np.array([f - joints.own_forces(x.places, x.rates) for f, x in zip(forces, after, strict=True)]) * own
    rows = np.array([speeds, gaps])
    for n, c in enumerate(GAUSS):
        place, rate = _slopes(c, h)
        for i in (0, 1):
            by_place, by_rate = (a * h * gaps[i] + b * speeds[i] for a, b in (place, rate))
            change = joints.damping[:, None] * by_rate + joints.stiffness[:, None] * by_place
            rows[n, i][own] = (change + (n == i) * np.eye(len(own)))[own]
    basis = joints.basis
    matrix = np.block([[basis.T @ rows[n, i] @ basis for i in (0, 1)] for n in (0, 1)])
    right = -(missed + excess) @ basis
    found = learned.change(matrix, right.ravel(), h).reshape(2, -1) @ basis.T
    reached = missed @ joints.shared
    reached[0] += sum(change @ force for change, force in zip(speeds, excess, strict=True)) * own
    return found, reached


def _slopes(c: float, h: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """How gap and rate at the part ``c`` of a step ``h`` (s) follow (gap, speed) at its end, see ``passing_of``."""
    d = 1.0 - c
    return (c * c * (1 + 2 * d), -h * c * c * d), (6 * c * d / h, c * (c - 2 * d))


def passing_of(start: JointState, end: JointState, h: float, time: float) -> Passing:
    """The joints at a ``time`` (s) of a step of length ``h`` (s), as (n, k), (n, n) and (k,)."""
    c, d = time / h, 1.0 - time / h
    (last, arriving), (gap, speed) = _slopes(c, h)
    first, leaving = d * d * (1 + 2 * c), h * c * d * d
    directions, turned, places = (
        first * a + last * b + leaving * u + arriving * v
        for a, b, u, v in (
            (start.directions, end.directions, start.rates, end.rates),
            (start.turned, end.turned, start.turning, end.turning),
            (start.gap, end.gap, start.speed, end.speed),
        )
    )
    rates = gap * (end.gap - start.gap) + d * (d - 2 * c) * start.speed + speed * end.speed
    return Passing(directions, turned, places, rates)
