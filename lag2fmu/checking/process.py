"""A process that is watched by the journal it keeps, and ended together with all processes that it starts.

An FMU may do anything in this process: hang, print without end, delete the journal's file, leave processes behind.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

MOST_WRITTEN = 10 << 20
"""Bytes in the journal or on standard output after which a process is ended."""
_MARK = "LAG2FMU_CHECK"
"""The environment variable by which the processes that a process has started are found."""
_START = 60.0
"""Time (s) for the process to start."""
_END = 5.0
"""Time (s) for all that it started to end."""


@dataclass(frozen=True)
class ChildRun:
    """How a process ended (a phrase, '' if well), its ``journal`` and what it ``printed``.

    Both are texts of MOST_WRITTEN bytes at most. ``stopped`` says that it was not let run on.
    """

    ended: str
    stopped: bool
    journal: str
    printed: str


def import_path() -> dict[str, str]:
    """The variable of the environment by which a process of Python finds the packages that this one finds."""
    return {"PYTHONPATH": os.pathsep.join(str(Path(place).absolute()) for place in sys.path)}


def watched(
    command: Sequence[str],
    folder: Path,
    journal: Path,
    environment: Mapping[str, str],
    timeout: float,
    total: float,
    follow: Callable[[str], None] | None = None,
) -> ChildRun:
    """Run ``command`` in ``folder`` until it ends, with all processes that it starts.

    It writes to the file ``journal``. It is killed when the journal stands still for ``timeout`` (s), when it takes
    longer than ``total`` (s), and when it writes too much. Python itself may take longer to start on a busy machine.
    ``follow`` is told the journal whenever it has grown.
    """
    mark = f"{_MARK}={uuid.uuid4().hex}"
    with journal.open("w+b") as told, journal.with_name("printed").open("w+b") as printed:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=printed,
            stderr=printed,
            cwd=folder,
            env=dict(environment) | dict([mark.split("=")]),
            start_new_session=True,  # a group of its own, where there are such
        )
        try:
            grown = (lambda: None) if follow is None else lambda: follow(_text(told))
            reason = _watch(process, told, printed, timeout, total, grown)
        finally:
            _kill(process)
            _kill_marked(mark.encode())
        return ChildRun(reason or end_of(process.returncode), bool(reason), _text(told), _text(printed))


def _watch(
    process: subprocess.Popen[bytes],
    told: BinaryIO,
    printed: BinaryIO,
    timeout: float,
    total: float,
    grown: Callable[[], None],
) -> str:
    """Why the process has to be ended, as a phrase; '' when it ended by itself. ``grown`` is called as it tells."""
    size, begun = 0, time.monotonic()
    since = begun
    while True:
        try:
            process.wait(0.02)
            if _size(told) != size:
                grown()
            return ""
        except subprocess.TimeoutExpired:
            pass
        now = _size(told)
        if now != size:
            size, since = now, time.monotonic()
            grown()
        allowed = timeout if size else max(timeout, _START)
        for length, most in ((time.monotonic() - since, allowed), (time.monotonic() - begun, total + _START)):
            if length > most:
                return f"it does not come back within {most:g} s"
        if max(now, _size(printed)) > MOST_WRITTEN:
            return "it prints without end"


def _kill(process: subprocess.Popen[bytes]) -> None:
    """End the process, if it runs, and all of its group."""
    if sys.platform == "win32":
        process.kill()
    else:
        with suppress(ProcessLookupError, PermissionError):  # nobody is left; macOS says so of zombies
            os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _kill_marked(mark: bytes) -> None:
    """End what left the group by a session of its own: on Linux, all processes that were born with ``mark``.

    One that is ended may have started another in the meantime, so this goes on until none is found, for some time.
    """
    ends = time.monotonic() + _END
    while time.monotonic() < ends:
        found = [place for place in Path("/proc").glob("[0-9]*") if mark in _environment(place).split(b"\0")]
        if not found:
            return
        for place in found:
            with suppress(ProcessLookupError):
                os.kill(int(place.name), signal.SIGKILL)


def _environment(place: Path) -> bytes:
    """The environment that the process at /proc/NUMBER was born with; empty of others' processes and of the dead."""
    try:
        return (place / "environ").read_bytes()
    except OSError:
        return b""


def _size(stream: BinaryIO) -> int:
    """The size of an open file, which may have lost its name."""
    return os.fstat(stream.fileno()).st_size


def _text(stream: BinaryIO) -> str:
    """The text in an open file, as far as it is looked at."""
    stream.seek(0)
    return stream.read(MOST_WRITTEN).decode("utf-8", "replace")


def end_of(code: int) -> str:
    """How a process ended that was not stopped, by its exit ``code``, as a phrase; '' if well."""
    if code >= 0:
        return f"it ends the process with exit code {code & 0xFFFFFFFF:#x}" if code else ""
    try:
        name = signal.Signals(-code).name
    except ValueError:  # realtime signals have no names
        name = f"signal {-code}"
    return f"it crashes ({name})"
