"""The energies and forces of a mechanism, composed on the graph from bodies, gravity, springs, dampers and loads.

Kinetic energy by Koenig's theorem: T = 1/2 sum(m v.v + I omega^2), velocities by forward AD of the positions. Potential
energy of uniform gravity a: V = -m a.r. Springs: V = 1/2 k e^2; dampers: R = 1/2 c rate^2 with force -dR/dqd.
Source: Hand, Finch, Analytical Mechanics, chapters 1 and 8; Goldstein, Classical Mechanics, sections 1.5 and 1.6.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lag2fmu.dynamics.autodiff import forward, reverse
from lag2fmu.dynamics.graph import Graph
from lag2fmu.dynamics.translate import Translator
from lag2fmu.mechanism import Mechanism, names


@dataclass(frozen=True)
class Variables:
    """The variables of a mechanism as nodes: t; q, qd, qdd, Q of n entries each; by name: inputs, motions, parameters.

    ``motions`` holds (y0, y0_dot, y0_ddot) for each motion input, in order.
    """

    t: int
    q: tuple[int, ...]
    qd: tuple[int, ...]
    qdd: tuple[int, ...]
    Q: tuple[int, ...]
    inputs: tuple[int, ...]
    motions: tuple[tuple[int, int, int], ...]
    parameters: tuple[int, ...]

    def rates(self, with_accelerations: bool) -> dict[int, int]:
        """The direction of time {variable: its rate}: q -> qd, qd -> qdd, motions alike; without that of t itself."""
        pairs = list(zip(self.q, self.qd, strict=True))
        for motion in self.motions:
            pairs += [(motion[0], motion[1]), (motion[1], motion[2])]
        if with_accelerations:
            pairs += list(zip(self.qd, self.qdd, strict=True))
        return dict(pairs)


@dataclass(frozen=True)
class Energies:
    """T, V, R and L = T - V as nodes; T and V are None where the user gave a Lagrangian as a whole.

    ``forces``: generalized non-potential forces, (n,) nodes, with the external inputs Q and without dissipation.
    """

    kinetic: int | None
    potential: int | None
    dissipation: int
    lagrangian: int
    forces: tuple[int, ...]


def declare(graph: Graph, mechanism: Mechanism) -> Variables:
    """All variables of ``mechanism`` on ``graph``."""
    q = [c.name for c in mechanism.coordinates]

    def nodes(labels: Sequence[str]) -> tuple[int, ...]:
        return tuple(graph.symbol(label) for label in labels)

    return Variables(
        t=graph.symbol("t"),
        q=nodes(q),
        qd=nodes([names.velocity(c) for c in q]),
        qdd=nodes([names.acceleration(c) for c in q]),
        Q=nodes([names.generalized_force(c) for c in q]),
        inputs=nodes([u.name for u in mechanism.plain_inputs]),
        motions=tuple(
            (graph.symbol(u.name), graph.symbol(names.velocity(u.name)), graph.symbol(names.acceleration(u.name)))
            for u in mechanism.motions
        ),
        parameters=nodes([p.name for p in mechanism.parameters if p.value is not None]),
    )


def translator(graph: Graph, mechanism: Mechanism) -> Translator:
    """A translator that knows the variables, the dependent parameters and the definitions of ``mechanism``."""
    variables = declare(graph, mechanism)
    known = [variables.t, *variables.q, *variables.qd, *variables.inputs, *variables.parameters]
    known += [node for motion in variables.motions for node in motion]
    translate = Translator(graph, {str(graph.first[node]): node for node in known})
    pending = {p.name: p.expression for p in mechanism.parameters if p.expression is not None}
    pending |= {d.name: d.expression for d in mechanism.definitions}
    while pending:  # the record has no cycles, so each pass defines at least one
        for name, expression in list(pending.items()):
            if not any(s.name in pending for s in expression.free_symbols):
                translate.define(name, translate(expression))
                del pending[name]
    return translate


class _Composer:
    """Adds up the energies part by part."""

    def __init__(self, graph: Graph, mechanism: Mechanism, translate: Translator) -> None:
        self.g, self.mechanism, self.put = graph, mechanism, translate
        self.variables = declare(graph, mechanism)
        self.direction = self.variables.rates(with_accelerations=False) | {self.variables.t: graph.one}

    def rate(self, nodes: Sequence[int]) -> list[int]:
        """d/dt of functions of t, q and motions"""
        return forward(self.g, nodes, self.direction)

    def half_square(self, factor: int, *components: int) -> int:
        """1/2 factor * |components|^2"""
        return self.g.multiply(self.g.constant_half, self.g.multiply(factor, self.g.dot(components, components)))

    def kinetic(self) -> int:
        terms = []
        for body in self.mechanism.bodies:
            velocity = self.rate(self.put.vector(tuple(body.position)))
            terms.append(self.half_square(self.put(body.mass), *velocity))
            if body.angle is not None:
                terms.append(self.half_square(self.put(body.inertia), *self.rate([self.put(body.angle)])))
        if self.mechanism.energy.kinetic is not None:
            terms.append(self.put(self.mechanism.energy.kinetic))
        return self.g.total(terms)

    def potential(self) -> int:
        terms = [
            self._gravity(),
            *(self.half_square(self.put(s.stiffness), self._elongation(s)) for s in self.mechanism.springs),
        ]
        if self.mechanism.energy.potential is not None:
            terms.append(self.put(self.mechanism.energy.potential))
        return self.g.total(terms)

    def _gravity(self) -> int:
        gravity = self.mechanism.gravity
        if gravity is None:
            return self.g.zero
        terms = []
        for body in self.mechanism.bodies:
            down = [0] * (len(body.position) - 1) + [-1]
            direction = (
                [self.g.constant(d) for d in down] if gravity.direction is None else self.put.vector(gravity.direction)
            )
            height = self.g.negate(self.g.dot(direction, self.put.vector(tuple(body.position))))
            terms.append(self.g.multiply(self.put(body.mass), self.g.multiply(self.put(gravity.acceleration), height)))
        return self.g.total(terms)

    def _elongation(self, spring: object) -> int:
        if spring.elongation is not None:  # type: ignore[attr-defined]
            return self.put(spring.elongation)  # type: ignore[attr-defined]
        length = spring.length  # type: ignore[attr-defined]
        return self.g.subtract(self._distance(spring.between), self.g.zero if length is None else self.put(length))  # type: ignore[attr-defined]

    def _distance(self, ends: Sequence[str]) -> int:
        a, b = (self.put.vector(self.mechanism.place(str(end))) for end in ends)
        difference = [self.g.subtract(x, y) for x, y in zip(a, b, strict=True)]
        return self.g.apply("sqrt", self.g.dot(difference, difference))

    def dissipation(self) -> int:
        terms = []
        for damper in self.mechanism.dampers:
            if damper.rate is not None:
                rate = self.put(damper.rate)
            else:
                (rate,) = self.rate([self._distance(damper.between)])  # type: ignore[arg-type]
            terms.append(self.half_square(self.put(damper.damping), rate))
        if self.mechanism.energy.dissipation is not None:
            terms.append(self.put(self.mechanism.energy.dissipation))
        return self.g.total(terms)

    def forces(self) -> tuple[int, ...]:
        """Q_j = sum F.dr/dq_j + tau dphi/dq_j (one reverse sweep), plus the forces on coordinates and the inputs Q."""
        seeds: dict[int, int] = {}
        for load in self.mechanism.loads:
            if load.force is not None:
                place = self.mechanism.place(str(load.point if load.point is not None else load.body))
                pairs = zip(self.put.vector(place), self.put.vector(tuple(load.force)), strict=True)
            else:
                body = next(b for b in self.mechanism.bodies if b.name == load.body)
                pairs = zip([self.put(body.angle)], [self.put(load.torque)], strict=True)
            for output, weight in pairs:
                seeds[output] = self.g.add(seeds.get(output, self.g.zero), weight)
        total = reverse(self.g, seeds, self.variables.q)
        direct = {force.coordinate: self.put(force.expression) for force in self.mechanism.forces}
        return tuple(
            self.g.add(self.g.add(force, direct.get(c.name, self.g.zero)), external)
            for c, force, external in zip(self.mechanism.coordinates, total, self.variables.Q, strict=True)
        )


def compose(graph: Graph, mechanism: Mechanism, translate: Translator) -> Energies:
    """T, V, R, L and the generalized forces of ``mechanism`` on ``graph``."""
    composer = _Composer(graph, mechanism, translate)
    kinetic, potential = composer.kinetic(), composer.potential()
    lagrangian = graph.subtract(kinetic, potential)
    whole = mechanism.energy.lagrangian
    if whole is not None:
        lagrangian = graph.add(lagrangian, translate(whole))
    return Energies(
        kinetic=None if whole is not None else kinetic,
        potential=None if whole is not None else potential,
        dissipation=composer.dissipation(),
        lagrangian=lagrangian,
        forces=composer.forces(),
    )
