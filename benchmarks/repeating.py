"""Many runs of one FMU with other parameters: by `lag2fmu.simulate`, which resets it, and by fmpy, which loads it anew.

Run with `make bench` or `python -m benchmarks.repeating [MODEL]`. The bar: at least five times the speed.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import lag2fmu

RUNS = 200


def main() -> None:
    """Measure CPU time and print."""
    import fmpy

    model = sys.argv[1] if len(sys.argv) > 1 else "double_pendulum"
    with tempfile.TemporaryDirectory() as folder:
        fmu = lag2fmu.export(model, Path(folder, "model.fmu"))
        parameter = next(p for p in fmu.mechanism.parameters if p.value)
        values = [{parameter.name: (parameter.value or 0.0) * (1 + 0.001 * i)} for i in range(RUNS)]
        for label, run in {
            "lag2fmu.simulate": lambda v: lag2fmu.simulate(fmu, stop_time=1.0, values=v),
            "fmpy.simulate_fmu": lambda v: fmpy.simulate_fmu(str(fmu.path), stop_time=1.0, start_values=v),
        }.items():
            start = time.process_time()
            for value in values:
                run(value)
            print(f"{label:20s} {RUNS} runs of {model}, 1 s: {time.process_time() - start:.2f} s of CPU time")


if __name__ == "__main__":
    main()
