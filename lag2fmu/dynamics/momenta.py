"""Sums over bodies on the graph: their mass centre, its velocity, their angular momentum, and what holds them.

All vectors are in world axes; in the plane they have the entry z = 0, and an angular momentum has z alone.
Source: J. Wittenburg, Dynamics of Multibody Systems, 2nd edition, chapter 3 (the laws of Newton and Euler).
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import reduce

from lag2fmu.description.outputs import Output
from lag2fmu.description.places import WORLD, Body
from lag2fmu.dynamics.energies import Composer
from lag2fmu.dynamics.frames import Rate
from lag2fmu.graph.graph import Node
from lag2fmu.graph.vectors import Vector, apply, cross, minus, plus, times


class Momenta:
    """The quantities of the bodies of one output; ``accelerating`` gives d/dt of functions of t, q and qd."""

    def __init__(self, composer: Composer, output: Output, accelerating: Rate) -> None:
        self._composer, self._output, self._accelerating = composer, output, accelerating
        self._g, named = composer.g, set(map(str, output.bodies or ()))
        self._bodies = [body for body in composer.mechanism.placed_bodies if body.name in named]

    def entries(self) -> Vector:
        """The entries of the output, in SI units, one for each of its names."""
        found = self._spatial(str(self._output.quantity))
        flat = self._output.dimension == 2
        return found[-1:] if flat and self._output.quantity == "angular_momentum" else found[: self._output.dimension]

    def _spatial(self, quantity: str) -> Vector:
        """The vector (3,) of ``quantity``."""
        if quantity == "mass_centre":
            return self._centre()
        if quantity == "mass_centre_velocity":
            return self._mean({body.name: self._velocity(body) for body in self._bodies})
        if quantity == "angular_momentum":
            carried = (times(self._g, self._mass(body), self._velocity(body)) for body in self._bodies)
            return self._moment(self._centre(), carried, map(self._spin, self._bodies))
        frames, frame = self._composer.frames, str(self._output.frame)
        forces = [self._holding(body) for body in self._bodies]
        if quantity == "holding_force":
            whole = self._sum(forces)
        else:
            changes = (tuple(self._accelerating(self._spin(body))) for body in self._bodies)
            whole = self._moment(frames.origin(frame), forces, changes)
        return whole if self._output.axes == WORLD else frames.to_frame(frame, whole)

    def _moment(self, about: Vector, forces: Iterable[Vector], couples: Iterable[Vector]) -> Vector:
        """sum((r - about) x force + couple) over the bodies at r, (3,)."""
        g, total = self._g, [self._zero]
        for body, force, couple in zip(self._bodies, forces, couples, strict=True):
            total.append(plus(g, cross(g, minus(g, self._place(body), about), force), couple))
        return self._sum(total)

    def _holding(self, body: Body) -> Vector:
        """m (acceleration - that of gravity)"""
        change = tuple(self._accelerating(self._velocity(body)))
        return times(self._g, self._mass(body), minus(self._g, change, self._whole(self._composer.gravity())))

    def _centre(self) -> Vector:
        return self._mean({body.name: self._place(body) for body in self._bodies})

    def _mean(self, vectors: dict[str, Vector]) -> Vector:
        """sum(m vector) / sum(m)"""
        g, masses = self._g, [self._mass(body) for body in self._bodies]
        weighted = self._sum([times(g, m, vectors[b.name]) for m, b in zip(masses, self._bodies, strict=True)])
        whole = g.total(masses)
        return tuple(g.divide(x, whole) for x in weighted)

    def _mass(self, body: Body) -> Node:
        return self._composer.put(body.mass)

    def _place(self, body: Body) -> Vector:
        return self._whole(self._composer.place(body.name))

    def _velocity(self, body: Body) -> Vector:
        return self._whole(tuple(self._composer.rate(self._composer.place(body.name))))

    def _spin(self, body: Body) -> Vector:
        """The angular momentum about the mass centre: I omega."""
        g, composer = self._g, self._composer
        if body.frame is not None:
            own = apply(g, composer.tensor(body), composer.velocities[str(body.frame)].angular)
            return composer.frames.to_world(str(body.frame), own)
        if body.angle is None:
            return self._zero
        (turning,) = composer.rate([composer.put(body.angle)])
        return (g.zero, g.zero, g.multiply(composer.put(body.inertia), turning))

    @property
    def _zero(self) -> Vector:
        return (self._g.zero,) * 3

    def _whole(self, vector: Vector) -> Vector:
        """``vector`` with 3 entries."""
        return (*vector, *self._zero[len(vector) :])

    def _sum(self, vectors: list[Vector]) -> Vector:
        return reduce(lambda a, b: plus(self._g, a, b), vectors, self._zero)
