"""Compilers: C sources in, shared libraries out.

The pinned zig (a dependency) is the default: it builds for every platform on every platform, needs nothing on the
machine, gives the same bytes everywhere and, for Linux, libraries that need no glibc newer than 2.17. No other module
of fmu/ starts programs.
"""

from __future__ import annotations

import os
import platform
import re
import shlex
import shutil
import tempfile
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future, as_completed
from functools import lru_cache
from pathlib import Path

from lag2fmu.building.build_cache import kept, place
from lag2fmu.building.process import compiling, is_zig, of_processor_alone, placed, run, zig, zig_version
from lag2fmu.codegen.sources import component_sources
from lag2fmu.errors import BuildError
from lag2fmu.fmu import windows
from lag2fmu.fmu.mach import hide, universal
from lag2fmu.fmu.platforms import Platform, host_platform
from lag2fmu.fmu.translation_units import shared_files, translation_units
from lag2fmu.fmu.wasm import runtime

FLAGS = (
    *("-std=c99", "-O2", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno", "-g0", "-DNDEBUG"),
    *("-ffunction-sections", "-fdata-sections"),  # zig's linker leaves out what nothing calls
    *("-fno-unwind-tables", "-fno-asynchronous-unwind-tables"),  # a tenth of a library, and C throws no exceptions
)

OF_WINDOWS = ("-funwind-tables", "-fasynchronous-unwind-tables")
"""Options for Windows, which finds callers by these tables alone: debuggers need them."""

LONG = 400_000
"""Characters of a C file that is long: zig looks for less in it, see SHORT_SEARCHES."""

SHORT_SEARCHES = ("-fno-slp-vectorize", "-mllvm", "-dse-memoryssa-walklimit=1")
"""Options of clang for long straight-line code.

It does not join scalar operations to vectors, the search for which takes a third of the time. The results have the same
bits, and accelerations of long mechanisms take .95 to 1 of the time. It looks only a step back for stores that later
ones make superfluous, which takes a twentieth of the time and finds none: each result is stored once.
"""

MODULE_FLAGS = (
    *("-Os" if flag == "-O2" else flag for flag in FLAGS if flag != "-fPIC"),
    *("-fno-vectorize", "-fno-unroll-loops", *SHORT_SEARCHES),
)
"""Those of modules of WebAssembly, which have no vectors: looking for some takes a tenth of the time and finds none."""

WASM = "wasm32-wasi"
"""Zig's name of the target WebAssembly with a C library."""

OF_ZIG = frozenset({"__mh_dylib_header", "___dso_handle"})
"""The names that zig's linker exports from every library for macOS; none of its options prevents this."""

Progress = Callable[[int, int, str], None]
"""A function called with the number of libraries done, the number of all, and the name of the one done or begun."""


def compiler_command(compiler: str, target: str) -> list[str]:
    """The command that compiles for ``target``; ``compiler`` is 'zig' or 'host' ($CC, cc, gcc, clang).

    Raises BuildError if no compiler is found; the message names the ones looked for.
    """
    if compiler == "zig":
        return [zig(), "cc", "-target", target, *of_processor_alone(target)]
    if compiler == "host":
        candidates = [os.environ.get("CC", ""), "cc", "gcc", "clang"]
        for candidate in candidates:
            words = shlex.split(candidate, posix=os.name == "posix")
            if words and shutil.which(words[0]):
                return words
        raise BuildError(
            f"no C compiler found; looked for $CC{' = ' + candidates[0] if candidates[0] else ''}, cc, gcc, clang; "
            "install one or use --compiler zig"
        )
    raise BuildError(f"unknown compiler '{compiler}'; known are zig and host")


def compile_library(
    sources: Mapping[str, str], include: Path, name: str, platform: Platform, compiler: str = "zig"
) -> bytes:
    """The shared library ``name`` of the C files in ``sources`` {file name: text}, for ``platform``.

    ``include`` is the folder of the headers of FMI; the result is the library's bytes, a universal one for several
    targets. Raises BuildError with the output of the compiler if it fails.
    """
    (library,) = compile_libraries(sources, include, name, [platform], compiler)
    return library


def compile_libraries(
    sources: Mapping[str, str],
    include: Path,
    name: str,
    platforms: Iterable[Platform],
    compiler: str = "zig",
    progress: Progress | None = None,
) -> list[bytes]:
    """The library for each of ``platforms``, in their order, built side by side; see ``compile_library``.

    ``progress`` is told how many of how many are done. Raises BuildError.
    """
    platforms = list(platforms)
    parts = [(p, target) for p in platforms for target in (p.targets if compiler == "zig" else p.targets[:1])]
    with compiling(max(1, min(len(parts), os.cpu_count() or 1))) as pool:
        running = {part: pool.submit(_compile, sources, include, name, part, compiler) for part in parts}
        if progress is not None:
            _report(running, progress)
        built = {part: future.result() for part, future in running.items()}
    return [universal([built[part] for part in parts if part[0] == p]) for p in platforms]


@lru_cache(maxsize=2)
def processor_macros(compiler: str = "zig") -> frozenset[str]:
    """What the compiler predefines for the processor of this machine, such as ``__AVX2__``. Raises BuildError."""
    with tempfile.TemporaryDirectory(prefix="lag2fmu-") as folder:
        Path(folder, "empty.c").write_text("", "utf-8")
        text = _run([*_for_here(compiler), "-E", "-dM", "empty.c"], Path(folder))
    return frozenset(words[1] for words in map(str.split, text.splitlines()) if words[:1] == ["#define"])


def compile_here(sources: Mapping[str, str], name: str, compiler: str = "zig") -> bytes:
    """The shared library ``name`` of ``sources`` {file name: text} for this very processor. Raises BuildError."""
    library, joined = f"{name}{host_platform().suffix}", translation_units(sources)
    linked, further = _linked(compiler, host_platform())
    command = [*_for_here(compiler), *_flags(sources, compiler, host_platform()), "-shared", "-o", library]
    command, files = [*command, *joined, *linked], {**sources, **joined, **further}
    if compiler != "zig":
        return _built(command, files, library)
    made_of = (zig_version(), _anywhere(command), sorted(processor_macros(compiler)), sorted(files.items()))
    return kept(made_of, lambda: _built(command, files, library))


def _flags(sources: Mapping[str, str], compiler: str, platform: Platform) -> tuple[str, ...]:
    """FLAGS, and what the ``platform`` and long ``sources`` {file name: text} take beside them."""
    short = SHORT_SEARCHES if compiler == "zig" and is_long(sources) else ()
    return (*FLAGS, *short, *(OF_WINDOWS if platform.suffix == ".dll" else ()))


def _linked(compiler: str, platform: Platform) -> tuple[tuple[str, ...], dict[str, str]]:
    """What stands behind the C files in a command, and the files {name: text} that this needs."""
    if compiler == "zig" and platform.suffix == ".dll":
        return (*windows.LINKED, f"-isystem{windows.headers()}"), {windows.RUNTIME: windows.runtime()}
    return ("-lm",), {}


def _anywhere(command: list[str]) -> list[str]:
    """The options of a ``command`` that are no folders of this machine."""
    return [word for word in command[1:] if not word.startswith(("-I", "-isystem"))]


def is_long(sources: Mapping[str, str]) -> bool:
    """Whether one of ``sources`` {file name: text} is LONG."""
    return max(map(len, sources.values()), default=0) > LONG


def host_target() -> str:
    """Zig's name of this machine."""
    machine = "x86_64" if platform.machine() in {"x86_64", "AMD64"} else "aarch64"
    return next(target for target in host_platform().targets if target.startswith(machine))


def _for_here(compiler: str) -> list[str]:
    """The command that compiles for this processor."""
    return [*compiler_command(compiler, host_target()), "-mcpu=native" if compiler == "zig" else "-march=native"]


def compile_module(sources: Mapping[str, str], functions: Iterable[str], *options: str) -> bytes:
    """The C files in ``sources`` {file name: text} as a module of WebAssembly that offers ``functions``.

    The module is optimised for size, and imports nothing that no ``options`` of the compiler ask for. Raises BuildError
    with the compiler's output if it fails.
    """
    joined = translation_units(sources)
    exports = [f"-Wl,--export={name}" for name in functions]
    command = [*compiler_command("zig", WASM), "-mexec-model=reactor", *MODULE_FLAGS, *options, *exports, "-s"]
    command += [*runtime.LINKED, *runtime.headers(), "-o", "page.wasm", *joined, runtime.ARCHIVE]
    files = {**sources, **joined}
    made_of = (zig_version(), _anywhere(command), runtime.made_of(), sorted(files.items()))
    return kept(made_of, lambda: _built(command, files, "page.wasm", {runtime.ARCHIVE: _runtime()}))


def _runtime() -> bytes:
    """The archive of what modules of WebAssembly take of the C library."""
    command, files = runtime.archive_command(), {runtime.OWN: runtime.own()}
    return kept((zig_version(), *runtime.made_of()), lambda: _built(command, files, runtime.ARCHIVE))


def _compile_component(sources: Mapping[str, str], include: Path) -> bytes:
    """The component for WebAssembly of the C files in ``sources`` {file name: text} of an FMU."""
    from lag2fmu.fmu.wasm.component import c_names, component

    headers = {file.name: file.read_text("utf-8") for file in sorted(include.glob("fmi*.h"))}
    imports = ("-Wl,--import-memory", "-Wl,--import-symbols")
    return component(compile_module({**component_sources(sources), **headers}, c_names(), *imports))


def compile_unit(files: Mapping[str, str], name: str, target: tuple[str, ...], *options: str) -> bytes:
    """What zig makes of the C file ``name`` of ``files`` {name: text} for a ``target`` with ``options``.

    Raises BuildError with the compiler's output if it fails.
    """
    flags = [flag for flag in FLAGS if flag not in ("-fPIC", "-fvisibility=hidden")]
    command = [*compiler_command("zig", target[0]), *target[1:], *flags, *options]
    command += ["-o", "unit.out", name]
    return kept((zig_version(), command[1:], sorted(files.items())), lambda: _built(command, files, "unit.out"))


def constant(sources: Mapping[str, str], header: str, expression: str, compiler: str = "zig") -> int:
    """The value of a constant ``expression`` in C, with a ``header`` of ``sources`` {file name: text}.

    Pointers have 64 bits, as on the processor with the largest ones. Raises BuildError with the compiler's output.
    """
    probe = f'#include "{header}"\nextern const unsigned long long probe;\n'
    probe += f"const unsigned long long probe = (unsigned long long)({expression});\n"
    command = [*compiler_command(compiler, "x86_64-linux-gnu"), "-std=c99", "-S", "-o", "probe.s", "probe.c"]
    text = _built(command, {**sources, "probe.c": probe}, "probe.s").decode()
    found = re.search(r"^_?probe:\s*(?:\.quad|\.xword|\.8byte|\.dword)\s+(\d+)", text, re.MULTILINE)
    if found is None:
        raise BuildError(f"the compiler '{command[0]}' writes no constants that can be read; use --compiler zig")
    return int(found[1])


def _report(running: Mapping[tuple[Platform, str], Future[bytes]], progress: Progress) -> None:
    """Tell ``progress`` of each target that is done."""
    futures = {future: target for (_, target), future in running.items()}
    progress(0, len(futures), "")
    for done, future in enumerate(as_completed(futures), start=1):
        progress(done, len(futures), futures[future])


def _compile(sources: Mapping[str, str], include: Path, name: str, part: tuple[Platform, str], compiler: str) -> bytes:
    """The library for one target of a platform; zig's libraries of equal sources are kept and reused."""
    platform, target = part
    if target == WASM:
        return _compile_component(sources, include)
    joined = translation_units(sources)
    library = f"{name}{platform.suffix}"
    strip = [] if platform.suffix == ".dylib" else ["-s"]
    flags = _flags(sources, compiler, platform)
    command = [*compiler_command(compiler, target), *flags, *strip, "-shared", f"-I{include}", "-o", library]
    linked, further = _linked(compiler, platform)
    command += [*joined, *linked]
    files = {**sources, **joined, **further}

    def build() -> bytes:
        built = _built(command, files, library)
        return hide(built, OF_ZIG) if platform.suffix == ".dylib" and compiler == "zig" else built

    if compiler != "zig":  # other compilers depend on the machine
        return build()
    of_fmi = [(file.name, file.read_bytes()) for file in sorted(include.glob("fmi*.h"))]
    return kept((zig_version(), _anywhere(command), of_fmi, sorted(files.items())), build)


def _built(
    command: list[str], files: Mapping[str, str], library: str, more: Mapping[str, bytes] | None = None
) -> bytes:
    """The ``library`` that ``command`` makes in a folder with the ``files`` {name: text}, and ``more``."""
    try:
        with tempfile.TemporaryDirectory(prefix="lag2fmu-") as folder:
            for file, text in files.items():
                (Path(folder) / file).write_text(text, "utf-8", newline="\n")
            for file, content in (more or {}).items():
                (Path(folder) / file).write_bytes(content)
            keeps = is_zig(command) and place() is not None
            _run([_kept_path(word, files) if keeps else word for word in command], Path(folder))
            built = Path(folder, library).read_bytes() if Path(folder, library).is_file() else b""
    except OSError as error:
        raise BuildError(
            f"the compiler's temporary folder cannot be used: {error.strerror or error}; "
            "free some space there, or set TMPDIR to another folder"
        ) from error
    if not built:
        raise BuildError(f"the compiler '{command[0]}' ended without an error but wrote no library")
    return built


def _kept_path(word: str, files: Mapping[str, str]) -> str:
    """The ``word`` of a command, or where it is a unit of the engine alone in ``files`` {name: text} its kept path."""
    shared = shared_files(word, files) if word in files else None
    folder = None if shared is None else placed(shared)
    return word if folder is None else str(folder / word)


def _run(command: list[str], folder: Path) -> str:
    """Run the compiler in ``folder`` and return its output; raises BuildError with this output if it fails."""
    done = run(command, folder)
    if done.code != 0:
        shown = (done.errors or done.output).strip()[-4000:]
        raise BuildError(f"the compiler failed with exit code {done.code} ({' '.join(command[:5])} ...):\n{shown}")
    return done.output
