"""The backends: what turns a program into the contents of an FMU, each in a module of its own."""

from collections.abc import Mapping

from lag2fmu.fmu.backends.backend import Backend
from lag2fmu.fmu.backends.native import NATIVE
from lag2fmu.fmu.backends.python import PYTHON

BACKENDS: Mapping[str, Backend] = {backend.name: backend for backend in (NATIVE, PYTHON)}
"""The backends by name, the default first."""

__all__ = ["BACKENDS", "Backend"]
