"""Errors of fixed steps in real time: what the report says of them, beside an independent run.

Run with `python -m benchmarks.fixed_steps [MODEL ...]`: all bundled mechanisms in plain C over their experiments, with
one solver step of 1 ms in a communication step, or that of the experiment if it is shorter. The report measures against
dop853, or radau5 where the motion is stiff, at the tolerance 1e-13. Here dopri5 at 1e-14 judges it. The bar: errors
that are told are right to 20 %, and others are below their bound.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.cases import Floats
from lag2fmu.errors import ExportError, Lag2FmuError
from lag2fmu.evidence.counting import counted
from lag2fmu.evidence.realtime import StepErrors, errors_of
from lag2fmu.fmu.contents import DESCRIPTION, EQUATIONS
from lag2fmu.fmu.exporting import export
from lag2fmu.fmu.firmware import Firmware, firmware
from lag2fmu.formats.loading import load
from lag2fmu.mechanism.record import complete
from lag2fmu.resources import bundled
from lag2fmu.verify.run import Run
from lag2fmu.verify.simulate import simulate_fmu

STEP = 1e-3
"""s"""
JUDGE, TOLERANCES = "dopri5", (1e-14, 1e-13)
"""The solver that judges; its runs at both tolerances tell what it does not know itself."""
RIGHT = 0.2
"""The most that an error may be wrong by, in parts of it."""


@dataclass(frozen=True)
class Judged:
    """A mechanism: how many outputs have an error that is told, and how many a bound.

    ``seen`` is the number of the former that the judge knows better than RIGHT; ``wrong`` is the most that one of these
    is wrong by, relative to it. ``beyond`` is the most of the latter in parts of its bound, but for what the
    judge does not know.
    """

    solver: str
    told: int
    seen: int
    bounded: int
    wrong: float
    beyond: float

    @property
    def passes(self) -> bool:
        """Whether the report is right."""
        return self.wrong <= RIGHT and self.beyond <= 1.0


def made_with_steps(model: str) -> Firmware:
    """The bundled ``model`` in plain C, with steps of STEP; raises ExportError where no method of fixed steps fits."""
    described = load(model).description
    step = min(STEP, described.experiment.step)
    mechanism = complete(replace(described, experiment=replace(described.experiment, step=step)))
    return firmware(mechanism, step=step, solver_steps=1)


def judged(made: Firmware) -> Judged | str:
    """What the report says of ``made``, beside the judge; the reason where the report has no errors."""
    values = counted(made, instructions=False).values
    steps = errors_of(made, values, values).steps
    if isinstance(steps, str):
        return steps
    runs = _runs(made, len(values))
    return _compared(made.solver, steps, *(np.abs(a - b).max(axis=0) for a, b in ((values, runs[0]), runs)))


def _compared(solver: str, steps: StepErrors, true: Floats, unknown: Floats) -> Judged:
    """The errors of ``steps`` beside those of the judge, (outputs,), who knows ``true`` but for ``unknown``."""
    seen = steps.clear & (unknown <= RIGHT * steps.found)
    wrong = np.where(seen, _parts(np.abs(steps.found - true), steps.found), 0.0)
    beyond = np.where(steps.clear, 0.0, _parts(np.maximum(true - unknown, 0.0), steps.bounds))
    told = int(steps.clear.sum())
    return Judged(solver, told, int(seen.sum()), len(true) - told, float(wrong.max()), float(beyond.max()))


def _parts(numbers: Floats, whole: Floats) -> Floats:
    """``numbers`` (outputs,) in parts of ``whole`` (outputs,); none is none of nothing."""
    return np.divide(numbers, whole, out=np.where(numbers > 0.0, np.inf, 0.0), where=whole > 0.0)


def _runs(made: Firmware, count: int) -> list[Floats]:
    """The outputs (count, outputs) of the judge at the same times, with each of TOLERANCES."""
    step = made.bound.longest
    asked = Run(stop_time=step * (count - 1), step=step, outputs=tuple(made.outputs))
    with tempfile.TemporaryDirectory(prefix="lag2fmu-") as folder:
        path = Path(folder) / "it.fmu"
        export(made.mechanism, path, solver=JUDGE, page="static", without=(EQUATIONS, DESCRIPTION))
        return [simulate_fmu(path, replace(asked, tolerance=tolerance)).values for tolerance in TOLERANCES]


def main() -> None:
    """Print a row for each mechanism; exit with 1 if an error in a report is wrong."""
    table = Table("mechanism", "solver", "told", "of them seen", "below a bound", "wrong by, %", "of the bound, %")
    failed = []
    for model in sys.argv[1:] or bundled():
        try:
            found = judged(made_with_steps(model))
        except ExportError:
            table.add_row(model, "none of fixed steps")
            continue
        except Lag2FmuError as error:
            found = str(error)
        if isinstance(found, str):
            table.add_row(model, found)
            failed.append(model)
            continue
        numbers = (found.told, found.seen, found.bounded, f"{100 * found.wrong:.2g}", f"{100 * found.beyond:.2g}")
        table.add_row(model, found.solver, *map(str, numbers))
        failed += [] if found.passes else [model]
    Console().print(table)
    if failed:
        sys.exit(f"wrong: {', '.join(failed)}")


if __name__ == "__main__":
    main()
