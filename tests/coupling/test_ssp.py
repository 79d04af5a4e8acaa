"""Systems of FMUs as archives: valid, read again by another reader, run by fmpy and by a master of our own."""

from __future__ import annotations

import importlib.metadata
import re
import shutil
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from click.testing import CliRunner
from lxml import etree
from master import Wire, run
from ssp_reader import read_ssp
from stepping import Stepping
from train import CAR, WAGON_ALONE, K, M, W, X, Y

import lag2fmu
from lag2fmu.cli import main
from lag2fmu.description.ports import JOINED
from lag2fmu.errors import ExportError, LoadError
from lag2fmu.systems.components import Component, ComponentTerminal, Connector, LinearUnit
from lag2fmu.systems.connections import connected
from lag2fmu.systems.structure import System, ssd

pytestmark = pytest.mark.fmu

CONNECT = ("wagon.x:cart.y", "cart.f:wagon.F")
VALUES = {f"wagon.{name}": value for name, value in WAGON_ALONE.items()}
SCHEMAS = {"SystemStructure.ssd": "SystemStructureDescription.xsd", ".ssv": "SystemStructureParameterValues.xsd"}


@pytest.fixture(scope="module")
def system(exported, tmp_path_factory) -> Path:
    """Cart and wagon, one FMU under two names."""
    path = tmp_path_factory.mktemp("ssp") / "train.ssp"
    car = exported(CAR)
    return lag2fmu.ssp({"cart": car, "wagon": car}, path, connect=CONNECT, values=VALUES, stop_time=1.0)


def test_another_reader_finds_what_was_asked_for(system: Path) -> None:
    found = read_ssp(system)
    assert found.components == {"cart": "resources/cart.fmu", "wagon": "resources/cart.fmu"}, "one file for both"
    assert found.connections == [(("wagon", "x"), ("cart", "y")), (("cart", "f"), ("wagon", "F"))]
    assert found.connectors["cart", "f"] == ("output", "Real", "N")
    assert found.connectors["wagon", "F"] == ("input", "Real", "N")
    assert found.connectors["cart", "y"] == ("input", "Real", "m")
    assert ("cart", "F") not in found.connectors, "an input that is not connected keeps its start value"
    assert found.units["N"] == {"kg": "1", "m": "1", "s": "-2"}
    assert found.values == {"wagon.m": (W, "kg"), "wagon.k": (0.0, "N/m"), "wagon.x": (Y, "m")}
    assert found.stop_time == 1.0
    assert b'version="1.0"' in found.texts["SystemStructure.ssd"]


def schema_of_fmpy(name: str) -> Path:
    """The schema of SSP 1.0."""
    return Path(fmpy.__file__).parent / "ssp" / "schema" / name


def schema_of_2(name: str) -> Path:
    """The schema of SSP 2.0, from a package that brings it."""
    try:
        files = importlib.metadata.files("pyssp_standard") or ()
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("pyssp_standard is not installed; it brings the schemas of SSP 2.0 ('make test-all' installs it)")
    return next(Path(str(f.locate())) for f in files if f.as_posix().endswith(f"ssp2/{name}"))


@pytest.mark.parametrize("version", ["1.0", "2.0"])
def test_it_is_valid_under_the_schemas(version: str, exported, tmp_path) -> None:
    car = exported(CAR)
    path = lag2fmu.ssp({"cart": car, "wagon": car}, tmp_path / "s.ssp", connect=CONNECT, values=VALUES, version=version)
    for file, text in read_ssp(path).texts.items():
        name = next(schema for ending, schema in SCHEMAS.items() if file.endswith(ending))
        schema = etree.XMLSchema(file=str((schema_of_fmpy if version == "1.0" else schema_of_2)(name)))
        root = etree.fromstring(text)
        assert root.get("version") == version
        schema.assertValid(root)


def test_the_same_bytes_each_time(system: Path, exported, tmp_path) -> None:
    car = exported(CAR)
    again = lag2fmu.ssp(
        {"cart": car, "wagon": car}, tmp_path / "train.ssp", connect=CONNECT, values=VALUES, stop_time=1.0
    )
    assert again.read_bytes() == system.read_bytes()


def exact(times: np.ndarray) -> np.ndarray:
    """The position of the wagon."""
    return (M * X + W * Y - M * (X - Y) * np.cos(np.sqrt(K / M + K / W) * times)) / (M + W)


def test_a_master_runs_what_the_archive_says(system: Path, tmp_path) -> None:
    """With second derivatives of inputs, at 10 ms: as near as docs/coupling.md says."""
    found = read_ssp(system)
    with zipfile.ZipFile(system) as archive:
        archive.extractall(tmp_path)
    with Stepping(tmp_path / found.components["cart"]) as cart, Stepping(tmp_path / found.components["wagon"]) as wagon:
        units = {"cart": cart, "wagon": wagon}
        for name, unit in units.items():
            own = {key.partition(".")[2]: value for key, (value, _) in found.values.items() if key.startswith(name)}
            unit.start(own, tolerance=1e-10)
        wires = [Wire(*source, *target) for source, target in found.connections]
        ends = run(units, wires, 0.01, 100, 2, wires[0])
    assert np.abs(np.array(ends) - exact(np.linspace(0.0, 1.0, 101))).max() < 1e-4


def test_fmpy_runs_it(system: Path) -> None:
    """It holds inputs and is a step late with forces: a hundredth of the motion at 0.2 ms."""
    from fmpy.ssp import ssd
    from fmpy.ssp.simulation import simulate_ssp

    read = ssd.read_ssd(str(system))
    (parameters,) = read.system.parameterBindings[0].parameterValues
    result = simulate_ssp(str(system), stop_time=0.5, step_size=2e-4, parameter_set=parameters)
    assert np.abs(result["wagon.x"] - exact(result["time"] + 2e-4)).max() < 0.01 * (X - Y)


def test_the_command_line_in_the_users_units(exported, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copy(exported(CAR).path, "car.fmu")
    words = [
        "ssp",
        "cart=car.fmu",
        "wagon=car.fmu",
        "-o",
        "train.ssp",
        "--set",
        "wagon.m=2 kg",
        "--set",
        "wagon.k=0.5 N/mm",
    ]
    for word in CONNECT:
        words += ["--connect", word]
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 0, done.output
    assert "wrote train.ssp: 2 components, 2 connections, 2 values" in done.output
    assert read_ssp(Path("train.ssp")).values == {"wagon.m": (2.0, "kg"), "wagon.k": (500.0, "N/m")}
    assert CliRunner().invoke(main, words).exit_code == 2, "an existing file stays"
    assert CliRunner().invoke(main, [*words, "--force"]).exit_code == 0
    wrong = CliRunner().invoke(main, ["simulate", "train.ssp", "--set", "cart.q=1"])
    assert (wrong.exit_code, "set cart.q" in wrong.output, "'cart.q' cannot be set" in wrong.output) == (2, False, True)
    model = CliRunner().invoke(main, ["ssp", "plant=cart_pole", "-o", "plant.ssp"])
    assert (model.exit_code, "write one first: lag2fmu export cart_pole" in model.output) == (2, True)


BAD_CONNECTIONS = {
    "cart.f": "expected COMPONENT.OUTPUT:COMPONENT.INPUT",
    "cart.f:wagon": "'wagon' is no COMPONENT.VARIABLE",
    "cart.f:waggon.F": "there is no component 'waggon'; did you mean 'wagon'",
    "cart.g:wagon.F": "has no variable 'g'; ",
    "cart.f:wagon.x": "cart.f is of causality output and wagon.x of causality output; connect an output with an input",
    "cart.x:wagon.F": "cart.x is in m and wagon.F in N; the dimensions must agree",
    "cart.f:wagon.m": "wagon.m of causality parameter",
    "cart.f:cart.x": "connect an output with an input",
}


@pytest.mark.parametrize(("word", "message"), BAD_CONNECTIONS.items())
def test_connections_that_do_not_fit(word: str, message: str, exported, tmp_path) -> None:
    car = exported(CAR)
    with pytest.raises(LoadError, match=re.escape(message)):
        lag2fmu.ssp({"cart": car, "wagon": car}, tmp_path / "x.ssp", connect=[word])
    assert not list(tmp_path.iterdir())


def test_what_else_is_refused(exported, tmp_path) -> None:
    car, path = exported(CAR), tmp_path / "x.ssp"
    for arguments, message in (
        ({"connect": ["wagon.x:cart.y", "cart.x:cart.y"]}, "the input cart.y is connected already, by wagon.x:cart.y"),
        ({"values": {"wagon.mm": 1.0}}, "--set wagon.mm: that variable does not exist"),
        ({"values": {"m": 1.0}}, "expected COMPONENT.VARIABLE; components are cart, wagon"),
        ({"values": {"wagon.f": 1.0}}, "that variable has no start value"),
        ({"values": {"wagon.m": float("nan")}}, "is not finite"),
        ({"values": {"wagon.m": -1.0}}, "--set wagon.m: -1 is not within the bounds of that variable, [0, inf]"),
        ({"stop_time": -1.0}, "--stop-time -1.0: give a positive number"),
    ):
        with pytest.raises(LoadError, match=re.escape(message)):
            lag2fmu.ssp({"cart": car, "wagon": car}, path, **arguments)
    with pytest.raises(LoadError, match="there is a component 'car' already"):
        lag2fmu.ssp([car, car.path], path)
    with pytest.raises(LoadError, match="cannot name a component"):
        lag2fmu.ssp({"a.b": car}, path)
    with pytest.raises(LoadError, match="no such file"):
        lag2fmu.ssp([tmp_path / "absent.fmu"], path)
    with pytest.raises(LoadError, match="needs an FMU"):
        lag2fmu.ssp([], path)
    with pytest.raises(ExportError, match=r"ends in \.ssp"):
        lag2fmu.ssp([car], tmp_path / "x.zip")
    with pytest.raises(ExportError, match=r"SSP '3\.0' is not written here; 1\.0 and 2\.0 are"):
        lag2fmu.ssp([car], path, version="3.0")
    assert not list(tmp_path.iterdir())


def test_arrays_need_version_2(exported, tmp_path) -> None:
    """An FMU with arrays among its outputs."""
    arrays = exported(CAR, fmi="3.0", arrays=True)
    with pytest.raises(ExportError, match=r"is an array, which SSP 1\.0 does not know; write version 2\.0"):
        lag2fmu.ssp([arrays], tmp_path / "x.ssp")
    run = lag2fmu.simulate(lag2fmu.ssp([arrays], tmp_path / "x.ssp", version="2.0"), stop_time=0.1)
    assert "car.x" in run.names


def component(name: str, causalities: dict[str, str], rule: str = "bus", unit: str = "N") -> Component:
    """A component with one terminal, ``port``, whose members are called as the variables behind the first letter."""
    newton = LinearUnit(unit, (1, 1, -2, 0, 0, 0, 0, 0), 1.0, 0.0)
    connectors = {v: Connector(v, causality, "Real", newton, (), True) for v, causality in causalities.items()}
    terminal = ComponentTerminal(rule, {v[1:]: v for v in causalities}, frozenset({"force"}))
    return Component(name, Path(f"{name}.fmu"), "2.0", "CoSimulation", connectors, {"port": terminal}, None)


def test_terminals_connect_what_belongs_together() -> None:
    """Force in and motion out on one side, the other way round on the other; members of one side only stay free.

    Forces are those on the own mechanism, which are in balance.
    """
    a = component("a", {"aforce": "input", "aplace": "output", "aheat": "output"})
    b = component("b", {"bforce": "output", "bplace": "input"})
    found = connected(["a.port:b.port"], {"a": a, "b": b})
    assert [f"{c.factor:g} {c.source}>{c.target}" for c in found] == ["-1 b.bforce>a.aforce", "1 a.aplace>b.bplace"]


def test_forces_of_terminals_change_sign_in_the_archive(exported, tmp_path) -> None:
    """The terminals of the coordinates of two FMUs give out motion both, and cannot be connected."""
    a, b = component("a", {"aforce": "input"}), component("b", {"bforce": "output"})
    system = System(
        "s", {"a": a, "b": b}, {"a": "x", "b": "y"}, connected(["a.port:b.port"], {"a": a, "b": b}), {}, 1.0
    )
    root = etree.fromstring(ssd(system))
    (transformation,) = root.iter("{http://ssp-standard.org/SSP1/SystemStructureCommon}LinearTransformation")
    assert transformation.get("factor") == "-1.0"
    etree.XMLSchema(file=str(schema_of_fmpy(SCHEMAS["SystemStructure.ssd"]))).assertValid(root)
    car = exported(CAR)
    with pytest.raises(LoadError, match=r"cart\.x is of causality output and wagon\.x of causality output"):
        lag2fmu.ssp({"cart": car, "wagon": car}, tmp_path / "x.ssp", connect=["cart.x:wagon.x"])


@pytest.mark.parametrize(
    ("causalities", "rule", "message"),
    [
        (
            {"bforce": "input", "bplace": "input"},
            "bus",
            "aforce is of causality input and b.bforce of causality input",
        ),
        ({"bheat": "input"}, "bus", "a.port has the members force, place, and b.port has heat"),
        ({"bforce": "output", "bplace": "input"}, "plug", "matches by 'bus', b.port by 'plug'"),
        ({"bforce": "output", "bplace": "input"}, "sequence", "matches by 'bus', b.port by 'sequence'"),
    ],
)
def test_terminals_that_do_not_match(causalities: dict[str, str], rule: str, message: str) -> None:
    a, b = component("a", {"aforce": "input", "aplace": "output"}), component("b", causalities, rule)
    with pytest.raises(LoadError, match=re.escape(message)):
        connected(["a.port:b.port"], {"a": a, "b": b})
    with pytest.raises(LoadError, match=r"a\.port is a terminal; both ends have to be terminals"):
        connected([f"a.port:b.{next(iter(causalities))}"], {"a": a, "b": b})


def test_places_match_what_drives_them_and_are_joined_to_each_other() -> None:
    """By their own rule two places need a joint; what hears a motion and gives a force is connected as to a bus."""
    place = component("a", {"aforce": "input", "aplace": "output"}, JOINED)
    twin = component("b", {"bforce": "input", "bplace": "output"}, JOINED)
    with pytest.raises(LoadError, match=r"both are places, which a joint connects: --join a\.port:b\.port=KIND"):
        connected(["a.port:b.port"], {"a": place, "b": twin})
    drive = component("b", {"bforce": "output", "bplace": "input"})
    assert len(connected(["a.port:b.port"], {"a": place, "b": drive})) == 2
    plug = component("b", {"bforce": "output", "bplace": "input"}, "plug")
    with pytest.raises(LoadError, match=f"the terminal a.port matches by '{JOINED}', b.port by 'plug'"):
        connected(["a.port:b.port"], {"a": place, "b": plug})
