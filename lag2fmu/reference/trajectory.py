"""The record ``Trajectory``: named columns over time, and its CSV form ``time,name,...``."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lag2fmu.errors import SimulationError
from lag2fmu.language.units import Unit
from lag2fmu.lazy import looked_up
from lag2fmu.reference.csv_tables import check_names, csv_text, parse_table
from lag2fmu.writing import replacing

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Columns over time: ``time`` (m,) in s, strictly increasing; ``names`` (k,); ``values`` (m, k), in SI units.

    The arrays are read-only copies. Raises SimulationError for times that are not increasing, values that are not
    finite, names that stand twice, and shapes that do not fit.
    """

    time: Floats
    names: tuple[str, ...]
    values: Floats

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        time, values = np.array(self.time, dtype=float), np.array(self.values, dtype=float)
        names = tuple(self.names)
        if time.ndim != 1 or values.shape != (len(time), len(names)):
            raise SimulationError(
                f"trajectory: values {values.shape} do not fit times {time.shape} and {len(names)} names"
            )
        if not len(time):
            raise SimulationError("trajectory: there are no times; give at least one")
        check_names(names, "trajectory", SimulationError)
        _check_time(time)
        if not np.isfinite(values).all():
            row, column = np.argwhere(~np.isfinite(values))[0]
            raise SimulationError(
                f"trajectory: '{names[column]}' is {values[row, column]} at time {float(time[row])!r} s"
            )
        for array in (time, values):
            array.setflags(write=False)
        for name, value in (("time", time), ("names", names), ("values", values)):
            object.__setattr__(self, name, value)

    @classmethod
    def of(cls, time: ArrayLike, columns: Mapping[str, ArrayLike]) -> Trajectory:
        """The trajectory with ``columns`` name -> (m,) in SI units, in their order, at the times ``time`` (m,) in s."""
        times = np.asarray(time, dtype=float)
        stacked = [np.broadcast_to(np.asarray(column, dtype=float), times.shape) for column in columns.values()]
        return cls(times, tuple(columns), np.stack(stacked, axis=1) if stacked else np.empty((len(times), 0)))

    def __len__(self) -> int:
        """The number of times m."""
        return len(self.time)

    def __contains__(self, name: object) -> bool:
        """Is there a column ``name``?"""
        return name in self.names

    def __iter__(self) -> Iterator[str]:
        """The names of the columns."""
        return iter(self.names)

    def __getitem__(self, name: str | Sequence[str]) -> Floats:
        """The column ``name`` (m,), or those of k names (m, k), in SI units; raises SimulationError without it.

        The name ``"time"`` gives the times (m,), in s.
        """
        if isinstance(name, str) and name == "time" and name not in self.names:
            return self.time
        return self.columns([name])[:, 0] if isinstance(name, str) else self.columns(name)

    def columns(self, names: Sequence[str]) -> Floats:
        """The columns of the k ``names``, (m, k); raises SimulationError that lists the missing ones."""
        missing = [name for name in names if name not in self.names]
        if missing:
            raise SimulationError(
                f"trajectory: no column '{', '.join(map(str, missing))}'; there are {', '.join(self.names) or 'none'}"
            )
        return self.values[:, [self.names.index(name) for name in names]]

    def without(self, names: Collection[str]) -> Trajectory:
        """The trajectory without the columns ``names``; names that are no columns are ignored."""
        return Trajectory.of(self.time, {name: self[name] for name in self if name not in names})

    def until(self, end: float) -> Trajectory:
        """The trajectory at its times up to ``end`` (s), which rounding (1e-9 of it) may miss."""
        k = int(np.searchsorted(self.time, end + 1e-9 * abs(end), side="right"))
        return Trajectory(self.time[:k], self.names, self.values[:k])

    def interpolated(self, times: ArrayLike) -> Trajectory:
        """The trajectory at ``times`` (m,) in s, linear between its own; raises SimulationError outside of its range.

        The ends may be missed by rounding (1e-9 of the duration).
        """
        wanted = np.asarray(times, dtype=float)
        first, last = float(self.time[0]), float(self.time[-1])
        slack = 1e-9 * max(last - first, abs(last))
        for t in wanted:
            if not first - slack <= t <= last + slack:
                raise SimulationError(
                    f"trajectory: time {float(t)!r} s is outside of its range, {first!r} s to {last!r} s"
                )
        columns = [np.interp(wanted, self.time, column) for column in self.values.T]
        return Trajectory(wanted, self.names, np.stack(columns, axis=1) if columns else np.empty((len(wanted), 0)))

    def __repr__(self) -> str:
        """One line: how many points, from when to when, of what."""
        listed = ", ".join(self.names[:8]) + (f", ... ({len(self.names)})" if len(self.names) > 8 else "")
        return f"<Trajectory: {len(self)} points, {self.time[0]:g} s to {self.time[-1]:g} s, of {listed or 'nothing'}>"

    def _repr_html_(self) -> str:
        """Start, extremes and end of every column, for a notebook."""
        cells = ["<tr><th></th><th>start</th><th>least</th><th>greatest</th><th>end</th></tr>"]
        for name, x in zip(self.names, self.values.T, strict=True):
            numbers = "".join(f"<td>{value:.6g}</td>" for value in (x[0], x.min(), x.max(), x[-1]))
            cells.append(f"<tr><th>{name}</th>{numbers}</tr>")
        caption = f"{len(self)} points, {self.time[0]:g} s to {self.time[-1]:g} s"
        return f"<table><caption>{caption}</caption>{''.join(cells)}</table>"

    def to_pandas(self) -> Any:
        """A DataFrame with the columns over ``time`` (s) as index; raises SimulationError where pandas is missing."""
        pandas = _optional("pandas")
        return pandas.DataFrame(self.values, index=pandas.Index(self.time, name="time"), columns=list(self.names))

    def to_xarray(self) -> Any:
        """A Dataset of variables over the coordinate ``time`` (s); raises SimulationError where xarray is missing."""
        columns = {name: ("time", x) for name, x in zip(self.names, self.values.T, strict=True)}
        return _optional("xarray").Dataset(columns, coords={"time": self.time})

    def plot(self, *names: str) -> Any:
        """A figure of matplotlib: each of ``names`` (default: all) over time, one below the other, in SI units.

        Raises SimulationError for a missing column, or where matplotlib is missing.
        """
        shown = names or self.names
        figure = _optional("matplotlib.figure").Figure(
            figsize=(7, 0.6 + 1.5 * max(1, len(shown))), layout="constrained"
        )
        axes = figure.subplots(max(1, len(shown)), 1, sharex=True, squeeze=False)[:, 0]
        for axis, name in zip(axes, shown, strict=False):
            axis.plot(self.time, self[name])
            axis.set_ylabel(name)
        axes[-1].set_xlabel("time in s")
        return figure

    def animate(self, model: Any, path: str | os.PathLike[str] | None = None) -> Any:
        """The motion of ``model``, a mechanism or what ``load`` takes, as a film that a notebook shows.

        With ``path`` (.gif, .mp4 or .html) the film is written there instead. Raises the errors of ``animate``.
        """
        if path is None:
            return looked_up("lag2fmu.verify.plots.animation", "film")(model, self)
        return looked_up("lag2fmu.verify.plots.animation", "animate")(model, self, path)

    def to_csv(self, units: Mapping[str, Unit] | None = None) -> str:
        """The text ``time,name,...``, one line a time (s); numbers read back to the same bits (at most 17 digits).

        With ``units`` the columns that they name are written in these, with headings ``name [unit]``.
        """
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        shown = [None if units is None else units.get(name) for name in self.names]
        headings = [f"{n} [{u.name}]" if u and u.name else n for n, u in zip(self.names, shown, strict=True)]
        columns = [x if u is None else u.from_si(x) for x, u in zip(self.values.T, shown, strict=True)]
        writer.writerow(["time", *headings])
        writer.writerows([repr(float(x)) for x in row] for row in zip(self.time, *columns, strict=True))
        return text.getvalue()

    def write_csv(self, path: str | os.PathLike[str], units: Mapping[str, Unit] | None = None) -> None:
        """Write ``to_csv(units)`` to ``path``, whole or not at all; raises SimulationError if that cannot be done."""
        try:
            with replacing(path) as new:
                new.write_text(self.to_csv(units), encoding="utf-8", newline="")
        except OSError as error:
            raise SimulationError(f"cannot write '{path}': {error.strerror}; choose another path") from error


def _optional(package: str) -> Any:
    """The ``package``; raises SimulationError that says how to install it."""
    try:
        return import_module(package)
    except ImportError as error:
        name = package.partition(".")[0]
        raise SimulationError(f"{name} is not installed; run 'pip install {name}'") from error


def read_csv(path: str | os.PathLike[str], units: Mapping[str, Unit] | None = None) -> Trajectory:
    """The trajectory in the CSV file ``path``; see ``parse_csv``.

    Raises LoadError with line and column of what is wrong.
    """
    return parse_csv(csv_text(path), str(path), units)


def parse_csv(text: str, where: str = "CSV", units: Mapping[str, Unit] | None = None) -> Trajectory:
    """The trajectory in ``text``, first column ``time``.

    Columns with a heading ``name [unit]`` are in that unit, others in SI units, times in s. ``units`` are those of the
    quantities, where they are known. Raises LoadError starting with ``where`` and the line, also for a unit of another
    kind than that in ``units``.
    """
    names, table = parse_table(text, where, units)
    return Trajectory(table[:, 0], names, table[:, 1:])


def _check_time(time: Floats) -> None:
    if not np.isfinite(time).all():
        raise SimulationError(f"trajectory: time {float(time[~np.isfinite(time)][0])!r} is not finite")
    for i in np.flatnonzero(np.diff(time) <= 0)[:1]:
        raise SimulationError(
            f"trajectory: time {float(time[i + 1])!r} s does not come after {float(time[i])!r} s (row {i + 2})"
        )
