"""Reading an expression graph: which nodes an output needs, in which order, and the values of nodes."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from fractions import Fraction
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, NewType

from numpy.typing import ArrayLike

from lag2fmu.graph.operations import ADD, CONSTANT, LOOKUP, LOOKUP_2, MULTIPLY, OPERATIONS, SUBTRACT, SYMBOL

if TYPE_CHECKING:
    from lag2fmu.graph.interpolants import Floats, Interpolant

Node = NewType("Node", int)
"""The number of a node; it has a meaning only together with its graph."""

Number = Fraction | float


class Nodes:
    """The nodes of a graph; a node's operands have smaller numbers than the node itself.

    - ``code``, ``operands``, ``marks``: the operation, the operands and the fingerprint of each node, by its number.
    - ``leaf``: {node: value of a constant or name of a variable}, for constants and variables only.
    - ``tables``: the tables of measured data, which lookups refer to by index.
    """

    def __init__(self) -> None:
        self.code: list[int] = []
        self.operands: list[tuple[Node, ...]] = []
        self.leaf: dict[Node, Number | str] = {}
        self.marks: list[int] = []
        self.tables: list[Interpolant] = []

    def __len__(self) -> int:
        return len(self.code)

    def is_constant(self, node: Node) -> bool:
        """Whether ``node`` is a number."""
        return self.code[node] == CONSTANT

    def value(self, node: Node) -> Number:
        """The number of a constant node."""
        value = self.leaf[node]
        if isinstance(value, str):
            raise TypeError(f"node {node} is the symbol '{value}'; ask is_constant first")
        return value

    def cone(self, outputs: Iterable[Node], given: Collection[Node] = ()) -> list[Node]:
        """All nodes that ``outputs`` need, ascending; operands of ``given`` nodes are not needed."""
        return sorted(self._reached(outputs, given))

    def _reached(self, outputs: Iterable[Node], given: Collection[Node]) -> set[Node]:
        operands = self.operands
        seen = set(outputs)
        stack = list(seen)
        while stack:
            node = stack.pop()
            if node in given:
                continue
            for operand in operands[node]:
                if operand not in seen:
                    seen.add(operand)
                    stack.append(operand)
        return seen

    def symbols(self, outputs: Iterable[Node]) -> set[str]:
        """The names of all variables that ``outputs``, (k,) nodes, depend on"""
        return {str(self.leaf[node]) for node in self.cone(outputs) if self.code[node] == SYMBOL}

    def symbols_of_each(self, groups: Sequence[Sequence[Node]]) -> list[set[str]]:
        """The names of all variables that each of the ``groups``, (k,) lists of nodes, depends on, in one pass."""
        variables: list[str] = []
        used: dict[Node, int] = {}  # the variables of a node as bits
        for node in self.cone([node for group in groups for node in group]):
            if self.code[node] == SYMBOL:
                used[node] = 1 << len(variables)
                variables.append(str(self.leaf[node]))
            else:
                used[node] = reduce(or_, (used[operand] for operand in self.operands[node]), 0)
        together = [reduce(or_, (used[node] for node in group), 0) for group in groups]
        return [{name for i, name in enumerate(variables) if bits >> i & 1} for bits in together]

    def schedule(self, outputs: Iterable[Node], given: Collection[Node] = ()) -> list[Node]:
        """The nodes that ``outputs`` need beside ``given`` ones, in depth-first order: operands shortly before use"""
        done: set[int] = set(given)
        order: list[Node] = []
        for output in outputs:
            stack: list[int] = [output]
            while stack:
                node = stack.pop()
                if node < 0:  # the bitwise complement marks a node whose operands are in the list already
                    order.append(Node(~node))
                elif node not in done:
                    done.add(node)
                    stack.append(~node)
                    stack += reversed(self.operands[node])
        return order

    def operations(self, outputs: Iterable[Node], given: Collection[Node] = ()) -> int:
        """The number of arithmetic operations and function calls that ``outputs`` take beside ``given`` nodes"""
        code, reached = self.code, self._reached(outputs, given)
        return sum(code[node] > SYMBOL for node in reached.difference(given))

    def depending(self, outputs: Iterable[Node], variables: Collection[Node]) -> set[Node]:
        """The nodes that ``outputs`` need, themselves included, and that depend on ``variables``."""
        moving = set(variables)
        reached = self.cone(outputs)
        for node in reached:
            if not moving.isdisjoint(self.operands[node]):
                moving.add(node)
        return moving.intersection(reached)

    def frontier(self, outputs: Sequence[Node], variables: Collection[Node]) -> list[Node]:
        """The nodes that do not depend on ``variables``, but are operands of nodes that do or are ``outputs``.

        They are ascending and without constants.
        """
        moving = self.depending(outputs, variables)
        border = {*outputs}.union(*(self.operands[node] for node in moving.difference(variables)))
        return sorted(node for node in border - moving if not self.is_constant(node))

    def looked_up(self, node: Node, arguments: Sequence[ArrayLike]) -> Floats:
        """The values (*batch) of the lookup ``node`` at one or two ``arguments`` (*batch), in SI units."""
        table, *rest = self.operands[node]
        orders = [int(self.value(order)) for order in rest[: len(arguments)]]
        return self.tables[int(self.value(table))](orders, *arguments)

    def evaluate(self, outputs: Sequence[Node], values: Mapping[str, float]) -> list[float]:
        """The values of ``outputs``, (k,) nodes, in double precision; nan where a function has none.

        ``values`` {variable: SI value} has every variable that ``outputs`` depend on. For many states at once see
        ``batches.evaluate``.
        """
        result: dict[Node, float] = {}
        for node in self.cone(outputs):
            code, operands = self.code[node], self.operands[node]
            if code == MULTIPLY:
                result[node] = result[operands[0]] * result[operands[1]]
            elif code == ADD:
                result[node] = result[operands[0]] + result[operands[1]]
            elif code == SUBTRACT:
                result[node] = result[operands[0]] - result[operands[1]]
            elif code == SYMBOL:
                result[node] = values[str(self.leaf[node])]
            elif code == CONSTANT:
                result[node] = float(self.value(node))
            elif code in (LOOKUP, LOOKUP_2):
                arguments = operands[2:] if code == LOOKUP else operands[3:]
                result[node] = float(self.looked_up(node, [result[operand] for operand in arguments]))
            else:
                result[node] = value_of(OPERATIONS[code].value, [result[operand] for operand in operands])
        return [result[output] for output in outputs]


def value_of(function: Callable[..., float], arguments: Sequence[float]) -> float:
    """``function`` of ``arguments``; nan where it has no value, or none within the range of doubles"""
    try:
        return function(*arguments)
    except (ValueError, OverflowError, ZeroDivisionError):
        return math.nan
