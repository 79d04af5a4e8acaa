"""The terms of the Lagrange equations on the graph: M qdd - forcing, the quadratic form of T, the named energies.

The method is told in ``lagrange``.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from lag2fmu.dynamics.frames import Rate
from lag2fmu.dynamics.parts import Constraints, Energies, Entries, RigidInertia, Variables
from lag2fmu.dynamics.quadratic import second_degree
from lag2fmu.dynamics.samples import check_quadratic
from lag2fmu.dynamics.silence import without_inputs
from lag2fmu.graph.autodiff import Forward, forward, reverse
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.operations import NEGATE
from lag2fmu.graph.vectors import apply, cross, minus, plus, times
from lag2fmu.mechanism.record import Mechanism


def unconstrained_residual(graph: Graph, v: Variables, energies: Energies, rate: Rate, second: Rate) -> list[Node]:
    """d/dt dL/dqd - dL/dq + dR/dqd - Q, (n,).

    ``rate`` is d/dt of places, ``second`` is d/dt of velocities. If ``second`` leaves qdd out, the result is minus the
    forcing. Source: Goldstein, Classical Mechanics, section 1.5 (velocity-dependent potentials, dissipation function).
    """
    velocities = rate([inertia.place for inertia in energies.inertias])
    accelerations, gains = second(velocities), rate([inertia.weight for inertia in energies.inertias])
    effort = {place: graph.negate(force) for place, force in energies.effort.items()}
    for inertia, speed, acceleration, gain in zip(energies.inertias, velocities, accelerations, gains, strict=True):
        force = graph.multiply(inertia.weight, graph.subtract(acceleration, inertia.gravity))
        force = graph.add(force, graph.multiply(gain, speed))  # of masses that change with the time
        effort[inertia.place] = graph.add(effort.get(inertia.place, graph.zero), force)
    effort[energies.potential] = graph.add(effort.get(energies.potential, graph.zero), graph.one)
    rows = zip(
        reverse(graph, effort, v.q),
        reverse(graph, _inertial_impetus(graph, energies, second), v.qd),
        _remainder(graph, v, energies.remainder, second),
        reverse(graph, {energies.dissipation: graph.one}, v.qd),
        energies.direct,
        strict=True,
    )
    return [graph.subtract(graph.total(terms), Q) for *terms, Q in rows]


def forcing(graph: Graph, v: Variables, energies: Energies) -> tuple[Node, ...]:
    """The right side of M qdd = forcing, (n,): N along a length, N.m along an angle."""
    rate = Forward(graph, v.direction(graph, accelerating=False))
    return tuple(graph.negate(r) for r in unconstrained_residual(graph, v, energies, rate, rate))


def with_constraints(
    graph: Graph, v: Variables, residual: Sequence[Node], c: Constraints, rate: Rate
) -> tuple[Node, ...]:
    """The equations with the constraints' forces G^T multiplier, and G qdd + gamma below, (n + m,).

    Source: Goldstein, Classical Mechanics, section 2.4 (multipliers).
    """
    forces = reverse(graph, dict(zip(c.velocities, v.multipliers, strict=True)), v.qd)
    return (*(graph.subtract(r, force) for r, force in zip(residual, forces, strict=True)), *rate(c.velocities))


def _inertial_impetus(graph: Graph, energies: Energies, rate: Rate) -> dict[Node, Node]:
    """{velocity: inertial force - load} of the spatial bodies, in their axes.

    The force is m (dv/dt + omega x v - gravity), the torque is I domega/dt + omega x I omega (Euler's equations). Where
    mass or inertia change with the time, dm/dt v and dI/dt omega are added.
    """
    impetus = {velocity: graph.negate(force) for velocity, force in energies.impetus.items()}
    rates = rate(list(energies.carried))
    for (velocity, weight), change in zip(energies.carried.items(), rates, strict=True):
        impetus[velocity] = graph.add(impetus.get(velocity, graph.zero), graph.multiply(weight, change))
    for body in energies.rigid:
        v, omega = body.velocity.linear, body.velocity.angular
        dv, alpha = tuple(rate(v)), tuple(rate(omega))
        acceleration = minus(graph, plus(graph, dv, cross(graph, omega, v)), body.gravity)
        gyroscopic = cross(graph, omega, apply(graph, body.tensor, omega))
        gain, changes = rate([body.mass])[0], tuple(tuple(rate(row)) for row in body.tensor)
        torque = plus(graph, apply(graph, body.tensor, alpha), plus(graph, gyroscopic, apply(graph, changes, omega)))
        push = plus(graph, times(graph, body.mass, acceleration), times(graph, gain, v))
        for where, force in zip((*v, *omega), (*push, *torque), strict=True):
            impetus[where] = graph.add(impetus.get(where, graph.zero), force)
    return impetus


def _remainder(graph: Graph, v: Variables, remainder: Node, rate: Rate) -> list[Node]:
    """d/dt dL/dqd - dL/dq of what the user wrote into L beside bodies and velocity-free potentials, (n,)."""
    gradient = reverse(graph, {remainder: graph.one}, [*v.qd, *v.q])
    momenta, by_q = gradient[: len(v.q)], gradient[len(v.q) :]
    return [graph.subtract(change, dL) for change, dL in zip(rate(momenta), by_q, strict=True)]


def quadratic_form(graph: Graph, mechanism: Mechanism, v: Variables, energies: Energies) -> Entries:
    """2 T2 = sum H_ab a b as {(a, b): H_ab}; T2 is the part of T of second degree in the velocities.

    The nodes a, b are the velocities J qd of the bodies, whose H are masses (kg) and inertias (kg.m2), and those of the
    user's terms. Raises DerivationError if the user's part is no quadratic form.
    """
    motion = dict(zip(v.q, v.qd, strict=True))
    speeds = forward(graph, [inertia.place for inertia in energies.inertias], motion)
    terms = [(speed, speed, i.weight) for speed, i in zip(speeds, energies.inertias, strict=True)]
    for body in energies.rigid:
        terms += _rigid_terms(body)
    for velocity, weight in energies.carried.items():
        shift = graph.dot(reverse(graph, {velocity: graph.one}, v.qd), v.qd)
        terms.append((shift, shift, weight))
    form = second_degree(graph, energies.remainder, v.qd)
    if form is not None:
        terms += [(a, b, value) for a, row in form.rows.items() for b, value in row.items()]
    else:
        terms += _hessian(graph, mechanism, v, energies.remainder)

    entries: dict[tuple[Node, Node], Node] = {}
    for x, y, value in terms:
        (a, same), (b, equal) = _unsigned(graph, x), _unsigned(graph, y)
        if graph.zero not in (a, b, value) and a <= b:
            signed = value if same == equal else graph.negate(value)
            entries[a, b] = graph.add(entries.get((a, b), graph.zero), signed)
    return entries


def _unsigned(graph: Graph, node: Node) -> tuple[Node, bool]:
    """The node without a minus sign in front, and whether it had none."""
    return (graph.operands[node][0], False) if graph.code[node] == NEGATE else (node, True)


Term = tuple[Node, Node, Node]
"""value * a * b in 2 T2, as (a, b, value); terms of different nodes stand twice, as (a, b) and as (b, a)."""


def _rigid_terms(body: RigidInertia) -> list[Term]:
    """The terms of m v.v + omega.I.omega"""
    v, omega = body.shift.linear, body.shift.angular
    spin = [(omega[i], omega[j], body.tensor[i][j]) for i in range(3) for j in range(3)]
    return [*((x, x, body.mass) for x in v), *spin]


def _hessian(graph: Graph, mechanism: Mechanism, v: Variables, remainder: Node) -> list[Term]:
    """The second derivatives by qd of a part of L that is no evident polynomial; refused unless they are constant."""
    momenta = reverse(graph, {remainder: graph.one}, v.qd)
    columns = [forward(graph, momenta, {velocity: graph.one}) for velocity in v.qd]
    entries = [entry for column in columns for entry in column]
    check_quadratic(mechanism, graph, entries)
    resting = iter(graph.substitute(entries, dict.fromkeys(v.qd, graph.zero)))
    return [(a, b, next(resting)) for a in v.qd for b in v.qd]


def generalized_forces(graph: Graph, v: Variables, energies: Energies) -> list[Node]:
    """The generalized forces Q of the loads and inputs, (n,): N along a length, N.m along an angle."""
    rows = zip(
        reverse(graph, energies.effort, v.q), reverse(graph, energies.impetus, v.qd), energies.direct, strict=True
    )
    return [graph.total(row) for row in rows]


def canonical(graph: Graph, v: Variables, energies: Energies) -> tuple[list[Node], list[Node]]:
    """p = dL/dqd and F = dL/dq - dR/dqd + Q, (n,) each; F is valid beside the constraints too.

    L holds the fictitious energies of constraints that make M regular, so that p determines qd. Source: J. E. Marsden,
    M. West, Acta Numerica 10 (2001), pp. 357-514, for what discrete actions need of L.
    """
    half = graph.constant(Fraction(1, 2))
    carried = [
        graph.multiply(half, graph.multiply(weight, graph.multiply(x, x))) for x, weight in energies.carried.items()
    ]
    action = graph.total([energies.lagrangian(graph), *carried])
    gradient = reverse(graph, {action: graph.one}, [*v.qd, *v.q])
    friction = reverse(graph, {energies.dissipation: graph.one}, v.qd)
    rows = zip(gradient[len(v.q) :], generalized_forces(graph, v, energies), friction, strict=True)
    return gradient[: len(v.q)], [graph.subtract(graph.add(slope, Q), drag) for slope, Q, drag in rows]


def named_energies(graph: Graph, v: Variables, energies: Energies, momenta: Sequence[Node]) -> dict[str, Node]:
    """T, V, T + V (unless V has velocities), h = sum qd p - L, all in J, and the power of the external inputs, in W.

    The power is that of the forces beyond those without inputs; a force that has no value without them counts as a
    whole. ``momenta`` are p, (n,). A Lagrangian that is written as a whole has only h and the power. Source: Goldstein,
    Classical Mechanics, section 2.7 (the energy function h).
    """
    named: dict[str, Node] = {}
    if energies.split:
        named["kinetic_energy"], named["potential_energy"] = energies.kinetic_energy, energies.potential_energy
        if not v.moves(graph, energies.potential_energy):
            named["total_energy"] = graph.add(energies.kinetic_energy, energies.potential_energy)
    named["generalized_energy"] = graph.subtract(graph.dot(v.qd, momenta), energies.lagrangian(graph))
    forces = generalized_forces(graph, v, energies)
    silent = without_inputs(graph, forces, (*v.Q, *v.plain))
    external = [graph.subtract(a, b) for a, b in zip(forces, silent, strict=True)]
    named["external_power"] = graph.dot(external, v.qd)
    return named
