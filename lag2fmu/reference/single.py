"""The equations at single states for an integration: compiled terms, and LAPACK for the linear system."""

from __future__ import annotations

import numpy as np

from lag2fmu.reference.constraints import Values
from lag2fmu.reference.energies import EnergyFunctions
from lag2fmu.reference.native import Function, native_terms
from lag2fmu.reference.state import Floats, StateBatch
from lag2fmu.reference.terms import Terms

COMPILED_AFTER, COMPILED_SOON = 1000, 100
"""The evaluations of a small mechanism, and of another one, up to which NumPy is quicker than a compiler and its
library."""


def single_state(energies: EnergyFunctions, scale: Floats) -> SingleState | None:
    """The equations of these ``energies`` compiled, with the ``scale`` (n,) of polarisation, or None: no compiler."""
    function = native_terms(energies.composition)
    return None if function is None else SingleState(energies, scale, function)


class CompiledLater:
    """The equations of ``energies`` compiled, once they were asked for so often that it pays; see ``SingleState``."""

    def __init__(self, energies: EnergyFunctions, scale: Floats, *, small: bool) -> None:
        self._of = energies, scale
        self._single: SingleState | None = None
        self._before = COMPILED_AFTER if small else COMPILED_SOON

    def asked(self) -> SingleState | None:
        """The compiled equations; None for the first times, and where there is no compiler."""
        if self._before == 0:
            self._single = single_state(*self._of)
        self._before -= 1
        return self._single


class SingleState:
    """The equations of ``energies`` (n coordinates, m constraints) at single states, by the compiled ``function``.

    The numbers are those of ``Equations``, up to rounding; ``scale`` (n,) is that of its polarisation. One object
    serves one thread, because it works in its own arrays.
    """

    def __init__(self, energies: EnergyFunctions, scale: Floats, function: Function) -> None:
        n, m = energies.n, energies.constraints.m
        self.energies, self.n, self.m, self._function = energies, n, m, function
        self._row = np.zeros(1 + 2 * n + len(energies.input_names))
        sizes = (n * n, n, n, n, n, 1, n, m, m, m, m * n)
        self._out = np.zeros(sum(sizes))
        self._constants = np.array([*energies.constants, 0.0]), scale.copy()
        self._has_sides = len(energies.constants) > len(energies.parameters)  # of kinks: they change at events
        self._pointers = [x.ctypes.data for x in (self._row, *self._constants, self._out)]
        mass, *self._parts, jacobian = np.split(self._out, np.cumsum(sizes)[:-1])
        self._mass, self.jacobian = mass.reshape(n, n), jacobian.reshape(m, n)
        self._system = np.zeros((n + m, n + m), order="F")
        self._full_rank: bool | None = None

    def terms(self, state: StateBatch) -> Terms:
        """The parts of the equations at a single ``state``, in SI units, with the shapes of ``Equations.terms``."""
        self._evaluate(float(state.t), np.concatenate([state.q, state.qd]), state.inputs)
        p, inertial, slope, dissipation, explicit, Q = (x.copy() for x in self._parts[:6])
        return Terms(self._mass.copy(), p, inertial, slope, dissipation, np.array(explicit[0]), Q)

    def constraint_values(self) -> Values:
        """What ``ConstraintFunctions`` gives, at the state that was evaluated last."""
        phi, velocities, gamma = self._parts[6:]
        return phi.copy(), velocities.copy(), gamma.copy(), self.jacobian.copy()

    def rates(self, t: float, z: Floats, inputs: Floats, damping: float = 0.0) -> tuple[Floats, Floats, float]:
        """qdd (n,), multipliers (m,), power (W) at t (s), z = (q, qd, ...) and ``inputs`` as of State.

        ``Equations.rates`` explains the three results. NaN without a solution.
        """
        self._evaluate(t, z[: 2 * self.n], inputs)
        _, inertial, slope, dissipation, explicit, Q, _, velocities, _ = self._parts
        qd = z[self.n : 2 * self.n]
        forcing = Q + slope - dissipation - inertial
        power = float(qd @ (Q - dissipation)) - float(explicit[0])
        if not self.m:
            return _accelerated(self._mass, forcing), np.empty(0), power
        qdd, multipliers = self._constrained(forcing, damping)
        return qdd, multipliers, power - float(multipliers @ (velocities - self.jacobian @ qd))

    def _evaluate(self, t: float, x: Floats, inputs: Floats) -> None:
        row = self._row
        if self._has_sides:
            self._constants[0][:-1] = self.energies.constants
        row[0], row[1 : 1 + 2 * self.n], row[1 + 2 * self.n :] = t, x, inputs
        self._function(*self._pointers)

    def _constrained(self, forcing: Floats, damping: float) -> tuple[Floats, Floats]:
        """qdd and multipliers: by elimination for independent constraints, else as ``ConstraintFunctions`` does."""
        n, constraints, (phi, velocities, gamma) = self.n, self.energies.constraints, self._parts[6:]
        values = phi, velocities, gamma, self.jacobian
        if not np.isfinite(self._out).all():
            return np.full(n, np.nan), np.full(self.m, np.nan)
        if self._full_rank is None:
            self._full_rank = constraints.has_full_rank(self.jacobian)
        if not self._full_rank:
            return constraints.solved(self._mass, forcing, values, damping)
        system = self._system
        system[:n, :n], system[:n, n:], system[n:, :n] = self._mass, self.jacobian.T, self.jacobian
        found = _solved(system, np.concatenate([forcing, -constraints.aim(values, damping)]))
        return found[:n], -found[n:]


def _accelerated(mass: Floats, forcing: Floats) -> Floats:
    """mass^-1 forcing, (n,): by Cholesky's method, which units of the coordinates do not matter to.

    Where the mass matrix is not positive definite, it is as ``_solved`` says. Source: J. W. Demmel, On floating point
    errors in Cholesky, LAPACK working note 14, 1989.
    """
    from scipy.linalg.lapack import dposv

    if not len(forcing):
        return forcing
    _, found, info = dposv(mass.T, forcing)
    return _solved(mass.T, forcing) if info else found


def _solved(matrix: Floats, right: Floats) -> Floats:
    """matrix^-1 right, (k,), by LAPACK with equilibration and refinement; NaN for a singular matrix."""
    from scipy.linalg.lapack import dgesvx

    if not len(right):
        return right
    *_, solution, _, _, _, info = dgesvx(matrix, right)
    singular = 0 < info <= len(right)  # len(right) + 1 means ill-conditioned, not singular
    found: Floats = np.full_like(right, np.nan) if singular else solution[:, 0]
    return found
