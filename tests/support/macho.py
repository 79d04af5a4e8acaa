"""What a library for macOS exports and needs, read from its bytes: Mach-O of 64 bit, alone or in a universal file.

Source: Apple, <mach-o/fat.h>, <mach-o/loader.h> and <mach-o/nlist.h>.
"""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Iterator

X86_64, ARM64 = 0x01000007, 0x0100000C
_LOAD_DYLIB, _CODE_SIGNATURE, _VERSION_MIN_MACOS, _BUILD_VERSION = 0xC, 0x1D, 0x24, 0x32
_DYLD_INFO, _EXPORTS_TRIE = 0x80000022, 0x80000033
_SYMBOLS, _DEFINED = 0x2, 0xE
_DYLIB, _MACOS = 6, 1


def libraries(data: bytes) -> dict[int, Library]:
    """The libraries of the universal file ``data`` by processor; raises ValueError if it is none."""
    magic, count = struct.unpack_from(">2I", data)
    if magic != 0xCAFEBABE:
        raise ValueError("not a universal file")
    found, end = {}, 8 + 20 * count
    for i in range(count):
        processor, kind, start, size, alignment = struct.unpack_from(">5I", data, 8 + 20 * i)
        assert start % (1 << alignment) == 0
        assert start >= end, "they do not overlap"
        end = start + size
        found[processor] = Library(data[start:end])
        assert (processor, kind) == found[processor].processor
    assert end == len(data)
    return found


class Library:
    """The Mach-O library in ``data``; raises ValueError if it is none."""

    def __init__(self, data: bytes) -> None:
        magic, processor, kind, file_type, self._count = struct.unpack_from("<5I", data)
        if (magic, file_type) != (0xFEEDFACF, _DYLIB):
            raise ValueError("not a dynamic library in Mach-O format, 64 bit")
        self.data, self.processor = data, (processor, kind)

    def _commands(self, *kinds: int) -> Iterator[int]:
        at = 32
        for _ in range(self._count):
            kind, size = struct.unpack_from("<2I", self.data, at)
            if kind in kinds:
                yield at
            at += size

    def _text(self, start: int) -> str:
        return self.data[start : self.data.index(b"\0", start)].decode()

    @property
    def imported(self) -> set[str]:
        """The names that other libraries must have, without the leading underscore: the undefined symbols."""
        (at,) = self._commands(_SYMBOLS)
        first, count, texts, _ = struct.unpack_from("<4I", self.data, at + 8)
        entries = (struct.unpack_from("<IB", self.data, first + 16 * i) for i in range(count))
        return {self._text(texts + name).removeprefix("_") for name, kind in entries if kind & _DEFINED == 0}

    @property
    def exported(self) -> set[str]:
        """The names that other libraries can see, without the leading underscore: the words of the export trie."""
        for at in self._commands(_DYLD_INFO):
            start, size = struct.unpack_from("<2I", self.data, at + 40)
        for at in self._commands(_EXPORTS_TRIE):
            start, size = struct.unpack_from("<2I", self.data, at + 8)
        return {name.removeprefix("_") for name in _words(self.data[start : start + size])}

    @property
    def needed(self) -> set[str]:
        """The libraries it needs."""
        places = self._commands(_LOAD_DYLIB)
        return {self._text(at + struct.unpack_from("<I", self.data, at + 8)[0]) for at in places}

    @property
    def minimum_system(self) -> tuple[int, int]:
        """The oldest macOS it runs on."""
        for at in self._commands(_BUILD_VERSION):
            system, version = struct.unpack_from("<2I", self.data, at + 8)
            assert system == _MACOS
            return version >> 16, version >> 8 & 0xFF
        (at,) = self._commands(_VERSION_MIN_MACOS)
        version = struct.unpack_from("<I", self.data, at + 8)[0]
        return version >> 16, version >> 8 & 0xFF

    @property
    def signed(self) -> bool:
        """Whether it carries a signature, without which Apple silicon loads nothing, and all pages have its hashes."""
        for at in self._commands(_CODE_SIGNATURE):
            start = struct.unpack_from("<I", self.data, at + 8)[0]
            directory = self.data.index(bytes.fromhex("fade0c02"), start)
            hashes, pages, end = (struct.unpack_from(">I", self.data, directory + k)[0] for k in (16, 28, 32))
            size = 1 << self.data[directory + 39]
            code = [self.data[k : min(k + size, end)] for k in range(0, end, size)]
            signed = [self.data[directory + hashes + 32 * k :][:32] for k in range(pages)]
            return end == start and signed == [hashlib.sha256(page).digest() for page in code]
        return False


def _words(trie: bytes, node: int = 0, prefix: str = "") -> Iterator[str]:
    """The words of an export trie: nodes of a size, what the word means, and edges to nodes by pieces of text."""
    size, at = _number(trie, node)
    if size:
        yield prefix
    at += size
    count, at = trie[at], at + 1
    for _ in range(count):
        end = trie.index(b"\0", at)
        child, following = _number(trie, end + 1)
        yield from _words(trie, child, prefix + trie[at:end].decode())
        at = following


def _number(data: bytes, at: int) -> tuple[int, int]:
    """The number of variable length (ULEB128) at ``at``, and where it ends."""
    value = shift = 0
    while True:
        byte, at = data[at], at + 1
        value |= (byte & 0x7F) << shift
        shift += 7
        if byte < 0x80:
            return value, at
