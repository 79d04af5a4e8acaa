"""The C gate of the live page, compiled as a library of this machine: it runs an experiment, and goes back."""

from __future__ import annotations

import ctypes
import math
from pathlib import Path

import numpy as np
import pytest
import wasmtime
from compiling import UNOPTIMISED, compiled

from lag2fmu.codegen.sources import FUNCTIONS, page_sources, public_names
from lag2fmu.dynamics.derivation import derive
from lag2fmu.dynamics.program import lower
from lag2fmu.fmu.backends.native import describe
from lag2fmu.fmu.compilers import compile_module
from lag2fmu.fmu.live.drawing import drawing
from lag2fmu.fmu.live.spots import no_spots
from lag2fmu.fmu.live.work import work
from lag2fmu.formats.loading import load
from lag2fmu.graph.operations import OPERATIONS
from lag2fmu.reference.direct_integration import integrate

pytestmark = pytest.mark.fmu


def test_the_gate_runs_an_experiment_and_goes_back(tmp_path: Path) -> None:
    equations = derive(load("four_bar_linkage"))
    program = lower(equations)
    found = drawing(equations.mechanism)
    assert found is not None
    description, sources = describe(equations.mechanism, equations, program, "dopri5")
    references = {v.name: v.value_reference for v in description.variables if v.derivative_of is None}
    files = page_sources(
        sources, program, {"picture": found.spots.program(program), "work": work(equations, references)}
    )
    files = {**files, **{name: sources[name] for name in FUNCTIONS if name in sources}}  # the linker here keeps all
    library = compiled(tmp_path, files, options=UNOPTIMISED["zig"])
    for name, kind in (
        ("page_point", ctypes.c_double),
        ("page_draw", ctypes.c_double),
        ("page_power", ctypes.c_double),
        ("page_sizes", ctypes.c_int),
    ):
        getattr(library, name).restype = ctypes.POINTER(kind)
    library.page_state.restype = ctypes.c_void_p
    library.page_sentence.restype = ctypes.c_char_p
    states, _, _, n, variables, size, state_size = library.page_sizes()[:7]
    assert (states, n, size) == (6, 3, 3 * found.data["count"] + found.data["residuals"])
    assert variables == max(v.value_reference for v in description.variables) + 1

    library.page_begin(*map(ctypes.c_double, (0.0, 0.2, 1e-8)))
    assert library.page_settle() == 1, library.page_sentence()
    saved = ctypes.string_at(library.page_state(), state_size)
    ends = []
    for _ in range(2):
        assert library.page_advance(ctypes.c_double(0.2)) == 1
        library.page_observe()
        ends.append(library.page_point()[:states])
        assert np.abs(library.page_draw(ctypes.c_double(0.2))[3 * found.data["count"] : size]).max() < 1e-8
        ctypes.memmove(library.page_state(), saved, state_size)
        library.page_restored()
    assert ends[0] == ends[1]
    assert library.page_power()[:2] == [0.0, 0.0]  # nothing drives it, nothing brakes it
    reference = integrate(equations.mechanism, np.array([0.0, 0.1, 0.2])).trajectory
    names = [c.name for c in equations.mechanism.coordinates]
    assert ends[0] == pytest.approx(reference.columns([*names, *(f"{q}_dot" for q in names)])[-1], abs=1e-6)


@pytest.mark.parametrize(("solver", "needed"), [("dopri5", ()), ("radau5", ("derivatives.c",))])
def test_the_module_has_derivatives_where_the_solver_calls_them(solver: str, needed: tuple[str, ...]) -> None:
    """What the text says is not called the linker would leave out: the module is as large with it."""
    equations = derive(load("four_bar_linkage"))
    program = lower(equations)
    description, sources = describe(equations.mechanism, equations, program, solver)
    references = {v.name: v.value_reference for v in description.variables if v.derivative_of is None}
    files = page_sources(sources, program, {"picture": no_spots(), "work": work(equations, references)})
    assert FUNCTIONS.keys() & files.keys() == {"mechanism.c", *needed}
    names = public_names(["page.c"])
    whole = compile_module({**files, **{name: sources[name] for name in FUNCTIONS if name in sources}}, names)
    assert len(compile_module(files, names)) == pytest.approx(len(whole), rel=0.01)


def test_modules_have_all_functions_of_expressions() -> None:
    """The part of the C library that they take has sinh and atan2, too, which are functions of expressions."""
    called = [row for row in OPERATIONS if hasattr(math, row.c.partition("(")[0]) and "(" in row.c]
    assert {"sin", "sinh", "atan2", "power"} <= {row.name for row in called}
    lines = [f"double do_{row.name}(double x, double y) {{ return {row.c.format('x', 'y')}; }}" for row in called]
    names = [f"do_{row.name}" for row in called]
    for options in ((), ("-flto",)):
        module = compile_module({"all.c": "\n".join(["#include <math.h>", *lines, ""])}, names, *options)
        store = wasmtime.Store()
        exports = wasmtime.Instance(store, wasmtime.Module(store.engine, module), []).exports(store)
        for row in called:
            for x, y in ((0.3, -0.7), (0.9, 2.5)):
                expected = row.value(*(x, y)[: row.arity])
                assert exports[f"do_{row.name}"](store, x, y) == pytest.approx(expected, rel=1e-14), row.name
