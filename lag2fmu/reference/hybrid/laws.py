"""The laws of contact, impact and dry friction, met by trying every combination of modes, or by a prox iteration.

Rows answer w = D r + c. At an impact w are the velocities behind it and r are impulses; between impacts w are
accelerations and r are forces. A normal row obeys 0 <= r and 0 <= w + shift, one of the two being 0. A tangential row
is held at w = 0 while r is within the cone, or gives way with w against r and |r| at its limit. The limit is
``friction`` times the normal r (Coulomb's law), or a given capacity.

Sources: Ch. Glocker, Set-Valued Force Laws, Springer 2001, chapters 4 to 7; P. Alart, A. Curnier, A mixed formulation
for frictional contact problems, Comp. Meth. Appl. Mech. Eng. 92 (1991), pp. 353-375, for the prox iteration.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np

from lag2fmu.deadline import check_time
from lag2fmu.reference.hybrid.limits import FREE, Limit, facet, margin, nearest
from lag2fmu.reference.hybrid.modes import SENSE, Mode
from lag2fmu.reference.state import Floats

CLOSED = (Mode.STICKS, Mode.FORWARD, Mode.BACKWARD)
PLANES = {0: (Mode.SLIDES,), 1: CLOSED, 2: (Mode.STICKS, Mode.SLIDES)}
"""{number of slips: the modes of a closed contact}."""

MOST = 3000
"""If there are more combinations, only those near the preferred one are tried, and then the prox iteration."""
EXACT = 1e-9
"""Relative violation of a law that counts as rounding."""
SWEEPS, STILL = 50_000, 1e-15
PATIENCE = 20
"""After every so many sweeps the modes that the projections have reached are tried."""


@dataclass(frozen=True)
class Item:
    """An element among the rows: a contact with a ``normal`` row, or dry friction without one.

    - ``options``: the modes to be tried, in order of preference; ``slips``: its tangential rows.
    - ``friction``, ``static``: the sliding and static coefficients of a contact, or forces (N, N.m) of dry friction.
    - ``direction``: that of a slip that goes on; its sliding force is then given, and its w is free.
    - ``shift``: restitution times the approaching speed (m/s) of a normal row.
    """

    options: tuple[Mode, ...]
    normal: int | None
    slips: tuple[int, ...] = ()
    friction: float = 0.0
    static: float = 0.0
    shift: float = 0.0
    direction: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Outcome:
    """The ``modes`` of the items, ``forces`` r (k,), ``answers`` w (k,) of all rows, directions of slips in space."""

    modes: tuple[Mode, ...]
    forces: Floats
    answers: Floats
    directions: tuple[tuple[float, ...] | None, ...]


def decided(
    D: Floats,
    c: Floats,
    items: Sequence[Item],
    pace: float,
    cost: Callable[[tuple[Mode, ...]], float] | None = None,
) -> Outcome | None:
    """The modes that meet the laws, for D (k, k) and c (k,); of several the first of least ``cost``.

    ``pace``: the least size, in units of sqrt(D) of its row, that errors of w are measured by. None if no combination
    meets the laws (Painleve's paradox). Source: Ch. Glocker, Set-Valued Force Laws, 2001, chapters 4 to 7.
    """
    if _in_space(items):
        return _iterated(D, c, items, pace)
    few = bool(np.prod([float(len(item.options)) for item in items]) <= MOST)
    tried = product(*(item.options for item in items)) if few else _near(items, cost)
    found, least = None, np.inf
    for modes in tried:
        price = cost(modes) if cost else 0.0
        outcome = lawful(D, c, items, modes, pace) if price < least else None
        if outcome is not None:
            found, least = outcome, price
            if not cost:
                break
    return found if few or found is not None else _iterated(D, c, items, pace)


def lawful(D: Floats, c: Floats, items: Sequence[Item], modes: tuple[Mode, ...], pace: float) -> Outcome | None:
    """The outcome of these ``modes`` for D (k, k) and c (k,); None if it breaks a law.

    What others hold at rest sticks: a row that does not move as long as the other modes last does not slide.
    """
    check_time()
    scale = 1.0 / np.sqrt(np.maximum(np.diagonal(D), 1e-300))
    solved = _forces(D, c, items, modes, scale)
    if solved is None:
        return None
    load, free = solved
    limits, bar = list(_limits(D, c, items, modes, scale)), EXACT * units(D, c, pace)[1] / scale
    broken = [limit for limit in limits if margin(limit, load) < -bar[0]]
    if broken and free.size and all(np.abs(facet(limit, load) @ free).max() > FREE for limit in broken):
        shared = nearest(load, free, limits)
        load = load if shared is None else shared
    if any(margin(limit, load) < -bar[0] for limit in limits):
        return None
    r = scale * load
    w = D @ r + c
    slow = np.abs(w) * scale <= bar
    if any(_held(D, items, modes, row) for row in _sliding(items, modes) if slow[row]):
        return None
    return Outcome(modes, r, w, tuple(item.direction for item in items))


def _in_space(items: Sequence[Item]) -> bool:
    """Whether one of the ``items`` may slide in space, in a direction that is not known yet."""
    return any(len(item.slips) == 2 and item.direction is None and len(item.options) > 1 for item in items)


def _near(items: Sequence[Item], cost: Callable[[tuple[Mode, ...]], float] | None) -> Iterator[tuple[Mode, ...]]:
    """The modes of least ``cost``, or without it the preferred ones; then those that differ in one or two items."""
    first = tuple(item.options[0] for item in items)
    if cost:
        for i, item in enumerate(items):
            first = min(((*first[:i], mode, *first[i + 1 :]) for mode in item.options), key=cost)
    others = [(i, mode) for i, item in enumerate(items) for mode in item.options if mode is not first[i]]
    for count in range(3):
        for changes in combinations(others, count):
            changed = dict(changes)
            yield tuple(changed.get(i, mode) for i, mode in enumerate(first))


def all_outcomes(D: Floats, c: Floats, items: Sequence[Item], pace: float) -> list[Outcome]:
    """Every combination of modes that meets the laws, in order; D is (k, k), c is (k,), ``pace`` as in ``decided``."""
    outcomes = (lawful(D, c, items, modes, pace) for modes in product(*(item.options for item in items)))
    return [outcome for outcome in outcomes if outcome is not None]


def units(D: Floats, c: Floats, pace: float) -> tuple[Floats, Floats]:
    """The units of w and of r of the rows, (k,) each: one energy for all rows, by their own inertia."""
    diagonal = np.maximum(np.diagonal(D), 1e-300)
    pace = max(float(np.max(np.abs(c) / np.sqrt(diagonal), initial=0.0)), pace, 1e-300)
    return pace * np.sqrt(diagonal), pace / np.sqrt(diagonal)


def _forces(
    D: Floats, c: Floats, items: Sequence[Item], modes: Sequence[Mode], scale: Floats
) -> tuple[Floats, Floats] | None:
    """Loads r/``scale`` (k,) of least norm in these ``modes``, and what may be added to them, (k, d).

    None where the modes contradict each other.
    """
    k = len(c)
    A, b = np.eye(k), np.zeros(k)
    for row in _bound(items, modes):
        A[row], b[row] = D[row], -c[row]
    for item, mode in zip(items, modes, strict=True):
        if item.normal is not None and mode is not Mode.OPEN:
            b[item.normal] -= item.shift
        for i, row in enumerate(item.slips if mode not in (Mode.STICKS, Mode.OPEN) else ()):
            along = item.direction[i] if item.direction is not None else SENSE[mode]
            if item.normal is None:
                b[row] = -item.friction * along
            else:
                A[row, item.normal] = item.friction * along
    weighed = A * scale
    length = np.maximum(np.abs(weighed).max(axis=1, initial=0.0), 1e-300)
    u, s, across = np.linalg.svd(weighed / length[:, None])
    rank = int(np.sum(s > 1e-11 * s.max(initial=0.0)))
    load: Floats = across[:rank].T @ ((u.T @ (b / length))[:rank] / s[:rank])
    rest = np.abs(weighed @ load - b) / length
    met = (rest <= EXACT * max(1e-300, float(np.abs(b / length).max(initial=0.0)))).all()
    return (load, across[rank:].T) if met else None


def _bound(items: Sequence[Item], modes: Sequence[Mode]) -> list[int]:
    """The rows that do not move: the normals of closed contacts, and what sticks."""
    found = [item.normal for item, mode in zip(items, modes, strict=True) if mode is not Mode.OPEN]
    stuck = (item.slips for item, mode in zip(items, modes, strict=True) if mode is Mode.STICKS)
    return [*(row for row in found if row is not None), *(row for slips in stuck for row in slips)]


def _sliding(items: Sequence[Item], modes: Sequence[Mode]) -> list[int]:
    """The rows along a line that begin to slide."""
    return [x.slips[0] for x, mode in zip(items, modes, strict=True) if mode in SENSE and x.direction is None]


def _held(D: Floats, items: Sequence[Item], modes: Sequence[Mode], row: int) -> bool:
    """Whether what does not move keeps the ``row`` from moving."""
    bound = _bound(items, modes)
    taken = D[row, bound] @ np.linalg.pinv(D[np.ix_(bound, bound)], rcond=1e-11) @ D[bound, row]
    return bool(D[row, row] - taken <= EXACT * D[row, row])


def _limits(
    D: Floats, c: Floats, items: Sequence[Item], modes: Sequence[Mode], scale: Floats
) -> Iterator[Limit]:
    """The inequalities of the laws, for loads r/``scale`` (k,)."""
    unit, none = np.eye(len(c)), np.zeros((0, len(c)))
    for item, mode in zip(items, modes, strict=True):
        n, slips = item.normal, list(item.slips)
        if n is not None:
            opens = scale[n] * (c[n] + item.shift), scale[n] * D[n] * scale, none
            yield opens if mode is Mode.OPEN else (0.0, unit[n], none)
        if mode is Mode.STICKS:
            tangents, static = scale[slips, None] / scale[slips[0]] * unit[slips], item.static / scale[slips[0]]
            yield (static, 0 * unit[0], tangents) if n is None else (0.0, static * scale[n] * unit[n], tangents)
        elif mode in SENSE and item.direction is None:
            sense, row = SENSE[mode], slips[0]
            yield sense * scale[row] * c[row], sense * scale[row] * D[row] * scale, none


def expanded(D: Floats, c: Floats, items: Sequence[Item], least: Sequence[float]) -> Floats | None:
    """r (k,) with normal forces of ``least`` or more; they are greater only where w would be negative otherwise."""
    found = _projected(D, c, items, [item.friction for item in items], 0.0, least)
    return None if found is None else found.forces


# ------------------------------------------------------------------------------------------------------------- in space


def _iterated(D: Floats, c: Floats, items: Sequence[Item], pace: float) -> Outcome | None:
    """The outcome by projections, first with static limits, then with sliding limits for items that slide."""
    found = _projected(D, c, items, [item.static for item in items], pace)
    if found is None:
        return None
    slides = [mode not in (Mode.OPEN, Mode.STICKS) for mode in found.modes]
    if not any(s and item.static > item.friction for s, item in zip(slides, items, strict=True)):
        return found
    limits = [item.friction if s else item.static for s, item in zip(slides, items, strict=True)]
    bound = [
        replace(item, options=tuple(o for o in item.options if o is not Mode.STICKS)) if s else item
        for s, item in zip(slides, items, strict=True)
    ]
    return _projected(D, c, bound, limits, pace)


def _projected(
    D: Floats,
    c: Floats,
    items: Sequence[Item],
    limits: Sequence[float],
    pace: float,
    least: Sequence[float] | None = None,
) -> Outcome | None:
    """The prox iteration: projected Gauss-Seidel on the laws until nothing changes; None if it does not converge."""
    least = least or [0.0] * len(items)
    k, diagonal = len(c), np.maximum(np.diagonal(D), 1e-300)
    r, size = np.zeros(k), units(D, c, pace)[1]
    for sweep in range(1, SWEEPS + 1):
        check_time()
        change = 0.0
        for item, limit, lowest in zip(items, limits, least, strict=True):
            rows = [*item.slips] if item.normal is None else [item.normal, *item.slips]
            before, n = r[rows].copy(), item.normal
            if n is not None:
                r[n] = max(lowest, r[n] - (D[n] @ r + c[n] + item.shift) / diagonal[n])
            _slip_forces(D, c, item, limit if n is None else limit * r[n], r, diagonal)
            change = max(change, float(np.max(np.abs(r[rows] - before) / size[rows], initial=0.0)))
        if change <= STILL * max(1.0, float(np.max(np.abs(r) / size, initial=0.0))):
            return _read(D, c, items, limits, r, size)
        if sweep % PATIENCE == 0 and not any(least):
            tried = _tried(D, c, items, limits, _read(D, c, items, limits, r, size), pace)
            if tried is not None:
                return tried
    return None


def _tried(
    D: Floats, c: Floats, items: Sequence[Item], limits: Sequence[float], reached: Outcome, pace: float
) -> Outcome | None:
    """The outcome with the modes that were ``reached``, if it meets the laws and all modes are options, else None.

    Projections find the modes soon, but the forces slowly where one row moves many others. None for slips in space.
    """
    if _in_space(items) or any(mode not in item.options for item, mode in zip(items, reached.modes, strict=True)):
        return None
    bound = [replace(item, friction=limit, static=limit) for item, limit in zip(items, limits, strict=True)]
    return lawful(D, c, bound, reached.modes, pace)


def _slip_forces(D: Floats, c: Floats, item: Item, limit: float, r: Floats, diagonal: Floats) -> None:
    """Project the tangential forces of ``item`` once, within r (k,), to a size of at most ``limit``."""
    slips = list(item.slips)
    if not slips:
        return
    if item.direction is not None:
        normal = 1.0 if item.normal is None else r[item.normal]
        r[slips] = -item.friction * normal * np.array(item.direction)
        return
    trial = r[slips] - (D[slips] @ r + c[slips]) / diagonal[slips].max()
    length = float(np.hypot.reduce(trial))
    r[slips] = trial if length <= limit else trial * (limit / length)


def _read(D: Floats, c: Floats, items: Sequence[Item], limits: Sequence[float], r: Floats, size: Floats) -> Outcome:
    """The modes that the forces r (k,) belong to."""
    w = D @ r + c
    found = []
    for item, coefficient in zip(items, limits, strict=True):
        limit = coefficient * (1.0 if item.normal is None else r[item.normal])
        found.append(_mode_of(item, limit, r, w, size))
    return Outcome(tuple(mode for mode, _ in found), r, w, tuple(direction for _, direction in found))


def _mode_of(item: Item, limit: float, r: Floats, w: Floats, size: Floats) -> tuple[Mode, tuple[float, ...] | None]:
    """The mode of ``item`` and the direction in which it slides, for forces r and motions w (k,)."""
    slips, direction, n = list(item.slips), item.direction, item.normal
    if n is not None and r[n] <= EXACT * size[n] and Mode.OPEN in item.options:
        return Mode.OPEN, direction
    if not slips:
        return Mode.SLIDES, direction
    if direction is None:
        force, moves = float(np.hypot.reduce(r[slips])), float(np.hypot.reduce(w[slips]))
        if (Mode.STICKS in item.options and moves <= EXACT) or force < limit * (1 - EXACT):
            return Mode.STICKS, direction
        if len(slips) == 1:
            return _sense(-r[slips[0]]), direction
        direction = tuple(-r[slips] / force) if force > 0 else tuple(w[slips] / moves)
    return (_sense(direction[0]) if len(slips) == 1 else Mode.SLIDES), direction


def _sense(slip: float) -> Mode:
    """The mode that slides along a line in the direction of the sign of ``slip``."""
    return Mode.FORWARD if slip > 0 else Mode.BACKWARD


def apart(items: Sequence[Item]) -> tuple[list[int], list[Item]]:
    """The rows of ``items``, one after the other, and the items with their rows renumbered among these."""
    rows = [row for item in items for row in (item.normal, *item.slips) if row is not None]
    at = {row: j for j, row in enumerate(rows)}
    return rows, [
        replace(x, normal=None if x.normal is None else at[x.normal], slips=tuple(at[s] for s in x.slips))
        for x in items
    ]
