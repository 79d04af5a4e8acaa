"""Long functions as listings: the same bits as statements, and statements where a listing cannot say it."""

from __future__ import annotations

import ctypes
import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from lag2fmu.codegen import listing
from lag2fmu.codegen.c import c_function, c_prototype
from lag2fmu.codegen.listing import RUN, c_definition
from lag2fmu.codegen.sources import engine_text, page_sources
from lag2fmu.dynamics.functions import Array, Function, Program
from lag2fmu.dynamics.lagrange import derive
from lag2fmu.dynamics.program import lower
from lag2fmu.fmu.backends.native import describe
from lag2fmu.fmu.live.spots import no_spots
from lag2fmu.fmu.live.work import work
from lag2fmu.formats.loading import load
from lag2fmu.graph.graph import Graph
from tests.support.compiling import compiled


def results(library: ctypes.CDLL, function: Function, values: dict[str, list[float]]) -> list[bytes]:
    """The bytes that the ``function`` of a ``library`` writes into arrays of nan, for arguments of these ``values``."""
    arguments: list[object] = []
    for argument in function.arguments:
        given = values[argument.name]
        arguments.append(ctypes.c_double(given[0]) if argument.scalar else (ctypes.c_double * len(given))(*given))
    sizes = [1 + max((i for a, i, _ in function.results if a == array), default=0) for array in function.arrays]
    arrays = [(ctypes.c_double * size)(*[math.nan] * size) for size in sizes]
    getattr(library, function.name)(*arguments, *arrays)
    return [bytes(array) for array in arrays]


def both(folder: Path, program: Program, functions: list[Function]) -> list[ctypes.CDLL]:
    """Libraries of ``functions`` as statements and as listings."""
    heads = "".join(f"{c_prototype(f)};\n" for f in functions)
    texts = ["".join(c_function(program, f) for f in functions)]
    texts.append("".join(c_definition(program, f, patient=True) for f in functions))
    assert texts[1].count(RUN) == len(functions)
    begin = '#include <math.h>\n#include <string.h>\n#include "listing.h"\n'
    engine = {f"listing.{end}": engine_text(f"base/listing.{end}") for end in "hc"}
    folders = [folder / name for name in ("statements", "listings")]
    for place in folders:
        place.mkdir()
    return [compiled(p, {**engine, "f.c": begin + heads + text}) for p, text in zip(folders, texts, strict=True)]


@pytest.mark.fmu
@pytest.mark.parametrize("model", ["four_bar_linkage", "six_axis_arm", "heavy_top_quaternion"])
def test_a_listing_has_the_bits_of_statements(model: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(listing, "LONGEST", 0)
    program = lower(derive(load(model)))
    functions = [f for f in program.functions if program.operations(f.name)]
    assert len(functions) >= 6
    libraries = both(tmp_path, program, functions)
    random = np.random.default_rng(1)
    for function in functions:
        values = {a.name: random.uniform(0.1, 2.0, max(1, len(a.entries))).tolist() for a in function.arguments}
        statements, listed = (results(library, function, values) for library in libraries)
        assert statements == listed, function.name


def small(operation: str) -> tuple[Program, Function]:
    """y = (operation(x0) + x1, x1, 0, 2.5, -x0) in a program of its own."""
    g = Graph()
    a, b = g.symbol("a"), g.symbol("b")
    value = g.add(g.apply(operation, a), b)
    entries = (value, b, g.zero, g.constant(2.5), g.negate(a))
    written = tuple(("y", i, node) for i, node in enumerate(entries))
    function = Function("f", "", (Array("x", (a, b)), Array("z", ())), ("y", "w"), written)
    return Program(g, (function,), "", 0, (), (), ()), function


def test_constants_and_arguments_are_results_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(listing, "LONGEST", 0)
    program, function = small("sqrt")
    for library in both(tmp_path, program, [function]):
        (y, _) = results(library, function, {"x": [4.0, 0.5], "z": [0.0]})
        assert np.frombuffer(y).tolist() == [2.5, 0.5, 0.0, 2.5, -4.0]


def test_what_is_short_often_called_or_without_a_sign_has_statements(monkeypatch: pytest.MonkeyPatch) -> None:
    program, root = small("sqrt")
    assert RUN not in c_definition(program, root, patient=True)
    monkeypatch.setattr(listing, "LONGEST", 0)
    (program, root), (other, tangent) = small("sqrt"), small("tanh")
    assert RUN in c_definition(program, root, patient=True)
    assert RUN not in c_definition(program, root)
    assert RUN not in c_definition(other, tangent, patient=True)


def test_equal_operations_stand_side_by_side() -> None:
    """A sum of 100 products, which statements compute one after the other, has two runs."""
    g = Graph()
    x = [g.symbol(f"x{i}") for i in range(200)]
    total = g.total(g.multiply(*x[i : i + 2]) for i in range(0, 200, 2))
    order = g.schedule([total], frozenset(x))
    codes = [g.code[node] for node in listing._grouped(g, order)]
    assert sum(a != b for a, b in pairwise(codes)) == 1


@pytest.mark.parametrize(("solver", "steps"), [("dopri5", False), ("radau5", True)])
def test_derivatives_are_statements_where_steps_take_them(
    solver: str, steps: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Jacobians of an implicit solver are made of them; a page has time even then."""
    monkeypatch.setattr(listing, "LONGEST", 0)
    equations = derive(load("double_pendulum"))
    program = lower(equations)
    description, sources = describe(equations.mechanism, equations, program, solver)
    assert (RUN in sources["derivatives.c"], RUN in sources["second_derivatives.c"]) == (not steps, True)
    assert "listing.c" in sources
    references = {v.name: v.value_reference for v in description.variables if v.derivative_of is None}
    page = page_sources(sources, program, {"picture": no_spots(), "work": work(equations, references)})
    assert ("derivatives.c" in page, RUN in page.get("derivatives.c", RUN)) == (steps, True)
    assert "const double t0 = " not in page["mechanism.c"]  # no statements
