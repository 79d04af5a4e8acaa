"""Rules that read an archive, done in a process of its own with bounds of time and memory.

``python -m lag2fmu.checking.apart ARCHIVE JOURNAL`` is that process. Small archives take little time whatever they
hold, so only archives of larger sizes are read apart.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

from lag2fmu.archives import opened
from lag2fmu.checking.binding import bounded
from lag2fmu.checking.contents import findings_in
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.process import import_path, watched
from lag2fmu.errors import LoadError

MOST_TIME = 60.0
"""Time (s) that the rules on what an archive holds may take."""
_LARGE_FILE, _LARGE_CONTENT = 4 << 20, 16 << 20
"""Bytes of an archive, and of all that it holds, above which it is read apart."""

_MOST_FINDINGS = 2000
"""The most findings that the process tells, errors first."""


def is_large(path: Path) -> bool:
    """Whether reading the archive ``path`` may take long. Raises LoadError if it cannot be opened."""
    if path.is_file() and path.stat().st_size > _LARGE_FILE:
        return True
    with opened(path) as archive:
        return sum(entry.file_size for entry in archive.infolist()) > _LARGE_CONTENT


def findings_apart(path: Path) -> tuple[list[Finding], list[str]]:
    """The findings and notes of ``findings_in`` for ``path``, found in another process.

    Raises LoadError as ``findings_in`` does, and if the process takes more than MOST_TIME (s), or too much memory.
    """
    with tempfile.TemporaryDirectory(prefix="lag2fmu-", ignore_cleanup_errors=True) as temporary:
        folder = Path(temporary)
        journal = folder / "journal"
        command = [sys.executable, "-m", "lag2fmu.checking.apart", str(path.absolute()), str(journal)]
        done = watched(command, folder, journal, os.environ | import_path(), MOST_TIME, MOST_TIME)
    records = [json.loads(line) for line in done.journal.splitlines()] if not done.ended else []
    for record in records:
        if "refused" in record:
            raise LoadError(record["refused"])
    if not records or "notes" not in records[-1]:
        raise LoadError(f"'{path}': reading it was given up, as no FMU needs so much: {done.ended}")
    return [Finding(**record["finding"]) for record in records[:-1]], records[-1]["notes"]


def _told(path: Path) -> Iterator[object]:
    """The lines of the journal on the archive ``path``."""
    try:
        findings, notes = findings_in(path)
    except LoadError as error:
        yield {"refused": str(error)}
    except MemoryError:
        yield {"refused": f"'{path}': reading it takes more memory than any FMU needs"}
    else:
        findings.sort(key=lambda f: f.severity)
        if len(findings) > _MOST_FINDINGS:
            notes.append(f"{len(findings) - _MOST_FINDINGS} findings more are left out")
        yield from ({"finding": asdict(finding.shortened())} for finding in findings[:_MOST_FINDINGS])
        yield {"notes": notes}


if __name__ == "__main__":
    bounded()
    with Path(sys.argv[2]).open("a", encoding="utf-8") as stream:
        for told in _told(Path(sys.argv[1])):
            stream.write(json.dumps(told) + "\n")
