"""The expression graph: rewrites keep values, derivatives agree with independent ones."""

from __future__ import annotations

import cmath
import math
import random
from fractions import Fraction

import pytest
import sympy as sp

from lag2fmu.graph.autodiff import forward, reverse
from lag2fmu.graph.derivatives import DERIVATIVES
from lag2fmu.graph.fingerprint import PRIME
from lag2fmu.graph.from_sympy import Translator
from lag2fmu.graph.graph import Graph
from lag2fmu.graph.operations import ARITY, CODE, OPERATIONS
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
    """What is derived: the fingerprint knows them as equal, whatever their form; SymPy agrees."""
    graph = Graph()
    translate = Translator(graph, {name: graph.symbol(name) for name in NAMES})
    derived = [graph.substitute([translate(parse(text))], {graph.symbol("x"): graph.symbol("q")}) for text in (a, b)]
    assert derived[0] == derived[1]
    assert sp.simplify(sp.expand_trig(parse(a) - parse(b))) == 0


WELL_AND_ILL = [
    ("x*y", "x*(y/z)*z", {"z": 0.0}),
    ("x*y*z", "(x*y + 10**17)*z - 10**17*z", {}),
    ("(x - y)*(x + y)", "x**2 - y**2", {"x": 1.0 + 2**-30, "y": 1.0}),
    ("sin(x - y)", "sin(x)*cos(y) - cos(x)*sin(y)", {"x": 1.0 + 1e-12, "y": 1.0}),
    ("sin(x)**2", "1 - cos(x)**2", {"x": 1e-9}),
]


@pytest.mark.parametrize(("well", "ill", "point"), WELL_AND_ILL)
def test_a_written_formula_is_computed_as_it_is_written(well: str, ill: str, point: dict[str, float]) -> None:
    """Whichever of two formulas that are equal as algebra comes first; against SymPy with 40 digits.

    Nor does what is derived take the place of what is written: a product of z is, with the other formula there.
    """
    point = {"x": 0.3, "y": 0.2, "z": 2.0} | point
    exact = float(parse(well).subs({sp.Symbol(n, real=True): sp.Float(v, 40) for n, v in point.items()}))
    parts = [sp.Symbol(f"part_{i}", real=True) for i in range(3)]
    for texts in ((well, ill), (ill, well)):
        graph = Graph()
        translate = Translator(graph, {name: graph.symbol(name) for name in NAMES})
        named = parse(ill).xreplace(dict(zip(parse(ill).args, parts, strict=False)))
        for part, e in zip(parts, parse(ill).args, strict=False):
            translate.define(part.name, translate(e))  # as a definition, with which SymPy cancels nothing
        nodes = {text: translate(named if text == ill else parse(text)) for text in texts}
        derived = graph.multiply(graph.constant(3), graph.multiply(nodes[well], graph.symbol("z")))
        found, tripled = graph.evaluate([nodes[well], derived], point)
        assert found == pytest.approx(exact, rel=1e-15, abs=0)
        assert tripled == pytest.approx(3 * point["z"] * exact, rel=1e-15, abs=0)


@pytest.mark.parametrize("prime", [PRIME, (1 << 61) - 1])
@pytest.mark.parametrize("multiple", [1, 2, -1, Fraction(1, 7)])
def test_numbers_that_are_equal_modulo_a_prime_are_different(prime: int, multiple: Fraction) -> None:
    """As factors and as terms, alone and put together from others; also where the equal one is there before."""
    graph = Graph()
    x = graph.symbol("x")
    seven = graph.multiply(graph.constant(7), x)
    for number in (prime * multiple, prime * multiple + 1, prime * multiple + 7):
        node = graph.constant(Fraction(number))
        alone, product, total = node, graph.multiply(node, x), graph.add(node, x)
        halves = graph.multiply(graph.multiply(graph.constant(Fraction(number, 2)), x), graph.constant(2))
        expected = [float(number), 3.0 * float(number), float(number) + 3.0, 3.0 * float(number), 21.0]
        assert graph.evaluate([alone, product, total, halves, seven], {"x": 3.0}) == pytest.approx(expected, rel=1e-15)


def test_a_node_holds_no_variables_but_those_of_its_formula() -> None:
    """Of two formulas of one value the one with other variables is not taken: a function need not be given them."""
    graph = Graph()
    x, y, seed = (graph.symbol(name) for name in ("x", "y", "seed"))
    around = graph.divide(graph.multiply(graph.multiply(x, seed), y), seed)
    direct = graph.multiply(x, y)
    assert graph.symbols([direct]) == {"x", "y"}
    assert graph.symbols([graph.multiply(seed, around)]) == {"x", "y", "seed"}
    sine, cosine = graph.apply("sin", y), graph.apply("cos", y)
    assert graph.add(graph.multiply(sine, sine), graph.multiply(cosine, cosine)) == graph.one


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


@pytest.mark.parametrize("power", [Fraction(5, 2), Fraction(3, 2), Fraction(17, 10)])
@pytest.mark.parametrize("base", ["max(0, -x)", "abs(x)"])
def test_broken_powers_above_one_are_flat_at_zero(power: Fraction, base: str) -> None:
    """Value and slope are 0 where the base is; the later derivatives are no numbers there, or 0 where it stays 0."""
    graph = Graph()
    x = graph.symbol("x")
    derivatives = [graph.power(Translator(graph, {"x": x})(parse(base)), graph.constant(power))]
    for _ in range(3):
        derivatives += forward(graph, derivatives[-1:], {x: graph.one})
    assert reverse(graph, {derivatives[0]: graph.one}, [x])[0] == derivatives[1]
    assert graph.evaluate(derivatives, {"x": 0.0}) == [0.0] * 4
    if base != "abs(x)":
        assert graph.evaluate(derivatives, {"x": 2.0}) == [0.0] * 4
    p, bent = float(power), -0.3
    slopes = [0.3**p, -p * 0.3 ** (p - 1), p * (p - 1) * 0.3 ** (p - 2), -p * (p - 1) * (p - 2) * 0.3 ** (p - 3)]
    assert graph.evaluate(derivatives, {"x": bent}) == pytest.approx(slopes, rel=1e-14)


@pytest.mark.parametrize(
    "root", ["sqrt(2*max(0, -x))", "max(0, -x)**n", "if(x < 0, (-x)**n, 0)", "if(x < 0, sqrt(-x), 0)"]
)
@pytest.mark.parametrize("place", [0.0, 2.0])
def test_roots_that_a_kink_holds_at_zero_have_finite_derivatives(root: str, place: float) -> None:
    """By the base and by the exponent, n = 3/2: both stay 0."""
    graph = Graph()
    x, n, by_x, by_n = (graph.symbol(name) for name in ("x", "n", "dx", "dn"))
    found = Translator(graph, {"x": x, "n": n})(parse(root))
    results = [*forward(graph, [found], {x: by_x, n: by_n}), *reverse(graph, {found: by_x}, [x, n])]
    assert graph.evaluate(results, {"x": place, "n": 1.5, "dx": 1.0, "dn": 0.3}) == [0.0] * 3


def test_a_power_of_a_negative_base_has_a_slope_where_its_exponent_is_whole() -> None:
    """The tangent of a program has seeds for all parameters, 0 for this exponent."""
    graph = Graph()
    x, n, none = (graph.symbol(name) for name in ("x", "n", "dn"))
    (slope,) = forward(graph, [graph.power(x, n)], {x: graph.one, n: none})
    assert graph.evaluate([slope], {"x": -2.0, "n": 3.0, "dn": 0.0}) == [12.0]


@pytest.mark.parametrize(("exponent", "cube"), [(3.0, -8.0), (2.0, 4.0), (1.5, 0.0)])
def test_a_power_in_a_branch_has_the_value_of_its_exponent(exponent: float, cube: float) -> None:
    """A branch clips the base of a broken power at 0, for steps beyond its end, and no other base."""
    graph = Graph()
    x, n = graph.symbol("x"), graph.symbol("n")
    found = Translator(graph, {"x": x, "n": n})(parse("if(x < 5, x**n, 1)"))
    assert graph.evaluate([found], {"x": -2.0, "n": exponent}) == [cube]


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
        assert (operation.name in DERIVATIVES) == (ARITY[code] > 0)
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
