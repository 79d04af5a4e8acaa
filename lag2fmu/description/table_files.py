"""CSV files of tables: columns of numbers, their units in the heading, and where each row stands."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from lag2fmu.errors import MechanismError

MAX_FILE = 10_000_000
"""The most bytes of a file with a table."""

_BRACKETS = re.compile(r"(|.*?\S)(?:^|\s+|(?=\[[^\]]*[^\d,\s\]]))\[(.+)\]")
"""A name with its unit at the head of a column: 'omega [rpm]'. 'x[1]', without a blank, is an element of an array."""
_OTHERS = re.compile(r"(.*?\S)\s+(?:\((.+)\)|(?:/|in)\s+(\S.*))")
"""Other ways to write it: 'omega (rpm)', 'omega / rpm', 'omega in rpm', as far as a unit stands there."""
_WORDS = re.compile(r"[^\s\[]+(?:\s+\[[^\]]*\])?")
"""The same where blanks separate the columns."""
Lines = list[tuple[int, list[str]]]
IsUnit = Callable[[str], bool]
"""Whether a text is the name of a unit."""


def name_and_unit(cell: str, is_unit: IsUnit) -> tuple[str, str | None]:
    """The name at the head of a column and its unit, None if none is written there.

    What stands in brackets is meant as a unit, elsewhere only what is one: 'torque (measured)' has none.
    """
    bracketed = _BRACKETS.fullmatch(cell)
    if bracketed is not None:
        return bracketed[1], bracketed[2].strip()
    other = _OTHERS.fullmatch(cell)
    unit = None if other is None else other[2] or other[3]
    return (cell, None) if other is None or unit is None or not is_unit(unit) else (other[1], unit)


class TableFile(NamedTuple):
    """What a CSV file holds: the ``columns`` as of a Table, and the ``units`` of its heading, () if it has none.

    ``lines`` are the numbers of the lines of each row; with a grid, the first line holds the second argument.
    """

    columns: tuple[Any, ...]
    units: tuple[str, ...]
    lines: tuple[int, ...]


def read_table(path: Path, where: str, is_unit: IsUnit) -> TableFile:
    """The CSV file ``path``: commas, semicolons, tabs or blanks, a header if there is one, # comments.

    A comment right above the numbers is a header too if each of its names has a unit. Numbers may stand in quotes.
    Raises MechanismError for a file that cannot be read or holds something else.
    """
    heading, rows = _cells(_text_of(path, where), is_unit)
    if not rows:
        raise MechanismError(f"{where}.file: '{path}' holds no numbers")
    gridded = len(rows[0][1]) > 3 or not is_finite(rows[0][1][0])
    for i, (n, cells) in enumerate(rows):
        fault = _fault(cells[int(gridded and i == 0) :], len(rows[0][1]) - int(gridded and i == 0))
        if fault:
            raise MechanismError(f"{where}.file: line {n} of '{path}' {fault}")
    named = [name_and_unit(cell, is_unit) for cell in heading]
    units = _units(named, len(rows[0][1]), gridded, f"{where}.file: the heading of '{path}'")
    columns = _gridded(rows) if gridded else tuple(zip(*([*map(float, cells)] for _, cells in rows), strict=True))
    return TableFile(columns, units, tuple(n for n, _ in rows))


def _units(heading: Sequence[tuple[str, str | None]], count: int, gridded: bool, where: str) -> tuple[str, ...]:
    """The units in the ``heading`` of ``count`` columns, () if there are none; ``where`` begins messages."""
    if not any(unit for _, unit in heading):
        return ()
    if gridded:
        raise MechanismError(
            f"{where} has units, which belong to no column of a grid; give 'units', and leave them out"
        )
    bare = next((name for name, unit in heading if unit is None), None)
    if bare is not None or len(heading) != count:
        found = f"has no unit for '{bare}'" if bare is not None else f"has {len(heading)} names for {count} columns"
        raise MechanismError(f"{where} {found}; give one unit for each column, [1] for pure numbers")
    return tuple("1" if unit == "-" else unit for _, unit in heading if unit is not None)


def _text_of(path: Path, where: str) -> str:
    """The text of the file ``path``; raises MechanismError for a file that cannot be read."""
    try:
        if path.stat().st_size > MAX_FILE:
            raise MechanismError(f"{where}.file: '{path}' has more than {MAX_FILE} bytes")
        return path.read_text("utf-8-sig")
    except UnicodeDecodeError as error:
        found = f"byte {error.object[error.start]:#x} at {error.start} is no UTF-8"
        raise MechanismError(f"{where}.file: '{path}' cannot be read: {found}; save it as UTF-8") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise MechanismError(f"{where}.file: '{path}' cannot be read: {reason}") from None


def _fault(cells: list[str], width: int) -> str:
    """What is wrong with the ``cells`` of a line, or "" if they are ``width`` finite numbers."""
    if len(cells) != width:
        return f"has {len(cells)} numbers, the first has {width}; give as many in each line"
    wrong = next((cell for cell in cells if not is_finite(cell)), None)
    if wrong is None:
        return ""
    remedy = "correct it, or put a # before the line"
    if is_finite(wrong.replace(",", ".")):
        remedy = f"write decimals with a point, {wrong.replace(',', '.')}"
    return f"holds {wrong[:40]!r}, which is no finite number; {remedy}"


def _cells(text: str, is_unit: IsUnit) -> tuple[list[str], Lines]:
    """The cells of the header, [] without one, and the lines with numbers, each as its cells, without comments."""
    filled = [(n, line.strip()) for n, line in enumerate(text.splitlines(), 1) if line.strip()]
    lines = [(n, line) for n, line in filled if line[0] != "#"]
    if not lines:
        return [], []
    mark = next((mark for mark in (";", "\t", ",") if mark in lines[0][1]), None)
    rows = [(n, [cell.strip(' \t"') for cell in (line.split(mark) if mark else line.split())]) for n, line in lines]
    if not (all(map(is_finite, rows[0][1][1:])) or is_finite(rows[0][1][0])):
        return _names(lines[0][1], mark), rows[1:]
    above = [_names(line.lstrip("# \t"), mark) for n, line in filled if n < rows[0][0]]
    return _with_units(above[-1] if above else [], len(rows[0][1]), is_unit), rows


def _with_units(comment: list[str], count: int, is_unit: IsUnit) -> list[str]:
    """The cells of a ``comment`` if it is a header of ``count`` columns with units, else []."""
    units = [name_and_unit(cell, is_unit)[1] for cell in comment]
    return comment if len(units) == count and None not in units else []


def _names(line: str, mark: str | None) -> list[str]:
    """The cells of a header, which blanks separate if there is no ``mark``."""
    return [cell.strip(' \t"') for cell in (line.split(mark) if mark else _WORDS.findall(line))]


def _gridded(rows: Lines) -> tuple[Any, ...]:
    """Both arguments, and a row of values for each entry of the first one."""
    second = tuple(map(float, rows[0][1][1:]))
    body = [tuple(map(float, cells)) for _, cells in rows[1:]]
    return tuple(row[0] for row in body), second, tuple(row[1:] for row in body)


def is_finite(entry: Any) -> bool:
    """Whether ``entry``, a number or a text, stands for a finite number."""
    try:
        return math.isfinite(float(entry))
    except (TypeError, ValueError, OverflowError):
        return False
