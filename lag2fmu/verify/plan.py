"""What a run of an FMU is told, and what that means for the FMU: communication points, outputs, inputs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from lag2fmu.description.names import acceleration, velocity
from lag2fmu.errors import LoadError
from lag2fmu.reference.signals import Pieces, interpolated
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.instances import description_of
from lag2fmu.verify.scalars import Scalar, scalars_of

Floats = NDArray[np.float64]
Kind = Literal["co-simulation", "model-exchange"]
POINTS = 500
"""Communication steps of a run for which no usable one is known."""


@dataclass(frozen=True)
class Run:
    """What a run is told; what is not given is taken from the FMU's DefaultExperiment.

    ``stop_time``, the communication ``step`` (s), the relative ``tolerance`` of the solver; ``values`` are start values
    of parameters, states and inputs in SI; ``inputs`` are linear between their times, and a motion given by position
    alone is a spline; with ``hold`` they keep their value during a communication step. ``outputs`` are recorded
    (default: all), and behind them those of ``beside`` that the FMU has. ``progress`` is called with the time reached,
    ``warned`` with each warning of the FMU (default: they are logged). With ``events``, co-simulation by FMI 3.0 uses
    event mode and early return.
    The run begins at ``start_time`` (s), where the ``values`` hold.
    """

    stop_time: float | None = None
    step: float | None = None
    tolerance: float | None = None
    values: Mapping[str, float] | None = None
    inputs: Trajectory | None = None
    hold: bool = False
    outputs: Sequence[str] | None = None
    beside: Sequence[str] = ()
    kind: Kind = "co-simulation"
    progress: Callable[[float], None] | None = None
    warned: Callable[[str], None] | None = None
    events: bool = False
    start_time: float = 0.0


@dataclass(frozen=True)
class Plan:
    """A run that was checked: ``grid`` of communication points (k,) in s, the ``names`` recorded, the inputs.

    ``scalars`` are all numbers of the FMU by name. ``pieces`` are the inputs between communication points, None where
    there are none or they are held.
    """

    grid: Floats
    names: Sequence[str]
    scalars: Mapping[str, Scalar]
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


def _recorded(run: Run, scalars: Mapping[str, Scalar]) -> list[str]:
    """The names of what is recorded."""
    outputs = [s.name for s in scalars.values() if s.variable.causality == "output" and not s.variable.alias]
    found = outputs if run.outputs is None else list(run.outputs)
    return found + [name for name in run.beside if name in scalars and name not in found]


def planned(description: Any, path: Path, run: Run) -> Plan:
    """What ``run`` means for the FMU ``path``; raises LoadError."""
    if run.kind not in (kinds := get_args(Kind)):
        raise LoadError(f"there is no simulation of kind {run.kind!r}; expected {' or '.join(map(repr, kinds))}")
    stop_time, step = _times(description, run.stop_time, run.step)
    _check_times(stop_time - run.start_time, step)
    scalars = scalars_of(description, path)
    names = _recorded(run, scalars)
    _check_known(names, list(scalars), "variable")
    _check_values(run.values or {}, scalars)
    span = stop_time - run.start_time
    grid: Floats = run.start_time + np.minimum(step * np.arange(math.ceil(span / step * (1 - 1e-9)) + 1), span)
    if run.inputs is None:
        return Plan(grid, names, scalars, None, None)
    known = [s.name for s in scalars.values() if s.variable.causality == "input"]
    _check_known(run.inputs.names, known, "input")
    motions = [name for name in known if {velocity(name), acceleration(name)} <= set(known)]
    pieces = interpolated(run.inputs, motions, stop_time)
    if run.hold or not takes_derivatives(description, run.kind):
        values = np.array([pieces.derivatives(t)[0] for t in grid])
        return Plan(grid, names, scalars, None, Trajectory(grid, pieces.names, values))
    return Plan(grid, names, scalars, pieces, None)


def first_inputs(plan: Plan) -> dict[str, float]:
    """The inputs at the start."""
    if plan.pieces is not None:
        return dict(zip(plan.pieces.names, plan.pieces.derivatives(float(plan.grid[0]))[0].tolist(), strict=True))
    return {} if plan.held is None else dict(zip(plan.held.names, plan.held.values[0].tolist(), strict=True))


def times_of(path: Path, stop_time: float | None, step: float | None) -> tuple[float, float]:
    """Stop time and communication step (s) of a run of the FMU ``path``, from its DefaultExperiment if not given.

    Raises LoadError for a file that is no FMU.
    """
    return _times(description_of(path), stop_time, step)


def _times(description: Any, stop_time: float | None, step: float | None) -> tuple[float, float]:
    experiment = description.defaultExperiment
    stop = float(getattr(experiment, "stopTime", None) or 1.0) if stop_time is None else stop_time
    usual = float(getattr(experiment, "stepSize", None) or stop / POINTS)
    return stop, (usual if usual <= stop else stop / POINTS) if step is None else step


def takes_derivatives(description: Any, kind: Kind = "co-simulation") -> bool:
    """Whether inputs can change between communication points: always in model exchange since FMI 2.0.

    In co-simulation by FMI 3.0 an FMU of lag2fmu asks for them; what others do with them is not known.
    """
    if kind == "model-exchange":
        return not description.fmiVersion.startswith("1")
    if description.fmiVersion == "2.0":
        return bool(description.coSimulation.canInterpolateInputs)
    asks = bool(getattr(description.coSimulation, "providesIntermediateUpdate", False))
    return asks and str(description.generationTool or "").startswith("lag2fmu")


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


def _check_values(values: Mapping[str, float], scalars: Mapping[str, Scalar]) -> None:
    settable = {name: scalar.variable for name, scalar in scalars.items() if scalar.start is not None}
    _check_known(list(values), list(settable), "settable variable")
    for name, value in values.items():
        low, high = (float(x) if x is not None else None for x in (settable[name].min, settable[name].max))
        if not math.isfinite(value) or (low is not None and value < low) or (high is not None and value > high):
            bounds = [f"{'below' if x is low else 'above'} {x:g}" for x in (low, high) if x is not None]
            raise LoadError(f"{name} = {value!r} is {' or '.join(['not finite', *bounds])}")
