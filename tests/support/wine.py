"""Wine, which runs programs of Windows: how they are started, with folders of settings in the cache."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from lag2fmu.fmu.windows import LINKED, RUNTIME, headers, runtime

CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "lag2fmu-tests"
LOADERS = {64: ("wine64", "/usr/lib/wine/wine64", "wine"), 32: ("wine32", "/usr/lib/wine/wine")}
"""{bits of a program: what may run it}"""


def wine(bits: int) -> tuple[str, dict[str, str]]:
    """What runs programs of ``bits`` bits, and the environment for it; the test is skipped where there is none.

    The first call on a machine takes some seconds.
    """
    import fcntl  # which Windows has not

    loader = next((path for path in map(shutil.which, LOADERS[bits]) if path), None)
    if loader is None:
        pytest.skip(f"Wine for {bits} bits is not on this machine (Debian: wine{bits})")
    CACHE.mkdir(parents=True, exist_ok=True)
    place = CACHE / ("wine" if bits == 64 else f"wine{bits}")
    settings = {"WINEPREFIX": str(place), "WINEDEBUG": "-all", "WINEDLLOVERRIDES": "mscoree,mshtml="}
    settings |= {"WINEARCH": "win32"} if bits == 32 else {}
    with (CACHE / "wine.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (place / "system.reg").exists():
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            subprocess.run([loader, "wineboot", "--init"], env=os.environ | settings, timeout=300, check=False, **quiet)
    return loader, settings


def alone(folder: Path) -> tuple[str, ...]:
    """What stands behind the C files in a command of zig for a program, which is then linked as libraries of FMUs are.

    Else zig would compile all of MinGW-w64. What comes with a library is written to the ``folder``.
    """
    (folder / RUNTIME).write_text(runtime(), "utf-8")
    linked = [str(folder / word) if word == RUNTIME else word for word in LINKED]
    further = ("-lkernel32", *(f"-lapi-ms-win-crt-{part}-l1-1-0" for part in ("convert", "runtime", "utility")))
    entry = ("-Wl,-e,mainCRTStartup", "-Wl,--subsystem,console")
    return (str(Path(__file__).with_name("windows_program.c")), *linked, *further, *entry, f"-isystem{headers()}")
