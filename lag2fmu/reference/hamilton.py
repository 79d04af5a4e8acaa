"""Hamilton's equations as a second direct integration: qd from M qd = p - b, and

    dp/dt = dL/dq + Q - dR/dqd + G^T multiplier.

Without constraints it does not use the time derivatives of M and b that the Lagrange equations contain.
Source: Landau, Lifshitz, Mechanics, section 40; Goldstein, Classical Mechanics, section 8.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from lag2fmu.deadline import check_time
from lag2fmu.description.names import velocity
from lag2fmu.errors import SimulationError
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.constraints import onward
from lag2fmu.reference.equations import Equations
from lag2fmu.reference.initial_value_problem import PULL_BACK, SCIPY_METHODS
from lag2fmu.reference.single import single_state
from lag2fmu.reference.state import Floats
from lag2fmu.reference.trajectory import Trajectory

SINGULAR = 1e12
"""Above this condition number of the scaled mass matrix, momenta do not determine velocities."""


def integrate_canonically(
    mechanism: Mechanism,
    times: ArrayLike,
    *,
    rtol: float = 1e-11,
    method: str = SCIPY_METHODS[0],
    turns: Sequence[float] = (),
) -> Trajectory:
    """q and qd at ``times`` (k,) in s by integrating (q, p) from the declared start, without inputs; SI units.

    ``rtol`` is the relative tolerance, ``method`` one of SCIPY_METHODS: a stiff mechanism takes Radau, as ``integrate``
    does. Steps end at ``turns`` (s), where the equations have kinks; a longer step would not see a short pulse. Raises
    SimulationError where M is singular, or if the integration fails. Source: Goldstein, Classical Mechanics, section
    8.1.
    """
    from scipy.integrate import solve_ivp

    grid = np.asarray(times, dtype=float)
    problem = _Canonical(mechanism)
    start = problem.start(float(grid[0]))
    options = {"rtol": rtol, "atol": rtol * problem.weights(float(grid[0]), start)}
    inner = [turn for turn in sorted({*turns}) if grid[0] < turn < grid[-1]]
    found = [start]
    for a, b in pairwise([float(grid[0]), *inner, float(grid[-1])]):
        wanted = [*grid[(grid > a) & (grid < b)].tolist(), b]
        solution = solve_ivp(problem.slope, (a, b), start, method, t_eval=wanted, **options)
        if solution.status != 0:
            raise SimulationError(f"mechanism '{mechanism.name}': Hamilton's equations: {solution.message}")
        found += list(solution.y.T[: None if b in grid else -1])
        start = problem.struck(b, solution.y[:, -1])
    q, p = np.array(found)[:, : problem.n], np.array(found)[:, problem.n :]
    qd = np.array([problem.velocity(float(t), *row) for t, *row in zip(grid, q, p, strict=True)])
    names = [c.name for c in mechanism.coordinates]
    return Trajectory(grid, (*names, *map(velocity, names)), np.concatenate([q, qd], axis=1))


class _Canonical:
    """d(q, p)/dt of ``mechanism``, z = (q, p) being (2 n,)."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.equations = Equations(mechanism)
        self.n, self.nominal = self.equations.n, np.array([c.nominal for c in mechanism.coordinates])
        # the rate (1/s) that pulls the motion back onto the constraints, as in ``initial_value_problem``
        self.damping = PULL_BACK / mechanism.experiment.step if self.equations.energies.constraints.m else 0.0
        self.single = None if self.equations.small else single_state(self.equations.energies, self.equations.scale)
        self.terms = self.equations.terms if self.single is None else self.single.terms

    def start(self, t: float) -> Floats:
        """z (2 n,) of the declared start, guesses solved for the constraints at ``t`` (s)."""
        q, qd = self.equations.energies.start(t)
        return np.concatenate([q, self.equations.momenta(t, q, qd)])

    def weights(self, t: float, z: Floats) -> Floats:
        """The units of the errors of z, (2 n,): nominal values, and M times nominal velocities."""
        momenta = np.abs(self.equations.mass_matrix(t, z[: self.n], np.zeros(self.n))) @ self.nominal
        return np.concatenate([self.nominal, np.where(momenta > 0, momenta, 1.0)])

    def velocity(self, t: float, q: Floats, p: Floats) -> Floats:
        """qd (n,) of p (n,), from M and b at zero velocities; raises SimulationError if M is singular."""
        resting = self.terms(self.equations.energies.state(t, q, np.zeros(self.n)))
        M, diagonal = resting.mass_matrix, np.diagonal(resting.mass_matrix)
        scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
        scaled = scale[:, None] * M * scale
        if not np.isfinite(scaled).all() or np.linalg.cond(scaled) > SINGULAR:
            raise SimulationError(
                f"mechanism '{self.equations.mechanism.name}' at time {t!r} s: the mass matrix is singular, so that "
                "momenta do not determine velocities"
            )
        found: Floats = scale * np.linalg.solve(scaled, scale * (p - resting.momenta))
        return found

    def struck(self, t: float, z: Floats) -> Floats:
        """z (2 n,) behind a kink of the equations that z is at: momenta that meet the constraints there.

        A corner of a constraint is an impact, p + G^T P with G M^-1 (p - b + G^T P) + phi_t = 0.
        """
        equations, constraints, q = self.equations, self.equations.energies.constraints, z[: self.n]
        if not constraints.m:
            return z
        qd = self.velocity(t, q, z[self.n :])
        beyond = equations.energies.state(t, onward(q, qd, self.nominal), qd)
        _, off, _, G = constraints(beyond)
        held = G @ np.linalg.solve(self.terms(beyond).mass_matrix, G.T)
        return np.concatenate([q, z[self.n :] - np.linalg.lstsq(held, off)[0] @ G])

    def slope(self, t: float, z: Floats) -> Floats:
        """dz/dt, (2 n,)."""
        check_time()
        qd = self.velocity(t, z[: self.n], z[self.n :])
        state = self.equations.energies.state(t, z[: self.n], qd)
        terms = self.terms(state)
        force = terms.lagrangian_slope + terms.forces - terms.dissipation_slope
        constraints = self.equations.energies.constraints
        if constraints.m:
            if self.single is None:
                multipliers, jacobian = self.equations.rates(state, self.damping)[1], constraints(state)[3]
            else:
                multipliers = self.single.rates(t, np.concatenate([z[: self.n], qd]), state.inputs, self.damping)[1]
                jacobian = self.single.jacobian
            force = force + multipliers @ jacobian
        return np.concatenate([qd, force])
