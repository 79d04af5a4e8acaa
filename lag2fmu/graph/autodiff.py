"""Forward and reverse automatic differentiation on the graph; both return nodes, so they nest.

Source: A. Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, sections 3.1 (tangents) and 3.2 (adjoints).
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

from lag2fmu.graph.derivatives import DERIVATIVES
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.operations import ADD, CHOICE, MULTIPLY, NEGATE, OPERATIONS, SLOPED, STEEP, SUBTRACT

FUNCTIONS = frozenset(code for code, row in enumerate(OPERATIONS) if row.arity == 1 and code != NEGATE)


def forward(graph: Graph, outputs: Sequence[Node], seeds: Mapping[Node, Node], *, steep: bool = False) -> list[Node]:
    """Directional derivatives (k,) of the nodes ``outputs`` (k,) in the direction ``seeds`` {variable: its rate}.

    A variable that is not in ``seeds`` has the rate 0. ``steep``: rates of 0 stay 0 where a slope has no bound, as that
    of sqrt(k) at 0; they are known at run time only. Source: Griewank, Walther, section 3.1 (propagation of
    tangents).
    """
    return Forward(graph, seeds, steep=steep)(outputs)


class Forward:
    """Directional derivatives in the direction ``seeds`` {variable: its rate}; each node is differentiated once.

    The object is for outputs that are asked for one after the other along the same direction. For outputs that are
    known together see ``forward``.
    """

    def __init__(self, graph: Graph, seeds: Mapping[Node, Node], *, steep: bool = False) -> None:
        self.graph, self.steep = graph, steep
        self.rates = dict(seeds)  # {node: its rate}, without the nodes whose rate is 0
        self.done = set(seeds)

    def __call__(self, outputs: Sequence[Node]) -> list[Node]:
        """The derivatives (k,) of the nodes ``outputs`` (k,)."""
        graph, rates = self.graph, self.rates
        cone = graph.cone(outputs, self.done)
        for node in cone:
            if node not in self.done:
                rate = self._rate(node)
                if rate != graph.zero:
                    rates[node] = rate
        self.done.update(cone)
        return [rates.get(output, graph.zero) for output in outputs]

    def _rate(self, node: Node) -> Node:
        g, rates, operands = self.graph, self.rates, self.graph.operands[node]
        moving = [operand for operand in operands if operand in rates]
        if not moving:
            return g.zero
        if g.code[node] in (ADD, SUBTRACT):
            a, b = (rates.get(operand, g.zero) for operand in operands)
            return g.add(a, b) if g.code[node] == ADD else g.subtract(a, b)
        if g.code[node] == CHOICE:  # the operand that is not chosen may have no value
            return g.choose(operands[0], *(rates.get(operand, g.zero) for operand in operands[1:]))
        return g.total(self._parts(node))

    def _parts(self, node: Node) -> Iterator[Node]:
        """The rate of ``node`` that is due to each of its operands."""
        g, rates, operands = self.graph, self.rates, self.graph.operands[node]
        factors = operands if g.code[node] == MULTIPLY else (node,)
        times = _sloped if self.steep and any(g.code[x] in STEEP for x in factors) else Graph.multiply
        for below, partial in _partials(g, node, rates):
            if below in rates:
                yield times(g, partial, rates[below])


def reverse(graph: Graph, seeds: Mapping[Node, Node], variables: Iterable[Node]) -> list[Node]:
    """Gradient by ``variables``, (n,) nodes, of the sum of adjoint * output over ``seeds`` {output: adjoint}.

    The adjoints in ``seeds`` are not differentiated themselves. The gradient costs a small multiple of what the
    outputs cost, whatever n is. Source: Griewank, Walther, section 3.2 (propagation of adjoints).
    """
    variables, zero = list(variables), graph.zero
    adjoint: dict[Node, Node] = {}
    for output, weight in seeds.items():
        adjoint[output] = graph.add(adjoint.get(output, zero), weight)
    inner = _dependent(graph, seeds, variables)
    depending = {*inner, *variables}
    for node in reversed(inner):
        weight = adjoint.get(node, zero)
        if weight == zero:
            continue
        for operand, partial in _partials(graph, node, depending):
            if operand in depending:
                times = _sloped if graph.code[node] == SLOPED else Graph.multiply
                adjoint[operand] = graph.add(adjoint.get(operand, zero), times(graph, partial, weight))
    return [adjoint.get(variable, zero) for variable in variables]


def _sloped(graph: Graph, slope: Node, rate: Node) -> Node:
    """``slope`` times ``rate``, 0 where the rate is 0."""
    return graph.multiply(slope, rate) if graph.is_constant(slope) else graph.apply("sloped", slope, rate)


def _dependent(graph: Graph, outputs: Iterable[Node], variables: Iterable[Node]) -> list[Node]:
    """The inner nodes between ``variables`` and ``outputs``, ascending."""
    reached = set(variables)
    order: list[Node] = []
    for node in graph.cone(outputs):
        if not reached.isdisjoint(graph.operands[node]):
            reached.add(node)
            order.append(node)
    return order


def _partials(graph: Graph, node: Node, varying: Collection[Node]) -> Iterable[tuple[Node, Node]]:
    """(operand, partial derivative) of ``node``; an operand that occurs twice, as in a square, comes once.

    In l * sin(x), where l does not vary, x counts as the operand. Its derivative l * cos(x) occurs in the velocities,
    so the graph has that node already.
    """
    code, operands = graph.code[node], graph.operands[node]
    if code == MULTIPLY:
        a, b = operands
        factor, other = (a, b) if b in varying else (b, a)
        if factor not in varying and graph.code[other] in FUNCTIONS:
            ((below, partial),) = _partials(graph, other, varying)
            return ((below, graph.multiply(factor, partial)),)
        return ((a, graph.add(a, a)),) if a == b else ((a, b), (b, a))
    partials = DERIVATIVES[OPERATIONS[code].name](graph, operands, node)
    if len(operands) == 2 and operands[0] == operands[1]:
        return ((operands[0], graph.add(*partials)),)
    return zip(operands, partials, strict=True)
