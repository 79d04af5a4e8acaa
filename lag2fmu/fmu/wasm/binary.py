"""The binary format of WebAssembly: numbers, names and vectors, and the definitions of a component one by one.

Source: the Component Model, design/mvp/Binary.md.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping

_SORTS = {"func": b"\1", "type": b"\3", "instance": b"\5", "core func": b"\0\0", "core memory": b"\0\2"}
MODULE, COMPONENT = b"\0asm\1\0\0\0", b"\0asm\x0d\0\1\0"
"""How modules and components begin."""
EQUAL, RESOURCE = b"\3\0", b"\3\1"
"""What an imported type has to be: equal to the one whose index follows, or any resource."""


def unsigned(number: int) -> bytes:
    """LEB128 of a number from 0 on."""
    low, rest = number & 0x7F, number >> 7
    return bytes([low | 0x80]) + unsigned(rest) if rest else bytes([low])


def signed(number: int) -> bytes:
    """LEB128 with a sign, of a number from 0 on."""
    low, rest = number & 0x7F, number >> 7
    return bytes([low | 0x80]) + signed(rest) if rest or low > 0x3F else bytes([low])


def sized(content: bytes) -> bytes:
    """``content`` behind its length in bytes."""
    return unsigned(len(content)) + content


def name(text: str) -> bytes:
    """A name in UTF-8."""
    return sized(text.encode())


def vector(items: Iterable[bytes]) -> bytes:
    """The ``items`` behind their number."""
    listed = list(items)
    return unsigned(len(listed)) + b"".join(listed)


class ByteReader:
    """Takes one thing after the other from the front of ``content``; beyond its end there are zeros."""

    def __init__(self, content: bytes) -> None:
        """Begin at the front."""
        self.content = content

    def take(self, size: int) -> bytes:
        """The next ``size`` bytes."""
        taken, self.content = self.content[:size], self.content[size:]
        return taken

    def byte(self) -> int:
        """One byte as a number."""
        return int.from_bytes(self.take(1), "little")

    def number(self) -> int:
        """A number in LEB128 without a sign."""
        value, shift, more = 0, 0, True
        while more:
            byte = self.byte()
            value, shift, more = value | (byte & 0x7F) << shift, shift + 7, byte > 0x7F
        return value

    def name(self) -> str:
        """A name in UTF-8."""
        return self.take(self.number()).decode(errors="replace")


def sections(content: bytes, number: int) -> Iterator[bytes]:
    """The sections of a module or a component that have this ``number``."""
    rest = ByteReader(content[len(MODULE) :])
    while rest.content:
        kind, size = rest.byte(), rest.number()
        section = rest.take(size)
        if kind == number:
            yield section


class Definitions:
    """The definitions of a component in their order; each has an index among those of its sort."""

    def __init__(self) -> None:
        """Begin a component."""
        self.content = bytearray(COMPONENT)
        self._counts: Counter[str] = Counter()

    def _add(self, sort: str, section: int, body: bytes) -> int:
        self.content += bytes([section]) + sized(body)
        return self._next(sort)

    def _next(self, sort: str) -> int:
        self._counts[sort] += 1
        return self._counts[sort] - 1

    def module(self, content: bytes) -> int:
        """A module in the component."""
        return self._add("module", 1, content)

    def component(self, content: bytes) -> int:
        """A component in the component."""
        return self._add("component", 4, content)

    def type(self, body: bytes) -> int:
        """A type."""
        return self._add("type", 7, b"\1" + body)

    def canonical(self, sort: str, body: bytes) -> int:
        """A function that is lifted ("func"), or one in core WebAssembly ("core func")."""
        return self._add(sort, 8, b"\1" + body)

    def bring(self, sort: str, label: str, described: bytes) -> int:
        """An import."""
        return self._add(sort, 10, b"\1\0" + name(label) + described)

    def export(self, sort: str, label: str, index: int, ascribed: bytes = b"\0") -> int:
        """An export; what it exports has a new index, and the ``ascribed`` type."""
        return self._add(sort, 11, b"\1\0" + name(label) + _SORTS[sort] + unsigned(index) + ascribed)

    def alias(self, sort: str, instance: int, label: str) -> int:
        """An export of an instance; of a core instance where the ``sort`` is a core one."""
        core = b"\1" if sort.startswith("core") else b"\0"
        return self._add(sort, 6, b"\1" + _SORTS[sort] + core + unsigned(instance) + name(label))

    def core_instance(self, module: int, **instances: int) -> int:
        """An instance of a module with core ``instances`` as what it imports."""
        given = vector(name(label) + b"\x12" + unsigned(index) for label, index in instances.items())
        return self._add("core instance", 2, b"\1\0" + unsigned(module) + given)

    def core_bundle(self, exports: Mapping[str, tuple[str, int]]) -> int:
        """A core instance with ``exports`` {name: (sort, index)}."""
        given = vector(name(label) + _SORTS[sort][1:] + unsigned(index) for label, (sort, index) in exports.items())
        return self._add("core instance", 2, b"\1\1" + given)

    def instance(self, component: int, imports: Mapping[str, tuple[str, int]]) -> int:
        """An instance of a component with what it ``imports`` {name: (sort, index)}."""
        given = vector(name(label) + _SORTS[sort] + unsigned(index) for label, (sort, index) in imports.items())
        return self._add("instance", 5, b"\1\0" + unsigned(component) + given)


class InstanceType:
    """The type of an instance: its own types and its exports, in their order."""

    def __init__(self) -> None:
        """Begin without any."""
        self._declarations: list[bytes] = []
        self._types = 0

    @property
    def body(self) -> bytes:
        """The type as the body of a definition."""
        return b"\x42" + vector(self._declarations)

    def type(self, body: bytes) -> int:
        """A type."""
        self._declarations.append(b"\1" + body)
        self._types += 1
        return self._types - 1

    def export_type(self, label: str, index: int) -> int:
        """A name for a type, which has a new index then."""
        self._declarations.append(b"\4\0" + name(label) + EQUAL + unsigned(index))
        self._types += 1
        return self._types - 1

    def export_function(self, label: str, index: int) -> None:
        """A function of the type with this index."""
        self._declarations.append(b"\4\0" + name(label) + b"\1" + unsigned(index))
