"""What an ELF library (64 bit, little-endian) exports and which versions it needs, read from its bytes.

Source: System V ABI, chapters 4 and 5; the Linux Standard Base, chapter 10 (symbol versioning).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass

_DYNSYM, _VERNEED, _DYNAMIC, _SYMTAB = 11, 0x6FFFFFFE, 6, 2
_NEEDED, _SONAME, _RPATH, _RUNPATH = 1, 14, 15, 29


@dataclass(frozen=True)
class Section:
    """A section header: ``kind`` is sh_type, ``link`` the number of the section with its strings."""

    kind: int
    start: int
    size: int
    link: int
    entry: int


class Library:
    """The library in ``data``; raises ValueError if it is none."""

    def __init__(self, data: bytes) -> None:
        if data[:6] != b"\x7fELF\x02\x01":
            raise ValueError("not an ELF file of 64 bit, little-endian")
        (table,), (size, count) = struct.unpack_from("<Q", data, 40), struct.unpack_from("<HH", data, 58)
        self.data = data
        self.sections = [self._section(table + number * size) for number in range(count)]

    def _section(self, at: int) -> Section:
        _, kind, _, _, start, size, link, _, _, entry = struct.unpack_from("<IIQQQQIIQQ", self.data, at)
        return Section(kind, start, size, link, entry)

    def _of(self, kind: int) -> list[Section]:
        return [section for section in self.sections if section.kind == kind]

    def _text(self, section: Section, offset: int) -> str:
        start = self.sections[section.link].start + offset
        return self.data[start : self.data.index(b"\0", start)].decode()

    @property
    def exported(self) -> set[str]:
        """The names that other libraries can see: defined, global or weak, of default or protected visibility."""
        (table,) = self._of(_DYNSYM)
        found = set()
        for at in range(table.start, table.start + table.size, table.entry):
            name, info, other, section = struct.unpack_from("<IBBH", self.data, at)
            if section and info >> 4 in (1, 2) and other & 3 in (0, 3):
                found.add(self._text(table, name))
        return found

    @property
    def versions(self) -> set[str]:
        """The versions it needs of other libraries, such as GLIBC_2.2.5."""
        found = set()
        for table in self._of(_VERNEED):
            at = table.start
            while True:
                _, count, _, first, following = struct.unpack_from("<HHIII", self.data, at)
                entry = at + first
                for _ in range(count):
                    _, _, _, name, step = struct.unpack_from("<IHHII", self.data, entry)
                    found.add(self._text(table, name))
                    entry += step
                if not following:
                    break
                at += following
        return found

    def _dynamic(self) -> Iterator[tuple[int, str]]:
        (table,) = self._of(_DYNAMIC)
        for at in range(table.start, table.start + table.size, 16):
            tag, value = struct.unpack_from("<qQ", self.data, at)
            if tag in (_NEEDED, _SONAME, _RPATH, _RUNPATH):
                yield tag, self._text(table, value)

    @property
    def needed(self) -> set[str]:
        """The libraries it needs."""
        return {name for tag, name in self._dynamic() if tag == _NEEDED}

    @property
    def search_paths(self) -> set[str]:
        """RPATH and RUNPATH."""
        return {name for tag, name in self._dynamic() if tag in (_RPATH, _RUNPATH)}

    @property
    def stripped(self) -> bool:
        """Whether the symbols for a debugger are gone."""
        return not self._of(_SYMTAB)
