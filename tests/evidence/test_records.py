"""``lag2fmu record``: the files of a record, the verdicts of tools, and what is refused."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from click.testing import CliRunner

from lag2fmu.cli import main
from lag2fmu.errors import ExportError, SimulationError
from lag2fmu.evidence import checks
from lag2fmu.evidence.importers import IMPORTERS, Importer, run_by
from lag2fmu.evidence.recording import record
from lag2fmu.fmu import export
from lag2fmu.formats.loading import load
from lag2fmu.reference.trajectory import read_csv
from lag2fmu.verify.reference_files import reference_of


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory):
    """A folder with records of a smooth mechanism and one with impacts, and what was said."""
    folder = tmp_path_factory.mktemp("records") / "new" / "records"
    return folder, record(["double_pendulum", "bouncing_ball"], folder)


@pytest.mark.fmu
def test_the_files_of_a_record(recorded) -> None:
    folder, _ = recorded
    assert {path.name for path in folder.iterdir()} == {"README.md", "tools.json", "double_pendulum", "bouncing_ball"}
    name = "double_pendulum"
    own = {f"{name}.fmu", f"{name}_ref.csv", f"{name}_in.csv", f"{name}_ref.opt", "Readme.txt"}
    assert {path.name for path in (folder / name).iterdir()} == own
    lines = (folder / name / f"{name}_ref.opt").read_text().splitlines()
    assert lines == ["StartTime,0.0", "StopTime,10.0", "StepSize,0.01", "RelTol,1e-06"]
    assert json.loads((folder / "tools.json").read_text())[0]["fmuExport"] == ["CS", "ME"]
    features = (
        "co-simulation, model exchange, inputs (2), tunable parameters (5), directional derivatives, "
        "states that are saved and restored"
    )
    assert f"Features of FMI that it uses: {features}.\n" in (folder / name / "Readme.txt").read_text()
    assert "event indicators (" in (folder / "bouncing_ball" / "Readme.txt").read_text()


@pytest.mark.fmu
@pytest.mark.parametrize("name", ["double_pendulum", "bouncing_ball"])
def test_a_stranger_meets_the_reference_with_fmpy_alone(name: str, recorded) -> None:
    """What the cross-check asks for: the options and inputs of the record, and columns of the reference."""
    place = recorded[0] / name
    options = dict(line.split(",") for line in (place / f"{name}_ref.opt").read_text().splitlines())
    reference = read_csv(place / f"{name}_ref.csv")
    assert len(reference.names) <= 10
    inputs = np.genfromtxt(place / f"{name}_in.csv", delimiter=",", names=True)
    result = fmpy.simulate_fmu(
        str(place / f"{name}.fmu"),
        stop_time=float(options["StopTime"]),
        output_interval=float(options["StepSize"]),
        relative_tolerance=float(options["RelTol"]),
        input=inputs,
        output=list(reference.names),
    )
    end = np.array([result[name][-1] for name in reference.names])
    assert end == pytest.approx(reference.columns(reference.names)[-1], abs=1e-4)


@pytest.mark.fmu
def test_the_verdicts_of_tools(recorded) -> None:
    folder, said = recorded
    for name, verdicts in said.items():
        assert {v.outcome for v in verdicts} <= {"passed", "not run"}, name
        assert {"lag2fmu check", "fmpy validate", "fmpy"} <= {v.tool for v in verdicts if v.outcome == "passed"}
        readme = (folder / name / "Readme.txt").read_text()
        assert all(f"{v.tool} {v.version}, {v.kind}: {v.outcome}" in readme for v in verdicts)
    installed = {importer.package for importer in IMPORTERS if importer.installed}
    assert installed == {v.tool for v in said["double_pendulum"] if v.outcome == "passed"} - {
        "lag2fmu check",
        "fmpy validate",
    }


@pytest.mark.fmu
def test_a_run_that_is_wrong_fails(recorded, monkeypatch: pytest.MonkeyPatch) -> None:
    """The values of an importer that are off by a thousandth of the range."""
    folder, _ = recorded
    fmu = next(iter((folder / "double_pendulum").glob("*.fmu")))
    monkeypatch.setattr(checks, "run_by", lambda importer, *given: run_by(importer, *given) + 1e-3)
    mechanism = load("double_pendulum")
    made = export(mechanism, fmu.parent.parent / "again.fmu")
    verdict = checks._run(IMPORTERS[0], made, reference_of(mechanism))
    made.path.unlink()
    assert verdict.outcome == "FAILED"
    assert "e-0" in verdict.detail


def _crashes(path: Path, tolerance: float, times: object, names: object) -> object:
    os.abort()


def _complains(path: Path, tolerance: float, times: object, names: object) -> object:
    raise ValueError(f"what is this?\nno {path.suffix} of mine")


@pytest.mark.parametrize(("run", "said"), [(_crashes, "x crashed while"), (_complains, "x cannot run .* no .fmu of")])
def test_an_importer_that_fails_is_a_sentence(run, said: str) -> None:
    with pytest.raises(SimulationError, match=said):
        run_by(Importer("x", "x", "co-simulation", run), Path("a.fmu"), 1e-6, np.array([0.0, 1.0]), ["y"])


@pytest.mark.parametrize("name", ["thesis.tex", "pendulum.fmu", "Readme.txt"])
def test_files_of_others_are_left_alone(name: str, tmp_path: Path) -> None:
    """Also those with the names of ours: a record is known by its Readme.txt."""
    (tmp_path / "pendulum").mkdir()
    (tmp_path / "pendulum" / name).write_text("mine")
    done = CliRunner().invoke(main, ["record", "pendulum", "-o", str(tmp_path)])
    assert done.exit_code == 2
    assert f"holds '{name}', which is no file of a record; move it away" in done.output
    assert [path.name for path in tmp_path.iterdir()] == ["pendulum"]
    assert (tmp_path / "pendulum" / name).read_text() == "mine"
    (tmp_path / "cart_pole").write_text("a file")
    with pytest.raises(ExportError, match="is a file, where the folder of a record has to stand"):
        record(["cart_pole"], tmp_path)


@pytest.mark.parametrize("name", ["README.md", "tools.json"])
def test_a_table_of_others_is_not_overwritten(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text("mine")
    done = CliRunner().invoke(main, ["record", "pendulum", "-o", str(tmp_path)])
    assert done.exit_code == 2
    assert "was not written by 'lag2fmu record'" in done.output
    assert (tmp_path / name).read_text() == "mine"
    with pytest.raises(ExportError, match="is a file, where the folder of records has to stand"):
        record(["pendulum"], tmp_path / name)


def test_two_mechanisms_of_one_name(tmp_path: Path) -> None:
    with pytest.raises(ExportError, match="two of the models are named 'pendulum'"):
        record(["pendulum", "pendulum"], tmp_path)


RECORD = Path(__file__).parents[2] / "docs" / "record"
RECORDED = sorted(path.name for path in RECORD.iterdir() if path.is_dir())


def test_the_record_of_this_project_is_whole() -> None:
    table = (RECORD / "README.md").read_text()
    assert len(RECORDED) == 10
    assert "FAILED" not in table
    assert all(f"[{name}]({name}/Readme.txt)" in table for name in RECORDED)


@pytest.mark.slow
@pytest.mark.parametrize("name", RECORDED)
def test_the_record_of_this_project_holds(name: str) -> None:
    """Its reference values are those of today's direct integration, by SciPy of today, in the first third."""
    written, mechanism = read_csv(RECORD / name / f"{name}_ref.csv"), load(name)
    experiment, count = mechanism.experiment, len(written.time) - 1
    assert count == round(experiment.stop_time / experiment.step)
    part = replace(experiment, stop_time=experiment.stop_time * (count // 3) / count)
    found = reference_of(replace(mechanism, experiment=part))
    size = len(found.trajectory.time)
    seen = np.ones(size, bool) if found.comparable is None else found.comparable
    for column in written.names:
        scale = max(1.0, float(np.abs(written[column]).max()))
        assert found.trajectory[column][seen] == pytest.approx(written[column][:size][seen], abs=1e-6 * scale), column
