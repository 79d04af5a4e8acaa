"""The Lagrange equations of a mechanism, M(q, t) qdd = forcing(t, q, qd, inputs), derived on the graph.

With L = T - V, generalized forces Q and Rayleigh's dissipation function R the equations are

    d/dt dL/dqd - dL/dq + dR/dqd = Q.

One reverse sweep gives p = dL/dqd and dL/dq; forward AD of p along qd (velocities as rates of q, accelerations as
rates of qd) gives dp/dt; M is its part that is linear in qdd. Source: Hand, Finch, Analytical Mechanics, section 1.9;
Landau, Lifshitz, Mechanics, sections 2, 6 and 7 for h; section 25 for R.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from lag2fmu.dynamics.autodiff import forward, reverse
from lag2fmu.dynamics.energies import Energies, Variables, compose, declare, translator
from lag2fmu.dynamics.graph import Graph
from lag2fmu.errors import DerivationError
from lag2fmu.mechanism import Mechanism, names


@dataclass(frozen=True)
class EquationsOfMotion:
    """M qdd = forcing and what follows from the same graph; all entries are nodes of ``graph``.

    ``mass_matrix``: (n, n), symmetric, a function of t, q, motions and parameters; ``forcing``: (n,); ``residual``:
    (n,), M qdd - forcing with qdd as variables; ``momenta``: (n,), dL/dqd; ``energies`` and ``outputs`` by name;
    ``dependent``: the dependent parameters by name, functions of the parameters.
    """

    mechanism: Mechanism
    graph: Graph
    variables: Variables
    mass_matrix: tuple[tuple[int, ...], ...]
    forcing: tuple[int, ...]
    residual: tuple[int, ...]
    momenta: tuple[int, ...]
    energies: Mapping[str, int]
    outputs: Mapping[str, int]
    dependent: Mapping[str, int]

    def locals(self) -> Iterator[tuple[str, int]]:
        """(name, node) of everything that is calculated beside the accelerations: momenta, energies, power, outputs."""
        for coordinate, momentum in zip(self.mechanism.coordinates, self.momenta, strict=True):
            yield names.momentum(coordinate.name), momentum
        yield from self.energies.items()
        yield from self.outputs.items()

    def acceleration_dependencies(self) -> tuple[frozenset[str], ...]:
        """The names of the variables each acceleration depends on, (n,): those of its block of coupled coordinates."""
        n = len(self.forcing)
        blocks = [{i} | {j for j in range(n) if self.mass_matrix[i][j] != self.graph.zero} for i in range(n)]
        for _ in range(n):
            blocks = [set().union(*(blocks[j] for j in block)) for block in blocks]
        rows = [self.graph.symbols([self.forcing[i], *self.mass_matrix[i]]) for i in range(n)]
        return tuple(frozenset(set().union(*(rows[j] for j in block))) for block in blocks)


def derive(mechanism: Mechanism) -> EquationsOfMotion:
    """Derive the equations of motion of ``mechanism``.

    Raises DerivationError if T is not quadratic in the velocities, if the mass matrix is singular for every q (naming
    the coordinates), or if an energy has no finite value at the start.
    """
    graph = Graph()
    translate = translator(graph, mechanism)
    variables = declare(graph, mechanism)
    energies = compose(graph, mechanism, translate)
    n = len(variables.q)

    gradient = reverse(graph, {energies.lagrangian: graph.one}, [*variables.qd, *variables.q])
    momenta, by_q = gradient[:n], gradient[n:]
    damping = reverse(graph, {energies.dissipation: graph.one}, variables.qd)
    mass_matrix = _mass_matrix(graph, mechanism, variables, momenta)

    def residual(with_accelerations: bool) -> list[int]:
        """d/dt p - dL/dq + dR/dqd - Q"""
        direction = variables.rates(with_accelerations) | {variables.t: graph.one}
        terms = zip(forward(graph, momenta, direction), by_q, damping, energies.forces, strict=True)
        return [graph.subtract(graph.add(graph.subtract(dp, dL), dR), Q) for dp, dL, dR, Q in terms]

    equations = EquationsOfMotion(
        mechanism=mechanism,
        graph=graph,
        variables=variables,
        mass_matrix=mass_matrix,
        forcing=tuple(graph.negate(r) for r in residual(with_accelerations=False)),
        residual=tuple(residual(with_accelerations=True)),
        momenta=tuple(momenta),
        energies=_named_energies(graph, variables, energies, momenta),
        outputs={o.name: translate(o.expression) for o in mechanism.outputs},
        dependent={p.name: translate.names[p.name] for p in mechanism.parameters if p.expression is not None},
    )
    _check_start(equations)
    _check_rank(equations)
    return equations


def _named_energies(graph: Graph, v: Variables, energies: Energies, momenta: list[int]) -> dict[str, int]:
    """T, V, T + V (unless V has velocities), h = sum qd p - L, and the power of the external inputs."""
    named: dict[str, int] = {}
    if energies.kinetic is not None and energies.potential is not None:
        named["kinetic_energy"], named["potential_energy"] = energies.kinetic, energies.potential
        velocities = {str(graph.first[node]) for node in v.qd}
        if not graph.symbols([energies.potential]) & velocities:
            named["total_energy"] = graph.add(energies.kinetic, energies.potential)
    named["generalized_energy"] = graph.subtract(graph.dot(v.qd, momenta), energies.lagrangian)
    silence = dict.fromkeys((*v.Q, *v.inputs), graph.zero)
    without = graph.substitute(list(energies.forces), silence)
    external = [graph.subtract(a, b) for a, b in zip(energies.forces, without, strict=True)]
    named["external_power"] = graph.dot(external, v.qd)
    return named


def _mass_matrix(graph: Graph, mechanism: Mechanism, v: Variables, momenta: list[int]) -> tuple[tuple[int, ...], ...]:
    """M_jk = dp_j/dqd_k; by symmetry only j >= k is derived."""
    n = len(momenta)
    rows = [[graph.zero] * n for _ in range(n)]
    for k, velocity in enumerate(v.qd):
        for j, entry in zip(range(k, n), forward(graph, momenta[k:], {velocity: graph.one}), strict=True):
            rows[j][k] = rows[k][j] = entry
    entries = [entry for row in rows for entry in row]
    speeds = {str(graph.first[node]) for node in v.qd}
    if graph.symbols(entries) & speeds:
        _require_quadratic(graph, mechanism, entries, speeds)
        entries = graph.substitute(entries, dict.fromkeys(v.qd, graph.zero))
    return tuple(tuple(entries[n * i : n * i + n]) for i in range(n))


# --------------------------------------------------------------------------------------------------- sampled checks


def start_values(mechanism: Mechanism) -> dict[str, float]:
    """The start values of all variables by name (SI); accelerations and external forces are 0."""
    values = {"t": 0.0}
    for c in mechanism.coordinates:
        values |= {c.name: c.start, names.velocity(c.name): c.velocity, names.acceleration(c.name): 0.0}
        values[names.generalized_force(c.name)] = 0.0
    for u in mechanism.inputs:
        values |= {u.name: u.start, names.velocity(u.name): 0.0, names.acceleration(u.name): 0.0}
    values |= {p.name: p.value for p in mechanism.parameters if p.value is not None}
    return values


def _samples(mechanism: Mechanism, count: int) -> Iterator[dict[str, float]]:
    """``count`` states around the start, reproducible; parameters are moved by up to a tenth."""
    generator = random.Random(20)
    start = start_values(mechanism)
    parameters = {p.name for p in mechanism.parameters}
    nominal = {c.name: c.nominal for c in mechanism.coordinates}
    for _ in range(count):
        yield {
            name: value * generator.uniform(0.9, 1.1)
            if name in parameters
            else value + nominal.get(name, 1.0) * generator.uniform(-1, 1)
            for name, value in start.items()
        }


def _require_quadratic(graph: Graph, mechanism: Mechanism, entries: list[int], speeds: set[str]) -> None:
    """M must not change with the velocities (an M that only looks as if it did is let pass)."""
    for values in _samples(mechanism, 4):
        a = np.array(graph.evaluate(entries, values))
        b = np.array(graph.evaluate(entries, values | {s: 1.7 * values[s] + 0.3 for s in speeds}))
        usable = np.isfinite(a) & np.isfinite(b)
        if np.any(np.abs(a - b)[usable] > 1e-9 * np.max(np.abs(a[usable]), initial=1e-300)):
            raise DerivationError(
                f"mechanism '{mechanism.name}': the kinetic energy (or Lagrangian) is not quadratic in the velocities; "
                "supported are T = 1/2 qd.M(q,t).qd + a(q,t).qd + b(q,t), and potentials of the same form"
            )


def _check_start(equations: EquationsOfMotion) -> None:
    """At the start M and the forces must be finite."""
    values = start_values(equations.mechanism)
    entries = [entry for row in equations.mass_matrix for entry in row]
    for what, nodes in (("mass matrix", entries), ("forces", list(equations.forcing))):
        if not np.all(np.isfinite(equations.graph.evaluate(nodes, values))):
            starts = ", ".join(f"{c.name} = {c.start:g}" for c in equations.mechanism.coordinates)
            raise DerivationError(
                f"mechanism '{equations.mechanism.name}': the {what} have no finite value at the start ({starts}); "
                "choose start values and parameters without a division by zero or a root of a negative number"
            )


def _check_rank(equations: EquationsOfMotion) -> None:
    """Raise DerivationError naming the coordinates if M is singular in every sampled state."""
    n = len(equations.forcing)
    entries = [entry for row in equations.mass_matrix for entry in row]
    directions = []
    for values in _samples(equations.mechanism, 5):
        matrix = np.array(equations.graph.evaluate(entries, values)).reshape(n, n)
        if not np.all(np.isfinite(matrix)):
            continue
        scale = np.sqrt(np.abs(np.diag(matrix)))
        scale[scale == 0] = 1.0
        singular, vectors = np.linalg.svd(matrix / np.outer(scale, scale))[1:]
        if singular[-1] > 1e-12 * max(singular[0], 1e-300):
            return
        directions.append(np.abs(vectors[-1]))
    if directions:
        worst = np.max(directions, axis=0)
        culprits = [c.name for c, w in zip(equations.mechanism.coordinates, worst, strict=True) if w > 1e-6]
        raise DerivationError(
            f"mechanism '{equations.mechanism.name}': the mass matrix is singular for every q; the motion along "
            f"{', '.join(culprits)} has no mass. Give what moves there a mass or inertia, or leave out coordinates"
        )
