"""Runs of FMUs in a process of their own: what takes that process down is a sentence here.

The process is a fork of this one, which takes 20 ms. Systems on which forks are not safe run FMUs in this one.
"""

from __future__ import annotations

import ctypes
import faulthandler
import os
import signal
import sys
import tempfile
import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from lag2fmu.checking.process import end_of
from lag2fmu.errors import Lag2FmuError, SimulationError
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.instances import description_of, is_ours, state_of
from lag2fmu.verify.run import Run

FORKS = sys.platform == "linux"
"""Whether a process may be a fork of this one: libraries of macOS do not survive it, and Windows knows none."""
_DIES_WITH_PARENT = 1
"""PR_SET_PDEATHSIG of Linux: the signal that a process gets when its parent ends, even while it hangs in an FMU."""
_proven: set[tuple[object, ...]] = set()
"""The states of files of FMUs of ours that have come through a run."""


def runs_apart(path: Path) -> bool:
    """Whether the FMU ``path`` is run in a process of its own: it is no build of ours, or has not been run yet.

    A file may say that it is ours and be damaged; who has come through a run is whole. Raises LoadError for a file
    that is no FMU.
    """
    return FORKS and state_of(path) not in _proven


def came_through(path: Path) -> None:
    """The FMU ``path`` has come through a run in a process of its own."""
    if is_ours(description_of(path)):
        _proven.add(state_of(path))


def run_apart(
    path: Path, run: Run, here: Callable[[Path, Run], Trajectory], called: Callable[[], str] = lambda: ""
) -> Trajectory:
    """What ``here``(path, run) gives in a process of its own.

    Raises what it raises, and SimulationError if the FMU takes the process down; ``called`` tells which one of several.
    """
    from multiprocessing import get_context

    fork = get_context("fork")
    receiver, sender = fork.Pipe(duplex=False)
    with tempfile.TemporaryDirectory(prefix="lag2fmu-", ignore_cleanup_errors=True) as folder:
        process = fork.Process(target=_child, args=(sender, folder, path, run, here))
        start_process(process)
        sender.close()
        try:
            found = _heard(receiver, run)
            process.join()
        finally:
            end_process(process)
    if isinstance(found, Trajectory):
        return found
    if found is None:
        ended = end_of(process.exitcode or 0) or "it ends the process"
        raise SimulationError(
            f"'{path}': while {called() or 'it'} is simulated, {ended}; 'lag2fmu check' tells in which call"
        )
    raise found


def _child(sender: Any, folder: str, path: Path, run: Run, here: Callable[[Path, Run], Trajectory]) -> None:
    """What the process does: it tells what ``here`` does, gives and raises. Its temporary files are in ``folder``."""
    begin_process(folder)
    kept = _exiting_at_once()
    progress, warned, recorded = (
        lambda *values, name=name: sender.send((name, *values)) for name in ("progress", "warned", "recorded")
    )
    asked = replace(
        run,
        progress=run.progress and progress,
        warned=run.warned and warned,
        recorded=run.recorded and recorded,
    )
    try:
        sender.send(("ended", here(path, asked)))
    except Lag2FmuError as error:
        error.__cause__ = error.__context__ = (
            None  # with tblib, which dask installs, they would travel, but fmpy's cannot
        )
        sender.send(("ended", error))
    sender.close()
    sys.stdout.flush()
    sys.stderr.flush()
    del kept
    os._exit(0)  # what else is to be done at an end is the other process's


def start_process(process: Any) -> None:
    """Start a ``process`` that does ``begin_process`` first, also from a daemon, as a worker of dask is one.

    Daemons are refused children because nobody ends these with them, but this one ends with its parent.
    """
    from multiprocessing import current_process

    parent = current_process()
    if parent.daemon:
        parent.daemon = False
    with warnings.catch_warnings():  # the child starts no threads and waits for no lock of others
        warnings.simplefilter("ignore", DeprecationWarning)
        process.start()


def begin_process(folder: str) -> None:
    """What a process of FMUs does first. Its temporary files are in ``folder``, and it ends with its parent.

    It leads a group of processes, to which all belong that its FMUs start.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the other process ends this one
    faulthandler.disable()  # a crash is told by one sentence
    tempfile.tempdir = folder
    if hasattr(os, "setpgid"):
        os.setpgid(0, 0)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_DIES_WITH_PARENT, signal.SIGKILL)


def end_process(process: Any) -> None:
    """End a ``process`` that did ``begin_process``, if it still runs, and what its FMUs have started."""
    if hasattr(os, "killpg"):
        with suppress(ProcessLookupError, PermissionError):  # nobody is left; macOS says so of zombies
            os.killpg(process.pid, signal.SIGKILL)
    process.kill()  # where it has no group yet
    process.join()


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
            name, *values = receiver.recv()
        except EOFError:
            return None
        if name == "ended":
            return values[0]  # type: ignore[no-any-return]
        getattr(run, name)(*values)
