"""The syntax of the text format, TOML: its numbers stay exact, and its errors say what may help."""

from __future__ import annotations

import re
import sys
from decimal import Decimal, InvalidOperation
from typing import Any

from lag2fmu.errors import TextError

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # type: ignore[import-not-found,unused-ignore]

MAX_KEY_PARTS = 32
"""The most parts of a key with dots; no table of a mechanism lies as deep."""

_DECIMAL_COMMA = re.compile(r"=\s*([+-]?\d+),(\d+)")
_NO_QUOTES = re.compile(r"(?!(?:true|false|inf|nan)\b)-?[^\W\d][^\s,\]}]*")
_KEY = re.compile(r"\s*([\w.-]+)\s*=")
_COLON = re.compile(r"\s*([\w-]+)\s*:")
_OTHER_LETTERS = re.compile(r"[\w.-]*[^\x00-\x7f][\w.-]*(?=\s*[=\]])")
_CHARACTERS = {
    "\N{MINUS SIGN}": "a minus is written with '-'",
    **dict.fromkeys("\u201c\u201d\u201e\u2018\u2019\u00ab\u00bb", 'texts have straight quotes: "..."'),
}
"""What word processors write at the beginning of a value: {character: the remedy}."""
_PLACE = re.compile(r"at line (\d+), column (\d+)")


def parse_toml(text: str) -> dict[str, Any]:
    """The tables of ``text`` with exact numbers (int, Decimal); raises TextError with line and column."""
    for number, line in enumerate(text.splitlines(), 1):
        if line.split("=", 1)[0].count(".") > MAX_KEY_PARTS and not line.lstrip().startswith("#"):
            raise TextError(f"line {number}: a key of more than {MAX_KEY_PARTS} parts")
    try:
        content: dict[str, Any] = tomllib.loads(text, parse_float=Decimal)
    except tomllib.TOMLDecodeError as error:
        raise TextError(f"no valid TOML: {error}{_remedy(text, str(error))}") from error
    except RecursionError:
        raise TextError("no valid TOML: arrays or tables are nested too deeply") from None
    except InvalidOperation:
        raise TextError("no valid TOML: the exponent of a number has too many digits") from None
    except ValueError as error:
        raise TextError(f"no valid TOML: {error}") from error
    return content


def _remedy(text: str, error: str) -> str:
    """What may help against the ``error`` of the TOML parser, '' where nothing is known."""
    if comma := _DECIMAL_COMMA.search(text):
        return f"; decimals have a point: {comma[1]}.{comma[2]} instead of {comma[1]},{comma[2]}"
    place = _PLACE.search(error)
    line, column = (text.split("\n")[int(place[1]) - 1], int(place[2]) - 1) if place else ("", 0)
    bare = _NO_QUOTES.match(line[column:].lstrip("[ "))
    if "Invalid value" in error and (remedy := _CHARACTERS.get(line[column : column + 1])):
        return f"; {remedy}"
    if "Invalid value" in error:
        return f'; texts have quotes: "{bare[0]}" instead of {bare[0]}' if bare else ""
    if line.lstrip().startswith(("//", "/*", "%", ";", "--")):
        return "; a comment begins with '#'"
    if "overwrite a value" in error and (key := _KEY.match(line)):
        return f"; '{key[1]}' has a value already: leave one of them out"
    if other := _OTHER_LETTERS.match(line.lstrip("[ ")):
        return f"; names have letters from a to z, digits and underscores: '{other[0]}' has another one"
    return f"; a key is followed by '=': {colon[1]} = ..." if (colon := _COLON.match(line)) else ""
