"""Names and texts of a mechanism that C, XML or an importer could stumble over."""

from __future__ import annotations

import math

import pytest
from archives import awkward_names, xml
from fmpy.fmi1 import FMICallException
from stepping import Stepping

import lag2fmu
from lag2fmu.checking.schema import problems
from lag2fmu.errors import ExportError, MechanismError
from lag2fmu.fmu import Fmu, export, read_mechanism
from lag2fmu.mechanism import Energy, Mechanism, coordinate
from lag2fmu.reference import integrate

pytestmark = pytest.mark.fmu


def test_keywords_unicode_and_long_names(tmp_path) -> None:
    mechanism = awkward_names()
    fmu = export(mechanism, tmp_path / "static.fmu", outputs=("all",))
    assert problems(fmu.path) == []
    assert read_mechanism(fmu.path) == mechanism
    assert xml(fmu).get("modelName") == mechanism.title
    states = ["int", "int_dot", "M_PI", "M_PI_dot"]
    found = lag2fmu.simulate(fmu, stop_time=2.0, step=0.1, tolerance=1e-9, outputs=states)
    expected = integrate(mechanism, found.time, rtol=1e-12).trajectory
    assert found.columns(states) == pytest.approx(expected.columns(states), abs=1e-7)


def test_names_of_128_characters(tmp_path) -> None:
    name = "q" * 118  # the longest name that is generated, der_..._dot, has 128 then
    q = coordinate(name, start=1.0)
    mechanism = Mechanism("m" * 128, coordinates=[q], energy=Energy(kinetic=q.dot**2 / 2, potential=2 * q**2))
    fmu = export(mechanism, tmp_path / "long.fmu")
    assert problems(fmu.path) == []
    assert len(xml(fmu).find("CoSimulation").attrib["modelIdentifier"]) <= 63
    with Stepping(fmu.path) as host:
        assert host.start(tolerance=1e-9).step(1.0)[0] == pytest.approx(math.cos(2.0), abs=1e-7)
        with pytest.raises(FMICallException):
            host.set({name: math.nan})
        assert name in host.sentences[-1]


def test_a_mechanism_without_units(tmp_path) -> None:
    q = coordinate("q", start=0.5)
    mechanism = Mechanism("plain", coordinates=[q], energy=Energy(lagrangian=q.dot**2 / 2 - q**2 / 2))
    fmu = export(mechanism, tmp_path / "plain.fmu")
    assert problems(fmu.path) == []
    units = {v.get("name"): v[0].get("unit") for v in xml(fmu).iter("ScalarVariable")}
    assert units["q"] is units["q_dot"] is units["Q_q"] is None
    with Stepping(fmu.path) as host:
        assert host.start(tolerance=1e-10).step(3.0)[0] == pytest.approx(0.5 * math.cos(3.0), abs=1e-8)


@pytest.mark.parametrize("character", ["\0", "\x07", "\x1b", "\ufffe", "\ud800"])
@pytest.mark.parametrize("place", ["title", "source", "doc"])
def test_characters_that_xml_cannot_hold(place: str, character: str, tmp_path) -> None:
    text = f"before{character}after"
    q = coordinate("q", start=0.5, doc=text if place == "doc" else "")
    texts = {place: text} if place != "doc" else {}

    def build() -> Fmu:
        mechanism = Mechanism("odd", coordinates=[q], energy=Energy(lagrangian=q.dot**2 / 2), **texts)
        return export(mechanism, tmp_path / "odd.fmu")

    with pytest.raises((MechanismError, ExportError), match=place):
        build()
    assert list(tmp_path.iterdir()) == []


def test_white_space_in_texts_survives(tmp_path) -> None:
    q = coordinate("q", start=0.5, doc="two\nlines\tand a tab")
    mechanism = Mechanism("odd", title="a\nb", coordinates=[q], energy=Energy(lagrangian=q.dot**2 / 2))
    fmu = export(mechanism, tmp_path / "odd.fmu")
    assert xml(fmu).get("modelName") == "a\nb"
    assert read_mechanism(fmu.path) == mechanism
