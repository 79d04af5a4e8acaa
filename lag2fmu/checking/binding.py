"""The functions of FMI 2.0 by ctypes, and one instance to call them on. Imported by the process that runs an FMU.

Source: FMI 2.0.5, sections 2.1, 3.2 and 4.2.
"""

from __future__ import annotations

import ctypes
import os
import struct
import sys
from collections.abc import Sequence
from ctypes import CFUNCTYPE, POINTER, Structure, byref, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

OK, WARNING, DISCARD, ERROR, FATAL, PENDING = range(6)
STATUS = ("fmi2OK", "fmi2Warning", "fmi2Discard", "fmi2Error", "fmi2Fatal", "fmi2Pending")
KIND = {"ModelExchange": 0, "CoSimulation": 1}

_Logger = CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p)
_Allocate = CFUNCTYPE(c_void_p, c_size_t, c_size_t)
_Free = CFUNCTYPE(None, c_void_p)


class _Callbacks(Structure):
    _fields_ = (
        ("logger", _Logger),
        ("allocateMemory", _Allocate),
        ("freeMemory", _Free),
        ("stepFinished", c_void_p),
        ("componentEnvironment", c_void_p),
    )


class EventInfo(Structure):
    """fmi2EventInfo."""

    _fields_ = (
        ("newDiscreteStatesNeeded", c_int),
        ("terminateSimulation", c_int),
        ("nominalsOfContinuousStatesChanged", c_int),
        ("valuesOfContinuousStatesChanged", c_int),
        ("nextEventTimeDefined", c_int),
        ("nextEventTime", c_double),
    )


_LETTERS: dict[str, Any] = {
    **{"p": c_void_p, "P": POINTER(c_void_p), "s": c_char_p, "S": POINTER(c_char_p), "i": c_int, "I": POINTER(c_int)},
    **{"d": c_double, "D": POINTER(c_double), "U": POINTER(c_uint), "n": c_size_t, "N": POINTER(c_size_t)},
    **{"E": POINTER(EventInfo), "C": POINTER(_Callbacks)},
}
_ARGUMENTS = {
    **{"GetTypesPlatform": "", "GetVersion": "", "Instantiate": "sissCii", "FreeInstance": "p", "Reset": "p"},
    **{"SetDebugLogging": "pinS", "SetupExperiment": "piddid", "Terminate": "p"},
    **{"EnterInitializationMode": "p", "ExitInitializationMode": "p", "GetDirectionalDerivative": "pUnUnDD"},
    **{
        f"{verb}{type_}": f"pUn{letter}"
        for verb in ("Get", "Set")
        for type_, letter in zip(("Real", "Integer", "Boolean", "String"), "DIIS", strict=True)
    },
    **{"GetFMUstate": "pP", "SetFMUstate": "pp", "FreeFMUstate": "pP", "SerializedFMUstateSize": "ppN"},
    **{"SerializeFMUstate": "ppsn", "DeSerializeFMUstate": "psnP"},
    **{"EnterEventMode": "p", "NewDiscreteStates": "pE", "EnterContinuousTimeMode": "p", "SetTime": "pd"},
    **{"CompletedIntegratorStep": "piII", "SetContinuousStates": "pDn", "GetDerivatives": "pDn"},
    **{"GetEventIndicators": "pDn", "GetContinuousStates": "pDn", "GetNominalsOfContinuousStates": "pDn"},
    **{"SetRealInputDerivatives": "pUnID", "GetRealOutputDerivatives": "pUnID", "DoStep": "pddi", "CancelStep": "p"},
    **{"GetStatus": "piI", "GetRealStatus": "piD"},
}
"""Function -> its arguments as _LETTERS."""

_RESULTS = {"GetTypesPlatform": c_char_p, "GetVersion": c_char_p, "Instantiate": c_void_p, "FreeInstance": None}


class RefusedError(Exception):
    """A legal call was answered with fmi2Discard, fmi2Error or fmi2Fatal."""

    def __init__(self, function: str, status: int, reason: str) -> None:
        super().__init__(f"fmi2{function} returned {name_of(status)}{f' ({reason})' if reason else ''}")
        self.function, self.status = function, status


def name_of(status: int) -> str:
    """The name of a status, or what it is if it is none."""
    return STATUS[status] if 0 <= status < len(STATUS) else f"{status}, which is no fmi2Status"


class Library:
    """The shared library at ``path``; raises OSError if it cannot be loaded."""

    def __init__(self, path: Path) -> None:
        self._library = ctypes.CDLL(str(path))

    def __call__(self, name: str, *arguments: Any) -> Any:
        """Call fmi2<name>; raises AttributeError if the library lacks it."""
        function = getattr(self._library, f"fmi2{name}")
        function.argtypes = [_LETTERS[letter] for letter in _ARGUMENTS[name]]
        function.restype = _RESULTS.get(name, c_int)
        return function(*arguments)


def _c_library() -> Any:
    return ctypes.cdll.msvcrt if os.name == "nt" else ctypes.CDLL(None)


def doubles(values: Sequence[float]) -> Any:
    """``values`` as an array of C with room for one element at least."""
    return (c_double * max(len(values), 1))(*values)


def references(values: Sequence[int]) -> Any:
    """Value references as an array of C."""
    return (c_uint * max(len(values), 1))(*values)


@dataclass
class Log:
    """What instances said: (status, category, sentence)."""

    sentences: list[tuple[int, str, str]] = field(default_factory=list)

    def hear(self, _: object, __: object, status: int, category: bytes | None, message: bytes | None) -> None:
        """The logger of FMI; the arguments of the format are not looked at."""
        texts = [(text or b"").decode("utf-8", "replace") for text in (category, message)]
        if len(self.sentences) < 10_000:
            self.sentences.append((status, texts[0], texts[1]))

    def last(self) -> str:
        """The last sentence with the status of a warning or worse."""
        return next((text[:300] for status, _, text in reversed(self.sentences) if status > OK), "")


class Instance:
    """An instance of ``kind`` ('ModelExchange', 'CoSimulation'); ``alive`` says whether there is one."""

    def __init__(self, library: Library, kind: str, guid: str, resources: str, log: Log, name: str = "check") -> None:
        self._call, self._log = library, log
        c = _c_library()
        self._callbacks = _Callbacks(
            _Logger(log.hear), ctypes.cast(c.calloc, _Allocate), ctypes.cast(c.free, _Free), None, None
        )
        self._component = library(
            "Instantiate", name.encode(), KIND[kind], guid.encode(), resources.encode(), byref(self._callbacks), 0, 1
        )
        self.alive = bool(self._component)

    def __enter__(self) -> Instance:
        return self

    def __exit__(self, *_: object) -> None:
        self.free()

    def free(self) -> None:
        """Free it, unless it is gone or dead (fmi2Fatal)."""
        if self.alive:
            self._call("FreeInstance", self._component)
        self.alive = False

    def status(self, name: str, *arguments: Any) -> int:
        """Call fmi2<name> on the instance and return its status."""
        found: int = self._call(name, self._component, *arguments)
        if found == FATAL:
            self.alive = False
        return found

    def do(self, name: str, *arguments: Any) -> None:
        """Call fmi2<name> on the instance; raises RefusedError unless the status is fmi2OK or fmi2Warning."""
        status = self.status(name, *arguments)
        if status not in (OK, WARNING):
            raise RefusedError(name, status, self._log.last())

    def get(self, type_: str, which: Sequence[int]) -> list[Any]:
        """The values of the variables ``which`` (value references) of one type; strings as bytes.

        Raises RefusedError as ``do`` does.
        """
        kind = "Integer" if type_ == "Enumeration" else type_
        element: Any = {"Real": c_double, "String": c_char_p}.get(kind, c_int)
        values = (element * max(len(which), 1))()
        self.do(f"Get{kind}", references(which), len(which), values)
        return list(values)[: len(which)]

    def set_reals(self, which: Sequence[int], values: Sequence[float]) -> None:
        """Set variables of the type Real. Raises RefusedError as ``do`` does."""
        self.do("SetReal", references(which), len(which), doubles(values))

    def vector(self, name: str, size: int) -> list[float]:
        """What a function of model exchange such as GetDerivatives writes: (size,).

        Raises RefusedError as ``do`` does.
        """
        values = doubles([0.0] * size)
        self.do(name, values, size)
        return list(values)[:size]


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
