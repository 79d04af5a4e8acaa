"""Conditions: trees of ``Choice`` whose leaves are 1 and 0, and expressions that are put in the place of the leaves."""

from __future__ import annotations

import sympy as sp

from lag2fmu.language.vocabulary import Choice

MAX_CHOICES, MAX_WRITTEN = 30, 5_000
"""How deep choices may be nested, and how many nodes an expression with a condition may have when written out."""


def is_condition(value: sp.Expr) -> bool:
    """Whether ``value`` is 1 or 0 always, as a comparison."""
    return value in (0, 1) or (isinstance(value, Choice) and value.is_condition)


def put(condition: sp.Expr, a: sp.Expr, b: sp.Expr) -> sp.Expr:
    """``a`` for every 1 in the tree of a ``condition``, ``b`` for every 0."""
    if not isinstance(condition, Choice):
        return a if condition == 1 else b
    margin, first, second = condition.args
    return Choice(margin, put(first, a, b), put(second, a, b))


def is_writable(expression: sp.Expr) -> bool:
    """Whether ``expression`` is within the bounds when it is written out, so that its text can be read."""
    nodes, nested = _extent(expression, {})
    return nodes <= MAX_WRITTEN and nested <= MAX_CHOICES


def _extent(expression: sp.Expr, memory: dict[sp.Expr, tuple[int, int]]) -> tuple[int, int]:
    """The number of nodes of ``expression`` when it is written out, and how deep its choices are nested."""
    if expression not in memory:
        found = [_extent(part, memory) for part in expression.args]
        nodes, nested = 1 + sum(n for n, _ in found), max((d for _, d in found), default=0)
        memory[expression] = nodes, nested + isinstance(expression, Choice)
    return memory[expression]
