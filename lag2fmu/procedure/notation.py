"""The two formats in which the steps are written: plain text and LaTeX."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import sympy as sp

from lag2fmu.language.letters import latex, latex_name, latex_sentence, without_dots
from lag2fmu.language.writer import to_read


@dataclass(frozen=True)
class Notation:
    """One format: how names, expressions, derivatives, headings and lines are written."""

    name: Callable[[str], str]
    expression: Callable[[sp.Expr], str]
    partial: Callable[[str, str], str]
    total: Callable[[str], str]
    heading: Callable[[int, str], str]
    formula: Callable[[str, str], str]
    remark: Callable[[str], str]


def _latex_name(name: str) -> str:
    head, hat, rest = name.partition("^np_")
    return f"{head}^{{np}}_{{{_latex_name(rest)}}}" if hat else latex_name(*without_dots(name))


TEXT = Notation(
    name=lambda name: name,
    expression=to_read,
    partial=lambda f, x: f"d{f}/d({x})",
    total=lambda f: f"d/dt {f}",
    heading=lambda number, title: f"\n{number:2d}. {title}" if number > 1 else f"{number:2d}. {title}",
    formula=lambda left, right: f"      {left} = {right}",
    remark=lambda sentence: f"      {sentence}",
)
LATEX = Notation(
    name=_latex_name,
    expression=latex,
    partial=lambda f, x: f"\\frac{{\\partial {f}}}{{\\partial {x}}}",
    total=lambda f: f"\\frac{{d}}{{dt}} {f}",
    heading=lambda number, title: f"\\paragraph{{{number}. {title}}}",
    formula=lambda left, right: f"\\[ {left} = {right} \\]",
    remark=latex_sentence,
)
