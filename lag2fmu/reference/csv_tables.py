"""CSV files as tables of numbers: times, names, units in the headings, gaps."""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lag2fmu.description.table_files import name_and_unit
from lag2fmu.errors import LoadError, SimulationError, UnitError
from lag2fmu.language import remedies
from lag2fmu.language.unit_parser import is_unit, parse_unit
from lag2fmu.language.units import SECOND, Unit


def csv_text(path: str | os.PathLike[str]) -> str:
    """The text of the CSV file ``path``; raises LoadError where it cannot be read."""
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise LoadError(f"cannot read '{path}': {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise LoadError(f"'{path}' is no text in UTF-8 (byte {error.start}); save the table as CSV in UTF-8") from error


def parse_table(
    text: str, where: str = "CSV", units: Mapping[str, Unit] | None = None, *, gaps: bool = False
) -> tuple[tuple[str, ...], NDArray[np.float64]]:
    """The names of the columns behind ``time``, and the table (rows, 1 + names) in ``text``, in SI units.

    ``units`` are as for ``parse_csv``. With ``gaps`` an empty cell is a missing value, NaN in the table. Raises
    LoadError with line and column of what is wrong.
    """
    header, table, lines = _parsed(text, where, units, gaps=gaps, first="time")
    check_names(header[1:], f"{where}, line 1", LoadError)
    for i in np.flatnonzero(np.diff(table[:, 0]) <= 0)[:1].tolist():
        jump = ": let a jump take a short time, such as 1e-9 s" if table[i + 1, 0] == table[i, 0] else ""
        raise LoadError(
            f"{where}, line {lines[i + 1]}, column 'time': {float(table[i + 1, 0])!r} s does not come after "
            f"{float(table[i, 0])!r} s; times must increase{jump}"
        )
    return tuple(header[1:]), table


def parse_columns(
    text: str, where: str = "CSV", units: Mapping[str, Unit] | None = None
) -> tuple[tuple[str, ...], NDArray[np.float64]]:
    """The names of all columns, and the table (rows, names) in ``text``, in SI units; no column need be the time.

    Raises LoadError with line and column of what is wrong.
    """
    header, table, _ = _parsed(text, where, units)
    return tuple(header), table


def _parsed(
    text: str, where: str, units: Mapping[str, Unit] | None, *, gaps: bool = False, first: str = ""
) -> tuple[list[str], NDArray[np.float64], list[int]]:
    """The header, the table in SI units, and the line numbers of its rows; ``first`` names the first column."""
    reader = csv.reader(io.StringIO(text, newline=""))
    rows: list[list[float]] = []
    lines: list[int] = []
    try:
        header, own = _headings(next(reader, []), f"{where}, line 1", {} if units is None else units)
        _check_first(header, first, text, f"{where}, line 1")
        for row in reader:
            if not "".join(row).strip() and len(row) <= 1:
                continue  # an empty line
            rows.append(_numbers(row, header, f"{where}, line {reader.line_num}", gaps=gaps))
            lines.append(reader.line_num)
    except csv.Error as error:
        raise LoadError(f"{where}, line {reader.line_num}: {error}") from error
    if not rows:
        raise LoadError(f"{where}: there are no rows below the header; give at least one")
    table = np.array(rows)
    for column, unit in own.items():
        table[:, column] = unit.array_to_si(table[:, column])
    return header, table, lines


def _check_first(header: Sequence[str], first: str, text: str, where: str) -> None:
    """Raise LoadError unless the ``header`` of ``text`` has names, the first of which is ``first`` if it is given."""
    if not header and not first:
        raise LoadError(f"{where}: the names of the columns are missing; begin with a line of them")
    if not header or (first and header[0] != first):
        heading = text.partition("\n")[0]
        commas = "; separate columns by commas" if ";" in heading or "\t" in heading else ""
        found = f"'{header[0]}'" if header else "missing"
        raise LoadError(f"{where}: the first column is {found}, expected 'time' (time,name,...){commas}")


def _headings(cells: Sequence[str], where: str, units: Mapping[str, Unit]) -> tuple[list[str], dict[int, Unit]]:
    """The names in the first line, and the units that stand there: {column: unit}."""
    named = [name_and_unit(cell.strip(), is_unit) for cell in cells]
    own: dict[int, Unit] = {}
    for column, (name, written) in enumerate(named):
        if written is None:
            continue
        try:
            own[column] = unit = parse_unit(written)
        except UnitError as error:
            raise LoadError(f"{where}, column '{name}': {error}") from error
        known = SECOND if name == "time" else units.get(name)
        if known is not None and known.dimension != unit.dimension:
            raise LoadError(f"{where}, column '{name}': '{unit.name}' is no unit of it; it is in {known.name or '1'}")
    return [name for name, _ in named], own


def _numbers(row: Sequence[str], header: Sequence[str], where: str, *, gaps: bool = False) -> list[float]:
    """The finite numbers of ``row``, as many as the header has names; with ``gaps`` an empty cell, or nan, is NaN."""
    if len(row) != len(header):
        raise LoadError(f"{where}: {len(row)} values for {len(header)} columns; {_remedy(row, header)}")
    numbers = [_number(text) for text in row]
    for name, text, number in zip(header, row, numbers, strict=True):
        empty = gaps and name != "time" and text.strip().lower() in {"", "nan"}
        if not (empty or math.isfinite(number)):
            remedy = remedies.of_number(text[:40])
            problem = f"{text[:40]!r} is not a finite number{remedy and f'; {remedy}'}"
            raise LoadError(f"{where}, column '{name}': {problem}")
    return numbers


def _remedy(row: Sequence[str], header: Sequence[str]) -> str:
    """What is to be done about a ``row`` of fewer or more cells than the ``header`` has."""
    if row[0].lstrip().startswith("#"):
        return "leave comments out"
    if len(row) < len(header):
        return f"column '{header[len(row)]}' is missing"
    return "decimals have a point, and columns a comma between them"


def _number(text: str) -> float:
    """The number ``text`` stands for, NaN if it stands for none (Python would read 1_000 too)."""
    try:
        return math.nan if "_" in text else float(text)
    except ValueError:
        return math.nan


def check_names(names: Sequence[str], where: str, error: type[LoadError] | type[SimulationError]) -> None:
    """Raise ``error`` for a name that is empty, stands twice, or is that of the time."""
    for column, name in enumerate(names, start=2):
        if not name:
            raise error(f"{where}: column {column} has no name")
        if name == "time" or names.index(name) != column - 2:
            raise error(f"{where}: the name '{name}' stands twice (column {column}); keep one of the columns")
