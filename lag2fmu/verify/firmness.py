"""Where constraints are about to be lost, next to singular positions, accelerations are rounding and do not judge."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lag2fmu.reference.energies import EnergyFunctions
from lag2fmu.reference.state import StateBatch, batch_first
from lag2fmu.verify.task import Floats

_WEAK, _REDUNDANT = 1e-2, 1e-8
"""Singular values of constraints of usual length: below the first one accelerations may lose the digits of ROUNDING,
which fall with its square; what is below the second one is redundant and no constraint more."""


@dataclass(frozen=True)
class Firmness:
    """What the constraints hold along a motion: the greatest ``lengths`` (m,) of their rows, and their ``rank``."""

    energies: EnergyFunctions
    lengths: Floats
    rank: int

    @classmethod
    def along(cls, energies: EnergyFunctions, motion: StateBatch) -> Firmness:
        """That along a ``motion`` of k states, in SI units."""
        lengths = np.linalg.norm(batch_first(energies.constraints(motion)[3], 2), axis=-1).max(axis=0)
        found = cls(energies, lengths, 0)
        ranks = (found._parts(motion) >= _WEAK).sum(axis=-1)
        return cls(energies, lengths, int(ranks.max(initial=0)))

    def at(self, state: StateBatch) -> NDArray[np.bool_]:
        """Which of the states (*batch) hold all that is held elsewhere, (*batch,); True without constraints."""
        parts = self._parts(state)
        between = ((parts > _REDUNDANT) & (parts < _WEAK)).any(axis=-1)
        return np.asarray(~between & ((parts >= _WEAK).sum(axis=-1) >= self.rank))

    def _parts(self, state: StateBatch) -> Floats:
        """The singular values of the constraints of usual length, (*batch, min(m, n))."""
        jacobian = batch_first(self.energies.constraints(state)[3], 2)
        length: Floats = np.maximum(np.linalg.norm(jacobian, axis=-1), self.lengths)
        parts = np.linalg.svd(jacobian / np.where(length > 0, length, 1.0)[..., None], compute_uv=False)
        return np.asarray(parts, dtype=np.float64)
