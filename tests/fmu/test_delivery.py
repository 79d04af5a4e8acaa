"""What an FMU shows to those who receive it: who is behind it, its icon, and what was left out of it."""

from __future__ import annotations

import io
import xml.etree.ElementTree as ET
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from describing import described
from PIL import Image

import lag2fmu
from lag2fmu.analysis.at_rest import resting
from lag2fmu.checking.schema import problems
from lag2fmu.errors import ExportError
from lag2fmu.fmu.icon import icon
from lag2fmu.fmu.picture import scene_at_start
from lag2fmu.fmu.versions import VERSIONS
from lag2fmu.formats.loading import load
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.language.writer import without_dust
from lag2fmu.mechanism import Body, Mechanism, Part, coordinate, parameter, signal
from lag2fmu.mechanism.record import complete
from lag2fmu.picture.scene import Scene, Stroke
from lag2fmu.procedure.steps import procedure

IMPRINT = {
    "author": "A. Lovelace & 'C. Babbage'",
    "version": "1.2",
    "copyright": "\u00a9 2026 Analytical Society <London>",
    "license": "BSD-3-Clause",
}
PAGE, ICON = "documentation/index.html", "model.png"


def signed() -> Mechanism:
    return complete(replace(load("pendulum").description, **IMPRINT))


def test_the_imprint_is_kept_in_text() -> None:
    text = write(signed())
    assert 'license = "BSD-3-Clause"' in text
    assert read(text, "here").imprint == IMPRINT
    assert read(text, "here") == signed()
    assert load("pendulum").imprint == {}
    assert "license" not in write(load("pendulum"))


@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
def test_the_imprint_is_in_the_xml_of_both_versions(fmi: str) -> None:
    description, _ = described(signed(), fmi=fmi)
    root = ET.fromstring(VERSIONS[fmi].to_xml(description))
    assert {word: root.get(word) for word in IMPRINT} == IMPRINT
    plain, _ = described(load("pendulum"), fmi=fmi)
    assert not {*IMPRINT} & {*ET.fromstring(VERSIONS[fmi].to_xml(plain)).attrib}


def test_show_says_who_is_behind_it() -> None:
    text = procedure(signed())
    assert "author: A. Lovelace" in text
    assert "version: 1.2" in text


def test_characters_that_no_xml_holds_are_refused(tmp_path) -> None:
    broken = complete(replace(load("pendulum").description, author="A\x00B"))
    with pytest.raises(ExportError, match="author: the character"):
        lag2fmu.export(broken, tmp_path / "x.fmu")


def test_the_icon_is_the_sketch() -> None:
    """The bob of a pendulum hangs low, and another model looks different."""
    scene = scene_at_start(lag2fmu.derive(load("pendulum")))
    pixels = np.asarray(Image.open(io.BytesIO(icon(scene))).convert("RGB")).astype(int)
    assert pixels.shape == (100, 100, 3)
    blue = (pixels[..., 2] - pixels[..., 0] > 60).nonzero()
    assert blue[0].size > 5
    assert blue[0].mean() > 80, "the bob is low"
    other = icon(scene_at_start(lag2fmu.derive(load("four_bar_linkage"))))
    assert other != icon(scene)
    assert icon(scene) == icon(scene), "the same bytes"
    assert icon(None)[:4] == b"\x89PNG"


def test_an_area_in_the_icon_is_filled_and_a_line_is_not() -> None:
    """A notched plate: its colour in it, the white of the ground in its notch and beside a line."""
    plate = ((0.0, 0.0), (30.0, 0.0), (30.0, 30.0), (15.0, 8.0), (0.0, 30.0), (0.0, 0.0))
    line = ((0.0, 40.0), (30.0, 40.0))
    scene = Scene("", (Stroke("", "shape", plate), Stroke("", "link", line)), (), (), (0.0, 0.0, 30.0, 40.0), 1.0)
    image = Image.open(io.BytesIO(icon(scene)))

    def at(x: float, y: float) -> str:
        column, row = round(50 + 92 / 40 * (x - 15)), round(50 - 92 / 40 * (y - 20))
        return "#" + bytes(image.getpixel((column, row))).hex()

    assert [at(15, 4), at(3, 20), at(27, 20)] == ["#cfdfec"] * 3
    assert [at(15, 20), at(15, 35), at(-4, 4)] == ["#ffffff"] * 3
    assert at(15, 40) not in ("#cfdfec", "#ffffff")


@pytest.mark.fmu
@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
def test_what_is_left_out(fmi: str, tmp_path, exported) -> None:
    whole = exported("pendulum", solver="dopri5", fmi=fmi, without=())
    words = ("sources", "equations", "description")
    part = lag2fmu.export("pendulum", tmp_path / "part.fmu", solver="dopri5", fmi=fmi, without=words)
    with zipfile.ZipFile(whole.path) as one, zipfile.ZipFile(part.path) as other:
        missing = {*one.namelist()} - {*other.namelist()}
        assert {*other.namelist()} < {*one.namelist()}
        page, shorter = (archive.read(PAGE).decode() for archive in (one, other))
    assert all(name.startswith("sources/") or name.endswith("mechanism.toml") for name in missing)
    assert "extra/org.lag2fmu/mechanism.toml" in missing
    assert any(name.startswith("sources/") for name in missing)
    for text in ("<math", "Conserved quantities", "sources/", "mechanism.toml"):
        assert text in page
        assert text not in shorter
    assert problems(part.path) == []
    ends = [lag2fmu.simulate(path, stop_time=0.1)["theta"][-1] for path in (part.path, whole.path)]
    assert ends[0] == ends[1]
    with pytest.raises(ExportError, match=r"carries no mechanism: .* exported with --without description"):
        lag2fmu.validate(part.path)


def test_an_unknown_word_and_the_python_backend_are_refused(tmp_path) -> None:
    with pytest.raises(ExportError, match="--without source: known are sources, equations, description"):
        lag2fmu.export("pendulum", tmp_path / "x.fmu", without=["source"])
    with pytest.raises(ExportError, match=r"runs its equations from resources/"):
        lag2fmu.export("pendulum", tmp_path / "x.fmu", backend="python", without=["equations"])
    assert not list(tmp_path.iterdir())


def bounds(mechanism: Mechanism) -> dict[str, tuple[float | None, float | None, float | None]]:
    """{name: (min, max, nominal)} of parameters and inputs."""
    description, _ = described(mechanism)
    wanted = ("parameter", "input")
    return {v.name: (v.minimum, v.maximum, v.nominal) for v in description.variables if v.causality in wanted}


def test_masses_and_inertias_have_a_least_value() -> None:
    """Also those of parts; a length that may point the other way and a stiffness have none."""
    found = bounds(load("double_pendulum"))
    assert found["m1"][0] == 0.0
    assert found["l1"][0] is None
    assert bounds(load("acrobot"))["I1"][0] == 0.0
    assert bounds(load("andrews_squeezer"))["l0"][0] == 0.0, "the length of its spring"
    assert bounds(load("elastic_pendulum"))["k"][0] is None
    x, m = coordinate("x", "m"), parameter("m", 2.0, "kg")
    plate = Mechanism("plate", coordinates=[x], parameters=[m], bodies=[Body("plate", m, (x, 0))])
    whole = bounds(Mechanism("two", parts=[Part("left", plate), Part("right", plate)]))
    assert whole["left_m"][0] == whole["right_m"][0] == 0.0


def test_a_given_bound_stays_and_ranges_give_nominal_values() -> None:
    x = coordinate("x", "m")
    m = parameter("m", 2.0, "kg", minimum=0.5, maximum=4.5)
    F = signal("F", "kN", minimum=-3.0, maximum=1.0)
    found = bounds(Mechanism("cart", coordinates=[x], parameters=[m], inputs=[F], bodies=[Body("b", m, (x, 0))]))
    assert found["m"] == (0.5, 4.5, 2.0)
    assert found["F"] == (-3000.0, 1000.0, 2000.0)


@pytest.mark.parametrize(
    ("x", "size", "clean"),
    [
        (15.000000000000002, 1.0, 15.0),
        (0.0049050000000000005, 1.0, 0.004905),
        (-1.1e-17, 1.0, 0.0),
        (-1.1e-17, 1e-9, -1.1e-17),
        (1.5707963267948966, 1.0, 1.5707963267948966),
        (1.000000000001, 1.0, 1.000000000001),
        (1e-12, 1.0, 1e-12),
        (0.1 + 0.2, 1.0, 0.3),
        (0.0, 1.0, 0.0),
    ],
)
def test_dust_is_no_more_than_four_roundings(x: float, size: float, clean: float) -> None:
    assert without_dust(x, size) == clean
    assert abs(without_dust(x, size) - x) <= 4 * np.finfo(float).eps * max(abs(x), size)


def test_computed_starts_have_no_dust_and_given_ones_stay() -> None:
    """What the user typed in centimetres is what stands in the XML; what constraints give is rounded to what it is."""
    found = {v.name: v.start for v in described(load("sphere_on_turntable"))[0].variables}
    assert found["e1_dot"] == 15.0
    velocities = [v.start for v in described(load("whipple_bicycle"))[0].variables if v.name.endswith("_dot")]
    assert not [x for x in velocities if x is not None and 0 < abs(x) < 1e-12]
    given = [
        coordinate("x", "cm", start=30.0),
        coordinate("y", "m", start=0.1 + 0.2),
        coordinate("z", "deg", start=0.1),
    ]
    mechanism = Mechanism("three", coordinates=given, bodies=[Body("b", 1.0, tuple(given))])
    starts = {v.name: v.start for v in described(mechanism)[0].variables if v.start is not None}
    assert starts["x"] == 0.3
    assert starts["y"] == 0.1 + 0.2, "this is what was given"
    assert [q.start for q in resting(load("elastic_pendulum")).coordinates] == [0.0981, 0.0]
