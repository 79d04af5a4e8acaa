"""The language of expressions: the functions a mechanism may use, bounds on size, values, and the normal form."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import cache
from typing import ClassVar

import sympy as sp
from sympy.printing.latex import LatexPrinter
from sympy.printing.str import StrPrinter

from lag2fmu.errors import MechanismError
from lag2fmu.language.rebuilding import replaced

TIME = sp.Symbol("t", real=True)
"""The time, in seconds."""


class Own(sp.Function):  # type: ignore[misc]
    """A function that SymPy does not know: real, and printed by itself."""

    is_real = True

    def _latex(self, printer: LatexPrinter, exp: str = "") -> str:
        """LaTeX, with an exponent ``exp`` if there is one."""
        return f"\\left({self._tex(printer)}\\right)^{{{exp}}}" if exp else self._tex(printer)

    def _tex(self, printer: LatexPrinter) -> str:
        raise NotImplementedError

    def value(self, values: Mapping[str, float], known: dict[int, float]) -> float:
        """Its value, as ``value_of`` finds it; raises KeyError for what has none by itself."""
        return _of_parts(self, values, known)


class Choice(Own):
    """``a`` where ``margin`` > 0, else ``b``: Choice(margin, a, b), what ``if`` and comparisons are made of.

    x > y is Choice(x - y, 1, 0), x >= y is Choice(y - x, 0, 1), so that ties are exact.
    """

    nargs = 3

    @classmethod
    def eval(cls, margin: sp.Expr, a: sp.Expr, b: sp.Expr) -> sp.Expr | None:
        """The chosen one if the margin is a number or both are equal."""
        if a == b:
            return a
        if margin.is_number:
            return a if value_of(margin) > 0 else b
        return None

    def _eval_derivative(self, s: sp.Symbol) -> sp.Expr:
        """The derivative beside the switch."""
        margin, a, b = self.args
        return Choice(margin, a.diff(s), b.diff(s))

    @property
    def is_condition(self) -> bool:
        """Whether it is 1 or 0 always, as a comparison, and as what ``and`` and ``or`` are made of."""
        return all(x in (0, 1) or (isinstance(x, Choice) and x.is_condition) for x in self.args[1:])

    def value(self, values: Mapping[str, float], known: dict[int, float]) -> float:
        """The value of the chosen one; the other may be undefined."""
        return value_of(self.args[1 if value_of(self.args[0], values, known) > 0 else 2], values, known)

    def _sympystr(self, printer: StrPrinter) -> str:
        """The text that reads back to it, see ``parser``."""
        margin, a, b = (printer._print(x) for x in self.args)
        first, second = self.args[1:]
        if (first, second) == (1, 0):
            return f"({margin} > 0)"
        if (first, second) == (0, 1):
            return f"({margin} <= 0)"
        if self.is_condition and (first in (0, 1) or second in (0, 1)):
            constant, other = (second, a) if second in (0, 1) else (first, b)
            sign = ">" if (second == 0 or first == 1) else "<="
            return f"({margin} {sign} 0 {'or' if constant else 'and'} {other})"
        return f"if({margin} > 0, {a}, {b})"

    def _tex(self, printer: LatexPrinter) -> str:
        margin, a, b = (printer._print(x) for x in self.args)
        return f"\\begin{{cases}} {a} & {margin} > 0 \\\\ {b} & \\text{{otherwise}} \\end{{cases}}"


class Smooth(Own):
    """Smooth(e) is e, whose kinks a solver may pass without an event."""

    nargs = 1

    @classmethod
    def eval(cls, e: sp.Expr) -> sp.Expr | None:
        """A number, and what is smooth already, is itself."""
        return e if e.is_number or isinstance(e, Smooth) else None

    def _eval_derivative(self, s: sp.Symbol) -> sp.Expr:
        return Smooth(self.args[0].diff(s))

    def _sympystr(self, printer: StrPrinter) -> str:
        return f"smooth({printer._print(self.args[0])})"

    def _tex(self, printer: LatexPrinter) -> str:
        return str(printer._print(self.args[0]))


class TableCall(Own):
    """A call of the table ``table``, or of its partial derivative of ``orders`` (one for each argument)."""

    table: ClassVar[str] = ""
    orders: ClassVar[tuple[int, ...]] = ()
    is_number = False  # only the description knows its values

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """The partial derivative by the argument ``argindex``, from 1 on."""
        orders = list(self.orders or (0,) * len(self.args))
        orders[argindex - 1] += 1
        return table_function(self.table, tuple(orders))(*self.args)

    def _sympystr(self, printer: StrPrinter) -> str:
        marks = "_".join(map(str, self.orders))
        return f"{self.table}{marks and f'^({marks})'}({printer.stringify(self.args, ', ')})"

    def _tex(self, printer: LatexPrinter) -> str:
        marks = ",".join(map(str, self.orders))
        name = printer._print(sp.Symbol(self.table)) + (f"^{{({marks})}}" if marks else "")
        inside = ", ".join(printer._print(x) for x in self.args)
        return f"{name}\\left({inside}\\right)"


@cache
def table_function(name: str, orders: tuple[int, ...] = ()) -> type[TableCall]:
    """The function of one or two arguments that the table ``name`` is, or its partial derivative of ``orders``.

    One class for each table, so that equal calls are equal expressions.
    """
    orders = orders if any(orders) else ()
    label = " ".join(map(str, ("table", name, *orders)))  # printers go by names: it is that of no SymPy function
    members = {"table": name, "orders": orders, "nargs": (len(orders),) if orders else (1, 2)}
    return type(label, (TableCall,), members)


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
WORDS = ("if", "and", "or", "not", "smooth")
"""What ``Choice`` and ``Smooth`` are written with."""

MAX_LENGTH, MAX_NESTING, MAX_POWER, MAX_ARGUMENTS = 100_000, 60, 64, 16
MAX_DIGITS, MAX_BITS, MAX_NUMBER_DEPTH = 400, 1020, 12
MAX_AXES = 2
"""Arguments of a table, at most."""


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
        found = f"got {type(result).__name__} '{result}'"
        raise MechanismError(f"{where}: expected a scalar expression, {found}; a condition is Choice(margin, 1, 0)")
    numbers = {number: _exact(float(number), where) for number in result.atoms(sp.Float)}
    symbols = {old: symbol(old.name) for old in result.free_symbols if old != symbol(old.name)}
    result = replaced(result, {**numbers, **symbols}, again=True)
    _refuse_foreign(result, where)
    for node in result.atoms(sp.Number, sp.Pow, sp.Function):
        if fault := excess(node):
            raise MechanismError(f"{where}: {fault} in '{node}'")
        if node.args and node.is_number:
            _refuse_unreal(node, where)
    return result


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
    Smooth: lambda x: x,
    sp.Abs: abs,
    sp.Min: min,
    sp.Max: max,
    sp.Add: lambda *terms: math.fsum(terms),
    sp.Mul: lambda *factors: math.prod(factors),
    sp.Pow: math.pow,
    sp.sign: lambda x: float((x > 0) - (x < 0)),
    sp.Heaviside: lambda x, middle: 0.5 * ((x > 0) + (x >= 0)),
}


def value_of(
    number: sp.Expr, values: Mapping[str, float] | None = None, known: dict[int, float] | None = None
) -> float:
    """The value of an expression in plain floats, ``values`` being those of its symbols.

    ``known`` has those of parts found before, by id, for SymPy compares whole trees. SymPy's own evaluation may take
    forever. Raises OverflowError beyond the floats, ValueError or ZeroDivisionError where there is no real value,
    KeyError for a symbol without value and for a table.
    """
    values, known = values or {}, {} if known is None else known
    if number.is_Rational:
        return int(number.p) / int(number.q)
    if number.is_Symbol:
        return values[number.name]
    is_own = isinstance(number, Own)
    if not is_own and not number.args:
        return float(number)
    if id(number) not in known:
        known[id(number)] = number.value(values, known) if is_own else _of_parts(number, values, known)
    return known[id(number)]


def _of_parts(call: sp.Expr, values: Mapping[str, float], known: dict[int, float]) -> float:
    return _FLOAT[call.func](*(value_of(a, values, known) for a in call.args))


def _refuse_foreign(expression: sp.Expr, where: str) -> None:
    if expression.has(sp.zoo, sp.nan, sp.oo, -sp.oo):
        raise MechanismError(f"{where}: '{expression}' is not finite (a division by zero?)")
    if expression.has(sp.I):
        raise MechanismError(f"{where}: '{expression}' is not real (a root or logarithm of a negative number?)")
    if expression.atoms(sp.Derivative, sp.Integral, sp.Piecewise, sp.Rel):
        raise MechanismError(
            f"{where}: '{expression}' has a derivative, integral or case distinction; write it out, cases as "
            "Choice(margin, a, b): a where margin > 0, else b"
        )
    for node in expression.atoms(sp.Function, sp.Min, sp.Max):
        if node.func not in NAME_OF and not isinstance(node, Own):
            raise MechanismError(
                f"{where}: the function '{node.func}' is not supported; known are "
                f"{', '.join([*FUNCTIONS, 'if', 'smooth'])}"
            )
