"""Constraints as numbers, and the dense solution of the KKT system with them.

A constraint is differentiated by SymPy, once or twice along the motion. The system

    [M  -G^T] [qdd       ]   [forcing]
    [G    0 ] [multiplier] = [-gamma ]

is scaled and solved by its pseudo-inverse. The accelerations are unique also with redundant constraints (Gauss's
principle). The multipliers are those of least norm, with rows of G scaled to unit length in the metric M^-1.
Source: F. Udwadia, R. Kalaba, Analytical Dynamics, Cambridge 1996, chapters 2 and 3.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from lag2fmu.errors import SimulationError
from lag2fmu.language.vocabulary import TIME
from lag2fmu.reference.composition import Composition
from lag2fmu.reference.functions import compiled
from lag2fmu.reference.newton import TIGHT, newton, newton_together, relative
from lag2fmu.reference.state import Floats, StateBatch, batch_first, batch_last

RANK = 1e-10
"""Smaller eigenvalues of the scaled KKT matrix count as zero; they are squares of distances between rows of G."""

Values = tuple[Floats, Floats, Floats, Floats]
"""phi or A qd + b, velocities, gamma, (m, *batch) each, and G (m, n, *batch)."""

Solve = Callable[[Floats, Floats, StateBatch, float], tuple[Floats, Floats]]
"""A function as ``ConstraintFunctions.solve``."""

LOOSE, ONWARD = 1e-6, 1e-14
"""Relative: the residual to which guesses alone are moved before all entries are, and the change of a slope that is a
kink; and, in nominal values, the step over a kink, which is some roundings."""


def onward(q: Floats, qd: Floats, nominal: Floats) -> Floats:
    """q (n,) moved along qd by ``ONWARD``, in units of the ``nominal`` values (n,): beyond a kink that it is at."""
    pace, size = float(np.abs(qd / nominal).max()), max(1.0, float(np.abs(q / nominal).max()))
    moved: Floats = q + ONWARD * size * qd / max(pace, 1e-300)
    return moved


class ConstraintFunctions:
    """The constraints of a mechanism: h holonomic ones first, m in all, at states of n coordinates.

    Values are in SI units.
    """

    def __init__(self, composition: Composition, constants: Sequence[float]) -> None:
        mechanism, s = composition.mechanism, composition.symbols
        self.names = [c.name for c in mechanism.constraints]
        self.h, self.m, self.n = len(mechanism.holonomic), len(mechanism.constraints), len(s.q)
        self._constants = constants
        self._full_rank: bool | None = None  # whether G has full rank; None until it is asked
        expressions = constraint_expressions(composition)
        self._function = compiled((TIME, *s.q, *s.qd, *s.inputs, *s.parameters), expressions)

    def __call__(self, state: StateBatch) -> tuple[Floats, Floats, Floats, Floats]:
        """phi or A qd + b (m, *batch), velocities (m, *batch), gamma (m, *batch), G (m, n, *batch)."""
        m = self.m
        values: Floats = self._function(state.rows, self._constants)
        return values[:m], values[m : 2 * m], values[2 * m : 3 * m], values[3 * m :].reshape(m, self.n, *state.t.shape)

    def solve(self, mass: Floats, forcing: Floats, state: StateBatch, rate: float = 0.0) -> tuple[Floats, Floats]:
        """qdd (n, *batch) and multipliers (m, *batch) for M (n, n, *batch) and forcing (n, *batch), in SI units.

        With a ``rate`` (1/s) the constraints' accelerations are -2 rate velocity - rate^2 position instead of 0. This
        damps the drift of an integration. NaN where M, G or the right side is not finite. Source: Udwadia, Kalaba,
        Analytical Dynamics, chapter 3; J. Baumgarte, Comp. Meth. Appl. Mech. Eng. 1 (1972), pp. 1-16, for the damping.
        """
        return self.solved(mass, forcing, self(state), rate)

    def solved(self, mass: Floats, forcing: Floats, values: Values, rate: float = 0.0) -> tuple[Floats, Floats]:
        """qdd (n, *batch) and multipliers (m, *batch) as ``solve`` gives them.

        ``values`` are those of the constraints, as a call of this object returns them.
        """
        phi, jacobian = values[0], values[3]
        M, G = batch_first(mass, 2), batch_first(jacobian, 2)
        right = batch_first(np.concatenate([forcing, -self.aim(values, rate)]), 1)
        if not (np.isfinite(M).all() and np.isfinite(G).all() and np.isfinite(right).all()):
            return np.full_like(forcing, np.nan), np.full_like(phi, np.nan)
        if self._full_rank is None:
            self._full_rank = self.has_full_rank(G)
        scale = scales(M, G, self._full_rank)
        matrix = np.zeros((*M.shape[:-2], self.n + self.m, self.n + self.m))
        matrix[..., : self.n, : self.n] = M
        matrix[..., : self.n, self.n :] = np.swapaxes(G, -1, -2)
        matrix[..., self.n :, : self.n] = G
        matrix *= scale[..., :, None] * scale[..., None, :]
        found = batch_last(scale * _least(matrix, scale * right))
        return found[: self.n], -found[self.n :]

    def aim(self, values: Values, rate: float) -> Floats:
        """The negative of what G qdd has to be, (m, *batch): gamma and, with a ``rate`` (1/s), the damping of drift."""
        phi, velocity, gamma, _ = values
        if not rate:
            return gamma
        position = np.concatenate([phi[: self.h], np.zeros_like(phi[self.h :])])
        aim: Floats = gamma + 2 * rate * velocity + rate**2 * position
        return aim

    def has_full_rank(self, G: Floats) -> bool:
        """Whether the rows of G (*batch, m, n) are independent at every state.

        A row that is next to none, as at a singular position, does not tell that: its direction is rounding.
        """
        lengths = np.linalg.norm(G, axis=-1, keepdims=True)
        short = lengths <= 1e-6 * lengths.max(axis=-2, keepdims=True)
        rows = np.where(short, 0.0, G / np.maximum(lengths, 1e-300))
        return bool((np.linalg.matrix_rank(rows, tol=1e-6) == self.m).all())

    # ------------------------------------------------------------------------------------------- onto the constraints

    def consistent(
        self,
        state: Callable[[Floats, Floats], StateBatch],
        q: Floats,
        qd: Floats,
        nominal: Floats,
        free: tuple[Sequence[bool], Sequence[bool]] | None = None,
    ) -> tuple[Floats, Floats]:
        """q and qd, (n,) each, moved until the constraints hold.

        ``free`` says which entries of q and of qd are moved first; without it all entries are moved. Newton's method
        takes steps of least norm in units of the ``nominal`` values (n,), and halves them where the residual grows.
        ``state`` makes the state of (q, qd). Raises SimulationError with the residuals if a relative residual above
        1e-6 is left. Source: N. Yamashita, M. Fukushima, Computing Suppl. 15 (2001), pp. 239-249.
        """
        everything = np.ones(self.n, dtype=bool), TIGHT
        q_passes, qd_passes = (
            ([(np.array(x, dtype=bool), LOOSE), everything] for x in free) if free else 2 * ([everything],)
        )

        def positions(x: Floats) -> tuple[Floats, Floats]:
            phi, _, _, jacobian = self(state(x, qd))
            return phi[: self.h], jacobian[: self.h] * nominal

        for chosen, bar in q_passes:
            q = newton(positions, q, chosen, nominal)
            self._refuse(*positions(q), q / nominal, bar)

        place = self._onward(state, q, qd, nominal)

        def velocities(x: Floats) -> tuple[Floats, Floats]:
            _, velocity, _, jacobian = self(state(place, x))
            return velocity, jacobian * nominal

        for chosen, bar in qd_passes:
            qd = newton(velocities, qd, chosen, nominal)
            self._refuse(*velocities(qd), qd / nominal, bar)
        return q, qd

    def _onward(self, state: Callable[[Floats, Floats], StateBatch], q: Floats, qd: Floats, nominal: Floats) -> Floats:
        """q (n,), or a place hardly farther along qd if G is another one there: at a kink that side counts."""
        place = onward(q, qd, nominal)
        here, there = self(state(q, qd))[3], self(state(place, qd))[3]
        kink = np.abs(there - here).max(initial=0.0) > LOOSE * np.abs(here).max(initial=0.0)
        return place if kink and np.isfinite(there).all() else q

    def consistent_together(
        self,
        state: Callable[[Floats, Floats], StateBatch],
        q: Floats,
        qd: Floats,
        nominal: Floats,
        mobility: Floats | None = None,
    ) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """q and qd, (b, n) each, of b states moved at once, and which of them meet the constraints then, (b,).

        Full steps are enough near the constraints, as along an integration; ``consistent`` takes the states that are
        left. ``state`` makes the batch of (q, qd), ``nominal`` (n,) measures the steps. With the ``mobility``
        (b, n, n), the inverse of the mass matrix in SI units, forces of the constraints make the steps: momenta along
        the motions that are free stay.
        """

        def positions(x: Floats) -> tuple[Floats, Floats]:
            phi, _, _, jacobian = self(state(x, qd))
            return phi[: self.h].T, batch_first(jacobian[: self.h], 2) * nominal

        q, near = newton_together(positions, q, nominal, mobility)

        def velocities(x: Floats) -> tuple[Floats, Floats]:
            _, velocity, _, jacobian = self(state(q, x))
            return velocity.T, batch_first(jacobian, 2) * nominal

        qd, still = newton_together(velocities, qd, nominal, mobility)
        return q, qd, near & still

    def _refuse(self, residual: Floats, jacobian: Floats, x: Floats, bar: float) -> None:
        if not relative(residual, jacobian, x) <= bar:
            listed = ", ".join(f"{name} = {r:.3g}" for name, r in zip(self.names, residual, strict=False))
            raise SimulationError(f"the constraints cannot be met from the start values; residuals: {listed}")


@lru_cache(maxsize=16)
def constraint_expressions(composition: Composition) -> tuple[sp.Expr, ...]:
    """Values (m,), velocities (m,), gamma (m,) and G (m n,) of the constraints, one after the other."""
    constraints, s = composition.mechanism.constraints, composition.symbols
    h = sum(c.holonomic for c in constraints)
    values = [composition.written(c.expression) for c in constraints]
    velocities = [*(composition.rate(x) for x in values[:h]), *values[h:]]
    return (*values, *velocities, *accelerations_without_qdd(composition, velocities), *gradients(s.qd, velocities))


def gradients(symbols: Sequence[sp.Symbol], expressions: Sequence[sp.Expr]) -> list[sp.Expr]:
    """The derivatives of k ``expressions`` to n ``symbols``, (k n,), row by row."""
    return [expression.diff(x) for expression in expressions for x in symbols]


def accelerations_without_qdd(composition: Composition, velocities: Sequence[sp.Expr]) -> list[sp.Expr]:
    """gamma: the time derivatives of ``velocities``, which are affine in qd, with qdd = 0."""
    s = composition.symbols
    moving = dict(zip(s.q, s.qd, strict=True)) | {TIME: sp.S.One}
    moving |= dict(zip(s.motion, s.motion_dot, strict=True)) | dict(zip(s.motion_dot, s.motion_ddot, strict=True))
    moving |= dict(zip(s.further, composition.further, strict=False))  # the rates of filters stand behind
    return [sp.Add(*(w.diff(x) * rate for x, rate in moving.items())) for w in velocities]


def _least(matrix: Floats, right: Floats) -> Floats:
    """The solution of least norm, (*batch, k), for symmetric matrices (*batch, k, k), by their eigenvectors."""
    values, vectors = np.linalg.eigh(matrix)
    size = np.abs(values)
    small = size <= RANK * size.max(axis=-1, keepdims=True)
    parts = (right[..., None, :] @ vectors)[..., 0, :] / np.where(small, np.inf, values)
    solution: Floats = (vectors @ parts[..., None])[..., 0]
    return solution


def scales(M: Floats, G: Floats, plain: bool) -> Floats:
    """Factors of rows and columns of the KKT matrix, (*batch, n + m), that bring its entries to one size.

    Rows of G get unit length in the metric M^-1. Where M is singular, M + G^T W G takes its place, with a W that makes
    both terms of one size. ``plain``: G has full rank, so that the length of its rows does not matter.
    """
    diagonal, squares = np.diagonal(M, axis1=-2, axis2=-1), G * G
    size = np.abs(diagonal).max(axis=-1)[..., None] / np.maximum(squares.sum(-1), 1e-300)
    own = np.abs(diagonal + (size[..., None] * squares).sum(axis=-2))
    columns = 1.0 / np.sqrt(np.where(own > 0, own, 1.0))
    rows = G * columns[..., None, :]
    if plain:
        square = (rows * rows).sum(axis=-1)
    else:
        full = M + np.swapaxes(G, -1, -2) @ (size[..., None] * G)
        both = columns[..., :, None] * columns[..., None, :]
        values, vectors = np.linalg.eigh(M * both)
        singular = np.abs(values).min(axis=-1) * 1e12 <= np.abs(values).max(axis=-1)
        if singular.any():
            values, vectors = np.linalg.eigh(np.where(singular[..., None, None], full, M) * both)
        size = np.abs(values)
        values = np.where(size > 1e-15 * size.max(axis=-1, keepdims=True), values, np.inf)
        square = ((rows @ vectors) ** 2 / values[..., None, :]).sum(axis=-1)
    return np.concatenate([columns, 1.0 / np.sqrt(np.where(square > 0, square, 1.0))], axis=-1)
