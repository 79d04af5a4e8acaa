"""The page as one file: scripts joined in order, nothing that ends a script early, nothing from elsewhere."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest

from lag2fmu.errors import ExportError
from lag2fmu.fmu import export
from lag2fmu.fmu.backends import native
from lag2fmu.fmu.live import module
from lag2fmu.fmu.live.document import SCRIPTS, script
from lag2fmu.fmu.live.module import page_choice
from lag2fmu.fmu.live.samples import Samples
from lag2fmu.resources import resource_folder

FOLDER = resource_folder("templates") / "page"


def test_all_scripts_are_joined_and_fit() -> None:
    joined = script()
    assert sorted(SCRIPTS) == sorted(path.stem for path in FOLDER.glob("*.js"))
    assert "</script" not in joined
    for path in FOLDER.glob("*.js"):
        text = path.read_text("utf-8")
        assert text.strip() in joined, path.name
        assert text.count("\n") <= 300, path.name


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node on this machine")
def test_the_joined_script_is_one_module(tmp_path: Path) -> None:
    """Two scripts that define the same name would be an error, as what is no module would be."""
    (tmp_path / "page.mjs").write_text(script(), "utf-8")
    done = subprocess.run(["node", "--check", "page.mjs"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("backend", ["c", "python"])
@pytest.mark.parametrize("most_text", [1000, module.MOST_TEXT])
def test_a_page_that_costs_much_stands_still(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, caplog: pytest.LogCaptureFixture, backend: str, most_text: int
) -> None:
    """And says which option makes it live."""

    def costly(*_: object) -> bytes:
        assert most_text > 1000, "what is too long is not compiled"
        return bytes(module.MOST_BYTES + 1)

    monkeypatch.setenv(module.VARIABLE, "live")
    monkeypatch.setattr(module, "compile_module", costly)
    monkeypatch.setattr(module, "MOST_TEXT", most_text)
    monkeypatch.setattr(native, "compile_libraries", lambda *_: [b"library"])
    fmu = export("pendulum", tmp_path / "still.fmu", backend=backend)
    with ZipFile(fmu.path) as archive:
        text = archive.read("documentation/index.html").decode()
    assert "This page stands still" in text
    assert "<code>--page live</code> makes it all the same" in text
    assert "wasm" not in text
    assert "warning: This page stands still" in caplog.text


def test_a_page_is_live_unless_it_is_said_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    assert page_choice(None) == "static"  # as the tests have it
    assert page_choice("live") == "live"
    monkeypatch.delenv(module.VARIABLE)
    assert page_choice(None) == "live"
    monkeypatch.setattr(module, "find_spec", lambda _: None)
    assert page_choice(None) == "static"
    with pytest.raises(ExportError, match="unknown page 'moving'; known are live, static"):
        page_choice("moving")


def test_samples_are_few_and_keep_both_ends() -> None:
    times = np.linspace(0.0, 1.0, 1001)
    samples = Samples(("x",), times, times[:, None] ** 2, np.ones(1), np.ones(1001), 1e-4)
    data = samples.data()
    assert data is not None
    assert (data["times"][0], data["times"][-1]) == (0.0, 1.0)
    assert len(data["times"]) == len(data["values"]) == len(data["growth"]) == 60
    assert Samples(("x",), times[:0], times[:0, None], np.ones(1), np.ones(0), 1e-4).data() is None
