"""The results of a batch of runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lag2fmu.errors import LoadError

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Runs:
    """The results of a batch of r runs, as arrays whose first axis is the run; all values in SI units.

    - ``samples`` {output: (r, k)}: the outputs at the ``times`` (k,) in s.
    - ``final`` {output: (r,)}: the outputs at the end.
    - ``minimum``, ``maximum`` {name: (r,)}: the extremes over each run.
    - ``crossings`` {name: (r, most)}: the times at which a quantity crossed zero, in order, then NaN.
    - ``crossing_counts`` {name: (r,)}: the number of crossings.
    - ``events`` {name: [(times,) for each run]}: the times of the events.
    - ``event_counts`` {name: (r,)}: the number of events, including those beyond the stored ones.
    - ``steps`` (r,): the number of solver steps.
    - ``reached`` (r,): the time that each run reached.
    - ``in_lanes`` (r,): whether the run went in lanes; the others took the scalar engine.
    - ``reasons`` {run: sentence}: why a run failed; its values are NaN from the time reached on.
    """

    times: Floats
    samples: Mapping[str, Floats]
    final: Mapping[str, Floats]
    minimum: Mapping[str, Floats]
    maximum: Mapping[str, Floats]
    crossings: Mapping[str, Floats]
    crossing_counts: Mapping[str, NDArray[np.int64]]
    events: Mapping[str, tuple[Floats, ...]]
    event_counts: Mapping[str, NDArray[np.int64]]
    steps: NDArray[np.int64]
    reached: Floats
    in_lanes: NDArray[np.bool_]
    reasons: Mapping[int, str]

    def __len__(self) -> int:
        """The number of runs."""
        return len(self.steps)

    def __getitem__(self, name: str) -> Floats:
        """The samples of the output ``name``, (r, k); raises KeyError."""
        return self.samples[name]

    def __repr__(self) -> str:
        """One line: the number of runs, the outputs, and how many runs failed."""
        failed = f", {len(self.reasons)} failed" if self.reasons else ""
        return f"<Runs: {len(self)}, {len(self.times)} samples of {', '.join(self.final)}{failed}>"

    def to_xarray(self) -> Any:
        """An xarray.Dataset of the samples over ``run`` and ``time`` (s), with ``reached``, ``failed`` and ``reason``.

        Final values, extremes and counts are NAME_final, NAME_minimum, NAME_maximum, NAME_crossings and NAME_events.
        Raises LoadError where xarray is missing.
        """
        runs = ["run"]
        reasons = np.array([self.reasons.get(i, "") for i in range(len(self))])
        stored = self.samples if len(self.times) else {}
        columns: dict[str, Any] = {name: (["run", "time"], values) for name, values in stored.items()}
        columns |= {name: (runs, values) for name, values in self._by_run().items()}
        columns |= {"reached": (runs, self.reached), "failed": (runs, self.failed), "reason": (runs, reasons)}
        coordinates = {"run": np.arange(len(self)), "time": self.times}
        return _package("xarray").Dataset(columns, coords=coordinates)

    def to_pandas(self) -> Any:
        """A pandas.DataFrame of the samples with the index (run, time in s); without samples, of what is one a run.

        Raises LoadError where pandas is missing.
        """
        pandas = _package("pandas")
        if not len(self.times):
            columns = {**self._by_run(), "reached": self.reached, "failed": self.failed}
            return pandas.DataFrame(columns, index=pandas.RangeIndex(len(self), name="run"))
        index = pandas.MultiIndex.from_product([range(len(self)), self.times], names=["run", "time"])
        return pandas.DataFrame({name: values.ravel() for name, values in self.samples.items()}, index=index)

    def _by_run(self) -> dict[str, NDArray[Any]]:
        """{NAME_final and so on: (r,)}."""
        tables = {
            "final": self.final,
            "minimum": self.minimum,
            "maximum": self.maximum,
            "crossings": self.crossing_counts,
            "events": self.event_counts,
        }
        return {f"{name}_{what}": values for what, table in tables.items() for name, values in table.items()}

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Which runs failed, (r,)."""
        found = np.zeros(len(self), dtype=bool)
        found[list(self.reasons)] = True
        return found


def _package(name: str) -> Any:
    """The optional package ``name``; raises LoadError, with the remedy, where it is missing."""
    try:
        return import_module(name)
    except ImportError as error:
        raise LoadError(f"the package {name} is not installed; pip install {name}") from error
