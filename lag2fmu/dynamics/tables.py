"""Tables of measured data as interpolants: the coefficients of their polynomials, by SciPy.

Linear interpolation; F. N. Fritsch, J. Butland, A method for constructing local monotone piecewise cubic interpolants,
SIAM J. Sci. Stat. Comput. 5 (1984) 300-304; cubic splines with continuous second derivatives and, at the ends,
continuous third ones (not-a-knot): C. de Boor, A Practical Guide to Splines, chapter IV.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lag2fmu.description.tables import Table
from lag2fmu.dynamics.functions import Array, Function, TableArgument, nodes_of, with_nodes
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.interpolants import Interpolant
from lag2fmu.graph.operations import CODE, LOOKUP, SYMBOL

Floats = NDArray[np.float64]

LOOKUPS = {CODE["lookup"]: 1, CODE["lookup_2"]: 2}
"""Codes of lookups -> number of arguments."""


def interpolant(table: Table) -> Interpolant:
    """The ``table`` as piecewise polynomials in SI units."""
    knots = tuple(np.array(axis, dtype=np.float64) for axis in table.grid.axes)
    values = np.array(table.grid.values, dtype=np.float64).reshape([len(axis) for axis in knots])
    found = _pieces(knots[0], values, table.interpolation)  # (d + 1, n - 1, ...)
    if len(knots) == 1:
        return Interpolant(table.name, knots, np.ascontiguousarray(found.T), table.outside)
    both = _pieces(knots[1], np.moveaxis(found, -1, 0), table.interpolation)  # (d + 1, m - 1, d + 1, n - 1)
    return Interpolant(table.name, knots, np.ascontiguousarray(both.transpose(3, 1, 2, 0)), table.outside)


def _pieces(knots: Floats, values: Floats, kind: str) -> Floats:
    """Coefficients of ascending powers (d + 1, n - 1, ...) of ``values`` (n, ...) over ``knots`` (n,)."""
    from scipy.interpolate import CubicSpline, PchipInterpolator

    if kind == "linear":
        steps = np.diff(knots).reshape(-1, *(1,) * (values.ndim - 1))
        return np.stack([values[:-1], np.diff(values, axis=0) / steps])
    found: Floats = (CubicSpline if kind == "cubic" else PchipInterpolator)(knots, values, axis=0).c[::-1]
    return found


def lookups(graph: Graph, nodes: list[Node]) -> Iterator[tuple[Interpolant, tuple[int, ...], tuple[Node, ...]]]:
    """(table, orders of derivatives, arguments) of each node among ``nodes`` that looks something up."""
    for node in nodes:
        arity = LOOKUPS.get(graph.code[node])
        if arity is not None:
            table, *rest = graph.operands[node]
            orders = tuple(int(graph.value(order)) for order in rest[:arity])
            yield graph.tables[int(graph.value(table))], orders, tuple(rest[arity:])


def watched_arguments(
    graph: Graph, functions: Iterable[Function], state: tuple[Array, ...]
) -> list[tuple[Node, TableArgument]]:
    """The arguments, functions of the ``state``, of tables that have no value outside their data."""
    given = {entry for array in state for entry in array.entries}
    nodes = graph.cone(node for f in functions for *_, node in f.results)
    found: dict[tuple[Node, str], TableArgument] = {}
    for table, _, arguments in lookups(graph, nodes):
        for axis, argument in enumerate(arguments):
            symbols = {node for node in graph.cone([argument]) if graph.code[node] == SYMBOL}
            if table.outside == "error" and symbols <= given:
                knots = table.knots[axis]
                found[argument, table.name] = TableArgument(table.name, axis + 1, float(knots[0]), float(knots[-1]))
    return [(argument, range_of) for (argument, _), range_of in found.items()]


MOST_KINKS = 64
"""A table with more kinks than this is passed by solvers without a stop at each."""


def in_pieces(
    graph: Graph, functions: Sequence[Function], effective: Sequence[Node], moving: Collection[Node]
) -> tuple[Function, ...]:
    """``functions`` whose tables of one argument with kinks are choices between smooth pieces.

    Those that ``effective`` nodes need, with arguments that contain ``moving`` variables: their kinks then are
    switches like others. A linear table with an error outside stays as it is, for a piece has no end.
    """
    chosen = {node for node in graph.cone(effective) if _has_pieces(graph, node, {*moving})}
    if not chosen:
        return tuple(functions)
    new: dict[Node, Node] = {}
    with graph.as_written():
        for node in nodes_of(graph, functions):
            operands = [new[operand] for operand in graph.operands[node]]
            if node in chosen:
                new[node] = _pieced(graph, operands)
            else:
                new[node] = node if list(graph.operands[node]) == operands else graph.rebuild(node, operands)
    return tuple(with_nodes(functions, new))


def _has_pieces(graph: Graph, node: Node, moving: set[Node]) -> bool:
    if graph.code[node] != LOOKUP:
        return False
    table, argument = graph.tables[int(graph.value(graph.operands[node][0]))], graph.operands[node][-1]
    located = table.outside != "error" and 0 < len(table.kinks()) <= MOST_KINKS
    return located and graph.code[argument] != CODE["passed"] and not moving.isdisjoint(graph.cone([argument]))


def _pieced(graph: Graph, operands: Sequence[Node]) -> Node:
    """A lookup of ``operands`` as choices, at each kink between what is above and below it."""
    number, order, x = operands
    table, count = graph.tables[int(graph.value(number))], int(graph.value(order))
    (knots,) = table.knots
    if table.degree == 1:
        pieces = [_piece(graph, table, i, count, x) for i in range(len(knots) - 1)]
        bounds = [float(knot) for knot in knots[1:-1]]
    else:
        pieces, bounds = [graph.lookup(_continued(graph, table), (order,), (x,))], []
    if table.outside == "hold":
        first, last = (graph.constant(0 if count else float(table((0,), knots[i]))) for i in (0, -1))
        pieces, bounds = [first, *pieces, last], [float(knots[0]), *bounds, float(knots[-1])]
    result = pieces[0]
    for bound, piece in zip(bounds, pieces[1:], strict=True):
        result = graph.choose(graph.subtract(x, graph.constant(bound)), piece, result)
    return result


def _piece(graph: Graph, table: Interpolant, i: int, order: int, x: Node) -> Node:
    """The derivative of the polynomial of interval ``i``, wherever x is, by Horner's rule."""
    distance, value = graph.subtract(x, graph.constant(float(table.knots[0][i]))), graph.zero
    for k in range(table.degree, order - 1, -1):
        factor = graph.constant(math.perm(k, order) * float(table.coefficients[i, k]))
        value = graph.add(graph.multiply(value, distance), factor)
    return value


def _continued(graph: Graph, table: Interpolant) -> Node:
    """The number of the same table that goes on beyond its ends."""
    for number, known in enumerate(graph.tables):
        if known.coefficients is table.coefficients and known.outside == "extrapolate":
            return graph.constant(number)
    graph.tables.append(replace(table, outside="extrapolate"))
    return graph.constant(len(graph.tables) - 1)
