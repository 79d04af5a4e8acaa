"""Every example of README.md and of the pages in docs/ runs, and prints what the page says."""

from __future__ import annotations

import re
from pathlib import Path

import examples
import pytest

from lag2fmu.cli import main

ROOT = Path(__file__).parents[2]
WRITTEN = ROOT / "docs" / "gallery"
PAGES = [ROOT / "README.md", *(page for page in sorted((ROOT / "docs").rglob("*.md")) if page.parent != WRITTEN)]
RUN = {"console", "python", "toml"}
LONG = {"robots-on-the-ground.md"}
"""Pages whose runs take longer than to compile them as users do."""
FIRST_STEPS = ROOT / "docs" / "first-steps.md"
COULD_BE_RUN = re.compile(rf"^(\$ |lag2fmu ({'|'.join(main.commands)})\b|import lag2fmu)", re.M)


def _name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def _shows_something(page: Path) -> bool:
    return page != FIRST_STEPS and not RUN.isdisjoint(block.language for block in examples.blocks(page))


@pytest.mark.fmu
@pytest.mark.slow
@pytest.mark.parametrize("page", filter(_shows_something, PAGES), ids=_name)
def test_the_examples_of_a_page_run(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    if page.name in LONG:
        request.getfixturevalue("optimised_alone")
    text = page.read_text("utf-8")
    needed = {*re.findall(r"^import (casadi|control|mujoco|pandas|wasmtime|xarray)", text, re.M)}
    for package in sorted(needed | ({"h5netcdf"} if ".nc\n" in text else set())):
        pytest.importorskip(package, reason=f"{package} is not installed")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    examples.run(page, tmp_path)


@pytest.mark.parametrize("page", PAGES, ids=_name)
def test_blocks_that_are_not_run_hold_nothing_that_could_be(page: Path) -> None:
    for block in examples.blocks(page):
        if block.language not in RUN:
            found = COULD_BE_RUN.search(block.text)
            assert found is None, f"{_name(page)}, line {block.line}: make it a console or python block"


@pytest.mark.fmu
@pytest.mark.slow
def test_first_steps_end_with_a_pendulum_that_moves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the commands and by Python alike: frames differ, and the bob keeps its distance from the pivot."""
    image = pytest.importorskip("PIL.Image")
    monkeypatch.chdir(tmp_path)
    examples.run(FIRST_STEPS, tmp_path)
    for name in ("my_pendulum.gif", "from_python.gif"):
        with image.open(tmp_path / name) as picture:
            assert picture.n_frames == 76  # 3 s, 25 frames a second
            frames = []
            for k in (0, 10, 20, 30):
                picture.seek(k)
                frames.append(picture.convert("L").tobytes())
            assert len(set(frames)) == len(frames)
    for name in ("my_pendulum.html", "from_python.html"):
        assert "<canvas" in (tmp_path / name).read_text("utf-8")
