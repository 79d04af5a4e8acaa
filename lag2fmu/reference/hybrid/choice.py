"""The choice of modes: which contacts open, close, stick or slide, so that accelerations and forces obey the laws."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from lag2fmu.reference.hybrid.elements import Elements
from lag2fmu.reference.hybrid.laws import CLOSED, PLANES, Item, Outcome, apart, is_held
from lag2fmu.reference.hybrid.loads import giving_way
from lag2fmu.reference.hybrid.measures import (
    BACK,
    SLOW_SLIP,
    STILL,
    force_sizes,
    is_free,
    pace,
    rest_speeds,
    slips_of,
    touching,
    velocity_sizes,
)
from lag2fmu.reference.hybrid.modes import Due, Memory, Mode, Modes
from lag2fmu.reference.hybrid.records import MotionPoint, Responses
from lag2fmu.reference.hybrid.search import decided
from lag2fmu.reference.hybrid.sharing import evenly, shared
from lag2fmu.reference.hybrid.system import HybridSystem
from lag2fmu.reference.state import Floats, StateBatch

SLIP_ENDS = 1e3
"""In units of the velocity that counts as zero: the most that a slip in space may have left where it ends."""
DRIVEN = 1e-9
"""Relative to the accelerations that all forces make: a greater one along a row drives it, and tells how it goes on."""
BEARS = 1e-9
"""Relative to the forces that act: a contact that comes to rest in an impact and bears more is under load."""

WithoutCollision = Callable[[MotionPoint, Modes, Sequence[int]], tuple[StateBatch, float]]


class ModeChoice:
    """Chooses the modes of a ``system`` during a run.

    Where no modes obey the laws, ``without_collision`` first makes an impact from (point, modes, contacts). It returns
    the state behind the impact and the energy that is lost (J). What is slow goes by the relative tolerance ``rtol``.
    """

    def __init__(self, system: HybridSystem, memory: Memory, without_collision: WithoutCollision, rtol: float) -> None:
        self.system, self.memory, self.without_collision = system, memory, without_collision
        self.slow = SLOW_SLIP * float(np.sqrt(rtol))

    def chosen(self, state: StateBatch, modes: Modes, due: Due) -> tuple[StateBatch, Modes, Floats]:
        """The state, the modes of contacts and frictions that obey the laws, and (work, dissipated energy), (2,) in J.

        Where no modes obey the laws at once, an impact is made first: the state then is that behind the impact, and the
        energies are those of the impact. Raises SimulationError where no modes meet the laws behind an impact either.
        Source: F. Pfeiffer, Ch. Glocker, Multibody Dynamics with Unilateral Contacts, Wiley 1996, chapter 5.
        """
        system, energies = self.system, np.zeros(2)
        if not system.elements.k:
            return state, modes, energies
        for _ in range(3):
            point = system.point(state)
            responses, v, sizes = system.responses(point, modes), point.rows.velocities, velocity_sizes(point)
            candidates = [i for i in touching(point, modes, due, responses.D) if v[i] < STILL * sizes[i]]
            found = self._problem(point, modes, due, responses, candidates)
            if found is not None:
                return state, self._named(modes, candidates, found, point), energies
            state, lost = self.without_collision(point, modes, candidates)
            energies[1] += lost
        raise system.stops(state.t, "no modes of the contacts meet the laws")

    def bearing(self, point: MotionPoint, modes: Modes, contacts: Sequence[int]) -> list[int]:
        """Which of the ``contacts``, which touch at rest, bear a force; none where no forces meet the laws."""
        found = self._problem(point, modes, frozenset(), self.system.responses(point, modes), contacts)
        if found is None:
            return []
        first = np.cumsum([0, *(1 + len(slips_of(point, i)) for i in contacts)])
        return [i for i, at in zip(contacts, first, strict=False) if found.forces[at] > BEARS * force_sizes(point)[i]]

    def _problem(
        self, point: MotionPoint, modes: Modes, due: Due, responses: Responses, contacts: Sequence[int]
    ) -> Outcome | None:
        """The outcome of the choice for all frictions and for the ``contacts``, which touch."""
        system, e = self.system, self.system.elements
        D, c = responses.D, responses.c
        v, rests = point.rows.velocities, rest_speeds(point)
        borne = np.zeros(system.constraints.m), np.zeros(e.k)
        present = self._lasting(modes, contacts, due)
        before: tuple[Mode, ...] | None = None
        slips = any(kind == "cone" for kind, _ in due)
        giving = giving_way(point, modes, system.answer(point, modes)) if slips else {}
        modes = self._without_held(modes, D)
        D, driven = _without_fixed(point, D, c)
        resting = np.abs(v) <= rests
        moves, going = ~resting | driven, np.where(resting, c, v)
        for _ in range(100):  # the capacities of frictions may depend on the forces that result
            items = [self._touching_item(point, i, modes, due, rests, giving.get(i)) for i in contacts]
            if e.f:
                items += self._friction_items(due, moves, going, *_capacities(e, point, responses, borne))
            rows, moved = apart(items)
            found = decided(D[np.ix_(rows, rows)], c[rows], moved, pace(point), present)
            if found is not None:
                found = shared(D[np.ix_(rows, rows)], c[rows], moved, found, pace(point))
                begins = [j for j, i in enumerate(contacts) if i in giving]
                found = evenly(D[np.ix_(rows, rows)], c[rows], moved, found, pace(point), begins)
            if found is None or not e.load_dependent:
                return found
            forces = np.zeros(e.k)
            forces[rows] = found.forces
            new = responses.borne(forces)
            change = np.abs(np.concatenate(new) - np.concatenate(borne)).max(initial=0.0)
            borne = new
            if found.modes == before and change <= 1e-12 * max(1e-300, np.abs(np.concatenate(borne)).max(initial=0.0)):
                return found
            before = found.modes
        return found

    def _without_held(self, modes: Modes, D: Floats) -> Modes:
        """The ``modes`` in which what feet that stick hold at rest is no slow slip any more; D is (k, k)."""
        bound, slips = [*chain(*self.system.bound_rows(modes))], self.system.elements.slip_rows
        held = {i for i in modes.steadied if all(is_held(D, bound, row) for row in slips[i])}
        return replace(modes, steadied={i: speed for i, speed in modes.steadied.items() if i not in held})

    @staticmethod
    def _lasting(modes: Modes, contacts: Sequence[int], due: Due) -> list[Mode | None]:
        """The present modes of contacts and frictions that go on if they can; None where an event function is due."""
        found: list[Mode | None] = []
        for i in contacts:
            ends = {kind for kind, j in due if i == j and kind in ("gap", "cone", "slip")}
            found.append(Mode.OPEN if ("force", i) in due else None if ends else modes.contacts[i])
        return found + [
            None if {("friction", j), ("hold", j)} & due else mode for j, mode in enumerate(modes.frictions)
        ]

    def _touching_item(
        self, point: MotionPoint, i: int, modes: Modes, due: Due, rests: Floats, gives: tuple[float, ...] | None
    ) -> Item:
        """The item of the contact ``i``, which touches: its present mode comes first, unless this mode has ended.

        Where it ``gives`` way, it slides in this direction with friction at its limit. The event may be located early,
        with loads that are still within the limit: they do not turn the slip back.
        """
        rows, slips = point.rows, slips_of(point, i)
        if not (np.isfinite(rows.friction[i]) and np.isfinite(rows.static[i])):
            name = self.system.elements.contacts[i]
            raise self.system.stops(point.state.t, f"the coefficient of friction of '{name}' is not finite")
        direction = self._going_on(point, i, modes, slips, rests, due) or gives
        closed: tuple[Mode, ...] = PLANES[len(slips)]
        if direction is not None:
            closed = (Mode.SLIDES,) if len(slips) == 2 else (Mode.FORWARD if direction[0] > 0 else Mode.BACKWARD,)
        elif ("cone", i) in due:
            closed = tuple(mode for mode in closed if mode is not Mode.STICKS)
        options = (Mode.OPEN, *closed) if ("force", i) in due else (*closed, Mode.OPEN)
        return Item(options, i, slips, float(rows.friction[i]), float(rows.static[i]), 0.0, direction)

    def _going_on(
        self, point: MotionPoint, i: int, modes: Modes, slips: tuple[int, ...], rests: Floats, due: Due
    ) -> tuple[float, ...] | None:
        """The direction of the slip of contact ``i``; None where it is at rest.

        A slip in space ends where a direction is located that errors may have turned. Feet of a body come to rest
        together: one that went on, as slow as errors are, would turn it about those that stick.
        """
        rows = list(slips)
        slip, still = point.rows.velocities[rows], rests[rows]
        ends = len(rows) == 2 and any(kind == "slip" and len(point.rows.slip_rows[j]) == 2 for kind, j in due)
        if ends:
            slow = 2 * BACK * self.slow * float(velocity_sizes(point)[rows].max())
            still = np.maximum(slow, SLIP_ENDS * still)
        rested = bool((np.abs(slip) <= still).all())
        lasts = i in modes.steadied and modes.contacts[i] is Mode.SLIDES and ("slip", i) not in due
        if lasts and not (ends and rested):
            return modes.directions[i]
        return None if rested else tuple(slip / np.hypot.reduce(slip))

    def _friction_items(
        self, due: Due, moves: NDArray[np.bool_], going: Floats, force: Floats, static: Floats, bears: Floats | None
    ) -> list[Item]:
        """The items of dry frictions, which slide as ``going`` (k,) says where a row ``moves`` (k,); bears (2, f, k).

        What gives way takes the same direction first: a load of 0 that grows tells no other one.
        """
        items = []
        for j, row in enumerate(self.system.elements.friction_rows):
            r, sense = int(row), float(np.sign(going[row]))
            moving = bool(moves[row])
            direction = (sense,) if moving else None
            options: tuple[Mode, ...] = CLOSED
            ways = (Mode.BACKWARD, Mode.FORWARD) if sense < 0 else (Mode.FORWARD, Mode.BACKWARD)
            if moving:
                options = ways[:1]
            elif ("hold", j) in due:
                options = ways
            slopes = None if bears is None else bears[:, j]
            items.append(Item(options, None, (r,), float(force[j]), float(static[j]), 0.0, direction, slopes))
        return items

    def _named(self, modes: Modes, contacts: Sequence[int], found: Outcome, point: MotionPoint) -> Modes:
        """The ``modes`` with what was ``found`` for the ``contacts`` that touch, and for all frictions."""
        e, t = self.system.elements, float(point.state.t)
        chosen = [Mode.OPEN] * e.u
        directions, steadied = {}, {}
        sizes = velocity_sizes(point)
        for i, mode, direction in zip(contacts, found.modes, found.directions, strict=False):
            chosen[i] = mode
            if direction is not None and mode is Mode.SLIDES:
                directions[i] = direction
                rows = point.rows.slip_rows[i]
                slow = self.slow * float(sizes[rows].max())
                if np.hypot.reduce(point.rows.velocities[rows]) <= slow:
                    steadied[i] = slow
        frictions = found.modes[len(contacts) :]
        for names, old, new in ((e.contacts, modes.contacts, chosen), (e.frictions, modes.frictions, frictions)):
            for name, a, b in zip(names, old, new, strict=True):
                if a is not b:
                    self.memory.log(t, name, _change(a, b))
        return replace(
            modes, contacts=tuple(chosen), frictions=tuple(frictions), directions=directions, steadied=steadied
        )


def _without_fixed(point: MotionPoint, D: Floats, c: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """D (k, k) without rows that no force along them moves, and which of these the motion drives by its c (k,).

    What rounding leaves of such rows is no answer. A slide in its crank's dead centre is one that is driven, and what a
    latch holds beside a friction is one that is not.
    """
    fixed = np.array([not is_free(point, D, row) for row in range(len(c))], dtype=bool)
    lone = np.diag(force_sizes(point) ** -2) * pace(point) ** 2
    return np.where(fixed[:, None] | fixed, lone, D), fixed & (np.abs(c) > DRIVEN * pace(point))


def _capacities(
    e: Elements, point: MotionPoint, responses: Responses, borne: tuple[Floats, Floats]
) -> tuple[Floats, Floats, Floats | None]:
    """The capacities of frictions, (f,) sliding and holding, without forces along rows, and what each adds, (2, f, k).

    They are those where constraints and rows bear what is ``borne``; None: they do not depend on that, or it is not
    known yet.
    """
    if not e.load_dependent or not np.concatenate(borne).any():
        return (*e.capacities(point.state, *borne), None)
    values, slopes = e.capacity_slopes(point.state, *borne)
    free, *units = (np.concatenate(responses.borne(forces)) for forces in (np.zeros(e.k), *np.eye(e.k)))
    force, static = values + slopes @ (free - np.concatenate(borne))
    return force, static, slopes @ (np.transpose(units) - free[:, None])


def _change(old: Mode, new: Mode) -> str:
    """The kind of the event that leads from one mode to another."""
    if new is Mode.OPEN:
        return "opens"
    if old is Mode.OPEN:
        return "closes"
    return "sticks" if new is Mode.STICKS else "slides"
