"""Sums over bodies: mass centre, momentum and angular momentum, as numbers or as SymPy expressions.

The angular momentum about the world's origin is sum(r x m v + J w), about the mass centre that less r_c x m v_c
(H. Goldstein, Classical Mechanics, section 1.2).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp

from lag2fmu.description.outputs import Output
from lag2fmu.description.places import WORLD, Body
from lag2fmu.reference.frames import FramePose, Mass, apply, apply_transposed, cross
from lag2fmu.reference.functions import STEP, Array


@dataclass(frozen=True)
class MovingBodies:
    """Bodies in world axes: ``masses`` (kg); ``places`` (m), ``velocities`` (m/s), ``spins`` (N.m.s): (3, *shape)."""

    masses: Sequence[Any]
    places: Sequence[Array]
    velocities: Sequence[Array]
    spins: Sequence[Array]

    @cached_property
    def mass(self) -> Any:
        """The mass of all, in kg."""
        return sum(self.masses)

    @cached_property
    def centre(self) -> Array:
        """The mass centre, (3, *shape), in m."""
        centre: Array = self._weighted(self.places) / self.mass
        return centre

    @cached_property
    def momentum(self) -> Array:
        """m v of all, (3, *shape), in N.s."""
        return self._weighted(self.velocities)

    @cached_property
    def about_origin(self) -> Array:
        """The angular momentum about the world's origin, (3, *shape), in N.m.s."""
        carried = zip(self.masses, self.places, self.velocities, self.spins, strict=True)
        moment: Array = np.sum([cross(x, m * v) + own for m, x, v, own in carried], axis=0)
        return moment

    def entries(self, output: Output) -> Array:
        """The entries of ``output`` that tell no force, as many as it has names, in SI units."""
        if output.quantity == "angular_momentum":
            own: Array = self.about_origin - cross(self.centre, self.momentum)
            return own[-len(output.names) :]
        vector = self.centre if output.quantity == "mass_centre" else self.momentum / self.mass
        return vector[: len(output.names)]

    def _weighted(self, vectors: Sequence[Array]) -> Array:
        weighted: Array = np.sum([m * x for m, x in zip(self.masses, vectors, strict=True)], axis=0)
        return weighted


def moving(masses: Mapping[str, Mass], output: Output, poses: dict[str, FramePose], values: Array) -> MovingBodies:
    """The bodies of ``output``, of which ``masses`` has all by name, at the ``values`` (slots, *shape) of the slots."""
    found = [masses[str(name)] for name in output.bodies or ()]
    motions = [mass.spot.motion(poses, values) for mass in found]
    spins = [_spin(poses[m.spot.frame], None if m.inertia is None else values[m.inertia]) for m in found]
    return MovingBodies([values[m.mass][0] for m in found], [x for x, _ in motions], [v for _, v in motions], spins)


def held(output: Output, later: MovingBodies, gravity: Array, frame: FramePose) -> Array:
    """What holds the bodies of ``output``, (3, N): the change of their momenta less the part of ``gravity`` (m/s2).

    ``later`` are the bodies a complex step later along the motion, ``frame`` is where the quantity is told.
    """
    force: Array = later.momentum.imag / STEP - (later.mass * gravity).real
    if output.quantity == "holding_torque":
        weight = later.mass.real * gravity
        force = later.about_origin.imag / STEP - cross(later.centre.real, weight) - cross(frame.x, force)
    return force if output.axes == WORLD else apply_transposed(frame.R, force)


def _spin(pose: FramePose, inertia: Array | None) -> Array:
    """The angular momentum J w (N.m.s) in world axes, (3, *shape), for the tensor's entries (6, *shape)."""
    if inertia is None:
        return np.zeros_like(pose.w)
    xx, yy, zz, xy, xz, yz = inertia
    tensor = np.stack([np.stack(row) for row in ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))])
    return apply(pose.R, apply(tensor, apply_transposed(pose.R, pose.w)))


Change = Callable[[Any], sp.Expr]


def in_fixed_frame(output: Output, bodies: Iterable[Body], written: Change, rate: Change) -> Sequence[sp.Expr]:
    """The entries of ``output`` about ``bodies`` whose positions are given in the fixed frame.

    ``written`` makes an expression of what the record holds, and ``rate`` gives its time derivative.
    """
    moving = [_expressions(body, written, rate) for body in bodies if body.name in (output.bodies or ())]
    return [sp.sympify(x) for x in MovingBodies(*zip(*moving, strict=True)).entries(output)]


def _expressions(body: Body, written: Change, rate: Change) -> tuple[sp.Expr, Array, Array, Array]:
    """The mass of ``body``, its place, its velocity and its spin."""
    place = _whole([written(x) for x in body.position or ()])
    turning = 0 if body.angle is None else written(body.inertia) * rate(written(body.angle))
    return written(body.mass), place, np.array([rate(x) for x in place], dtype=object), _whole([0, 0, turning])


def _whole(vector: Sequence[Any]) -> Array:
    """A ``vector`` of 2 or 3 expressions as (3,), with z = 0 in the plane."""
    return np.array([*map(sp.sympify, vector), *(sp.S.Zero,) * (3 - len(vector))], dtype=object)
