"""Terminals and reference trajectories: valid by their schemas, complete, and true."""

from __future__ import annotations

import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path

import fmpy
import pytest
from click.testing import CliRunner
from lxml import etree

import lag2fmu
from lag2fmu.checking.schema import problems
from lag2fmu.cli import main
from lag2fmu.fmu.materials import BILL_ENTRY
from lag2fmu.reference.trajectory import parse_csv
from lag2fmu.verify.reference_files import reference_files

pytestmark = pytest.mark.fmu

TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"
FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
LAYERED = "{http://fmi-standard.org/fmi-ls-manifest}fmi-ls-"


SCHEMAS = Path(fmpy.__file__).parent / "schema" / "fmi3"


def schema(name: str) -> etree.XMLSchema:
    return etree.XMLSchema(file=str(SCHEMAS / name))


@pytest.mark.parametrize("model", ["double_pendulum", "cart_pole", "furuta_pendulum"])
def test_terminals(model: str, exported) -> None:
    fmu = exported(model)
    with zipfile.ZipFile(fmu.path) as archive:
        data = archive.read(TERMINALS)
    schema("fmi3TerminalsAndIcons.xsd").assertValid(etree.fromstring(data))
    causality = {v.name: v.causality for v in fmu.description.variables}
    found = ET.fromstring(data).findall("Terminals/Terminal")
    assert [t.get("name") for t in found] == [q.name for q in fmu.mechanism.coordinates]
    for terminal in found:
        name = terminal.get("name")
        members = {m.get("memberName"): m.attrib for m in terminal}
        assert {key: m["variableName"] for key, m in members.items()} == {
            "coordinate": name,
            "velocity": f"{name}_dot",
            "force": f"Q_{name}",
        }
        assert [causality[m["variableName"]] for m in members.values()] == ["output", "output", "input"]
        assert [m["variableKind"] for m in members.values()] == ["signal", "signal", "inflow"]


@pytest.fixture(scope="module")
def with_reference(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("reference") / "cart_pole.fmu"
    result = CliRunner().invoke(main, ["export", "cart_pole", "-o", str(path), "--reference"], catch_exceptions=False)
    assert result.exit_code == 0
    return path


def files(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def test_the_manifest_is_valid(with_reference: Path, tmp_path: Path) -> None:
    """By the schema of modelica/fmi-ls-ref; what it includes of FMI 3.0 comes with fmpy."""
    own = Path(__file__).parent / "schemas" / "fmi3LayeredStandardReferenceManifest.xsd"
    for path in (own, *(SCHEMAS / f"fmi3{name}.xsd" for name in ("LayeredStandardManifest", "Annotation"))):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    manifest = etree.fromstring(files(with_reference)[f"{FOLDER}/fmi-ls-manifest.xml"])
    etree.XMLSchema(file=str(tmp_path / own.name)).assertValid(manifest)


def test_the_manifest_names_the_files(with_reference: Path) -> None:
    """FMI-LS-REF 1.0.0-alpha.1."""
    found = files(with_reference)
    root = ET.fromstring(found[f"{FOLDER}/fmi-ls-manifest.xml"])
    assert root.tag == "fmiReferences"
    assert root.get(f"{LAYERED}name") == "org.fmi-standard.fmi-ls-ref"
    assert root.get(f"{LAYERED}version")
    assert root.get(f"{LAYERED}description").startswith("Layered Standard providing information on related files")
    assert [r.get("role") for r in root] == ["experiment/validation", "result", "model"]
    for related in root:
        source = str(related.get("source"))
        name = source.replace("..", "extra", 1) if source.startswith("..") else f"{FOLDER}/{source}"
        assert name in found
    assert "independent" in str(root[1].get("description"))
    assert b"Estimated error" in found["documentation/fmi-ls-ref.txt"]
    assert problems(with_reference) == []


def test_the_remarks_tell_where_columns_are_in_arrays() -> None:
    pendulum = lag2fmu.load("pendulum")
    plain, joined = (reference_files(pendulum, arrays=arrays) for arrays in (False, True))
    remarks = "documentation/fmi-ls-ref.txt"
    assert (
        joined[remarks] == plain[remarks] + b"The columns are elements of the arrays q and qd, whose descriptions "
        b"name them in order.\n"
    )
    assert {name for name in joined if joined[name] != plain[name]} == {remarks}


def test_a_receiver_can_repeat_the_experiment(with_reference: Path) -> None:
    found = files(with_reference)
    root = ET.fromstring(found[f"{FOLDER}/validation.exp"])
    (experiment,) = root
    expected = parse_csv(found[f"{FOLDER}/{experiment.find('References').get('source')}"].decode())
    step, stop = float(experiment.get("stepSize")), float(experiment.get("stopTime"))
    run = lag2fmu.simulate(with_reference, stop_time=stop, step=step, tolerance=1e-9, outputs=list(expected.names))
    assert run.time == pytest.approx(expected.time)
    assert run.columns(expected.names) == pytest.approx(expected.columns(expected.names), abs=1e-5)


def test_the_reference_leaves_the_fmu_as_it_is(with_reference: Path, exported) -> None:
    """All but its bill of materials, which lists what is added."""
    plain, more = files(exported("cart_pole", without=()).path), files(with_reference)
    assert {name for name in plain if more[name] != plain[name]} == {BILL_ENTRY}
    assert len(more) == len(plain) + 4
