"""Expressions built again, of any size: with other leaves, and as if their text were read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import islice
from typing import Any

import sympy as sp

COMPARED = 3
"""Nodes of an argument that SymPy may compare with another: of one with 10 that takes 5 ms, of long ones minutes."""


def call(function: Callable[..., sp.Expr], *arguments: sp.Expr) -> sp.Expr:
    """``function`` of ``arguments``, without a search for the least or greatest of them where one is long.

    SymPy's Min and Max compare their arguments as formulas, to leave out those that others make superfluous.
    """
    if function in (sp.Min, sp.Max) and any(has_more_nodes(a, COMPARED) for a in arguments):
        return function(*arguments, evaluate=False)
    return function(*arguments)


def has_more_nodes(expression: sp.Expr, count: int) -> bool:
    """Whether ``expression`` has more than ``count`` nodes; no more of them are looked at."""
    return next(islice(sp.preorder_traversal(expression), count, None), None) is not None


def replaced(expression: sp.Expr, new: Mapping[Any, sp.Expr], *, again: bool = False) -> sp.Expr:
    """``expression`` with parts replaced by those of ``new``, as ``xreplace`` does.

    ``again``: what has no other parts is evaluated again, too, for SymPy leaves abs(abs(x)) at times.
    """
    return _replaced(expression, {**new}, again)


def _replaced(expression: sp.Expr, known: dict[sp.Expr, sp.Expr], again: bool) -> sp.Expr:
    if expression.args and expression not in known:
        parts = tuple(_replaced(a, known, again) for a in expression.args)
        known[expression] = call(expression.func, *parts) if again or parts != expression.args else expression
    return known.get(expression, expression)
