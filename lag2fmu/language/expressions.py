"""The language of expressions for users, models and tests: symbols, normal form, reader and writer.

Reader and writer are inverse to each other: ``parse(to_text(e)) == normal_form(e)``.
"""

from __future__ import annotations

from lag2fmu.language.parser import parse
from lag2fmu.language.parts_of import free_names
from lag2fmu.language.vocabulary import CONSTANTS, FUNCTIONS, NAME_OF, TIME, normal_form, symbol, value_of
from lag2fmu.language.writer import number_text, to_text, with_decimals

__all__ = [
    "CONSTANTS",
    "FUNCTIONS",
    "NAME_OF",
    "TIME",
    "free_names",
    "normal_form",
    "number_text",
    "parse",
    "symbol",
    "to_text",
    "value_of",
    "with_decimals",
]
