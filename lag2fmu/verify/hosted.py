"""FMUs for model exchange with CVode of SUNDIALS as their solver, called like FMUs for co-simulation.

Between communication steps such an FMU is in event mode, where all its inputs may change. Source: FMI 2.0.5, section
3.2, and FMI 3.0.2, section 3.2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

from lag2fmu.errors import SimulationError
from lag2fmu.verify.instances import Instance, is_fmi3

_TOLERANCE = 1e-6
"""The relative tolerance of the run where none is given."""
_PART = 0.01
"""The solver's tolerance, as a part of the run's: it begins anew at each communication point, which costs digits."""
MOST_STEPS = 20_000
"""The steps that CVode may take from one point to the next; its own bound, 500, is for slow motions."""
_MOST_EVENTS = 100_000
"""The most events in one communication step, and the most rounds in which discrete states settle."""
_CLOSE = 1e-13
"""Relative: times that differ by less are one, because CVode refuses such a step."""


class HostedFmu:
    """The calls of an ``instance`` for model exchange; ``doStep`` integrates, all others are those of fmpy."""

    def __init__(self, instance: Instance) -> None:
        self._instance, self._fmu = instance, instance.fmu
        self._third = is_fmi3(instance.description)
        self._tolerance, self._time, self._next = _TOLERANCE, 0.0, math.inf
        self._solver: Any = None
        self._failure: Exception | None = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._fmu, name)

    def setupExperiment(self, tolerance: float | None = None, **told: Any) -> None:
        """As fmpy; the ``tolerance`` is that of the run."""
        self._tolerance = tolerance or _TOLERANCE
        self._fmu.setupExperiment(tolerance=tolerance, **told)

    def enterInitializationMode(self, tolerance: float | None = None, **told: Any) -> None:
        """As fmpy; FMI 3.0 tells the ``tolerance`` here."""
        if not self._third:
            self._fmu.enterInitializationMode()
            return
        self._tolerance = tolerance or _TOLERANCE
        self._fmu.enterInitializationMode(tolerance=tolerance, **told)

    def exitInitializationMode(self) -> None:
        """Go to event mode, where discrete states settle. Raises SimulationError if they do not."""
        self._fmu.exitInitializationMode()
        self._settle()

    def getFMUState(self) -> tuple[Any, float]:
        """The state, with the time of the next event."""
        return self._fmu.getFMUState(), self._next

    def setFMUState(self, state: tuple[Any, float]) -> None:
        """Go back to a ``state``."""
        self._fmu.setFMUState(state[0])
        self._next = state[1]

    def freeFMUState(self, state: tuple[Any, float]) -> None:
        """Free the memory of a ``state``."""
        self._fmu.freeFMUState(state[0])

    def doStep(self, t: float, h: float, *_: Any) -> tuple[bool, bool, bool, float]:
        """From ``t`` over ``h`` (s), through all events on the way; what FMI 3.0 returns: no event, no early return.

        Inputs may have jumped at ``t``, so that the solver begins anew. Raises SimulationError if the FMU ends the run,
        and where events do not come to an end.
        """
        end = t + h
        self._settle()
        self._fmu.enterContinuousTimeMode()
        self._begin(t)
        for _event in range(_MOST_EVENTS):
            target = min(end, max(self._next, t))
            happened = self._integrate(t, target)
            t = self._time
            if happened or t >= self._next or t >= end:
                self._fmu.enterEventMode()
                self._settle()
                if t >= end:
                    return False, False, False, t
                self._fmu.enterContinuousTimeMode()
                self._solver.reset(t)
        raise SimulationError(f"there are more than {_MOST_EVENTS} events in one step, the last one at t = {t:.9g} s")

    def _integrate(self, t: float, target: float) -> bool:
        """Integrate until an event, or the ``target`` (s); whether there is an event of the states or of the step."""
        crossed = False
        if target - t > _CLOSE * max(abs(t), abs(target)):
            self._failure = None  # of a step that was taken back
            try:
                crossed, _, reached = self._solver.step(t, target)
            finally:
                if self._failure is not None:  # what CVode says of it tells less
                    raise self._failure
            target = reached if crossed else target
        self._time = target
        self._set_time(target)
        asked = False
        if self._instance.description.modelExchange.needsCompletedIntegratorStep:
            asked, terminate = self._fmu.completedIntegratorStep()
            self._refuse(terminate)
        return bool(crossed or asked)

    def _begin(self, t: float) -> None:
        """The solver starts at ``t`` (s)."""
        if self._solver is not None:
            self._solver.reset(t)
            return
        from fmpy.sundials import CVodeSolver

        fmu, description = self._fmu, self._instance.description
        self._solver = CVodeSolver(
            nx=description.numberOfContinuousStates,
            nz=description.numberOfEventIndicators,
            get_x=self._told(fmu.getContinuousStates),
            set_x=self._told(fmu.setContinuousStates),
            get_dx=self._told(fmu.getContinuousStateDerivatives if self._third else fmu.getDerivatives),
            get_z=self._told(fmu.getEventIndicators),
            get_nominals=self._told(fmu.getNominalsOfContinuousStates),
            set_time=self._told(self._set_time),
            input=SimpleNamespace(apply=lambda t: None),  # inputs go with the time
            startTime=t,
            relativeTolerance=_PART * self._tolerance,
            maxNumSteps=MOST_STEPS,
        )

    def _told(self, call: Callable[..., Any]) -> Callable[..., None]:
        """``call`` for the solver: C cannot raise, so that the first failure is kept until the solver is back."""

        def told(*args: Any) -> None:
            try:
                call(*args)
            except Exception as error:  # fmpy raises bare exceptions
                self._failure = self._failure or error

        return told

    def _set_time(self, t: float) -> None:
        """Set the time (s), and the inputs that go on within steps."""
        self._fmu.setTime(t)
        if self._instance.asked is not None:
            self._instance.asked(t)

    def _settle(self) -> None:
        """In event mode: let the discrete states settle, and take the time of the next event."""
        update = self._fmu.updateDiscreteStates if self._third else self._fmu.newDiscreteStates
        for _ in range(_MOST_EVENTS):
            again, terminate, _, _, defined, time = update()
            self._refuse(terminate)
            self._next = time if defined else math.inf
            if not again:
                return
        raise SimulationError(f"the discrete states do not settle within {_MOST_EVENTS} rounds")

    def _refuse(self, terminate: bool) -> None:
        """Raise SimulationError if the FMU ends the simulation."""
        if terminate:
            raise SimulationError(f"the FMU ended the simulation at t = {self._time:.9g} s")


@contextmanager
def hosted(instance: Instance) -> Iterator[None]:
    """A context in which the calls of the ``instance``, one for model exchange, are those of co-simulation."""
    plain = instance.fmu
    instance.fmu = HostedFmu(instance)
    try:
        yield
    finally:
        instance.fmu = plain
