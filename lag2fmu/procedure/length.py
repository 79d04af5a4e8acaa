"""The length of formulas, and the shorter one of two ways to write them."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache

import sympy as sp

from lag2fmu.language.definitions import calls

MAX_OPERATIONS = 400
"""Lagrangians with more operations than this are not differentiated on paper."""
MAX_ON_PAPER = 20_000
"""Formulas with more symbols, numbers and operations than this are not written at all."""
MAX_DEFINITIONS = 20
"""At most this many long definitions are shown."""


def tidy(expression: sp.Expr) -> sp.Expr:
    """The shorter one of ``expression`` and its trigonometric simplification; large expressions are unchanged.

    Terms with the same factors outside of trigonometric functions are simplified together. This is much faster than
    the simplification of the whole.
    """
    if operations(expression) > MAX_OPERATIONS:
        return expression
    groups: dict[sp.Expr, sp.Expr] = {}
    for term in sp.Add.make_args(sp.expand(expression)):
        rest, angular = term.as_independent(sp.sin, sp.cos, sp.tan, as_Add=False)
        number, factors = rest.as_coeff_Mul()
        groups[factors] = groups.get(factors, sp.S.Zero) + number * angular
    simpler = sp.factor_terms(sp.Add(*(factors * _shorter(angular) for factors, angular in groups.items())))
    return simpler if operations(simpler) < operations(expression) else expression


@cache
def _shorter(angular: sp.Expr) -> sp.Expr:
    return sp.trigsimp(angular)


@cache
def symbols(expression: sp.Expr) -> int:
    """The number of symbols, numbers and operations of ``expression``, which is found faster than ``operations``."""
    size: dict[sp.Basic, int] = {}
    stack: list[sp.Basic] = [expression]
    while stack:
        top = stack[-1]
        missing = [below for below in top.args if below not in size]
        if missing:
            stack += missing
        else:
            size[stack.pop()] = 1 + sum(size[below] for below in top.args)
    return size[expression]


@cache
def operations(expression: sp.Expr) -> int:
    """The number of operations of ``expression`` as it is printed, with the names of long definitions."""
    return symbols(expression) if symbols(expression) > MAX_ON_PAPER else int(sp.count_ops(expression))


def rounded(count: int) -> str:
    """``count`` as text, rounded to three digits if it is long."""
    return str(count) if count <= MAX_ON_PAPER else f"{count:.3g}"


def why_not_differentiated(lagrangian: sp.Expr) -> str:
    """The reason why the Lagrangian is not differentiated on paper, as a predicate; '' if it is."""
    if operations(lagrangian) > MAX_OPERATIONS:
        return f"is too long to be differentiated here, with {rounded(operations(lagrangian))} operations"
    long = calls([lagrangian])
    return f"uses the long definition {long[-1].definition}" if long else ""


def long_definitions(expressions: Iterable[sp.Expr]) -> list[tuple[str, sp.Expr]]:
    """(name, meaning) of the long definitions in ``expressions``; each comes after those it uses."""
    found = calls(expressions)
    return [(call.definition, call.meaning) for call in found if not call.by and call.args == call.parameters]
