"""What MkDocs asks while it builds the site: the generated pages, and formulas as MathML.

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

sys.path.insert(0, str(Path(__file__).parent))

import gallery
import generated

UNMEASURED = "# Measurements\n\n`make bench` measures accuracy and speed, and writes this page.\n"
_FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)

_LINK = re.compile(r'href="([^":]+)\.md([#"])')


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages."""
    pages: dict[str, str] = {"reference/text-format.md": generated.text_format()}
    pages |= gallery.pages(os.environ.get("LAG2FMU_LIVE", "none"))
    if files.get_file_from_path("benchmarks.md") is None:
        pages["benchmarks.md"] = UNMEASURED
    for path, content in pages.items():
        files.append(File.generated(config, path, content=content))
    return files


def on_page_content(content: str, **_: object) -> str:
    """Formulas as MathML, which browsers draw without a script; links of notebooks to pages as those of the site."""
    return _LINK.sub(r'href="\1.html\2', _FORMULA.sub(_mathml, content))


def _mathml(found: re.Match[str]) -> str:
    kind, formula = found.groups()
    return convert(html.unescape(formula), display="block" if kind == "div" else "inline")
