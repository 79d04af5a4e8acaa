"""The C of ensembles and functions: clean for compilers, and computing what the graph computes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from compiling import COMPILERS, UNOPTIMISED, compiled
from sympy import acos, asin, atan, atan2, cos, cosh, exp, log, sin, sinh, sqrt, tan, tanh

from lag2fmu.codegen.lanes import render_external, render_function, render_lanes, render_scalar
from lag2fmu.dynamics import derive, lower
from lag2fmu.dynamics.plain import plain_functions
from lag2fmu.ensemble import StateFunction
from lag2fmu.fmu.variables import build_table
from lag2fmu.formats.loading import load
from lag2fmu.graph.batches import evaluate
from lag2fmu.mechanism import Energy, Mechanism, coordinate, parameter
from lag2fmu.solvers.methods import METHODS

pytestmark = pytest.mark.fmu


def smooth_functions() -> Mechanism:
    """Equations with every smooth function of the language, each with an argument in its domain."""
    x, y, p = coordinate("x", start=0.3), coordinate("y", start=0.4), parameter("p", 1.7)
    first = sin(x) + cos(p * y) + tan(x / 2) + asin(x / 9) + acos(y / 9) + atan(p * x) + sinh(x) + cosh(y) + tanh(x * y)
    second = exp(-(x**2)) + log(3 + x**2) + sqrt(2 + y**2) + atan2(x + 3, y + 4) + (2 + sin(x)) ** (1 + y**2 / 5)
    kinetic = (2 + sin(x)) * x.dot**2 / 2 + (3 + tanh(y)) * y.dot**2 / 2
    energy = Energy(kinetic=kinetic, potential=first + second + (3 + x) ** p)
    return Mechanism("smooth_functions", coordinates=[x, y], parameters=[p], energy=energy)


def test_lanes_compute_what_the_graph_computes() -> None:
    mechanism = smooth_functions()
    f = StateFunction(mechanism)
    functions = plain_functions(derive(mechanism))
    x = f.start["x"] + np.random.default_rng(0).uniform(-0.2, 0.2, (19, 4))
    values = {"t": 0.0, "p": 1.7, "Q_x": 0.0, "Q_y": 0.0} | dict(zip(f.names["x"], x.T, strict=True))
    nodes = [node for array, _, node in functions.program.functions[0].results if array == "f"]
    expected = evaluate(functions.program.graph, nodes, values)
    assert np.allclose(f(x).T, expected, rtol=1e-13, atol=1e-13)


def rendered(model: str, lanes: int, solver: str) -> Mapping[str, Mapping[str, str]]:
    equations, method = derive(load(model)), METHODS[solver]
    program, functions = lower(equations, variational=method.variational), plain_functions(equations)
    tables = build_table(equations, program).tables
    names = dict.fromkeys("xup", ("entry",))
    return {
        "lanes": render_lanes(program, tables, method, lanes),
        "function": render_function(functions, model, lanes, jacobian=False),
        "jacobian": render_function(functions, model, lanes, jacobian=True),
        "external": render_external(functions, model, names),
        "scalar": render_scalar(program, tables, method),
    }


@pytest.mark.slow
@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize(
    ("model", "lanes", "solver"),
    [("four_bar_linkage", 4, "dop853"), ("double_pendulum", 1, "dop853"), ("double_pendulum", 4, "verlet")],
)
def test_compilers_have_nothing_to_say(model: str, lanes: int, solver: str, compiler: str, tmp_path: Path) -> None:
    """With -Wall -Wextra -Wpedantic -Wconversion -Werror; the scalar engine once."""
    # they warn of vectors that no register holds; clang finds what it warns of before it optimises, gcc on the way
    own = ("-march=native",) if compiler == "gcc" else ("-mcpu=native", *UNOPTIMISED["zig"])
    for name, sources in rendered(model, lanes, solver).items():
        if name != "scalar" or model == "four_bar_linkage":
            folder = tmp_path / name
            folder.mkdir()
            compiled(folder, sources, compiler, options=own)
