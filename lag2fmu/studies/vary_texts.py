"""The texts that say on the command line what varies: ranges, lists, columns of tables, in declared units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from lag2fmu.errors import LoadError
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import value_in_si
from lag2fmu.reference.csv_tables import csv_text, parse_columns
from lag2fmu.reference.trajectory import Floats
from lag2fmu.studies.design import Axis, check_count


def axes_of_texts(texts: Mapping[str, str], units: Mapping[str, Unit], *, sampled: bool) -> list[Axis]:
    """The axes that ``NAME=A:B:N``, ``NAME=V,V,...`` and ``NAME=@CSV`` describe; columns of one table vary together.

    ``units`` are those of the texts; the axes are in SI units. Raises LoadError for a text of another form.
    """
    axes, tables = [], dict[str, list[str]]()
    for name, text in texts.items():
        if text.startswith("@"):
            tables.setdefault(text[1:], []).append(name)
        elif ":" in text:
            axes.append(_range(name, text, units, sampled=sampled))
        else:
            values = [value_in_si(name, value.strip(), units) for value in text.split(",")]
            axes.append(Axis((name,), np.array(values)[:, None]))
    return [*axes, *(_table(Path(file), names, units) for file, names in tables.items())]


def _range(name: str, text: str, units: Mapping[str, Unit], *, sampled: bool) -> Axis:
    parts = [part.strip() for part in text.split(":")]
    usage = f"--vary {name}={text}: give {name}=A:B:N, N values from A to B"
    if len(parts) not in ((2, 3) if sampled else (3,)) or not all(parts):
        raise LoadError(usage + (" (or A:B, a range)" if sampled else "; only --sample takes A:B"))
    low, high = (value_in_si(name, part, units) for part in parts[:2])
    if len(parts) == 2:
        if not low < high:
            raise LoadError(f"--vary {name}={text}: the range is empty; A has to be less than B")
        return Axis((name,), None, low, high)
    if not parts[2].isdigit() or int(parts[2]) < 1:
        raise LoadError(f"{usage}; '{parts[2]}' is no number of values")
    check_count(int(parts[2]))
    return Axis((name,), np.linspace(low, high, int(parts[2]))[:, None])


def _table(file: Path, names: Sequence[str], units: Mapping[str, Unit]) -> Axis:
    """The columns ``names`` of a table; raises LoadError for one that is missing."""
    found, table = parse_columns(csv_text(file), str(file), units)
    for name in names:
        if name not in found:
            raise LoadError(f"'{file}' has no column '{name}'; there are {', '.join(found)}")
    return Axis(tuple(names), table[:, [found.index(name) for name in names]])


def numbers_of_text(option: str, text: str) -> Floats:
    """The k numbers, (k,), between the commas of the ``text`` of an ``option``; raises LoadError for other texts."""
    try:
        return np.array([float(part) for part in text.split(",")])
    except ValueError:
        raise LoadError(f"{option} {text}: give numbers between commas") from None
