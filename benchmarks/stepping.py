"""The cost of a communication step in a C host: fmi2DoStep beside the evaluations of the equations that it makes.

Run with `make bench` or `python -m benchmarks.stepping [MODEL ...]`: RK4 with communication and solver step 1 ms. The
bar: beyond its 4 evaluations a step takes at most 20 %. Under error control most communication steps only move the
time, but where equations contain the time each takes a solver step. Times are the least and the median of many short
rounds. An evaluation takes longer at some states than at others (a sine of a large angle does), so what a step takes
beyond its evaluations is the median of the ratios in one round, which has both at the same states.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.running import KERNELS
from lag2fmu.dynamics import derive, lower
from lag2fmu.fmu.backends.native import describe, fmi_headers
from lag2fmu.fmu.compilers import FLAGS
from lag2fmu.fmu.platforms import host_platform
from lag2fmu.fmu.translation_units import translation_units
from lag2fmu.formats.loading import load

STEPS, ROUNDS = 500, 3000
CASES = {
    "rk4": ["double_pendulum", "cart_pole", "six_axis_arm"],
    "dopri5": ["horizontally_driven_pendulum", "motion_driven_pendulum"],
}
"""The second model of dopri5 is the first one with inputs in the place of the time."""


def build(model: str, solver: str, folder: Path) -> Path:
    """The C host with the sources of ``model``, compiled as an FMU is."""
    mechanism = load(model)
    equations = derive(mechanism)
    _, sources = describe(mechanism, equations, lower(equations), solver)
    joined = translation_units(sources)
    for name, text in {**sources, **joined}.items():
        (folder / name).write_text(text, "utf-8")
    flags = [flag for flag in FLAGS if flag != "-fPIC"]
    zig = [sys.executable, "-m", "ziglang", "cc", "-target", host_platform().targets[0]]
    command = [*zig, *flags, "-I.", f"-I{fmi_headers()}", "-o", "host"]
    objects = os.environ | {"ZIG_LOCAL_CACHE_DIR": str(folder)}  # the host's object depends on headers of this folder
    subprocess.run([*command, *joined, str(KERNELS / "stepping.c"), "-lm"], cwd=folder, check=True, env=objects)
    return folder / "host"


def measure(host: Path) -> list[str]:
    """Of a step and of its evaluations the least and the median time (ns); what a step takes beyond those beside it."""
    done = subprocess.run([str(host), str(STEPS), str(ROUNDS)], check=True, capture_output=True, text=True)
    steps, evaluations = zip(*(map(float, line.split()) for line in done.stdout.splitlines()), strict=True)
    columns = [f"{min(times):.0f}, {statistics.median(times):.0f}" for times in (steps, evaluations)]
    beyond = statistics.median(step / evaluation - 1 for step, evaluation in zip(steps, evaluations, strict=True))
    return [*columns, f"{beyond:.1%}"]


def main() -> None:
    """Measure and print."""
    title = f"a communication step of 1 ms: least and median of {ROUNDS} interleaved rounds"
    table = Table(title=title, title_justify="left")
    for heading in ("model", "solver", "step (ns)", "4 evaluations (ns)", "beyond them", "bar"):
        table.add_column(heading, justify="right")
    chosen = {"rk4": sys.argv[1:]} if sys.argv[1:] else CASES
    for solver, model in ((solver, model) for solver, models in chosen.items() for model in models):
        with tempfile.TemporaryDirectory() as folder:
            columns = measure(build(model, solver, Path(folder)))
        table.add_row(model, solver, *columns, "20%" if solver == "rk4" else "")
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
