"""A sweep of 10 000 runs against the same by a loop of `simulate`.

Run with `make bench` or `python -m benchmarks.sweeps`. The double pendulum, 10 s, tolerance 1e-6, the state at the end,
over 100 lengths and 100 starts. The loop is measured over 100 runs of one FMU that is exported before, by wall clock;
the sweep with and without what it takes to derive and compile. The bar: 100 times faster.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np

import lag2fmu

MODEL, LOOPED = "double_pendulum", 100
VARY = {"l1": np.linspace(0.5, 2.0, 100), "theta1": np.linspace(0.1, 1.0, 100)}


def main() -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as folder:
        fmu = lag2fmu.export(MODEL, Path(folder, "model.fmu"))
        lag2fmu.simulate(fmu, tolerance=1e-6)
        start = time.perf_counter()
        for i in range(LOOPED):
            lag2fmu.simulate(fmu, tolerance=1e-6, values={"l1": VARY["l1"][i], "theta1": VARY["theta1"][i]})
        loop = (time.perf_counter() - start) / LOOPED
        for label in ("with compiling", "compiled before"):
            start = time.perf_counter()
            found = lag2fmu.sweep(MODEL, VARY, at_end=True, tolerance=1e-6, path=Path(folder, "out.nc"))
            each = (time.perf_counter() - start) / found["failed"].size
            times = f"{1e6 * each:8.1f} us a run, simulate {1e6 * loop:8.1f} us"
            print(f"{label:16s} {times}: {loop / each:6.0f} times faster")


if __name__ == "__main__":
    main()
