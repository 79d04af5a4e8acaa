"""The two small modules in a component beside that of the FMU, see ``component``; and what that one imports.

Source: the WebAssembly specification, section 5 (binary format).
"""

from __future__ import annotations

from collections.abc import Mapping

from lag2fmu.errors import BuildError
from lag2fmu.fmu.wasm.binary import MODULE, ByteReader, name, sections, sized, unsigned, vector

_I32 = b"\x7f"
_LOAD_BYTE, _LOAD, _STORE = b"\x2d\0\0", b"\x28\2\4", b"\x36\2\4"
"""Of an option: its discriminant at 0, its value at 4."""


def memory_module(pages: int) -> bytes:
    """A module that is a memory of ``pages`` pages at first."""
    return MODULE + _section(5, [b"\0" + unsigned(pages)]) + _section(7, [name("memory") + b"\2\0"])


def handle_module(makers: Mapping[str, int]) -> bytes:
    """A module with functions of the same names as the ``makers`` {name: number of parameters} of the FMU's module.

    All parameters are i32. A maker returns the address of an option with the address of an instance; here this becomes
    the instance's handle, by a function of the same name of "handles".
    """
    types, imports, codes, exports = [_function_type(1)], [], [], []
    imports.append(name("memory") + name("memory") + b"\2\0\0")
    for i, (maker, count) in enumerate(makers.items()):
        types.append(_function_type(count))
        imports.append(name("fmu") + name(maker) + b"\0" + unsigned(i + 1))
        imports.append(name("handles") + name(maker) + b"\0\0")
        exports.append(name(maker) + b"\0" + unsigned(2 * len(makers) + i))
        codes.append(sized(b"\1\1" + _I32 + _with_handle(count, 2 * i, 2 * i + 1)))
    functions = [unsigned(i + 1) for i in range(len(makers))]
    parts = {1: types, 2: imports, 3: functions, 7: exports, 10: codes}
    return MODULE + b"".join(_section(number, items) for number, items in parts.items())


def _with_handle(count: int, maker: int, handle: int) -> bytes:
    """The instructions of a function in ``handle_module``: two functions by their indices."""
    option = b"\x20" + unsigned(count)  # local.get
    call = b"".join(b"\x20" + unsigned(i) for i in range(count)) + b"\x10" + unsigned(maker)
    some = b"\x22" + unsigned(count) + _LOAD_BYTE + b"\x04\x40"  # local.tee, if
    return call + some + option * 2 + _LOAD + b"\x10" + unsigned(handle) + _STORE + b"\x0b" + option + b"\x0b"


def _function_type(count: int) -> bytes:
    return b"\x60" + vector([_I32] * count) + vector([_I32])


def _section(number: int, items: list[bytes]) -> bytes:
    return bytes([number]) + sized(vector(items))


def imported_pages(module: bytes, *functions: str) -> int:
    """The pages of memory that a ``module`` imports at least; it may import these ``functions`` beside.

    Raises BuildError if it imports something else: a function of C that is nowhere defined.
    """
    pages = 0
    for content in sections(module, 2):
        rest = ByteReader(content)
        for _ in range(rest.number()):
            rest.name()
            imported, kind = rest.name(), rest.byte()
            if kind == 2:
                bounded = rest.byte() & 1
                pages = rest.number()
                _ = rest.number() if bounded else 0
            elif kind == 0 and imported in functions:
                rest.number()
            else:
                raise BuildError(f"the C code of the component needs '{imported}', which WebAssembly does not have")
    return pages
