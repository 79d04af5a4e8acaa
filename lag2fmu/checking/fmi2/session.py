"""A run of an FMU of FMI 2.0, step by step, in the order the standard asks for: the same words for both kinds."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import byref, c_int
from typing import Any

from lag2fmu.checking.binding import DISCARD, OK, WARNING, FmuLibrary, RefusedError
from lag2fmu.checking.description import Variable, number
from lag2fmu.checking.fmi2.binding import BINDING, EventInfo, Instance2
from lag2fmu.checking.fmi2.description import TYPES, Description2, ScalarVariable2
from lag2fmu.checking.session import Iteration, Model, Session


class Model2(Model):
    """An FMU of FMI 2.0."""

    description: Description2
    floats = frozenset({"Real"})

    def load(self) -> FmuLibrary:
        """The library; raises OSError if it cannot be loaded."""
        return FmuLibrary(self.path, BINDING)

    @property
    def indicator_count(self) -> int:
        """The number of event indicators."""
        return int(number(self.description.root.get("numberOfEventIndicators", "0")))

    @property
    def state_count(self) -> int:
        """The number of continuous states."""
        return len(self.derivatives)

    @property
    def states(self) -> list[ScalarVariable2]:
        """The continuous states in the order of their derivatives."""
        found = (self.description.variable(v.derivative) for v in self.derivatives)
        return [v for v in found if v is not None]

    @property
    def readable(self) -> list[ScalarVariable2]:
        """All variables, in the order of their types."""
        return [v for type_ in TYPES for v in self.description.variables if v.type == type_]

    def lists(self) -> list[list[Variable] | None]:
        """The dependencies of each unknown in ModelStructure, None where none are given."""
        found = self.description.variable
        return [
            None if u.dependencies is None else [v for index in u.dependencies if (v := found(index)) is not None]
            for u in self.description.unknowns()
        ]

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
    def derivatives(self) -> list[ScalarVariable2]:
        """The derivatives in the order of ModelStructure, which is that of the states."""
        found = (self.description.variable(u.index) for u in self.description.structure("Derivatives"))
        return [v for v in found if v is not None]


class Session2(Session):
    """An instance of FMI 2.0 on its way through a run."""

    model: Model2
    instance: Instance2
    rates = "GetDerivatives"

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
            self.go_on()
        return self

    def go_on(self) -> None:
        """Leave Event Mode. Raises RefusedError."""
        self.instance.do("EnterContinuousTimeMode")

    def update(self) -> Iteration:
        """One event iteration. Raises RefusedError."""
        info = EventInfo()
        self.instance.do("NewDiscreteStates", byref(info))
        return Iteration(
            again=bool(info.newDiscreteStatesNeeded),
            end=bool(info.terminateSimulation),
            nominals_changed=bool(info.nominalsOfContinuousStatesChanged),
            values_changed=bool(info.valuesOfContinuousStatesChanged),
            next_defined=bool(info.nextEventTimeDefined),
            next_time=info.nextEventTime,
        )

    def step(self, part: float = 1.0) -> bool:
        """Take a step, ``part`` of the model's step long; False if a co-simulation says fmi2Discard.

        Raises RefusedError, and RecursionError as ``rest`` does.
        """
        if self.model.kind == "ModelExchange":
            if self.euler(part):
                self.handle()
            return True
        length = part * self.model.step
        try:
            self.instance.do("DoStep", self.time, length, 1)
        except RefusedError as refused:
            if refused.status == DISCARD:
                return False
            raise
        self.time += length
        return True

    def completed(self) -> bool:
        """Tell of a completed step of the integrator; whether the FMU answers with an event. Raises RefusedError."""
        event, end = c_int(), c_int()
        if not self.model.can("completedIntegratorStepNotNeeded"):
            self.instance.do("CompletedIntegratorStep", 1, byref(event), byref(end))
        return bool(event.value)

    def set(self, variable: Variable, values: Sequence[Any]) -> bool:
        """Set a variable; whether the FMU takes the value."""
        return self.instance.set(variable.type, [variable.reference], values) in (OK, WARNING)

    def get(self, variable: Variable) -> list[Any]:
        """The value of a variable, a list of one; strings as bytes. Raises RefusedError."""
        return self.instance.get(variable.type, [variable.reference])

    def get_together(self, variables: Sequence[Variable]) -> list[Any]:
        """The values of variables of one type, by one call. Raises RefusedError."""
        return self.instance.get(variables[0].type, [v.reference for v in variables])

    def set_together(self, variables: Sequence[Variable], values: Sequence[Any]) -> bool:
        """Set variables of one type by one call; whether the FMU takes them."""
        return self.instance.set(variables[0].type, [v.reference for v in variables], values) in (OK, WARNING)

    def values(self) -> list[Any]:
        """The values of all variables, in the order of their types. Raises RefusedError."""
        found: list[Any] = []
        for type_ in TYPES:
            which = [v.reference for v in self.model.description.variables if v.type == type_]
            if which:
                found += self.instance.get(type_, which)
        return found
