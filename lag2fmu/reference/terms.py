"""Records of the equations of motion at a state: their terms, and the balance of the energy."""

from __future__ import annotations

from dataclasses import dataclass

from lag2fmu.reference.state import Floats


@dataclass(frozen=True)
class Terms:
    """The parts of the equations at a state or batch of states, batch last, in SI units.

    mass_matrix (n, n), momenta p = dL/dqd (n,), inertial = dM/dt qd + db/dt (n,), lagrangian_slope dL/dq (n,),
    dissipation_slope dR/dqd (n,), explicit_rate dL/dt at fixed q, qd, motion inputs moving (), forces Q (n,).
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

    power = Q . qd - qd . dR/dqd - dL/dt - multiplier . b, constraints being G qd + b = 0. ``scale`` is the sum of the
    magnitudes of all powers that flow at that instant; over a run divide by its largest value. All have the shape of
    the batch.
    """

    rate: Floats
    power: Floats
    scale: Floats

    @property
    def residual(self) -> Floats:
        """rate - power, (*batch) in W: zero to rounding for exact accelerations."""
        return self.rate - self.power
