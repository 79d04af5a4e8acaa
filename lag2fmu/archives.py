"""The archive: files in, an .fmu out, byte for byte reproducible, never half-written; and reading others' archives."""

from __future__ import annotations

import shutil
import stat
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from lag2fmu.errors import ExportError, LoadError
from lag2fmu.writing import replacing

_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest time a zip entry can have
_UNREADABLE = (OSError, zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError, ValueError)
"""What zipfile raises for damaged, encrypted and unusually compressed entries."""

DESCRIPTION = "modelDescription.xml"
MOST_ENTRIES, MOST_BYTES, MOST_OF_A_TEXT, GREATEST_RATIO = 50_000, 2 << 30, 64 << 20, 500
"""The limits of an archive: entries, bytes unpacked, bytes of one text, bytes unpacked from one packed byte.

Archives beyond a limit are refused. Texts are modelDescription.xml and the mechanism, which are read as a whole.
"""

PACKED = 8
"""Deflate's level: the usual one, 6, makes FMUs .4 % larger and takes half of its 70 ms for 1.2 MB; 9 gains no more."""


def pack(files: Mapping[str, bytes], path: Path) -> None:
    """Write ``files`` {name in the archive: content} to ``path``; entries are sorted and carry a fixed time.

    The archive is written beside ``path`` and moved into place: the same files give the same bytes. Raises ExportError
    if that is not possible.
    """
    try:
        with replacing(path) as new, zipfile.ZipFile(new, "w", zipfile.ZIP_DEFLATED) as archive:
            for name in sorted(files):
                entry = zipfile.ZipInfo(name, _EPOCH)
                entry.compress_type, entry.external_attr, entry.create_system = zipfile.ZIP_DEFLATED, 0o644 << 16, 3
                archive.writestr(entry, files[name], compresslevel=PACKED)
    except OSError as error:
        raise ExportError(f"cannot write '{path}': {error.strerror}; choose another place with -o") from error


def read_text(path: Path, name: str, missing: str = "there is none; is it an FMU of lag2fmu?") -> str:
    """The text in UTF-8 called ``name`` in the archive ``path``, of any origin; ``missing`` ends the error without it.

    Raises LoadError if there is no such archive, ExportError if no such text that is safe to read is in it.
    """
    _refuse_other_than_file(path)
    try:
        with opened(path) as archive:
            size = archive.getinfo(name).file_size
            if size > MOST_OF_A_TEXT:
                raise LoadError(f"'{path}': '{name}' has {size} bytes; at most {MOST_OF_A_TEXT} are read")
            content = archive.read(name)
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise ExportError(f"'{path}': '{name}' is not UTF-8 (byte {error.start}); export the FMU anew") from error
    except KeyError:
        raise ExportError(f"'{path}': there is no '{name}' in it; {missing}") from None
    except LoadError as error:
        raise ExportError(f"'{path}': cannot read '{name}' from it ({error}); is it an FMU of lag2fmu?") from error


@contextmanager
def opened(path: Path) -> Iterator[zipfile.ZipFile]:
    """The archive ``path``, of any origin, for reading.

    Raises LoadError if it is none, cannot be read, or would unpack to more than is sensible.
    """
    _refuse_other_than_file(path)
    try:
        with zipfile.ZipFile(path) as archive:
            _refuse_bomb(path, archive.infolist())
            yield archive
    except _UNREADABLE as error:
        raise LoadError(f"'{path}': is no archive (zip) that can be read, so no FMU: {error}") from error


def unpack(path: Path, folder: Path) -> None:
    """Write all entries of the archive ``path``, of any origin, into ``folder``.

    Raises LoadError as ``opened`` does, and for an entry that would lie outside of the folder.
    """
    with opened(path) as archive:
        for entry in archive.infolist():
            place = PurePosixPath(entry.filename.replace("\\", "/"))
            if place.is_absolute() or ".." in place.parts or any(":" in part for part in place.parts):
                raise LoadError(f"'{path}': the entry '{entry.filename}' leads out of the archive; it is not unpacked")
            if entry.is_dir():
                continue
            target = folder / place
            target.parent.mkdir(parents=True, exist_ok=True)
            with archive.open(entry) as content, target.open("wb") as file:
                shutil.copyfileobj(content, file)


def _refuse_other_than_file(path: Path) -> None:
    """Raise LoadError unless ``path`` is a regular file: reading from a pipe might never end."""
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise LoadError(f"'{path}': is not a regular file, so no FMU")
    except FileNotFoundError:
        raise LoadError(f"'{path}': there is no such file") from None
    except (OSError, ValueError) as error:
        raise LoadError(f"'{path}': cannot be read: {getattr(error, 'strerror', error)}") from error


def _refuse_bomb(path: Path, entries: Sequence[zipfile.ZipInfo]) -> None:
    if len(entries) > MOST_ENTRIES:
        raise LoadError(f"'{path}': {len(entries)} entries; archives with more than {MOST_ENTRIES} are not opened")
    unpacked = sum(e.file_size for e in entries)
    if unpacked > MOST_BYTES:
        raise LoadError(f"'{path}': unpacks to {unpacked} bytes; more than {MOST_BYTES} are not unpacked")
    for e in entries:
        if e.file_size > 16 << 20 and e.file_size > GREATEST_RATIO * max(e.compress_size, 1):
            raise LoadError(
                f"'{path}': '{e.filename}' unpacks from {e.compress_size} to {e.file_size} bytes like a zip bomb; "
                f"ratios above {GREATEST_RATIO} are not unpacked"
            )
        if e.filename == DESCRIPTION and e.file_size > MOST_OF_A_TEXT:
            raise LoadError(f"'{path}': {DESCRIPTION} has {e.file_size} bytes; at most {MOST_OF_A_TEXT} are read")


def damage(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> str:
    """Why ``entry`` cannot be read to its end, as a phrase; empty if it can."""
    try:
        with archive.open(entry) as stream:
            while stream.read(1 << 20):
                pass
    except _UNREADABLE as error:
        return str(error) or type(error).__name__
    return ""


PAGE = "documentation/index.html"
"""The page that people read first, by its name in the archive: FMI 2.0.5, section 2.3."""
