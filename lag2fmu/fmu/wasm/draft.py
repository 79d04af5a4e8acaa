"""The draft layered standard fmi-ls-wasm: what FMUs of ``--platform wasm`` hold beside what it has in WIT.

Source: https://github.com/modelica/fmi-ls-wasm, docs/index.adoc at ``commit()``. Where the draft moves, this file and
templates/wasm/fmi3.wit follow it.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING

from lag2fmu.fmu.xml_text import document
from lag2fmu.resources import resource_folder

if TYPE_CHECKING:
    from lag2fmu.fmu.wasm.wit import WitInterface

NAME = "org.modelica.fmi-ls-wasm"
FOLDER = "wasm32-wasip2"
"""The folder of components in binaries/."""
MANIFEST = f"extra/{NAME}/manifest.xml"
"""The manifest as the draft calls it; FMI 3.0.2, section 2.6, has another name for the same file."""
MANIFESTS = (MANIFEST, f"extra/{NAME}/fmi-ls-manifest.xml")
SPACE = "http://fmi-standard.org/fmi-ls-manifest"
_HEAD = {"name": NAME, "version": "0.1.0", "description": "FMI Layered Standard for WebAssembly"}
EXPORTED = ("common", "co-simulation", "model-exchange")
"""The interfaces of components: those of the draft's worlds co-simulation-fmu and model-exchange-fmu."""
LOGGER = "log-message"
"""What components import, of the interface callbacks. The world model-exchange-fmu has no intermediate updates, and in
those of co-simulation-fmu nothing can be read or set, because no component is entered while it calls its importer."""
NOT_OFFERED = (
    "providesIntermediateUpdate",
    "canReturnEarlyAfterIntermediateUpdate",
    "recommendedIntermediateInputSmoothness",
)
"""The capabilities of FMI 3.0 that such a component lacks for this reason. Libraries and sources beside it have them;
an importer of components sees by what these import whether they have them."""


@cache
def _text() -> str:
    return (resource_folder("templates") / "wasm" / "fmi3.wit").read_text("utf-8")


@cache
def interfaces() -> Mapping[str, WitInterface]:
    """The interfaces of the draft {short name: interface}."""
    from lag2fmu.fmu.wasm.wit import parse_wit

    return parse_wit(_text())


def commit() -> str:
    """The commit of the draft that the interfaces are of."""
    found = re.search(r"at commit ([0-9a-f]{40})", _text())
    assert found is not None, "fmi3.wit says its commit"
    return found[1]


def manifests() -> dict[str, bytes]:
    """{name in the archive: content} of the manifest."""
    head = {f"fmi-ls:fmi-ls-{what}": text for what, text in _HEAD.items()}
    content = document(ET.Element("fmiLayeredStandardManifest", {"xmlns:fmi-ls": SPACE, **head}))
    return dict.fromkeys(MANIFESTS, content)
