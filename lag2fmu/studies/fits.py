"""What a calibration works with: measurements, the values that are free, and how well the model fits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lag2fmu.reference.trajectory import Floats, Trajectory


@dataclass(frozen=True)
class FreeValue:
    """A parameter or start that is looked for, in SI units.

    ``experiment`` is the number, from 0 on, of the experiment whose start it is; None for a value that all experiments
    share. ``start`` is the first guess, and later the estimate; ``low`` and ``high`` are bounds, ``scale`` is a typical
    size.
    """

    name: str
    label: str
    experiment: int | None
    start: float
    low: float
    high: float
    scale: float


@dataclass(frozen=True, eq=False)
class Fit:
    """An experiment, and the values of the calibrated model: ``fitted`` (m, k), in SI units, NaN at gaps."""

    experiment: Measurement
    fitted: Floats


@dataclass(frozen=True, eq=False)
class Measurement:
    """One experiment: ``time`` (m,) in s, measured columns ``names`` (k) with ``values`` (m, k) in SI, NaN at gaps.

    ``inputs`` are the columns of inputs, without gaps; None if there are none. ``start`` is the time (s) at which the
    run begins, None for the first one that was measured.
    """

    label: str
    time: Floats
    names: tuple[str, ...]
    values: Floats
    inputs: Trajectory | None = None
    start: float | None = None

    @property
    def begin(self) -> float:
        """The time (s) at which the run begins."""
        return float(self.time[0]) if self.start is None else self.start

    @property
    def count(self) -> int:
        """How many values were measured."""
        return int(np.isfinite(self.values).sum())
