"""A hash-consed graph of scalar expressions: every distinct subexpression stands once.

Derived expressions of equal value are one node: nodes are compared by a fingerprint, so that sin(x)^2 + cos(x)^2 is
the node 1. Expressions that the user wrote are one node only if their operations are equal, see ``Graph.as_written``:
of two formulas of one value the user may have chosen the one that rounds less, or that is defined where the other one
is not.

Nodes are integers. A node's operands have smaller numbers, so ascending order is an order of evaluation. Building a
node applies cheap local rewrites (neutral elements, signs, constants folded as exact fractions). The same input
builds the same graph, whatever the hash seed.

Source: J.-C. Filliatre, S. Conchon, Type-safe modular hash-consing, ML Workshop 2006; A. Griewank, A. Walther,
Evaluating Derivatives, SIAM 2008, chapter 2, for the evaluation graph.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction

from lag2fmu.graph.circle import Circle
from lag2fmu.graph.fingerprint import PRIME, inverse_mark, random_mark
from lag2fmu.graph.nodes import Node, Number, value_of
from lag2fmu.graph.operations import (
    ADD,
    CODE,
    CONSTANT,
    COSINE,
    DIVIDE,
    LOOKUP,
    LOOKUP_2,
    MULTIPLY,
    NEGATE,
    OPERATIONS,
    SINE,
    SUBTRACT,
    SYMBOL,
)
from lag2fmu.graph.store import Store

__all__ = ["Graph", "Node", "Number"]


class Graph(Store):
    """The nodes, and how new ones are made.

    An operation first looks for a node with the same operands. If the operation is derived, it also looks for a node
    of the same or the opposite value that holds no other groups of variables. Rewrites are tried only if there is
    none. Raises DerivationError where a combination of constants goes beyond the range of doubles.
    """

    def __init__(self) -> None:
        super().__init__()
        self._circle = Circle()
        self._constant_products: dict[tuple[Node, Node], Node] = {}

    # --------------------------------------------------------------------------------------------------- arithmetic

    def negate(self, a: Node) -> Node:
        """-a"""
        if self.code[a] == CONSTANT:
            return self.constant(-self.value(a))
        if self.code[a] == NEGATE:
            return self.operands[a][0]
        node = self._known(NEGATE, (a,), -self.marks[a] % PRIME)
        return self._negated(a) if node is None else node

    def add(self, a: Node, b: Node) -> Node:
        """a + b"""
        if self.zero in (a, b):
            return a if b == self.zero else b
        mark = (self.marks[a] + self.marks[b]) % PRIME
        node = self._known(ADD, (a, b) if a < b else (b, a), mark)
        return self._sum(a, b, mark) if node is None else node

    def _sum(self, a: Node, b: Node, mark: int) -> Node:
        code = self.code
        if code[a] == CONSTANT and code[b] == CONSTANT:
            return self.constant(self.value(a) + self.value(b))
        opposite = self._opposite((a, b), mark)
        if opposite is not None:
            return opposite
        if code[b] == NEGATE:
            return self.subtract(a, self.operands[b][0])
        if code[a] == NEGATE:
            return self.subtract(b, self.operands[a][0])
        if a == b:
            return self._scaled(self.constant(2), a, mark)
        return self._new(ADD, (a, b) if a < b else (b, a), mark)

    def subtract(self, a: Node, b: Node) -> Node:
        """a - b"""
        if a == b:
            return self.zero
        if self.zero in (a, b):
            return a if b == self.zero else self.negate(b)
        mark = (self.marks[a] - self.marks[b]) % PRIME
        node = self._known(SUBTRACT, (a, b), mark)
        return self._difference(a, b, mark) if node is None else node

    def _difference(self, a: Node, b: Node, mark: int) -> Node:
        code = self.code
        if code[a] == CONSTANT and code[b] == CONSTANT:
            return self.constant(self.value(a) - self.value(b))
        opposite = self._opposite((a, b), mark)
        if opposite is not None:
            return opposite
        if code[b] == NEGATE:
            return self.add(a, self.operands[b][0])
        if code[a] == NEGATE:
            return self.negate(self.add(self.operands[a][0], b))
        return self._new(SUBTRACT, (a, b), mark)

    def multiply(self, a: Node, b: Node) -> Node:
        """a * b, with constants gathered in front and signs pulled out."""
        if self.code[b] == CONSTANT:
            a, b = b, a
        if self.code[a] == CONSTANT:
            return self._multiple(a, b)
        mark = self.marks[a] * self.marks[b] % PRIME
        node = self._known(MULTIPLY, (a, b) if a < b else (b, a), mark)
        return self._product(a, b, mark) if node is None else node

    def _product(self, a: Node, b: Node, mark: int) -> Node:
        code = self.code
        opposite = self._opposite((a, b), mark)
        if opposite is not None:
            return opposite
        for x, y in ((a, b), (b, a)):
            kind, operands = code[x], self.operands[x]
            if kind == NEGATE:
                return self.negate(self.multiply(operands[0], y))
            if kind == MULTIPLY and code[operands[0]] == CONSTANT:
                return self.multiply(operands[0], self.multiply(operands[1], y))
        return self._new(MULTIPLY, (a, b) if a < b else (b, a), mark)

    def _multiple(self, factor: Node, b: Node) -> Node:
        """factor * b with a constant ``factor``"""
        if self.code[b] == CONSTANT:
            return self._constant_product(factor, b)
        if factor in (self.zero, self.one):
            return b if factor == self.one else self.zero
        mark = self.marks[factor] * self.marks[b] % PRIME
        node = self._known(MULTIPLY, (factor, b), mark)
        return self._scaled(factor, b, mark) if node is None else node

    def _scaled(self, factor: Node, b: Node, mark: int) -> Node:
        opposite = self._opposite((b,), mark)
        if opposite is not None:
            return opposite
        if factor == self.minus_one:
            return self.negate(b)
        if self.code[b] == NEGATE:
            return self.multiply(self.negate(factor), self.operands[b][0])
        if self.code[b] == MULTIPLY and self.code[self.operands[b][0]] == CONSTANT:
            inner, rest = self.operands[b]
            return self.multiply(self._constant_product(factor, inner), rest)
        return self._new(MULTIPLY, (factor, b), mark)

    def _constant_product(self, a: Node, b: Node) -> Node:
        """a * b of two constants; the few products of a mechanism's constants are asked for often, and are kept."""
        node = self._constant_products.get((a, b))
        if node is None:
            node = self._constant_products[a, b] = self.constant(self.value(a) * self.value(b))
        return node

    def divide(self, a: Node, b: Node) -> Node:
        """a / b; raises ZeroDivisionError if b is the constant 0"""
        if self.code[b] == CONSTANT:
            return self.multiply(self.constant(1 / self.value(b)), a)
        if a in (self.zero, b):
            return self.zero if a == self.zero else self.one
        inverse = self._inverses.get(b)
        if inverse is None:
            inverse = self._inverses[b] = inverse_mark(self.marks[b])
        mark = self.marks[a] * inverse % PRIME
        node = self._known(DIVIDE, (a, b), mark)
        return self._quotient(a, b, mark) if node is None else node

    def _quotient(self, a: Node, b: Node, mark: int) -> Node:
        opposite = self._opposite((a, b), mark)
        if opposite is not None:
            return opposite
        if self.code[a] == NEGATE:
            return self.negate(self.divide(self.operands[a][0], b))
        if self.code[b] == NEGATE:
            return self.negate(self.divide(a, self.operands[b][0]))
        return self._new(DIVIDE, (a, b), mark)

    def power(self, base: Node, exponent: Node) -> Node:
        """base ** exponent: whole powers by repeated squaring, multiples of 1/2 up to 1 with a square root.

        The derivatives of other powers above 1 are 0 where the base is 0, see ``operations``. Source: D. Knuth,
        The Art of Computer Programming, volume 2, section 4.6.3 (the binary method).
        """
        if not self.is_constant(exponent):
            return self._function(CODE["power"], (base, exponent))
        value = self.value(exponent)
        if value > 1 and value % 1:
            return self.apply("power_or_zero", base, exponent)
        if value % Fraction(1, 2):
            return self.apply("power", base, exponent)
        return self._root_power(base, Fraction(value))

    def _root_power(self, base: Node, value: Fraction) -> Node:
        """base ** value for a multiple of 1/2"""
        if value < 0:
            return self.divide(self.one, self._root_power(base, -value))
        whole, half = divmod(value, 1)
        result = self.apply("sqrt", base) if half else self.one
        square, count = base, int(whole)
        while count:
            if count & 1:
                result = self.multiply(result, square)
            square, count = (self.multiply(square, square) if count > 1 else square), count >> 1
        return result

    def apply(self, name: str, *operands: Node) -> Node:
        """The function ``name`` of OPERATIONS of ``operands``; a constant if all operands are constants."""
        code = CODE[name]
        node = self._by_structure.get((code, operands))
        if node is not None:
            return node
        if operands == (self.zero,) and name in ("sin", "tan", "asin", "atan", "sinh", "tanh", "sqrt", "abs", "sign"):
            return self.zero
        if operands == (self.zero,) and name in ("cos", "exp", "cosh"):
            return self.one
        if all(self.is_constant(operand) for operand in operands):
            value = value_of(OPERATIONS[code].value, [float(self.value(o)) for o in operands])
            if math.isfinite(value):  # else the checks of numbers refuse it, which can name the expression
                return self.constant(value)
        return self._function(code, operands)

    def choose(self, margin: Node, a: Node, b: Node) -> Node:
        """a where ``margin`` > 0, b elsewhere"""
        if a == b:
            return a
        if self.is_constant(margin):
            return a if self.value(margin) > 0 else b
        return self.apply("choice", margin, a, b)

    def lookup(self, table: Node, orders: Sequence[Node], arguments: Sequence[Node]) -> Node:
        """The partial derivative of a table at ``arguments``, with an order in ``orders`` for each argument.

        ``table``, the index in ``tables``, and ``orders`` are constant nodes.
        """
        highest = max(int(self.value(order)) for order in orders)
        if highest > self.tables[int(self.value(table))].degree:
            return self.zero
        code = LOOKUP if len(arguments) == 1 else LOOKUP_2
        node = self._by_structure.get((code, (table, *orders, *arguments)))
        return self._function(code, (table, *orders, *arguments)) if node is None else node

    def _function(self, code: int, operands: tuple[Node, ...]) -> Node:
        if code in (SINE, COSINE):
            mark = self._circle.point(self, operands[0])[code == SINE]
        else:
            mark = random_mark(OPERATIONS[code].name, [self.marks[operand] for operand in operands])
        node = self._known(code, operands, mark)
        if node is None:
            node = self._opposite(operands, mark)
        return self._new(code, operands, mark) if node is None else node

    def total(self, terms: Iterable[Node]) -> Node:
        """The sum of ``terms``, from left to right"""
        result = self.zero
        for term in terms:
            result = self.add(result, term)
        return result

    def dot(self, a: Sequence[Node], b: Sequence[Node]) -> Node:
        """The inner product of two vectors of nodes of equal length"""
        return self.total(self.multiply(x, y) for x, y in zip(a, b, strict=True))

    # --------------------------------------------------------------------------------------------------- rebuilding

    def substitute(self, outputs: Sequence[Node], replacement: Mapping[Node, Node]) -> list[Node]:
        """The nodes ``outputs`` (k,) with nodes replaced {old: new}: (k,) nodes, rebuilt by the same rewrites."""
        new: dict[Node, Node] = dict(replacement)
        for node in self.cone(outputs):
            if node not in new:
                new[node] = self.rebuild(node, [new[operand] for operand in self.operands[node]])
        return [new[output] for output in outputs]

    def rebuild(self, node: Node, operands: Sequence[Node]) -> Node:
        """The operation of ``node`` applied to other ``operands``."""
        code = self.code[node]
        if code in (CONSTANT, SYMBOL):
            return node
        arithmetic = {ADD: self.add, SUBTRACT: self.subtract, MULTIPLY: self.multiply, DIVIDE: self.divide}
        if code in arithmetic:
            return arithmetic[code](*operands)
        name = OPERATIONS[code].name
        if name == "negate":
            return self.negate(*operands)
        if name == "choice":
            return self.choose(*operands)
        return self.power(*operands) if name == "power" else self.apply(name, *operands)
