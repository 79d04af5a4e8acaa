"""The energies and forces of a mechanism, composed on the graph from bodies, gravity, springs, dampers and loads.

Kinetic energy by Koenig's theorem: T = 1/2 sum(m v.v + I omega^2), velocities by forward AD of the positions. Potential
energy of uniform gravity a: V = -m a.r. Springs: V = 1/2 k e^2; dampers: R = 1/2 c rate^2 with force -dR/dqd.
Source: Hand, Finch, Analytical Mechanics, chapters 1 and 8; Goldstein, Classical Mechanics, sections 1.5 and 1.6.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from lag2fmu.dynamics.autodiff import forward
from lag2fmu.dynamics.graph import Graph
from lag2fmu.dynamics.translate import Translator
from lag2fmu.dynamics.variables import Variables
from lag2fmu.mechanism import Body, Damper, Mechanism, Spring


@dataclass(frozen=True)
class Inertia:
    """A mass or moment of inertia ``weight`` that moves along ``place``: T = 1/2 weight (d place/dt)^2."""

    weight: int
    place: int


@dataclass(frozen=True)
class Energies:
    """What the Lagrange equations are made of, as nodes.

    ``inertias``: the bodies, each mass along every axis and each moment of inertia; ``potential``: V of gravity,
    springs and the user, as far as it is free of velocities; ``remainder``: the user's part of L beside these (further
    kinetic energy, velocity-dependent potentials, a whole Lagrangian); ``dissipation``: R; ``effort``: {place: force}
    of the loads, generalized forces being Q = sum force * dplace/dq; ``direct``: forces on the coordinates themselves,
    (n,), the external inputs Q among them. ``split``: whether T and V are told apart.
    """

    inertias: tuple[Inertia, ...]
    potential: int
    remainder: int
    dissipation: int
    effort: dict[int, int]
    direct: tuple[int, ...]
    kinetic_energy: int
    potential_energy: int
    split: bool

    def lagrangian(self, graph: Graph) -> int:
        """L, the inertias included."""
        bodies = graph.subtract(self.kinetic_energy, self.potential_energy)
        return bodies if self.split else graph.add(bodies, self.remainder)


def compose(graph: Graph, mechanism: Mechanism, translate: Translator, variables: Variables) -> Energies:
    """The energies and forces of ``mechanism`` on ``graph``."""
    return _Composer(graph, mechanism, translate, variables).energies()


class _Composer:
    """Puts the parts of a mechanism on the graph."""

    def __init__(self, graph: Graph, mechanism: Mechanism, translate: Translator, variables: Variables) -> None:
        self.g, self.mechanism, self.put, self.variables = graph, mechanism, translate, variables
        self.direction = variables.direction(graph, accelerating=False)

    def energies(self) -> Energies:
        g, given = self.g, self.mechanism.energy
        inertias = tuple(self._inertias())
        user_kinetic, user_potential, whole = (
            g.zero if e is None else self.put(e) for e in (given.kinetic, given.potential, given.lagrangian)
        )
        bodies_kinetic = g.total(self._half_square(i.weight, *self.rate([i.place])) for i in inertias)
        own_potential = g.add(self._gravity(), g.total(self._spring(s) for s in self.mechanism.springs))
        moving = self.variables.moves(g, user_potential)
        return Energies(
            inertias=inertias,
            potential=own_potential if moving else g.add(own_potential, user_potential),
            remainder=g.total([user_kinetic, whole, g.negate(user_potential) if moving else g.zero]),
            dissipation=self._dissipation(),
            effort=self._effort(),
            direct=self._direct(),
            kinetic_energy=g.add(bodies_kinetic, user_kinetic),
            potential_energy=g.add(own_potential, user_potential),
            split=given.lagrangian is None,
        )

    def rate(self, nodes: Sequence[int]) -> list[int]:
        """d/dt of functions of t, q and motions"""
        return forward(self.g, nodes, self.direction)

    def _half_square(self, factor: int, *components: int) -> int:
        """1/2 factor * |components|^2"""
        return self.g.multiply(self.g.constant_half, self.g.multiply(factor, self.g.dot(components, components)))

    def _inertias(self) -> Iterator[Inertia]:
        for body in self.mechanism.bodies:
            mass = self.put(body.mass)
            yield from (Inertia(mass, place) for place in self._place(body))
            if body.angle is not None:
                yield Inertia(self.put(body.inertia), self.put(body.angle))

    def _place(self, part: Body | str) -> tuple[int, ...]:
        """The position of a body, or of a point or body by name"""
        position = self.mechanism.place(part) if isinstance(part, str) else tuple(part.position)
        return self.put.vector(position)

    def _gravity(self) -> int:
        """V = -sum m a.r"""
        g, gravity = self.g, self.mechanism.gravity
        if gravity is None:
            return g.zero
        terms = []
        for body in self.mechanism.bodies:
            place = self._place(body)
            down = [g.zero] * (len(place) - 1) + [g.minus_one]
            direction = down if gravity.direction is None else self.put.vector(gravity.direction)
            weight = g.multiply(self.put(body.mass), self.put(gravity.acceleration))
            terms.append(g.multiply(weight, g.negate(g.dot(direction, place))))
        return g.total(terms)

    def _spring(self, spring: Spring) -> int:
        """V = 1/2 k e^2"""
        if spring.between is None:
            return self._half_square(self.put(spring.stiffness), self.put(spring.elongation))
        length = self.g.zero if spring.length is None else self.put(spring.length)
        elongation = self.g.subtract(self._distance(spring.between), length)
        return self._half_square(self.put(spring.stiffness), elongation)

    def _damper(self, damper: Damper) -> int:
        """R = 1/2 c rate^2"""
        if damper.between is None:
            return self._half_square(self.put(damper.damping), self.put(damper.rate))
        return self._half_square(self.put(damper.damping), *self.rate([self._distance(damper.between)]))

    def _distance(self, ends: Sequence[object]) -> int:
        a, b = (self._place(str(end)) for end in ends)
        difference = [self.g.subtract(x, y) for x, y in zip(a, b, strict=True)]
        return self.g.apply("sqrt", self.g.dot(difference, difference))

    def _dissipation(self) -> int:
        user = self.mechanism.energy.dissipation
        terms = [self._damper(damper) for damper in self.mechanism.dampers]
        return self.g.total([*terms, self.g.zero if user is None else self.put(user)])

    def _effort(self) -> dict[int, int]:
        """The loads: forces at positions, torques at angles"""
        effort: dict[int, int] = {}
        for load in self.mechanism.loads:
            if load.force is not None:
                place = self._place(str(load.point if load.point is not None else load.body))
                pairs = list(zip(place, self.put.vector(tuple(load.force)), strict=True))
            else:
                body = next(b for b in self.mechanism.bodies if b.name == load.body)
                pairs = [(self.put(body.angle), self.put(load.torque))]
            for where, force in pairs:
                effort[where] = self.g.add(effort.get(where, self.g.zero), force)
        return effort

    def _direct(self) -> tuple[int, ...]:
        given = {force.coordinate: self.put(force.expression) for force in self.mechanism.forces}
        coordinates = self.mechanism.coordinates
        return tuple(
            self.g.add(given.get(c.name, self.g.zero), external)
            for c, external in zip(coordinates, self.variables.Q, strict=True)
        )
