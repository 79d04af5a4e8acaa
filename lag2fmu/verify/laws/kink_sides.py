"""On which sides of the kinks of a mechanism the states of a run are, and what is evaluated on these sides."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from lag2fmu.reference.hybrid.elements import Elements
from lag2fmu.reference.state import Floats, StateBatch

UNTOLD = 1e-9
"""Relative to its greatest value: a margin that is smaller does not tell its side."""


def sides_along(e: Elements, state: StateBatch) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """The sides of all kinks of ``e`` at a batch of m states, (s, m), 1 or -1, and which of them the states tell."""
    m = len(state.t)
    sides = np.ones((e.sides, m), dtype=np.intp)
    margins = np.zeros((e.sides, m))
    for _ in range(e.sides + 1 if e.sides else 0):  # margins may depend on other sides
        for kind in np.unique(sides, axis=1).T:
            e.set_sides(tuple(int(side) for side in kind))
            at = np.flatnonzero((sides == kind[:, None]).all(axis=0))
            margins[:, at] = e.events(part_of(state, at))[0]
        sides = np.where(margins > 0, 1, -1)
    return sides, tells(margins)


def by_sides(
    e: Elements, sides: NDArray[np.intp], evaluate: Callable[[NDArray[np.intp]], Sequence[Floats]]
) -> list[Floats]:
    """What ``evaluate`` finds for each group of places (k,) with the same ``sides`` (s, m), which ``e`` is set to.

    Its arrays (..., k) are put together as (..., m).
    """
    kinds, group = np.unique(sides, axis=1, return_inverse=True)
    places = [np.flatnonzero(group.ravel() == k) for k in range(kinds.shape[1])]
    found = []
    for kind, at in zip(kinds.T, places, strict=True):
        e.set_sides(tuple(int(side) for side in kind))
        found.append(evaluate(at))
    order = np.argsort(np.concatenate(places))
    return [np.concatenate(part, axis=-1)[..., order] for part in zip(*found, strict=True)]


def tells(margins: Floats) -> NDArray[np.bool_]:
    """Which of the ``margins`` (k, m) tell on which side of 0 they are: those that are more than rounding."""
    return np.asarray(np.abs(margins) > UNTOLD * np.abs(margins).max(axis=1, initial=0.0, keepdims=True))


def part_of(state: StateBatch, at: NDArray[np.intp] | Sequence[int]) -> StateBatch:
    """The states ``at`` these places (k,) of a batch."""
    return StateBatch(state.t[at], state.q[:, at], state.qd[:, at], state.inputs[:, at])
