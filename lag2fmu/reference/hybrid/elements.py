"""Contacts, dry friction, conditions and switches as numbers: gaps, relative velocities, what they do to coordinates.

The rows of a mechanism with u contacts (stops are contacts without friction), f frictions and l latches (constraints
with a condition): the gap of each contact, its slips, one of a contact in the plane and two in space, the relative
velocity of each friction, and the latches. A row has a velocity v = J qd + b and an acceleration J qdd + gamma; a force
r along it has the generalized forces J^T r.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import sympy as sp

from lag2fmu.description import names
from lag2fmu.language.vocabulary import TIME, symbol
from lag2fmu.reference.constraints import accelerations_without_qdd, gradients
from lag2fmu.reference.energies import EnergyFunctions
from lag2fmu.reference.functions import STEP, compiled
from lag2fmu.reference.hybrid.kinks import FrozenComposition
from lag2fmu.reference.state import Floats, State


@dataclass(frozen=True)
class Rows:
    """At one state: gaps (u,), velocities and gamma (k,), J (k, n), and restitution, friction, static friction (u,).

    ``latched`` (l,): the positions of latches that hold positions, 0 of those that hold velocities.
    """

    gaps: Floats
    latched: Floats
    velocities: Floats
    gamma: Floats
    jacobian: Floats
    restitution: Floats
    friction: Floats
    static: Floats


class Elements:
    """The functions of the elements of a mechanism, of the ``energies`` that are composed with frozen kinks."""

    def __init__(self, energies: EnergyFunctions) -> None:
        composition, mechanism = energies.composition, energies.mechanism
        assert isinstance(composition, FrozenComposition)
        self._constants, self.n = energies.constants, energies.n
        unilaterals, frictions = mechanism.unilaterals, mechanism.frictions
        self.contacts = [c.name for c in unilaterals]
        self.frictions = [f.name for f in frictions]
        s, written = composition.symbols, composition.written
        arguments = (TIME, *s.q, *s.qd, *s.inputs, *s.parameters)
        gaps = [written(c.gap) for c in unilaterals]
        slips = [[written(x) for x in c.slips] for c in unilaterals]
        velocities = [*map(composition.rate, gaps), *(x for pair in slips for x in pair)]
        velocities += [written(f.on) for f in frictions]
        held = [written(latch.expression) for latch in mechanism.latches]
        self.holonomic = [latch.holonomic for latch in mechanism.latches]
        velocities += [composition.rate(x) if h else x for h, x in zip(self.holonomic, held, strict=True)]
        positions = [x if h else sp.S.Zero for h, x in zip(self.holonomic, held, strict=True)]
        firsts = len(gaps) + np.cumsum([0, *(len(pair) for pair in slips)])
        self.slip_rows = [np.arange(a, b) for a, b in pairwise(firsts)]
        self.friction_rows = np.arange(firsts[-1], firsts[-1] + len(frictions))
        self.u, self.f, self.k = len(gaps), len(frictions), len(velocities)
        self.latches = [latch.name for latch in mechanism.latches]
        self.latch_rows = list(range(self.k - len(held), self.k))
        gamma = accelerations_without_qdd(composition, velocities)
        laws = [written(x) for c in unilaterals for x in (c.restitution, c.friction, c.static_friction)]
        self._function = compiled(
            arguments, [*gaps, *positions, *velocities, *gamma, *gradients(s.qd, velocities), *laws]
        )
        self.sides = len(composition.kinks.sides)
        margins = [*composition.kinks.margins, *(written(latch.while_) for latch in mechanism.latches)]
        self._events = compiled(arguments, [*margins, *gaps, *velocities])
        forces = [symbol(names.multiplier(c.name)) for c in mechanism.constraints]
        forces += [symbol(name) for name in self.force_names]
        capacities = [written(x) for f in frictions for x in (f.force, f.force if f.static is None else f.static)]
        self.load_dependent = any(x.free_symbols & set(forces) for x in capacities)
        self._capacities = compiled(
            (*arguments[: len(arguments) - len(s.parameters)], *forces, *s.parameters), capacities
        )
        qdd = [symbol(names.acceleration(c.name)) for c in mechanism.coordinates]
        self.f_states = len(composition.further)
        of_states = (*arguments[: len(arguments) - len(s.parameters)], *qdd, *forces, *s.parameters)
        self._further = compiled(of_states, composition.further)
        self._damping = compiled(arguments, [composition.damper_power()])
        self._first_side = len(energies.constants) - self.sides

    @property
    def force_names(self) -> list[str]:
        """What the forces along the rows are called, (k,)."""
        slips = (names.frictions(c, len(rows)) for c, rows in zip(self.contacts, self.slip_rows, strict=True))
        found = [*map(names.force, self.contacts), *(name for pair in slips for name in pair)]
        return [*found, *map(names.force, self.frictions), *map(names.multiplier, self.latches)]

    def set_sides(self, sides: tuple[int, ...]) -> None:
        """Freeze the kinks on these ``sides``, +1 or -1 each."""
        for i, side in enumerate(sides):
            self._constants[self._first_side + i] = np.float64(side)

    def rows(self, state: State) -> Rows:
        """Everything about the rows at a single ``state``."""
        values = self._function(state.rows, self._constants)
        u, k = self.u, self.k
        parts = np.split(values, np.cumsum([u, len(self.latches), k, k, k * self.n]))
        gaps, latched, velocities, gamma, jacobian, laws = parts
        restitution, friction, static = laws.reshape(u, 3).T
        return Rows(gaps, latched, velocities, gamma, jacobian.reshape(k, self.n), restitution, friction, static)

    def events(self, state: State) -> tuple[Floats, Floats, Floats, Floats]:
        """Margins of kinks, conditions, gaps and velocities of rows, at a batch of states: (count, *batch) each."""
        values = self._events(state.rows, self._constants)
        c = self.sides + len(self.latches)
        return values[: self.sides], values[self.sides : c], values[c : c + self.u], values[c + self.u :]

    def further(self, state: State, qdd: Floats, multipliers: Floats, forces: Floats) -> Floats:
        """The derivatives of the further states, (f,), where constraints (m,) and rows (k,) bear these forces."""
        if not self.f_states:
            return np.zeros(0)
        return self._further(np.concatenate([state.rows, qdd, multipliers, forces]), self._constants)

    def damper_power(self, state: State) -> float:
        """What dampers with a law of force dissipate, in W."""
        return float(self._damping(state.rows, self._constants)[0])

    def capacities(self, state: State, multipliers: Floats, forces: Floats) -> tuple[Floats, Floats]:
        """Sliding and largest holding forces of frictions (f,) where constraints (m,) and rows (k,) bear these."""
        rows = np.concatenate([state.rows, multipliers, forces])
        values = self._capacities(rows, self._constants).reshape(self.f, 2)
        return values[:, 0], values[:, 1]

    def capacity_slopes(self, state: State, multipliers: Floats, forces: Floats) -> tuple[Floats, Floats]:
        """The sliding forces (f,), and their derivatives to all multipliers and forces along rows (f, m + k)."""
        borne = np.concatenate([multipliers, forces])
        batch = np.concatenate([state.rows, borne])[:, None] + np.zeros((1, len(borne) + 1), complex)
        batch[len(state.rows) :, 1:] += 1j * STEP * np.eye(len(borne))
        values = self._capacities(batch, self._constants)[::2]
        return values[:, 0].real, values[:, 1:].imag / STEP
