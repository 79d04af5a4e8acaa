"""Libraries that are compiled for the processor of this machine, loaded, and called in threads."""

from __future__ import annotations

import ctypes
import os
import tempfile
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TypeVar

from lag2fmu.errors import BuildError
from lag2fmu.fmu.compilers import compile_here, processor_macros
from lag2fmu.fmu.platforms import host_platform

Part = TypeVar("Part")
_LANES = (("__AVX512F__", 16), ("__AVX__", 8))
"""(macro that the compiler predefines for a processor, doubles in two of its registers); other processors have 4.

Two registers side by side hide the time that each operation takes."""


def lanes_here(compiler: str) -> int:
    """The number of lanes that suits the processor, according to ``compiler``."""
    macros = processor_macros(compiler)
    return next((lanes for macro, lanes in _LANES if macro in macros), 4)


def built(sources: Mapping[str, str], name: str, compiler: str) -> KernelLibrary:
    """The library ``name`` of ``sources`` {file name: text}, compiled or kept, and loaded; raises BuildError."""
    return KernelLibrary(compile_here(sources, name, compiler), f"{name}{host_platform().suffix}")


def in_threads(work: Callable[[Part], None], parts: Iterable[Part], stop: Callable[[], None] = lambda: None) -> None:
    """Do the ``work`` on all ``parts``, each in a thread of its own; a single part in this thread.

    ``stop`` is called if this thread is interrupted, and makes the other threads end.
    """
    parts = list(parts)
    if len(parts) == 1:
        work(parts[0])
        return
    with ThreadPoolExecutor(len(parts)) as pool:
        try:
            list(pool.map(work, parts))
        except BaseException:
            stop()
            raise


class KernelLibrary:
    """A compiled library, loaded; its functions run without Python's lock."""

    def __init__(self, content: bytes, name: str) -> None:
        """Load the library with the bytes ``content``; raises BuildError if the system refuses it."""
        handle, path = tempfile.mkstemp(prefix="lag2fmu-", suffix=Path(name).suffix)
        os.write(handle, content)
        os.close(handle)
        try:
            self._library = ctypes.CDLL(path)
        except OSError as error:
            raise BuildError(f"the library '{name}' that was just built cannot be loaded: {error}") from error
        finally:
            if os.name == "posix":  # it stays loaded; elsewhere a loaded file cannot be removed
                Path(path).unlink()

    def number(self, name: str) -> int:
        """The result of the function ``name``, which takes no arguments."""
        function = self._library[name]
        function.restype, function.argtypes = ctypes.c_int64, []
        return int(function())

    def function(self, name: str) -> Callable[..., None]:
        """The function ``name``, which returns nothing and takes pointers."""
        function = self._library[name]
        function.restype = None
        return function
