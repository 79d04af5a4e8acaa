"""A hash-consed graph of scalar expressions: every distinct subexpression stands once.

Distinct means distinct in value: nodes are compared by a fingerprint, so that sin(x)^2 + cos(x)^2 is the node 1.

Nodes are integers; a node's operands have smaller numbers, so ascending order is an order of evaluation. Building a
node applies cheap local rewrites (neutral elements, signs, constants folded as exact fractions). The same input
builds the same graph, whatever the hash seed.

Source: J.-C. Filliatre, S. Conchon, Type-safe modular hash-consing, ML Workshop 2006; A. Griewank, A. Walther,
Evaluating Derivatives, SIAM 2008, chapter 2, for the evaluation graph.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from fractions import Fraction

from lag2fmu.dynamics.fingerprint import PRIME, fingerprint
from lag2fmu.dynamics.operations import (
    ADD,
    ARITY,
    CODE,
    CONSTANT,
    DIVIDE,
    MULTIPLY,
    NEGATE,
    OPERATIONS,
    SUBTRACT,
    SYMBOL,
)

Number = Fraction | float
_MAX_BITS = 512  # exact constants longer than this are rounded to double precision


class Graph:
    """The nodes, as parallel lists: operation code, operands (a constant's value and a symbol's name in ``first``)."""

    def __init__(self) -> None:
        self.code: list[int] = []
        self.first: list[object] = []
        self.second: list[int] = []
        self._known: dict[tuple[int, object, int], int] = {}
        self._by_fingerprint: dict[int, int] = {}
        self.fingerprints: list[int] = []
        self.circle: dict[int, tuple[int, int]] = {}
        self.zero: int = self.constant(Fraction(0))
        self.one: int = self.constant(Fraction(1))
        self.minus_one: int = self.constant(Fraction(-1))
        self.constant_half: int = self.constant(Fraction(1, 2))

    def __len__(self) -> int:
        return len(self.code)

    # ------------------------------------------------------------------------------------------------- making nodes

    def _node(self, code: int, first: object, second: int) -> int:
        key = (code, first, second)
        node = self._known.get(key)
        if node is None:
            node = self._known[key] = self._new(code, first, second)
        return node

    def _new(self, code: int, first: object, second: int) -> int:
        """A node of this value: an old one, the opposite of an old one, or a new one."""
        mark = fingerprint(self, code, first, second)
        old = self._by_fingerprint.get(mark)
        if old is not None:
            return old
        opposite = self._by_fingerprint.get(PRIME - mark)
        if opposite is not None and code > SYMBOL and code != NEGATE:
            return self._node(NEGATE, opposite, 0)
        node = self._by_fingerprint[mark] = len(self.code)
        self.code.append(code)
        self.first.append(first)
        self.second.append(second)
        self.fingerprints.append(mark)
        return node

    def constant(self, value: Number | int) -> int:
        """The node of a number; fractions stay exact up to a length of 512 bits."""
        if isinstance(value, (int, Fraction)):
            value = Fraction(value)
            if max(value.numerator.bit_length(), value.denominator.bit_length()) > _MAX_BITS:
                value = float(value)
        return self._node(CONSTANT, value, 0)

    def symbol(self, name: str) -> int:
        """The node of the variable ``name``."""
        return self._node(SYMBOL, name, 0)

    def is_constant(self, node: int) -> bool:
        """Whether ``node`` is a number."""
        return self.code[node] == CONSTANT

    def value(self, node: int) -> Number:
        """The number of a constant node."""
        value = self.first[node]
        assert isinstance(value, (Fraction, float))
        return value

    def operands(self, node: int) -> tuple[int, ...]:
        """The operands of ``node``."""
        arity = ARITY[self.code[node]]
        if arity == 0:
            return ()
        first = self.first[node]
        assert isinstance(first, int)
        return (first,) if arity == 1 else (first, self.second[node])

    # --------------------------------------------------------------------------------------------------- arithmetic

    def negate(self, a: int) -> int:
        """-a"""
        code = self.code[a]
        if code == CONSTANT:
            return self.constant(-self.value(a))
        if code == NEGATE:
            return self.operands(a)[0]
        if code == SUBTRACT:
            x, y = self.operands(a)
            return self.subtract(y, x)
        return self._node(NEGATE, a, 0)

    def add(self, a: int, b: int) -> int:
        """a + b"""
        if a == self.zero:
            return b
        if b == self.zero:
            return a
        code = self.code
        if code[a] == CONSTANT and code[b] == CONSTANT:
            return self.constant(self.value(a) + self.value(b))
        if code[b] == NEGATE:
            return self.subtract(a, self.operands(b)[0])
        if code[a] == NEGATE:
            return self.subtract(b, self.operands(a)[0])
        if a == b:
            return self.multiply(self.constant(2), a)
        if code[b] == SUBTRACT and self.second[b] == a:
            return self.operands(b)[0]
        if code[a] == SUBTRACT and self.second[a] == b:
            return self.operands(a)[0]
        return self._node(ADD, *((a, b) if a < b else (b, a)))

    def subtract(self, a: int, b: int) -> int:
        """a - b"""
        if b == self.zero:
            return a
        if a == self.zero:
            return self.negate(b)
        if a == b:
            return self.zero
        code = self.code
        if code[a] == CONSTANT and code[b] == CONSTANT:
            return self.constant(self.value(a) - self.value(b))
        if code[b] == NEGATE:
            return self.add(a, self.operands(b)[0])
        if code[a] == NEGATE:
            return self.negate(self.add(self.operands(a)[0], b))
        if code[a] == ADD and b in (operands := self.operands(a)):
            return operands[1] if operands[0] == b else operands[0]
        return self._node(SUBTRACT, a, b)

    def multiply(self, a: int, b: int) -> int:
        """a * b; constants are gathered in front, signs are pulled out"""
        if self.zero in (a, b):
            return self.zero
        if a == self.one:
            return b
        if b == self.one:
            return a
        if self.code[b] == CONSTANT:
            a, b = b, a
        if self.code[a] == CONSTANT:
            return self._scale(a, b)
        for x, y in ((a, b), (b, a)):
            if self.code[x] == NEGATE:
                return self.negate(self.multiply(self.operands(x)[0], y))
            if self.code[x] == MULTIPLY and self.code[self.operands(x)[0]] == CONSTANT:
                factor, rest = self.operands(x)
                return self.multiply(factor, self.multiply(rest, y))
        return self._node(MULTIPLY, *((a, b) if a < b else (b, a)))

    def _scale(self, factor: int, b: int) -> int:
        """factor * b with a constant ``factor``, neither 0 nor 1"""
        if self.code[b] == CONSTANT:
            return self.constant(self.value(factor) * self.value(b))
        if factor == self.minus_one:
            return self.negate(b)
        if self.code[b] == NEGATE:
            return self.multiply(self.negate(factor), self.operands(b)[0])
        if self.code[b] == MULTIPLY and self.code[self.operands(b)[0]] == CONSTANT:
            inner, rest = self.operands(b)
            return self.multiply(self.constant(self.value(factor) * self.value(inner)), rest)
        return self._node(MULTIPLY, factor, b)

    def divide(self, a: int, b: int) -> int:
        """a / b; raises ZeroDivisionError if b is the constant 0"""
        if self.code[b] == CONSTANT:
            return self.multiply(self.constant(1 / self.value(b)), a)
        if a == self.zero:
            return a
        if a == b:
            return self.one
        if self.code[a] == NEGATE:
            return self.negate(self.divide(self.operands(a)[0], b))
        if self.code[b] == NEGATE:
            return self.negate(self.divide(a, self.operands(b)[0]))
        return self._node(DIVIDE, a, b)

    def power(self, base: int, exponent: int) -> int:
        """base ** exponent; whole and half powers by repeated squaring and a square root"""
        if not self.is_constant(exponent):
            return self._node(CODE["power"], base, exponent)
        value = self.value(exponent)
        if not isinstance(value, Fraction) or value.denominator > 2:
            return self.apply("power", base, exponent)
        if value < 0:
            return self.divide(self.one, self.power(base, self.constant(-value)))
        whole, half = divmod(value, 1)
        result = self.apply("sqrt", base) if half else self.one
        square, count = base, int(whole)
        while count:
            if count & 1:
                result = self.multiply(result, square)
            square, count = (self.multiply(square, square) if count > 1 else square), count >> 1
        return result

    def apply(self, name: str, *operands: int) -> int:
        """A function of OPERATIONS by name; of constants, its value (exact for the trivial arguments)"""
        if operands == (self.zero,) and name in ("sin", "tan", "asin", "atan", "sinh", "tanh", "sqrt", "abs", "sign"):
            return self.zero
        if operands == (self.zero,) and name in ("cos", "exp", "cosh"):
            return self.one
        if all(self.is_constant(operand) for operand in operands):
            return self.constant(OPERATIONS[CODE[name]].value(*(float(self.value(o)) for o in operands)))
        return self._node(CODE[name], operands[0], operands[1] if len(operands) > 1 else 0)

    def total(self, terms: Iterable[int]) -> int:
        """The sum of ``terms``, from left to right"""
        result = self.zero
        for term in terms:
            result = self.add(result, term)
        return result

    def dot(self, a: Sequence[int], b: Sequence[int]) -> int:
        """The inner product of two vectors of nodes of equal length"""
        return self.total(self.multiply(x, y) for x, y in zip(a, b, strict=True))

    # --------------------------------------------------------------------------------------------------- traversals

    def cone(self, outputs: Iterable[int], given: Collection[int] = ()) -> list[int]:
        """All nodes that ``outputs`` need, ascending; what is below ``given`` nodes is not needed"""
        seen: set[int] = set()
        stack = list(outputs)
        while stack:
            node = stack.pop()
            if node not in seen:
                seen.add(node)
                if node not in given:
                    stack.extend(self.operands(node))
        return sorted(seen)

    def symbols(self, outputs: Iterable[int]) -> set[str]:
        """The names of all variables that ``outputs`` depend on"""
        return {str(self.first[node]) for node in self.cone(outputs) if self.code[node] == SYMBOL}

    def schedule(self, outputs: Iterable[int], given: Collection[int] = ()) -> list[int]:
        """The nodes that ``outputs`` need beside ``given`` ones, in depth-first order: operands shortly before use"""
        done: set[int] = set(given)
        order: list[int] = []
        for output in outputs:
            stack = [(output, False)]
            while stack:
                node, ready = stack.pop()
                if ready:
                    order.append(node)
                elif node not in done:
                    done.add(node)
                    stack.append((node, True))
                    stack.extend((operand, False) for operand in reversed(self.operands(node)))
        return order

    def operations(self, outputs: Iterable[int], given: Collection[int] = ()) -> int:
        """The number of arithmetic operations and function calls that ``outputs`` take beside ``given`` nodes"""
        return sum(self.code[n] not in (CONSTANT, SYMBOL) and n not in given for n in self.cone(outputs, given))

    def frontier(self, outputs: Sequence[int], variables: Collection[int]) -> list[int]:
        """What ``outputs`` need of nodes that do not depend on ``variables``: the operands between both, ascending"""
        moving = set(variables)
        border: set[int] = {output for output in outputs if output not in moving}
        for node in self.cone(outputs):
            operands = self.operands(node)
            if any(operand in moving for operand in operands):
                moving.add(node)
                border |= set(operands)
        return sorted(node for node in border if node not in moving and not self.is_constant(node))

    def substitute(self, outputs: Sequence[int], replacement: Mapping[int, int]) -> list[int]:
        """``outputs`` with nodes replaced, rebuilt through the rewrites"""
        new: dict[int, int] = dict(replacement)
        for node in self.cone(outputs):
            if node not in new:
                new[node] = self.rebuild(node, [new[operand] for operand in self.operands(node)])
        return [new[output] for output in outputs]

    def rebuild(self, node: int, operands: Sequence[int]) -> int:
        """The operation of ``node`` on other ``operands``"""
        code = self.code[node]
        if code in (CONSTANT, SYMBOL):
            return node
        arithmetic = {ADD: self.add, SUBTRACT: self.subtract, MULTIPLY: self.multiply, DIVIDE: self.divide}
        if code in arithmetic:
            return arithmetic[code](*operands)
        name = OPERATIONS[code].name
        if name == "negate":
            return self.negate(*operands)
        return self.power(*operands) if name == "power" else self.apply(name, *operands)

    def evaluate(self, outputs: Sequence[int], values: Mapping[str, float]) -> list[float]:
        """The values of ``outputs`` in double precision; nan where a function has none there"""
        result: dict[int, float] = {}
        for node in self.cone(outputs):
            code = self.code[node]
            if code == CONSTANT:
                result[node] = float(self.value(node))
            elif code == SYMBOL:
                result[node] = values[str(self.first[node])]
            else:
                try:
                    result[node] = OPERATIONS[code].value(*(result[operand] for operand in self.operands(node)))
                except (ValueError, OverflowError, ZeroDivisionError):
                    result[node] = math.nan
        return [result[output] for output in outputs]
