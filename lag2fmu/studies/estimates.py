"""The record of what an observer estimates."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lag2fmu.errors import LoadError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.language.units import Unit
from lag2fmu.reference.trajectory import Floats, Trajectory


@dataclass(frozen=True, eq=False)
class Estimates:
    """Estimates over time, in SI units.

    - ``time`` (m,) in s; ``names`` (n): coordinates, velocities, further states, estimated parameters.
    - ``values``, ``deviations`` (m, n): the estimates and their standard deviations.
    - ``measured`` (p) are names; ``samples`` (m, p) was measured, NaN where nothing was.
    - ``innovations`` (m, p): what a sample says beyond what was expected; ``innovation_deviations`` (m, p).
    - ``squared`` (m,): the normalised innovations squared, of ``degrees`` (m,) values each. Their mean is 1 a degree
      where model and noise are right.
    - ``smoothed``: whether the estimates know the samples behind them too. ``warnings`` are sentences.
    """

    time: Floats
    names: tuple[str, ...]
    values: Floats
    deviations: Floats
    measured: tuple[str, ...]
    samples: Floats
    innovations: Floats
    innovation_deviations: Floats
    squared: Floats
    degrees: Floats
    smoothed: bool
    warnings: tuple[str, ...]
    units: Mapping[str, Unit] = field(repr=False)

    def __repr__(self) -> str:
        """One line: what is estimated at how many times."""
        how = "smoothed" if self.smoothed else "filtered"
        return f"<Estimates of {', '.join(self.names)} at {len(self.time)} times, {how}>"

    def __getitem__(self, name: str) -> Floats:
        """The estimates (m,) of ``name`` in SI units; raises LoadError if it is not estimated."""
        return self.values[:, self._place(name)]

    def deviation(self, name: str) -> Floats:
        """The standard deviations (m,) of the estimates of ``name``; raises LoadError if it is not estimated."""
        return self.deviations[:, self._place(name)]

    @property
    def consistency(self) -> float:
        """The mean of the normalised innovations squared by degree; 1 where model and noise are right."""
        return float(np.sum(self.squared) / max(np.sum(self.degrees), 1.0))

    @property
    def trajectory(self) -> Trajectory:
        """The estimates as NAME, their standard deviations as NAME_std, and the normalised innovation squared."""
        columns = dict(zip(self.names, self.values.T, strict=True))
        columns |= {f"{name}_std": x for name, x in zip(self.names, self.deviations.T, strict=True)}
        return Trajectory.of(self.time, {**columns, "innovation_squared": self.squared})

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the ``trajectory`` to ``path``, a CSV file with the units of the model in its headings.

        Raises SimulationError where that cannot be done.
        """
        sizes = {f"{name}_std": unit for name, unit in self.units.items() if unit.from_si(0.0) == 0.0}
        self.trajectory.write_csv(path, {**self.units, **sizes})

    def plot(self) -> Any:
        """A matplotlib figure: each estimate within two standard deviations, with what was measured of it."""
        from lag2fmu.studies.estimates_figure import estimates_figure

        estimates = dict(zip(self.names, zip(self.values.T, self.deviations.T, strict=True), strict=True))
        samples = dict(zip(self.measured, self.samples.T, strict=True))
        return estimates_figure(self.time, estimates, samples, self.units)

    def _place(self, name: str) -> int:
        if name not in self.names:
            raise LoadError(f"'{name}' is not estimated; {suggestion(name, self.names)}")
        return self.names.index(name)
