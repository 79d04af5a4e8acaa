"""Contacts, dry friction, conditions and switches as numbers: gaps, relative velocities, generalized forces.

A mechanism has u contacts (stops are contacts without friction), f frictions and l latches (constraints with a
condition). They make k rows: the gaps of the contacts, their slips (one in the plane, two in space), the relative
velocities of the frictions, and the latches. A row has a velocity v = J qd + b and an acceleration J qdd + gamma; a
force r along it has the generalized forces J^T r.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate, pairwise, zip_longest

import numpy as np
import sympy as sp

from lag2fmu.description import names
from lag2fmu.language.vocabulary import TIME, symbol
from lag2fmu.reference.constraints import accelerations_without_qdd, gradients
from lag2fmu.reference.energies import EnergyFunctions
from lag2fmu.reference.functions import STEP, compiled
from lag2fmu.reference.hybrid.kinks import FrozenComposition
from lag2fmu.reference.hybrid.records import Rows
from lag2fmu.reference.state import Floats, StateBatch

MANY = 64
"""Derivatives of more rows are not written out, which takes SymPy minutes for hundreds, but found by complex steps."""


@dataclass(frozen=True)
class _Rows:
    """The expressions of rows: gaps (u,), slips of each contact, speeds under dry friction (f,), latches (l,)."""

    gaps: list[sp.Expr]
    slips: list[list[sp.Expr]]
    rubbing: list[sp.Expr]
    held: list[sp.Expr]
    holonomic: list[bool]

    @classmethod
    def of(cls, composition: FrozenComposition) -> _Rows:
        """The rows of the mechanism of ``composition``."""
        m, written = composition.mechanism, composition.written
        return cls(
            gaps=[written(c.gap) for c in m.unilaterals],
            slips=[[written(x) for x in c.slips] for c in m.unilaterals],
            rubbing=[written(f.on) for f in m.frictions],
            held=[written(latch.expression) for latch in m.latches],
            holonomic=[latch.holonomic for latch in m.latches],
        )

    def velocities(self, composition: FrozenComposition) -> list[sp.Expr]:
        """The velocities of all rows, (k,): of gaps, slips, dry frictions, latches."""
        approach = map(composition.rate, self.gaps)
        slipping = (x for pair in self.slips for x in pair)
        latched = (composition.rate(x) if h else x for h, x in zip(self.holonomic, self.held, strict=True))
        return [*approach, *slipping, *self.rubbing, *latched]

    def positions(self) -> list[sp.Expr]:
        """The positions that latches hold, (l,): 0 for latches that hold velocities."""
        return [x if h else sp.S.Zero for h, x in zip(self.holonomic, self.held, strict=True)]


class Elements:
    """Contacts, frictions and latches of a mechanism as functions; ``energies`` are made of the ``composition``."""

    def __init__(self, energies: EnergyFunctions, composition: FrozenComposition) -> None:
        mechanism = energies.mechanism
        self._energies, self._constants, self.n = energies, energies.constants, energies.n
        self.contacts = [c.name for c in mechanism.unilaterals]
        self.frictions = [f.name for f in mechanism.frictions]
        self.latches = [latch.name for latch in mechanism.latches]
        rows = _Rows.of(composition)
        velocities = rows.velocities(composition)
        self.holonomic = rows.holonomic
        firsts = len(rows.gaps) + np.cumsum([0, *map(len, rows.slips)])
        self.slip_rows = [np.arange(a, b) for a, b in pairwise(firsts)]
        self.friction_rows = np.arange(firsts[-1], firsts[-1] + len(rows.rubbing))
        self.u, self.f, self.k = len(rows.gaps), len(rows.rubbing), len(velocities)
        self.latch_rows = list(range(self.k - len(rows.held), self.k))
        self.sides = len(composition.kinks.sides)
        self._first_side = len(energies.constants) - self.sides
        self.timed: list[bool] = []  # whether margins and conditions depend on nothing but the time
        self._compile_rows(composition, rows, velocities)
        self._compile_forces(composition)

    def _compile_rows(self, composition: FrozenComposition, rows: _Rows, velocities: list[sp.Expr]) -> None:
        """Compile what depends on the state alone: rows with their laws, margins of events, the power of dampers."""
        s, m, written = composition.symbols, composition.mechanism, composition.written
        arguments = (TIME, *s.q, *s.qd, *s.inputs, *s.parameters)
        laws = [
            x
            for c in m.unilaterals
            for x in (composition.bent(c.restitution), written(c.friction), written(c.static_friction))
        ]
        moving = {*arguments} - set(s.parameters) | set(composition.kinks.sides)
        self.changing = [
            bool(moving & (a.free_symbols | b.free_symbols)) for a, b in zip(laws[1::3], laws[2::3], strict=True)
        ]
        few = velocities if self.k <= MANY else []
        gamma, slopes = accelerations_without_qdd(composition, few), gradients(s.qd, few)
        self.returns_alike = moving.isdisjoint(set().union(*(law.free_symbols for law in laws[::3])))
        self._function = compiled(arguments, [*rows.gaps, *rows.positions(), *velocities, *laws, *gamma, *slopes])
        rates = dict(zip((*s.motion, *s.motion_dot), (*s.motion_dot, *s.motion_ddot), strict=True))
        rates |= dict(zip(s.further, composition.further, strict=False))  # the rates of filters stand behind
        used = set().union(*(x.free_symbols for x in velocities))
        self._input_rates = compiled(arguments, [rates.get(x, sp.S.Zero) if x in used else sp.S.Zero for x in s.inputs])
        margins = [*composition.kinks.margins, *(written(latch.while_) for latch in m.latches)]
        known = {TIME, *s.parameters} - set(composition.kinks.sides)
        for margin, side in zip_longest(margins, composition.kinks.sides):
            self.timed.append(margin.free_symbols <= known)
            known |= {side} if self.timed[-1] else set()
        self._events = compiled(arguments, [*margins, *rows.gaps, *velocities])
        self._damping = compiled(arguments, [composition.damper_power()])

    def _compile_forces(self, composition: FrozenComposition) -> None:
        """Compile what may depend on forces: how much dry friction bears, and the rates of the further states."""
        s, m = composition.symbols, composition.mechanism
        forces = [symbol(names.multiplier(c.name)) for c in m.constraints] + [symbol(x) for x in self.force_names]
        bearing = ((f.force, f.force if f.static is None else f.static) for f in m.frictions)
        capacities = [composition.written(x) for pair in bearing for x in pair]
        self.load_dependent = any(x.free_symbols & set(forces) for x in capacities)
        state = (TIME, *s.q, *s.qd, *s.inputs)
        self._capacities = compiled((*state, *forces, *s.parameters), capacities)
        qdd = [symbol(names.acceleration(c.name)) for c in m.coordinates]
        self.f_states = len(composition.further)
        self._further = compiled((*state, *qdd, *forces, *s.parameters), composition.further)

    @property
    def force_names(self) -> list[str]:
        """The names of the forces along the rows, (k,)."""
        slips = (names.frictions(c, len(rows)) for c, rows in zip(self.contacts, self.slip_rows, strict=True))
        found = [*map(names.force, self.contacts), *(name for pair in slips for name in pair)]
        return [*found, *map(names.force, self.frictions), *map(names.multiplier, self.latches)]

    def set_sides(self, sides: tuple[int, ...]) -> None:
        """Freeze the kinks on these ``sides``, +1 or -1 each."""
        for i, side in enumerate(sides):
            self._constants[self._first_side + i] = np.float64(side)

    def take_sides(self, state: StateBatch) -> tuple[int, ...]:
        """Freeze the kinks on the sides on which a single ``state`` is, and return these."""
        sides = (1,) * self.sides
        for _ in range(self.sides + 1):  # margins may contain other sides
            self.set_sides(sides)
            sides = tuple(1 if margin > 0 else -1 for margin in self.events(state)[0])
        return sides

    def rows(self, state: StateBatch) -> Rows:
        """Everything about the rows at ``state``; a batch of states has its axis last."""
        values, batch = self._function(state.rows, self._constants), state.t.shape
        u, k = self.u, self.k
        ends = [0, *accumulate((u, len(self.latches), k, 3 * u)), len(values)]
        gaps, latched, velocities, laws, rates = (values[a:b] for a, b in pairwise(ends))
        if k <= MANY:
            gamma, slopes = rates[:k], rates[k:].reshape(k, self.n, *batch)
        else:
            gamma, slopes = self._rates_by_steps(state, slice(*ends[2:4]))
        coefficients = laws[::3], laws[1::3], laws[2::3]
        return Rows(
            gaps, latched, velocities, gamma, slopes, *coefficients, self.slip_rows, self.friction_rows, self.changing
        )

    def _rates_by_steps(self, state: StateBatch, velocities: slice) -> tuple[Floats, Floats]:
        """gamma (k, *batch) and J (k, n, *batch) by complex steps: the values ``velocities`` along time, and by qd."""

        def along(direction: Floats) -> Floats:
            values = self._function(state.rows + 1j * STEP * direction, self._constants)
            return np.asarray(values[velocities].imag / STEP)

        n, still = self.n, np.zeros_like(state.qd)
        inputs = self._input_rates(state.rows, self._constants)
        gamma = along(np.concatenate([np.ones_like(state.t)[None], state.qd, still, inputs]))
        slopes = np.empty((self.k, n, *state.t.shape))
        for i in range(n):
            direction = np.zeros_like(state.rows)
            direction[1 + n + i] = 1.0
            slopes[:, i] = along(direction)
        return gamma, slopes

    def events(self, state: StateBatch) -> tuple[Floats, Floats, Floats, Floats]:
        """Margins of kinks, conditions, gaps, velocities of rows at a batch of states: (count, *batch) each, in SI."""
        values = self._events(state.rows, self._constants)
        c = self.sides + len(self.latches)
        return values[: self.sides], values[self.sides : c], values[c : c + self.u], values[c + self.u :]

    def further(self, state: StateBatch, qdd: Floats, multipliers: Floats, forces: Floats) -> Floats:
        """The rates of the further states, (f,), in SI units, with ``multipliers`` (m,) and ``forces`` of rows (k,)."""
        if not self.f_states:
            return np.zeros(0)
        return self._further(np.concatenate([state.rows, qdd, multipliers, forces]), self._constants)

    def damper_power(self, state: StateBatch) -> Floats:
        """The power, in W, that dampers with a law of force dissipate, (*batch,)."""
        found: Floats = self._damping(state.rows, self._constants)[0] + self._energies.resistance_of_frames(state)
        return found

    def capacities(self, state: StateBatch, multipliers: Floats, forces: Floats) -> tuple[Floats, Floats]:
        """The sliding and the largest holding forces of frictions, (f,) each, in N or N.m.

        They may depend on what constraints and rows bear: ``multipliers`` (m,) and ``forces`` (k,).
        """
        rows = np.concatenate([state.rows, multipliers, forces])
        values = self._capacities(rows, self._constants)
        return values[::2], values[1::2]

    def capacity_slopes(self, state: StateBatch, multipliers: Floats, forces: Floats) -> tuple[Floats, Floats]:
        """The ``capacities`` (2, f), and their derivatives by all multipliers and forces along rows (2, f, m + k)."""
        borne = np.concatenate([multipliers, forces])
        batch = np.concatenate([state.rows, borne])[:, None] + np.zeros((1, len(borne) + 1), complex)
        batch[len(state.rows) :, 1:] += 1j * STEP * np.eye(len(borne))
        values = self._capacities(batch, self._constants)
        pairs = np.stack([values[::2], values[1::2]])
        return pairs[:, :, 0].real, pairs[:, :, 1:].imag / STEP
