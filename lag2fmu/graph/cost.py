"""What an evaluation costs: not only its operations, also how long they wait for each other."""

from __future__ import annotations

from collections.abc import Sequence

from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.operations import CODE, SYMBOL

_CYCLES = {"constant": 0, "symbol": 0, "add": 4, "subtract": 4, "multiply": 4, "divide": 14, "negate": 1, "sqrt": 18}
_FUNCTION = 40
_LATENCY = tuple(_CYCLES.get(name, _FUNCTION) for name in CODE)
"""Cycles from operands to result, about. Source: A. Fog, Instruction tables, for processors of 2015 to 2022."""

_AT_ONCE = 2
"""Operations that are begun in a cycle where they need not wait; measured, with loads and stores between them."""


def cycles(graph: Graph, outputs: Sequence[Node]) -> float:
    """About how many cycles of a processor ``outputs`` take: the longest chain, and all operations, two a cycle.

    An elimination along a chain of links waits for a division and the products behind it at every link; more
    operations that wait less may be done sooner. Source: R. P. Brent, The parallel evaluation of general arithmetic
    expressions, J. ACM 21 (1974), pp. 201-206: time <= chain + operations / processors.
    """
    code, operands = graph.code, graph.operands
    ready: dict[Node, int] = {}
    operations = 0
    for node in graph.cone(outputs):
        wait = max(map(ready.__getitem__, operands[node]), default=0)
        ready[node] = wait + _LATENCY[code[node]]
        operations += code[node] > SYMBOL
    return max(ready.values(), default=0) + operations / _AT_ONCE
