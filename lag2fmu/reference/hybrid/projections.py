"""The laws met by a prox iteration: projected Gauss-Seidel on normal forces and round cones until nothing changes.

Source: P. Alart, A. Curnier, A mixed formulation for frictional contact problems, Comp. Meth. Appl. Mech. Eng. 92
(1991), pp. 353-375.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from lag2fmu.deadline import check_time
from lag2fmu.reference.hybrid.laws import EXACT, Item, Outcome, lawful, units
from lag2fmu.reference.hybrid.modes import Mode
from lag2fmu.reference.state import Floats

SWEEPS, STILL = 50_000, 1e-15
"""The most sweeps; and the change of forces in a sweep, in their sizes, with which they have come to rest: rounding."""
WANDERS, LULL = 1e-12, 1000
"""Where redundant rows contradict each other by rounding, forces drift without end: by changes of at most WANDERS that
do not halve in LULL sweeps."""
PATIENCE = 20
"""The sweeps from one trial of the modes that the projections have reached to the next."""


def projected(
    D: Floats, c: Floats, items: Sequence[Item], pace: float, least: Sequence[float] | None = None
) -> Outcome | None:
    """The outcome for D (k, k), c (k,) with normal forces of ``least`` or more; None if sweeps do not come to rest.

    Projections find the modes soon, but the forces slowly where one row moves many others. So the modes that they have
    reached are tried now and then, where these tell the forces: not of slips in space, nor with least forces.
    """
    k, diagonal = len(c), np.maximum(np.diagonal(D), 1e-300)
    r, size = np.zeros(k), units(D, c, pace)[1]
    parts = [_ItemRows(D, c, item, diagonal) for item in items]
    telling = least is None and not in_space(items)
    rest = _Rest()
    for sweep in range(1, SWEEPS + 1):
        check_time()
        before = r.copy()
        for part, lowest in zip(parts, least or [0.0] * len(items), strict=True):
            part.project(r, lowest)
        change = float(np.max(np.abs(r - before) / size, initial=0.0))
        if rest.reached(sweep, change / max(1.0, float(np.max(np.abs(r) / size, initial=0.0)))):
            return _read(D, c, items, r, size)
        if telling and sweep % PATIENCE == 0:
            modes = _read(D, c, items, r, size).modes
            lasting = all(mode in item.options for item, mode in zip(items, modes, strict=True))
            outcome = lawful(D, c, items, modes, pace) if lasting else None
            if outcome is not None:
                return outcome
    return None


class _Rest:
    """Whether forces have come to rest: the ``smallest`` change of a sweep, which halved the one before."""

    def __init__(self) -> None:
        self.smallest, self.since = math.inf, 0

    def reached(self, sweep: int, change: float) -> bool:
        """Whether this ``change`` in a ``sweep`` is rounding."""
        if change < 0.5 * self.smallest:
            self.smallest, self.since = change, sweep
        return change <= STILL or (change <= WANDERS and sweep > self.since + LULL)


class _ItemRows:
    """What D (k, k), c (k,) and its ``diagonal`` (k,) hold for an ``item``."""

    def __init__(self, D: Floats, c: Floats, item: Item, diagonal: Floats) -> None:
        n, slips = item.normal, list(item.slips)
        self.item, self.slips = item, slips
        if n is not None:
            self.normal, self.approach, self.stiff = D[n], c[n] + item.shift, diagonal[n]
        if slips:
            self.along, self.drift, self.stiffest = D[slips], c[slips], diagonal[slips].max()
            self.sliding = -np.array(item.direction or ())

    def project(self, r: Floats, lowest: float) -> None:
        """Project the forces once, within r (k,): normal to ``lowest`` or more, tangential to at most their limit."""
        item, slips, n = self.item, self.slips, self.item.normal
        if n is not None:
            r[n] = max(lowest, r[n] - (self.normal @ r + self.approach) / self.stiff)
        if not slips:
            return
        limit = item.most(r)
        if item.direction is not None:
            r[slips] = self.sliding * limit
            return
        trial = r[slips] - (self.along @ r + self.drift) / self.stiffest
        length = math.hypot(*trial)
        r[slips] = trial if length <= limit else trial * (limit / length)


def _read(D: Floats, c: Floats, items: Sequence[Item], r: Floats, size: Floats) -> Outcome:
    """The modes that the forces r (k,) belong to."""
    w = D @ r + c
    found = [_mode_of(item, r, w, size) for item in items]
    return Outcome(tuple(mode for mode, _ in found), r, w, tuple(direction for _, direction in found))


def _mode_of(item: Item, r: Floats, w: Floats, size: Floats) -> tuple[Mode, tuple[float, ...] | None]:
    """The mode of ``item`` and the direction in which it slides, for forces r and motions w (k,)."""
    slips, direction, n = list(item.slips), item.direction, item.normal
    if n is not None and r[n] <= EXACT * size[n] and Mode.OPEN in item.options:
        return Mode.OPEN, direction
    if not slips:
        return Mode.SLIDES, direction
    if direction is None:
        force, moves = float(np.hypot.reduce(r[slips])), float(np.hypot.reduce(w[slips]))
        if (Mode.STICKS in item.options and moves <= EXACT) or force < item.most(r) * (1 - EXACT):
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
