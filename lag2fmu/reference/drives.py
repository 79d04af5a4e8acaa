"""The forces that carry prescribed motions, on the independent path: each such motion y is taken as a coordinate.

The Lagrange equation of y has one more force on its right side, which is the force of the drive:

    F = d/dt dL/dy_dot - dL/dy + dR/dy_dot - Q_y - sum of multiplier * G_y.

L is quadratic in the velocities, so dL/dy_dot is half the difference of L at y_dot + 1 and y_dot - 1. All other
derivatives are complex steps. Accelerations and multipliers are those of the mechanism itself.
Sources: H. Goldstein, Classical Mechanics, sections 1.4 and 2.4; for the complex step see ``functions``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from lag2fmu.description import names
from lag2fmu.language.vocabulary import symbol
from lag2fmu.reference.composition import Composition
from lag2fmu.reference.energies import EnergyFunctions
from lag2fmu.reference.equations import Equations
from lag2fmu.reference.functions import STEP, Array
from lag2fmu.reference.state import Floats, InputValues, StateBatch, batch_first
from lag2fmu.reference.symbols import Symbols


@dataclass(frozen=True, eq=False)
class _Freed(Composition):
    """The composition of a mechanism whose k motions are its last coordinates; their accelerations are plain inputs."""

    def _symbols(self) -> Symbols:
        s = super()._symbols()
        return replace(
            s,
            q=(*s.q, *s.motion),
            qd=(*s.qd, *s.motion_dot),
            motion=(),
            motion_dot=(),
            motion_ddot=(),
            plain=(*s.motion_ddot, *s.plain),
            external=(*s.external, *(symbol(names.generalized_force(y.name)) for y in s.motion)),
            filtered=0,
        )


class DriveForces:
    """The forces F (k,) of the k motions ``names``, each in J by the unit of its motion; filtered motions stand last.

    Behind them are those of coordinates among the ports' drives, see ``description.ports.Ports``.

    ``equations`` are those of the mechanism. They know no contacts, dry friction and latches, nor do the forces.
    Source: H. Goldstein, Classical Mechanics, sections 1.4 and 2.4.
    """

    def __init__(self, equations: Equations) -> None:
        self.equations, self.n = equations, equations.n
        m = equations.mechanism
        self.names = m.driven
        self._bears = np.array([not c.massless for c in m.constraints], dtype=bool)
        self._own = [i for i, q in enumerate(m.coordinates) if q.name in m.ports.drives]
        self._given = np.array([name in m.ports.drives for name in m.driven], dtype=bool)

    @cached_property
    def _energies(self) -> EnergyFunctions:
        mechanism, values = self.equations.mechanism, self.equations.energies.parameters
        given = {p.name: values[p.name] for p in mechanism.parameters if p.value is not None}
        return EnergyFunctions(mechanism, given, _Freed(mechanism))

    @cached_property
    def _parts(self) -> Callable[[Array], Array]:
        return self._energies.velocity_part()

    def __call__(self, t: ArrayLike, q: ArrayLike, qd: ArrayLike, inputs: InputValues | None = None) -> Floats:
        """The forces, (k,) or (m, k), each in J by the unit of its motion; arguments are those of ``Equations``."""
        own = self.equations.energies.state(t, q, qd, inputs)
        if not self.names:
            return np.empty((*own.t.shape, 0))
        qdd, multipliers, _ = self.equations.rates(own)
        k, external = len(self.names), 3 * len(self.names) + len(self.equations.mechanism.plain_inputs) + self.n
        y, y_dot, y_ddot = own.inputs[:k], own.inputs[k : 2 * k], own.inputs[2 * k : 3 * k]
        rest = np.concatenate([own.inputs[2 * k : external], np.zeros_like(y), own.inputs[external:]])
        state = StateBatch(own.t, np.concatenate([own.q, y]), np.concatenate([own.qd, y_dot]), rest)
        found = self._inertial(state, np.concatenate([qdd, y_ddot])) - self._energies.forces(state)[self.n :]
        if self._energies.constraints.m:
            gradients = self._energies.constraints(state)[3]
            borne = gradients * multipliers[:, None]
            found = found - borne[self._bears, self.n :].sum(axis=0)
            if self._own:
                guides = (gradients[:, self.n :][:, ~self._given] != 0).any(axis=tuple(range(1, gradients.ndim)))
                exerted = borne[guides].sum(axis=0)
                found[self._given] += exerted[self.n :][self._given]
                found = np.concatenate([found, exerted[self._own]])
        return batch_first(found, 1)

    def _inertial(self, state: StateBatch, qdd: Floats) -> Floats:
        """d/dt dL/dy_dot - dL/dy + dR/dy_dot, (k, *batch), with the accelerations of coordinates and motions."""
        size, k = len(state.q), len(self.names)
        configuration = state.rows[: 1 + 2 * size]
        along = np.concatenate([np.ones_like(state.t)[None], state.qd, qdd])
        rows = np.repeat(configuration[:, None].astype(complex), 4 * k, axis=1)
        for j in range(k):
            place, rate = 1 + self.n + j, 1 + size + self.n + j
            rows[:, 4 * j : 4 * j + 2] += 1j * STEP * along[:, None]
            rows[rate, 4 * j] += 1.0
            rows[rate, 4 * j + 1] -= 1.0
            rows[place, 4 * j + 2] += 1j * STEP
            rows[rate, 4 * j + 3] += 1j * STEP
        K, U, R = (x.imag / STEP for x in self._parts(rows))
        found: Floats = (K[0::4] - K[1::4]) / 2 - (K[2::4] - U[2::4]) + R[3::4]
        return found
