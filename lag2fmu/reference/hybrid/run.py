"""A run of a hybrid mechanism: what is to be run, and what is remembered at the times that were asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from lag2fmu.description.names import velocity
from lag2fmu.errors import SimulationError
from lag2fmu.reference.constraints import onward
from lag2fmu.reference.energies import declared_starts
from lag2fmu.reference.hybrid.modes import Event, Mode, Modes
from lag2fmu.reference.hybrid.system import HybridSystem
from lag2fmu.reference.newton import newton
from lag2fmu.reference.signals import Signals
from lag2fmu.reference.state import Floats, StateBatch

LONGEST_PART = 0.05
"""The longest step as a part of the run."""
PULL_BACK = 0.1
"""The part of the error of a constraint that is pulled back in a communication step."""
SIDES_TRIED = 20
"""How often guesses of a start are solved for at most, each time on the sides of kinks that the last ones came to."""


@dataclass(frozen=True, eq=False)
class Track:
    """A run at m times.

    ``values`` (m, s + 2) are q, qd, further states, work (J) and dissipated energy (J). For each contact, (m, u):
    ``impacts`` counts them, ``impulses`` are the last ones (N.s), ``since`` counts impacts since the contact closed
    last. ``turns`` are the times (s) at which kinks changed their sides.
    """

    values: Floats
    modes: tuple[Modes, ...]
    impacts: Floats
    impulses: Floats
    since: Floats
    events: tuple[Event, ...]
    evaluations: int
    turns: tuple[float, ...] = ()

    def until(self, times: Floats) -> Track:
        """The run at the first of its times, ``times`` (k,) in s, k <= m."""
        k, last = len(times), float(times[-1])
        return replace(
            self,
            values=self.values[:k],
            modes=self.modes[:k],
            impacts=self.impacts[:k],
            impulses=self.impulses[:k],
            since=self.since[:k],
            events=tuple(event for event in self.events if event.time <= last),
            turns=tuple(turn for turn in self.turns if turn <= last),
        )


class HybridRun:
    """A problem: the motion of ``system`` over ``times`` (m,), in s, with the inputs ``signals``.

    The times may be a part of a ``whole`` run that is as long, in s.
    """

    def __init__(self, system: HybridSystem, signals: Signals, times: Floats, whole: float | None = None) -> None:
        self.system, self.signals, self.times, self.n = system, signals, times, system.n
        self.size, self.further = system.size, [z.name for z in system.mechanism.states]
        self.nominal = np.concatenate([system.nominal, system.nominal, [z.nominal for z in system.mechanism.states]])
        q = [c.name for c in system.mechanism.coordinates]
        self.states = [*q, *map(velocity, q), *self.further]
        self.end = np.inf
        needs = system.constraints.m or system.elements.k
        self.whole = whole or float(times[-1] - times[0])
        longest = LONGEST_PART * self.whole
        # the rate (1/s) that pulls back onto closed contacts; a greater one would shorten the steps of a motion at rest
        self.damping = min(PULL_BACK / system.mechanism.experiment.step, 2 / longest) if needs and longest else 0.0
        self.progress: Callable[[float], None] | None = None

    def inputs(self, t: float) -> Floats:
        """The inputs (i,) at ``t`` (s), as in ``StateBatch``; one that jumps keeps its value until the segment ends."""
        values: Mapping[str, float] = self.signals.at(min(t, float(np.nextafter(self.end, -np.inf))))
        return self.system.energies.input_values(values)

    def state(self, t: float, y: Floats) -> StateBatch:
        """The state at y (s + 2,)."""
        inputs = self.system.energies.with_states(self.inputs(t), y[2 * self.n : self.size])
        return StateBatch(np.float64(t), y[: self.n], y[self.n : 2 * self.n], inputs)

    def started(self, start: Floats) -> Modes:
        """The modes before anything is decided at ``start`` (s,): contacts are open, and dry frictions at rest stick.

        What sticks goes on sticking up to the greatest holding force. Kinks that the start is at are on the side to
        which it goes.
        """
        q, qd, further = np.split(start, (self.n, 2 * self.n))
        there = np.concatenate([onward(q, qd, self.system.nominal), qd, further])
        e, state = self.system.elements, self.state(float(self.times[0]), there)
        sides, latches = e.take_sides(state), len(e.latches)
        return Modes((Mode.OPEN,) * e.u, (Mode.STICKS,) * e.f, (False,) * latches, sides, {}, (0.0,) * latches)


def started(run: HybridRun, overrides: Mapping[str, float]) -> Floats:
    """q, qd and further states at the start, (s,), in SI units; guesses are solved for.

    ``overrides`` {NAME or NAME_dot: SI value} replace declared values. Raises LoadError for unknown names and unusable
    values, SimulationError where constraints cannot be met.
    """
    coordinates, n, system = run.system.mechanism.coordinates, run.n, run.system
    start: Floats = np.array(list(declared_starts(system.mechanism, overrides).values()), dtype=float)
    if not system.constraints.m:
        return start
    free = [c.given is False for c in coordinates], [c.velocity_given is False for c in coordinates]
    t, h = float(run.times[0]), system.constraints.h

    def positions(q: Floats) -> tuple[Floats, Floats]:
        phi, _, _, G = system.constraints(run.state(t, np.concatenate([q, start[n:]])))
        return phi[:h], G[:h] * system.nominal

    def velocities(qd: Floats) -> tuple[Floats, Floats]:
        _, v, _, G = system.constraints(run.state(t, np.concatenate([start[:n], qd, start[2 * n :]])))
        return v, G * system.nominal

    for half, function, flags in ((slice(0, n), positions, free[0]), (slice(n, 2 * n), velocities, free[1])):
        passes = np.array(flags, dtype=bool), np.ones(n, dtype=bool)
        for _ in range(SIDES_TRIED):
            sides = run.started(start).sides
            for chosen in passes if len(function(start[half])[0]) else ():
                start[half] = newton(function, start[half], chosen, system.nominal)
            if run.started(start).sides == sides:
                break  # otherwise guesses have left the sides of kinks under which they were solved for
        residual, jacobian = function(start[half])
        size = np.maximum(np.abs(jacobian).max(axis=1, initial=0.0), 1e-300)
        if np.max(np.abs(residual) / size, initial=0.0) > 1e-9 * max(1.0, float(np.abs(start[half]).max())):
            raise SimulationError(f"the constraints cannot be met from the start values; residuals: {residual}")
    return start
