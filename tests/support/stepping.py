"""An FMU driven call by call through fmpy, with names in place of value references."""

from __future__ import annotations

import itertools
import struct
from collections.abc import Mapping, Sequence
from ctypes import byref, c_double
from functools import lru_cache
from pathlib import Path
from types import TracebackType
from typing import Any

import fmpy
from fmpy.fmi1 import calloc, free
from fmpy.fmi2 import (
    FMU2Model,
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)
from fmpy.logging import addLoggerProxy

OK, WARNING, DISCARD, ERROR = 0, 1, 2, 3
_LOGS: dict[bytes, list[tuple[int, str, str]]] = {}
"""Instance name -> (status, category, sentence) of all that the instance said."""
_NUMBERS = itertools.count()


def _hear(environment: object, name: bytes, status: int, category: bytes | None, message: bytes) -> None:
    _LOGS.setdefault(name, []).append((status, (category or b"").decode(), message.decode()))


_LOGGER = fmi2CallbackLoggerTYPE(_hear)
"""One logger for all instances, never collected: fmpy's native proxy calls the last one that was registered."""


def _callbacks() -> fmi2CallbackFunctions:
    callbacks = fmi2CallbackFunctions()
    callbacks.logger = _LOGGER
    callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
    callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
    addLoggerProxy(byref(callbacks))
    return callbacks


@lru_cache(maxsize=64)
def described(path: Path, changed: int) -> Any:
    """What fmpy reads in the FMU ``path`` that was ``changed`` then; nobody changes what is read."""
    return fmpy.read_model_description(str(path), validate=False)


def bits(values: Sequence[float]) -> str:
    """The bits of ``values`` as text; equal if and only if the values are equal bit for bit."""
    return struct.pack(f"<{len(values)}d", *values).hex()


class Stepping:
    """An instance of the FMU ``path``, 'CoSimulation' or 'ModelExchange'; a context that frees it at the end.

    ``log`` collects (status, category, sentence) of all that the FMU says; ``time`` is the communication point in s.
    """

    def __init__(self, path: Path, kind: str = "CoSimulation", guid: str | None = None) -> None:
        folder = path.with_suffix(".unpacked")
        if not folder.is_dir():
            fmpy.extract(str(path), str(folder))
        self.description: Any = described(path, path.stat().st_mtime_ns)
        variables = self.description.modelVariables
        self.references = {v.name: v.valueReference for v in variables}
        self.states = [v.name for v in variables if v.causality == "output" and v.start is not None]
        name = f"instance {next(_NUMBERS)}"
        self.log = _LOGS.setdefault(name.encode(), [])
        self.unit: Any = (FMU2Slave if kind == "CoSimulation" else FMU2Model)(
            guid=guid or self.description.guid,
            unzipDirectory=str(folder),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self.unit.instantiate(callbacks=_callbacks(), loggingOn=True)
        self.kind, self.time = kind, 0.0

    def __enter__(self) -> Stepping:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.unit.freeInstance()

    def start(
        self,
        values: Mapping[str, float] | None = None,
        tolerance: float | None = None,
        stop_time: float | None = None,
        start_time: float = 0.0,
    ) -> Stepping:
        """Set ``values`` and go to the state in which steps are taken."""
        self.set(values or {})
        self.unit.setupExperiment(tolerance=tolerance, startTime=start_time, stopTime=stop_time)
        self.unit.enterInitializationMode()
        self.unit.exitInitializationMode()
        if self.kind == "ModelExchange":
            self.unit.newDiscreteStates()
            self.unit.enterContinuousTimeMode()
        self.time = start_time
        return self

    def set(self, values: Mapping[str, float]) -> None:
        """Set variables by name, in one call."""
        if values:
            self.unit.setReal([self.references[name] for name in values], list(values.values()))

    def get(self, names: Sequence[str]) -> list[float]:
        """The values of ``names``."""
        values: list[float] = self.unit.getReal([self.references[name] for name in names])
        return values

    def step(self, length: float) -> list[float]:
        """Take one communication step (s) and return the states."""
        self.unit.doStep(self.time, length)
        self.time += length
        return self.get(self.states)

    def steps(self, count: int, length: float) -> list[list[float]]:
        """The states after each of ``count`` communication steps."""
        return [self.step(length) for _ in range(count)]

    def repeats(self, count: int, length: float) -> bool:
        """Whether ``count`` communication steps from here lead to the same states once more after a roll-back."""
        state, at = self.unit.getFMUState(), self.time
        first = self.steps(count, length)
        self.unit.setFMUState(state)
        self.unit.freeFMUState(state)
        self.time = at
        return self.steps(count, length) == first

    def derivative(self, unknowns: Sequence[str], seed: Mapping[str, float]) -> list[float]:
        """The directional derivative of ``unknowns`` along ``seed``."""
        r = self.references
        values: list[float] = self.unit.getDirectionalDerivative(
            [r[name] for name in unknowns], [r[name] for name in seed], list(seed.values())
        )
        return values

    def rates(self) -> list[float]:
        """The derivatives of the continuous states, by fmi2GetDerivatives."""
        values = (c_double * len(self.states_of_derivatives))()
        self.unit.getDerivatives(values, len(values))
        return list(values)

    def due(self, states: Sequence[float]) -> list[int]:
        """The event indicators that are not above 0 where the continuous states are ``states``."""
        self.unit.setContinuousStates((c_double * len(states))(*states), len(states))
        values = (c_double * self.description.numberOfEventIndicators)()
        self.unit.getEventIndicators(values, len(values))
        return [k for k, value in enumerate(values) if value <= 0]

    @property
    def states_of_derivatives(self) -> list[str]:
        """The names of the continuous states: what the variables with the attribute ``derivative`` derive."""
        return [v.derivative.name for v in self.description.modelVariables if v.derivative is not None]

    @property
    def sentences(self) -> list[str]:
        """What was said with the status of a warning or worse."""
        return [sentence for status, _, sentence in self.log if status != OK]
