"""Samples of a trajectory by direct integration, with which a page compares its own motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

_MOST = 60
"""The most times of the reference run that a page holds to compare with."""


@dataclass(frozen=True, eq=False)
class Samples:
    """``values`` (m, k) of the variables ``names`` at the ``times`` (m,) s, in SI units.

    Errors are relative to the ``scales`` (k,) of the variables and to the ``growth`` (m,) of disturbances. They may be
    as large as ``bar``. ``until`` (s) is where the integration ended, if its time was over before the experiment.
    """

    names: tuple[str, ...]
    times: NDArray[np.float64]
    values: NDArray[np.float64]
    scales: NDArray[np.float64]
    growth: NDArray[np.float64]
    bar: float
    until: float | None = None

    def data(self) -> dict[str, Any] | None:
        """The data for the page's script, with at most 60 rows; None if there is no row."""
        if len(self.times) == 0:
            return None
        rows = np.unique(np.linspace(0, len(self.times) - 1, _MOST).astype(int))
        return {
            "names": list(self.names),
            "times": self.times[rows].tolist(),
            "values": [[float(f"{x:.12g}") for x in row] for row in self.values[rows]],
            "scales": [float(f"{x:.6g}") for x in self.scales],
            "growth": [float(f"{x:.6g}") for x in self.growth[rows]],
            "bar": self.bar,
            "until": self.until,
        }
