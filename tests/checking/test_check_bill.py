"""The bill of materials in an FMU, and what `lag2fmu check` says where it lies."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from faults import files_of, written

from lag2fmu.checking import check_fmu
from lag2fmu.checking.findings import Finding
from lag2fmu.cli import main
from lag2fmu.fmu.materials import BILL_ENTRY, bill_of_materials
from lag2fmu.solvers.methods import METHODS

pytestmark = pytest.mark.fmu


@pytest.fixture(scope="module")
def files(exported) -> dict[str, bytes]:
    return files_of(exported("pendulum").path, bill=True)


def found(files: dict[str, bytes], folder: Path) -> list[Finding]:
    findings = check_fmu(written(files, folder / "changed.fmu"), run=False).findings
    return [finding for finding in findings if finding.rule == "bill-of-materials"]


def test_a_bill_lists_each_file_with_its_hash(files: dict[str, bytes]) -> None:
    bill = json.loads(files[BILL_ENTRY])
    hashes = {part["name"]: part["hashes"][0]["content"] for part in bill["components"]}
    assert hashes == {name: hashlib.sha256(data).hexdigest() for name, data in files.items() if name != BILL_ENTRY}
    assert [tool["name"] for tool in bill["metadata"]["tools"]["components"]] == ["lag2fmu", "ziglang"]
    told = {part["name"].removeprefix("org.lag2fmu:"): part["value"] for part in bill["metadata"]["properties"]}
    assert "-std=c99" in told["compiler-flags"]
    assert told["solver"] in METHODS


@pytest.mark.parametrize("library", ["binaries/win64/p.dll", "binaries/linux64/p.so"])
def test_a_bill_tells_what_libraries_of_windows_take_beside_the_others(library: str) -> None:
    bill = json.loads(bill_of_materials("p", {library: b""}, solver="dopri5", compiler="zig"))
    told = {part["name"]: part["value"] for part in bill["metadata"]["properties"]}
    further = told.get("org.lag2fmu:further-compiler-flags-of-windows", "")
    assert ("-funwind-tables" in further) == library.endswith(".dll")


def test_a_true_bill_finds_nothing(files: dict[str, bytes], tmp_path: Path) -> None:
    assert found(files, tmp_path) == []


def test_a_file_that_was_changed_is_named_with_both_hashes(files: dict[str, bytes], tmp_path: Path) -> None:
    name = next(n for n in files if n.endswith(".so") or n.startswith("sources/"))
    changed = files | {name: files[name] + b"\n"}
    (finding,) = found(changed, tmp_path)
    assert finding.place == name
    assert finding.severity == "error"
    assert hashlib.sha256(changed[name]).hexdigest()[:16] in finding.problem
    done = CliRunner().invoke(main, ["check", "--no-run", str(written(changed, tmp_path / "changed.fmu"))])
    assert done.exit_code == 1


def test_files_that_are_missing_or_not_listed_are_named(files: dict[str, bytes], tmp_path: Path) -> None:
    gone = {name: data for name, data in files.items() if name != "documentation/index.html"}
    first, second = found(gone | {"resources/other.txt": b"x"}, tmp_path)
    assert (first.place, first.severity) == ("documentation/index.html", "error")
    assert (second.place, second.severity) == ("resources/other.txt", "warning")


def test_a_file_without_a_hash_that_can_be_compared_is_named(files: dict[str, bytes], tmp_path: Path) -> None:
    bill = json.loads(files[BILL_ENTRY])
    first, second = (part for part in bill["components"][:2])
    del first["hashes"]
    second["hashes"][0]["alg"] = "MD5"
    findings = found(files | {BILL_ENTRY: json.dumps(bill).encode()}, tmp_path)
    assert [(f.place, f.severity) for f in findings] == [(part["name"], "warning") for part in (first, second)]
    assert all("has no hash of it by SHA-256" in f.problem for f in findings)


@pytest.mark.parametrize(
    "bill",
    [
        b"",
        b"\xff",
        b"[]",
        b"{}",
        b'{"bomFormat": "other"}',
        b"[" * 9999,
        b'{"bomFormat": "CycloneDX", "components": 3}',
        b'{"bomFormat": "CycloneDX", "components": [1, 2]}',
    ],
)
def test_what_is_no_bill_is_said(bill: bytes, files: dict[str, bytes], tmp_path: Path) -> None:
    (finding,) = found(files | {BILL_ENTRY: bill}, tmp_path)
    assert finding.place == BILL_ENTRY
    assert "no bill of materials that can be read" in finding.problem
    assert not any(word in finding.problem for word in ("Error", "subscriptable", "iterable", "recursion"))
