"""The time of `lag2fmu export` beside `import sympy` and the compiler alone: medians of interleaved runs, one table.

Run with `make bench` or `python -m benchmarks.export [MODEL ...]`. Python's bytecode, libraries and templates are kept
from a first run. The bars: an export with a static page takes at most twice the time of `python -c "import sympy"`,
plus the compiler's own. A live page, whose module is compiled as well, takes at most 1 s more.

Seconds are those of the wall. Beside the bar stands the same ratio of seconds of CPU, which another process on the
machine disturbs less.
"""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from operator import sub
from pathlib import Path

from rich.console import Console
from rich.table import Table

from lag2fmu.codegen import DEFAULT_SOLVER
from lag2fmu.dynamics import derive, lower
from lag2fmu.fmu.backends.native import describe, fmi_headers
from lag2fmu.fmu.compilers import compile_library
from lag2fmu.fmu.platforms import host_platform
from lag2fmu.formats.loading import load

RUNS = 25


Seconds = tuple[float, float]
"""On the wall, and of CPU."""


def _command(*arguments: str) -> Callable[[], None]:
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}

    def run() -> None:
        subprocess.run([sys.executable, *arguments], check=True, capture_output=True, env=environment)

    return run


def _compiler(name: str) -> Callable[[], None]:
    mechanism = load(name)
    equations = derive(mechanism)
    description, sources = describe(mechanism, equations, lower(equations), DEFAULT_SOLVER)

    def run() -> None:
        compile_library(sources, fmi_headers(), description.model_identifier, host_platform(), "zig")

    return run


def _median_seconds(actions: dict[str, Callable[[], None]]) -> dict[str, Seconds]:
    """The seconds of each action, medians of interleaved runs after one warm-up."""
    times: dict[str, list[Seconds]] = {label: [] for label in actions}
    for number in range(RUNS + 1):
        for label, action in actions.items():
            begun = _now()
            action()
            wall, cpu = map(sub, _now(), begun)
            if number:
                times[label].append((wall, cpu))
    columns = {label: zip(*runs, strict=True) for label, runs in times.items()}
    return {label: (statistics.median(walls), statistics.median(cpus)) for label, (walls, cpus) in columns.items()}


def _now() -> Seconds:
    """The time on the wall, and the CPU time of this process and of its children that have ended."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.perf_counter(), time.process_time() + children.ru_utime + children.ru_stime


def _row(name: str, folder: str) -> list[str]:
    """The cells of a model: medians, and what they are measured by."""
    export = ("-m", "lag2fmu", "export", name, "-o", str(Path(folder) / f"{name}.fmu"), "--force", "--page")
    seconds = _median_seconds(
        {
            "sympy": _command("-c", "import sympy"),
            "compiler": _compiler(name),
            "static": _command(*export, "static"),
            "live": _command(*export, "live"),
        }
    )
    sympy, compiler, static, live = seconds.values()
    wall, cpu = (f"{(s - c) / i:.2f}" for i, c, s in zip(sympy, compiler, static, strict=True))
    return [name, *(f"{own[0]:.3f}" for own in seconds.values()), wall, cpu, f"{live[0] - static[0]:.2f}"]


def main() -> None:
    """Measure and print."""
    table = Table(title=f"seconds on the wall, medians of {RUNS} interleaved runs", title_justify="left")
    bars = ("(static - compiler) / sympy, bar 2", "of CPU", "live - static, bar 1 s")
    for heading in ("model", "sympy", "compiler", "static", "live", *bars):
        table.add_column(heading, justify="right")
    with tempfile.TemporaryDirectory() as folder:
        for name in sys.argv[1:] or ["double_pendulum", "cart_pole"]:
            table.add_row(*_row(name, folder))
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
