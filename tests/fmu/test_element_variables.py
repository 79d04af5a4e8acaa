"""Variables that are not Real: modes and counts of contacts, stops and dry frictions, and their discrete impulses."""

from __future__ import annotations

import struct
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from describing import described
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

from lag2fmu.checking import check_fmu
from lag2fmu.checking.schema import problems
from lag2fmu.errors import ExportError
from lag2fmu.fmu import Fmu, export
from lag2fmu.fmu.materials import BILL_ENTRY
from lag2fmu.fmu.versions.fmi2 import to_xml
from lag2fmu.formats.loading import load
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Mechanism
from lag2fmu.reference import Trajectory
from lag2fmu.verify.plots import motion_figure
from lag2fmu.verify.simulate import Run, simulate_fmu

pytestmark = pytest.mark.fmu

OPEN, STICKS, SLIDES_BACKWARD = 1, 2, 5
TEXT = """
[mechanism]
name = "held"
[parameters]
m = { value = 1.0, unit = "kg" }
l = { value = 1.0, unit = "m" }
T = { value = 100.0, unit = "N.m" }
g = { value = 9.81, unit = "m/s2" }
[coordinates]
theta = { unit = "rad", start = 0.5 }
[gravity]
acceleration = "g"
[bodies.bob]
mass = "m"
position = ["l*sin(theta)", "-l*cos(theta)"]
[contacts.floor]
gap = "2*l - l*cos(theta)"
[stops.wall]
of = "theta"
lower = -1
[frictions.bearing]
on = "theta_dot"
force = "T"
"""
"""A pendulum that its bearing holds, over a floor and beside a wall that it never touches."""
PROMOTED = ("bearing_mode", "floor_impacts", "floor_impulse", "p_theta")


def held() -> Mechanism:
    return read(TEXT, "held.toml")


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Fmu:
    return export(held(), tmp_path_factory.mktemp("fmu") / "held.fmu", solver="dopri5", outputs=PROMOTED)


@pytest.fixture
def slave(fmu: Fmu, tmp_path: Path) -> Iterator[FMU2Slave]:
    extract(str(fmu.path), str(tmp_path))
    description = read_model_description(str(fmu.path), validate=False)
    slave = FMU2Slave(
        guid=description.guid,
        unzipDirectory=str(tmp_path),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="slave",
    )
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    yield slave
    slave.freeInstance()


def references(fmu: Fmu) -> dict[str, int]:
    return {v.name: v.value_reference for v in fmu.description.variables}


def test_types_in_the_description() -> None:
    """FMI 2.0.5: TypeDefinitions (2.2.3), ScalarVariables (2.2.7); only outputs stand in ModelStructure (2.2.8)."""
    root = ET.fromstring(to_xml(described(held(), ["bearing_mode", "floor_impulse"])[0]))
    items = {i.get("name"): i.get("value") for i in root.findall("TypeDefinitions/SimpleType/Enumeration/Item")}
    names = ("open", "sticks", "slides", "slides_forward", "slides_backward")
    assert items == {name: str(value) for value, name in enumerate(names, start=1)}
    variables = {v.get("name"): v for v in root.findall("ModelVariables/ScalarVariable")}
    declared = root.find("TypeDefinitions/SimpleType").get("name")
    for name in ("floor_mode", "wall_lower_mode", "bearing_mode"):
        assert variables[name].find("Enumeration").attrib == {"declaredType": declared}
    for name in ("floor_impacts", "wall_lower_impacts"):
        assert variables[name].find("Integer").attrib == {"min": "0"}
    assert variables["floor_impulse"].find("Real").get("unit") == "kg.m/s"
    assert variables["wall_lower_impulse"].find("Real").get("unit") == "N.m.s"
    discrete = {name for name, v in variables.items() if v.get("variability") == "discrete"}
    assert discrete == {f"{n}_{of}" for n in ("floor", "wall_lower") for of in ("mode", "impacts", "impulse")} | {
        "bearing_mode"
    }
    assert {v.get("initial") for name, v in variables.items() if name in discrete} == {"calculated"}
    index = {name: str(i) for i, name in enumerate(variables, start=1)}
    for group in ("Outputs", "InitialUnknowns"):
        listed = {u.get("index"): u.attrib for u in root.findall(f"ModelStructure/{group}/Unknown")}
        assert listed[index["bearing_mode"]] == {"index": index["bearing_mode"]}  # it may depend on everything
        assert listed[index["floor_impulse"]] == {"index": index["floor_impulse"]}
        assert index["floor_mode"] not in listed


def test_an_fmu_with_them_keeps_the_rules(fmu: Fmu) -> None:
    assert problems(fmu.path) == []
    assert check_fmu(fmu.path).findings == ()


def test_the_value_of_no_item_is_found(fmu: Fmu, tmp_path: Path) -> None:
    with zipfile.ZipFile(fmu.path) as archive:
        files = {name: archive.read(name) for name in archive.namelist() if name != BILL_ENTRY}
    text = files["modelDescription.xml"].decode()
    files["modelDescription.xml"] = text.replace('name="sticks" value="2"', 'name="sticks" value="9"').encode()
    with zipfile.ZipFile(tmp_path / "x.fmu", "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    found = check_fmu(tmp_path / "x.fmu").findings
    assert {f.rule for f in found} == {"enumeration-value"}
    assert all(f.problem.startswith("'bearing_mode' is 2 at t = ") for f in found)


def test_a_run_records_them(fmu: Fmu) -> None:
    names = ["theta", *PROMOTED]
    run = simulate_fmu(fmu.path, Run(stop_time=0.1, step=0.01, outputs=names))
    assert run.names == tuple(names)
    assert (run.columns(PROMOTED[:3]) == [STICKS, 0, 0]).all()
    assert run["theta"][0] == 0.5
    default = simulate_fmu(fmu.path, Run(stop_time=0.1, step=0.01))
    assert set(PROMOTED) <= set(default.names)
    other = simulate_fmu(fmu.path, Run(stop_time=0.1, step=0.01, outputs=names, kind="model-exchange"))
    np.testing.assert_allclose(other.values, run.values, rtol=1e-4, atol=1e-4)
    assert run.to_csv().splitlines()[-1].split(",")[2:5] == ["2.0", "0.0", "0.0"]


def test_each_type_has_its_functions(fmu: Fmu, slave: FMU2Slave) -> None:
    """Reading by the function of another type and setting are refused with a sentence each."""
    known = references(fmu)
    integers = [known[n] for n in ("floor_mode", "wall_lower_mode", "bearing_mode", "floor_impacts")]
    assert slave.getInteger(integers) == [OPEN, OPEN, STICKS, 0]
    assert slave.getReal([known["floor_impulse"]]) == [0.0]
    for call, arguments in (
        (slave.getReal, [[known["floor_mode"]]]),
        (slave.setReal, [[known["floor_impacts"]], [1.0]]),
        (slave.setInteger, [[known["floor_impacts"]], [1]]),
        (slave.setInteger, [[known["floor_mode"]], [2]]),
        (slave.getInteger, [[known["theta"]]]),
        (slave.getInteger, [[10_000]]),
        (slave.setReal, [[known["floor_impulse"]], [1.0]]),
        (slave.getDirectionalDerivative, [[known["floor_mode"]], [known["theta"]], [1.0]]),
    ):
        saved = slave.getFMUState()
        with pytest.raises(Exception, match="failed with status 3"):
            call(*arguments)
        slave.setFMUState(saved)
        slave.freeFMUState(saved)


def test_an_impulse_does_not_change_between_events(fmu: Fmu, slave: FMU2Slave) -> None:
    known = references(fmu)
    slave.exitInitializationMode()
    which = [known["floor_impulse"], known["p_theta"]]
    assert slave.getDirectionalDerivative(which, [known["theta_dot"]], [1.0]) == [0.0, 1.0]
    slave.doStep(0.0, 0.01)
    assert slave.getRealOutputDerivatives([known["floor_impulse"]], [1]) == [0.0]


def hashed(data: bytes) -> int:
    """64-bit FNV-1a, as in saved_state.c."""
    value = 0xCBF29CE484222325
    for byte in data:
        value = (value ^ byte) * 0x100000001B3 % 2**64
    return value


def test_modes_are_part_of_the_state_and_checked(fmu: Fmu, slave: FMU2Slave) -> None:
    """A serialized state brings its modes and counts back; one with a mode that cannot be is refused."""
    known = references(fmu)
    integers = [known[n] for n in ("floor_mode", "wall_lower_mode", "bearing_mode", "floor_impacts")]
    slave.exitInitializationMode()
    saved = slave.getFMUState()
    data = slave.serializeFMUState(saved)
    fresh = struct.pack("<7q", OPEN, OPEN, STICKS, 0, 0, 0, 0)  # modes, counts, impulses
    place = data.index(fresh)
    assert data.count(fresh) == 1

    def altered(*modes: int, impacts: int) -> bytes:
        new = data[:place] + struct.pack("<5q2d", *modes, impacts, 0, 0.25, 0.0) + data[place + len(fresh) :]
        return new[:32] + struct.pack("<Q", hashed(new[40:])) + new[40:]

    other = slave.deserializeFMUState(altered(SLIDES_BACKWARD, OPEN, SLIDES_BACKWARD, impacts=3))
    slave.setFMUState(other)
    assert slave.getInteger(integers) == [SLIDES_BACKWARD, OPEN, SLIDES_BACKWARD, 3]
    assert slave.getReal([known["floor_impulse"]]) == [0.25]
    for wrong in (
        altered(6, OPEN, STICKS, impacts=0),
        altered(0, OPEN, STICKS, impacts=0),
        altered(OPEN, OPEN, OPEN, impacts=0),  # a dry friction is never open
        altered(OPEN, OPEN, STICKS, impacts=-1),
    ):
        with pytest.raises(Exception, match="failed with status 3"):
            slave.deserializeFMUState(wrong)
    slave.setFMUState(saved)
    assert slave.getInteger(integers) == [OPEN, OPEN, STICKS, 0]
    slave.reset()
    assert slave.getInteger(integers) == [OPEN, OPEN, STICKS, 0]


def test_the_documentation_tells_what_the_values_mean(fmu: Fmu) -> None:
    with zipfile.ZipFile(fmu.path) as archive:
        page = archive.read("documentation/index.html").decode()
    assert "how floor holds (1: open, 2: sticks, 3: slides, 4: slides_forward, 5: slides_backward)" in page
    assert "number of impacts of wall_lower since the start" in page


def test_the_python_backend_refuses_them(tmp_path: Path) -> None:
    with pytest.raises(ExportError, match=r"'held': .* without constraints and events, .*; use --backend c"):
        export(held(), tmp_path / "x.fmu", backend="python")
    assert not list(tmp_path.iterdir())


def test_modes_are_drawn_as_steps() -> None:
    """A mode keeps its value until the next time; its axis names the modes."""
    time = np.linspace(0.0, 1.0, 5)
    modes = [OPEN, OPEN, STICKS, STICKS, SLIDES_BACKWARD]
    columns = dict.fromkeys(("theta", "theta_dot"), np.zeros(5)) | {"floor_mode": modes}
    figure = motion_figure("x", Trajectory.of(time, columns), held())
    (axes,) = [a for a in figure.axes if a.get_title() == "modes"]
    (line,) = axes.get_lines()
    assert line.get_drawstyle() == "steps-post"
    assert list(line.get_ydata()) == modes
    assert [t.get_text() for t in axes.get_yticklabels()][:2] == ["open", "sticks"]


def test_mechanisms_without_elements_have_none() -> None:
    description, sources = described(load("pendulum"))
    assert b"TypeDefinitions" not in to_xml(description)
    for name in ("mechanism.h", "mechanism.c", "tables.c"):
        assert "ELEMENT" not in sources[name]
        assert "UNILATERAL" not in sources[name]
