"""A hybrid mechanism as numbers: its equations of motion under given modes, and the problem of finding these modes.

Between events

    M qdd = f + G^T multiplier + sum of J^T r,  with G qdd = -gamma for constraints, closed contacts and sticking rows.

The forces r of sliding rows follow from Coulomb's law. The whole system is solved at once; sliding friction makes it
unsymmetric. Source: F. Pfeiffer, Ch. Glocker, Multibody Dynamics with Unilateral Contacts, Wiley 1996, chapter 5.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace

import numpy as np

from lag2fmu.errors import SimulationError
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.constraints import Values, scales
from lag2fmu.reference.energies import EnergyFunctions
from lag2fmu.reference.equations import Equations
from lag2fmu.reference.hybrid.elements import Elements
from lag2fmu.reference.hybrid.kinks import FrozenComposition
from lag2fmu.reference.hybrid.limits import FREE
from lag2fmu.reference.hybrid.modes import SENSE, Mode, Modes, closed_contacts
from lag2fmu.reference.hybrid.records import Answer, MotionPoint, Responses, Rows
from lag2fmu.reference.newton import newton
from lag2fmu.reference.single import CompiledLater
from lag2fmu.reference.state import Floats, StateBatch

RANK = 1e-11
"""Relative to the greatest singular value: smaller ones belong to rows that depend on others."""
WEAK = 1e-8
"""A matrix whose condition is better than 1 / WEAK has independent rows."""


class HybridSystem:
    """The equations of a hybrid ``mechanism`` for ``parameters`` (name -> SI value)."""

    def __init__(self, mechanism: Mechanism, parameters: Mapping[str, float] | None = None) -> None:
        self.mechanism = mechanism
        composition = FrozenComposition(mechanism)
        self.energies = EnergyFunctions(mechanism, parameters, composition)
        self.elements = Elements(self.energies, composition)
        self.elements.take_sides(self.energies.declared())  # constraints may have kinks, and equations need a start
        self.equations = Equations(mechanism, parameters, self.energies)
        self.n = self.equations.n
        self.constraints = self.energies.constraints
        self._compiled = CompiledLater(self.equations.energies, self.equations.scale, small=self.equations.small)
        self._bound: tuple[Modes, tuple[list[int], list[int]]] | None = None  # the modes asked for last, and their rows
        self._redundant: Modes | None = None  # the modes asked for last, if their rows were redundant
        self.size = 2 * self.n + len(mechanism.states)  # of the states: q, qd, further ones
        self.nominal = np.array([c.nominal for c in mechanism.coordinates])

    def latched(self, modes: Modes, position: bool) -> list[int]:
        """The indices of the latches that hold: of those of positions, or of those of velocities."""
        e = self.elements
        return [i for i, (held, h) in enumerate(zip(modes.held, e.holonomic, strict=True)) if held and h is position]

    def point(self, state: StateBatch) -> MotionPoint:
        """Everything at a single ``state``."""
        single = self._compiled.asked()
        if single is None:
            terms, values = self.equations.terms(state), self._constraint_values(state)
        else:
            terms, values = single.terms(state), single.constraint_values()
        forcing = terms.forces + terms.lagrangian_slope - terms.dissipation_slope - terms.inertial
        return MotionPoint(state, terms, forcing, values, self.elements.rows(state), self.nominal)

    def _constraint_values(self, state: StateBatch) -> Values:
        return self.constraints(state) if self.constraints.m else (*np.zeros((3, 0)), np.zeros((0, self.n)))

    def stops(self, t: float | Floats, why: str) -> SimulationError:
        """The error that says ``why`` there is no motion from the time ``t`` (s) on."""
        return SimulationError(f"mechanism '{self.mechanism.name}' at time {float(t)!r} s: {why}")

    # ------------------------------------------------------------------------------------------------- under modes

    def bound_rows(self, modes: Modes) -> tuple[list[int], list[int]]:
        """The rows whose position is kept, closed contacts first, and the rows whose velocity is kept."""
        if self._bound is None or self._bound[0] is not modes:
            self._bound = modes, self._bound_rows(modes)
        return self._bound[1]

    def _bound_rows(self, modes: Modes) -> tuple[list[int], list[int]]:
        e = self.elements
        closed = closed_contacts(modes)
        stuck = [int(row) for i in closed if modes.contacts[i] is Mode.STICKS for row in e.slip_rows[i]]
        stuck += [int(row) for row, mode in zip(e.friction_rows, modes.frictions, strict=True) if mode is Mode.STICKS]
        stuck += [e.latch_rows[i] for i in self.latched(modes, False)]
        return closed + [e.latch_rows[i] for i in self.latched(modes, True)], stuck

    def missed(self, rows: Rows, modes: Modes) -> Floats:
        """The deviations of the p rows whose position is kept from the positions that they keep, (p,), in SI units."""
        latched = self.latched(modes, True)
        offsets = np.array([modes.offsets[i] for i in latched])
        return np.concatenate([rows.gaps[closed_contacts(modes)], rows.latched[latched] - offsets])

    def slip_direction(self, modes: Modes, i: int, rows: Rows) -> Floats | None:
        """The direction in which the contact ``i`` slides, (1,) or (2,); None where there is no friction."""
        slips = self.elements.slip_rows[i]
        if not len(slips) or rows.friction[i] == 0:
            return None
        if modes.contacts[i] in SENSE:
            return np.array([SENSE[modes.contacts[i]]])
        before = np.array(modes.directions[i])
        slip = rows.velocities[slips] + modes.steadied.get(i, 0.0) * before
        # beyond the end of a slip the equations stay as before it, so that the end can be located exactly
        return slip / np.hypot.reduce(slip) if slip @ before > 0 else before

    @np.errstate(over="ignore", invalid="ignore")  # where a coefficient of friction overflows, at a trial step
    def answer(self, point: MotionPoint, modes: Modes, damping: float = 0.0) -> Answer:
        """Accelerations and forces at ``point`` in the ``modes``; NaN without a solution.

        ``damping`` (1/s) pulls the motion back onto constraints and closed contacts. Source: F. Pfeiffer, Ch. Glocker,
        Multibody Dynamics with Unilateral Contacts, Wiley 1996, chapter 5.
        """
        e, n, m, rows = self.elements, self.n, self.constraints.m, point.rows
        kept, stuck = self.bound_rows(modes)
        if not (m or kept or stuck or e.f):  # nothing acts along a row, as in flight
            qdd, none, empty = _free(point.terms.mass_matrix, point.forcing), np.zeros(0), np.zeros((0, 0))
            return Answer(qdd, none, np.zeros(e.k), none, [], none, empty, empty)
        closed = closed_contacts(modes)
        bound = kept + stuck
        G = np.concatenate([point.constraints[3], rows.jacobian[bound]])
        aim = rows.gamma[bound] + 2 * damping * rows.velocities[bound]
        aim = np.concatenate([self.constraints.aim(point.constraints, damping), aim])
        aim[m : m + len(kept)] += damping**2 * self.missed(rows, modes)
        directions = G.copy()
        spread = np.zeros((e.k, len(closed)))  # the forces along all rows that a unit of normal force causes
        for j, i in enumerate(closed):
            spread[i, j] = 1.0
            d = self.slip_direction(modes, i, rows) if modes.contacts[i] is not Mode.STICKS else None
            if d is not None:
                spread[e.slip_rows[i], j] = -rows.friction[i] * d
                directions[m + j] = rows.jacobian.T @ spread[:, j]
        sliding = [j for j, mode in enumerate(modes.frictions) if mode is not Mode.STICKS]
        senses = np.array([SENSE[modes.frictions[j]] for j in sliding])
        along = -senses[:, None] * rows.jacobian[e.friction_rows[sliding]] if sliding else np.zeros((0, n))
        right = np.zeros((n + len(G), 1 + len(sliding)))
        right[:n, 0], right[n:, 0], right[:n, 1:] = point.forcing, -aim, along.T
        redundant = self._redundant is modes
        found, units, free = _solved(point.terms.mass_matrix, G, directions, right, redundant=redundant)
        self._redundant = modes if free.size else None

        slides, holds = self._capacities_alone(point)

        def answer_of(x: Floats) -> Answer:
            forces = spread @ x[n + m : n + m + len(closed)]
            forces[bound[len(closed) :]] += x[n + m + len(closed) :]
            return Answer(x[:n], x[n : n + m], forces, holds, bound, units, free, np.zeros((e.f, len(G))))

        limit = self._sliding_forces(point, found, answer_of, sliding) if e.load_dependent else slides[sliding]
        whole = answer_of(found[:, 0] + found[:, 1:] @ limit)
        whole.forces[e.friction_rows[sliding]] = -senses * limit
        return self._with_holding(point, whole) if e.load_dependent else whole

    def _capacities_alone(self, point: MotionPoint) -> tuple[Floats, Floats]:
        """The sliding and the largest holding forces of frictions, (f,) each; 0 where they depend on other forces."""
        e, none = self.elements, np.zeros(self.elements.f)
        loads = np.zeros(self.constraints.m), np.zeros(e.k)
        return (none, none) if e.load_dependent or not e.f else e.capacities(point.state, *loads)

    def _with_holding(self, point: MotionPoint, whole: Answer) -> Answer:
        """The answer with what frictions hold at most, and with what loads add to it where these are not unique."""
        e, m = self.elements, self.constraints.m
        if not whole.free.size:
            return replace(whole, holding=e.capacities(point.state, whole.multipliers, whole.forces)[1])
        values, slopes = e.capacity_slopes(point.state, whole.multipliers, whole.forces)
        return replace(whole, holding=values[1], bears=slopes[1][:, [*range(m), *(m + row for row in whole.bound)]])

    def _sliding_forces(
        self, point: MotionPoint, found: Floats, answer_of: Callable[[Floats], Answer], sliding: list[int]
    ) -> Floats:
        """The forces of the s frictions that slide, by Newton's method, for they may depend on what other rows bear.

        ``found`` (n + r, 1 + s): the solution without these forces, and what a unit of each force adds.
        """
        e, m, whole = self.elements, self.constraints.m, [answer_of(column) for column in found.T]
        borne, limit = np.array([np.concatenate([a.multipliers, a.forces]) for a in whole]), np.zeros(len(sliding))
        for _ in range(50):
            at = borne[0] + limit @ borne[1:]
            (value, _), (slopes, _) = e.capacity_slopes(point.state, at[:m], at[m:])
            matrix = np.eye(len(sliding)) - slopes[sliding] @ borne[1:].T
            step = np.linalg.lstsq(matrix, value[sliding] - limit, rcond=None)[0]
            limit = limit + step
            if np.abs(step).max(initial=0.0) <= 1e-15 * np.abs(limit).max(initial=0.0):
                break
        return limit

    # ----------------------------------------------------------------------------------------- onto what is bound

    def projected(self, state: StateBatch, modes: Modes) -> StateBatch:
        """The single ``state`` moved until constraints, closed contacts and latches hold, in position and velocity.

        Raises SimulationError if they cannot be met.
        """
        h, (kept, stuck) = self.constraints.h, self.bound_rows(modes)
        everything = np.ones(self.n, dtype=bool)

        def at(q: Floats, qd: Floats) -> StateBatch:
            return StateBatch(state.t, q, qd, state.inputs)

        def positions(q: Floats) -> tuple[Floats, Floats]:
            values, rows = self._bound_values(at(q, state.qd))
            jacobian = np.concatenate([values[3][:h], rows.jacobian[kept]])
            return np.concatenate([values[0][:h], self.missed(rows, modes)]), jacobian * self.nominal

        q = newton(positions, state.q, everything, self.nominal) if h or kept else state.q

        def velocities(qd: Floats) -> tuple[Floats, Floats]:
            values, rows = self._bound_values(at(q, qd))
            jacobian = np.concatenate([values[3], rows.jacobian[kept + stuck]])
            return np.concatenate([values[1], rows.velocities[kept + stuck]]), jacobian * self.nominal

        qd = newton(velocities, state.qd, everything, self.nominal) if self.constraints.m or kept or stuck else state.qd
        for residual, jacobian in (positions(q), velocities(qd)):
            size = np.maximum(np.abs(jacobian).max(axis=1, initial=0.0), 1e-300)
            if np.max(np.abs(residual) / size, initial=0.0) > 1e-6:
                apart = f"residuals up to {np.abs(residual).max():.3g}"
                raise self.stops(state.t, f"constraints and closed contacts cannot hold together; {apart}")
        return at(q, qd)

    def _bound_values(self, state: StateBatch) -> tuple[Values, Rows]:
        return self._constraint_values(state), self.elements.rows(state)

    def responses(self, point: MotionPoint, modes: Modes) -> Responses:
        """What forces along rows make at ``point``; constraints and latches that hold in the ``modes`` stay met."""
        n, held = self.n, [row for row, holds in zip(self.elements.latch_rows, modes.held, strict=True) if holds]
        (_, velocities, gamma, G), rows = point.constraints, point.rows
        G = np.concatenate([G, rows.jacobian[held]])
        right = np.zeros((n + len(G), 2 + self.elements.k))
        right[:n, 0], right[n:, 0] = point.forcing, -np.concatenate([gamma, rows.gamma[held]])
        right[n:, 1] = -np.concatenate([velocities, rows.velocities[held]])
        right[:n, 2:] = rows.jacobian.T
        found, *_ = _solved(point.terms.mass_matrix, G, G, right)
        return Responses(rows, held, found[:n], found[n:])


def _solved(
    M: Floats, G: Floats, directions: Floats, right: Floats, *, redundant: bool = False
) -> tuple[Floats, Floats, Floats]:
    """[M -B^T; G 0]^-1 right with B = ``directions`` (r, n): unknowns (n + r, columns).

    Where rows are redundant, the forces are those of least norm among all with the same G^T forces, in units of each
    row's inertia: a combination of the columns of G, as those of a bed of springs. Beside the unknowns these units (r,)
    are returned, and in them an orthonormal basis of the forces that no motion feels, (r, d). ``redundant``: the rows
    were so at a point nearby, and a try without that would be in vain.
    """
    n, r = len(M), len(G)
    if not r:
        return _free(M, right), np.ones(0), np.zeros((0, 0))
    if not all(np.isfinite(x).all() for x in (M, G, directions, right)):
        return np.full_like(right, np.nan), np.ones(r), np.zeros((r, 0))
    inverse, free = None, np.zeros((r, 0))
    if r <= n and not redundant:
        scale, matrix = _scaled(M, G, directions, plain=True)
        inverse = _inverse(matrix)
    if inverse is None:
        scale, matrix = _scaled(M, G, directions, plain=False)
        loads, values, _ = np.linalg.svd(matrix[n:, :n])
        values = np.append(values, np.zeros(r - len(values)))
        free, onto = loads[:, values <= FREE], np.eye(n + r)[:, : n + int(np.sum(values > RANK * values[0]))]
        onto[n:, n:] = loads[:, values > RANK * values[0]]
        reduced = onto.T @ matrix @ onto
        inverse = _inverse(reduced)
        inverse = onto @ (np.linalg.pinv(reduced, rcond=RANK) if inverse is None else inverse) @ onto.T
    found = scale[:, None] * (inverse @ (scale[:, None] * right))
    # the bound rows are met to the last bit, so that a motion at rest stays where it is
    missed = scale[n:, None] * (right[n:] - G @ found[:n])
    found[:n] += scale[:n, None] * (inverse[:n, n:] @ missed)
    return np.asarray(found), scale[n:], free


def _inverse(matrix: Floats) -> Floats | None:
    """The inverse of a ``matrix`` (k, k) whose rows are independent; None of another one."""
    with suppress(np.linalg.LinAlgError):
        inverse = np.linalg.inv(matrix)
        if np.vdot(matrix, matrix) * np.vdot(inverse, inverse) < 1.0 / WEAK**2:
            return np.asarray(inverse)
    return None


def _free(M: Floats, right: Floats) -> Floats:
    """M^-1 right; NaN where there is none."""
    if np.isfinite(M).all() and np.isfinite(right).all():
        with suppress(np.linalg.LinAlgError):
            return np.asarray(np.linalg.solve(M, right))
    return np.full_like(right, np.nan)


def _scaled(M: Floats, G: Floats, directions: Floats, *, plain: bool) -> tuple[Floats, Floats]:
    """Factors of rows and columns (n + r,), see ``scales``, and the matrix of ``_solved`` with them, (n + r, n + r)."""
    n, r = len(M), len(G)
    scale, matrix = scales(M, G, plain), np.zeros((n + r, n + r))
    matrix[:n, :n], matrix[:n, n:], matrix[n:, :n] = M, -directions.T, G
    matrix *= scale[:, None] * scale
    return scale, matrix
