"""How contacts that touch share a load that is not unique: idle ones take a part, and what slides does so evenly."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import combinations, islice

import numpy as np

from lag2fmu.reference.hybrid.laws import EXACT, Item, Outcome, bound_rows, idle_contacts, lawful, of_least_norm, units
from lag2fmu.reference.hybrid.modes import Mode
from lag2fmu.reference.hybrid.projections import projected
from lag2fmu.reference.state import Floats

TRIED = 200
"""The most sets of contacts that are tried as those which bear nothing."""

TURNS = 30
"""The most turns of loads and slips where contacts begin to slide in space."""


def shared(D: Floats, c: Floats, items: Sequence[Item], found: Outcome, least: float) -> Outcome:
    """The outcome in which contacts that touch and were to bear nothing take a share of the load.

    It is ``found`` where there is none. All of them take one, or else each that can beside those before it, or those
    bear nothing without which the norm is least. D is (k, k), c (k,).
    """
    idle = idle_contacts(D, c, items, found, least)
    items = [_in_direction(item, way) for item, way in zip(items, found.directions, strict=True)]
    items = [_with_slip(item, D, c, found, least) if j in idle else item for j, item in enumerate(items)]
    for group in [idle, *([j] for j in idle)] if len(idle) > 1 else [idle]:
        if any(found.modes[j] is Mode.OPEN for j in group):
            found = _taken(D, c, items, found, group, least)
    return _lightest(D, c, items, found, [j for j in idle if found.modes[j] is Mode.OPEN], least)


def _lightest(
    D: Floats, c: Floats, items: Sequence[Item], found: Outcome, idle: Sequence[int], least: float
) -> Outcome:
    """The outcome of least norm of those in which others than the ``idle`` contacts bear nothing, or fewer.

    It is ``found`` where nothing slides that the share matters to. D is (k, k), c (k,).
    """
    closed = [j for j, mode in enumerate(found.modes) if items[j].normal is not None and mode is not Mode.OPEN]
    if not any(_rubs(items[j], found.modes[j]) for j in closed):
        return found
    best, scale = found, units(D, c, least)[1]
    spares = (spared for count in range(len(idle)) for spared in combinations(sorted([*closed, *idle]), count + 1))
    for spared in islice(spares, TRIED):
        other = _sparing(D, c, items, found, idle, spared, least)
        if _norm(items, other, scale) < (1 - EXACT) * _norm(items, best, scale):
            best = other
    return best


def _rubs(item: Item, mode: Mode) -> bool:
    """Whether a closed contact slides by friction."""
    return bool(item.slips) and item.friction > 0 and mode is not Mode.STICKS


def _sparing(
    D: Floats,
    c: Floats,
    items: Sequence[Item],
    found: Outcome,
    idle: Sequence[int],
    spared: Sequence[int],
    least: float,
) -> Outcome:
    """The outcome in which ``spared`` contacts bear nothing, and other ``idle`` ones do; ``found`` if there is none."""
    takers = [j for j in idle if j not in spared]
    modes = tuple(Mode.OPEN if j in spared else mode for j, mode in enumerate(found.modes))
    other = _taken(D, c, items, replace(found, modes=modes), takers, least) if takers else found
    return found if other.modes == modes else other


def _norm(items: Sequence[Item], found: Outcome, scale: Floats) -> float:
    """The norm of what rows bear that do not move, in units ``scale`` (k,)."""
    rows = bound_rows(items, found.modes)
    return float(np.linalg.norm(found.forces[rows] / scale[rows]))


def evenly(
    D: Floats, c: Floats, items: Sequence[Item], found: Outcome, least: float, begins: Collection[int]
) -> Outcome:
    """The outcome in which contacts that slide share their load by least norm; D is (k, k), c (k,).

    Those that ``begins`` names slide from rest, in directions that may be others than their items have. ``found`` may
    hold some by other loads, up to the limit of all, and tell slips that go on another way with these. With given loads
    the slips are those of a convex problem; both are found in turn. It is ``found`` where loads are unique, and where
    the turns do not end.
    """
    now = _with_idle(D, c, items, found, least)
    rubbing = _rubbing(items, now)
    free = [replace(item, direction=None) if j in begins else item for j, item in enumerate(items)]
    for turn in range(TURNS if len(rubbing) > 1 else 0):
        directed = [_in_direction(item, way) for item, way in zip(items, now.directions, strict=True)]
        loads = of_least_norm(D, c, directed, now.modes, least)
        if loads is None:
            return found
        if turn > 0 and np.abs(loads - now.forces).max() <= EXACT * np.abs(loads).max():
            return lawful(D, c, directed, now.modes, least) or found
        slips = _slips(D, c, free, rubbing, replace(now, forces=loads), least)
        if slips is None:
            return found
        now = slips
    return found


def _slips(
    D: Floats, c: Floats, items: Sequence[Item], rubbing: Sequence[int], now: Outcome, least: float
) -> Outcome | None:
    """The outcome ``now`` with the slips of contacts that are ``rubbing`` under its forces; None if there are none.

    D is (k, k), c (k,).
    """
    parts = [x for j, item in enumerate(items) for x in (_with_load(item, now.forces) if j in rubbing else [item])]
    found = projected(D, c, parts, least)
    if found is None:
        return None
    place = {x.slips: k for k, x in enumerate(parts)}
    modes, ways = list(now.modes), list(now.directions)
    for j in rubbing:
        mode, way = found.modes[place[items[j].slips]], found.directions[place[items[j].slips]]
        if mode in items[j].options:
            modes[j], ways[j] = mode, way
        else:  # it gives way, and friction that is at its limit only just makes no slip yet
            friction = found.forces[list(items[j].slips)]
            modes[j], ways[j] = Mode.SLIDES, ways[j] or tuple(-friction / np.hypot.reduce(friction))
    return replace(now, modes=tuple(modes), directions=tuple(ways))


def _rubbing(items: Sequence[Item], found: Outcome) -> list[int]:
    """The contacts in space that are closed, if one of them slides."""
    closed = [
        j
        for j, (item, mode) in enumerate(zip(items, found.modes, strict=True))
        if item.normal is not None and len(item.slips) == 2 and mode is not Mode.OPEN
    ]
    return closed if any(found.modes[j] is Mode.SLIDES for j in closed) else []


def _with_load(item: Item, loads: Floats) -> list[Item]:
    """The normal of a contact that slides, and its friction with the limit that the ``loads`` (k,) make."""
    limit = item.most(loads)
    return [
        replace(item, slips=(), options=(Mode.SLIDES,), direction=None),
        Item((Mode.STICKS, Mode.SLIDES), None, item.slips, limit, limit, direction=item.direction),
    ]


def _taken(D: Floats, c: Floats, items: Sequence[Item], found: Outcome, group: Sequence[int], least: float) -> Outcome:
    """The outcome in which the open contacts of the ``group`` bear, too; ``found`` where they cannot.

    D is (k, k), c (k,).
    """
    takers = [normal for j in group if (normal := items[j].normal) is not None]
    most = units(D, c, least)[1][takers]
    for ways in zip(*(_closed_ways(items[j]) for j in group), strict=False):
        taken = dict(zip(group, ways, strict=True))
        modes = tuple(taken.get(j, mode) for j, mode in enumerate(found.modes))
        other = lawful(D, c, items, modes, least)
        if other and (other.forces[takers] > EXACT * most).all():
            return other
    return found


def _closed_ways(item: Item) -> list[Mode]:
    """The modes in which a contact may be closed; a slip in space has to have its direction."""
    without = item.direction is None
    return [mode for mode in item.options if mode is not Mode.OPEN and not (mode is Mode.SLIDES and without)]


def _with_idle(D: Floats, c: Floats, items: Sequence[Item], found: Outcome, least: float) -> Outcome:
    """The outcome ``found`` in which contacts in space that go on to touch are closed; D is (k, k), c (k,)."""
    modes, ways = list(found.modes), list(found.directions)
    for j in idle_contacts(D, c, items, found, least):
        if len(items[j].slips) == 2:
            ways[j] = _with_slip(items[j], D, c, found, least).direction
            modes[j] = Mode.SLIDES if ways[j] else Mode.STICKS
    return replace(found, modes=tuple(modes), directions=tuple(ways))


def _with_slip(item: Item, D: Floats, c: Floats, found: Outcome, least: float) -> Item:
    """The ``item`` of a contact in space at rest, in the direction of the slip that others make; D is (k, k)."""
    rows = list(item.slips)
    slip, motion = found.answers[rows], units(D, c, least)[0][rows]
    if item.direction or len(rows) < 2 or (np.abs(slip) <= EXACT * motion).all():
        return item
    return replace(item, direction=tuple(slip / np.hypot.reduce(slip)))


def _in_direction(item: Item, way: tuple[float, ...] | None) -> Item:
    """The ``item`` whose slip has the direction that was found; an open contact keeps its own."""
    return item if way is None else replace(item, direction=way)
