"""What happens at an event: switches, conditions, impacts and new modes, in rounds until nothing changes any more."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from lag2fmu.reference.hybrid.laws import LATE
from lag2fmu.reference.hybrid.measures import STILL, accelerations, energies_of_jump, gap_sizes, touches, velocity_sizes
from lag2fmu.reference.hybrid.modes import SENSE, Due, Memory, Mode, Modes
from lag2fmu.reference.hybrid.records import MotionPoint
from lag2fmu.reference.hybrid.system import HybridSystem
from lag2fmu.reference.state import Floats, StateBatch

PASSES = 200
"""Impacts that hand a motion on to each other halve it in four rounds or so, down to rounding."""
ZERO = 1e-12
"""Margins of kinks and conditions whose size is at most this do not tell their side."""

LOW = 1e-11
"""In nominal gaps: a rebound that is lower ends a cascade of impacts."""
JUMP = 1e-6
"""In nominal gaps: a gap that comes to differ from 0 by more has jumped; a kink makes less of it."""

Resolved = Callable[[StateBatch, Modes, Due, bool], tuple[StateBatch, Floats, bool]]
Chosen = Callable[[StateBatch, Modes, Due], tuple[StateBatch, Modes, Floats]]


class Settling:
    """Events of a ``system`` during a run; heights of rebound below ``rtol`` (of nominal gaps) end a cascade.

    ``resolved`` makes impacts and ``chosen`` chooses modes, see ``Impacts`` and ``ModeChoice``.
    """

    def __init__(self, system: HybridSystem, memory: Memory, rtol: float, resolved: Resolved, chosen: Chosen) -> None:
        self.system, self.memory, self.low = system, memory, max(LOW, rtol)
        self.resolved, self.chosen = resolved, chosen
        self.returned: dict[int, float] = {}  # {contact: the part of its velocity that Poisson's law returned}

    def settled(self, state: StateBatch, modes: Modes, due: Due) -> tuple[StateBatch, Modes, Floats]:
        """The state and modes behind an event at a single ``state``, and (work, dissipated energy) of impacts, in J.

        ``due`` are the event functions that came to zero, as (kind, index). Kinds are side, condition, gap, force,
        cone, slip, friction. Raises SimulationError where modes change without end.
        """
        energies = np.zeros(2)
        turned = frozenset(label for label in due if label[0] in ("side", "condition"))
        state, known = self._at_rest(state, modes, due), modes.sides
        for _ in range(PASSES):
            before = modes
            modes, bilateral = self._switched(state, modes, due, turned)
            if modes.sides != known:
                modes, known = self._left(state, modes), modes.sides
                bilateral = bilateral or self.system.constraints.m > 0  # they may have a corner there
            margins = self._margins(state)
            begun, logged = state, len(self.memory.events)
            state, gained, struck = self.resolved(state, modes, due, bilateral)
            self._note_returned(begun, state, logged)
            energies = energies + gained
            due = due | _stopped(modes, struck=struck)
            if struck:  # forces behind it are those of its velocities
                turned = self._unmoved(turned, margins, state)
                modes = replace(modes, sides=self._sides(state, modes, frozenset(), turned)[0])
            for step in (self.chosen, self._rested):
                state, modes, gained = step(state, modes, due)
                energies = energies + gained
            if any(kind == "slip" and before.contacts[i] is Mode.SLIDES for kind, i in due):
                state = self.system.projected(state, modes)  # what is left of a slip in space is no velocity
            due = _opening(due, struck=struck)
            if before == modes and not struck:
                return self.system.projected(state, modes), modes, energies
        raise self.system.stops(state.t, "the modes of contacts and switches do not come to rest")

    def _margins(self, state: StateBatch) -> dict[tuple[str, int], float]:
        """The margins of sides and conditions at ``state`` by their labels."""
        margins, conditions, *_ = self.system.elements.events(state)
        sides = {("side", i): float(margin) for i, margin in enumerate(margins)}
        return sides | {("condition", j): float(value) for j, value in enumerate(conditions)}

    def _unmoved(self, turned: Due, margins: Mapping[tuple[str, int], float], state: StateBatch) -> Due:
        """Those of ``turned`` whose ``margins`` an impact has not moved: they do not know of velocities."""
        moved = self._margins(state)
        return frozenset(label for label in turned if moved[label] == margins[label])

    def _at_rest(self, state: StateBatch, modes: Modes, due: Due) -> StateBatch:
        """The ``state`` without what the errors of a step have left of slips along lines that have come to zero.

        Rows that move with these are at rest then as well. A slip that is zero by its lever leaves nothing.
        """
        contacts, frictions = list(modes.contacts), list(modes.frictions)
        for kind, i in due:
            if kind == "friction":
                frictions[i] = Mode.STICKS
            elif kind == "slip" and contacts[i] in SENSE:
                contacts[i] = Mode.STICKS
        still = replace(modes, contacts=tuple(contacts), frictions=tuple(frictions))
        if still == modes:
            return state
        found = self.system.projected(state, still)
        size = np.maximum(self.system.nominal, np.abs(state.qd))
        return found if (np.abs(found.qd - state.qd) <= LATE * size).all() else state

    def _switched(self, state: StateBatch, modes: Modes, due: Due, turned: Due) -> tuple[Modes, bool]:
        """``modes`` with the sides of kinks and the latches that hold at ``state``; whether a latch begins to hold.

        What is in ``turned`` comes from the event itself: a steep margin may be beyond ZERO at the time nearest to its
        root.
        """
        e = self.system.elements
        sides, conditions = self._sides(state, modes, due, turned)
        held, offsets = list(modes.held), list(modes.offsets)
        closes, rows = False, e.rows(state)
        for j, value in enumerate(conditions):
            kept = ("condition", j) in turned or abs(value) <= ZERO
            now = not held[j] if ("condition", j) in due else held[j] if kept else bool(value > 0)
            if now != held[j]:
                self.memory.log(float(state.t), e.latches[j], "holds" if now else "releases")
                closes |= now
                offsets[j] = float(rows.latched[j])
            held[j] = now
        return replace(modes, sides=sides, held=tuple(held), offsets=tuple(offsets)), closes

    def _sides(self, state: StateBatch, modes: Modes, due: Due, turned: Due) -> tuple[tuple[int, ...], Floats]:
        """The sides of kinks at ``state``, where due sides are turned, and the values of conditions, (l,)."""
        e, sides = self.system.elements, list(modes.sides)
        for kind, i in sorted(due):
            if kind == "side":
                sides[i] = -sides[i]
        e.set_sides(tuple(sides))
        for _ in range(len(sides) + 1):  # margins may contain other sides
            margins, conditions, *_ = e.events(state)
            new = [
                side if ("side", i) in turned or abs(margin) <= ZERO else (1 if margin > 0 else -1)
                for i, (side, margin) in enumerate(zip(sides, margins, strict=True))
            ]
            if new == sides:
                break
            sides = new
            e.set_sides(tuple(sides))
        return tuple(sides), conditions

    def _undone(self, point: MotionPoint, modes: Modes, low: list[int], D: Floats) -> Floats:
        """The impulses (k,) that take the velocities of the contacts ``low`` from them at once, D (k, k).

        The floor gave these velocities, and with them its friction: an impulse that is taken back has that of its size.
        From rest to rest friction then has its part of weight times time, and no more. What is bound in the ``modes``
        stays at rest: it has passed these impulses on.
        """
        rows, e = point.rows, self.system.elements
        kept, stuck = self.system.bound_rows(modes)
        bound = [row for row in (*kept, *stuck) if row not in low]
        spread = np.zeros((e.k, len(low) + len(bound)))
        for j, i in enumerate(low):
            slip = rows.velocities[e.slip_rows[i]]
            speed = float(np.linalg.norm(slip))
            spread[i, j] = 1.0
            if speed > STILL * velocity_sizes(point)[i]:
                spread[e.slip_rows[i], j] = -rows.friction[i] * slip / speed
        spread[bound, np.arange(len(low), spread.shape[1])] = 1.0
        change = np.concatenate([-rows.velocities[low], np.zeros(len(bound))])
        taken: Floats = spread @ np.linalg.lstsq((D @ spread)[low + bound], change, rcond=1e-11)[0]
        return taken

    def _left(self, state: StateBatch, modes: Modes) -> Modes:
        """``modes`` without contacts whose gaps have jumped up with a side; raises SimulationError for a jump down."""
        point = self.system.point(state)
        gaps, sizes = point.rows.gaps, gap_sizes(point)
        contacts = list(modes.contacts)
        for i, (gap, size) in enumerate(zip(gaps, sizes, strict=True)):
            if gap < -JUMP * size:
                name = self.system.elements.contacts[i]
                raise self.system.stops(state.t, f"the gap of {name} jumps to {gap:.6g} with a condition in it")
            contacts[i] = Mode.OPEN if gap > JUMP * size else contacts[i]
        return replace(modes, contacts=tuple(contacts))

    def _note_returned(self, begun: StateBatch, state: StateBatch, logged: int) -> None:
        """Note what impacts have ``returned``, events from number ``logged`` on: ``begun`` is before.

        By Poisson's law friction takes a share, so that contacts with a restitution of 1 come to rest, too. A
        restitution that changes tells nothing behind its impact.
        """
        self.returned = {}
        kinds = {event.kind for event in self.memory.events[logged:]}
        if "poisson" in kinds or not self.system.elements.returns_alike:
            before, after = (self.system.elements.rows(x).velocities for x in (begun, state))
            fallen = [i for i in range(self.system.elements.u) if before[i] < 0 < after[i]]
            self.returned = {i: -after[i] / before[i] for i in fallen}

    def _part_of(self, i: int, restitution: float) -> float:
        """What contact ``i`` returns of a velocity, where ``restitution`` is its coefficient behind the impact."""
        part = self.returned.get(i, restitution)
        return min(part, restitution) if self.system.elements.returns_alike else part

    def _rested(self, state: StateBatch, modes: Modes, due: Due) -> tuple[StateBatch, Modes, Floats]:
        """Close contacts that rebound lower than ``low``; the rest of their cascade would last 2 v/(a (1 - e)).

        With e = 1 rebounds do not become lower. They are left out where they are LOW, as no run resolves those.
        """
        system, e = self.system, self.system.elements
        if not e.u:
            return state, modes, np.zeros(2)
        point = system.point(state)
        sizes, gaps = velocity_sizes(point), gap_sizes(point)
        rising = [
            i
            for i in range(e.u)
            if modes.contacts[i] is Mode.OPEN and touches(point, i) and point.rows.velocities[i] >= STILL * sizes[i]
        ]
        if not rising:
            return state, modes, np.zeros(2)
        down = -accelerations(point, system.answer(point, modes).qdd)
        low = []
        for i in rising:
            v, a, restitution = point.rows.velocities[i], down[i], self._part_of(i, float(point.rows.restitution[i]))
            height = self.low if restitution < 1 else LOW
            if a > 0 and v * v < 2 * a * height * gaps[i]:
                low.append(i)
                lasts = 2 * v / (a * (1 - restitution)) if restitution < 1 else 0.0
                self.memory.log(float(state.t) + lasts, e.contacts[i], "closes")
        if not low:
            return state, modes, np.zeros(2)
        responses, v = system.responses(point, modes), point.rows.velocities
        P = self._undone(point, modes, low, responses.D)
        qd = state.qd + responses.moved[:, 2:] @ P
        new = StateBatch(state.t, state.q, qd, state.inputs)
        logged = len(self.memory.events)
        new, modes, _ = self.chosen(new, modes, frozenset(("gap", i) for i in low))
        del self.memory.events[logged:]
        return new, modes, energies_of_jump(point, qd, -0.5 * float(P @ (2 * v + responses.D @ P)))


def _stopped(modes: Modes, *, struck: bool) -> Due:
    """The slips along lines that an impact, where it ``struck``, may have brought to rest: those that slid before."""
    sliding = [("friction", j) for j, mode in enumerate(modes.frictions) if mode in SENSE]
    sliding += [("slip", i) for i, mode in enumerate(modes.contacts) if mode in SENSE]
    return frozenset(sliding if struck else [])


def _opening(due: Due, *, struck: bool) -> Due:
    """The forces that are ``due`` in the next round, too, unless an impact ``struck``.

    At the time that was found for the event they may be above zero by rounding, and would close their contacts again.
    """
    return frozenset() if struck else frozenset(label for label in due if label[0] == "force")
