"""The results of a batch of runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Which runs failed, (r,)."""
        found = np.zeros(len(self), dtype=bool)
        found[list(self.reasons)] = True
        return found
