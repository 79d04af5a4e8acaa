"""Energy over a million periods: variational integrators beside explicit ones that take the same CPU time.

Run with `make bench` or `python -m benchmarks.long [--periods N] [--folder FOLDER]`: Kepler's problem and a free rigid
body in a quaternion. Steps and tolerances are chosen by trial such that a period costs about as much CPU time with each
method; a million periods take a quarter of an hour. The bar: the energy error of variational methods does not grow,
while that of the others does.
"""

from __future__ import annotations

import argparse
import math
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from benchmarks.cases import Floats
from benchmarks.integrators import kepler
from benchmarks.running import KERNELS, save
from lag2fmu.codegen import METHODS
from lag2fmu.dynamics import derive, lower
from lag2fmu.fmu.backends.native import describe, fmi_headers
from lag2fmu.fmu.compilers import FLAGS
from lag2fmu.formats.loading import load
from lag2fmu.mechanism import Mechanism

SAMPLES = 64
"""Energies in a period of a method that chooses its steps; of the others one a step."""
TRIAL = 1000
"""Periods of a trial run."""


@dataclass(frozen=True)
class Problem:
    """A motion, its period (s), the CPU time (us) that a period may cost, and the methods to integrate it with."""

    mechanism: Callable[[], Mechanism]
    period: float
    cost: float
    solvers: tuple[str, ...]


PROBLEMS = {
    "Kepler, e = 0.6": Problem(
        lambda: kepler(0.6), 2 * math.pi, 60.0, ("verlet", "lobatto4", "gauss4", "gauss6", "dopri5", "dop853")
    ),
    "free body in a quaternion": Problem(
        lambda: load("free_body"), 2 * math.pi / 1.5, 150.0, ("verlet", "lobatto4", "dopri5", "dop853")
    ),
}


@dataclass(frozen=True)
class Run:
    """What was set, CPU time (us) a period, and (periods, relative energy error) along the run, (k, 2)."""

    setting: str
    cost: float
    errors: Floats


# ------------------------------------------------------------------------------------------------------------ running


def build(mechanism: Mechanism, solver: str, folder: Path) -> Path:
    """The C host with the sources of ``mechanism``, compiled by gcc with the flags of an FMU."""
    equations = derive(mechanism)
    program = lower(equations, variational=METHODS[solver].variational)
    _, sources = describe(equations.mechanism, equations, program, solver)
    place = folder / f"{mechanism.name}_{solver}"
    place.mkdir()
    for name, text in sources.items():
        (place / name).write_text(text, "utf-8")
    units = [name for name in sources if name.endswith(".c")]
    flags = [flag for flag in FLAGS if flag != "-fPIC"]
    command = ["gcc", *flags, "-I.", f"-I{fmi_headers()}", *units, str(KERNELS / "long.c"), "-lm", "-o", "host"]
    subprocess.run(command, cwd=place, check=True)
    return place / "host"


@dataclass(frozen=True)
class Host:
    """The program of a method, with steps (s) or tolerances that go with a number: steps, or digits, of a period."""

    program: Path
    period: float
    adaptive: bool

    def setting(self, effort: float) -> tuple[str, float, int]:
        """Parameter, value and samples a period."""
        if self.adaptive:
            return "solver_tolerance", 10.0**-effort, SAMPLES
        return "solver_step", self.period / round(effort), round(effort)

    def run(self, effort: float, periods: int) -> Run:
        """``periods`` of the motion."""
        name, value, samples = self.setting(effort)
        command = [str(self.program), name, repr(value), repr(self.period), str(samples), str(periods)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        table = np.array([line.split() for line in done.stdout.splitlines()], float)
        shown = f"{value:.1e}" if self.adaptive else f"{samples} steps"
        return Run(shown, 1e6 * float(table[-1, 2]), table[:, :2])

    def effort_for(self, cost: float) -> float:
        """The effort for about this CPU time (us) a period, by bisection."""
        low, high = (4.0, 14.5) if self.adaptive else (8.0, 1024.0)
        for _ in range(7):
            middle = (low + high) / 2 if self.adaptive else math.sqrt(low * high)
            low, high = (low, middle) if self.run(middle, TRIAL).cost > cost else (middle, high)
        return (low + high) / 2


# ------------------------------------------------------------------------------------------------------------ showing


def by_decade(errors: Floats) -> dict[str, float]:
    """The greatest error up to 10 periods, then up to 100, ..., up to the end."""
    last = float(errors[-1, 0])
    ends = [0.0, *(10.0**k for k in range(1, math.ceil(math.log10(last)))), last]
    times, sizes = errors.T
    return {f"to {end:.0e}": float(sizes[(times > begin) & (times <= end)].max()) for begin, end in pairwise(ends)}


def growth(errors: Floats) -> float:
    """The slope of log error over log time in the last two decades."""
    late = errors[errors[:, 0] >= errors[-1, 0] / 100]
    return float(np.polyfit(np.log(late[:, 0]), np.log(np.maximum(late[:, 1], 1e-17)), 1)[0])


def show(name: str, found: dict[str, Run], console: Console) -> None:
    """Errors by decade."""
    table = Table(title=f"{name}: greatest relative error of the energy, by decade of time", title_justify="left")
    decades = by_decade(next(iter(found.values())).errors)
    for heading in ("solver", "setting", "us a period", *decades, "growth"):
        table.add_column(heading, justify="right")
    for solver, run in found.items():
        cells = [f"{error:.1e}" for error in by_decade(run.errors).values()]
        table.add_row(solver, run.setting, f"{run.cost:.1f}", *cells, f"t^{growth(run.errors):.2f}")
    console.print(table)


def plot(results: dict[str, dict[str, Run]], path: Path) -> None:
    """Error over time, double logarithmic."""
    figure = Figure(figsize=(11, 4.5), layout="constrained")
    axes = figure.subplots(1, len(results))
    solvers = sorted({solver for found in results.values() for solver in found})
    colours = {solver: f"C{i}" for i, solver in enumerate(solvers)}
    for axis, (name, found) in zip(axes, results.items(), strict=True):
        for solver, run in found.items():
            style = "o-" if METHODS[solver].variational else "s--"
            axis.loglog(*run.errors.T, style, color=colours[solver], ms=3, label=f"{solver}, {run.setting}")
        axis.set(xlabel="periods", ylabel="relative energy error", title=name)
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8)
    save(figure, path)


def main() -> None:
    """Measure, print, plot."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=Path("build/benchmarks"), help="where the plot goes")
    parser.add_argument("--periods", type=lambda text: int(float(text)), default=1_000_000)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    console, results = Console(width=160), {}
    with tempfile.TemporaryDirectory() as folder:
        for name, problem in PROBLEMS.items():
            found: dict[str, Run] = {}
            for solver in problem.solvers:
                program = build(problem.mechanism(), solver, Path(folder))
                host = Host(program, problem.period, METHODS[solver].error_order > 0)
                found[solver] = host.run(host.effort_for(problem.cost), options.periods)
            results[name] = found
            show(name, found, console)
    plot(results, options.folder / "long.svg")


if __name__ == "__main__":
    main()
