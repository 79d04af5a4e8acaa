"""The file: reproducible bytes, the library inside, modelDescription.xml, names, and paths that cannot be written."""

from __future__ import annotations

import filecmp
import math
import os
import stat
import subprocess
import sys
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from archives import awkward_names, functions_of_fmi, xml
from chosen import models
from describing import described
from elf import Library
from fmpy.fmi1 import FMICallException
from stepping import Stepping, bits

import lag2fmu
from lag2fmu.errors import BuildError, ExportError, LoadError, MechanismError
from lag2fmu.fmu import Fmu, export, read_mechanism
from lag2fmu.fmu.model_description import to_xml
from lag2fmu.formats.loading import bundled, load
from lag2fmu.mechanism import Energy, Mechanism, coordinate, parameter
from lag2fmu.reference import integrate
from lag2fmu.verify.simulate import problems

pytestmark = pytest.mark.fmu
on_linux = pytest.mark.skipif(sys.platform != "linux", reason="reads ELF libraries")

EXPORT = """
import sys, lag2fmu
for model in ("cart_pole", "n_pendulum"):
    lag2fmu.export(lag2fmu.load(model), f"{sys.argv[1]}/{model}.fmu")
"""


def same(one: Path, other: Path) -> bool:
    """Whether both files have the same bytes; pytest would take minutes to show where they differ."""
    return filecmp.cmp(one, other, shallow=False)


def library(fmu: Fmu) -> bytes:
    with zipfile.ZipFile(fmu.path) as archive:
        name, *_ = (name for name in archive.namelist() if name.startswith("binaries/"))
        return archive.read(name)


@pytest.fixture(params=models())
def fmu(request, exported) -> Fmu:
    return exported(request.param)


@pytest.fixture(params=["double_pendulum", "cart_pole", "motion_driven_pendulum", "vertically_driven_pendulum"])
def full(request, exported) -> Fmu:
    """An FMU with all local variables promoted to outputs."""
    return exported(request.param, outputs=("all",))


# ------------------------------------------------------------------------------------------------------- same bytes


@pytest.mark.usefixtures("compiled_anew")
def test_exporting_twice_gives_the_same_bytes(exported, tmp_path) -> None:
    """Also where the solver is chosen and not named."""
    again = export(load("double_pendulum"), tmp_path / "other_name.fmu")
    assert same(again.path, exported("double_pendulum", solver="dopri5").path)


@pytest.mark.parametrize("seed", ["0", "1", "4711"])
def test_the_hash_seed_does_not_matter(seed: str, exported, tmp_path) -> None:
    """The whole file, library included, from another process in another folder."""
    environment = os.environ | {"PYTHONHASHSEED": seed}
    subprocess.run([sys.executable, "-c", EXPORT, str(tmp_path)], env=environment, cwd=tmp_path, check=True)
    for model in ("cart_pole", "n_pendulum"):
        assert same(tmp_path / f"{model}.fmu", exported(model).path)


@pytest.mark.usefixtures("compiled_anew")
@pytest.mark.parametrize(("epoch", "expected"), [("1700000000", "2023-11-14T22:13:20Z"), ("0", "1970-01-01T00:00:00Z")])
def test_source_date_epoch_is_the_only_date(epoch: str, expected: str, exported, tmp_path, monkeypatch) -> None:
    plain = exported("pendulum")
    monkeypatch.setenv("SOURCE_DATE_EPOCH", epoch)
    dated = export(load("pendulum"), tmp_path / "pendulum.fmu")
    assert xml(dated).attrib.pop("generationDateAndTime") == expected
    assert "generationDateAndTime" not in xml(plain).attrib
    assert xml(dated).get("guid") == xml(plain).get("guid")
    assert library(dated) == library(plain)
    assert problems(dated.path) == []


def test_other_mechanisms_and_solvers_have_other_guids(exported) -> None:
    fmus = [
        exported("pendulum"),
        exported("pendulum", solver="rk4"),
        exported("double_pendulum"),
        exported("n_pendulum"),
    ]
    fmus += [exported("n_pendulum", n="2"), exported("pendulum", outputs=("all",))]
    assert len({xml(fmu).get("guid") for fmu in fmus}) == len(fmus)


def test_entries_of_the_archive(fmu: Fmu) -> None:
    with zipfile.ZipFile(fmu.path) as archive:
        entries = archive.infolist()
        assert archive.testzip() is None
    names = [entry.filename for entry in entries]
    assert names == sorted(names)
    assert len(names) == len(set(names))
    assert {"modelDescription.xml", "extra/org.lag2fmu/mechanism.toml", "sources/buildDescription.xml"} < set(names)
    for entry in entries:
        assert entry.date_time == (1980, 1, 1, 0, 0, 0)
        assert entry.compress_type in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
        assert entry.extract_version <= 20
        assert not entry.flag_bits & 0x1, "not encrypted"
    assert stat.S_IMODE(fmu.path.stat().st_mode) == 0o644


# ------------------------------------------------------------------------------------------------------- the library


@on_linux
def test_the_library_shows_the_functions_of_fmi_and_nothing_else(fmu: Fmu) -> None:
    found = Library(library(fmu))
    assert len(functions_of_fmi()) == 44
    assert found.exported == functions_of_fmi()


@on_linux
@pytest.mark.parametrize(("model", "arguments"), [("double_pendulum", {}), ("n_pendulum", {"n": "5"})])
def test_the_library_is_small_and_stripped(model: str, arguments: dict[str, str], exported) -> None:
    data = library(exported(model, **arguments))
    assert len(data) < 100_000
    assert Library(data).stripped


@on_linux
def test_the_library_runs_on_old_systems(fmu: Fmu) -> None:
    found = Library(library(fmu))
    versions = {tuple(map(int, v.removeprefix("GLIBC_").split("."))) for v in found.versions if v.startswith("GLIBC_")}
    assert versions, "the C library is versioned"
    assert max(versions) <= (2, 17)
    assert found.needed <= {"libm.so.6", "libc.so.6", "ld-linux-x86-64.so.2", "ld-linux-aarch64.so.1"}
    assert not found.search_paths


def test_the_library_holds_the_guid_and_no_path_of_this_machine(fmu: Fmu) -> None:
    data = library(fmu)
    assert data.count(xml(fmu).attrib["guid"].encode()) >= 1
    for folder in (str(Path.home()), str(Path(lag2fmu.__file__).parents[1]), "/tmp", "lag2fmu-"):
        assert f"{folder}/".encode() not in data


# --------------------------------------------------------------------------------------------------- modelDescription


def test_fmpy_finds_nothing(fmu: Fmu) -> None:
    assert problems(fmu.path) == []


def test_fmpy_finds_nothing_with_all_outputs(full: Fmu) -> None:
    assert problems(full.path) == []


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_start_values_are_those_of_the_library(kind: str, fmu: Fmu) -> None:
    """Bit for bit, before and after initialization."""
    starts = {
        v.get("name"): v[0].get("start") for v in xml(fmu).iter("ScalarVariable") if v[0].get("start") is not None
    }
    expected = bits([float(text) for text in starts.values()])
    with Stepping(fmu.path, kind) as host:
        assert bits(host.get(list(starts))) == expected
        host.start()
        assert bits(host.get(list(starts))) == expected


def test_awkward_start_values_survive(tmp_path) -> None:
    awkward = {"a": 0.1, "b": 1 / 3, "c": 5e-324, "d": 1.7976931348623157e308, "e": 2.0**53 + 2, "f": -0.0, "g": 1e22}
    parameters = [parameter(name, value) for name, value in awkward.items()]
    x = coordinate("x", start=math.pi, velocity=-math.e)
    mechanism = Mechanism(
        "awkward", coordinates=[x], parameters=parameters, energy=Energy(kinetic=x.dot**2 * (1 + parameters[0]) / 2)
    )
    fmu = export(mechanism, tmp_path / "awkward.fmu")
    with Stepping(fmu.path) as host:
        assert bits(host.get([*awkward, "x", "x_dot"])) == bits([*awkward.values(), math.pi, -math.e])
    assert read_mechanism(fmu.path) == mechanism


def test_units_are_defined_and_used(fmu: Fmu) -> None:
    root = xml(fmu)
    defined = {u.get("name"): {d.get("name") for d in u.iter("DisplayUnit")} for u in root.iter("Unit")}
    used: dict[str | None, set[str | None]] = {}
    for real in root.iter("Real"):
        if real.get("unit") is not None:
            used.setdefault(real.get("unit"), set()).update({real.get("displayUnit")} - {None})
        else:
            assert real.get("displayUnit") is None
    assert used == defined
    for base in root.iter("BaseUnit"):
        assert set(base.attrib) <= {"kg", "m", "s", "A", "K", "mol", "cd", "rad", "factor", "offset"}


def test_units_of_the_cart_pole(exported) -> None:
    root = xml(exported("cart_pole"))
    bases = {u.get("name"): {k: int(e) for k, e in u.find("BaseUnit").attrib.items()} for u in root.iter("Unit")}
    units = {v.get("name"): v[0].get("unit") for v in root.iter("ScalarVariable")}
    expected = {
        "x": {"m": 1},
        "x_dot": {"m": 1, "s": -1},
        "x_ddot": {"m": 1, "s": -2},
        "der_x_dot": {"m": 1, "s": -2},
        "theta": {"rad": 1},
        "der_theta": {"rad": 1, "s": -1},
        "theta_ddot": {"rad": 1, "s": -2},
        "Q_x": {"kg": 1, "m": 1, "s": -2},
        "Q_theta": {"kg": 1, "m": 2, "s": -2},
        "p_x": {"kg": 1, "m": 1, "s": -1},
        "p_theta": {"kg": 1, "m": 2, "s": -1},
        "kinetic_energy": {"kg": 1, "m": 2, "s": -2},
        "external_power": {"kg": 1, "m": 2, "s": -3},
        "I0": {"kg": 1, "m": 2},
        "c": {"kg": 1, "s": -1},
        "time": {"s": 1},
        "solver_step": {"s": 1},
    }
    assert {name: bases[units[name]] for name in expected} == expected
    shown = {d.get("name"): float(d.attrib["factor"]) for d in root.iter("DisplayUnit")}
    assert shown["deg"] == pytest.approx(180 / math.pi, rel=1e-15), "value in deg = factor * value in rad"


def unknowns(root: ET.Element, tag: str) -> dict[int, tuple[list[int], list[str]]]:
    """index -> (dependencies, kinds) of a list in ModelStructure, in its order."""
    found = {}
    for unknown in root.find("ModelStructure").find(tag):
        if "dependencies" not in unknown.attrib:  # on everything
            found[int(unknown.attrib["index"])] = ([], [])
            continue
        dependencies = [int(i) for i in unknown.attrib["dependencies"].split()]
        kinds = unknown.get("dependenciesKind", " ".join(["dependent"] * len(dependencies))).split()
        found[int(unknown.attrib["index"])] = (dependencies, kinds)
        assert len(kinds) == len(dependencies)
        assert dependencies == sorted(set(dependencies))
    return found


@pytest.mark.parametrize("outputs", [(), ("all",)])
@pytest.mark.parametrize("model", bundled())
def test_sets_and_order_of_the_model_structure(model: str, outputs: tuple[str, ...]) -> None:
    """FMI 2.0.5, section 2.2.8, computed anew from the attributes of the variables."""
    mechanism = load(model)
    root = ET.fromstring(to_xml(described(mechanism, outputs)[0]))
    variables = list(root.iter("ScalarVariable"))
    number = {v.get("name"): i for i, v in enumerate(variables, start=1)}
    outs = [i for i, v in enumerate(variables, start=1) if v.get("causality") == "output"]
    derivatives = {
        i: int(v[0].attrib["derivative"]) for i, v in enumerate(variables, start=1) if "derivative" in v[0].attrib
    }
    calculated = {i for i, v in enumerate(variables, start=1) if v.get("initial") in ("calculated", "approx")}
    parameters = {i for i, v in enumerate(variables, start=1) if v.get("causality") == "calculatedParameter"}
    states = set(derivatives.values())

    assert list(unknowns(root, "Outputs")) == outs
    assert list(unknowns(root, "Derivatives")) == sorted(derivatives)
    expected = (set(outs) | states | set(derivatives)) & calculated | parameters
    assert list(unknowns(root, "InitialUnknowns")) == sorted(expected)

    massless = {"x"} if model == "slides_problem_5_small" else set()
    assert {variables[i - 1].get("name") for i in states} == {
        name for q in mechanism.coordinates if q.name not in massless for name in (q.name, f"{q.name}_dot")
    }
    for derivative, state in derivatives.items():
        assert variables[derivative - 1].get("name") == f"der_{variables[state - 1].get('name')}"
    inputs = {number[v.get("name")] for v in variables if v.get("causality") in ("input", "independent")}
    exact = {i for i, v in enumerate(variables, start=1) if v.get("initial") == "exact"}
    for tag, knowns in (
        ("Outputs", inputs | states),
        ("Derivatives", inputs | states),
        ("InitialUnknowns", inputs | exact),
    ):
        for index, (dependencies, kinds) in unknowns(root, tag).items():
            assert set(dependencies) <= knowns, (tag, index)
            if index in states and tag != "InitialUnknowns":
                assert (dependencies, kinds) == ([index], ["constant"])


def test_dependencies_are_what_differences_show(full: Fmu) -> None:
    """What differs from zero somewhere is listed, and what is listed differs from zero somewhere.

    The second half not where terms cancel that the graph keeps apart: with moving supports, and in qd dL/dqd - L.
    """
    exactly = full.mechanism.name in ("double_pendulum", "cart_pole")
    root = xml(full)
    variables = [v.get("name") for v in root.iter("ScalarVariable")]
    generator = np.random.default_rng(2)
    with Stepping(full.path, "ModelExchange") as host:
        host.start()
        listed = unknowns(root, "Outputs") | unknowns(root, "Derivatives")
        inputs = [v.get("name") for v in root.iter("ScalarVariable") if v.get("causality") == "input"]
        knowns = [*host.states_of_derivatives, *inputs, "time"]
        size = np.zeros((len(listed), len(knowns)))
        for _ in range(8):
            host.set({name: generator.uniform(0.2, 1.2) for name in knowns if name != "time"})
            host.unit.setTime(generator.uniform(0.2, 5.0))
            for column, known in enumerate(knowns):
                found = host.derivative([variables[i - 1] for i in listed], {known: 1.0})
                size[:, column] = np.maximum(size[:, column], np.abs(found))
    # what cancels leaves rounding: the largest entries are about 10
    shown = {
        i: {known for known, x in zip(knowns, row, strict=True) if x > 1e-11}
        for i, row in zip(listed, size, strict=True)
    }
    for index, (dependencies, _) in listed.items():
        names = {variables[i - 1] for i in dependencies}
        assert shown[index] <= names, f"{variables[index - 1]} depends on {shown[index] - names} too"
        if exactly and variables[index - 1] != "generalized_energy":
            assert names == shown[index], f"{variables[index - 1]} does not depend on {names - shown[index]}"


def test_the_mechanism_inside_reads_back_equal(fmu: Fmu) -> None:
    assert read_mechanism(fmu.path) == fmu.mechanism


def test_a_file_that_is_no_fmu_of_ours(tmp_path) -> None:
    other = tmp_path / "other.fmu"
    other.write_bytes(b"no archive")
    with pytest.raises(ExportError, match=r"is it an FMU of lag2fmu\?"):
        read_mechanism(other)
    with zipfile.ZipFile(other, "w") as archive:
        archive.writestr("modelDescription.xml", "<x/>")
    with pytest.raises(ExportError, match=r"is it an FMU of lag2fmu\?"):
        read_mechanism(other)
    with pytest.raises(LoadError, match=r"absent.*no such file"):
        read_mechanism(tmp_path / "absent.fmu")


# --------------------------------------------------------------------------------------------------------- promotion


def test_promotion_changes_causality_and_nothing_else(exported) -> None:
    plain, promoted = exported("pendulum"), exported("pendulum", outputs=("theta_ddot", "kinetic_energy"))

    def causality(fmu: Fmu) -> dict[str | None, str | None]:
        return {v.get("name"): v.get("causality") for v in xml(fmu).iter("ScalarVariable")}

    changed = {name for name, value in causality(promoted).items() if causality(plain)[name] != value}
    assert changed == {"theta_ddot", "kinetic_energy"}
    assert {causality(promoted)[name] for name in changed} == {"output"}
    assert list(causality(promoted)) == list(causality(plain))


def test_all_promotes_every_local_that_is_no_derivative(exported) -> None:
    root = xml(exported("pendulum", outputs=("all",)))
    locals_ = {v.get("name") for v in root.iter("ScalarVariable") if v.get("causality") == "local"}
    assert locals_ == {"der_theta", "der_theta_dot"}
    run = lag2fmu.simulate(exported("pendulum", outputs=("all",)), stop_time=0.1)
    assert {"theta_ddot", "p_theta", "total_energy", "external_power"} <= set(run.names)


@pytest.mark.parametrize("name", ["theta_dddot", "", "g", "Q_theta", "time", "der_theta"])
def test_what_cannot_be_promoted(name: str, tmp_path) -> None:
    with pytest.raises(ExportError, match=f"--output {name}:"):
        export(load("pendulum"), tmp_path / "pendulum.fmu", outputs=(name,))
    assert list(tmp_path.iterdir()) == []


def test_promoting_an_output_is_no_error(exported) -> None:
    assert xml(exported("pendulum", outputs=("x", "theta"))).get("guid") == xml(exported("pendulum")).get("guid")


# ------------------------------------------------------------------------------------------------------------- names


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
    assert len(xml(fmu).find("CoSimulation").attrib["modelIdentifier"]) <= 64
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


# -------------------------------------------------------------------------------------------- what cannot be written


@pytest.fixture
def pendulum() -> Mechanism:
    return load("pendulum")


def compiler(folder: Path, script: str) -> str:
    """A compiler that is a shell script."""
    path = folder / "compiler"
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)
    return str(path)


@pytest.fixture
def target(tmp_path) -> Iterator[Path]:
    """A path in an empty folder that must be empty afterwards."""
    folder = tmp_path / "target"
    folder.mkdir()
    yield folder / "pendulum.fmu"
    assert list(folder.iterdir()) == []


needs_shell = pytest.mark.skipif(os.name != "posix", reason="the failing compilers are shell scripts")


@needs_shell
def test_a_failing_compiler(pendulum, target, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("CC", compiler(tmp_path, "echo 'mechanism.c:7: made up' >&2; exit 3"))
    with pytest.raises(BuildError, match=r"exit code 3[\s\S]*mechanism\.c:7: made up"):
        export(pendulum, target, compiler="host")


@needs_shell
def test_a_compiler_that_fails_without_a_word(pendulum, target, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("CC", compiler(tmp_path, "exit 1"))
    with pytest.raises(BuildError, match="failed with exit code 1"):
        export(pendulum, target, compiler="host")


@needs_shell
def test_a_compiler_that_is_killed(pendulum, target, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("CC", compiler(tmp_path, "kill -9 $$"))
    with pytest.raises(BuildError, match="failed with exit code -9"):
        export(pendulum, target, compiler="host")


@needs_shell
def test_a_compiler_that_writes_nothing(pendulum, target, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("CC", compiler(tmp_path, "exit 0"))
    with pytest.raises(BuildError, match="wrote no library"):
        export(pendulum, target, compiler="host")


def test_no_compiler_at_all(pendulum, target, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(BuildError, match=r"no C compiler found; looked for \$CC = no-such-compiler, cc, gcc, clang"):
        export(pendulum, target, compiler="host")


@pytest.mark.parametrize("keyword", [{"compiler": "msvc"}, {"solver": "euler"}])
def test_unknown_compiler_or_solver(pendulum, target, keyword) -> None:
    with pytest.raises((BuildError, ExportError), match=f"unknown {next(iter(keyword))} .*known are"):
        export(pendulum, target, **keyword)


def test_a_failed_export_leaves_the_older_file_alone(pendulum, tmp_path, exported) -> None:
    target = tmp_path / "pendulum.fmu"
    before = exported("pendulum").path.read_bytes()
    target.write_bytes(before)
    with pytest.raises(BuildError):
        export(load("double_pendulum"), target, compiler="msvc")
    assert target.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["pendulum.fmu"]


def test_a_new_export_replaces_the_older_file(tmp_path, exported) -> None:
    target = tmp_path / "pendulum.fmu"
    target.write_bytes(b"older")
    assert same(export(load("pendulum"), target).path, exported("pendulum").path)
    assert [path.name for path in tmp_path.iterdir()] == ["pendulum.fmu"]


@pytest.mark.parametrize(
    ("path", "sentence"),
    [
        ("folder.fmu", "is a folder"),
        ("missing/pendulum.fmu", "does not exist"),
        ("pendulum.zip", "does not end in .fmu"),
        ("pendulum", "does not end in .fmu"),
        ("file/pendulum.fmu", "does not exist"),
    ],
)
def test_paths_that_cannot_be_written(path: str, sentence: str, pendulum, tmp_path) -> None:
    (tmp_path / "folder.fmu").mkdir()
    (tmp_path / "file").write_text("")
    with pytest.raises(ExportError, match=sentence) as caught:
        export(pendulum, tmp_path / path)
    assert str(tmp_path) in str(caught.value)
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["file", "folder.fmu"]


@on_linux
def test_a_folder_that_takes_no_files(pendulum) -> None:
    """/proc takes none even from root."""
    with pytest.raises(ExportError, match=r"cannot write '/proc/pendulum\.fmu'"):
        export(pendulum, "/proc/pendulum.fmu")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_an_unwritable_folder(pendulum, target) -> None:
    target.parent.chmod(0o555)
    try:
        with pytest.raises(ExportError, match="cannot write"):
            export(pendulum, target)
    finally:
        target.parent.chmod(0o755)


@on_linux
@pytest.mark.usefixtures("host_compiler")
def test_the_host_compiler_gives_the_same_motion(exported, tmp_path) -> None:
    """Another compiler and C library: equal to rounding, not to the bit."""
    host_built = export(load("double_pendulum"), tmp_path / "double_pendulum.fmu", compiler="host")
    assert Library(library(host_built)).exported == functions_of_fmi()
    with Stepping(host_built.path) as one, Stepping(exported("double_pendulum").path) as other:
        one.start(tolerance=1e-8)
        other.start(tolerance=1e-8)
        assert one.step(3.0) == pytest.approx(other.step(3.0), rel=1e-10)
