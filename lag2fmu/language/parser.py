"""The reader of expressions: text is scanned and parsed, never evaluated as Python.

A recursive-descent parser (Aho, Lam, Sethi, Ullman, Compilers, section 4.4) builds SymPy objects, with bounds on
nesting, size and powers so that no text can take long.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable

import sympy as sp

from lag2fmu.errors import ExpressionError
from lag2fmu.language.vocabulary import (
    CONSTANTS,
    FUNCTIONS,
    MAX_ARGUMENTS,
    MAX_DIGITS,
    MAX_LENGTH,
    MAX_NESTING,
    MAX_NUMBER_DEPTH,
    MAX_POWER,
    depth,
    excess,
    symbol,
    value_of,
)

Resolve = Callable[[str], sp.Expr | None]

_SCANNER = re.compile(
    r"(?P<space>\s+)|(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>[A-Za-z_]\w*)|(?P<operator>\*\*|[-+*/(),^])",
    re.ASCII,
)


class _Parser:
    """One pass over the text of one expression.

    expression: ['+'|'-'] term (('+'|'-') term)*;  term: factor (('*'|'/') factor)*;
    factor: {'+'|'-'} power;  power: primary ['**' factor];  primary: number | name | call | '(' expression ')'
    """

    def __init__(self, text: str, resolve: Resolve, where: str) -> None:
        self.text, self.resolve, self.where = text, resolve, where
        self.position, self.nesting = 0, 0
        self.kind, self.token, self.column = "", "", 0
        if len(text) > MAX_LENGTH:
            raise ExpressionError(f"{where}: the expression has {len(text)} characters; at most {MAX_LENGTH} are read")

    def fail(self, message: str) -> ExpressionError:
        around = self.text[max(0, self.column - 20) : self.column + 20]
        return ExpressionError(f"{self.where}: {message} at column {self.column + 1} of '{around}'")

    def advance(self) -> None:
        """Scan the next token into ``kind`` ('' at the end), ``token`` and ``column``."""
        while self.position < len(self.text):
            match = _SCANNER.match(self.text, self.position)
            self.column = self.position
            if match is None:
                raise self.fail(f"unexpected character {self.text[self.position]!r}")
            self.position = match.end()
            if match.lastgroup != "space":
                self.kind, self.token = str(match.lastgroup), match.group()
                return
        self.kind, self.token, self.column = "", "", len(self.text)

    def parse(self) -> sp.Expr:
        self.advance()
        if not self.kind:
            raise ExpressionError(f"{self.where}: the expression is empty")
        result = self.expression()
        if self.kind:
            raise self.fail(f"unexpected '{self.token}'")
        return result

    def expression(self) -> sp.Expr:
        self.nesting += 1
        if self.nesting > MAX_NESTING:
            raise self.fail(f"parentheses nested deeper than {MAX_NESTING}")
        terms = [self.term()]
        while self.token in ("+", "-"):
            sign = self.token
            self.advance()
            terms.append(self.term() if sign == "+" else -self.term())
        self.nesting -= 1
        return self.checked(sp.Add(*terms))

    def term(self) -> sp.Expr:
        factors = [self.sign(), self.power()]
        while self.token in ("*", "/"):
            operator = self.token
            self.advance()
            factors.append(self.sign())
            factor = self.power()
            if operator == "/" and factor == 0:
                raise self.fail("division by zero")
            factors.append(factor if operator == "*" else 1 / factor)
        return self.checked(sp.Mul(*factors))

    def sign(self) -> sp.Expr:
        """1 or -1 for the signs that stand here, if any."""
        negative, signs = False, 0
        while self.token in ("+", "-"):
            negative, signs = negative ^ (self.token == "-"), signs + 1
            if signs > MAX_NESTING:
                raise self.fail(f"more than {MAX_NESTING} signs in a row")
            self.advance()
        return sp.S.NegativeOne if negative else sp.S.One

    def power(self) -> sp.Expr:
        base = self.primary()
        if self.token == "^":
            raise self.fail("'^' is not an operator; a power is written with '**'")
        if self.token != "**":
            return base
        self.nesting += 1
        if self.nesting > MAX_NESTING:
            raise self.fail(f"powers nested deeper than {MAX_NESTING}")
        self.advance()
        exponent = self.sign() * self.power()
        self.nesting -= 1
        if exponent.is_number and not abs(value_of(exponent)) <= MAX_POWER:
            raise self.fail(f"a power beyond {MAX_POWER}")
        if base.is_zero and exponent.is_negative:
            raise self.fail("division by zero")
        return self.checked(base**exponent)

    def primary(self) -> sp.Expr:
        kind, token, column = self.kind, self.token, self.column
        if kind == "number":
            return self.number(token)
        if kind == "name":
            self.advance()
            if self.token == "(":
                return self.call(token, column)
            value = CONSTANTS.get(token) or self.resolve(token)
            if value is None:
                self.column = column
                raise self.fail(f"unknown name '{token}'")
            return value
        if token == "(":
            self.advance()
            inner = self.expression()
            self.expect(")")
            return inner
        raise self.fail(f"unexpected '{token}'" if token else "the expression ends too early")

    def number(self, token: str) -> sp.Expr:
        if len(token) > MAX_DIGITS or ("e" in token.lower() and abs(int(token.lower().split("e")[1])) > MAX_DIGITS):
            raise self.fail(f"a number of more than {MAX_DIGITS} digits")
        if not math.isfinite(float(token)):
            raise self.fail(f"the number {token} is too large")
        self.advance()
        return sp.Rational(token)

    def call(self, name: str, column: int) -> sp.Expr:
        if name not in FUNCTIONS:
            self.column = column
            raise self.fail(f"'{name}' is not a function; known are {', '.join(FUNCTIONS)}")
        count, constructor = FUNCTIONS[name]
        self.advance()
        arguments = [self.expression()]
        while self.token == ",":
            self.advance()
            arguments.append(self.expression())
        self.expect(")")
        if len(arguments) != count and not (count < 0 and len(arguments) >= -count):
            wanted = str(count) if count > 0 else f"{-count} or more"
            raise self.fail(f"{name} takes {wanted} argument(s), got {len(arguments)}, before the text")
        width = sum(len(a.args) if a.func == constructor else 1 for a in arguments)
        if width > MAX_ARGUMENTS:
            raise self.fail(f"{name} of {width} arguments; at most {MAX_ARGUMENTS} are read")
        return self.checked(constructor(*arguments))

    def expect(self, token: str) -> None:
        if self.token != token:
            raise self.fail(
                f"expected '{token}', got '{self.token}'" if self.token else f"expected '{token}' at the end"
            )
        self.advance()

    def checked(self, value: sp.Expr) -> sp.Expr:
        """``value``, unless it has no real value or is a number or power too large to be meant."""
        if value.is_number:
            if value.has(sp.zoo, sp.nan, sp.oo, -sp.oo):
                raise self.fail("the value is not finite (a division by zero?)")
            if value.has(sp.I):
                raise self.fail("the value is not real (a root or logarithm of a negative number?)")
        for part in (value, *value.args):
            if fault := excess(part):
                raise self.fail(fault)
        if value.is_number:
            if depth(value) > MAX_NUMBER_DEPTH:
                raise self.fail("a number with roots and functions nested too deeply; write its value")
            try:
                finite = math.isfinite(value_of(value))
            except OverflowError:
                finite = False
            except (ValueError, ZeroDivisionError):
                raise self.fail("the value is not real (a root or logarithm of a negative number?)") from None
            if not finite:
                raise self.fail("the value is too large")
        return value


def parse(text: str, resolve: Resolve | None = None, where: str = "expression") -> sp.Expr:
    """Read ``text`` as an expression with exact numbers.

    ``resolve`` maps a name to its meaning or to None if it is unknown; by default every name is a symbol. Raises
    ExpressionError with ``where`` and the column.
    """
    return _Parser(text, resolve or symbol, where).parse()
