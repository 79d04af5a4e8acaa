"""Rules on folders and files that FMI 3.0 alone has: platforms, sources, documentation, manifests (section 2.5)."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import chain
from posixpath import normpath

from lag2fmu.checking.archive import Archive
from lag2fmu.checking.components import MANIFEST
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.fmi3.build import build_findings
from lag2fmu.checking.fmi3.description import Description3
from lag2fmu.checking.fmi3.terminals import terminal_findings
from lag2fmu.errors import LoadError
from lag2fmu.xml_tree import XmlElement, parse

OLD_FOLDERS = {
    "win32": "x86-windows",
    "win64": "x86_64-windows",
    "linux32": "x86-linux",
    "linux64": "x86_64-linux",
    "darwin64": "x86_64-darwin",
}
"""Folder of FMI 2.0 -> platform tuple."""

STATIC_FOLDER = re.compile(r"\w+-(darwin|linux|windows)-[a-z][a-z0-9_]*")
"""A folder for static libraries: the tuple with the name of an ABI."""

_MANIFEST_SPACE = "http://fmi-standard.org/fmi-ls-manifest"


def folder_findings(archive: Archive, description: Description3) -> Iterator[Finding]:
    """The broken rules on folders and files beside modelDescription.xml.

    Source: FMI 3.0.2 specification, sections 2.4.9, 2.4.10, 2.5.1 and 2.6.
    """
    rules = (_platforms, _documentation, _icons, build_findings, terminal_findings)
    yield from chain.from_iterable(rule(archive, description) for rule in rules)
    yield from _manifests(archive)


def _platforms(archive: Archive, description: Description3) -> Iterator[Finding]:
    folders = {parts[1] for name in archive.below("binaries") if len(parts := name.split("/")) > 2}
    for folder in sorted(folders & OLD_FOLDERS.keys()):
        problem = "the name of a platform in FMI 2.0; importers of FMI 3.0 do not look there"
        yield Finding("platform-tuple", f"binaries/{folder}", problem, f"name it {OLD_FOLDERS[folder]}")
    texts = {f"documentation/staticLinking.{end}" for end in ("txt", "html")}
    if any(map(STATIC_FOLDER.fullmatch, folders)) and not texts & archive.files:
        problem = "there are static libraries, but nothing says how to link them"
        yield Finding("static-linking", "documentation/staticLinking.txt", problem, "name compilers and options")


def _documentation(archive: Archive, description: Description3) -> Iterator[Finding]:
    entries = {f"documentation/licenses/license.{end}" for end in ("txt", "html", "spdx")}
    if archive.below("documentation/licenses") and not entries & archive.files:
        problem = "there is no entry point of the licenses"
        yield Finding("license", "documentation/licenses", problem, "add license.txt, license.html or license.spdx")
    if "documentation/diagram.svg" in archive.files and "documentation/diagram.png" not in archive.files:
        problem = "documentation/diagram.svg without diagram.png"
        yield Finding("diagram", "documentation/diagram.svg", problem, "add the same picture as PNG")


def _icons(archive: Archive, description: Description3) -> Iterator[Finding]:
    if "model.png" in archive.files:
        problem = "the place of the icon in FMI 2.0"
        yield Finding("icon", "model.png", problem, "move it to terminalsAndIcons/icon.png", "warning")
    if "terminalsAndIcons/icon.svg" in archive.files and "terminalsAndIcons/icon.png" not in archive.files:
        problem = "terminalsAndIcons/icon.svg without icon.png"
        yield Finding("icon", "terminalsAndIcons/icon.svg", problem, "add the same picture as PNG")


# ------------------------------------------------------------------------------------------------ layered standards


def _manifests(archive: Archive) -> Iterator[Finding]:
    """The manifests of layered standards: extra/<reverse domain>/fmi-ls-manifest.xml (section 2.6)."""
    for name in archive.below("extra"):
        if not name.endswith("/fmi-ls-manifest.xml") and name != MANIFEST:
            continue
        try:
            root = parse(archive.read(name), name).root
        except LoadError as error:
            yield Finding("xml", name, str(error), "write it anew")
            continue
        yield from _manifest(name, root)
        folder = name.rsplit("/", 1)[0]
        for related in root.all("Related"):
            source = normpath(f"{folder}/{related.get('source')}")
            if source not in archive.files:
                problem = f"names the file '{related.get('source')}', which is not there"
                yield Finding("manifest-source", f"{name}:{related.line}", problem, "put it beside the manifest")


def _manifest(name: str, root: XmlElement) -> Iterator[Finding]:
    """The three attributes of a manifest's root, in their namespace."""
    spaces = [key.removeprefix("xmlns:") for key, uri in root.attributes.items() if uri == _MANIFEST_SPACE]
    values = {
        what: next((root.get(f"{space}:{what}") for space in spaces if f"{space}:{what}" in root.attributes), None)
        for what in ("fmi-ls-name", "fmi-ls-version", "fmi-ls-description")
    }
    for what, value in values.items():
        if value is None:
            problem = f"its root has no {what} in the namespace {_MANIFEST_SPACE}"
            yield Finding("manifest", f"{name}:{root.line}", problem, "add the attribute", "warning")
    own, folder = values["fmi-ls-name"], name.split("/")[1]
    if own is not None and own != folder:
        problem = f"fmi-ls-name='{own}' in the folder extra/{folder}"
        yield Finding("manifest-name", f"{name}:{root.line}", problem, "name the folder as the standard", "warning")
