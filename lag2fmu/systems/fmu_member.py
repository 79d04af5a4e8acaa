"""An FMU on its way through the run of a system: one way to call it, by FMI 2.0 and 3.0, through fmpy."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, contextmanager
from typing import Any, cast

import numpy as np

from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.systems.components import Component
from lag2fmu.systems.fmu_process import Apart, RemoteInstance, called_as_one, instance_apart, patience_of
from lag2fmu.systems.fmu_worker import instance_on
from lag2fmu.systems.member import ORDERS, Member, StepDiscardedError
from lag2fmu.verify.channels import Channel
from lag2fmu.verify.instances import Instance, description_of, is_fmi3
from lag2fmu.verify.plan import input_orders
from lag2fmu.verify.run import Floats, Kind, Plan, Run, Scalar
from lag2fmu.verify.scalars import scalars_of
from lag2fmu.verify.simulate import begin

_KINDS: Mapping[str, Kind] = {"CoSimulation": "co-simulation", "ModelExchange": "model-exchange"}
PATIENCE = 100_000
"""The most early returns in one communication step."""
_DISCARD = 2
"""The status of a step that was not made to its end, by FMI 2.0 and 3.0."""
_DIFFERENCE = 1e-7
"""The difference by which outputs are differentiated, in units of an input's size: the root of rounding, about."""


class _Told:
    """The calls of a member's FMU; what goes wrong is a SimulationError that names the component and the call."""

    def __init__(self, member: FmuMember) -> None:
        self._member = member

    def __getattr__(self, name: str) -> Callable[..., Any]:
        member, call = self._member, getattr(self._member.instance.fmu, name)

        def told(*args: Any) -> Any:
            member.begin()
            try:
                return call(*args)
            except Exception as error:  # fmpy raises bare exceptions
                raise member.failure(f"called by {name}", error) from error

        setattr(self, name, told)  # which is found at once from now on
        return told


class FmuMember(Member):
    """A ``component`` as an ``instance`` whose numbers are ``scalars``; its calls are those of ``fmu``."""

    def __init__(
        self, component: Component, instance: Instance, scalars: Mapping[str, Scalar], begin: Callable[[], None]
    ) -> None:
        """Look up what the FMU offers; ``begin`` is called before calls of the FMU, which may not come back."""
        description, self.begin, self.instance = instance.description, begin, instance
        super().__init__(component.name, _Told(self), scalars, third=is_fmi3(description))
        exchanges = component.kind == "ModelExchange"
        offered = description.modelExchange if exchanges else description.coSimulation
        self.takes_orders = min(input_orders(description, _KINDS[component.kind]), ORDERS)
        self.gives_orders = min(int(getattr(offered, "maxOutputDerivativeOrder", 0) or 0), ORDERS)
        self.repeats = bool(offered.canGetAndSetFMUstate)
        self._differentiates = bool(offered.providesDirectionalDerivative)
        self._is_asked = self.third or exchanges
        self._polynomials: dict[Channel, Floats] = {}
        self._begun = 0.0
        self._followed = _followed(description)

    @property
    def warnings(self) -> Sequence[str]:
        """The warnings of its FMU."""
        return self.instance.log.warnings

    def depends(self, outputs: Channel, inputs: Channel) -> bool:
        """By the structure that the FMU declares."""
        return any(
            followed is None or i in followed
            for followed in map(self._followed.get, outputs.references)
            for i in inputs.references
        )

    def initialize(self, values: Mapping[str, float | str], tolerance: float | None, span: tuple[float, float]) -> None:
        """See ``Member``; raises what its FMU raises."""
        self.begin()
        run = Run(values=cast("Mapping[str, float]", values), tolerance=tolerance)
        begin(self.instance, run, Plan(np.array(span), (), self.scalars, None, None))

    def drive(self, inputs: Channel, values: Floats, derivatives: Floats) -> None:
        """Let the ``inputs`` (k,) go on in the next step from ``values`` (k,) by their ``derivatives`` (orders, k)."""
        orders, k = derivatives[: self.takes_orders].shape
        if self._is_asked:
            self._polynomials[inputs] = np.vstack([values, derivatives])
            self.instance.asked = self._asked
        elif k and orders:
            numbers = np.repeat(np.arange(1, orders + 1), k).tolist()
            self.fmu.setRealInputDerivatives(orders * inputs.references, numbers, derivatives[:orders].ravel().tolist())

    def _asked(self, t: float) -> None:
        """The FMU asks for its inputs at ``t`` (s) within a step."""
        h = t - self._begun
        for inputs, terms in self._polynomials.items():
            inputs.write(sum(term * h**i / max(i, 1) for i, term in enumerate(terms)))  # of order 2 at most: i! is i

    def derivatives(self, outputs: Channel) -> Floats:
        """The derivatives of the ``outputs`` (k,) by time, (orders, k); an order that the FMU does not know is 0."""
        k, found = len(outputs), np.zeros((ORDERS, len(outputs)))
        if self.gives_orders and k and outputs.are_floats:
            get = self.fmu.getOutputDerivatives if self.third else self.fmu.getRealOutputDerivatives
            for order in range(1, self.gives_orders + 1):
                found[order - 1] = get(outputs.references, [order] * k)
        return np.where(np.isfinite(found), found, 0.0)  # those of OpenModelica are differences, NaN at the start

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

    def save(self) -> Any:
        """The present state, to go back to; it is to be given to ``forget``."""
        return self.fmu.getFMUState(), len(self.warnings)

    def restore(self, state: Any) -> None:
        """Go back to a ``state``; what the FMU has warned of since then has not happened."""
        self.fmu.setFMUState(state[0])
        del self.instance.log.warnings[state[1] :]

    def forget(self, state: Any) -> None:
        """Free the memory of a ``state``."""
        self.fmu.freeFMUState(state[0])

    def sample(self, t: float) -> None:
        """Nothing: the FMU samples within its steps."""

    def failure(self, doing: str, error: Exception) -> SimulationError:
        """See ``Member``."""
        return SimulationError(
            f"the component '{self.name}', {doing}: {str(error).rstrip('.')}; {self.instance.log.tail()}"
        )

    def step(self, t: float, h: float) -> None:
        """See ``Member``; raises SimulationError and StepDiscardedError with the name of the component."""
        self.begin()
        self._begun = t
        try:
            if self.third:
                self.step3(t, t + h)
            else:
                self.instance.fmu.doStep(t, h, 1)
        except Exception as error:  # fmpy raises bare exceptions
            told = self.failure(f"in the step from t = {t:g} s", error)
            if getattr(error, "status", None) == _DISCARD:
                raise StepDiscardedError(f"{told}; it may make a shorter --step") from error
            raise told from error

    def step3(self, t: float, end: float) -> None:
        """From ``t`` to the ``end`` (s) by FMI 3.0, after early returns in several parts. Raises SimulationError."""
        begun = t
        for _ in range(PATIENCE):
            _, terminate, early, reached = self.instance.fmu.doStep(t, end - t, self.stays(begun, t))
            if terminate:
                raise SimulationError(f"the FMU ended the simulation at t = {reached:.9g} s")
            if not early or reached >= end:
                return
            t = reached
        raise SimulationError(f"the FMU returned {PATIENCE} times from one step, the last time at t = {t:.9g} s")

    def stays(self, begun: float, t: float) -> bool:
        """Whether no state of a time before ``t`` comes back, in a communication step that has ``begun`` (s)."""
        return t == begun or not self.repeats


@contextmanager
def fmu_member_of(
    component: Component, driven: Sequence[str], begin: Callable[[], None], kind: type[FmuMember], *, apart: Apart
) -> Iterator[FmuMember]:
    """The ``component``, instantiated; ``driven`` are its inputs that change within steps.

    ``kind`` is the class of the member; with periodic clocks it has event mode. ``begin`` is called before calls of the
    FMU; ``apart``: see there. Raises LoadError for clocks in model exchange, SimulationError for an FMU that cannot be
    instantiated.
    """
    if component.clocks and component.kind == "ModelExchange":
        raise LoadError(f"the component '{component.name}' has clocks, which run here in co-simulation alone")
    description = description_of(component.path)
    scalars = scalars_of(description, component.path)
    asked = driven if component.kind == "CoSimulation" and is_fmi3(description) and input_orders(description) else ()
    followed = {s.reference for s in scalars.values() if s.name in asked or s.variable.name in asked}
    begin()
    events, asks = bool(component.clocks), tuple(sorted(followed))
    if apart:
        with _remotely(component, apart, events=events, followed=asks) as remote:
            yield kind(component, cast("Instance", remote), scalars, begin)
        return
    with called_as_one(component.path, component.kind, events=events, followed=asks) as instance:

        def heard() -> None:
            begin()
            instance.listen()

        try:
            yield kind(component, instance, scalars, heard)
        finally:
            begin()  # an FMU that is freed may not come back either


def _remotely(
    component: Component, apart: Apart, *, events: bool, followed: tuple[int, ...]
) -> AbstractContextManager[RemoteInstance]:
    """An instance of the FMU of the ``component`` in another process."""
    if isinstance(apart, Executor):
        return instance_on(apart, component.path, component.kind, events=events, followed=followed)
    patience = patience_of(apart)
    return instance_apart(component.path, component.kind, events=events, followed=followed, patience=patience)


def _followed(description: Any) -> dict[int, frozenset[int] | None]:
    """{value reference of an output: references of the variables that it follows at once; None if that is not said}."""
    return {
        u.variable.valueReference: None
        if u.dependencies is None
        else frozenset(v.valueReference for v in u.dependencies)
        for u in description.outputs
    }
