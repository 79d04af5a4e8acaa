"""Dimensions of expressions, inferred from the units of the names in them.

A dimension is a tuple of the exponents of kg, m, s, A, K, mol, cd; exponents are fractions under roots. None stands
for an unknown dimension, which matches every other. The radian counts as 1.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import lru_cache

import sympy as sp

from lag2fmu.errors import UnitError
from lag2fmu.language.units import BASE_UNITS, Exponents, si_name
from lag2fmu.language.vocabulary import Choice, Smooth, TableCall
from lag2fmu.language.writer import number_text, to_quote

Dimension = tuple[Fraction, ...]
ONE: Dimension = (Fraction(0),) * (len(BASE_UNITS) - 1)

_SAME = (sp.Min, sp.Max, sp.Abs, Smooth)


@lru_cache(maxsize=256)
def dimension(exponents: Exponents) -> Dimension:
    """The dimension of a unit with the ``exponents`` of BASE_UNITS."""
    return tuple(Fraction(e) for e in exponents[: len(ONE)])


def describe(d: Dimension) -> str:
    """The dimension ``d`` as the name of a unit such as ``N.m``, for messages."""
    return si_name((*(int(e) if e.denominator == 1 else e for e in d), 0)) or "1"


class DimensionOf:
    """Infers dimensions of expressions; ``known`` maps names to dimensions (None or missing: unknown).

    ``tables`` maps names of tables to the dimensions of their arguments and their value.
    """

    def __init__(
        self,
        known: Mapping[str, Dimension | None],
        tables: Mapping[str, tuple[Dimension | None, ...]] | None = None,
    ) -> None:
        self.known, self.tables = known, tables or {}
        self.memory: dict[sp.Expr, Dimension | None] = {}

    def __call__(self, expression: sp.Expr) -> Dimension | None:
        """The dimension of ``expression``, None if unknown; raises UnitError where a sum or function mismatches."""
        if expression not in self.memory:
            self.memory[expression] = self._infer(expression)
        return self.memory[expression]

    def _infer(self, e: sp.Expr) -> Dimension | None:
        if e.is_Symbol:
            return self.known.get(e.name)
        if e.is_number:
            return ONE
        if e.is_Mul:
            return _product([self(a) for a in e.args])
        if e.is_Pow:
            return self._power(e)
        if e.is_Add or isinstance(e, (*_SAME, sp.atan2)):
            common = self._common(e.args)
            return ONE if isinstance(e, sp.atan2) else common
        if isinstance(e, TableCall):
            return self._of_table(e)
        argument = self(e.args[0])
        if isinstance(e, Choice):
            return self._common(e.args[1:])
        return ONE if isinstance(e, (sp.sign, sp.Heaviside)) else self._of_function(e, argument)

    def _of_function(self, e: sp.Expr, argument: Dimension | None) -> Dimension:
        """The dimension of a function of a pure number; raises UnitError for an ``argument`` with a dimension."""
        if argument not in (None, ONE):
            raise UnitError(
                f"the argument of '{to_quote(e)}' has the dimension {describe(argument)}; "
                "it must be a pure number or an angle"
            )
        return ONE

    def _of_table(self, e: TableCall) -> Dimension | None:
        columns = self.tables.get(e.table, (None,))
        for argument, wanted in zip(e.args, columns, strict=False):
            found = self(argument)
            if None not in (found, wanted) and found != wanted and not argument.is_number:
                raise UnitError(
                    f"the argument '{to_quote(argument)}' of '{e.table}' is in {describe(found)}, "  # type: ignore[arg-type]
                    f"its column is in {describe(wanted)}"  # type: ignore[arg-type]
                )
        return columns[-1]

    def _power(self, e: sp.Expr) -> Dimension | None:
        base, exponent = self(e.base), self(e.exp)
        if exponent not in (None, ONE):
            raise UnitError(
                f"the exponent of '{to_quote(e)}' has the dimension {describe(exponent)}; it must be a pure number"
            )
        if base is None or base == ONE:
            return base
        if not e.exp.is_Rational:
            return None
        return tuple(b * Fraction(int(e.exp.p), int(e.exp.q)) for b in base)

    def _common(self, terms: tuple[sp.Expr, ...]) -> Dimension | None:
        """The one dimension of all ``terms`` of a sum; the number 0 fits every dimension."""
        found: tuple[sp.Expr, Dimension] | None = None
        unknown = False
        for a in terms:
            d = self(a)
            unknown |= d is None
            if d is None or a.is_zero:
                continue
            if found is not None and d != found[1]:
                raise UnitError(_not_alike(*found, a, d))
            found = (a, d)
        return found[1] if found and not unknown else None


def _not_alike(term: sp.Expr, d: Dimension, other: sp.Expr, its: Dimension) -> str:
    """The message that two terms cannot be added, with the remedy where one of them is a plain number."""
    remedy = "; a number has no unit: make it a parameter that has one" if term.is_number or other.is_number else ""
    sides = f"'{_typed(term)}' is in {describe(d)} but '{_typed(other)}' is in {describe(its)}"
    return f"{sides}; they cannot be added{remedy}"


def _typed(term: sp.Expr) -> str:
    """``term`` as text, a decimal fraction as it was typed."""
    decimal = number_text(float(term)) if term.is_Rational and term.q > 1 else ""
    return decimal if decimal and sp.Rational(decimal) == term else to_quote(term)


def _product(factors: list[Dimension | None]) -> Dimension | None:
    total = ONE
    for d in factors:
        if d is None:
            return None
        total = tuple(a + b for a, b in zip(total, d, strict=True))
    return total
