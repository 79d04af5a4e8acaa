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
    "%": "a per cent is 0.01",
    "°": "angles are in rad: write pi/180*...",
    "√": "a root is sqrt(...)",
    "\\": "functions are written without a backslash",
    "#": "a comment stands outside of the quotes",
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


def of_number(text: str) -> str:
    """The number that a ``text`` was meant to be, with a decimal comma or the sign of a printed minus; '' if none."""
    meant = text.strip().replace("\N{MINUS SIGN}", "-").replace(",", ".")
    try:
        float(meant.partition(" ")[0])
    except ValueError:
        return ""
    return "" if meant == text else f"write {meant}"


def of_operator(token: str, before: str) -> tuple[str, str]:
    """(message, remedy) for a ``token`` with which no operand begins; ``before`` is the text in front of it."""
    comment = token == "/" and before.rstrip().endswith("/")
    remedy = "a quotient has one '/'; a comment begins with '#', outside of the quotes" if comment else ""
    return f"unexpected '{token}'" if token else "the expression ends too early", remedy


def of_rest(kind: str, token: str, before: str) -> str:
    """The remedy for a ``token`` that follows a complete expression; ``before`` is the text in front of the token."""
    behind_number = before[-1:].isdigit() or before.endswith(".")
    if token == "," and behind_number:
        return "the decimal sign is '.'"
    operand = kind == "name" or token == "(" or (kind == "number" and not behind_number)
    unit = " Numbers are in SI units, without a name of them" if kind == "name" and behind_number else ""
    return f"is a '*' missing before it?{unit}" if operand else ""


_RATE = "the velocity of x is x_dot"
_NAMES = {
    "time": "the time is t",
    "e": "the power of e is exp(...)",
    **dict.fromkeys(("Pi", "PI"), "the constant is pi"),
    **dict.fromkeys(("dt", "ddt"), _RATE),
}
"""What is called otherwise in other languages: {name: the remedy}."""

_ELSEWHERE = {"ln": "log(...)", "log10": "log(...)/log(10)", "pow": "a**b", "cot": "1/tan(...)"}
"""Functions of other languages: {name: what is written here}."""
_RATES = {"d", "der", "ddt", "diff", "dot", "derivative", "Derivative"}


def of_call(name: str, functions: Iterable[str]) -> str:
    """The remedy for a call of ``name``, which is none of the ``functions``."""
    if name in _RATES:
        return _RATE
    if name in _ELSEWHERE:
        return f"write {_ELSEWHERE[name]}"
    remedy = suggestion(name, functions)
    return f"{remedy}; a product is written {name}*(...)" if remedy.startswith("known") else remedy


def of_symbol(name: str, known: Iterable[str]) -> str:
    """The remedy for a ``name`` that is declared nowhere, where those are ``known``."""
    remedy = _NAMES.get(name) or suggestion(name, known)
    return remedy if remedy.startswith("did you mean") else f"{remedy}, or declare '{name}' among the parameters"


def of_name(name: str, tables: Collection[str], is_function: bool, following: str) -> tuple[str, str]:
    """(message, remedy) for an unknown ``name`` that stands before the token ``following``, no parenthesis."""
    if not is_function:
        return f"unknown name '{name}'", ""
    what = f"the table '{name}'" if name in tables else f"the function '{name}'"
    power = "**2" if following in ("^", "**") else ""
    return f"{what} has no argument", f"write {name}(...){power}"
