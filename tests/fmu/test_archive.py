"""The archive: the same bytes from the same input, its entries, and the mechanism inside."""

from __future__ import annotations

import filecmp
import os
import stat
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from archives import library, xml

from lag2fmu.checking.schema import problems
from lag2fmu.errors import ExportError, LoadError
from lag2fmu.fmu import Fmu, export, read_mechanism
from lag2fmu.formats.loading import load

pytestmark = pytest.mark.fmu

EXPORT = """
import sys, lag2fmu
for model in ("cart_pole", "n_pendulum"):
    lag2fmu.export(lag2fmu.load(model), f"{sys.argv[1]}/{model}.fmu")
"""


def same(one: Path, other: Path) -> bool:
    """Whether both files have the same bytes; pytest would take minutes to show where they differ."""
    return filecmp.cmp(one, other, shallow=False)


@pytest.mark.usefixtures("compiled_anew")
def test_exporting_twice_gives_the_same_bytes(exported, tmp_path) -> None:
    """Also where the solver is chosen and not named."""
    again = export(load("double_pendulum"), tmp_path / "other_name.fmu")
    assert same(again.path, exported("double_pendulum", solver="dopri5", without=()).path)


@pytest.mark.parametrize("seed", ["0", "1", "4711"])
def test_the_hash_seed_does_not_matter(seed: str, exported, tmp_path) -> None:
    """The whole file, library included, from another process in another folder."""
    environment = os.environ | {"PYTHONHASHSEED": seed}
    subprocess.run([sys.executable, "-c", EXPORT, str(tmp_path)], env=environment, cwd=tmp_path, check=True)
    for model in ("cart_pole", "n_pendulum"):
        assert same(tmp_path / f"{model}.fmu", exported(model, optimised=True, without=()).path)


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


def test_the_mechanism_inside_reads_back_equal(fmu: Fmu) -> None:
    assert read_mechanism(fmu.path) == fmu.mechanism


def test_a_file_that_is_no_fmu_of_ours(tmp_path) -> None:
    other = tmp_path / "other.fmu"
    other.write_bytes(b"no archive")
    with pytest.raises(ExportError, match=r"is it an FMU of lag2fmu\?"):
        read_mechanism(other)
    with zipfile.ZipFile(other, "w") as archive:
        archive.writestr("modelDescription.xml", "<x/>")
    with pytest.raises(ExportError, match="it carries no mechanism"):
        read_mechanism(other)
    with pytest.raises(LoadError, match=r"absent.*no such file"):
        read_mechanism(tmp_path / "absent.fmu")


def test_a_new_export_replaces_the_older_file(tmp_path, exported) -> None:
    target = tmp_path / "pendulum.fmu"
    target.write_bytes(b"older")
    assert same(export(load("pendulum"), target).path, exported("pendulum", without=()).path)
    assert [path.name for path in tmp_path.iterdir()] == ["pendulum.fmu"]
