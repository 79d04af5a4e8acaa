"""Runs that are recorded step by step, so that the derivatives of one number go back through them."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lag2fmu.reference.trajectory import Floats
from lag2fmu.studies.library import KnotSignals, PreparedRequest, Study, StudyLibrary


class Tape:
    """Memory in which runs of a library are recorded, one after the other; for one thread at a time."""

    def __init__(self, library: StudyLibrary, varied: int) -> None:
        """Allocate the memory for derivatives by ``varied`` values of a library with adjoints.

        Raises MemoryError if there is none.
        """
        self._free = None
        room: Any = library.functions.function("study_tape_room")
        room.restype = ctypes.c_int
        self._study, self._varied = Study(library, varied + room()), varied
        new = self._study.function("study_tape_new", ctypes.c_void_p)
        self._free = self._study.function("study_tape_free")
        self._handle = ctypes.c_void_p(new(self._study.handle, varied))
        if not self._handle.value:
            raise MemoryError(f"no memory to record runs of '{library.name}'")

    def __del__(self) -> None:
        """Give the memory back."""
        if self._free is not None:
            self._free(self._handle)

    def limit(self, most: int) -> int:
        """Give up later runs whose steps, events and samples are more than ``most``; those of the last run.

        0: no run is given up.
        """
        limit = self._study.function("study_tape_limit", ctypes.c_size_t)
        return int(limit(self._handle, ctypes.c_size_t(most)))

    def record(
        self,
        values: Mapping[int, float],
        times: Floats,
        outputs: Sequence[int],
        *,
        tolerance: float,
        start: float = 0.0,
        signals: KnotSignals | None = None,
        seeds: Sequence[tuple[int, float]] = (),
    ) -> tuple[Floats, str]:
        """One run, with the arguments of ``Study.run``.

        Returns the ``outputs`` at the times, (m, k), and "", or the reason why the run ended early.
        """
        found = np.full((len(times), len(outputs)), np.nan)
        self._study.begin(values, seeds)
        self._asked = PreparedRequest(times, outputs, found, start=start, tolerance=tolerance, signals=signals)
        run = self._study.function("study_record", ctypes.c_int)
        reached = run(self._handle, ctypes.byref(self._asked.request))
        return found, "" if reached == len(times) else self._study.message

    def gradient(self, weights: Floats) -> tuple[Floats, str]:
        """The derivatives (d,) by the seeds of what has the derivatives ``weights`` (m, k) by the recorded outputs.

        The second result is "", or the reason why there are none.
        """
        weights = np.ascontiguousarray(weights, dtype=float)
        found = np.zeros(self._varied)
        back = self._study.function("study_gradient", ctypes.c_int)
        done = back(
            self._handle,
            ctypes.byref(self._asked.request),
            ctypes.c_void_p(weights.ctypes.data),
            ctypes.c_void_p(found.ctypes.data),
        )
        return found, "" if done else self._study.message
