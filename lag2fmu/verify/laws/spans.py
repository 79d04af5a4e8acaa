"""Laws between the times of a run: what moves is the integral of its rate, and energy that of power.

Three times in a row between which nothing happens give two rules for an integral, Simpson's and that of trapezoids. The
difference of the two bounds the error of the better one, also where a rate jumps between the times.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from lag2fmu.description import names
from lag2fmu.verify.laws.along import Along
from lag2fmu.verify.laws.residual import Accuracy, Floats, Residual, worst

SPREAD = 6.0
"""A jump of the rate moves the integral from Simpson's rule by at most 4 times the difference of the two rules."""
NEAR = 2
"""The difference of the rules may pass through 0: the greatest of so many times before and behind is taken."""


def between_points(a: Along, accuracy: Accuracy) -> Iterator[Residual]:
    """The worst residual of each law that holds between times at which nothing happens."""
    q = [c.name for c in a.mechanism.coordinates]
    units = ["rad" if a.units.get(c, "m") == "rad" else "m" for c in q]
    nominal = a.system.nominal
    size = np.maximum(np.ptp(a.q, axis=1), nominal)[:, None]
    yield from _integrals(a, "positions follow velocities", q, units, a.q, a.qd, accuracy.states * size)
    size = np.maximum(np.abs(a.qd).max(axis=1), nominal)[:, None]
    rates = [f"{unit}/s" for unit in units]
    yield from _integrals(a, "velocities follow accelerations", q, rates, a.qd, a.qdd, accuracy.states * size)
    lost, whole = a.run[names.DISSIPATED_ENERGY][None], a.run["generalized_energy"][None]
    bar = accuracy.motion * a.energy_size
    yield from _integrals(a, "dissipated energy = work of friction", ["energy"], ["J"], lost, a.lost[None], bar)
    yield from _integrals(a, "change of energy = work", ["energy"], ["J"], whole + lost, a.power[None], bar)


def _integrals(
    a: Along,
    law: str,
    elements: Sequence[str],
    units: Sequence[str],
    values: Floats,
    rates: Floats,
    bars: Floats | float,
) -> Iterator[Residual]:
    """The residual of ``values`` (k, m) as integrals of ``rates`` (k, m)."""
    h = np.diff(a.time)
    even = np.isclose(h[:-1], h[1:], rtol=1e-6, atol=0.0)
    at = np.flatnonzero(a.quiet[:-1] & a.quiet[1:] & even)
    step, (x, y, z) = h[at], (rates[:, at], rates[:, at + 1], rates[:, at + 2])
    simpson, trapezoids = step / 3 * (x + 4 * y + z), step / 2 * (x + 2 * y + z)
    off = np.abs(values[:, at + 2] - values[:, at] - simpson)
    padded = np.pad(np.abs(simpson - trapezoids), ((0, 0), (NEAR, NEAR)))
    spread = np.maximum.reduce([padded[:, i : i + len(at)] for i in range(2 * NEAR + 1)])
    yield from worst(law, elements, units, a.time[at], off, bars + SPREAD * spread)
