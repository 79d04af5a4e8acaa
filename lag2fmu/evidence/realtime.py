"""The report on what a mechanism in plain C takes in real time, and on how far its run is from the motion.

Errors are those of steps of fixed length against an accurate run, and of numbers of type float against doubles.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
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

TIGHT = (1e-13, 1e-12)
"""The relative tolerances of the run that errors are measured against, near rounding, and of one beside it.

The differences of both tell what the first does not know: rounding, and what the motion makes of it.
"""
CLEAR = 10.0
"""Times what is not known is an error that is told; of smaller ones a bound is told."""
ROUNDING = 1e-13
"""Times the greatest value is never known."""
GROWN = 1e-6
"""Times the greatest value of a unit is more than a motion without growing errors leaves unknown."""
LOST = 0.1
"""Times the greatest value is an error that tells no more than that the steps have left the motion."""
_ACCURATE = "dop853"
"""The solver of these runs, of order 8; that of stiff motions is their own."""
MOST_ROWS = 20
"""The most outputs whose errors are listed."""


@dataclass(frozen=True)
class StepErrors:
    """The greatest errors ``found`` (outputs,) of steps of fixed length over a run, in SI units.

    Each is known but for ``unknown`` (outputs,).
    """

    found: Floats
    unknown: Floats

    @property
    def clear(self) -> NDArray[np.bool_]:
        """(outputs,): whether what is not known is a small part of the error."""
        return np.asarray(self.found >= CLEAR * self.unknown)

    @property
    def bounds(self) -> Floats:
        """(outputs,): what the errors are below in any case."""
        return self.found + self.unknown


@dataclass(frozen=True)
class Errors:
    """The greatest error of each output over a run, and its greatest ``values`` (outputs,), in SI units.

    ``steps`` are errors of the steps of fixed length, or the reason why there are none. ``real`` (outputs,) are those
    that numbers of type float add; None where all are doubles.
    """

    values: Floats
    steps: StepErrors | str
    real: Floats | None


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
    if isinstance(errors.steps, str):
        lines = [f"Errors of the steps are not known: {errors.steps}"]
    else:
        columns["error of the steps"] = _told(errors.steps)
        lines = [*_judged(errors.steps, errors.values, [*made.outputs.values()])]
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


def _told(steps: StepErrors) -> list[str]:
    """The error of each output; a bound where the run that it is measured against does not tell it."""
    known = zip(steps.clear, steps.found, steps.bounds, strict=True)
    return [f"{error:.3g}" if clear else f"below {_upwards(bound):.0e}" for clear, error, bound in known]


def _upwards(number: float) -> float:
    """The least number of one digit that is not below a positive ``number``."""
    unit = 10.0 ** math.floor(math.log10(number)) if number > 0.0 else 1.0
    return math.ceil(number / unit * (1.0 - 1e-12)) * unit


def _judged(steps: StepErrors, values: Floats, units: list[str]) -> Iterator[str]:
    """What the errors of the ``steps`` are, and what they do not tell, as sentences.

    The outputs have these greatest ``values`` (outputs,) and these ``units``.
    """
    tight, beside = TIGHT
    yield f"Errors of the steps are the greatest differences to a run with the tolerance {tight:g}."
    if not steps.clear.all():
        yield f"Those that are not told from its own, as a run with {beside:g} shows them, are below what is said."
    usual = np.array([max(v for v, u in zip(values, units, strict=True) if u == unit) for unit in units])
    grown = float((steps.unknown / np.where(usual > 0.0, usual, 1.0)).max())
    if grown > GROWN:
        yield (
            f"The motion makes errors grow: those of rounding to {_upwards(grown):.0e} of the greatest value. Then "
            "numbers depend on the processor and the compiler, and a shorter experiment tells more."
        )
    if (steps.found > LOST * usual).any():
        yield (
            "An error of more than a tenth of the greatest value says that a jump comes some steps early or late, or "
            "that the steps have left the motion. Then a shorter step or a shorter experiment tells more."
        )


def errors_of(made: Firmware, values: Floats, in_double: Floats) -> Errors:
    """The errors of what was ``made``.

    ``values`` (m, outputs) are those of its run, ``in_double`` (m, outputs) of one by the same steps in double. Both
    are one array where it is in double itself.
    """
    size = min(len(values), len(in_double))
    real = None if values is in_double else _greatest(values[:size] - in_double[:size])
    try:
        tight, beside = _accurate(made, len(in_double))
    except Lag2FmuError as error:
        return Errors(_greatest(in_double), str(error), real)
    unknown = np.maximum(_greatest(tight - beside), ROUNDING * _greatest(tight))
    return Errors(_greatest(in_double), StepErrors(_greatest(in_double - tight), unknown), real)


def _greatest(values: Floats) -> Floats:
    """The greatest magnitudes (outputs,) of ``values`` (m, outputs)."""
    return np.asarray(np.abs(values).max(axis=0))


def _accurate(made: Firmware, count: int) -> list[Floats]:
    """The outputs (count, outputs) of the motion at the same times, with each tolerance of TIGHT.

    Raises Lag2FmuError where they cannot be had.
    """
    step = made.bound.longest
    solver = STIFF_SOLVER if made.solver == BOUNDED[STIFF_SOLVER] else _ACCURATE
    asked = Run(stop_time=step * (count - 1), step=step, outputs=tuple(made.outputs))
    with tempfile.TemporaryDirectory(prefix="lag2fmu-") as folder:
        path = Path(folder) / "it.fmu"
        export(made.mechanism, path, solver=solver, page="static", without=(EQUATIONS, DESCRIPTION))
        return [simulate_fmu(path, replace(asked, tolerance=tolerance)).values for tolerance in TIGHT]
