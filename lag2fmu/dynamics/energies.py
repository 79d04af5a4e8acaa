"""The energies and forces of a mechanism, composed on the graph from bodies, gravity, springs, dampers and loads.

Kinetic energy by Koenig's theorem: T = 1/2 sum(m v.v + omega.I.omega), velocities by forward AD of the positions or
from frame to frame. Potential energy of uniform gravity a: V = -m a.r. Springs: V = 1/2 k e^2; dampers: R = 1/2 c
rate^2 with the force -dR/dqd, or Q = -force d(rate)/dqd.
Source: Hand, Finch, Analytical Mechanics, chapters 1 and 8; Goldstein, Classical Mechanics, sections 1.5 and 1.6.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.parts import Damper, Load, Spring
from lag2fmu.description.places import WORLD, Body
from lag2fmu.dynamics.frames import Frames, Rate
from lag2fmu.dynamics.parts import Energies, Inertia, RigidInertia, Variables, Velocity
from lag2fmu.graph.autodiff import Forward
from lag2fmu.graph.from_sympy import Translator
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.vectors import Vector, apply, times
from lag2fmu.language.vocabulary import symbol
from lag2fmu.mechanism.record import Mechanism


class Composer:
    """Puts the parts of a mechanism on the graph, as energies and forces.

    The attribute ``rate`` gives d/dt of functions of t, q and prescribed motions. All quantities are in SI units.
    """

    def __init__(self, graph: Graph, mechanism: Mechanism, translate: Translator, variables: Variables) -> None:
        self.g, self.mechanism, self.put, self.variables = graph, mechanism, translate, variables
        self.rate = Forward(graph, variables.direction(graph, accelerating=False))
        self.frames = Frames(graph, mechanism, translate)
        self.velocities = self.frames.velocities(self.rate)
        self.effort: dict[Node, Node] = {}
        self.impetus: dict[Node, Node] = {}
        self.resistance = graph.zero

    def energies(self) -> Energies:
        """The energies (J) and forces (N, N.m) of the whole mechanism, as nodes."""
        g, given = self.g, self.mechanism.energy
        inertias, rigid = tuple(self._inertias()), tuple(self._rigid())
        self._loads()
        user_kinetic, user_potential, whole = (
            g.zero if e is None else self.put(e) for e in (given.kinetic, given.potential, given.lagrangian)
        )
        bodies_kinetic = g.total(
            [*(self._half_square(i.weight, *self.rate([i.place])) for i in inertias), *map(self._rigid_energy, rigid)]
        )
        springs = g.total(self._spring(s) for s in self.mechanism.springs)
        moving = self.variables.moves(g, user_potential)
        return Energies(
            inertias=inertias,
            rigid=rigid,
            potential=springs if moving else g.add(springs, user_potential),
            remainder=g.total([user_kinetic, whole, g.negate(user_potential) if moving else g.zero]),
            dissipation=self._dissipation(),
            resistance=self.resistance,
            effort=self.effort,
            impetus=self.impetus,
            direct=self._direct(),
            on_motions=self._on_motions(),
            kinetic_energy=g.add(bodies_kinetic, user_kinetic),
            potential_energy=g.total([self._gravity_energy(), springs, user_potential]),
            split=given.lagrangian is None,
        )

    def _half_square(self, factor: Node, *components: Node) -> Node:
        """1/2 factor * |components|^2"""
        return self.g.multiply(self.g.constant_half, self.g.multiply(factor, self.g.dot(components, components)))

    def _inertias(self) -> Iterator[Inertia]:
        falling = self.gravity()
        for body in self.mechanism.bodies:
            if body.frame is None:
                if body.placed:
                    mass = self.put(body.mass)
                    yield from (Inertia(mass, x, a) for x, a in zip(self.place(body.name), falling, strict=True))
                if body.angle is not None:
                    yield Inertia(self.put(body.inertia), self.put(body.angle), self.g.zero)
            elif self._flies(body):
                place, mass = self.frames.origin(str(body.frame)), self.put(body.mass)
                yield from (Inertia(mass, x, a) for x, a in zip(place, falling, strict=True))

    def _flies(self, body: Body) -> bool:
        """Whether the mass centre is the origin of a frame on the world.

        Its velocity then stays in the world's axes: in those of the frame, the errors of a quaternion's norm would push
        a body that flies freely.
        """
        frame = self.frames.by_name.get(str(body.frame))
        on_world = frame is not None and frame.parent == WORLD
        return on_world and all(x == self.g.zero for x in self.put.vector(tuple(body.center)))

    def _rigid(self) -> Iterator[RigidInertia]:
        g, v = self.g, self.variables
        shift = Forward(g, dict(zip(v.q, v.qd, strict=True)))
        shifts = self.frames.velocities(shift)
        framed = [body for body in self.mechanism.bodies if body.frame is not None]
        down = self.frames.spread(self.gravity()) if framed else {}
        for body in framed:
            center, frame = self.put.vector(tuple(body.center)), str(body.frame)
            yield RigidInertia(
                mass=g.zero if self._flies(body) else self.put(body.mass),
                tensor=self.tensor(body),
                velocity=self._moved(self.velocities[frame], center, self.rate),
                shift=self._moved(shifts[frame], center, shift),
                gravity=down[frame],
            )

    def _moved(self, velocity: Velocity, place: Vector, rate: Rate) -> Velocity:
        """The velocity of a point of a frame, with the frame's angular velocity"""
        return Velocity(velocity.at(self.g, place, tuple(rate(place))), velocity.angular)

    def tensor(self, body: Body) -> tuple[Vector, ...]:
        """The inertia tensor (3, 3), in kg.m2, of a spatial body about its mass centre, in the axes of its frame."""
        if body.inertia is None:
            return ((self.g.zero,) * 3,) * 3
        xx, yy, zz, xy, xz, yz = self.put.vector(_entries(body.inertia))
        return ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))

    def _rigid_energy(self, body: RigidInertia) -> Node:
        """1/2 m v.v + 1/2 omega.I.omega"""
        g, omega = self.g, body.velocity.angular
        spin = g.multiply(g.constant_half, g.dot(omega, apply(g, body.tensor, omega)))
        return g.add(self._half_square(body.mass, *body.velocity.linear), spin)

    def place(self, name: str) -> Vector:
        """The position (m) of a point or body in the fixed frame, 2 or 3 entries"""
        frame, position = self.mechanism.location(name)
        place = self.put.vector(position)
        return place if frame == WORLD else self.frames.position(frame, place)

    def gravity(self) -> Vector:
        """The acceleration of gravity in world axes, m/s2, (3,)."""
        return times(self.g, self._gravity_acceleration(), self._gravity_direction())

    def _gravity_direction(self) -> Vector:
        gravity, zero = self.mechanism.gravity, self.g.zero
        if gravity is None or gravity.direction is None:
            return (zero,) * (self.mechanism.dimension - 1) + (self.g.minus_one,)
        return self.put.vector(gravity.direction)

    def _gravity_acceleration(self) -> Node:
        return self.g.zero if self.mechanism.gravity is None else self.put(self.mechanism.gravity.acceleration)

    def _gravity_energy(self) -> Node:
        """V = -sum m a.r"""
        g, bodies = self.g, self.mechanism.placed_bodies
        if self.mechanism.gravity is None:
            return g.zero
        direction, acceleration = self._gravity_direction(), self._gravity_acceleration()
        falls = ((self.put(body.mass), g.dot(direction, self.place(body.name))) for body in bodies)
        return g.negate(g.total(g.multiply(g.multiply(mass, acceleration), depth) for mass, depth in falls))

    def _spring(self, spring: Spring) -> Node:
        """V = 1/2 k e^2"""
        if spring.between is None:
            return self._half_square(self.put(spring.stiffness), self.put(spring.elongation))
        length = self.g.zero if spring.length is None else self.put(spring.length)
        elongation = self.g.subtract(self._distance(spring.between), length)
        return self._half_square(self.put(spring.stiffness), elongation)

    def _damper(self, damper: Damper) -> Node:
        """R = 1/2 c rate^2. A damper that is given by its force has no R; its force acts along the rate."""
        if damper.force is None:
            return self._half_square(self.put(damper.damping), self._damper_rate(damper))
        rate, own = self._damper_rate(damper), symbol(names.damper_rate(damper.name))
        self.put.define(own.name, rate)
        force = self.put(damper.force_at(own))
        self._act(self.impetus, (rate,), (self.g.negate(force),))
        self.resistance = self.g.add(self.resistance, self.g.multiply(force, rate))
        return self.g.zero

    def _damper_rate(self, damper: Damper) -> Node:
        if damper.between is None:
            return self.put(damper.rate)
        (rate,) = self.rate([self._distance(damper.between)])
        return rate

    def distances(self) -> dict[str, Node]:
        """{place in the mechanism: distance of its ends, in m} of the springs and dampers between two places."""
        tables = (("springs", self.mechanism.springs), ("dampers", self.mechanism.dampers))
        return {
            f"{t}.{p.name}": self._distance(p.between) for t, parts in tables for p in parts if p.between is not None
        }

    def _distance(self, ends: Sequence[object]) -> Node:
        a, b = (self.place(str(end)) for end in ends)
        difference = [self.g.subtract(x, y) for x, y in zip(a, b, strict=True)]
        return self.g.apply("sqrt", self.g.dot(difference, difference))

    def _dissipation(self) -> Node:
        user = self.mechanism.energy.dissipation
        terms = [self._damper(damper) for damper in self.mechanism.dampers]
        return self.g.total([*terms, self.g.zero if user is None else self.put(user)])

    def _loads(self) -> None:
        """Forces at positions and torques at angles into ``effort``; those on frames into ``impetus``"""
        for load in self.mechanism.loads:
            target = str(load.point if load.point is not None else load.body)
            placed = any(place.name == target for place in self.mechanism.places)
            frame, position = self.mechanism.location(target) if placed else (WORLD, ())
            if frame != WORLD:
                self._load_on_frame(load, frame, self.put.vector(position))
            elif load.force is not None:
                self._act(self.effort, self.place(target), self.put.vector(tuple(load.force)))
            else:
                self._act(self.effort, (self.angle(target),), (self.put(load.torque),))

    def angle(self, name: str) -> Node:
        """The angle (rad) of the planar body or point ``name``."""
        parts = (*self.mechanism.bodies, *self.mechanism.points)
        return self.put(next(part.angle for part in parts if part.name == name))

    def _load_on_frame(self, load: Load, frame: str, place: Vector) -> None:
        """A force at the velocity of its point, a torque at the angular velocity, in the frame's axes"""
        vector = self.put.vector(_entries(load.force if load.force is not None else load.torque))
        own = vector if load.axes != WORLD else self.frames.to_frame(frame, vector)
        velocity = self._moved(self.velocities[frame], place, self.rate)
        self._act(self.impetus, velocity.linear if load.force is not None else velocity.angular, own)

    def _act(self, total: dict[Node, Node], where: Vector, force: Vector) -> None:
        for node, component in zip(where, force, strict=True):
            total[node] = self.g.add(total.get(node, self.g.zero), component)

    def _direct(self) -> tuple[Node, ...]:
        given, coordinates = self._given(), self.mechanism.coordinates
        return tuple(
            self.g.add(given.get(c.name, self.g.zero), external)
            for c, external in zip(coordinates, self.variables.Q, strict=True)
        )

    def _on_motions(self) -> tuple[Node, ...]:
        given = self._given()
        return tuple(given.get(name, self.g.zero) for name in self.mechanism.driven)

    def _given(self) -> dict[str, Node]:
        return {force.coordinate: self.put(force.expression) for force in self.mechanism.forces}


def _entries(vector: object) -> tuple[sp.Expr, ...]:
    """The entries of a quantity that the record has checked to be a vector"""
    if not isinstance(vector, tuple):
        raise TypeError(f"expected the entries of a vector, got {vector!r}; give a tuple")
    return vector
