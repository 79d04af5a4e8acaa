"""Running an FMU by fmpy: co-simulation or model exchange (with fmpy's CVode)."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Mapping, Sequence
from ctypes import c_double, c_int, c_uint
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lag2fmu.description.names import acceleration, velocity
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.reference import Pieces, Trajectory, interpolated
from lag2fmu.verify.instances import Instance, description_of, instance_of

Floats = NDArray[np.float64]
Kind = Literal["co-simulation", "model-exchange"]
_FMI_TYPES = {"co-simulation": "CoSimulation", "model-exchange": "ModelExchange"}
_LOGGER = logging.getLogger("lag2fmu")
MOST_STEPS = 100_000
"""The steps that CVode may take from one communication point to the next; its own bound, 500, is for slow motions."""
"""Gets what an FMU warns of; without a handler of the user's it goes to standard error."""


@dataclass(frozen=True)
class Run:
    """What a run is told; what is not given is taken from the FMU's DefaultExperiment.

    ``stop_time``, the communication ``step`` (s), the relative ``tolerance`` of the solver; ``values`` are start values
    of parameters, states and inputs in SI; ``inputs`` are linear between their times, and a motion given by position
    alone is a spline; with ``hold`` they keep their value during a communication step. ``outputs`` are recorded
    (default: all). ``progress`` is called with the time reached, ``warned`` with each warning of the FMU (default: they
    are logged).
    """

    stop_time: float | None = None
    step: float | None = None
    tolerance: float | None = None
    values: Mapping[str, float] | None = None
    inputs: Trajectory | None = None
    hold: bool = False
    outputs: Sequence[str] | None = None
    kind: Kind = "co-simulation"
    progress: Callable[[float], None] | None = None
    warned: Callable[[str], None] | None = None


def simulate_fmu(path: Path, run: Run) -> Trajectory:
    """Run the FMU ``path`` from 0 to the stop time and record the outputs every step, in SI units.

    Between communication points inputs go on by their derivatives, in co-simulation, or as functions of time; an FMU
    that does not take derivatives gets them held. Raises LoadError for unknown names and SimulationError with the FMU's
    own words if the run fails.
    """
    description = description_of(path)
    plan = _planned(description, run)
    warned = run.warned or partial(_LOGGER.warning, "warning: '%s': %s", path.name)
    if plan.held is not None and not run.hold:
        warned("the FMU takes no derivatives of inputs: they are held during each communication step")
    with instance_of(path, _FMI_TYPES[run.kind]) as instance:
        try:
            native = run.kind == "co-simulation" and _is_plain(description, plan.names)
            time, values = (_steps if native else _by_fmpy)(instance, run, plan)
        except Exception as error:  # fmpy raises bare exceptions
            raise SimulationError(f"'{path}': the simulation failed: {error}; {instance.log.tail()}") from error
        for sentence in instance.log.warnings:
            warned(sentence)
        reached, stop = float(time[-1]), float(plan.grid[-1])
        if reached < stop - 1e-9 * max(stop / len(plan.grid), stop):
            raise SimulationError(
                f"'{path}': the simulation stopped at t = {reached:.9g} s of {stop:g} s; {instance.log.tail()}"
            )
    return Trajectory(time, tuple(plan.names), values)


@dataclass(frozen=True)
class _Plan:
    """A run that was checked: ``grid`` of communication points (k,) in s, the ``names`` recorded, the inputs.

    ``pieces`` are the inputs between communication points, None where there are none or they are held.
    """

    grid: Floats
    names: Sequence[str]
    pieces: Pieces | None
    held: Trajectory | None

    @property
    def points(self) -> Floats:
        """The communication points with those between them where inputs have kinks, (m,)."""
        if self.pieces is None:
            return self.grid
        grid, breaks = self.grid, self.pieces.breaks
        nearest = grid[np.searchsorted((grid[1:] + grid[:-1]) / 2, breaks)]
        return np.union1d(grid, breaks[np.abs(breaks - nearest) > 1e-9 * grid[-1]])


def _planned(description: Any, run: Run) -> _Plan:
    """What ``run`` means for an FMU; raises LoadError."""
    stop_time, step = _times(description, run.stop_time, run.step)
    _check_times(stop_time, step)
    all_outputs = [v.name for v in description.modelVariables if v.causality == "output"]
    names = all_outputs if run.outputs is None else list(run.outputs)
    _check_known(names, [v.name for v in description.modelVariables], "variable")
    _check_values(run.values or {}, description)
    grid: Floats = np.minimum(step * np.arange(math.ceil(stop_time / step * (1 - 1e-9)) + 1), stop_time)
    if run.inputs is None:
        return _Plan(grid, names, None, None)
    known = [v.name for v in description.modelVariables if v.causality == "input"]
    _check_known(run.inputs.names, known, "input")
    motions = [name for name in known if {velocity(name), acceleration(name)} <= set(known)]
    pieces = interpolated(run.inputs, motions, stop_time)
    if run.hold or not takes_derivatives(description, run.kind):
        values = np.array([pieces.derivatives(t)[0] for t in grid])
        return _Plan(grid, names, None, Trajectory(grid, pieces.names, values))
    return _Plan(grid, names, pieces, None)


def times_of(path: Path, stop_time: float | None, step: float | None) -> tuple[float, float]:
    """Stop time and communication step (s) of a run of the FMU ``path``, from its DefaultExperiment if not given."""
    return _times(description_of(path), stop_time, step)


def _times(description: Any, stop_time: float | None, step: float | None) -> tuple[float, float]:
    experiment = description.defaultExperiment
    stop = float(getattr(experiment, "stopTime", None) or 1.0) if stop_time is None else stop_time
    return stop, float(getattr(experiment, "stepSize", None) or stop / 500) if step is None else step


def takes_derivatives(description: Any, kind: Kind = "co-simulation") -> bool:
    """Whether inputs can change between communication points: always in model exchange of FMI 2.0."""
    if description.fmiVersion != "2.0":
        return False
    return kind == "model-exchange" or bool(description.coSimulation.canInterpolateInputs)


def _is_plain(description: Any, names: Sequence[str]) -> bool:
    """Whether the steps can be made here: FMI 2.0, and numbers only."""
    kinds = {v.name: v.type for v in description.modelVariables}
    return description.fmiVersion == "2.0" and all(kinds[name] == "Real" for name in names)


# ------------------------------------------------------------------------------------------------------ co-simulation


def _steps(instance: Instance, run: Run, plan: _Plan) -> tuple[Floats, Floats]:
    """Communication step after communication step: the grid (k,) and what is recorded there, (k, outputs)."""
    fmu, component = instance.fmu, instance.fmu.component
    _initialize(instance, run, plan)
    references = {v.name: v.valueReference for v in instance.description.modelVariables}
    set_inputs = _setter(instance, plan, references)
    wanted = (c_uint * len(plan.names))(*(references[name] for name in plan.names))
    buffer = (c_double * len(plan.names))()
    view, points = np.ctypeslib.as_array(buffer), plan.points
    values = np.empty((len(plan.grid), len(plan.names)))
    row = 0
    for i, t in enumerate(points):
        if t == plan.grid[row]:
            if len(plan.names):
                fmu.fmi2GetReal(component, wanted, len(wanted), buffer)
            values[row] = view
            row += 1
            if run.progress is not None:
                run.progress(float(t))
        if i + 1 < len(points):
            set_inputs(float(t))
            fmu.fmi2DoStep(component, float(t), float(points[i + 1] - t), 1)
    return plan.grid, values


def _initialize(instance: Instance, run: Run, plan: _Plan) -> None:
    """Start values, first what comes before the initialization mode."""
    from fmpy.simulation import apply_start_values, settable_in_initialization_mode, settable_in_instantiated

    fmu, description = instance.fmu, instance.description
    tolerance = run.tolerance
    if tolerance is None and description.defaultExperiment is not None:
        tolerance = float(description.defaultExperiment.tolerance or 0.0) or None
    fmu.setupExperiment(tolerance=tolerance, startTime=0.0, stopTime=float(plan.grid[-1]))
    values = {**(run.values or {}), **_first(plan)}
    values = apply_start_values(fmu, description, values, settable=settable_in_instantiated)
    fmu.enterInitializationMode()
    apply_start_values(fmu, description, values, settable=settable_in_initialization_mode)
    fmu.exitInitializationMode()


def _first(plan: _Plan) -> dict[str, float]:
    """The inputs at the start."""
    if plan.pieces is not None:
        return dict(zip(plan.pieces.names, plan.pieces.derivatives(0.0)[0].tolist(), strict=True))
    return {} if plan.held is None else dict(zip(plan.held.names, plan.held.values[0].tolist(), strict=True))


def _setter(instance: Instance, plan: _Plan, references: Mapping[str, int]) -> Callable[[float], None]:
    """What sets the inputs, and their derivatives if they are not held, at the beginning of a step."""
    fmu, component, held = instance.fmu, instance.fmu.component, plan.held
    names = plan.pieces.names if plan.pieces is not None else held.names if held is not None else ()
    k = len(names)
    if not k:
        return lambda t: None
    inputs = (c_uint * k)(*(references[name] for name in names))
    thrice = (c_uint * (3 * k))(*(3 * list(inputs)))
    slack = 1e-9 * float(plan.grid[-1])  # a communication point may be a rounding before a kink
    orders = (c_int * (3 * k))(*np.repeat([1, 2, 3], k).tolist())

    def set_pieces(t: float) -> None:
        found = plan.pieces.derivatives(t, slack)  # type: ignore[union-attr]
        fmu.fmi2SetReal(component, inputs, k, (c_double * k)(*found[0]))
        fmu.fmi2SetRealInputDerivatives(component, thrice, 3 * k, orders, (c_double * (3 * k))(*found[1:].ravel()))

    def set_held(t: float) -> None:
        row = int(np.searchsorted(held.time, t))  # type: ignore[union-attr]
        fmu.fmi2SetReal(component, inputs, k, (c_double * k)(*held.values[row]))  # type: ignore[union-attr]

    return set_held if plan.pieces is None else set_pieces


# ------------------------------------------------------------------------------------------------------------ by fmpy


def _by_fmpy(instance: Instance, run: Run, plan: _Plan) -> tuple[Floats, Floats]:
    """The same by fmpy's own loop: model exchange, other versions of FMI, outputs that are no numbers."""
    import fmpy
    from fmpy import sundials

    description, fmu = instance.description, instance.fmu
    cvode = sundials.CVodeSolver
    sundials.CVodeSolver = partial(cvode, maxNumSteps=MOST_STEPS)  # simulate_fmu has no argument for it
    if plan.pieces is not None:
        fmu.setTime = _driven(instance, plan.pieces)
    constants = _constant_inputs(description, run, plan)
    try:
        result = fmpy.simulate_fmu(
            instance.folder,
            validate=False,
            start_time=0.0,
            stop_time=float(plan.grid[-1]),
            output_interval=float(plan.grid[1]),
            relative_tolerance=run.tolerance,
            fmi_type=_FMI_TYPES[run.kind],
            start_values={**(run.values or {}), **(_first(plan) if plan.pieces is not None else {})},
            input=None if plan.held is None else _signals(plan.held, constants, run.kind),
            output=list(plan.names),
            record_events=False,
            step_finished=None if run.progress is None else _progress(run.progress),
            model_description=description,
            fmu_instance=fmu,
        )
    finally:
        sundials.CVodeSolver = cvode
        fmu.__dict__.pop("setTime", None)
    return result["time"], np.stack([result[name] for name in plan.names], axis=1)


def _driven(instance: Instance, pieces: Pieces) -> Callable[[float], None]:
    """fmpy's setTime that sets the inputs too: its CVode would hold them between communication points."""
    references = {v.name: v.valueReference for v in instance.description.modelVariables}
    set_time, set_real = instance.fmu.setTime, instance.fmu.setReal
    inputs = [references[name] for name in pieces.names]

    def driven(t: float) -> None:
        set_time(t)
        set_real(inputs, pieces.derivatives(t)[0].tolist())

    return driven


def _constant_inputs(description: Any, run: Run, plan: _Plan) -> dict[str, float]:
    """The inputs without a signal, with their values: fmpy prints a warning for each that it is not given."""
    given, values = plan.held or (), run.values or {}
    variables = [v for v in description.modelVariables if v.causality == "input" and v.name not in given]
    return {v.name: float(values.get(v.name, v.start)) for v in variables}


def _signals(inputs: Trajectory, constants: Mapping[str, float], kind: Kind) -> Any:
    """The structured array fmpy wants for ``inputs`` at the communication points.

    fmpy's CVode does not see inputs change between communication points, so that it gets stairs: two rows at each
    point, where fmpy starts it anew.
    """
    times, columns = inputs.time, dict(zip(inputs.names, inputs.values.T, strict=True))
    if kind == "model-exchange":
        times = np.repeat(times, 2)[1:-1]
        columns = {name: np.repeat(x[:-1], 2) for name, x in columns.items()}
    columns |= {name: np.full(len(times), value) for name, value in constants.items()}
    table = np.empty(len(times), dtype=[("time", float), *((name, float) for name in columns)])
    table["time"] = times
    for name, column in columns.items():
        table[name] = column
    return table


def _progress(report: Callable[[float], None]) -> Callable[[float, object], bool]:
    def finished(time: float, recorder: object) -> bool:
        report(time)
        return True

    return finished


# ------------------------------------------------------------------------------------------------------------ checks


def problems(path: Path) -> list[str]:
    """What fmpy's own validation finds in the FMU ``path``, a sentence each."""
    from fmpy.validation import validate_fmu

    return [str(problem) for problem in validate_fmu(str(path))]


def _check_times(stop_time: float, step: float) -> None:
    for label, value in (("stop time", stop_time), ("step", step)):
        if not (math.isfinite(value) and value > 0):
            raise LoadError(f"the {label} {value!r} s is not positive and finite")
    if step > stop_time:
        raise LoadError(f"the step {step!r} s is longer than the stop time {stop_time!r} s")


def _check_known(names: Sequence[str], known: Sequence[str], what: str) -> None:
    unknown = [name for name in names if name not in known]
    if unknown:
        raise LoadError(f"the FMU has no {what} '{unknown[0]}'; there are {', '.join(known)}")


def _check_values(values: Mapping[str, float], description: Any) -> None:
    settable = {v.name: v for v in description.modelVariables if v.start is not None}
    _check_known(list(values), list(settable), "settable variable")
    for name, value in values.items():
        low, high = (float(x) if x is not None else None for x in (settable[name].min, settable[name].max))
        if not math.isfinite(value) or (low is not None and value < low) or (high is not None and value > high):
            bounds = [f"{'below' if x is low else 'above'} {x:g}" for x in (low, high) if x is not None]
            raise LoadError(f"{name} = {value!r} is {' or '.join(['not finite', *bounds])}")
