"""Every command and snippet of the README runs and says what the README promises."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from lag2fmu.formats.loading import bundled
from lag2fmu.formats.text import read

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text("utf-8")
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", README, re.DOTALL)

pytestmark = pytest.mark.fmu


def _run(command: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)


def test_the_python_example_prints_a_small_error(tmp_path: Path) -> None:
    (example,) = [text for language, text in BLOCKS if language == "python"]
    assert len([line for line in example.splitlines() if line]) <= 14
    output = _run([sys.executable, "-c", example], tmp_path).stdout
    theta, error = re.fullmatch(r"theta after one period: ([\d.]+), error (.+)\n", output).groups()  # type: ignore[union-attr]
    assert float(error) < 1e-8
    assert float(theta) == pytest.approx(1.0, abs=1e-8)


def test_the_commands_run(tmp_path: Path) -> None:
    lines = [line for language, text in BLOCKS if language == "sh" for line in text.splitlines()]
    commands = [line for line in lines if line.startswith("lag2fmu")]
    assert len(commands) == 4
    for command in commands:
        line, _, target = command.partition(" > ")
        done = _run([sys.executable, "-m", "lag2fmu.cli", *shlex.split(line)[1:]], tmp_path)
        if target:
            (tmp_path / target).write_text(done.stdout, "utf-8")


def test_make_and_pip_lines_name_what_exists() -> None:
    makefile = (ROOT / "Makefile").read_text("utf-8")
    for target in re.findall(r"^make (\w+)", README, re.MULTILINE):
        assert re.search(rf"^{target}:", makefile, re.MULTILINE)
    assert '-e ".[test]"' in README
    assert '-e ".[test]"' in makefile


def test_all_models_are_in_the_table() -> None:
    table = re.findall(r"`(\w+)`", README.split("## Models")[1].split("## What")[0])
    assert set(bundled()) <= set(table)


def test_the_repository_table_is_true() -> None:
    """Every room of the package stands there, and every folder that is named exists."""
    section = README.split("## Repository")[1].split("## Constraints")[0]
    places = re.findall(r"`([\w/]+)/`", section)
    rooms = {folder.name for folder in (ROOT / "lag2fmu").iterdir() if (folder / "__init__.py").is_file()}
    assert rooms <= set(places)
    for place in places:
        assert any((ROOT / above / place).is_dir() for above in ("", "lag2fmu", "templates/runtime")), place


def test_what_docs_hybrid_shows_is_read_and_runs(tmp_path: Path) -> None:
    """About 5 s, nearly all of it for the export of the Python example."""
    text = (ROOT / "docs" / "hybrid.md").read_text("utf-8")
    blocks = dict(re.findall(r"```(\w+)\n(.*?)```", text, re.DOTALL))
    machine = read(blocks["toml"], "machine.toml")
    assert [u.name for u in machine.unilaterals] == ["floor", "wall_upper"]
    assert set(re.findall(r"^\| `(\w+)`", text.split("## Models")[1], re.MULTILINE)) <= set(bundled())
    output = _run([sys.executable, "-c", blocks["python"]], tmp_path).stdout
    assert output == "rests at 4.07 s, force 4.905 N, lost 4.905 J\n"


def test_the_readme_is_short() -> None:
    assert len(README.splitlines()) <= 180


@pytest.mark.parametrize(("name", "shown"), [("parts", "['a_theta', 'b_theta']"), ("linearize", "[[")])
def test_what_docs_show_in_python_runs(
    name: str, shown: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "docs" / f"{name}.md").read_text("utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    exec(code, {})
    assert capsys.readouterr().out.startswith(shown)
