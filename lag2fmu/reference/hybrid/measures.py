"""What is zero but for rounding, and what touches: measures of gaps, velocities and forces along rows."""

from __future__ import annotations

import numpy as np

from lag2fmu.reference.hybrid.records import Point
from lag2fmu.reference.state import Floats

TOUCH = 1e-11
"""Gaps up to this part of what nominal values make count as closed."""
STILL = 1e-10
"""Velocities up to this part of what nominal values make count as zero."""


def gap_sizes(point: Point) -> Floats:
    """What nominal values of coordinates make of each gap: (u,) in SI units."""
    found: Floats = np.abs(point.rows.jacobian[: len(point.rows.gaps)]) @ point.nominal
    return np.where(found > 0, found, 1.0)


def velocity_sizes(point: Point) -> Floats:
    """What nominal velocities make of the velocity of each row: (k,) in SI units."""
    found: Floats = np.abs(point.rows.jacobian) @ point.nominal
    return np.where(found > 0, found, 1.0)


def pace(point: Point) -> float:
    """What all that acts makes together of accelerations, in units of the root of inertia: |f| in the metric M^-1."""
    mass = np.maximum(np.abs(np.diagonal(point.terms.mass_matrix)), 1e-300)
    return float(np.sqrt(np.sum(point.forcing**2 / mass)))


def force_sizes(point: Point) -> Floats:
    """The force along each row that would make ``pace``: (k,) in SI units."""
    mass = np.maximum(np.abs(np.diagonal(point.terms.mass_matrix)), 1e-300)
    found: Floats = pace(point) / np.sqrt(np.maximum((point.rows.jacobian**2) @ (1 / mass), 1e-300))
    return np.maximum(found, 1e-12)


def touches(point: Point, i: int) -> bool:
    """Whether the gap of the contact ``i`` is closed but for rounding."""
    return bool(point.rows.gaps[i] <= TOUCH * gap_sizes(point)[i])


def is_free(point: Point, D: Floats, i: int) -> bool:
    """Whether constraints leave the gap of the contact ``i`` free; D (k, k) is what they leave to forces along rows."""
    mass = np.maximum(np.abs(np.diagonal(point.terms.mass_matrix)), 1e-300)
    return bool(D[i, i] > 1e-10 * (point.rows.jacobian[i] ** 2 @ (1 / mass)))


def slips_of(point: Point, i: int) -> tuple[int, ...]:
    """The rows of the slips of the contact ``i``; none without friction."""
    frictional = max(point.rows.friction[i], point.rows.static[i]) > 0
    return tuple(int(row) for row in point.rows.slip_rows[i]) if frictional else ()
