"""The Lagrange equations of a mechanism as numbers, without a derivative of its energies being written down.

K is the part of L that contains velocities: a polynomial of second degree in qd. Polarisation at unit velocities e_i
gives M and b:

    M_ii = K(e_i) + K(-e_i) - 2 K(0),   M_ij = K(e_i + e_j) - K(e_i) - K(e_j) + K(0),   b_i = (K(e_i) - K(-e_i)) / 2

and p = dL/dqd = M qd + b. A complex step i h (qd, 1, y_dot, y_ddot) moves all these points along the motion, so that
the imaginary parts of M and b are h dM/dt and h db/dt. Complex steps at further points give dL/dq, dR/dqd and the
explicit dL/dt. Then

    M qdd = Q + dL/dq - dR/dqd - dM/dt qd - db/dt,

and constraints add their forces G^T multiplier, see ``constraints``.

Sources: H. Goldstein, Classical Mechanics, sections 1.5 and 2.7; for the complex step see ``functions``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields

import numpy as np
from numpy.typing import ArrayLike

from lag2fmu.errors import DerivationError, SimulationError
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.constraints import Solve
from lag2fmu.reference.energies import EnergyFunctions
from lag2fmu.reference.functions import BLOCK, STEP, Array
from lag2fmu.reference.state import Floats, InputValues, StateBatch, batch_first, batch_last
from lag2fmu.reference.terms import Balance, Terms, weakness

SMALL = 3
"""The number of coordinates up to which compiled equations save no time at a thousand states."""


class Equations:
    """The equations of motion of ``mechanism`` for ``parameters`` (name -> SI value; declared values otherwise).

    A state is given by t in s, q and qd (n,), and ``inputs`` name -> SI value, which hold the further states too. A
    batch of m states has t (m,), q and qd (m, n), values (m,). Raises LoadError for unknown or unusable parameters,
    DerivationError if L is not quadratic in the velocities. Source: H. Goldstein, Classical Mechanics, sections 1.5 and
    2.7. The ``energies`` are those of the mechanism, if they are at hand.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        parameters: Mapping[str, float] | None = None,
        energies: EnergyFunctions | None = None,
    ) -> None:
        self.energies = energies or EnergyFunctions(mechanism, parameters)
        self.mechanism, self.n = mechanism, self.energies.n
        self._motions = len(mechanism.driven)
        self._parts = self.energies.velocity_part()
        self._pairs, self._diagonal = np.triu_indices(self.n, 1), np.diag_indices(self.n)
        self._steps = 1j * STEP * np.eye(2 * self.n)  # along each q and qd
        self.scale = np.ones(self.n)
        self._units = self._unit_velocities()
        q, qd = self.energies.start()
        state = self.energies.state(0.0, q, qd)
        # powers of two as velocities of about equal energy, so that coordinates of different units lose no digits
        diagonal = np.diagonal(self.terms(state).mass_matrix)
        usable = np.isfinite(diagonal) & (diagonal > 1e-30 * np.nanmax(np.abs(diagonal), initial=0.0))
        self.scale = np.exp2(-np.round(0.5 * np.log2(np.where(usable, diagonal, 1.0))))
        self._units = self._unit_velocities()
        self._check_degree(state)

    @property
    def small(self) -> bool:
        """Whether NumPy evaluates a state fast: few coordinates, no constraints, nothing on frames."""
        return self.n <= SMALL and not self.energies.constraints.m and self.energies.spatial.empty

    # -------------------------------------------------------------------------------------------- what users ask for

    def accelerations(self, t: ArrayLike, q: ArrayLike, qd: ArrayLike, inputs: InputValues | None = None) -> Floats:
        """qdd (n,) or (m, n), in SI units. Raises SimulationError where M is singular or a value is not finite."""
        return batch_first(self.solved(self.energies.state(t, q, qd, inputs))[0], 1)

    def multipliers(self, t: ArrayLike, q: ArrayLike, qd: ArrayLike, inputs: InputValues | None = None) -> Floats:
        """The constraints' multipliers (m,) or (batch, m), in W by the unit of the constraint's rate."""
        return batch_first(self.rates(self.energies.state(t, q, qd, inputs))[1], 1)

    def residuals(self, t: ArrayLike, q: ArrayLike, qd: ArrayLike, inputs: InputValues | None = None) -> Floats:
        """What the constraints demand to be zero: phi, or A qd + b, (m,) or (batch, m), in SI units."""
        return batch_first(self.energies.constraints(self.energies.state(t, q, qd, inputs))[0], 1)

    def kinetic_energy(self, t: ArrayLike, q: ArrayLike, qd: ArrayLike, inputs: InputValues | None = None) -> Floats:
        """T in J, () or (m,)."""
        kinetic, _, _ = self.energies.energies(self.energies.state(t, q, qd, inputs))
        return np.asarray(kinetic)

    def potential_energy(self, t: ArrayLike, q: ArrayLike, qd: ArrayLike, inputs: InputValues | None = None) -> Floats:
        """V in J, () or (m,)."""
        _, potential, _ = self.energies.energies(self.energies.state(t, q, qd, inputs))
        return np.asarray(potential)

    def generalized_energy(
        self, t: ArrayLike, q: ArrayLike, qd: ArrayLike, inputs: InputValues | None = None
    ) -> Floats:
        """h = qd . p - L in J, () or (m,)."""
        h: Floats = self._generalized_energy(self._rows(self.energies.state(t, q, qd, inputs), 3)).real
        return h

    def momenta(self, t: ArrayLike, q: ArrayLike, qd: ArrayLike, inputs: InputValues | None = None) -> Floats:
        """p = dL/dqd, (n,) or (m, n), in J.s by the unit of q."""
        return batch_first(self.terms(self.energies.state(t, q, qd, inputs)).momenta, 1)

    def mass_matrix(self, t: ArrayLike, q: ArrayLike, qd: ArrayLike, inputs: InputValues | None = None) -> Floats:
        """M = d2L/dqd2, (n, n) or (m, n, n), in J.s2 by the units of both q."""
        return batch_first(self.terms(self.energies.state(t, q, qd, inputs)).mass_matrix, 2)

    def outputs(
        self, t: ArrayLike, q: ArrayLike, qd: ArrayLike, inputs: InputValues | None = None
    ) -> dict[str, Floats]:
        """{name: values () or (m,)} of the mechanism's outputs, one for each entry of a vector, in SI units."""
        state = self.energies.state(t, q, qd, inputs)
        return self.energies.outputs(state, self.rates(state)[:2])

    def balance(
        self, t: ArrayLike, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, inputs: InputValues | None = None
    ) -> Balance:
        """The balance of energy at given states and accelerations qdd (n,) or (m, n), for instance those of an FMU.

        dh/dt is the complex step of h along (qd, qdd), so that the mass matrix is not used. Source: Goldstein,
        Classical Mechanics, section 2.7 (the energy function).
        """
        state = self.energies.state(t, q, qd, inputs)
        x = batch_last(np.broadcast_to(np.asarray(qdd, dtype=float), np.shape(q)))
        rows = self._rows(state, 3)
        self._move(rows[:, :], state)
        rows[1 + self.n : 1 + 2 * self.n] += 1j * STEP * x[:, None]
        rate = self._generalized_energy(rows).imag / STEP
        terms = self.terms(state)
        inertia = np.einsum("ij...,j...->i...", np.abs(terms.mass_matrix), np.abs(x))
        parts = [terms.forces, terms.dissipation_slope, terms.lagrangian_slope, terms.inertial, inertia]
        multipliers = self.rates(state, terms=terms)[1]
        moved = self._constraint_power(state, multipliers)
        if self.energies.constraints.m:  # their forces cancel in the sum, and their rounding does not
            parts.append(
                np.einsum("k...,ki...->i...", np.abs(multipliers), np.abs(self.energies.constraints(state)[3]))
            )
        scale = np.abs(terms.explicit_rate) + np.abs(moved) + sum(np.abs(state.qd * part).sum(axis=0) for part in parts)
        return Balance(rate, self._power(state, terms) + moved, scale)

    # ------------------------------------------------------------------------------------------------- how it is done

    def rates(
        self, state: StateBatch, damping: float = 0.0, terms: Terms | None = None, solve: Solve | None = None
    ) -> tuple[Floats, Floats, Floats]:
        """qdd (n, *batch), multipliers (m, *batch) and the power (*batch,), in W, that changes h.

        NaN where there is no solution. ``damping`` (1/s) pulls the motion back onto the constraints, see
        ``ConstraintFunctions.solve``, or ``solve``. ``terms`` are those of the ``state``, if they are known.
        """
        terms = terms or self.terms(state)
        forcing = terms.forces + terms.lagrangian_slope - terms.dissipation_slope - terms.inertial
        if self.energies.constraints.m:
            qdd, multipliers = (solve or self.energies.constraints.solve)(terms.mass_matrix, forcing, state, damping)
            return qdd, multipliers, self._power(state, terms) + self._constraint_power(state, multipliers)
        return self._unconstrained(terms, forcing), np.empty((0, *state.t.shape)), self._power(state, terms)

    def solved(self, state: StateBatch) -> tuple[Floats, Floats]:
        """qdd (n, *batch) and multipliers (m, *batch) in SI units.

        Raises SimulationError where M is singular or an acceleration is not finite.
        """
        qdd, multipliers, _ = self.rates(state)
        if not np.isfinite(qdd).all():
            raise SimulationError(
                f"{self._where(state, qdd)}: the accelerations are not finite ({self.weakness(state)})"
            )
        return qdd, multipliers

    def _unconstrained(self, terms: Terms, forcing: Floats) -> Floats:
        """M^-1 forcing"""
        try:
            solution = np.linalg.solve(batch_first(terms.mass_matrix, 2), batch_first(forcing, 1)[..., None])
            return batch_last(np.asarray(solution[..., 0], dtype=np.float64))
        except np.linalg.LinAlgError:
            return np.full_like(forcing, np.nan)

    def terms(self, state: StateBatch) -> Terms:
        """The parts of the equations at ``state``, by polarisation and complex steps, see the module.

        Long batches are evaluated in blocks, which bounds the memory.
        """
        size = max(1, BLOCK // (self._units.shape[1] + 2 * self.n + 1))
        if state.t.ndim != 1 or len(state.t) <= size:
            return self._terms(state)
        parts = [self._terms(state.part(slice(i, i + size))) for i in range(0, len(state.t), size)]
        return Terms(*(np.concatenate([getattr(part, f.name) for part in parts], axis=-1) for f in fields(Terms)))

    def weakness(self, state: StateBatch) -> str:
        """Words that say what is wrong with the mass matrix at one of the states, and name the coordinates."""
        names = [c.name for c in self.mechanism.coordinates]
        if not names:
            return "all coordinates are prescribed"
        matrices = batch_first(self.terms(state).mass_matrix, 2).reshape(-1, self.n, self.n)
        if m := self.energies.constraints.m:
            jacobian = batch_first(self.energies.constraints(state)[3], 2).reshape(-1, m, self.n)
            size = np.abs(matrices).max(axis=(1, 2)) / np.maximum((jacobian**2).max(axis=(1, 2)), 1e-300)
            matrices = matrices + np.swapaxes(jacobian, 1, 2) @ (size[:, None, None] * jacobian)
        return weakness(names, matrices)

    def _terms(self, state: StateBatch) -> Terms:
        n, units = self.n, self._units.shape[1]
        rows = self._rows(state, units + 2 * n + 1)
        batch = (1,) * state.t.ndim
        rows[1 + n : 1 + 2 * n, :units] = self._units.reshape(n, units, *batch)
        self._move(rows[:, :units], state)
        rows[1 : 1 + 2 * n, units:-1] += self._steps.reshape(2 * n, 2 * n, *batch)
        self._move(rows[:, -1:], state, explicit=True)
        K, U, R = self._parts(rows)
        matrix, linear = self._polarised(K[:units])
        momenta = np.einsum("ij...,j...->i...", matrix, state.qd) + linear
        lagrangian = K[units:] - U[units:]
        return Terms(
            matrix.real,
            momenta.real,
            momenta.imag / STEP,
            lagrangian[:n].imag / STEP,
            R[units + n : units + 2 * n].imag / STEP,
            lagrangian[-1].imag / STEP,
            self.energies.forces(state),
        )

    def _unit_velocities(self) -> Floats:
        """The points of polarisation (n, 1 + 2 n + n (n - 1) / 2): 0, e_i, -e_i, e_i + e_j for i < j, scaled."""
        unit = np.diag(self.scale)
        i, j = self._pairs
        return np.concatenate([np.zeros((self.n, 1)), unit, -unit, unit[:, i] + unit[:, j]], axis=1)

    def _polarised(self, K: Array) -> tuple[Array, Array]:
        """M (n, n, *batch) and b (n, *batch) from K at ``_unit_velocities`` (points, *batch)."""
        n, (i, j) = self.n, self._pairs
        zero, plus, minus = K[0], K[1 : 1 + n], K[1 + n : 1 + 2 * n]
        matrix = np.empty((n, n, *K.shape[1:]), K.dtype)
        matrix[self._diagonal] = plus + minus - 2 * zero
        matrix[i, j] = matrix[j, i] = K[1 + 2 * n :] - plus[i] - plus[j] + zero
        scale = self.scale.reshape(n, *(1,) * (K.ndim - 1))
        return matrix / (scale[:, None] * scale), (plus - minus) / (2 * scale)

    def _generalized_energy(self, rows: Array) -> Array:
        """h (*batch,), in J, at rows (rows, 3, *batch), from the even part of K: without K(0) it is qd . M qd / 2."""
        rows[1 + self.n : 1 + 2 * self.n, 1] *= -1
        rows[1 + self.n : 1 + 2 * self.n, 2] = 0
        K, U, _ = self._parts(rows)
        h: Array = (K[0] + K[1]) / 2 - 2 * K[2] + U[0]
        return h

    def _rows(self, state: StateBatch, points: int) -> Array:
        """t, q, qd, y, y_dot of ``state`` at ``points`` equal points, complex: (1 + 2 n + 2 k, points, *batch)."""
        stacked = state.rows[: 1 + 2 * self.n + 2 * self._motions]
        rows = np.empty((len(stacked), points, *state.t.shape), complex)
        rows[...] = stacked[:, None]
        return rows

    def _move(self, rows: Array, state: StateBatch, explicit: bool = False) -> None:
        """Add the complex step along the motion to ``rows``: t and motion inputs, and q unless ``explicit``."""
        n, k, step = self.n, self._motions, 1j * STEP
        rows[0] += step
        if not explicit:
            rows[1 : 1 + n] += step * state.qd[:, None]
        rows[1 + 2 * n :] += step * state.inputs[k : 3 * k, None]

    def _power(self, state: StateBatch, terms: Terms) -> Floats:
        """Q . qd - qd . dR/dqd - dL/dt, in W."""
        power: Floats = (state.qd * (terms.forces - terms.dissipation_slope)).sum(axis=0) - terms.explicit_rate
        return power

    def _constraint_power(self, state: StateBatch, multipliers: Floats) -> Floats:
        """-multiplier . b, in W: the power that moving constraints put into the mechanism."""
        if not self.energies.constraints.m:
            return np.zeros(state.t.shape)
        _, velocities, _, jacobian = self.energies.constraints(state)
        moving = velocities - np.einsum("ki...,i...->k...", jacobian, state.qd)
        power: Floats = -(multipliers * moving).sum(axis=0)
        return power

    def _where(self, state: StateBatch, values: Floats) -> str:
        """Mechanism and time of the first value that is not finite."""
        bad = ~np.isfinite(values).all(axis=0)
        return f"mechanism '{self.mechanism.name}' at time {float(np.atleast_1d(state.t)[np.atleast_1d(bad)][0])!r} s"

    def _check_degree(self, state: StateBatch) -> None:
        """Raise DerivationError unless the third difference of K along a velocity vanishes."""
        rows = self._rows(state, 4)
        direction = self.scale * np.cos(np.arange(1, self.n + 1))
        rows[1 + self.n : 1 + 2 * self.n] = np.outer(direction, [2, 1, 0, -1])
        K = self._parts(rows)[0].real * [1, -3, 3, -1]
        if np.isfinite(K).all() and abs(K.sum()) > 1e-9 * np.abs(K).sum():
            raise DerivationError(
                f"mechanism '{self.mechanism.name}': the energies are not quadratic in the velocities (third "
                f"difference {K.sum():.3g} J); supported are kinetic energies of second and potentials of first degree"
            )
