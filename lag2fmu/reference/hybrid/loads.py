"""How redundant contacts that stay at rest may share their load."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from lag2fmu.reference.hybrid.limits import Limit, Limits, beside_sliding, inmost, nearest
from lag2fmu.reference.hybrid.modes import Mode, Modes, closed_contacts
from lag2fmu.reference.hybrid.records import Answer, MotionPoint
from lag2fmu.reference.state import Floats

AT_LIMIT = 1e-6
"""Relative to the limit of a cone: a force that is nearer to it is at its limit."""


@dataclass(frozen=True)
class _Sharing:
    """Loads (r,) of constraints and of bound rows, in units of ``size``.

    ``least`` are those of least norm; ``free`` (r, d) may be added. ``limits`` are what holds, as ``_limits`` says.
    """

    size: Floats
    least: Floats
    free: Floats
    limits: Limits

    def told(self, answer: Answer, loads: Floats) -> Answer:
        """The ``answer`` with these ``loads`` (r,)."""
        found, forces, m = loads * self.size, answer.forces.copy(), len(answer.multipliers)
        holding = answer.holding + answer.bears @ (found - np.concatenate([answer.multipliers, forces[answer.bound]]))
        forces[answer.bound] = found[m:]
        return replace(answer, multipliers=found[:m], forces=forces, holding=holding)


def centred(point: MotionPoint, modes: Modes, answer: Answer) -> Answer:
    """The ``answer`` at ``point`` with those forces among all with the same motion that are deepest within all limits.

    Where they come to a limit, no forces obey the laws in these ``modes``. The answer stays as it is where its forces
    are unique or wide within the limits. What a contact that slides shares with others keeps the loads of least norm.
    """
    sharing = _sharing(point, modes, answer)
    return answer if sharing is None else sharing.told(answer, inmost(sharing.least, sharing.free, sharing.limits))


def giving_way(point: MotionPoint, modes: Modes, answer: Answer) -> dict[int, tuple[float, ...]]:
    """{contact: unit vector} of contacts in space that give way at ``point``, and the directions in which they do.

    There are none where loads are unique: then accelerations tell.
    """
    sharing = _sharing(point, modes, answer)
    if sharing is None:
        return {}
    more = 0.1 * AT_LIMIT * float(np.abs(sharing.least).max())
    sharing.limits.offsets += more
    loads = nearest(sharing.least, sharing.free, sharing.limits)
    if loads is None:
        return {}
    forces, found = sharing.told(answer, loads).forces, {}
    for i in closed_contacts(modes):
        friction = forces[point.rows.slip_rows[i]]
        length = float(np.hypot.reduce(friction, initial=0.0))
        at_limit = length >= point.rows.static[i] * forces[i] * (1 - AT_LIMIT)
        if modes.contacts[i] is Mode.STICKS and len(friction) == 2 and length > 0 and at_limit:
            found[i] = tuple(-friction / length)
    return found


def _sharing(point: MotionPoint, modes: Modes, answer: Answer) -> _Sharing | None:
    """How loads may be shared at ``point``; None where they are unique, or would change what slides."""
    m, bound, size, free = len(answer.multipliers), answer.bound, answer.units, answer.free
    place = {row: m + j for j, row in enumerate(bound)}
    if not free.size or not bound:
        return None
    scaled = np.concatenate([answer.multipliers, answer.forces[bound]]) / size
    least = scaled - free @ (free.T @ scaled)
    free = beside_sliding(free, *_normals(point, modes, place))
    limits = Limits(_limits(point, modes, answer, place, size), len(size))
    return _Sharing(size, least, free, limits) if free.size else None


def _normals(point: MotionPoint, modes: Modes, place: dict[int, int]) -> tuple[list[int], list[int]]:
    """The places of the normal forces that friction of what slides follows, and of all of closed contacts."""
    rows, closed = point.rows, closed_contacts(modes)
    slides = [i for i in closed if modes.contacts[i] is not Mode.STICKS and len(rows.slip_rows[i])]
    return [place[i] for i in slides if rows.friction[i] > 0], [place[i] for i in closed]


def _limits(point: MotionPoint, modes: Modes, answer: Answer, place: dict[int, int], size: Floats) -> Iterator[Limit]:
    """What holds: (o, a, T) for o + a x >= |T x| with the scaled loads x (r,); a is (r,) and T (slips, r)."""
    rows, unit = point.rows, np.diag(size)
    for i in closed_contacts(modes):
        normal, slips = unit[place[i]] / size[place[i]], [int(row) for row in rows.slip_rows[i]]
        if modes.contacts[i] is Mode.STICKS and rows.static[i] > 0:
            yield 0.0, rows.static[i] * normal, unit[[place[row] for row in slips]] / size[place[i]]
        else:
            yield 0.0, normal, np.zeros((1, len(size)))
    for j, (row, mode) in enumerate(zip(rows.friction_rows, modes.frictions, strict=True)):
        if mode is Mode.STICKS:
            at = place[int(row)]
            present = np.concatenate([answer.multipliers, answer.forces[answer.bound]])
            offset = float(answer.holding[j] - answer.bears[j] @ present)
            yield offset / size[at], answer.bears[j] * size / size[at], unit[[at]] / size[at]
