"""The SymPy expressions of a description, translated to nodes of the graph."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from fractions import Fraction
from functools import partial, reduce

import sympy as sp

from lag2fmu.errors import DerivationError
from lag2fmu.graph.derivatives import LEAST
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.operations import KINKS, LOOKUP, LOOKUP_2, OPERATIONS, ROOTS, SYMBOL
from lag2fmu.language.definitions import calls
from lag2fmu.language.vocabulary import Choice, Smooth, TableCall

FUNCTIONS = {
    sp.sin: "sin",
    sp.cos: "cos",
    sp.tan: "tan",
    sp.asin: "asin",
    sp.acos: "acos",
    sp.atan: "atan",
    sp.sinh: "sinh",
    sp.cosh: "cosh",
    sp.tanh: "tanh",
    sp.exp: "exp",
    sp.log: "log",
    sp.Abs: "abs",
    sp.sign: "sign",
    sp.Heaviside: "heaviside",
    sp.atan2: "atan2",
    sp.Min: "min",
    sp.Max: "max",
}

_PARTLY_DEFINED = {
    "divide": (1, 1),
    "log": (0, 1),
    "asin": (0, 0),
    "acos": (0, 0),
    "atan2": (1, 1),
    "exp": (0, 0),
    "sinh": (0, 0),
    "cosh": (0, 0),
    "power": (0, 1),
}
"""Operations that have no finite value or derivative everywhere: (an operand, one of its values where they have)."""

_WHOLE = 1e-9
"""An exponent is whole where the square of the sine of pi times it is less."""


def _located(code: int) -> range:
    """The indices of the operands of the operation ``code`` that say where its kinks are."""
    if code in (LOOKUP, LOOKUP_2):
        return range(2, 3) if code == LOOKUP else range(3, 5)
    return range(KINKS.get(OPERATIONS[code].name, 0))


class Translator:
    """Puts expressions on ``graph``; ``names`` gives the node of each variable and definition, by name.

    Sums begin with the terms that stand in most sums of ``expressions``, so that sums share their beginnings: positions
    of a chain written as flat sums l1 sin(q1) + l2 sin(q2) + ... become a recursion from link to link.
    """

    def __init__(self, graph: Graph, names: Mapping[str, Node], expressions: Iterable[sp.Expr] = ()) -> None:
        self.graph, self.names = graph, dict(names)
        self._memory: dict[sp.Expr, Node] = {}
        self._cores: dict[sp.Expr, sp.Expr] = {}
        self._frequency = self._term_frequency(expressions)

    def define(self, name: str, node: Node) -> None:
        """Let ``name`` stand for ``node`` in expressions translated from now on."""
        self.names[name] = node

    def __call__(self, expression: sp.Expr) -> Node:
        """The node of ``expression``; raises DerivationError for an operation the graph does not have."""
        if expression not in self._memory:
            with self.graph.as_written():
                for call in calls([expression]):
                    self._memory[call] = self._memory.get(call) or self._translate(call.meaning)
                self._memory[expression] = self._translate(expression)
        return self._memory[expression]

    def vector(self, expressions: tuple[sp.Expr, ...]) -> tuple[Node, ...]:
        """The nodes of several expressions, (k,)."""
        return tuple(self(e) for e in expressions)

    def _node(self, e: sp.Expr) -> Node:
        """The node of a part of an expression whose calls of definitions have theirs."""
        node = self._memory.get(e)
        if node is None:
            node = self._memory[e] = self._translate(e)
        return node

    def _translate(self, e: sp.Expr) -> Node:
        g = self.graph
        if e.is_Symbol:
            return self.names[e.name]
        if e.is_Rational:
            return g.constant(Fraction(int(e.p), int(e.q)))
        if e.is_NumberSymbol:
            return g.constant(float(e))
        if e.is_Add:
            return self._sum(e)
        if e.is_Mul:
            return self._product(e)
        if e.is_Pow:
            return (
                g.apply("exp", self._node(e.exp)) if e.base is sp.E else g.power(self._node(e.base), self._node(e.exp))
            )
        if isinstance(e, Choice):
            return self._choice(e)
        if isinstance(e, Smooth):
            return self._smooth(self._node(e.args[0]))
        if isinstance(e, TableCall):
            return self._lookup(e)
        return self._call(e)

    def _call(self, e: sp.Expr) -> Node:
        """``e``, a call of one of FUNCTIONS."""
        g, name = self.graph, FUNCTIONS.get(e.func)
        if name is None:
            raise DerivationError(f"'{e}' uses the operation {e.func.__name__}, which the equations cannot be made of")
        arguments = [self._node(a) for a in (e.args[:1] if name == "heaviside" else e.args)]
        if name in ("min", "max"):  # they take any number of arguments
            return reduce(partial(g.apply, name), arguments)
        return g.apply(name, *arguments)

    def _smooth(self, node: Node) -> Node:
        """``node`` with all its kinks marked as passed without an event, also the kinks of definitions in it."""
        g = self.graph
        new: dict[Node, Node] = {}
        for below in g.cone([node]):
            operands = [new[operand] for operand in g.operands[below]]
            for i in _located(g.code[below]):
                operands[i] = g.apply("passed", operands[i])
            new[below] = below if operands == list(g.operands[below]) else g.rebuild(below, operands)
        return new[node]

    def _choice(self, e: Choice) -> Node:
        margin, *branches = (self._node(a) for a in e.args)
        return self.graph.choose(margin, *(self._branch(branch, margin, k) for k, branch in enumerate(branches)))

    def _branch(self, node: Node, margin: Node, which: int) -> Node:
        """``node``, branch ``which`` (0 or 1) of a choice, with values and derivatives also where it is not chosen.

        Operands of roots and broken powers count as 0 where negative, for rounding and trial steps evaluate a branch
        a little beyond the place where it ends. Where the ``margin`` chooses the other branch, a harmless operand
        stands in place of one that the margin may guard: the derivative there is 0 times that of this branch.
        """
        g = self.graph
        guarded = {below for below in g.cone([margin]) if g.code[below] == SYMBOL}
        new: dict[Node, Node] = {}
        for below in g.cone([node]):
            operands = [new[operand] for operand in g.operands[below]]
            name = OPERATIONS[g.code[below]].name
            if name in ROOTS:
                operands[0] = self._base(*operands)
            if not guarded.isdisjoint(g.operands[below]):
                guarded.add(below)
            k, harmless = _PARTLY_DEFINED.get(name, (0, None))
            if harmless is not None and g.operands[below][k] in guarded:
                pair = (self._within(name, operands[k], margin, which), g.constant(harmless))
                operands[k] = g.choose(margin, *(pair if which == 0 else reversed(pair)))
            new[below] = below if operands == list(g.operands[below]) else g.rebuild(below, operands)
        return new[node]

    def _within(self, name: str, operand: Node, margin: Node, which: int) -> Node:
        """``operand``; where a trial step is beyond the end of the branch ``which``, the nearest that has a value."""
        g = self.graph
        if name not in ("log", "asin", "acos"):
            return operand
        nearest, inside = g.apply("passed", operand), g.apply("passed", margin)
        nearest = g.apply("max", nearest, g.constant(LEAST if name == "log" else -1))
        if name != "log":
            nearest = g.apply("min", g.apply("passed", nearest), g.one)
        return g.choose(inside, *((operand, nearest) if which == 0 else (nearest, operand)))

    def _base(self, base: Node, exponent: Node | None = None) -> Node:
        """``base`` or, where it is negative, 0; but for an ``exponent`` that is whole at present, it stays negative."""
        g = self.graph
        clipped = g.apply("max", g.apply("passed", base), g.zero)
        if exponent is None or g.is_constant(exponent):
            return clipped
        wave = g.apply("sin", g.multiply(g.constant(math.pi), exponent))
        return g.choose(g.apply("passed", g.subtract(g.multiply(wave, wave), g.constant(_WHOLE))), clipped, base)

    def _lookup(self, e: TableCall) -> Node:
        """A call of a table or of its derivative."""
        g = self.graph
        table = next(k for k, known in enumerate(g.tables) if known.name == e.table)
        orders = e.orders or (0,) * len(e.args)
        return g.lookup(g.constant(table), [g.constant(order) for order in orders], [self._node(a) for a in e.args])

    def _sum(self, e: sp.Expr) -> Node:
        """A sum from left to right, the most frequent terms first."""
        cores = {term: self._core(term) for term in e.args}
        order = sorted(e.args, key=lambda term: (-self._frequency[cores[term]], self._node(cores[term])))
        return self.graph.total(self._node(term) for term in order)

    def _core(self, term: sp.Expr) -> sp.Expr:
        """``term`` without its numerical factor. Equal results are one object, so that SymPy need not compare them."""
        core = self._cores.get(term)
        if core is None:
            core = term.as_coeff_Mul()[1]
            core = self._cores[term] = self._cores.setdefault(core, core)
        return core

    def _term_frequency(self, expressions: Iterable[sp.Expr]) -> Counter[sp.Expr]:
        """How many different sums in ``expressions`` each term stands in, numerical factors aside."""
        frequency: Counter[sp.Expr] = Counter()
        seen: set[sp.Expr] = set()
        stack = list(expressions)
        while stack:
            e = stack.pop()
            if e not in seen:
                seen.add(e)
                stack.extend(e.args)
                if e.is_Add:
                    frequency.update([self._core(term) for term in e.args])
        return frequency

    def _product(self, e: sp.Expr) -> Node:
        """A product as numerator / denominator, so that x/y is one division."""
        g = self.graph
        above, below = g.one, g.one
        for factor in e.args:
            if factor.is_Pow and factor.exp.is_Rational and factor.exp.is_negative:
                below = g.multiply(below, self._node(1 / factor))
            else:
                above = g.multiply(above, self._node(factor))
        return g.divide(above, below)
