"""Expressions: reading and writing are inverse to each other, and no text can do harm or take long."""

from __future__ import annotations

import random
import re
import time
from collections.abc import Callable

import pytest
import sympy as sp
from sympy.functions.elementary.miscellaneous import MinMaxBase

from lag2fmu.errors import ExpressionError, MechanismError
from lag2fmu.language.conditions import put
from lag2fmu.language.expressions import (
    FUNCTIONS,
    free_names,
    normal_form,
    number_text,
    parse,
    symbol,
    to_text,
    value_of,
)
from lag2fmu.language.vocabulary import Choice, Smooth, TableCall, table_function

x, y, m = symbol("x"), symbol("y"), symbol("m")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x + 2*y", x + 2 * y),
        ("-x**2", -(x**2)),
        ("2**-1", sp.Rational(1, 2)),
        ("2**3**2", sp.Integer(512)),
        ("x - y - 1", x - y - 1),
        ("x/y/2", x / y / 2),
        ("-(x + y)*m", sp.Mul(-1, x + y, m)),
        ("- -x", x),
        ("x*-y", -x * y),
        ("0.1*x", x / 10),
        (".5", sp.Rational(1, 2)),
        ("1e-3*x", x / 1000),
        ("2.*x", 2 * x),
        ("sin(x)**2", sp.sin(x) ** 2),
        ("atan2(y, x)", sp.atan2(y, x)),
        ("min(x, y, 1)", sp.Min(x, y, 1)),
        ("heaviside(x)*abs(y)*sign(x)", sp.Heaviside(x) * sp.Abs(y) * sp.sign(x)),
        ("2*pi*x", 2 * sp.pi * x),
        ("I + E*beta - lambda", symbol("I") + symbol("E") * symbol("beta") - symbol("lambda")),
        (" x\n+\ty ", x + y),
    ],
)
def test_texts_are_read(text: str, expected: sp.Expr) -> None:
    assert parse(text) == expected


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        (9.81 * m, "9.81*m"),
        (m * x**2 / 2, "m*x**2/2"),
        (sp.Abs(x) + sp.Heaviside(y), "abs(x) + heaviside(y)"),
        (sp.Max(x, y), "max(x, y)"),
        (sp.sqrt(x), "sqrt(x)"),
        (sp.exp(1) * x, "exp(1)*x"),
        (1e-25 * x, "1e-25*x"),
        (1 / (x + y) / 5, "1/(x + y)/5"),
    ],
)
def test_texts_are_written_as_people_write(expression: sp.Expr, expected: str) -> None:
    assert to_text(normal_form(expression, "e")) == expected


def random_expression(source: random.Random, depth: int) -> sp.Expr:
    """An expression of all functions, decimals, fractions, roots and odd names."""
    if depth == 0 or source.random() < 0.15:
        kind = source.random()
        if kind < 0.55:
            return symbol(source.choice(["x", "theta", "theta_dot", "l1", "I", "E", "beta", "S", "lambda"]))
        if kind < 0.7:
            return sp.Integer(source.randint(-9, 9))
        if kind < 0.8:
            return sp.Rational(source.randint(-9, 9), source.randint(1, 20))
        if kind < 0.95:
            return normal_form(source.choice([0.05, 1.5, -2.75, 9.81, 1e-5, 3.3e12, -0.013, 1e-25]), "e")
        return sp.pi
    a, b = random_expression(source, depth - 1), random_expression(source, depth - 1)
    one = [constructor for count, constructor in FUNCTIONS.values() if count == 1]
    powers = [2, 3, -1, -2, sp.Rational(1, 2), sp.Rational(-1, 2), sp.Rational(3, 2), sp.Rational(13, 100)]
    operation = source.choice(
        ["add", "add", "subtract", "multiply", "multiply", "divide", "power", "one", "one", "two"]
    )
    if operation == "add":
        return a + b
    if operation == "subtract":
        return a - b
    if operation == "multiply":
        return a * b
    if operation == "divide":
        return a / b
    if operation == "power":
        return a ** source.choice(powers)
    return source.choice(one)(a) if operation == "one" else source.choice([sp.Min, sp.Max, sp.atan2])(a, b)


def test_random_expressions_read_back_the_same() -> None:
    read_back = 0
    for seed in range(600):
        source = random.Random(seed)
        try:
            expression = normal_form(random_expression(source, source.randint(1, 6)), "e")
        except (MechanismError, ValueError):  # asin(7), log(0), max(sqrt(-1), 1): no real value
            continue
        assert parse(to_text(expression)) == expression, f"seed {seed}: {to_text(expression)}"
        read_back += 1
    assert read_back > 500


def test_random_conditions_read_back_the_same() -> None:
    """Choices with any parts, conditions of them, smooth parts and calls of tables."""
    x, y = symbol("x"), symbol("y")
    for seed in range(200):
        source = random.Random(seed)
        try:
            a, b, c = (normal_form(random_expression(source, 2), "e") for _ in range(3))
            once = Choice(a, sp.S.One, sp.S.Zero)
            condition = put(once, Choice(b, sp.S.Zero, sp.S.One), Choice(c, sp.S.One, sp.S.Zero))
            parts = [put(condition, Smooth(a) + x, b), Choice(y, put(condition, sp.S.One, c), a), 2 * once - condition]
            expression = normal_form(source.choice(parts) * table_function("f")(a, y), "e")
        except (MechanismError, ValueError):
            continue
        assert parse(to_text(expression), tables=("f",)) == expression, f"seed {seed}: {to_text(expression)}"


@pytest.mark.parametrize(
    ("text", "truth"),
    [
        ("x > y", lambda x, y: x > y),
        ("x >= y", lambda x, y: x >= y),
        ("x < y", lambda x, y: x < y),
        ("x <= y", lambda x, y: x <= y),
        ("not x > y", lambda x, y: not x > y),
        ("x > y or x < y and y > 0", lambda x, y: x > y or (x < y and y > 0)),
        ("(x > y or x < y) and y > 0", lambda x, y: x != y and y > 0),
        ("not (x > 0 and not y > 0) or x >= 1", lambda x, y: not (x > 0 and not y > 0) or x >= 1),
        ("if(x > y, y > 0, x > 0)", lambda x, y: y > 0 if x > y else x > 0),
    ],
)
def test_conditions_are_what_they_say_at_ties_too(text: str, truth: Callable[[float, float], bool]) -> None:
    for a in (-1.0, 0.0, 1.0):
        for b in (-1.0, 0.0, 1.0):
            assert value_of(parse(f"if({text}, 3, 5)"), {"x": a, "y": b}) == (3.0 if truth(a, b) else 5.0)
            assert value_of(parse(text), {"x": a, "y": b}) == truth(a, b)


def test_a_choice_is_lazy_and_differentiated_beside_its_switch() -> None:
    expression = parse("if(x > 0, log(x), smooth(abs(x)))")
    assert value_of(expression, {"x": -2.0}) == 2.0
    assert expression.diff(symbol("x")) == parse("if(x > 0, 1/x, smooth(sign(x)))")
    slope = parse("f(x**2, x)", tables=("f",)).diff(symbol("x"))
    assert {call.orders for call in slope.atoms(TableCall)} == {(1, 0), (0, 1)}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x == y", "'==' is not an operator; conditions have <, <=, > or >=; write a = b as a - b at column 3"),
        ("x < y < 1", "two comparisons in a row; join them by 'and'"),
        ("if(x, 1, 2)", "'x' is no condition, such as x > 0"),
        ("x and y > 0", "'x' is no condition"),
        ("not x", "'x' is no condition"),
        ("if(x > 0, 1)", "if takes 3 argument"),
        ("and", "unexpected 'and'"),
        ("f(x, y, 1)", "f takes 1 to 2 argument"),
        ("smooth(x, y)", "smooth takes 1 argument"),
        (" and ".join(f"(a{i} > 0 or b{i} > 0)" for i in range(12)), "too many cases when the conditions are written"),
        (" and ".join(f"a{i} > 0" for i in range(40)), "too many cases when the conditions are written"),
    ],
)
def test_what_is_no_condition_is_refused(text: str, message: str) -> None:
    with pytest.raises(ExpressionError, match=re.escape(message)):
        parse(text, tables=("f",))


def test_a_name_is_resolved_or_unknown() -> None:
    assert parse("a + 1", {"a": x}.get) == x + 1
    with pytest.raises(ExpressionError, match="here: unknown name 'b' at column 3"):
        parse("a*b", {"a": x}.get, "here")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x.y", "unexpected character '.' at column 2"),
        ("x[0]", r"unexpected character '\['"),
        ("1_000", "unexpected '_000'"),
        ("0x10", "unexpected 'x10'"),
        ("5 N", r"unexpected 'N' at column 3 of '5 N'; .* Numbers are in SI units"),
        ("cos(30 deg)", r"expected '\)', got 'deg' at column 8 of .*; is a '\*' missing .* Numbers are in SI units"),
        ("x y", r"unexpected 'y' at column 3 of 'x y'; is a '\*' missing before it\?"),
        ("l sin(x)", r"unexpected 'sin' at column 3 of 'l sin\(x\)'; is a '\*' missing before it\?"),
        ("(x) (y)", r"unexpected '\(' at column 5 .*; is a '\*' missing before it\?"),
        ("x)", r"unexpected '\)' at column 2 of 'x\)'$"),
        ("5.0.3", "unexpected '.3' at column 4 of '5.0.3'$"),
        ("1,5*x", "unexpected ',' at column 2 of '1,5.x'; the decimal sign is '.'"),
        ("exp x", r"the function 'exp' has no argument at column 1 of 'exp x'; write exp\(...\)"),
        ("1 + sin", r"the function 'sin' has no argument at column 5"),
        ("sin^2(x)", r"the function 'sin' has no argument at column 1 .*; write sin\(...\)\*\*2"),
        ("x // y", "unexpected '/' at column 4 .*; a quotient has one '/'; a comment begins with '#'"),
        ("50%*x", "unexpected character '%' .*; a per cent is 0.01"),
        ("sin(60°)", "unexpected character '°' .*; angles are in rad"),
        ("√x", r"unexpected character '√' .*; a root is sqrt\(...\)"),
        (r"\sin(x)", "unexpected character .*; functions are written without a backslash"),
        ("x # y", "unexpected character '#' .*; a comment stands outside of the quotes"),
        ("d(x)/dt", "'d' is not a function .*; the velocity of x is x_dot"),
        ("diff(x, y)", "'diff' is not a function .*; the velocity of x is x_dot"),
        ("arcsin(x)", "'arcsin' is not a function at column 1 .*; did you mean 'asin'"),
        ("ln(x)", r"'ln' is not a function at column 1 of 'ln\(x\)'; write log\(...\)"),
        ("l(x)", r"'l' is not a function .*; known are sin, .*; a product is written l\*\(...\)"),
        ("x²", r"unexpected character '²' .*; a power is written with '\*\*'"),
        ("x·y", r"unexpected character '·' .*; a product is written with '\*'"),
        ("sin[x]", r"unexpected character '\[' .*; brackets are \( and \)"),
        ("φ*x", "unexpected character 'φ' .*; names are of the letters A to Z"),
        ("f(x)", "'f' is not a function"),
        ("x^2", "a power is written with"),
        ("atan2(x)", "atan2 takes 2 argument"),
        ("min(x)", "min takes 2 or more argument"),
        ("heaviside(x, 1)", "heaviside takes 1 argument"),
        ("1e400", "too large"),
        ("9" * 401, "more than 400 digits"),
        ("1e200*x*1e200", "a number beyond 1e307"),
        ("1e-200*x*1e-200", "a number beyond 1e307 or below"),
        ("x**65", "a power beyond 64"),
        ("x**40*x**40", "a power beyond 64"),
        ("(x**9)**9", "a power beyond 64"),
        ("x**exp(exp(exp(exp(100))))", "too large"),
        ("1/(x - x)", "division by zero"),
        ("0**-1", "division by zero"),
        ("tan(pi/2)", "not finite"),
        ("log(0)", "not finite"),
        ("sqrt(-1)*x", "not real"),
        ("acos(2)", "not real"),
        ("asin(pi)", "not real"),
        ("(-8)**(1/3)", "not real"),
        ("exp(" * 50 + "1" + ")" * 50, "too large"),
        ("log(cos(" * 25 + "1" + "))" * 25, "nested too deeply"),
        ("min(x" + "".join(f",y{i}" for i in range(16)) + ")", "min of 17 arguments"),
    ],
)
def test_hostile_texts_are_refused_at_once(text: str, message: str) -> None:
    began = time.process_time()
    with pytest.raises(ExpressionError, match=message) as caught:
        parse(text, where="energy.potential")
    assert time.process_time() - began < 5.0  # a hostile text would take hours; collecting garbage takes a second
    assert str(caught.value).startswith("energy.potential: ")


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("x", "expected an expression, got 'x'"),
        (True, "expected an expression, got True"),
        (float("nan"), "not finite"),
        (sp.oo * x, "not finite"),
        (sp.I * x, "not real"),
        (sp.asin(5) * x, "no real value"),
        (sp.gamma(x), "the function 'gamma' is not supported"),
        (sp.Matrix([x]), "expected a scalar expression"),
        (sp.Piecewise((x, x > 0), (0, True)), "case distinction|not supported"),
        (sp.Function("f")(x), "the function 'f' is not supported"),
        (x**100, "a power beyond 64 in"),
        (sp.Eq(x, 1), "expected a scalar expression"),
    ],
)
def test_other_values_have_no_normal_form(value: object, message: str) -> None:
    with pytest.raises(MechanismError, match=f"^masses.m: .*({message})"):
        normal_form(value, "masses.m")


def test_formulas_of_any_size_are_not_compared_for_the_largest(monkeypatch: pytest.MonkeyPatch) -> None:
    """SymPy compares arguments as formulas, which takes minutes for lengths along places of a robot."""
    long, short = "+".join(f"sin({k}*x)*cos({k}*y)" for k in range(1, 30)), parse("max(x, x + 1)")
    assert short == x + 1
    assert isinstance(parse("min(" * 50 + "x" + "".join(f",y{i})" for i in range(50))), sp.Min)
    monkeypatch.setattr(MinMaxBase, "_is_connected", lambda *_: pytest.fail("compared"))
    found = parse(f"max(x, {long})")
    assert isinstance(found, sp.Max)
    assert normal_form(found, "e") == found
    assert parse(to_text(found)) == found


def test_the_normal_form_has_real_symbols_and_exact_numbers() -> None:
    assert normal_form(sp.Symbol("x") * 0.1, "e") == x / 10
    assert normal_form(sp.Abs(sp.Abs(x, evaluate=False), evaluate=False), "e") == sp.Abs(x)
    assert free_names([x * y, sp.sin(m)]) == {"x", "y", "m"}
    assert [number_text(value) for value in (0.1, 1e-25, 3.0)] == ["0.1", "1e-25", "3.0"]


def test_numbers_have_the_value_of_floats() -> None:
    number = parse("2*pi + sqrt(3)*sin(1/2)**2 - atan2(1, 2)*max(exp(1), 3)")
    assert value_of(number) == pytest.approx(float(number), rel=1e-14)
