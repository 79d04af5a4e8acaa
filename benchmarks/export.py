"""The time of `lag2fmu export` beside `import sympy` and the compiler alone: medians of interleaved runs, one table.

Run with `make bench` or `python -m benchmarks.export [MODEL ...]`. The bars: an export with a static page takes at most
three times the wall time of `python -c "import sympy"`, plus the compiler's own. A live page, whose module is compiled
as well, takes at most 1 s more.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from rich.console import Console
from rich.table import Table

from lag2fmu.codegen import DEFAULT_SOLVER
from lag2fmu.dynamics import derive, lower
from lag2fmu.fmu.backends.native import describe, fmi_headers
from lag2fmu.fmu.compilers import compile_library, host_platform
from lag2fmu.formats.loading import load

RUNS = 9


def _command(*arguments: str) -> Callable[[], None]:
    def run() -> None:
        subprocess.run([sys.executable, *arguments], check=True, capture_output=True)

    return run


def _compiler(name: str) -> Callable[[], None]:
    mechanism = load(name)
    equations = derive(mechanism)
    description, sources = describe(mechanism, equations, lower(equations), DEFAULT_SOLVER)

    def run() -> None:
        compile_library(sources, fmi_headers(), description.model_identifier, host_platform(), "zig")

    return run


def _median_seconds(actions: dict[str, Callable[[], None]]) -> dict[str, float]:
    """Wall seconds of each action, the median of interleaved runs after one warm-up."""
    times: dict[str, list[float]] = {label: [] for label in actions}
    for number in range(RUNS + 1):
        for label, action in actions.items():
            start = time.perf_counter()
            action()
            if number:
                times[label].append(time.perf_counter() - start)
    return {label: statistics.median(seconds) for label, seconds in times.items()}


def _row(name: str, folder: str) -> list[str]:
    """The cells of a model: medians, and what they are measured by."""
    export = ("-m", "lag2fmu", "export", name, "-o", str(Path(folder) / f"{name}.fmu"), "--page")
    seconds = _median_seconds(
        {
            "sympy": _command("-c", "import sympy"),
            "compiler": _compiler(name),
            "static": _command(*export, "static"),
            "live": _command(*export, "live"),
        }
    )
    ratio = (seconds["static"] - seconds["compiler"]) / seconds["sympy"]
    more = seconds["live"] - seconds["static"]
    return [name, *(f"{second:.3f}" for second in seconds.values()), f"{ratio:.2f}", f"{more:.2f}"]


def main() -> None:
    """Measure and print."""
    table = Table(title=f"wall seconds, medians of {RUNS} interleaved runs", title_justify="left")
    bars = ("(static - compiler) / sympy, bar 3", "live - static, bar 1 s")
    for heading in ("model", "sympy", "compiler", "static", "live", *bars):
        table.add_column(heading, justify="right")
    with tempfile.TemporaryDirectory() as folder:
        for name in sys.argv[1:] or ["double_pendulum", "cart_pole"]:
            table.add_row(*_row(name, folder))
    Console().print(table)


if __name__ == "__main__":
    main()
