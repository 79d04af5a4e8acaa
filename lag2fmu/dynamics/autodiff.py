"""Forward and reverse automatic differentiation on the graph; both return nodes, so they nest.

Source: A. Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, sections 3.1 (tangents) and 3.2 (adjoints).
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence

from lag2fmu.dynamics.graph import Graph
from lag2fmu.dynamics.operations import MULTIPLY, NEGATE, OPERATIONS

FUNCTIONS = frozenset(code for code, row in enumerate(OPERATIONS) if row.arity == 1 and code != NEGATE)


def forward(graph: Graph, outputs: Sequence[int], seeds: Mapping[int, int]) -> list[int]:
    """Directional derivatives of ``outputs``, (k,) nodes, in the direction ``seeds`` {variable: its rate}."""
    tangent: dict[int, int] = dict(seeds)
    for node in graph.cone(outputs):
        if node in tangent:
            continue
        if any(operand in tangent for operand in graph.operands[node]):
            partials = _partials(graph, node, tangent).items()
            rate = graph.total(
                graph.multiply(partial, tangent[below]) for below, partial in partials if below in tangent
            )
            if rate != graph.zero:
                tangent[node] = rate
    return [tangent.get(output, graph.zero) for output in outputs]


def reverse(graph: Graph, seeds: Mapping[int, int], variables: Iterable[int]) -> list[int]:
    """Gradient by ``variables``, (n,) nodes, of the sum of adjoint * output over ``seeds`` {output: adjoint}.

    The adjoints in ``seeds`` are taken as they stand, not differentiated.
    """
    variables = list(variables)
    adjoint: dict[int, int] = {}
    for output, weight in seeds.items():
        adjoint[output] = graph.add(adjoint.get(output, graph.zero), weight)
    inner = _dependent(graph, list(seeds), set(variables))
    depending = {*inner, *variables}
    for node in reversed(inner):
        weight = adjoint.get(node, graph.zero)
        if weight == graph.zero:
            continue
        for operand, partial in _partials(graph, node, depending).items():
            adjoint[operand] = graph.add(adjoint.get(operand, graph.zero), graph.multiply(partial, weight))
    return [adjoint.get(variable, graph.zero) for variable in variables]


def _dependent(graph: Graph, outputs: Sequence[int], variables: set[int]) -> list[int]:
    """The inner nodes between ``variables`` and ``outputs``, ascending."""
    reached = set(variables)
    order: list[int] = []
    for node in graph.cone(outputs):
        if any(operand in reached for operand in graph.operands[node]):
            reached.add(node)
            order.append(node)
    return order


def _partials(graph: Graph, node: int, varying: Container[int]) -> dict[int, int]:
    """{operand: partial derivative} of ``node``; an operand that stands twice (a square) is met once.

    Of l * sin(x) with an l that does not vary, x counts as the operand: l * cos(x) is what velocities are made of, so
    that it is there already.
    """
    if graph.code[node] == MULTIPLY:
        a, b = graph.operands[node]
        factor, other = (a, b) if b in varying else (b, a)
        if factor not in varying and graph.code[other] in FUNCTIONS:
            (below,) = graph.operands[other]
            return {below: graph.multiply(factor, _partials(graph, other, varying)[below])}
    derivative = OPERATIONS[graph.code[node]].derivative
    assert derivative is not None  # constants and symbols have no operands and never come here
    operands, partials = graph.operands[node], derivative(graph, graph.operands[node], node)
    merged: dict[int, int] = {}
    for operand, partial in zip(operands, partials, strict=True):
        merged[operand] = graph.add(merged[operand], partial) if operand in merged else partial
    return merged
