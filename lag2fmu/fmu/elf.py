"""Object files of ELF, as compilers write them for Linux and for firmware.

Source: Tool Interface Standard, Executable and Linking Format, version 1.2, and its 64-bit form in the System V ABI.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Mapping

_FORMS = {1: ("<I", 32, 46, "<6I"), 2: ("<Q", 40, 58, "<2I4Q")}
"""Class -> form and place of the sections' offset, place of their counts, form of a section's first six words."""


def section_sizes(data: bytes) -> Mapping[str, int]:
    """{name: bytes} of the sections of the little-endian object ``data``; those of equal names are added up."""
    form, place, counts, section = _FORMS[data[4]]
    (offset,) = struct.unpack_from(form, data, place)
    size, number, of_names = struct.unpack_from("<3H", data, counts)
    table = [struct.unpack_from(section, data, offset + i * size) for i in range(number)]
    names = table[of_names][4]
    sizes: Counter[str] = Counter()
    for name, *_, bytes_of in table:
        begin = names + name
        sizes[data[begin : data.index(0, begin)].decode()] += bytes_of
    return sizes
