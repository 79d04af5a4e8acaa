"""The values of nodes at batches of states, by NumPy; ``Graph.evaluate`` is for one state."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.operations import CONSTANT, LOOKUP, LOOKUP_2, OPERATIONS, SYMBOL

Floats = NDArray[np.float64]
Values = Mapping[str, "float | Floats"]

_NUMPY: dict[str, Callable[..., Any]] = {
    "add": np.add,
    "subtract": np.subtract,
    "multiply": np.multiply,
    "divide": np.divide,
    "negate": np.negative,
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
    "choice": lambda margin, a, b: np.where(margin > 0.0, a, b),
}


def evaluate(graph: Graph, nodes: Sequence[Node], values: Values) -> Floats:
    """The values (k, *batch) of ``nodes`` (k,), in SI units; nan where a node has no value.

    ``values`` is {variable: number or array}; all arrays broadcast to the shape of the batch.
    """
    found: dict[Node, Floats | float] = {}
    with np.errstate(all="ignore"):
        for node in graph.cone(nodes):
            code = graph.code[node]
            if code == CONSTANT:
                found[node] = np.float64(float(graph.value(node)))
            elif code == SYMBOL:
                found[node] = np.asarray(values[str(graph.leaf[node])], dtype=np.float64)
            elif code in (LOOKUP, LOOKUP_2):
                arguments = graph.operands[node][2 if code == LOOKUP else 3 :]
                found[node] = graph.looked_up(node, [found[operand] for operand in arguments])
            else:
                name = OPERATIONS[code].name
                function = _NUMPY.get(name) or getattr(np, name)
                found[node] = function(*(found[operand] for operand in graph.operands[node]))
    batch = np.broadcast_shapes(*{np.shape(x) for x in values.values()})
    result: Floats = np.empty((len(nodes), *batch))
    for i, node in enumerate(nodes):
        result[i, ...] = found[node]
    return result


def matrix(graph: Graph, rows: Sequence[Sequence[Node]], values: Values, columns: int) -> Floats:
    """The values (r, ``columns``) of a matrix of nodes of this shape at the state ``values`` (SI units)."""
    return evaluate(graph, [entry for row in rows for entry in row], values).reshape(len(rows), columns)
