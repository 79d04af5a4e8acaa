"""From the forms in which users give the inputs of a run to a Trajectory."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from lag2fmu.errors import LoadError
from lag2fmu.reference.trajectory import Trajectory, read_csv

Inputs: TypeAlias = (
    "Trajectory | Mapping[str, Any] | Callable[[float], Mapping[str, float]] | str | os.PathLike[str] | Any"
)
"""A Trajectory; the path of a CSV file; a mapping, structured array or DataFrame with columns by name, among them
``time`` (a DataFrame may have it as index); or a function of time that gives a mapping from names to values."""

SAMPLES = 4
"""A function of time is sampled at this many points in a communication step."""


def trajectory_of(inputs: Inputs | None, stop_time: float, step: float) -> Trajectory | None:
    """``inputs`` in SI units over time in s; None for None.

    A function of time is sampled from 0 to ``stop_time`` (s), four times a ``step`` (s). Raises LoadError for inputs of
    another form, and for columns whose shapes are not that of the times, (m,); it names them.
    """
    if inputs is None or isinstance(inputs, Trajectory):
        return inputs
    if isinstance(inputs, (str, os.PathLike)):
        return read_csv(Path(inputs))
    if callable(inputs) and not isinstance(inputs, Mapping):
        return _sampled(inputs, stop_time, step)
    columns = _columns(inputs)
    if "time" not in columns:
        there = ", ".join(map(str, columns)) or "none"
        raise LoadError(f"the inputs have no column 'time'; there are {there}; what is constant goes to values=")
    time = np.asarray(columns.pop("time"), dtype=float)
    for name, column in columns.items():
        if np.shape(column) not in {(), time.shape}:
            raise LoadError(f"the input '{name}' has shape {np.shape(column)}, the times have {time.shape}")
    return Trajectory.of(time, columns)


def _sampled(function: Callable[[float], Mapping[str, float]], stop_time: float, step: float) -> Trajectory:
    times = np.linspace(0.0, stop_time, SAMPLES * max(1, round(stop_time / step)) + 1)
    try:
        samples = [function(float(t)) for t in times]
    except Exception as error:  # whatever the user's function meets
        words = "the function of the inputs, which is asked with the time alone where no sample_time is given, failed"
        raise LoadError(f"{words}: {type(error).__name__}: {error}") from error
    if not all(isinstance(sample, Mapping) and sample.keys() == samples[0].keys() for sample in samples):
        raise LoadError("the function of the inputs must give a mapping {name: value} with the same names at all times")
    return Trajectory.of(times, {name: [sample[name] for sample in samples] for name in samples[0]})


def _columns(inputs: Any) -> dict[str, Any]:
    """Name -> column of a mapping, a structured array, or a DataFrame."""
    if isinstance(inputs, Mapping):
        return dict(inputs)
    if isinstance(inputs, np.ndarray) and inputs.dtype.names:
        return {name: inputs[name] for name in inputs.dtype.names}
    if hasattr(inputs, "to_dict") and hasattr(inputs, "columns"):
        index = {} if "time" in inputs.columns else {"time": inputs.index.to_numpy()}
        return {**index, **{str(name): inputs[name].to_numpy() for name in inputs.columns}}
    raise LoadError(
        f"the inputs are a {type(inputs).__name__}; give a Trajectory, the path of a CSV file, a mapping of arrays, a "
        "structured array, a DataFrame, or a function of time"
    )
