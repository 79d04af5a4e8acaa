"""What becomes free behind an event: a motion that was bound, and that may be perturbed as a start is."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from lag2fmu.reference.hybrid.modes import SENSE, Mode, Modes
from lag2fmu.reference.hybrid.system import HybridSystem
from lag2fmu.reference.state import Floats, StateBatch


def released(system: HybridSystem, state: StateBatch, modes: tuple[Modes, Modes], kick: Floats) -> StateBatch:
    """The single ``state`` behind an event, with a velocity along what the event has freed; all in SI units.

    A contact that opens moves off, and what begins to slip slips on. ``modes`` are those before and behind the event.
    The most that a velocity changes by, in units of ``kick`` (n,), is 1. Nothing else that the modes bind moves.
    """
    rows, senses = np.array([*_freed(system, *modes)], dtype=float).reshape(-1, 2).T
    if not len(rows):
        return state
    point = system.point(state)
    along = system.responses(point, modes[1]).moved[:, 2 + rows.astype(int)] @ senses
    size = float(np.max(np.abs(along) / kick))
    if not 0 < size < np.inf:
        return state
    moved = StateBatch(state.t, state.q, state.qd + along / size, state.inputs)
    return system.projected(moved, modes[1])


def _freed(system: HybridSystem, before: Modes, behind: Modes) -> Iterator[tuple[int, float]]:
    """(row, sense in which it moves) of the rows that are bound ``before`` an event and free ``behind`` it."""
    e = system.elements
    for i, (a, b) in enumerate(zip(before.contacts, behind.contacts, strict=True)):
        if b is Mode.OPEN and a is not Mode.OPEN:
            yield i, 1.0
        elif a is Mode.STICKS and b is not Mode.STICKS:
            senses = (SENSE[b],) if b in SENSE else behind.directions.get(i, ())
            yield from zip(e.slip_rows[i].tolist(), senses, strict=False)  # there is none without friction
    for row, a, b in zip(e.friction_rows.tolist(), before.frictions, behind.frictions, strict=True):
        if a is Mode.STICKS and b is not Mode.STICKS:
            yield row, SENSE[b]
    for row, held, holds in zip(e.latch_rows, before.held, behind.held, strict=True):
        if held > holds:
            yield row, 1.0
