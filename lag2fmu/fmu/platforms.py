"""Platforms: where their libraries stand in an FMU, and what zig calls them."""

from __future__ import annotations

import platform as machine
from collections.abc import Callable, Sequence
from typing import NamedTuple

from lag2fmu.errors import BuildError
from lag2fmu.fmu.wasm.draft import FOLDER as WASM_FOLDER
from lag2fmu.fmu.wasm.draft import NAME as WASM_NAME


class Platform(NamedTuple):
    """A platform: its folders in ``binaries/``, the suffix of its libraries, its targets as zig calls them.

    The libraries of several targets are joined in one file. ``folders`` are those of FMI 2.0, ``tuples`` those of
    FMI 3.0 for the same processors, in the same order. FMI 2.0 has names of its own for five platforms; for others its
    section 2.3 lets exporters choose, and importers look for the tuple of FMI 3.0.
    """

    folders: tuple[str, ...]
    tuples: tuple[str, ...]
    suffix: str
    targets: tuple[str, ...]


DESKTOP = ("linux64", "win64", "darwin", "aarch64-linux")
"""The platforms of 'all'."""

PLATFORMS = {
    "linux64": Platform(("linux64",), ("x86_64-linux",), ".so", ("x86_64-linux-gnu.2.17",)),
    "win64": Platform(("win64",), ("x86_64-windows",), ".dll", ("x86_64-windows-gnu",)),
    "darwin": Platform(
        ("aarch64-darwin", "darwin64"),
        ("aarch64-darwin", "x86_64-darwin"),
        ".dylib",
        ("x86_64-macos.11.0", "aarch64-macos.11.0"),
    ),
    "aarch64-linux": Platform(("aarch64-linux",), ("aarch64-linux",), ".so", ("aarch64-linux-gnu.2.17",)),
    "linux64-musl": Platform(("linux64",), ("x86_64-linux",), ".so", ("x86_64-linux-musl",)),
    "linux32": Platform(("linux32",), ("x86-linux",), ".so", ("x86-linux-gnu.2.17",)),
    "aarch32-linux": Platform(("aarch32-linux",), ("aarch32-linux",), ".so", ("arm-linux-gnueabihf.2.17",)),
    "riscv64-linux": Platform(("riscv64-linux",), ("riscv64-linux",), ".so", ("riscv64-linux-gnu.2.27",)),
    "win32": Platform(("win32",), ("x86-windows",), ".dll", ("x86-windows-gnu",)),
    "aarch64-windows": Platform(("aarch64-windows",), ("aarch64-windows",), ".dll", ("aarch64-windows-gnu",)),
    "wasm": Platform((), (WASM_FOLDER,), ".wasm", ("wasm32-wasi",)),
}
"""{name: platform}. Importers on Apple silicon look in either of two folders, hence the same file stands in both.

A library for musl (Alpine) stands where importers look for one of Linux, so an FMU has that of glibc or that of musl.
The first glibc for riscv64 is 2.27. The processor of aarch32-linux has floating point in hardware, as ARMv7 does.
A component for WebAssembly belongs to FMI 3.0 alone, see ``wasm.draft``.
"""

WASM = PLATFORMS["wasm"]

GROUPS = {"all": DESKTOP, "every": tuple(name for name in PLATFORMS if name not in ("linux64-musl", "wasm"))}
"""{choice: names of platforms}: what desktops need, and all processors that fit in one FMU of either version."""

CHOICES = ("host", *PLATFORMS, *GROUPS)

_HOSTS = {
    ("Linux", "x86_64"): "linux64",
    ("Linux", "aarch64"): "aarch64-linux",
    ("Darwin", "x86_64"): "darwin",
    ("Darwin", "arm64"): "darwin",
    ("Windows", "AMD64"): "win64",
}
"""{(system, machine) by Python's ``platform``: name in PLATFORMS}."""


def host_name() -> str:
    """The name in PLATFORMS of this machine; raises BuildError if there is none."""
    key = (machine.system(), machine.machine())
    if key not in _HOSTS:
        raise BuildError(f"this machine ({' '.join(key)}) is none of the supported platforms: {', '.join(PLATFORMS)}")
    return _HOSTS[key]


def host_platform() -> Platform:
    """The platform of this machine; raises BuildError if it is none of PLATFORMS."""
    return PLATFORMS[host_name()]


def choose_platforms(choice: str, compiler: str = "zig") -> tuple[Platform, ...]:
    """The platforms of ``choice``: names of CHOICES, with commas between them, each platform once.

    The compiler 'host' makes libraries for this machine only. Raises BuildError for any other choice, and for two
    platforms whose libraries would stand in one folder.
    """
    names = _names(choice)
    if compiler != "host":
        return tuple(PLATFORMS[name] for name in names)
    host = host_name()
    for name in names:
        if name != host:
            raise BuildError(f"the host compiler builds for this machine only, not for '{name}'; use --compiler zig")
    found = PLATFORMS[host]
    if machine.machine() == "x86_64" and len(found.folders) > 1:
        # a library built on an Intel Mac does not run on Apple silicon
        found = found._replace(folders=found.folders[1:], tuples=found.tuples[1:])
    return (found,)


def _names(choice: str) -> tuple[str, ...]:
    """The names in PLATFORMS of ``choice``, see ``choose_platforms``."""
    found: dict[str, None] = {}
    for word in map(str.strip, choice.split(",")):
        if word not in CHOICES:
            raise BuildError(f"unknown platform '{word}'; known are {', '.join(CHOICES)}")
        found |= dict.fromkeys([host_name()] if word == "host" else GROUPS.get(word, (word,)))
    if {"linux64", "linux64-musl"} <= found.keys():
        raise BuildError(
            f"--platform {choice}: the libraries of linux64 (glibc) and linux64-musl stand in one folder of an FMU; "
            "name one of the two, or make two FMUs"
        )
    return tuple(found)


def binaries_text(platforms: Sequence[Platform], folders: Callable[[Platform], Sequence[str]], compiler: str) -> str:
    """Which libraries there are in binaries/ for ``platforms`` and what they need, as a phrase.

    ``folders`` are those of a platform by the version of FMI.
    """
    places = sorted(folder for platform in platforms for folder in folders(platform))
    listed = ", ".join(places)
    if compiler == "host":
        name, version = machine.libc_ver()
        needed = f"{name} {version}" if name else "the C library"
        return f"{listed}; built by the compiler of one machine, it needs {needed} as there or newer"
    linux = "musl" if PLATFORMS["linux64-musl"] in platforms else "glibc 2.17 or newer"
    linux += ", on riscv64 2.27" if "riscv64-linux" in places else ""
    alone = (
        f"{WASM_FOLDER}: a component for WebAssembly by the draft {WASM_NAME}, which needs an importer that runs these"
    )
    if places == [WASM_FOLDER]:
        return alone
    beside = f"; {alone}" if WASM_FOLDER in places else ""
    listed = ", ".join(place for place in places if place != WASM_FOLDER)
    return f"{listed}; they need the C library of the system only (on Linux {linux}, on macOS 11 or newer){beside}"
