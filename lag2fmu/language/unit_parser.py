"""The reader of units: a text such as N*m or kg.m2 resolved to exponents, factor and offset."""

from __future__ import annotations

import re
from collections.abc import Iterator
from difflib import get_close_matches
from fractions import Fraction
from functools import cache, partial

from lag2fmu.errors import MechanismError, UnitError
from lag2fmu.language.units import NAMED, NONE, PREFIXED, PREFIXES, Exponents, Unit, plain_power

MAX_UNIT = 100
MAX_RUN_TOGETHER = 8
"""Letters of a name that is searched for the factors of a product."""

_TOKEN = re.compile(
    r"\s*(?:(?P<operator>\*(?!\*)|\.|/)|(?P<open>\()|(?P<close>\))"
    r"|(?P<factor>(?P<name>[A-Za-z%]+|1(?!\d))(?:(?:\*\*|\^)(?P<broken>[+-]?\d+\.\d+|\([+-]?\d+/\d+\))|(?:\*\*|\^)?(?P<exponent>[+-]?\d+))?))\s*"
)
_FACTOR = re.compile(r"(?P<slash>/)?(?P<name>[A-Za-z]+)(?P<power>(?:\*\*|\^)?[+-]?\d+)?")
_PLAINER = {
    **{"°C": "degC", "°": "deg", "\N{MICRO SIGN}": "u", "\N{GREEK SMALL LETTER MU}": "u", "Ω": "Ohm"},
    **{"·": ".", "⋅": ".", "²": "2", "³": "3", "⁻": "-", "¹": "1"},
}
_PLAIN = re.compile("|".join(_PLAINER))
"""Letters that are missing on keyboards or in importers, and what is written instead."""
_SPELLED_OUT = {
    **{"meter": "m", "metre": "m", "second": "s", "sec": "s", "kilogram": "kg", "gram": "g", "newton": "N"},
    **{"joule": "J", "watt": "W", "pascal": "Pa", "hertz": "Hz", "volt": "V", "ampere": "A", "amp": "A", "ohm": "Ohm"},
    **{"radian": "rad", "degree": "deg", "kelvin": "K", "minute": "min", "hour": "h", "inch": "in", "kmh": "km/h"},
    **{"kph": "km/h", "liter": "l", "litre": "l", "lbs": "lb"},
}
"""Names in words, in the singular, and their symbols."""
_GENERAL = "known are m, kg, s, rad, deg, N, J, W, Pa, Hz and others, written like N*m, kg.m2 or m/s**2"
_BEGINS_OPERAND = {"operator": False, "open": True, "close": False, "factor": True}
_MISPLACED = {
    "operator": "'{}' stands where a unit is expected",
    "open": "'{}' stands where a unit is expected",
    "close": "unbalanced ')' or nothing before it",
    "factor": "an operator is missing before '{}'",
}


class _SpellingError(UnitError):
    """A text that is no unit, for which a remedy is still to be found."""


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
    for (base, base_factor, base_offset), power in _known_factors(text):
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


def _known_factors(text: str) -> list[tuple[tuple[Exponents, float, float], int | Fraction]]:
    """(exponents, factor and offset, power) of each factor; raises UnitError, with a remedy for what is misspelt."""
    try:
        return [(_look_up(name, text), power) for name, power in _factors(text)]
    except _SpellingError as error:
        raise UnitError(f"{error}; {_remedy(text)}") from None


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
            if power == 0:
                raise _SpellingError(f"unit '{text}': the power 0 leaves nothing of '{token['name']}'")
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
        fault = _MISPLACED[kind].format(token["name"] or token[kind])
        raise _SpellingError(f"unit '{text}': {fault}")


def _tokens(text: str) -> Iterator[re.Match[str]]:
    """Operators, brackets and factors in turn; raises UnitError at anything else."""
    position = 0
    while position < len(text):
        match = _TOKEN.match(text, position)
        if match is None:
            raise _SpellingError(f"unit '{text}': unexpected '{text[position:]}'")
        yield match
        position = match.end()


def _remedy(text: str) -> str:
    """What to write instead of ``text``, which is no unit: the units that it may mean, if there are any."""
    plain = _PLAIN.sub(lambda found: _PLAINER[found[0]], text.strip())
    plain = re.sub(r"(?<=\d),(?=\d)", ".", plain)
    plain = re.sub(r"(?<=[A-Za-z])([+-]?\d+\.\d+)", r"^\1", plain)
    plain = re.sub(r"(?<=[\w)])\s+(?=[A-Za-z(])|(?<=[A-Za-z])-(?=[A-Za-z])", ".", plain)
    choices = [_FACTOR.sub(partial(_corrected, choice=choice), plain) for choice in (0, 1)]
    sound = [choice for choice in dict.fromkeys(choices) if choice != text and is_unit(choice)]
    return f"did you mean {' or '.join(map(repr, sound))}?" if sound else _GENERAL


def _corrected(factor: re.Match[str], choice: int) -> str:
    """The ``factor`` with the first (0) or second (1) that its name may mean, a divisor of several in brackets."""
    meant = _meant(factor["name"]) or [factor["name"]]
    text = meant[min(choice, len(meant) - 1)] + (factor["power"] or "")
    return f"/({text})" if factor["slash"] and "." in text else (factor["slash"] or "") + text


def is_unit(text: str) -> bool:
    """Whether ``text`` consists of known units, so that ``parse_unit``, which raises UnitError for others, takes it."""
    try:
        return all(name == "1" or _known(name) for name, _ in _factors(text))
    except UnitError:
        return False


def _meant(name: str) -> list[str]:
    """What an unknown ``name`` may mean: a word's symbol, other capitals, a product, what is near; [] if known."""
    if _known(name):
        return []
    word = name.lower()
    symbol = _SPELLED_OUT.get(word) or _SPELLED_OUT.get(word.removesuffix("s"))
    if symbol or (products := sorted(_products(name), key=len, reverse=True)):
        return [symbol] if symbol else products[:2]
    prefixed = (prefix + unit for prefix in PREFIXES for unit in sorted(PREFIXED))
    cases = [known for known in (*NAMED, *prefixed) if known.lower() == word]
    found = list(dict.fromkeys([*cases, *_products(name.capitalize())]))
    return found[:2] or get_close_matches(name, [*NAMED, "kg", "kN", "mm", "cm", "ms"], n=2)


def _products(name: str) -> Iterator[str]:
    """The products that ``name`` may mean, N.s for Ns, of different factors; K at its beginning is meant as kilo."""
    if len(name) > MAX_RUN_TOGETHER or name.startswith("K"):
        return
    for i in range(1, len(name)):
        if _known(name[:i]):
            rest = [name[i:]] if _known(name[i:]) else []
            for others in (*rest, *_products(name[i:])):
                kinds = [_look_up(factor, factor)[0] for factor in (name[:i], *others.split("."))]
                if len(set(kinds)) == len(kinds):
                    yield f"{name[:i]}.{others}"


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
    raise _SpellingError(f"unit '{text}': unknown unit '{name}'")


def checked_unit(value: object, where: str) -> Unit:
    """The unit ``value``, which may be a text; raises MechanismError, for a text UnitError, for what is none."""
    if not isinstance(value, (Unit, str)):
        raise MechanismError(f"{where}: expected a unit such as 'm/s', got {value!r}")
    try:
        return parse_unit(value) if isinstance(value, str) else value
    except UnitError as error:
        raise UnitError(f"{where}: {error}") from None
