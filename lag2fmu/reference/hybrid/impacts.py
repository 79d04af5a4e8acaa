"""Impacts: M (qd+ - qd-) = J^T P with Newton's law along normals and Coulomb's between impulses.

Sequential impacts come in rounds. In a round those contacts take part that approach; of contacts at rest, those that
bear a force at the velocities of that moment; and those that a round has stopped without restitution, if no contact
with restitution approaches. The contacts that a round makes approach are the next round. Simultaneous
impacts are one problem over all contacts that touch. A round that would gain energy is made again by Poisson's law: the
normal impulse of expansion is restitution times that of compression. Source: F. Pfeiffer, Ch. Glocker, Multibody
Dynamics with Unilateral Contacts, Wiley 1996, chapter 8.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

import numpy as np

from lag2fmu.reference.hybrid.laws import PLANES, Item, apart
from lag2fmu.reference.hybrid.measures import (
    STILL,
    energies_of_jump,
    force_sizes,
    is_free,
    slips_of,
    touching,
    velocity_sizes,
)
from lag2fmu.reference.hybrid.modes import Due, Memory, Mode, Modes
from lag2fmu.reference.hybrid.projections import projected
from lag2fmu.reference.hybrid.records import MotionPoint
from lag2fmu.reference.hybrid.search import all_outcomes, decided
from lag2fmu.reference.hybrid.system import HybridSystem
from lag2fmu.reference.state import Floats, StateBatch

LOADED = 1e-9
"""Relative to the forces or impulses that act: a contact that bears more is under load."""
BALANCED = 1e-10
"""Relative to the greatest answer: impulses whose answer is smaller balance each other."""
ROUNDS = 2000
"""The most rounds of an impact; the last one is plastic, with all contacts that are near."""

Bearing = Callable[[MotionPoint, Modes, Sequence[int]], Collection[int]]
"""Which of these contacts, which touch at rest, bear a force."""


class Impacts:
    """The impacts of a ``system`` during a run; ``memory`` counts them."""

    def __init__(self, system: HybridSystem, memory: Memory) -> None:
        self.system, self.memory = system, memory
        self.simultaneous = system.mechanism.impacts == "simultaneous"

    def resolved(
        self, state: StateBatch, modes: Modes, due: Due, catching: bool, bearing: Bearing
    ) -> tuple[StateBatch, Floats, bool]:
        """The state behind all rounds of impacts, (work, dissipated energy), (2,) in J, and whether there was a round.

        ``catching``: latches and constraints take part in a first round, without rebound. ``bearing`` tells what bears
        a force between rounds. Raises SimulationError where no impulses meet the laws of impact. Source: F. Pfeiffer,
        Ch. Glocker, Multibody Dynamics with Unilateral Contacts, Wiley 1996, chapter 8.
        """
        system, e = self.system, self.system.elements
        if not e.u and not catching:
            return state, np.zeros(2), False
        point = system.point(state)
        responses = system.responses(point, modes)
        D, v = responses.D, point.rows.velocities
        near = touching(point, modes, due, D)
        loaded = [i for i in self._loaded(point, modes) if is_free(point, D, i)]
        lost, total, qd = 0.0, np.zeros(e.k), state.qd
        if catching:
            total = self._round(D, responses.caught, loaded, dict.fromkeys(loaded, 0.0), point)[0]
            behind = responses.caught + D @ total
            lost = -0.5 * float(responses.borne(total, jump=True)[1] @ (v + behind))
            v, qd = behind, qd + responses.moved[:, 1]

        def behind_all(impulses: Floats) -> MotionPoint:
            return system.point(StateBatch(state.t, state.q, qd + responses.moved[:, 2:] @ impulses, state.inputs))

        def returned(impulses: Floats) -> Floats:
            return (point if e.returns_alike else behind_all(impulses)).rows.restitution

        def pressed(impulses: Floats, contacts: Sequence[int]) -> Collection[int]:
            return bearing(behind_all(impulses), modes, contacts)

        starts = not due and all(mode is Mode.OPEN for mode in modes.contacts)
        asked = {*near} if starts else set()
        total, dissipated, struck = self._rounds(D, v, total, near, loaded, asked, point, returned, pressed)
        qd = qd + responses.moved[:, 2:] @ total
        if not struck and not catching:
            return state, np.zeros(2), False
        self._count(total, D, point)
        return StateBatch(state.t, state.q, qd, state.inputs), energies_of_jump(point, qd, lost + dissipated), True

    def _count(self, impulses: Floats, D: Floats, point: MotionPoint) -> None:
        """Count an impact of each contact with a part in the ``impulses`` (k,); D is (k, k).

        Where no impulse changes a velocity, all of them are rounding.
        """
        u, sizes = self.system.elements.u, velocity_sizes(point)
        shows = impulses[:u] * np.diagonal(D)[:u] > STILL * sizes[:u]
        struck = shows & (impulses[:u] > LOADED * np.abs(impulses).max(initial=0.0))
        for i in np.flatnonzero(struck).tolist():
            self.memory.impacts[i] += 1
            self.memory.impulses[i] = impulses[i]

    def _rounds(
        self,
        D: Floats,
        v: Floats,
        total: Floats,
        near: Sequence[int],
        loaded: list[int],
        asked: set[int],
        point: MotionPoint,
        returned: Callable[[Floats], Floats],
        pressed: Callable[[Floats, Sequence[int]], Collection[int]],
    ) -> tuple[Floats, float, bool]:
        """The sum of all impulses (k,), the energy (J) that the rounds dissipate, and whether there was a round.

        Rounds are made until no contact that is ``near`` approaches. ``total`` (k,) are the impulses before.
        ``returned`` tells the restitution behind all impulses, ``pressed`` which contacts bear a force there; of those
        ``asked`` it is not known at first.
        """
        lost, time = 0.0, float(point.state.t)
        sizes = velocity_sizes(point)
        for turn in range(ROUNDS):
            approaching = [i for i in near if v[i] < -STILL * sizes[i]]
            if not approaching:
                return total, lost, turn > 0
            still = [i for i in near if abs(v[i]) <= STILL * sizes[i]]
            if {*still} & asked - {*loaded}:
                loaded = [*loaded, *pressed(total, still)]
            plastic = turn == ROUNDS - 1
            restitution = returned(total)
            borne = {*still} & {*loaded, *_joining(still, total, restitution, approaching)}
            took_part = near if self.simultaneous or plastic else sorted({*approaching, *borne})
            rebounding = [] if plastic else approaching
            shifts = dict.fromkeys(took_part, 0.0) | {i: restitution[i] * v[i] for i in rebounding}
            P, kind = self._round(D, v, took_part, shifts, point)
            self._log(time, approaching, P, kind, _sharing(D, took_part, point), plastic=plastic)
            lost -= 0.5 * float(P @ (2 * v + D @ P))
            v, total, asked = v + D @ P, total + P, {*np.flatnonzero(P[: len(sizes)] > 0)}
        return total, lost, True

    def _log(
        self, time: float, approaching: Sequence[int], P: Floats, kind: str, shares: Sequence[int], *, plastic: bool
    ) -> None:
        """Remember a round at ``time`` (s): impulses P (k,), contacts ``approaching``, and its ``kind`` unless "".

        Of the impulses of contacts in ``shares`` only sums are known.
        """
        contacts = self.system.elements.contacts
        for i in approaching:
            self.memory.log(time, contacts[i], "impact", float(P[i]))
        if kind or plastic:
            self.memory.log(time, contacts[approaching[0]], kind or "plastic")
        for i in shares:
            self.memory.log(time, contacts[i], "shares")

    def _round(
        self, D: Floats, v: Floats, part: Sequence[int], shifts: dict[int, float], point: MotionPoint
    ) -> tuple[Floats, str]:
        """The impulses (k,) of one round and the kind of its event.

        They obey Newton's law; Poisson's, if Newton's would gain energy.
        """
        items = [impact_item(point, i, shifts[i]) for i in part]
        P = self._impulses(D, v, items)
        if P is not None and not self._gains(D, v, P):
            return P, ""
        return self._by_poisson(D, v, items, part, point), "poisson"

    @staticmethod
    def _gains(D: Floats, v: Floats, P: Floats) -> bool:
        """Whether the impulses P (k,) make the kinetic energy grow."""
        after = v + D @ P
        return float(P @ (v + after)) > 1e-12 * float(np.abs(P) @ (np.abs(v) + np.abs(after)))

    def _by_poisson(
        self, D: Floats, v: Floats, items: Sequence[Item], part: Sequence[int], point: MotionPoint
    ) -> Floats:
        """The impulses (k,) of compression and expansion together, by Poisson's law.

        Of the expansion, the greatest share is taken that gains no energy. Raises SimulationError where no impulses
        meet the laws of impact.
        """
        plastic = [replace(item, shift=0.0) for item in items]
        pressed = self._impulses(D, v, plastic)
        if pressed is not None:
            returned = [
                item.shift / v[i] * pressed[i] if item.shift else 0.0 for i, item in zip(part, items, strict=True)
            ]
            rows, moved = apart(plastic)
            after = v + D @ pressed
            found = projected(D[np.ix_(rows, rows)], after[rows], moved, 0.0, returned)
            if found is not None:
                back = np.zeros(len(v))
                back[rows] = found.forces
                # 2 T changes by -lost + 2 share slope + share^2 bend
                lost, slope, bend = (float(x) for x in (-pressed @ (v + after), back @ after, back @ D @ back))
                beyond = slope + math.sqrt(max(0.0, slope**2 + bend * lost))
                share = min(1.0, lost / beyond) if beyond > 0 else 1.0
                return np.asarray(pressed + share * back)
        where = ", ".join(self.system.elements.contacts[i] for i in part)
        raise self.system.stops(point.state.t, f"no impulses meet the laws of impact at {where}")

    def _impulses(self, D: Floats, v: Floats, items: Sequence[Item]) -> Floats | None:
        """The impulses (k,) of ``items``, 0 in rows that take no part; None if none meet the laws."""
        rows, moved = apart(items)
        found = decided(D[np.ix_(rows, rows)], v[rows], moved, 0.0)
        if found is None:
            return None
        P = np.zeros(len(v))
        P[rows] = found.forces
        return P

    def _loaded(self, point: MotionPoint, modes: Modes) -> list[int]:
        """The contacts that bear a force in the present ``modes``."""
        closed = [i for i, mode in enumerate(modes.contacts) if mode is not Mode.OPEN]
        if not closed:
            return []
        forces = self.system.answer(point, modes).forces
        sizes = force_sizes(point)
        return [i for i in closed if forces[i] > LOADED * sizes[i]]

    def without_collision(self, point: MotionPoint, modes: Modes, contacts: Sequence[int]) -> tuple[StateBatch, float]:
        """The state behind an impact without collision, and the energy lost (J).

        It is made where no accelerations meet the laws. Raises SimulationError where no such impact meets them either.
        Source: F. Pfeiffer, Ch. Glocker, Multibody Dynamics with Unilateral Contacts, Wiley 1996, chapter 8.
        """
        system, e = self.system, self.system.elements
        responses = system.responses(point, modes)
        D, v = responses.D, point.rows.velocities
        rows, moved = apart([impact_item(point, i, 0.0) for i in contacts])
        momentum = point.terms.mass_matrix @ point.state.qd
        pace = float(np.sqrt(max(0.0, float(momentum @ point.state.qd))))
        outcomes = all_outcomes(D[np.ix_(rows, rows)], v[rows], moved, pace)
        P = np.zeros(e.k)
        if outcomes:
            P[rows] = max(outcomes, key=lambda o: float(np.abs(o.forces).sum())).forces
        if not P.any():
            where = ", ".join(e.contacts[i] for i in contacts)
            none = f"neither accelerations nor an impact meet the laws of contact at {where}"
            raise system.stops(point.state.t, none if where else "no accelerations meet the laws of dry friction")
        self._count(P, D, point)
        for i in contacts:
            self.memory.log(float(point.state.t), e.contacts[i], "painleve", float(P[i]))
        s = point.state
        return StateBatch(s.t, s.q, s.qd + responses.moved[:, 2:] @ P, s.inputs), -0.5 * float(P @ (2 * v + D @ P))


def impact_item(point: MotionPoint, i: int, shift: float) -> Item:
    """The contact ``i`` in an impact; ``shift`` is restitution times its approach."""
    slips, friction = slips_of(point, i), float(point.rows.friction[i])
    return Item((*PLANES[len(slips)], Mode.OPEN), i, slips, friction, friction, shift)


def _joining(still: Sequence[int], impulses: Floats, restitution: Floats, approaching: Sequence[int]) -> list[int]:
    """The contacts that rounds have stopped and that take part though they may bear nothing: plastic impacts go on.

    In turn they would come to the same velocities, in rounds without end.
    """
    together = (impulses[: len(restitution)] > 0) & (restitution == 0) & (not restitution[approaching].any())
    return [i for i in still if together[i]]


def _sharing(D: Floats, part: Sequence[int], point: MotionPoint) -> list[int]:
    """The contacts in this ``part`` whose normal impulses others, with friction, may balance; D is (k, k)."""
    rows = [row for i in part for row in (i, *slips_of(point, i))]
    scale = 1 / np.sqrt(np.maximum(np.diagonal(D)[rows], 1e-300))
    answers, ways = np.linalg.eigh(D[np.ix_(rows, rows)] * np.outer(scale, scale))
    share = np.abs(ways[:, answers <= BALANCED * answers[-1]]).max(axis=1, initial=0.0)
    return [i for i in part if share[rows.index(i)] > math.sqrt(BALANCED)]
