"""Rules on components for WebAssembly, which the draft layered standard fmi-ls-wasm puts beside libraries.

Source: https://github.com/modelica/fmi-ls-wasm, docs/index.adoc, sections "FMU Archive Format" and "Conformance".
"""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from pathlib import PurePosixPath

from lag2fmu.checking.archive import Archive
from lag2fmu.checking.description import FmuDescription
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.rulebook import Rulebook

FOLDER, SUFFIX = "wasm32-wasip2", ".wasm"
MANIFEST = "extra/org.modelica.fmi-ls-wasm/manifest.xml"
_MODULE, _COMPONENT = b"\0asm\1\0\0\0", b"\0asm\x0d\0\1\0"
"""How modules and components begin: the Component Model, design/mvp/Binary.md."""
_IMPORTS, _EXPORTS, _INSTANCE = 10, 11, 5
"""Numbers of sections of a component, and of a sort, from there."""
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
        if not data.startswith(_COMPONENT):
            found = "a module, which has no interfaces" if data.startswith(_MODULE) else "none that can be read"
            yield Finding("binary-format", name, f"is {found}", f"{FOLDER} wants a component of WebAssembly")
            continue
        stem = PurePosixPath(name).stem
        kinds = [kind for kind, identifier in description.identifiers.items() if identifier == stem]
        yield from _interface_findings(name, data, kinds)
        yield from token_findings(name, data, description)
    if names and MANIFEST not in archive.files:
        yield Finding("wasm-manifest", MANIFEST, f"is missing beside {names[0]}", "add the draft's manifest")


def _interface_findings(name: str, data: bytes, kinds: list[str]) -> Iterator[Finding]:
    exported, imported = _names(data, _EXPORTS), _names(data, _IMPORTS)
    for short in ("common", *(_INTERFACES[kind] for kind in kinds)):
        if not any(found.startswith(f"fmi:fmi3/{short}@3.") for found in exported):
            problem = f"does not export the interface fmi:fmi3/{short}"
            yield Finding("binary-functions", name, problem, "export all of the draft's world")
    for found in imported:
        if not found.startswith(_KNOWN):
            problem = f"imports '{found}', which not every importer has"
            yield Finding("binary-imports", name, problem, "build it in", "warning")


def _names(data: bytes, section: int) -> list[str]:
    """The names in the sections with imports or exports of a component.

    In a section all are read up to the first one that is no instance, whose description has another length.
    """
    found, stream = [], BytesIO(data[len(_COMPONENT) :])
    while number := stream.read(1):
        content = BytesIO(stream.read(_number(stream)))
        for _ in range(_number(content)) if number[0] == section else ():
            content.read(1)
            found.append(content.read(_number(content)).decode(errors="replace"))
            if _number(content) != _INSTANCE:
                break
            _number(content)
            if section == _EXPORTS and _number(content):
                content.read(1), _number(content)
    return found


def _number(stream: BytesIO) -> int:
    """A number of at most 32 bits in LEB128 without a sign; beyond the end there are zeros."""
    value = 0
    for shift in range(0, 35, 7):
        byte = int.from_bytes(stream.read(1), "little")
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            break
    return value


def token_findings(name: str, data: bytes, description: FmuDescription) -> Iterator[Finding]:
    """Whether the library ``name`` with these bytes holds the token of its description."""
    token = description.token.encode()
    if token.strip(b"{} ") and token.strip(b"{} ") not in data:
        problem = f"does not hold the {description.token_name} of modelDescription.xml as text"
        yield Finding("binary-guid", name, problem, "build library and description together", "warning")
