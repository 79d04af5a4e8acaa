"""What a mechanism in plain C takes on processors: code, constants, and the deepest stack, from the compiler's output.

The assembly of one file holds all calls and, in its section ``.stack_sizes``, the frame of every function. The deepest
stack is that of the longest path of calls. A function that is called by its address has no caller there, and counts as
called wherever an address is. What the C library and the compiler's own functions take, such as ``sin`` or the division
of doubles on a processor without them, is not in these numbers.
"""

from __future__ import annotations

import re
import struct
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise

from lag2fmu.fmu.compilers import compile_unit
from lag2fmu.fmu.taken import Footprint

TARGETS: Mapping[str, tuple[str, ...]] = {
    "x86-64": ("x86_64-linux-musl",),
    "aarch64": ("aarch64-linux-musl",),
    "Cortex-M4F": ("thumb-linux-musleabihf", "-mcpu=cortex_m4"),
    "Cortex-M7": ("thumb-linux-musleabihf", "-mcpu=cortex_m7"),
    "riscv32": ("riscv32-linux-musl",),
    "armv7": ("arm-linux-musleabihf",),
    "riscv64": ("riscv64-linux-musl",),
}
"""{processor: zig's target, options}; the headers of musl are there in place of those of a firmware's C library."""
FIRMWARE = ("x86-64", "aarch64", "Cortex-M4F", "Cortex-M7", "riscv32")
"""The processors of programs in plain C."""
LINUX = {"x86_64": "x86-64", "aarch64": "aarch64", "arm": "armv7", "riscv64": "riscv64"}
"""{the begin of zig's target: processor} for libraries; frames of x86 of 32 bits are not all in its listings."""

_RETURN_ADDRESS = {"x86-64": 8}
"""Bytes that a call puts on the stack beside the frame of the function that is called; others have a register."""

_BY_ADDRESS = re.compile(
    r"^(callq\s+\*|blx\s+r|blr\s+x|jalr\s+[ast]\d|jmpq\s+\*.*TAILCALL|bx\s+r.*TAILCALL|br\s+x.*TAILCALL)"
)
_BRANCH = re.compile(r"^(callq?|jmp|bl|blx|b|b\.w|call|tail|jal)\s+([A-Za-z_.$][\w.$]*)")
_BEGIN, _SIZE = re.compile(r"^(\.Lfunc_begin\d+):"), re.compile(r"^\.(?:quad|xword|long|word)\s+(\.Lfunc_begin\d+)$")

_FORMS = {1: ("<I", 32, 46, "<6I"), 2: ("<Q", 40, 58, "<2I4Q")}
"""Class -> form and place of the sections' offset, place of their counts, form of a section's first six words."""


@dataclass
class _Function:
    frame: int = 0
    calls: set[str] = field(default_factory=set)
    by_address: bool = False


def footprints(
    name: str, files: Mapping[str, str], outside: str, processors: Iterable[str] = FIRMWARE
) -> tuple[Footprint, ...]:
    """The footprint on each of ``processors``, names in TARGETS, of the C file ``name`` among ``files`` {name: text}.

    What is called from ``outside`` are the public functions whose names match this regular expression. Raises
    BuildError with the compiler's output if it fails.
    """
    return tuple(_footprint(processor, TARGETS[processor], name, files, outside) for processor in processors)


def _footprint(processor: str, target: tuple[str, ...], name: str, files: Mapping[str, str], outside: str) -> Footprint:
    options = ("-S", "-fstack-size-section", "-ffunction-sections", "-fdata-sections")
    listing = compile_unit(files, name, target, *options).decode("utf-8", "replace")
    sizes = _section_sizes(compile_unit({"unit.s": listing}, "unit.s", target, "-c"))
    code = sum(size for section, size in sizes.items() if section.startswith(".text"))
    constants = sum(size for section, size in sizes.items() if section.startswith((".rodata", ".data.rel.ro")))
    entries = {
        found for found in re.findall(r"^\s*\.globl\s+(\S+)", listing, re.MULTILINE) if re.fullmatch(outside, found)
    }
    stack, path = deepest(listing, entries, _RETURN_ADDRESS.get(processor, 0))
    return Footprint(processor, code, constants, stack, path)


def deepest(listing: str, entries: Collection[str], return_address: int = 0) -> tuple[int, tuple[str, ...]]:
    """The stack (bytes) of the deepest path of calls in the assembly ``listing``, and the functions on it.

    It begins with one of ``entries``. ``return_address``: the bytes that each call takes beside frames. Recursion is
    entered once.
    """
    functions = _functions(listing)
    called = {name for function in functions.values() for name in function.calls}
    hidden = {name for name in functions if name not in called and f"\t.globl\t{name}" not in listing}
    depths: dict[str, tuple[int, tuple[str, ...]]] = {}

    def depth(name: str, above: tuple[str, ...]) -> tuple[int, tuple[str, ...]]:
        if name not in depths:
            function = functions[name]
            others = (function.calls | (hidden if function.by_address else set())) - {name, *above}
            size, path = max((depth(other, (*above, name)) for other in others), default=(0, ()))
            depths[name] = (function.frame + return_address + size, (name, *path))
        return depths[name]

    return max((depth(name, ()) for name in functions if name in entries), default=(0, ()))


def _functions(listing: str) -> dict[str, _Function]:
    """{name: function} of an assembly ``listing``."""
    names = set(re.findall(r"^\s*\.type\s+([\w.$]+),\s*[@%]function", listing, re.MULTILINE))
    found: dict[str, _Function] = defaultdict(_Function)
    begins: dict[str, str] = {}
    current = ""
    lines = [line.strip() for line in listing.splitlines()]
    for line, following in pairwise([*lines, ""]):
        label = line.split(":", 1)[0] if ":" in line else ""
        if label in names:
            current = label
            found[current]
        elif begin := _BEGIN.match(line):
            begins[begin[1]] = current
        elif size := _SIZE.match(line):
            found[begins[size[1]]].frame = _uleb(following)
        elif current and (branch := _BRANCH.match(line)) and branch[2].removesuffix("@PLT") in names:
            found[current].calls.add(branch[2].removesuffix("@PLT"))
        elif current and _BY_ADDRESS.match(line):
            found[current].by_address = True
    return dict(found)


def _uleb(line: str) -> int:
    """The number that a directive of bytes holds in the form ULEB128."""
    kind, _, text = line.partition("\t")
    if kind == ".ascii":
        data = [int(octal, 8) if octal else ord(plain) for octal, plain in re.findall(r'\\([0-7]{3})|([^"\\])', text)]
    else:
        data = [int(word, 0) for word in text.split(",")]
    return sum((byte & 0x7F) << 7 * place for place, byte in enumerate(data))


def _section_sizes(data: bytes) -> Mapping[str, int]:
    """{name: bytes} of the sections of a little-endian object ``data`` in ELF; those of equal names are added up.

    Source: Tool Interface Standard, Executable and Linking Format, version 1.2, and its 64-bit form in the System V
    ABI.
    """
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
