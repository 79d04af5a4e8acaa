"""The page as one self-contained file of HTML, with its scripts, styles and the module of WebAssembly."""

from __future__ import annotations

import json
import zlib
from base64 import b64encode
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rjsmin import jsmin

from lag2fmu.codegen.templates import render
from lag2fmu.fmu.live.parts import Live
from lag2fmu.resources import resource_folder

SCRIPTS = (
    *("address", "badge", "colors", "drag", "hand", "mechanism", "balance", "plots", "settings", "panel", "player"),
    *("run", "trails", "gauges", "glyphs", "plane_parts", "scene", "plane", "solids", "space", "views", "page"),
)
"""The files of templates/page in the order in which they are joined: a class stands behind the one that it extends.

A page that is opened from a disk may load no other file, so they are one script, and no two define the same name.
"""


def document(context: Mapping[str, object], data: Mapping[str, Any], made: Live) -> str:
    """The text of the page.

    ``context`` is that of the static page, ``data`` is for the script, and ``made`` holds what is compiled and drawn.
    A mechanism in space needs the library that draws it.
    """
    spatial = made.spatial
    folder = resource_folder("templates") / "page"
    vendor = folder / "vendor"
    styles = [(vendor / "uPlot.min.css").read_text("utf-8"), (folder / "page.css").read_text("utf-8")]
    live = {
        "css": "\n".join(styles),
        "data": json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c"),
        "module": _packed(made.module),
        "surfaces": _packed(made.surfaces) if made.surfaces else "",
        "three": _packed((vendor / "three.module.min.js").read_bytes()) if spatial else "",
        "licences": "\n".join(path.read_text("utf-8").replace("--", "- -") for path in licences(spatial)),
        "uplot": (vendor / "uPlot.iife.min.js").read_text("utf-8").replace("</script", "<\\/script"),
        "script": jsmin(script()),  # without comments and indents, which are a fourth of its packed size
        "drawn": data["drawing"] is not None,
        "compared": data["reference"] is not None,
    }
    return render("page/page.html.jinja", {**context, **live})


def licences(spatial: bool) -> list[Path]:
    """The files with the licences of the libraries that a page includes."""
    vendor = resource_folder("templates") / "page" / "vendor"
    return [vendor / f"{name}.LICENSE.txt" for name in (("three", "uplot") if spatial else ("uplot",))]


def _packed(content: bytes) -> str:
    """``content`` deflated and encoded in base 64; browsers unpack it without a library."""
    deflate = zlib.compressobj(9, zlib.DEFLATED, -15)
    return b64encode(deflate.compress(content) + deflate.flush()).decode()


def script() -> str:
    """All of SCRIPTS, joined."""
    folder = resource_folder("templates") / "page"
    texts = [(folder / f"{name}.js").read_text("utf-8").strip() for name in SCRIPTS]
    return "\n\n".join(texts).replace("</script", "<\\/script")
