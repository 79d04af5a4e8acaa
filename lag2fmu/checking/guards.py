"""Arrays for functions of C that notice what is written where it should not be."""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Iterator
from typing import Any

_BYTES = struct.pack("<Q", 0x7FF8_A5A5_A5A5_A5A5)
UNWRITTEN: float = struct.unpack("<d", _BYTES)[0]
"""What stands in arrays of numbers before a function writes to them: a NaN that no computation has as its result."""
_GUARD = bytes([0xA5]) * 256
"""What stands before and behind an array."""


class Guarded:
    """A copy of an array of C for one call, with room on both sides; ``array`` is what the function is given."""

    def __init__(self, original: ctypes.Array[Any]) -> None:
        self._original, self._before = original, bytes(original)
        self.holds: Any = original._type_
        self._memory = bytearray(_GUARD + self._before + _GUARD)
        self.array = type(original).from_buffer(self._memory, len(_GUARD))

    def given_back(self, *, reads: bool, answered: bool) -> Iterator[str]:
        """What the function did to the array that it must not do, as phrases; the original gets what it wrote.

        ``reads`` says that the function must leave the array as it is, ``answered`` that it said to have done its work.
        """
        begin, end = len(_GUARD), len(_GUARD) + len(self._before)
        after = bytes(self._memory[begin:end])
        if not (self._memory.startswith(_GUARD) and self._memory.endswith(_GUARD)):
            yield "writes beyond the array that it is given"
        if reads and after != self._before:
            yield "changes the array that it is to read"
        if answered and not reads and self.holds is ctypes.c_double and _left(self._before, after):
            yield "leaves elements of the array unwritten"
        ctypes.memmove(self._original, after, len(after))


def _left(before: bytes, after: bytes) -> bool:
    """Whether an element that was UNWRITTEN still is; an array without elements has room for one all the same."""
    words = range(0, len(before), len(_BYTES)) if _BYTES in after else ()
    return any(before[i : i + len(_BYTES)] == _BYTES == after[i : i + len(_BYTES)] for i in words)
