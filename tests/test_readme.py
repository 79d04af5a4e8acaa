"""What README.md and docs/ say of the repository is true, and README stays short; tests/docs runs their examples."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
from examples import blocks

import lag2fmu
from lag2fmu.dynamics import derive
from lag2fmu.fmu.sketch import sketch
from lag2fmu.formats.loading import bundled, load
from lag2fmu.picture import draw, layout_of

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text("utf-8")


@pytest.mark.fmu
def test_the_python_example_prints_a_small_error(tmp_path: Path) -> None:
    (example,) = [block.text for block in blocks(ROOT / "README.md") if block.language == "python"]
    assert len([line for line in example.splitlines() if line]) <= 14
    done = subprocess.run([sys.executable, "-c", example], cwd=tmp_path, capture_output=True, text=True, check=True)
    theta, error = re.fullmatch(r"theta after one period: ([\d.]+), error (.+)\n", done.stdout).groups()  # type: ignore[union-attr]
    assert float(error) < 1e-8
    assert float(theta) == pytest.approx(1.0, abs=1e-8)


def test_the_readme_is_read_in_two_minutes() -> None:
    assert len(README.splitlines()) <= 120


def test_the_picture_is_the_sketch_of_today() -> None:
    """``lag2fmu.fmu.sketch.sketch`` writes it anew."""
    scene = draw(layout_of(derive(load("double_pendulum")).mechanism))
    assert (ROOT / "docs" / "assets" / "double_pendulum.svg").read_text("utf-8") == sketch(scene)


def test_make_and_pip_lines_name_what_exists() -> None:
    makefile = (ROOT / "Makefile").read_text("utf-8")
    for target in re.findall(r"^make ([\w-]+)", README, re.MULTILINE):
        assert re.search(rf"^{target}:", makefile, re.MULTILINE)
    assert '-e ".[test]"' in README
    assert '-e ".[test]"' in makefile


def test_the_page_for_contributors_names_what_exists() -> None:
    text, makefile = (ROOT / "docs" / "CONTRIBUTING.md").read_text("utf-8"), (ROOT / "Makefile").read_text("utf-8")
    targets = re.findall(r"`make ([\w-]+)`", text)
    assert len(targets) > 4
    assert [name for name in targets if not re.search(rf"^{name}:", makefile, re.MULTILINE)] == []


def test_the_changelog_says_where_names_are_now() -> None:
    """Each of them is there."""
    text = (ROOT / "docs" / "CHANGELOG.md").read_text("utf-8")
    rows = re.findall(r"^ *\| (`[\w`, ]+) \| `([\w.]+)` \|$", text, re.MULTILINE)
    moved = {name: place for names, place in rows for name in re.findall(r"\w+", names)}
    assert len(moved) > 8
    for name, place in moved.items():
        with pytest.raises(AttributeError, match=rf"it is {place}\.{name}$"):
            getattr(lag2fmu, name)
        assert hasattr(import_module(place), name)


def test_the_repository_table_is_true() -> None:
    """Every room of the package stands there, and every folder that is named exists."""
    section = (ROOT / "docs" / "extending.md").read_text("utf-8").split("## The repository")[1]
    places = re.findall(r"`([\w/]+)/`", section)
    rooms = {folder.name for folder in (ROOT / "lag2fmu").iterdir() if (folder / "__init__.py").is_file()}
    assert rooms <= set(places)
    for place in places:
        assert any((ROOT / above / place).is_dir() for above in ("", "lag2fmu", "templates/engine")), place


def test_all_public_names_are_in_the_reference_of_python() -> None:
    page = (ROOT / "docs" / "reference" / "python.md").read_text("utf-8")
    named = set(re.findall(r"\.(\w+)$|`(\w+)`", page, re.MULTILINE)) | {("Lag2FmuError", "")}
    assert {*lag2fmu.__all__} <= {a or b for a, b in named}


def test_models_that_pages_name_are_bundled() -> None:
    table = (ROOT / "docs" / "hybrid.md").read_text("utf-8").split("## Models")[1]
    assert set(re.findall(r"^\| `(\w+)`", table, re.MULTILINE)) <= set(bundled())


def test_the_files_that_an_extension_touches_are_there() -> None:
    table = (ROOT / "docs" / "extending.md").read_text("utf-8").split("## The repository")[0]
    named = {x for x in re.findall(r"`([\w/]+(?:/|\.(?:py|c|h)))`", table) if "NAME" not in x}
    homes = [ROOT, ROOT / "lag2fmu", ROOT / "templates" / "engine"]
    assert [x for x in sorted(named) if not any((home / x).exists() for home in homes)] == []
    assert len(named) > 20
