"""The parts of expressions, which are graphs: SymPy walks them as trees, and long ones without end."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import sympy as sp


def parts_of(expressions: Iterable[sp.Expr]) -> Iterator[Any]:
    """Each part of ``expressions`` once, however often it comes; SymPy's ``atoms`` meets it each time."""
    seen, waiting = set[int](), list[sp.Basic](expressions)
    while waiting:
        part = waiting.pop()
        if id(part) not in seen:
            seen.add(id(part))
            waiting += part.args
            yield part


def free_names(expressions: Iterable[sp.Expr]) -> set[str]:
    """The names of all symbols in ``expressions``."""
    return {part.name for part in parts_of(expressions) if part.is_Symbol}
