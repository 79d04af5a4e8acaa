"""An FMU in a process of its own: its calls go there and back, and what takes that process down is an error here.

The process is a fork where forks are safe, else a new Python. It ends when the process of the run ends.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager, suppress
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Protocol

from lag2fmu.checking.process import end_of
from lag2fmu.errors import SimulationError
from lag2fmu.verify.apart import FORKS, begin_process, end_process, start_process
from lag2fmu.verify.hosted import hosted
from lag2fmu.verify.instances import Instance, Log, description_of, instance_of

Apart = bool | float | Executor
"""Whether each FMU has a process of its own, on an executor a worker; a number is the longest time (s) of a call."""
PATIENCE = 5.0
"""Seconds that a process has to end by itself."""


def patience_of(apart: Apart) -> float | None:
    """The longest time (s) of a call; None: it may take any time."""
    return None if isinstance(apart, bool | Executor) else apart


class RemoteCallError(Exception):
    """A call that failed in another process, as it would fail here; ``status``: of the FMU, where it gave one."""

    def __init__(self, words: str, status: int | None = None) -> None:
        super().__init__(words)
        self.status = status


class _Remote:
    """The calls of the FMU, by the names that fmpy gives them."""

    def __init__(self, call: Callable[..., Any]) -> None:
        self._call = call

    def __getattr__(self, name: str) -> Callable[..., Any]:
        return lambda *args, **kwargs: self._call(name, args, kwargs)


class Host(Protocol):
    """The process of an FMU, as this one knows it."""

    def end(self) -> None:
        """End it, and what it has started, if it still runs."""

    def ended(self) -> str:
        """A phrase that tells how it has ended."""


class _Child:
    """A ``process`` of this one."""

    def __init__(self, process: Any) -> None:
        self._process = process

    def end(self) -> None:
        end_process(self._process)

    def ended(self) -> str:
        self._process.join(PATIENCE)
        return end_of(self._process.exitcode or 0) or "it ends"


class RemoteInstance:
    """What an ``Instance`` is, in another process at the end of a ``connection``, the ``host``."""

    def __init__(self, path: Path, host: Host, connection: Any, patience: float | None) -> None:
        """Instantiate the FMU ``path``. Raises SimulationError if it cannot be instantiated.

        A call that takes longer than ``patience`` (s) ends the process; None: it may take any time.
        """
        self.description, self.log = description_of(path), Log()
        self.fmu = _Remote(self._call)
        self.asked: Callable[[float], None] | None = None
        self._host, self._connection, self._patience = host, connection, patience
        try:
            self.fmu.instantiate()  # what the process does first, whatever it is called
        except RemoteCallError as error:
            raise SimulationError(str(error)) from error

    def _call(self, name: str, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
        """The result of a call. Raises RemoteCallError if it fails, or if the process ends."""
        try:
            self._connection.send((name, args, kwargs))
            return self.answer()
        except (EOFError, OSError) as error:
            raise RemoteCallError(f"the process of the FMU is lost: {self._host.ended()}") from error

    def answer(self) -> Any:
        """What the process answers; on the way it may ask for inputs. Raises RemoteCallError if a call fails."""
        while True:
            if not self._connection.poll(self._patience):
                self._host.end()
                raise RemoteCallError(
                    f"the FMU does not come back from a call within {self._patience:g} s and is ended"
                )
            kind, value, status, *said = self._connection.recv()
            if kind == "asked":
                if self.asked is not None:
                    self.asked(value)
                self._connection.send(None)
                continue
            self.log.sentences += said[0]
            self.log.warnings += said[1]
            if kind == "failed":
                raise RemoteCallError(value, status)
            return value


@contextmanager
def called_as_one(path: Path, kind: str, *, events: bool, followed: tuple[int, ...]) -> Iterator[Instance]:
    """An instance of the FMU ``path`` by the ``kind`` of FMI, whose calls are those of co-simulation either way.

    See ``instance_of`` for ``events``, ``followed`` and errors.
    """
    with ExitStack() as opened:
        instance = opened.enter_context(instance_of(path, kind, events=events, followed=followed))
        if kind == "ModelExchange":
            opened.enter_context(hosted(instance))
        yield instance


@contextmanager
def instance_apart(
    path: Path, kind: str, *, events: bool, followed: tuple[int, ...], patience: float | None
) -> Iterator[RemoteInstance]:
    """An instance of the FMU ``path`` in a process of its own, which ends with the context.

    See ``called_as_one`` for ``kind``, ``events`` and ``followed``. A call that takes longer than ``patience`` (s)
    raises RemoteCallError; None: it may take any time. Raises SimulationError for one that cannot be instantiated.
    """
    context: Any = get_context("fork" if FORKS else "spawn")
    here, there = context.Pipe()
    with tempfile.TemporaryDirectory(prefix="lag2fmu-", ignore_cleanup_errors=True) as folder:
        process = context.Process(target=serve, args=(there, here, path, kind, folder, events, followed))
        start_process(process)
        there.close()
        try:
            yield RemoteInstance(path, _Child(process), here, patience)
        finally:
            with suppress(OSError):
                here.send(None)
            process.join(patience or PATIENCE)
            end_process(process)
            here.close()


def serve(
    connection: Any, other: Any, path: Path, kind: str, folder: str, events: bool, followed: tuple[int, ...]
) -> None:
    """What the process does: instantiate the FMU ``path``, then call by call, until nobody calls any more.

    Calls come by the ``connection``; the ``other`` one is not its own. Temporary files are in ``folder``.
    """
    other.close()
    begin_process(folder)
    try:
        connection.recv()
        with called_as_one(path, kind, events=events, followed=followed) as instance:
            connection.send(("done", None, None, [], []))
            server = _Server(connection, instance)
            instance.asked = server.ask
            while server.serve():
                pass
    except SimulationError as error:
        connection.send(("failed", str(error), None, [], []))
    except (EOFError, OSError):  # nobody calls any more
        pass
    os._exit(0)  # what else is to be done at an end is the other process's


class _Server:
    """Calls the FMU of an ``instance`` as the ``connection`` says."""

    def __init__(self, connection: Any, instance: Instance) -> None:
        self._connection, self._instance = connection, instance
        self._states: dict[int, Any] = {}
        self._told = [0, 0]

    def serve(self) -> bool:
        """Do one call, or go on where the FMU has asked; whether there was a call."""
        asked = self._connection.recv()
        if asked is None:
            return False
        name, args, kwargs = asked
        try:
            answer = "done", self._result(name, args, kwargs), None
        except Exception as error:  # fmpy raises bare exceptions
            answer = "failed", str(error), getattr(error, "status", None)
        log = self._instance.log
        new = [kept[n:] for kept, n in zip((log.sentences, log.warnings), self._told, strict=True)]
        self._told = [len(log.sentences), len(log.warnings)]
        self._connection.send((*answer, *new))
        return True

    def ask(self, t: float) -> None:
        """The FMU asks for its inputs at ``t`` (s) within a step: the calls that set them come before it goes on."""
        self._connection.send(("asked", t, None))
        while self.serve():
            pass

    def _result(self, name: str, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
        """The result of a call; states stay here, and go by number."""
        if name in ("setFMUState", "freeFMUState"):
            state = self._states[args[0]] if name == "setFMUState" else self._states.pop(args[0])
            return getattr(self._instance.fmu, name)(state)
        found = getattr(self._instance.fmu, name)(*args, **kwargs)
        if name != "getFMUState":
            return found
        number = max(self._states, default=0) + 1
        self._states[number] = found
        return number
