"""The motion between two events: slopes for an integration, and the functions that say where the modes end."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lag2fmu.deadline import check_time
from lag2fmu.reference.hybrid.loads import centred
from lag2fmu.reference.hybrid.measures import BACK, force_sizes
from lag2fmu.reference.hybrid.modes import SENSE, Mode, Modes
from lag2fmu.reference.hybrid.system import HybridSystem
from lag2fmu.reference.state import Floats, StateBatch

ROUNDING = 4e-15
"""The rounding error of an event function, relative to the terms that it is made of."""

UNPRESSED = 1e-10
"""Relative to the usual force along a row: what a friction that can bear nothing may seem to bear."""


class Piece:
    """The motion under fixed ``modes``: slopes and event functions; ``inputs`` maps a time (s) to input values."""

    def __init__(self, system: HybridSystem, modes: Modes, inputs: Callable[[float], Floats], damping: float) -> None:
        self.system, self.modes, self.inputs, self.damping = system, modes, inputs, damping
        self.n, self.size = system.n, system.size
        e = system.elements
        labels = [("side", i) for i in range(e.sides)] + [("condition", j) for j in range(len(e.latches))]
        labels += [("gap", i) for i, mode in enumerate(modes.contacts) if mode is Mode.OPEN]
        labels += [("slip", i) for i in range(e.u) if self._has_direction(i)]
        labels += [("friction", j) for j, mode in enumerate(modes.frictions) if mode in SENSE]
        self.plain = len(labels)
        self.turning = bool(modes.directions)
        self.timed = tuple(np.flatnonzero(e.timed).tolist())
        closed = [i for i, mode in enumerate(modes.contacts) if mode is not Mode.OPEN]
        labels += [("force", i) for i in closed]
        labels += [("cone", i) for i in closed if modes.contacts[i] is Mode.STICKS]
        labels += [("hold", j) for j, mode in enumerate(modes.frictions) if mode is Mode.STICKS]
        self.labels = tuple(labels)
        e.set_sides(modes.sides)

    def _has_direction(self, i: int) -> bool:
        return self.modes.contacts[i] in SENSE or i in self.modes.directions

    def state(self, t: float, y: Floats) -> StateBatch:
        """The state at ``y`` (s + 2,)."""
        return StateBatch(np.float64(t), y[: self.n], y[self.n : 2 * self.n], self.with_further(self.inputs(t), y))

    def with_further(self, inputs: Floats, y: Floats) -> Floats:
        """``inputs`` (i, *batch) with the further states of y (s + 2, *batch) put in, in SI units."""
        return self.system.energies.with_states(inputs.copy(), y[2 * self.n : self.size])

    def turn(self, t: float, y: Floats) -> None:
        """Set the directions of slips in space to those at the state y (s + 2,) at ``t`` (s), where a step begins.

        Slow slips keep theirs.
        """
        e, modes = self.system.elements, self.modes
        if modes.directions:
            velocities = e.events(self.state(t, y))[3]
            for i in modes.directions:
                slip = velocities[e.slip_rows[i]]
                speed = float(np.hypot.reduce(slip))
                if speed > 3 * modes.steadied.get(i, 0.0):
                    modes.directions[i] = tuple(slip / speed)  # type: ignore[index]
                    modes.steadied.pop(i, None)  # type: ignore[attr-defined]

    def slope(self, t: float, y: Floats) -> Floats:
        """dy/dt, (s + 2,): velocities, accelerations, further states, power of work, power that is dissipated."""
        check_time()
        system, n = self.system, self.n
        point = system.point(self.state(t, y))
        answer = system.answer(point, self.modes, self.damping)
        qd, terms, e = y[n : 2 * n], point.terms, system.elements
        lost = float(qd @ terms.dissipation_slope) + e.damper_power(point.state)
        power = float(qd @ (terms.forces - terms.dissipation_slope)) - float(terms.explicit_rate) + lost
        if system.constraints.m:
            power -= float(answer.multipliers @ (point.constraints[1] - point.constraints[3] @ qd))
        if e.k:
            velocities = point.rows.velocities
            power -= float(answer.forces @ (velocities - point.rows.jacobian @ qd))
            rubbing = slice(e.u, e.k - len(e.latches))
            lost -= float(answer.forces[rubbing] @ velocities[rubbing])
        found = np.empty_like(y)
        found[:n], found[n : 2 * n], found[self.size :] = qd, answer.qdd, [power, lost]
        found[2 * n : self.size] = e.further(point.state, answer.qdd, answer.multipliers, answer.forces)
        return found

    def events(self, times: Floats, y: Floats) -> Floats:
        """The event functions at ``times`` (b,) and y (b, s + 2): (count, b)."""
        margins = self.margins(times, y)
        if len(self.labels) == self.plain:
            return margins
        forceful = [self._forceful(float(t), at) for t, at in zip(times, y, strict=True)]
        return np.concatenate([margins, np.transpose(forceful)])

    def margin_of_time(self, i: int, times: Floats, y: Floats) -> Floats:
        """The event function ``i``, which depends on nothing but the time, at ``times`` (b,); y (s + 2,) is any."""
        e, sides = self.system.elements, self.modes.sides
        inputs = self.inputs(float(times[0]))[:, None].repeat(len(times), axis=1)
        along = y[:, None].repeat(len(times), axis=1)
        batch = StateBatch(times, along[: self.n], along[self.n : 2 * self.n], self.with_further(inputs, along))
        margins, conditions, *_ = e.events(batch)
        if i < len(sides):
            return np.asarray(sides[i] * margins[i])
        j = i - len(sides)
        return np.asarray(conditions[j] if self.modes.held[j] else -conditions[j])

    def margins(self, times: Floats, y: Floats) -> Floats:
        """The event functions that follow without forces, at ``times`` (b,) and y (b, s + 2): (plain, b)."""
        check_time()
        n, e, modes = self.n, self.system.elements, self.modes
        inputs = np.stack([self.inputs(float(t)) for t in times], axis=-1)
        batch = StateBatch(times, y[:, :n].T, y[:, n : 2 * n].T, self.with_further(inputs, y.T))
        margins, conditions, gaps, velocities = e.events(batch)
        out = np.empty((self.plain, len(times)))
        for row, (kind, i) in zip(out, self.labels[: self.plain], strict=True):
            if kind == "side":
                row[:] = modes.sides[i] * margins[i]
            elif kind == "condition":
                row[:] = conditions[i] if modes.held[i] else -conditions[i]
            elif kind == "gap":
                row[:] = gaps[i]
            elif kind == "friction":
                row[:] = SENSE[modes.frictions[i]] * velocities[e.friction_rows[i]]
            elif modes.contacts[i] in SENSE:
                row[:] = SENSE[modes.contacts[i]] * velocities[e.slip_rows[i][0]]
            else:
                along = np.array(modes.directions[i]) @ velocities[e.slip_rows[i]]
                row[:] = along + BACK * modes.steadied.get(i, 0.0)
        return out

    def _forceful(self, t: float, y: Floats) -> Floats:
        """The event functions that need forces at y (s + 2,): normal forces, margins of cones and of holding."""
        e = self.system.elements
        point = self.system.point(self.state(t, y))
        answer = centred(point, self.modes, self.system.answer(point, self.modes))
        found = []
        for kind, i in self.labels[self.plain :]:
            if kind == "force":
                found.append(answer.forces[i])
            elif kind == "cone":
                tangential = float(np.hypot.reduce(answer.forces[e.slip_rows[i]], initial=0.0))
                found.append(point.rows.static[i] * answer.forces[i] - tangential)
            else:  # a clutch that is not pressed rests as long as others hold it, whose loads leave it rounding
                row = e.friction_rows[i]
                least = UNPRESSED * force_sizes(point)[row] if answer.holding[i] == 0 else 0.0
                found.append(answer.holding[i] + least - abs(answer.forces[row]))
        return np.array(found)

    def _in_an_instant(self, t: float, y: Floats) -> Floats:
        """What the event functions without forces change by while the time (s) changes by its rounding, (plain,)."""
        instant = 64 * np.spacing(abs(t))
        y = np.stack([y, y + instant * self.slope(t, y)])
        return np.asarray(np.abs(np.diff(self.margins(np.array([t, t + instant]), y))[:, 0]) / 16)

    def floors(self, t: float, y: Floats) -> Floats:
        """The sizes below which event functions are zero up to rounding: (count,)."""
        system, e = self.system, self.system.elements
        point = system.point(self.state(t, y))
        rows = point.rows
        gap = np.maximum(np.abs(rows.jacobian[: e.u]) @ np.maximum(system.nominal, np.abs(y[: self.n])), 1e-300)
        velocity = np.abs(rows.jacobian) @ np.maximum(system.nominal, np.abs(y[self.n : 2 * self.n]))
        force, found = force_sizes(point), []
        largest = max(1.0, abs(t), float(np.abs(y).max()), float(np.abs(point.state.inputs).max(initial=0.0)))
        instant = self._in_an_instant(t, y)
        for row, (kind, i) in enumerate(self.labels):
            if kind in ("side", "condition"):
                found.append(ROUNDING * largest + instant[row])
            elif kind == "gap":
                found.append(ROUNDING * gap[i])
            elif kind == "slip":
                found.append(ROUNDING * velocity[e.slip_rows[i]].max())
            elif kind == "friction":
                found.append(ROUNDING * velocity[e.friction_rows[i]])
            else:
                found.append(1e3 * ROUNDING * force[i if kind != "hold" else e.friction_rows[i]])
        return np.array(found)
