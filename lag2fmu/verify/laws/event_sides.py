"""An event that a run shows from both sides: what jumps there, and the impulses that make it.

An impact changes velocities by impulses P along the rows that touch: M (qd+ - qd-) = J^T P + G^T L. P is found from the
change of velocities alone, and then is what Newton's and Coulomb's laws speak of.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lag2fmu.description import names
from lag2fmu.verify.laws.along import Along
from lag2fmu.verify.laws.residual import Accuracy, Floats

RANK = 1e-9
"""Relative: rows whose answers to impulses differ by less have impulses that nothing tells apart."""


@dataclass(frozen=True)
class EventSides:
    """What happened in ``a`` between the times ``left`` and left + 1."""

    a: Along
    left: int
    accuracy: Accuracy

    @cached_property
    def hits(self) -> Floats:
        """How many impacts each contact had, (u,)."""
        counts = self.a.run.columns([names.impacts(c.name) for c in self.a.mechanism.unilaterals])
        return np.asarray(counts[self.left + 1] - counts[self.left])

    @cached_property
    def change(self) -> Floats:
        """The change of velocities, (n,), without that of the time between the two sides."""
        a, i = self.a, self.left
        return np.asarray(a.qd[:, i + 1] - a.qd[:, i] - a.qdd[:, i] * (a.time[i + 1] - a.time[i]))

    @property
    def moved(self) -> float:
        """By how much positions may jump, in nominal values, where gaps that close up to a step late are opened."""
        return float(self.accuracy.step * (np.abs(self.change) / self.a.system.nominal).max())

    @property
    def drawn(self) -> Floats:
        """The change of positions, (n,), that brings gaps to 0 which are closed to the tolerance before it.

        Impulses along the gaps make it, so coordinates of little inertia move further than the gaps.
        """
        a, gaps = self.a, np.abs(self.a.gaps[self.touching, self.left])
        size = a.gap_sizes[self.touching, 0]
        apart = gaps > self.accuracy.exact * size
        if not apart.any():
            return np.zeros(a.system.n)
        height = np.where(apart, np.minimum(gaps, self.accuracy.states * size), 0.0)
        shares = np.linalg.lstsq(a.mobility(self.touching, self.left), height, rcond=RANK)[0]
        return np.asarray(np.abs(a.answers(self.touching, self.left) @ shares))

    @cached_property
    def touching(self) -> NDArray[np.intp]:
        """The contacts whose gaps are closed before it, (c,)."""
        a = self.a
        gaps = np.minimum(a.gaps[:, self.left], a.gaps[:, self.left + 1])
        return np.flatnonzero(gaps <= self.accuracy.exact * a.gap_sizes[:, 0])

    @cached_property
    def rows(self) -> list[int]:
        """The rows that may have impulses: of contacts that touch, and of latches that hold."""
        a = self.a
        found = [row for i in self.touching for row in (i, *a.e.slip_rows[i])]
        held = a.conditions[:, self.left + 1] > 0
        return [*map(int, found), *(row for row, holds in zip(a.e.latch_rows, held, strict=True) if holds)]

    @cached_property
    def impulses(self) -> tuple[Floats, bool, Floats]:
        """Impulses (k,) along ``rows`` and constraints, whether they are unique, what none explains of M dqd, (n,)."""
        a, at = self.a, self.left + 1
        mass = a.mass[:, :, at]
        given = mass @ self.change
        along = np.concatenate([a.slopes[self.rows, :, at], a.G[:, :, at]]).T
        weight = 1 / np.sqrt(np.maximum(np.abs(np.diagonal(mass)), 1e-300))
        scale = np.maximum(np.linalg.norm(along * weight[:, None], axis=0), 1e-300)
        found, _, rank, _ = np.linalg.lstsq(along * weight[:, None] / scale, given * weight, rcond=RANK)
        loads = found / scale
        return loads, rank == along.shape[1], np.abs(given - along @ loads)

    @cached_property
    def unforced(self) -> Floats:
        """The change of velocities, (n,), but for what steps over events take back of the turning of rows that bear.

        The law that what is closed stays closed tells how fast these rows may be before.
        """
        if self.accuracy.step == 0.0:
            return self.change
        a, at = self.a, self.left + 1
        along = np.concatenate([a.slopes[self.rows, :, at], a.G[:, :, at]]).T
        taken = np.linalg.lstsq(a.mass[:, :, at], along @ self.impulses[0], rcond=None)[0]
        return np.asarray(self.change - taken)

    @cached_property
    def work(self) -> float:
        """The energy (J) that the impulses bring, without what moving walls do: -sum of P (v+ + v-)/2.

        NaN where rows that share an impulse move differently: a stop that a body strikes, and a belt below the body.
        """
        a, i = self.a, self.left
        moving = a.moving[[*self.rows, *range(a.e.k, len(a.moving))]]
        driven = (moving[:, i] + moving[:, i + 1]) / 2
        along = np.concatenate([a.slopes[self.rows, :, i + 1], a.G[:, :, i + 1]])
        apart = driven - along @ np.linalg.lstsq(along, driven, rcond=RANK)[0]
        if not self.impulses[1] and np.abs(apart).max(initial=0.0) > RANK * np.abs(driven).max(initial=0.0):
            return np.nan
        kinetic = float(self.change @ a.mass[:, :, i + 1] @ (a.qd[:, i] + a.qd[:, i + 1])) / 2
        return kinetic + float(self.impulses[0] @ driven)
