"""A library by ctypes, and one instance to call its functions on. Imported by the process that runs an FMU."""

from __future__ import annotations

import ctypes
import struct
import sys
from collections.abc import Mapping, Sequence
from ctypes import POINTER, byref, c_char, c_char_p, c_double, c_float, c_int, c_size_t, c_uint, c_void_p
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lag2fmu.checking.guards import UNWRITTEN, Guarded

OK, WARNING, DISCARD, ERROR, FATAL = range(5)
_STATUS = ("OK", "Warning", "Discard", "Error", "Fatal", "Pending")

LETTERS: dict[str, Any] = {
    **{"p": c_void_p, "P": POINTER(c_void_p), "s": c_char_p, "S": POINTER(c_char_p), "i": c_int, "I": POINTER(c_int)},
    **{"d": c_double, "D": POINTER(c_double), "U": POINTER(c_uint), "n": c_size_t, "N": POINTER(c_size_t)},
    **{"u": c_uint, "b": ctypes.c_bool, "B": POINTER(ctypes.c_bool), "f": POINTER(c_float)},
    **{"h": POINTER(ctypes.c_int8), "H": POINTER(ctypes.c_uint8), "w": POINTER(ctypes.c_int16)},
    **{"W": POINTER(ctypes.c_uint16), "l": POINTER(ctypes.c_int32), "L": POINTER(ctypes.c_uint32)},
    **{"q": POINTER(ctypes.c_int64), "Q": POINTER(ctypes.c_uint64)},
}
"""The types of arguments, a letter each."""


class RefusedError(Exception):
    """A legal call was answered with Discard, Error or Fatal."""

    def __init__(self, function: str, status: int, reason: str) -> None:
        super().__init__(f"{function} returned {name_of(function, status)}{f' ({reason})' if reason else ''}")
        self.function, self.status = function, status


def name_of(function: str, status: int) -> str:
    """The name of a ``status`` that ``function`` returned; its number if it is no status."""
    prefix = function[:4]
    return f"{prefix}{_STATUS[status]}" if 0 <= status < len(_STATUS) else f"{status}, which is no {prefix}Status"


@dataclass(frozen=True)
class Binding:
    """The functions of a version: ``arguments`` are {name without ``prefix``: the types of its arguments as LETTERS}.

    ``results`` are {function: type of its result} where this is no status. ``state`` is the word for the state of an
    FMU in names of functions, ``deserialize`` the first word of the function that reads a serialized state.
    """

    prefix: str
    arguments: Mapping[str, str]
    results: Mapping[str, Any]
    state: str
    deserialize: str


class FmuLibrary:
    """The shared library at ``path``; raises OSError if it cannot be loaded."""

    def __init__(self, path: Path, binding: Binding) -> None:
        self._library = ctypes.CDLL(str(path))
        self.binding = binding
        self._functions: dict[str, Any] = {}

    def __call__(self, name: str, *arguments: Any) -> Any:
        """Call the function ``name``, given without prefix; raises AttributeError if the library lacks it."""
        function = self._functions.get(name)
        if function is None:
            function = getattr(self._library, f"{self.binding.prefix}{name}")
            function.argtypes = [LETTERS[letter] for letter in self.binding.arguments[name]]
            function.restype = self.binding.results.get(name, c_int)
            self._functions[name] = function
        return function(*arguments)


def doubles(values: Sequence[float]) -> Any:
    """``values`` as an array of C with room for one element at least."""
    return (c_double * max(len(values), 1))(*values)


def room(size: int) -> Any:
    """An array of C for ``size`` numbers that a function is to write; what it leaves unwritten is noticed."""
    return doubles([UNWRITTEN] * size)


def references(values: Sequence[int]) -> Any:
    """Value references as an array of C."""
    return (c_uint * max(len(values), 1))(*values)


@dataclass
class MessageLog:
    """The messages of instances, each as (status, category, sentence), and what functions did to arrays."""

    sentences: list[tuple[int, str, str]] = field(default_factory=list)
    misuses: set[str] = field(default_factory=set)

    def add(self, status: int, category: bytes | None, message: bytes | None) -> None:
        """Take down a sentence."""
        texts = [(text or b"").decode("utf-8", "replace") for text in (category, message)]
        if len(self.sentences) < 10_000:
            self.sentences.append((status, texts[0], texts[1]))

    def last(self) -> str:
        """The last sentence with the status of a warning or worse."""
        return next((text[:300] for status, _, text in reversed(self.sentences) if status > OK), "")


class LibraryInstance:
    """An instance of a library; ``alive`` says whether there is one. Each version makes it in its own way."""

    def __init__(self, library: FmuLibrary, log: MessageLog, component: Any) -> None:
        self._call, self._log, self._component = library, log, component
        self.alive = bool(component)

    def free(self) -> None:
        """Free the instance, unless it is freed already or dead (Fatal)."""
        if self.alive:
            self._call("FreeInstance", self._component)
        self.alive = False

    def status(self, name: str, *arguments: Any) -> int:
        """Call a function, named without prefix, on the instance and return its status."""
        held = [Guarded(a) if isinstance(a, ctypes.Array) else a for a in arguments]
        plain = (a.array if isinstance(a, Guarded) else a for a in held)
        found: int = self._call(name, self._component, *plain)
        if found == FATAL:
            self.alive = False
        for guarded in held:
            if isinstance(guarded, Guarded):
                answered = found in (OK, WARNING)
                misuses = guarded.given_back(reads=_only_reads(name, guarded), answered=answered)
                self._log.misuses |= {f"{self._call.binding.prefix}{name} {misuse}" for misuse in misuses}
        return found

    def do(self, name: str, *arguments: Any) -> None:
        """Call a function on the instance; raises RefusedError unless the status is OK or Warning."""
        status = self.status(name, *arguments)
        if status not in (OK, WARNING):
            raise RefusedError(f"{self._call.binding.prefix}{name}", status, self._log.last())

    def vector(self, name: str, size: int) -> list[float]:
        """What a function of model exchange such as GetContinuousStates writes: (size,).

        Raises RefusedError as ``do`` does.
        """
        values = room(size)
        self.do(name, values, size)
        return list(values)[:size]

    def saved(self) -> c_void_p:
        """The state of the FMU, to be freed. Raises RefusedError as ``do`` does."""
        pointer = c_void_p()
        self.do(f"Get{self._call.binding.state}", byref(pointer))
        return pointer

    def restore(self, saved: c_void_p) -> None:
        """Go back to a saved state. Raises RefusedError as ``do`` does."""
        self.do(f"Set{self._call.binding.state}", saved)

    def drop(self, saved: c_void_p) -> None:
        """Free a saved state. Raises RefusedError as ``do`` does."""
        self.do(f"Free{self._call.binding.state}", byref(saved))

    def serialized(self, saved: c_void_p) -> Any:
        """A saved state as an array of bytes of C. Raises RefusedError as ``do`` does."""
        size = c_size_t()
        self.do(f"Serialized{self._call.binding.state}Size", saved, byref(size))
        block = (c_char * size.value)()
        self.do(f"Serialize{self._call.binding.state}", saved, block, size)
        return block

    def deserialized(self, block: Any) -> c_void_p:
        """The saved state in the bytes ``block``, to be freed. Raises RefusedError as ``do`` does."""
        pointer = c_void_p()
        self.do(f"{self._call.binding.deserialize}{self._call.binding.state}", block, len(block), byref(pointer))
        return pointer


def _only_reads(function: str, guarded: Guarded) -> bool:
    """Whether a function, named without prefix, must leave an array as it is: value references, and what it sets."""
    references_alone = not function.endswith(("Dependencies", "UInt32"))
    return function.startswith("Set") or (guarded.holds is c_uint and references_alone)


def bits(values: Sequence[Any]) -> bytes:
    """Values of variables as bytes: equal if and only if they are equal bit for bit."""
    return b"|".join(struct.pack("<d", v) if isinstance(v, float) else repr(v).encode() for v in values)


MOST_MEMORY, MOST_FILE = 4 << 30, 1 << 30
"""Bytes that the process of an FMU may have as data, and write to one file, where the system can bound them."""


def bounded() -> None:
    """No dialogs and no core files when the FMU crashes; bounds of what it takes from the machine."""
    if sys.platform == "win32":
        ctypes.windll.kernel32.SetErrorMode(0x8007)
    else:
        import resource

        for kind, most in (
            (resource.RLIMIT_CORE, 0),
            (resource.RLIMIT_DATA, MOST_MEMORY),
            (resource.RLIMIT_FSIZE, MOST_FILE),
        ):
            hard = resource.getrlimit(kind)[1]
            bound = most if hard == resource.RLIM_INFINITY else min(most, hard)
            resource.setrlimit(kind, (bound, bound))
