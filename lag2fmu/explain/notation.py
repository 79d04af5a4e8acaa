"""The two formats in which the steps are written: plain text and LaTeX."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import sympy as sp

from lag2fmu.language.vocabulary import TIME
from lag2fmu.language.writer import to_text, with_decimals


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
    r"""``theta1_dot`` -> ``\dot{\theta}_{1}``; in a name of several words the later ones become indices."""
    for suffix, accent in (("_ddot", "ddot"), ("_dot", "dot")):
        if name.endswith(suffix):
            return f"\\{accent}{{{_latex_name(name.removesuffix(suffix))}}}"
    head, hat, rest = name.partition("^np_")
    if hat:
        return f"{head}^{{np}}_{{{_latex_name(rest)}}}"
    return str(sp.latex(sp.Symbol(name)))


def _latex(expression: sp.Expr) -> str:
    symbols = {s: _latex_name(s.name) for s in expression.free_symbols if s != TIME}
    return str(sp.latex(with_decimals(expression), symbol_names=symbols))


TEXT = Notation(
    name=lambda name: name,
    expression=to_text,
    partial=lambda f, x: f"d{f}/d({x})",
    total=lambda f: f"d/dt {f}",
    heading=lambda number, title: f"\n{number:2d}. {title}" if number > 1 else f"{number:2d}. {title}",
    formula=lambda left, right: f"      {left} = {right}",
    remark=lambda sentence: f"      {sentence}",
)
LATEX = Notation(
    name=_latex_name,
    expression=_latex,
    partial=lambda f, x: f"\\frac{{\\partial {f}}}{{\\partial {x}}}",
    total=lambda f: f"\\frac{{d}}{{dt}} {f}",
    heading=lambda number, title: f"\\paragraph{{{number}. {title}}}",
    formula=lambda left, right: f"\\[ {left} = {right} \\]",
    remark=lambda sentence: sentence.replace("_", "\\_") + "\\\\",
)
