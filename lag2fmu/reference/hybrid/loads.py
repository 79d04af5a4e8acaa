"""How redundant contacts that stay at rest share their load: with the least norm among the ways that obey the laws.

The nearest point of a polyhedron as a problem of nonnegative least squares: C. L. Lawson, R. J. Hanson, Solving Least
Squares Problems, 1974, chapter 23 (least distance programming). A round cone is met by cutting off what lies outside.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from lag2fmu.reference.hybrid.modes import Mode, Modes, closed_contacts
from lag2fmu.reference.hybrid.records import Answer, Point
from lag2fmu.reference.hybrid.system import System
from lag2fmu.reference.state import Floats

FREE = 1e-9
"""Singular values below this belong to loads that no motion feels; the rows have unit length."""
MET = 1e-11
"""Cones are met to this part of the greatest load."""
CUTS = 60


def shared(system: System, point: Point, modes: Modes, answer: Answer) -> Answer:
    """The ``answer`` at ``point`` with forces of least norm that obey the laws in these ``modes``.

    The norm is that of forces by which each row by itself gives the same motion. The answer stays as it is where no
    forces obey, and where a contact slides whose friction another sharing would change.
    """
    m, (kept, stuck) = system.constraints.m, system.bound_rows(modes)
    bound = kept + stuck
    G = np.concatenate([point.constraints[3], point.rows.jacobian[bound]])
    if not len(bound) or not np.isfinite(answer.qdd).all():
        return answer
    mass, permanent = point.terms.mass_matrix, point.constraints[3]
    if np.linalg.matrix_rank(mass) < len(mass):  # quaternions: their norm takes no energy, and a constraint holds it
        mass = mass + permanent.T @ permanent
    root = np.linalg.cholesky(mass)
    rows = np.linalg.solve(root, G.T)
    size = 1.0 / np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
    _, values, across = np.linalg.svd(rows * size)
    free = across[int(np.sum(values > FREE)) :].T  # (r, d), an orthonormal basis
    place = {row: m + j for j, row in enumerate(bound)}
    if not free.size or _rubs(system, point, modes, free, place):
        return answer
    scaled = np.concatenate([answer.multipliers, answer.forces[bound]]) / size
    limits = list(_limits(system, point, modes, answer, place, size))
    nearest = _nearest(scaled - free @ (free.T @ scaled), free, limits)
    if nearest is None:
        return answer
    found, forces = nearest * size, answer.forces.copy()
    forces[bound] = found[m:]
    return replace(answer, multipliers=found[:m], forces=forces)


def _rubs(system: System, point: Point, modes: Modes, free: Floats, place: dict[int, int]) -> bool:
    """Whether a contact slides by friction that ``free`` loads (r, d) change."""
    rows, slides = point.rows, [i for i in closed_contacts(modes) if modes.contacts[i] is not Mode.STICKS]
    rubbing = [i for i in slides if len(rows.slip_rows[i]) and rows.friction[i] > 0]
    return any(np.abs(free[place[i]]).max() > FREE for i in rubbing)


def _limits(
    system: System, point: Point, modes: Modes, answer: Answer, place: dict[int, int], size: Floats
) -> Iterator[tuple[float, Floats, Floats]]:
    """What holds: (o, a, T) for o + a x >= |T x| with the scaled loads x (r,); a is (r,) and T (slips, r)."""
    rows, e, unit = point.rows, system.elements, np.diag(size)
    for i in closed_contacts(modes):
        normal, slips = unit[place[i]] / size[place[i]], [int(row) for row in rows.slip_rows[i]]
        if modes.contacts[i] is Mode.STICKS and rows.static[i] > 0:
            yield 0.0, rows.static[i] * normal, unit[[place[row] for row in slips]] / size[place[i]]
        else:
            yield 0.0, normal, np.zeros((1, len(size)))
    for j, (row, mode) in enumerate(zip(e.friction_rows, modes.frictions, strict=True)):
        if mode is Mode.STICKS:
            at = place[int(row)]
            yield float(answer.holding[j]) / size[at], np.zeros(len(size)), unit[[at]] / size[at]


def _nearest(least: Floats, free: Floats, limits: list[tuple[float, Floats, Floats]]) -> Floats | None:
    """The loads ``least`` + ``free`` z (r,) within the ``limits`` that are nearest to ``least``; None without any."""
    load, found = max(float(np.abs(least).max()), 1e-300), least
    facets: list[tuple[float, Floats]] = []
    for _ in range(CUTS):
        beyond = []
        for offset, slope, tangents in limits:
            force = tangents @ found
            length = float(np.linalg.norm(force))
            facet = slope - (force / length if length > 0 else 0 * force) @ tangents
            if offset + facet @ found < -MET * load and np.abs(facet @ free).max() > FREE:
                beyond.append((offset, facet))
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


def _least_distance(A: Floats, b: Floats) -> Floats | None:
    """The z (d,) of least norm with A z >= b, for A (p, d) and b (p,); None if there is none."""
    from scipy.optimize import nnls

    right = np.append(np.zeros(A.shape[1]), 1.0)
    matrix = np.vstack([A.T, b])
    rest = matrix @ nnls(matrix, right)[0] - right
    return None if np.linalg.norm(rest) < FREE else np.asarray(-rest[:-1] / rest[-1])
