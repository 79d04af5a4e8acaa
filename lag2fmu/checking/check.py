"""``check_fmu``: all rules, one after the other."""

from __future__ import annotations

from pathlib import Path

from lag2fmu.checking.archive import archive_findings, open_archive
from lag2fmu.checking.binaries import binary_findings, glibc_notes
from lag2fmu.checking.description import read_description
from lag2fmu.checking.files import file_findings
from lag2fmu.checking.findings import Finding, Findings
from lag2fmu.checking.header import header_findings
from lag2fmu.checking.isolated_run import run_findings
from lag2fmu.checking.schema import schema_findings
from lag2fmu.checking.structure import structure_findings
from lag2fmu.checking.variables import variable_findings
from lag2fmu.fmu.pack import DESCRIPTION


def check_fmu(path: str | Path, *, run: bool = True, timeout: float = 60.0) -> Findings:
    """Check the FMU ``path``, of any tool, by the rules of FMI 2.0: all problems, with rule, place and remedy.

    With ``run`` its library is run in a process of its own, where each trial may take ``timeout`` (s); that executes
    code of the FMU. Raises LoadError if ``path`` is no FMU of FMI 2.0 or is not safe to unpack. Nothing is written but
    a temporary folder that goes away at the end.
    """
    path = Path(path)
    archive = open_archive(path)
    description = read_description(archive.read(DESCRIPTION))
    in_xml = [
        *header_findings(description),
        *variable_findings(description),
        *structure_findings(description),
    ]
    found = any(f.severity == "error" for f in in_xml)
    findings: list[Finding] = [
        *archive_findings(archive),
        *schema_findings(path, found=found),
        *in_xml,
        *file_findings(archive, description),
        *binary_findings(archive, description),
    ]
    notes = glibc_notes(archive, description)
    if run:
        in_run, note = run_findings(archive, description, timeout)
        findings += in_run
        notes.append(note)
    else:
        notes.append("not run, as asked")
    findings.sort(key=lambda f: f.severity)  # errors come first, otherwise the order stays
    return Findings(path, tuple(dict.fromkeys(findings)), tuple(notes))
