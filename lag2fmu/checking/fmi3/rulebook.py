"""The rules of FMI 3.0 as one record."""

from __future__ import annotations

import platform
from collections.abc import Iterator
from itertools import chain

from lag2fmu.checking.components import FOLDER, SUFFIX
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.fmi3.binding import FUNCTIONS
from lag2fmu.checking.fmi3.description import Description3
from lag2fmu.checking.fmi3.files import OLD_FOLDERS, STATIC_FOLDER, folder_findings
from lag2fmu.checking.fmi3.header import header_findings
from lag2fmu.checking.fmi3.session import Model3
from lag2fmu.checking.fmi3.structure import structure_findings
from lag2fmu.checking.fmi3.trials import trials_of
from lag2fmu.checking.fmi3.variables import variable_findings
from lag2fmu.checking.rulebook import Rulebook

_SUFFIXES = {
    f"{processor}-{system}": suffix
    for system, suffix, processors in (
        ("linux", ".so", "x86 x86_64 aarch32 aarch64"),
        ("windows", ".dll", "x86 x86_64 aarch64"),
        ("darwin", ".dylib", "x86_64 aarch64"),
    )
    for processor in processors.split()
} | {FOLDER: SUFFIX}
"""Platform tuple -> suffix of its libraries; that of the draft fmi-ls-wasm among them."""

_MACHINES = {"amd64": "x86_64", "arm64": "aarch64"}
"""What systems call a processor -> what platform tuples call it."""


def _description_findings(description: Description3) -> Iterator[Finding]:
    return chain(header_findings(description), variable_findings(description), structure_findings(description))


def _host_folders() -> tuple[str, ...]:
    """The folder in binaries/ whose libraries run on this machine."""
    machine = platform.machine().lower()
    return (f"{_MACHINES.get(machine, machine)}-{platform.system().lower()}",)


FMI3 = Rulebook(
    version="3.0",
    on_description=_description_findings,
    on_files=folder_findings,
    functions=dict.fromkeys(Description3.kinds_known, FUNCTIONS),
    headers=frozenset({"fmi3Functions.h", "fmi3FunctionTypes.h", "fmi3PlatformTypes.h"}),
    suffixes=_SUFFIXES,
    hosts=_host_folders,
    holds_no_library=lambda folder: folder in OLD_FOLDERS or bool(STATIC_FOLDER.fullmatch(folder)),
    model=Model3,
    trials=trials_of,
    sentences=(
        (r"^ERROR \(line", "schema", "follow the schema fmi3ModelDescription.xsd"),
        (r"not a legal variable name|contains an illegal", "name-grammar", "rename it, or use the convention 'flat'"),
    ),
    other_sentences="warning",  # fmpy stumbles over some attributes that are right
)
