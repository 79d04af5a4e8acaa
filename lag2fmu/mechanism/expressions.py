"""Expressions: the functions a mechanism may use, a safe reader and a writer of their text, and their normal form.

Reader and writer are inverse to each other: ``parse(to_text(e)) == normal_form(e)``. The reader never evaluates text as
Python: a scanner and a recursive-descent parser (Aho, Lam, Sethi, Ullman, Compilers, section 4.4) build SymPy objects,
with bounds on nesting, size and powers so that no text can take long.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from fractions import Fraction

import sympy as sp
from sympy.printing.str import StrPrinter

from lag2fmu.errors import ExpressionError, MechanismError

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

Resolve = Callable[[str], sp.Expr | None]


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


def value_of(number: sp.Expr) -> float:
    """The value of an expression without symbols in plain floats: SymPy's own evaluation may take forever.

    Raises OverflowError beyond the floats and ValueError where there is no real value.
    """
    if number.is_Rational:
        return int(number.p) / int(number.q)
    if not number.args:
        return float(number)
    return _FLOAT[number.func](*(value_of(a) for a in number.args))


def _depth(number: sp.Expr) -> int:
    return 1 + max((_depth(a) for a in number.args), default=0)


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


# --------------------------------------------------------------------------------------------------------- writing


class _TextPrinter(StrPrinter):  # type: ignore[misc]
    """Prints with the names of FUNCTIONS."""

    def _print_Function(self, expr: sp.Expr) -> str:
        """Functions carry our names where SymPy's differ (Abs, Heaviside)."""
        arguments = expr.args[:1] if isinstance(expr, sp.Heaviside) else expr.args
        return f"{NAME_OF[expr.func]}({self.stringify(arguments, ', ')})"

    _print_Abs = _print_Heaviside = _print_Min = _print_Max = _print_Function
    _print_LatticeOp = _print_Function

    def _print_Mul(self, expr: sp.Expr) -> str:
        """1/(5*(x + y)) is written 1/(x + y)/5: read back, the first one would become 1/(5*x + 5*y)."""
        coefficient, rest = expr.as_coeff_Mul()
        below = [a for a in sp.Mul.make_args(rest) if a.is_Pow and a.exp.is_Rational and a.exp.is_negative]
        if coefficient.q == 1 or len(below) != 1 or not below[0].base.is_Add or below[0].exp != -1:
            return str(super()._print_Mul(expr))
        return f"{self._print(coefficient.p * rest)}/{coefficient.q}"

    def _print_Exp1(self, expr: sp.Expr) -> str:
        """Euler's number has no letter in the text format."""
        return "exp(1)"


def to_text(expression: sp.Expr) -> str:
    """``expression`` in the syntax of the text format, with decimals as decimals (``9.81*m``, not ``981*m/100``)."""
    decimals = {number: _decimal(number) for number in expression.atoms(sp.Rational)}
    return str(_TextPrinter({"order": "none"}).doprint(expression.xreplace(decimals)))


def _decimal(number: sp.Rational) -> sp.Expr:
    """A stand-in that prints ``number`` as a decimal, where that is exact and shorter than the fraction."""
    text = number_text(abs(float(number))) if number.q > 12 and number else ""
    if not text or len(text) > len(str(number)) or sp.Rational(text) != abs(number):
        return number
    return sp.sign(number) * sp.Symbol(text)


def number_text(value: float) -> str:
    """The shortest decimal text that reads back to ``value``."""
    return repr(float(value))


# --------------------------------------------------------------------------------------------------------- reading

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


def parse(text: str, resolve: Resolve | None = None, where: str = "expression") -> sp.Expr:
    """Read ``text`` as an expression with exact numbers.

    ``resolve`` maps a name to its meaning or to None if it is unknown; by default every name is a symbol. Raises
    ExpressionError with ``where`` and the column.
    """
    return _Parser(text, resolve or symbol, where).parse()


def free_names(expressions: Iterable[sp.Expr]) -> set[str]:
    """The names of all symbols in ``expressions``."""
    return {s.name for expression in expressions for s in expression.free_symbols}
