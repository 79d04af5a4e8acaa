"""Solving M x = rhs by elimination over the velocity graph, or writing M out by substitution.

M is the Hessian of a quadratic form whose variables are inner velocities. By Gauss's principle of least constraint x
minimises 1/2 sum H_ab a b - sum L_a a. Inner nodes are replaced by their combinations from the tip of the mechanism
on, and a velocity is eliminated as soon as no inner node contains it any more; for a chain or tree this is the
articulated-body algorithm (Featherstone, Rigid Body Dynamics Algorithms, chapter 7), found without being told the
topology. If every inner node is replaced first, H is the mass matrix: the composite-rigid-body algorithm (chapter 6).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from lag2fmu.dynamics.parts import Entries, Solution
from lag2fmu.dynamics.quadratic import LinearNodes, QuadraticForm
from lag2fmu.graph.graph import Graph, Node


class _Pivot(NamedTuple):
    """An eliminated velocity x = (load - sum coupling_k value_k) * inverse, over the nodes k that are left."""

    leaf: Node
    inverse: Node
    load: Node
    couplings: tuple[tuple[Node, Node], ...]


class _Elimination:
    """The state of one elimination: the quadratic form, the linear part, and the nodes that are left."""

    def __init__(self, graph: Graph, entries: Mapping[tuple[Node, Node], Node], leaves: Sequence[Node]) -> None:
        self.g, self.leaves = graph, list(leaves)
        self.form = QuadraticForm(graph)
        for (a, b), value in entries.items():
            self.form.add(a, b, value)
        self.nodes = LinearNodes(graph, leaves, self.form.rows)
        self.load: dict[Node, Node] = {}
        self.pivots: list[_Pivot] = []
        self.pivot_of: dict[Node, Node] = {}

    def substitute(self, node: Node) -> None:
        """Replace the inner ``node`` by its combination in the form and in the linear part."""
        g, terms = self.g, self.nodes.combinations[node]
        row = self.form.remove(node)
        diagonal, load = row.pop(node, g.zero), self.load.pop(node, g.zero)
        for number, (below, coefficient) in enumerate(terms):
            for other, entry in row.items():
                value = g.multiply(coefficient, entry)
                self.form.add(below, other, g.multiply(g.constant(2), value) if below == other else value)
            scaled = g.multiply(coefficient, diagonal)
            for second, factor in terms[number:]:
                self.form.add(below, second, g.multiply(scaled, factor))
            self._add_load(below, g.multiply(coefficient, load))

    def eliminate(self, leaf: Node) -> bool:
        """Eliminate the velocity ``leaf``. Returns False, with nothing changed, if its pivot is identically zero."""
        g = self.g
        pivot = self.form.rows.get(leaf, {}).get(leaf, g.zero)
        if pivot == g.zero:
            return False
        row = self.form.remove(leaf)
        del row[leaf]
        inverse, load = g.divide(g.one, pivot), self.load.pop(leaf, g.zero)
        couplings = [(other, entry) for other, entry in row.items() if entry != g.zero]
        scaled = {other: g.multiply(entry, inverse) for other, entry in couplings}
        for number, (other, entry) in enumerate(couplings):
            for second, _ in couplings[number:]:
                self.form.add(other, second, g.negate(g.multiply(entry, scaled[second])))
            self._add_load(other, g.negate(g.multiply(scaled[other], load)))
        self.pivots.append(_Pivot(leaf, inverse, load, tuple(couplings)))
        self.pivot_of[leaf] = pivot
        return True

    def back_substitute(self, known: Mapping[Node, Node] | None = None) -> dict[Node, Node]:
        """{leaf: x}, found from the velocity eliminated last back to the first.

        ``known`` {leaf: x} holds the velocities that were not eliminated.
        """
        g = self.g
        value: dict[Node, Node] = dict(known or {})
        for pivot in reversed(self.pivots):
            rest = pivot.load
            for node, entry in pivot.couplings:
                rest = g.subtract(rest, g.multiply(entry, self._value(node, value)))
            value[pivot.leaf] = g.multiply(pivot.inverse, rest)
        return value

    def _value(self, node: Node, value: dict[Node, Node]) -> Node:
        """The value of a velocity or inner node, all leaves below it being known."""
        stack = [node]
        while stack:
            top = stack[-1]
            if top in value:
                stack.pop()
                continue
            missing = [below for below, _ in self.nodes.combinations[top] if below not in value]
            if missing:
                stack += missing
                continue
            value[top] = self.g.total(self.g.multiply(c, value[below]) for below, c in self.nodes.combinations[top])
            stack.pop()
        return value[node]

    def _add_load(self, node: Node, value: Node) -> None:
        if value != self.g.zero:
            self.load[node] = self.g.add(self.load[node], value) if node in self.load else value


def solve(
    graph: Graph, entries: Entries, velocities: Sequence[Node], rhs: Sequence[Node], early: bool
) -> Solution | None:
    """x of M x = ``rhs``, where M is the Hessian of ``entries`` with respect to ``velocities``, (n,).

    With ``early`` a velocity is eliminated as soon as no inner node contains it. Without, everything is written out in
    the velocities first, and the elimination is an LDL^T of M. Pivots that are identically zero are put off; the result
    is None if they stay zero. ``rhs`` are (n,) nodes. Source: for a chain or tree, Featherstone, Rigid Body Dynamics
    Algorithms, chapter 7 with ``early``, chapter 6 without.
    """
    work = _Elimination(graph, entries, velocities)
    work.load = dict(zip(velocities, rhs, strict=True))
    put_off = _eliminated_early(work, velocities) if early else _written_out(work, velocities)
    put_off.reverse()
    while put_off:
        done = next((v for v in put_off if work.eliminate(v)), None)
        if done is None:
            return None
        put_off.remove(done)
    value = work.back_substitute()
    return Solution(tuple(value[v] for v in velocities), tuple(work.pivot_of[v] for v in velocities))


def _written_out(work: _Elimination, velocities: Sequence[Node]) -> list[Node]:
    """Write everything out in the ``velocities``; returns those still to be eliminated, which are all of them."""
    for node in sorted(work.nodes.combinations, reverse=True):
        work.substitute(node)
    return list(velocities)


def _eliminated_early(work: _Elimination, velocities: Sequence[Node]) -> list[Node]:
    """Eliminate each velocity once no inner node contains it; returns those whose pivot is identically zero then."""
    combinations = work.nodes.combinations
    waiting = Counter(below for terms in combinations.values() for below, _ in terms)
    put_off = [v for v in velocities if waiting[v] == 0 and not work.eliminate(v)]
    known = set(velocities)
    for node in sorted(combinations, reverse=True):
        work.substitute(node)
        for below, _ in combinations[node]:
            waiting[below] -= 1
            if below in known and waiting[below] == 0 and not work.eliminate(below):
                put_off.append(below)
    return put_off


def null_vectors(graph: Graph, entries: Entries, velocities: Sequence[Node]) -> dict[Node, tuple[Node, ...]]:
    """{velocity: null vector (n,)} of M, the Hessian of ``entries``, for each null vector that M has at every q.

    The entry of a null vector for its own velocity is 1. Where there is a choice, the last of the ``velocities`` are
    taken. Source: Golub, Van Loan, Matrix Computations, section 4.2 (LDL^T of a positive semidefinite matrix).
    """
    work = _Elimination(graph, entries, velocities)
    left = _written_out(work, velocities)
    while (done := next((v for v in left if work.eliminate(v)), None)) is not None:
        left.remove(done)
    if any(entry != graph.zero for v in left for entry in work.form.rows.get(v, {}).values()):
        return {}
    found = {}
    for velocity in left:
        value = work.back_substitute({other: graph.one if other == velocity else graph.zero for other in left})
        found[velocity] = tuple(value[v] for v in velocities)
    return found


def mass_matrix(graph: Graph, entries: Entries, velocities: Sequence[Node]) -> tuple[tuple[Node, ...], ...]:
    """M, (n, n) nodes, the Hessian of ``entries`` with respect to ``velocities``, (n,).

    Source: for a chain or tree the composite-rigid-body algorithm, Featherstone, chapter 6.
    """
    work = _Elimination(graph, entries, velocities)
    for node in sorted(work.nodes.combinations, reverse=True):
        work.substitute(node)
    return tuple(tuple(work.form.rows.get(a, {}).get(b, graph.zero) for b in velocities) for a in velocities)
