"""Elimination against factorisation against a dense solve, on random mechanisms; operation counts as golden numbers."""

from __future__ import annotations

import random
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from lag2fmu.description import names
from lag2fmu.dynamics import derive, lower
from lag2fmu.dynamics.elimination import mass_matrix, solve
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.lagrange import ACCELERATION_METHODS
from lag2fmu.dynamics.quadratic import second_degree
from lag2fmu.dynamics.starts import start_values
from lag2fmu.formats.loading import bundled, load
from lag2fmu.graph.cost import cycles
from lag2fmu.graph.from_sympy import Translator
from lag2fmu.graph.graph import Graph
from lag2fmu.graph.operations import OPERATIONS
from lag2fmu.language.vocabulary import Choice
from lag2fmu.mechanism import Body, Energy, Frame, Mechanism, Spring, coordinate, parameter, signal
from lag2fmu.reference import Equations

COUNTS = Path(__file__).with_name("operations.txt")


def random_tree(seed: int) -> Mechanism:
    """Spatial bodies on a random tree of frames with several roots, all kinds of joints, a moving support, a spring."""
    generator = random.Random(seed)
    n = generator.randint(3, 7)
    g, k, y0 = parameter("g", 9.81, "m/s2"), parameter("k", 3.0), signal("y0", "m", motion=True)
    q, frames, bodies = [], [], []
    for i in range(n):
        parent = generator.choice(["world", *frames[-2:]]) if i else "world"
        sliding = generator.random() < 0.3
        q.append(coordinate(f"q{i}", "m" if sliding else "rad", start=generator.uniform(-0.5, 0.5)))
        offset = [sp.Float(generator.uniform(-0.5, 0.5)) for _ in range(3)]
        if sliding:
            offset[generator.randrange(3)] += q[-1]
        if i == 1:
            offset[0] += y0
        axis = generator.choice(["x", "y", "z", (1, 2, generator.choice([-1, 2]))])
        turns = [("x", sp.Float(generator.uniform(-1, 1)))] + ([] if sliding else [(axis, q[-1])])
        frames.append(Frame(f"f{i}", parent, offset, turns))
        a, b, c = (generator.uniform(0.5, 1.0) for _ in range(3))
        tensor = (b + c, a + c, a + b, 0.1, -0.05, 0.02)
        center = [generator.uniform(-0.3, 0.3) for _ in range(3)]
        bodies.append(Body(f"b{i}", generator.uniform(0.5, 2), frame=frames[-1], center=center, inertia=tensor))
    coupling = Spring("far", k, elongation=q[0] - q[-1])
    return Mechanism(
        "tree",
        coordinates=q,
        parameters=[g, k],
        inputs=[y0],
        frames=frames,
        bodies=bodies,
        gravity=g,
        springs=[coupling],
    )


def random_energy(seed: int) -> Mechanism:
    """T = 1/2 qd.M.qd + a.qd with a random positive definite M(q); V random, with a velocity in it."""
    generator = random.Random(100 + seed)
    n = generator.randint(2, 5)
    q = [coordinate(f"q{i}", start=generator.uniform(-0.5, 0.5)) for i in range(n)]
    factors = [[sp.Rational(generator.randint(-3, 3), 4) * sp.cos(generator.choice(q)) for _ in q] for _ in q]
    speeds = sp.Matrix([x.dot for x in q])
    root = sp.Matrix(factors) + 3 * sp.eye(n)
    kinetic = ((root * speeds).T * (root * speeds))[0] / 2 + q[0].dot * sp.sin(q[-1])
    potential = sum((sp.sin(a * b) for a in q for b in q), sp.S.Zero) + q[0].dot * q[-1] / 5
    return Mechanism("energy", coordinates=q, energy=Energy(kinetic, potential))


MECHANISMS = [*(("tree", s) for s in range(12)), *(("energy", s) for s in range(8))]


def random_states(mechanism: Mechanism, count: int = 4) -> list[dict[str, float]]:
    generator = random.Random(5)
    fixed = {p.name for p in mechanism.parameters}
    start = start_values(mechanism)
    return [{k: v if k in fixed else v + generator.uniform(-1, 1) for k, v in start.items()} for _ in range(count)]


def dense(equations: EquationsOfMotion, values: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    n = len(equations.forcing)
    entries = [entry for row in equations.mass_matrix for entry in row]
    numbers = equations.graph.evaluate([*entries, *equations.forcing], values)
    return np.array(numbers[: n * n]).reshape(n, n), np.array(numbers[n * n :])


@pytest.mark.parametrize(("kind", "seed"), MECHANISMS)
def test_both_methods_solve_the_equations(kind: str, seed: int) -> None:
    """|M qdd - f| <= 1e-12 (|M||qdd| + |f|), the accelerations of both agree, and with the independent path."""
    mechanism = (random_tree if kind == "tree" else random_energy)(seed)
    independent = Equations(mechanism)
    both = [derive(mechanism, method) for method in ACCELERATION_METHODS]
    coordinates = [c.name for c in mechanism.coordinates]
    for values in random_states(mechanism):
        found = []
        for equations in both:
            assert equations.solution is not None
            M, f = dense(equations, values)
            qdd = np.array(equations.graph.evaluate(equations.solution.x, values))
            assert np.all(np.abs(M @ qdd - f) <= 1e-12 * (np.abs(M) @ np.abs(qdd) + np.abs(f)))
            assert min(equations.graph.evaluate(equations.solution.pivots, values)) > 0
            found.append(qdd)
        q = np.array([values[c] for c in coordinates])
        qd = np.array([values[names.velocity(c)] for c in coordinates])
        inputs = {name: values[name] for name in independent.energies.input_names}
        expected = independent.accelerations(values["t"], q, qd, inputs)
        assert found[0] == pytest.approx(found[1], rel=1e-9, abs=1e-9)
        assert found[0] == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("name", bundled())
def test_residuals_of_the_bundled_models(name: str) -> None:
    mechanism = load(name)
    for method in ACCELERATION_METHODS:
        equations = derive(mechanism, method)
        for values in random_states(equations.mechanism, 3):
            M, f = dense(equations, values)
            qdd = np.array(equations.graph.evaluate(equations.solution.x, values))  # type: ignore[union-attr]
            assert np.all(np.abs(M @ qdd - f) <= 1e-12 * (np.abs(M) @ np.abs(qdd) + np.abs(f)))


def copied(g: Graph, node: int, fresh: Graph, nodes: dict[int, int]) -> int:
    """The operation of ``node`` in another graph."""
    name, operands = OPERATIONS[g.code[node]].name, [nodes[o] for o in g.operands[node]]
    method = getattr(fresh, name, None)
    return method(*operands) if method else fresh.apply(name, *operands)


@pytest.mark.parametrize(("kind", "seed"), MECHANISMS[::4])
def test_factor_and_solve_are_the_inverse_of_the_mass_matrix(kind: str, seed: int) -> None:
    """The program's cut in two parts, evaluated as it will run in C: w of the state, then a of w and b."""
    mechanism = (random_tree if kind == "tree" else random_energy)(seed)
    equations = derive(mechanism)
    program = lower(equations)
    g, functions = program.graph, {f.name: f for f in program.functions}
    factor, solution = functions["mechanism_factor"], functions["mechanism_solve"]
    (values,) = random_states(mechanism, 1)
    w = g.evaluate([node for array, _, node in factor.results if array == "w"], values)
    fresh = Graph()
    given = dict(zip(solution.arguments[0].entries, (fresh.symbol(f"w{i}") for i in range(len(w))), strict=True))
    rhs = {node: fresh.symbol(str(g.leaf[node])) for node in solution.arguments[1].entries}
    nodes = {**given, **rhs}
    for node in g.cone((n for *_, n in solution.results), solution.given):
        if node not in nodes:
            nodes[node] = fresh.constant(g.value(node)) if g.is_constant(node) else copied(g, node, fresh, nodes)
    M, _ = dense(equations, values)
    b = np.arange(1.0, len(M) + 1)
    numbers = {f"w{i}": x for i, x in enumerate(w)} | {f"rhs {i}": x for i, x in enumerate(b)}
    a = fresh.evaluate([nodes[node] for *_, node in solution.results], numbers)
    assert M @ a == pytest.approx(b, rel=1e-9)


def test_second_degree_of_a_polynomial() -> None:
    graph = Graph()
    x, y, q = graph.symbol("x"), graph.symbol("y"), graph.symbol("q")
    translate = Translator(graph, {"x": x, "y": y, "q": q})
    X, Y, Q = (sp.Symbol(n) for n in "xyq")
    form = second_degree(graph, translate(Q * (X + 2 * Y) ** 2 + X * Y / 3 + sp.sin(Q) * X + Q**3), [x, y])
    assert form is not None
    entries = {(a, b): v for a, row in form.rows.items() for b, v in row.items() if a <= b}
    hessian = mass_matrix(graph, entries, [x, y])
    values = {"x": 0.0, "y": 0.0, "q": 0.7}
    assert [graph.evaluate(list(row), values) for row in hessian] == [
        [pytest.approx(1.4), pytest.approx(2.8 + 1 / 3)],
        [pytest.approx(2.8 + 1 / 3), pytest.approx(5.6)],
    ]
    assert second_degree(graph, translate(X**3), [x, y]) is None
    assert second_degree(graph, translate(sp.cos(X)), [x, y]) is None
    assert second_degree(graph, translate(Choice(X, X**2, 2 * X**2)), [x, y]) is None


def test_a_pivot_that_is_zero_is_put_off() -> None:
    """M = [[0, 1], [1, 1]]: the first velocity has no pivot until the second is eliminated."""
    graph = Graph()
    a, b = graph.symbol("a"), graph.symbol("b")
    rhs = [graph.symbol("f"), graph.symbol("h")]
    for early in (True, False):
        found = solve(graph, {(a, b): graph.one, (b, b): graph.one}, [a, b], rhs, early)
        assert found is not None
        assert graph.evaluate(found.x, {"f": 2.0, "h": 5.0}) == [3.0, 2.0]
    assert solve(graph, {(a, b): graph.one}, [a, b], rhs, early=True) is None


def test_operation_counts_are_the_golden_ones(request: pytest.FixtureRequest) -> None:
    """Operations of the accelerations by each method; rewrite the file with --update and look at the diff."""
    models = [(name, {}) for name in bundled()] + [("n_pendulum", {"n": n}) for n in (10, 20)]
    lines = []
    for name, arguments in models:
        counts = [derive(load(name, arguments), method).operations for method in ACCELERATION_METHODS]
        label = " ".join([name, *(f"{k}={v}" for k, v in arguments.items())])
        lines.append(f"{label}: " + ", ".join(f"{m} {c}" for m, c in zip(ACCELERATION_METHODS, counts, strict=True)))
    text = "\n".join(lines) + "\n"
    if request.config.getoption("--update"):
        COUNTS.write_text(text, "utf-8")
    assert text == COUNTS.read_text("utf-8")


def test_operations_grow_linearly_with_the_links() -> None:
    counts = [derive(load("n_pendulum", {"n": n}), "elimination").operations for n in (10, 20, 30)]
    assert counts[2] - counts[1] == counts[1] - counts[0]


def test_the_automatic_choice_is_the_quicker_one() -> None:
    """Along a chain of 8 links the elimination is shorter and waits longer; both were measured (P8, P20a)."""
    for name, links in (("six_axis_arm", 0), ("double_pendulum", 0), ("n_pendulum", 8), ("n_pendulum", 16)):
        mechanism = load(name, {"n": links} if links else {})
        both = {method: derive(mechanism, method) for method in ACCELERATION_METHODS}
        cost = {method: cycles(e.graph, e.solution.x) for method, e in both.items() if e.solution}
        chosen = derive(mechanism)
        assert cost[chosen.method] == min(cost.values())
        assert chosen.operations == both[chosen.method].operations
        if links:
            assert min(both, key=lambda method: both[method].operations) == "elimination"
            assert chosen.method == ("factorisation" if links == 8 else "elimination")


def test_cycles_are_the_longest_chain_and_half_the_operations() -> None:
    graph = Graph()
    x, y = graph.symbol("x"), graph.symbol("y")
    quotient = graph.divide(graph.add(x, y), y)
    assert cycles(graph, [quotient]) == 4 + 14 + 2 / 2
    assert cycles(graph, [quotient, graph.multiply(x, y)]) == 4 + 14 + 3 / 2
    assert cycles(graph, [x]) == 0


def test_the_graph_does_not_depend_on_the_hash_seed() -> None:
    code = (
        "from lag2fmu.dynamics import derive, lower; from lag2fmu.formats.loading import load\n"
        "g = lower(derive(load('six_axis_arm'))).graph\n"
        "print(hash((tuple(g.code), tuple(g.operands))), len(g), list(g.leaf.values())[-9:])"
    )
    outputs = {
        subprocess.run(
            [sys.executable, "-c", code], env={"PYTHONHASHSEED": seed}, capture_output=True, text=True, check=True
        ).stdout
        for seed in ("0", "1", "2024")
    }
    assert len(outputs) == 1
