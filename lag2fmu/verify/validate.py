"""The FMU against the direct integration of the same mechanism, on paths that share nothing but the record.

``agreement`` explains the bars, ``comparison`` how the rest of a chaotic run is compared.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np

from lag2fmu.checking.schema import problems
from lag2fmu.deadline import LIMIT, OutOfTimeError, within
from lag2fmu.dynamics.lagrange import derive, with_derived
from lag2fmu.errors import ExportError
from lag2fmu.fmu.contents import read_mechanism
from lag2fmu.fmu.deriving import chosen_solver
from lag2fmu.fmu.exported import Model, fmu_path, is_fmu
from lag2fmu.fmu.exporting import as_fmu
from lag2fmu.formats.loading import as_mechanism
from lag2fmu.mechanism.display import display_units
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.progress import reached, telling
from lag2fmu.reference.direct_integration import remedy_of_jumps
from lag2fmu.reference.initial_value_problem import prepare
from lag2fmu.reference.integrated import Reference
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify import time_stepping
from lag2fmu.verify.agreement import has_rows, horizon_of, most_left_out, on_grid
from lag2fmu.verify.balances import constraint_checks, energy_checks
from lag2fmu.verify.comparison import Windows, beyond, compare, extent_check, extent_note, own_check
from lag2fmu.verify.fmu_runs import by_sharper_run, ended, planned, run_of
from lag2fmu.verify.hybrid import extent, row_checks
from lag2fmu.verify.inputs import Inputs, trajectory_of
from lag2fmu.verify.instances import description_of, offers_model_exchange
from lag2fmu.verify.invariants import analysis_checks
from lag2fmu.verify.law_checks import law_checks
from lag2fmu.verify.plan import check_limit, check_tolerance, checked_stop, input_orders, times_of
from lag2fmu.verify.pointwise import pointwise_checks
from lag2fmu.verify.references import References
from lag2fmu.verify.report import Check, Report
from lag2fmu.verify.task import Task, moves_a_target

DIRECT = "direct integration"


@telling("validating")
def validate(  # noqa: PLR0913 (a run, the choices of an export, a bound)
    model: Model,
    *,
    stop_time: float | None = None,
    tolerance: float | None = None,
    values: Mapping[str, float] | None = None,
    inputs: Inputs | None = None,
    hold: bool = False,
    solver: str | None = None,
    fmi: str = "2.0",
    limit: float = LIMIT,
    progress: Callable[[float], None] | None = None,
) -> Report:
    """Compare the FMU of ``model`` with the direct integration of its mechanism until ``stop_time`` (s).

    An FMU of lag2fmu carries its mechanism inside. For a model that is no FMU yet, ``values`` are parameters and start
    values in SI units, and ``solver`` and ``fmi`` are choices of its export. ``tolerance`` is the relative one of the
    FMU's solver. ``inputs`` and ``hold`` are those of ``simulate``. ``limit`` is the CPU time, in s, of the direct
    integrations, to which the runs of the FMU come, and of its model exchange; where it is over, the report says until
    when was compared, and gives no judgement if that is too little. ``progress`` is told the share that is done, 0 to
    1. Raises Lag2FmuError if one side cannot be run, ExportError for values and choices of an FMU, LoadError for a
    limit that is no time; differences are reported, not raised. Source: E. Hairer, S. P. Norsett, G. Wanner, Solving
    Ordinary Differential Equations I, section I.14.
    """
    if is_fmu(model) and (values or fmi != "2.0"):
        raise ExportError(f"'{fmu_path(model)}' is an FMU: values= and fmi= belong to its export; give the model")
    source = model if is_fmu(model) else as_mechanism(model, values)
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
            limit=limit,
            progress=progress or reached,
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
    limit: float = LIMIT,
    progress: Callable[[float], None] | None = None,
) -> Report:
    """Compare the FMU ``path`` with the direct integration of ``mechanism`` from 0 to ``stop_time`` (s).

    ``inputs`` (SI units) drive both sides. They are linear between their times; they are held during a step with
    ``hold``, or if they move a target (``moves_a_target``). ``tolerance`` is the relative one of the FMU's solver;
    ``limit`` and ``progress`` are those of ``validate``. Raises LoadError for a time or a tolerance that cannot be, and
    SimulationError if either side fails; differences are reported, not raised. Source: E. Hairer, S. P. Norsett, G.
    Wanner, Solving Ordinary Differential Equations I, section I.14, for how neighbouring solutions, and hence errors,
    grow apart.
    """
    step, experiment = time_stepping.own_step(mechanism, path), mechanism.experiment
    stepped = time_stepping.as_stepped(mechanism) if step else mechanism
    exchanged = with_derived(mechanism)
    mechanism = exchanged if stepped is mechanism else with_derived(stepped)
    hold = hold or not input_orders(description_of(path)) or moves_a_target(mechanism, inputs)
    stop_time = checked_stop(experiment, stop_time)
    tolerance = experiment.tolerance if tolerance is None else check_tolerance(tolerance)
    task = Task(mechanism, path, stop_time, tolerance, inputs, hold, check_limit(limit), step)
    checks = [_findings(path)]
    references = References(task, progress or (lambda share: None))
    located = references if mechanism is exchanged else References(replace(task, mechanism=exchanged), lambda _: None)
    if remedy_of_jumps(mechanism):  # a jump that nothing passes ends the FMU at once, and the integration never
        _, kind, step, events = planned(task)[1]
        run_of(task, kind, step, events, lambda sentence: None)
    lacking = references.lacking() or located.lacking()
    if lacking:
        return _not_compared(task, checks, lacking)
    return _compared(task, references, located, checks)


def _compared(own: Task, references: References, located: References, checks: list[Check]) -> Report:
    """The report on the FMU of the task ``own``, with the ``checks`` made so far, beside its direct integrations.

    Those for model exchange, which locates impacts also where co-simulation steps over them, are ``located``.
    """
    task = time_stepping.sharpened(own, [*map(references.of, own.steps)])
    runs: dict[str, Trajectory] = {}
    of_law: dict[str, Trajectory] = {}
    warnings: dict[str, list[str]] = {}
    for label, kind, step, events in planned(task):
        beside = located if kind == "model-exchange" else references
        reference = time_stepping.as_seen(task, beside.of(step), kind)
        end = float(reference.trajectory.time[-1])
        needed = ended(task, step, end) if kind == "model-exchange" else task  # which takes longest by far
        try:
            with within(task.limit if kind == "model-exchange" else math.inf):
                run = run_of(needed, kind, step, events, warnings.setdefault(label, []).append)
        except OutOfTimeError:
            detail = f"the run does not end in {task.limit:g} s of CPU time; give a longer --limit"
            checks.append(Check(f"{label}, share not compared", 1.0, most_left_out(task), detail, extent=True))
            continue
        runs[label] = run = run.until(end)
        of_law |= {label: run} if beside is references else {}
        if task.states and step <= horizon_of(task, reference) * (1 + 1e-9):  # else the start alone
            check = compare(task, label, run, reference)
            checks.append(by_sharper_run(task, check, kind, step, events, reference))
        if (kind, step, events) == ("co-simulation", task.steps[1], False):
            energy = energy_checks(task, run, reference)
            analysis, analysis_notes = analysis_checks(task, run, reference, references.budget)
    direct = references.of(task.steps[1])
    reference, windows = time_stepping.as_seen(task, direct), beyond(task, direct, references.window)
    checks += [
        *extent_check(task, reference, windows),
        *extent(task, reference, horizon_of(task, reference), windows),
        *energy,
        *analysis,
        *constraint_checks(task, runs, reference),
        *_laws_checks(task, of_law, references),
        *([] if has_rows(task.mechanism) else pointwise_checks(task, reference)),
        own_check(task, direct),
    ]
    return Report(
        title=_title(task),
        checks=tuple(checks),
        notes=(
            *_notes(task, reference, windows),
            *analysis_notes,
            *_solver_notes(task, warnings),
            *time_stepping.own_step_notes(own, direct, run_of),
        ),
        coordinates=tuple(c.name for c in task.mechanism.coordinates),
        trajectories={DIRECT: reference.trajectory, **runs},
        units=display_units(task.mechanism),
    )


def _findings(path: Path) -> Check:
    """The check of what fmpy finds in the FMU ``path``."""
    found = problems(path)
    return Check("findings of fmpy's validation", float(len(found)), 0.0, "; ".join(found)[:200])


def _title(task: Task) -> str:
    what = f"{task.mechanism.title}: FMU against direct integration"
    return f"{what}, {task.stop_time:g} s, tolerance {task.tolerance:g}"


def _not_compared(task: Task, checks: list[Check], lacking: str) -> Report:
    """The report on an FMU where the direct integration is ``lacking``, as this phrase says.

    The FMU runs all the same, and is held against the laws of contacts and dry friction where there are any.
    """
    label, kind, step, events = planned(task)[1]
    warned: list[str] = []
    run = run_of(task, kind, step, events, warned.append)
    detail = f"the direct integration {lacking}"
    extent = Check("trajectories, share not compared", 1.0, most_left_out(task), detail, extent=True)
    return Report(
        title=_title(task),
        checks=(*checks, extent, *law_checks(task)),
        notes=tuple(_solver_notes(task, {label: warned})),
        coordinates=tuple(c.name for c in task.mechanism.coordinates),
        trajectories={label: run},
        units=display_units(task.mechanism),
    )


# ---------------------------------------------------------------------------------------------------------- what holds


def _laws_checks(task: Task, runs: dict[str, Trajectory], references: References) -> list[Check]:
    """The checks of the laws of contacts and dry friction, of the runs that share one direct integration."""
    if not has_rows(task.mechanism):
        return []
    reference = time_stepping.as_seen(task, references.of(task.steps[1]))
    of_it = {label: run for label, run in runs.items() if not task.holds or label.endswith(f"{task.steps[1]:.3g} s")}
    rows = {label: on_grid(reference, run.time) for label, run in of_it.items()}
    return [*row_checks(task, of_it, reference, rows), *law_checks(task)]


def _solver_notes(task: Task, warnings: Mapping[str, Sequence[str]]) -> list[str]:
    """Sentences: which solver is the default of such a mechanism, what the FMU's own does, and the FMU's warnings."""
    solver, choice, _ = chosen_solver(derive(task.mechanism), None)
    suited = [f"Where no solver is asked for, the export takes {solver}: {choice}."] if choice else []
    warned = [f"The FMU warned, {label}: {text}" for label, texts in warnings.items() for text in texts]
    return [*suited, *time_stepping.order_notes(task), *warned]


def _notes(task: Task, reference: Reference, windows: Windows) -> list[str]:
    notes = [
        "Errors are relative to max(range, nominal) and divided by the amplification of start perturbations, "
        f"which reaches {float(reference.amplification[-1]):.3g}.",
        f"Direct integration: {reference.method} of SciPy, {reference.evaluations} evaluations.",
    ]
    notes += [] if offers_model_exchange(task.path) else ["The FMU offers co-simulation only."]
    return [*notes, *filter(None, [extent_note(task, reference, windows)])]
