"""The derivatives of the operations: one entry an operation that has operands.

A derivative is a function of the graph, the operands and the result. It returns the partial derivatives with respect
to the operands as nodes. Where the operands of min or max are equal, it is the mean of both one-sided derivatives.
Roots and powers of what a kink may hold at 0, as max(0, -x), have the derivative 0 there instead of infinity times 0.
Source: Abramowitz and Stegun, sections 4.2-4.6.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from lag2fmu.graph.graph import Graph
from lag2fmu.graph.nodes import Node
from lag2fmu.graph.operations import KINKS, OPERATIONS

Partials = tuple[Node, ...]
Derivative = Callable[[Graph, tuple[Node, ...], Node], Partials]
LEAST = 1e-37
"""Instead of a base of 0 in a logarithm that is multiplied by the power of this base, which is 0; float holds it, too.
That of a negative base is the one of its absolute value: whole powers have values there, and their rates count as 0."""


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


def kink_margin(g: Graph, node: Node) -> Node | None:
    """The margin at whose sign the kink ``node`` changes; None if it is no kink."""
    name, operands = OPERATIONS[g.code[node]].name, g.operands[node]
    if name not in KINKS:
        return None
    return g.subtract(*operands) if KINKS[name] == 2 else operands[0]


def steep_roots(g: Graph, derivatives: Sequence[Node]) -> list[list[Node]]:
    """Of each root in ``derivatives`` (k,) that a kink may hold at 0: its base, and the margins (m,) of such kinks.

    Where both the base and a margin are 0, the slope has no bound, although the derivatives say 0.
    """
    found = []
    for node in g.cone(derivatives):
        if OPERATIONS[g.code[node]].name == "power_or_zero":
            base, exponent = g.operands[node]
            if not g.is_constant(exponent) or g.value(exponent) < 0:
                margins = [kink_margin(g, below) for below in g.cone([base])]
                found.append([base, *(margin for margin in margins if margin is not None)])
    return found


def _may_stay_at_zero(g: Graph, x: Node) -> bool:
    """Whether a kink may hold ``x`` at 0, as max(0, -y) and its multiples."""
    name, operands = OPERATIONS[g.code[x]].name, g.operands[x]
    if name in ("add", "subtract", "multiply"):
        every = all if name != "multiply" else any
        return every(_may_stay_at_zero(g, operand) for operand in operands)
    if name in ("divide", "negate", "passed", "sqrt", "power", "power_or_zero"):
        return _may_stay_at_zero(g, operands[0])
    return name in KINKS


def _d_sqrt(g: Graph, operands: tuple[Node, ...], result: Node) -> Partials:
    if _may_stay_at_zero(g, operands[0]):
        return (g.multiply(g.constant_half, g.apply("power_or_zero", result, g.minus_one)),)
    return (g.divide(g.constant_half, result),)


def _d_power(g: Graph, operands: tuple[Node, ...], result: Node) -> Partials:
    base, exponent = operands
    lower, stays = g.subtract(exponent, g.one), _may_stay_at_zero(g, base)
    by_base = g.multiply(exponent, g.apply("power_or_zero", base, lower) if stays else g.power(base, lower))
    if g.is_constant(exponent):
        return by_base, g.zero
    size = g.apply("passed", g.apply("abs", g.apply("passed", base)))
    return by_base, g.multiply(result, g.apply("log", g.apply("max", size, g.constant(LEAST))))


def _d_power_or_zero(g: Graph, operands: tuple[Node, ...], _: Node) -> Partials:
    base, exponent = operands
    return g.multiply(exponent, g.apply("power_or_zero", base, g.subtract(exponent, g.one))), g.zero


def _d_min(g: Graph, operands: tuple[Node, ...], _: Node) -> Partials:
    a, b = operands
    return g.apply("heaviside", g.subtract(b, a)), g.apply("heaviside", g.subtract(a, b))


def _d_max(g: Graph, operands: tuple[Node, ...], _: Node) -> Partials:
    a, b = operands
    return g.apply("heaviside", g.subtract(a, b)), g.apply("heaviside", g.subtract(b, a))


def _d_choice(g: Graph, operands: tuple[Node, ...], _: Node) -> Partials:
    margin = operands[0]
    return g.zero, g.choose(margin, g.one, g.zero), g.choose(margin, g.zero, g.one)


def _d_lookup(g: Graph, operands: tuple[Node, ...], _: Node) -> Partials:
    table, order, x = operands
    return g.zero, g.zero, g.lookup(table, (g.add(order, g.one),), (x,))


def _d_lookup_2(g: Graph, operands: tuple[Node, ...], _: Node) -> Partials:
    table, first, second, x, y = operands
    by_x = g.lookup(table, (g.add(first, g.one), second), (x, y))
    by_y = g.lookup(table, (first, g.add(second, g.one)), (x, y))
    return g.zero, g.zero, g.zero, by_x, by_y


DERIVATIVES: Mapping[str, Derivative] = {
    "add": lambda g, o, y: (g.one, g.one),
    "subtract": lambda g, o, y: (g.one, g.minus_one),
    "multiply": lambda g, o, y: (o[1], o[0]),
    "divide": lambda g, o, y: (g.divide(g.one, o[1]), g.negate(g.divide(y, o[1]))),
    "negate": lambda g, o, y: (g.minus_one,),
    "sqrt": _d_sqrt,
    "exp": lambda g, o, y: (y,),
    "log": lambda g, o, y: (g.divide(g.one, o[0]),),
    "sin": lambda g, o, y: (g.apply("cos", o[0]),),
    "cos": lambda g, o, y: (_negative(g, g.apply("sin", o[0])),),
    "tan": lambda g, o, y: (_one_plus_square(g, y),),
    "asin": lambda g, o, y: (_inverse_root(g, o[0]),),
    "acos": lambda g, o, y: (_negative(g, _inverse_root(g, o[0])),),
    "atan": lambda g, o, y: (g.divide(g.one, _one_plus_square(g, o[0])),),
    "sinh": lambda g, o, y: (g.apply("cosh", o[0]),),
    "cosh": lambda g, o, y: (g.apply("sinh", o[0]),),
    "tanh": lambda g, o, y: (_one_minus_square(g, y),),
    "abs": lambda g, o, y: (g.apply("sign", o[0]),),
    "sign": lambda g, o, y: (g.zero,),
    "heaviside": lambda g, o, y: (g.zero,),
    "atan2": _d_atan2,
    "power": _d_power,
    "power_or_zero": _d_power_or_zero,
    "min": _d_min,
    "max": _d_max,
    "passed": lambda g, o, y: (g.one,),
    "choice": _d_choice,
    "sloped": lambda g, o, y: (o[1], o[0]),
    "lookup": _d_lookup,
    "lookup_2": _d_lookup_2,
}
"""Name of an operation -> its derivative."""
