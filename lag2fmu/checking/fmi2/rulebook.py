"""The rules of FMI 2.0 as one record."""

from __future__ import annotations

import platform
from collections.abc import Iterator
from itertools import chain

from lag2fmu.checking.archive import Archive
from lag2fmu.checking.findings import Finding, Severity
from lag2fmu.checking.fmi2.description import Description2
from lag2fmu.checking.fmi2.header import header_findings
from lag2fmu.checking.fmi2.session import Model2
from lag2fmu.checking.fmi2.structure import structure_findings
from lag2fmu.checking.fmi2.trials import trials_of
from lag2fmu.checking.fmi2.variables import variable_findings
from lag2fmu.checking.rulebook import Rulebook

_DARWIN = ("aarch64-darwin", "darwin64")
_HOSTS = {
    ("Linux", "x86_64"): ("linux64",),
    ("Linux", "aarch64"): ("aarch64-linux",),
    ("Darwin", "x86_64"): _DARWIN,
    ("Darwin", "arm64"): _DARWIN,
    ("Windows", "AMD64"): ("win64",),
}
"""{(system, machine) by Python's ``platform``: folders in which importers there look}."""

_SUFFIXES = {
    "linux32": ".so",
    "linux64": ".so",
    "aarch32-linux": ".so",
    "aarch64-linux": ".so",
    "riscv64-linux": ".so",
    "x86-linux": ".so",
    "x86_64-linux": ".so",
    "win32": ".dll",
    "win64": ".dll",
    "aarch64-windows": ".dll",
    "x86-windows": ".dll",
    "x86_64-windows": ".dll",
    "darwin64": ".dylib",
    "aarch64-darwin": ".dylib",
    "x86_64-darwin": ".dylib",
}
"""Folder in binaries/ -> suffix of its libraries; the platform tuples of FMI 3 are in use for FMI 2 as well."""

_COMMON = (
    "GetTypesPlatform GetVersion SetDebugLogging Instantiate FreeInstance SetupExperiment EnterInitializationMode "
    "ExitInitializationMode Terminate Reset GetReal GetInteger GetBoolean GetString SetReal SetInteger SetBoolean "
    "SetString GetFMUstate SetFMUstate FreeFMUstate SerializedFMUstateSize SerializeFMUstate DeSerializeFMUstate "
    "GetDirectionalDerivative"
)
_OWN = {
    "ModelExchange": "EnterEventMode NewDiscreteStates EnterContinuousTimeMode CompletedIntegratorStep SetTime "
    "SetContinuousStates GetDerivatives GetEventIndicators GetContinuousStates GetNominalsOfContinuousStates",
    "CoSimulation": "SetRealInputDerivatives GetRealOutputDerivatives DoStep CancelStep GetStatus GetRealStatus "
    "GetIntegerStatus GetBooleanStatus GetStringStatus",
}
_FUNCTIONS = {kind: frozenset(f"fmi2{name}" for name in f"{_COMMON} {own}".split()) for kind, own in _OWN.items()}
"""Kind -> the functions its library must export, optional ones included (section 2.3)."""


_SENTENCES = (
    (r"^ERROR \(line", "schema", "follow the schema fmi2ModelDescription.xsd"),
    (r"has no start value", "start-missing", "give it a start value"),
    (r"must have variability != \"continuous\"", "variability", "only Reals are continuous; say 'discrete'"),
    (r"but provides a start value", "start-forbidden", "remove the start value"),
    (r"variable name .* is not unique", "name-duplicate", "give each variable a name of its own"),
    (r"not a legal variable name|contains an illegal", "name-grammar", "rename it, or use the convention 'flat'"),
)
"""What a sentence of fmpy contains, the rule it tells of, the remedy."""


def _description_findings(description: Description2) -> Iterator[Finding]:
    return chain(header_findings(description), variable_findings(description), structure_findings(description))


def _host_folders() -> tuple[str, ...]:
    """The folders in binaries/ whose libraries run on this machine; none where the machine is unknown."""
    return _HOSTS.get((platform.system(), platform.machine()), ())


def _sources(archive: Archive, description: Description2) -> Iterator[Finding]:
    files = [name.removeprefix("sources/") for name in archive.below("sources")]
    for kind, element in description.kinds.items():
        for file in sorted({f.get("name") for f in element.all("SourceFiles", "File")} - set(files)):
            problem = f"{kind} lists it as a source file, but it is not there"
            severity: Severity = "error" if files else "warning"  # without source files nobody reads the list
            yield Finding("source-missing", f"sources/{file}", problem, "put it in or take it off the list", severity)
        units = [file for file in files if file.endswith((".c", ".cpp", ".cc"))]
        if units and element.child("SourceFiles") is None and "buildDescription.xml" not in files:
            problem = f"{kind} does not list the sources, so that nobody knows what to compile"
            yield Finding("sources-unlisted", "sources/", problem, "list them as SourceFiles", "warning")


FMI2 = Rulebook(
    version="2.0",
    on_description=_description_findings,
    on_files=_sources,
    functions=_FUNCTIONS,
    headers=frozenset({"fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"}),
    suffixes=_SUFFIXES,
    hosts=_host_folders,
    holds_no_library=lambda folder: False,
    model=Model2,
    trials=trials_of,
    sentences=_SENTENCES,
    other_sentences="error",
)
