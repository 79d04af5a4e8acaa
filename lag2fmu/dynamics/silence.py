"""Expressions without their external inputs, also where an input stands in a denominator or logarithm.

Setting inputs to zero is right for forces that vanish with them. It says nothing of 1/u or log(u), which have no value
then: such a term is external as a whole.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.operations import CHOICE, OPERATIONS

_LIMITED = {"divide": (1,), "power": (0, 1), "power_or_zero": (0, 1), "atan2": (0, 1)} | dict.fromkeys(
    ("sqrt", "log", "asin", "acos"), (0,)
)
"""{operation that has values for some operands only: these operands}."""


def without_inputs(graph: Graph, outputs: Sequence[Node], inputs: Iterable[Node]) -> list[Node]:
    """The nodes ``outputs`` (k,) with ``inputs`` set to zero: (k,) nodes.

    A term is left out if it need not have a value then: if it contains a quotient, root or the like of inputs whose
    operand without inputs is no number that it is defined for.
    """
    new: dict[Node, Node] = dict.fromkeys(inputs, graph.zero)
    driven, lost = set(new), set[Node]()
    for node in graph.cone(outputs):
        operands = graph.operands[node]
        if node in new or driven.isdisjoint(operands):
            new.setdefault(node, node)
            continue
        driven.add(node)
        silent, moved = [new[x] for x in operands], [x in driven for x in operands]
        own, below = _is_lost(graph, node, moved, silent), not lost.isdisjoint(operands)
        gone = own or (below and not _is_sum(graph, node, moved))
        new[node] = graph.zero if gone else graph.rebuild(node, silent)
        lost |= {node} if own or below else set()
    return [new[output] for output in outputs]


def _is_lost(graph: Graph, node: Node, driven: Sequence[bool], silent: Sequence[Node]) -> bool:
    """Whether the operation of ``node`` need not have a value at its ``silent`` operands, some being ``driven``."""
    operation = OPERATIONS[graph.code[node]]
    limited = _LIMITED.get(operation.name, ())
    if not any(driven[i] for i in limited):
        return False
    if not all(graph.is_constant(silent[i]) for i in limited):
        return True
    try:
        numbers = [float(graph.value(x)) if graph.is_constant(x) else 1.0 for x in silent]
        return not math.isfinite(operation.value(*numbers))
    except (ValueError, ArithmeticError):
        return True


def _is_sum(graph: Graph, node: Node, driven: Sequence[bool]) -> bool:
    """Whether ``node`` is a sum of multiples of its ``driven`` operands, or a choice of one of them."""
    name = OPERATIONS[graph.code[node]].name
    if name in ("add", "subtract", "negate", "passed"):
        return True
    if graph.code[node] == CHOICE:
        return not driven[0]
    return sum(driven) == 1 and (name == "multiply" or (name == "divide" and driven[0]))
