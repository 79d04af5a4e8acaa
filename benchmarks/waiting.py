"""What users wait for: from a mechanism to what runs, in seconds of CPU time.

Run with `make bench` or `python -m benchmarks.waiting [CASE ...]`. Kept libraries and objects are off, the compiler's
own parts are there. Seconds are those of the process and all its children, medians of three runs in turn, or one run
if the yardstick is given up.

The yardstick is CasADi: the accelerations of the same Lagrangian and their Jacobian by states and forces in SX, as C,
compiled by the same compiler with the same flags, and given up after 20 s. An FMU has more: energies, outputs,
directional and second derivatives, solvers and the interface. B40 is an elastic beam: P40a with springs between its
rods. The bars: all of it takes less than the yardstick, deriving and generating half of CasADi's, the beam 10 s.

Robots are those of example-robot-data, with a floating base. `export` makes the live page too; `function` is compiled
and called once. The last table has ratios to an export for this machine alone, first without and then with what the
run before has kept.
"""

from __future__ import annotations

import argparse
import gc
import importlib
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.cases import Case, case
from benchmarks.peers import casadi_text, of_lagrangian
from benchmarks.robots import robot_files
from lag2fmu.building.process import zig
from lag2fmu.fmu.backends.native import describe, fmi_headers
from lag2fmu.fmu.compilers import FLAGS, compile_library
from lag2fmu.fmu.deriving import derived
from lag2fmu.fmu.platforms import host_platform
from lag2fmu.solvers.methods import DEFAULT_SOLVER

RUNS = 3
CASES = ("P20", "P40", "C8", "S6", "S7", "S12", "T14", "B40")
EXPORTED = {"anymal": 6, "talos_reduced": 12}
"""{robot: bar in s}"""
CALLED = {"anymal": 8, "hyq_no_sensors": 8, "g1_29dof_rev_1_0": 12, "human": 30}
PLATFORMS = {"first": 4, "again": 2}
LONGEST = 20
"""Seconds of CPU after which the compiler of the yardstick is ended."""

Environment = Mapping[str, str]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("cases", nargs="*", metavar="CASE", help=f"default: {' '.join(CASES)}, then the other tables")
    chosen = parser.parse_args().cases
    console = Console(width=120)
    console.print(_of_cases(chosen or CASES))
    if not chosen:
        console.print(_of_robots())
        console.print(_of_platforms())


def _of_cases(names: Sequence[str]) -> Table:
    headings = ("case", "derive s", "CasADi s", "ratio", "all s", "yardstick s", "ratio")
    table = Table(*headings, title="a mechanism's library beside the yardstick", title_justify="left")
    for name in names:
        given = case(name)
        mine: list[tuple[float, float]] = []
        peer: list[tuple[float, float]] = []
        for _ in range(RUNS):
            mine.append(_library(given))
            peer.append(_yardstick(given))
            if peer[-1][1] > LONGEST:
                break
        (a, whole), (b, yard) = (tuple(map(statistics.median, zip(*runs, strict=True))) for runs in (mine, peer))
        more = "< " if yard > LONGEST else ""
        cells = (f"{a:.3f}", f"{b:.3f}", f"{a / b:.2f}", f"{whole:.1f}", f"{yard:.1f}", f"{more}{whole / yard:.2f}")
        table.add_row(name, *cells)
    return table


def _library(given: Case) -> tuple[float, float]:
    """Seconds to derive the library's sources, and with compiling.

    The solver is given, as CasADi chooses none: an export without --solver looks at the stiffness of the start first.
    """
    mechanism = given.mechanism()
    with _cold():
        begun = _seconds()
        found = derived(mechanism, DEFAULT_SOLVER)
        description, sources = describe(found.mechanism, found.equations, found.program, found.solver, found.vibrations)
        written = _seconds()
        compile_library(sources, fmi_headers(), description.model_identifier, host_platform())
        return written - begun, _seconds() - begun


def _yardstick(given: Case) -> tuple[float, float]:
    """The same of CasADi's accelerations and their Jacobian."""
    ca: Any = importlib.import_module("casadi")
    with _cold() as folder:
        begun = _seconds()
        arguments, (qdd,) = of_lagrangian(ca, given, True)
        jacobian = ca.jacobian(qdd, ca.vertcat(*arguments[:2]))
        text = casadi_text(ca, ca.Function("f", arguments, [ca.densify(qdd), jacobian], {"cse": True}))
        written = _seconds()
        Path(folder, "peer.c").write_text(text, "utf-8")
        command = [
            zig(),
            "cc",
            "-target",
            host_platform().targets[0],
            *FLAGS,
            "-w",
            "-shared",
            "peer.c",
            "-o",
            "peer.so",
        ]
        subprocess.run(command, cwd=folder, check=False, capture_output=True, preexec_fn=_bound)
        return written - begun, _seconds() - begun


def _bound() -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST))


class _cold(tempfile.TemporaryDirectory[str]):  # noqa: N801 (a context)
    """A folder for the compiler's objects, which are removed behind; libraries are not kept."""

    def __enter__(self) -> str:
        os.environ |= {"LAG2FMU_LIBRARIES": "off", "ZIG_LOCAL_CACHE_DIR": self.name}
        gc.collect()  # what other runs left would be searched within this one
        return super().__enter__()


def _of_robots() -> Table:
    table = Table("what", "robot", "s", "bar", title="commands, floating bases", title_justify="left")
    files = robot_files()
    with tempfile.TemporaryDirectory() as folder:
        for name, bar in EXPORTED.items():
            arguments = (str(files[name]), "--base", "floating", "-o", str(Path(folder, f"{name}.fmu")), "--force")
            table.add_row("export", name, f"{_median(partial(_run, *_EXPORT, *arguments)):.1f}", str(bar))
    for name, bar in CALLED.items():
        code = f"f = lag2fmu.function(lag2fmu.load({str(files[name])!r}, {{'base': 'floating'}})); f(f.start['x'])"
        table.add_row("function", name, f"{_median(partial(_run, '-c', f'import lag2fmu; {code}')):.1f}", str(bar))
    return table


def _of_platforms() -> Table:
    table = Table("export of double_pendulum", "s", "ratio", "bar", title="--platform all", title_justify="left")
    with tempfile.TemporaryDirectory() as folder:
        arguments = (*_EXPORT, "double_pendulum", "-o", str(Path(folder, "x.fmu")), "--force")
        everywhere = (*arguments, "--platform", "all")
        _run(*everywhere)  # the compiler's own parts of each platform
        alone = _median(partial(_run, *arguments))
        kept = Path(folder, "libraries")
        first = _run(*everywhere, kept=kept)
        again = _median(partial(_run, *everywhere, kept=kept))
    table.add_row("this machine", f"{alone:.1f}")
    for name, seconds in (("first", first), ("again", again)):
        table.add_row(f"all, {name}", f"{seconds:.1f}", f"{seconds / alone:.2f}", str(PLATFORMS[name]))
    return table


_EXPORT = ("-m", "lag2fmu", "export")


def _run(*arguments: str, kept: Path | None = None) -> float:
    """The seconds of CPU that Python takes with ``arguments``; libraries are kept in a folder, if one is given."""
    with _cold():
        environment = os.environ | ({"LAG2FMU_LIBRARIES": str(kept)} if kept else {})
        environment.pop("PYTHONDONTWRITEBYTECODE", None)  # an installed package has its bytecode
        begun = _seconds()
        subprocess.run([sys.executable, *arguments], check=True, capture_output=True, env=environment)
        return _seconds() - begun


def _median(run: Callable[[], float]) -> float:
    return statistics.median(run() for _ in range(RUNS))


def _seconds() -> float:
    """The CPU time of this process and of its children that have ended."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


if __name__ == "__main__":
    main()
