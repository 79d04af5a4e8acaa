"""The places where springs and dampers act, found from the derivatives of their elongations or rates by q.

A spring along an axis d between the places A and B has an elongation e(q) with de/dq = d.(drB/dq - drA/dq). If A is at
rest, it is a wall. A torsion spring has de/dq = +-1 for an angle, and acts at the hinge of that angle.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np

from lag2fmu.description.parts import Damper, Spring
from lag2fmu.graph.batches import Floats
from lag2fmu.picture.skeleton import Skeleton

_NEAR = 1e-9
"""Slopes and places are equal up to this part of them."""


class Attachment(NamedTuple):
    """The place of the spring or damper ``part``, between two spots.

    - ``wall``: the second end is a wall, in the direction ``along`` (3,).
    - ``share``: how far along the link from the first spot the first end is, from 0 to 1 at the link's end.
    - ``hinge``: the part is a torsion spring or damper at this place.
    """

    part: Spring | Damper
    ends: tuple[int, ...] = ()
    along: tuple[float, float, float] | None = None
    link: tuple[int, int] | None = None
    share: float = 1.0
    hinge: int | None = None


def attach(skeleton: Skeleton, part: Spring | Damper, places: dict[int, Floats]) -> Attachment | None:
    """The place where ``part`` acts, None if it cannot be found; ``places`` are the result of ``slopes_of_places``."""
    if part.between is not None:
        a, b = (skeleton.place[str(end)] for end in part.between)
        return Attachment(part, (a, b))
    written = part.elongation if isinstance(part, Spring) else part.rate
    if written is None:
        return None
    node = skeleton.put(written)
    slope = skeleton.slopes([node], by_velocity=isinstance(part, Damper))[0]
    if not np.isfinite(slope).all() or not np.any(slope):
        return None
    hinge = _at_hinge(part, slope, skeleton)
    if hinge is not None:
        return hinge
    return _at_wall(part, slope, places) or _between(part, slope, places) or _at_link(part, slope, skeleton, places)


def slopes_of_places(skeleton: Skeleton) -> dict[int, Floats]:
    """{spot of a body, point or joint: the derivatives of its position by q, (3, n, samples)}, bodies first.

    Spots without finite derivatives are left out.
    """
    numbers = [*skeleton.place.values(), *(i for link in skeleton.links for i in link.ends)]
    return {i: skeleton.spot_slopes[i] for i in dict.fromkeys(numbers) if np.isfinite(skeleton.spot_slopes[i]).all()}


def _at_wall(part: Spring | Damper, slope: Floats, places: dict[int, Floats]) -> Attachment | None:
    for spot, found in places.items():
        for axis in range(3):
            for sign in (1.0, -1.0):
                if _same(sign * found[axis], slope):
                    return Attachment(part, (spot,), _unit(axis, -sign))
    return None


def _between(part: Spring | Damper, slope: Floats, places: dict[int, Floats]) -> Attachment | None:
    for a, mine in places.items():
        for b, theirs in places.items():
            if a != b and any(_same(theirs[axis] - mine[axis], slope) for axis in range(3)):
                return Attachment(part, (a, b))
    return None


def _at_link(part: Spring | Damper, slope: Floats, skeleton: Skeleton, places: dict[int, Floats]) -> Attachment | None:
    """The attachment between a wall and a point of a link or of its continuation."""
    for link in skeleton.links:
        if not set(link.ends) <= places.keys():
            continue
        a, b = (places[i] for i in link.ends)
        for axis in range(3):
            reach, beyond = b[axis] - a[axis], slope - a[axis]
            size = float((reach * reach).sum())
            share = float((reach * beyond).sum()) / size if size else 0.0
            if share and abs(share) < 20 and _same(share * reach, beyond):
                return Attachment(part, (), _unit(axis, -1.0), link.ends, share)
    return None


def _at_hinge(part: Spring | Damper, slope: Floats, skeleton: Skeleton) -> Attachment | None:
    """The hinge of the newest coordinate, where the elongation is a difference of angles."""
    if np.ptp(slope, axis=1).max() > _NEAR:
        return None
    coordinates = skeleton.mechanism.coordinates
    used = [c.name for c, share in zip(coordinates, slope[:, 0], strict=True) if abs(share) > _NEAR]
    if not used or any(name not in skeleton.hinges or name in skeleton.sliders for name in used):
        return None
    return Attachment(part, hinge=skeleton.hinges[used[-1]])


def _same(a: Floats, b: Floats) -> bool:
    return bool(np.abs(a - b).max() <= _NEAR * max(float(np.abs(b).max()), 1e-300))


def _unit(axis: int, sign: float) -> tuple[float, float, float]:
    x, y, z = (sign * float(i == axis) for i in range(3))
    return x, y, z


def attachments(skeleton: Skeleton) -> Iterator[tuple[Spring | Damper, Attachment | None]]:
    """Every spring and damper with its place, but for those of compliant contacts."""
    m = skeleton.mechanism
    dampers = [d for d in m.dampers if not m.origins.get(f"dampers.{d.name}", "").startswith("contacts.")]
    parts: tuple[Spring | Damper, ...] = (*m.springs, *dampers)
    written = any(part.between is None for part in parts)
    places = slopes_of_places(skeleton) if written and skeleton.reads else {}
    for part in parts:
        yield part, attach(skeleton, part, places)


def ropes(skeleton: Skeleton) -> Iterator[tuple[str, tuple[int, int]]]:
    """(part, spots) of ropes that can be slack: contacts whose gap is a length minus the distance of two places."""
    unilaterals = skeleton.mechanism.unilaterals if skeleton.reads else ()
    gaps = [(u.where, skeleton.slopes([skeleton.put(u.gap)])[0]) for u in unilaterals]
    places = slopes_of_places(skeleton) if gaps else {}
    if not places:
        return
    at = skeleton.positions(skeleton.samples)
    for part, gap in gaps:
        for a, b in combinations(places, 2):
            away = at[a] - at[b]
            growth = (away[:, None] * (places[a] - places[b])).sum(axis=0)  # of half the square of the distance
            if np.any(growth) and _same(-np.linalg.norm(away, axis=0) * gap, growth):
                yield part, (a, b)
                break
