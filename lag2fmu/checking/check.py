"""``check_fmu``: all rules, one after the other."""

from __future__ import annotations

from pathlib import Path

from lag2fmu.checking.archive import archive_findings, open_archive
from lag2fmu.checking.binaries import binary_findings, glibc_notes
from lag2fmu.checking.description import read_document
from lag2fmu.checking.files import file_findings
from lag2fmu.checking.findings import Finding, Findings
from lag2fmu.checking.isolated_run import run_findings
from lag2fmu.checking.rulebooks import rulebook_of
from lag2fmu.checking.schema import schema_findings
from lag2fmu.fmu.pack import DESCRIPTION


def check_fmu(path: str | Path, *, run: bool = True, timeout: float = 60.0) -> Findings:
    """Check the FMU ``path``, of any tool, by the rules of its version: all problems, with rule, place and remedy.

    With ``run`` its library is run in a process of its own, where each trial may take ``timeout`` (s); that executes
    code of the FMU. Raises LoadError if ``path`` is no FMU of FMI 2.0 or 3.0 or is not safe to unpack. Nothing is
    written but a temporary folder that goes away at the end.
    """
    path = Path(path)
    archive = open_archive(path)
    document = read_document(archive.read(DESCRIPTION))
    rules = rulebook_of(document)
    description = rules.describe(document)
    in_xml = list(rules.on_description(description))
    found = any(f.severity == "error" for f in in_xml)
    findings: list[Finding] = [
        *archive_findings(archive),
        *schema_findings(path, rules, found=found),
        *in_xml,
        *file_findings(archive, description, rules),
        *binary_findings(archive, description, rules),
    ]
    notes = glibc_notes(archive, description, rules)
    if run:
        in_run, note = run_findings(archive, description, rules, timeout)
        findings += in_run
        notes.append(note)
    else:
        notes.append("not run, as asked")
    findings.sort(key=lambda f: f.severity)  # errors come first, otherwise the order stays
    return Findings(path, tuple(dict.fromkeys(findings)), tuple(notes))
