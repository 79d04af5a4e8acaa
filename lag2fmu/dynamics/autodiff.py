"""Forward and reverse automatic differentiation on the graph; both return nodes, so they nest.

Source: A. Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, sections 3.1 (tangents) and 3.2 (adjoints).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from lag2fmu.dynamics.graph import Graph
from lag2fmu.dynamics.operations import OPERATIONS


def forward(graph: Graph, outputs: Sequence[int], seeds: Mapping[int, int]) -> list[int]:
    """Directional derivatives of ``outputs``, (k,) nodes, in the direction ``seeds`` {variable: its rate}."""
    tangent: dict[int, int] = dict(seeds)
    for node in graph.cone(outputs):
        if node in tangent:
            continue
        moving = [operand for operand in dict.fromkeys(graph.operands(node)) if operand in tangent]
        if moving:
            partials = _partials(graph, node)
            rate = graph.total(graph.multiply(partials[operand], tangent[operand]) for operand in moving)
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
    for node in reversed(_dependent(graph, list(seeds), set(variables))):
        weight = adjoint.get(node, graph.zero)
        if weight == graph.zero:
            continue
        for operand, partial in _partials(graph, node).items():
            adjoint[operand] = graph.add(adjoint.get(operand, graph.zero), graph.multiply(partial, weight))
    return [adjoint.get(variable, graph.zero) for variable in variables]


def _dependent(graph: Graph, outputs: Sequence[int], variables: set[int]) -> list[int]:
    """The inner nodes between ``variables`` and ``outputs``, ascending."""
    reached = set(variables)
    order: list[int] = []
    for node in graph.cone(outputs):
        if any(operand in reached for operand in graph.operands(node)):
            reached.add(node)
            order.append(node)
    return order


def _partials(graph: Graph, node: int) -> dict[int, int]:
    """{operand: partial derivative} of ``node``; an operand that stands twice (a square) is met once."""
    derivative = OPERATIONS[graph.code[node]].derivative
    assert derivative is not None  # constants and symbols have no operands and never come here
    operands, partials = graph.operands(node), derivative(graph, graph.operands(node), node)
    merged: dict[int, int] = {}
    for operand, partial in zip(operands, partials, strict=True):
        merged[operand] = graph.add(merged[operand], partial) if operand in merged else partial
    return merged
