"""Records of the equations of motion at a state: their terms, and the balance of the energy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lag2fmu.reference.state import Floats


@dataclass(frozen=True)
class Terms:
    """The parts of the equations at a state or batch of states, batch last, in SI units.

    - ``mass_matrix``: (n, n); ``momenta``: p = dL/dqd, (n,); ``inertial``: dM/dt qd + db/dt, (n,).
    - ``lagrangian_slope``: dL/dq, (n,); ``dissipation_slope``: dR/dqd, (n,); ``forces``: Q, (n,).
    - ``explicit_rate``: dL/dt at fixed q and qd, while motion inputs move.
    """

    mass_matrix: Floats
    momenta: Floats
    inertial: Floats
    lagrangian_slope: Floats
    dissipation_slope: Floats
    explicit_rate: Floats
    forces: Floats


@dataclass(frozen=True)
class Balance:
    """The balance of the generalized energy h = qd . p - L: ``rate`` dh/dt and ``power`` of what changes it, in W.

    power = Q . qd - qd . dR/dqd - dL/dt - multiplier . b, constraints being G qd + b = 0. ``scale`` (W) is the sum of
    the magnitudes of all powers at that instant; errors of a run are relative to its largest value. All three have the
    shape of the batch. Source: Goldstein, Classical Mechanics, section 2.7.
    """

    rate: Floats
    power: Floats
    scale: Floats

    @property
    def residual(self) -> Floats:
        """rate - power, (*batch) in W: zero to rounding for exact accelerations."""
        return self.rate - self.power


def weakness(names: Sequence[str], matrices: Floats) -> str:
    """Words that say what is wrong with one of the mass ``matrices`` (m, n, n) of the coordinates ``names`` (n,)."""
    for matrix in matrices:
        if not np.isfinite(matrix).all():
            return "the mass matrix is not finite"
        scale = np.sqrt(np.abs(np.diagonal(matrix)))
        scale = np.where(scale > 0, scale, 1.0)
        values, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
        weakest = np.argmin(np.abs(values))
        if np.abs(values[weakest]) <= 16 * len(names) * np.finfo(float).eps * np.abs(values).max():
            weak = [name for name, x in zip(names, vectors[:, weakest], strict=True) if abs(x) > 1e-6]
            return f"the mass matrix is singular in {', '.join(weak)}; these coordinates move no mass"
    return "a force or potential is not finite"
