"""CSV files of tables: columns of numbers, their units in the heading, and where each row stands."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from lag2fmu.errors import MechanismError

MAX_FILE = 10_000_000

HEADING = re.compile(r"(\S.*?)\s+\[(.+)\]")
"""A name with its unit at the head of a column: 'omega [rpm]'. 'x[1]', without a blank, is the name of an element of an
array."""
_WORDS = re.compile(r"[^\s\[]+(?:\s+\[[^\]]*\])?")
"""The same where blanks separate the columns."""
Lines = list[tuple[int, list[str]]]


class TableFile(NamedTuple):
    """What a CSV file holds: the ``columns`` as of a Table, and the ``units`` of its heading, () if it has none.

    ``lines`` are the numbers of the lines of each row; with a grid, the first line holds the second argument.
    """

    columns: tuple[Any, ...]
    units: tuple[str, ...]
    lines: tuple[int, ...]


def read_table(path: Path, where: str) -> TableFile:
    """The CSV file ``path``: commas, semicolons, tabs or blanks, a header if there is one, # comments.

    Numbers may stand in quotes. Raises MechanismError for a file that cannot be read or holds something else.
    """
    heading, rows = _cells(_text_of(path, where))
    if not rows:
        raise MechanismError(f"{where}.file: '{path}' holds no numbers")
    gridded = len(rows[0][1]) > 3 or not is_finite(rows[0][1][0])
    for i, (n, cells) in enumerate(rows):
        fault = _fault(cells[int(gridded and i == 0) :], len(rows[0][1]) - int(gridded and i == 0))
        if fault:
            raise MechanismError(f"{where}.file: line {n} of '{path}' {fault}")
    units = _units(heading, len(rows[0][1]), gridded, f"{where}.file: the heading of '{path}'")
    columns = _gridded(rows) if gridded else tuple(zip(*([*map(float, cells)] for _, cells in rows), strict=True))
    return TableFile(columns, units, tuple(n for n, _ in rows))


def _units(heading: Sequence[str], count: int, gridded: bool, where: str) -> tuple[str, ...]:
    """The units in the ``heading`` of ``count`` columns, () if there are none; ``where`` begins messages."""
    matches = [HEADING.fullmatch(cell) for cell in heading]
    if not any(matches):
        return ()
    if gridded:
        raise MechanismError(
            f"{where} has units, which belong to no column of a grid; give 'units', and leave them out"
        )
    bare = next((cell for cell, match in zip(heading, matches, strict=True) if match is None), None)
    if bare is not None or len(heading) != count:
        found = f"has no unit for '{bare}'" if bare is not None else f"has {len(heading)} names for {count} columns"
        raise MechanismError(f"{where} {found}; give one unit for each column, [1] for pure numbers")
    return tuple("1" if match[2].strip() == "-" else match[2] for match in matches if match is not None)


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


def _cells(text: str) -> tuple[list[str], Lines]:
    """The cells of the header, [] without one, and the lines with numbers, each as its cells, without comments."""
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and line.strip()[0] != "#"]
    mark = next((mark for mark in (";", "\t", ",") if lines and mark in lines[0][1]), None)
    rows = [(n, [cell.strip(' \t"') for cell in (line.split(mark) if mark else line.split())]) for n, line in lines]
    if not rows or all(map(is_finite, rows[0][1][1:])) or is_finite(rows[0][1][0]):
        return [], rows
    return rows[0][1] if mark else [cell.strip('"') for cell in _WORDS.findall(lines[0][1])], rows[1:]


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
