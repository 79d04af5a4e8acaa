"""The few functions of the C library that modules of WebAssembly take, built apart.

Zig would first compile all of wasi-libc, which takes 30 s of CPU time. Its parts in Zig are one file. Of its parts in C
a module needs ``snprintf``, and ``pow``, ``atan2`` and ``sinh`` of expressions, with what they call.
"""

from __future__ import annotations

from pathlib import Path

from lag2fmu.building.process import zig
from lag2fmu.resources import resource_folder

ARCHIVE = "libruntime.a"
LINKED = ("-nostdlib", "-rtlib=compiler-rt")
"""The options of a module that is linked with it, which stands behind the C files."""
OWN = "runtime.c"
"""The C file that ends what the others call."""

_FILES = (
    *("stdio/snprintf.c", "stdio/vsnprintf.c", "stdio/vfprintf.c", "stdio/fwrite.c", "stdio/__towrite.c"),
    *("math/pow.c", "math/pow_data.c", "math/exp_data.c", "math/ldexp.c", "math/scalbn.c", "math/__math_invalid.c"),
    *("math/__math_oflow.c", "math/__math_uflow.c", "math/__math_xflow.c", "math/atan2.c", "math/sinh.c"),
    *("math/__expo2.c", "math/expm1.c"),
)
"""Of musl, in ``src``; some stand in wasi-libc's own version of it."""
_FLAGS = ("-std=gnu99", "-D_XOPEN_SOURCE=700", "-Os", "-w", "-g0", "-fno-strict-aliasing", "-fvisibility=hidden")
_TARGET = ("-target", "wasm32-wasi", "-OReleaseSmall", "-fstrip", "-lc", "--name", "runtime")


def own() -> str:
    """The text of OWN."""
    return (resource_folder("templates") / "wasm" / OWN).read_text("utf-8")


def made_of() -> tuple[object, ...]:
    """What the archive depends on, beside the version of zig."""
    return (_TARGET, _FLAGS, _FILES, own())


def headers() -> list[str]:
    """The options that name the folders of the headers of the C library; raises BuildError if zig is not installed."""
    include = _library() / "include"
    return [f"-isystem{include / name}" for name in ("wasm-wasi-musl", "generic-musl")]


def archive_command() -> list[str]:
    """The command that makes ARCHIVE in a folder with OWN; raises BuildError if zig is not installed."""
    top, musl = _library() / "wasi" / "libc-top-half", _library() / "musl"
    both = (top / "musl", musl)
    inner = [place / "arch" / name for place in both for name in ("wasm32", "generic")]
    inner += [place / "src" / name for name in ("include", "internal") for place in both]
    inner += [top / "headers" / "private"]
    public = [word for option in headers() for word in ("-isystem", option.removeprefix("-isystem"))]
    files = [next(path for place in both if (path := place / "src" / name).is_file()) for name in _FILES]
    command = [zig(), "build-lib", *_TARGET, str(_library().with_name("c.zig"))]
    command += [*(f"-I{place}" for place in inner), *public, "-cflags", *_FLAGS, "--", *map(str, files), OWN]
    return command


def _library() -> Path:
    """The folder of the C libraries that come with zig."""
    return Path(zig()).parent / "lib" / "libc"
