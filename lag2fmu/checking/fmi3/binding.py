"""The functions of FMI 3.0 by ctypes, and its instances.

Source: FMI 3.0.2, sections 2.2, 2.3, 3.2 and 4.2.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from ctypes import CFUNCTYPE, POINTER, byref, c_bool, c_char_p, c_double, c_int, c_size_t, c_void_p
from dataclasses import dataclass, field
from typing import Any

from lag2fmu.checking.binding import Binding, FmuLibrary, LibraryInstance, MessageLog, doubles, references, room

ELEMENTS: dict[str, tuple[str, Any]] = {
    **{"Float32": ("f", ctypes.c_float), "Float64": ("D", c_double), "Boolean": ("B", c_bool)},
    **{"Int8": ("h", ctypes.c_int8), "UInt8": ("H", ctypes.c_uint8), "Int16": ("w", ctypes.c_int16)},
    **{"UInt16": ("W", ctypes.c_uint16), "Int32": ("l", ctypes.c_int32), "UInt32": ("L", ctypes.c_uint32)},
    **{"Int64": ("q", ctypes.c_int64), "UInt64": ("Q", ctypes.c_uint64), "String": ("S", c_char_p)},
}
"""Type of the functions for values -> letter of its arrays, element in C; Binary and Clock have calls of their own."""

_ARGUMENTS = {
    **{"GetVersion": "", "SetDebugLogging": "pbnS", "FreeInstance": "p", "Reset": "p", "Terminate": "p"},
    **{"InstantiateModelExchange": "sssbbpp", "InstantiateCoSimulation": "sssbbbbUnppp"},
    **{"EnterInitializationMode": "pbddbd", "ExitInitializationMode": "p", "EnterEventMode": "p"},
    **{f"{verb}{type_}": f"pUn{x}n" for verb in ("Get", "Set") for type_, (x, _) in ELEMENTS.items()},
    **{"GetBinary": "pUnNPn", "SetBinary": "pUnNPn", "GetClock": "pUnB", "SetClock": "pUnB"},
    **{"GetNumberOfVariableDependencies": "puN", "GetVariableDependencies": "puNUNIn"},
    **{"GetFMUState": "pP", "SetFMUState": "pp", "FreeFMUState": "pP", "SerializedFMUStateSize": "ppN"},
    **{"SerializeFMUState": "ppsn", "DeserializeFMUState": "psnP"},
    **{"GetDirectionalDerivative": "pUnUnDnDn", "GetAdjointDerivative": "pUnUnDnDn"},
    **{"EnterConfigurationMode": "p", "ExitConfigurationMode": "p", "ActivateModelPartition": "pud"},
    **{"GetIntervalDecimal": "pUnDI", "GetIntervalFraction": "pUnQQI", "GetShiftDecimal": "pUnD"},
    **{"GetShiftFraction": "pUnQQ", "SetIntervalDecimal": "pUnD", "SetIntervalFraction": "pUnQQ"},
    **{"SetShiftDecimal": "pUnD", "SetShiftFraction": "pUnQQ", "EvaluateDiscreteStates": "p"},
    **{"UpdateDiscreteStates": "pBBBBBD", "EnterContinuousTimeMode": "p", "CompletedIntegratorStep": "pbBB"},
    **{"SetTime": "pd", "SetContinuousStates": "pDn", "GetContinuousStateDerivatives": "pDn"},
    **{"GetEventIndicators": "pDn", "GetContinuousStates": "pDn", "GetNominalsOfContinuousStates": "pDn"},
    **{"GetNumberOfEventIndicators": "pN", "GetNumberOfContinuousStates": "pN", "EnterStepMode": "p"},
    **{"GetOutputDerivatives": "pUnlDn", "DoStep": "pddbBBBD"},
}
"""Function -> the types of its arguments as LETTERS."""

_RESULTS = {
    "GetVersion": c_char_p,
    "InstantiateModelExchange": c_void_p,
    "InstantiateCoSimulation": c_void_p,
    "FreeInstance": None,
}
BINDING = Binding("fmi3", _ARGUMENTS, _RESULTS, "FMUState", "Deserialize")
FUNCTIONS = frozenset(f"fmi3{name}" for name in [*_ARGUMENTS, "InstantiateScheduledExecution"])
"""Every function of the standard; each library exports all of them (section 2.5.1.3)."""

_LogMessage = CFUNCTYPE(None, c_void_p, c_int, c_char_p, c_char_p)
_IntermediateUpdate = CFUNCTYPE(
    None, c_void_p, c_double, c_bool, c_bool, c_bool, c_bool, POINTER(c_bool), POINTER(c_double)
)
ENVIRONMENT = 0x1A62
"""What is handed to instances as the importer's pointer."""


@dataclass(frozen=True)
class Update:
    """What an FMU says when it calls back in the middle of a step; ``time`` in s."""

    time: float
    can_set: bool
    can_get: bool
    finished: bool
    can_return: bool


@dataclass
class Manner:
    """How an importer wants a co-simulation: what it can handle, and what it does in the middle of a step.

    ``update`` is called there and says whether to return early; ``required`` are the value references that it reads.
    """

    events: bool = False
    early: bool = False
    logging: bool = True
    silent: bool = False
    update: Callable[[Update], bool] | None = None
    required: Sequence[int] = ()
    environments: set[int] = field(default_factory=set)
    """The pointers that came back with calls of the FMU; the importer's alone where all is well."""


class Instance3(LibraryInstance):
    """An instance of ``kind`` ('ModelExchange', 'CoSimulation'), of a co-simulation in a certain ``manner``."""

    def __init__(
        self,
        library: FmuLibrary,
        kind: str,
        token: str | None,
        resources: str | None,
        log: MessageLog,
        name: str | None = "check",
        manner: Manner | None = None,
    ) -> None:
        self.manner = manner = manner or Manner()

        def hear(environment: int | None, status: int, category: bytes | None, message: bytes | None) -> None:
            manner.environments.add(environment or 0)
            log.add(status, category, message)

        def update(environment: int | None, *arguments: Any) -> None:
            manner.environments.add(environment or 0)
            *said, requested, time = arguments
            returns = bool(manner.update(Update(*said))) if manner.update is not None else False
            requested[0], time[0] = returns, said[0]

        self._callbacks = _LogMessage(hear), _IntermediateUpdate(update)
        texts = [None if text is None else text.encode() for text in (name, token, resources)]
        heard = None if manner.silent else self._callbacks[0]
        if kind == "ModelExchange":
            made = library("InstantiateModelExchange", *texts, False, manner.logging, ENVIRONMENT, heard)
        else:
            which = references(manner.required), len(manner.required)
            callback = None if manner.update is None else self._callbacks[1]
            flags = False, manner.logging, manner.events, manner.early
            made = library("InstantiateCoSimulation", *texts, *flags, *which, ENVIRONMENT, heard, callback)
        super().__init__(library, log, made)

    def get(self, type_: str, variables: Sequence[int], size: int) -> list[Any]:
        """The values of ``size`` elements of ``variables`` (value references) of one type; bytes of text and binaries.

        A clock or a binary variable is asked for alone.

        Raises RefusedError as ``do`` does.
        """
        which, count = references(variables), len(variables)
        if type_ == "Clock":
            ticks = (c_bool * 1)()
            self.do("GetClock", which, 1, ticks)
            return list(ticks)
        if type_ == "Binary":
            sizes, pointers = (c_size_t * size)(), (c_void_p * size)()
            self.do("GetBinary", which, 1, sizes, pointers, size)
            return [ctypes.string_at(p, n) if p else b"" for p, n in zip(pointers, sizes, strict=True)]
        name = "Int64" if type_ == "Enumeration" else type_
        values = room(size) if name == "Float64" else (ELEMENTS[name][1] * max(size, 1))()
        self.do(f"Get{name}", which, count, values, size)
        return list(values)[:size]

    def set(self, type_: str, variables: Sequence[int], values: Sequence[Any]) -> int:
        """Set the elements of ``variables`` of a type in ELEMENTS or an Enumeration, and return the status."""
        name = "Int64" if type_ == "Enumeration" else type_
        array = (ELEMENTS[name][1] * max(len(values), 1))(*values)
        return self.status(f"Set{name}", references(variables), len(variables), array, len(values))

    def derivative(
        self, function: str, unknowns: Sequence[int], knowns: Sequence[int], seed: Sequence[float], size: int
    ) -> list[float]:
        """What GetDirectionalDerivative or GetAdjointDerivative writes for ``seed``: (size,).

        Raises RefusedError as ``do`` does.
        """
        values = room(size)
        which = references(unknowns), len(unknowns), references(knowns), len(knowns)
        self.do(function, *which, doubles(seed), len(seed), values, size)
        return list(values)[:size]

    def count(self, function: str) -> int:
        """What GetNumberOfContinuousStates or GetNumberOfEventIndicators says. Raises RefusedError as ``do`` does."""
        found = c_size_t()
        self.do(function, byref(found))
        return found.value
