"""The FMU against the direct integration of the same mechanism, on paths that share nothing but the record.

``agreement`` explains the bars, ``comparison`` how the rest of a chaotic run is compared.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from lag2fmu.description import names
from lag2fmu.dynamics.lagrange import derive, with_derived
from lag2fmu.errors import SimulationError
from lag2fmu.fmu.advice import suited_solver
from lag2fmu.fmu.contents import read_mechanism
from lag2fmu.fmu.exported import Model, is_fmu
from lag2fmu.fmu.exporting import as_fmu
from lag2fmu.formats.loading import as_mechanism, with_values
from lag2fmu.mechanism.display import display_units
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.initial_value_problem import prepare
from lag2fmu.reference.integrate import integrate, remedy_of_jumps
from lag2fmu.reference.integrated import Reference
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.solvers.methods import METHODS
from lag2fmu.verify.agreement import SAFETY, has_rows, horizon_of, on_grid
from lag2fmu.verify.balances import constraint_checks, energy_checks
from lag2fmu.verify.comparison import compare, extent_check, extent_note, own_error, windows_after
from lag2fmu.verify.hybrid import extent, row_checks, row_outputs
from lag2fmu.verify.inputs import Inputs, trajectory_of
from lag2fmu.verify.instances import description_of, has_event_mode, offers_model_exchange, problems
from lag2fmu.verify.invariants import action_note, drift_checks, hamilton_checks
from lag2fmu.verify.law_checks import law_checks
from lag2fmu.verify.plan import check_times, check_tolerance, takes_derivatives, times_of
from lag2fmu.verify.pointwise import pointwise_checks
from lag2fmu.verify.report import Check, Report
from lag2fmu.verify.run import Kind, Run
from lag2fmu.verify.simulate import simulate_fmu
from lag2fmu.verify.task import Floats, Task, moves_a_target

DIRECT = "direct integration"
SHARE = 0.8
"""About this part of the time goes to the direct integration."""


def validate(
    model: Model,
    *,
    stop_time: float | None = None,
    tolerance: float | None = None,
    values: Mapping[str, float] | None = None,
    inputs: Inputs | None = None,
    hold: bool = False,
    solver: str | None = None,
    fmi: str = "2.0",
    progress: Callable[[float], None] | None = None,
) -> Report:
    """Compare the FMU of ``model`` with the direct integration of its mechanism until ``stop_time`` (s).

    An FMU of lag2fmu carries its mechanism inside. For a model that is no FMU yet, ``values`` are parameters and start
    values in SI units, and ``solver`` and ``fmi`` are choices of its export. ``tolerance`` is the relative one of the
    FMU's solver. ``inputs`` and ``hold`` are those of ``simulate``. ``progress`` is told the share that is done, 0 to
    1. Raises Lag2FmuError if one side cannot be run; differences are reported, not raised. Source: E. Hairer, S. P.
    Norsett, G. Wanner, Solving Ordinary Differential Equations I, section I.14.
    """
    source = model if is_fmu(model) else with_values(as_mechanism(model), values or {})
    with ExitStack() as folders:
        with ThreadPoolExecutor(max_workers=1) as beside:
            if isinstance(source, Mechanism):  # the compilers of both sides work at the same time
                beside.submit(
                    lambda: prepare(with_derived(source))
                )  # an error here comes again where the result is needed
            path = folders.enter_context(as_fmu(source, solver, fmi))
        mechanism = read_mechanism(path)
        signals = trajectory_of(inputs, *times_of(path, stop_time, None))
        return validate_fmu(
            mechanism,
            path,
            stop_time=stop_time,
            tolerance=tolerance,
            inputs=signals,
            hold=hold,
            progress=progress,
        )


@np.errstate(all="ignore")  # values that are not finite are reported in a row or an error
def validate_fmu(
    mechanism: Mechanism,
    path: Path,
    *,
    stop_time: float | None = None,
    tolerance: float | None = None,
    inputs: Trajectory | None = None,
    hold: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Report:
    """Compare the FMU ``path`` with the direct integration of ``mechanism`` from 0 to ``stop_time`` (s).

    ``inputs`` (SI units) drive both sides. They are linear between their times; they are held during a step with
    ``hold``, or if they move a target (``moves_a_target``). ``tolerance`` is the relative one of the FMU's solver;
    ``progress`` is told the share that is done. Raises SimulationError if either side fails; differences are reported,
    not raised. Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, section I.14,
    for how neighbouring solutions, and hence errors, grow apart.
    """
    mechanism, experiment = with_derived(mechanism), mechanism.experiment
    hold = hold or not takes_derivatives(description_of(path)) or moves_a_target(mechanism, inputs)
    stop_time = experiment.stop_time if stop_time is None else stop_time
    check_times(stop_time, min(experiment.step, stop_time))
    tolerance = experiment.tolerance if tolerance is None else check_tolerance(tolerance)
    task = Task(mechanism, path, stop_time, tolerance, inputs, hold)
    found = problems(path)
    checks = [Check("findings of fmpy's validation", float(len(found)), 0.0, "; ".join(found)[:200])]
    references = _References(task, progress or (lambda share: None))
    runs: dict[str, Trajectory] = {}
    warnings: dict[str, list[str]] = {}
    for label, kind, step, events in _plan(task):
        reference = references.of(step)
        runs[label] = run = _run(task, kind, step, events, warnings.setdefault(label, []).append)
        if step <= horizon_of(task, reference) * (1 + 1e-9):  # beyond that only the start could be compared
            checks.append(compare(task, label, run, reference))
        if (kind, step, events) == ("co-simulation", task.steps[1], False):
            energy = energy_checks(task, run, reference)
            analysis, analysis_notes = _analysis(task, run, reference)
    windows = windows_after(task, references.of(task.steps[1]), references.window)
    checks += [
        *extent_check(task, reference, windows),
        *extent(task, reference, horizon_of(task, reference)),
        *energy,
        *analysis,
        *constraint_checks(task, runs, reference),
        *_laws_checks(task, runs, references),
        *([] if has_rows(task.mechanism) else pointwise_checks(task, reference)),
    ]
    bar, own = SAFETY * task.tolerance / 10, "of runs at two tolerances; growth taken out"
    checks.append(Check("direct integration, own error", own_error(task, reference), bar, own))
    notes = filter(None, [extent_note(task, reference, windows)])
    return Report(
        title=f"{mechanism.title}: FMU against direct integration, {task.stop_time:g} s, tolerance {task.tolerance:g}",
        checks=tuple(checks),
        notes=(*_notes(task, reference), *notes, *analysis_notes, *_solver_notes(task, warnings)),
        coordinates=tuple(c.name for c in mechanism.coordinates),
        trajectories={DIRECT: reference.trajectory, **runs},
        units=display_units(mechanism),
    )


def _plan(task: Task) -> list[tuple[str, Kind, float, bool]]:
    """(label, kind, communication step in s, whether by event mode with early return) of the runs of the FMU."""
    middle = task.steps[1]
    plan: list[tuple[str, Kind, float, bool]]
    plan = [(f"co-simulation, step {step:.3g} s", "co-simulation", step, False) for step in task.steps]
    if has_event_mode(task.path):
        plan.append((f"co-simulation with event mode, step {middle:.3g} s", "co-simulation", middle, True))
    if offers_model_exchange(task.path):
        plan.append(("model exchange, CVode of fmpy", "model-exchange", middle, False))
    return plan


class _References:
    """The direct integrations: one for all communication steps, or one for each where inputs are held during them."""

    def __init__(self, task: Task, progress: Callable[[float], None]) -> None:
        self._task, self._progress = task, progress
        self._found: dict[float, Reference] = {}
        self._count = len(task.steps) if task.holds else 1
        self._rtol = max(1e-13, min(1e-10, 1e-3 * task.tolerance))

    def of(self, step: float) -> Reference:
        """The direct integration for a communication ``step`` (s)."""
        task = self._task
        step = step if task.holds else task.steps[-1]
        if step not in self._found:
            done = len(self._found)

            def reached(share: float) -> None:
                self._progress(SHARE * (done + share) / self._count)

            grid, driving = task.grid(step), task.driving(step)
            self._found[step] = integrate(task.mechanism, grid, inputs=driving, rtol=self._rtol, progress=reached)
        return self._found[step]

    def window(self, times: Floats, starts: Mapping[str, float]) -> Reference:
        """The direct integration at ``times`` (k,), in s, with the states ``starts`` {name: SI value} at the first."""
        task = self._task
        driving = task.driving(task.steps[1])
        return integrate(task.mechanism, times, starts=starts, inputs=driving, rtol=self._rtol, whole=task.stop_time)


def _run(task: Task, kind: Kind, step: float, events: bool, warned: Callable[[str], None]) -> Trajectory:
    """One run of the FMU, whose warnings go to ``warned``.

    CVode gets a hundredth of the tolerance, for its global errors exceed its local ones.
    """
    outputs = [*task.states, *(names.acceleration(c.name) for c in task.mechanism.coordinates), "generalized_energy"]
    outputs += [names.residual(c.name) for c in task.mechanism.constraints]
    outputs += row_outputs(task.mechanism)
    tolerance = task.tolerance if kind == "co-simulation" else max(task.tolerance / 100, 1e-13)
    options = Run(
        stop_time=task.stop_time,
        step=step,
        tolerance=tolerance,
        inputs=task.inputs,
        hold=task.hold,
        outputs=outputs,
        kind=kind,
        warned=warned,
        events=events,
    )
    try:
        return simulate_fmu(task.path, options)
    except SimulationError as error:
        remedy = remedy_of_jumps(task.mechanism)
        raise SimulationError(f"{error}; {remedy}" if remedy else str(error)) from error


# ---------------------------------------------------------------------------------------------------------- what holds


def _laws_checks(task: Task, runs: dict[str, Trajectory], references: _References) -> list[Check]:
    """The checks of the laws of contacts and dry friction, of the runs that share one direct integration."""
    if not has_rows(task.mechanism):
        return []
    reference = references.of(task.steps[1])
    of_it = {label: run for label, run in runs.items() if not task.holds or label.endswith(f"{task.steps[1]:.3g} s")}
    rows = {label: on_grid(reference, run.time) for label, run in of_it.items()}
    return [*row_checks(task, of_it, reference, rows), *law_checks(task)]


def _analysis(task: Task, run: Trajectory, reference: Reference) -> tuple[list[Check], list[str]]:
    """Checks of conserved quantities and of Hamilton's equations, for a run without inputs, and notes."""
    if has_rows(task.mechanism):
        return [], [
            "Conserved quantities and Hamilton's equations are for mechanisms without contacts and dry friction."
        ]
    if task.inputs is not None:
        return [], ["Conserved quantities and Hamilton's equations are compared in runs without inputs only."]
    equations, horizon = derive(task.mechanism), horizon_of(task, reference)
    rows = on_grid(reference, run.time)
    checks, notes = hamilton_checks(equations, reference, horizon, SAFETY * task.tolerance)
    drifts = drift_checks(equations, run, reference, rows, horizon, SAFETY * task.tolerance)
    return [*drifts, *checks], [*notes, action_note(equations, reference)]


def _solver_notes(task: Task, warnings: Mapping[str, Sequence[str]]) -> list[str]:
    """Sentences: which solver is the default of such a mechanism, and the warnings of the FMU in each run."""
    solver, reason = suited_solver(derive(task.mechanism), METHODS)
    suited = [f"Where no solver is asked for, the export takes {solver}: {reason}."] if reason else []
    return suited + [f"The FMU warned, {label}: {text}" for label, texts in warnings.items() for text in texts]


def _notes(task: Task, reference: Reference) -> list[str]:
    amplification = float(reference.amplification[-1])
    notes = [
        "Errors are relative to max(range, nominal) and divided by the amplification of start perturbations, "
        f"which reaches {amplification:.3g}.",
        f"Direct integration: {reference.method} of SciPy, {reference.evaluations} evaluations.",
    ]
    if not offers_model_exchange(task.path):
        notes.append("The FMU offers co-simulation only.")
    return notes
