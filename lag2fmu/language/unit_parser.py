"""The reader of units: a text such as N*m or kg.m2 resolved to exponents, factor and offset."""

from __future__ import annotations

import re
from collections.abc import Iterator
from difflib import get_close_matches
from fractions import Fraction
from functools import cache

from lag2fmu.errors import UnitError
from lag2fmu.language.units import NAMED, NONE, PREFIXED, PREFIXES, Exponents, Unit, plain_power

MAX_UNIT = 100

_TOKEN = re.compile(
    r"\s*(?:(?P<operator>\*(?!\*)|\.|/)|(?P<open>\()|(?P<close>\))"
    r"|(?P<factor>(?P<name>[A-Za-z%]+|1)(?:(?:\*\*|\^)(?P<broken>[+-]?\d+\.\d+|\([+-]?\d+/\d+\))|(?:\*\*|\^)?(?P<exponent>[+-]?\d+))?))\s*"
)
_PLAINER = {
    **{"°C": "degC", "°": "deg", "\N{MICRO SIGN}": "u", "\N{GREEK SMALL LETTER MU}": "u", "Ω": "Ohm"},
    **{"·": ".", "⋅": ".", "²": "2", "³": "3", "⁻": "-", "¹": "1"},
}
_PLAIN = re.compile("|".join(_PLAINER))
"""Letters that are missing on keyboards or in importers, and what is written instead."""
_BEGINS_OPERAND = {"operator": False, "open": True, "close": False, "factor": True}
_MISPLACED = {
    "operator": "'{}' stands where a unit is expected",
    "open": "'{}' stands where a unit is expected",
    "close": "unbalanced ')' or nothing before it",
    "factor": "an operator is missing before '{}'",
}


@cache
def parse_unit(text: str) -> Unit:
    """Resolve ``text``, e.g. ``N*m``, ``N.m``, ``kg*m^2``, ``kg.m2``, ``m/s**2``, ``N/(m/s)`` or ``1``.

    Broken powers follow a ``^`` or ``**``: ``N/m^1.5``, ``m^(1/3)``. A quotient divides by the one factor that follows
    it: ``J/kg/K``, ``m/s2``. Raises UnitError for a text that is no unit and for an unknown name, with the nearest
    known ones.
    """
    if len(text) > MAX_UNIT:
        raise UnitError(f"unit '{text[:20]}...': has {len(text)} characters; at most {MAX_UNIT} are read")
    exponents, factor, offset, powers = NONE, 1.0, 0.0, []
    for name, power in _factors(text):
        base, base_factor, base_offset = _look_up(name, text)
        exponents = tuple(plain_power(e + power * b) for e, b in zip(exponents, base, strict=True))
        factor *= base_factor**power
        offset = offset or base_offset
        powers.append(power)
    if offset and powers != [1]:
        raise UnitError(f"unit '{text}': a unit with an offset can only stand alone; use K")
    plain = re.sub(r"\s", "", text).replace("**", "^")
    whole = all(isinstance(power, int) for power in powers)
    name = (plain.replace("^", "") if whole else plain).replace("*", ".")
    return Unit("" if exponents == NONE and factor == 1.0 and name == "1" else name, exponents, factor, offset)


def _factors(text: str) -> Iterator[tuple[str, int | Fraction]]:
    """(name, power) of each factor, from left to right; those of ``N/(m/s)`` are N 1, m -1 and s 1.

    The grammar: unit = operand {("*" | "." | "/") operand}; operand = name [power] | "(" unit ")". Raises UnitError.
    """
    sign, around = 1, [1]  # the sign of the next operand's powers; the signs of the open brackets
    operand_expected = True
    for token in _tokens(text):
        kind = str(token.lastgroup)
        _check_place(text, token, operand_expected, len(around))
        if kind == "open":
            around.append(sign)
        elif kind == "close":
            around.pop()
        elif kind == "operator":
            sign = -around[-1] if token["operator"] == "/" else around[-1]
        else:
            power = _exponent(text, token)
            power = power if sign > 0 else -power
            if not -12 <= power <= 12:
                raise UnitError(f"unit '{text}': the power {power} is beyond 12")
            yield token["name"], power
        operand_expected = kind in ("operator", "open")
    if operand_expected or len(around) > 1:
        raise UnitError(f"unit '{text}': incomplete; write '1' for a dimensionless quantity, or leave the unit out")


def _exponent(text: str, token: re.Match[str]) -> int | Fraction:
    """The power of a factor; raises UnitError for a division by zero."""
    try:
        return plain_power(Fraction((token["broken"] or token["exponent"] or "1").strip("()")))
    except ZeroDivisionError:
        raise UnitError(f"unit '{text}': the power '{token['broken']}' divides by zero") from None


def _check_place(text: str, token: re.Match[str], operand_expected: bool, depth: int) -> None:
    """Raise UnitError for a ``token`` that cannot stand where it does, in ``depth`` - 1 open brackets."""
    kind = str(token.lastgroup)
    if _BEGINS_OPERAND[kind] != operand_expected or (kind == "close" and depth == 1):
        raise UnitError(f"unit '{text}': {_MISPLACED[kind].format(token['name'] or token[kind])}")


def _tokens(text: str) -> Iterator[re.Match[str]]:
    """Operators, brackets and factors in turn; raises UnitError at anything else."""
    position = 0
    while position < len(text):
        match = _TOKEN.match(text, position)
        if match is None:
            plain = _PLAIN.sub(lambda found: _PLAINER[found[0]], text)
            remedy = f"did you mean '{plain}'?" if plain != text else "write units like N*m, kg.m2 or m/s**2"
            raise UnitError(f"unit '{text}': unexpected '{text[position:]}'; {remedy}")
        yield match
        position = match.end()


def _product_in(name: str) -> str:
    """The product that ``name`` may mean, N.s for Ns; '' if there is none."""
    for i in range(1, len(name)):
        first, second = name[:i], name[i:]
        if _known(first) and _known(second) and _look_up(first, first)[0] != _look_up(second, second)[0]:
            return f"{first}.{second}"
    return ""


def _known(name: str) -> bool:
    """Whether ``name`` is a unit, with or without an SI prefix."""
    return name in NAMED or (name[0] in PREFIXES and name[1:] in PREFIXED)


def _look_up(name: str, text: str) -> tuple[Exponents, float, float]:
    """Exponents, factor and offset of one unit name, with or without an SI prefix."""
    if name == "1":
        return NONE, 1.0, 0.0
    if name in NAMED:
        return NAMED[name]
    if _known(name):
        exponents, factor, _ = NAMED[name[1:]]
        return exponents, PREFIXES[name[0]] * factor if name != "kg" else 1.0, 0.0
    product = _product_in(name)
    near = get_close_matches(name, [*NAMED, "kg", "kN", "mm", "cm", "ms"], n=3)
    if product:
        raise UnitError(f"unit '{text}': unknown unit '{name}'; did you mean '{text.replace(name, product, 1)}'?")
    hint = f"did you mean {', '.join(near)}?" if near else "known are m, kg, s, rad, deg, N, J, W, Pa, Hz and others"
    raise UnitError(f"unit '{text}': unknown unit '{name}'; {hint}")
