"""The functions of FMI 2.0 by ctypes, and its instances.

Source: FMI 2.0.5, sections 2.1, 3.2 and 4.2.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Sequence
from ctypes import CFUNCTYPE, Structure, byref, c_char_p, c_double, c_int, c_size_t, c_void_p
from typing import Any

from lag2fmu.checking.binding import Binding, FmuLibrary, LibraryInstance, MessageLog, references, room

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


_ARGUMENTS = {
    **{"GetTypesPlatform": "", "GetVersion": "", "Instantiate": "sisspii", "FreeInstance": "p", "Reset": "p"},
    **{"SetDebugLogging": "pinS", "SetupExperiment": "piddid", "Terminate": "p"},
    **{"EnterInitializationMode": "p", "ExitInitializationMode": "p", "GetDirectionalDerivative": "pUnUnDD"},
    **{
        f"{verb}{type_}": f"pUn{letter}"
        for verb in ("Get", "Set")
        for type_, letter in zip(("Real", "Integer", "Boolean", "String"), "DIIS", strict=True)
    },
    **{"GetFMUstate": "pP", "SetFMUstate": "pp", "FreeFMUstate": "pP", "SerializedFMUstateSize": "ppN"},
    **{"SerializeFMUstate": "ppsn", "DeSerializeFMUstate": "psnP"},
    **{"EnterEventMode": "p", "NewDiscreteStates": "pp", "EnterContinuousTimeMode": "p", "SetTime": "pd"},
    **{"CompletedIntegratorStep": "piII", "SetContinuousStates": "pDn", "GetDerivatives": "pDn"},
    **{"GetEventIndicators": "pDn", "GetContinuousStates": "pDn", "GetNominalsOfContinuousStates": "pDn"},
    **{"SetRealInputDerivatives": "pUnID", "GetRealOutputDerivatives": "pUnID", "DoStep": "pddi", "CancelStep": "p"},
    **{"GetStatus": "piI", "GetRealStatus": "piD"},
}
_RESULTS = {"GetTypesPlatform": c_char_p, "GetVersion": c_char_p, "Instantiate": c_void_p, "FreeInstance": None}
BINDING = Binding("fmi2", _ARGUMENTS, _RESULTS, "FMUstate", "DeSerialize")


def _c_library() -> Any:
    return ctypes.cdll.msvcrt if os.name == "nt" else ctypes.CDLL(None)


class Instance2(LibraryInstance):
    """An instance of ``kind`` ('ModelExchange', 'CoSimulation')."""

    def __init__(
        self, library: FmuLibrary, kind: str, guid: str, resources: str, log: MessageLog, name: str = "check"
    ) -> None:
        def hear(_: object, __: object, status: int, category: bytes | None, message: bytes | None) -> None:
            log.add(status, category, message)  # the arguments of the format are not looked at

        c = _c_library()
        self._callbacks = _Callbacks(
            _Logger(hear), ctypes.cast(c.calloc, _Allocate), ctypes.cast(c.free, _Free), None, None
        )
        made = library(
            "Instantiate", name.encode(), KIND[kind], guid.encode(), resources.encode(), byref(self._callbacks), 0, 1
        )
        super().__init__(library, log, made)

    def get(self, type_: str, which: Sequence[int]) -> list[Any]:
        """The values of the variables ``which`` (value references) of one type; strings as bytes.

        Raises RefusedError as ``do`` does.
        """
        kind = "Integer" if type_ == "Enumeration" else type_
        values = room(len(which)) if kind == "Real" else (_element(kind) * max(len(which), 1))()
        self.do(f"Get{kind}", references(which), len(which), values)
        return list(values)[: len(which)]

    def set(self, type_: str, which: Sequence[int], values: Sequence[Any]) -> int:
        """Set variables of one type and return the status."""
        kind = "Integer" if type_ == "Enumeration" else type_
        array = (_element(kind) * max(len(values), 1))(*values)
        return self.status(f"Set{kind}", references(which), len(which), array)


def _element(kind: str) -> Any:
    """The type in C of the values of a type."""
    return {"Real": c_double, "String": c_char_p}.get(kind, c_int)
