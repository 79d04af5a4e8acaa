"""The nodes of a graph, found by their operation and operands or by their value.

Source: J.-C. Filliatre, S. Conchon, Type-safe modular hash-consing, ML Workshop 2006.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from types import MappingProxyType
from typing import TypeVar

from lag2fmu.errors import DerivationError
from lag2fmu.graph.fingerprint import PRIME, constant_mark, random_mark
from lag2fmu.graph.nodes import Node, Nodes, Number
from lag2fmu.graph.operations import ADD, CONSTANT, DIVIDE, NEGATE, SUBTRACT, SYMBOL

MAX_BITS = 512
"""Exact constants longer than this are rounded to double precision."""

Same = TypeVar("Same", bound="Store")


class Store(Nodes):
    """The nodes of a graph: a node is found by its operation and operands, or by its value, or else it is added."""

    def __init__(self) -> None:
        super().__init__()
        self._by_mark: dict[int, Node] = {}
        self._by_structure: dict[tuple[int, tuple[Node, ...]], Node] = {}
        self._supports: list[int] = []
        self._groups: dict[str, int] = {}
        self._algebra = True
        self._leaves: dict[Number | str, Node] = {}
        self._inverses: dict[Node, int] = {}
        self.zero: Node = self.constant(0)
        self.one: Node = self.constant(1)
        self.minus_one: Node = self.constant(-1)
        self.constant_half: Node = self.constant(Fraction(1, 2))

    def copy(self: Same) -> Same:
        """A copy to which nodes can be added, even if the original is sealed."""
        other = type(self)()
        for name, content in vars(self).items():
            setattr(other, name, content if isinstance(content, int) else content.copy())
        return other

    def seal(self) -> None:
        """From now on a new node raises TypeError; whoever needs further nodes adds them to a copy."""
        self._by_structure = MappingProxyType(self._by_structure)  # type: ignore[assignment]  # it refuses to be written to

    @contextmanager
    def as_written(self) -> Iterator[None]:
        """A context in which new expressions keep their operations, instead of becoming another node of equal value."""
        before, self._algebra = self._algebra, False
        try:
            yield
        finally:
            self._algebra = before

    def adopt(self, copy: Store) -> None:
        """Take over the nodes of a ``copy`` that has grown."""
        vars(self).update(vars(copy))

    def _new(self, code: int, operands: tuple[Node, ...], mark: int) -> Node:
        node = self._by_structure[code, operands] = Node(len(self.code))
        if self._algebra or self._serves(code, operands):
            self._by_mark[mark] = node
        self.code.append(code)
        self.operands.append(operands)
        self.marks.append(mark)
        self._supports.append(self._support(operands))
        return node

    def _serves(self, code: int, operands: tuple[Node, ...]) -> bool:
        """Whether a new node as written may stand for all nodes of its value: if it is a product of nodes that may."""
        marks, by_mark = self.marks, self._by_mark
        return code not in (ADD, SUBTRACT, DIVIDE) and all(by_mark.get(marks[o]) == o for o in operands)

    def _support(self, operands: Iterable[Node]) -> int:
        """The groups of variables that ``operands`` hold, one bit for each group."""
        support, supports = 0, self._supports
        for operand in operands:
            support |= supports[operand]
        return support

    def _known(self, code: int, operands: tuple[Node, ...], mark: int) -> Node | None:
        """The node of this operation on ``operands``; for a derived expression also a node of equal value."""
        node = self._by_structure.get((code, operands))
        if node is None and self._algebra and mark in self._by_mark:
            return self._equal(operands, mark)
        return node

    def _equal(self, operands: tuple[Node, ...], mark: int) -> Node | None:
        """The node of the known value ``mark``, if it holds no other groups of variables than ``operands``"""
        node = self._by_mark[mark]
        return None if self._supports[node] & ~self._support(operands) else node

    def _opposite(self, operands: tuple[Node, ...], mark: int) -> Node | None:
        """- (the node of the opposite value), if there is one"""
        if not self._algebra or PRIME - mark not in self._by_mark:
            return None
        node = self._equal(operands, PRIME - mark)
        return None if node is None else self._negated(node)

    def _negated(self, a: Node) -> Node:
        node = self._by_structure.get((NEGATE, (a,)))
        return self._new(NEGATE, (a,), -self.marks[a] % PRIME) if node is None else node

    def constant(self, value: Number | int) -> Node:
        """The node of a number; fractions stay exact up to a length of 512 bits.

        Raises DerivationError beyond the range of doubles.
        """
        node = self._leaves.get(value)
        if node is None:
            exact: Number = _rounded(value) if isinstance(value, float) else Fraction(value)
            if isinstance(exact, Fraction) and max(map(int.bit_length, exact.as_integer_ratio())) > MAX_BITS:
                exact = _rounded(exact)
            node = self._leaves.get(exact)
            self._leaves[value] = node = self._new_constant(exact) if node is None else node
        return node

    def _new_constant(self, value: Number) -> Node:
        node = self._leaves[value] = self._new(CONSTANT, (), constant_mark(value))
        self.leaf[node] = value
        return node

    def symbol(self, name: str, group: str | None = None) -> Node:
        """The node of the variable ``name``; where one variable of a ``group`` is known, all of the group are known."""
        node = self._leaves.get(name)
        if node is None:
            node = self._leaves[name] = self._new(SYMBOL, (), random_mark("symbol", name))
            self.leaf[node] = name
            self._supports[node] = 1 << self._groups.setdefault(group or name, len(self._groups))
        return node


def _rounded(value: Number) -> float:
    """The double nearest to ``value``; raises DerivationError for one beyond their range"""
    try:
        nearest = float(value)
    except OverflowError:
        nearest = math.inf
    if not math.isfinite(nearest):
        raise DerivationError(
            "constants of the equations, multiplied or added, go beyond the range of double precision (1e308); "
            "give them in other units"
        )
    return nearest
