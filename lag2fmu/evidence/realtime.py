"""The report on what a mechanism in plain C takes in real time, and on how far its run is from the motion.

Errors are those of steps of fixed length against an accurate run, and of numbers of type float against doubles.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lag2fmu.errors import Lag2FmuError
from lag2fmu.evidence.counting import Counted, counted
from lag2fmu.fmu.contents import DESCRIPTION, EQUATIONS
from lag2fmu.fmu.exporting import export
from lag2fmu.fmu.firmware import Firmware
from lag2fmu.fmu.footprint import footprints
from lag2fmu.fmu.taken import Taken, bounds_of
from lag2fmu.solvers.methods import BOUNDED, STIFF_SOLVER
from lag2fmu.verify.run import Run
from lag2fmu.verify.simulate import simulate_fmu

Floats = NDArray[np.float64]

REPORT = "REPORT.md"

TIGHT = 1e-13
"""The relative tolerance of the run that errors are measured against: near rounding."""
KNOWN = 1e-11
"""Errors below so many greatest values are not told from those of that run."""
_ACCURATE = "dop853"
"""The solver of that run, of order 8; that of stiff motions is their own."""
MOST_ROWS = 20
"""The most outputs whose errors are listed."""


@dataclass(frozen=True)
class Errors:
    """The greatest error of each output over a run, and its greatest ``values`` (outputs,), in SI units.

    ``steps`` (outputs,) are errors of the steps of fixed length, ``why`` tells why there are none. ``real`` (outputs,)
    are those that numbers of type float add; None where all are doubles.
    """

    values: Floats
    steps: Floats | None
    real: Floats | None
    why: str = ""


def realtime_report(made: Firmware, in_double: Firmware | None = None) -> str:
    """What ``made`` takes, as Markdown: memory, the deepest stack, code and constants on processors, bounds of loops.

    It has the operations and instructions of steps over the experiment, and the errors of the run: those of steps of
    fixed length, and those of numbers of type float against the same mechanism ``in_double``, None where ``made`` is.
    Raises BuildError with the compiler's output if it fails.
    """
    name = next(name for name in made.files if name.endswith(".h")).removesuffix(".h")
    prints = footprints(f"{name}.c", made.files, rf"{name}_(init|set|get|start|step|time|failure|notices)")
    bounds = bounds_of(made.files[f"{name}.c"])
    taken = Taken(name, made.solver, made.real, made.bound, made.size, prints, bounds)
    run = counted(made)
    double = run if in_double is None else counted(in_double, instructions=False)
    return "\n".join([*taken.markdown, *_steps(run), *_accuracy(made, errors_of(made, run.values, double.values))])


def _steps(taken: Counted) -> list[str]:
    """What steps took, as lines of Markdown."""
    rows = {"floating-point operations": taken.operations}
    rows |= {} if taken.instructions is None else {"instructions": taken.instructions}
    lines = [f"| one of {len(taken.operations)} steps, this machine | least | median | most |", "|---|---|---|---|"]
    lines += [
        f"| {name} | {' | '.join(f'{value:.0f}' for value in _spread(counts))} |" for name, counts in rows.items()
    ]
    if taken.instructions is None:
        return [*lines, "", "Instructions were not counted: valgrind is not on this machine.", ""]
    return [*lines, ""]


def _spread(counts: Floats) -> tuple[float, float, float]:
    """The least, median and greatest of ``counts`` (steps,)."""
    return float(counts.min()), float(np.median(counts)), float(counts.max())


def _accuracy(made: Firmware, errors: Errors) -> list[str]:
    """The errors of the run, as lines of Markdown."""
    columns = {"greatest value": [f"{value:.3g}" for value in errors.values]}
    if errors.steps is None:
        lines = [f"Errors of the steps are not known: {errors.why}"]
    else:
        columns["error of the steps"] = [*map(_error, errors.steps, errors.values)]
        lines = [f"Errors of the steps are the greatest differences to a run with the tolerance {TIGHT:g}."]
    if errors.real is not None:
        columns["error of float"] = [f"{value:.3g}" for value in errors.real]
        lines.append("Those of float are the greatest differences to the same steps in double.")
    names = [f"{name}, {unit}" if unit else name for name, unit in made.outputs.items()]
    rows = [f"| {' | '.join(row)} |" for row in zip(names, *columns.values(), strict=True)]
    more = len(rows) - MOST_ROWS
    lines += [f"{more} further outputs are left out."] if more > 0 else []
    return [
        f"| {' | '.join(['output', *columns])} |",
        "|---|" + "---|" * len(columns),
        *rows[:MOST_ROWS],
        "",
        *lines,
        "",
    ]


def _error(error: float, value: float) -> str:
    """An error of the steps; it is not known where it is as small as those of the run that it is measured against."""
    least = KNOWN * value
    return f"{error:.3g}" if error >= least else f"below {least:.1g}"


def errors_of(made: Firmware, values: Floats, in_double: Floats) -> Errors:
    """The errors of what was ``made``.

    ``values`` (m, outputs) are those of its run, ``in_double`` (m, outputs) of one by the same steps in double. Both
    are one array where it is in double itself.
    """
    found, why = _tight(made, len(in_double))
    size = min(len(values), len(in_double))
    real = None if values is in_double else np.abs(values[:size] - in_double[:size]).max(axis=0)
    steps = None if found is None else np.abs(found - in_double).max(axis=0)
    return Errors(np.abs(in_double).max(axis=0), steps, real, why)


def _tight(made: Firmware, count: int) -> tuple[Floats | None, str]:
    """The outputs (count, outputs) of the motion at the same times, None where they cannot be had and the reason."""
    step = made.bound.longest
    solver = STIFF_SOLVER if made.solver == BOUNDED[STIFF_SOLVER] else _ACCURATE
    asked = Run(stop_time=step * (count - 1), step=step, tolerance=TIGHT, outputs=tuple(made.outputs))
    with tempfile.TemporaryDirectory(prefix="lag2fmu-") as folder:
        path = Path(folder) / "it.fmu"
        try:
            export(made.mechanism, path, solver=solver, page="static", without=(EQUATIONS, DESCRIPTION))
            return simulate_fmu(path, asked).values, ""
        except Lag2FmuError as error:
            return None, str(error)
