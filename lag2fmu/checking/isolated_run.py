"""Running an FMU in a process of its own, so that a crash or a hang is a finding."""

from __future__ import annotations

import json
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields
from pathlib import Path, PurePosixPath
from typing import Any

from lag2fmu.archives import DESCRIPTION
from lag2fmu.checking.archive import Archive
from lag2fmu.checking.description import FmuDescription
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.process import ChildRun, import_path, watched
from lag2fmu.checking.rulebook import Rulebook
from lag2fmu.checking.trials import ESSENTIAL
from lag2fmu.errors import SimulationError

_CHILD = "lag2fmu.checking.child"
TIME_LIMIT = 30.0
"""What a trial of an FMU may take by default (s); trials of FMUs at work take some seconds at most."""


@dataclass
class _Progress:
    """What is to be tried, and what was found; ``tell`` hears the share that is done, 0 to 1."""

    waiting: list[str]
    tell: Callable[[float], None] | None
    count: int = field(init=False)
    findings: list[Finding] = field(default_factory=list)
    printed: bool = False
    deleted: bool = False

    def __post_init__(self) -> None:
        """Count what is to be tried."""
        self.count = len(self.waiting)

    def follow(self, journal: str) -> None:
        """Tell how far it is, from what the process has written so far."""
        if self.tell is None:
            return
        ended = sum(record.get("end") in self.waiting for record in _records(journal))
        self.tell((self.count - len(self.waiting) + ended) / self.count)


def run_findings(
    archive: Archive,
    description: FmuDescription,
    rules: Rulebook,
    time_limit: float,
    tell: Callable[[float], None] | None = None,
) -> tuple[list[Finding], str]:
    """The findings of a run of the FMU on this machine, and a note on what was run.

    ``time_limit`` (s) is what a trial may take; ``tell`` hears the share of the trials that is done, 0 to 1. The FMU is
    unpacked to a temporary folder that goes away at the end.
    Raises LoadError if it cannot be unpacked.
    """
    names = _libraries_of_host(archive, description, rules)
    if not names:
        return [], "not run: there is no library for this machine"
    with tempfile.TemporaryDirectory(prefix="lag2fmu-", ignore_cleanup_errors=True) as temporary:
        folder = Path(temporary) / "fmu"
        beside = [n for library in names.values() for n in archive.below(str(PurePosixPath(library).parent))]
        files = [DESCRIPTION, *beside, *archive.below("resources")]
        progress = _Progress([f"{kind}: {trial}" for kind in names for trial in rules.trials(kind)], tell)
        arguments = [f"{kind}={folder / name}" for kind, name in names.items()]
        once = any(description.can(kind, "canBeInstantiatedOnlyOncePerProcess") for kind in names)
        while progress.waiting:
            if not (folder / DESCRIPTION).is_file():
                archive.unpack(files, folder)
                (folder / "resources").mkdir(exist_ok=True)
            _one_process(folder, arguments, progress, time_limit, once=once)
            progress.deleted |= not (folder / DESCRIPTION).is_file()
    found = [*progress.findings, *_side_effects(progress)]
    note = (
        f"run on this machine: {', '.join(names)}; {progress.count} trials of {time_limit:g} s at most (--time-limit)"
    )
    return _for_tools(description, list(dict.fromkeys(found))), note


def _libraries_of_host(archive: Archive, description: FmuDescription, rules: Rulebook) -> dict[str, str]:
    """{kind of FMU: name in the archive} of the libraries that this machine can load."""
    return {
        kind: name
        for kind, identifier in description.identifiers.items()
        for name, platform in rules.libraries(archive, description).items()
        if platform in rules.hosts() and PurePosixPath(name).stem == identifier
    }


def _side_effects(progress: _Progress) -> Iterator[Finding]:
    """What the library did to its surroundings."""
    if progress.deleted:
        problem, remedy = "deletes the folder that it was unpacked to", "leave the folder of the importer as it is"
        yield Finding("environment", "library", problem, remedy)
    if progress.printed:
        problem = "prints to standard output or standard error"
        yield Finding("prints", "library", problem, "use the logger that the importer gives", "warning")


def _for_tools(description: FmuDescription, findings: list[Finding]) -> list[Finding]:
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


def _one_process(folder: Path, arguments: list[str], progress: _Progress, time_limit: float, *, once: bool) -> None:
    """Start a process for the trials that wait, and take from the list what it did."""
    journal, listed = (folder.parent / name for name in ("journal", "labels"))
    labels = progress.waiting[:1] if once else list(progress.waiting)
    listed.write_text("\n".join(labels), "utf-8")
    command = [sys.executable, "-m", _CHILD, str(folder), str(journal), str(listed), *arguments]
    environment = os.environ | import_path()
    done = watched(command, folder.parent, journal, environment, time_limit, time_limit * len(labels), progress.follow)
    records = list(_records(done.journal))
    begun = [r["begin"] for r in records if r.get("begin") in labels]
    _read_journal(records, progress)
    if not begun:
        raise SimulationError(f"the process for running the FMU could not start: {done.ended}; {done.printed[-500:]}")
    progress.printed |= bool(done.printed)
    if begun[-1] in progress.waiting:
        _fell(begun[-1], done, progress)


def _records(journal: str) -> Iterator[dict[str, Any]]:
    """The records of a journal; lines that the FMU wrote into it are left out."""
    for line in journal.splitlines():
        try:
            record = json.loads(line)
        except (ValueError, RecursionError):
            continue
        if isinstance(record, dict) and all(isinstance(record.get(key, ""), str) for key in ("begin", "end")):
            yield record


def _read_journal(records: list[dict[str, Any]], progress: _Progress) -> None:
    """Take findings and finished trials from the journal."""
    keys = {f.name for f in fields(Finding)}
    for record in records:
        found = record.get("finding")
        if isinstance(found, dict) and found.keys() == keys and all(isinstance(text, str) for text in found.values()):
            progress.findings.append(Finding(**found))
        elif record.get("end") in progress.waiting:
            _drop(record["end"], progress, rest=bool(record.get("failed")))


def _drop(label: str, progress: _Progress, *, rest: bool) -> None:
    """Take ``label`` off the list and, if it is essential and failed, the rest of its kind."""
    kind, name = label.split(": ", 1)
    progress.waiting.remove(label)
    if rest and name in ESSENTIAL:
        progress.waiting = [w for w in progress.waiting if not w.startswith(f"{kind}: ")]


def _fell(label: str, done: ChildRun, progress: _Progress) -> None:
    """The trial ``label`` took the process down."""
    kind, name = label.split(": ", 1)
    last = done.printed.strip().splitlines()[-1:]
    shown = f"; its last words: {last[0][:200]}" if last else ""
    rule = "hang" if done.stopped else "crash"
    problem = f"in the trial '{name}', {done.ended or 'it ends the process'}{shown}"
    slow = "give a larger time limit if it is slow, else " if done.stopped else ""
    progress.findings.append(Finding(rule, kind, problem, f"{slow}run this call sequence under a debugger"))
    _drop(label, progress, rest=True)
    if done.stopped:
        progress.waiting = [w for w in progress.waiting if not w.startswith(f"{kind}: ")]
