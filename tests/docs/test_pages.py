"""The pages that are written from the code are those of today, and links lead somewhere without the site."""

from __future__ import annotations

import json
import re
import sys
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(p for end in ("*.md", "*.ipynb") for p in DOCS.rglob(end))]


@pytest.fixture
def written(monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """Path below docs/ -> what the code of today writes there."""
    monkeypatch.syspath_prepend(DOCS / "site")
    for name in ("gallery", "text_format"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    import gallery
    import text_format

    return {"reference/text-format.md": text_format.page(), **gallery.texts()}


def test_written_pages_are_those_of_today(written: dict[str, str], request: pytest.FixtureRequest) -> None:
    """``pytest tests/docs --update`` writes them anew, and removes those of models that are no more."""
    gone = {path.relative_to(DOCS).as_posix() for path in (DOCS / "gallery").glob("*.md")} - set(written)
    if request.config.getoption("--update"):
        for path in gone:
            (DOCS / path).unlink()
        for path, text in written.items():
            (DOCS / path).parent.mkdir(exist_ok=True)
            (DOCS / path).write_text(text, "utf-8", newline="\n")
        return
    old = [p for p, text in written.items() if not (DOCS / p).is_file() or (DOCS / p).read_text("utf-8") != text]
    assert [*old, *gone] == [], "run pytest tests/docs --update"


@cache
def _markdown(page: Path) -> str:
    """``page`` without its blocks of code; of a notebook the cells of text."""
    text = page.read_text("utf-8")
    if page.suffix == ".ipynb":
        cells = json.loads(text)["cells"]
        text = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    return re.sub(r"^ *```.*?^ *```$", "", text, flags=re.M | re.S)


def _headings(page: Path) -> set[str]:
    """The fragments that lead to headings of ``page`` where GitHub shows it."""
    titles = re.findall(r"^#+ +(.+)$", _markdown(page), re.M)
    plain = (re.sub(r"\[([^\]]*)\]\([^)]*\)|[`*]", r"\1", title) for title in titles)
    return {re.sub(r"[^\w\- ]", "", title.lower()).strip().replace(" ", "-") for title in plain}


def _broken(page: Path, link: str) -> bool:
    path, _, fragment = link.partition("#")
    target = page.parent / path if path else page
    return not target.is_file() or (bool(fragment) and fragment not in _headings(target))


def test_links_lead_to_files_and_headings() -> None:
    """Of every page and notebook; addresses on the network are not asked for."""
    found = [
        (page, a or b)
        for page in PAGES
        for a, b in re.findall(r'\]\(([^)\s]+)\)|(?:src|href)="([^"]+)"', re.sub(r"`[^`\n]*`", "", _markdown(page)))
    ]
    inside = [(page, link) for page, link in found if not re.match(r"\w+:", link)]
    assert len(inside) > 200
    assert [f"{page.relative_to(ROOT)}: {link}" for page, link in inside if _broken(page, link)] == []
