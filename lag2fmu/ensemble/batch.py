"""The record that describes a batch to the compiled code."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lag2fmu.ensemble.libraries import KernelLibrary, in_threads

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

WAITS, DONE, LEFT, FAILED = range(4)
"""The status of a run: see batch.h."""
STOPPED = 2**62
"""The value of ``next_run`` that makes all threads stop, see batch.h."""
REASON = 1024
"""The bytes for the sentence that says why a run failed, including the byte that ends it."""

_COUNTS = (
    *("runs", "samples", "outputs", "extremes", "crossings", "most_crossings", "events", "most_events"),
    *("knots", "inputs_apart", "hold"),
)
_NUMBERS = ("start_time", "tolerance")
_ARRAYS = (
    *("starts", "parameters", "stop_times", "steps", "longest_steps", "nominals", "knot_times", "inputs"),
    *("sample_times", "output_columns", "extreme_columns", "crossing_columns", "event_kinds"),
    *("finals", "sampled", "minima", "maxima", "crossed", "crossing_counts", "event_times", "event_counts"),
    *("reached", "accepted", "status", "next", "reasons"),
)


class _Batch(ctypes.Structure):
    """The struct Batch of batch.h, field by field."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in _COUNTS),
        *((name, ctypes.c_double) for name in _NUMBERS),
        *((name, ctypes.c_void_p) for name in _ARRAYS),
    )


@dataclass(frozen=True)
class Batch:
    """A batch of runs as batch.h describes it; all values in SI units, the arrays C-contiguous.

    ``reasons`` is empty if no run takes the scalar engine. ``event_times`` are set up to ``event_counts`` only.
    """

    hold: bool
    start_time: float
    tolerance: float
    starts: Floats
    parameters: Floats
    stop_times: Floats
    steps: Floats
    longest_steps: Floats
    nominals: Floats
    knot_times: Floats
    inputs: Floats
    sample_times: Floats
    output_columns: Integers
    extreme_columns: Integers
    crossing_columns: Integers
    event_kinds: Integers
    finals: Floats
    sampled: Floats
    minima: Floats
    maxima: Floats
    crossed: Floats
    crossing_counts: Integers
    event_times: Floats
    event_counts: Integers
    reached: Floats
    accepted: Integers
    status: Integers
    next: Integers
    reasons: NDArray[np.bytes_]

    def struct(self) -> ctypes.Structure:
        """The batch as the struct that C reads; the arrays must live longer than the struct."""
        counts = {
            "runs": len(self.starts),
            "samples": len(self.sample_times),
            "outputs": len(self.output_columns),
            "extremes": len(self.extreme_columns),
            "crossings": len(self.crossing_columns),
            "most_crossings": self.crossed.shape[2],
            "events": len(self.event_kinds),
            "most_events": self.event_times.shape[2],
            "knots": len(self.knot_times),
            "inputs_apart": int(len(self.inputs) > 1),
            "hold": int(self.hold),
        }
        arrays = {name: getattr(self, name).ctypes.data for name in _ARRAYS}
        return _Batch(**counts, start_time=self.start_time, tolerance=self.tolerance, **arrays)


def run_batch(library: KernelLibrary, name: str, batch: Batch, threads: int, *further: Floats) -> None:
    """Call the C function ``name``, KIND_runs, on ``batch`` in as many ``threads``.

    ``further`` are contiguous arrays that the function takes as well; it defines their shapes. Each thread has memory
    of its own, of the size that the function KIND_memory returns.
    """
    function, size = library.function(name), library.number(f"{name.split('_', maxsplit=1)[0]}_memory")
    struct = batch.struct()
    pointers = [ctypes.c_void_p(array.ctypes.data) for array in further]

    def work(_: int) -> None:
        memory = ctypes.create_string_buffer(size)
        function(ctypes.byref(struct), memory, *pointers)

    batch.next[...] = 0
    in_threads(work, range(threads), lambda: batch.next.fill(STOPPED))
