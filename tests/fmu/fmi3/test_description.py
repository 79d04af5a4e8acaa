"""modelDescription.xml of FMI 3.0: valid by the schema and by fmpy, complete, in the order of the C code."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from chosen import models
from describing import described
from fmpy import read_model_description
from fmpy.validation import validate_fmu

import lag2fmu
from lag2fmu.checking.description import read_document
from lag2fmu.checking.fmi3.description import Description3
from lag2fmu.checking.fmi3.rulebook import FMI3
from lag2fmu.errors import ExportError
from lag2fmu.fmu.versions.fmi3 import to_xml
from lag2fmu.formats.loading import load

KINDS = ["cart_pole", "bouncing_ball", "four_bar_linkage", "dc_motor"]
"""A tree, impacts, constraints with guesses, a further state with switches."""


def read(folder: Path, model: str, **choices: Any) -> tuple[Any, Mapping[str, str], list[str]]:
    """What fmpy reads of the description of ``model``, the C sources, and what fmpy's validation finds."""
    description, sources = described(load(model), **choices)
    (folder / "modelDescription.xml").write_bytes(to_xml(description))
    return read_model_description(str(folder), validate=False), sources, validate_fmu(str(folder))


@pytest.mark.parametrize("arrays", [False, True], ids=["flat", "arrays"])
@pytest.mark.parametrize("outputs", [(), ("all",)], ids=["", "all outputs"])
@pytest.mark.parametrize("model", KINDS)
def test_nothing_is_found(model: str, outputs: tuple[str, ...], arrays: bool, tmp_path: Path) -> None:
    assert read(tmp_path, model, outputs=outputs, fmi="3.0", arrays=arrays)[2] == []


@pytest.mark.all_models
@pytest.mark.parametrize("arrays", [False, True], ids=["flat", "arrays"])
@pytest.mark.parametrize("model", models())
def test_nothing_is_found_in_the_gallery(model: str, arrays: bool, tmp_path: Path) -> None:
    """By fmpy and the schema, and by our own rules on descriptions."""
    assert read(tmp_path, model, outputs=("all",), fmi="3.0", arrays=arrays)[2] == []
    document = read_document((tmp_path / "modelDescription.xml").read_bytes())
    assert [*FMI3.on_description(Description3(document))] == []


@pytest.mark.parametrize("model", KINDS)
def test_the_structure_has_the_order_of_the_c_code(model: str, tmp_path: Path) -> None:
    found, sources, _ = read(tmp_path, model, fmi="3.0")
    mechanism = load(model)
    q = [c.name for c in mechanism.coordinates]
    hidden = ["dissipated_energy"] if mechanism.unilaterals else []
    x = [*q, *(f"{name}_dot" for name in q), *(z.name for z in mechanism.states), *hidden]
    (listed,) = re.findall(r"CONTINUOUS_STATES\[N_CONTINUOUS\] = \{(.*?)\}", sources["tables.c"])
    assert [d.variable.derivative.name for d in found.derivatives] == [x[int(i)] for i in listed.split(",")]
    references = [u.variable.valueReference for u in found.outputs]
    assert references == [v.valueReference for v in found.modelVariables if v.causality == "output" and not v.alias]
    (count,) = re.findall(r"EVENT_NOMINALS\[\] = \{(.*?)\}", sources["tables.c"]) or [""]
    assert len(found.eventIndicators) == len(count.split(", ") if count else ())
    unknowns = (found.outputs, found.derivatives, found.eventIndicators, found.initialUnknowns)
    assert all(unknown.dependencies is not None for kind in unknowns for unknown in kind)


def test_variables_keep_their_names_and_starts(tmp_path: Path) -> None:
    found = {v.name: v for v in read(tmp_path, "cart_pole", fmi="3.0")[0].modelVariables}
    for own in described(load("cart_pole"))[0].variables:
        assert found[own.name].causality == own.causality or own.name.startswith("der_")
        start = found[own.name].start
        assert (None if start is None else float(start)) == own.start


def test_elements_of_arrays_say_what_they_are(tmp_path: Path) -> None:
    found = {v.name: v for v in read(tmp_path, "cart_pole", fmi="3.0", arrays=True)[0].modelVariables}
    assert found["q"].description == "x in m, theta in rad"
    assert found["q"].unit is None
    assert (found["q"].shape, found["q"].start) == ((2,), "0.0 0.5")
    assert found["qd"].derivative is None
    assert found["der_q"].derivative is found["q"]
    assert (found["qdd"].derivative, found["der_qd"].alias) == (found["qd"], found["qdd"])
    assert found["Q"].causality == "input"
    assert "x" not in found


def test_unlike_elements_stay_scalars(tmp_path: Path) -> None:
    """Where constraints determine some coordinates, these have guesses and the others exact starts."""
    found = {v.name: v for v in read(tmp_path, "four_bar_linkage", fmi="3.0", arrays=True)[0].modelVariables}
    assert "q" not in found
    assert found["Q"].shape == (len(load("four_bar_linkage").coordinates),)


def test_an_array_takes_no_name_that_is_in_use(tmp_path: Path) -> None:
    """The charge of the particle is called q."""
    found = read(tmp_path, "charged_particle", fmi="3.0", arrays=True)[0].modelVariables
    assert [v.causality for v in found if v.name == "q"] == ["parameter"]


def test_a_clock_for_each_contact(tmp_path: Path) -> None:
    """Local: such clocks are read in event mode and stand nowhere in ModelStructure (section 2.2.8.3)."""
    found = read(tmp_path, "bouncing_ball", outputs=["all"], fmi="3.0")[0]
    clock = next(v for v in found.modelVariables if v.name == "floor_impact")
    assert (clock.type, clock.causality, clock.intervalVariability) == ("Clock", "local", "triggered")
    assert clock not in [u.variable for u in (*found.outputs, *found.initialUnknowns)]


def test_a_clock_that_is_named_is_an_output(tmp_path: Path) -> None:
    """Its schema has no ``initial``, and it is no unknown at initialization, which only fmpy wants."""
    found, _, problems = read(tmp_path, "bouncing_ball", outputs=["floor_impact"], fmi="3.0")
    clock = next(v for v in found.modelVariables if v.name == "floor_impact")
    assert (clock.type, clock.causality, clock.intervalVariability) == ("Clock", "output", "triggered")
    assert clock in [u.variable for u in found.outputs]
    assert clock not in [u.variable for u in found.initialUnknowns]
    assert [re.findall(r"InitialUnknowns does not|floor_impact", problem) for problem in problems] == [
        ["InitialUnknowns does not", "floor_impact"]
    ]
    with pytest.raises(ExportError, match="--output floor_impact: there is no such variable"):
        lag2fmu.export("bouncing_ball", tmp_path / "x.fmu", outputs=["floor_impact"], fmi="3.0", without=["clocks"])
    with pytest.raises(ExportError, match="--output floor_impact: there is no such variable"):
        described(load("bouncing_ball"), ["floor_impact"])


def test_parameters_are_among_the_dependencies(tmp_path: Path) -> None:
    found = read(tmp_path, "cart_pole", fmi="3.0")[0]
    of = {u.variable.name: {d.name for d in u.dependencies} for u in found.outputs}
    assert of["x_tip"] == {"x", "theta", "l"}
    derivatives = {u.variable.name: u for u in found.derivatives}
    assert {"M", "m", "l", "g", "Q_x"} <= {d.name for d in derivatives["x_ddot"].dependencies}
    assert "time" not in {d.name for d in derivatives["x_ddot"].dependencies}
    assert [d.name for d in derivatives["der_x"].dependencies] == ["x_dot"]
