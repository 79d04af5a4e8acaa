"""Forces within limits where several make the same motion: those of least norm, and those deepest within the limits.

A limit (o, a, T) holds for forces x (r,) with o + a x >= |T x|, a (r,) and T (slips, r): a plane, or a round cone. The
nearest point of a polyhedron is a problem of nonnegative least squares: C. L. Lawson, R. J. Hanson, Solving Least
Squares Problems, 1974, chapter 23 (least distance programming). A round cone is met by cutting off what lies outside.
What is cut off lies outside at any depth.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

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


class Limits:
    """Several limits for forces (r,)."""

    def __init__(self, limits: Iterable[Limit], r: int) -> None:
        found = [*limits]
        self.offsets = np.array([o for o, *_ in found])
        self.slopes = np.array([a for _, a, _ in found]).reshape(len(found), r)
        self.tangents = np.zeros((len(found), 2, r))
        for rows, (*_, T) in zip(self.tangents, found, strict=True):
            rows[: len(T)] = T

    def of(self, which: NDArray[np.bool_]) -> Limits:
        """Those ``which`` (count,) names."""
        found = Limits([], self.slopes.shape[1])
        found.offsets, found.slopes, found.tangents = self.offsets[which], self.slopes[which], self.tangents[which]
        return found

    def margins(self, loads: Floats) -> Floats:
        """How far the ``loads`` (r,) are within each limit."""
        return np.asarray(self.offsets + self.slopes @ loads - np.hypot(*(self.tangents @ loads).T))

    def facets(self, loads: Floats, which: NDArray[np.bool_]) -> Floats:
        """The slopes (p, r) at the ``loads`` (r,) of the margins of p limits, those ``which`` names."""
        tangents = self.tangents[which]
        forces = tangents @ loads
        lengths = np.hypot(*forces.T)
        ways = forces / np.where(lengths > 0, lengths, 1.0)[:, None]
        return np.asarray(self.slopes[which] - (ways[:, None] @ tangents)[:, 0])


class _Cuts:
    """Planes that cut off what is outside of ``limits``, for loads ``least`` + ``free`` z: A z >= b at depth 0."""

    def __init__(self, least: Floats, free: Floats, limits: Limits) -> None:
        self.least, self.free, self.limits = least, free, limits
        self.load = max(float(np.abs(least).max()), 1e-300)
        self.A, self.b = np.zeros((0, free.shape[1])), np.zeros(0)

    def nearest(self, depth: float) -> Floats | None:
        """The loads (r,) at the ``depth`` within the limits, in units of the load, nearest to ``least``; None: none."""
        for _ in range(CUTS):
            z = _least_distance(self.A, self.b + depth)
            if z is None:
                return None
            found = self.least + self.load * (self.free @ z)
            margins = self.limits.margins(found) - depth * self.load
            outside = margins < -WITHIN_CONES * self.load
            facets = self.limits.facets(found, outside)
            rows = facets @ self.free
            felt = np.abs(rows).max(axis=1) > FREE
            if not felt.any():
                break
            self.A = np.vstack([self.A, rows[felt]])
            base = self.limits.offsets[outside] + facets @ self.least
            self.b = np.append(self.b, -base[felt] / self.load)
        return found


def nearest(least: Floats, free: Floats, limits: Limits) -> Floats | None:
    """The loads ``least`` + ``free`` z (r,) within the ``limits`` that are nearest to ``least``; None without any."""
    return _Cuts(least, free, limits).nearest(0.0)


def inmost(least: Floats, free: Floats, limits: Limits) -> Floats:
    """The loads ``least`` + ``free`` z (r,) that are deepest within the ``limits``, to the next of DEPTHS.

    Of those as deep they are the nearest to ``least``. Where no loads are within the limits, it is those that are least
    beyond them. Each group of loads that depend on each other has its own depth: a friction that gives way does not
    draw those to their limits that share another load.
    """
    found: Floats = least.copy()
    for loads, which in _groups(free, limits):
        found += _deepest(_Cuts(least, loads, limits.of(which))) - least
    return found


def _groups(free: Floats, limits: Limits) -> Iterator[tuple[Floats, NDArray[np.bool_]]]:
    """The free loads (r, e) of each group, which have no load and no limit in common, and its limits (count,)."""
    from scipy.sparse.csgraph import connected_components

    shares = free @ free.T  # the projector on the free loads, (r, r)
    together = np.abs(shares) > FREE
    bounds = ((limits.slopes != 0) | (limits.tangents != 0).any(axis=1)) & together.diagonal()
    _, group = connected_components(np.block([[together, bounds.T], [bounds, np.eye(len(bounds), dtype=bool)]]))
    r = len(shares)
    for label in np.unique(group[:r][together.diagonal()]):
        which = group[r:] == label
        _, values, across = np.linalg.svd(free[group[:r] == label])
        count = int(np.sum(values > 0.5))  # they are 1 or 0
        # Turned by rounding, the loads of a lone group would leave limits that they all come to at once.
        loads = free if count == free.shape[1] else free @ across[:count].T
        if which.any():
            yield loads, which


def _deepest(cuts: _Cuts) -> Floats:
    """The loads (r,) that are deepest within the limits of the ``cuts``."""
    best, limits = cuts.least, cuts.limits
    first, last = 0, len(DEPTHS)
    while first < last:  # what is too deep for all loads is the first part of the depths
        middle = 0 if first == 0 and last == len(DEPTHS) else (first + last) // 2
        depth = DEPTHS[middle]
        found = cuts.nearest(depth)
        if found is not None and limits.margins(found).min(initial=np.inf) >= cuts.load * (depth - 0.5 * abs(depth)):
            best, last = found, middle
        else:
            first = middle + 1
    return best


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

    if not len(A):
        return np.zeros(A.shape[1])
    right = np.append(np.zeros(A.shape[1]), 1.0)
    matrix = np.vstack([A.T, b])
    rest = matrix @ nnls(matrix, right)[0] - right
    return None if -rest[-1] < NONE else np.asarray(-rest[:-1] / rest[-1])  # -rest[-1] is the square of its length
