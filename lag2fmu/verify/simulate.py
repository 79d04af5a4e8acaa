"""Running an FMU by fmpy: co-simulation or model exchange (with fmpy's CVode). The only module that uses fmpy."""

from __future__ import annotations

import logging
import math
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lag2fmu.description.names import acceleration, velocity
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.fmu.pack import DESCRIPTION, opened
from lag2fmu.reference import Trajectory

Floats = NDArray[np.float64]
Kind = Literal["co-simulation", "model-exchange"]
_FMI_TYPES = {"co-simulation": "CoSimulation", "model-exchange": "ModelExchange"}
_WARNING, _OK = 1, 0
_LOGGER = logging.getLogger("lag2fmu")
"""Gets what an FMU warns of; without a handler of the user's it goes to standard error."""


class _Log:
    """Collects what the FMU says; its last sentences go into the error if a run fails."""

    def __init__(self) -> None:
        self.sentences: list[str] = []
        self.warnings: list[str] = []

    def __call__(self, environment: object, instance: bytes, status: int, category: bytes, message: bytes) -> None:
        """The logger of FMI 2.0.5, section 2.1.5; sentences below a warning are dropped."""
        if status > _OK:
            self.sentences.append(message.decode("utf-8", "replace"))
        if status == _WARNING:
            self.warnings.append(self.sentences[-1])

    def tail(self) -> str:
        return " | ".join(self.sentences[-3:]) or "the FMU gave no reason"


def simulate_fmu(  # noqa: PLR0913 (what fmpy can be told)
    path: Path,
    *,
    stop_time: float | None = None,
    step: float | None = None,
    tolerance: float | None = None,
    values: Mapping[str, float] | None = None,
    inputs: Trajectory | None = None,
    outputs: Sequence[str] | None = None,
    kind: Kind = "co-simulation",
    progress: Callable[[float], None] | None = None,
    warned: Callable[[str], None] | None = None,
) -> Trajectory:
    """Run the FMU ``path`` from 0 to ``stop_time`` (s) and record ``outputs`` (default: all) every ``step`` (s).

    ``step`` is the communication step of co-simulation; ``values`` are start values of parameters, states and inputs
    in SI; ``inputs`` is interpolated linearly and held constant during a communication step; ``progress`` is called
    with the time reached, ``warned`` with each warning of the FMU (default: they are logged). What is not given is
    taken from the FMU's DefaultExperiment. Raises LoadError for unknown names and SimulationError with the FMU's own
    words if the run fails.
    """
    import fmpy

    description = _description(path)
    experiment = description.defaultExperiment
    stop_time = float(experiment.stopTime or 1.0) if stop_time is None else stop_time
    step = float(experiment.stepSize or stop_time / 500) if step is None else step
    _check_times(stop_time, step)
    all_outputs = [v.name for v in description.modelVariables if v.causality == "output"]
    names = all_outputs if outputs is None else list(outputs)
    _check_known(names, [v.name for v in description.modelVariables], "variable")
    _check_values(values or {}, description)
    signals = None
    if inputs is not None:
        _check_inputs(inputs, description)
        points = np.minimum(step * np.arange(math.ceil(stop_time / step * (1 - 1e-9)) + 1), stop_time)
        signals = _signals(inputs, _constant_inputs(description, values or {}, inputs), points, kind)
    log = _Log()
    try:
        with _unpacked(path) as folder:
            result = fmpy.simulate_fmu(
                folder,
                validate=False,
                start_time=0.0,
                stop_time=stop_time,
                output_interval=step,
                relative_tolerance=tolerance,
                fmi_type=_FMI_TYPES[kind],
                start_values=dict(values or {}),
                input=signals,
                output=names,
                record_events=False,
                debug_logging=True,
                logger=log,
                step_finished=None if progress is None else _progress(progress),
            )
    except Exception as error:  # fmpy raises bare exceptions
        raise SimulationError(f"'{path}': the simulation failed: {error}; {log.tail()}") from error
    for sentence in log.warnings:
        (warned or partial(_LOGGER.warning, "warning: '%s': %s", path.name))(sentence)
    reached = float(result["time"][-1])
    if reached < stop_time - 1e-9 * max(step, stop_time):
        raise SimulationError(
            f"'{path}': the simulation stopped at t = {reached:.9g} s of {stop_time:g} s; {log.tail()}"
        )
    return Trajectory.of(result["time"], {name: result[name] for name in names})


def problems(path: Path) -> list[str]:
    """What fmpy's own validation finds in the FMU ``path``, a sentence each."""
    from fmpy.validation import validate_fmu

    return [str(problem) for problem in validate_fmu(str(path))]


def offers_model_exchange(path: Path) -> bool:
    """Whether the FMU ``path`` can be run in model exchange; an FMU of the python backend cannot."""
    return _description(path).modelExchange is not None


class Instance:
    """An instance in a mode where states can be set, for evaluating the FMU's equations at single states."""

    def __init__(self, unit: Any, description: Any, log: _Log) -> None:
        self._unit, self._log = unit, log
        self._references = {v.name: v.valueReference for v in description.modelVariables}

    def evaluate(self, values: Mapping[str, float], names: Sequence[str]) -> Floats:
        """Set ``values`` (states, inputs and parameters, SI) and get ``names``: (len(names),)."""
        try:
            self._unit.setReal([self._references[name] for name in values], list(values.values()))
            return np.array(self._unit.getReal([self._references[name] for name in names]))
        except Exception as error:  # fmpy raises bare exceptions
            raise SimulationError(f"the FMU could not be evaluated: {error}; {self._log.tail()}") from error


@contextmanager
def instance(path: Path) -> Iterator[Instance]:
    """An ``Instance`` of the FMU ``path``, freed at the end; raises SimulationError if it cannot be made.

    In continuous-time mode of model exchange or, where the FMU has none, in initialization mode of co-simulation.
    """
    from fmpy.simulation import instantiate_fmu

    description, log = _description(path), _Log()
    with _unpacked(path) as folder:
        try:
            kind = "ModelExchange" if description.modelExchange is not None else "CoSimulation"
            unit = instantiate_fmu(folder, description, kind, logger=log, debug_logging=True)
        except Exception as error:  # fmpy raises bare exceptions
            raise SimulationError(f"'{path}': cannot be instantiated: {error}; {log.tail()}") from error
        try:
            unit.setupExperiment(startTime=0.0)
            unit.enterInitializationMode()
            if kind == "ModelExchange":
                unit.exitInitializationMode()
                unit.newDiscreteStates()
                unit.enterContinuousTimeMode()
            yield Instance(unit, description, log)
        finally:
            unit.freeInstance()


@contextmanager
def _unpacked(path: Path) -> Iterator[str]:
    """A temporary folder with the files of the FMU ``path``, which goes away however a run ends."""
    import fmpy

    with tempfile.TemporaryDirectory(prefix="lag2fmu-", ignore_cleanup_errors=True) as folder:
        fmpy.extract(str(path), folder)
        yield folder


# ----------------------------------------------------------------------------------------------------------- checks


def _description(path: Path) -> Any:
    import fmpy

    from lag2fmu.fmu.xml_tree import parse

    try:
        with opened(path) as archive:
            parse(archive.read(DESCRIPTION), DESCRIPTION)  # refuses what would take all memory
        return fmpy.read_model_description(str(path), validate=False)
    except LoadError:
        raise
    except Exception as error:  # fmpy raises bare exceptions
        raise LoadError(f"'{path}': is no FMU that can be read: {error}") from error


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


def _check_inputs(inputs: Trajectory, description: Any) -> None:
    """Raise LoadError for a signal that is no input, and for a motion without its derivatives."""
    known = [v.name for v in description.modelVariables if v.causality == "input"]
    _check_known(inputs.names, known, "input")
    for name in known:
        motion = [name, velocity(name), acceleration(name)]
        if set(motion) <= set(known):
            given = [n for n in motion if n in inputs]
            if given and len(given) < len(motion):
                missing = ", ".join(n for n in motion if n not in inputs)
                raise LoadError(
                    f"the inputs give {', '.join(given)} but not {missing}; a motion input needs all three columns"
                )


def _constant_inputs(description: Any, values: Mapping[str, float], inputs: Trajectory) -> dict[str, float]:
    """The inputs without a signal, with their values: fmpy prints a warning for each that it is not given."""
    variables = [v for v in description.modelVariables if v.causality == "input" and v.name not in inputs]
    return {v.name: float(values.get(v.name, v.start)) for v in variables}


def _signals(inputs: Trajectory, constants: Mapping[str, float], points: Floats, kind: Kind) -> Any:
    """The structured array fmpy wants, for a run with communication ``points`` (s).

    fmpy's CVode does not see inputs change between communication points, so that it gets stairs: two rows at each
    point, where fmpy starts it anew.
    """
    times, columns = inputs.time, dict(zip(inputs.names, inputs.values.T, strict=True))
    if kind == "model-exchange":
        times = np.repeat(points, 2)[1:-1]
        columns = {name: np.repeat(np.interp(points[:-1], inputs.time, x), 2) for name, x in columns.items()}
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
