"""The Python text of a Program: what it computes, how it names things; and the runtime's solution of M a = b."""

from __future__ import annotations

import importlib
import math
from types import ModuleType

import numpy as np
import pytest

from lag2fmu.codegen.python import python_body, python_names, python_number, python_text, used_functions
from lag2fmu.dynamics import Array, Function, Program
from lag2fmu.graph.graph import Graph
from lag2fmu.graph.operations import ARITY, CODE, OPERATIONS
from lag2fmu.resources import resource_folder

NAMES = ("lambda", "states", "sin", "v1", "M", "theta")


@pytest.fixture
def runtime(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The package of templates/python/runtime."""
    monkeypatch.syspath_prepend(resource_folder("templates") / "python")
    return importlib.import_module("runtime")


def program_of(graph: Graph, outputs: list[int]) -> Program:
    """A Program whose only function computes ``outputs`` from NAMES as the parameters."""
    p = Array("p", tuple(graph.symbol(name) for name in NAMES))
    results = tuple(("c", index, node) for index, node in enumerate(outputs))
    function = Function("mechanism_dependent", "", (p,), ("c",), results)
    return Program(graph, (function,), "", 0, (), (), tuple(f"c{i}" for i in range(len(outputs))))


def text_of(program: Program) -> str:
    body = python_body(program, program.functions[0], 0, {"c": program.dependent})
    return f"def function(parameters):\n{body}\n"


def run(program: Program, values: list[float], runtime: ModuleType) -> list[float]:
    functions = importlib.import_module("runtime.functions")
    used = used_functions(program, program.functions)
    names = {name: getattr(functions, name, None) or getattr(math, name, None) for name in used}
    names = {name: function for name, function in names.items() if function is not None}
    exec(text_of(program), names)  # the text that is tested
    computed: list[float] = names["function"](values)
    return computed


def test_every_operation_computes_what_the_graph_says(runtime: ModuleType) -> None:
    graph = Graph()
    a, b = graph.symbol(NAMES[0]), graph.symbol(NAMES[1])
    unary = ("negate", "add", "subtract", "multiply", "divide")
    outputs = [graph.add(a, b), graph.subtract(a, b), graph.multiply(a, b), graph.divide(a, b), graph.negate(a)]
    for row in OPERATIONS:
        if row.name not in unary and ARITY[CODE[row.name]] and not row.name.startswith("lookup"):
            outputs.append(graph.apply(row.name, *(a, b, a)[: row.arity]))
    program = program_of(graph, outputs)
    for values in ([0.3, 0.7], [0.7, 0.3], [0.5, 0.5]):
        given = [*values, 0.0, 0.0, 0.0, 0.0]
        expected = graph.evaluate(outputs, dict(zip(NAMES, given, strict=True)))
        assert run(program, given, runtime) == expected


def test_the_precedence_keeps_the_graph(runtime: ModuleType) -> None:
    """Random expressions with the four operations and squares, bit for bit."""
    generator, graph = np.random.default_rng(3), Graph()
    nodes = [graph.symbol(name) for name in NAMES]
    for _ in range(300):
        a, b = (nodes[i] for i in generator.integers(max(0, len(nodes) - 30), len(nodes), 2))
        operation = [graph.add, graph.subtract, graph.multiply, graph.divide][generator.integers(4)]
        if operation != graph.divide or not graph.is_constant(b):
            nodes.append(operation(a, b))
        if generator.uniform() < 0.2:
            nodes.append(graph.negate(nodes[-1]))
    outputs = nodes[-40:]
    values = generator.uniform(0.5, 1.5, len(NAMES)).tolist()
    expected = graph.evaluate(outputs, dict(zip(NAMES, values, strict=True)))
    found = run(program_of(graph, outputs), values, runtime)
    np.testing.assert_array_max_ulp(np.array(found), np.array(expected), maxulp=0)


def test_names_that_mean_something_get_an_underscore() -> None:
    assert python_names(["theta", "lambda", "M", "states", "sin", "v7", "v", "max", "max_"]) == {
        "theta": "theta",
        "lambda": "lambda_",
        "M": "M",
        "states": "states_",
        "sin": "sin_",
        "v7": "v7_",
        "v": "v",
        "max": "max_",
        "max_": "max__",
    }


def test_what_is_used_again_gets_a_telling_name() -> None:
    graph = Graph()
    theta, m = graph.symbol("theta"), graph.symbol("M")
    sine = graph.apply("sin", theta)
    text = text_of(program_of(graph, [graph.multiply(sine, m), graph.multiply(sine, sine)]))
    assert "    sin_theta = sin(theta)\n" in text
    assert "        M * sin_theta,  # c0\n" in text.replace("sin_theta * M", "M * sin_theta")
    assert "        sin_theta**2,  # c1\n" in text


@pytest.mark.parametrize("text", ["2", "0.1", "1 / 3", "-22 / 7", "1e-25", "6.02214076e+23", "0.5"])
def test_numbers_read_back_exactly(text: str) -> None:
    from fractions import Fraction

    exact = Fraction(text.replace(" ", ""))
    assert eval(python_number(exact)) == float(exact)
    assert python_number(exact) == text
    assert eval(python_number(float(exact))) == float(exact)


def test_a_title_cannot_end_its_docstring() -> None:
    title = 'a """ b \\ c'
    assert eval(f'"""{python_text(title)}"""') == "a ''' b \\ c"


@pytest.mark.parametrize(
    ("call", "expected"),
    [
        ("exp(1000.0)", math.inf),
        ("exp(-1000.0)", 0.0),
        ("sinh(-1000.0)", -math.inf),
        ("cosh(-1000.0)", math.inf),
        ("log(0.0)", -math.inf),
        ("power(10.0, 400.0)", math.inf),
        ("power(-10.0, 401.0)", -math.inf),
        ("sign(-0.0)", 0.0),
        ("heaviside(0.0)", 0.5),
    ],
)
def test_functions_at_the_edges_of_their_range(call: str, expected: float, runtime: ModuleType) -> None:
    assert eval(call, vars(importlib.import_module("runtime.functions"))) == expected


@pytest.mark.parametrize("kind", ["positive", "indefinite", "hollow", "badly scaled"])
def test_the_mass_matrix_is_solved(kind: str, runtime: ModuleType) -> None:
    """Against LAPACK; what is not positive definite needs the pivots."""
    solve = importlib.import_module("runtime.linear_solve").solve
    generator = np.random.default_rng(11)
    for n in (1, 2, 3, 6):
        root = generator.normal(size=(n, n))
        mass = root @ root.T + 0.1 * np.eye(n)
        if kind == "indefinite":
            mass = root + root.T
        elif kind == "hollow" and n > 1:
            mass = root + root.T
            np.fill_diagonal(mass, 0.0)
        elif kind == "badly scaled":
            scale = 10.0 ** generator.uniform(-6, 6, n)
            mass = mass * scale * scale[:, None]
        rhs = generator.normal(size=n)
        found, concerned = solve([list(row[: i + 1]) for i, row in enumerate(mass)], list(rhs))
        assert concerned == []
        residual = np.abs(mass @ found - rhs) / (np.abs(mass) @ np.abs(found))
        assert residual.max() < 1e-13


def test_a_singular_matrix_names_its_coordinates(runtime: ModuleType) -> None:
    """The second and third coordinate share one inertia: only their sum counts."""
    solve = importlib.import_module("runtime.linear_solve").solve
    assert solve([[2.0], [0.0, 3.0], [0.0, 3.0, 3.0]], [1.0, 1.0, 1.0])[1] == [1, 2]
    assert solve([[2.0], [0.0, 0.0]], [1.0, 1.0])[1] == [1]
    assert solve([[2.0], [math.nan, 1.0]], [1.0, 1.0])[1] == [0, 1]


def test_the_runtime_is_small() -> None:
    """It travels in every FMU and is meant to be read."""
    files = (resource_folder("templates") / "python" / "runtime").glob("*.py")
    assert max(len(p.read_text("utf-8").splitlines()) for p in files) <= 300
