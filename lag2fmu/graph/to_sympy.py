"""From nodes of the graph back to SymPy expressions, as one would write them on paper.

The graph shares subexpressions, but a reader wants them written out. Therefore expressions are multiplied out, and
products of sines and cosines are combined by the addition theorems. Nothing else is simplified.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import reduce
from itertools import combinations, product

import sympy as sp

from lag2fmu.graph.from_sympy import FUNCTIONS
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.operations import CONSTANT, LOOKUP, LOOKUP_2, NEGATE, OPERATIONS, SYMBOL
from lag2fmu.language.vocabulary import Choice, table_function

_SYMPY = {name: function for function, name in FUNCTIONS.items()} | {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "multiply": lambda a, b: a * b,
    "divide": lambda a, b: a / b,
    "negate": lambda a: -a,
    "sqrt": sp.sqrt,
    "power": sp.Pow,
    "power_or_zero": sp.Pow,
    "passed": lambda x: x,
    "sloped": lambda slope, rate: slope * rate,
    "choice": lambda margin, a, b: Choice(margin, _beside(margin, a, 1), _beside(margin, b, 2)),
}
_OTHER = {sp.sin: sp.cos, sp.cos: sp.sin}


def written_operations(graph: Graph, nodes: Iterable[Node]) -> int:
    """The number of operations of ``nodes`` if every formula is written out, shared parts as often as they stand."""
    nodes = list(nodes)
    count: dict[Node, int] = {}
    for node in graph.cone(nodes):
        operands = graph.operands[node]
        count[node] = sum(count[o] for o in operands) + bool(operands)
    return sum(count[node] for node in nodes)


def written(graph: Graph, nodes: Sequence[Node]) -> list[sp.Expr]:
    """``nodes`` (k,) as SymPy expressions in real symbols; the arguments of functions are tidied, see ``tidy``."""
    found: dict[Node, sp.Expr] = {}
    for node in graph.cone(nodes):
        code = graph.code[node]
        if code == CONSTANT:
            found[node] = sp.sympify(graph.value(node))
        elif code == SYMBOL:
            found[node] = sp.Symbol(str(graph.leaf[node]), real=True)
        elif code in (LOOKUP, LOOKUP_2):
            found[node] = _call(graph, node, found)
        else:
            operands = [found[o] for o in graph.operands[node]]
            if code > NEGATE:  # tidying the whole does not reach into the arguments of roots and functions
                operands = [tidy(operand) for operand in operands]
            found[node] = _SYMPY[OPERATIONS[code].name](*operands)
    return [found[node] for node in nodes]


def _call(graph: Graph, node: Node, found: Mapping[Node, sp.Expr]) -> sp.Expr:
    """The lookup ``node`` as a call of its table, ``found`` being its operands."""
    arity = 1 if graph.code[node] == LOOKUP else 2
    table, *rest = graph.operands[node]
    orders = tuple(int(graph.value(order)) for order in rest[:arity])
    arguments = (tidy(found[argument]) for argument in rest[arity:])
    return table_function(graph.tables[int(graph.value(table))].name, orders)(*arguments)


def tidy(expression: sp.Expr) -> sp.Expr:
    """``expression`` multiplied out, with sums such as sin a sin b + cos a cos b combined to one cosine or sine.

    Source: Abramowitz, Stegun, formulas 4.3.16 and 4.3.17.
    """
    terms = dict(_multiplied_out(expression).as_coefficients_dict())
    if expression.has(Choice):
        terms = dict(sp.Add(*(factor * _in_its_case(core) for core, factor in terms.items())).as_coefficients_dict())
    while (pair := _addition_theorem(terms)) is not None:
        one, other, result = pair
        del terms[one], terms[other]
        factor, core = result.as_coeff_Mul()
        terms[core] = terms.get(core, 0) + factor
    return sp.Add(*(coefficient * core for core, coefficient in terms.items()))


def _beside(margin: sp.Expr, x: sp.Expr, which: int) -> sp.Expr:
    """``x`` where ``margin`` > 0 (``which`` 1) or not (2): choices by the same margin are made."""
    return x.replace(lambda e: isinstance(e, Choice) and e.args[0] == margin, lambda e: e.args[which])


def _in_its_case(core: sp.Expr) -> sp.Expr:
    """The product ``core`` where one factor is a condition by which others choose: the case of 1, or else 0."""
    for factor in sp.Mul.make_args(core):
        base, exponent = factor.as_base_exp()
        if isinstance(base, Choice) and base.args[1:] in ((1, 0), (0, 1)) and exponent.is_positive:
            margin, which = base.args[0], 1 if base.args[1] == 1 else 2
            rest = core / factor
            if (made := _beside(margin, rest, which)) != rest:
                return Choice(margin, *((made, sp.S.Zero) if which == 1 else (sp.S.Zero, made)))
    return core


def _multiplied_out(x: sp.Expr) -> sp.Expr:
    """``x`` with its products and whole powers of sums multiplied out; what is divided by is left as it stands.

    ``sp.expand`` multiplies out there, too, so that r^3 loses its root; and takes twice the time.
    """
    if isinstance(x, sp.Add):
        return sp.Add(*map(_multiplied_out, x.args))
    if isinstance(x, sp.Mul):
        sums, rest = sp.sift(map(_multiplied_out, x.args), lambda factor: factor.is_Add, binary=True)
        return reduce(_product, sums, sp.Mul(*rest))
    if isinstance(x, sp.Pow) and isinstance(x.base, sp.Add) and isinstance(x.exp, sp.Integer) and x.exp > 1:
        return reduce(_product, [_multiplied_out(x.base)] * int(x.exp))
    return x


def _product(one: sp.Expr, other: sp.Expr) -> sp.Expr:
    return sp.Add(*(a * b for a, b in product(sp.Add.make_args(one), sp.Add.make_args(other))))


def _addition_theorem(terms: Mapping[sp.Expr, sp.Expr]) -> tuple[sp.Expr, sp.Expr, sp.Expr] | None:
    """Two of ``terms`` {product: coefficient} and their sum by an addition theorem; None if no two terms fit.

    cos(a - b) = cos a cos b + sin a sin b, sin(a + b) = sin a cos b + cos a sin b; Abramowitz and Stegun, 4.3.16-17.
    """
    for core, coefficient in terms.items():
        for f, g in combinations(_circular_factors(core), 2):
            a, b = f.args[0], g.args[0]
            other = core / (f * g) * _OTHER[f.func](a) * _OTHER[g.func](b)
            partner = terms.get(other)
            if partner is None or other == core or partner not in (coefficient, -coefficient):
                continue
            same = partner == coefficient
            if f.func == g.func:
                sign = 1 if same or f.func is sp.cos else -1
                together = sign * sp.cos(a - b if same else a + b)
            elif f.func is sp.sin:
                together = sp.sin(a + b if same else a - b)
            else:
                together = sp.sin(a + b) if same else sp.sin(b - a)
            return core, other, coefficient * core / (f * g) * together
    return None


def _circular_factors(core: sp.Expr) -> list[sp.Expr]:
    """The sines and cosines in the product ``core``; a square counts as two factors."""
    found: list[sp.Expr] = []
    for factor in sp.Mul.make_args(core):
        base, exponent = factor.as_base_exp()
        if base.func in _OTHER and exponent in (1, 2):
            found += [base] * int(exponent)
    return found
