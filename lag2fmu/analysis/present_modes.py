"""The equations within the modes that contacts, stops, dry frictions and latches have at a state.

A row that is closed, sticks or is latched is a constraint. A row that slides is a force along it, which may depend on
what other rows bear. The search begins with all touching contacts closed, and sticking if they are at rest. Rows with
impossible forces are let go one after the other. If the modes that are left are not consistent, an error says so.
Source: F. Pfeiffer, Ch. Glocker, Multibody Dynamics with Unilateral Contacts, Wiley 1996, chapters 5 and 6.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from lag2fmu.analysis.evaluation import saddle
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.modes import ModeNumbers, pushes, sliding_forces
from lag2fmu.dynamics.parts import Constraints
from lag2fmu.errors import DerivationError
from lag2fmu.graph.autodiff import Forward, forward
from lag2fmu.graph.batches import Floats, Values, evaluate, matrix
from lag2fmu.graph.nodes import Node

_TOUCHING, _ROUNDING, _STEPS = 1e-6, 1e-8, 20
"""The share of nominal values below which gaps and speeds are 0; that of the greatest force below which forces are; the
greatest number of Newton steps."""


def within_modes(equations: EquationsOfMotion, values: Values) -> EquationsOfMotion:
    """Hybrid ``equations`` within the modes at the state ``values``, {variable: SI value}, on a copy of their graph.

    Rows that hold are among the ``constraints``. Raises DerivationError where the modes are not determined: at an
    impact, at an overlap, or if no modes are consistent. Source: F. Pfeiffer, Ch. Glocker, Multibody Dynamics with
    Unilateral Contacts, Wiley 1996, chapters 5 and 6.
    """
    search = _ModeSearch(equations.apart(), values)
    for _ in range(2 * len(equations.rows) + 2):
        found = search.equations_within()
        qdd, multipliers, _ = solved(found, values)
        labels = (str(found.graph.leaf[node]) for node in found.variables.multipliers)
        borne = dict.fromkeys(equations.forces, 0.0) | dict(zip(labels, multipliers, strict=True))
        if not search.let_go(borne):
            search.check(qdd)
            return found
    raise search.undecided()


def solved(equations: EquationsOfMotion, values: Values) -> tuple[Floats, Floats, Floats]:
    """Accelerations (n,), multipliers (m,) and the inverse (n + m, n + m) of the Jacobian of equations within modes.

    Sliding forces may depend on other forces by any formula, hence Newton's method. It takes one step where they are
    linear. ``values`` are {variable: SI value}.
    """
    g, v, n = equations.graph, equations.variables, len(equations.forcing)
    seeds = {x: g.symbol(f"d {g.leaf[x]}") for x in v.multipliers}
    slopes = forward(g, equations.residual[:n], seeds)
    labels = [str(g.leaf[x]) for x in v.unknowns]
    units = dict(zip((str(g.leaf[s]) for s in seeds.values()), np.eye(len(seeds)), strict=True))
    M, G = (matrix(g, rows, values, n) for rows in (equations.mass_matrix, equations.constraints.jacobian))
    x = np.zeros(len(labels))
    for _ in range(_STEPS):
        at = {**values, **dict(zip(labels, x, strict=True))}
        inverse = saddle(equations, M, G, evaluate(g, slopes, {**at, **units}) if seeds else None)
        step = -inverse @ evaluate(g, equations.residual, at)
        x = x + step
        if not np.abs(step).max(initial=0.0) > 1e-13 * np.abs(x).max(initial=0.0):
            break
    return x[:n], x[n:], inverse


class _ModeSearch:
    """The modes that are tried: ``closed`` contacts, and ``ways`` {group: direction} in which groups slide.

    A group is a set of frictional rows that slide or stick together: the slips of a contact, or a dry friction. The way
    of a contact without friction is None.
    """

    def __init__(self, equations: EquationsOfMotion, values: Values) -> None:
        g, self.rows = equations.graph, equations.rows
        self.equations, self.values = equations, values
        self.jacobian = matrix(g, self.rows.jacobian, values, len(equations.forcing))
        nominal = np.array([c.nominal for c in equations.mechanism.coordinates])
        size = np.abs(self.jacobian) @ nominal
        self.sizes = _TOUCHING * np.where(size > 0, size, 1.0)
        self.speeds = evaluate(g, self.rows.velocities, values)
        self.sticking = evaluate(g, self.rows.static_friction, values)
        self.touching = self._touching(evaluate(g, self.rows.gaps, values))
        held = evaluate(g, self.rows.conditions, values) > 0
        self.latched = [row for row, holds in zip(self.rows.latches, held, strict=True) if holds]
        self.groups, self.contacts = self._groups(), len(self.rows.slips)
        self.closed = set(self.touching)
        self.ways: dict[int, Floats | None] = {}
        for k, group in enumerate(self.groups):
            if k < self.contacts and self.sticking[k] == 0:
                self.ways[k] = None
            elif (np.abs(self.speeds[group]) > self.sizes[group]).any():
                self.ways[k] = self.speeds[group] / np.linalg.norm(self.speeds[group])

    def _touching(self, gaps: Floats) -> list[int]:
        """The contacts that are closed; raises DerivationError for one that hits or overlaps."""
        found = []
        for i, contact in enumerate(self.equations.mechanism.unilaterals):
            gap, speed, size = gaps[i], self.speeds[i], self.sizes[i]
            if gap > size or (gap >= -size and speed > size):
                continue
            if gap < -size or speed < -size:
                what = f"overlaps by {-gap:.3g}" if gap < -size else f"hits with {-speed:.3g}"
                raise DerivationError(
                    f"{contact.where}: it {what} (SI) at the state, which has no modes; choose another"
                )
            found.append(i)
        return found

    def _groups(self) -> list[list[int]]:
        row, found = len(self.rows.slips), []
        for count in (*self.rows.slips, *(1 for _ in self.rows.sliding)):
            found.append(list(range(row, row + count)))
            row += count
        return found

    def _acts(self, group: int) -> bool:
        """Whether the ``group`` is a dry friction or of a closed contact."""
        return group >= self.contacts or group in self.closed

    def _stuck(self) -> list[int]:
        return [k for k in range(len(self.groups)) if self._acts(k) and k not in self.ways]

    def equations_within(self) -> EquationsOfMotion:
        """The equations within the modes that are tried."""
        e, rows = self.equations, self.rows
        g, v, c, n, contacts = e.graph, e.variables, e.constraints, len(e.forcing), len(rows.slips)
        positions = [*range(contacts), *list(rows.latches)[: len(rows.positions) - contacts]]
        held = {*self.closed, *(row for k in self._stuck() for row in self.groups[k]), *self.latched}
        first = [row for row in positions if row in held]
        rest = sorted(held.difference(positions))
        h = len(c.positions)

        def joined(of_constraints: Sequence[Any], of_rows: Sequence[Any]) -> tuple[Any, ...]:
            return (*of_constraints[:h], *(of_rows[i] for i in first), *of_constraints[h:], *(of_rows[i] for i in rest))

        constraints = Constraints(
            positions=(*c.positions, *(rows.positions[positions.index(row)] for row in first)),
            velocities=joined(c.velocities, rows.velocities),
            accelerations=joined(c.accelerations, rows.accelerations),
            jacobian=joined(c.jacobian, rows.jacobian),
        )
        free = self._free_forces(held)
        pushed = [g.subtract(r, x) for r, x in zip(e.residual[:n], pushes(g, rows, v.qd), strict=True)]
        variables = v._replace(
            multipliers=joined(v.multipliers, rows.forces),
            further_rates=tuple(g.substitute(v.further_rates, free)),
        )
        accelerating = Forward(g, v.direction(g, True))
        residual = (*g.substitute(pushed, free), *accelerating(constraints.velocities))
        return replace(e, constraints=constraints, variables=variables, residual=residual, solution=None)

    def _free_forces(self, held: set[int]) -> dict[Node, Node]:
        """The forces of the rows that do not hold: 0, or those of sliding."""
        g, rows = self.equations.graph, self.rows
        none = {rows.forces[row]: g.zero for row in range(len(rows)) if row not in held}
        ways = [g.constant(float(x)) for k, group in enumerate(self.groups) for x in self._way(k, len(group))]
        at_once = ModeNumbers((), tuple(ways), (), (g.zero,) * (2 * rows.slips.count(2)))
        sliding = g.substitute(sliding_forces(g, rows, at_once, (g.zero,) * len(rows)), none)
        found = dict(none)
        for k, group in enumerate(self.groups):
            if self._acts(k) and self.ways.get(k) is not None:
                found |= {rows.forces[row]: sliding[row - len(rows.slips)] for row in group}
        return found

    def _way(self, group: int, count: int) -> Floats:
        way = self.ways.get(group)
        return np.zeros(count) if way is None else way

    def let_go(self, borne: dict[str, float]) -> bool:
        """Open the contact that pulls most, or let the group slide whose sticking force is most beyond its limit.

        ``borne`` {name: SI value} are the multipliers. Returns whether there was such a contact or group.
        """
        forces = np.array([borne[name] for name in self.equations.forces])
        rounding = _ROUNDING * np.abs(forces).max(initial=0.0)
        pulling = [i for i in self.closed if forces[i] < -rounding]
        if pulling:
            self.closed.remove(min(pulling, key=lambda i: forces[i]))
            return True
        holding = evaluate(self.equations.graph, self.rows.holding, {**self.values, **borne})
        limits = [*self.sticking * forces[: self.contacts], *holding]
        beyond = {k: float(np.linalg.norm(forces[self.groups[k]]) - limits[k]) for k in self._stuck()}
        most = max(beyond, key=lambda k: beyond[k], default=None)
        if most is None or beyond[most] <= rounding:
            return False
        force = forces[self.groups[most]]
        self.ways[most] = -force / np.linalg.norm(force)
        return True

    def check(self, qdd: Floats) -> None:
        """Raise DerivationError unless open contacts part, and groups that slide from rest accelerate that way."""
        terms = evaluate(self.equations.graph, self.rows.accelerations, self.values)
        found = self.jacobian @ qdd + terms
        rounding = _TOUCHING * (np.abs(self.jacobian) @ np.abs(qdd) + np.abs(terms))
        parting = all(found[i] >= -rounding[i] for i in self.touching if i not in self.closed)
        for k, group in enumerate(self.groups):
            way, resting = self.ways.get(k), (np.abs(self.speeds[group]) <= self.sizes[group]).all()
            if way is not None and resting and self._acts(k):
                parting &= bool(way @ found[group] >= -rounding[group].max())
        if not parting:
            raise self.undecided()

    def undecided(self) -> DerivationError:
        """The error that no modes are consistent."""
        return DerivationError(
            f"mechanism '{self.equations.mechanism.name}': no modes of contacts and frictions are consistent at the "
            "state; choose another"
        )
