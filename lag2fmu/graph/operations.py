"""The operations of the expression graph: one row an operation, with its value, its derivative and its spelling in C.

A derivative is given as a function of the graph, the operands and the result, and returns the partial derivatives with
respect to the operands as nodes. Sources: Abramowitz and Stegun, sections 4.2-4.6; for min and max the mean of both
one-sided derivatives where the operands are equal. ``power_or_zero`` is a broken power above 1 and what its derivatives
are made of: where the base rests at 0, as that of max(0, -x)**(5/2) does, all of them are 0, not infinity times 0.
A lookup has constants in front: the number of its table, and an order of derivatives for each argument.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from lag2fmu.graph.graph import Graph, Node

Partials: TypeAlias = "tuple[Node, ...]"
Derivative: TypeAlias = "Callable[[Graph, tuple[Node, ...], Node], Partials]"


@dataclass(frozen=True)
class Operation:
    """``value`` computes with floats, ``derivative`` gives the partials as nodes, ``c`` is a format of the operands."""

    name: str
    arity: int
    value: Callable[..., float]
    derivative: Derivative | None
    c: str


def _sign(x: float) -> float:
    return math.copysign(1.0, x) if x else 0.0


def _heaviside(x: float) -> float:
    return 0.5 * (1.0 + _sign(x))


def _power_or_zero(base: float, exponent: float) -> float:
    return math.pow(base, exponent) if base else 0.0


def _divide(a: float, b: float) -> float:
    return a / b if b else math.nan


def _negative(g: Graph, x: Node) -> Node:
    return g.negate(x)


def _one_minus_square(g: Graph, x: Node) -> Node:
    return g.subtract(g.one, g.multiply(x, x))


def _one_plus_square(g: Graph, x: Node) -> Node:
    return g.add(g.one, g.multiply(x, x))


def _inverse_root(g: Graph, x: Node) -> Node:
    return g.divide(g.one, g.apply("sqrt", _one_minus_square(g, x)))


def _d_atan2(g: Graph, operands: tuple[Node, ...], _: Node) -> Partials:
    y, x = operands
    square = g.add(g.multiply(x, x), g.multiply(y, y))
    return g.divide(x, square), g.negate(g.divide(y, square))


def _d_power(g: Graph, operands: tuple[Node, ...], result: Node) -> Partials:
    base, exponent = operands
    by_base = g.multiply(exponent, g.power(base, g.subtract(exponent, g.one)))
    return by_base, g.zero if g.is_constant(exponent) else g.multiply(result, g.apply("log", base))


def _d_power_or_zero(g: Graph, operands: tuple[Node, ...], _: Node) -> Partials:
    base, exponent = operands
    return g.multiply(exponent, g.apply("power_or_zero", base, g.subtract(exponent, g.one))), g.zero


def _d_min(g: Graph, operands: tuple[Node, ...], _: Node) -> Partials:
    a, b = operands
    return g.apply("heaviside", g.subtract(b, a)), g.apply("heaviside", g.subtract(a, b))


def _d_max(g: Graph, operands: tuple[Node, ...], _: Node) -> Partials:
    a, b = operands
    return g.apply("heaviside", g.subtract(a, b)), g.apply("heaviside", g.subtract(b, a))


def _d_lookup(g: Graph, operands: tuple[Node, ...], _: Node) -> Partials:
    table, order, x = operands
    return g.zero, g.zero, g.lookup(table, (g.add(order, g.one),), (x,))


def _d_lookup_2(g: Graph, operands: tuple[Node, ...], _: Node) -> Partials:
    table, first, second, x, y = operands
    by_x = g.lookup(table, (g.add(first, g.one), second), (x, y))
    by_y = g.lookup(table, (first, g.add(second, g.one)), (x, y))
    return g.zero, g.zero, g.zero, by_x, by_y


def _in_table(*_: float) -> float:
    return math.nan  # the graph knows the tables, see ``Graph.looked_up``


_ROWS = (
    Operation("constant", 0, lambda: math.nan, None, ""),
    Operation("symbol", 0, lambda: math.nan, None, ""),
    Operation("add", 2, lambda a, b: a + b, lambda g, o, y: (g.one, g.one), "{0} + {1}"),
    Operation("subtract", 2, lambda a, b: a - b, lambda g, o, y: (g.one, g.minus_one), "{0} - {1}"),
    Operation("multiply", 2, lambda a, b: a * b, lambda g, o, y: (o[1], o[0]), "{0} * {1}"),
    Operation(
        "divide",
        2,
        _divide,
        lambda g, o, y: (g.divide(g.one, o[1]), g.negate(g.divide(y, o[1]))),
        "{0} / {1}",
    ),
    Operation("negate", 1, lambda a: -a, lambda g, o, y: (g.minus_one,), "-{0}"),
    Operation("sqrt", 1, math.sqrt, lambda g, o, y: (g.divide(g.constant_half, y),), "sqrt({0})"),
    Operation("exp", 1, math.exp, lambda g, o, y: (y,), "exp({0})"),
    Operation("log", 1, math.log, lambda g, o, y: (g.divide(g.one, o[0]),), "log({0})"),
    Operation("sin", 1, math.sin, lambda g, o, y: (g.apply("cos", o[0]),), "sin({0})"),
    Operation("cos", 1, math.cos, lambda g, o, y: (_negative(g, g.apply("sin", o[0])),), "cos({0})"),
    Operation("tan", 1, math.tan, lambda g, o, y: (_one_plus_square(g, y),), "tan({0})"),
    Operation("asin", 1, math.asin, lambda g, o, y: (_inverse_root(g, o[0]),), "asin({0})"),
    Operation("acos", 1, math.acos, lambda g, o, y: (_negative(g, _inverse_root(g, o[0])),), "acos({0})"),
    Operation("atan", 1, math.atan, lambda g, o, y: (g.divide(g.one, _one_plus_square(g, o[0])),), "atan({0})"),
    Operation("sinh", 1, math.sinh, lambda g, o, y: (g.apply("cosh", o[0]),), "sinh({0})"),
    Operation("cosh", 1, math.cosh, lambda g, o, y: (g.apply("sinh", o[0]),), "cosh({0})"),
    Operation("tanh", 1, math.tanh, lambda g, o, y: (_one_minus_square(g, y),), "tanh({0})"),
    Operation("abs", 1, math.fabs, lambda g, o, y: (g.apply("sign", o[0]),), "fabs({0})"),
    Operation("sign", 1, _sign, lambda g, o, y: (g.zero,), "sign({0})"),
    Operation("heaviside", 1, _heaviside, lambda g, o, y: (g.zero,), "heaviside({0})"),
    Operation("atan2", 2, math.atan2, _d_atan2, "atan2({0}, {1})"),
    Operation("power", 2, math.pow, _d_power, "pow({0}, {1})"),
    Operation("power_or_zero", 2, _power_or_zero, _d_power_or_zero, "power_or_zero({0}, {1})"),
    Operation("min", 2, min, _d_min, "fmin({0}, {1})"),
    Operation("max", 2, max, _d_max, "fmax({0}, {1})"),
    Operation("lookup", 3, _in_table, _d_lookup, ""),
    Operation("lookup_2", 5, _in_table, _d_lookup_2, ""),
)

OPERATIONS: tuple[Operation, ...] = _ROWS
CODE = {row.name: code for code, row in enumerate(OPERATIONS)}
ARITY = tuple(row.arity for row in OPERATIONS)
CONSTANT, SYMBOL, ADD, SUBTRACT, MULTIPLY, DIVIDE, NEGATE = range(7)
LOOKUP, LOOKUP_2 = CODE["lookup"], CODE["lookup_2"]
SINE, COSINE = CODE["sin"], CODE["cos"]
