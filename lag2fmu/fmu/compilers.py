"""Platforms and compilers: C sources in, a shared library out.

The pinned zig (a dependency) is the default: it needs nothing on the machine, gives the same bytes everywhere and, on
Linux, a library that needs no glibc newer than 2.17. The only module that starts other programs.
"""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from lag2fmu.errors import BuildError

FLAGS = ("-std=c99", "-O2", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno", "-g0", "-DNDEBUG")


@dataclass(frozen=True)
class Platform:
    """A platform: its folder in ``binaries/``, the suffix of its libraries, the target as zig calls it."""

    folder: str
    suffix: str
    target: str


PLATFORMS = {
    ("Linux", "x86_64"): Platform("linux64", ".so", "x86_64-linux-gnu.2.17"),
    ("Linux", "aarch64"): Platform("aarch64-linux", ".so", "aarch64-linux-gnu.2.17"),
    ("Darwin", "x86_64"): Platform("darwin64", ".dylib", "x86_64-macos.11.0"),
    ("Darwin", "arm64"): Platform("darwin64", ".dylib", "aarch64-macos.11.0"),
    ("Windows", "AMD64"): Platform("win64", ".dll", "x86_64-windows-gnu"),
}
"""(system, machine) as Python's ``platform`` names them -> platform."""


def host_platform() -> Platform:
    """The platform of this machine; raises BuildError if FMI 2.0 has no folder for it."""
    key = (platform.system(), platform.machine())
    if key not in PLATFORMS:
        raise BuildError(f"this machine ({' '.join(key)}) is none of the supported platforms: {sorted(PLATFORMS)}")
    return PLATFORMS[key]


def compiler_command(compiler: str, target: Platform) -> list[str]:
    """The command that compiles for ``target``; ``compiler`` is 'zig' or 'host' ($CC, cc, gcc, clang).

    Raises BuildError if there is none, naming what was looked for.
    """
    if compiler == "zig":
        if find_spec("ziglang") is None:
            raise BuildError("the compiler zig is not installed; run 'pip install ziglang', or use --compiler host")
        return [sys.executable, "-m", "ziglang", "cc", "-target", target.target]
    if compiler == "host":
        candidates = [os.environ.get("CC", ""), "cc", "gcc", "clang"]
        for candidate in candidates:
            if candidate and shutil.which(candidate.split()[0]):
                return candidate.split()
        raise BuildError(
            f"no C compiler found; looked for $CC{' = ' + candidates[0] if candidates[0] else ''}, cc, gcc, clang; "
            "install one or use --compiler zig"
        )
    raise BuildError(f"unknown compiler '{compiler}'; known are zig and host")


def compile_library(
    sources: Mapping[str, str], include: Path, name: str, target: Platform, compiler: str = "zig"
) -> bytes:
    """The shared library ``name`` of the C files in ``sources`` {file name: text}, for ``target``.

    ``include`` is the folder of the headers of FMI. Raises BuildError with the output of the compiler if it fails.
    """
    command = compiler_command(compiler, target)
    with tempfile.TemporaryDirectory(prefix="lag2fmu-") as folder:
        for file, text in sources.items():
            (Path(folder) / file).write_text(text, "utf-8", newline="\n")
        units = sorted(file for file in sources if file.endswith(".c"))
        library = f"{name}{target.suffix}"
        strip = [] if target.suffix == ".dylib" else ["-s"]
        command += [*FLAGS, *strip, "-shared", f"-I{include}", "-o", library, *units, "-lm"]
        try:
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        except OSError as error:
            raise BuildError(f"the compiler '{command[0]}' could not be started: {error}") from error
        if done.returncode != 0:
            shown = (done.stderr or done.stdout).strip()[-4000:]
            raise BuildError(
                f"the compiler failed with exit code {done.returncode} ({' '.join(command[:5])} ...):\n{shown}"
            )
        try:
            return (Path(folder) / library).read_bytes()
        except OSError as error:
            raise BuildError(f"the compiler '{command[0]}' ended without an error but wrote no library") from error
