"""The rules on the contents of an archive, without running anything of it: its XML, libraries, sources and bills.

Source: FMI 2.0.5, section 2.3; FMI 3.0.2, section 2.5.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from lag2fmu.archives import DESCRIPTION
from lag2fmu.checking.archive import Archive, archive_findings, open_archive
from lag2fmu.checking.bill import bill_findings
from lag2fmu.checking.binaries import binary_findings, glibc_notes
from lag2fmu.checking.description import FmuDescription, read_document
from lag2fmu.checking.findings import Finding, Severity
from lag2fmu.checking.rulebook import Rulebook
from lag2fmu.checking.rulebooks import rulebook_of
from lag2fmu.checking.schema import broken_schema, schema_findings
from lag2fmu.checking.versions import described
from lag2fmu.errors import LoadError
from lag2fmu.xml_tree import parse

_XML = {
    "sources/buildDescription.xml": "fmi3BuildDescription",
    "terminalsAndIcons/terminalsAndIcons.xml": "fmi3TerminalsAndIcons",
}
"""File -> its schema, which FMI 2.0.4 and later take from FMI 3.0."""


def findings_in(path: Path) -> tuple[list[Finding], list[str]]:
    """The findings on what the archive ``path`` holds, without running it, and notes. Raises LoadError."""
    archive, description, rules = read_archive(path)
    in_xml = list(rules.on_description(description))
    found = any(f.severity == "error" for f in in_xml)
    findings: list[Finding] = [
        *archive_findings(archive),
        *bill_findings(archive),
        *schema_findings(path, rules, found=found),
        *in_xml,
        *_file_findings(archive, description, rules),
        *binary_findings(archive, description, rules),
    ]
    return findings, glibc_notes(archive, description, rules)


def read_archive(path: Path) -> tuple[Archive, FmuDescription, Rulebook]:
    """The archive ``path``, its description and the rules of its version. Raises LoadError."""
    archive = open_archive(path)
    document = read_document(archive.read(DESCRIPTION))
    rules = rulebook_of(document)
    return archive, described(document), rules


def _file_findings(archive: Archive, description: FmuDescription, rules: Rulebook) -> Iterator[Finding]:
    """The broken rules on libraries and sources as files, and on the XML of the standard beside the description.

    Source: FMI 2.0.5 specification, section 2.3; FMI 3.0.2 specification, section 2.5.
    """
    yield from _libraries(archive, description, rules)
    for file in archive.below("sources"):
        if file.rsplit("/", 1)[-1] in rules.headers:
            problem = "a header of FMI; importers have their own, and this one may hide it"
            yield Finding("sources-header", file, problem, "leave it out, as the standard says", "warning")
    said = {f"documentation/externalDependencies.{end}" for end in ("txt", "html")} & archive.files
    if not said and any(description.can(kind, "needsExecutionTool") for kind in description.kinds):
        problem = "needsExecutionTool='true', and nothing says what is needed"
        remedy = "name tool and version in documentation/externalDependencies.txt"
        yield Finding("execution-tool", "documentation/", problem, remedy, "warning")
    found = list(rules.on_files(archive, description))
    yield from found
    for name in sorted(_XML.keys() & archive.files):
        said_before = any(f.severity == "error" and f.place.startswith(name) for f in found)
        yield from _xml(name, archive.read(name), whole=not said_before)


def _xml(name: str, content: bytes, *, whole: bool) -> Iterator[Finding]:
    """What is wrong in the form of the file ``name``; with the schema on the ``whole`` of it."""
    try:
        parse(content, name)
    except LoadError as error:
        yield Finding("xml", name, str(error), "write it anew")
        return
    for line, problem in broken_schema(content, _XML[name]) if whole else ():
        yield Finding("schema", f"{name}:{line}", problem, f"follow the schema {_XML[name]}.xsd")


def _libraries(archive: Archive, description: FmuDescription, rules: Rulebook) -> Iterator[Finding]:
    present = {parts[1] for name in archive.below("binaries") if len(parts := name.split("/")) > 2}
    if not present and not archive.below("sources"):
        problem = "there is neither a library nor a source"
        yield Finding("binaries-missing", "binaries/", problem, "put binaries/<platform>/<modelIdentifier>.<suffix> in")
    for folder in sorted(present):
        if rules.holds_no_library(folder):
            continue
        if folder not in rules.suffixes:
            problem = "importers know no such platform"
            yield Finding(
                "binary-folder", f"binaries/{folder}", problem, f"known are {', '.join(rules.suffixes)}", "warning"
            )
            continue
        for kind, identifier in description.identifiers.items():
            library = f"binaries/{folder}/{identifier}{rules.suffixes[folder]}"
            if library not in archive.files:
                problem = f"there is no {identifier}{rules.suffixes[folder]} for {kind}"
                found_by_windows = library.lower() in {n.lower() for n in archive.files} and library.endswith(".dll")
                severity: Severity = "warning" if found_by_windows else "error"
                remedy = "name the library as modelIdentifier says"
                yield Finding("binary-name", f"binaries/{folder}", problem, remedy, severity)
