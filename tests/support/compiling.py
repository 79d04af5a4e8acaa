"""Compiling C text with each compiler at hand, warnings being errors, and calling the result."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import sys
from collections.abc import Collection, Mapping
from pathlib import Path

from lag2fmu.building.process import of_processor_alone
from lag2fmu.fmu.backends.native import fmi_headers
from lag2fmu.fmu.platforms import host_platform
from lag2fmu.fmu.translation_units import translation_units

STRICT = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", "-ffp-contract=off", "-fPIC"]
_HERE = host_platform().targets[0]
TARGET = ["-target", _HERE, *of_processor_alone(_HERE)] if sys.platform == "linux" else []
"""That of FMUs, for which zig has built the parts of the C library already; what it takes for itself is another one."""
COMPILERS = {"zig": [sys.executable, "-m", "ziglang", "cc", *TARGET]}
UNOPTIMISED = {"zig": ("-O2", "-Xclang", "-O0", "-g0"), "gcc": ("-O0",)}
"""Options that leave out the optimisation. With -O0 alone zig builds other parts of the C library, which takes long.
What a debugger reads would take a third more time."""
if shutil.which("gcc"):
    COMPILERS["gcc"] = ["gcc"]
QUICK = COMPILERS["zig"]
"""The command of the compiler that takes least time: without optimisation gcc takes 2.5 times as long for an FMU."""


def compiled(
    folder: Path,
    sources: Mapping[str, str],
    compiler: str = "zig",
    units: tuple[str, ...] = (),
    options: tuple[str, ...] = (),
    apart: Collection[str] = (),
) -> ctypes.CDLL:
    """The shared library of ``units`` (default: all .c files) of ``sources``, compiled in ``folder``.

    All files are joined as an export joins them, but for those ``apart``, each of which is compiled alone.
    """
    joined = {name: text for name, text in sources.items() if name not in apart}
    together = {} if units or not any(name.endswith(".c") for name in joined) else translation_units(joined)
    for name, text in {**sources, **together}.items():
        (folder / name).write_text(text, "utf-8")
    chosen = units or (*together, *sorted(apart))
    library = folder / f"{compiler}.so"
    command = [
        *COMPILERS[compiler],
        *STRICT,
        *options,
        f"-I{fmi_headers()}",
        "-shared",
        "-o",
        str(library),
        *chosen,
        "-lm",
    ]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return ctypes.CDLL(str(library))
