"""Universal libraries of macOS: one file that holds a library for each kind of processor.

Source: Apple, Mach-O Programming Topics; the structures fat_header and fat_arch of <mach-o/fat.h>.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

_FAT_MAGIC, _MACH_MAGIC = 0xCAFEBABE, 0xFEEDFACF
_ALIGNMENT = 14
"""Binary logarithm of the alignment of each library: pages of 16 KiB, as Apple silicon has them."""


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
