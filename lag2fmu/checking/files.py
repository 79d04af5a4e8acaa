"""Rules on what the archive holds beside modelDescription.xml: libraries, sources, other XML (section 2.3)."""

from __future__ import annotations

from collections.abc import Iterator

from lag2fmu.checking.archive import Archive
from lag2fmu.checking.description import Description
from lag2fmu.checking.findings import Finding, Severity
from lag2fmu.errors import BuildError, LoadError
from lag2fmu.fmu.compilers import host_platform
from lag2fmu.xml_tree import parse

SUFFIXES = {
    "linux32": ".so",
    "linux64": ".so",
    "aarch32-linux": ".so",
    "aarch64-linux": ".so",
    "x86_64-linux": ".so",
    "win32": ".dll",
    "win64": ".dll",
    "aarch64-windows": ".dll",
    "x86_64-windows": ".dll",
    "darwin64": ".dylib",
    "aarch64-darwin": ".dylib",
    "x86_64-darwin": ".dylib",
}
"""Folder in binaries/ -> suffix of its libraries; the platform tuples of FMI 3 are in use for FMI 2 as well."""

_HEADERS = {"fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"}
_XML = ("sources/buildDescription.xml", "terminalsAndIcons/terminalsAndIcons.xml")


def file_findings(archive: Archive, description: Description) -> Iterator[Finding]:
    """The broken rules on libraries and sources as files, and on the XML of the standard beside the description.

    Source: FMI 2.0.5 specification, section 2.3.
    """
    yield from _libraries(archive, description)
    yield from _sources(archive, description)
    for name in _XML:
        if name in archive.files:
            try:
                parse(archive.read(name), name)
            except LoadError as error:
                yield Finding("xml", name, str(error), "write it anew")
    said = {f"documentation/externalDependencies.{end}" for end in ("txt", "html")} & archive.files
    if not said and any(description.can(kind, "needsExecutionTool") for kind in description.kinds):
        problem = "needsExecutionTool='true', and nothing says what is needed"
        remedy = "name tool and version in documentation/externalDependencies.txt"
        yield Finding("execution-tool", "documentation/", problem, remedy, "warning")


def libraries(archive: Archive, description: Description) -> dict[str, str]:
    """The libraries that importers would load: name in the archive -> folder in binaries/.

    Source: FMI 2.0.5 specification, section 2.3.
    """
    found = {}
    for folder, suffix in SUFFIXES.items():
        for identifier in description.identifiers.values():
            name = f"binaries/{folder}/{identifier}{suffix}"
            if name in archive.files:
                found[name] = folder
    return found


def host_folders() -> tuple[str, ...]:
    """The folders in binaries/ whose libraries run on this machine; none where the machine is unknown."""
    try:
        return host_platform().folders
    except BuildError:
        return ()


def _libraries(archive: Archive, description: Description) -> Iterator[Finding]:
    present = {parts[1] for name in archive.below("binaries") if len(parts := name.split("/")) > 2}
    if not present and not archive.below("sources"):
        problem = "there is neither a library nor a source"
        yield Finding("binaries-missing", "binaries/", problem, "put binaries/<platform>/<modelIdentifier>.<suffix> in")
    for folder in sorted(present):
        if folder not in SUFFIXES:
            problem = "importers know no such platform"
            yield Finding("binary-folder", f"binaries/{folder}", problem, f"known are {', '.join(SUFFIXES)}", "warning")
            continue
        for kind, identifier in description.identifiers.items():
            library = f"binaries/{folder}/{identifier}{SUFFIXES[folder]}"
            if library not in archive.files:
                problem = f"there is no {identifier}{SUFFIXES[folder]} for {kind}"
                found_by_windows = library.lower() in {n.lower() for n in archive.files} and library.endswith(".dll")
                severity: Severity = "warning" if found_by_windows else "error"
                remedy = "name the library as modelIdentifier says"
                yield Finding("binary-name", f"binaries/{folder}", problem, remedy, severity)


def _sources(archive: Archive, description: Description) -> Iterator[Finding]:
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
    for file in files:
        if file.rsplit("/", 1)[-1] in _HEADERS:
            problem = "a header of FMI; importers have their own, and this one may hide it"
            yield Finding("sources-header", f"sources/{file}", problem, "leave it out, as the standard says", "warning")
