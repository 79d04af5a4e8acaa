"""From the record of a run to its plan for an FMU: communication points, outputs, inputs, all checked."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from numbers import Real
from pathlib import Path
from typing import Any, get_args

import numpy as np

from lag2fmu.description.names import acceleration, velocity
from lag2fmu.description.outputs import Experiment
from lag2fmu.errors import LoadError
from lag2fmu.language.given import check_mapping, check_names, within
from lag2fmu.language.identifiers import suggestion
from lag2fmu.reference.signals import interpolated
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.instances import description_of, is_ours
from lag2fmu.verify.run import Floats, Kind, Plan, Run, Scalar

POINTS = 500
"""The number of communication steps of a run if no usable step is known."""
MOST_POINTS = 20_000_000
"""Communication points of a run, at most: a gigabyte of memory for six variables."""
INPUT_ORDERS = 3
"""The highest order of the derivatives of inputs: signals are cubic between their points."""
ALL = "all"
"""Among outputs: every output and local variable."""
LEAST_TOLERANCE = 2e-15
"""The relative tolerance that rounding allows."""


def recorded(run: Run, scalars: Mapping[str, Scalar]) -> list[str]:
    """The names of what is recorded, where 'all' stands for every output and local variable.

    Raises LoadError for outputs that are no list of names.
    """
    outputs, local = ([s.name for s in scalars.values() if _is_own(s, kind)] for kind in ("output", "local"))
    if run.outputs is not None:
        check_names("outputs", run.outputs)
    found = outputs if run.outputs is None else list(run.outputs)
    if ALL in found and ALL not in scalars:
        found = list(dict.fromkeys([*outputs, *local, *(name for name in found if name != ALL)]))
    return found + [name for name in run.beside if name in scalars and name not in found]


def _is_own(scalar: Scalar, causality: str) -> bool:
    """Is this variable of the FMU of this ``causality``, and no other name of another?"""
    return bool(scalar.variable.causality == causality and not scalar.variable.alias)


def planned(description: Any, scalars: Mapping[str, Scalar], run: Run) -> Plan:
    """The plan of ``run`` for the FMU of this ``description``, whose numbers are ``scalars``.

    Raises LoadError for names, times and values that the FMU cannot take.
    """
    if run.kind not in (kinds := get_args(Kind)):
        raise LoadError(f"there is no simulation of kind {run.kind!r}; expected {' or '.join(map(repr, kinds))}")
    stop_time, step = _times(description, run.stop_time, run.step)
    start = _start(description, run, stop_time)
    check_times(stop_time - start, step)
    if run.tolerance is not None:
        check_tolerance(run.tolerance)
    names = recorded(run, scalars)
    check_known(names, list(scalars), "variable")
    check_values(run.values or {}, scalars)
    span = stop_time - start
    grid: Floats = start + np.minimum(step * np.arange(math.ceil(span / step * (1 - 1e-9)) + 1), span)
    if run.inputs is None:
        return Plan(grid, names, scalars, None, None)
    known = [s.name for s in scalars.values() if s.variable.causality == "input"]
    check_known(run.inputs.names, known, "input")
    motions = [name for name in known if {velocity(name), acceleration(name)} <= set(known)]
    pieces = interpolated(run.inputs, motions, stop_time)
    if run.hold or not input_orders(description, run.kind):
        values = np.array([pieces.values(t) for t in grid])
        return Plan(grid, names, scalars, None, Trajectory(grid, pieces.names, values))
    return Plan(grid, names, scalars, pieces, None)


def _start(description: Any, run: Run, stop: float) -> float:
    """The time (s) at which a run begins that is to end at ``stop`` (s)."""
    start = run.start_time or float(getattr(description.defaultExperiment, "startTime", None) or 0.0)
    if start and not stop > start:
        raise LoadError(f"the stop time {stop:g} s is not after the start time {start:g} s; give a later one")
    return start


def times_of(path: Path, stop_time: float | None, step: float | None) -> tuple[float, float]:
    """Stop time and communication step (s) of a run of the FMU ``path``, from its DefaultExperiment if not given.

    Raises LoadError for a file that is no FMU.
    """
    return _times(description_of(path), stop_time, step)


def _times(description: Any, stop_time: float | None, step: float | None) -> tuple[float, float]:
    experiment = description.defaultExperiment
    for label, value in (("stop time", stop_time), ("step", step)):
        if value is not None and not isinstance(value, Real):
            raise LoadError(f"the {label} {value!r} is no number; give it in s")
    stop = float(getattr(experiment, "stopTime", None) or 1.0) if stop_time is None else stop_time
    usual = float(getattr(experiment, "stepSize", None) or stop / POINTS)
    return stop, (usual if usual <= stop else stop / POINTS) if step is None else step


def input_orders(description: Any, kind: Kind = "co-simulation") -> int:
    """The highest order of the derivatives by which inputs change between communication points; 0 if they do not.

    In model exchange they are set at all times. In co-simulation an FMU of lag2fmu takes all orders, or asks for inputs
    by FMI 3.0. FMI 2.0 has no word for the highest order that is taken: FMUs of Dymola and OpenModelica end the run at
    the second one. Whether FMUs of other tools ask by FMI 3.0 is not known.
    """
    if kind == "model-exchange":
        return 0 if description.fmiVersion.startswith("1") else INPUT_ORDERS
    if description.fmiVersion == "2.0":
        own = INPUT_ORDERS if is_ours(description) else 1
        return own if description.coSimulation.canInterpolateInputs else 0
    asks = bool(getattr(description.coSimulation, "providesIntermediateUpdate", False))
    return INPUT_ORDERS if asks and is_ours(description) else 0


def check_times(stop_time: float, step: float) -> None:
    """Raise LoadError unless 0 < ``step`` <= ``stop_time``, in s, are finite, with no more than MOST_POINTS steps."""
    for label, value in (("stop time", stop_time), ("step", step)):
        if not (math.isfinite(value) and value > 0):
            raise LoadError(f"the {label} {float(value)!r} s is not positive and finite")
    if step > stop_time * (1 + 1e-9):  # a difference of two times is rounded
        raise LoadError(f"the step {float(step)!r} s is longer than the stop time {float(stop_time)!r} s")
    if stop_time / step > MOST_POINTS:
        count = f"{stop_time / step:.3g} steps of {step:g} s in {stop_time:g} s"
        raise LoadError(f"{count} are too many, {MOST_POINTS:g} at most; give a longer step, or an earlier stop time")


def check_tolerance(tolerance: float) -> float:
    """The relative ``tolerance``; raises LoadError for what no solver can meet, and for what asks nothing of it."""
    if not (within(tolerance, least=LEAST_TOLERANCE) and tolerance < 1.0):
        least = f"at least {LEAST_TOLERANCE:g} and below 1, such as 1e-6"
        raise LoadError(f"the tolerance {tolerance!r} is no relative tolerance; give one of {least}")
    return float(tolerance)


def checked_stop(experiment: Experiment, stop_time: float | None, step: float | None = None) -> float:
    """The ``stop_time`` (s), that of the ``experiment`` if it is None.

    Raises LoadError for what is no time, and for a ``step`` (s) that does not fit into it; None is the usual one.
    """
    found = experiment.stop_time if stop_time is None else stop_time
    for label, value in (("stop time", found), ("step", step)):
        if value is not None and not within(value, above=0.0):
            raise LoadError(f"the {label} {value!r} s is not positive and finite")
    check_times(found, min(experiment.step, found) if step is None else step)
    return found


def check_limit(limit: float) -> float:
    """The ``limit`` (s) of a time that something may take; raises LoadError unless it is positive."""
    if not limit > 0:
        raise LoadError(f"the limit {limit!r} s is no time that something may take; give a positive one, such as 60")
    return float(limit)


def check_known(names: Sequence[str], known: Sequence[str], what: str) -> None:
    """Raise LoadError for a name that is not ``known`` of the FMU's numbers of the kind ``what``."""
    unknown = [name for name in names if name not in known]
    if unknown:
        raise LoadError(f"the FMU has no {what} '{unknown[0]}'; {suggestion(unknown[0], known)}")


def check_values(values: Mapping[str, float], scalars: Mapping[str, Scalar]) -> None:
    """Raise LoadError for start ``values`` of unknown names, or beyond what the FMU's ``scalars`` may have."""
    check_mapping("values", values)
    settable = {name: scalar.variable for name, scalar in scalars.items() if scalar.start is not None}
    check_known(list(values), list(settable), "settable variable")
    for name, value in values.items():
        low, high = (float(x) if x is not None else None for x in (settable[name].min, settable[name].max))
        if not isinstance(value, Real):
            raise LoadError(f"{name} = {value!r} is no number; give one in SI units")
        if not math.isfinite(value):
            raise LoadError(f"{name} = {value!r} is not finite; give a finite number")
        if low is not None and value < low:
            raise LoadError(f"{name} = {value!r} is below {low:g}, the least that it may be")
        if high is not None and value > high:
            raise LoadError(f"{name} = {value!r} is above {high:g}, the most that it may be")
