"""A run of an FMU, step by step, with the same methods for both versions and all kinds."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from lag2fmu.checking.binding import FmuLibrary, LibraryInstance, MessageLog, doubles
from lag2fmu.checking.description import FmuDescription, Variable, number

MOST_EVENTS = 1000
"""The event iterations at one time after which a model counts as never at rest."""


def endless(time: float) -> str:
    """The sentence on events at a ``time`` (s) that do not come to rest."""
    return f"{MOST_EVENTS} event iterations at t = {time:g} s and no end"


@dataclass(frozen=True)
class Iteration:
    """The six results of an event iteration."""

    again: bool
    end: bool
    nominals_changed: bool
    values_changed: bool
    next_defined: bool
    next_time: float


@dataclass
class Model(ABC):
    """An FMU of one kind, unpacked in ``folder``, on which trials are made."""

    description: FmuDescription
    kind: str
    folder: Path
    path: Path
    log: MessageLog = field(default_factory=MessageLog)

    def __post_init__(self) -> None:
        self.library = self.load()

    @abstractmethod
    def load(self) -> FmuLibrary:
        """The library; raises OSError if it cannot be loaded."""

    @abstractmethod
    def instance(self, key: str | None = None, name: str = "check") -> LibraryInstance:
        """A new instance; not alive if the FMU refused. ``key`` stands in for what proves which FMU is meant."""

    @abstractmethod
    def session(self, name: str = "check") -> Session:
        """A new instance, not yet initialized; raises RefusedError if there is none."""

    @property
    def prefix(self) -> str:
        """How the names of functions begin."""
        return self.library.binding.prefix

    @property
    def saves(self) -> bool:
        """Whether the state of the FMU can be saved and restored."""
        return self.can(f"canGetAndSet{self.library.binding.state}")

    @property
    def serializes(self) -> bool:
        """Whether a saved state can be written as bytes."""
        return self.can(f"canSerialize{self.library.binding.state}")

    def can(self, capability: str) -> bool:
        """Whether the flag is declared for this kind."""
        return self.description.can(self.kind, capability)

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
    def duration(self) -> float:
        """The length of the default experiment in s, of 100 steps where it has no end."""
        length = self._experiment("stopTime", math.inf) - self.start_time
        return length if 0 < length < math.inf else 100 * self.step

    @property
    def outputs(self) -> list[Variable]:
        """The outputs that are floating point numbers."""
        return [v for v in self.description.variables if v.causality == "output" and v.type in self.floats]

    @property
    @abstractmethod
    def floats(self) -> frozenset[str]:
        """The types of floating point numbers."""

    @property
    @abstractmethod
    def state_count(self) -> int:
        """The number of continuous states, of arrays their elements."""

    @property
    @abstractmethod
    def indicator_count(self) -> int:
        """The number of event indicators, of arrays their elements."""

    @property
    @abstractmethod
    def readable(self) -> Sequence[Variable]:
        """The variables that can be read, in the order in which ``Session.values`` gives them."""

    @abstractmethod
    def lists(self) -> list[list[Variable] | None]:
        """The dependencies of each unknown in ModelStructure, None where none are given."""

    def concerns(self, variable: Variable) -> bool:
        """Whether values of this kind should change with ``variable``, by what modelDescription.xml says.

        What lists of dependencies leave out may be for the FMU's own solver. Some tools list no parameters, or nothing.
        Model exchange beside co-simulation leaves the solver alone.
        """
        lists = self.lists()
        known = [v for listed in lists for v in listed or ()]
        if variable in known:
            return True
        if self.kind == "ModelExchange" and "CoSimulation" in self.description.kinds:
            return False
        if None in lists:
            return variable.causality == "input" or not any(lists)
        return self.state_count > 0 and not any(v.causality == "parameter" for v in known)


class Session(ABC):
    """An instance on its way through a run; a context that frees it at the end. ``time`` in s.

    ``next_event`` is the time (s) of the next time event, infinite where there is none.
    """

    rates: ClassVar[str]
    """The function that gives the derivatives of the states."""

    def __init__(self, model: Model, instance: LibraryInstance) -> None:
        self.model, self.instance, self.time, self.next_event = model, instance, model.start_time, math.inf

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_: object) -> None:
        self.instance.free()

    @abstractmethod
    def enter(self, stop_time: float | None = None) -> Session:
        """Go to Initialization Mode. Raises RefusedError if the FMU does not go there."""

    @abstractmethod
    def start(self, stop_time: float | None = None) -> Session:
        """Go to where steps are taken: Continuous-Time Mode, or the first communication point.

        Raises RefusedError, and RecursionError where events do not come to an end.
        """

    @abstractmethod
    def step(self, part: float = 1.0) -> bool:
        """Take a step, ``part`` of the model's step long; False if a co-simulation ends the run.

        Raises RefusedError, and RecursionError as ``start`` does.
        """

    @abstractmethod
    def update(self) -> Iteration:
        """One event iteration. Raises RefusedError."""

    @abstractmethod
    def go_on(self) -> None:
        """Leave Event Mode. Raises RefusedError."""

    @abstractmethod
    def completed(self) -> bool:
        """Tell of a completed step of the integrator; whether the FMU answers with an event. Raises RefusedError."""

    @abstractmethod
    def set(self, variable: Variable, values: Sequence[Any]) -> bool:
        """Set the elements of a variable; whether the FMU takes them."""

    def rest(self) -> Iteration:
        """Iterate events until no more is needed; raises RefusedError, and RecursionError if there is no end."""
        for _ in range(MOST_EVENTS):
            found = self.update()
            if not found.again or found.end:
                self.next_event = found.next_time if found.next_defined else math.inf
                return found
        raise RecursionError(endless(self.time))

    def handle(self) -> None:
        """Enter Event Mode, iterate and leave it. Raises RefusedError, and RecursionError as ``rest`` does."""
        self.instance.do("EnterEventMode")
        self.rest()
        self.go_on()

    def euler(self, part: float = 1.0) -> bool:
        """A step of model exchange by Euler's method; whether it leads to an event. Raises RefusedError.

        It is a tenth of ``part`` of the model's step long, shorter so that no state moves by more than a hundredth of
        its size, for stiff models, and ends with a time event. Events of states are at its end: where an indicator
        changes its sign is not looked for.
        """
        step, size = part * self.model.step / 10, self.model.state_count
        before = self._signs()
        x, dx = self.instance.vector("GetContinuousStates", size), self.instance.vector(self.rates, size)
        step = min([step, *(0.01 * (abs(a) + 1.0) / abs(b) for a, b in zip(x, dx, strict=True) if b)])
        planned = self.time < self.next_event <= self.time + step
        step = self.next_event - self.time if planned else step
        self.time = self.next_event if planned else self.time + step
        self.instance.do("SetTime", self.time)
        if size:
            self.move([value + step * rate for value, rate in zip(x, dx, strict=True)])
        return self.completed() or planned or self._signs() != before

    def move(self, states: Sequence[float]) -> None:
        """Set the continuous states of model exchange. Raises RefusedError."""
        self.instance.do("SetContinuousStates", doubles(states), len(states))

    def _signs(self) -> list[bool]:
        """Which event indicators are positive."""
        return [z > 0 for z in self.instance.vector("GetEventIndicators", self.model.indicator_count)]

    @abstractmethod
    def get(self, variable: Variable) -> list[Any]:
        """The values of the elements of a variable; strings as bytes. Raises RefusedError."""

    @abstractmethod
    def get_together(self, variables: Sequence[Variable]) -> list[Any]:
        """The values of the elements of variables of one type, by one call. Raises RefusedError."""

    @abstractmethod
    def set_together(self, variables: Sequence[Variable], values: Sequence[Any]) -> bool:
        """Set the elements of variables of one type by one call; whether the FMU takes them."""

    @abstractmethod
    def values(self) -> list[Any]:
        """The values of all variables that can be read, in the order of ``Model.readable``. Raises RefusedError."""

    def table(self) -> dict[str, list[Any]]:
        """{name: values of the elements} of the variables that can be read. Raises RefusedError."""
        found, values = {}, iter(self.values())
        for v in self.model.readable:
            found[v.name] = [next(values) for _ in range(v.size)]
        return found

    def numbers(self, variables: Sequence[Variable]) -> list[float]:
        """The values of floating point variables, their elements one after the other. Raises RefusedError."""
        return [x for v in variables for x in self.get(v)]

    def steps(self, count: int) -> list[list[Any]]:
        """All values after each of ``count`` steps; fewer if the FMU ends the run.

        Raises RefusedError, and RecursionError as ``start`` does.
        """
        found = []
        for _ in range(count):
            if not self.step():
                break
            found.append(self.values())
        return found
