"""Running an FMU in a process of its own, so that a crash or a hang is a finding."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

from lag2fmu.checking.archive import DESCRIPTION, Archive
from lag2fmu.checking.catalogue import ESSENTIAL, trials_of
from lag2fmu.checking.description import Description
from lag2fmu.checking.files import host_folders, libraries
from lag2fmu.checking.findings import Finding
from lag2fmu.errors import SimulationError

_CHILD = "lag2fmu.checking.child"
_MOST_PRINTED = 10 << 20
"""Bytes on standard output after which a run is ended."""
_START = 60.0
"""Time (s) for the process to start."""


@dataclass
class _Progress:
    """What is to be tried, and what was found."""

    waiting: list[str]
    findings: list[Finding] = field(default_factory=list)
    printed: bool = False


def run_findings(archive: Archive, description: Description, timeout: float) -> tuple[list[Finding], str]:
    """The findings of a run of the FMU on this machine, and a note on what was run.

    ``timeout`` (s) is what a trial may take. The FMU is unpacked to a temporary folder that goes away at the end.
    Raises LoadError if it cannot be unpacked.
    """
    names = {
        kind: name
        for kind, identifier in description.identifiers.items()
        for name, platform in libraries(archive, description).items()
        if platform in host_folders() and PurePosixPath(name).stem == identifier
    }
    if not names:
        return [], "not run: there is no library for this machine"
    with tempfile.TemporaryDirectory(prefix="lag2fmu-", ignore_cleanup_errors=True) as temporary:
        folder = Path(temporary) / "fmu"
        beside = [n for library in names.values() for n in archive.below(str(PurePosixPath(library).parent))]
        archive.unpack([DESCRIPTION, *beside, *archive.below("resources")], folder)
        (folder / "resources").mkdir(exist_ok=True)
        progress = _Progress([f"{kind}: {trial}" for kind in names for trial in trials_of(kind)])
        count = len(progress.waiting)
        arguments = [f"{kind}={folder / name}" for kind, name in names.items()]
        once = any(description.can(kind, "canBeInstantiatedOnlyOncePerProcess") for kind in names)
        while progress.waiting:
            _one_process(folder, arguments, progress, timeout, once=once)
    if progress.printed:
        problem = "prints to standard output or standard error"
        finding = Finding("prints", "library", problem, "use the logger that the importer gives", "warning")
        progress.findings.append(finding)
    note = f"run on this machine: {', '.join(names)}; {count} trials"
    return _for_tools(description, list(dict.fromkeys(progress.findings))), note


def _for_tools(description: Description, findings: list[Finding]) -> list[Finding]:
    """The findings, where the FMU needs a tool: that it does not start without it is no error."""
    if not any(description.can(kind, "needsExecutionTool") for kind in description.kinds):
        return findings
    excused = {"load", "refused"}
    return [
        Finding(f.rule, f.place, f"{f.problem} (the FMU says it needs a tool)", f.remedy, "warning")
        if f.rule in excused
        else f
        for f in findings
    ]


def _one_process(folder: Path, arguments: list[str], progress: _Progress, timeout: float, *, once: bool) -> None:
    """Start a process for the trials that wait, and take from the list what it did."""
    journal, printed, labels = (folder.parent / name for name in ("journal", "printed", "labels"))
    journal.write_bytes(b"")
    labels.write_text("\n".join(progress.waiting[:1] if once else progress.waiting), "utf-8")
    command = [sys.executable, "-m", _CHILD, str(folder), str(journal), str(labels), *arguments]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(str(Path(place).absolute()) for place in sys.path)}
    with printed.open("wb") as stream:
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=stream, stderr=stream, cwd=folder.parent, env=environment
        )
        ended = _watch(process, journal, printed, timeout)
    records = [json.loads(line) for line in journal.read_text("utf-8").splitlines() if line.endswith("}")]
    _read_journal(records, progress)
    begun = [r["begin"] for r in records if "begin" in r]
    if not begun:
        said = printed.read_text("utf-8", "replace").strip()
        raise SimulationError(f"the process for running the FMU could not start: {ended}; {said[-500:]}")
    progress.printed |= printed.stat().st_size > 0
    if begun[-1] in progress.waiting:
        _fell(begun[-1], ended, printed, progress)


def _watch(process: subprocess.Popen[bytes], journal: Path, printed: Path, timeout: float) -> str:
    """How the process ended, '' if well; it is killed when the journal stands still for ``timeout`` (s).

    Python itself may take longer to start on a busy machine.
    """
    size, since = 0, time.monotonic()
    while True:
        try:
            code = process.wait(0.02)
            break
        except subprocess.TimeoutExpired:
            pass
        now = journal.stat().st_size
        if now != size:
            size, since = now, time.monotonic()
        allowed = timeout if size else max(timeout, _START)
        stuck = time.monotonic() - since > allowed
        if stuck or printed.stat().st_size > _MOST_PRINTED:
            process.kill()
            process.wait()
            return f"it does not come back within {allowed:g} s" if stuck else "it prints without end"
    if code < 0:
        return f"it crashes ({signal.Signals(-code).name})"
    return f"it ends the process with exit code {code & 0xFFFFFFFF:#x}" if code else ""


def _read_journal(records: list[dict[str, Any]], progress: _Progress) -> None:
    """Take findings and finished trials from the journal."""
    for record in records:
        if "finding" in record:
            progress.findings.append(Finding(**record["finding"]))
        elif "end" in record:
            _drop(record["end"], progress, rest=record["failed"])


def _drop(label: str, progress: _Progress, *, rest: bool) -> None:
    """Take ``label`` off the list and, if it is essential and failed, the rest of its kind."""
    kind, name = label.split(": ", 1)
    progress.waiting.remove(label)
    if rest and name in ESSENTIAL:
        progress.waiting = [w for w in progress.waiting if not w.startswith(f"{kind}: ")]


def _fell(label: str, ended: str, printed: Path, progress: _Progress) -> None:
    """The trial ``label`` took the process down."""
    kind, name = label.split(": ", 1)
    hangs = "come back" in ended or "without end" in ended
    last = printed.read_text("utf-8", "replace").strip().splitlines()[-1:] if printed.stat().st_size else []
    shown = f"; its last words: {last[0][:200]}" if last else ""
    rule = "hang" if hangs else "crash"
    problem = f"in the trial '{name}', {ended or 'it ends the process'}{shown}"
    progress.findings.append(Finding(rule, kind, problem, "run this call sequence under a debugger"))
    _drop(label, progress, rest=True)
    if hangs:
        progress.waiting = [w for w in progress.waiting if not w.startswith(f"{kind}: ")]
