"""The equations at single states for an integration: compiled terms, and LAPACK for the linear system."""

from __future__ import annotations

import numpy as np

from lag2fmu.reference.equations import Equations
from lag2fmu.reference.native import Function, native_terms
from lag2fmu.reference.state import Floats, StateBatch
from lag2fmu.reference.terms import Terms


def single_state(equations: Equations) -> SingleState | None:
    """The equations compiled; None where there is no compiler."""
    function = native_terms(equations.mechanism)
    return None if function is None else SingleState(equations, function)


class SingleState:
    """The ``equations`` (n coordinates, m constraints) at single states, by the compiled ``function``.

    The numbers are those of ``Equations``, up to rounding. One object serves one thread, because it works in its own
    arrays.
    """

    def __init__(self, equations: Equations, function: Function) -> None:
        n, m, energies = equations.n, equations.energies.constraints.m, equations.energies
        self.equations, self.n, self.m, self._function = equations, n, m, function
        self._row = np.zeros(1 + 2 * n + len(energies.input_names))
        sizes = (n * n, n, n, n, n, 1, n, m, m, m, m * n)
        self._out = np.zeros(sum(sizes))
        self._constants = np.array([*energies.parameters.values(), 0.0]), equations.scale.copy()
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
            return _solved(np.asfortranarray(self._mass), forcing), np.empty(0), power
        qdd, multipliers = self._constrained(forcing, damping)
        return qdd, multipliers, power - float(multipliers @ (velocities - self.jacobian @ qd))

    def _evaluate(self, t: float, x: Floats, inputs: Floats) -> None:
        row = self._row
        row[0], row[1 : 1 + 2 * self.n], row[1 + 2 * self.n :] = t, x, inputs
        self._function(*self._pointers)

    def _constrained(self, forcing: Floats, damping: float) -> tuple[Floats, Floats]:
        """qdd and multipliers: by elimination for independent constraints, else as ``ConstraintFunctions`` does."""
        n, constraints, values = self.n, self.equations.energies.constraints, (*self._parts[6:], self.jacobian)
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


def _solved(matrix: Floats, right: Floats) -> Floats:
    """matrix^-1 right, (k,), by LAPACK with equilibration and refinement; NaN for a singular matrix."""
    from scipy.linalg.lapack import dgesvx

    if not len(right):
        return right
    *_, solution, _, _, _, info = dgesvx(matrix, right)
    singular = 0 < info <= len(right)  # len(right) + 1 means ill-conditioned, not singular
    found: Floats = np.full_like(right, np.nan) if singular else solution[:, 0]
    return found
