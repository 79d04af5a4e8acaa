"""A run of an FMU of FMI 2.0, step by step, in the order the standard asks for: the same words for both kinds."""

from __future__ import annotations

from ctypes import byref, c_int
from typing import Any

from lag2fmu.checking.binding import DISCARD, Library, RefusedError, doubles
from lag2fmu.checking.description import Variable, number
from lag2fmu.checking.fmi2.binding import BINDING, EventInfo, Instance2
from lag2fmu.checking.fmi2.description import TYPES, Description2, ScalarVariable
from lag2fmu.checking.session import MOST_EVENTS, Model, Session


class Model2(Model):
    """An FMU of FMI 2.0."""

    description: Description2
    floats = frozenset({"Real"})

    def load(self) -> Library:
        """The library; raises OSError if it cannot be loaded."""
        return Library(self.path, BINDING)

    @property
    def indicators(self) -> int:
        """The number of event indicators."""
        return int(number(self.description.root.get("numberOfEventIndicators", "0")))

    def instance(self, key: str | None = None, name: str = "check") -> Instance2:
        """A new instance; not alive if the FMU refused."""
        resources = (self.folder / "resources").resolve().as_uri()
        own = self.description.token
        return Instance2(self.library, self.kind, own if key is None else key, resources, self.log, name)

    def session(self, name: str = "check") -> Session2:
        """A new instance, not yet initialized; raises RefusedError if there is none."""
        instance = self.instance(name=name)
        if not instance.alive:
            raise RefusedError("fmi2Instantiate", -1, self.log.last())
        return Session2(self, instance)

    @property
    def derivatives(self) -> list[ScalarVariable]:
        """The derivatives in the order of ModelStructure, which is that of the states."""
        found = (self.description.variable(u.index) for u in self.description.structure("Derivatives"))
        return [v for v in found if v is not None]


class Session2(Session):
    """An instance of FMI 2.0 on its way through a run."""

    model: Model2
    instance: Instance2

    def __enter__(self) -> Session2:
        return self

    def enter(self, stop_time: float | None = None) -> Session2:
        """Go to Initialization Mode. Raises RefusedError if the FMU does not go there."""
        self.time = self.model.start_time
        self.instance.do("SetupExperiment", 0, 0.0, self.time, int(stop_time is not None), stop_time or 0.0)
        self.instance.do("EnterInitializationMode")
        return self

    def start(self, stop_time: float | None = None) -> Session2:
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
        for _ in range(MOST_EVENTS):
            self.instance.do("NewDiscreteStates", byref(info))
            if not info.newDiscreteStatesNeeded or info.terminateSimulation:
                return info
        raise RecursionError(f"{MOST_EVENTS} event iterations at t = {self.time:g} s and no end")

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

    def get(self, variable: Variable) -> list[Any]:
        """The value of a variable, a list of one; strings as bytes. Raises RefusedError."""
        return self.instance.get(variable.type, [variable.reference])

    def values(self) -> list[Any]:
        """The values of all variables, in the order of their types. Raises RefusedError."""
        found: list[Any] = []
        for type_ in TYPES:
            which = [v.reference for v in self.model.description.variables if v.type == type_]
            if which:
                found += self.instance.get(type_, which)
        return found
