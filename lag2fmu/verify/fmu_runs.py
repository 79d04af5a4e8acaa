"""The runs of an FMU that are compared: co-simulation at three steps and by event mode, and model exchange."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lag2fmu.deadline import OutOfTimeError, within
from lag2fmu.description import names
from lag2fmu.errors import SimulationError
from lag2fmu.reference.integrated import Reference
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.agreement import horizon_of
from lag2fmu.verify.comparison import compare
from lag2fmu.verify.hybrid import row_outputs
from lag2fmu.verify.instances import has_event_mode, offers_model_exchange
from lag2fmu.verify.report import Check
from lag2fmu.verify.run import Kind, Run
from lag2fmu.verify.simulate import simulate_fmu
from lag2fmu.verify.task import Task

CVODE = 0.01
"""In tolerances: that of CVode, whose errors over a run are far above those of a step."""
CONVERGES = 10.0
"""By how many times the errors of a run fall at least, with a hundredth of the tolerance, if they are the solver's."""
FINER = 0.1
"""In solver steps: the step of a run that shows whether errors of time stepping fall with it."""
OF_FIRST = 3.0
"""By how many times they fall then at least: ten times by the order, but an event is late by any part of a step."""


def planned(task: Task) -> list[tuple[str, Kind, float, bool]]:
    """(label, kind, communication step in s, whether by event mode with early return) of the runs of the FMU."""
    middle = task.steps[1]
    plan: list[tuple[str, Kind, float, bool]]
    plan = [(f"co-simulation, step {step:.3g} s", "co-simulation", step, False) for step in task.steps]
    if has_event_mode(task.path):
        plan.append((f"co-simulation with event mode, step {middle:.3g} s", "co-simulation", middle, True))
    if offers_model_exchange(task.path):
        plan.append(("model exchange, CVode of fmpy", "model-exchange", middle, False))
    return plan


def ended(task: Task, step: float, end: float) -> Task:
    """The ``task`` until the last multiple of the communication ``step`` (s) that is no later than ``end`` (s)."""
    return replace(task, stop_time=min(task.stop_time, step * max(1, int(end / step * (1 + 1e-9)))))


def by_sharper_run(task: Task, check: Check, kind: Kind, step: float, events: bool, reference: Reference) -> Check:
    """The ``check`` of a run of this ``kind``, or that of a sharper run if this shows that it was the integrator.

    CVode begins anew at every event, and low rebounds enlarge each of its errors by more than those of the start. Time
    stepping takes events late, and some enlarge that. Such errors fall with the tolerance of CVode, or with the step,
    those of an FMU do not. Raises SimulationError where its times are not those of the ``reference``.
    """
    exchange = kind == "model-exchange"
    if check.passed or not (exchange or task.solver_step):
        return check
    compared = ended(task, step, horizon_of(task, reference))
    sharper = compared if exchange else replace(compared, solver_step=FINER * task.solver_step)
    try:
        with within(task.limit):
            run = run_of(sharper, kind, step, events, lambda sentence: None, CVODE * CVODE)
    except (OutOfTimeError, SimulationError):
        return check
    found = compare(task, check.name, run, reference)
    falls = check.value / max(found.value, 1e-300)
    by = task.tolerance * CVODE**2, task.tolerance * CVODE
    told = "CVode at {:.0e}; at {:.0e}".format(*by) if exchange else f"solver_step {sharper.solver_step:.1e} s; else"
    detail = f"{found.detail}, {told} it errs {falls:.0f} times as much"
    return replace(found, detail=detail) if found.passed and falls > (CONVERGES if exchange else OF_FIRST) else check


def run_of(
    task: Task, kind: Kind, step: float, events: bool, warned: Callable[[str], None], cvode: float = CVODE
) -> Trajectory:
    """One run of the FMU, whose warnings go to ``warned``; CVode gets the part ``cvode`` of the tolerance.

    Raises SimulationError where it does not come to its end.
    """
    outputs = [*task.states, *(names.acceleration(c.name) for c in task.mechanism.coordinates), "generalized_energy"]
    outputs += [names.residual(c.name) for c in task.mechanism.constraints]
    outputs += row_outputs(task.mechanism)
    tolerance = task.tolerance if kind == "co-simulation" else max(task.tolerance * cvode, 1e-13)
    options = Run(
        stop_time=task.stop_time,
        step=step,
        tolerance=tolerance,
        inputs=task.inputs,
        hold=task.hold,
        values=task.settings,
        outputs=outputs,
        kind=kind,
        warned=warned,
        events=events,
    )
    return simulate_fmu(task.path, options)
