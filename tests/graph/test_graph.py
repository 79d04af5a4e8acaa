"""The expression graph: rewrites keep values, derivatives agree with independent ones."""

from __future__ import annotations

import cmath
import math
import random
from fractions import Fraction

import pytest
import sympy as sp

from lag2fmu.graph.autodiff import forward, reverse
from lag2fmu.graph.graph import Graph
from lag2fmu.graph.operations import ARITY, CODE, OPERATIONS
from lag2fmu.graph.translate import Translator
from lag2fmu.language.expressions import parse

NAMES = ("x", "y", "z")


def _random_expression(generator: random.Random, depth: int) -> sp.Expr:
    """A random rational expression of x, y, z with sines and cosines."""
    if depth == 0:
        return generator.choice([*map(sp.Symbol, NAMES), sp.Integer(generator.randint(-3, 3)), sp.Rational(1, 3)])
    a, b = (_random_expression(generator, depth - 1) for _ in range(2))
    return generator.choice([a + b, a - b, a * b, a * a, -a, sp.sin(a), sp.cos(b), a * b - b * a + a, (a + b) * 2])


@pytest.mark.parametrize("seed", range(60))
def test_rewrites_keep_the_value(seed: int) -> None:
    """Against SymPy's evaluation with 30 digits."""
    generator = random.Random(seed)
    expression = _random_expression(generator, 5)
    graph = Graph()
    node = Translator(graph, {name: graph.symbol(name) for name in NAMES})(expression)
    values = {name: generator.uniform(-2, 2) for name in NAMES}
    exact = complex(sp.N(expression.subs({sp.Symbol(n): sp.Float(v, 40) for n, v in values.items()}), 30)).real
    (value,) = graph.evaluate([node], values)
    assert value == pytest.approx(exact, rel=1e-12, abs=1e-11)


def test_equal_expressions_are_one_node() -> None:
    graph = Graph()
    x, y = graph.symbol("x"), graph.symbol("y")
    assert graph.add(x, y) == graph.add(y, x)
    assert graph.multiply(graph.negate(x), y) == graph.negate(graph.multiply(x, y))
    assert graph.add(x, graph.negate(x)) == graph.zero
    assert graph.subtract(graph.add(x, y), y) == x
    third = graph.constant(Fraction(1, 3))
    assert graph.multiply(third, graph.multiply(graph.constant(3), x)) == x
    assert graph.divide(x, x) == graph.one


@pytest.mark.parametrize(
    ("a", "b"),
    [
        ("sin(x)**2 + cos(x)**2", "1"),
        ("sin(x + y)", "sin(x)*cos(y) + cos(x)*sin(y)"),
        ("cos(x - y)", "cos(x)*cos(y) + sin(x)*sin(y)"),
        ("cos(x + y + z)", "cos(x)*cos(y + z) - sin(x)*sin(y + z)"),
        ("(x*y)*z", "x*(z*y)"),
        ("x*(y + z)", "x*y + x*z"),
        ("(x + y)**2 - x**2 - y**2", "2*x*y"),
        ("x/(y*z)", "x/y/z"),
        ("0.1*x + 0.2*x", "0.3*x"),
    ],
)
def test_expressions_of_equal_value_are_one_node(a: str, b: str) -> None:
    """The fingerprint knows them as equal, whatever their form; SymPy agrees."""
    graph = Graph()
    translate = Translator(graph, {name: graph.symbol(name) for name in NAMES})
    assert translate(parse(a)) == translate(parse(b))
    assert sp.simplify(sp.expand_trig(parse(a) - parse(b))) == 0


@pytest.mark.parametrize(("a", "b"), [("sin(x)", "cos(x)"), ("x + y", "x - y"), ("exp(x)*exp(y)", "exp(x - y)")])
def test_different_expressions_are_different_nodes(a: str, b: str) -> None:
    graph = Graph()
    translate = Translator(graph, {name: graph.symbol(name) for name in NAMES})
    assert translate(parse(a)) != translate(parse(b))


def test_constants_stay_exact_but_not_without_bound() -> None:
    graph = Graph()
    tenth = graph.constant(Fraction(1, 10))
    assert graph.value(graph.add(tenth, graph.constant(Fraction(2, 10)))) == Fraction(3, 10)
    assert isinstance(graph.value(graph.constant(Fraction(1, 3**400))), float)


def test_a_copy_goes_its_own_way_until_it_is_adopted() -> None:
    graph = Graph()
    x, y = graph.symbol("x"), graph.symbol("y")
    tried, other = graph.copy(), graph.copy()
    product, total = tried.multiply(x, y), other.add(x, y)
    assert product == total == len(graph)
    assert graph.add(x, graph.one) == product
    graph.adopt(tried)
    assert graph.multiply(y, x) == product
    assert graph.evaluate([product], {"x": 3.0, "y": 4.0}) == [12.0]


def test_powers_multiply() -> None:
    graph = Graph()
    x = graph.symbol("x")
    node = graph.power(x, graph.constant(7))
    assert graph.evaluate([node], {"x": 1.3}) == [pytest.approx(1.3**7, rel=1e-15)]
    used = {OPERATIONS[graph.code[n]].name for n in graph.cone([node])}
    assert used == {"symbol", "multiply"}
    for power in (Fraction(-3, 2), Fraction(1, 3), Fraction(5, 2), Fraction(-2)):
        node = graph.power(x, graph.constant(power))
        assert graph.evaluate([node], {"x": 1.3}) == [pytest.approx(1.3 ** float(power), rel=1e-14)]


FUNCTIONS = ("sqrt", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh")
COMPLEX = {name: getattr(cmath, name) for name in FUNCTIONS} | {"negate": lambda z: -z}


@pytest.mark.parametrize("name", COMPLEX)
def test_unary_derivatives_by_complex_step(name: str) -> None:
    """Squire, Trapp, SIAM Review 40 (1998) 110-112: f'(x) = Im f(x + ih)/h."""
    graph = Graph()
    x = graph.symbol("x")
    node = graph.negate(x) if name == "negate" else graph.apply(name, x)
    (tangent,) = forward(graph, [node], {x: graph.one})
    (adjoint,) = reverse(graph, {node: graph.one}, [x])
    expected = COMPLEX[name](complex(0.4, 1e-30)).imag / 1e-30
    assert graph.evaluate([tangent, adjoint], {"x": 0.4}) == [pytest.approx(expected, rel=1e-14)] * 2


@pytest.mark.parametrize(
    ("name", "point", "expected"),
    [
        ("abs", (-0.4,), (-1.0,)),
        ("sign", (0.4,), (0.0,)),
        ("heaviside", (-0.4,), (0.0,)),
        ("min", (0.3, 0.7), (1.0, 0.0)),
        ("max", (0.3, 0.7), (0.0, 1.0)),
        ("max", (0.5, 0.5), (0.5, 0.5)),
        ("atan2", (0.3, -0.7), (-0.7 / 0.58, -0.3 / 0.58)),
        ("power", (1.3, 0.7), (0.7 * 1.3**-0.3, 1.3**0.7 * math.log(1.3))),
        ("divide", (0.3, 0.7), (1 / 0.7, -0.3 / 0.49)),
    ],
)
def test_other_derivatives(name: str, point: tuple[float, ...], expected: tuple[float, ...]) -> None:
    graph = Graph()
    variables = [graph.symbol(n) for n in NAMES[: len(point)]]
    node = graph.divide(*variables) if name == "divide" else graph.apply(name, *variables)
    gradient = reverse(graph, {node: graph.one}, variables)
    tangents = [forward(graph, [node], {v: graph.one})[0] for v in variables]
    values = dict(zip(NAMES, point, strict=False))
    assert graph.evaluate(gradient, values) == [pytest.approx(e, rel=1e-14) for e in expected]
    assert graph.evaluate(tangents, values) == [pytest.approx(e, rel=1e-14) for e in expected]


def test_every_operation_has_a_derivative() -> None:
    for code, operation in enumerate(OPERATIONS):
        assert (operation.derivative is not None) == (ARITY[code] > 0)
        assert CODE[operation.name] == code


def test_second_derivatives_by_nesting() -> None:
    graph = Graph()
    translate = Translator(graph, {name: graph.symbol(name) for name in NAMES})
    expression = parse("x**3*sin(y*z) + exp(x*y)/z + sqrt(x + z)")
    node, variables = translate(expression), [graph.symbol(n) for n in NAMES]
    gradient = reverse(graph, {node: graph.one}, variables)
    values = {"x": 0.7, "y": 0.3, "z": 1.1}
    point = {sp.Symbol(n, real=True): v for n, v in values.items()}
    for i, a in enumerate(NAMES):
        hessian_row = forward(graph, gradient, {graph.symbol(a): graph.one})
        for j, b in enumerate(NAMES):
            expected = float(expression.diff(sp.Symbol(a, real=True), sp.Symbol(b, real=True)).subs(point))
            assert graph.evaluate([hessian_row[j]], values) == [pytest.approx(expected, rel=1e-13)], (i, j)


def test_a_square_costs_one_multiplication_in_reverse() -> None:
    graph = Graph()
    x, y = graph.symbol("x"), graph.symbol("y")
    half_square = graph.multiply(graph.constant_half, graph.multiply(y, graph.multiply(x, x)))
    (momentum,) = reverse(graph, {half_square: graph.one}, [x])
    assert momentum == graph.multiply(y, x)


def test_substitution_rebuilds_through_the_rewrites() -> None:
    graph = Graph()
    x, y = graph.symbol("x"), graph.symbol("y")
    node = graph.add(graph.multiply(x, graph.apply("sin", y)), y)
    assert graph.substitute([node], {y: graph.zero}) == [graph.zero]
    assert graph.substitute([node], {x: graph.zero}) == [y]
