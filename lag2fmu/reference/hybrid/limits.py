"""Forces within limits where several make the same motion: those of least norm, and those deepest within the limits.

A limit (o, a, T) holds for forces x (r,) with o + a x >= |T x|, a (r,) and T (slips, r): a plane, or a round cone. The
nearest point of a polyhedron is a problem of nonnegative least squares: C. L. Lawson, R. J. Hanson, Solving Least
Squares Problems, 1974, chapter 23 (least distance programming). A round cone is met by cutting off what lies outside.
"""

from __future__ import annotations

import numpy as np

from lag2fmu.reference.state import Floats

Limit = tuple[float, Floats, Floats]

FREE = 1e-9
"""Singular values below this belong to loads that no motion feels; the rows have unit length."""
WITHIN_CONES = 1e-11
"""Relative to the greatest load: how far outside of its cone a load may be."""
CUTS = 60
"""The most rounds of cutting planes."""
DEPTHS = (*10.0 ** -np.arange(3.0, 14.0), *-(10.0 ** np.arange(-13.0, 3.0)))
"""Relative to the greatest load: how far within all limits loads are looked for, the deepest first.

A depth of 1e-3 is wide; at 1e-13 rounding begins. Depths below 0 tell which limits no loads keep, and by how much.
"""
NONE = 1e-14
"""The least square of what is left of 1 by which planes have a point in common; below it is rounding."""


def margin(limit: Limit, loads: Floats) -> float:
    """How far the ``loads`` (r,) are within the ``limit``."""
    offset, slope, tangents = limit
    return offset + float(slope @ loads) - float(np.linalg.norm(tangents @ loads))


def facet(limit: Limit, loads: Floats) -> Floats:
    """The slope (r,) of the margin of the ``limit`` at the ``loads`` (r,)."""
    _, slope, tangents = limit
    force = tangents @ loads
    length = float(np.linalg.norm(force))
    return slope - (force / length if length > 0 else 0 * force) @ tangents


def nearest(least: Floats, free: Floats, limits: list[Limit]) -> Floats | None:
    """The loads ``least`` + ``free`` z (r,) within the ``limits`` that are nearest to ``least``; None without any."""
    load, found = max(float(np.abs(least).max()), 1e-300), least
    A, b = np.zeros((0, free.shape[1])), np.zeros(0)
    for _ in range(CUTS):
        cuts = [(limit[0], facet(limit, found)) for limit in limits if margin(limit, found) < -WITHIN_CONES * load]
        beyond = [(offset, a, a @ free) for offset, a in cuts]
        beyond = [cut for cut in beyond if np.abs(cut[2]).max() > FREE]
        if not beyond:
            return found
        A = np.vstack([A, *(row for *_, row in beyond)])
        b = np.append(b, [-(offset + a @ least) / load for offset, a, _ in beyond])
        z = _least_distance(A, b)
        if z is None:
            return None
        found = least + load * (free @ z)
    return found


def inmost(least: Floats, free: Floats, limits: list[Limit]) -> Floats:
    """The loads ``least`` + ``free`` z (r,) that are deepest within the ``limits``, to the next of DEPTHS.

    Of those as deep they are the nearest to ``least``. Where no loads are within the limits, it is those that are least
    beyond them.
    """
    load = max(float(np.abs(least).max()), 1e-300)
    for depth in DEPTHS:
        found = nearest(least, free, [(offset - depth * load, a, T) for offset, a, T in limits])
        reached = -np.inf if found is None else min(margin(limit, found) for limit in limits)
        if found is not None and reached >= load * (depth - 0.5 * abs(depth)):
            return found
    return least


def beside_sliding(free: Floats, rubbing: list[int], normals: list[int]) -> Floats:
    """Those of the ``free`` loads (r, d) that leave what slides as it is, (r, e) with e <= d.

    The friction of ``rubbing`` normal forces follows them. They and the ``normals`` that share a load with them keep
    theirs, whatever the sticking friction beside them does.
    """
    sharing = free @ free[rubbing].T
    kept = free[[n for n in normals if np.abs(sharing[n]).max(initial=0.0) > FREE]]
    _, values, across = np.linalg.svd(kept)
    return np.asarray(free @ across[int(np.sum(values > FREE)) :].T)


def _least_distance(A: Floats, b: Floats) -> Floats | None:
    """The z (d,) of least norm with A z >= b, for A (p, d) and b (p,); None if there is none."""
    from scipy.optimize import nnls

    right = np.append(np.zeros(A.shape[1]), 1.0)
    matrix = np.vstack([A.T, b])
    rest = matrix @ nnls(matrix, right)[0] - right
    return None if -rest[-1] < NONE else np.asarray(-rest[:-1] / rest[-1])  # -rest[-1] is the square of its length
