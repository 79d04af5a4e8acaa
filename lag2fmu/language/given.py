"""Whether what a caller gives is a number, names, or a mapping of names to values."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from numbers import Real
from typing import Any

from lag2fmu.errors import LoadError


def within(size: object, *, least: float = -math.inf, above: float = -math.inf) -> bool:
    """Whether ``size`` is a finite number of at ``least`` that, greater than that ``above``."""
    number: Any = size  # those of NumPy are Real too
    return isinstance(size, Real) and bool(least <= number < math.inf and above < number)


def check_names(what: str, given: object, such: str = "names") -> None:
    """Raise LoadError, which begins with ``what``, unless ``given`` is an iterable of ``such``, and not one text."""
    if isinstance(given, str):
        raise LoadError(f"{what}: {given!r} is one text; give a list of {such}, such as [{given!r}]")
    if not isinstance(given, Iterable):
        raise LoadError(f"{what}: {given!r} is no list; give a list of {such}")


def check_mapping(what: str, given: object) -> None:
    """Raise LoadError, which begins with ``what``, unless ``given`` is a mapping."""
    if not isinstance(given, Mapping):
        raise LoadError(f"{what}: {given!r} is no mapping; give {{name: value}}")
