"""A run of a hybrid mechanism with everything that its laws speak of, at all of its times at once.

The run gives states, accelerations, forces and modes. Masses, forces of nature, gaps, slips and coefficients are
evaluated at its states from the mechanism itself, by ``reference``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lag2fmu.description import names
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.hybrid.system import HybridSystem
from lag2fmu.reference.state import Floats
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.laws.kink_sides import by_sides, part_of, sides_along, tells

SIDED = 1e-9
"""s: two times that are as near are the two sides of an event."""
SMALL = 1e-3
"""Relative to the greatest size, in units of energy: what is smaller may be the rest of a cancellation."""
STILL = 3
"""The communication points in a row at which a force has to break a law: it is then no single step of time stepping."""


def watched(mechanism: Mechanism) -> list[str]:
    """The variables that change at events: modes, and counts of impacts."""
    elements = [*(c.name for c in mechanism.unilaterals), *(f.name for f in mechanism.frictions)]
    return [*map(names.mode, elements), *(names.impacts(c.name) for c in mechanism.unilaterals)]


def needed(mechanism: Mechanism) -> list[str]:
    """The variables of an FMU that the laws speak of."""
    q = [c.name for c in mechanism.coordinates]
    found = [*q, *map(names.velocity, q), *map(names.acceleration, q), *(z.name for z in mechanism.states)]
    for c in mechanism.unilaterals:
        found += [names.gap(c.name), names.force(c.name), *names.frictions(c.name, len(c.slips))]
        found += [names.impulse(c.name)]
    found += [names.force(f.name) for f in mechanism.frictions]
    found += [names.multiplier(c.name) for c in (*mechanism.constraints, *mechanism.latches)]
    return list(dict.fromkeys([*found, *watched(mechanism), names.DISSIPATED_ENERGY, "generalized_energy"]))


class Along:
    """A ``run`` of ``system`` at m times, SI units, time last.

    States: q, qd, qdd (n, m). Equations: ``mass`` (n, n, m), ``forcing`` (n, m), ``G`` and ``multipliers`` of
    constraints (c, n, m), (c, m). Rows (k): ``velocities``, ``slopes`` (k, n, m), ``accelerations``, ``forces``.
    ``gaps``, ``restitution``, ``friction``, ``static`` (u, m); ``sliding`` and ``holding`` (f, m); ``conditions`` of
    latches (l, m). ``moving`` (k + c, m): velocities of rows and constraints where
    coordinates rest. ``power`` (m,), in W, changes generalized and dissipated energy together, ``lost`` the second.
    """

    def __init__(
        self, system: HybridSystem, run: Trajectory, inputs: Mapping[str, Floats], units: Mapping[str, str]
    ) -> None:
        """``inputs`` {name: (m,)} are those that differ from their start values; ``units`` {variable: its unit}."""
        self.system, self.run, self.time, self.units = system, run, run.time, units
        self.e, self.mechanism = system.elements, system.mechanism
        q = [c.name for c in self.mechanism.coordinates]
        kinds = (str, names.velocity, names.acceleration)
        self.q, self.qd, self.qdd = (run.columns([of(name) for name in q]).T for of in kinds)
        others = {**inputs, **{z.name: run[z.name] for z in self.mechanism.states}}
        self.state = system.energies.state(run.time, self.q.T, self.qd.T, others)
        self.forces = run.columns(self.e.force_names).T
        self.multipliers = run.columns([names.multiplier(c.name) for c in self.mechanism.constraints]).T
        self.sides, self.sides_told = sides_along(self.e, self.state)
        self.told = np.asarray(self.sides_told.all(axis=0))
        self._evaluate()

    def _evaluate(self) -> None:
        """Everything at the states of the run, in one batch for each combination of sides of kinks."""
        parts = by_sides(self.e, self.sides, self._evaluated)
        self.mass, self.forcing, self.G, self.moving = parts[:4]
        self.gaps, self.velocities, self.gamma, self.slopes, self.restitution, self.friction, self.static = parts[4:11]
        self.sliding, self.holding, self.power, self.lost, self.conditions = parts[11:]
        self.accelerations = np.einsum("kim,im->km", self.slopes, self.qdd) + self.gamma

    def _evaluated(self, at: NDArray[np.intp]) -> list[Floats]:
        """The arrays of ``_evaluate`` at the times ``at``, on the sides that are set."""
        state, system, e = part_of(self.state, at), self.system, self.e
        qd, forces, multipliers = self.qd[:, at], self.forces[:, at], self.multipliers[:, at]
        terms, rows = system.equations.terms(state), e.rows(state)
        forcing = terms.forces + terms.lagrangian_slope - terms.dissipation_slope - terms.inertial
        _, velocities, _, G = system.constraints(state) if system.constraints.m else (None, qd[:0], None, None)
        G = np.zeros((0, *qd.shape)) if G is None else G
        driven = velocities - np.einsum("kim,im->km", G, qd)
        lost = (qd * terms.dissipation_slope).sum(axis=0) + e.damper_power(state)
        power = (qd * (terms.forces - terms.dissipation_slope)).sum(axis=0) - terms.explicit_rate + lost
        power = power - (multipliers * driven).sum(axis=0)
        moving = rows.velocities - np.einsum("kim,im->km", rows.jacobian, qd)
        power = power - (forces * moving).sum(axis=0)
        rubbing = slice(e.u, e.k - len(e.latches))
        lost = lost - (forces[rubbing] * rows.velocities[rubbing]).sum(axis=0)
        sliding, holding = e.capacities(state, multipliers, forces) if e.f else (qd[:0], qd[:0])
        laws = rows.gaps, rows.velocities, rows.gamma, rows.jacobian, rows.restitution, rows.friction, rows.static
        conditions = e.events(state)[1]
        return [
            terms.mass_matrix,
            forcing,
            G,
            np.concatenate([moving, driven]),
            *laws,
            sliding,
            holding,
            power,
            lost,
            conditions,
        ]

    # ------------------------------------------------------------------------------------------------- what happened

    @cached_property
    def sided(self) -> NDArray[np.intp]:
        """The times (j,) that are the last before an event; the next time is the first behind it."""
        return np.flatnonzero(np.diff(self.time) <= SIDED * np.maximum(1.0, np.abs(self.time[1:])))

    @cached_property
    def behind(self) -> NDArray[np.bool_]:
        """The times at which no event is due, (m,): all but those just before one."""
        found = self.told.copy()
        found[self.sided] = False
        return np.asarray(found)

    @cached_property
    def quiet(self) -> NDArray[np.bool_]:
        """Between which times and the next ones nothing happens, as far as these tell, (m - 1,)."""
        columns = self.run.columns(watched(self.mechanism))
        kept = (columns[1:] == columns[:-1]).all(axis=1)
        for side in (self.latched, self.sides * self.sides_told):
            kept &= ~_turns(side).any(axis=0)
        kept[self.sided] = False
        return np.asarray(kept)

    @cached_property
    def latched(self) -> Floats:
        """Whether each latch holds, (l, m): 1 or -1, and 0 where its condition does not tell."""
        return np.asarray(np.where(self.conditions > 0, 1.0, -1.0) * tells(self.conditions))

    def lasting(self, off: Floats, step: float, bars: Floats | float = 0.0) -> Floats:
        """Of violations ``off`` (k, m) the least of STILL communication points in a row; all without a ``step``.

        NaN where a law says nothing at one of these points, and at the sides of events; 0 where one is below its bar.
        """
        if step == 0.0:
            return off
        points = np.setdiff1d(np.arange(len(self.time)), [*self.sided, *(self.sided + 1)])
        off, found = np.where(off <= bars, 0.0, off), np.full(off.shape, np.nan)
        if len(points) >= STILL:
            windows = np.lib.stride_tricks.sliding_window_view(off[:, points], STILL, axis=1)
            found[:, points[: 1 - STILL]] = windows.min(axis=-1)
        return found

    @cached_property
    def speeds(self) -> Floats:
        """The greatest speeds of rows since the time before, (k, m), as velocities and accelerations tell them."""
        speed, since = np.abs(self.velocities), np.diff(self.time, prepend=self.time[0])
        faster = since * np.abs(self.accelerations)
        return np.asarray(np.maximum(speed, np.roll(speed, 1, axis=1)) + np.maximum(faster, np.roll(faster, 1, axis=1)))

    @cached_property
    def turning(self) -> Floats:
        """The accelerations (k, m) of rows, where their parts do not cancel: what a row turns by in 1 s."""
        return np.asarray(np.einsum("kim,im->km", np.abs(self.slopes), np.abs(self.qdd)) + np.abs(self.gamma))

    @cached_property
    def shifts(self) -> Floats:
        """By how much the velocities (n, m) may have to move where rows that bear turn, for 1 s of it."""
        nominal, bears = self.system.nominal, self.forces != 0
        size = np.einsum("kim,i->km", np.abs(self.slopes), nominal)
        rates = np.where(bears, self.turning / np.maximum(size, 1e-300), 0.0)
        return np.asarray(nominal[:, None] * rates.max(axis=0, initial=0.0))

    def mode(self, element: str) -> Floats:
        """The mode that the run shows, (m,)."""
        return self.run[names.mode(element)]

    def answers(self, rows: Sequence[int] | NDArray[np.intp], at: int) -> Floats:
        """The accelerations (n, k) that unit forces along ``rows`` (k,) make at the time ``at``."""
        c, n = (held := self.G[:, :, at]).shape
        system = np.block([[self.mass[:, :, at], held.T], [held, np.zeros((c, c))]])
        loads = np.concatenate([self.slopes[rows, :, at].T, np.zeros((c, len(rows)))])
        return np.asarray(np.linalg.lstsq(system, loads, rcond=None)[0][:n])

    def mobility(self, rows: Sequence[int] | NDArray[np.intp], at: int) -> Floats:
        """The accelerations along ``rows`` (k,) that unit forces there make at ``at``, (k, k); 0 at a dead centre."""
        return np.asarray(self.slopes[rows, :, at] @ self.answers(rows, at))

    # --------------------------------------------------------------------------------------------------------- sizes

    @cached_property
    def gap_sizes(self) -> Floats:
        """How much each gap changes where coordinates change by their greatest or nominal values, (u, 1)."""
        return self._moved(self.slopes[: self.e.u], self.q)

    @cached_property
    def speed_sizes(self) -> Floats:
        """The size of the velocities of rows, (k, 1)."""
        return self._moved(self.slopes, self.qd)

    @cached_property
    def acceleration_sizes(self) -> Floats:
        """The size of the accelerations of rows, (k, 1): the sum of what cancels in a row that is kept.

        Where nothing moves they are rounding errors of forces, which are small beside nominal values.
        """
        least = SMALL * np.einsum("kim,i->km", np.abs(self.slopes), self.system.nominal)
        return np.asarray(np.maximum(np.maximum(self.turning, least).max(axis=1), 1e-300)[:, None])

    @cached_property
    def force_sizes(self) -> Floats:
        """The greatest force of each element, (k, 1): of a contact's normal force and friction together.

        None is far below the greatest of all, or below what else acts: a ball that rolls along a wall has forces of
        rounding there, and so have bodies that fall together.
        """
        found = np.abs(self.forces).max(axis=1)
        for i, rows in enumerate(self.e.slip_rows):
            found[[i, *rows]] = found[[i, *rows]].max()
        for row, limit in zip(self.e.friction_rows, self.holding, strict=True):
            found[row] = max(found[row], np.abs(limit).max())
        acts = np.abs(self.forcing * self.system.nominal[:, None]).max() / self._moved(self.slopes, 0.0 * self.q)
        least = SMALL * np.maximum(found.max(initial=0.0), acts)
        return np.asarray(np.maximum(found[:, None], np.maximum(least, 1e-300)))

    @cached_property
    def energy_size(self) -> float:
        """The greatest energy (J) in the run: kinetic, or changes of the whole, or what is dissipated."""
        kinetic = 0.5 * np.einsum("im,ijm,jm->m", self.qd, self.mass, self.qd)
        moved = (float(np.ptp(self.run[name])) for name in ("generalized_energy", names.DISSIPATED_ENERGY))
        nominal = float(np.abs(np.einsum("im,i->m", self.forcing, self.system.nominal)).max())
        return max(float(np.abs(kinetic).max()), *moved, SMALL * nominal, 1e-300)

    def balanced(self, size: Floats) -> Floats:
        """Sizes along coordinates (n,), none far below the greatest in units of energy or action: (n, 1)."""
        nominal = self.system.nominal
        return np.asarray(np.maximum(np.maximum(size, SMALL * (size * nominal).max() / nominal), 1e-300)[:, None])

    def _moved(self, slopes: Floats, values: Floats) -> Floats:
        greatest = np.maximum(np.abs(values).max(axis=1), self.system.nominal)
        found = np.einsum("kim,i->km", np.abs(slopes), greatest).max(axis=1)
        return np.asarray(np.where(found > 0, found, 1.0)[:, None])

    def unit(self, element: str) -> str:
        """The unit of the gap or slip of an ``element``: rad where its force is a torque, else m."""
        return "rad" if self.units.get(names.force(element), "N").replace(" ", "") in ("N.m", "N*m", "J/rad") else "m"

    def force_unit(self, element: str) -> str:
        """The unit of the force of an ``element``."""
        return "N.m" if self.unit(element) == "rad" else "N"


def _turns(side: NDArray[Any]) -> NDArray[np.bool_]:
    """Between which times and the next ones a ``side`` (k, m) may turn, (k, m - 1).

    Where it is 0, nothing tells whether the turn at this time is behind it: it may be on both sides of this time.
    """
    changes, untold = np.asarray(side[:, 1:] != side[:, :-1]), side[:, 1:-1] == 0
    found: NDArray[np.bool_] = changes.copy()
    found[:, 1:] |= changes[:, :-1] & untold
    found[:, :-1] |= changes[:, 1:] & untold
    return found
