"""Conditions: trees of ``Choice`` whose leaves are 1 and 0, and the expressions that replace these leaves."""

from __future__ import annotations

import sympy as sp

from lag2fmu.language.vocabulary import Choice

MAX_CHOICES, MAX_WRITTEN = 30, 5_000
"""How deep choices may be nested, and how many nodes a written-out expression with a condition may have."""


def is_condition(value: sp.Expr) -> bool:
    """Whether ``value`` is always 1 or 0, as a comparison is."""
    return value in (0, 1) or (isinstance(value, Choice) and value.is_condition)


def put(condition: sp.Expr, a: sp.Expr, b: sp.Expr) -> sp.Expr:
    """``a`` for every 1 in the tree of a ``condition``, ``b`` for every 0."""
    if not isinstance(condition, Choice):
        return a if condition == 1 else b
    margin, first, second = condition.args
    return Choice(margin, put(first, a, b), put(second, a, b))


def is_writable(expression: sp.Expr) -> bool:
    """Whether ``expression``, written out, is within the bounds that the parser sets."""
    nodes, nested = _extent(expression, {})
    return nodes <= MAX_WRITTEN and nested <= MAX_CHOICES


def _extent(expression: sp.Expr, memory: dict[sp.Expr, tuple[int, int]]) -> tuple[int, int]:
    """(number of nodes of ``expression`` when it is written out, depth of its nested choices)."""
    if expression not in memory:
        found = [_extent(part, memory) for part in expression.args]
        nodes, nested = 1 + sum(n for n, _ in found), max((d for _, d in found), default=0)
        memory[expression] = nodes, nested + isinstance(expression, Choice)
    return memory[expression]
