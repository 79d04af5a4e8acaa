"""A time step with 30 to 300 spheres on a plane: its cost, and that of deriving and compiling them.

Run with `make bench` or `python -m benchmarks.contacts [--spheres N ...]`. Each sphere slides or rolls on the plane,
and touches the next one or not. The bar: with solver moreau the cost of a step is linear in the contacts that are
closed. The dense matrices of other events and of model exchange are slow, and take 0.4 GB with 300 spheres.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import tempfile
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.running import KERNELS
from benchmarks.spheres import spheres
from lag2fmu.dynamics import derive, lower
from lag2fmu.fmu.backends.native import describe, fmi_headers
from lag2fmu.fmu.compilers import FLAGS

STEP, SETTLING, STEPS = 1e-3, 300, 300
"""The step (s), how many come before those that are measured, and how many these are."""


def build(count: int, folder: Path) -> tuple[Path, float, float]:
    """The program that runs ``count`` spheres, and the seconds that deriving and compiling them took."""
    begin = time.process_time()
    mechanism = spheres(count)
    equations = derive(mechanism)
    _, sources = describe(equations.mechanism, equations, lower(equations, time_stepping=True), "moreau")
    derived = time.process_time() - begin
    place = folder / str(count)
    place.mkdir()
    for name, text in sources.items():
        (place / name).write_text(text, "utf-8")
    units = [name for name in sources if name.endswith(".c")]
    flags = [flag for flag in FLAGS if flag != "-fPIC"]
    command = ["gcc", *flags, "-I.", f"-I{fmi_headers()}", *units, str(KERNELS / "contacts.c"), "-lm", "-o", "host"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run(command, cwd=place, check=True)
    return place / "host", derived, resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def with_stack() -> None:
    """Let the process have as much stack as there is."""
    most = resource.getrlimit(resource.RLIMIT_STACK)[1]
    resource.setrlimit(resource.RLIMIT_STACK, (most, most))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--spheres", type=int, nargs="+", default=[30, 100, 300])
    table = Table(title="solver moreau, CPU time", title_justify="left")
    for heading in ("spheres", "closed contacts", "us a step", "us a contact", "s to derive", "s to compile"):
        table.add_column(heading, justify="right")
    with tempfile.TemporaryDirectory() as folder:
        for count in parser.parse_args().spheres:
            program, derived, compiled = build(count, Path(folder))
            command = [str(program), repr(STEP), str(SETTLING), str(STEPS)]
            done = subprocess.run(command, check=True, capture_output=True, text=True, preexec_fn=with_stack)
            closed, cost = map(float, done.stdout.split())
            cells = f"{closed:.0f}", f"{cost:.0f}", f"{cost / closed:.2f}", f"{derived:.0f}", f"{compiled:.0f}"
            table.add_row(str(count), *cells)
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
