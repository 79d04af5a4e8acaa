"""Runs of FMUs in a process of their own: what takes that process down is a sentence here.

The process is a fork of this one, which takes milliseconds. Systems on which forks are not safe run FMUs in this one.
"""

from __future__ import annotations

import ctypes
import faulthandler
import os
import signal
import struct
import sys
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from lag2fmu.errors import Lag2FmuError, SimulationError
from lag2fmu.fmu.compilers import host_platform
from lag2fmu.fmu.pack import opened
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.instances import description_of, is_ours, state_of
from lag2fmu.verify.run import Run

FORKS = sys.platform == "linux"
"""Whether a process may be a fork of this one: libraries of macOS do not survive it, and Windows knows none."""
_LOADED = 1
"""The type of a part of an ELF file that is loaded (ELF-64 Object File Format, version 1.5, table 16)."""


def runs_apart(path: Path) -> bool:
    """Whether the FMU ``path`` is run in a process of its own: it is no build of ours, or not as it was built.

    Raises LoadError for a file that is no FMU.
    """
    return FORKS and not (is_ours(description_of(path)) and _is_whole(path, state_of(path)))


@lru_cache(maxsize=16)
def _is_whole(path: Path, state: object) -> bool:
    """Whether the libraries for this machine end where they say: a page that is missing kills whoever reads it.

    ``state`` is that of the file.
    """
    host = host_platform()
    with opened(path) as archive:
        names = [
            entry.filename
            for entry in archive.infolist()
            if entry.filename.startswith("binaries/") and entry.filename.endswith(host.suffix)
        ]
        folders = {*host.folders, *host.tuples}
        return all(_ends_right(archive.read(name)) for name in names if name.split("/")[1] in folders)


def _ends_right(data: bytes) -> bool:
    """Whether the parts of an ELF file that are loaded lie in it."""
    if len(data) < 64 or data[:5] != b"\x7fELF\x02":
        return False
    table, size, count = struct.unpack_from("<32xQ14xHH", data)
    if table + size * count > len(data):
        return False
    parts = (struct.unpack_from("<I4xQ16xQ", data, table + i * size) for i in range(count))
    return all(kind != _LOADED or begin + length <= len(data) for kind, begin, length in parts)


def run_apart(path: Path, run: Run, here: Callable[[Path, Run], Trajectory]) -> Trajectory:
    """What ``here``(path, run) gives in a process of its own.

    Raises what it raises, and SimulationError if the FMU takes the process down.
    """
    from multiprocessing import get_context

    fork = get_context("fork")
    receiver, sender = fork.Pipe(duplex=False)
    with tempfile.TemporaryDirectory(prefix="lag2fmu-", ignore_cleanup_errors=True) as folder:
        process = fork.Process(target=_child, args=(sender, folder, path, run, here))
        with warnings.catch_warnings():  # the child starts no threads and waits for no lock of others
            warnings.simplefilter("ignore", DeprecationWarning)
            process.start()
        sender.close()
        try:
            found = _heard(receiver, run)
            process.join()
        finally:
            process.kill()
            process.join()
    if isinstance(found, Trajectory):
        return found
    if found is None:
        raise SimulationError(
            f"'{path}': while it is simulated, {end_of(process.exitcode or 0) or 'it ends the process'}; "
            "'lag2fmu check' tells in which call"
        )
    raise found


def _child(sender: Any, folder: str, path: Path, run: Run, here: Callable[[Path, Run], Trajectory]) -> None:
    """What the process does: it tells what ``here`` does, gives and raises. Its temporary files are in ``folder``."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the other process ends this one
    faulthandler.disable()  # a crash is told by one sentence
    kept = _exiting_at_once()
    tempfile.tempdir = folder
    progress, warned = (lambda value, name=name: sender.send((name, value)) for name in ("progress", "warned"))
    try:
        sender.send(
            ("ended", here(path, replace(run, progress=run.progress and progress, warned=run.warned and warned)))
        )
    except Lag2FmuError as error:
        sender.send(("ended", error))
    sender.close()
    sys.stdout.flush()
    sys.stderr.flush()
    del kept
    os._exit(0)  # what else is to be done at an end is the other process's


def _exiting_at_once() -> object:
    """Let an FMU that calls ``exit`` end the process with its status, before any library's work at an end.

    That work is the other process's, and may crash in a fork. The result is to be kept as long as the process may end.
    """
    libc = ctypes.CDLL(None)
    handler = ctypes.CFUNCTYPE(None, ctypes.c_int, ctypes.c_void_p)(lambda status, _: os._exit(status & 0xFF))
    if hasattr(libc, "on_exit"):  # glibc has it, musl has not
        libc.on_exit(handler, None)
    return handler


def _heard(receiver: Any, run: Run) -> Trajectory | Lag2FmuError | None:
    """The outcome of the process; None if it ends without. On the way the listeners of ``run`` are told."""
    while True:
        try:
            name, value = receiver.recv()
        except EOFError:
            return None
        if name == "ended":
            return value  # type: ignore[no-any-return]
        getattr(run, name)(value)


def end_of(code: int) -> str:
    """How a process ended that was not stopped, by its exit ``code``, as a phrase; '' if well."""
    if code >= 0:
        return f"it ends the process with exit code {code & 0xFFFFFFFF:#x}" if code else ""
    try:
        name = signal.Signals(-code).name
    except ValueError:  # realtime signals have no names
        name = f"signal {-code}"
    return f"it crashes ({name})"
