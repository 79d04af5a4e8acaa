"""What MkDocs asks while it builds the site: pictures of the gallery, and formulas as MathML.

The environment variable LAG2FMU_LIVE says which models of the gallery get a page in which they move: "all", "none" or
names with commas between them. Each takes two seconds of a processor, for the compiler and a direct integration.
"""

from __future__ import annotations

import html
import os
import re
import sys
from pathlib import Path

from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

sys.path.insert(0, str(Path(__file__).parent))

import gallery

from lag2fmu.resources import bundled

_FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)

_LINK = re.compile(r'href="([^":]+)\.md([#"])')


def _moving() -> tuple[str, ...]:
    """The models whose pages move."""
    live = os.environ.get("LAG2FMU_LIVE", "none")
    return bundled() if live == "all" else () if live == "none" else tuple(live.split(","))


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages in which models move."""
    for path, content in gallery.motions(_moving()).items():
        files.append(File.generated(config, path, content=content))
    return files


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    """Sketches and motions in the gallery, which takes the whole width."""
    if not page.file.src_uri.startswith("gallery/"):
        return markdown
    page.meta["hide"] = ["navigation", "toc"]
    return gallery.with_picture(page.file.src_uri, markdown, _moving())


def on_page_content(content: str, **_: object) -> str:
    """Formulas as MathML, which browsers draw without a script; links of notebooks to pages as those of the site."""
    return _LINK.sub(r'href="\1.html\2', _FORMULA.sub(_mathml, content))


def _mathml(found: re.Match[str]) -> str:
    kind, formula = found.groups()
    return convert(html.unescape(formula), display="block" if kind == "div" else "inline")
