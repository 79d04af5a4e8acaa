"""The archive: opened without trust, and the rules on its entries (FMI 2.0.5, section 2.3; FMI 3.0.2, section 2.5)."""

from __future__ import annotations

import shutil
import stat
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from lag2fmu.archives import DESCRIPTION, MOST_OF_A_TEXT, damage, opened
from lag2fmu.checking.findings import Finding
from lag2fmu.errors import LoadError

if TYPE_CHECKING:
    from zipfile import ZipInfo

__all__ = ["DESCRIPTION", "Archive", "archive_findings", "open_archive"]

_MOST_OF_A_LIBRARY = 512 << 20
"""At most this many bytes of a file are read at once."""
_STORED, _DEFLATED = 0, 8
"""Methods of compression that FMI allows, by their numbers in the zip format."""
_ENCRYPTED, _DESCRIPTOR = 0x1, 0x8
"""Flags of an entry: encrypted; its size stands behind its bytes."""
_KNOWN = {DESCRIPTION, "model.png", "documentation", "sources", "binaries", "resources", "extra", "terminalsAndIcons"}


@dataclass(frozen=True)
class Archive:
    """An archive that is safe to unpack: its entries, and the names of the files that can be read.

    ``broken`` are the findings on files that cannot.
    """

    path: Path
    entries: tuple[ZipInfo, ...]
    files: frozenset[str]
    broken: tuple[Finding, ...]

    def read(self, name: str) -> bytes:
        """The content of the file ``name``; raises LoadError if it cannot be read or is too large for that."""
        with self.reading() as read:
            return read(name)

    @contextmanager
    def reading(self) -> Iterator[Callable[[str], bytes]]:
        """``read`` for many files: the archive, whose list of entries takes longer than a file, is opened once."""
        with opened(self.path) as archive:

            def read(name: str) -> bytes:
                most = MOST_OF_A_TEXT if name.endswith(".xml") else _MOST_OF_A_LIBRARY
                if (size := archive.getinfo(name).file_size) > most:
                    raise LoadError(f"'{self.path}': '{name}' has {size} bytes; at most {most} are read")
                return archive.read(name)

            yield read

    def below(self, folder: str) -> list[str]:
        """The names of the files in ``folder`` and its folders, sorted."""
        return sorted(name for name in self.files if name.startswith(f"{folder}/"))

    def unpack(self, names: list[str], folder: Path) -> None:
        """Write the files ``names`` below ``folder``; raises LoadError if that is not possible."""
        with opened(self.path) as archive:
            for name in names:
                target = folder.joinpath(*PurePosixPath(name).parts)
                try:
                    target.parent.mkdir(parents=True, exist_ok=True)
                    with archive.open(name) as source, target.open("wb") as stream:
                        shutil.copyfileobj(source, stream)
                except OSError as error:
                    raise LoadError(f"'{self.path}': '{name}' cannot be unpacked: {error}") from error


def open_archive(path: Path) -> Archive:
    """The archive ``path``; raises LoadError if it is none, holds no modelDescription.xml or is not safe to unpack."""
    with opened(path) as archive:
        entries = tuple(archive.infolist())
        for entry in entries:
            _refuse_escape(path, entry)
        regular = [e for e in entries if not e.is_dir() and not _is_link(e)]
        broken = {e.filename: problem for e in regular if (problem := damage(archive, e))}
    files = frozenset(e.filename for e in regular) - broken.keys()
    if DESCRIPTION not in files:
        why = f" ({broken[DESCRIPTION]})" if DESCRIPTION in broken else ""
        raise LoadError(f"'{path}': is no FMU: no {DESCRIPTION} can be read at the top of the archive{why}")
    return Archive(path, entries, files, tuple(_broken(name, problem) for name, problem in broken.items()))


# ---------------------------------------------------------------------------------------------------------- safety


def _parts(entry: ZipInfo) -> list[str]:
    """The parts of an entry's name as any system would see them."""
    return entry.orig_filename.replace("\\", "/").split("/")


def _refuse_escape(path: Path, entry: ZipInfo) -> None:
    first, *_ = parts = _parts(entry)
    if ".." in parts or first == "" or ":" in first or "\0" in entry.orig_filename:
        raise LoadError(
            f"'{path}': the entry {entry.orig_filename!r} would be written outside of the folder it is unpacked to; "
            "do not unpack this archive"
        )


def _is_link(entry: ZipInfo) -> bool:
    return stat.S_ISLNK(entry.external_attr >> 16)


def _broken(name: str, problem: str) -> Finding:
    return Finding("entry-readable", name, f"cannot be unpacked: {problem}", "pack the FMU anew")


# ----------------------------------------------------------------------------------------------------------- rules


def archive_findings(archive: Archive) -> Iterator[Finding]:
    """The broken rules on the archive itself: names, kinds and compression of its entries.

    Source: FMI 2.0.5 specification, section 2.3; FMI 3.0.2 specification, section 2.5.
    """
    yield from archive.broken
    if archive.path.suffix != ".fmu":
        yield Finding("suffix", archive.path.name, "the name does not end in .fmu", "rename the file")
    for entry in archive.entries:
        yield from _name_findings(entry)
        yield from _format_findings(entry)
    yield from _repeated(archive)
    for top in sorted({_parts(e)[0] for e in archive.entries} - _KNOWN - {"."}):
        problem = "the standard knows no such file or folder at the top of an FMU"
        yield Finding("top-level", top, problem, "put data of your own below extra/<reverse domain>/", "warning")
    if "documentation/index.html" not in archive.files:
        problem = "there is no documentation"
        yield Finding("documentation", "documentation/index.html", problem, "add a page that tells users", "warning")
    for folder in sorted({_parts(e)[1] for e in archive.entries if _parts(e)[0] == "extra" and len(_parts(e)) > 2}):
        if "." not in folder:
            yield Finding(
                "extra", f"extra/{folder}", "the folder's name is no reverse domain", "e.g. extra/com.acme", "warning"
            )


def _name_findings(entry: ZipInfo) -> Iterator[Finding]:
    name = entry.orig_filename
    if "\\" in name:
        yield Finding("path-backslash", name, "the path has a backslash", "separate folders by '/'")
    if {".", ""} & set(_parts(entry)[:-1]) or _parts(entry)[-1] == ".":
        yield Finding("path-dot", name, "the path has an empty or '.' part", "begin paths at the top of the archive")


def _format_findings(entry: ZipInfo) -> Iterator[Finding]:
    name = entry.filename
    if _is_link(entry):
        yield Finding("link", name, "is a symbolic link", "store the file itself")
    if entry.compress_type not in (_STORED, _DEFLATED):
        problem = f"is compressed by method {entry.compress_type}"
        yield Finding("compression", name, problem, "use deflate (8) or none (0), as the standard asks")
    if entry.flag_bits & _ENCRYPTED:
        yield Finding("encryption", name, "is encrypted", "store it in the clear")
    elif entry.extract_version > 20 and entry.compress_type in (_STORED, _DEFLATED):
        problem = f"needs version {entry.extract_version / 10:.1f} of the zip format (e.g. for zip64)"
        yield Finding("zip-version", name, problem, "use features of version 2.0 only")
    if entry.flag_bits & _DESCRIPTOR and entry.compress_type == _STORED and not entry.is_dir() and entry.file_size:
        problem = "is stored with its size behind the data (flag bit 3)"
        yield Finding("zip-descriptor", name, problem, "deflate it, or write to a file that can be rewound")


def _repeated(archive: Archive) -> Iterator[Finding]:
    """Entries of the same name, and of names that are one file on Windows and macOS."""
    counts = Counter(e.filename for e in archive.entries)
    for name, count in counts.items():
        if count > 1:
            yield Finding("path-duplicate", name, f"stands {count} times in the archive", "keep one of them")
    folded = Counter(name.casefold() for name in counts)
    for name in counts:
        if folded[name.casefold()] > 1:
            problem = "another path differs by upper and lower case only"
            yield Finding("path-case", name, problem, "rename one; they are one file on Windows", "warning")
