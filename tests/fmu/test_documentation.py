"""The documentation in an FMU: a page that stands on its own, licences, an icon."""

from __future__ import annotations

import re
import struct
import zipfile
from functools import partial
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import pytest
from archives import awkward_names

from lag2fmu import derive, load
from lag2fmu.fmu import Fmu, export
from lag2fmu.fmu import documentation as module
from lag2fmu.fmu.backends.native import fmi_headers
from lag2fmu.mechanism import Energy, Mechanism, coordinate

ROOT = Path(__file__).parents[2]
VOID = {"meta"}

pytestmark = pytest.mark.fmu


@pytest.fixture
def exported(exported):
    """FMUs with the equations on their pages."""
    return partial(exported, without=())


class Page(HTMLParser):
    """Collects the text and the links, and insists that every element is closed."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.text, self.links = "", []
        self.tags: set[str] = set()
        self.feed(html)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.links += [str(value) for name, value in attrs if name in ("href", "src")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def entry(fmu: Fmu, name: str) -> bytes:
    with zipfile.ZipFile(fmu.path) as archive:
        return archive.read(name)


def page(fmu: Fmu) -> Page:
    return Page(entry(fmu, "documentation/index.html").decode("utf-8"))


@pytest.mark.parametrize("model", ["double_pendulum", "motion_driven_pendulum", "six_axis_arm"])
def test_the_page_stands_on_its_own(model: str, exported) -> None:
    found = page(exported(model))
    assert found.links == ["licenses/license.txt"]
    assert not found.tags & {"script", "img", "link", "iframe", "object"}
    assert exported(model).mechanism.title in found.text
    assert "{{" not in found.text
    assert "{%" not in found.text
    with zipfile.ZipFile(exported(model).path) as archive:
        assert "documentation/licenses/license.txt" in archive.namelist()


@pytest.mark.parametrize("model", ["double_pendulum", "cart_pole", "six_axis_arm"])
def test_every_variable_is_in_the_nomenclature(model: str, exported) -> None:
    text = page(exported(model)).text
    for variable in exported(model).description.variables:
        if variable.derivative_of is None and variable.causality != "independent":
            assert variable.name in text
            assert variable.doc in text


@pytest.mark.parametrize("model", ["double_pendulum", "cart_pole", "six_axis_arm", "four_bar_linkage"])
def test_the_sketch_is_in_the_page(model: str, exported) -> None:
    html = entry(exported(model), "documentation/index.html").decode("utf-8")
    (text,) = re.findall(r"<svg.*?</svg>", html, re.DOTALL)
    assert len(text) < 60_000
    svg = ElementTree.fromstring(text)
    assert svg.findtext("{*}title") == exported(model).mechanism.title
    _, _, width, height = map(float, svg.attrib["viewBox"].split())
    assert width > 20
    assert height > 10
    assert len(svg.findall("{*}path")) > 5
    names = {label.text for label in svg.findall("{*}text")}
    assert {body.name for body in exported(model).mechanism.bodies} <= names


def test_without_bodies_there_is_no_sketch(exported) -> None:
    assert "svg" not in page(exported("wilberforce_pendulum")).tags


def test_small_mechanisms_have_formulas(exported) -> None:
    found = page(exported("double_pendulum"))
    assert "math" in found.tags
    assert found.text.count(r"\[ ") == found.text.count(r" \]") == 5
    assert "l_{1} l_{2} m_{2}" in found.text


def test_forces_of_contacts_stand_in_the_equations_with_their_laws(exported) -> None:
    """The rope of the crane pulls on all three coordinates, and its law and those of the stops are told."""
    found = page(exported("crane"))
    assert found.text.count(r"\mathrm{rope}_{\mathrm{force}}") == 3
    for sentence in ("contact rope: gap and force", "stop end_lower: gap and force", "stop end_upper: gap and force"):
        assert sentence in found.text


def test_a_page_of_many_contacts_stays_short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_LAWS", 2)
    laws = module._laws(derive(load("crane")))
    assert [bool(group) for _, group in laws] == [False, True, False]
    assert laws[-1][0] == "and more, which are not written out here"


def test_long_formulas_of_laws_are_not_written_out(monkeypatch: pytest.MonkeyPatch) -> None:
    equations = derive(load("crane"))
    ((sentence, formulas),) = [law for law in module._laws(equations) if "rope" in law[0]]
    monkeypatch.setattr(module, "MOST_SYMBOLS", 5)
    (left_out,) = [law for law in module._laws(equations) if "rope" in law[0]]
    assert len(formulas) == 1
    assert left_out == (f"{sentence}; 17 symbols are not written out", ())


def test_large_mechanisms_have_their_structure(exported) -> None:
    found = page(exported("six_axis_arm"))
    assert "math" not in found.tags
    assert "36 of 36" in re.sub(r"\s+", " ", found.text)
    assert "operations of the accelerations" in found.text


def test_uncoupled_coordinates_are_blocks(tmp_path) -> None:
    """20 uncoupled oscillators with a stiffness that is no short formula."""
    q = [coordinate(f"q{i}") for i in range(20)]
    energy = Energy(kinetic=sum(x.dot**2 for x in q) / 2, potential=sum((1 + x) ** 9 * (2 + x) ** 9 for x in q))
    fmu = export(Mechanism("many", coordinates=q, energy=energy), tmp_path / "many.fmu")
    assert "blocks of coordinates that M couples20" in page(fmu).text


def test_awkward_texts_are_escaped(tmp_path) -> None:
    mechanism = awkward_names()
    text = page(export(mechanism, tmp_path / "static.fmu")).text
    assert mechanism.title in text
    assert mechanism.source in text
    assert "\u00b5 & <b> */" in text


def test_licences(exported) -> None:
    text = " ".join(entry(exported("pendulum"), "documentation/licenses/license.txt").decode().split())
    assert " ".join((ROOT / "LICENSE").read_text("utf-8").split()) in text
    header = (fmi_headers() / "fmi2Functions.h").read_text("utf-8")
    licence = header[header.index("Copyright (C)") : header.index("*/", header.index("Copyright (C)"))]
    assert " ".join(licence.split()) in text


def test_the_icon_is_a_small_picture(exported) -> None:
    data = entry(exported("pendulum"), "model.png")
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">2I", data[16:24]) == (100, 100)
    assert len(data) < 10_000


@pytest.mark.usefixtures("host_compiler")
def test_the_host_compiler_is_named(tmp_path, exported) -> None:
    from lag2fmu.formats.loading import load

    fmu = export(load("pendulum"), tmp_path / "pendulum.fmu", compiler="host")
    assert "built by the compiler of one machine" in page(fmu).text
    assert "glibc 2.17 or newer" in page(exported("pendulum")).text


def test_the_page_tells_what_is_conserved_and_the_modes(exported) -> None:
    text = entry(exported("double_pendulum"), "documentation/index.html").decode("utf-8")
    assert "Conserved quantities, equilibrium and modes" in text
    assert "generalized_energy: energy T + V." in text
    assert "mode 2: 5.78735 rad/s" in text
