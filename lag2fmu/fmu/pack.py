"""The archive: files in, an .fmu out, byte for byte reproducible, never half-written; and reading others' archives."""

from __future__ import annotations

import os
import tempfile
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from lag2fmu.errors import ExportError, LoadError

_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest time a zip entry can have
_UNREADABLE = (OSError, zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError, ValueError)
"""What zipfile raises for damaged, encrypted and unusually compressed entries."""


def pack(files: Mapping[str, bytes], path: Path) -> None:
    """Write ``files`` {name in the archive: content} to ``path``; entries are sorted and carry a fixed time.

    The archive is written beside ``path`` and moved into place: the same files give the same bytes. Raises ExportError
    if that is not possible.
    """
    try:
        descriptor, temporary = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    except OSError as error:
        raise ExportError(f"cannot write '{path}': {error.strerror}; choose another folder with -o") from error
    try:
        with os.fdopen(descriptor, "wb") as stream, zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
            for name in sorted(files):
                entry = zipfile.ZipInfo(name, _EPOCH)
                entry.compress_type, entry.external_attr, entry.create_system = zipfile.ZIP_DEFLATED, 0o644 << 16, 3
                archive.writestr(entry, files[name])
        Path(temporary).chmod(0o644)
        Path(temporary).replace(path)
    except OSError as error:
        raise ExportError(f"cannot write '{path}': {error.strerror}; choose another place with -o") from error
    finally:
        Path(temporary).unlink(missing_ok=True)


def read_entry(path: Path, name: str) -> bytes:
    """The content of one file in the archive ``path``; raises ExportError if it is no archive or has no such file."""
    try:
        with zipfile.ZipFile(path) as archive:
            return archive.read(name)
    except (OSError, zipfile.BadZipFile, KeyError) as error:
        raise ExportError(f"'{path}': cannot read '{name}' from it ({error}); is it an FMU of lag2fmu?") from error


@contextmanager
def opened(path: Path) -> Iterator[zipfile.ZipFile]:
    """The archive ``path``, of any origin, for reading; raises LoadError if it is none or cannot be read."""
    try:
        with zipfile.ZipFile(path) as archive:
            yield archive
    except _UNREADABLE as error:
        raise LoadError(f"'{path}': is no archive (zip) that can be read, so no FMU: {error}") from error


def damage(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> str:
    """Why ``entry`` cannot be read to its end, as a phrase; empty if it can."""
    try:
        with archive.open(entry) as stream:
            while stream.read(1 << 20):
                pass
    except _UNREADABLE as error:
        return str(error) or type(error).__name__
    return ""
