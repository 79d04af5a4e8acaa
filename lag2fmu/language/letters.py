"""Names as they stand on paper: ``theta1_max`` is a letter with indices, and a part of several letters is one word."""

from __future__ import annotations

import re

import sympy as sp
from sympy.printing.latex import tex_greek_dictionary
from sympy.printing.pretty.pretty_symbology import greek_unicode
from sympy.printing.pretty.pretty_symbology import sub as small

from lag2fmu.language.vocabulary import TIME
from lag2fmu.language.writer import with_decimals

_DOTS = {"_ddot": 2, "_dot": 1}
"""{end of a name: the number of dots over its letter}."""
_ACCENTS, _ABOVE = ("", "\\dot", "\\ddot"), ("", "\u0307", "\u0308")
_NUMBERED = re.compile(r"(?P<letters>[A-Za-z]+)(?P<number>\d+)")


def split(name: str) -> tuple[str, tuple[str, ...]]:
    """The letter or word that ``name`` begins with, and its indices: ('theta', ('1', 'max')) of theta1_max."""
    first, *others = [entry for entry in name.split("_") if entry] or [name]
    match = _NUMBERED.fullmatch(first)
    head, *number = (first,) if match is None else match.group("letters", "number")
    return head, (*number, *others)


def without_dots(name: str) -> tuple[str, int]:
    """The coordinate of a velocity or acceleration, and the number of its time derivatives."""
    return next(((name.removesuffix(end), dots) for end, dots in _DOTS.items() if name.endswith(end)), (name, 0))


def latex_name(name: str, dots: int = 0) -> str:
    r"""``name`` in LaTeX with ``dots`` dots: ``theta1`` is \theta_{1}; ``mr`` is no product, but \mathrm{mr}."""
    head, indices = split(name)
    accented = f"{_ACCENTS[dots]}{{{_latex(head)}}}" if dots else _latex(head)
    return accented + (f"_{{{', '.join(map(latex_name, indices))}}}" if indices else "")


def _latex(part: str) -> str:
    """A letter, a Greek letter, a number, or a word."""
    if len(part) == 1 or part[0].isdigit():
        return part
    if part in tex_greek_dictionary:
        return str(tex_greek_dictionary[part])
    return f"\\{part}" if part in greek_unicode else f"\\mathrm{{{part}}}"


def letter(part: str) -> str:
    """A part of a name in Unicode, a Greek letter where it is the name of one."""
    return str(greek_unicode.get(part, part))


def unicode_name(name: str, dots: int = 0) -> str:
    """``name`` in Unicode with ``dots`` dots above it; indices are small where each is a number or one letter.

    A word with dots stays the name of the velocity.
    """
    head, indices = split(name)
    if dots and len(letter(head)) > 1:
        return name + next(end for end, count in _DOTS.items() if count == dots)
    glyphs = [small.get(x) if len(x) == 1 else "".join(map(small.get, x)) if x.isdigit() else None for x in indices]
    written = "".join(map(str, glyphs)) if all(glyphs) and len(indices) < 3 else "".join(f"_{x}" for x in indices)
    return letter(head) + _ABOVE[dots] + written


def latex(expression: sp.Expr) -> str:
    """``expression`` in LaTeX, with coefficients of one kind; names that end in _dot have a dot."""
    symbols = {s: latex_name(*without_dots(s.name)) for s in expression.free_symbols if s != TIME}
    return str(sp.latex(with_decimals(expression, alike=True), symbol_names=symbols))


_ESCAPED = str.maketrans({c: f"\\{c}" for c in "_%&#$"} | {"^": "\\textasciicircum{}", "~": "\\textasciitilde{}"})
"""The characters of sentences that mean something else in LaTeX."""


def latex_sentence(sentence: str) -> str:
    """A ``sentence`` as a line of LaTeX."""
    return sentence.translate(_ESCAPED) + "\\\\"
