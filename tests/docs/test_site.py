"""The documentation is built without a warning, every link leads somewhere, and the notebooks run."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))

pytestmark = [pytest.mark.fmu, pytest.mark.slow]


class Page(HTMLParser):
    """The links of a page and what they may lead to in it."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.names: set[str] = set()
        self.feed(path.read_text("utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for key, value in attrs:
            if key == "id" and value:
                self.names.add(value)
            elif (tag, key) in {("a", "href"), ("img", "src"), ("iframe", "src"), ("link", "href")} and value:
                self.links.append(value)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site with one page in which a mechanism moves; the build fails where MkDocs warns."""
    pytest.importorskip("material", reason="MkDocs is not installed: pip install -e '.[docs]'")
    pytest.importorskip("mkdocs_jupyter", reason="MkDocs is not installed: pip install -e '.[docs]'")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-f", "docs/site/mkdocs.yml", "-d", str(folder)]
    environment = os.environ | {"LAG2FMU_LIVE": "pendulum", "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    assert "WARNING" not in done.stderr
    return folder


def test_links_lead_to_pages_and_headings(site: Path) -> None:
    """Of each page but the live one, which belongs to the package; addresses on the network are not asked for."""
    pages = {path: Page(path) for path in site.rglob("*.html") if "live" not in path.parts}
    assert len(pages) > 100
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc or path.name == "404.html":
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            assert target.is_file() or (target / "index.html").is_file(), f"{path.relative_to(site)}: {link}"
            if parts.fragment and target in pages:
                assert unquote(parts.fragment) in pages[target].names, f"{path.relative_to(site)}: {link}"


def test_references_are_those_of_the_code(site: Path) -> None:
    """Every verb and every table; formulas are MathML, which needs no script from elsewhere."""
    from lag2fmu.cli import main
    from lag2fmu.formats.keys import TABLES

    headings = Page(site / "reference" / "command-line.html").names
    assert {f"lag2fmu-{name}" for name in main.commands} <= headings
    assert set(TABLES) <= Page(site / "reference" / "text-format.html").names
    assert "lag2fmu.fmu.exporting.export" in Page(site / "reference" / "python.html").names
    method = (site / "method.html").read_text("utf-8")
    assert "<math" in method
    assert r"\(" not in re.sub(r"<script.*?</script>", "", method, flags=re.S)


def test_the_gallery_shows_every_model(site: Path) -> None:
    from lag2fmu.resources import bundled

    overview = (site / "gallery" / "index.html").read_text("utf-8")
    assert re.findall(r'class="model" href="(\w+)\.html"', overview) == list(bundled())
    assert overview.count("<svg xmlns") > 60
    assert 'src="live/pendulum.html"' in (site / "gallery" / "pendulum.html").read_text("utf-8")
    assert "<canvas" in (site / "gallery" / "live" / "pendulum.html").read_text("utf-8")


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_and_shows_pictures(notebook: Path, tmp_path: Path) -> None:
    """Its cells assert their numbers; it is kept without outputs."""
    nbformat = pytest.importorskip("nbformat", reason="Jupyter is not installed: pip install -e '.[docs]'")
    client = pytest.importorskip("nbclient", reason="Jupyter is not installed: pip install -e '.[docs]'")
    pytest.importorskip("ipykernel", reason="Jupyter is not installed: pip install -e '.[docs]'")
    content = nbformat.read(notebook, as_version=4)
    cells = [cell for cell in content.cells if cell.cell_type == "code"]
    assert not any(cell.outputs or cell.execution_count for cell in cells)
    client.NotebookClient(content, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    shown = "".join(str(output.get("data", "")) for cell in cells for output in cell.outputs)
    for part in ("<svg", "<iframe", "text/latex", "<th>compared</th>"):
        assert part in shown, part
