"""Libraries for Windows with the C runtime that is part of it, and nothing of MinGW-w64's beside that.

Zig would first compile the 450 files of MinGW-w64, which takes 75 s of CPU time. An FMU needs an entry of them, and
``snprintf``. Sines and the care for long stacks are those of compiler-rt, as they are with these files.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

from lag2fmu.building.process import zig
from lag2fmu.resources import resource_folder

RUNTIME = "windows_runtime.c"
"""The C file that a library is linked with."""
_PARTS = ("heap", "math", "private", "stdio", "string")
"""Of the Universal C Runtime."""

LINKED = (RUNTIME, "-nostdlib", "-rtlib=compiler-rt", *(f"-lapi-ms-win-crt-{part}-l1-1-0" for part in _PARTS))
"""What stands behind the C files in a command of zig, in place of ``-lm``."""


def headers() -> Path:
    """The folder of the headers of Windows and its C runtime; raises BuildError if zig is not installed."""
    return Path(zig()).parent / "lib" / "libc" / "include" / "any-windows-any"


@cache
def runtime() -> str:
    """The text of RUNTIME."""
    return (resource_folder("templates") / "windows" / "runtime.c").read_text("utf-8")
