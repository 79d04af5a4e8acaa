"""Tables of measured data as interpolants: the coefficients of their polynomials, by SciPy.

Linear interpolation; F. N. Fritsch, J. Butland, A method for constructing local monotone piecewise cubic interpolants,
SIAM J. Sci. Stat. Comput. 5 (1984) 300-304; cubic splines with continuous second derivatives and, at the ends,
continuous third ones (not-a-knot): C. de Boor, A Practical Guide to Splines, chapter IV.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.interpolants import Interpolant
from lag2fmu.graph.operations import CODE
from lag2fmu.mechanism import Table

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


def kinks(graph: Graph, nodes: list[Node]) -> dict[Node, Floats]:
    """{argument: where the first derivative of a table jumps along it} of the lookups among ``nodes``.

    Solvers have to stop there: the margins of such a switch are argument - knot.
    """
    found: dict[Node, Floats] = {}
    for table, _, arguments in lookups(graph, nodes):
        for axis, argument in enumerate(arguments):
            knots = table.kinks(axis)
            if len(knots) and not graph.is_constant(argument):
                found[argument] = np.union1d(found.get(argument, np.empty(0)), knots)
    return found
