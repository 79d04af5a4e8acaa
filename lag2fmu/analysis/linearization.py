"""The linearized equations about a state, on the constraint manifold.

The tangent program gives dqdd by the seeds (dq, dqd, du). Small motions meet the linearized constraints on positions
and velocities. So they are a linear function of as many independent coordinates and velocities as the manifold has
dimensions, of the further states, and of the inputs. With z, the independent ones and the further states,

    dz/dt = A z + B u,    y = C z + D u.

At an equilibrium the same residual gives M, the damping and the stiffness matrix, with the part of the multipliers.
Source: Landau, Lifshitz, Mechanics, section 23; J. G. de Jalon, E. Bayo, Kinematic and Dynamic Simulation of Multibody
Systems, 1994, section 5.3, for independent coordinates of a null space.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from functools import lru_cache

import numpy as np

from lag2fmu.analysis.evaluation import at, further_names, operating_inputs, saddle, unknowns
from lag2fmu.analysis.state_space import Linearization
from lag2fmu.analysis.subspaces import RANK, independent_rows, null_space
from lag2fmu.description import names
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.tangent import Tangent, differentiate
from lag2fmu.errors import DerivationError
from lag2fmu.graph.batches import Floats, Values, evaluate, matrix
from lag2fmu.graph.derivatives import steep_roots
from lag2fmu.graph.nodes import Node
from lag2fmu.language.given import check_names
from lag2fmu.language.identifiers import suggestion


class Linearizer:
    """The tangent program of ``equations``, derived once for many states; a call linearizes at one of them.

    Source: J. G. de Jalon, E. Bayo, Kinematic and Dynamic Simulation of Multibody Systems, 1994, section 5.3.
    """

    def __init__(self, equations: EquationsOfMotion) -> None:
        self.equations = equations = equations.apart()
        self.tangent: Tangent = differentiate(equations)
        v, g = equations.variables, equations.graph
        self.inputs = tuple(str(g.leaf[node]) for node in v.inputs)
        self.size = len(v.states)
        self.outputs = tuple(equations.outputs)
        self.nodes = dict(equations.locals())
        self.tangents = dict(zip(self.nodes, self.tangent.locals, strict=True))
        self.variables = [str(g.leaf[node]) for node in (*v.states, *v.unknowns)]

    def telling(self, outputs: Sequence[str]) -> Linearizer:
        """The same with ``outputs``, the names of the entries of y; raises DerivationError for an unknown name.

        Raises LoadError for what is no list.
        """
        check_names("outputs", outputs)
        for name in outputs:
            if name not in self.nodes and name not in self.variables:
                remedy = suggestion(name, [*self.variables, *self.nodes])
                raise DerivationError(f"mechanism '{self.equations.mechanism.name}': '{name}' is no output; {remedy}")
        other = copy(self)
        other.outputs = tuple(outputs)
        return other

    def at_rest(self, q: Floats, further: Floats) -> Linearization:
        """The linearization about rest at q (n,) with ``further`` states (f,), inputs having their start values."""
        return self(_state(self.equations, q, np.zeros_like(q), further=further))

    @np.errstate(all="ignore")  # values that are not finite raise errors below
    def __call__(self, values: Values) -> Linearization:
        """The linearization about the state ``values`` {variable: SI value}, which has to meet the constraints.

        Raises DerivationError where M is singular or not finite.
        """
        e, n = self.equations, len(self.equations.forcing)
        m = len(e.constraints)
        labels = [str(e.graph.leaf[node]) for node in e.variables.unknowns]
        M, G = (matrix(e.graph, r, values, n) for r in (e.mass_matrix, e.constraints.jacobian))
        qdd, multipliers, inverse = self._motion(values, M, G)
        values = {**values, **dict(zip(labels, [*qdd, *multipliers], strict=True))}
        rows = self._residual(values)
        if not (np.isfinite(inverse).all() and self._bounded(rows, self.tangent.residual, values)):
            raise DerivationError(
                f"mechanism '{e.mechanism.name}': the equations have no finite derivatives at the state"
            )
        self._check_mass(M, G)
        moved = -inverse @ rows[: n + m]  # (n + m, s + r), dqdd and dmultipliers by every seed
        bound = rows[n + m :]
        chosen, shape, push = self._free_states(bound)
        further = self._moved(self.tangent.further, values, moved)
        rate = np.concatenate([np.eye(n, self.size + len(self.inputs), n), moved[:n], further])
        if not self._bounded(rate, self.tangent.further, values):
            raise DerivationError(
                f"mechanism '{e.mechanism.name}': a further state has no finite derivatives at the state"
            )
        by_state, by_input = rate[:, : self.size], rate[:, self.size :]
        y = self._outputs(values, moved)
        C, D = y[:, : self.size], y[:, self.size :]
        coordinates = [c.name for c in e.mechanism.coordinates]
        everything = [*coordinates, *map(names.velocity, coordinates), *further_names(e)]
        rates = [*(values[name] for name in map(names.velocity, coordinates)), *qdd]
        rates += evaluate(e.graph, e.variables.further_rates, values).tolist()
        return Linearization(
            mechanism=e.mechanism,
            values=values,
            states=tuple(everything[i] for i in chosen),
            inputs=self.inputs,
            outputs=self.outputs,
            A=(by_state @ shape)[chosen],
            B=(by_input + by_state @ push)[chosen],
            C=C @ shape,
            D=D + C @ push,
            drift=np.array(rates, dtype=np.float64)[chosen],
            level=self._levels(values),
            shape=shape,
            mass=M,
            damping=rows[:n, n : 2 * n],
            stiffness=rows[:n, :n],
            action=-rows[:n, self.size :],
            tangent=shape[:n, : sum(i < n for i in chosen)],
        )

    def _bounded(self, found: Floats, nodes: Sequence[Node], values: Values) -> bool:
        """Whether all derivatives ``found``, of ``nodes`` (k,), are finite, and no root begins to rise from 0 there."""
        g = self.equations.graph
        steep = (evaluate(g, root, values) for root in steep_roots(g, nodes))
        return bool(np.isfinite(found).all()) and not any(root[0] == 0 and (root[1:] == 0).any() for root in steep)

    def _motion(self, values: Values, M: Floats, G: Floats) -> tuple[Floats, Floats, Floats]:
        """Accelerations (n,), multipliers (m,) and the inverse (n + m, n + m) of the system that both solve."""
        e = self.equations
        if e.constraints is e.permanent:
            return *unknowns(e, values), saddle(e, M, G)
        from lag2fmu.analysis.present_modes import solved

        return solved(e, values)

    def _outputs(self, values: Values, moved: Floats) -> Floats:
        """The outputs by q, qd, z and u, (o, s + r); ``moved`` (n + m, s + r) are accelerations and multipliers."""
        seeds = np.eye(self.size, self.size + len(self.inputs))
        known = dict(zip(self.variables, [*seeds, *moved], strict=True))
        calculated = [name for name in self.outputs if name in self.tangents]
        known |= zip(calculated, self._moved([self.tangents[x] for x in calculated], values, moved), strict=True)
        return np.array([known[name] for name in self.outputs]).reshape(-1, seeds.shape[1])

    def _levels(self, values: Values) -> Floats:
        """The values of the outputs, (o,)."""
        calculated = [name for name in self.outputs if name in self.nodes]
        found = evaluate(self.equations.graph, [self.nodes[name] for name in calculated], values)
        known = {**values, **dict(zip(calculated, found, strict=True))}
        return np.array([known[name] for name in self.outputs], dtype=np.float64)

    def _check_mass(self, M: Floats, G: Floats) -> None:
        """Raise DerivationError unless M (n, n) is regular on the motions that G (m, n) leaves free."""
        nominal = np.array([c.nominal for c in self.equations.mechanism.coordinates])
        rows = G * nominal
        length = np.linalg.norm(rows, axis=1, keepdims=True)
        free = nominal[:, None] * null_space(rows / np.where(length > 0, length, 1.0))
        inertia = free.T @ M @ free
        size = np.sqrt(np.abs(np.diagonal(inertia)))
        if not len(size):  # nothing is free there
            return
        if not (size > 0).all() or np.linalg.cond(inertia / np.outer(size, size)) > 1e12:
            raise DerivationError(
                f"mechanism '{self.equations.mechanism.name}': the mass matrix is singular at the state, the "
                "coordinates do not describe small motions there; choose other coordinates"
            )

    def _residual(self, values: Values) -> Floats:
        """Derivatives of the equations, and of the constraints' velocities and positions, by q, qd, z and u."""
        seeds = [*self.tangent.dx, *self.tangent.du]
        return self._seeded(self.tangent.residual, values, np.eye(len(seeds)))

    def _moved(self, nodes: Sequence[Node], values: Values, moved: Floats) -> Floats:
        """The derivatives (k, s + r) of ``nodes`` (k,) by q, qd, z and u.

        ``moved`` (n + m, s + r) says how accelerations and multipliers change with these.
        """
        return self._seeded(nodes, values, np.eye(self.size + len(self.inputs)), moved)

    def _free_states(self, bound: Floats) -> tuple[list[int], Floats, Floats]:
        """The independent states: those that ``_independent`` finds, and the further states, which nothing binds.

        ``bound`` (m + h, s + r): the constraints' derivatives. Returns the indices of the independent ones among the s
        states, the derivatives of all states by the independent ones (s, k), and those by u (s, r).
        """
        n, f = len(self.equations.forcing), self.size - 2 * len(self.equations.forcing)
        h = len(self.equations.constraints.positions)
        chosen, shape, push = self._independent(bound[:, : 2 * n], bound[:, 2 * n :], h)
        own = np.concatenate([np.zeros((f, len(chosen))), np.eye(f)], axis=1)
        whole = np.concatenate([np.concatenate([shape, push[:, :f]], axis=1), own])
        pushed = np.concatenate([push[:, f:], np.zeros((f, len(self.inputs)))])
        return [*chosen, *range(2 * n, self.size)], whole, pushed

    def _seeded(self, nodes: Sequence[Node], values: Values, seeds: Floats, moved: Floats | None = None) -> Floats:
        """``nodes`` for every row of ``seeds`` (k, s + r); ``moved`` has the seeds of accelerations and multipliers."""
        g, t = self.equations.graph, self.tangent
        given = {**values, str(g.leaf[t.dt]): 0.0, **dict.fromkeys((str(g.leaf[x]) for x in (*t.dp, *t.drates)), 0.0)}
        given |= {str(g.leaf[x]): seed for x, seed in zip((*t.dx, *t.du), seeds.T, strict=True)}
        along = np.zeros((len(t.dqdd), len(seeds))) if moved is None else moved
        given |= {str(g.leaf[x]): seed for x, seed in zip(t.dqdd, along, strict=True)}
        return evaluate(g, nodes, given)

    def _independent(self, by_state: Floats, by_input: Floats, h: int) -> tuple[list[int], Floats, Floats]:
        """The indices of the independent ones of (q, qd); the derivatives of all by these (2 n, k) and by u (2 n, r).

        ``by_state`` (m + h, 2 n) and ``by_input`` (m + h, r) are the derivatives of the constraints' velocities and, in
        the last h rows, of their positions.
        """
        n2 = by_state.shape[1]
        nominal = np.tile([c.nominal for c in self.equations.mechanism.coordinates], 2)
        rows, m = by_state * nominal, len(by_state) - h
        length = np.linalg.norm(rows, axis=1, keepdims=True)
        rows = rows / np.where(length > 0, length, 1.0)
        places, rates = rows[m:, : n2 // 2], rows[:m, n2 // 2 :]
        chosen = [*independent_rows(null_space(places)), *(n2 // 2 + i for i in independent_rows(null_space(rates)))]
        null = null_space(rows)
        if null.shape[1] != len(chosen):
            raise DerivationError(
                f"mechanism '{self.equations.mechanism.name}': the constraints lose their rank at the state; "
                "choose another"
            )
        shape = nominal[:, None] * null @ np.linalg.inv(nominal[chosen][:, None] * null[chosen])
        shape[chosen] = np.eye(len(chosen))  # exact, without rounding
        # how inputs move the manifold: a particular solution, shifted along the manifold to z = 0
        push = -nominal[:, None] * np.linalg.pinv(rows, rcond=RANK) @ (by_input / np.where(length > 0, length, 1.0))
        return chosen, shape, push - shape @ push[chosen]


@lru_cache(maxsize=1)
def linearizer(equations: EquationsOfMotion) -> Linearizer:
    """The linearizer of ``equations``, kept until others are asked for: an export needs it for several analyses."""
    return Linearizer(equations)


def linearize(
    equations: EquationsOfMotion,
    q: Floats | None = None,
    qd: Floats | None = None,
    t: float = 0.0,
    inputs: Mapping[str, float] | None = None,
    further: Floats | None = None,
    outputs: Sequence[str] | None = None,
    within: bool = False,
) -> Linearization:
    """The linearization about q, qd (n,) and ``further`` states (f,) in SI units, by default the start, at ``t`` (s).

    Inputs have their start values, or those of ``inputs`` {name: SI value}; u are the deviations from these.
    ``outputs`` are names of states, accelerations, multipliers and other calculated variables, by default the
    mechanism's outputs. With ``within``, contacts, stops, dry frictions and latches keep the modes that they have at
    the state; without it they are left out. Raises DerivationError where M is singular or a value is not finite, and
    for an unknown name. Source: J. G. de Jalon, E. Bayo, Kinematic and Dynamic Simulation of Multibody Systems, 1994,
    section 5.3.
    """
    values = _state(equations, q, qd, t, inputs, further)
    if within and equations.mechanism.hybrid:
        from lag2fmu.analysis.present_modes import within_modes

        equations = within_modes(equations, values)
    found = linearizer(equations)
    return (found if outputs is None else found.telling(outputs))(values)


@lru_cache(maxsize=1)
def about_start(equations: EquationsOfMotion) -> Linearization:
    """``linearize(equations)``, kept until others are asked for; raises DerivationError where there is none."""
    return linearize(equations)


def _state(
    equations: EquationsOfMotion,
    q: Floats | None,
    qd: Floats | None,
    t: float = 0.0,
    inputs: Mapping[str, float] | None = None,
    further: Floats | None = None,
) -> dict[str, float | Floats]:
    """{variable: SI value} for the arguments of ``linearize``."""
    coordinates = equations.mechanism.coordinates
    place = np.array([c.start for c in coordinates]) if q is None else np.asarray(q, dtype=np.float64)
    rate = np.array([c.velocity for c in coordinates]) if qd is None else np.asarray(qd, dtype=np.float64)
    return at(equations, operating_inputs(equations, inputs) | {"t": t}, place, rate, further)
