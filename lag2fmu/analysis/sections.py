"""The sections of an analysis: titles with sentences and formulas."""

from __future__ import annotations

from typing import NamedTuple

import sympy as sp

from lag2fmu.language.letters import latex, latex_name, latex_sentence
from lag2fmu.language.writer import to_read


class Line(NamedTuple):
    """A sentence, or with an ``expression`` the formula ``text`` = expression."""

    text: str
    expression: sp.Expr | None = None

    def __str__(self) -> str:
        return self.text if self.expression is None else f"{self.text} = {to_read(self.expression)}"

    @property
    def latex(self) -> str:
        """The line in LaTeX."""
        if self.expression is None:
            return latex_sentence(self.text)
        return f"\\[ {latex_name(self.text)} = {latex(self.expression)} \\]"


class Section(NamedTuple):
    """A title with lines."""

    title: str
    lines: tuple[Line, ...]
