"""The laws met by a prox iteration: projected Gauss-Seidel on normal forces and round cones until nothing changes.

Source: P. Alart, A. Curnier, A mixed formulation for frictional contact problems, Comp. Meth. Appl. Mech. Eng. 92
(1991), pp. 353-375.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lag2fmu.deadline import check_time
from lag2fmu.reference.hybrid.laws import EXACT, Item, Outcome, lawful, units
from lag2fmu.reference.hybrid.modes import Mode
from lag2fmu.reference.state import Floats

SWEEPS, STILL = 50_000, 1e-15
"""The most sweeps; and the change of forces in a sweep, in their sizes, with which they have come to rest: rounding."""
PATIENCE = 20
"""The sweeps from one trial of the modes that the projections have reached to the next."""


def iterated(D: Floats, c: Floats, items: Sequence[Item], pace: float) -> Outcome | None:
    """The outcome for D (k, k), c (k,), first with static limits, then with sliding limits for items that slide."""
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
    parts = [_ItemRows(D, c, item, diagonal) for item in items]
    for sweep in range(1, SWEEPS + 1):
        check_time()
        before = r.copy()
        for part, limit, lowest in zip(parts, limits, least, strict=True):
            n = part.item.normal
            if n is not None:
                r[n] = max(lowest, r[n] - (part.normal @ r + part.approach) / diagonal[n])
            part.slip_forces(limit if n is None else limit * r[n], r)
        change = float(np.max(np.abs(r - before) / size, initial=0.0))
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
    if in_space(items) or any(mode not in item.options for item, mode in zip(items, reached.modes, strict=True)):
        return None
    bound = [replace(item, friction=limit, static=limit) for item, limit in zip(items, limits, strict=True)]
    return lawful(D, c, bound, reached.modes, pace)


class _ItemRows:
    """What D (k, k), c (k,) and its ``diagonal`` (k,) hold for an ``item``."""

    def __init__(self, D: Floats, c: Floats, item: Item, diagonal: Floats) -> None:
        n, slips = item.normal, list(item.slips)
        self.item, self.slips = item, slips
        if n is not None:
            self.normal, self.approach = D[n], c[n] + item.shift
        if slips:
            self.along, self.drift, self.stiffest = D[slips], c[slips], diagonal[slips].max()
        if item.direction is not None:
            self.sliding = -item.friction * np.array(item.direction)

    def slip_forces(self, limit: float, r: Floats) -> None:
        """Project the tangential forces once, within r (k,), to a size of at most ``limit``."""
        item, slips = self.item, self.slips
        if not slips:
            return
        if item.direction is not None:
            r[slips] = self.sliding if item.normal is None else self.sliding * r[item.normal]
            return
        trial = r[slips] - (self.along @ r + self.drift) / self.stiffest
        length = math.hypot(*trial)
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


def in_space(items: Sequence[Item]) -> bool:
    """Whether one of the ``items`` may slide in space, in a direction that is not known yet."""
    return any(len(item.slips) == 2 and item.direction is None and len(item.options) > 1 for item in items)


def expanded(D: Floats, c: Floats, items: Sequence[Item], least: Sequence[float]) -> Floats | None:
    """r (k,) with normal forces of ``least`` or more; they are greater only where w would be negative otherwise."""
    found = _projected(D, c, items, [item.friction for item in items], 0.0, least)
    return None if found is None else found.forces
