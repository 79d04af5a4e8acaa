"""The wheel holds everything: installed into an empty environment it exports an FMU from an empty folder."""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

pytestmark = [pytest.mark.fmu, pytest.mark.slow]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run(
        [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(folder), str(ROOT)],
        check=True,
    )
    (path,) = folder.glob("*.whl")
    return path


def test_the_wheel_carries_templates_models_and_types(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    for name in (
        "py.typed",
        "templates/engine/integrate/integrator.c",
        "templates/mechanism/mechanism.c.jinja",
        "templates/start.toml",
        "templates/mechanism.schema.json",
        "models/pendulum.py",
        "reference/native.c",
    ):
        assert f"lag2fmu/{name}" in names
    assert not [name for name in names if "__pycache__" in name or name.startswith("tests")]


def test_the_installed_wheel_works_in_an_empty_folder(
    wheel: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Dependencies are those of this environment (they are lent by a path file); the package is the wheel's."""
    monkeypatch.delenv("PYTHONPATH", raising=False)
    environment, work = tmp_path / "env", tmp_path / "work"
    work.mkdir()
    venv.create(environment)
    python = next(
        (environment / place) for place in ("bin/python", "Scripts/python.exe") if (environment / place).exists()
    )
    site = subprocess.run(
        [python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.strip()
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", site, str(wheel)]
    subprocess.run(install, check=True)
    lent = {str(Path(entry)) for entry in sys.path if entry.endswith("site-packages")}
    (Path(site) / "lent.pth").write_text("\n".join(sorted(lent)) + "\n", "utf-8")
    for arguments in (["models"], ["export", "pendulum"], ["simulate", "pendulum.fmu", "--stop-time", "1"]):
        done = subprocess.run(
            [python, "-m", "lag2fmu", *arguments], cwd=work, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
    where = subprocess.run(
        [python, "-c", "import lag2fmu; print(lag2fmu.__file__)"], cwd=work, capture_output=True, text=True, check=True
    ).stdout
    assert str(environment) in where
    assert [p.name for p in work.iterdir()] == ["pendulum.fmu"]


def test_the_files_of_a_release_are_listed_with_their_hashes(wheel: Path, tmp_path: Path) -> None:
    """In SHA256SUMS and in the bill of materials, which names what the package needs; equal contents, equal bytes."""
    made = []
    for name in ("one", "two"):
        folder, part = tmp_path / name, tmp_path / f"{name}_part" / "inner"
        part.mkdir(parents=True)
        folder.mkdir()
        (part / "file.txt").write_text("content", "utf-8")
        shutil.copy(wheel, folder)
        script = [sys.executable, ROOT / "docs" / "site" / "release.py", folder, f"part={part.parent}"]
        subprocess.run(script, check=True)
        made.append({path.name: path.read_bytes() for path in folder.iterdir()})
    assert made[0] == made[1]
    sums = dict(reversed(line.split("  ")) for line in made[0].pop("SHA256SUMS").decode().splitlines())
    assert sums == {name: hashlib.sha256(data).hexdigest() for name, data in made[0].items()}
    bill = json.loads(made[0]["lag2fmu.cdx.json"])
    listed = {p["name"]: p["hashes"][0]["content"] for p in bill["components"] if p["type"] == "file"}
    assert listed == {name: sha256 for name, sha256 in sums.items() if name != "lag2fmu.cdx.json"}
    needed = {p["name"] for p in bill["components"] if p.get("scope") == "required"}
    assert {"sympy", "ziglang", "fmpy"} <= needed
    assert "casadi" not in needed
