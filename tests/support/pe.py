"""What a Windows DLL (PE32+, x86-64) exports and imports, read from its bytes.

Source: Microsoft, PE Format, sections "Optional Header", "The .edata Section", "The .idata Section" and
"The .pdata Section".
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

_AMD64, _PE32_PLUS, _DLL = 0x8664, 0x20B, 0x2000
_EXPORTS, _IMPORTS, _CALLERS = 0, 1, 3


class Dll:
    """The DLL in ``data``; raises ValueError if it is none."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        at = struct.unpack_from("<I", data, 0x3C)[0] if data[:2] == b"MZ" else len(data)
        if data[at : at + 4] != b"PE\0\0":
            raise ValueError("not a PE file")
        machine, sections, self.time, _, _, size, flags = struct.unpack_from("<HHIIIHH", data, at + 4)
        optional = at + 24
        if (machine, data[optional : optional + 2]) != (_AMD64, struct.pack("<H", _PE32_PLUS)) or not flags & _DLL:
            raise ValueError("not a DLL for x86-64")
        self._tables = optional + 112
        self._sections = [struct.unpack_from("<8xIIII", data, optional + size + 40 * i) for i in range(sections)]

    def _offset(self, address: int) -> int:
        """The place in the file of a relative virtual address."""
        for virtual_size, start, size, place in self._sections:
            if start <= address < start + max(virtual_size, size):
                return place + address - start
        raise ValueError(f"address {address:#x} is in no section")

    def _text(self, address: int) -> str:
        start = self._offset(address)
        return self.data[start : self.data.index(b"\0", start)].decode()

    def _table(self, number: int) -> int:
        (address,) = struct.unpack_from("<I", self.data, self._tables + 8 * number)
        return self._offset(address)

    @property
    def functions_unwound(self) -> int:
        """The number of functions whose callers a debugger finds."""
        (size,) = struct.unpack_from("<I", self.data, self._tables + 8 * _CALLERS + 4)
        return size // 12

    @property
    def exported(self) -> set[str]:
        """The names that can be loaded from it."""
        count, _, addresses = struct.unpack_from("<III", self.data, self._table(_EXPORTS) + 24)
        pointers = struct.unpack_from(f"<{count}I", self.data, self._offset(addresses))
        return {self._text(pointer) for pointer in pointers}

    def _imports(self) -> Iterator[str]:
        at = self._table(_IMPORTS)
        while name := struct.unpack_from("<I", self.data, at + 12)[0]:
            yield self._text(name)
            at += 20

    @property
    def needed(self) -> set[str]:
        """The DLLs it needs."""
        return set(self._imports())
