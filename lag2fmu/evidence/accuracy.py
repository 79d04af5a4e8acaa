"""How far a run with steps of fixed length is from the motion, and one of numbers of type float from one of doubles."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lag2fmu.errors import Lag2FmuError
from lag2fmu.fmu.contents import DESCRIPTION, EQUATIONS
from lag2fmu.fmu.exporting import export
from lag2fmu.fmu.firmware import Firmware
from lag2fmu.solvers.methods import BOUNDED, STIFF_SOLVER
from lag2fmu.verify.run import Run
from lag2fmu.verify.simulate import simulate_fmu

Floats = NDArray[np.float64]

TIGHT = 1e-13
"""The relative tolerance of the run that errors are measured against: near rounding."""
KNOWN = 1e-11
"""Errors below so many greatest values are not told from those of that run."""
_ACCURATE = "dop853"
"""The solver of that run, of order 8; that of stiff motions is their own."""


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
