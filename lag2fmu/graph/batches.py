"""The values of nodes at batches of states, by NumPy; ``Graph.evaluate`` is for one state."""

from __future__ import annotations

import operator
import random
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.operations import CONSTANT, LOOKUP, LOOKUP_2, OPERATIONS, SYMBOL

Floats = NDArray[np.float64]
Values = Mapping[str, "float | Floats"]


def drawn(generator: random.Random, size: float, count: int) -> Floats:
    """``count`` random numbers (count,) between -``size`` and ``size``.

    Reading NumPy's own generators takes 12 ms, a sixtieth of a small export.
    """
    return np.array([generator.uniform(-size, size) for _ in range(count)])


_NUMPY: dict[str, Callable[..., Any]] = {
    # Python's operators are those of NumPy on its numbers and arrays, and take a tenth of the time on single numbers
    "add": operator.add,
    "subtract": operator.sub,
    "multiply": operator.mul,
    "divide": operator.truediv,
    "negate": operator.neg,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "abs": np.abs,
    "heaviside": lambda x: np.heaviside(x, 0.5),
    "atan2": np.arctan2,
    "power": np.power,
    "power_or_zero": lambda x, exponent: np.where(x == 0.0, 0.0, np.power(x, exponent)),
    "min": np.minimum,
    "max": np.maximum,
    "passed": lambda x: x,
    "sloped": lambda slope, rate: np.where(rate == 0.0, 0.0, slope * rate),
    "choice": lambda margin, a, b: np.where(margin > 0.0, a, b),
}


class Evaluator:
    """The values of nodes at batches of states; what is called often looks for the operations only once."""

    def __init__(self, graph: Graph, nodes: Sequence[Node]) -> None:
        """Plan the evaluation of ``nodes`` (k,)."""
        order = graph.cone(nodes)
        place = {node: i for i, node in enumerate(order)}
        self._places = [place[node] for node in nodes]
        self._constants: list[Any] = [None] * len(order)
        self._symbols: list[tuple[int, str]] = []
        self._steps: list[tuple[int, Callable[..., Any], list[int]]] = []
        for i, node in enumerate(order):
            code, operands = graph.code[node], graph.operands[node]
            if code == CONSTANT:
                self._constants[i] = np.float64(float(graph.value(node)))
            elif code == SYMBOL:
                self._symbols.append((i, str(graph.leaf[node])))
            else:
                looked_up = code in (LOOKUP, LOOKUP_2)
                arguments = operands[2 if code == LOOKUP else 3 :] if looked_up else operands
                function = _looking_up(graph, node) if looked_up else _function(OPERATIONS[code].name)
                self._steps.append((i, function, [place[operand] for operand in arguments]))

    def __call__(self, values: Values) -> Floats:
        """The values (k, *batch), in SI units; ``values`` are as for ``evaluate``."""
        found = self._constants.copy()
        for i, name in self._symbols:
            found[i] = np.asarray(values[name], dtype=np.float64)[()]  # a number, if it has no dimensions
        with np.errstate(all="ignore"):
            for i, function, operands in self._steps:
                if len(operands) == 2:
                    found[i] = function(found[operands[0]], found[operands[1]])
                else:
                    found[i] = function(*(found[operand] for operand in operands))
        batch = np.broadcast_shapes(*{getattr(x, "shape", ()) for x in values.values()})
        result: Floats = np.empty((len(self._places), *batch))
        for row, i in enumerate(self._places):
            result[row, ...] = found[i]
        return result


def _function(name: str) -> Callable[..., Any]:
    return _NUMPY.get(name) or getattr(np, name)


def _looking_up(graph: Graph, node: Node) -> Callable[..., Floats]:
    return lambda *arguments: graph.looked_up(node, arguments)


def evaluate(graph: Graph, nodes: Sequence[Node], values: Values) -> Floats:
    """The values (k, *batch) of ``nodes`` (k,), in SI units; nan where a node has no value.

    ``values`` is {variable: number or array}; all arrays broadcast to the shape of the batch.
    """
    return Evaluator(graph, nodes)(values)


def matrix(graph: Graph, rows: Sequence[Sequence[Node]], values: Values, columns: int) -> Floats:
    """The values (r, ``columns``) of a matrix of nodes of this shape at the state ``values`` (SI units)."""
    return evaluate(graph, [entry for row in rows for entry in row], values).reshape(len(rows), columns)
