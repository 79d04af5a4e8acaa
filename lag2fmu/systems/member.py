"""A component on its way through the run of a system: what the master does with FMUs and functions alike."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.verify.channels import Channel
from lag2fmu.verify.run import Floats, Scalar

ORDERS = 2
"""Inputs go on as polynomials of at most this degree: with second derivatives the error of coupling is of order 3."""


class StepDiscardedError(SimulationError):
    """A component did not make the whole step; a shorter one may do."""


class Member(ABC):
    """A component on its way through a run: an FMU, or a Python function.

    - ``fmu``: its calls, named as those of fmpy; ``third``: whether they are those of FMI 3.0.
    - ``takes_orders``: the highest order of the derivatives by which its inputs go on within a step; 0: they are held.
    - ``gives_orders``: the highest order of the derivatives that its outputs have.
    - ``repeats``: whether it can go back to a state before.
    - ``ticks``: whether ``sample`` is to be called at all.
    - ``samples``: whether it reads inputs and changes outputs at times that are ``due`` alone.
    - ``due``: the time (s) at which ``sample`` is to be called next.
    """

    takes_orders, gives_orders, repeats, due = ORDERS, ORDERS, True, math.inf
    samples, ticks = False, False

    def __init__(self, name: str, fmu: Any, scalars: Mapping[str, Scalar], *, third: bool) -> None:
        """``scalars`` are its numbers."""
        self.name, self.fmu, self.scalars, self.third = name, fmu, scalars, third

    def channel(self, names: Sequence[str]) -> Channel:
        """The numbers in the variables ``names``, of an array its elements; raises LoadError as ``elements``."""
        return Channel(self.fmu, [s for name in names for s in self.elements(name)], third=self.third)

    def elements(self, name: str) -> list[Scalar]:
        """The scalars of the variable or element ``name``; raises LoadError if there is none that is a number."""
        if name in self.scalars:
            return [self.scalars[name]]
        found = [s for s in self.scalars.values() if s.variable.name == name]
        if not found:
            raise LoadError(f"the component '{self.name}' has no number '{name}'; {suggestion(name, self.scalars)}")
        return found

    @property
    @abstractmethod
    def warnings(self) -> Sequence[str]:
        """The sentences with which it has warned."""

    @abstractmethod
    def initialize(self, values: Mapping[str, float | str], tolerance: float | None, span: tuple[float, float]) -> None:
        """Set start ``values`` and go to initialization mode, for a run over the ``span`` (s)."""

    def exit_initialization(self) -> None:
        """Leave initialization mode. Raises SimulationError."""
        self.fmu.exitInitializationMode()

    @abstractmethod
    def depends(self, outputs: Channel, inputs: Channel) -> bool:
        """Whether one of the ``outputs`` follows one of the ``inputs`` at once, after initialization."""

    @abstractmethod
    def drive(self, inputs: Channel, values: Floats, derivatives: Floats) -> None:
        """Let the ``inputs`` (k,) go on in the next step from ``values`` (k,) by their ``derivatives`` (orders, k).

        Those beyond ``takes_orders`` are left out.
        """

    @abstractmethod
    def derivatives(self, outputs: Channel) -> Floats:
        """The derivatives of the ``outputs`` (k,) by time, (orders, k); an order that it does not know is 0."""

    @abstractmethod
    def slopes(self, outputs: Channel, inputs: Channel) -> Floats:
        """The derivatives of the ``outputs`` (k,) by the ``inputs`` (m,) at the present time, (k, m)."""

    @abstractmethod
    def save(self) -> Any:
        """The present state, to go back to; it is to be given to ``forget``."""

    @abstractmethod
    def restore(self, state: Any) -> None:
        """Go back to a ``state``."""

    @abstractmethod
    def forget(self, state: Any) -> None:
        """Free the memory of a ``state``."""

    @abstractmethod
    def step(self, t: float, h: float) -> None:
        """A communication step from ``t`` of length ``h`` (s).

        It may be repeated from ``t``, and FMUs are told that no earlier state comes back: some go back by themselves
        else. Raises SimulationError if the component ends the run, StepDiscardedError if it does not come to the end.
        """

    @abstractmethod
    def sample(self, t: float) -> None:
        """Do what is ``due`` at ``t`` (s); outputs may jump there. Raises SimulationError."""

    @abstractmethod
    def failure(self, doing: str, error: Exception) -> SimulationError:
        """The error of the component: its name, what it was ``doing``, and its words."""

    @contextmanager
    def telling(self, doing: str) -> Iterator[None]:
        """A context that raises the ``failure`` of the component for what goes wrong."""
        try:
            yield
        except SimulationError:  # it tells its component already
            raise
        except Exception as error:  # fmpy raises bare exceptions
            raise self.failure(doing, error) from error
