"""The reader of expressions: text is scanned and parsed, never evaluated as Python.

A recursive-descent parser (Aho, Lam, Sethi, Ullman, Compilers, section 4.4) builds SymPy objects, with bounds on
nesting, size and powers so that no text can take long.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection

import sympy as sp

from lag2fmu.errors import ExpressionError
from lag2fmu.language import remedies
from lag2fmu.language.conditions import is_condition, is_writable, put
from lag2fmu.language.rebuilding import call
from lag2fmu.language.vocabulary import (
    CONSTANTS,
    FUNCTIONS,
    MAX_ARGUMENTS,
    MAX_AXES,
    MAX_DIGITS,
    MAX_LENGTH,
    MAX_NESTING,
    MAX_NUMBER_DEPTH,
    MAX_POWER,
    WORDS,
    Choice,
    Smooth,
    excess,
    symbol,
    table_function,
    value_of,
)

Resolve = Callable[[str], sp.Expr | None]

_SCANNER = re.compile(
    r"(?P<space>\s+)|(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>[A-Za-z_]\w*)|(?P<operator>\*\*|[<>]=?|[=!]=|[-+*/(),^=])",
    re.ASCII,
)


class _Parser:
    """One pass over the text of one expression.

    expression: choice ('or' choice)*;  choice: negation ('and' negation)*;  negation: ['not'] comparison;
    comparison: sum [('<'|'<='|'>'|'>=') sum];  sum: ['+'|'-'] term (('+'|'-') term)*;
    term: factor (('*'|'/') factor)*;  factor: {'+'|'-'} power;  power: primary ['**' factor];
    primary: number | name | call | '(' expression ')'

    Conditions are made of ``Choice``: 'and' puts its right side for every 1 of the left one, 'or' for every 0.
    """

    def __init__(self, text: str, resolve: Resolve, where: str, tables: Collection[str]) -> None:
        self.text, self.resolve, self.where, self.tables = text, resolve, where, tables
        self.position, self.nesting = 0, 0
        self.kind, self.token, self.column = "", "", 0
        if len(text) > MAX_LENGTH:
            raise ExpressionError(f"{where}: the expression has {len(text)} characters; at most {MAX_LENGTH} are read")

    def fail(self, message: str, remedy: str = "") -> ExpressionError:
        around = self.text[max(0, self.column - 20) : self.column + 20]
        place = f"at column {self.column + 1} of '{around}'"
        return ExpressionError(f"{self.where}: {message} {place}" + (f"; {remedy}" if remedy else ""))

    def advance(self) -> None:
        """Scan the next token into ``kind`` ('' at the end), ``token`` and ``column``."""
        while self.position < len(self.text):
            match = _SCANNER.match(self.text, self.position)
            self.column = self.position
            if match is None:
                character = self.text[self.position]
                raise self.fail(f"unexpected character {character!r}", remedies.of_character(character))
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
            raise self.fail(f"unexpected '{self.token}'", self.remedy())
        return result

    def expression(self) -> sp.Expr:
        self.nesting += 1
        if self.nesting > MAX_NESTING:
            raise self.fail(f"parentheses nested deeper than {MAX_NESTING}")
        result = self.conjunction()
        while self.token == "or":
            self.advance()
            result = self.put(result, sp.S.One, self.condition(self.conjunction()))
        self.nesting -= 1
        return result

    def conjunction(self) -> sp.Expr:
        result = self.negation()
        while self.token == "and":
            self.advance()
            result = self.put(result, self.condition(self.negation()), sp.S.Zero)
        return result

    def negation(self) -> sp.Expr:
        negations = 0
        while self.token == "not":
            negations += 1
            self.advance()
        result = self.comparison()
        if negations:
            self.condition(result)
        return self.put(result, sp.S.Zero, sp.S.One) if negations % 2 else result

    def comparison(self) -> sp.Expr:
        """x > y is Choice(x - y, 1, 0) and x >= y is Choice(y - x, 0, 1): at a tie both are exact."""
        left, operator = self.sum(), self.token
        if operator in ("=", "==", "!="):
            raise self.fail(f"'{operator}' is not an operator; conditions have <, <=, > or >=; write a = b as a - b")
        if operator not in ("<", "<=", ">", ">="):
            return left
        self.advance()
        right = self.sum()
        if self.token in ("<", "<=", ">", ">="):
            raise self.fail("two comparisons in a row; join them by 'and'")
        margin = self.checked(left - right if operator in (">", "<=") else right - left)
        strict = len(operator) == 1
        return Choice(margin, sp.Integer(strict), sp.Integer(not strict))

    def condition(self, value: sp.Expr) -> sp.Expr:
        """``value`` if it is a condition: 1 or 0 always."""
        if not is_condition(value):
            raise self.fail(f"'{value}' is no condition, such as x > 0, before the text")
        return value

    def put(self, condition: sp.Expr, a: sp.Expr, b: sp.Expr) -> sp.Expr:
        """``a`` for every 1 of the ``condition``, ``b`` for every 0."""
        result = put(self.condition(condition), a, b)
        if not is_writable(result):
            raise self.fail("too many cases when the conditions are written out; split them into definitions")
        return result

    def sum(self) -> sp.Expr:
        terms = [self.term()]
        while self.token in ("+", "-"):
            sign = self.token
            self.advance()
            terms.append(self.term() if sign == "+" else -self.term())
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
        if token in ("and", "or", "not"):
            raise self.fail(f"unexpected '{token}'")
        if kind == "name":
            self.advance()
            if self.token == "(":
                return self.call(token, column)
            is_function = token in FUNCTIONS or token in WORDS or token in self.tables
            value = CONSTANTS.get(token) or (None if is_function else self.resolve(token))
            if value is None:
                self.column = column
                raise self.fail(*remedies.of_name(token, self.tables, is_function, self.token))
            return value
        if token == "(":
            self.advance()
            inner = self.expression()
            self.expect(")")
            return inner
        raise self.fail(*remedies.of_operator(token, self.text[: self.column]))

    def number(self, token: str) -> sp.Expr:
        if len(token) > MAX_DIGITS or ("e" in token.lower() and abs(int(token.lower().split("e")[1])) > MAX_DIGITS):
            raise self.fail(f"a number of more than {MAX_DIGITS} digits")
        if not math.isfinite(float(token)):
            raise self.fail(f"the number {token} is too large")
        self.advance()
        return sp.Rational(token)

    def call(self, name: str, column: int) -> sp.Expr:
        least, most, constructor = self.function(name, column)
        self.advance()
        arguments = [self.expression()]
        while self.token == ",":
            self.advance()
            arguments.append(self.expression())
        self.expect(")")
        if not least <= len(arguments) <= most:
            wanted = str(least) if least == most else f"{least} or more" if most == math.inf else f"{least} to {most}"
            raise self.fail(f"{name} takes {wanted} argument(s), got {len(arguments)}, before the text")
        if len(arguments) > MAX_ARGUMENTS:
            raise self.fail(f"{name} of {len(arguments)} arguments; at most {MAX_ARGUMENTS} are read")
        return self.checked(call(constructor, *arguments))

    def function(self, name: str, column: int) -> tuple[int, float, Callable[..., sp.Expr]]:
        """The least and the largest number of arguments of the function ``name``, and what makes its calls."""
        if name in self.tables:
            return 1, MAX_AXES, table_function(name)
        own: dict[str, tuple[int, Callable[..., sp.Expr]]] = {"if": (3, self.put), "smooth": (1, Smooth)}
        known = FUNCTIONS | own
        if name not in known:
            self.column = column
            raise self.fail(f"'{name}' is not a function", remedies.of_call(name, [*known, *self.tables]))
        count, constructor = known[name]
        return (count, count, constructor) if count > 0 else (-count, math.inf, constructor)

    def expect(self, token: str) -> None:
        if self.token != token:
            got = f", got '{self.token}'" if self.token else " at the end"
            raise self.fail(f"expected '{token}'{got}", self.remedy())
        self.advance()

    def remedy(self) -> str:
        return remedies.of_rest(self.kind, self.token, self.text[: self.column].rstrip())

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
            if _depth(value) > MAX_NUMBER_DEPTH:
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


def parse(
    text: str, resolve: Resolve | None = None, where: str = "expression", tables: Collection[str] = ()
) -> sp.Expr:
    """Read ``text`` as an expression with exact numbers.

    ``resolve`` maps a name to its meaning or to None if it is unknown; by default every name is a symbol. ``tables``
    are the names that are called as functions beside FUNCTIONS. Raises ExpressionError with ``where`` and the column.
    """
    return _Parser(text, resolve or symbol, where, tables).parse()


def _depth(number: sp.Expr) -> int:
    """The depth of the tree of ``number``."""
    return 1 + max((_depth(a) for a in number.args), default=0)
