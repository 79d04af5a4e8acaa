"""Start values that meet the constraints: given ones stay, guesses are moved.

Source: P. Deuflhard, Newton Methods for Nonlinear Problems, Springer 2004, section 4.4 (steps of least norm).
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lag2fmu.description import names
from lag2fmu.description.parts import Constraint
from lag2fmu.dynamics.least_steps import least_step, relative_size, row_scales
from lag2fmu.dynamics.parts import Constraints
from lag2fmu.dynamics.starts import start_values
from lag2fmu.errors import DerivationError
from lag2fmu.graph.batches import Floats, drawn
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.language.writer import without_dust
from lag2fmu.mechanism.record import Mechanism

MET, PROJECTED = 1e-12, 1e-6
"""Residuals relative to the mechanism's size: below MET a constraint is met; below PROJECTED even given starts may be
moved onto it."""

_ITERATIONS, _HALVINGS = 60, 12
"""The most steps of Newton's method, and how often a step that makes residuals greater is halved."""
_INDEPENDENT, _TRIALS = 1e-8, 3
"""Rows of length 1 are independent beyond this singular value; places where the slopes are looked at."""
_SHOWN, _PLACES = 6, 12
"""The most names in a message, and the places from which a start that meets the constraints is looked for."""
_NEAR, _NEIGHBOURS, _NOISE = 1e-6, 6, 0.01
"""Slopes are noise if those at some neighbours, this part of the positions away, differ by a hundred times as much."""
_ONWARD = 1e-14
"""A part of the positions: a kink is passed, and no slope changes by as much as MET."""

Measure = Callable[[Floats], tuple[Floats, Floats]]
"""x (n,) -> residuals (m,) and their Jacobian in units of the nominal values (m, n)."""


def starting_consistently(mechanism: Mechanism, graph: Graph, constraints: Constraints) -> Mechanism:
    """``mechanism`` with start values that meet its constraints.

    Given values stay, guesses are moved by Newton's method. Its steps are of least norm, where coordinates are measured
    by their nominal values. Given values that miss by less than ``PROJECTED`` are moved too. Raises DerivationError,
    with the residuals, if Newton's method finds no solution; also for a constraint that is constant, and for
    constraints that leave nothing to move. Source: P. Deuflhard, Newton Methods for Nonlinear Problems, Springer 2004,
    section 4.4 (steps of least norm).
    """
    if not mechanism.constraints:
        return mechanism
    start = _Start(mechanism, graph, constraints)
    start.check_variation()
    start.solve_positions()
    start.solve_velocities()
    start.check_freedom()
    return start.moved()


def ambiguous(mechanism: Mechanism, graph: Graph, constraints: Constraints) -> frozenset[str]:
    """The names of the constraints whose multipliers are not unique at the start: G (m, n) has dependent rows there.

    These rows are found by the singular value decomposition of G: some left null vector has an entry for each of them.
    """
    if not len(constraints):
        return frozenset()
    jacobian = _Start(mechanism, graph, constraints).jacobian()
    length = np.linalg.norm(jacobian, axis=1, keepdims=True)
    left, singular, _ = np.linalg.svd(jacobian / np.where(length > 0, length, 1.0))
    null = left[:, int(np.sum(singular > _INDEPENDENT)) :]
    loose = np.abs(null).max(axis=1, initial=0.0) > 1e-6
    return frozenset(c.name for c, found in zip(mechanism.constraints, loose, strict=True) if found)


class _Start:
    """The start values q and qd, (n,), on their way to the constraints."""

    def __init__(self, mechanism: Mechanism, graph: Graph, constraints: Constraints) -> None:
        self.mechanism, self.graph, self.constraints = mechanism, graph, constraints
        q = mechanism.coordinates
        self.values = start_values(mechanism)
        self.q, self.qd = np.array([c.start for c in q]), np.array([c.velocity for c in q])
        self.nominal = np.array([c.nominal for c in q])
        self.given = np.array([c.given is not False for c in q])
        self.velocity_given = np.array([c.velocity_given is not False for c in q])

    def _evaluate(self, nodes: Sequence[Node], q: Floats, qd: Floats) -> Floats:
        for c, place, rate in zip(self.mechanism.coordinates, q, qd, strict=True):
            self.values |= {c.name: float(place), names.velocity(c.name): float(rate)}
        values: Floats = np.array(self.graph.evaluate(list(nodes), self.values))
        return values

    def _jacobian(self, q: Floats) -> Floats:
        """G in units of the nominal values, (m, n)."""
        c = self.constraints
        entries = self._evaluate([entry for row in c.jacobian for entry in row], q, self.qd)
        jacobian: Floats = entries.reshape(len(c), len(q)) * self.nominal
        return jacobian

    def jacobian(self) -> Floats:
        """G at the start in units of the nominal values, (m, n)."""
        return self._jacobian(self.q)

    def check_variation(self) -> None:
        """Raise DerivationError for a constraint that contains coordinates, or velocities, and yet is constant."""
        generator = random.Random(20)
        moves = np.zeros(len(self.constraints), dtype=bool)
        for _ in range(_TRIALS):
            q = self.q + self.nominal * [generator.uniform(-1, 1) for _ in self.q]
            moves |= self._slopes_known(q, generator)
        for k, constraint in enumerate(self.mechanism.constraints):
            if not moves[k]:
                (value,) = self._evaluate([self.constraints.residuals[k]], self.q, self.qd)
                value = value if abs(value) > MET else 0.0
                raise DerivationError(
                    f"constraints.{constraint.kind}.{constraint.name}: '{constraint.expression}' is {value:.3g} "
                    "whatever the coordinates are, so it cannot restrict the motion; leave it out or correct it"
                )

    def _slopes_known(self, q: Floats, generator: random.Random) -> NDArray[np.bool_]:
        """Which rows (m,) of G at ``q`` are more than the rounding errors that cancelling sines and cosines leave.

        In a small mechanism true slopes may be as small as such errors. But a small change of q hardly changes a
        slope, while it changes an error by its whole size.
        """
        jacobian = self._jacobian(q)
        size = np.abs(jacobian).max(axis=1)
        known: NDArray[np.bool_] = ~(size <= MET)
        if known.all():
            return known
        near = [q * (1 + _NEAR * np.array([generator.uniform(-1, 1) for _ in q])) for _ in range(_NEIGHBOURS)]
        noise = np.max([np.abs(self._jacobian(x) - jacobian).max(axis=1) for x in near], axis=0)
        known |= _NOISE * size > noise
        return known

    def check_freedom(self) -> None:
        """Raise DerivationError if the constraints leave no degree of freedom at the start, and nothing drives them."""
        c, jacobian = self.constraints, self.jacobian()
        rank = int(np.linalg.matrix_rank(row_scales(jacobian)[:, None] * jacobian, tol=_INDEPENDENT))
        drives = {"t", *(x for name in self.mechanism.driven for x in (name, names.velocity(name)))}
        driven = self.graph.symbols([*c.residuals, *c.velocities]) & drives
        if (
            rank == len(self.q)
            and not driven
            and not self._evaluate(c.velocities, self.q, np.zeros_like(self.qd)).any()
        ):
            listed = ", ".join(c.name for c in self.mechanism.constraints)
            raise DerivationError(
                f"mechanism '{self.mechanism.name}': nothing can move: {rank} of its {len(c)} constraints ({listed}) "
                f"are independent at the start, for {rank} coordinates; take at least one out"
            )

    def solve_positions(self) -> None:
        """Move the free entries of q onto the constraints; then, if the residual is below PROJECTED, all of them."""
        count = len(self.constraints.positions)

        def measure(q: Floats) -> tuple[Floats, Floats]:
            return self._evaluate(self.constraints.positions, q, self.qd), self._jacobian(q)[:count]

        for free, bar in ((~self.given, np.inf), (np.ones_like(self.given), PROJECTED)):
            if MET < relative_size(*measure(self.q)) <= bar:
                self.q = self._newton(self.q, measure, free)
        self.q = self._cleaned(self.q, [c.start for c in self.mechanism.coordinates], measure)
        self._check("the start", self.q, measure, "positions")

    def solve_velocities(self) -> None:
        """Move qd onto the constraints, free entries first; residuals count relative to the greatest velocity."""
        place = self._onward()

        def measure(qd: Floats) -> tuple[Floats, Floats]:
            return self._evaluate(self.constraints.velocities, place, qd), self._jacobian(place)

        def relative(qd: Floats) -> tuple[Floats, Floats]:
            residual, jacobian = measure(qd)
            return residual, jacobian * max(1.0, float(np.abs(qd / self.nominal).max()))

        for free, bar in ((~self.velocity_given, np.inf), (np.ones_like(self.given), PROJECTED)):
            if MET < relative_size(*relative(self.qd)) <= bar:
                self.qd = self._newton(self.qd, measure, free)
        self.qd = self._cleaned(self.qd, [c.velocity for c in self.mechanism.coordinates], relative)
        self._check(f"the {self._given_speeds()}", self.qd, measure, "velocities", relative)

    def _onward(self) -> Floats:
        """q (n,); at a kink of a constraint, a place hardly beyond it to which the start velocities go."""
        span = _ONWARD * max(1.0, float(np.abs(self.q / self.nominal).max()))
        place: Floats = self.q + span * self.qd / max(float(np.abs(self.qd / self.nominal).max()), 1e-300)
        here, there = self._jacobian(self.q), self._jacobian(place)
        kink = np.abs(there - here).max(initial=0.0) > PROJECTED * np.abs(here).max(initial=0.0)
        return place if kink and np.isfinite(there).all() else self.q

    def _given_speeds(self) -> str:
        """The start velocities that are given and that constraints concern, with their values, as a phrase."""
        concerned = np.abs(self.jacobian()).max(axis=0) > MET
        found = [
            f"{names.velocity(q.name)} = {q.velocity:.6g}"
            for q, given, moves in zip(self.mechanism.coordinates, self.velocity_given, concerned, strict=True)
            if given and moves
        ]
        shown = ", ".join([*found[:_SHOWN], *(["..."] if len(found) > _SHOWN else [])])
        return f"start velocities {shown} (SI)" if found else "velocities at the start"

    def _newton(self, x: Floats, measure: Measure, free: NDArray[np.bool_]) -> Floats:
        """x (n,) after Newton's method in its ``free`` entries; a step is halved while the residual would grow."""
        r, jacobian = measure(x)
        for _ in range(_ITERATIONS if free.any() else 0):
            if not np.isfinite(r).all() or not np.isfinite(jacobian).all() or relative_size(r, jacobian) <= 1e-3 * MET:
                break
            step = np.zeros_like(x)
            scale = row_scales(jacobian[:, free])
            step[free] = least_step(scale[:, None] * jacobian[:, free], scale * r)
            for halving in range(_HALVINGS):
                trial = x + 0.5**halving * step * self.nominal
                found, slopes = measure(trial)
                if np.linalg.norm(scale * found) < np.linalg.norm(scale * r):  # the scaled norm falls along the step
                    break
            else:
                break
            x, r, jacobian = trial, found, slopes
        return x

    def _cleaned(self, x: Floats, before: Sequence[float], measure: Measure) -> Floats:
        """x (n,) with entries that were moved by rounding errors only set back to ``before``, if the constraints
        allow it.
        """
        size = self.nominal * max(1.0, float(np.abs(x / self.nominal).max()))
        pairs = zip(x, before, size, strict=True)
        clean = np.array([new if new == old else without_dust(float(new), float(s)) for new, old, s in pairs])
        return clean if relative_size(*measure(clean)) <= max(MET, relative_size(*measure(x))) else x

    def _check(self, what: str, x: Floats, measure: Measure, level: str, relative: Measure | None = None) -> None:
        """Raise DerivationError unless ``x``, positions or velocities, meets the constraints of ``measure``.

        ``relative`` tells how large residuals are, if ``measure`` does not.
        """
        residual, jacobian = (relative or measure)(x)
        if relative_size(residual, jacobian) <= MET:
            return
        constraints = self.mechanism.constraints[: len(residual)]
        lost = ~(np.isfinite(residual) & np.isfinite(jacobian).all(axis=1))
        if lost.any():
            named = ", ".join(c.name for c, nothing in zip(constraints, lost, strict=True) if nothing)
            raise DerivationError(
                f"mechanism '{self.mechanism.name}': at {what} constraints have no value: {named}; roots of negative "
                "numbers have none, nor quotients by 0, as rates of angles at a pole: start elsewhere"
            )
        listed = ", ".join(f"{c.name} = {r:.3g}" for c, r in zip(constraints, residual, strict=True))
        raise DerivationError(
            f"mechanism '{self.mechanism.name}': {what} cannot meet the constraints; residuals: {listed}. "
            + _meaning(constraints)
            + self._remedy(x, measure, level)
        )

    def _remedy(self, x: Floats, measure: Measure, level: str) -> str:
        """The end of the message: starts nearby that meet the constraints, else the constraints that contradict."""
        given, guess = ("start", "guess") if level == "positions" else ("velocity", "guess_velocity")
        found = self._nearest(x, measure)
        if found is not None:
            of = [q.name if level == "positions" else names.velocity(q.name) for q in self.mechanism.coordinates]
            moved = [f"{name} = {new:.6g}" for name, new, old in zip(of, found, x, strict=True) if abs(new - old) > MET]
            shown = ", ".join([*moved[:_SHOWN], *(["..."] if len(moved) > _SHOWN else [])])
            reach = "; or is a part of the loop too short to close it?" if level == "positions" else ""
            return (
                f"Near it they are met by {shown} (SI): correct what is given, or give '{guess}' in place of '{given}'"
                f"{reach}"
            )
        residual, jacobian = measure(self._newton(x, measure, np.ones_like(self.given)))
        size = np.abs(residual) / np.maximum(np.abs(jacobian).max(axis=1), 1e-300)
        torn = [c.name for c, r in zip(self.mechanism.constraints, size, strict=False) if not r <= PROJECTED]
        among = f"{', '.join(torn)} contradict each other" if len(torn) > 1 else f"{torn[0]} cannot be met"
        return f"No start near it meets them: {among}; correct or take out one, or start nearer to a solution"

    def _nearest(self, x: Floats, measure: Measure) -> Floats | None:
        """The nearest (n,) of some solutions that Newton's method finds from ``x`` and random places around it."""
        generator = random.Random(7)
        turning = [q.unit is not None and q.unit.si_name == "rad" for q in self.mechanism.coordinates]
        size, found = np.where(turning, np.pi, self.nominal), list[Floats]()
        for trial in range(_PLACES):
            place = x + size * drawn(generator, 1.0, len(x)) if trial else x
            solution = self._newton(place, measure, np.ones_like(self.given))
            if relative_size(*measure(solution)) <= PROJECTED:
                found.append(solution)
                if not trial:
                    break
        return min(found, key=lambda y: float(np.abs((y - x) / size).max()), default=None)

    def moved(self) -> Mechanism:
        """The mechanism with the values found."""
        found = zip(self.mechanism.coordinates, self.q, self.qd, strict=True)
        coordinates = [replace(c, start=float(q), velocity=float(qd)) for c, q, qd in found]
        return self.mechanism.starting_at(coordinates)


def _meaning(constraints: Sequence[Constraint]) -> str:
    """A sentence on those of the ``constraints`` that are equilibria, added by the derivation; "" if there are none."""
    found = [f"{c.name} is the force on {c.coordinate}, which has no mass" for c in constraints if c.massless]
    return f"{'; '.join(found)}. " if found else ""
