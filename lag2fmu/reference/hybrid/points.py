"""Accelerations and forces of a hybrid mechanism at given states and modes: a second opinion on what an FMU shows."""

from __future__ import annotations

import numpy as np

from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.hybrid.loads import shared
from lag2fmu.reference.hybrid.modes import Mode, Modes
from lag2fmu.reference.hybrid.system import System
from lag2fmu.reference.state import Floats, InputValues, State


class Points:
    """Single states of ``mechanism``, with declared parameters."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.system = System(mechanism)
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
        self, t: float, q: Floats, qd: Floats, inputs: InputValues | None, modes: tuple[list[int], list[int]]
    ) -> tuple[Floats, Floats] | None:
        """qdd (n,) and forces along all rows (k,), in SI units, in the ``modes`` of contacts and frictions.

        None if a contact slides in space with a slip that is too small to have a direction.
        """
        state = self.system.energies.state(t, q, qd, inputs)
        contacts, frictions = (tuple(map(Mode, part)) for part in modes)
        sides, held = self._sides(state)
        directions = self._directions(state, contacts)
        if directions is None:
            return None
        offsets = (0.0,) * len(held)
        found = Modes(contacts, frictions, held, sides, directions, offsets)
        point = self.system.point(state)
        answer = shared(self.system, point, found, self.system.answer(point, found))
        return answer.qdd, answer.forces

    def _sides(self, state: State) -> tuple[tuple[int, ...], tuple[bool, ...]]:
        """The sides of kinks and which latches hold at ``state``, as their expressions say."""
        e = self.system.elements
        sides = (1,) * e.sides
        for _ in range(e.sides + 1):
            e.set_sides(sides)
            margins, conditions, *_ = e.events(state)
            sides = tuple(1 if margin > 0 else -1 for margin in margins)
        return sides, tuple(bool(c > 0) for c in conditions)

    def _directions(self, state: State, contacts: tuple[Mode, ...]) -> dict[int, tuple[float, ...]] | None:
        """The directions of the contacts that slide in space; None if a slip is zero up to rounding."""
        e, found = self.system.elements, {}
        velocities = e.events(state)[3]
        for i, mode in enumerate(contacts):
            slip = velocities[e.slip_rows[i]]
            if mode is Mode.SLIDES and len(slip) == 2:
                if np.hypot.reduce(slip) < 1e-6:
                    return None
                found[i] = tuple(slip / np.hypot.reduce(slip))
        return found
