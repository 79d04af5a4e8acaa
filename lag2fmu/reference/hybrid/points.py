"""Accelerations and forces of a hybrid mechanism at given states and modes: a second opinion on what an FMU shows."""

from __future__ import annotations

import numpy as np

from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.hybrid.loads import as_shown
from lag2fmu.reference.hybrid.measures import pace, velocity_sizes
from lag2fmu.reference.hybrid.modes import Mode, Modes
from lag2fmu.reference.hybrid.records import MotionPoint
from lag2fmu.reference.hybrid.settling import ZERO
from lag2fmu.reference.hybrid.system import HybridSystem
from lag2fmu.reference.state import Floats, InputValues, StateBatch

STEADIED = 132.0
"""The FMU steadies slips in space that begin up to 120 times its tolerance, in units of the greatest velocity."""
STEPS = 3.3e-3
"""It steadies them up to what friction changes in three of its fixed steps of 1 ms, if it has such."""

FOREVER = 1e30
"""A speed (m/s) that no slip comes to."""


class Points:
    """Single states of ``mechanism``, with declared parameters."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.system = HybridSystem(mechanism)
        self.force_names = self.system.elements.force_names

    def gap_sizes(self, t: float, q: Floats, qd: Floats, inputs: InputValues | None = None) -> Floats:
        """The nominal size of each gap, (u,) in SI units, see ``measures.gap_sizes``; t in s, q and qd (n,)."""
        system = self.system
        rows = system.elements.rows(system.energies.state(t, q, qd, inputs))
        found: Floats = np.abs(rows.jacobian[: system.elements.u]) @ system.nominal
        return np.where(found > 0, found, 1.0)

    def coefficients(self, t: float, q: Floats, qd: Floats) -> tuple[Floats, Floats]:
        """The coefficients of sliding and of static friction of all contacts, (u,) each; t in s, q and qd (n,)."""
        rows = self.system.elements.rows(self.system.energies.state(t, q, qd))
        return rows.friction, rows.static

    def answer(
        self,
        t: float,
        q: Floats,
        qd: Floats,
        inputs: InputValues | None,
        modes: tuple[list[int], list[int]],
        shown: Floats,
        tolerance: float,
    ) -> tuple[Floats, Floats] | None:
        """qdd (n,) and forces along all rows (k,), in SI units, in the ``modes`` of contacts and frictions.

        A slip in space that errors of a run with this relative ``tolerance`` may turn has the direction of the friction
        in the forces ``shown`` (k,), and loads that the motion does not determine are those nearest to them. None if
        there is no friction, or the state does not tell whether a latch holds.
        """
        state = self.system.energies.state(t, q, qd, inputs)
        contacts, frictions = (tuple(map(Mode, part)) for part in modes)
        sides, held, told = self._sides(state)
        if not told:
            return None
        point = self.system.point(state)
        directions, steadied = self._directions(point, contacts, shown, tolerance)
        if not all(map(any, directions.values())):
            return None
        offsets = (0.0,) * len(held)
        found = Modes(contacts, frictions, held, sides, directions, offsets, steadied)
        answer = as_shown(self.system, point, found, self.system.answer(point, found), shown)
        return answer.qdd, answer.forces

    def _sides(self, state: StateBatch) -> tuple[tuple[int, ...], tuple[bool, ...], bool]:
        """The sides of kinks and which latches hold at ``state``, as their expressions say; whether they say it.

        They do not where a latch holds or not by a margin that is 0, up to rounding.
        """
        e = self.system.elements
        sides = (1,) * e.sides
        for _ in range(e.sides + 1):
            e.set_sides(sides)
            margins, conditions, *_ = e.events(state)
            sides = tuple(1 if margin > 0 else -1 for margin in margins)
        held = tuple(bool(c > 0) for c in conditions)
        told = not any(abs(c) <= ZERO for c in conditions)
        for i in (i for i, margin in enumerate(margins) if abs(margin) <= ZERO and held):
            e.set_sides(tuple(-side if i == k else side for k, side in enumerate(sides)))
            told &= held == tuple(bool(c > 0) for c in e.events(state)[1])
        e.set_sides(sides)
        return sides, held, told

    def _directions(
        self, point: MotionPoint, contacts: tuple[Mode, ...], shown: Floats, tolerance: float
    ) -> tuple[dict[int, tuple[float, ...]], dict[int, float]]:
        """The directions of contacts that slide in space, 0 if unknown, and up to which speed slow ones keep theirs."""
        directions, steadied = {}, {}
        for i, mode in enumerate(contacts):
            rows = point.rows.slip_rows[i]
            if mode is Mode.SLIDES and len(rows) == 2:
                told = point.rows.velocities[rows]
                if np.hypot.reduce(told) <= _slow_speed(point, i, tolerance):
                    told, steadied[i] = -shown[rows], FOREVER
                directions[i] = tuple(told / max(float(np.hypot.reduce(told)), 1e-300))
        return directions, steadied


def _slow_speed(point: MotionPoint, i: int, tolerance: float) -> float:
    """The speed (m/s) below which the slip of contact ``i`` in space may be steadied in a run."""
    greatest = max(1.0, float(np.abs(point.state.qd / point.nominal).max()))
    size = float(velocity_sizes(point)[point.rows.slip_rows[i]].max())
    return max(STEADIED * tolerance * greatest * size, STEPS * pace(point))
