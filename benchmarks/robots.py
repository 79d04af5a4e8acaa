"""Robots in URDF: from the file to the equations and the program that C is written from.

Run with `make bench` or `python -m benchmarks.robots [NAME ...]`. The files are those of the package
example-robot-data. Times are medians of three, by the process's CPU clock. The base floats where it is said so.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import statistics
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypeVar

from rich.console import Console
from rich.table import Table

from lag2fmu import derive, load
from lag2fmu.dynamics.program import lower

ROBOTS = {
    "ur5_robot": "fixed",
    "panda": "fixed",
    "solo12": "floating",
    "g1_29dof_rev_1_0": "floating",
    "talos_reduced": "floating",
    "tiago": "fixed",
    "tiago_dual": "fixed",
}
"""Name of the file -> how its base stands."""

Result = TypeVar("Result")
REPEATS = 3


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"default: {' '.join(ROBOTS)}")
    table = Table("robot", "base", "coordinates", "read s", "equations s", "program s", "operations", box=None)
    files = robot_files()
    for name in parser.parse_args().names or ROBOTS:
        base = ROBOTS.get(name, "fixed")
        read, mechanism = timed(partial(load, files[name], {"base": base}))
        deriving, equations = timed(partial(derive, mechanism))
        lowering, _ = timed(partial(lower, equations))
        cells = (f"{read:.3f}", f"{deriving:.2f}", f"{lowering:.2f}", str(equations.operations))
        table.add_row(name, base, str(len(mechanism.coordinates)), *cells)
    Console(width=120).print(table)


def robot_files() -> dict[str, Path]:
    """{name: file} of the package example-robot-data."""
    found = importlib.metadata.files("example-robot-data") or ()
    return {Path(str(file)).stem: Path(str(file.locate())) for file in found if file.suffix == ".urdf"}


def timed(action: Callable[[], Result]) -> tuple[float, Result]:
    """The median CPU time (s) of ``action`` and what it returns."""
    times = []
    for _ in range(REPEATS):
        begun = time.process_time()
        result = action()
        times.append(time.process_time() - begun)
    return statistics.median(times), result


if __name__ == "__main__":
    main()
