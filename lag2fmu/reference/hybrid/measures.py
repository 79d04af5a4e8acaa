"""The sizes of gaps, velocities and forces along rows, by which rounding errors are told from motions."""

from __future__ import annotations

import numpy as np

from lag2fmu.reference.hybrid.modes import Due, Modes, closed_contacts
from lag2fmu.reference.hybrid.records import MotionPoint
from lag2fmu.reference.state import Floats

TOUCH = 1e-11
"""In nominal gaps: a gap up to it is closed."""
STILL = 1e-10
"""In nominal velocities: a velocity up to it counts as zero."""
TIME_LOCATED = 1e-12
"""The accuracy (s) of the location of events; beyond 1 s it is relative to their time."""
SLOW = 1e-3
"""In nominal values per s^2: the least size of accelerations by which errors are measured: forces may cancel."""
ROUNDING = 1e-13
"""Relative to the accelerations of coordinates and of surfaces: a smaller one of a row counts as 0."""

BOUND = 1e-11
"""Relative to the greatest singular value: constraints with smaller ones are redundant."""

SLOW_SLIP = 1.0
"""In nominal velocities, times the square root of the relative tolerance of the integration: a slip in space up to it
is slow, and keeps the direction in which it began. The direction turns meanwhile, by less where it is slow for less
long: the error of a velocity is about the power 3/4 of the tolerance. A slip that is slower makes an integration stiff,
and errors turn it."""
BACK = 0.05
"""In units of the speed up to which a slip is slow: a slow slip that moves against its direction faster than this has
turned back; one that is faster than 3 of these units has a direction of its own."""


def gap_sizes(point: MotionPoint) -> Floats:
    """The nominal size of each gap: its change if coordinates change by their nominal values, (u,) in SI units."""
    found: Floats = np.abs(point.rows.jacobian[: len(point.rows.gaps)]) @ point.nominal
    return np.where(found > 0, found, 1.0)


def velocity_sizes(point: MotionPoint) -> Floats:
    """The nominal size of the velocity of each row, if velocities have nominal values, (k,) in SI units."""
    found: Floats = np.abs(point.rows.jacobian) @ point.nominal
    return np.where(found > 0, found, 1.0)


def accelerations(point: MotionPoint, qdd: Floats) -> Floats:
    """The acceleration of each row, (k,) in SI units, where coordinates have the accelerations qdd (n,).

    One that is no more than rounding is 0: bodies that fly side by side do not come back to one another.
    """
    found = point.rows.jacobian @ qdd + point.rows.gamma
    greatest = float(np.max(np.abs(qdd) / point.nominal, initial=0.0))
    rounding = ROUNDING * (greatest * velocity_sizes(point) + np.abs(point.rows.gamma))
    return np.where(np.abs(found) <= rounding, 0.0, found)


def rest_speeds(point: MotionPoint) -> Floats:
    """The velocity of each row that counts as zero, (k,) in SI units: a part of its size, or what an instant makes.

    Where the velocities of a mechanism do not move a row, as at the dead centre of a crank, its size is no measure.
    """
    instant = TIME_LOCATED * max(1.0, abs(float(point.state.t)))
    found: Floats = np.maximum(STILL * velocity_sizes(point), instant * np.abs(point.rows.gamma))
    return found


def mobilities(point: MotionPoint) -> Floats:
    """The acceleration of each coordinate by a unit of force along it alone, (n,) in SI units.

    Where constraints hold, none is more mobile, in nominal values, than the most mobile one under them: the scalar part
    of a quaternion has no inertia of its own near 1, and the norm holds it.
    """
    mass, G, nominal = point.terms.mass_matrix, point.constraints[3], point.nominal
    alone: Floats = 1.0 / np.maximum(np.abs(np.diagonal(mass)), 1e-300)
    if not len(G):
        return alone
    _, values, across = np.linalg.svd(G * nominal)
    free = nominal[:, None] * across[int(np.sum(values > BOUND * values.max())) :].T  # (n, free directions)
    if not free.size:
        return alone
    answer = free @ np.linalg.pinv(free.T @ mass @ free, hermitian=True) @ free.T
    most: Floats = nominal**2 * (np.diagonal(answer) / nominal**2).max()
    return np.minimum(alone, most)


def pace(point: MotionPoint) -> float:
    """The size of the accelerations that all forces f make, |f| in the metric M^-1: sqrt(f . M^-1 f), in SI units.

    It is at least that of SLOW accelerations.
    """
    mobile = mobilities(point)
    return float(np.sqrt(np.sum(np.maximum(point.forcing**2 * mobile, (SLOW * point.nominal) ** 2 / mobile))))


def force_sizes(point: MotionPoint) -> Floats:
    """The force along each row that would make ``pace``: (k,) in SI units."""
    found: Floats = pace(point) / np.sqrt(np.maximum((point.rows.jacobian**2) @ mobilities(point), 1e-300))
    return np.maximum(found, 1e-12)


def touches(point: MotionPoint, i: int) -> bool:
    """Whether the gap of the contact ``i`` is closed, up to rounding."""
    return bool(point.rows.gaps[i] <= TOUCH * gap_sizes(point)[i])


def is_free(point: MotionPoint, D: Floats, i: int) -> bool:
    """Whether constraints leave the motion along row ``i`` free; D (k, k) is the answer of rows to forces on rows."""
    return bool(D[i, i] > 1e-10 * (point.rows.jacobian[i] ** 2 @ mobilities(point)))


def touching(point: MotionPoint, modes: Modes, due: Due, D: Floats) -> list[int]:
    """The contacts that touch, are closed or are due to close, and that constraints leave free.

    D (k, k) is the answer of rows to forces on rows.
    """
    near = {i for kind, i in due if kind == "gap"} | {*closed_contacts(modes)}
    return [i for i in range(len(modes.contacts)) if (i in near or touches(point, i)) and is_free(point, D, i)]


def slips_of(point: MotionPoint, i: int) -> tuple[int, ...]:
    """The rows of the slips of the contact ``i``; none where there never is friction."""
    frictional = point.rows.changing[i] or max(point.rows.friction[i], point.rows.static[i]) > 0
    return tuple(int(row) for row in point.rows.slip_rows[i]) if frictional else ()


def energies_of_jump(point: MotionPoint, qd: Floats, lost: float) -> Floats:
    """(work, dissipated energy), (2,) in J, of impulses that make the velocities of ``point`` to be ``qd`` (n,).

    ``lost`` (J) is what the impulses take along the velocities of rows. These contain how surfaces move, which qd does
    not: so surfaces do work.
    """
    gained = 0.5 * float((qd + point.state.qd) @ point.terms.mass_matrix @ (qd - point.state.qd))
    return np.array([gained + lost, lost])
