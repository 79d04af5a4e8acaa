"""From SymPy expressions to NumPy functions that are safe for the complex step and evaluate a whole batch at once.

The complex step f'(x) = Im f(x + i h) / h has no cancellation, so h may be tiny and the derivative is exact to rounding
(W. Squire, G. Trapp, Using complex variables to estimate derivatives of real functions, SIAM Review 40, 1998). With a
tiny h a complex number is a dual number. NumPy continues some functions differently (abs, sqrt of a negative, atan2,
...). These are given here as f(x) + i f'(x) Im z, and stay NaN where the real function is not defined.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache, reduce
from graphlib import TopologicalSorter
from typing import Any

import numpy as np
import sympy as sp
from numpy.typing import NDArray
from sympy.printing.str import StrPrinter
from sympy.utilities.iterables import numbered_symbols

from lag2fmu.deadline import paced
from lag2fmu.language.definitions import separated
from lag2fmu.language.rebuilding import replaced
from lag2fmu.language.vocabulary import NAME_OF, Choice, Smooth
from lag2fmu.reference.tables import Tabulated, number_of, tabulated

Array = NDArray[Any]

STEP = 2.0**-100
"""Length of the complex step; its square is far below rounding, and dividing by a power of two is exact."""

BLOCK = 4096
"""Points that are evaluated in one vectorised call: their intermediate results fit the cache."""

FEW = 3
"""At most this many points are evaluated one by one: NumPy's scalars take a fifth of the time of its short arrays."""

_EXACT = 2**53
"""Whole numbers up to this one are exact as doubles."""

Function = Callable[..., Any]


def _lifted(function: Function, slope: Function) -> Function:
    """``function`` of real arrays, continued to z = x + i h by its first derivative ``slope``."""

    def lifted(z: Any) -> Any:
        return function(z) if not np.iscomplexobj(z) else function(z.real) + 1j * (slope(z.real) * z.imag)

    return lifted


def absolute(z: Any) -> Any:
    """|z| for ``z`` of any shape, with the derivative sign(z), which is 0 at 0."""
    return np.sign(np.real(z)) * z


def atan2(y: Any, x: Any) -> Any:
    """The angle of (x, y), in rad within [-pi, pi]; any shape."""
    a, b = np.real(y), np.real(x)
    angle = np.arctan2(a, b)
    if not (np.iscomplexobj(y) or np.iscomplexobj(x)):
        return angle
    return angle + 1j * ((b * np.imag(y) - a * np.imag(x)) / (a * a + b * b))


def power(base: Any, exponent: Any) -> Any:
    """base ** exponent, any shape, for exponents that are no small integers.

    NaN for a negative base with an exponent that is no integer.
    """
    x, y = np.real(base), np.real(exponent)
    value = np.power(x, y)
    if np.iscomplexobj(base):
        value = value + 1j * (y * np.power(x, y - 1.0) * np.imag(base))
    if np.iscomplexobj(exponent) and np.any(np.imag(exponent)):
        value = value + 1j * (np.real(value) * np.log(x) * np.imag(exponent))
    return value


def minimum(*values: Any) -> Any:
    """The least of ``values`` by their real parts."""
    return reduce(lambda a, b: np.where(np.real(a) <= np.real(b), a, b), values)


def choice(margin: Any, a: Any, b: Any) -> Any:
    """``a`` where the real part of ``margin`` is above 0, else ``b``; any shape."""
    return np.where(np.real(margin) > 0, a, b)


def maximum(*values: Any) -> Any:
    """The greatest of ``values`` by their real parts."""
    return reduce(lambda a, b: np.where(np.real(a) >= np.real(b), a, b), values)


NUMERIC: dict[str, Function] = {
    "sin": np.sin,
    "cos": np.cos,
    "sinh": np.sinh,
    "cosh": np.cosh,
    "tanh": np.tanh,
    "exp": np.exp,
    "tan": _lifted(np.tan, lambda x: 1.0 + np.tan(x) ** 2),
    "asin": _lifted(np.arcsin, lambda x: 1.0 / np.sqrt(1.0 - x * x)),
    "acos": _lifted(np.arccos, lambda x: -1.0 / np.sqrt(1.0 - x * x)),
    "atan": _lifted(np.arctan, lambda x: 1.0 / (1.0 + x * x)),
    "sqrt": _lifted(np.sqrt, lambda x: 0.5 / np.sqrt(x)),
    "log": _lifted(np.log, lambda x: 1.0 / x),
    "abs": absolute,
    "sign": lambda z: np.sign(np.real(z)),
    "heaviside": lambda z: np.heaviside(np.real(z), 0.5),
    "min": minimum,
    "max": maximum,
    "choice": choice,
    "atan2": atan2,
    "power": power,
    "tabulated": tabulated,
    "pi": np.pi,  # type: ignore[dict-item]
}
"""The meaning of every name that ``NumericPrinter`` writes."""


def number(value: sp.Expr) -> str:
    """The double nearest to ``value``, as text that Python and C read; an infinity beyond the range of doubles."""
    nearest = float(value)
    return repr(nearest) if np.isfinite(nearest) else f"{'-' if nearest < 0 else ''}1e999"


def _is_long(value: sp.Expr) -> bool:
    """Whether numerator or denominator are not exact as doubles. NumPy makes integers beyond 64 bits objects."""
    return bool(value.is_Rational) and max(abs(int(value.p)), int(value.q)) > _EXACT


class NumericPrinter(StrPrinter):  # type: ignore[misc]
    """Prints Python that calls NUMERIC.

    It differs from SymPy's printer in three points. Powers that are no integers or roots call ``power``, because NumPy
    would give complex values instead of NaN. The derivative of a jump, Dirac's delta, is 0, as it is almost everywhere.
    Fractions too long to be exact are one double.
    """

    printmethod = "_numeric"  # the functions of the language would print themselves as text

    def _print_Choice(self, expr: Choice) -> str:
        return f"choice({self.stringify(expr.args, ', ')})"

    def _print_Smooth(self, expr: Smooth) -> str:
        return f"({self._print(expr.args[0])})"

    def _print_Function(self, expr: sp.Expr) -> str:
        if isinstance(expr, Tabulated):
            return f"tabulated({number_of(expr)}, {self.stringify(expr.args, ', ')})"
        arguments = expr.args[:1] if isinstance(expr, sp.Heaviside) else expr.args
        return f"{NAME_OF[expr.func]}({self.stringify(arguments, ', ')})"

    _print_Abs = _print_Heaviside = _print_Min = _print_Max = _print_LatticeOp = _print_Function

    def _print_Pow(self, expr: sp.Expr, rational: bool = False) -> str:
        if expr.exp.is_Integer or abs(expr.exp) == sp.S.Half:
            return str(super()._print_Pow(expr, rational))
        return f"power({self._print(expr.base)}, {self._print(expr.exp)})"

    def _print_Mul(self, expr: sp.Expr) -> str:
        factor, rest = expr.as_coeff_Mul()
        return f"{number(factor)}*({self._print(rest)})" if _is_long(factor) else str(super()._print_Mul(expr))

    def _print_Integer(self, expr: sp.Expr) -> str:
        return number(expr) if _is_long(expr) else str(super()._print_Integer(expr))

    def _print_Rational(self, expr: sp.Expr) -> str:
        return number(expr) if _is_long(expr) else str(super()._print_Rational(expr))

    def _print_DiracDelta(self, expr: sp.Expr) -> str:
        return "0.0"

    _print_Derivative = _print_DiracDelta  # the derivative of sign

    def _print_Exp1(self, expr: sp.Expr) -> str:
        return repr(float(np.e))


Steps = list[tuple[sp.Symbol, sp.Expr]]


def shared(expressions: Sequence[sp.Expr]) -> tuple[Steps, list[sp.Expr]]:
    """The shared parts of ``expressions`` as steps, and the ``expressions`` in terms of these, (k,).

    Steps are long definitions (d0, ...) and common subexpressions (c0, ...); each stands after those that it uses.
    Their names differ from those of the arguments, a0, a1, ...
    """
    definitions, outputs = separated(expressions, "d")
    bodies = [*(body for _, body in definitions), *outputs]
    common, left = sp.cse(bodies, symbols=numbered_symbols("c", real=True), list=False, order="none")
    steps = dict(common) | dict(zip((name for name, _ in definitions), left, strict=False))
    if definitions:  # definitions use common subexpressions, and these use other definitions
        uses = {name: sorted(body.free_symbols & steps.keys(), key=str) for name, body in steps.items()}
        steps = {name: steps[name] for name in TopologicalSorter(uses).static_order()}
    return list(steps.items()), left[len(definitions) :]


PART = 500
"""Expressions that are compiled together, which share their common parts."""

Compiled = Callable[[Array, Sequence[float]], Array]
"""A function (rows, constants) -> (k, *shape), see ``compiled``."""


def compiled(arguments: Sequence[sp.Symbol], expressions: Sequence[sp.Expr]) -> Compiled:
    """A function (rows, constants) -> (k, *shape) that evaluates the k ``expressions``.

    The first ``arguments`` are the rows of an array (rows, *shape), real or complex, the others are ``constants``
    of type float64. Any size of batch is taken, in blocks of BLOCK points. Values outside the range of a function
    give inf or NaN, without a warning. The functions compiled last are kept: a mechanism's equations are often built
    again with other parameters.
    """
    parts = [tuple(expressions[i : i + PART]) for i in range(0, max(len(expressions), 1), PART)]
    functions = [_compiled(tuple(arguments), part) for part in paced(parts)]  # SymPy takes minutes for thousands
    if len(functions) == 1:
        return functions[0]
    return lambda rows, constants: np.concatenate([function(rows, constants) for function in functions])


@lru_cache(maxsize=128)
def _compiled(
    arguments: tuple[sp.Symbol, ...], expressions: tuple[sp.Expr, ...]
) -> Callable[[Array, Sequence[float]], Array]:
    renamed = {old: sp.Symbol(f"a{i}", real=True) for i, old in enumerate(arguments)}
    outputs = [replaced(expression, renamed) for expression in expressions]
    function = sp.lambdify(
        list(renamed.values()), outputs, modules=[NUMERIC], printer=NumericPrinter({"order": "none"}), cse=shared
    )

    def evaluate(rows: Array, constants: Sequence[float]) -> Array:
        if rows.ndim == 1:
            with np.errstate(all="ignore"):
                return np.array(function(*rows, *constants), rows.dtype)
        flat = rows.reshape(len(rows), math.prod(rows.shape[1:]))
        out = np.empty((len(outputs), flat.shape[1]), rows.dtype)
        with np.errstate(all="ignore"):
            if flat.shape[1] <= FEW:
                for i, point in enumerate(flat.T):
                    out[:, i] = function(*point, *constants)
                return out.reshape(len(outputs), *rows.shape[1:])
            for start in range(0, flat.shape[1], BLOCK):
                block = slice(start, start + BLOCK)
                for line, value in zip(out, function(*flat[:, block], *constants), strict=True):
                    line[block] = value
        return out.reshape(len(outputs), *rows.shape[1:])

    return evaluate


def in_blocks(evaluate: Callable[[Array], Array], rows: Array, count: int, width: int = 1) -> Array:
    """``evaluate`` (rows, N) -> (count, N) for rows of any shape, at most BLOCK / width points a call."""
    flat, size = rows.reshape(len(rows), -1), max(1, BLOCK // width)
    out = np.empty((count, flat.shape[1]), rows.dtype)
    with np.errstate(all="ignore"):
        for start in range(0, flat.shape[1], size):
            out[:, start : start + size] = evaluate(flat[:, start : start + size])
    return out.reshape(count, *rows.shape[1:])


class Slots:
    """Expressions that are evaluated together; each user keeps the slice of his own values.

    ``written`` writes out the definitions in an expression of a mechanism; ``rate`` gives the time derivative of the
    result.
    """

    def __init__(self, written: Callable[[Any], sp.Expr], rate: Callable[[sp.Expr], sp.Expr]) -> None:
        self.expressions: list[sp.Expr] = []
        self.written, self.rate = written, rate

    def add(self, expressions: Sequence[sp.Expr]) -> slice:
        """The slice in which the values of the k ``expressions`` will stand among all values."""
        start = len(self.expressions)
        self.expressions += expressions
        return slice(start, len(self.expressions))


def unit_vector(vector: Sequence[sp.Expr]) -> list[sp.Expr]:
    """The direction of ``vector`` (3,), of any length, as expressions (3,)."""
    length = sp.sqrt(sp.Add(*(x**2 for x in vector)))
    return [x / length for x in vector]
