"""Components for WebAssembly, run by wasmtime beside the native library of the same FMU."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from components import STATUS, ComponentUnit, SteppingComponent, component_of, exchange
from stepping3 import Stepping3

from lag2fmu.archives import DESCRIPTION, read_text
from lag2fmu.checking import check_fmu
from lag2fmu.codegen.sources import public_names
from lag2fmu.errors import BuildError, ExportError
from lag2fmu.fmu.compilers import compile_module
from lag2fmu.fmu.exporting import export
from lag2fmu.fmu.wasm.binary import MODULE
from lag2fmu.fmu.wasm.component import c_names, component
from lag2fmu.fmu.wasm.draft import NOT_OFFERED, interfaces
from lag2fmu.fmu.wasm.modules import imported_pages, memory_module
from lag2fmu.language.vocabulary import FUNCTIONS

Both = Callable[[str], Path]
KINDS = ("CoSimulation", "ModelExchange")
EQUAL = 1e-12
"""The relative difference that two mathematical libraries may make, against the greatest value of a variable."""
MOST_BYTES = 300_000


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> Both:
    """The FMU of a model with a library for this machine and a component, made once."""
    made: dict[str, Path] = {}

    def build(model: str) -> Path:
        if model not in made:
            path = tmp_path_factory.mktemp("wasm") / f"{model}.fmu"
            made[model] = export(model, path, fmi="3.0", platform="host,wasm", page="static").path
        return made[model]

    return build


def reals(stepping: Stepping3, causality: str = "") -> list[str]:
    variables = stepping.description.modelVariables
    return [v.name for v in variables if v.type == "Float64" and causality in ("", v.causality)]


def difference(of_library: Any, of_component: Any) -> float:
    """The greatest relative difference, see EQUAL."""
    a, b = np.array(of_library), np.array(of_component)
    return float((np.abs(a - b) / (1.0 + np.abs(a).max(axis=0))).max())


MODELS = ("bouncing_ball", "woodpecker", "four_bar_linkage", "clutch_pair")


@pytest.mark.fmu
@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_a_component_computes_what_the_library_does(model: str, both: Both) -> None:
    path, times, short = both(model), [0.01 * i for i in range(201)], [0.001 * i for i in range(301)]
    for events in (False, True):
        with (
            Stepping3(path, events=events, early=events) as library,
            SteppingComponent(path, events=events, early=events) as wasm,
        ):
            rows, at = library.start().run(times, reals(library, "output"))
            others, also = wasm.start().run(times, reals(wasm, "output"))
            assert difference(rows, others) <= EQUAL
            np.testing.assert_allclose(also, at, rtol=EQUAL, atol=EQUAL)
    with Stepping3(path, "ModelExchange") as library, SteppingComponent(path, "ModelExchange") as wasm:
        assert difference(exchange(library.start(), short), exchange(wasm.start(), short)) <= EQUAL
    assert len(component_of(path)) <= MOST_BYTES


@pytest.mark.fmu
@pytest.mark.slow
def test_the_longest_equations_make_no_larger_component(tmp_path: Path) -> None:
    path = export("whipple_bicycle", tmp_path / "bicycle.fmu", fmi="3.0", platform="wasm", page="static").path
    assert len(component_of(path)) <= MOST_BYTES


@pytest.mark.fmu
@pytest.mark.slow
def test_the_bits_are_those_of_the_library_where_nothing_is_rounded_otherwise(both: Both) -> None:
    """The ball needs no function of a mathematical library: all values and the times of its impacts are equal."""
    path, times = both("bouncing_ball"), [0.01 * i for i in range(301)]
    with (
        Stepping3(path, events=True, early=True) as library,
        SteppingComponent(path, events=True, early=True) as wasm,
    ):
        runs = [stepping.start().run(times, reals(stepping)) for stepping in (library, wasm)]
    assert runs[0] == runs[1]
    assert runs[0][1], "it has impacts"


@pytest.mark.fmu
@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_states_go_from_one_to_the_other(kind: str, both: Both) -> None:
    """A state saved by the component is restored by the library, saved there, and restored by the component."""
    path = both("bouncing_ball")
    with (
        SteppingComponent(path, kind) as wasm,
        Stepping3(path, kind) as library,
        SteppingComponent(path, kind) as third,
    ):
        for stepping in (wasm, library, third):
            stepping.start()
        if kind == "CoSimulation":
            wasm.run([0.0, 0.3, 0.7], ["y"])
        else:
            exchange(wasm, [0.0, 0.3, 0.7])
        saved = bytes(wasm.unit.getFMUState())
        library.unit.setFMUState(library.unit.deserializeFMUState(saved))
        again = library.unit.serializeFMUState(library.unit.getFMUState())
        assert again == saved
        third.unit.setFMUState(again)
        assert bytes(third.unit.getFMUState()) == saved
        assert wasm.get(reals(wasm)) == library.get(reals(library)) == third.get(reals(third))
        with pytest.raises(RuntimeError, match="set-fmu-state: error"):
            third.unit.setFMUState(saved[:-1])
        assert "fmi3DeserializeFMUState" in third.log[-1][2]


@pytest.mark.fmu
@pytest.mark.slow
def test_derivatives_and_dependencies(both: Both) -> None:
    path = both("bouncing_ball")
    with Stepping3(path) as library, SteppingComponent(path) as wasm:
        library.start(), wasm.start()
        y, v, a = (library.references[name] for name in ("y", "y_dot", "y_ddot"))
        for name, seed, count in (("getDirectionalDerivative", [1.0, 2.0], 1), ("getAdjointDerivative", [3.0], 2)):
            found = getattr(library.unit, name)([a], [y, v], seed, count)
            assert getattr(wasm.unit, name)([a], [y, v], seed) == found
        kinds = {"dependent": 5, "constant": 1}
        for name, reference in wasm.references.items():
            listed = [vars(one) for one in wasm.unit.getVariableDependencies(reference)]
            found = [(one["independent-value-reference"], kinds[one["kind"]]) for one in listed]
            assert found == library.dependencies(name)
            assert wasm.unit.getNumberOfVariableDependencies(reference) == len(found)
        assert wasm.unit.getOutputDerivatives([(y, 1), (y, 2)]) == wasm.get(["y_dot", "y_ddot"])


@pytest.mark.fmu
@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_adjoint_derivatives_are_those_of_the_library(model: str, both: Both) -> None:
    """The component finds them column by column; for all knowns, while the start is solved for and afterwards."""
    path, random = both(model), np.random.default_rng(7)
    with Stepping3(path) as library, SteppingComponent(path) as wasm:
        variables = [v for v in library.description.modelVariables if v.type == "Float64"]
        states = {v.derivative.valueReference for v in variables if v.derivative is not None}
        causalities = ("input", "parameter", "independent")
        known = [v.valueReference for v in variables if v.causality in causalities and v.name[:7] != "solver_"]
        known += sorted(states)
        unknown = sorted({v.valueReference for v in variables if v.causality == "output"})
        weights = [float(w) for w in random.normal(size=len(unknown))]
        for enter in ("enterInitializationMode", "exitInitializationMode"):
            getattr(library.unit, enter)(), getattr(wasm.unit, enter)()
            found = np.array(wasm.unit.getAdjointDerivative(unknown, known, weights))
            expected = np.array(library.unit.getAdjointDerivative(unknown, known, weights, len(known)))
            assert np.abs(found - expected).max() <= EQUAL * np.abs(expected).max()
            assert np.abs(expected).max() > 0.1


@pytest.mark.fmu
@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_every_function_of_the_draft_answers(kind: str, both: Both) -> None:
    """Also where nothing is asked for, or the call is illegal: no call ends the component."""
    with SteppingComponent(both("bouncing_ball"), kind) as wasm:
        interface = interfaces()["co-simulation" if kind == "CoSimulation" else "model-exchange"]
        given: dict[Any, Any] = {"bool": False, "f64": 0.0, "value-reference": 0, ("option", "f64"): None}
        given |= {"fmu-state": b"", ("list", "u8"): b""}
        for function in interface.functions[1:]:
            name = function.name.rpartition(".")[2]
            arguments = [given.get(one, []) for one in [*function.parameters.values()][1:]]
            try:
                wasm.unit.call(name, *arguments)
            except RuntimeError:
                assert wasm.log[-1][0] == STATUS.index("error")
                wasm.unit.reset()
        assert wasm.unit.version() == "3.0"


@pytest.mark.fmu
@pytest.mark.slow
def test_who_says_what_is_wrong(both: Both) -> None:
    """A wrong token makes no instance; sentences come with the name of the instance, and with cut letters left out."""
    path, log = both("bouncing_ball"), []
    unit = ComponentUnit(component_of(path), "CoSimulation", log)
    assert not unit.instantiate("ball", "ß" * 4000, "", False, True, False, False, [])
    assert unit.names == ["ball"]
    assert log[0][:2] == (STATUS.index("error"), "logStatusError")
    assert log[0][2].startswith('fmi3Instantiate: the instantiation token is "ßß')
    with SteppingComponent(path) as wasm:
        wasm.start()
        for call in (lambda: wasm.unit.setClock([0], []), lambda: wasm.unit.setInputDerivatives([(0, 1)], [1.0])):
            with pytest.raises(RuntimeError):
                call()
        assert "0 values for 1 clocks" in wasm.log[0][2]
        assert "inputs have no derivatives in FMI 3.0" in wasm.log[1][2]


# ------------------------------------------------------------------------------------------------------------ archives


@pytest.mark.fmu
@pytest.mark.slow
@pytest.mark.slow
def test_an_fmu_that_is_a_component_alone_says_what_it_has(tmp_path: Path) -> None:
    path = export("pendulum", tmp_path / "p.fmu", fmi="3.0", platform="wasm", page="static", without=("sources",)).path
    text = read_text(path, DESCRIPTION)
    assert not [word for word in (*NOT_OFFERED, "intermediateUpdate") if word in text]
    assert 'canSerializeFMUState="true"' in text
    assert check_fmu(path, run=True).findings == ()


@pytest.mark.parametrize(
    ("choices", "sentence"),
    [
        ({"fmi": "2.0"}, "FMI 2.0 has no components for WebAssembly; add --fmi 3.0"),
        ({"profile": "realtime"}, "take memory for what they return, which --profile realtime excludes"),
        ({"compiler": "host"}, "not for 'wasm'; use --compiler zig"),
        ({"fmi": "2.0", "backend": "python"}, "the python backend has no library for 'wasm'"),
    ],
)
def test_choices_that_do_not_go_together(choices: dict[str, str], sentence: str, tmp_path: Path) -> None:
    with pytest.raises((ExportError, BuildError), match=sentence):
        export("pendulum", tmp_path / "p.fmu", **{"fmi": "3.0", "platform": "wasm", **choices})
    assert list(tmp_path.iterdir()) == []


def test_the_c_code_has_the_functions_of_the_draft() -> None:
    assert public_names(["wasm.c"]) == c_names()


def test_a_module_that_needs_more_is_refused() -> None:
    assert imported_pages(memory_module(17)) == 0
    imports = b"\1\3env\7missing\0\0"
    with pytest.raises(BuildError, match="needs 'missing', which WebAssembly does not have"):
        component(MODULE + bytes([2, len(imports)]) + imports)


def test_modules_have_the_functions_of_expressions() -> None:
    names = sorted({"pow"} | {name for name in FUNCTIONS if hasattr(math, name)})
    calls = "".join(f"        {name}(a{', b' * (name in ('atan2', 'pow'))}),\n" for name in names)
    head = "void all(double a, double b, double *values)"
    text = f"#include <math.h>\n{head};\n{head} {{\n"
    text += f"    const double of[] = {{\n{calls}    }};\n"
    text += "    for (int i = 0; i < (int)(sizeof of / sizeof *of); i++)\n        values[i] = of[i];\n}\n"
    assert compile_module({"page.c": text}, ["all"]).startswith(MODULE)
