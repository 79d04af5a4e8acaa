"""Tables of measured data by SciPy's own interpolators, as functions of expressions.

Splines of two arguments are tensor products of B-splines: C. de Boor, A Practical Guide to Splines, chapter XVII.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
import sympy as sp
from numpy.typing import NDArray
from sympy.printing.latex import LatexPrinter
from sympy.printing.str import StrPrinter

from lag2fmu.description.tables import Table
from lag2fmu.language.vocabulary import TableCall, table_function

Data = tuple[tuple[tuple[float, ...], ...], tuple[float, ...], str, str]
"""A table's arguments, values, kind of interpolation, and what holds outside its data."""


Floats = NDArray[np.float64]


class Tabulated(sp.Function):  # type: ignore[misc]
    """A table that knows its ``data``, or its partial derivative of ``orders``, one order for each argument."""

    is_real = True
    is_number = False
    table: ClassVar[str]
    data: ClassVar[Data]
    orders: ClassVar[tuple[int, ...]]

    def _sympystr(self, printer: StrPrinter) -> str:
        """The call of the table, as a user writes it."""
        return str(printer._print(table_function(self.table, self.orders)(*self.args)))

    def _latex(self, printer: LatexPrinter, exp: str = "") -> str:
        return str(table_function(self.table, self.orders)(*self.args)._latex(printer, exp))

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """The partial derivative by the argument ``argindex``, from 1 on."""
        orders = tuple(order + (k == argindex - 1) for k, order in enumerate(self.orders))
        return _function(self.table, self.data, orders)(*self.args)


@lru_cache(maxsize=256)
def _function(table: str, data: Data, orders: tuple[int, ...]) -> type[Tabulated]:
    """The class of a table and its derivatives; there is one for each, so that equal calls are equal expressions."""
    name, members = f"table {len(_KNOWN)}", {"table": table, "data": data, "orders": orders}
    made: type[Tabulated] = type(name, (Tabulated,), {**members, "nargs": (len(orders),)})
    _KNOWN.append(made)
    return made


_KNOWN: list[type[Tabulated]] = []
"""All classes that were made; the text of an expression names them by their number."""


def with_data(expression: sp.Expr, tables: Mapping[str, Table]) -> sp.Expr:
    """``expression`` with the calls of ``tables`` replaced by functions that know their data."""
    if not expression.has(TableCall):
        return expression

    def bound(*arguments: sp.Expr, call: TableCall) -> sp.Expr:
        table = tables[call.table]
        data = (table.grid.axes, table.grid.values, table.interpolation, table.outside)
        return _function(call.table, data, call.orders or (0,) * len(arguments))(*arguments)

    return expression.replace(lambda e: isinstance(e, TableCall), lambda e: bound(*e.args, call=e))


def straight_pieces(call: Tabulated) -> Floats | None:
    """The factors C, one index for each argument, of a table of straight pieces; None if ``call`` is no such table.

    The table is the sum of C[i] p_i(x), or of C[i, j] p_i(x) p_j(y), where p is 1, x - x_0 and then max(0, x - x_k) for
    each point x_k of this argument. It is no such table where it is smooth, a derivative, or ends with an error.
    """
    axes, values, kind, outside = call.data
    if kind != "linear" or any(call.orders) or outside == "error":
        return None
    found = np.reshape(values, [len(axis) for axis in axes])
    for k, axis in enumerate(axes):
        along = np.moveaxis(found, k, 0)
        slopes = (np.diff(along, axis=0).T / np.diff(axis)).T
        beyond = np.zeros_like(slopes) if outside == "hold" else slopes
        slopes = np.concatenate([beyond[:1], slopes, beyond[-1:]])
        found = np.moveaxis(np.concatenate([along[:1], slopes[:1], np.diff(slopes, axis=0)]), 0, k)
    return found


def without_ends(call: Tabulated) -> type[Tabulated] | None:
    """The smooth table that goes on beyond its ends where ``call`` holds its values; None if it is no such table."""
    axes, values, kind, outside = call.data
    if kind == "linear" or any(call.orders) or outside != "hold":
        return None
    return _function(call.table, (axes, values, kind, "extrapolate"), call.orders)


def number_of(call: Tabulated) -> int:
    """The number by which ``tabulated`` finds the class of ``call``."""
    return _KNOWN.index(type(call))


def tabulated(number: int, *arguments: Any) -> Any:
    """The values of the class ``number`` at ``arguments``; complex ones are continued by the first derivative."""
    made = _KNOWN[number]
    real = [np.real(x) for x in arguments]
    value = _values(made.data, made.orders, real)
    for k, x in enumerate(arguments):
        if np.iscomplexobj(x):
            orders = tuple(order + (i == k) for i, order in enumerate(made.orders))
            value = value + 1j * (_values(made.data, orders, real) * np.imag(x))
    return value


def _values(data: Data, orders: tuple[int, ...], arguments: list[Any]) -> Any:
    """The derivative of ``orders`` where the table has one: 0 beyond its ends where the value is held."""
    axes, _, _, outside = data
    spline = _spline(data)
    points = list(np.broadcast_arrays(*arguments))
    beyond = [(x < axis[0]) | (x > axis[-1]) for x, axis in zip(points, axes, strict=True)]
    if outside == "hold":
        points = [np.clip(x, axis[0], axis[-1]) for x, axis in zip(points, axes, strict=True)]
    value = spline(points, orders)
    if outside == "hold":
        flat = [out & (order > 0) for out, order in zip(beyond, orders, strict=True)]
        value = np.where(np.any(flat, axis=0), 0.0, value)
    return np.where(np.any(beyond, axis=0), np.nan, value) if outside == "error" else value


@lru_cache(maxsize=64)
def _spline(data: Data) -> Callable[[Any, tuple[int, ...]], Any]:
    """A function (points, orders) -> values that extrapolates beyond the ends of the data.

    Source: C. de Boor, A Practical Guide to Splines, chapter XVII, for tensor products.
    """
    from scipy.interpolate import BSpline, CubicSpline, PchipInterpolator, make_interp_spline

    axes, flat, kind, _ = data
    degrees = [1 if kind == "linear" else min(3, len(axis) - 1) for axis in axes]
    if len(axes) == 1:
        single: Any = make_interp_spline(axes[0], flat, k=1)
        if kind != "linear":
            single = (CubicSpline if kind == "cubic" else PchipInterpolator)(axes[0], flat)
        return lambda points, orders: single(points[0], orders[0])
    values = np.reshape(flat, [len(axis) for axis in axes])
    first = make_interp_spline(axes[0], values, k=degrees[0])
    second = make_interp_spline(axes[1], first.c, k=degrees[1], axis=1)
    along = BSpline(second.t, second.c, degrees[1])

    def of_two(points: Any, orders: tuple[int, ...]) -> Any:
        rows = along(np.ravel(points[1]), orders[1])  # coefficients of the first argument, (points, n)
        pairs = zip(np.ravel(points[0]), rows, strict=True)
        found = [BSpline(first.t, row, degrees[0])(x, orders[0]) for x, row in pairs]
        return np.reshape(found, np.shape(points[0]))

    return of_two
