"""The laws of contact, impact and dry friction: whether modes meet them, and the forces that do.

Rows answer w = D r + c. At an impact w are the velocities behind it and r are impulses; between impacts w are
accelerations and r are forces. A normal row obeys 0 <= r and 0 <= w + shift, one of the two being 0. A tangential row
is held at w = 0 while r is within the cone, or gives way with w against r and |r| at its limit. The limit is
``friction`` times the normal r (Coulomb's law), or a given capacity.

Where rows depend on one another, as those of two frictions between the same bodies, their motion is unique but their
forces are not: modes meet the laws if any forces do.

Source: Ch. Glocker, Set-Valued Force Laws, Springer 2001, chapters 4 to 7.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from lag2fmu.deadline import check_time
from lag2fmu.reference.hybrid.limits import FREE, Limit, Limits, beside_sliding, nearest
from lag2fmu.reference.hybrid.modes import SENSE, Mode
from lag2fmu.reference.state import Floats

CLOSED = (Mode.STICKS, Mode.FORWARD, Mode.BACKWARD)
PLANES = {0: (Mode.SLIDES,), 1: CLOSED, 2: (Mode.STICKS, Mode.SLIDES)}
"""{number of slips: the modes of a closed contact}."""

EXACT = 1e-9
"""Relative violation of a law that counts as rounding."""
LATE = 1e-6
"""Relative to the load: the greatest error of the run that locates events. What gives way may turn back by it."""


@dataclass(frozen=True)
class Item:
    """An element among the rows: a contact with a ``normal`` row, or dry friction without one.

    - ``options``: the modes to be tried, in order of preference; ``slips``: its tangential rows.
    - ``friction``, ``static``: the sliding and static coefficients of a contact, or forces (N, N.m) of dry friction.
    - ``direction``: that of a slip that goes on; its sliding force is then given, and its w is free.
    - ``shift``: restitution times the approaching speed (m/s) of a normal row.
    - ``bears``: what each of all r adds to ``friction`` and ``static`` of dry friction, (2, k); None: nothing.
    """

    options: tuple[Mode, ...]
    normal: int | None
    slips: tuple[int, ...] = ()
    friction: float = 0.0
    static: float = 0.0
    shift: float = 0.0
    direction: tuple[float, ...] | None = None
    bears: Floats | None = field(default=None, compare=False)

    def limit(self, k: int, *, static: bool = False) -> tuple[float, Floats]:
        """o and a (k,) of the greatest friction o + a r, of what slides or of what is ``static``."""
        value, slope = self.static if static else self.friction, np.zeros(k)
        if self.normal is None:
            return value, slope if self.bears is None else self.bears[int(static)]
        slope[self.normal] = value
        return 0.0, slope

    def most(self, r: Floats) -> float:
        """The greatest friction of what slides for forces r (k,)."""
        limit, slope = self.limit(len(r))
        return limit + float(slope @ r)

    def alike(self, *, static: bool) -> Item:
        """The item with one limit for both: that of what slides, or of what is ``static``."""
        value, bears = self.static if static else self.friction, self.bears
        return replace(
            self, friction=value, static=value, bears=None if bears is None else bears[[int(static), int(static)]]
        )


@dataclass(frozen=True)
class Outcome:
    """The ``modes`` of the items, ``forces`` r (k,), ``answers`` w (k,) of all rows, directions of slips in space."""

    modes: tuple[Mode, ...]
    forces: Floats
    answers: Floats
    directions: tuple[tuple[float, ...] | None, ...]


def lawful(D: Floats, c: Floats, items: Sequence[Item], modes: tuple[Mode, ...], pace: float) -> Outcome | None:
    """The outcome of these ``modes`` for D (k, k) and c (k,); None if it breaks a law.

    What others hold at rest sticks: a row that does not move as long as the other modes last does not slide.
    """
    check_time()
    scale = 1.0 / np.sqrt(np.maximum(np.diagonal(D), 1e-300))
    motion, _ = units(D, c, pace)
    solved = _forces(D, c, items, modes, scale, motion)
    if solved is None:
        return None
    load, free = solved
    size = float(np.max(motion * scale, initial=0.0))
    limits, bar = Limits(_limits(D, c, items, modes, scale, LATE * size), len(c)), EXACT * size
    broken = limits.margins(load) < -bar
    if broken.any() and free.size:
        load = _within(limits, broken, load, beside_sliding(free, *_normals(items, modes)))
        broken = limits.margins(load) < -bar
    if broken.any():
        return None
    r = scale * load
    w = D @ r + c
    slow = np.abs(w) * scale <= bar
    bound = bound_rows(items, modes)
    if any(is_held(D, bound, row) for row in _sliding(items, modes) if slow[row]):
        return None
    return Outcome(modes, r, w, tuple(item.direction for item in items))


def idle_contacts(D: Floats, c: Floats, items: Sequence[Item], found: Outcome, pace: float) -> list[int]:
    """The contacts that are open and go on to touch, for D (k, k) and c (k,): they may bear a share of the load.

    Without those whose share has come to zero: they are about to open, and open is their first option.
    """
    motion, _ = units(D, c, pace)
    return [
        j
        for j, (item, mode) in enumerate(zip(items, found.modes, strict=True))
        if mode is Mode.OPEN
        and item.options[0] is not Mode.OPEN
        and found.answers[item.normal] + item.shift <= EXACT * motion[item.normal]
    ]


def _within(limits: Limits, broken: NDArray[np.bool_], load: Floats, free: Floats) -> Floats:
    """The nearest load to ``load`` (k,) within ``limits``, if ``free`` loads (k, d) change all ``broken`` margins."""
    felt = np.abs(limits.facets(load, broken) @ free).max(axis=1, initial=0.0) > FREE
    shared = nearest(load, free, limits) if felt.all() else None
    return load if shared is None else shared


def of_least_norm(D: Floats, c: Floats, items: Sequence[Item], modes: Sequence[Mode], pace: float) -> Floats | None:
    """The forces r (k,) of least norm in these ``modes``, for D (k, k) and c (k,), whether they obey limits or not.

    None where the modes contradict each other.
    """
    scale = 1.0 / np.sqrt(np.maximum(np.diagonal(D), 1e-300))
    solved = _forces(D, c, items, modes, scale, units(D, c, pace)[0])
    return None if solved is None else scale * solved[0]


def _normals(items: Sequence[Item], modes: Sequence[Mode]) -> tuple[list[int], list[int]]:
    """The rows of the normal forces that friction of what slides follows, and of all of closed contacts."""
    closed = [(x, mode) for x, mode in zip(items, modes, strict=True) if x.normal is not None and mode is not Mode.OPEN]
    rubbing = [x.normal for x, mode in closed if x.slips and mode is not Mode.STICKS and x.friction > 0]
    return [row for row in rubbing if row is not None], [x.normal for x, _ in closed if x.normal is not None]


def units(D: Floats, c: Floats, pace: float) -> tuple[Floats, Floats]:
    """The units of w and of r of the rows, (k,) each: one energy for all rows, by their own inertia."""
    diagonal = np.maximum(np.diagonal(D), 1e-300)
    pace = max(float(np.max(np.abs(c) / np.sqrt(diagonal), initial=0.0)), pace, 1e-300)
    return pace * np.sqrt(diagonal), pace / np.sqrt(diagonal)


def _forces(
    D: Floats, c: Floats, items: Sequence[Item], modes: Sequence[Mode], scale: Floats, motion: Floats
) -> tuple[Floats, Floats] | None:
    """Loads r/``scale`` (k,) of least norm in these ``modes``, and what may be added to them, (k, d).

    ``motion`` (k,) are the units of w. None where the modes contradict each other.
    """
    k, bound = len(c), bound_rows(items, modes)
    A, b = np.eye(k), np.zeros(k)
    for row in bound:
        A[row], b[row] = D[row], -c[row]
    for item, mode in zip(items, modes, strict=True):
        if item.normal is not None and mode is not Mode.OPEN:
            b[item.normal] -= item.shift
        for i, row in enumerate(item.slips if mode not in (Mode.STICKS, Mode.OPEN) else ()):
            along = item.direction[i] if item.direction is not None else SENSE[mode]
            limit, slope = item.limit(k)
            b[row] = -limit * along
            A[row] += slope * along
    weighed = A * scale
    length = np.maximum(np.abs(weighed).max(axis=1, initial=0.0), 1e-300)
    u, s, across = np.linalg.svd(weighed / length[:, None])
    rank = int(np.sum(s > 1e-11 * s.max(initial=0.0)))
    load: Floats = across[:rank].T @ ((u.T @ (b / length))[:rank] / s[:rank])
    rest, size = np.abs(weighed @ load - b) / length, np.abs(b)
    size[bound] = np.maximum(size[bound], motion[bound])  # where all rests c is rounding, which nothing meets
    met = (rest <= EXACT * max(1e-300, float((size / length).max(initial=0.0)))).all()
    free = across[rank:].T
    return (_evened(D, bound, scale, load, free), free) if met else None


def _evened(D: Floats, bound: list[int], scale: Floats, load: Floats, free: Floats) -> Floats:
    """The ``load`` (k,) and ``free`` loads (k, d) in which what is ``bound`` bears its part by least norm.

    Sliding friction, which follows it, has no part in the norm.
    """
    if not free.size:
        return load
    _, values, across = np.linalg.svd((D * scale * scale[:, None])[np.ix_(bound, bound)])
    shared = across[int(np.sum(values > FREE * values.max(initial=0.0))) :]
    more = np.linalg.lstsq(shared @ free[bound], -shared @ load[bound], rcond=None)[0]
    return np.asarray(load + free @ more)


def bound_rows(items: Sequence[Item], modes: Sequence[Mode]) -> list[int]:
    """The rows that do not move: the normals of closed contacts, and what sticks."""
    found = [item.normal for item, mode in zip(items, modes, strict=True) if mode is not Mode.OPEN]
    stuck = (item.slips for item, mode in zip(items, modes, strict=True) if mode is Mode.STICKS)
    return [*(row for row in found if row is not None), *(row for slips in stuck for row in slips)]


def _sliding(items: Sequence[Item], modes: Sequence[Mode]) -> list[int]:
    """The rows along a line that begin to slide."""
    return [x.slips[0] for x, mode in zip(items, modes, strict=True) if mode in SENSE and x.direction is None]


def is_held(D: Floats, bound: Sequence[int], row: int) -> bool:
    """Whether rows that are ``bound`` keep the ``row`` from moving; D is (k, k)."""
    taken = D[row, bound] @ np.linalg.pinv(D[np.ix_(bound, bound)], rcond=1e-11) @ D[bound, row]
    return bool(D[row, row] - taken <= EXACT * D[row, row])


def _limits(
    D: Floats, c: Floats, items: Sequence[Item], modes: Sequence[Mode], scale: Floats, late: float
) -> Iterator[Limit]:
    """The inequalities of the laws, for loads r/``scale`` (k,); what gives way may turn back by ``late``."""
    unit, none = np.eye(len(c)), np.zeros((0, len(c)))
    for item, mode in zip(items, modes, strict=True):
        n, slips = item.normal, list(item.slips)
        if n is not None:
            back = late if item.options[0] is Mode.OPEN else 0.0
            opens = back + scale[n] * (c[n] + item.shift), scale[n] * D[n] * scale, none
            yield opens if mode is Mode.OPEN else (0.0, unit[n], none)
        if mode is Mode.STICKS:
            limit, slope = item.limit(len(c), static=True)
            yield (
                limit / scale[slips[0]],
                slope * scale / scale[slips[0]],
                scale[slips, None] / scale[slips[0]] * unit[slips],
            )
        elif mode in SENSE and item.direction is None:
            sense, row, back = SENSE[mode], slips[0], 0.0 if Mode.STICKS in item.options else late
            yield back + sense * scale[row] * c[row], sense * scale[row] * D[row] * scale, none


def apart(items: Sequence[Item]) -> tuple[list[int], list[Item]]:
    """The rows of ``items``, one after the other, and the items with their rows renumbered among these."""
    rows = [row for item in items for row in (item.normal, *item.slips) if row is not None]
    at = {row: j for j, row in enumerate(rows)}
    return rows, [
        replace(
            x,
            normal=None if x.normal is None else at[x.normal],
            slips=tuple(at[s] for s in x.slips),
            bears=None if x.bears is None else x.bears[:, rows],
        )
        for x in items
    ]
