"""Repairs of PythonFMU's library (0.7.0), which drops references that it does not own and frees memory twice.

It drops a reference of the module's namespace at each instantiation, and at each exception one of the
instance, of its class and of its log.
"""

from __future__ import annotations

import atexit
import ctypes
from pathlib import Path

_released: set[Path] = set()


def hold(*things: object) -> None:
    """Add a reference to each of ``things``, in place of one that PythonFMU's library drops without owning it.

    A list of them would not do: it would drop them once more when Python ends.
    """
    for thing in things:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(thing))


def release_at_exit(resources: str) -> None:
    """Let PythonFMU's library release what it holds while Python ends; by itself it does so twice on Linux.

    ``resources`` is the folder of that name in the unpacked FMU.
    """
    for path in Path(resources).parent.glob("binaries/linux64/*.so"):
        if path not in _released:
            _released.add(path)
            atexit.register(ctypes.CDLL(str(path)).finalizePythonInterpreter)
