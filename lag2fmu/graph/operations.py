"""The operations of the expression graph: one row an operation, with its value and its spelling in C.

Some operations are not those of C:

- ``power_or_zero``: a power above 1 whose exponent is not whole, and the operation of its derivatives. Where the base
  stays at 0, as in max(0, -x)**(5/2), all derivatives are 0 instead of infinity times 0.
- ``choice``: the second operand where the first is positive, else the third.
- ``passed``: its operand, unchanged; kinks whose margins use it are not located.
- ``sloped``: a slope times a rate; 0 where the rate is 0, however steep the slope is.
- lookups: constants come first, namely the index of the table and the order of the derivative by each argument.

The derivatives of the operations are in ``derivatives``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple


class Operation(NamedTuple):
    """An operation: ``value`` computes it with ``arity`` floats, ``c`` is its format string in C."""

    name: str
    arity: int
    value: Callable[..., float]
    c: str


def _sign(x: float) -> float:
    return math.copysign(1.0, x) if x else 0.0


def _heaviside(x: float) -> float:
    return 0.5 * (1.0 + _sign(x))


def _power_or_zero(base: float, exponent: float) -> float:
    return math.pow(base, exponent) if base else 0.0


def _divide(a: float, b: float) -> float:
    return a / b if b else math.nan


def _in_table(*_: float) -> float:
    return math.nan  # the graph knows the tables, see ``Graph.looked_up``


OPERATIONS: tuple[Operation, ...] = (
    Operation("constant", 0, lambda: math.nan, ""),
    Operation("symbol", 0, lambda: math.nan, ""),
    Operation("add", 2, lambda a, b: a + b, "{0} + {1}"),
    Operation("subtract", 2, lambda a, b: a - b, "{0} - {1}"),
    Operation("multiply", 2, lambda a, b: a * b, "{0} * {1}"),
    Operation("divide", 2, _divide, "{0} / {1}"),
    Operation("negate", 1, lambda a: -a, "-{0}"),
    Operation("sqrt", 1, math.sqrt, "sqrt({0})"),
    Operation("exp", 1, math.exp, "exp({0})"),
    Operation("log", 1, math.log, "log({0})"),
    Operation("sin", 1, math.sin, "sin({0})"),
    Operation("cos", 1, math.cos, "cos({0})"),
    Operation("tan", 1, math.tan, "tan({0})"),
    Operation("asin", 1, math.asin, "asin({0})"),
    Operation("acos", 1, math.acos, "acos({0})"),
    Operation("atan", 1, math.atan, "atan({0})"),
    Operation("sinh", 1, math.sinh, "sinh({0})"),
    Operation("cosh", 1, math.cosh, "cosh({0})"),
    Operation("tanh", 1, math.tanh, "tanh({0})"),
    Operation("abs", 1, math.fabs, "fabs({0})"),
    Operation("sign", 1, _sign, "sign({0})"),
    Operation("heaviside", 1, _heaviside, "heaviside({0})"),
    Operation("atan2", 2, math.atan2, "atan2({0}, {1})"),
    Operation("power", 2, math.pow, "pow({0}, {1})"),
    Operation("power_or_zero", 2, _power_or_zero, "power_or_zero({0}, {1})"),
    Operation("min", 2, min, "fmin({0}, {1})"),
    Operation("max", 2, max, "fmax({0}, {1})"),
    Operation("passed", 1, lambda x: x, "{0}"),
    Operation("choice", 3, lambda m, a, b: a if m > 0.0 else b, "{0} > 0.0 ? {1} : {2}"),
    Operation("sloped", 2, lambda slope, rate: slope * rate if rate else 0.0, "{1} == 0.0 ? 0.0 : {0} * {1}"),
    Operation("lookup", 3, _in_table, ""),
    Operation("lookup_2", 5, _in_table, ""),
)
CODE = {row.name: code for code, row in enumerate(OPERATIONS)}
ARITY = tuple(row.arity for row in OPERATIONS)
CONSTANT, SYMBOL, ADD, SUBTRACT, MULTIPLY, DIVIDE, NEGATE = range(7)
KINKS = {"sign": 1, "abs": 1, "heaviside": 1, "min": 2, "max": 2, "choice": 1}
"""The operations with a kink: {name: how many of the first operands say where the kink is}."""
ROOTS = ("sqrt", "power", "power_or_zero")
STEEP = frozenset(CODE[name] for name in ("sqrt", "power", "asin", "acos", "atan2"))
"""The codes of operations with places where they have a value but no bounded slope."""
SINE, COSINE, CHOICE, SLOPED = CODE["sin"], CODE["cos"], CODE["choice"], CODE["sloped"]
LOOKUP, LOOKUP_2 = CODE["lookup"], CODE["lookup_2"]
