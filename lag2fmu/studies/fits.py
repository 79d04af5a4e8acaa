"""What a calibration works with: measurements, the values that are free, and how well the model fits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lag2fmu.reference.trajectory import Floats, Trajectory


@dataclass(frozen=True)
class FreeValue:
    """A parameter or start that is looked for, in SI units.

    ``experiment`` is the number, from 0 on, of the one whose start it is, None for what all have in common. ``start``
    is the first guess, later the estimate; ``low`` and ``high`` are its bounds, ``scale`` a typical size.
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
    """An experiment and what the calibrated model gives, ``fitted`` (m, k) in SI, NaN where nothing was measured."""

    experiment: Measurement
    fitted: Floats


@dataclass(frozen=True, eq=False)
class Measurement:
    """One experiment: ``time`` (m,) in s, measured columns ``names`` (k) with ``values`` (m, k) in SI, NaN at gaps.

    ``inputs`` are the columns of inputs, without gaps; None if there are none.
    """

    label: str
    time: Floats
    names: tuple[str, ...]
    values: Floats
    inputs: Trajectory | None = None

    @property
    def count(self) -> int:
        """How many values were measured."""
        return int(np.isfinite(self.values).sum())
