"""How redundant contacts that stay at rest share their load: with the least norm among the ways that obey the laws.

The nearest point of a polyhedron as a problem of nonnegative least squares: C. L. Lawson, R. J. Hanson, Solving Least
Squares Problems, 1974, chapter 23 (least distance programming). A round cone is met by cutting off what lies outside.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from lag2fmu.reference.hybrid.modes import Mode, Modes, closed_contacts
from lag2fmu.reference.hybrid.records import Answer, MotionPoint
from lag2fmu.reference.hybrid.system import HybridSystem
from lag2fmu.reference.state import Floats

FREE = 1e-9
"""Singular values below this belong to loads that no motion feels; the rows have unit length."""
WITHIN_CONES = 1e-11
"""Cones are met to this part of the greatest load."""
CUTS = 60
FAR = 1e-3
"""Loads that are this part of the greatest one within all limits are far from them."""
AT_LIMIT = 1e-6
"""A cone is at its limit to this part."""
EXACTLY = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
MOST = 1e3
"""No load is looked for beyond so many times the greatest of least norm."""


@dataclass(frozen=True)
class _Sharing:
    """Loads (r,) of the rows ``bound`` and of constraints, in units of ``size``.

    ``least`` are those of least norm; ``free`` (r, d) may be added. ``limits`` are what holds, as ``_limits`` says.
    """

    bound: list[int]
    size: Floats
    least: Floats
    free: Floats
    limits: list[tuple[float, Floats, Floats]]

    def told(self, answer: Answer, loads: Floats) -> Answer:
        """The ``answer`` with these ``loads`` (r,)."""
        found, forces, m = loads * self.size, answer.forces.copy(), len(answer.multipliers)
        forces[self.bound] = found[m:]
        return replace(answer, multipliers=found[:m], forces=forces)


def shared(system: HybridSystem, point: MotionPoint, modes: Modes, answer: Answer) -> Answer:
    """The ``answer`` at ``point`` with forces of least norm that obey the laws in these ``modes``.

    The norm is that of forces by which each row by itself gives the same motion. The answer stays as it is where no
    forces obey, and where a contact slides whose friction another sharing would change.
    """
    sharing = _sharing(system, point, modes, answer)
    nearest = None if sharing is None else _nearest(sharing.least, sharing.free, sharing.limits)
    return answer if sharing is None or nearest is None else sharing.told(answer, nearest)


def centred(system: HybridSystem, point: MotionPoint, modes: Modes, answer: Answer) -> Answer:
    """The ``answer`` at ``point`` with those forces among all with the same motion that are farthest from all limits.

    Where they come to a limit, no forces obey the laws in these ``modes``. The answer stays as it is where its forces
    are within the limits, and where ``shared`` would let it be.
    """
    sharing = _sharing(system, point, modes, answer)
    if sharing is None or all(_margin(limit, sharing.least) > 0 for limit in sharing.limits):
        return answer
    return sharing.told(answer, _farthest(sharing.least, sharing.free, sharing.limits))


def giving_way(system: HybridSystem, point: MotionPoint, modes: Modes) -> dict[int, tuple[float, ...]]:
    """{contact: unit vector} of contacts in space that give way at ``point``, and the directions in which they do.

    There are none where loads are unique: then accelerations tell.
    """
    answer = system.answer(point, modes)
    sharing = _sharing(system, point, modes, answer)
    if sharing is None:
        return {}
    more = 0.1 * AT_LIMIT * float(np.abs(sharing.least).max())
    nearest = _nearest(sharing.least, sharing.free, [(o + more, a, T) for o, a, T in sharing.limits])
    if nearest is None:
        return {}
    forces, found = sharing.told(answer, nearest).forces, {}
    for i in closed_contacts(modes):
        friction = forces[point.rows.slip_rows[i]]
        length = float(np.hypot.reduce(friction, initial=0.0))
        at_limit = length >= point.rows.static[i] * forces[i] * (1 - AT_LIMIT)
        if modes.contacts[i] is Mode.STICKS and len(friction) == 2 and length > 0 and at_limit:
            found[i] = tuple(-friction / length)
    return found


def _sharing(system: HybridSystem, point: MotionPoint, modes: Modes, answer: Answer) -> _Sharing | None:
    """How loads may be shared at ``point``; None where they are unique, or where friction would change with them."""
    m, (kept, stuck) = system.constraints.m, system.bound_rows(modes)
    bound = kept + stuck
    G = np.concatenate([point.constraints[3], point.rows.jacobian[bound]])
    if answer.unique or not len(bound) or not np.isfinite(answer.qdd).all():
        return None
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
        return None
    scaled = np.concatenate([answer.multipliers, answer.forces[bound]]) / size
    limits = list(_limits(system, point, modes, answer, place, size))
    return _Sharing(bound, size, scaled - free @ (free.T @ scaled), free, limits)


def _rubs(system: HybridSystem, point: MotionPoint, modes: Modes, free: Floats, place: dict[int, int]) -> bool:
    """Whether a contact slides by friction that ``free`` loads (r, d) change."""
    rows, slides = point.rows, [i for i in closed_contacts(modes) if modes.contacts[i] is not Mode.STICKS]
    rubbing = [i for i in slides if len(rows.slip_rows[i]) and rows.friction[i] > 0]
    return any(np.abs(free[place[i]]).max() > FREE for i in rubbing)


def _limits(
    system: HybridSystem, point: MotionPoint, modes: Modes, answer: Answer, place: dict[int, int], size: Floats
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


def _margin(limit: tuple[float, Floats, Floats], loads: Floats) -> float:
    """How far the ``loads`` (r,) are within the ``limit``."""
    offset, slope, tangents = limit
    return offset + float(slope @ loads) - float(np.linalg.norm(tangents @ loads))


def _facet(limit: tuple[float, Floats, Floats], loads: Floats) -> Floats:
    """The slope (r,) of the margin of the ``limit`` at the ``loads`` (r,)."""
    _, slope, tangents = limit
    force = tangents @ loads
    length = float(np.linalg.norm(force))
    return slope - (force / length if length > 0 else 0 * force) @ tangents


def _nearest(least: Floats, free: Floats, limits: list[tuple[float, Floats, Floats]]) -> Floats | None:
    """The loads ``least`` + ``free`` z (r,) within the ``limits`` that are nearest to ``least``; None without any."""
    load, found = max(float(np.abs(least).max()), 1e-300), least
    facets: list[tuple[float, Floats]] = []
    for _ in range(CUTS):
        cuts = [(limit[0], _facet(limit, found)) for limit in limits if _margin(limit, found) < -WITHIN_CONES * load]
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


def _farthest(least: Floats, free: Floats, limits: list[tuple[float, Floats, Floats]]) -> Floats:
    """The loads ``least`` + ``free`` z (r,) whose least margin to the ``limits`` is greatest, by cutting planes.

    Loads that are FAR within the limits will do.
    Source: J. E. Kelley, The Cutting-Plane Method for Solving Convex Programs, J. SIAM 8, 1960.
    """
    from scipy.optimize import linprog

    load, d = max(float(np.abs(least).max()), 1e-300), free.shape[1]
    found, facets = least, [(limit[0], limit[1]) for limit in limits]
    for _ in range(CUTS):
        facets += [(limit[0], _facet(limit, found)) for limit in limits]
        A = np.array([np.append(-(a @ free), 1.0) for _, a in facets])
        b = np.array([o + a @ least for o, a in facets]) / load
        bounds = [(-MOST, MOST)] * d + [(None, MOST)]
        result = linprog(np.append(np.zeros(d), -1.0), A_ub=A, b_ub=b, bounds=bounds, options=EXACTLY)
        if result.x is None:
            return found
        found = least + load * (free @ result.x[:d])
        if min(_margin(limit, found) for limit in limits) >= load * min(result.x[-1] - WITHIN_CONES, FAR):
            break
    return found


def _least_distance(A: Floats, b: Floats) -> Floats | None:
    """The z (d,) of least norm with A z >= b, for A (p, d) and b (p,); None if there is none."""
    from scipy.optimize import nnls

    right = np.append(np.zeros(A.shape[1]), 1.0)
    matrix = np.vstack([A.T, b])
    rest = matrix @ nnls(matrix, right)[0] - right
    return None if np.linalg.norm(rest) < FREE else np.asarray(-rest[:-1] / rest[-1])
