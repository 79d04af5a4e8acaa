"""Running an FMU by fmpy: co-simulation or model exchange (with fmpy's CVode)."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from ctypes import c_double, c_int, c_uint
from dataclasses import replace
from functools import partial
from math import isfinite
from pathlib import Path
from typing import Any, cast

import numpy as np

from lag2fmu.deadline import OutOfTimeError
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.apart import came_through, run_apart, runs_apart
from lag2fmu.verify.by_fmpy import FMI_TYPES, by_fmpy, tolerance_of
from lag2fmu.verify.co_simulation import co_simulation
from lag2fmu.verify.instances import Instance, description_of, instance_of, is_fmi3
from lag2fmu.verify.plan import input_orders, planned
from lag2fmu.verify.remarks import moved_guesses, short_inputs
from lag2fmu.verify.run import Feedback, Floats, Kind, Plan, Run, first_inputs, whole
from lag2fmu.verify.scalars import scalars_of
from lag2fmu.verify.stepping import Simulation, sampled

_INTEGERS = ("Integer", "Enumeration")
_LOGGER = logging.getLogger("lag2fmu")
"""Gets the warnings of FMUs; without a handler of the user they go to standard error."""


def simulate_fmu(path: Path, run: Run) -> Trajectory:
    """Run the FMU ``path`` from its start time to the stop time and record the outputs every step, in SI units.

    Between communication points inputs are continued by their derivatives in co-simulation, and are functions of time
    in model exchange. An FMU that takes no derivatives gets held inputs. The trajectory is (m, outputs). Raises
    LoadError for unknown names, and SimulationError with the FMU's own words if the run fails. FMUs that are no builds
    of lag2fmu, and others in their first run, are in a process of their own, where they may crash. A run with feedback
    is in this process, in which the feedback may keep what it meets. An FMU without co-simulation runs by model
    exchange.
    """
    run = replace(run, warned=run.warned or partial(_LOGGER.warning, "warning: '%s': %s", path.name))
    if run.feedback is not None or not runs_apart(path):
        return _simulated(path, run)
    found = run_apart(path, run, _simulated)
    came_through(path)
    return found


def _simulated(path: Path, run: Run) -> Trajectory:
    """What ``simulate_fmu`` gives, in this process; the warnings are heard by ``run``."""
    description = description_of(path)
    run = replace(run, kind=_kind(path, description, run))
    plan = planned(description, scalars_of(description, path), run)
    warned = run.warned or _LOGGER.warning
    if plan.held is not None and not run.hold:
        warned("the FMU takes no derivatives of inputs: they are held during each communication step")
    asked = followed(plan) if run.kind == "co-simulation" and is_fmi3(description) else ()
    with instance_of(path, FMI_TYPES[run.kind], events=run.events, followed=asked) as instance:
        try:
            time, values = _loop(description, run, plan)(instance, run, plan)
        except (LoadError, OutOfTimeError):  # of what a feedback gives, and of the bound of a run
            raise
        except Exception as error:  # fmpy raises bare exceptions
            raise SimulationError(
                f"'{path.name}': the simulation failed: {str(error).rstrip('.')}; {instance.log.tail()}"
            ) from error
        guesses = {v.name for v in description.modelVariables if v.initial == "approx"}
        start = dict(zip(plan.names, values[0], strict=True))
        remarks = (*moved_guesses(guesses, run.values or {}, start), *short_inputs(run, plan))
        for sentence in (*instance.log.warnings, *remarks):
            warned(sentence)
        reached, stop = float(time[-1]), float(plan.grid[-1])
        if reached < stop - 1e-9 * max(stop / len(plan.grid), stop):
            raise SimulationError(
                f"'{path.name}': the simulation stopped at t = {reached:.9g} s of {stop:g} s; {instance.log.tail()}"
            )
    return Trajectory(time, tuple(plan.names), values)


def _kind(path: Path, description: Any, run: Run) -> Kind:
    """The kind of the ``run``; model exchange where the FMU offers nothing else, unless inputs follow outputs."""
    if run.kind != "co-simulation" or description.coSimulation is not None:
        return run.kind
    if description.modelExchange is None:
        raise LoadError(f"'{path}': offers neither co-simulation nor model exchange, by which FMUs run here")
    if run.feedback is not None:
        raise LoadError(
            f"'{path}': offers no co-simulation, by which controllers run; make it the component of a system"
        )
    return "model-exchange"


def _loop(description: Any, run: Run, plan: Plan) -> Callable[[Instance, Run, Plan], tuple[Floats, Floats]]:
    """The function that makes the steps: one of this package in co-simulation, fmpy's loop in other runs.

    fmpy's loop also runs co-simulation by FMI 2.0 with outputs that are no numbers.
    """
    if run.feedback is not None:
        return _sampled
    kinds = {plan.scalars[name].variable.type for name in plan.names}
    if run.kind == "co-simulation" and is_fmi3(description):
        return _steps3
    plain = description.fmiVersion == "2.0" and kinds <= {"Real", *_INTEGERS}
    return _steps if run.kind == "co-simulation" and plain else by_fmpy


# ------------------------------------------------------------------------------------------------------ co-simulation


def _steps(instance: Instance, run: Run, plan: Plan) -> tuple[Floats, Floats]:
    """Make all communication steps; returns the grid (k,), in s, and the values recorded there, (k, outputs)."""
    fmu, component = instance.fmu, instance.fmu.component
    begin(instance, run, plan)
    fmu.exitInitializationMode()
    references = {v.name: v.valueReference for v in instance.description.modelVariables}
    set_inputs = setter(instance, plan, references)
    recorded, points = recorder(instance, plan, references), plan.points
    values = np.empty((len(plan.grid), len(plan.names)))
    row = 0
    for i, t in enumerate(points):
        if t == plan.grid[row]:
            recorded(values[row])
            row += 1
            if run.progress is not None:
                run.progress(float(t))
        if i + 1 < len(points):
            set_inputs(float(t))
            fmu.fmi2DoStep(component, float(t), float(points[i + 1] - t), 1)
    return plan.grid, values


def _steps3(instance: Instance, run: Run, plan: Plan) -> tuple[Floats, Floats]:
    """The grid (k,), in s, and the values recorded there, (k, outputs), by FMI 3.0."""
    begin(instance, run, plan)
    instance.fmu.exitInitializationMode()
    return co_simulation(instance, run, plan)


def _sampled(instance: Instance, run: Run, plan: Plan) -> tuple[Floats, Floats]:
    """The grid (k,), in s, and the values recorded there, (k, outputs), with inputs by the feedback."""
    initialize(instance, run, plan)
    sim = Simulation(instance, plan.scalars, float(plan.grid[0]))
    return plan.grid, sampled(sim, cast("Feedback", run.feedback), plan, run.progress)


def initialize(instance: Instance, run: Run, plan: Plan) -> None:
    """Set start values and initialize the FMU."""
    begin(instance, run, plan)
    instance.fmu.exitInitializationMode()


def begin(instance: Instance, run: Run, plan: Plan) -> None:
    """Set start values and enter initialization mode; in FMI 2.0 some are set after that."""
    from fmpy.simulation import apply_start_values, settable_in_initialization_mode, settable_in_instantiated

    fmu, description = instance.fmu, instance.description
    tolerance, start, stop = tolerance_of(instance, run), float(plan.grid[0]), _end(plan)
    values = whole({**(run.values or {}), **first_inputs(plan)}, plan.scalars)
    if is_fmi3(description):
        apply_start_values(fmu, description, values, settable=settable_in_instantiated)
        fmu.enterInitializationMode(tolerance=tolerance, startTime=start, stopTime=stop)
        return
    fmu.setupExperiment(tolerance=tolerance, startTime=start, stopTime=stop)
    left = apply_start_values(fmu, description, values, settable=settable_in_instantiated)
    fmu.enterInitializationMode()
    apply_start_values(fmu, description, left, settable=settable_in_initialization_mode)


def _end(plan: Plan) -> float | None:
    """The stop time (s) of a run; None for one without an end that is known."""
    stop = float(plan.grid[-1])
    return stop if isfinite(stop) else None


def followed(plan: Plan) -> tuple[int, ...]:
    """The value references of the inputs that change within a communication step."""
    names = plan.pieces.names if plan.pieces is not None else ()
    return tuple(sorted({plan.scalars[name].reference for name in names}))


def recorder(instance: Instance, plan: Plan, references: Mapping[str, int]) -> Callable[[Floats], None]:
    """A function that writes the present values of the recorded variables into a row (outputs,)."""
    fmu, component = instance.fmu, instance.fmu.component
    kinds = {v.name: v.type for v in instance.description.modelVariables}
    reals = [i for i, name in enumerate(plan.names) if kinds[name] == "Real"]
    others = [i for i in range(len(plan.names)) if i not in reals]
    parts: list[tuple[Callable[..., int], Any, Any, list[int]]] = []
    for get, number, columns in ((fmu.fmi2GetReal, c_double, reals), (fmu.fmi2GetInteger, c_int, others)):
        wanted = (c_uint * len(columns))(*(references[plan.names[i]] for i in columns))
        parts += [(get, wanted, (number * len(columns))(), columns)] if columns else []

    def record(row: Floats) -> None:
        for get, wanted, buffer, columns in parts:
            get(component, wanted, len(wanted), buffer)
            row[columns] = buffer

    return record


def setter(instance: Instance, plan: Plan, references: Mapping[str, int]) -> Callable[[float], None]:
    """A function of t (s) that sets the inputs at the beginning of a step, and their derivatives unless held."""
    fmu, component, held = instance.fmu, instance.fmu.component, plan.held
    names = plan.pieces.names if plan.pieces is not None else held.names if held is not None else ()
    k = len(names)
    if not k:
        return lambda t: None
    inputs = (c_uint * k)(*(references[name] for name in names))
    most, points = input_orders(instance.description), plan.points
    repeated = (c_uint * (most * k))(*(most * list(inputs)))
    slack = 1e-9 * float(plan.grid[-1])  # a communication point may be a rounding before a kink
    orders = (c_int * (most * k))(*np.repeat(np.arange(1, most + 1), k).tolist())

    def set_pieces(t: float) -> None:
        found = plan.pieces.derivatives(t, slack)  # type: ignore[union-attr]
        if most == 1:  # a chord, which meets the next value
            h = float(points[np.searchsorted(points, t + slack)]) - t
            before = plan.pieces.derivatives(t + h - slack)  # type: ignore[union-attr]
            found[1] = (before[0] + slack * before[1] - found[0]) / h
        fmu.fmi2SetReal(component, inputs, k, (c_double * k)(*found[0]))
        told = (c_double * (most * k))(*found[1 : most + 1].ravel())
        fmu.fmi2SetRealInputDerivatives(component, repeated, most * k, orders, told)

    def set_held(t: float) -> None:
        row = int(np.searchsorted(held.time, t))  # type: ignore[union-attr]
        fmu.fmi2SetReal(component, inputs, k, (c_double * k)(*held.values[row]))  # type: ignore[union-attr]

    return set_held if plan.pieces is None else set_pieces
