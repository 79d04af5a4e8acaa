"""Singular positions, at which constraints are lost for a moment: parallel cranks in one line, a folded rhombus.

Next to them rounding of the positions turns the velocities by its size over the square of the distance, and would
choose the branch on which the motion goes on. Very near them such a direction is left out, for as short a time as the
distance is small. Source: O. A. Bauchau, A. Laulusa, Review of contemporary approaches for constraint enforcement in
multibody systems, J. Comput. Nonlinear Dyn. 3 (2008), 011005.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lag2fmu.reference.constraints import ConstraintFunctions
from lag2fmu.reference.state import Floats, StateBatch, batch_first, batch_last

LOST = 1e-8
"""The square of the distance, in units of the greatest one so far, below which a direction is left out: there what the
rounding of double precision changes and what leaving it out does are about alike."""
NEAR = 1e-4
"""The square from which on stages of a step may come that near."""
_REGULAR = 1e-10
"""The least eigenvalue of a scaled matrix that can be solved with."""
_DISTINCT = 1e-9
"""The least eigenvalue of the scaled constraints that belongs to a direction of its own."""


class LostRows:
    """How far the rows of ``constraints`` (m) are from being lost along a run of n coordinates."""

    def __init__(self, constraints: ConstraintFunctions) -> None:
        self._constraints = constraints
        self._steepest, self._lengths = np.zeros(constraints.m), np.zeros(constraints.m)
        self._rank, self._usual = 0, 0.0
        self.near, self.lost = False, False
        self.mobility: Floats | None = None

    def look(self, mass: Floats, state: StateBatch) -> None:
        """Tells from now on of ``state``, one or several, with its mass matrices (n, n, *batch), in SI units.

        ``near``: directions are so near to being lost that ``solve`` is wanted. ``lost``: they are left out.
        ``mobility`` (b, n, n): what forces of constraints move by, the inverse of the mass matrix; None without it.
        """
        found = self._squares(mass, state)
        self._rank = max(self._rank, int(((found > _DISTINCT) & np.isfinite(found)).sum(axis=-1).max()))
        weakest = self._weakest(found)
        self._usual = max(self._usual, *weakest[np.isfinite(weakest)], 0.0)
        self.near = bool((weakest < NEAR * self._usual).any())
        self.lost = bool((weakest < LOST * self._usual).any())

    def near_at(self, mass: Floats, state: StateBatch) -> NDArray[np.bool_]:
        """Which of the states (b,) are near, (b,), as ``look`` says; nothing follows from it."""
        found: NDArray[np.bool_] = self._weakest(self._squares(mass, state)) < NEAR * self._usual
        return found

    def _squares(self, mass: Floats, state: StateBatch) -> Floats:
        """The squares of distances of the rows from each other, (b, m); infinite without accelerations.

        Their greatest lengths are those up to here, and the mobility is that here.
        """
        self.mobility = None
        M, G = batch_first(mass, 2), batch_first(self._constraints(state)[3], 2)
        if not np.isfinite(G).all():
            return np.full((np.size(state.t), len(self._lengths)), np.inf)
        self._steepest = np.maximum(self._steepest, np.linalg.norm(G, axis=-1).reshape(-1, len(G[0])).max(axis=0))
        metric = self._metric(M, G)[0]
        if not _is_regular(metric):
            return np.full((np.size(state.t), len(self._lengths)), np.inf)
        inverse = np.asarray(np.linalg.inv(metric), dtype=np.float64)
        self.mobility = inverse.reshape(-1, *inverse.shape[-2:])
        response = inverse @ np.swapaxes(G, -1, -2)
        lengths = np.sqrt(np.abs(np.einsum("...kn,...nk->...k", G, response)))
        self._lengths = np.maximum(self._lengths, lengths.reshape(-1, len(self._lengths)).max(axis=0))
        squares = np.linalg.eigvalsh(self._scaled(G, response)).reshape(-1, len(self._lengths))
        return np.asarray(squares, dtype=np.float64)

    def _weakest(self, squares: Floats) -> Floats:
        """Of ``squares`` (b, m) those of the weakest direction that is not redundant, (b,)."""
        return np.abs(squares[:, -self._rank]) if self._rank else np.full(len(squares), np.inf)

    def solve(self, mass: Floats, forcing: Floats, state: StateBatch, rate: float = 0.0) -> tuple[Floats, Floats]:
        """qdd (n, *batch) and multipliers (m, *batch) as of ``ConstraintFunctions.solve``, but for lost directions.

        They are left out; up to ``LOST`` their part grows smoothly from 0 to all of it.
        """
        values = self._constraints(state)
        M, G, right = batch_first(mass, 2), batch_first(values[3], 2), batch_first(forcing, 1)
        if not (np.isfinite(M).all() and np.isfinite(G).all() and np.isfinite(right).all()):
            return np.full_like(forcing, np.nan), np.full_like(values[0], np.nan)
        metric, weighed = self._metric(M, G)
        aim = batch_first(self._constraints.aim(values, rate), 1)[..., None]
        columns = np.concatenate([np.swapaxes(G, -1, -2), right[..., None] - weighed @ aim], axis=-1)
        if not _is_regular(metric):
            return np.full_like(forcing, np.nan), np.full_like(values[0], np.nan)
        response, free = np.split(np.linalg.solve(metric, columns), [self._constraints.m], axis=-1)
        aim = (aim + G @ free)[..., 0]
        scale = self._scale()
        parts, vectors = np.linalg.eigh(self._scaled(G, response))
        kept = _smooth((np.abs(parts) / (LOST * self._usual) - 0.1) / 0.9)
        along = (np.swapaxes(vectors, -1, -2) @ (scale * aim)[..., None])[..., 0]
        weights = along * kept / np.where(kept > 0, parts, 1.0)
        multipliers = -scale * (vectors @ weights[..., None])[..., 0]
        qdd = free[..., 0] + (response @ multipliers[..., None])[..., 0]
        return batch_last(qdd), batch_last(multipliers)

    def _metric(self, M: Floats, G: Floats) -> tuple[Floats, Floats]:
        """M + G^T W G, (*batch, n, n), and G^T W; W makes both terms of one size. They give the same accelerations.

        M alone is singular where coordinates carry no mass.
        """
        size = np.abs(np.diagonal(M, axis1=-2, axis2=-1)).max(axis=-1)[..., None, None]
        weighed = size * np.swapaxes(G, -1, -2) / np.where(self._steepest > 0, self._steepest, 1.0) ** 2
        return M + weighed @ G, weighed

    def _scale(self) -> Floats:
        """Of the rows, (m,): one over their greatest length so far."""
        found: Floats = 1.0 / np.where(self._lengths > 0, self._lengths, 1.0)
        return found

    def _scaled(self, G: Floats, response: Floats) -> Floats:
        """D G A^-1 G^T D, (*batch, m, m), of G (*batch, m, n) and ``response`` A^-1 G^T; D are ``_scale``."""
        scale = self._scale()
        return np.asarray(scale[:, None] * (G @ response) * scale, dtype=np.float64)


def _is_regular(M: Floats) -> bool:
    """Are the symmetric matrices (*batch, n, n) positive definite beyond rounding?"""
    diagonal = np.diagonal(M, axis1=-2, axis2=-1)
    if not np.isfinite(M).all() or not (diagonal > 0).all():
        return False
    scale = 1.0 / np.sqrt(diagonal)
    least = np.linalg.eigvalsh(M * scale[..., :, None] * scale[..., None, :]).min()
    return bool(least > _REGULAR)


def _smooth(x: Floats) -> Floats:
    """0 up to x = 0, 1 from x = 1 on, with two continuous derivatives."""
    x = np.clip(x, 0.0, 1.0)
    found: Floats = x**3 * (10 - 15 * x + 6 * x**2)
    return found
