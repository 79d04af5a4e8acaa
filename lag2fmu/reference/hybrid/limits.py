"""Forces within limits where several make the same motion: those of least norm, and those farthest from all limits.

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
FAR = 1e-3
"""Relative to the greatest load: a margin of this size is wide, and is not made wider."""
FIRST = 1e3
"""The weight of the least margin, in units of that of all margins together."""
EXACTLY = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
NONE = 1e-14
"""The least square of what is left of 1 by which planes have a point in common; below it is rounding."""
MOST = 1e3
"""In units of the greatest load of least norm: the bound of the loads that are looked for."""


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
    facets: list[tuple[float, Floats]] = []
    for _ in range(CUTS):
        cuts = [(limit[0], facet(limit, found)) for limit in limits if margin(limit, found) < -WITHIN_CONES * load]
        beyond = [(offset, facet) for offset, facet in cuts if np.abs(facet @ free).max() > FREE]
        if not beyond:
            return found
        facets += beyond
        z = _least_distance(
            np.array([a @ free for _, a in facets]), -np.array([o + a @ least for o, a in facets]) / load
        )
        if z is None:
            return None
        found = least + load * (free @ z)
    return found


def farthest(least: Floats, free: Floats, limits: list[Limit]) -> Floats:
    """The loads ``least`` + ``free`` z (r,) whose least margin to the ``limits`` is greatest, by cutting planes.

    The other margins are great too, so that none is small but those that no loads enlarge. FAR within the limits is
    enough. Source: J. E. Kelley, The Cutting-Plane Method for Solving Convex Programs, J. SIAM 8, 1960.
    """
    from scipy.optimize import linprog

    load, d, k = max(float(np.abs(least).max()), 1e-300), free.shape[1], len(limits)
    found, facets = least, [(j, limit[0], limit[1]) for j, limit in enumerate(limits)]
    goal = -np.concatenate([np.zeros(d), np.ones(k), [FIRST * k]])  # of loads, of each margin, of the least one
    bounds = [(-MOST, MOST)] * d + [(None, FAR)] * k + [(None, None)]
    for _ in range(CUTS):
        facets += [(j, limit[0], facet(limit, found)) for j, limit in enumerate(limits) if len(limit[2])]
        within = np.array([[*(-(a @ free)), *(np.arange(k) == j), 0.0] for j, _, a in facets])
        least_of_all = np.hstack([np.zeros((k, d)), -np.eye(k), np.ones((k, 1))])
        b = np.array([(o + a @ least) / load for _, o, a in facets] + [0.0] * k)
        result = linprog(goal, A_ub=np.vstack([within, least_of_all]), b_ub=b, bounds=bounds, options=EXACTLY)
        if result.x is None:
            return found
        found = least + load * (free @ result.x[:d])
        if min(margin(limit, found) for limit in limits) >= load * (result.x[-1] - WITHIN_CONES):
            break
    return found


def _least_distance(A: Floats, b: Floats) -> Floats | None:
    """The z (d,) of least norm with A z >= b, for A (p, d) and b (p,); None if there is none."""
    from scipy.optimize import nnls

    right = np.append(np.zeros(A.shape[1]), 1.0)
    matrix = np.vstack([A.T, b])
    rest = matrix @ nnls(matrix, right)[0] - right
    return None if -rest[-1] < NONE else np.asarray(-rest[:-1] / rest[-1])  # -rest[-1] is the square of its length
