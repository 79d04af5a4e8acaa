"""Quadratic forms over the velocity graph: T2 = 1/2 sum H_ab a b, where a, b are nodes linear in the velocities.

The velocities qd are the leaves; an inner node is a linear combination of nodes below it. Keeping T in terms of inner
nodes (velocities of mass centres, angular velocities) is what makes the elimination in ``elimination`` linear in n.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.operations import ADD, CHOICE, DIVIDE, MULTIPLY, NEGATE, SUBTRACT


class QuadraticForm:
    """A symmetric matrix over k nodes, (k, k), by ``rows`` {a: {b: H_ab}}; entries are nodes free of velocities."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.rows: dict[Node, dict[Node, Node]] = {}

    def add(self, a: Node, b: Node, value: Node) -> None:
        """H_ab += value (and H_ba, the same entry, if a is not b)."""
        if value == self.graph.zero:
            return
        row = self.rows.setdefault(a, {})
        row[b] = total = self.graph.add(row[b], value) if b in row else value
        if a != b:
            self.rows.setdefault(b, {})[a] = total

    def remove(self, a: Node) -> dict[Node, Node]:
        """Take the row and column of ``a`` out and return the row."""
        row = self.rows.pop(a, {})
        for b in row:
            if b != a:
                del self.rows[b][a]
        return row


class LinearNodes:
    """The nodes between the velocities and the nodes of a quadratic form, as linear combinations.

    ``combinations``: {inner node: [(node below, coefficient)]}. An inner node has no combination of its own if only one
    node uses it and the form has no entry for it. It is then written out in the node that uses it.
    """

    def __init__(self, graph: Graph, leaves: Sequence[Node], carrying: Iterable[Node]) -> None:
        self.graph, self.leaves, self.carrying = graph, set(leaves), set(carrying)
        self.linear = _linear_nodes(graph, leaves, self.carrying)
        self.combinations: dict[Node, list[tuple[Node, Node]]] = {}
        uses = self._collect()
        for node in sorted(self.combinations):
            if node in self.combinations:
                self._write_out(node, uses)

    def _collect(self) -> dict[Node, int]:
        """Fill ``combinations`` with one operation a node; returns how often each node is used."""
        uses: dict[Node, int] = {}
        stack = sorted(self.carrying)
        while stack:
            node = stack.pop()
            if node in self.combinations or node in self.leaves:
                continue
            self.combinations[node] = terms = list(self._terms(node))
            for below, _ in terms:
                uses[below] = uses.get(below, 0) + 1
                stack.append(below)
        return uses

    def _terms(self, node: Node) -> Iterator[tuple[Node, Node]]:
        """The node as a combination of its operands: sums, choices, products or quotients with one linear factor."""
        g, code, operands = self.graph, self.graph.code[node], self.graph.operands[node]
        if code in (ADD, SUBTRACT):
            signs = (g.one, g.one if code == ADD else g.minus_one)
            yield from ((o, sign) for o, sign in zip(operands, signs, strict=True) if o in self.linear)
        elif code == NEGATE:
            yield operands[0], g.minus_one
        elif code == DIVIDE:
            yield operands[0], g.divide(g.one, operands[1])
        elif code == CHOICE:
            margin, *branches = operands
            chosen = g.choose(margin, g.one, g.zero), g.choose(margin, g.zero, g.one)
            yield from ((o, part) for o, part in zip(branches, chosen, strict=True) if o in self.linear)
        else:
            a, b = operands
            yield (a, b) if a in self.linear else (b, a)

    def _write_out(self, node: Node, uses: dict[Node, int]) -> None:
        written: dict[Node, Node] = {}
        for below, factor in self.combinations[node]:
            inner = [(below, self.graph.one)]
            if below in self.combinations and uses[below] == 1 and below not in self.carrying:
                inner = self.combinations.pop(below)
            for leaf, coefficient in inner:
                value = self.graph.multiply(factor, coefficient)
                written[leaf] = self.graph.add(written[leaf], value) if leaf in written else value
        self.combinations[node] = list(written.items())


def _linear_nodes(graph: Graph, leaves: Sequence[Node], nodes: Iterable[Node]) -> set[Node]:
    """All nodes below ``nodes`` that contain a leaf. They are linear in the leaves if ``nodes`` are."""
    linear = set(leaves)
    for node in graph.cone(nodes):
        if any(operand in linear for operand in graph.operands[node]):
            linear.add(node)
    return linear


# --------------------------------------------------------------------------------------------- parts by degree in qd

Parts = tuple[Node, Node, Node]
"""The parts of degree 0, 1 and 2 in the velocities of a node."""


def second_degree(graph: Graph, node: Node, velocities: Sequence[Node]) -> QuadraticForm | None:
    """The part of ``node`` of second degree in ``velocities``, (n,), as a form.

    The form is the Hessian: node = 1/2 sum H_ab a b + lower degrees, a and b being nodes linear in the velocities. None
    if ``node`` is no polynomial of degree two or less in the velocities.
    """
    form = QuadraticForm(graph)
    parts: dict[Node, Parts] = {v: (graph.zero, v, graph.zero) for v in velocities}
    products: dict[Node, list[tuple[Node, Node, Node]]] = {}
    for inner in graph.cone([node]):
        if inner in parts or not any(operand in parts for operand in graph.operands[inner]):
            continue
        split = _split(graph, inner, parts, products)
        if split is None:
            return None
        parts[inner] = split
    for a, b, coefficient in products.get(parts.get(node, (0, 0, graph.zero))[2], []):
        form.add(a, b, graph.multiply(graph.constant(2), coefficient) if a == b else coefficient)
    return form


def _split(
    graph: Graph, node: Node, parts: dict[Node, Parts], products: dict[Node, list[tuple[Node, Node, Node]]]
) -> Parts | None:
    """The parts of ``node``; the second-degree part is recorded in ``products`` as a sum of coefficient * a * b."""
    g, code = graph, graph.code[node]
    z = g.zero
    if len(graph.operands[node]) > 2:
        return None
    a, *rest = (parts.get(o, (o, z, z)) for o in graph.operands[node])
    if code == NEGATE:
        return _recorded(g, products, _scaled(g, a, g.minus_one), _times(g, products, a[2], g.minus_one))
    (b,) = rest or [(z, z, z)]
    if code in (ADD, SUBTRACT):
        sign = g.one if code == ADD else g.minus_one
        lower = (g.add(a[0], g.multiply(sign, b[0])), g.add(a[1], g.multiply(sign, b[1])))
        return _recorded(g, products, lower, _times(g, products, a[2], g.one) + _times(g, products, b[2], sign))
    if code == DIVIDE and _degree(g, b) == 0:
        inverse = g.divide(g.one, b[0])
        return _recorded(g, products, _scaled(g, a, inverse), _times(g, products, a[2], inverse))
    if code != MULTIPLY or _degree(g, a) + _degree(g, b) > 2:
        return None
    lower = (g.multiply(a[0], b[0]), g.add(g.multiply(a[0], b[1]), g.multiply(a[1], b[0])))
    second = _times(g, products, a[2], b[0]) + _times(g, products, b[2], a[0])
    if z not in (a[1], b[1]):
        second.append((a[1], b[1], g.one))
    return _recorded(g, products, lower, second)


def _degree(g: Graph, parts: Parts) -> int:
    """The highest degree whose part among ``parts`` is not identically zero."""
    return max((degree for degree, part in enumerate(parts) if part != g.zero), default=0)


def _scaled(g: Graph, parts: Parts, factor: Node) -> tuple[Node, Node]:
    return g.multiply(factor, parts[0]), g.multiply(factor, parts[1])


def _times(
    g: Graph, products: dict[Node, list[tuple[Node, Node, Node]]], node: Node, factor: Node
) -> list[tuple[Node, Node, Node]]:
    if factor == g.zero:
        return []
    return [(a, b, g.multiply(factor, c)) for a, b, c in products.get(node, [])]


def _recorded(
    g: Graph,
    products: dict[Node, list[tuple[Node, Node, Node]]],
    lower: tuple[Node, Node],
    second: list[tuple[Node, Node, Node]],
) -> Parts:
    """The parts with the products of ``second`` degree summed up to one node; ``products`` keeps them under it."""
    merged: dict[tuple[Node, Node], Node] = {}
    for a, b, c in second:
        key = (a, b) if a <= b else (b, a)
        merged[key] = g.add(merged[key], c) if key in merged else c
    kept = [(a, b, c) for (a, b), c in merged.items() if c != g.zero]
    node = g.total(g.multiply(c, g.multiply(a, b)) for a, b, c in kept)
    if node != g.zero:
        products[node] = kept
    return (*lower, node)
