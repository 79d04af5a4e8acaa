"""What `lag2fmu check` says of components for WebAssembly, and what their bill of materials lists."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from faults import files_of, written

from lag2fmu.checking import check_fmu
from lag2fmu.fmu.exporting import export
from lag2fmu.fmu.materials import BILL_ENTRY
from lag2fmu.fmu.wasm.binary import MODULE
from lag2fmu.fmu.wasm.draft import FOLDER, MANIFEST, NAME, commit

pytestmark = [pytest.mark.fmu, pytest.mark.slow]

COMPONENT = f"binaries/{FOLDER}/pendulum.wasm"


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("component") / "pendulum.fmu"
    return export("pendulum", target, fmi="3.0", platform="wasm", page="static").path


def test_a_component_is_checked(path: Path, tmp_path: Path) -> None:
    assert check_fmu(path, run=False).findings == ()
    files = files_of(path)
    data, manifest = files[COMPONENT], files[MANIFEST]
    for changed, rule in (
        ({COMPONENT: MODULE + bytes(8)}, "binary-format"),
        ({COMPONENT: data[:8] + b"\xff" * 9999}, "binary-functions"),
        ({COMPONENT: data.replace(b"fmi:fmi3/model-exchange@3", b"fmi:fmi3/model-exchangi@3")}, "binary-functions"),
        ({COMPONENT: data.replace(b"fmi:fmi3/callbacks@", b"foi:fmi3/callbacks@")}, "binary-imports"),
        ({MANIFEST: manifest.replace(b"fmi-ls:fmi-ls-name", b"fmi-ls:fmi-ls-nam")}, "manifest"),
        ({f"binaries/{FOLDER}/other.wasm": data, COMPONENT: None}, "binary-name"),
        ({MANIFEST: None}, "wasm-manifest"),
    ):
        kept = {file: content for file, content in {**files, **changed}.items() if content is not None}
        found = check_fmu(written(kept, tmp_path / "changed.fmu"), run=False).findings
        assert rule in {finding.rule for finding in found}, rule


def test_the_bill_lists_what_is_in_a_component(path: Path) -> None:
    bill = json.loads(files_of(path, bill=True)[BILL_ENTRY])
    parts = {part["name"]: part for part in bill["components"] if part["type"] != "file"}
    assert parts[NAME]["version"] == commit()
    assert "wasi-libc" in parts
    told = {part["name"]: part["value"] for part in bill["metadata"]["properties"]}
    assert "-Os" in told["org.lag2fmu:compiler-flags-of-wasm"]
