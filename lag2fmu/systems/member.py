"""An FMU on its way through the run of a system: one way to call it, by FMI 2.0 and 3.0, through fmpy."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, cast

import numpy as np

from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.systems.components import Component
from lag2fmu.verify.channels import Channel
from lag2fmu.verify.instances import Instance, description_of, instance_of, is_fmi3
from lag2fmu.verify.plan import takes_derivatives
from lag2fmu.verify.run import Floats, Plan, Run, Scalar
from lag2fmu.verify.scalars import scalars_of
from lag2fmu.verify.simulate import begin

_ORDERS = 2
"""Inputs go on as polynomials of at most this degree: with second derivatives the error of coupling is of order 3."""
_PATIENCE = 100_000
"""The most early returns in one communication step."""
_DIFFERENCE = 1e-7
"""The difference by which outputs are differentiated, in units of an input's size: the root of rounding, about."""


class _Told:
    """The calls of a member's FMU; what goes wrong is a SimulationError that names the component and the call."""

    def __init__(self, member: Member) -> None:
        self._member = member

    def __getattr__(self, name: str) -> Callable[..., Any]:
        call = getattr(self._member.instance.fmu, name)

        def told(*args: Any) -> Any:
            with self._member.telling(f"called by {name}"):
                return call(*args)

        return told


class Member:
    """A ``component`` as an ``instance`` whose numbers are ``scalars``; its calls are those of ``fmu``."""

    def __init__(
        self, component: Component, instance: Instance, scalars: Mapping[str, Scalar], begin: Callable[[], None]
    ) -> None:
        """Look up what the FMU offers; ``begin`` is called before calls of the FMU, which may not come back."""
        self.begin = begin
        self.name, self.instance, self.scalars = component.name, instance, scalars
        self.fmu = _Told(self)
        description = instance.description
        self.takes_derivatives = takes_derivatives(description)
        self.gives_orders = min(int(description.coSimulation.maxOutputDerivativeOrder or 0), _ORDERS)
        self._differentiates = bool(description.coSimulation.providesDirectionalDerivative)
        self._polynomials: dict[Channel, Floats] = {}
        self._begun = 0.0

    def channel(self, names: Sequence[str]) -> Channel:
        """The numbers in the variables ``names``, of an array its elements; raises LoadError as ``elements``."""
        found = [s for name in names for s in self.elements(name)]
        return Channel(self.fmu, found, third=is_fmi3(self.instance.description))

    def elements(self, name: str) -> list[Scalar]:
        """The scalars of the variable or element ``name``; raises LoadError if there is none that is a number."""
        if name in self.scalars:
            return [self.scalars[name]]
        found = [s for s in self.scalars.values() if s.variable.name == name]
        if not found:
            raise LoadError(f"the component '{self.name}' has no number '{name}'; {suggestion(name, self.scalars)}")
        return found

    def initialize(self, values: Mapping[str, float | str], tolerance: float | None, span: tuple[float, float]) -> None:
        """Set start ``values`` and go to initialization mode, for a run over the ``span`` (s)."""
        run = Run(values=cast("Mapping[str, float]", values), tolerance=tolerance)
        begin(self.instance, run, Plan(np.array(span), (), self.scalars, None, None))

    def drive(self, inputs: Channel, values: Floats, derivatives: Floats) -> None:
        """Let the ``inputs`` (k,) go on in the next step from ``values`` (k,) by their ``derivatives`` (orders, k)."""
        orders, k = derivatives.shape
        if is_fmi3(self.instance.description):
            self._polynomials[inputs] = np.vstack([values, derivatives])
            self.instance.asked = self._asked
        elif k and orders:
            numbers = np.repeat(np.arange(1, orders + 1), k).tolist()
            self.fmu.setRealInputDerivatives(orders * inputs.references, numbers, derivatives.ravel().tolist())

    def _asked(self, t: float) -> None:
        """The FMU asks for its inputs at ``t`` (s) within a step."""
        h = t - self._begun
        for inputs, terms in self._polynomials.items():
            inputs.write(sum(term * h**i / max(i, 1) for i, term in enumerate(terms)))  # of order 2 at most: i! is i

    def derivatives(self, outputs: Channel) -> Floats:
        """The derivatives of the ``outputs`` (k,) by time, (orders, k); an order that the FMU does not know is 0."""
        k, found = len(outputs), np.zeros((_ORDERS, len(outputs)))
        if self.gives_orders and k and outputs.are_floats:
            third = is_fmi3(self.instance.description)
            get = self.fmu.getOutputDerivatives if third else self.fmu.getRealOutputDerivatives
            for order in range(1, self.gives_orders + 1):
                found[order - 1] = get(outputs.references, [order] * k)
        return found

    def slopes(self, outputs: Channel, inputs: Channel) -> Floats:
        """The derivatives of the ``outputs`` (k,) by the ``inputs`` (m,) at the present time, (k, m)."""
        if self._differentiates and outputs.are_floats and inputs.are_floats:
            columns = [
                self.fmu.getDirectionalDerivative(outputs.references, [reference], [1.0])
                for reference in inputs.references
            ]
            found: Floats = np.array(columns, dtype=float).reshape(len(inputs), len(outputs)).T
            return found
        values, before = inputs.read(), outputs.read()
        found = np.zeros((len(outputs), len(inputs)))
        for j, value in enumerate(values):
            difference = _DIFFERENCE * max(abs(value), 1.0)
            inputs.write(np.where(np.arange(len(values)) == j, value + difference, values))
            found[:, j] = (outputs.read() - before) / difference
        inputs.write(values)
        return found

    @property
    def repeats(self) -> bool:
        """Whether the FMU can go back to a state before."""
        return bool(self.instance.description.coSimulation.canGetAndSetFMUstate)

    def save(self) -> Any:
        """The present state, to go back to; it is to be given to ``forget``."""
        return self.fmu.getFMUState()

    def restore(self, state: Any) -> None:
        """Go back to a ``state``."""
        self.fmu.setFMUState(state)

    def forget(self, state: Any) -> None:
        """Free the memory of a ``state``."""
        self.fmu.freeFMUState(state)

    @contextmanager
    def telling(self, doing: str) -> Iterator[None]:
        """A context that raises SimulationError, with the name of the component and its words, for what goes wrong."""
        self.begin()
        try:
            yield
        except Exception as error:  # fmpy raises bare exceptions
            words = f"the component '{self.name}', {doing}: {error}; {self.instance.log.tail()}"
            raise SimulationError(words) from error

    def advance(self, t: float, h: float, *, last: bool = False) -> None:
        """``step``; raises SimulationError that names the component and the time."""
        with self.telling(f"in the step from t = {t:g} s"):
            self.step(t, h, last=last)

    def step(self, t: float, h: float, *, last: bool) -> None:
        """A communication step from ``t`` of length ``h`` (s); ``last``: it is not repeated.

        Raises SimulationError if the FMU ends the run.
        """
        if not is_fmi3(self.instance.description):
            self.instance.fmu.doStep(t, h, int(last))
            return
        self._begun = t
        now, end = t, t + h
        for _ in range(_PATIENCE):
            _, terminate, early, reached = self.instance.fmu.doStep(now, end - now, last)
            if terminate:
                raise SimulationError(f"the FMU ended the simulation at t = {reached:.9g} s")
            if not early or reached >= end:
                return
            now = reached
        raise SimulationError(f"the FMU returned {_PATIENCE} times from one step, the last time at t = {now:.9g} s")


@contextmanager
def member_of(component: Component, driven: Sequence[str], begin: Callable[[], None]) -> Iterator[Member]:
    """The ``component``, instantiated for co-simulation; ``driven`` are its inputs that change within steps.

    ``begin`` is called before calls of the FMU.

    Raises LoadError for an FMU without co-simulation, SimulationError for one that cannot be instantiated.
    """
    if component.kind != "CoSimulation":
        raise LoadError(f"the component '{component.name}' offers no co-simulation; a system is run by that alone")
    description = description_of(component.path)
    scalars = scalars_of(description, component.path)
    asked = driven if is_fmi3(description) and takes_derivatives(description) else ()
    followed = {s.reference for s in scalars.values() if s.name in asked or s.variable.name in asked}
    begin()
    with instance_of(component.path, "CoSimulation", followed=tuple(sorted(followed))) as instance:
        yield Member(component, instance, scalars, begin)
