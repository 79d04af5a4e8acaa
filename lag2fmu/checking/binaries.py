"""Rules on the shared libraries, read from their bytes by LIEF: ELF, PE and Mach-O.

Source: FMI 2.0.5, sections 2.1.1 and 2.3; FMI 3.0.2, section 2.5.1; and faults that importers do not tolerate.
"""

from __future__ import annotations

import platform
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from fnmatch import fnmatch
from functools import lru_cache
from pathlib import PurePosixPath
from typing import Any

from lag2fmu.checking.archive import Archive
from lag2fmu.checking.components import component_findings, token_findings
from lag2fmu.checking.description import FmuDescription
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.rulebook import Rulebook

Version = tuple[int, ...]

_OF_LINKERS = {"_init", "_fini", "_edata", "_end", "__bss_start", "__dso_handle", "_mh_dylib_header"}
_PARTS_OF_SYSTEMS = (
    *("libc.so.6", "libm.so.6", "libdl.so.2", "libpthread.so.0", "librt.so.1", "ld-linux*.so.*"),
    *("libc.so", "libc.musl-*.so.1"),
    *("kernel32.dll", "api-ms-win-*.dll", "ucrtbase.dll", "msvcrt.dll", "ntdll.dll", "user32.dll", "advapi32.dll"),
    *("shell32.dll", "ole32.dll", "ws2_32.dll", "/usr/lib/*", "/system/library/*"),
)
"""Libraries that every system of its kind has; in small letters."""

_MACH_O = (b"\xcf\xfa\xed\xfe", b"\xce\xfa\xed\xfe", b"\xca\xfe\xba\xbe")
"""The first bytes of files for macOS: 64 bit, 32 bit, universal."""

_OLD_GLIBC: Version = (2, 28)
"""Libraries that need a glibc newer than this one, of 2018 (Debian 10, RHEL 8), get a warning."""

_FOLDERS = {
    "linux32": ("ELF", "i386"),
    "x86-linux": ("ELF", "i386"),
    "linux64": ("ELF", "x86_64"),
    "x86_64-linux": ("ELF", "x86_64"),
    "aarch64-linux": ("ELF", "aarch64"),
    "aarch32-linux": ("ELF", "arm"),
    "riscv64-linux": ("ELF", "riscv"),
    "win32": ("PE", "i386"),
    "x86-windows": ("PE", "i386"),
    "win64": ("PE", "amd64"),
    "x86_64-windows": ("PE", "amd64"),
    "aarch64-windows": ("PE", "arm64"),
    "darwin64": ("MachO", "x86_64 arm64"),
    "x86_64-darwin": ("MachO", "x86_64"),
    "aarch64-darwin": ("MachO", "arm64"),
}
"""{folder in binaries/: format and processors, by LIEF's names}; darwin64 is loaded on two processors."""


@dataclass(frozen=True)
class LibraryFacts:
    """The facts of a library for one processor that rules need; ``glibc`` is the version it needs, () if none."""

    format: str
    processor: str
    exported: frozenset[str]
    needed: frozenset[str]
    glibc: Version = ()
    hazards: tuple[str, ...] = ()


@lru_cache(maxsize=16)
def read_libraries(data: bytes) -> tuple[LibraryFacts, ...]:
    """The library in ``data``, or those of a universal file of macOS; none if ``data`` is no library."""
    if not _is_whole(data):
        return ()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # LIEF warns of numbers that it has no name for
        return _parsed(data)


def _quiet_lief() -> Any:
    """The package LIEF, which prints nothing; else it tells of damaged files, and of itself when Python ends."""
    import lief

    lief.logging.disable()
    lief.disable_leak_warning()
    return lief


def _parsed(data: bytes) -> tuple[LibraryFacts, ...]:
    lief = _quiet_lief()
    parsed: Any = lief.MachO.parse(data) if data.startswith(_MACH_O) else lief.parse(data)
    if isinstance(parsed, lief.ELF.Binary):
        return (_elf(parsed),)
    if isinstance(parsed, lief.PE.Binary):
        return (_pe(parsed),)
    return tuple(map(_mach_o, parsed)) if isinstance(parsed, lief.MachO.FatBinary) else ()


def _is_whole(data: bytes) -> bool:
    """Whether ``data`` begins like a library and is long enough for its headers."""
    return len(data) > 256 and data.startswith((b"\x7fELF", b"MZ", *_MACH_O))


def _names(symbols: Any) -> frozenset[str]:
    return frozenset(str(symbol.name) for symbol in symbols)


def _word(value: Any) -> str:
    """An enumerator's name in small letters; in a damaged library it may be a mere number."""
    return str(getattr(value, "name", value)).lower()


def _elf(binary: Any) -> LibraryFacts:
    versions = {str(v.name) for r in binary.symbols_version_requirement for v in r.get_auxiliary_symbols()}
    glibc = [tuple(map(int, m[1].split("."))) for v in versions if (m := re.fullmatch(r"GLIBC_([\d.]+)", v))]
    processor = _word(binary.header.machine_type)
    exported = _names(s for s in binary.exported_symbols if not str(s.name).startswith("_ZGV"))
    hazards = tuple(_elf_hazards(binary))
    return LibraryFacts(
        "ELF", processor, exported, frozenset(map(str, binary.libraries)), max(glibc, default=()), hazards
    )


def _elf_hazards(binary: Any) -> Iterator[str]:
    """Phrases on why a hardened system refuses the library, or loads other libraries than those meant."""
    import lief

    tags = lief.ELF.DynamicEntry.TAG
    stacks = [s for s in binary.segments if s.type == lief.ELF.Segment.TYPE.GNU_STACK]
    if not stacks or any(s.has(lief.ELF.Segment.FLAGS.X) for s in stacks):
        yield "asks for an executable stack, which hardened systems refuse"
    if binary.has(tags.TEXTREL):
        yield "has text relocations, which hardened systems refuse"
    for tag in (tags.RPATH, tags.RUNPATH):
        for path in str(getattr(binary.get(tag), tag.name.lower())).split(":") if binary.has(tag) else ():
            if not path.startswith(("$ORIGIN", "${ORIGIN}")):
                yield f"searches libraries in '{path}' of the machine it was built on"


def _pe(binary: Any) -> LibraryFacts:
    exports = binary.get_export()
    names = _names(e for e in exports.entries if e.name) if exports is not None else frozenset()
    return LibraryFacts("PE", _word(binary.header.machine), names, frozenset(map(str, binary.libraries)))


def _mach_o(binary: Any) -> LibraryFacts:
    import lief

    kinds = lief.MachO.LoadCommand.TYPE
    needed = {str(d.name) for d in binary.libraries if d.command in (kinds.LOAD_DYLIB, kinds.LOAD_WEAK_DYLIB)}
    names = frozenset(str(s.name).removeprefix("_") for s in binary.exported_symbols)
    processor = _word(binary.header.cpu_type)
    unsigned = processor == "arm64" and not binary.has_code_signature
    hazards = ("is not signed; Apple silicon loads signed libraries only",) if unsigned else ()
    return LibraryFacts("MachO", processor, names, frozenset(needed), (), hazards)


# ----------------------------------------------------------------------------------------------------------- rules


def binary_findings(archive: Archive, description: FmuDescription, rules: Rulebook) -> Iterator[Finding]:
    """The broken rules on every library in binaries/ that bears the name of the model.

    Source: FMI 2.0.5 specification, sections 2.1.1 and 2.3; FMI 3.0.2 specification, section 2.5.1.
    """
    yield from component_findings(archive, description, rules)
    for name, folder in _native(archive, description, rules).items():
        data = archive.read(name)
        found = read_libraries(data)
        wanted, processors = _FOLDERS[folder]
        if not found or any(part.format != wanted for part in found):
            shown = found[0].format if found else "no library that can be read"
            yield Finding("binary-format", name, f"is {shown}", f"{folder} wants a library in the format {wanted}")
            continue
        if not {part.processor for part in found} & set(processors.split()):
            problem = f"is for {', '.join(part.processor for part in found)}"
            yield Finding("binary-processor", name, problem, f"{folder} wants {processors.replace(' ', ' or ')}")
        for part in found:
            yield from _functions(name, part, description, rules)
            yield from _imports(name, part, archive)
            yield from _hazards(name, part, on_this_machine=folder in rules.hosts())
        yield from token_findings(name, data, description)


def _native(archive: Archive, description: FmuDescription, rules: Rulebook) -> dict[str, str]:
    """{name in the archive: folder in binaries/} of the libraries that are no components for WebAssembly."""
    return {name: folder for name, folder in rules.libraries(archive, description).items() if folder in _FOLDERS}


def _functions(name: str, part: LibraryFacts, description: FmuDescription, rules: Rulebook) -> Iterator[Finding]:
    stem = PurePosixPath(name).stem
    kinds = [kind for kind, identifier in description.identifiers.items() if identifier == stem]
    for kind in kinds:
        missing = sorted(rules.functions[kind] - part.exported)
        if missing:
            problem = f"does not export {_some(missing)} of {kind}"
            yield Finding("binary-functions", name, problem, "export all, also those that only return an error")
    others = sorted(part.exported - frozenset().union(*rules.functions.values()) - _OF_LINKERS)
    if others:
        problem = f"exports {_some(others)}, which may clash with other libraries"
        yield Finding("binary-exports", name, problem, "hide all but the functions of FMI", "warning")


def _some(names: list[str]) -> str:
    shown = [name if len(name) <= 40 else f"{name[:37]}..." for name in names[:4]]
    return ", ".join(shown) + (f" and {len(names) - 4} more" if len(names) > 4 else "")


def _imports(name: str, part: LibraryFacts, archive: Archive) -> Iterator[Finding]:
    folder = str(PurePosixPath(name).parent)
    beside = {PurePosixPath(file).name.lower() for file in archive.below(folder)}
    foreign = [
        needed
        for needed in sorted(part.needed)
        if not any(fnmatch(needed.lower(), pattern) for pattern in _PARTS_OF_SYSTEMS)
        and PurePosixPath(needed).name.lower() not in beside
    ]
    if foreign:
        problem = f"needs {_some(foreign)}, which not every machine has"
        yield Finding("binary-imports", name, problem, "link statically or put it beside", "warning")


def _hazards(name: str, part: LibraryFacts, *, on_this_machine: bool) -> Iterator[Finding]:
    for hazard in part.hazards:
        yield Finding("binary-hazard", name, hazard, "change the options of compiler and linker", "warning")
    if part.glibc > _OLD_GLIBC:
        own = _host_glibc() if on_this_machine else ()
        severe = bool(own) and part.glibc > own
        problem = f"needs glibc {_dotted(part.glibc)}" + (f"; this machine has {_dotted(own)}" if severe else "")
        remedy = "build on an older system, or with a compiler that targets one"
        yield Finding("binary-glibc", name, problem, remedy, "error" if severe else "warning")


def _dotted(version: Version) -> str:
    return ".".join(map(str, version))


def _host_glibc() -> Version:
    """The glibc of this machine, () where there is none."""
    library, version = platform.libc_ver()
    return tuple(int(part) for part in version.split(".")) if library == "glibc" else ()


def glibc_notes(archive: Archive, description: FmuDescription, rules: Rulebook) -> list[str]:
    """A sentence on the glibc that each library for Linux needs."""
    return [
        f"{name} needs glibc {_dotted(part.glibc)}"
        for name, folder in _native(archive, description, rules).items()
        if _FOLDERS[folder][0] == "ELF"
        for part in read_libraries(archive.read(name))
        if part.glibc
    ]
