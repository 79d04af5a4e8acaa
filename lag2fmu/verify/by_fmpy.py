"""Runs by fmpy's own loop: model exchange, other versions of FMI, and outputs that are no numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from lag2fmu.deadline import check_time
from lag2fmu.errors import LoadError
from lag2fmu.verify.co_simulation import Writer
from lag2fmu.verify.hosted import MOST_STEPS
from lag2fmu.verify.instances import Instance, is_fmi3
from lag2fmu.verify.run import Floats, Kind, Plan, Run, first_inputs, whole

FMI_TYPES = {"co-simulation": "CoSimulation", "model-exchange": "ModelExchange"}
_SETTING_UP = ("setupExperiment", "enterInitializationMode")
"""The methods of fmpy that take the tolerance, in FMI 2.0 and 3.0."""


def tolerance_of(instance: Instance, run: Run) -> float | None:
    """The relative tolerance of the run, or else of the default experiment; None if neither has one."""
    experiment = instance.description.defaultExperiment
    if run.tolerance is not None or experiment is None:
        return run.tolerance
    return float(experiment.tolerance or 0.0) or None


def _interval(grid: Floats) -> float:
    """The step (s) of the ``grid`` (k,); where its last step is shorter, the step by which as many reach its end."""
    step, steps, span = float(grid[1] - grid[0]), len(grid) - 1, float(grid[-1] - grid[0])
    return step if np.isclose(steps * step, span, rtol=1e-9) else span / steps


def by_fmpy(instance: Instance, run: Run, plan: Plan) -> tuple[Floats, Floats]:
    """The grid (k,), in s, and the values recorded there, (k, outputs), by fmpy's own loop.

    It serves model exchange, other versions of FMI, and outputs that are no numbers. The loop makes equal steps only:
    where the last one of the plan is shorter, all are made a little shorter. Raises LoadError for inputs of different
    sizes, which fmpy cannot hold.
    """
    import fmpy
    from fmpy import sundials

    description, fmu = instance.description, instance.fmu
    cvode = sundials.CVodeSolver
    sundials.CVodeSolver = partial(cvode, maxNumSteps=MOST_STEPS)  # simulate_fmu has no argument for it
    if plan.pieces is not None:
        fmu.setTime = _driven(instance, run, plan)
    if run.kind == "model-exchange":
        _tell_tolerance(instance, tolerance_of(instance, run))
    constants = _constant_inputs(run, plan)
    start = {**(run.values or {}), **(first_inputs(plan) if plan.pieces is not None else {})}
    recorded = [plan.scalars[name] for name in plan.names]
    try:
        result = fmpy.simulate_fmu(
            instance.folder,
            validate=False,
            start_time=float(plan.grid[0]),
            stop_time=float(plan.grid[-1]),
            output_interval=_interval(plan.grid),
            relative_tolerance=run.tolerance,
            fmi_type=FMI_TYPES[run.kind],
            start_values=whole(start, plan.scalars),
            input=None if plan.held is None else _signals(plan, constants, run.kind),
            output=sorted({s.variable.name for s in recorded}),
            record_events=False,
            step_finished=_progress(run.progress),
            model_description=description,
            fmu_instance=fmu,
        )
    finally:
        sundials.CVodeSolver = cvode
        for name in ("setTime", *_SETTING_UP):
            fmu.__dict__.pop(name, None)
    columns = [result[s.variable.name].reshape(len(result), -1)[:, s.element] for s in recorded]
    return result["time"], np.stack(columns, axis=1)


def _tell_tolerance(instance: Instance, tolerance: float | None) -> None:
    """Let fmpy tell the FMU the relative ``tolerance``: in model exchange it gives it to its own solver alone.

    The FMU needs it too. Impacts that accumulate end where their rebounds are below it.
    """
    setting_up = _SETTING_UP[is_fmi3(instance.description)]
    setattr(instance.fmu, setting_up, partial(getattr(instance.fmu, setting_up), tolerance=tolerance))


def _driven(instance: Instance, run: Run, plan: Plan) -> Callable[[float], None]:
    """fmpy's setTime, which now sets the inputs too, because fmpy's CVode holds them between communication points."""
    fmu, pieces = instance.fmu, plan.pieces
    set_time, names = fmu.setTime, pieces.names  # type: ignore[union-attr]
    if is_fmi3(instance.description):
        set_inputs = Writer(fmu, plan.scalars, names, run.values).write
    else:
        set_inputs = partial(fmu.setReal, [plan.scalars[name].reference for name in names])

    def driven(t: float) -> None:
        set_time(t)
        set_inputs(pieces.values(t))  # type: ignore[union-attr]

    return driven


def _constant_inputs(run: Run, plan: Plan) -> dict[str, float]:
    """{input without a signal: its value}, for fmpy prints a warning for each input that it is not given."""
    given, values = plan.held or (), run.values or {}
    inputs = [s for s in plan.scalars.values() if s.variable.causality == "input" and s.name not in given]
    return {s.name: float(values.get(s.name, s.start or 0.0)) for s in inputs}


def _signals(plan: Plan, constants: Mapping[str, float], kind: Kind) -> Any:
    """The structured array fmpy wants for the inputs that are held, at the communication points.

    fmpy's CVode does not see inputs change between communication points. So it gets stairs: two rows at each point,
    where fmpy restarts the solver. Raises LoadError for inputs of different sizes, which fmpy cannot take.
    """
    held = plan.held
    times, columns = held.time, dict(zip(held.names, held.values.T, strict=True))  # type: ignore[union-attr]
    if kind == "model-exchange":
        times = np.repeat(times, 2)[1:-1]
        columns = {name: np.repeat(x[:-1], 2) for name, x in columns.items()}
    columns |= {name: np.full(len(times), value) for name, value in constants.items()}
    variables = {plan.scalars[name].variable.name: plan.scalars[name].variable for name in columns}
    shapes = {v.name: tuple(getattr(v, "shape", None) or ()) for v in variables.values()}
    if len({*shapes.values()}) > 1:
        raise LoadError("fmpy cannot hold inputs of different sizes in model exchange; export without --arrays")
    table = np.empty(len(times), dtype=[("time", float), *((name, float, shape) for name, shape in shapes.items())])
    table["time"] = times
    for name, column in columns.items():
        scalar = plan.scalars[name]
        table[scalar.variable.name].reshape(len(times), -1)[:, scalar.element] = column
    return table


def _progress(report: Callable[[float], None] | None) -> Callable[[float, object], bool]:
    """What fmpy calls behind each step; it raises OutOfTimeError where the time of the run is over."""

    def finished(time: float, recorder: object) -> bool:
        check_time()
        if report is not None:
            report(time)
        return True

    return finished
