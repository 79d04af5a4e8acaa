"""Remedies in the messages of the parser: how to correct a text that is no expression."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from lag2fmu.language.identifiers import suggestion

_CHARACTERS = {
    **dict.fromkeys("·⋅\N{MULTIPLICATION SIGN}∙", "a product is written with '*'"),
    **dict.fromkeys("²³", "a power is written with '**'"),
    **dict.fromkeys("[]{}", "brackets are ( and )"),
    **dict.fromkeys("'\N{RIGHT SINGLE QUOTATION MARK}", "the velocity of x is x_dot"),
    **dict.fromkeys("?:", "cases are written if(condition, a, b)"),
    **dict.fromkeys("&|", "conditions are joined by 'and' and 'or'; a magnitude is abs(x)"),
    "!": "the contrary of a condition is written with 'not'",
    "π": "write pi",
    "÷": "a quotient is written with '/'",
    "\N{MINUS SIGN}": "a minus is written with '-'",
    ".": "functions have no module before them: sin(x)",
}


def of_character(character: str) -> str:
    """The remedy for a ``character`` that no expression contains; '' if none is known."""
    letter = character.isalpha() and not character.isascii()
    return _CHARACTERS.get(character, "names are of the letters A to Z, a to z, digits and _" if letter else "")


def of_rest(kind: str, token: str, before: str) -> str:
    """The remedy for a ``token`` that follows a complete expression; ``before`` is the text in front of the token."""
    behind_number = before[-1:].isdigit() or before.endswith(".")
    if token == "," and behind_number:
        return "the decimal sign is '.'"
    operand = kind == "name" or token == "(" or (kind == "number" and not behind_number)
    unit = " Numbers are in SI units, without a name of them" if kind == "name" and behind_number else ""
    return f"is a '*' missing before it?{unit}" if operand else ""


_ELSEWHERE = {"ln": "log(...)", "log10": "log(...)/log(10)", "pow": "a**b", "cot": "1/tan(...)"}
"""Functions of other languages: {name: what is written here}."""


def of_call(name: str, functions: Iterable[str]) -> str:
    """The remedy for a call of ``name``, which is none of the ``functions``."""
    if name in _ELSEWHERE:
        return f"write {_ELSEWHERE[name]}"
    remedy = suggestion(name, functions)
    return f"{remedy}; a product is written {name}*(...)" if remedy.startswith("known") else remedy


def of_name(name: str, tables: Collection[str], is_function: bool) -> tuple[str, str]:
    """(message, remedy) for an unknown ``name`` that is not followed by parentheses."""
    if not is_function:
        return f"unknown name '{name}'", ""
    what = f"the table '{name}'" if name in tables else f"the function '{name}'"
    return f"{what} has no argument", f"write {name}(...)"
