"""Rules on components for WebAssembly, which the draft layered standard fmi-ls-wasm puts beside libraries.

Source: https://github.com/modelica/fmi-ls-wasm, docs/index.adoc, sections "FMU Archive Format" and "Conformance".
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import PurePosixPath

from lag2fmu.checking.archive import Archive
from lag2fmu.checking.description import FmuDescription
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.rulebook import Rulebook
from lag2fmu.fmu.wasm.binary import COMPONENT, MODULE, ByteReader, sections
from lag2fmu.fmu.wasm.draft import FOLDER, MANIFEST

SUFFIX = ".wasm"
_INTERFACES = {
    "CoSimulation": "co-simulation",
    "ModelExchange": "model-exchange",
    "ScheduledExecution": "scheduled-execution",
}
_KNOWN = ("fmi:fmi3/", "wasi:")
"""Importers provide the interfaces of these packages."""


def component_findings(archive: Archive, description: FmuDescription, rules: Rulebook) -> Iterator[Finding]:
    """The broken rules on the component that bears the name of the model, and on the manifest that belongs to it."""
    names = [name for name, folder in rules.libraries(archive, description).items() if folder == FOLDER]
    for name in names:
        data = archive.read(name)
        if not data.startswith(COMPONENT):
            found = "a module, which has no interfaces" if data.startswith(MODULE) else "none that can be read"
            yield Finding("binary-format", name, f"is {found}", f"{FOLDER} wants a component of WebAssembly")
            continue
        stem = PurePosixPath(name).stem
        kinds = [kind for kind, identifier in description.identifiers.items() if identifier == stem]
        yield from _interface_findings(name, data, kinds)
        yield from token_findings(name, data, description)
    if names and MANIFEST not in archive.files:
        yield Finding("wasm-manifest", MANIFEST, f"is missing beside {names[0]}", "add the draft's manifest")


def _interface_findings(name: str, data: bytes, kinds: list[str]) -> Iterator[Finding]:
    exported, imported = _names(data, 11), _names(data, 10)
    for short in ("common", *(_INTERFACES[kind] for kind in kinds)):
        if not any(found.startswith(f"fmi:fmi3/{short}@3.") for found in exported):
            problem = f"does not export the interface fmi:fmi3/{short}"
            yield Finding("binary-functions", name, problem, "export all of the draft's world")
    for found in imported:
        if not found.startswith(_KNOWN):
            problem = f"imports '{found}', which not every importer has"
            yield Finding("binary-imports", name, problem, "build it in", "warning")


def _names(data: bytes, section: int) -> list[str]:
    """The names in the sections with imports (10) or exports (11) of a component.

    In a section all are read up to the first one that is no instance, whose description has another length.
    """
    found = []
    for content in sections(data, section):
        rest = ByteReader(content)
        for _ in range(rest.number()):
            rest.byte()
            found.append(rest.name())
            sort = rest.byte()
            if sort != 5:
                break
            rest.number()
            if section == 11 and rest.byte():
                rest.byte(), rest.number()
    return found


def token_findings(name: str, data: bytes, description: FmuDescription) -> Iterator[Finding]:
    """Whether the library ``name`` with these bytes holds the token of its description."""
    token = description.token.encode()
    if token.strip(b"{} ") and token.strip(b"{} ") not in data:
        problem = f"does not hold the {description.token_name} of modelDescription.xml as text"
        yield Finding("binary-guid", name, problem, "build library and description together", "warning")
