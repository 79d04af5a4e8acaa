"""A run of an FMU of FMI 3.0, step by step, in the order the standard asks for."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import byref, c_bool, c_double
from dataclasses import dataclass
from typing import Any

from lag2fmu.checking.binding import DISCARD, OK, WARNING, FmuLibrary, RefusedError
from lag2fmu.checking.description import Variable, number
from lag2fmu.checking.fmi3.binding import BINDING, Instance3, Manner
from lag2fmu.checking.fmi3.description import FLOATS, Description3, Variable3
from lag2fmu.checking.session import MOST_EVENTS, Iteration, Model, Session


@dataclass(frozen=True)
class StepResults:
    """The results of DoStep: ``asked`` is where the step was to end, ``reached`` where it did (s)."""

    begun: float
    asked: float
    event: bool
    end: bool
    early: bool
    reached: float


_MOST_OWN_STEPS = 1000
"""Own steps of an FMU in a communication step: one of the usual length may be years of steps."""


class Model3(Model):
    """An FMU of FMI 3.0."""

    description: Description3
    floats = FLOATS

    def load(self) -> FmuLibrary:
        """The library; raises OSError if it cannot be loaded."""
        return FmuLibrary(self.path, BINDING)

    @property
    def step(self) -> float:
        """A communication step in s: a multiple of the FMU's own step size, where that is fixed, and not too large."""
        element, length = self.description.kinds[self.kind], super().step
        own = number(element.get("fixedInternalStepSize"))
        return min(max(round(length / own), 1), _MOST_OWN_STEPS) * own if own > 0 else length

    @property
    def usual(self) -> Manner:
        """What an importer of few abilities asks for: Event Mode only where there are clocks to connect."""
        clocks = any(v.type == "Clock" and v.causality != "local" for v in self.description.variables)
        return Manner(events=clocks and self.can("hasEventMode"))

    def instance(self, key: str | None = None, name: str = "check", manner: Manner | None = None) -> Instance3:
        """A new instance; not alive if the FMU refused. ``key`` stands in for what proves which FMU is meant."""
        resources = f"{(self.folder / 'resources').resolve()}/"
        own = self.description.token
        return Instance3(
            self.library, self.kind, own if key is None else key, resources, self.log, name, manner or self.usual
        )

    def session(self, name: str = "check", manner: Manner | None = None) -> Session3:
        """A new instance, not yet initialized; raises RefusedError if there is none."""
        instance = self.instance(name=name, manner=manner)
        if not instance.alive:
            raise RefusedError(f"fmi3Instantiate{self.kind}", -1, self.log.last())
        return Session3(self, instance)

    @property
    def outputs(self) -> list[Variable]:
        """The outputs that are floating point numbers and belong to no clock."""
        return [v for v in self.description.variables if v.causality == "output" and v.type in FLOATS and v.readable]

    @property
    def states(self) -> list[Variable3]:
        """The continuous states in the order of ModelStructure."""
        found = (self.description.by_reference.get(r) for r in self.description.states)
        return [v for v in found if v is not None]

    @property
    def state_count(self) -> int:
        """The number of elements of all continuous states."""
        return size_of(self.states)

    @property
    def indicator_count(self) -> int:
        """The number of elements of all event indicators."""
        return size_of(self.description.listed("EventIndicator"))

    @property
    def readable(self) -> list[Variable3]:
        """The variables that can be read between events, in the order of the description."""
        return [v for v in self.description.variables if v.readable]

    def lists(self) -> list[list[Variable] | None]:
        """The dependencies of each unknown in ModelStructure, None where none are given."""
        known = self.description.by_reference
        return [
            None if u.dependencies is None else [known[r] for r in u.dependencies if r in known]
            for u in self.description.unknowns()
        ]

    def of(self, *causalities: str) -> list[Variable3]:
        """The variables of some causalities that can be read between events."""
        return [v for v in self.description.variables if v.causality in causalities and v.readable]


def size_of(variables: Sequence[Variable3]) -> int:
    """The number of elements of all ``variables``."""
    return sum(v.size for v in variables)


class Session3(Session):
    """An instance of FMI 3.0 on its way through a run."""

    model: Model3
    instance: Instance3
    rates = "GetContinuousStateDerivatives"

    def __enter__(self) -> Session3:
        return self

    def enter(self, stop_time: float | None = None) -> Session3:
        """Go to Initialization Mode. Raises RefusedError if the FMU does not go there."""
        self.time = self.model.start_time
        self.instance.do("EnterInitializationMode", False, 0.0, self.time, stop_time is not None, stop_time or 0.0)
        return self

    def start(self, stop_time: float | None = None) -> Session3:
        """Go to Continuous-Time Mode or Step Mode.

        Raises RefusedError, and RecursionError as ``rest`` does.
        """
        self.enter(stop_time).instance.do("ExitInitializationMode")
        if self.has_events:
            self.rest()
            self.go_on()
        return self

    @property
    def has_events(self) -> bool:
        """Whether events are the importer's business."""
        return self.model.kind == "ModelExchange" or self.instance.manner.events

    def go_on(self) -> None:
        """Leave Event Mode. Raises RefusedError."""
        self.instance.do("EnterContinuousTimeMode" if self.model.kind == "ModelExchange" else "EnterStepMode")

    def update(self) -> Iteration:
        """One event iteration. Raises RefusedError."""
        flags, time = [c_bool() for _ in range(5)], c_double(self.time)
        self.instance.do("UpdateDiscreteStates", *map(byref, flags), byref(time))
        again, end, nominals, values, defined = (flag.value for flag in flags)
        return Iteration(again, end, nominals, values, defined, time.value)

    def step(self, part: float = 1.0) -> bool:
        """Take a step, ``part`` of the model's step long; False if a co-simulation ends the run.

        Raises RefusedError, and RecursionError as ``rest`` does.
        """
        if self.model.kind == "ModelExchange":
            if self.euler(part):
                self.handle()
            return True
        end = self.time + part * self.model.step
        for _ in range(MOST_EVENTS):
            try:
                done = self.advance(end - self.time)
            except RefusedError as refused:
                if refused.status == DISCARD:
                    return False
                raise
            if done.event and self.has_events:
                self.handle()
            if done.end:
                return False
            if not done.early or done.reached >= end - 1e-9 * self.model.step:
                return True
        raise RecursionError(f"{MOST_EVENTS} early returns before t = {end:g} s")

    def advance(self, length: float) -> StepResults:
        """One call of DoStep over ``length`` (s), with its results as they are. Raises RefusedError."""
        flags, reached, begun = [c_bool() for _ in range(3)], c_double(self.time), self.time
        self.instance.do("DoStep", begun, length, True, *map(byref, flags), byref(reached))
        event, end, early = (flag.value for flag in flags)
        self.time = reached.value if early else begun + length
        return StepResults(begun, begun + length, event, end, early, reached.value)

    def completed(self) -> bool:
        """Tell of a completed step of the integrator; whether the FMU answers with an event. Raises RefusedError."""
        event, end = c_bool(), c_bool()
        self.instance.do("CompletedIntegratorStep", True, byref(event), byref(end))
        return event.value

    def set(self, variable: Variable, values: Sequence[Any]) -> bool:
        """Set the elements of a variable; whether the FMU takes them."""
        return self.instance.set(variable.type, [variable.reference], values) in (OK, WARNING)

    def get(self, variable: Variable) -> list[Any]:
        """The values of the elements of a variable; strings and binaries as bytes. Raises RefusedError."""
        return self.instance.get(variable.type, [variable.reference], variable.size)

    def get_together(self, variables: Sequence[Variable]) -> list[Any]:
        """The values of the elements of variables of one type, by one call. Raises RefusedError."""
        which = [v.reference for v in variables]
        return self.instance.get(variables[0].type, which, sum(v.size for v in variables))

    def set_together(self, variables: Sequence[Variable], values: Sequence[Any]) -> bool:
        """Set the elements of variables of one type by one call; whether the FMU takes them."""
        return self.instance.set(variables[0].type, [v.reference for v in variables], values) in (OK, WARNING)

    def values(self) -> list[Any]:
        """The values of all variables that can be read, in the order of the description. Raises RefusedError."""
        return [x for v in self.model.readable for x in self.get(v)]
