"""A run of an FMU, step by step, with the same methods for both versions and all kinds."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lag2fmu.checking.binding import Instance, Library, Log
from lag2fmu.checking.description import Description, Variable, number

MOST_EVENTS = 1000
"""After so many event iterations at one time a model counts as never at rest."""


@dataclass
class Model(ABC):
    """An FMU of one kind, unpacked in ``folder``, on which trials are made."""

    description: Description
    kind: str
    folder: Path
    path: Path
    log: Log = field(default_factory=Log)

    def __post_init__(self) -> None:
        self.library = self.load()

    @abstractmethod
    def load(self) -> Library:
        """The library; raises OSError if it cannot be loaded."""

    @abstractmethod
    def instance(self, key: str | None = None, name: str = "check") -> Instance:
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
    def outputs(self) -> list[Variable]:
        """The outputs that are floating point numbers."""
        return [v for v in self.description.variables if v.causality == "output" and v.type in self.floats]

    @property
    @abstractmethod
    def floats(self) -> frozenset[str]:
        """The types of floating point numbers."""


class Session(ABC):
    """An instance on its way through a run; a context that frees it at the end. ``time`` in s."""

    def __init__(self, model: Model, instance: Instance) -> None:
        self.model, self.instance, self.time = model, instance, model.start_time

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
    def step(self) -> bool:
        """Take a step of the model's length; False if a co-simulation ends the run.

        Raises RefusedError, and RecursionError as ``start`` does.
        """

    @abstractmethod
    def get(self, variable: Variable) -> list[Any]:
        """The values of the elements of a variable; strings as bytes. Raises RefusedError."""

    @abstractmethod
    def values(self) -> list[Any]:
        """The values of all variables that can be read, in an order of its own. Raises RefusedError."""

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
