"""The profile for real time: how long a step may be, and how many solver steps it may have."""

from __future__ import annotations

import math
from typing import NamedTuple

from lag2fmu.codegen.tables import RuntimeTables, StepBound
from lag2fmu.errors import ExportError
from lag2fmu.mechanism.record import Mechanism

REAL_TIME = "realtime"
PROFILES = ("desktop", REAL_TIME)
"""What an FMU is for; the work of a step has a bound in real time."""
MOST_SOLVER_STEPS = 10_000
"""In a step; a longer one belongs to no loop in real time."""


class RealTime(NamedTuple):
    """An FMU for real time, whose longest communication step is ``step`` (s), None for that of the experiment."""

    step: float | None = None


def step_bound(
    mechanism: Mechanism, solver_step: float, longest: float | None = None, solver_steps: int | None = None
) -> StepBound:
    """The bound of a step that is ``longest`` (s), by default that of the experiment, with solver steps (s) as long.

    ``solver_steps`` names their number. Raises ExportError for lengths and numbers that none can have.
    """
    step = mechanism.experiment.step if longest is None else longest
    if not (math.isfinite(step) and step > 0):
        raise ExportError(f"--step {step:g}: expected a positive number of seconds")
    if solver_steps is not None and not 1 <= solver_steps <= MOST_SOLVER_STEPS:
        raise ExportError(f"--solver-steps {solver_steps}: expected 1 to {MOST_SOLVER_STEPS}")
    count = math.ceil(step / solver_step * (1 - 1e-9)) if solver_steps is None else solver_steps
    if count > MOST_SOLVER_STEPS:
        raise ExportError(
            f"a step of {step:g} s would have {count} solver steps; expected 1 to {MOST_SOLVER_STEPS}: name a shorter "
            "--step"
        )
    return StepBound(step, count)


def bounded(tables: RuntimeTables, bound: StepBound) -> RuntimeTables:
    """The ``tables`` of a mechanism whose steps have this ``bound``."""
    return tables._replace(bound=bound, default_solver_step=bound.longest / bound.solver_steps)


def check_profile(profile: str, backend: str, step: float | None) -> None:
    """Raise ExportError for a profile that is unknown, or that does not go with the other choices."""
    if profile not in PROFILES:
        raise ExportError(f"--profile {profile}: known are {', '.join(PROFILES)}")
    if profile == REAL_TIME and backend != "c":
        raise ExportError(f"--profile {REAL_TIME}: Python answers when it likes; leave --backend out")
    if profile != REAL_TIME and step is not None:
        raise ExportError(f"--step bounds the steps of --profile {REAL_TIME}; add it, or leave --step out")
