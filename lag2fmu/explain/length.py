"""How long a formula is, and the shorter one of two ways to write it."""

from __future__ import annotations

from functools import cache

import sympy as sp

MAX_OPERATIONS = 400
"""Lagrangians with more operations than this are not differentiated on paper."""
MAX_ON_PAPER = 20_000
"""Formulas with more symbols, numbers and operations than this are not written at all."""


def tidy(expression: sp.Expr) -> sp.Expr:
    """The shorter one of ``expression`` and its trigonometric simplification; large ones as they stand.

    Terms with the same factors outside of trigonometric functions are simplified together, which is much faster than
    to treat all symbols alike.
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
def operations(expression: sp.Expr) -> int:
    """The operations of ``expression`` written out; what definitions share may make that a number of many digits."""
    size: dict[sp.Basic, int] = {}
    stack: list[sp.Basic] = [expression]
    while stack:
        top = stack[-1]
        missing = [below for below in top.args if below not in size]
        if missing:
            stack += missing
        else:
            size[stack.pop()] = 1 + sum(size[below] for below in top.args)
    return size[expression] if size[expression] > MAX_ON_PAPER else int(sp.count_ops(expression))
