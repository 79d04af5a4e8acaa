"""Measured data as functions: the record of a table, its file, and its normal form as a grid."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise, product
from pathlib import Path
from typing import Any, NamedTuple

import sympy as sp

from lag2fmu.description.keys import key
from lag2fmu.description.table_files import is_finite, read_table
from lag2fmu.description.values import require_text
from lag2fmu.errors import MechanismError, UnitError
from lag2fmu.language.unit_parser import checked_unit, is_unit
from lag2fmu.language.units import DIMENSIONLESS, Unit
from lag2fmu.language.vocabulary import table_function

INTERPOLATIONS = ("linear", "pchip", "cubic")
OUTSIDE = ("hold", "extrapolate", "error")


class Grid(NamedTuple):
    """The data of a table in SI: the increasing ``axes`` of its one or two arguments, and its ``values``.

    With two arguments, of n0 and n1 points, ``values`` is (n0 n1,), the second argument running fastest.
    """

    axes: tuple[tuple[float, ...], ...]
    values: tuple[float, ...]


@dataclass(frozen=True)
class Table:
    """Measured data as a function NAME(x) or NAME(x, y), for expressions; in Python the table is called itself.

    The data are ``columns``, or those of a CSV ``file``, read when the record is built. Two columns hold one argument
    and the value. Three columns hold two arguments and the value. The value then is either a column of numbers, where
    the rows fill a grid in any order, or a row of values for each entry of the first argument. A file with more than
    three columns is a grid too: its first row holds the second argument, its first column the first one. Numbers are in
    ``units``, one for each column, the value's last; by default in those of the file's heading, as in "omega [rpm],
    torque [N.m]", or else in SI units. ``grid`` holds the data in SI units.
    Raises MechanismError for data that are no function, UnitError for a text that is no unit.
    """

    name: str
    file: str | Path | None = key("file", "A CSV file, beside this one.", default=None, compare=False)
    columns: Sequence[Any] | None = key(
        "columns", "Instead of a file: [[x...], [value...]], or [[x...], [y...], [values...]].", default=None
    )
    units: Sequence[Unit | str] = key(
        "units", "The units of the columns; by default those in the file's heading, or else of SI.", default=()
    )
    interpolation: str = key(INTERPOLATIONS, "Between the points; by default linear.", default="linear")
    outside: str = key(
        OUTSIDE,
        "Beyond the points: the last value, the last piece continued, or an error; by default hold.",
        default="hold",
    )

    grid: Grid = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        where, read = f"tables.{self.name}", None
        self._check_words(where)
        if self.columns is None:
            if self.file is None:
                raise MechanismError(f"{where}: 'columns' are missing; give them, or a CSV 'file'")
            read = read_table(self._path(where), where, is_unit)
            vars(self).update(columns=read.columns, units=self._agreed(read.units, where))
        if isinstance(self.columns, str) or not isinstance(self.columns, Iterable):
            raise MechanismError(f"{where}.columns: expected an array of columns, got {self.columns!r}")
        columns = tuple(_column(column, f"{where}.columns[{i}]") for i, column in enumerate(self.columns))
        if len(columns) not in (2, 3):
            raise MechanismError(f"{where}.columns: {len(columns)} columns; give 2, or 3 for two arguments")
        units = self._units(len(columns), where)
        vars(self).update(columns=columns, units=units)
        vars(self)["grid"] = _grid(columns, units, where)
        self._check_order(where, () if read is None else read.lines)
        if self.interpolation == "pchip" and self.arity == 2:
            raise MechanismError(f"{where}.interpolation: pchip is for one argument; give linear or cubic")

    def _units(self, count: int, where: str) -> tuple[Unit, ...]:
        """The units of the ``count`` columns, or none; raises MechanismError for another number of them."""
        if isinstance(self.units, str) or not isinstance(self.units, Iterable):
            raise MechanismError(f"{where}.units: expected an array of units, got {self.units!r}")
        units = tuple(checked_unit(unit, f"{where}.units") for unit in self.units)
        if units and len(units) != count:
            raise MechanismError(f"{where}.units: {len(units)} units of {count} columns; give one each")
        return units

    def _agreed(self, heading: tuple[str, ...], where: str) -> Sequence[Unit | str]:
        """The units in the ``heading`` of the file, or else ``units``; raises UnitError if these contradict it."""
        found = tuple(checked_unit(text, f"{where}.file: the heading of '{self.file}'") for text in heading)
        if not found or not self.units:
            return found or self.units
        for unit, other in zip(found, self._units(len(found), where), strict=True):
            if (unit.dimension, unit.factor, unit.offset) != (other.dimension, other.factor, other.offset):
                raise UnitError(
                    f"{where}.units: '{other.name}' contradicts the heading of '{self.file}', which has "
                    f"'{unit.name}'; leave 'units' out, or correct one of the two"
                )
        return found

    def _check_order(self, where: str, lines: tuple[int, ...]) -> None:
        """Raise MechanismError for arguments that do not increase; ``lines`` are those of the file, () without one."""
        columns: tuple[Any, ...] = tuple(self.columns or ())
        by_rows = len(columns) == 3 and isinstance(columns[2][0], tuple)
        for i, axis in enumerate(columns[: 2 if by_rows else 1] if by_rows or len(columns) == 2 else ()):
            unit = f" {self.units[i].name}" if self.units else " (SI)"  # type: ignore[union-attr]
            for j, (before, after) in enumerate(pairwise(axis), 1):
                if before < after:
                    continue
                place = f"columns[{i}], entry {j + 1}"
                if lines:
                    place = f"file: line {lines[0] if i else lines[j + by_rows]} of '{self.file}'"
                raise MechanismError(
                    f"{where}.{place}: {after!r}{unit} follows {before!r}{unit}; the arguments have to increase: sort "
                    "the rows, or correct the number"
                )

    def _check_words(self, where: str) -> None:
        """Raise MechanismError for an unknown ``interpolation`` or ``outside``."""
        for known, words in (("interpolation", INTERPOLATIONS), ("outside", OUTSIDE)):
            require_text(getattr(self, known), f"{where}.{known}")
            if getattr(self, known) not in words:
                raise MechanismError(
                    f"{where}.{known}: '{getattr(self, known)}' is unknown; give one of {', '.join(words)}"
                )

    def _path(self, where: str) -> Path:
        """The path of the ``file``; raises MechanismError for what is none."""
        if not isinstance(self.file, (str, Path)):
            raise MechanismError(f"{where}.file: expected the path of a CSV file, got {self.file!r}")
        return Path(self.file)

    @property
    def arity(self) -> int:
        """The number of arguments, 1 or 2."""
        return len(self.grid.axes)

    def __call__(self, *arguments: object) -> sp.Expr:
        """The expression NAME(...) of the ``arguments``."""
        return table_function(self.name)(*map(sp.sympify, arguments))


def _column(column: object, where: str) -> tuple[Any, ...]:
    """``column`` as floats, or as rows of floats; raises MechanismError for anything else."""
    if isinstance(column, (str, bytes)) or not isinstance(column, Iterable):
        raise MechanismError(f"{where}: expected an array of numbers, got {column!r}")
    entries = tuple(column)
    if entries and all(isinstance(entry, Iterable) and not isinstance(entry, str) for entry in entries):
        return tuple(_column(entry, f"{where}[{i}]") for i, entry in enumerate(entries))
    for i, entry in enumerate(entries):
        if isinstance(entry, (bool, str)) or not is_finite(entry):
            raise MechanismError(f"{where}[{i}]: {entry!r} is not a finite number")
    return tuple(float(entry) for entry in entries)


# ------------------------------------------------------------------------------------------------------------- grid


def _grid(columns: tuple[tuple[Any, ...], ...], units: tuple[Unit, ...], where: str) -> Grid:
    """The ``columns`` in SI, checked."""
    converted = [
        _in_si(column, unit) for column, unit in zip(columns, units or (DIMENSIONLESS,) * len(columns), strict=True)
    ]
    by_rows = len(converted) == 3 and any(isinstance(entry, tuple) for entry in converted[2])
    axes, flat = _rows(converted, where) if by_rows else _axes(converted, where)
    for i, axis in enumerate(axes):
        if len(axis) < 2:
            raise MechanismError(f"{where}.columns[{i}]: has {len(axis)} entries; give at least 2")
    return Grid(axes, flat)


def _rows(columns: list[tuple[Any, ...]], where: str) -> tuple[tuple[tuple[float, ...], ...], tuple[float, ...]]:
    """Axes and values of two arguments and a row of values for each entry of the first one."""
    first, second, values = columns
    if len(values) != len(first):
        raise MechanismError(f"{where}.columns[2]: has {len(values)} rows; give {len(first)}, one for each x")
    for i, row in enumerate(values, 1):
        if not isinstance(row, tuple) or len(row) != len(second):
            raise MechanismError(f"{where}.columns[2]: row {i} does not have {len(second)} values, one for each y")
    return (first, second), tuple(value for row in values for value in row)


def _in_si(column: tuple[Any, ...], unit: Unit) -> tuple[Any, ...]:
    return tuple(_in_si(entry, unit) if isinstance(entry, tuple) else unit.to_si(entry) for entry in column)


def _axes(columns: list[tuple[float, ...]], where: str) -> tuple[tuple[tuple[float, ...], ...], tuple[float, ...]]:
    """Axes and values of ``columns`` of equal length; with two arguments the rows fill a grid, in any order."""
    lengths = [len(column) for column in columns]
    if len(set(lengths)) > 1 or any(isinstance(entry, tuple) for column in columns for entry in column):
        raise MechanismError(f"{where}.columns: have {lengths} entries; give as many in each column")
    *arguments, values = columns
    if len(arguments) == 1:
        return (arguments[0],), values
    axes = tuple(tuple(sorted(set(argument))) for argument in arguments)
    found = dict(zip(zip(*arguments, strict=True), values, strict=True))
    for point in product(*axes):
        if point not in found:
            raise MechanismError(f"{where}.columns: there is no value at {point} (SI); the rows have to fill a grid")
    if len(found) != len(values):
        raise MechanismError(f"{where}.columns: {len(values)} rows of {len(found)} different points; give each once")
    return axes, tuple(found[point] for point in product(*axes))
