"""The language of expressions: the functions a mechanism may use, bounds on size, values, and the normal form."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction

import sympy as sp

from lag2fmu.errors import MechanismError

TIME = sp.Symbol("t", real=True)
"""The time, in seconds."""

FUNCTIONS: dict[str, tuple[int, Callable[..., sp.Expr]]] = {
    "sin": (1, sp.sin),
    "cos": (1, sp.cos),
    "tan": (1, sp.tan),
    "asin": (1, sp.asin),
    "acos": (1, sp.acos),
    "atan": (1, sp.atan),
    "atan2": (2, sp.atan2),
    "sinh": (1, sp.sinh),
    "cosh": (1, sp.cosh),
    "tanh": (1, sp.tanh),
    "sqrt": (1, sp.sqrt),
    "exp": (1, sp.exp),
    "log": (1, sp.log),
    "abs": (1, sp.Abs),
    "sign": (1, sp.sign),
    "heaviside": (1, sp.Heaviside),
    "min": (-2, sp.Min),
    "max": (-2, sp.Max),
}
"""Name -> (number of arguments, constructor); -2 means two or more."""

NAME_OF = {constructor: name for name, (_, constructor) in FUNCTIONS.items() if name != "sqrt"}
CONSTANTS = {"pi": sp.pi}

MAX_LENGTH, MAX_NESTING, MAX_POWER, MAX_ARGUMENTS = 100_000, 60, 64, 16
MAX_DIGITS, MAX_BITS, MAX_NUMBER_DEPTH = 400, 1020, 12


def symbol(name: str) -> sp.Symbol:
    """The real symbol called ``name``; all expressions of a record consist of such symbols."""
    return sp.Symbol(name, real=True)


# ---------------------------------------------------------------------------------------------------- normal form


def normal_form(expression: object, where: str) -> sp.Expr:
    """``expression`` (SymPy, int, float, Fraction) with plain real symbols and exact numbers.

    A float becomes the shortest decimal fraction that reads back to it, so that text and Python mean the same number.
    Raises MechanismError with ``where`` for anything that has no real value or a function outside FUNCTIONS.
    """
    if isinstance(expression, (bool, str)):
        raise MechanismError(
            f"{where}: expected an expression, got {expression!r}; give a number or a SymPy expression"
        )
    try:
        result = sp.sympify(expression, strict=True)
    except sp.SympifyError as error:
        raise MechanismError(f"{where}: expected an expression, got {expression!r}") from error
    if not isinstance(result, sp.Expr) or result.is_Matrix:
        raise MechanismError(f"{where}: expected a scalar expression, got {type(result).__name__} '{result}'")
    numbers = {number: _exact(float(number), where) for number in result.atoms(sp.Float)}
    symbols = {old: symbol(old.name) for old in result.free_symbols if old != symbol(old.name)}
    result = _rebuilt(result.xreplace({**numbers, **symbols}))
    _refuse_foreign(result, where)
    for node in result.atoms(sp.Number, sp.Pow, sp.Function):
        if fault := excess(node):
            raise MechanismError(f"{where}: {fault} in '{node}'")
        if node.args and node.is_number:
            _refuse_unreal(node, where)
    return result


def _rebuilt(expression: sp.Expr) -> sp.Expr:
    """``expression`` evaluated again from its leaves, as reading its text does: SymPy leaves abs(abs(x)) at times."""
    if not expression.args:
        return expression
    arguments = tuple(_rebuilt(a) for a in expression.args)
    return expression.func(*arguments)


def _refuse_unreal(number: sp.Expr, where: str) -> None:
    try:
        value_of(number)
    except (ValueError, ArithmeticError) as error:
        raise MechanismError(f"{where}: '{number}' has no real value that a float can hold") from error


def _exact(value: float, where: str) -> sp.Expr:
    if not math.isfinite(value):
        raise MechanismError(f"{where}: the number {value} is not finite")
    return sp.Rational(Fraction(repr(value)))


def excess(node: sp.Expr) -> str:
    """What is beyond the bounds in ``node`` itself: a power above MAX_POWER, a number no float holds; else ''."""
    if node.is_Pow and node.exp.is_Rational and abs(node.exp) > MAX_POWER:
        return f"a power beyond {MAX_POWER}"
    if node.is_Rational and node and abs(node.p.bit_length() - node.q.bit_length()) > MAX_BITS:
        return "a number beyond 1e307 or below 1e-307"
    if node.is_Rational and max(node.p.bit_length(), node.q.bit_length()) > 4 * MAX_DIGITS:
        return f"a number of more than {MAX_DIGITS} digits"
    return ""


_FLOAT: dict[object, Callable[..., float]] = {
    **{FUNCTIONS[name][1]: getattr(math, name) for name in ("sin", "cos", "tan", "asin", "acos", "atan", "atan2")},
    **{FUNCTIONS[name][1]: getattr(math, name) for name in ("sinh", "cosh", "tanh", "exp", "log")},
    sp.Abs: abs,
    sp.Min: min,
    sp.Max: max,
    sp.Add: lambda *terms: math.fsum(terms),
    sp.Mul: lambda *factors: math.prod(factors),
    sp.Pow: math.pow,
    sp.sign: lambda x: float((x > 0) - (x < 0)),
    sp.Heaviside: lambda x, middle: 0.5 * ((x > 0) + (x >= 0)),
}


def value_of(number: sp.Expr, values: Mapping[str, float] | None = None) -> float:
    """The value of an expression in plain floats, ``values`` being those of its symbols.

    SymPy's own evaluation may take forever. Raises OverflowError beyond the floats, ValueError or ZeroDivisionError
    where there is no real value, KeyError for a symbol without value.
    """
    if number.is_Rational:
        return int(number.p) / int(number.q)
    if number.is_Symbol:
        return (values or {})[number.name]
    if not number.args:
        return float(number)
    return _FLOAT[number.func](*(value_of(a, values) for a in number.args))


def depth(number: sp.Expr) -> int:
    """The depth of the tree of ``number``."""
    return 1 + max((depth(a) for a in number.args), default=0)


def _refuse_foreign(expression: sp.Expr, where: str) -> None:
    if expression.has(sp.zoo, sp.nan, sp.oo, -sp.oo):
        raise MechanismError(f"{where}: '{expression}' is not finite (a division by zero?)")
    if expression.has(sp.I):
        raise MechanismError(f"{where}: '{expression}' is not real (a root or logarithm of a negative number?)")
    for node in expression.atoms(sp.Function, sp.Min, sp.Max):
        if node.func not in NAME_OF:
            raise MechanismError(
                f"{where}: the function '{node.func}' is not supported; known are {', '.join(FUNCTIONS)}"
            )
    if expression.atoms(sp.Derivative, sp.Integral, sp.Piecewise):
        raise MechanismError(f"{where}: '{expression}' has a derivative, integral or case distinction; write it out")


def free_names(expressions: Iterable[sp.Expr]) -> set[str]:
    """The names of all symbols in ``expressions``."""
    return {s.name for expression in expressions for s in expression.free_symbols}
