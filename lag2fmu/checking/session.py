"""A run of an FMU, step by step, in the order the standard asks for: the same words for both kinds."""

from __future__ import annotations

import math
from ctypes import byref, c_int
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lag2fmu.checking.binding import DISCARD, EventInfo, Instance, Library, Log, RefusedError, doubles
from lag2fmu.checking.description import Description, ScalarVariable, number

_MOST_EVENTS = 1000
"""Event iterations at one time after which a model does not come to rest."""


@dataclass
class Model:
    """An FMU of one kind that is unpacked in ``folder``: what the trials are given."""

    description: Description
    kind: str
    folder: Path
    path: Path
    log: Log = field(default_factory=Log)

    def __post_init__(self) -> None:
        self.library = Library(self.path)

    def can(self, capability: str) -> bool:
        """Whether the flag is declared for this kind."""
        return self.description.can(self.kind, capability)

    @property
    def indicators(self) -> int:
        """The number of event indicators."""
        return int(number(self.description.root.get("numberOfEventIndicators", "0")))

    def instance(self, guid: str | None = None, name: str = "check") -> Instance:
        """A new instance; not alive if the FMU refused."""
        resources = (self.folder / "resources").resolve().as_uri()
        own = self.description.root.get("guid")
        return Instance(self.library, self.kind, own if guid is None else guid, resources, self.log, name)

    def session(self, name: str = "check") -> Session:
        """A new instance, not yet initialized; raises RefusedError if there is none."""
        instance = self.instance(name=name)
        if not instance.alive:
            raise RefusedError("Instantiate", -1, self.log.last())
        return Session(self, instance)

    @property
    def start_time(self) -> float:
        """The start time of the default experiment in s."""
        return self._experiment("startTime", 0.0)

    @property
    def step(self) -> float:
        """A communication step in s."""
        length = self._experiment("stopTime", self.start_time + 1.0) - self.start_time
        return self._experiment("stepSize", length / 100 if length > 0 else 0.01)

    def _experiment(self, name: str, otherwise: float) -> float:
        element = self.description.root.child("DefaultExperiment")
        value = number(element.get(name)) if element is not None else math.nan
        return value if math.isfinite(value) and (name != "stepSize" or value > 0) else otherwise

    @property
    def outputs(self) -> list[ScalarVariable]:
        """The outputs of the type Real."""
        return [v for v in self.description.variables if v.causality == "output" and v.type == "Real"]

    @property
    def derivatives(self) -> list[ScalarVariable]:
        """The derivatives in the order of ModelStructure, which is that of the states."""
        found = (self.description.variable(u.index) for u in self.description.structure("Derivatives"))
        return [v for v in found if v is not None]


class Session:
    """An instance on its way through a run; a context that frees it at the end. ``time`` in s."""

    def __init__(self, model: Model, instance: Instance) -> None:
        self.model, self.instance, self.time = model, instance, model.start_time

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_: object) -> None:
        self.instance.free()

    def enter(self, stop_time: float | None = None) -> Session:
        """Go to Initialization Mode. Raises RefusedError if the FMU does not go there."""
        self.time = self.model.start_time
        self.instance.do("SetupExperiment", 0, 0.0, self.time, int(stop_time is not None), stop_time or 0.0)
        self.instance.do("EnterInitializationMode")
        return self

    def start(self, stop_time: float | None = None) -> Session:
        """Go to where steps are taken: Continuous-Time Mode, or the first communication point.

        Raises RefusedError, and RecursionError as ``rest`` does.
        """
        self.enter(stop_time).instance.do("ExitInitializationMode")
        if self.model.kind == "ModelExchange":
            self.rest()
            self.instance.do("EnterContinuousTimeMode")
        return self

    def rest(self) -> EventInfo:
        """Iterate events until no more is needed; raises RecursionError if there is no end."""
        info = EventInfo()
        for _ in range(_MOST_EVENTS):
            self.instance.do("NewDiscreteStates", byref(info))
            if not info.newDiscreteStatesNeeded or info.terminateSimulation:
                return info
        raise RecursionError(f"{_MOST_EVENTS} event iterations at t = {self.time:g} s and no end")

    def steps(self, count: int) -> list[list[Any]]:
        """All values after each of ``count`` steps; fewer if the FMU ends the run by fmi2Discard.

        Raises RefusedError, and RecursionError as ``rest`` does.
        """
        found = []
        for _ in range(count):
            if not self.step():
                break
            found.append(self.values())
        return found

    def step(self) -> bool:
        """Take a step of the model's length; False if a co-simulation says fmi2Discard.

        Raises RefusedError, and RecursionError as ``rest`` does.
        """
        if self.model.kind == "ModelExchange":
            self._euler(self.model.step / 10)
            return True
        try:
            self.instance.do("DoStep", self.time, self.model.step, 1)
        except RefusedError as refused:
            if refused.status == DISCARD:
                return False
            raise
        self.time += self.model.step
        return True

    def _euler(self, step: float) -> None:
        """A step of model exchange by Euler's method, with the event it may lead to."""
        size = len(self.model.derivatives)
        x, dx = self.instance.vector("GetContinuousStates", size), self.instance.vector("GetDerivatives", size)
        self.time += step
        self.instance.do("SetTime", self.time)
        if size:
            x = [value + step * rate for value, rate in zip(x, dx, strict=True)]
            self.instance.do("SetContinuousStates", doubles(x), size)
        event, end = c_int(), c_int()
        if not self.model.can("completedIntegratorStepNotNeeded"):
            self.instance.do("CompletedIntegratorStep", 1, byref(event), byref(end))
        if event.value:
            self.instance.do("EnterEventMode")
            self.rest()
            self.instance.do("EnterContinuousTimeMode")

    def values(self) -> list[Any]:
        """The values of all variables, in the order of their types."""
        found: list[Any] = []
        for type_ in ("Real", "Integer", "Boolean", "String", "Enumeration"):
            which = [v.reference for v in self.model.description.variables if v.type == type_]
            if which:
                found += self.instance.get(type_, which)
        return found
