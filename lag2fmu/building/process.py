"""Compilers as processes: they find their cache, and end with whoever started them."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import IO, NamedTuple
from uuid import uuid4

from lag2fmu.building.folders import cache_folder, refusal, say_once
from lag2fmu.errors import BuildError
from lag2fmu.progress import telling

CACHE = "ZIG_GLOBAL_CACHE_DIR"
"""Zig's own variable for the folder of its cache; who sets it decides."""
_OBJECTS = "ZIG_LOCAL_CACHE_DIR"

_SUPERVISOR = str(Path(__file__).with_name("supervisor.py"))
_LOCKS = Path("/proc/locks")
"""Linux's list of locks; a line with an arrow is a process that waits."""
_WEEK = 7 * 24 * 3600
_WATCHED = 1.0
"""Seconds between two looks at a running compiler."""

_running: set[subprocess.Popen[bytes]] = set()
_interrupted = threading.Event()


class Result(NamedTuple):
    """How a command ended: its exit code and what it wrote."""

    code: int
    output: str
    errors: str


@lru_cache(maxsize=1)
def zig() -> str:
    """The path of the installed zig; raises BuildError if there is none."""
    found = find_spec("ziglang")
    if found is None or not found.submodule_search_locations:
        raise BuildError("the compiler zig is not installed; run 'pip install ziglang', or use --compiler host")
    return str(Path(found.submodule_search_locations[0], "zig.exe" if os.name == "nt" else "zig"))


@lru_cache(maxsize=1)
def zig_version() -> str:
    """The version of the installed zig; raises BuildError if there is none.

    It stands in the name of the folder NAME-VERSION.dist-info beside the package. Source: PyPA, Recording installed
    projects. To import what reads the folder takes longer than to derive a small mechanism.
    """
    beside = Path(zig()).parents[1].glob("ziglang-*.dist-info")
    names = [folder.name.removesuffix(".dist-info") for folder in beside]
    if len(names) == 1:
        return names[0].removeprefix("ziglang-")
    from importlib.metadata import version

    return version("ziglang")


def of_processor_alone(target: str) -> tuple[str, ...]:
    """The options by which zig links no compiler-rt to code for ``target``; none where the code may need it.

    Compiler-rt is what processors lack. Code that computes with doubles needs nothing of it on these processors, and
    libraries have the same bytes without it. To build it takes 5 s of CPU time for each target. What is missing all the
    same is an error of the linker. Libraries for Windows need its care for long stacks.
    """
    if target.startswith(("x86_64-linux-gnu", "aarch64-linux-gnu")):
        return ("-rtlib=none", "-Wl,-z,defs")
    return ("-rtlib=none",) if "-macos" in target else ()


def is_zig(command: Sequence[str]) -> bool:
    """Whether the ``command`` is one of the installed zig, which finds again what it compiled.

    Raises BuildError if what is installed has no folder.
    """
    return find_spec("ziglang") is not None and command[0] == zig()


@telling("compiling")
def run(command: Sequence[str], folder: Path) -> Result:
    """Run a compiler in ``folder``, which is removed later.

    It ends with all its children if this process ends, however that happens. Raises BuildError if it cannot be started.
    """
    if shutil.which(command[0]) is None:
        raise BuildError(f"the compiler '{command[0]}' could not be started: there is no such program")
    environment = _with_cache(folder) if is_zig(command) else None
    with tempfile.TemporaryFile() as output, tempfile.TemporaryFile() as errors:
        process = subprocess.Popen(
            [sys.executable, "-I", "-S", _SUPERVISOR, *command],
            cwd=folder,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=output,
            stderr=errors,
            start_new_session=os.name == "posix",
        )
        _running.add(process)
        if _interrupted.is_set():
            _end(process)
        ended = threading.Event()
        watch = threading.Thread(target=_watch, args=(process, ended), daemon=True)
        watch.start()
        try:
            process.wait()
        finally:
            ended.set()
            _running.discard(process)
            _end(process)
        return Result(process.returncode, *(_text(file) for file in (output, errors)))


@contextmanager
def compiling(threads: int) -> Iterator[ThreadPoolExecutor]:
    """Threads that compile; what they run ends if this thread is interrupted or told to leave."""
    try:
        with ThreadPoolExecutor(threads) as pool:
            try:
                yield pool
            except BaseException as error:
                pool.shutdown(wait=False, cancel_futures=True)
                if not isinstance(error, Exception):
                    _interrupted.set()
                    for process in tuple(_running):
                        _end(process)
                raise
    finally:
        _interrupted.clear()


def _end(process: subprocess.Popen[bytes]) -> None:
    """Close the input of a supervisor, which then ends itself and its command; nothing if it has ended."""
    if process.stdin is not None:
        process.stdin.close()


def _text(file: IO[bytes]) -> str:
    file.seek(0)
    return file.read().decode("utf-8", "replace")


def _watch(process: subprocess.Popen[bytes], ended: threading.Event) -> None:
    """Say so if the process waits for a lock for two looks, until it has ``ended``."""
    waits = 0
    while not ended.wait(_WATCHED):
        waits = waits + 1 if _waits_for_a_lock(process.pid) else 0
        if waits == 2:
            say_once(
                "another process compiles with the same compiler, and holds a lock in its cache; waiting for it to end"
            )


def _waits_for_a_lock(group: int) -> bool:
    """Whether a process of the ``group`` waits for the lock of a file; only Linux tells."""
    try:
        waiting = [line.split() for line in _LOCKS.read_text("ascii").splitlines() if "->" in line]
    except OSError:
        return False
    for words in waiting:
        try:
            if os.getpgid(int(words[5])) == group:  # number: -> kind, way, access, process
                return True
        except OSError:  # it has ended, or it is another user's
            continue
    return False


def _with_cache(folder: Path) -> dict[str, str]:
    """The environment in which zig finds its cache: the user's choice, a folder of this installation, or ``folder``."""
    if os.environ.get(CACHE):
        return dict(os.environ)
    kept = compiler_folder()
    reason = refusal(kept)
    if reason:
        say_once(
            f"the compiler cannot keep its work in '{kept}': {reason}; it builds its parts anew, which takes a while. "
            f"Put it right, or set {CACHE} to a folder that can be written"
        )
        kept = folder / "cache"
        kept.mkdir(exist_ok=True)
    (kept / "place.txt").write_text(zig(), "utf-8")
    return {_OBJECTS: str(_objects(kept)), **os.environ, CACHE: str(kept)}


def compiler_folder() -> Path:
    """The folder of the cache of this installation of zig; what another installation does cannot lock it.

    Raises BuildError if zig is not installed.
    """
    key = hashlib.sha256(zig().encode()).hexdigest()[:12]
    return cache_folder() / "compiler" / f"{zig_version()}-{key}"


def placed(files: Mapping[str, str]) -> Path | None:
    """A folder with ``files`` {name: text}, the same one for the same texts; None if nothing can be kept.

    Zig knows a source by its path. What it made of sources in such a folder it finds again. Raises BuildError if zig is
    not installed.
    """
    if os.environ.get(CACHE):
        kept = Path(os.environ[CACHE])
    else:
        kept = compiler_folder()
        kept = kept if refusal(kept) else _objects(kept)
    if refusal(kept):
        return None
    folder = kept / "sources" / hashlib.sha256(repr(sorted(files.items())).encode()).hexdigest()[:32]
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        for name, text in files.items():
            _write_once(folder / name, text.encode())
    except OSError:
        return None
    return folder


def _write_once(file: Path, content: bytes) -> None:
    """Make sure that ``file`` has this ``content``, whoever writes or reads it meanwhile."""
    if not file.is_file() or file.read_bytes() != content:
        written = file.with_name(f"{file.name}.{uuid4().hex}")
        written.write_bytes(content)
        written.replace(file)


def _objects(kept: Path) -> Path:
    """The folder of what zig compiles this week.

    Zig never removes anything. Folders older than the one before go, as nobody works in them any more.
    """
    week = int(time.time() // _WEEK)
    new = kept / f"objects-{week}"
    if not new.is_dir():
        new.mkdir(mode=0o700, exist_ok=True)
        last = {new.name, f"objects-{week - 1}"}
        old = [place for place in kept.glob("objects-*") if place.name not in last]
        gone = [place.parent for place in kept.parent.glob("*/place.txt") if _is_left_behind(place)]
        for place in old + gone:
            shutil.rmtree(place, ignore_errors=True)
    return new


def _is_left_behind(place: Path) -> bool:
    """Whether the compiler whose path is in the file ``place`` is no longer there."""
    try:
        return not Path(place.read_text("utf-8")).exists()
    except OSError:  # another process has just removed the folder
        return False
