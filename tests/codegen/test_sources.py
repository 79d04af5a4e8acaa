"""The source tree: complete, free of template marks, clean for compilers, and computing what the graph computes."""

from __future__ import annotations

import ctypes
import difflib
import math
import random
from collections.abc import Mapping
from pathlib import Path

import pytest
from chosen import REPRESENTATIVE
from compiling import COMPILERS, UNOPTIMISED, compiled
from jinja2 import UndefinedError
from sympy import (
    Abs,
    Heaviside,
    Max,
    Min,
    acos,
    asin,
    atan,
    atan2,
    cos,
    cosh,
    exp,
    log,
    sign,
    sin,
    sinh,
    sqrt,
    tan,
    tanh,
)

from lag2fmu.codegen import DEFAULT_SOLVER, METHODS, SMOOTH_METHODS, takes
from lag2fmu.codegen.reached import reached
from lag2fmu.codegen.sources import FUNCTIONS, GENERATED
from lag2fmu.codegen.templates import render
from lag2fmu.dynamics import Program, derive, lower
from lag2fmu.fmu.backends.native import describe
from lag2fmu.formats.loading import load
from lag2fmu.graph.graph import Graph
from lag2fmu.graph.operations import OPERATIONS, SYMBOL
from lag2fmu.language.expressions import TIME
from lag2fmu.language.vocabulary import Smooth
from lag2fmu.mechanism import Energy, Mechanism, Output, coordinate, parameter
from lag2fmu.resources import resource_folder

SIZE = 512
"""Longer than any array of these mechanisms."""
ENGINE = resource_folder("templates") / "engine"
GOLDEN = Path(__file__).parent / "golden"


def every_function() -> Mechanism:
    """A mechanism whose equations use every function of the language, each with an argument in its domain."""
    x, y, p = coordinate("x", start=0.3), coordinate("y", start=0.4), parameter("p", 1.7)
    smooth = (
        sin(x) + cos(p * y) + tan(x / 2) + asin(x / 9) + acos(y / 9) + atan(p * x) + sinh(x) + cosh(y) + tanh(x * y)
    )
    others = exp(-(x**2)) + log(3 + x**2) + sqrt(2 + y**2) + atan2(x + 3, y + 4) + (2 + sin(x)) ** (1 + y**2 / 5)
    powers = (3 + x) ** p + (4 + y) ** -3 + (5 + x) ** 2.5 + x**7
    # no force contains these
    apart = sign(x - 5) + Abs(x - 6) + Heaviside(y - 5) + Min(x, y + 6) * Max(y, x + 7) + Smooth(Abs(x))
    kinks = Abs(x - y) ** 3 + Min(x, y, p) ** 3 + Max(x, p * y) ** 3 + sign(x) * x**2 + Heaviside(y) * y**3
    return Mechanism(
        "every_function",
        coordinates=[x, y],
        parameters=[p, parameter("follows", exp(p) / 3)],
        energy=Energy(
            kinetic=(2 + sin(x)) * x.dot**2 / 2 + (3 + tanh(y)) * y.dot**2 / 2 + sin(x * y) * x.dot * y.dot / 4,
            potential=smooth + others + powers + kinks * cos(TIME),
            dissipation=(1 + x**2) * (x.dot - y.dot) ** 2 / 2,
        ),
        outputs=[Output("all", smooth * others - kinks / powers), Output("kinks", apart)],
    )


def sources_of(mechanism: Mechanism, solver: str = DEFAULT_SOLVER) -> tuple[Program, Mapping[str, str]]:
    equations = derive(mechanism)
    program = lower(equations, variational=METHODS[solver].variational, time_stepping=solver == "moreau")
    return program, describe(mechanism, equations, program, solver)[1]


def test_every_function_is_used() -> None:
    program, _ = sources_of(every_function())
    used = {
        OPERATIONS[program.graph.code[node]].name
        for function in program.functions
        for node in program.graph.cone(node for *_, node in function.results)
    }
    assert used == {row.name for row in OPERATIONS} - {"lookup", "lookup_2"}


@pytest.mark.parametrize(
    ("model", "solver"),
    [
        *((m, "dopri5") for m in sorted(REPRESENTATIVE)),
        *(("double_pendulum", s) for s in SMOOTH_METHODS),
        ("woodpecker", "moreau"),
    ],
)
def test_no_mark_of_a_template_survives(model: str, solver: str) -> None:
    _, sources = sources_of(load(model), solver)
    assert set(GENERATED) < set(sources)
    assert list(sources) == sorted(sources)
    for name, text in sources.items():
        assert not any(mark in text for mark in ("{{", "{%", "{#", "}}", "%}", "Undefined")), name
        assert text.isascii(), name
        assert "\r" not in text
        assert "\t" not in text
        assert text.endswith("\n"), name


NEVER_LEFT_OUT = {"equations.c", "fmi2_variables.c", "instance.c", "integrator.c", "mass_matrix.c", "state.h"}
FREE = {
    *("constraints_none.c", "contacts_none.c", "contact_events_none.c", "events_none.c", "event_steps_none.c"),
    *("further_none.c", "massless_none.c", "tables_none.c", "timed_none.c", "arena_blocks.c"),
}
CONSTRAINED = {
    *("further_none.c", "tables_none.c", "timed_none.c", "arena_blocks.c"),
    *("constrained_accelerations.c", "constrained_system.c", "constraint_factorization.c", "constraint_projection.c"),
    *("contacts_none.c", "contact_events_none.c", "events_none.c", "event_steps_none.c"),
    *("constraint_kinks.c", "constraint_residuals.c", "constraint_start.c", "free_states.c", "multiplier_rates.c"),
}
STEPS = "step_failure.c"


def _is_chosen(path: Path) -> bool:
    """Whether a file of the engine is that of a variant, of a family of solvers, or of adjoint derivatives."""
    room, *folders = path.relative_to(ENGINE).parts[:-1]
    return bool(folders) and (room != "drivers" or folders[0] == "adjoints")


@pytest.mark.parametrize(
    ("model", "solver", "expected"),
    [
        ("pendulum", "dopri5", {*FREE, "runge_kutta.c", STEPS}),
        ("pendulum", "ros2", {*FREE, "ros2.c", "fixed_steps.c", "jacobian.c", "lu.c", STEPS}),
        ("pendulum", "radau5", {*FREE, "radau.c", "radau_stages.c", "jacobian.c", "lu.c", STEPS}),
        ("pendulum", "gauss4", {*FREE, "variational.c", "fixed_steps.c", "variational_free.c", STEPS}),
        ("four_bar_linkage", "dopri5", {*CONSTRAINED, "massless_none.c", "runge_kutta.c", STEPS}),
        (
            "four_bar_linkage",
            "lobatto4",
            {
                *CONSTRAINED,
                *("fixed_steps.c", "massless_none.c", "variational.c", "variational_constraints.c", STEPS),
            },
        ),
        ("slides_problem_5_small", "dopri5", {*CONSTRAINED, "massless.c", "lu.c", "runge_kutta.c", STEPS}),
    ],
)
def test_the_files_of_the_engine_are_those_that_are_needed(model: str, solver: str, expected: set[str]) -> None:
    """What has no mass is solved for by the L U decomposition of an implicit solver, with an explicit one too."""
    _, sources = sources_of(load(model), solver)
    optional = {path.name for path in ENGINE.rglob("*.c") if _is_chosen(path)} | {"lu.c"}
    assert set(sources) >= NEVER_LEFT_OUT
    assert set(sources) & optional == expected


@pytest.mark.parametrize(("solver", "many"), [("dopri5", False), ("moreau", True)])
def test_code_for_many_rows_is_that_of_time_stepping_alone(solver: str, many: bool) -> None:
    _, sources = sources_of(load("woodpecker"), solver)
    named = {"newton_many.c", "sweeps.c", "sparse_rows.c", "few_rows.c", "step_matrix.c"}
    assert named & set(sources) == (named if many else set())
    assert ("newton_many_none.c" in sources) is not many


@pytest.mark.parametrize("name", [*GENERATED, "mechanism.c"])
def test_an_undefined_name_in_a_template_is_an_error(name: str) -> None:
    with pytest.raises(UndefinedError, match="is undefined"):
        render(f"mechanism/{name}.jinja", {})


def test_the_text_is_a_function_of_the_mechanism() -> None:
    assert sources_of(load("cart_pole"))[1] == sources_of(load("cart_pole"))[1]


def test_names_of_the_user_stand_in_comments_and_strings_only() -> None:
    lambda_, q = parameter("lambda", 2.0), coordinate("int", start=1.0)
    energy = Energy(kinetic=lambda_ * q.dot**2 / 2, potential=lambda_ * q**2)
    mechanism = Mechanism("plain", coordinates=[q], parameters=[lambda_], energy=energy)
    text = sources_of(mechanism)[1]["mechanism.c"]
    code = [line for line in text[text.index("#include") :].splitlines() if not line.startswith("/*")]
    assert not any("lambda" in line or "int " in line for line in code)


# ------------------------------------------------------------------------------------------------------ compiled


@pytest.mark.fmu
@pytest.mark.parametrize(
    ("compiler", "solver"),
    [
        *((c, s) for c in COMPILERS for s in ("dopri5", "radau5", "gauss4", "lobatto4")),
        *(("zig", s) for s in ("rk4", "dop853", "ros2", "verlet", "moreau")),
    ],
)
def test_compilers_have_nothing_to_say(compiler: str, solver: str, tmp_path) -> None:
    """The whole tree, with -Wall -Wextra -Wpedantic -Wconversion -Werror; under constraints too where it takes them.

    Each file includes what it needs: it is compiled alone, in the tree of dopri5 or else in each that has it.
    """
    constrained = [load("four_bar_linkage")] if takes(METHODS[solver], "holonomic") else []
    smooth = [*constrained, every_function()]
    for mechanism in [load("woodpecker"), load("gripper")] if solver == "moreau" else smooth:
        folder = tmp_path / mechanism.name
        folder.mkdir()
        # clang finds what it warns of before it optimises, gcc on the way
        options = UNOPTIMISED["zig"] if compiler == "zig" else ()
        sources = sources_of(mechanism, solver)[1]
        known = {} if solver in ("dopri5", "moreau") else sources_of(mechanism)[1]
        apart = [name for name in sources if name.endswith(".c") and sources[name] != known.get(name)]
        compiled(folder, sources, compiler, options=options, apart=apart)


@pytest.mark.fmu
@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("model", ["every_function", "double_pendulum", "cart_pole", "vertically_driven_pendulum"])
def test_the_compiled_functions_compute_what_the_graph_computes(model: str, compiler: str, tmp_path) -> None:
    mechanism = every_function() if model == "every_function" else load(model)
    program, sources = sources_of(mechanism)
    library = compiled(tmp_path, sources, compiler, units=[name for name in FUNCTIONS if name in sources])
    generator, graph = random.Random(6), program.graph
    for function in program.functions:
        called = getattr(library, function.name)
        called.restype = None
        # arguments may be any nodes: what is handed from one function to the next takes any value here
        entries = [node for argument in function.arguments for node in argument.entries if not graph.is_constant(node)]
        given = {node: node if graph.code[node] == SYMBOL else graph.symbol(f"given {node}") for node in entries}
        nodes = graph.substitute([node for *_, node in function.results], given)
        for _ in range(20):
            values = {
                name: generator.uniform(0.1, 1.5) * generator.choice([-1.0, 1.0]) for name in _names(graph, given)
            }
            values |= {"p": generator.uniform(0.5, 2.0)} if "p" in values else {}
            arguments: list[object] = []
            for argument in function.arguments:
                numbers = graph.evaluate([given.get(node, node) for node in argument.entries], values)
                scalar = ctypes.c_double(numbers[0]) if argument.scalar else None
                arguments.append(scalar or (ctypes.c_double * max(1, len(numbers)))(*numbers))
            arrays = {name: (ctypes.c_double * SIZE)(*[math.nan] * SIZE) for name in function.arrays}
            called(*arguments, *arrays.values())
            written: dict[str, set[int]] = {name: set() for name in arrays}
            for (array, index, _), value in zip(function.results, graph.evaluate(nodes, values), strict=True):
                assert math.isfinite(value)
                # the same operations in the same order: only functions of libm and of Python may differ by rounding
                assert arrays[array][index] == pytest.approx(value, rel=1e-12, abs=1e-12), (function.name, array, index)
                written[array].add(index)
            for name, array in arrays.items():
                assert all(math.isnan(array[i]) for i in range(SIZE) if i not in written[name]), (
                    "nothing else is written"
                )


def _names(graph: Graph, given: Mapping[int, int]) -> list[str]:
    return sorted(graph.symbols(given.values()))


@pytest.mark.fmu
def test_functions_with_kinks_at_their_kinks(tmp_path) -> None:
    """sign(0) = 0, heaviside(0) = 1/2, and min, max of equals, in C as on the graph."""
    x, y = coordinate("x"), coordinate("y")
    kinks = sign(x) + 2 * Heaviside(x) + 4 * Max(x, y) + 8 * Min(x, y) + 16 * Abs(x)
    mechanism = Mechanism(
        "kinks",
        coordinates=[x, y],
        energy=Energy(kinetic=(x.dot**2 + y.dot**2) / 2, potential=x * y),
        outputs=[Output("kinks", kinks)],
    )
    program, sources = sources_of(mechanism)
    called = compiled(tmp_path, sources, units=("mechanism.c",)).mechanism_locals
    place = program.locals.index("kinks")
    node = next(n for f in program.functions if f.name == "mechanism_locals" for _, i, n in f.results if i == place)
    for values in ((0.0, 0.0), (-0.0, 0.0), (1.0, 1.0), (-2.0, -2.0), (0.0, -1.0)):
        found = (ctypes.c_double * 64)()
        empty = (ctypes.c_double * 8)()
        called(ctypes.c_double(0.0), (ctypes.c_double * 4)(*values, 0.0, 0.0), empty, empty, empty, found)
        graph = program.graph.evaluate([node], {"x": values[0], "y": values[1]})
        by_hand = {0.0: 0.0 + 1.0, 1.0: 1.0 + 2.0, -2.0: -1.0}[values[0]]
        by_hand += 4 * max(values) + 8 * min(values) + 16 * abs(values[0])
        assert found[place] == graph[0] == by_hand


def test_solvers_leave_out_what_events_alone_change() -> None:
    """The dissipated energy, where impacts alone take some; friction takes it all the time."""
    for model, resting in (("bouncing_ball", 1), ("coulomb_oscillator", 0), ("pendulum", 0)):
        _, sources = sources_of(load(model))
        assert f"#define N_RESTING {resting} " in sources["mechanism.h"], model
        assert ("i < N_MOVING" in sources["tableau.c"]) == (resting > 0), model
        assert ("i < N_STATES" in sources["tableau.c"].partition("case 1:")[2].partition("}")[0]) == (resting == 0)


def test_functions_that_the_engine_does_not_call_are_not_emitted() -> None:
    """Under constraints ``mechanism_constrained`` gives what ``mechanism_factor`` gives otherwise."""
    for model, called in (("pendulum", "mechanism_factor"), ("four_bar_linkage", "mechanism_constrained")):
        _, sources = sources_of(load(model))
        names = {"mechanism_factor", "mechanism_constrained"}
        assert {name for name in names if f"void {name}(" in sources["mechanism.c"]} == {called}


def test_what_calls_reach_in_c() -> None:
    text = """/* c(); is a word of a comment */
static int c(int x);
static const Table TABLE = {.call = d};

static int a(int x) {
    return b(x) + c(x);
}

int b(int x)
{
    return a(x);
}

static void far(double x[],
                int n) {
    b(n);
}

static int c(int x) {
    return x;
}
"""
    assert {"a", "b", "c", "d", "TABLE"} < reached({"x.c": text}, ["a"])
    assert "far" not in reached({"x.c": text}, ["a"])
    assert "a" not in reached({"x.c": text}, ["c"])


# ------------------------------------------------------------------------------------------------------ golden text


@pytest.mark.parametrize("name", ["mechanism.c", "derivatives.c", "locals_derivatives.c", "second_derivatives.c"])
def test_golden_text(name: str, request) -> None:
    """What is emitted for the pendulum; ``pytest tests/codegen --update`` writes it anew."""
    path, text = GOLDEN / f"pendulum_{name}", sources_of(load("pendulum"))[1][name]
    if request.config.getoption("--update"):
        path.write_text(text, "utf-8")
    golden = path.read_text("utf-8")
    if text != golden:
        difference = difflib.unified_diff(golden.splitlines(), text.splitlines(), str(path), "emitted now", lineterm="")
        pytest.fail("\n".join(difference) + "\nif this is meant, run pytest tests/codegen --update")
