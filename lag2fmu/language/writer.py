"""The writer of expressions and numbers: the text that the reader in ``parser`` reads back to the same."""

from __future__ import annotations

import sys
from functools import partial
from typing import Any

import sympy as sp
from sympy.printing.str import StrPrinter

from lag2fmu.language.rebuilding import replaced
from lag2fmu.language.vocabulary import NAME_OF


class _TextPrinter(StrPrinter):  # type: ignore[misc]
    """Prints with the names of FUNCTIONS."""

    def _print_Function(self, expr: sp.Expr) -> str:
        """Functions carry our names where SymPy's differ (Abs, Heaviside)."""
        arguments = expr.args[:1] if isinstance(expr, sp.Heaviside) else expr.args
        return f"{NAME_OF[expr.func]}({self.stringify(arguments, ', ')})"

    _print_Abs = _print_Heaviside = _print_Min = _print_Max = _print_Function
    _print_LatticeOp = _print_Function

    def _print_Mul(self, expr: sp.Expr) -> str:
        """1/(5*(x + y)) is written 1/(x + y)/5, because 1/(5*(x + y)) would be read as 1/(5*x + 5*y)."""
        coefficient, rest = expr.as_coeff_Mul()
        below = [a for a in sp.Mul.make_args(rest) if a.is_Pow and a.exp.is_Rational and a.exp.is_negative]
        if (
            not coefficient.is_Rational
            or coefficient.q == 1
            or len(below) != 1
            or not below[0].base.is_Add
            or below[0].exp != -1
        ):
            return str(super()._print_Mul(expr))
        return f"{self._print(coefficient.p * rest)}/{coefficient.q}"

    def _print_Exp1(self, expr: sp.Expr) -> str:
        """Euler's number has no letter in the text format."""
        return "exp(1)"


def to_text(expression: sp.Expr) -> str:
    """``expression`` in the syntax of the text format, with decimals as decimals (``9.81*m``, not ``981*m/100``)."""
    return str(_TextPrinter({"order": "none"}).doprint(with_decimals(expression)))


QUOTED = 120
"""The most characters of an expression that a message quotes."""


def to_quote(expression: sp.Expr) -> str:
    """``expression`` in the syntax of the text format, for a message; of a long one the middle is left out."""
    text, part = to_text(expression), (QUOTED - 5) // 2
    return text if len(text) <= QUOTED else f"{text[:part]} ... {text[-part:]}"


def to_read(expression: sp.Expr) -> str:
    """``expression`` for people: as ``to_text``, but with coefficients of one kind, and a number alone as a decimal."""
    if expression.is_Rational and expression.q > 1:
        return number_text(float(expression)) if _decimal(expression, len(_LONG)) != expression else str(expression)
    return str(_TextPrinter({"order": "none"}).doprint(with_decimals(expression, alike=True)))


_LONG = "0.0001"
"""Where other coefficients are decimals, a fraction is one too if it is no longer than this."""


def with_decimals(expression: Any, *, alike: bool = False) -> Any:
    """``expression``, or a matrix of such, for printing: decimals as symbols that are called like the number.

    ``alike``: where some coefficients are decimals, short fractions become decimals too. Exponents stay.
    """
    numbers = expression.atoms(sp.Rational)
    found = {number: _decimal(number) for number in numbers}
    if alike and any(found[number] != number for number in numbers):
        found = {number: _decimal(number, len(_LONG)) for number in numbers - _exponents(expression)}
    return expression.applyfunc(partial(replaced, new=found)) if expression.is_Matrix else replaced(expression, found)


def _exponents(expression: Any) -> set[sp.Rational]:
    return {power.exp for power in expression.atoms(sp.Pow) if power.exp.is_Rational}


def _decimal(number: sp.Rational, room: int = 0) -> sp.Expr:
    """A stand-in that prints ``number`` as a decimal, where that is exact and shorter than the fraction or ``room``."""
    text = number_text(abs(float(number))) if number.q > 1 else ""
    if not text or len(text) >= max(len(str(abs(number))), room + 1) or sp.Rational(text) != abs(number):
        return number
    return sp.sign(number) * sp.Symbol(text)


def number_text(value: float) -> str:
    """The shortest decimal text that reads back to ``value``."""
    return repr(float(value))


def without_dust(x: float, size: float) -> float:
    """The number of fewest digits that computed ``x`` cannot be told from; 0 for what is rounding beside ``size``.

    It differs from ``x`` by four roundings at most, as many as computing a start takes at least; where no number of
    less than 14 digits is so near, ``x`` stays.
    """
    near = 4 * sys.float_info.epsilon
    if abs(x) <= near * size:
        return 0.0
    shorter = (float(f"{x:.{digits}g}") for digits in range(1, 14))
    return next((y for y in shorter if abs(y - x) <= near * abs(x)), x)
