"""Equilibria: configurations where the mechanism stays at rest, by Newton's method.

At rest and without accelerations, the residual of the equations and the constraints vanish. Steps are of least norm, so
that coordinates that no equation contains stay where they are.
Source: Hand, Finch, Analytical Mechanics, section 3.1; Goldstein, Classical Mechanics, section 6.1.
"""

from __future__ import annotations

import logging
import random
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.linalg import norm

from lag2fmu.analysis.evaluation import at, operating_inputs
from lag2fmu.deadline import LIMIT, OutOfTimeError, check_time, within
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.graph.autodiff import forward
from lag2fmu.graph.batches import Evaluator, Floats, Values, drawn, evaluate
from lag2fmu.mechanism.record import Mechanism

_SEEDS, _ITERATIONS, _HALVINGS, _RETURNS = 11, 40, 6, 4
"""Places from which equilibria are looked for, the steps of Newton's method from each, how often a step that makes
residuals greater is halved, and the moves along directions without a force back to the start."""
_MANY = 6
"""With more coordinates a third of the places is tried: each takes longer."""
_CONVERGED, _BALANCED, _FAR, _ROUNDING = 1e-12, 1e-9, 1e4, 1e-9
"""In nominal values: the steps at which the method ends, the distance at which it gives up, and what counts as 0 of a
place. Forces balance if a part of _BALANCED is left of them."""
_FALLS = 0.99
"""Where Newton's method promises that more of a residual remains, it stands where the residual is smallest."""
TURN = 2 * np.pi
_CLOSED = 1e-6
"""A gap counts as 0 down to this one (m or rad) below it."""


_LOGGER = logging.getLogger("lag2fmu")


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """The configuration ``q`` (n,) in SI units, held by the ``multipliers`` (m,), and the ``further`` states (f,)."""

    q: Floats
    multipliers: Floats
    further: Floats = field(default_factory=lambda: np.zeros(0))

    @property
    def place(self) -> Floats:
        """q and behind it the further states, (n + f,)."""
        return np.concatenate([self.q, self.further])


def equilibria(
    equations: EquationsOfMotion,
    most: int = 6,
    inputs: Mapping[str, float] | None = None,
    limit: float = LIMIT,
) -> tuple[Equilibrium, ...]:
    """The equilibria that Newton's method finds from the start and from places around it, ``most`` at most.

    All inputs have their start values, or those of ``inputs`` {name: SI value}. Two equilibria whose angles differ by
    full turns count as one. The equilibrium found from the start stands first, if there is one. Of a family of
    equilibria the member next to the start is taken. Contacts and stops exert no forces here, but what lies beyond them
    is no equilibrium. The search ends when the CPU time of ``limit`` (s) is over, with a warning of the logger
    "lag2fmu". Raises DerivationError for a name that is no input.
    Source: P. Deuflhard, Newton Methods for Nonlinear Problems, Springer 2004, section 4.4, for steps of least norm.
    """
    found: list[Equilibrium] = []
    try:
        with within(limit):
            _search(_EquilibriumSearch(equations, operating_inputs(equations, inputs)), most, found)
    except OutOfTimeError:
        _LOGGER.warning("warning: the search for equilibria took all its time and ended; it found %d", len(found))
    return tuple(found)


def _search(search: _EquilibriumSearch, most: int, found: list[Equilibrium]) -> None:
    """Put the equilibria into ``found``, ``most`` of them at most."""
    for seed in search.seeds():
        solution = search.nearest(seed)
        if solution is None or not search.reaches(solution.place):
            continue
        if not any(search.same(solution.place, other.place) for other in found):
            found.append(solution)
        if len(found) == most:
            break


def _quaternions(mechanism: Mechanism) -> Iterator[list[int]]:
    """The places of four coordinates that are the quaternion of a frame."""
    place = {q.name: i for i, q in enumerate(mechanism.coordinates)}
    for frame in mechanism.frames:
        entries = [place.get(str(entry), -1) for entry in frame.quaternion or ()]
        if entries and -1 not in entries:
            yield entries


class _EquilibriumSearch:
    """The equations at rest, r(q, z, multipliers) = 0 with n + h + m + f rows, and their derivatives.

    The f further states z rest too; configurations are (q, z), (n + f,).
    """

    def __init__(self, equations: EquationsOfMotion, values: Values) -> None:
        self.equations = equations = equations.apart()
        g, v = equations.graph, equations.variables
        c, n = equations.constraints, len(equations.forcing)
        resting = dict.fromkeys((*v.qd, *v.qdd), g.zero)
        rows = [*equations.residual[:n], *c.positions, *c.velocities[len(c.positions) :], *v.further_rates]
        self.rows = g.substitute(rows, resting)
        self.variables = (*v.q, *v.further, *v.multipliers)
        self.seeds_of = {x: g.symbol(f"d {g.leaf[x]}") for x in self.variables}
        self.balance = Evaluator(g, self.rows)
        self.changes = Evaluator(g, forward(g, self.rows, self.seeds_of))
        self.values = values
        coordinates, further = equations.mechanism.coordinates, equations.mechanism.states
        self.nominal = np.array([*(q.nominal for q in coordinates), *(z.nominal for z in further)])
        self.start = np.array([*(q.start for q in coordinates), *(z.start for z in further)])
        self.unloaded = np.zeros(len(equations.constraints))
        turning = [q.unit is not None and q.unit.si_name == "rad" for q in coordinates]
        self.angle = np.array([*turning, *(False for _ in further)])
        self.quaternions = [*_quaternions(equations.mechanism)]
        self._known: dict[bytes, Floats] = {}

    def seeds(self) -> Iterator[Floats]:
        """Places (n,) to begin at: the start, zero, the start with all angles half a turn on, and random ones.

        What stands upright hangs half a turn on; in closed chains few random places lead there. At random places angles
        have any value, quaternions are those of turns, and other coordinates are within 3 nominal values of the start.
        """
        generator = random.Random(11)
        yield self.start
        yield np.zeros_like(self.start)
        if self.angle.any():
            yield self.start - np.where(self.angle, np.pi, 0.0)
        for _ in range(_SEEDS if len(self.start) <= _MANY else _SEEDS // 3):
            around = self.start + 3 * self.nominal * drawn(generator, 1.0, len(self.start))
            for turn in self.quaternions:
                around[turn] /= norm(around[turn])
            yield np.where(self.angle, drawn(generator, np.pi, len(self.start)), around)

    def nearest(self, seed: Floats) -> Equilibrium | None:
        """The equilibrium reached from ``seed`` (n,); of a family of equilibria the member next to the start."""
        found = self.solve(seed, self.unloaded)
        if found is None and seed is self.start:
            found = self.solve(seed, self._carrying(seed))
        if found is None or seed is self.start:
            return found
        for _ in range(_RETURNS):
            neutral = self._neutral(found.place)
            away = self.nominal * (neutral @ (neutral.T @ ((found.place - self.start) / self.nominal)))
            closer = (
                self.solve(found.place - away, self.unloaded)
                if np.abs(away / self.nominal).max() > _CONVERGED
                else None
            )
            if closer is None or not self.same(closer.place, found.place):
                break
            found = closer
        return found

    def solve(self, q: Floats, multipliers: Floats) -> Equilibrium | None:
        """The equilibrium reached from q (n,), z and ``multipliers`` (m,), which Newton's method begins with.

        None if there is none, or if it lasts for an instant only.
        """
        n, x = len(q), np.concatenate([q, multipliers])
        r, size = self._residual(x), 0.0
        for _ in range(_ITERATIONS):
            slopes = self._slopes(x)
            size = max(size, float(np.abs(slopes[:, :n] * self.nominal).max(initial=0.0)))
            step = self._step(slopes, r, size)
            if step is None:
                return None
            for halving in range(_HALVINGS):
                trial = x + 0.5**halving * step
                found = self._residual(trial)
                if norm(found) < norm(r):
                    break
            else:
                if np.abs(r).max() > _BALANCED * size:
                    return None  # the residual falls nowhere along Newton's direction
            moved = float(np.abs((trial - x)[:n] / self.nominal).max())
            x, r = trial, found
            if moved < _CONVERGED * max(1.0, float(np.abs(x[:n] / self.nominal).max())):
                break
        else:
            return None
        if np.abs(r).max(initial=0.0) > _BALANCED * (size or 1.0) or np.abs(x[:n] / self.nominal).max() > _FAR:
            return None
        if not self._lasts(x, size):
            return None
        place = np.where(self.angle, x[:n] - TURN * np.round((x[:n] - 1e-9) / TURN), x[:n])
        place = np.where(np.abs(place) < _ROUNDING * self.nominal, 0.0, place)
        place, own = self._nice(place), len(self.equations.forcing)
        return Equilibrium(place[:own], x[n:], place[own:])

    def _carrying(self, q: Floats) -> Floats:
        """The multipliers (m,) that balance the forces at q (n,) and z best."""
        x = np.concatenate([q, self.unloaded])
        r, slopes = self._residual(x), self._slopes(x)
        return np.asarray(np.linalg.lstsq(slopes[:, len(q) :], -r, rcond=1e-10)[0], dtype=np.float64)

    def _nice(self, q: Floats) -> Floats:
        """``q`` with angles made exact that are, up to rounding, multiples of a quarter turn."""
        quarter = np.round(q / (np.pi / 2)) * (np.pi / 2)
        return np.where(self.angle & (np.abs(q - quarter) < _ROUNDING), quarter, q)

    def reaches(self, place: Floats) -> bool:
        """Whether no contact or stop is in the way of ``place`` (n + f,), or of the same angles next to the start."""
        turned = (place - self.start + np.pi) % TURN - np.pi
        return any(self._is_open(x) for x in (place, np.where(self.angle, self.start + turned, place)))

    def _is_open(self, place: Floats) -> bool:
        """Whether no gap is negative at ``place`` (n + f,), beyond rounding."""
        n = len(self.equations.forcing)
        values = at(self.equations, self.values, place[:n], np.zeros(n), place[n:])
        gaps = self.equations.rows.gaps[: len(self.equations.mechanism.unilaterals)]
        return bool((evaluate(self.equations.graph, gaps, values) >= -_CLOSED).all())

    def same(self, a: Floats, b: Floats) -> bool:
        """Whether ``a`` and ``b`` (n,) differ only by full turns of angles and along a family of equilibria."""
        apart = np.where(self.angle, (a - b + np.pi) % TURN - np.pi, a - b)
        neutral = self._neutral(b)
        apart = apart / self.nominal
        apart -= neutral @ (neutral.T @ apart)
        if np.abs(apart).max() < 1e-6:
            return True
        if not neutral.shape[1] or not self.equations.constraints or self._neutral(a).shape != neutral.shape:
            return False
        # along a bent family of equilibria the potential energy is constant
        one, other = self._energies(a, b)
        return abs(one - other) <= 1e-9 * (abs(one) or 1.0)

    def _energies(self, *places: Floats) -> list[float]:
        """h of the mechanism at rest at ``places``, each (n + f,)."""
        node = [self.equations.energies["generalized_energy"]]
        n = len(self.equations.forcing)
        states = (at(self.equations, self.values, x[:n], np.zeros(n), x[n:]) for x in places)
        return [float(evaluate(self.equations.graph, node, values)[0]) for values in states]

    def _neutral(self, q: Floats) -> Floats:
        """An orthonormal basis (n, k), in nominal values, of the motions from ``q`` along which no row changes.

        Most seeds lead to places that are known already, to the bit.
        """
        if q.tobytes() not in self._known:
            slopes = self._slopes(np.concatenate([q, self.unloaded]))[:, : len(q)]
            _, singular, right = np.linalg.svd(slopes * self.nominal)
            rank = int(np.sum(singular > 1e-10 * max(float(singular.max(initial=0.0)), 1e-300)))
            self._known[q.tobytes()] = np.asarray(right[rank:].T, dtype=np.float64)
        return self._known[q.tobytes()]

    def _residual(self, x: Floats, t: float = 0.0) -> Floats:
        """The rows (k,) at ``x``: q, z and multipliers."""
        return self.balance(self._at(x, t))

    def _slopes(self, x: Floats) -> Floats:
        """The derivatives (k, n + f + m) of the rows with respect to ``x``."""
        seeds = (str(self.equations.graph.leaf[node]) for node in self.seeds_of.values())
        return self.changes({**self._at(x, 0.0), **dict(zip(seeds, np.eye(len(x)), strict=True))})

    def _at(self, x: Floats, t: float) -> dict[str, float | Floats]:
        """The values of all variables where ``x`` rests, at time ``t``."""
        check_time()
        n, own, leaf = len(self.start), len(self.equations.forcing), self.equations.graph.leaf
        values = at(self.equations, {**self.values, "t": t}, x[:own], np.zeros(own), x[own:n])
        return {**values, **{str(leaf[node]): value for node, value in zip(self.variables[n:], x[n:], strict=True)}}

    def _step(self, slopes: Floats, r: Floats, size: float) -> Floats | None:
        """Newton's step of least norm, in nominal values, with rows of one size.

        None without numbers, and where it promises nothing: no place nearby balances the weight of what floats.
        """
        if not (np.isfinite(r).all() and np.isfinite(slopes).all()):
            return None
        columns = np.concatenate([self.nominal, np.ones(slopes.shape[1] - len(self.nominal))])
        scaled = slopes * columns
        largest = np.abs(scaled).max(axis=1)
        scaled, right = scaled / np.where(largest > 0, largest, 1.0)[:, None], r / np.where(largest > 0, largest, 1.0)
        step: Floats = columns * np.linalg.lstsq(scaled, -right, rcond=1e-10)[0]
        stuck = np.abs(r).max(initial=0.0) > _BALANCED * size and norm(r + slopes @ step) > _FALLS * norm(r)
        return None if stuck else step

    def _lasts(self, x: Floats, size: float) -> bool:
        """Whether the forces balance at other times too, not only at the start."""
        if self.equations.variables.t not in self.equations.graph.cone(self.rows):
            return True
        later = [np.abs(self._residual(x, t)).max(initial=0.0) for t in (0.37, 1.93, 11.1)]
        return bool(max(later) <= _BALANCED * (size or 1.0))
