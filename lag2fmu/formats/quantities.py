"""Numbers of a text: exact ones, and those with a unit of their own."""

from __future__ import annotations

import re
from decimal import Decimal
from fractions import Fraction

from lag2fmu.errors import TextError, UnitError
from lag2fmu.language.unit_parser import parse_unit
from lag2fmu.language.units import Unit

MAX_EXPONENT, MAX_BITS, MAX_NUMBER = 330, 1024, 1600
"""The limits of numbers in texts: the exponent to 10 and the bits of an integer go little beyond the range of doubles;
digits are those of the longest exact decimal of a double, and more."""
QUANTITY = re.compile(r"^\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([^\s\d,.].*)$")


def quantity(value: object, where: str, unit: Unit, *, difference: bool = False, per: Unit | None = None) -> float:
    """``value`` in SI: a number in ``unit``, or a text with its own unit, such as '280 rpm'.

    A ``difference`` leaves the zero of the unit out. A number is in ``unit``, a text in a unit of ``unit`` / ``per``.
    Raises TextError for what is neither, and for a unit of another dimension.
    """
    match = QUANTITY.fullmatch(value) if isinstance(value, str) else None
    if match is None:
        number = fraction(value, where)
        return unit.difference_to_si(number) if difference else unit.to_si(number)
    wanted = unit if per is None else unit / per
    try:
        own = parse_unit(match[2])
    except UnitError as error:
        raise TextError(f"{where}: {error}") from error
    if own.dimension != wanted.dimension:
        raise TextError(f"{where}: '{match[2]}' is no unit of it, which is in {wanted.name or '1'}")
    number = fraction(Decimal(match[1]), where)
    return own.difference_to_si(number) if difference else own.to_si(number)


def describe(value: object) -> str:
    """Kind and value of an entry for a message, e.g. ``the string 'abc'``, cut where it is long."""
    kinds = {
        bool: "a boolean",
        str: "the string",
        int: "the number",
        Decimal: "the number",
        list: "an array",
        dict: "a table",
    }
    kind = kinds.get(type(value), "the date or time")
    if isinstance(value, (list, dict)):
        return kind
    if isinstance(value, int) and not isinstance(value, bool) and value.bit_length() > MAX_BITS:
        return f"the number {hex(value)[:20]}..."
    shown = str(value).lower() if isinstance(value, bool) else repr(value) if isinstance(value, str) else str(value)
    return f"{kind} {shown if len(shown) <= 40 else shown[:37] + '...'}"


def fraction(value: object, where: str) -> Fraction:
    """``value`` exactly; raises TextError for another type, for inf, nan and what no float holds."""
    if isinstance(value, bool) or not isinstance(value, (int, Decimal)):
        raise TextError(f"{where}: expected a number, got {describe(value)}")
    if isinstance(value, Decimal) and not value.is_finite():
        raise TextError(f"{where}: {value} is not a finite number")
    if not value:
        return Fraction(0)
    if isinstance(value, int):
        too_large = value.bit_length() > MAX_BITS
    else:
        too_large = abs(value.adjusted()) > MAX_EXPONENT or len(value.as_tuple().digits) > MAX_NUMBER
    if too_large:
        raise TextError(f"{where}: {describe(value)} has too many digits or is outside of the range of floats")
    return Fraction(value)
