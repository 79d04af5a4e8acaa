"""Are the values that Python gives numbers and texts, where the record needs them? The text format asks by itself."""

from __future__ import annotations

from collections.abc import Iterable
from numbers import Real

import sympy as sp

from lag2fmu.errors import MechanismError

_MAKERS = {"Coordinate": "coordinate", "Parameter": "parameter", "Input": "signal"}
"""What declares a symbol, by the record that it declares."""


def kind_and_name(value: object) -> str:
    """What ``value`` is, for messages: Coordinate 'x' of a declared symbol or its record, int '3' of another thing."""
    record = getattr(value, "declaration", value)
    return f"{type(record).__name__} '{getattr(record, 'name', record)}'"


def require_number(value: object, where: str) -> None:
    """Raise MechanismError for what is no real number, such as None, a list, a text or an expression with names."""
    known = isinstance(value, sp.Expr) and value.is_number and value.is_extended_real is not False
    if isinstance(value, bool) or not (known or isinstance(value, Real)):
        raise MechanismError(f"{where}: expected a number, got {value!r}")


def require_optional_number(value: object, where: str) -> None:
    """Raise MechanismError for what is neither None nor a real number."""
    if value is not None:
        require_number(value, where)


def require_text(value: object, where: str) -> None:
    """Raise MechanismError for what is no text."""
    if not isinstance(value, str):
        raise MechanismError(f"{where}: expected a text, got {value!r}")


def texts(value: object, where: str) -> tuple[str, ...]:
    """Texts, of which one may stand alone; raises MechanismError for anything else."""
    found = (value,) if isinstance(value, str) or not isinstance(value, Iterable) else tuple(value)
    for text in found:
        require_text(text, where)
    return tuple(str(text) for text in found if text)


def require_flag(value: object, where: str) -> None:
    """Raise MechanismError for what is neither True nor False."""
    if not isinstance(value, bool):
        raise MechanismError(f"{where}: expected True or False, got {value!r}")


def require_record(value: object, kind: type, where: str) -> None:
    """Raise MechanismError for what is no record of this ``kind``."""
    if not isinstance(value, kind):
        expected, found = kind.__name__.lower(), type(value).__name__
        article = "an" if expected[0] in "aeiou" else "a"
        maker = _MAKERS.get(kind.__name__, kind.__name__)
        raise MechanismError(f"{where}: expected {article} {expected}, got {found} '{value}'; {maker}(...) makes one")
