"""Runs of what was measured, at free values, and their derivatives: of few values by directions, of many by adjoints.

Along directions a run has the derivatives of all samples, and its cost grows with the number of free values. A run that
is recorded and followed backwards has those of one weighed sum of samples by all free values, at the cost of a few
runs. Source: A. Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, chapter 3.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from lag2fmu.reference.trajectory import Floats
from lag2fmu.studies.fits import FreeValue, Measurement
from lag2fmu.studies.library import Study, StudyLibrary
from lag2fmu.studies.requests import references_of, scale_of, signals_of
from lag2fmu.studies.tape import Tape

MANY = 30
"""More free values than these are many: ``benchmarks/calibration.py`` measures both ways.

A search by adjoints goes a full first step and feels no bounds until its end. Where that leads astray, derivatives of
all samples take its place, and the fit takes half as long again.
"""
_FAR = 20
"""In units of the steps of the first run: a run of a search that takes more is given up."""
_PASS = 4
"""The cost of a way back, in directions; see ``benchmarks/gradients.py``."""


def are_many(count: int) -> bool:
    """Whether adjoints are cheaper for ``count`` free values."""
    return count > MANY


class MeasuredRuns:
    """The values (n,) that would be measured in all experiments, and their derivatives (n, p) by p free values."""

    def __init__(
        self,
        library: StudyLibrary,
        experiments: Sequence[Measurement],
        sought: Sequence[FreeValue],
        values: Sequence[Mapping[str, float]],
        tolerance: float,
        *,
        hold: bool,
        progress: Callable[[int], None] | None = None,
    ) -> None:
        """``values`` (SI) of each experiment are what is not ``sought``; ``progress`` is told the number of runs.

        The ``library`` has adjoints where the free values are MANY.
        """
        self.library, self.experiments, self.sought = library, experiments, sought
        self.values, self.tolerance, self.hold, self._progress = values, tolerance, hold, progress
        self.masks = [np.isfinite(e.values) for e in experiments]
        self.measured = np.concatenate([e.values[m] for e, m in zip(experiments, self.masks, strict=True)])
        self._places = [[j for j, x in enumerate(sought) if x.experiment in {None, i}] for i in range(len(experiments))]
        self._directed: tuple[bytes, Floats, Floats, str] | None = None
        self._recorded: tuple[bytes, Floats, str] | None = None
        self._runs, self.many = 0, are_many(len(sought))
        self._most = [0] * len(experiments)

    def at(self, point: Floats) -> tuple[Floats, Floats, str]:
        """The values (n,) at a ``point`` (p,), their derivatives (n, p), and "" or why there are none."""
        key = point.tobytes()
        if self._directed is None or self._directed[0] != key:
            few = self.many and _PASS * len(self.measured) < len(self.sought)
            self._directed = (key, *(self._by_rows(point) if few else self._by_columns(point)))
        return self._directed[1:]

    def values_at(self, point: Floats) -> tuple[Floats, str]:
        """The values (n,) at a ``point`` (p,), and "" or why there are none."""
        if not self.many:
            found, _, reason = self.at(point)
            return found, reason
        key = point.tobytes()
        if self._recorded is None or self._recorded[0] != key:
            self._recorded = (key, *self._record(point))
        return self._recorded[1:]

    def weighed(self, point: Floats, weights: Floats) -> Floats:
        """The derivatives (p,) of the sum of the values with ``weights`` (n,), at a ``point`` (p,).

        They are NaN where a run has none.
        """
        if not self.many:
            return np.asarray(weights @ self.at(point)[1])
        self.values_at(point)
        found = np.zeros(len(self.sought))
        for i, rows in self._parts():
            found[self._places[i]] += self._back(i, weights[rows])
        return found

    # ------------------------------------------------------------------------------------------------- derivatives

    def _by_columns(self, point: Floats) -> tuple[Floats, Floats, str]:
        """All by directions."""
        values, slopes = np.full(len(self.measured), np.nan), np.zeros((len(self.measured), len(self.sought)))
        for i, rows in self._parts():
            given, times, outputs, options = self._asked(i, point)
            found, changes, reason = self._studies[i].run(given, times, outputs, **options)
            if reason:
                return values, slopes, f"{self.experiments[i].label}: {reason}"
            values[rows] = found[self.masks[i]]
            slopes[rows, self._places[i]] = changes[self.masks[i]]
        return values, slopes, ""

    def _parts(self) -> Iterator[tuple[int, slice]]:
        """Each experiment, and its rows; a run of each is counted."""
        row = 0
        for i, mask in enumerate(self.masks):
            yield i, slice(row, row := row + int(mask.sum()))
            self._runs += 1
            if self._progress is not None:
                self._progress(self._runs)

    def _asked(self, i: int, point: Floats) -> tuple[dict[int, float], Floats, list[int], dict[str, Any]]:
        """What a run of experiment i at a ``point`` is asked for: arguments of ``Study.run`` and ``Tape.record``."""
        library, experiment = self.library, self.experiments[i]
        given = {**self.values[i], **{self.sought[j].name: float(point[j]) for j in self._places[i]}}
        names = [self.sought[j].name for j in self._places[i]]
        options = {
            "tolerance": self.tolerance,
            "start": experiment.begin,
            "signals": signals_of(library, experiment.inputs, experiment.time, hold=self.hold),
            "seeds": [(library.settable(name), scale_of(library, name, given)) for name in names],
        }
        return references_of(library, given), experiment.time, library.readable(experiment.names), options

    @cached_property
    def _studies(self) -> list[Study]:
        return [Study(self.library, len(places)) for places in self._places]

    def _by_rows(self, point: Floats) -> tuple[Floats, Floats, str]:
        """All by ways back, one for each measured value."""
        values, reason = self.values_at(point)
        slopes = np.zeros((len(self.measured), len(self.sought)))
        for i, rows in self._parts():
            weights = np.eye(rows.stop - rows.start)
            slopes[rows, self._places[i]] = [self._back(i, row) for row in weights]
        return values, slopes, reason

    # -------------------------------------------------------------------------------------------------- adjoints

    @cached_property
    def _tapes(self) -> list[Tape]:
        return [Tape(self.library, len(places)) for places in self._places]

    def _record(self, point: Floats) -> tuple[Floats, str]:
        """The values (n,) of runs that are recorded, and "" or why there are none."""
        values = np.full(len(self.measured), np.nan)
        for i, rows in self._parts():
            given, times, outputs, options = self._asked(i, point)
            found, reason = self._tapes[i].record(given, times, outputs, **options)
            if reason:
                return values, f"{self.experiments[i].label}: {reason}"
            self._most[i] = self._most[i] or _FAR * self._tapes[i].limit(0)
            self._tapes[i].limit(self._most[i])
            values[rows] = found[self.masks[i]]
        return values, ""

    def _back(self, i: int, weights: Floats) -> Floats:
        """The derivatives of the sum with ``weights`` of the values of experiment i, by what is free in it."""
        spread = np.zeros(self.masks[i].shape)
        spread[self.masks[i]] = weights
        found, reason = self._tapes[i].gradient(spread)
        return np.full_like(found, np.nan) if reason else found
