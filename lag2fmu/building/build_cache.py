"""Libraries that are kept in the user's cache: the same sources are compiled only once."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from uuid import uuid4

from lag2fmu.building.folders import cache_folder, foreign, refusal, say_once
from lag2fmu.version import VERSION

VARIABLE = "LAG2FMU_LIBRARIES"
"""The environment variable that names another folder, or is OFF."""
OFF = "off"
MOST = 512 * 2**20
"""Bytes that are kept; what was not used for the longest time goes first."""

_SEAL = hashlib.sha256().digest_size
_NAME = re.compile("[0-9a-f]{64}(-[0-9a-f]{32})?")
"""The names of kept files, and of those that are being written; no other file is ever removed."""


def place() -> Path | None:
    """The folder of kept libraries; None if nothing is kept."""
    named = os.environ.get(VARIABLE)
    if named is None:
        return cache_folder() / "libraries"
    return None if named in ("", OFF) else Path(named)


def kept(made_of: Sequence[object], build: Callable[[], bytes]) -> bytes:
    """The result of ``build``, or the kept result of an earlier build with an equal ``made_of``.

    ``made_of`` has everything that the result depends on. A folder that cannot be used, or that is not this user's
    alone, is named in a warning and left alone. The time of a kept file says when it was used last.
    """
    folder = place()
    if folder is None:
        return build()
    reason = refusal(folder)
    if reason:
        say_once(
            f"the folder '{folder}' cannot keep libraries: {reason}; all is compiled anew. Put it right, name another "
            f"one in {VARIABLE}, or set {VARIABLE}={OFF}"
        )
        return build()
    file = folder / hashlib.sha256(repr((VERSION, *made_of)).encode()).hexdigest()
    library = _read(file)
    if library is None:
        library = build()
        _store(file, library)
    return library


def kept_files(folder: Path) -> list[tuple[Path, os.stat_result]]:
    """The kept libraries in ``folder`` with what the system knows of them, the one used last at the end."""
    return sorted(_found(folder), key=lambda pair: pair[1].st_mtime)


def _found(folder: Path) -> Iterator[tuple[Path, os.stat_result]]:
    if folder.is_dir():
        for file in folder.iterdir():
            if _NAME.fullmatch(file.name):
                try:
                    yield file, file.stat()
                except OSError:  # another process has just removed it
                    continue


def _seal(file: Path, library: bytes) -> bytes:
    """The hash that stands before a kept library, of its name and content."""
    return hashlib.sha256(file.name.encode() + library).digest()


def _read(file: Path) -> bytes | None:
    """The library in ``file``; None, and a warning, if it is not as this user wrote it."""
    try:
        with file.open("rb") as opened:
            reason, content = foreign(os.fstat(opened.fileno())), opened.read()
        os.utime(file)
    except FileNotFoundError:
        return None
    except OSError as error:
        reason, content = error.strerror or str(error), b""
    library = content[_SEAL:]
    if not reason and content[:_SEAL] != _seal(file, library):
        reason = "its content has changed"
    if reason:
        say_once(f"the kept library '{file}' is not used but built anew: {reason}")
        return None
    return library


def _store(file: Path, library: bytes) -> None:
    """Write a library, moved into place when complete, so that no process reads half a file; then drop the oldest."""
    written = file.with_name(f"{file.name}-{uuid4().hex}")
    try:
        written.touch(mode=0o600, exist_ok=False)
        written.write_bytes(_seal(file, library) + library)
        written.replace(file)
        trim(file.parent, MOST)
    except OSError as error:  # a full disk; on Windows also a file that another process reads
        say_once(f"the folder '{file.parent}' did not take a library: {error.strerror or error}; it will be built anew")
        written.unlink(missing_ok=True)


def trim(folder: Path, most: int) -> None:
    """Remove the kept libraries that were not used for the longest time until ``most`` bytes are left."""
    files = kept_files(folder)
    size = sum(found.st_size for _, found in files)
    for file, found in files:
        if size <= most:
            return
        file.unlink(missing_ok=True)
        size -= found.st_size
