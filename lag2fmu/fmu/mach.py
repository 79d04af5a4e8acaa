"""Libraries for macOS: several in one file, and names taken out of their exports, which zig's linker has no option for.

A universal file holds a library for each kind of processor. A name is exported by a word of the export trie, where the
loader looks, and by a mark in the symbol table, where tools look. Both are rewritten in place, then the hashes of the
ad-hoc signature, without which Apple silicon loads nothing. Sources: Apple, Mach-O Programming Topics; <mach-o/fat.h>,
<mach-o/loader.h>, <mach-o/nlist.h>, and <kern/cs_blobs.h> of XNU.
"""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Iterator, Mapping, Sequence
from itertools import accumulate, groupby

_FAT_MAGIC, _MACH_MAGIC = 0xCAFEBABE, 0xFEEDFACF
_ALIGNMENT = 14
"""Binary logarithm of the alignment of each library: pages of 16 KiB, as Apple silicon has them."""
_SYMTAB, _DYSYMTAB, _CODE_SIGNATURE, _DYLD_INFO, _EXPORTS_TRIE = 0x2, 0xB, 0x1D, 0x80000022, 0x80000033
_EXTERNAL = 0x01
"""The bit of n_type that marks a symbol as visible to other libraries."""
_CODE_DIRECTORY, _SHA256 = 0xFADE0C02, 2
"""The magic number of the directory of a signature, and the number of the kind of its hashes."""


def universal(libraries: Sequence[bytes]) -> bytes:
    """One file of several Mach-O libraries (64 bit, little-endian); a single library is returned as it is.

    Raises ValueError if one of several is no such library.
    """
    if len(libraries) == 1:
        return libraries[0]
    header = struct.pack(">2I", _FAT_MAGIC, len(libraries))
    start = len(header) + 20 * len(libraries)
    body = b""
    for library in libraries:
        magic, processor, kind = struct.unpack_from("<3I", library)
        if magic != _MACH_MAGIC:
            raise ValueError(f"not a Mach-O library of 64 bit: it begins with 0x{magic:08x}")
        body += bytes(-(start + len(body)) % (1 << _ALIGNMENT))
        header += struct.pack(">5I", processor, kind, start + len(body), len(library), _ALIGNMENT)
        body += library
    return header + body


def hide(library: bytes, names: frozenset[str]) -> bytes:
    """``library`` (Mach-O, 64 bit, little-endian), which no longer exports ``names`` (with the leading underscore).

    Raises ValueError if its exports or its signature are not of the form that zig writes.
    """
    image = bytearray(library)
    commands = dict(_commands(image))
    _rewrite_trie(image, commands, names)
    _rewrite_symbols(image, commands, names)
    if _CODE_SIGNATURE in commands:
        _sign(image, *struct.unpack_from("<I", image, commands[_CODE_SIGNATURE] + 8))
    return bytes(image)


def _commands(image: bytearray) -> Iterator[tuple[int, int]]:
    """(kind, place) of each load command."""
    (count,) = struct.unpack_from("<I", image, 16)
    at = 32
    for _ in range(count):
        kind, size = struct.unpack_from("<2I", image, at)
        yield kind, at
        at += size


# ---------------------------------------------------------------------------------------------------------- export trie


def _rewrite_trie(image: bytearray, commands: Mapping[int, int], names: frozenset[str]) -> None:
    """Replace the trie by that of the names that stay; it is shorter, so zeros fill the rest, as linkers pad it."""
    place = commands[_EXPORTS_TRIE] + 8 if _EXPORTS_TRIE in commands else commands[_DYLD_INFO] + 40
    start, size = struct.unpack_from("<2I", image, place)
    words = {name: what for name, what in _words(bytes(image[start : start + size])) if name not in names}
    trie = _trie(words)
    if len(trie) > size:
        raise ValueError(f"the export trie of {len(words)} words needs {len(trie)} bytes, but there are {size}")
    image[start : start + size] = trie.ljust(size, b"\0")


def _words(trie: bytes, node: int = 0, prefix: str = "") -> Iterator[tuple[str, bytes]]:
    """(word, what it means) below a node: the size of the meaning, the meaning, edges to nodes by pieces of text."""
    size, at = _read_number(trie, node)
    if size:
        yield prefix, trie[at : at + size]
    at += size
    count, at = trie[at], at + 1
    for _ in range(count):
        end = trie.index(b"\0", at)
        child, following = _read_number(trie, end + 1)
        yield from _words(trie, child, prefix + trie[at:end].decode())
        at = following


_Node = tuple[bytes, list[tuple[str, int]]]
"""The meaning of the word that ends here, b"" if none does, and the edges (text, number of a node) to longer words."""


def _trie(words: Mapping[str, bytes]) -> bytes:
    """The trie of ``words``, nodes in the order of a walk; where they stand follows from how long the numbers are."""
    nodes: list[_Node] = []
    _add(nodes, words)
    places, known = [0] * len(nodes), False
    while not known:
        parts = [_node_bytes(node, places) for node in nodes]
        found = [0, *accumulate(map(len, parts[:-1]))]
        places, known = found, found == places
    return b"".join(parts)


def _add(nodes: list[_Node], words: Mapping[str, bytes]) -> int:
    """Add the node of ``words`` and those below it; returns its number."""
    number = len(nodes)
    nodes.append((words.get("", b""), []))
    for _, group in groupby(sorted(word for word in words if word), key=lambda word: word[0]):
        members = list(group)
        text = _common(members[0], members[-1])
        nodes[number][1].append((text, _add(nodes, {word[len(text) :]: words[word] for word in members})))
    return number


def _common(first: str, last: str) -> str:
    """What two words begin with, and all those that stand between them in the alphabet."""
    return first[: next((i for i, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), len(first))]


def _node_bytes(node: _Node, places: Sequence[int]) -> bytes:
    meaning, edges = node
    texts = (text.encode() + b"\0" + _number(places[child]) for text, child in edges)
    return _number(len(meaning)) + meaning + bytes([len(edges)]) + b"".join(texts)


def _read_number(data: bytes, at: int) -> tuple[int, int]:
    """The number of variable length (ULEB128) at ``at``, and where it ends."""
    value = shift = 0
    while True:
        byte, at = data[at], at + 1
        value |= (byte & 0x7F) << shift
        shift += 7
        if byte < 0x80:
            return value, at


def _number(value: int) -> bytes:
    """``value`` as ULEB128."""
    digits = bytearray()
    while value > 0x7F:
        digits.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes(digits) + bytes([value])


# --------------------------------------------------------------------------------------------------------- symbol table


def _rewrite_symbols(image: bytearray, commands: Mapping[int, int], names: frozenset[str]) -> None:
    """Move the symbols of ``names`` from the exported ones, in the middle, to the end of the local ones before them."""
    symbols, _, strings, _ = struct.unpack_from("<4I", image, commands[_SYMTAB] + 8)
    dynamic = commands[_DYSYMTAB] + 8
    first, n_local, _, n_exported = struct.unpack_from("<4I", image, dynamic)
    indirect, n_indirect = struct.unpack_from("<2I", image, commands[_DYSYMTAB] + 56)

    def entry(i: int) -> bytes:
        return bytes(image[symbols + 16 * i : symbols + 16 * i + 16])

    def name(i: int) -> str:
        start = strings + int.from_bytes(entry(i)[:4], "little")
        return image[start : image.index(0, start)].decode()

    exported = range(first + n_local, first + n_local + n_exported)
    hidden = [i for i in exported if name(i) in names]
    order = hidden + [i for i in exported if i not in hidden]
    entries = [bytearray(entry(i)) for i in order]
    for symbol in entries[: len(hidden)]:
        symbol[4] &= ~_EXTERNAL
    image[symbols + 16 * exported.start : symbols + 16 * exported.stop] = b"".join(entries)
    struct.pack_into(
        "<3I", image, dynamic + 4, n_local + len(hidden), exported.start + len(hidden), n_exported - len(hidden)
    )
    moved = {old: exported.start + i for i, old in enumerate(order)}
    for at in range(indirect, indirect + 4 * n_indirect, 4):
        (i,) = struct.unpack_from("<I", image, at)
        struct.pack_into("<I", image, at, moved.get(i, i))


# ------------------------------------------------------------------------------------------------------------ signature


def _sign(image: bytearray, start: int) -> None:
    """Calculate the hashes of the pages anew in the code directory of the signature at ``start``; it holds nothing else
    that depends on the content. Its numbers are big-endian.
    """
    _, _, count = struct.unpack_from(">3I", image, start)
    for i in range(count):
        directory = start + struct.unpack_from(">2I", image, start + 12 + 8 * i)[1]
        magic, _, _, _, hashes, _, _, pages, limit = struct.unpack_from(">9I", image, directory)
        if magic != _CODE_DIRECTORY:
            continue
        size, kind, _, shift = struct.unpack_from("4B", image, directory + 36)
        if (size, kind) != (32, _SHA256):
            raise ValueError(f"the signature has hashes of kind {kind} with {size} bytes, expected SHA-256")
        for page in range(pages):
            content = image[page << shift : min((page + 1) << shift, limit)]
            place = directory + hashes + size * page
            image[place : place + size] = hashlib.sha256(content).digest()
