"""An FMU of FMI 3.0 driven call by call through fmpy, with names in place of value references."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from ctypes import c_size_t
from pathlib import Path
from types import TracebackType
from typing import Any

import fmpy
from fmpy.fmi3 import (
    FMU3Model,
    FMU3Slave,
    fmi3DependencyKind,
    fmi3ValueReference,
)
from stepping import described

_NUMBERS = itertools.count()
Update = Callable[[float, bool, bool], "float | None"]
"""(time in s, inputs may be set, early return is possible) -> the time in s for an early return, or None."""


class Stepping3:
    """An instance of the FMU ``path``, 'CoSimulation' or 'ModelExchange'; a context that frees it at the end.

    ``log`` collects (status, category, sentence) of all that the FMU says; ``update`` is called in intermediate
    updates, in which ``intermediate`` variables are read and set.
    """

    def __init__(
        self,
        path: Path,
        kind: str = "CoSimulation",
        *,
        events: bool = False,
        early: bool = False,
        update: Update | None = None,
        intermediate: Sequence[str] = (),
        logging: bool = True,
    ) -> None:
        folder = path.with_suffix(".unpacked")
        if not folder.is_dir():
            fmpy.extract(str(path), str(folder))
        self.description: Any = described(path, path.stat().st_mtime_ns)
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.log: list[tuple[int, str, str]] = []
        self.unit: Any = (FMU3Slave if kind == "CoSimulation" else FMU3Model)(
            guid=self.description.guid,
            unzipDirectory=str(folder),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=f"instance {next(_NUMBERS)}",
        )
        options: dict[str, Any] = {"loggingOn": logging, "logMessage": self._hear}
        if kind == "CoSimulation":
            options |= {"eventModeUsed": events, "earlyReturnAllowed": early}
            options |= {"requiredIntermediateVariables": [self.references[name] for name in intermediate]}
            options |= {"intermediateUpdate": self._update} if update else {}
        self.events, self.kind, self._follow = events or kind == "ModelExchange", kind, update
        self.unit.instantiate(**options)

    def _hear(self, environment: object, status: int, category: bytes | None, message: bytes) -> None:
        self.log.append((status, (category or b"").decode(), message.decode()))

    def _update(self, _: object, time: float, sets: bool, gets: bool, done: bool, may: bool, *early: Any) -> None:
        assert sets != gets == done
        assert self._follow is not None
        wanted = self._follow(time, sets, may)
        if wanted is not None:
            early[0][0], early[1][0] = True, wanted

    def __enter__(self) -> Stepping3:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.unit.freeInstance()

    def start(self, values: Mapping[str, float] | None = None, **experiment: float) -> Stepping3:
        """Set ``values`` and go to the state in which steps are taken."""
        self.set(values or {})
        self.unit.enterInitializationMode(**experiment)
        self.unit.exitInitializationMode()
        if self.events:
            self.settle()
        return self

    def settle(self) -> list[tuple[bool, ...]]:
        """Leave event mode; the results of all fmi3UpdateDiscreteStates."""
        results = [self.unit.updateDiscreteStates()]
        while results[-1][0]:
            results.append(self.unit.updateDiscreteStates())
        if self.kind == "CoSimulation":
            self.unit.enterStepMode()
        else:
            self.unit.enterContinuousTimeMode()
        return results

    def set(self, values: Mapping[str, float]) -> None:
        """Set variables by name, in one call."""
        if values:
            self.unit.setFloat64([self.references[name] for name in values], list(values.values()))

    def get(self, names: Sequence[str]) -> list[float]:
        """The values of ``names``."""
        values: list[float] = self.unit.getFloat64([self.references[name] for name in names])
        return values

    def run(self, times: Sequence[float], names: Sequence[str]) -> tuple[list[list[float]], list[float]]:
        """The values of ``names`` at ``times`` (s), the first of which is the start, and the times of events (s)."""
        rows, events = [self.get(names)], []
        for start, end in itertools.pairwise(times):
            time = start
            while True:
                event, terminate, early, last = self.unit.doStep(time, end - time)
                assert not terminate
                assert early == (last < time + (end - time))
                if event:
                    events.append(last)
                    self.unit.enterEventMode()
                    self.settle()
                if not early:
                    break
                time = last
            rows.append(self.get(names))
        return rows, events

    def dependencies(self, name: str) -> list[tuple[int, int]]:
        """(value reference, kind) of what ``name`` depends on, by fmi3GetVariableDependencies."""
        reference, count = fmi3ValueReference(self.references[name]), c_size_t()
        self.unit.fmi3GetNumberOfVariableDependencies(self.unit.component, reference, count)
        indices, others = (c_size_t * count.value)(), (c_size_t * count.value)()
        knowns, kinds = (fmi3ValueReference * count.value)(), (fmi3DependencyKind * count.value)()
        self.unit.fmi3GetVariableDependencies(
            self.unit.component, reference, indices, knowns, others, kinds, count.value
        )
        assert not any([*indices, *others])
        return list(zip(knowns, kinds, strict=True))
