"""What is doubtful in a run by itself: friction beyond its limit, constraints left open, a stick that creeps.

A second run is not needed: the laws are looked at where the run was recorded.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from lag2fmu.description import names
from lag2fmu.dynamics.lagrange import derive, with_derived
from lag2fmu.fmu.runtime_tables import default_solver_step
from lag2fmu.graph.batches import evaluate
from lag2fmu.graph.nodes import Node
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.hybrid.modes import Mode
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.solvers.methods import METHODS, TimeStepping
from lag2fmu.verify.run import Floats

BEYOND = 1e-3
"""Relative to the greatest limit: a friction that exceeds its limit by more is doubtful.

Rounding and the width of an event give 1e-8 at most; one that is decided wrongly exceeds its limit by half or more.
"""
FAINT = 1e-6
"""Relative to the forces on what it acts on: a friction that exceeds its limit by less does so by rounding.

A contact that bears a normal force of 1e-8 N beside a weight of 10 N has a limit that is as small.
"""
OPEN = 100.0
"""In tolerances of its size: a residual, a slip or a creep that is greater is doubtful; errors of runs are below 10."""
HARDLY = 1e-3
"""Relative to the coordinate that a row moves most: one that it moves less is hardly moved."""
ROUNDED = 1e-13
"""Relative: equal speeds that are recorded differ by less, which is some units in the last place."""
STILL = 3
"""The points in a row at which something has to creep, or with time stepping to break a law, before it is told.

The error of a step with an impact is of first order in its length, and past with the next one.
"""
REMEDY = "compare with a run at a sharper tolerance, and with the solver moreau; where they differ, trust none of them"
REMEDY_OF_STEPS = (
    "compare with a run of a smaller solver_step, and with a solver that locates events, as dopri5; where they differ, "
    "trust none of them"
)


TOGETHER = 64
"""The rows that are evaluated at once."""


class _Arms(NamedTuple):
    """``greatest``: the greatest |entry| of each of R rows for n coordinates in a run, (R, n).

    ``acting``: the greatest sum of the sizes of all forces on each coordinate, (n,).
    """

    greatest: Floats
    acting: Floats


class DoubtWatch:
    """What is looked at in runs of ``mechanism``; ``outputs`` are the variables of its FMU that this needs."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.equations = derive(mechanism)
        self.mechanism = m = with_derived(mechanism, self.equations)
        self._values = self._own = {p.name: float(p.value) for p in m.parameters if p.value is not None}
        rows, c = self.equations.rows, self.equations.constraints
        laws = (*rows.sliding, *rows.holding, *rows.friction, *rows.static_friction, *rows.velocities)
        self._nodes = [*laws, *(x for row in (*rows.jacobian, *c.jacobian) for x in row)]
        self._symbols = self.equations.graph.symbols(self._nodes) - {"t"} - self._values.keys()
        q = [x.name for x in m.coordinates]
        elements = [*(u.name for u in m.unilaterals), *(f.name for f in m.frictions)]
        shown = [*q, *map(names.velocity, q), *self.equations.forces, *map(names.mode, elements)]
        shown += [names.residual(item.name) for item in m.constraints]
        shown += [names.DISSIPATED_ENERGY] if m.hybrid else []
        self.outputs = list(dict.fromkeys([*shown, *sorted(self._symbols)])) if len(rows) or len(c) else []

    @cached_property
    def _owners(self) -> list[str]:
        """The contacts and frictions of the rows that rub, in the order of the rows."""
        unilaterals = zip(self.mechanism.unilaterals, self.equations.rows.slips, strict=True)
        contacts = (u.name for u, slips in unilaterals for _ in range(slips))
        return [*contacts, *(f.name for f in self.mechanism.frictions)]

    def doubts(
        self,
        run: Trajectory,
        tolerance: float | None,
        values: Mapping[str, float] = MappingProxyType({}),
        solver: str | None = None,
    ) -> Iterator[str]:
        """A sentence on all doubts in the ``run``, made with this ``tolerance``; none without ``outputs``.

        ``values`` (SI) are those of parameters and settings for the run, ``solver`` is the name of that of the FMU.
        """
        self._values = self._own | {name: x for name, x in values.items() if name in self._own}
        if not self.outputs or not set(self.outputs) <= set(run.names) or len(run.time) < 2:
            return
        tolerance = self.mechanism.experiment.tolerance if tolerance is None else tolerance
        stepped = isinstance(METHODS.get(solver or ""), TimeStepping)
        step = (values.get("solver_step") or default_solver_step(self.mechanism)) if stepped else 0.0
        arms = self._arms(run)
        told = [
            *self._frictions(run, arms, step),
            *self._residuals(run, tolerance),
            *self._creeps(run, tolerance, arms, step),
        ]
        if told:
            yield f"the run is doubtful: {'; '.join(told)}; {REMEDY_OF_STEPS if stepped else REMEDY}"

    def _numbers(self, run: Trajectory, nodes: Sequence[Node]) -> Floats:
        """The values of ``nodes`` (k,) along the run, (k, m)."""
        graph, recorded = self.equations.graph, set(run.names)
        moving = graph.symbols(nodes) - self._values.keys()
        values: dict[str, float | Floats] = {name: run[name] if name in recorded else 0.0 for name in moving}
        return evaluate(graph, nodes, {**self._values, **values, "t": run.time})

    def _greatest(self, run: Trajectory, nodes: Sequence[Node]) -> Floats:
        """The greatest values of ``nodes`` (k,), limits that hold speeds equal, along the run, (k, m).

        A limit may ask which of these speeds is the greater one, as that of a freewheel: rounding must not answer.
        """
        apart = ROUNDED * np.arange(len(run.names))
        sides = (Trajectory(run.time, run.names, run.values * (1 + side * apart)) for side in (-1, 0, 1))
        found: Floats = np.maximum.reduce([self._numbers(side, nodes) for side in sides])
        return found

    def _frictions(self, run: Trajectory, arms: _Arms, step: float) -> Iterator[str]:
        """The friction that is farthest beyond its limit, with time stepping by ``step`` (s; 0: another solver)."""
        m, rows = self.mechanism, self.equations.rows
        found, faint = [], self._faint(arms)
        limits = zip(m.frictions, self._numbers(run, rows.sliding), self._greatest(run, rows.holding), strict=True)
        for f, sliding, holding in limits:
            limit = np.where(run[names.mode(f.name)] == Mode.STICKS, holding, sliding)
            found.append((f.name, np.abs(run[names.force(f.name)]), limit))
        coefficients = self._numbers(run, rows.friction), self._numbers(run, rows.static_friction)
        for u, friction, static in zip(m.unilaterals, *coefficients, strict=True):
            forces = [run[name] for name in names.frictions(u.name, len(u.slips))]
            if forces:
                coefficient = np.where(run[names.mode(u.name)] == Mode.STICKS, static, friction)
                found.append((u.name, np.hypot.reduce(forces), coefficient * run[names.force(u.name)]))
        for name, size, own in found:
            limit = _around(own)
            over = _lasting(size - limit, step)
            at = int(np.argmax(over))
            if over[at] > BEYOND * float(np.abs(limit).max()) + faint[name]:
                yield (
                    f"the friction of {name} is {size[at]:.4g} where {limit[at]:.4g} is its limit, "
                    f"at t = {run.time[at]:.4g} s"
                )

    def _arms(self, run: Trajectory) -> _Arms:
        """How rows move coordinates along the run; TOGETHER rows at a time, so that the numbers need little memory."""
        rows = self.equations.rows
        acting = np.abs(self._numbers(run, self.equations.forcing))
        greatest = []
        for first in range(0, len(rows.jacobian), TOGETHER):
            some = rows.jacobian[first : first + TOGETHER]
            entries = np.abs(self._numbers(run, [x for row in some for x in row]))
            entries = entries.reshape(len(some), -1, len(run.time))
            forces = np.abs([run[name] for name in self.equations.forces[first : first + TOGETHER]])
            acting += np.einsum("rnm,rm->nm", entries, forces)
            greatest.append(entries.max(axis=2))
        return _Arms(np.concatenate([*greatest, np.empty((0, len(acting)))]), acting.max(axis=1, initial=0.0))

    def _faint(self, arms: _Arms) -> dict[str, float]:
        """{owner of a row that rubs: a force that is rounding beside the forces in the run}, in units of the force.

        The forces on each coordinate are compared with what a force in the row is there. Coordinates that the row
        hardly moves do not count.
        """
        nominal = np.array([q.nominal for q in self.mechanism.coordinates])
        found: dict[str, float] = {}
        for name, own in zip(self._owners, arms.greatest[len(self.mechanism.unilaterals) :], strict=False):
            moved = own * nominal > HARDLY * float((own * nominal).max())
            found[name] = max(found.get(name, 0.0), FAINT * float((arms.acting[moved] / own[moved]).max(initial=0.0)))
        return found

    def _residuals(self, run: Trajectory, tolerance: float) -> Iterator[str]:
        """The constraints that are not met."""
        m, c = self.mechanism, self.equations.constraints
        for k, (item, row) in enumerate(zip(m.constraints, c.jacobian, strict=True)):
            greatest = np.abs(self._numbers(run, row)).max(axis=1)
            size = self._size(run, greatest, rates=k >= len(c.positions))
            open_ = np.abs(run[names.residual(item.name)])
            at = int(np.argmax(open_))
            if open_[at] > OPEN * tolerance * size:
                yield f"the constraint {item.name} is left open by {open_[at]:.3g} at t = {run.time[at]:.4g} s"

    def _creeps(self, run: Trajectory, tolerance: float, arms: _Arms, step: float) -> Iterator[str]:
        """The friction that slips while it sticks, and the coordinate that moves at rest.

        Time stepping obeys the laws in the middle of each ``step`` (s; 0: another solver). What sticks there slips at
        the end by what its row turns in half a step; this much twice is no doubt.
        """
        rows, first = self.equations.rows, len(self.mechanism.unilaterals)
        stuck = np.zeros(len(run.time), dtype=bool)
        rubbing = slice(first, first + len(self._owners))
        slips, turning = (self._numbers(run, nodes[rubbing]) for nodes in (rows.velocities, rows.accelerations))
        for name, slip, turns, own in zip(self._owners, slips, turning, arms.greatest[rubbing], strict=True):
            sticks = run[names.mode(name)] == Mode.STICKS
            stuck |= sticks
            off = _lasting(np.where(sticks, np.abs(slip) - step * np.abs(turns), 0.0), step)
            at = int(np.argmax(off))
            if off[at] > OPEN * tolerance * self._size(run, own, rates=True):
                yield f"{name} sticks and slips by {abs(slip[at]):.3g} (SI) at t = {run.time[at]:.4g} s"
        if stuck.any():
            yield from self._moving_at_rest(run, stuck, tolerance)

    def _moving_at_rest(self, run: Trajectory, stuck: np.ndarray, tolerance: float) -> Iterator[str]:
        """The coordinate that moves while every velocity is 0 and a friction sticks.

        What slips and rests again between two points moves, too; friction has taken energy then.
        """
        coordinates = self.mechanism.coordinates
        slow = [np.abs(run[names.velocity(q.name)]) <= tolerance * q.nominal for q in coordinates]
        still = np.logical_and.reduce([stuck, *slow])
        undissipated = np.diff(run[names.DISSIPATED_ENERGY]) == 0.0
        edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
        for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            for q in coordinates if end - begin >= STILL else ():
                steps = np.diff(run[q.name][begin:end]) * undissipated[begin : end - 1]
                moved = float(abs(steps.sum()))
                span = float(run.time[end - 1] - run.time[begin])
                if moved > OPEN * tolerance * q.nominal * max(1.0, span):
                    yield f"{q.name} creeps by {moved:.3g} (SI) at rest, from t = {run.time[begin]:.4g} s on"
                    return

    def _size(self, run: Trajectory, entries: Floats, *, rates: bool) -> float:
        """The size of what a row makes of the motion: sums of its ``entries`` (n,) times greatest or nominal values."""
        of = names.velocity if rates else str
        greatest = [max(float(np.abs(run[of(q.name)]).max()), q.nominal) for q in self.mechanism.coordinates]
        return max(float(entries @ greatest), 1e-300)


def _lasting(excess: Floats, step: float) -> Floats:
    """What of an ``excess`` (m,) is doubtful at each point: with time stepping (``step`` > 0) the least of STILL."""
    if step == 0.0:
        return excess
    padded = np.concatenate([excess, np.full(STILL - 1, -np.inf)])
    found: Floats = np.lib.stride_tricks.sliding_window_view(padded, STILL).min(axis=1)
    return found


def _around(limit: Floats) -> Floats:
    """The greatest of each entry and its neighbours (m,): a limit that jumps at a point holds before and after it."""
    padded = np.concatenate([limit[:1], limit, limit[-1:]])
    found: Floats = np.maximum.reduce([padded[:-2], padded[1:-1], padded[2:]])
    return found
