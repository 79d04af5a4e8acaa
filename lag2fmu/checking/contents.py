"""The rules on the contents of an archive, without running anything of it."""

from __future__ import annotations

from pathlib import Path

from lag2fmu.archives import DESCRIPTION
from lag2fmu.checking.archive import Archive, archive_findings, open_archive
from lag2fmu.checking.bill import bill_findings
from lag2fmu.checking.binaries import binary_findings, glibc_notes
from lag2fmu.checking.description import FmuDescription, read_document
from lag2fmu.checking.files import file_findings
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.rulebook import Rulebook
from lag2fmu.checking.rulebooks import rulebook_of
from lag2fmu.checking.schema import schema_findings
from lag2fmu.checking.versions import described


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
        *file_findings(archive, description, rules),
        *binary_findings(archive, description, rules),
    ]
    return findings, glibc_notes(archive, description, rules)


def read_archive(path: Path) -> tuple[Archive, FmuDescription, Rulebook]:
    """The archive ``path``, its description and the rules of its version. Raises LoadError."""
    archive = open_archive(path)
    document = read_document(archive.read(DESCRIPTION))
    rules = rulebook_of(document)
    return archive, described(document), rules
