"""Tables of measured data as interpolants: the coefficients of their polynomials, by SciPy.

There are three kinds. Linear interpolation. Monotone cubic pieces: F. N. Fritsch, J. Butland, A method for constructing
local monotone piecewise cubic interpolants, SIAM J. Sci. Stat. Comput. 5 (1984) 300-304. Cubic splines, whose second
derivatives are continuous, and whose third ones are continuous at the knots beside the ends (not-a-knot): C. de Boor, A
Practical Guide to Splines, chapter IV.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lag2fmu.description.tables import Table
from lag2fmu.dynamics.functions import Array, Function, TableArgument, nodes_of, with_nodes
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.operations import CODE, SYMBOL

if TYPE_CHECKING:
    from lag2fmu.graph.interpolants import Interpolant

Floats = NDArray[np.float64]

LOOKUPS = {CODE["lookup"]: 1, CODE["lookup_2"]: 2}
"""{code of a lookup operation: the number of arguments of its table}."""


SMOOTH = {"linear": 0, "pchip": 1, "cubic": 2}
"""{interpolation: the greatest order of derivatives that are continuous at inner knots}."""


def interpolant(table: Table) -> Interpolant:
    """The ``table`` as piecewise polynomials in SI units.

    Source: Fritsch, Butland (1984) for monotone pieces; C. de Boor, A Practical Guide to Splines, chapter IV, for
    splines.
    """
    from lag2fmu.graph.interpolants import Interpolant

    knots = tuple(np.array(axis, dtype=np.float64) for axis in table.grid.axes)
    values = np.array(table.grid.values, dtype=np.float64).reshape([len(axis) for axis in knots])
    found, smooth = _pieces(knots[0], values, table.interpolation), SMOOTH[table.interpolation]
    if len(knots) == 1:
        return Interpolant(table.name, knots, np.ascontiguousarray(found.T), table.outside, smooth)
    both = _pieces(knots[1], np.moveaxis(found, -1, 0), table.interpolation)  # (d + 1, m - 1, d + 1, n - 1)
    return Interpolant(table.name, knots, np.ascontiguousarray(both.transpose(3, 1, 2, 0)), table.outside, smooth)


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
    """The arguments of tables that have no value outside their data, as functions of the ``state``."""
    if not graph.tables:
        return []
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


MOST_KINKS, MOST_PIECES = 64, 256
"""Solvers do not stop at the kinks of a table with more kinks, or with more pieces between them."""


def in_pieces(
    graph: Graph, functions: Sequence[Function], effective: Sequence[Node], moving: Collection[Node], *, forceful: bool
) -> tuple[Function, ...]:
    """``functions`` in which tables with kinks are replaced by choices between smooth pieces.

    The kinks of the choices become switches as other kinks do. ``forceful``: events depend on forces, which jump with
    the curvature of monotone pieces in a gap; so these are parted, too. Replaced are the tables that ``effective``
    nodes need and whose arguments contain ``moving`` variables. A table with an error outside its data stays as it is,
    because a piece has no end at which to report.
    """
    chosen = _with_pieces(graph, effective, {*moving}, forceful) if graph.tables else {}
    if not chosen:
        return tuple(functions)
    new: dict[Node, Node] = {}
    with graph.as_written():
        for node in nodes_of(graph, functions):
            operands = [new[operand] for operand in graph.operands[node]]
            if node in chosen:
                new[node] = _pieced(graph, operands, chosen[node])
            else:
                new[node] = node if list(graph.operands[node]) == operands else graph.rebuild(node, operands)
    return tuple(with_nodes(functions, new))


def _with_pieces(graph: Graph, effective: Sequence[Node], moving: set[Node], forceful: bool) -> dict[Node, list[int]]:
    """{lookup that ``effective`` nodes need: the orders, by each argument, of the derivative that tells its kinks}.

    These are the highest ones of the same table at the same arguments if events are ``forceful``, because velocities
    have to change to another piece together with accelerations; else 0.
    """
    orders: dict[tuple[Node, ...], list[int]] = {}
    found: dict[Node, tuple[Node, ...]] = {}
    for node in graph.cone(effective):
        arity = LOOKUPS.get(graph.code[node])
        if arity is not None:
            table, *rest = graph.operands[node]
            found[node] = (table, *rest[arity:])
            own = [int(graph.value(order)) if forceful else 0 for order in rest[:arity]]
            orders[found[node]] = [max(pair) for pair in zip(own, orders.get(found[node], own), strict=True)]
    return {node: orders[at] for node, at in found.items() if _has_pieces(graph, at, orders[at], moving)}


def _has_pieces(graph: Graph, at: tuple[Node, ...], orders: Sequence[int], moving: set[Node]) -> bool:
    """Whether solvers stop at the kinks of the derivative of ``orders``, of the table and at the arguments ``at``."""
    table, arguments = graph.tables[int(graph.value(at[0]))], at[1:]
    counts = [len(table.kinks(axis, order)) for axis, order in enumerate(orders)]
    few = sum(counts) <= MOST_KINKS and math.prod(count + 1 for count in counts) <= MOST_PIECES
    located = [x for x in arguments if graph.code[x] != CODE["passed"] and not moving.isdisjoint(graph.cone([x]))]
    return table.outside != "error" and few and any(counts) and len(located) > 0


@dataclass(frozen=True)
class _Cell:
    """Where a piece lies along one argument: in the interval ``index`` between knots, None for all intervals.

    ``at`` is the argument in this piece. Beyond the ends of a table that is ``held`` there, it is the end.
    """

    index: int | None
    at: Node
    held: bool = False


def _pieced(graph: Graph, operands: Sequence[Node], highest: Sequence[int]) -> Node:
    """A lookup of ``operands`` as choices, at each kink of the derivative of orders ``highest``."""
    table, arity = graph.tables[int(graph.value(operands[0]))], len(highest)
    orders, arguments = operands[1 : 1 + arity], [*zip(operands[1 + arity :], highest, strict=True)]
    return _chosen(graph, table, orders, arguments, ())


def _chosen(
    graph: Graph,
    table: Interpolant,
    orders: Sequence[Node],
    arguments: Sequence[tuple[Node, int]],
    cells: tuple[_Cell, ...],
) -> Node:
    """The choices along the arguments that have no cell yet; ``cells`` are those of the arguments before them.

    With each argument goes the order of the derivative whose kinks part the choices.
    """
    if len(cells) == table.arity:
        return _piece(graph, table, orders, cells)
    (x, order), knots = arguments[len(cells)], table.knots[len(cells)]
    inside = range(len(knots) - 1) if table.in_intervals(order) else [None]
    options = [_Cell(index, x) for index in inside]
    if table.outside == "hold":
        first, last = (graph.constant(float(knots[i])) for i in (0, -1))
        options = [_Cell(0, first, True), *options, _Cell(len(knots) - 2, last, True)]
    pieces = [_chosen(graph, table, orders, arguments, (*cells, option)) for option in options]
    result = pieces[0]
    for bound, piece in zip(table.kinks(len(cells), order), pieces[1:], strict=True):
        result = graph.choose(graph.subtract(x, graph.constant(float(bound))), piece, result)
    return result


def _piece(graph: Graph, table: Interpolant, orders: Sequence[Node], cells: Sequence[_Cell]) -> Node:
    """The derivative of ``orders`` of the polynomial in these ``cells``, wherever the arguments are."""
    counts = [int(graph.value(order)) for order in orders]
    if any(count > 0 and cell.held for count, cell in zip(counts, cells, strict=True)):
        return graph.zero
    if all(cell.held for cell in cells):
        return graph.constant(float(table(counts, *(float(graph.value(cell.at)) for cell in cells))))
    if any(cell.index is None for cell in cells):
        return graph.lookup(_continued(graph, table), orders, [cell.at for cell in cells])
    return _in_one(graph, table, counts, cells)


def _in_one(graph: Graph, table: Interpolant, counts: Sequence[int], cells: Sequence[_Cell]) -> Node:
    """The derivative of orders ``counts`` of the polynomial of a ``table`` in these ``cells``, one interval each."""
    corner = [cell.index or 0 for cell in cells]
    knots = [float(axis[index]) for axis, index in zip(table.knots, corner, strict=True)]
    distances = [graph.subtract(cell.at, graph.constant(knot)) for cell, knot in zip(cells, knots, strict=True)]
    return _polynomial(graph, table.coefficients[tuple(corner)], distances, counts)


def _polynomial(graph: Graph, coefficients: Floats, distances: Sequence[Node], orders: Sequence[int]) -> Node:
    """The derivative of ``orders`` of the sum of ``coefficients`` times powers of ``distances``, by Horner's rule."""
    value = graph.zero
    for k in range(len(coefficients) - 1, orders[0] - 1, -1):
        part = math.perm(k, orders[0]) * coefficients[k]
        last = len(distances) == 1
        factor = graph.constant(float(part)) if last else _polynomial(graph, part, distances[1:], orders[1:])
        value = graph.add(graph.multiply(value, distances[0]), factor)
    return value


def _continued(graph: Graph, table: Interpolant) -> Node:
    """The number of the same table with extrapolation beyond its ends."""
    for number, known in enumerate(graph.tables):
        if known.coefficients is table.coefficients and known.outside == "extrapolate":
            return graph.constant(number)
    graph.tables.append(replace(table, outside="extrapolate"))
    return graph.constant(len(graph.tables) - 1)
