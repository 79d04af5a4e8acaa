"""A run of a hybrid mechanism from event to event; states and modes are kept at the times that were asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.integrate import solve_ivp

from lag2fmu.deadline import OutOfTimeError
from lag2fmu.errors import SimulationError
from lag2fmu.reference.hybrid.choice import ModeChoice
from lag2fmu.reference.hybrid.impacts import Impacts
from lag2fmu.reference.hybrid.measures import SLOW, STILL, TOUCH, accelerations, gap_sizes, touches, velocity_sizes
from lag2fmu.reference.hybrid.modes import Due, Memory, Mode, Modes
from lag2fmu.reference.hybrid.piece import Piece
from lag2fmu.reference.hybrid.records import MotionPoint
from lag2fmu.reference.hybrid.releases import released
from lag2fmu.reference.hybrid.run import LONGEST_PART, HybridRun, Track
from lag2fmu.reference.hybrid.settling import Settling
from lag2fmu.reference.hybrid.stepping import Dense, Stepper
from lag2fmu.reference.state import Floats, StateBatch

STUCK = 200
"""The number of events at one time from which on the motion counts as stuck."""

SOON = 0.03
"""In units of the shortest time in which coordinates or velocities change by their nominal values: how far one looks
ahead to see whether a contact without a load is pressed."""

Enough = Callable[[int, Floats], bool]
"""Whether a run may end at the time of a row, where its states and energies are (s + 2,)."""


class _PartedError(Exception):
    """The run is far from another one; no user sees this error."""


class Follower:
    """Carries out a ``run`` from event to event, by SciPy's ``method`` with the relative tolerance ``rtol``.

    The method has failed after ``most`` evaluations. A slip in space is slow as the tolerance ``finest`` asks for, that
    of the finest run which this one is compared with; by default its own. Rebounds are left out that are lower than
    ``low``, in nominal gaps, or than ``rtol``. Motions that become free get a velocity of their own, as ``released``
    says, which moves no coordinate by more than ``kick`` (n,), in SI units.
    """

    def __init__(
        self,
        run: HybridRun,
        method: str,
        rtol: float,
        most: float,
        finest: float | None = None,
        low: float = 0.0,
        kick: Floats | None = None,
    ) -> None:
        self.run, self.n, system = run, run.n, run.system
        self.memory = Memory([0] * system.elements.u, np.zeros(system.elements.u))
        impacts = Impacts(system, self.memory)
        choice = ModeChoice(system, self.memory, impacts.without_collision, finest or rtol)
        resolved = partial(impacts.resolved, bearing=choice.bearing)
        self.settling = Settling(system, self.memory, max(rtol, low), resolved, choice.chosen)
        weights = np.append(run.nominal, [self._energy_scale()] * 2)
        self.stepper = Stepper(method, rtol, rtol * weights, LONGEST_PART * run.whole, most)
        m, u = len(run.times), system.elements.u
        self.values = np.full((m, run.size + 2), np.nan)
        self.modes: list[Modes | None] = [None] * m
        self.counts, self.impulses, self.since = (np.zeros((m, u)) for _ in range(3))
        self.closings = np.zeros(u)  # counts of impacts when each contact was closed last
        self.enough: Enough | None = None
        self.kick = kick
        self.at_once, self.settled_at = 0, -np.inf  # the number of events at one time, and this time (s)

    def _energy_scale(self) -> float:
        """An energy (J) to weigh the error of work with: T at nominal velocities."""
        system = self.run.system
        q, qd = (np.array([getattr(c, x) for c in system.mechanism.coordinates]) for x in ("start", "velocity"))
        further = [z.start for z in system.mechanism.states]
        state = self.run.state(float(self.run.times[0]), np.concatenate([q, qd, further]))
        scale = float(0.5 * np.abs(np.diagonal(system.equations.terms(state).mass_matrix) * system.nominal**2).sum())
        return scale if scale > 0 else 1.0

    def follow(self, start: Floats, enough: Enough | None = None) -> Track:
        """The run from the states ``start`` (s,), in SI units, to the end or until the time for the work is over.

        It ends earlier where it is ``enough``.
        Raises SimulationError with the time reached, and OutOfTimeError if that is not even the first one.
        """
        self.enough = enough
        try:
            self._follow(start)
        except _PartedError:
            pass
        except OutOfTimeError:
            if self.modes[0] is None:
                raise
        found = [m for m in self.modes if m is not None]
        events = tuple(sorted(self.memory.events, key=lambda event: event.time))
        count, turns = self.stepper.evaluations, tuple(self.memory.turns)
        k = len(found)
        rows = self.values[:k], tuple(found), self.counts[:k], self.impulses[:k], self.since[:k]
        return Track(*rows, events, count, turns)

    def _follow(self, start: Floats) -> None:
        """Remember what the run from ``start`` (s,) reaches."""
        run, times = self.run, self.run.times
        first, last = float(times[0]), float(times[-1])
        breaks = run.signals.breaks
        ends = [*np.unique(breaks[(breaks > first) & (breaks < last)]), last]
        y, t, modes = np.concatenate([start, [0.0, 0.0]]), first, run.started(start)
        due: Due = frozenset()
        for end in ends:
            run.end = end
            y, modes = self._settle(t, y, modes, due)
            while t < end:
                t, y, due = self._piece(t, y, modes, end)
                if t < end or due:
                    y, modes = self._settle(t, y, modes, due)
            due = frozenset()

    def _piece(self, t: float, y: Floats, modes: Modes, end: float) -> tuple[float, Floats, Due]:
        """The motion from ``t`` to the next event or to ``end``: the time reached (s), y there, and what is due."""
        run = self.run
        piece = Piece(run.system, modes, run.inputs, run.damping)

        def wanted(dense: Dense, a: float, b: float) -> None:
            rows = np.flatnonzero((run.times > a) & (run.times <= b))
            for row in rows.tolist():
                self._remember(row, dense(float(run.times[row])), modes)
            if run.progress is not None:
                run.progress((b - float(run.times[0])) / float(run.times[-1] - run.times[0]))

        try:
            return self.stepper.run(piece, t, y, end, self._first_step(t, y, modes), wanted)
        except SimulationError as error:
            raise SimulationError(f"mechanism '{run.system.mechanism.name}' near time {t!r} s: {error}") from None

    def _remember(self, row: int, y: Floats, modes: Modes) -> None:
        self.values[row], self.modes[row] = y, modes
        self.counts[row], self.impulses[row] = self.memory.impacts, self.memory.impulses
        self.since[row] = self.counts[row] - self.closings
        if self.enough is not None and self.enough(row, y):
            raise _PartedError

    def _settle(self, t: float, y: Floats, modes: Modes, due: Due) -> tuple[Floats, Modes]:
        """y and modes behind an event, or at the start of a segment."""
        last = self.memory.events[-1].time if self.memory.events else -np.inf
        self.at_once = self.at_once + 1 if t - self.settled_at <= 1e-13 * max(1.0, abs(t)) else 0
        self.settled_at = t
        if self.at_once > STUCK:
            events = ", ".join(sorted(self._told(kind, i) for kind, i in due))
            raise self.run.system.stops(t, f"events follow without end; last {events or f'at {last!r} s'}")
        logged = len(self.memory.events)
        state = self.run.state(t, y)
        if due:  # what is bound has moved by the errors of the integration alone since the last event: no impact
            state = self.run.system.projected(state, modes)
        state, new, gained = self._settled(state, modes, due, y[2 * self.n :])
        for i, (a, b) in enumerate(zip(modes.contacts, new.contacts, strict=True)):
            if b is not Mode.OPEN and a is Mode.OPEN:
                self.closings[i] = self.memory.impacts[i]
        if new.sides != modes.sides:
            self.memory.turns.append(t)
        state = self._kicked(state, modes, new)
        y = np.concatenate([state.q, state.qd, y[2 * self.n : -2], y[-2:] + gained])
        self._measure_rebounds(state, new, logged)
        for row in np.flatnonzero(self.run.times == t).tolist():
            self._remember(row, y, new)
        return y, new

    def _kicked(self, state: StateBatch, modes: Modes, new: Modes) -> StateBatch:
        """The ``state`` with what a perturbed run gets behind an event that leads from ``modes`` to ``new`` ones."""
        if self.kick is None or state.t <= self.run.times[0]:
            return state
        return released(self.run.system, state, (modes, new), self.kick)

    def _settled(self, state: StateBatch, modes: Modes, due: Due, further: Floats) -> tuple[StateBatch, Modes, Floats]:
        """What ``settled`` finds, where contacts without a load close which the motion presses at once.

        ``further`` (s + 2 - 2n,): further states and energies, which an event leaves as they are.
        """
        state, modes, gained = self.settling.settled(state, modes, due)
        for _ in modes.contacts:
            sinking = self._sinking(state, modes, further)
            if not sinking:
                break
            state, modes, more = self.settling.settled(state, modes, sinking)
            gained = gained + more
        return state, modes, gained

    def _sinking(self, state: StateBatch, modes: Modes, further: Floats) -> Due:
        """Gaps of contacts that touch, open and at rest, which the motion makes negative: their force of 0 grows."""
        run, system, t = self.run, self.run.system, float(state.t)
        point = system.point(state)
        v, sizes = point.rows.velocities, velocity_sizes(point)
        still = [
            i
            for i, mode in enumerate(modes.contacts)
            if mode is Mode.OPEN and touches(point, i) and abs(v[i]) <= STILL * sizes[i]
        ]
        if not still or t >= run.end:
            return frozenset()
        qdd = system.answer(point, modes).qdd
        a = accelerations(point, qdd)
        still = [i for i in still if a[i] == 0]
        if not still:
            return frozenset()
        rates = np.max(np.abs(qdd) / system.nominal), np.max(np.abs(state.qd) / system.nominal) ** 2, SLOW
        soon = min(t + SOON / np.sqrt(max(rates)), run.end)
        piece = Piece(system, modes, run.inputs, run.damping)
        begin = np.concatenate([state.q, state.qd, further])
        there = solve_ivp(piece.slope, (t, soon), begin, method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1]
        later = system.point(run.state(soon, there))
        sunk = later.rows.gaps < point.rows.gaps - TOUCH * gap_sizes(point)
        return frozenset(("gap", i) for i in still if sunk[i])

    def _told(self, kind: str, i: int) -> str:
        """An event function in words: what came to 0, and the element's name."""
        e = self.run.system.elements
        if kind == "side":
            return f"the condition number {i + 1} of an expression"
        if kind == "condition":
            return f"the condition of '{e.latches[i]}'"
        return f"the {kind} of '{e.frictions[i] if kind in ('friction', 'hold') else e.contacts[i]}'"

    def _measure_rebounds(self, state: StateBatch, modes: Modes, logged: int) -> None:
        """Add to the impacts from number ``logged`` on how high they rebound, and how high they lift other contacts.

        Impacts without restitution are left out, for they do not rebound.
        """
        events, system = self.memory.events, self.run.system
        if not any(event.kind == "impact" for event in events[logged:]):
            return
        point = system.point(state)
        a = accelerations(point, system.answer(point, modes).qdd)
        sizes, v = gap_sizes(point), point.rows.velocities
        lift = max((float(v[i] ** 2 / (-2 * a[i]) / sizes[i]) for i in _thrown(point, modes, a)), default=np.inf)
        for j, event in enumerate(events[logged:], logged):
            if event.kind != "impact":
                continue
            i, height, flight = system.elements.contacts.index(event.element), np.inf, 0.0
            closed = modes.contacts[i] is not Mode.OPEN
            if point.rows.restitution[i] > 0 if closed else a[i] < 0:
                height = 0.0 if closed else float(v[i] ** 2 / (-2 * a[i]) / sizes[i])
                flight = 0.0 if closed else float(2 * v[i] / -a[i])
            events[j] = replace(event, height=height, lift=lift, flight=flight)

    def _first_step(self, t: float, y: Floats, modes: Modes) -> float | None:
        """The time (s) to the top of the shortest rebound that begins; None if there is none."""
        system = self.run.system
        if Mode.OPEN not in modes.contacts:
            return None
        point = system.point(self.run.state(t, y))
        a = accelerations(point, system.answer(point, modes).qdd)
        v = point.rows.velocities
        return min((float(v[i] / -a[i]) for i in _thrown(point, modes, a)), default=None)


def _thrown(point: MotionPoint, modes: Modes, a: Floats) -> list[int]:
    """The contacts that begin to open with a speed and come back by the accelerations ``a`` of their gaps, (u,)."""
    v = point.rows.velocities
    return [i for i, mode in enumerate(modes.contacts) if mode is Mode.OPEN and touches(point, i) and v[i] > 0 > a[i]]
