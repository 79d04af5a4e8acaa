"""FMUs of FMI 3.0 with clocks that the importer ticks: they run with event mode, in which each tick is told.

Source: FMI 3.0.2, sections 2.2.8.3 (clocks), 4.2 (co-simulation with event mode).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from lag2fmu.errors import SimulationError
from lag2fmu.systems.components import Component, PeriodicClock
from lag2fmu.systems.fmu_member import PATIENCE, FmuMember
from lag2fmu.verify.co_simulation import settle
from lag2fmu.verify.instances import Instance
from lag2fmu.verify.run import Scalar


class _Tick(NamedTuple):
    """The next tick of a clock: its time (s), its number, and the clock."""

    time: float
    number: int
    clock: PeriodicClock


class ClockedFmu(FmuMember):
    """An FMU whose periodic clocks tick when they are ``due``; at other events it asks for event mode itself."""

    ticks = True

    def __init__(
        self, component: Component, instance: Instance, scalars: Mapping[str, Scalar], begin: Callable[[], None]
    ) -> None:
        """See ``FmuMember``; the ``instance`` has event mode and early return."""
        super().__init__(component, instance, scalars, begin)
        self._clocks, self._start = component.clocks, 0.0
        self._ticks: list[_Tick] = []

    def initialize(self, values: Mapping[str, float | str], tolerance: float | None, span: tuple[float, float]) -> None:
        """See ``FmuMember``."""
        super().initialize(values, tolerance, span)
        self._start = span[0]

    def exit_initialization(self) -> None:
        """Go to step mode; clocks without a shift tick before. Raises SimulationError."""
        self.fmu.exitInitializationMode()
        self._ticks = [_Tick(self._start + clock.shift, 0, clock) for clock in self._clocks]
        self._tick(self._start)

    def sample(self, t: float) -> None:
        """Tick the clocks that are due at ``t`` (s). Raises SimulationError."""
        self.fmu.enterEventMode()
        self._tick(t)

    def _tick(self, t: float) -> None:
        """In event mode: tick, let the discrete states settle, and go to step mode."""
        near = 1e-9 * min(clock.interval for clock in self._clocks)
        due = [tick for tick in self._ticks if tick.time <= t + near]
        if due:
            self.fmu.setClock([tick.clock.reference for tick in due], [True] * len(due))
        self._settle()
        self._ticks = [self._after(tick) if tick in due else tick for tick in self._ticks]
        self.due = min(tick.time for tick in self._ticks)

    def _after(self, tick: _Tick) -> _Tick:
        number = tick.number + 1
        return _Tick(self._start + tick.clock.shift + number * tick.clock.interval, number, tick.clock)

    def _settle(self) -> None:
        with self.telling("in event mode"):
            settle(self.instance.fmu)
        self.fmu.enterStepMode()

    def step3(self, t: float, end: float) -> None:
        """From ``t`` to the ``end`` (s), in as many parts as its events ask for. Raises SimulationError."""
        begun = t
        for _ in range(PATIENCE):
            event, terminate, early, reached = self.instance.fmu.doStep(t, end - t, self.stays(begun, t))
            if terminate:
                raise SimulationError(f"the FMU ended the simulation at t = {reached:.9g} s")
            if event:
                self.fmu.enterEventMode()
                self._settle()
            if not early or reached >= end:
                return
            t = reached
        raise SimulationError(f"the FMU returned {PATIENCE} times from one step, the last time at t = {t:.9g} s")
