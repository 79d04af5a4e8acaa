"""Laws between the times of a run: what moves is the integral of its rate, and energy that of power.

Three times in a row between which nothing happens give two rules for an integral: that of the parabola through the
rates, which is Simpson's where times are even, and that of trapezoids. The difference of the two bounds the error of
the better one, also where a rate jumps between the times. It does not bound that of a pulse between two times, as where
Euler's angles pass their singularity: a run with several times in each step tells it from a fault.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lag2fmu.description import names
from lag2fmu.verify.laws.along import Along
from lag2fmu.verify.laws.points import rubbing
from lag2fmu.verify.laws.residual import Accuracy, Floats, Residual, worst

INTEGRALS = (
    "positions follow velocities",
    "velocities follow accelerations",
    "dissipated energy = work of friction",
    "change of energy = work",
)
"""The laws of this module."""
SPREAD = 6.0
"""A jump of the rate moves the integral from Simpson's rule by at most 4 times the difference of the two rules."""
EVEN = 0.2
"""Two spans whose lengths have a ratio below this do not tell how a rate bends."""
NEAR = 2
"""The times before and behind whose greatest difference of the rules is taken: at one time it may pass through 0."""


def between_points(a: Along, accuracy: Accuracy, count: int = 2) -> Iterator[Residual]:
    """The worst residual of each law that holds over ``count`` intervals between times at which nothing happens.

    ``count`` is even.
    """
    q = [c.name for c in a.mechanism.coordinates]
    units = ["rad" if a.units.get(c, "m") == "rad" else "m" for c in q]
    nominal, step = a.system.nominal, accuracy.step
    bars = accuracy.states * np.maximum(np.ptp(a.q, axis=1), nominal)[:, None]
    moved = Integral(INTEGRALS[0], q, units, a.q, a.qd, step, step * a.shifts)
    yield from moved.residual(a, bars, count)
    bars = accuracy.states * np.maximum(np.abs(a.qd).max(axis=1), nominal)[:, None]
    rates = [f"{unit}/s" for unit in units]
    turned = _turned(a, accuracy)
    changed = Integral(INTEGRALS[1], q, rates, a.qd, a.qdd, step, turned, step * a.shifts)
    yield from changed.residual(a, bars, count)
    lost, whole = a.run[names.DISSIPATED_ENERGY][None], a.run["generalized_energy"][None]
    unsure = step * (np.abs(a.forces) * a.turning).sum(axis=0)[None]
    bars = np.full((1, 1), accuracy.motion * a.energy_size)
    for law, values, rate in (
        (INTEGRALS[2], lost, a.lost),
        (INTEGRALS[3], whole + lost, a.power),
    ):
        yield from Integral(law, ["energy"], ["J"], values, rate[None], step, unsure).residual(a, bars, count)


def _turned(a: Along, accuracy: Accuracy) -> Floats:
    """What errors of the directions of slow slips in space make of accelerations, (n, m)."""
    found = np.zeros_like(a.qdd)
    for item in rubbing(a, accuracy):
        if len(item.rows) > 1:
            force = item.sliding * np.minimum(1.0, item.slow / np.maximum(item.speed, 1e-300))
            moved = np.linalg.pinv(np.moveaxis(a.mass, -1, 0)) @ np.moveaxis(a.slopes[item.rows], -1, 0).swapaxes(1, 2)
            found += np.abs(moved).max(axis=-1).T * force * item.moves
    return np.asarray(found)


@dataclass(frozen=True)
class Integral:
    """The ``law`` that ``values`` (k, m) of ``elements`` are integrals of ``rates`` (k, m).

    Changes of rates are up to ``late`` (s) late. Rates are ``unsure`` by so much, values ``shown`` with such errors.
    """

    law: str
    elements: Sequence[str]
    units: Sequence[str]
    values: Floats
    rates: Floats
    late: float
    unsure: Floats | float = 0.0
    shown: Floats | float = 0.0

    def residual(self, a: Along, bars: Floats, count: int) -> Iterator[Residual]:
        """By how much the law is broken over ``count`` intervals of ``a``, in units of values; ``bars`` (k, 1)."""
        h, rates, values = np.diff(a.time), self.rates, self.values
        even = np.minimum(h[:-1], h[1:]) > EVEN * np.maximum(h[:-1], h[1:])
        at = np.flatnonzero(_rows(a.quiet, count).all(axis=-1) & _rows(even, count - 1).all(axis=-1))
        lengths, spans = _rows(h, count)[at], _rows(rates, count + 1)[:, at]
        first, second, step = lengths[:, ::2], lengths[:, 1::2], lengths.sum(axis=-1) / 2
        slopes = np.diff(spans, axis=-1) / lengths
        bends = (slopes[..., 1::2] - slopes[..., ::2]) / (first + second)
        trapezoids = (lengths * (spans[..., 1:] + spans[..., :-1])).sum(axis=-1) / 2
        parabolas = trapezoids - (bends * (first**3 + second**3)).sum(axis=-1) / 6
        off = np.abs(values[:, at + count] - values[:, at] - parabolas)
        near = _near(rates)[:, at]  # a change may show in the span before or behind it
        spread = SPREAD * np.abs(parabolas - trapezoids) + self.late * (near.max(axis=-1) - near.min(axis=-1))
        unsure, shown = (np.broadcast_to(x, values.shape) for x in (self.unsure, self.shown))
        spread += 2 * step * _near(unsure)[:, at].max(axis=-1) + 2 * _near(shown)[:, at].max(axis=-1)
        padded = np.pad(spread, ((0, 0), (NEAR * count // 2, NEAR * count // 2)))
        spread = np.maximum.reduce([padded[:, i : i + len(at)] for i in range(NEAR * count + 1)])
        yield from worst(self.law, self.elements, self.units, a.time[at], off, bars + spread)


def _rows(values: NDArray[Any], count: int) -> NDArray[Any]:
    """All ``count`` neighbours along the last axis of ``values`` (..., m): (..., m - count + 1, count), or none."""
    if count > values.shape[-1]:
        return np.zeros((*values.shape[:-1], 0, count), dtype=values.dtype)
    return np.lib.stride_tricks.sliding_window_view(values, count, axis=-1)


def _near(values: Floats) -> Floats:
    """The ``values`` (k, m) at a time before each time, there, and at three behind it, (k, m, 5)."""
    return np.lib.stride_tricks.sliding_window_view(np.pad(values, ((0, 0), (1, 3)), "edge"), 5, axis=1)
