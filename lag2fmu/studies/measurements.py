"""Measured columns over time, with gaps, as calibration takes them."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from lag2fmu.errors import LoadError
from lag2fmu.language.units import Unit
from lag2fmu.reference.csv_tables import csv_text, parse_table
from lag2fmu.reference.trajectory import Floats, Trajectory
from lag2fmu.studies.fits import Measurement
from lag2fmu.studies.library import INPUT, StudyLibrary
from lag2fmu.studies.requests import continuous_outputs

Data: TypeAlias = "str | os.PathLike[str] | Trajectory | Mapping[str, Any] | Any"
"""A CSV file, a Trajectory, or a mapping or DataFrame with columns by name, among them ``time``; NaN is a gap."""


def measurements_of(data: Data | Sequence[Data], library: StudyLibrary, units: Mapping[str, Unit]) -> list[Measurement]:
    """The experiments in ``data``, one or several; ``units`` are those of columns whose headings name one.

    Raises LoadError for what cannot be read, for columns that are no variables of the ``library``, and for experiments
    in which nothing was measured.
    """
    listed = list(data) if isinstance(data, (list, tuple)) else [data]
    if not listed:
        raise LoadError("there are no measurements; give at least one file")
    return [_measurement(each, i + 1, library, units) for i, each in enumerate(listed)]


def check_times(label: str, time: Floats) -> None:
    """Raise LoadError, called ``label``, unless the ``time`` (m,) in s is finite and increases."""
    if not len(time):
        raise LoadError(f"{label}: there is no row; give at least one")
    gaps, back = np.flatnonzero(~np.isfinite(time)), np.flatnonzero(np.diff(time) <= 0)
    if len(gaps):
        raise LoadError(f"{label}: the time is {time[gaps[0]]:g} in row {gaps[0] + 1}; leave that row out")
    if len(back):
        row = int(back[0]) + 1
        raise LoadError(f"{label}: the time goes from {time[row - 1]:g} s to {time[row]:g} s in row {row + 1}; sort it")


def _measurement(data: Data, number: int, library: StudyLibrary, units: Mapping[str, Unit]) -> Measurement:
    label, time, columns = columns_of(data, number, units)
    check_times(label, time)
    _check_known(label, columns, library)
    driven = {name: column for name, column in columns.items() if library.kinds[name] == INPUT}
    measured = [name for name in columns if name not in driven]
    continuous_outputs(library, measured)
    values = np.stack([columns[name] for name in measured], axis=1) if measured else np.empty((len(time), 0))
    for name, column in zip(measured, values.T, strict=True):
        if np.isinf(column).any():
            row = int(np.flatnonzero(np.isinf(column))[0])
            raise LoadError(
                f"{label}: '{name}' is infinite at {time[row]:g} s; a missing value is NaN or an empty cell"
            )
    if not np.isfinite(values).any():
        raise LoadError(f"{label}: there is no measured value; a column must be named as a variable of the model")
    return Measurement(label, time, tuple(measured), values, inputs_of(label, time, driven))


def _check_known(label: str, columns: Iterable[str], library: StudyLibrary) -> None:
    """Raise LoadError for a column that is no variable of the ``library``."""
    for name in columns:
        if name not in library.variables:
            try:
                library.variable(name)
            except LoadError as error:
                raise LoadError(f"{label}: {error}; remove the column, or give it a name of the model") from None


def inputs_of(label: str, time: Floats, columns: Mapping[str, Floats]) -> Trajectory | None:
    """The ``columns`` {name: (m,)} of inputs over ``time`` (m,), in SI units; None without any.

    Raises LoadError for one with gaps; ``label`` says where.
    """
    for name, column in columns.items():
        if not np.isfinite(column).all():
            row = int(np.flatnonzero(~np.isfinite(column))[0])
            raise LoadError(f"{label}: the input '{name}' has no value at {time[row]:g} s; inputs may have no gaps")
    return Trajectory.of(time, columns) if columns else None


def columns_of(data: Data, number: int, units: Mapping[str, Unit]) -> tuple[str, Floats, dict[str, Floats]]:
    """A label, the times (m,) and {name: column (m,)} of one experiment, in SI units.

    Raises LoadError for what cannot be read, and for columns of another length than the times.
    """
    if isinstance(data, (str, os.PathLike)):
        names, table = parse_table(csv_text(data), str(data), units, gaps=True)
        return Path(data).name, table[:, 0], dict(zip(names, table[:, 1:].T, strict=True))
    label = f"experiment {number}"
    if isinstance(data, Trajectory):
        return label, data.time, {name: data[name] for name in data.names}
    found = _arrays(data, label)
    time = found.pop("time")
    for name, column in found.items():
        if column.shape != time.shape or time.ndim != 1:
            raise LoadError(f"{label}: the column '{name}' has shape {column.shape}, the times have {time.shape}")
    return label, time, found


def _arrays(data: Any, label: str) -> dict[str, Floats]:
    """The columns of a mapping or a DataFrame, which may have the time as index; raises LoadError for anything else."""
    if hasattr(data, "columns") and hasattr(data, "to_numpy"):
        index = {} if "time" in data.columns else {"time": data.index.to_numpy()}
        data = {**index, **{str(name): data[name].to_numpy() for name in data.columns}}
    if not isinstance(data, Mapping) or "time" not in data:
        raise LoadError(f"{label}: a {type(data).__name__} without a column 'time' is no measurement")
    try:
        return {str(name): np.asarray(column, dtype=float) for name, column in data.items()}
    except (TypeError, ValueError) as error:
        raise LoadError(f"{label}: a column has no numbers: {error}") from error
