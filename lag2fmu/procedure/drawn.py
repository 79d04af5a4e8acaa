"""Formulas in two dimensions, with fractions, roots and dots above letters, for terminals that know Unicode."""

from __future__ import annotations

import sympy as sp
from sympy.printing.pretty.pretty import PrettyPrinter
from sympy.printing.pretty.stringpict import prettyForm, stringPict

from lag2fmu.language.letters import unicode_name, without_dots
from lag2fmu.language.writer import to_read, with_decimals
from lag2fmu.procedure.length import operations
from lag2fmu.procedure.notation import TEXT, Notation

MOST_DRAWN = 150
"""The most operations of a formula that is drawn; a longer one would be wider than any terminal."""

_INDENT = " " * 6
_SETTINGS = {"use_unicode": True, "wrap_line": False, "num_columns": None}


class Drawn(str):
    """A formula of one or several lines; equations continue on the line ``baseline``, ``text`` is the plain formula."""

    __slots__ = ("baseline", "text")

    baseline: int
    text: str


def drawn(width: int) -> Notation:
    """The notation for a terminal of ``width`` columns; a wider formula stays one line of text."""

    def formula(left: str, right: str) -> str:
        sides = [_picture(left), " = ", _picture(right)]
        lines = stringPict(*stringPict.next(*sides)).render(wrap_line=False).splitlines()
        if max(map(len, lines)) + len(_INDENT) > width:
            return TEXT.formula(getattr(left, "text", left), getattr(right, "text", right))
        return "\n".join([*(_INDENT + line.rstrip() for line in lines), ""])

    return Notation(
        name=_name,
        expression=_expression,
        partial=lambda f, x: f"∂{f}/∂({x})",
        total=lambda f: f"d/dt {f}",
        heading=TEXT.heading,
        formula=formula,
        remark=TEXT.remark,
    )


class _DrawnPrinter(PrettyPrinter):  # type: ignore[misc]
    """Prints names as ``letters`` writes them."""

    def _print_Symbol(self, e: sp.Symbol) -> prettyForm:
        return prettyForm(unicode_name(*without_dots(e.name)), binding=prettyForm.ATOM)


def _expression(expression: sp.Expr) -> str:
    if operations(expression) > MOST_DRAWN:
        return to_read(expression)
    form = _DrawnPrinter(_SETTINGS)._print(with_decimals(expression, alike=True))
    found = Drawn(form.render(wrap_line=False))
    found.baseline, found.text = form.baseline, to_read(expression)
    return found


def _name(name: str) -> str:
    head, external, rest = name.partition("^np_")
    plain = unicode_name(*without_dots(rest or name))
    found = Drawn(f"{head}ⁿᵖ_{plain}" if external else plain)
    found.baseline, found.text = 0, name
    return found


def _picture(side: str) -> stringPict:
    return prettyForm(str(side), baseline=getattr(side, "baseline", 0))
