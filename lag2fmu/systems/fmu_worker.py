"""An FMU on a worker of an executor, which may be another machine or a container.

The worker gets the file and the address of this process, starts the FMU in a process of its own, and stays to end it:
when the run ends, or when this process is lost. Both sides prove to each other that they know a key, which travels with
the task; what they say is not encrypted.
"""

from __future__ import annotations

import hmac
import os
import shutil
import socket
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, Future
from concurrent.futures import wait as wait_for
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from lag2fmu.checking.process import end_of
from lag2fmu.errors import SimulationError
from lag2fmu.systems.fmu_process import PATIENCE, RemoteInstance, serve
from lag2fmu.verify.apart import FORKS, end_process, start_process

_QUEUE = 60.0
"""Time (s) within which a worker has to take an FMU."""
_TURN = 0.2
"""Time (s) after which an executor is asked again what became of the task."""
_ALIVE = {"TCP_KEEPIDLE": 10, "TCP_KEEPINTVL": 5, "TCP_KEEPCNT": 4}
"""When the other side is lost, in s and times: half a minute after a machine is switched off."""
_BYTES = 32
"""Of a key, of what a side is asked to prove that it knows the key, and of its answer."""
_NAME = "component.fmu"
_ELSEWHERE = ("192.0.2.1", 9)
"""An address of nobody (RFC 5737): nothing is sent there, but the system tells from where it would be."""
Address = tuple[str, int]


@contextmanager
def instance_on(
    executor: Executor, path: Path, kind: str, *, events: bool, followed: tuple[int, ...]
) -> Iterator[RemoteInstance]:
    """An instance of the FMU ``path`` on a worker of the ``executor``, which is free again when the context ends.

    See ``called_as_one`` for ``kind``, ``events`` and ``followed``. Raises SimulationError where no worker takes it, or
    it cannot be instantiated there.
    """
    key, content = os.urandom(_BYTES), path.read_bytes()
    with socket.create_server(("", 0)) as server:
        addresses = _addresses(server.getsockname()[1])
        try:
            future = executor.submit(host, addresses, key, content, kind, events, followed)
        except RuntimeError as error:  # the executor is broken or shut down
            raise SimulationError(f"the executor takes no FMU: {error}") from error
        try:
            connection, control = (_accepted(server, key, future) for _ in range(2))
        except BaseException:
            future.cancel()
            raise
    worker = _Worker(control, future, content)
    try:
        yield RemoteInstance(path, worker, connection, None)
    finally:
        with suppress(OSError):
            connection.send(None)
        worker.leave()
        _hang_up(connection)


class _Worker:
    """The process of an FMU on a worker, by the ``control`` connection to the task that has this ``future``."""

    def __init__(self, control: Any, future: Future[None], content: bytes) -> None:
        self._control, self._future = control, future
        self._folder: Path | None = None
        with suppress(EOFError, OSError):  # of a worker that is lost already the next call tells
            folder = Path(control.recv())
            if (folder / _NAME).read_bytes() == content:  # it is this machine's
                self._folder = folder

    def end(self) -> None:
        """The task ends the process when nobody is at the other end any more."""
        _hang_up(self._control)

    def ended(self) -> str:
        """How the process has ended, as the task tells; a task that is lost tells nothing."""
        with suppress(EOFError, OSError):
            if self._control.poll(PATIENCE):
                return end_of(self._control.recv()) or "it ends"
        return "its worker ends"

    def leave(self) -> None:
        """Let the process end by itself, and the task with it. Of a worker that was killed the files are removed."""
        with suppress(EOFError, OSError):
            self._control.poll(PATIENCE)
        self.end()
        wait_for([self._future], PATIENCE)
        if self._folder:  # a worker that was killed as it removed its files has left some of them
            shutil.rmtree(self._folder, ignore_errors=True)


def _accepted(server: socket.socket, key: bytes, future: Future[None]) -> Any:
    """A connection to the task that has this ``future``. Raises SimulationError if it does not come."""
    server.settimeout(_TURN)
    last = time.monotonic() + _QUEUE
    while time.monotonic() < last:
        try:
            taken, _ = server.accept()
        except TimeoutError:
            if future.done():
                error = future.exception()
                raise SimulationError(f"its worker ends: {type(error).__name__}: {error}") from error
            continue
        with suppress(OSError):  # of somebody else
            return _connection(taken, key, "run", "worker")
    raise SimulationError(
        f"no worker of the executor has taken the FMU in {_QUEUE:g} s; each FMU of the system needs a free worker, "
        "which can connect to this machine"
    )


def _connection(taken: socket.socket, key: bytes, own: str, other: str) -> Any:
    """The socket as a connection between two who know the ``key``, the ``own`` side and the ``other`` one.

    It notices when the other machine is lost. Raises OSError for somebody who does not know the key, or says nothing.
    """
    with taken:
        taken.settimeout(PATIENCE)
        asked = os.urandom(_BYTES)
        taken.sendall(asked)
        told = taken.recv(_BYTES, socket.MSG_WAITALL)
        taken.sendall(_proof(key, own, told))
        if not hmac.compare_digest(taken.recv(_BYTES, socket.MSG_WAITALL), _proof(key, other, asked)):
            raise ConnectionRefusedError("the other side does not know the key")
        taken.settimeout(None)
        taken.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for name, value in _ALIVE.items():
            if hasattr(socket, name):  # macOS has another name for the first one
                taken.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
        return Connection(taken.detach())


def _proof(key: bytes, side: str, asked: bytes) -> bytes:
    """What only a ``side`` that knows the ``key`` can answer to the bytes that it was ``asked``."""
    return hmac.digest(key, side.encode() + asked, "sha256")


def _hang_up(connection: Any) -> None:
    """End a connection, also where another process has a copy of it, as workers that were forked since."""
    if not connection.closed:
        with suppress(OSError), socket.socket(fileno=os.dup(connection.fileno())) as own:
            own.shutdown(socket.SHUT_RDWR)
        connection.close()


def _addresses(port: int) -> list[Address]:
    """Where a worker may find this ``port``: on this machine, in its network, by its name."""
    hosts = ["127.0.0.1"]
    with suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(_ELSEWHERE)
        hosts.append(probe.getsockname()[0])
    with suppress(OSError):
        hosts += socket.gethostbyname_ex(socket.gethostname())[2]
    return [(name, port) for name in dict.fromkeys(hosts)]


# ------------------------------------------------------------------------------------------------------ on the worker


def host(
    addresses: Sequence[Address], key: bytes, content: bytes, kind: str, events: bool, followed: tuple[int, ...]
) -> None:
    """The task: run the FMU that is this ``content`` in a process until it ends, or nobody needs it any more.

    Raises SimulationError if there is nobody at the ``addresses`` who knows the ``key``.
    """
    context: Any = get_context("fork" if FORKS else "spawn")
    with tempfile.TemporaryDirectory(prefix="lag2fmu-", ignore_cleanup_errors=True) as folder:
        path = Path(folder) / _NAME
        path.write_bytes(content)
        connection, control = (_connected(addresses, key) for _ in range(2))
        process = context.Process(target=serve, args=(connection, control, path, kind, folder, events, followed))
        start_process(process)
        connection.close()
        try:
            with suppress(OSError):  # of a run that is lost
                control.send(folder)
                if process.sentinel in wait([process.sentinel, control]):
                    process.join()
                    control.send(process.exitcode)
        finally:
            end_process(process)
            control.close()


def _connected(addresses: Sequence[Address], key: bytes) -> Any:
    """A connection to who waits for this task. Raises SimulationError if nobody does."""
    for address in addresses:
        with suppress(OSError):
            return _connection(socket.create_connection(address, timeout=PATIENCE), key, "worker", "run")
    raise SimulationError(f"the worker reaches the run at none of {', '.join(f'{a}:{port}' for a, port in addresses)}")
