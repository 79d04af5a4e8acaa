"""What an evaluation costs: the number of its operations, and how long they wait for each other."""

from __future__ import annotations

from collections.abc import Sequence

from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.operations import CODE, SYMBOL

_CYCLES = {"constant": 0, "symbol": 0, "add": 4, "subtract": 4, "multiply": 4, "divide": 14, "negate": 1, "sqrt": 18}
_FUNCTION = 40
_LATENCY = tuple(_CYCLES.get(name, _FUNCTION) for name in CODE)
"""About how many cycles an operation takes from its operands to its result.

Source: A. Fog, Instruction tables, for processors of 2015 to 2022.
"""

_AT_ONCE = 2
"""How many operations a processor begins in a cycle if none has to wait, as measured with loads and stores between."""


def cycles(graph: Graph, outputs: Sequence[Node]) -> float:
    """About how many cycles of a processor ``outputs`` take: the longest chain of operations, plus all at full rate.

    Fewer operations are not always faster. An elimination along a chain of links waits at every link for a division
    and the products that need its result. A method with more operations that wait less may be done sooner. Source: R.
    P. Brent, The parallel evaluation of general arithmetic expressions, J. ACM 21 (1974), pp. 201-206: time <= chain +
    operations / processors.
    """
    code, operands = graph.code, graph.operands
    ready = [0] * len(code)
    operations = 0
    for node in graph.cone(outputs):
        wait = 0
        for operand in operands[node]:
            wait = ready[operand] if ready[operand] > wait else wait  # a call of max takes three times as long
        ready[node] = wait + _LATENCY[code[node]]
        operations += code[node] > SYMBOL
    return max(ready, default=0) + operations / _AT_ONCE
