"""Energies, forces and outputs of the parts on frames, as numbers; for small mechanisms also as SymPy expressions.

T = 1/2 m v . v + 1/2 w . J w with the velocity v of the mass centre, and the full inertia tensor J about the mass
centre in the axes of the frame (Koenig; H. Goldstein, Classical Mechanics, sections 1.2 and 5.3). A force F at a point
of velocity v has the generalized forces Q_j = F . dv/dqd_j. A torque tau on a frame of angular velocity w has
tau . dw/dqd_j (T. Kane, D. Levinson, Dynamics, section 4.4). v and w are affine in the velocities, so that unit
velocities give these derivatives.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import sympy as sp

from lag2fmu.description.outputs import ACCELERATIONS
from lag2fmu.description.parts import Damper, Load, Spring
from lag2fmu.description.places import WORLD, Body
from lag2fmu.language.rebuilding import replaced
from lag2fmu.language.vocabulary import TIME
from lag2fmu.reference.composition import Composition
from lag2fmu.reference.frames import (
    Element,
    FramePose,
    Mass,
    apply,
    apply_transposed,
    dot,
    growth,
    links_of,
    poses_of,
    rotational,
    spot_of,
)
from lag2fmu.reference.functions import STEP, Array, Compiled, Slots, compiled, in_blocks
from lag2fmu.reference.quaternions import Quaternions
from lag2fmu.reference.spatial_outputs import SpatialOutputs

_RATE = sp.Dummy("rate", real=True)

Energies = tuple[Any, Any, Any]
"""T, V (J) and R (W): arrays, or expressions."""


class Spatial:
    """The parts on frames of a mechanism, in SI units; rows are t, q, qd, y, y_dot, (1 + 2 n + 2 k, *shape)."""

    def __init__(self, composition: Composition, constants: Sequence[np.float64]) -> None:
        self._composition, self._constants = composition, constants
        m, s = composition.mechanism, composition.symbols
        slots = Slots(composition.written, composition.rate)
        self.n = len(s.q)
        self._links = links_of(m.frames, slots)
        self._bodies = [self._mass(body, slots) for body in m.bodies if body.frame is not None]
        self._springs = [self._element(spring, slots) for spring in m.springs if self._framed(spring)]
        self._dampers = [self._element(damper, slots) for damper in m.dampers if self._framed(damper)]
        self._loads = [x for x in m.loads if composition.on_frame(x.point if x.point is not None else x.body)]
        self._outputs = [
            x for x in m.outputs if x.frame is not None or composition.on_frame(x.point) or (m.frames and x.bodies)
        ]
        summed = self._summed(slots)
        self._spots = {place.name: spot_of(*m.location(place.name), slots) for place in m.places if place.frame}
        self._pull = slots.add(self._gravity())
        self._configuration = (TIME, *s.q, *s.qd, *s.motion, *s.motion_dot)
        self.expressions = slots.expressions
        self._local = compiled((*self._configuration, *s.parameters), self.expressions)
        arguments = (TIME, *s.q, *s.qd, *s.inputs)
        self._forceful = self._forces_of_dampers((*arguments, _RATE, *s.parameters))
        entries = [x for load in self._loads for x in composition.effort(load)]
        self._entries = compiled((*arguments, *s.parameters), entries)
        self._told = SpatialOutputs(summed, self._spots, self._pull, self._quaternions())

    def _summed(self, slots: Slots) -> dict[str, Mass]:
        """The bodies over which outputs sum, by name."""
        named = {str(name) for output in self._outputs for name in output.bodies or ()}
        return {body.name: self._mass(body, slots) for body in self._composition.mechanism.bodies if body.name in named}

    def _quaternions(self) -> Quaternions:
        """Those of the frames whose quaternion is an output."""
        composition = self._composition
        wanted = [str(x.frame) for x in self._outputs if x.quantity == "quaternion"]
        own = Slots(composition.written, composition.rate)
        arguments = (*self._configuration, *composition.symbols.parameters)
        return Quaternions(composition.mechanism.frames, wanted, own, arguments, self._constants)

    def _forces_of_dampers(self, arguments: Sequence[sp.Symbol]) -> list[tuple[Element, Compiled]]:
        """(element, its force as a function of ``arguments``) of each damper on frames that has a force."""
        dampers = zip(filter(self._framed, self._composition.mechanism.dampers), self._dampers, strict=True)
        written = self._composition.written
        return [(e, compiled(arguments, [written(d.force_at(_RATE))])) for d, e in dampers if d.force is not None]

    @property
    def loaded(self) -> bool:
        """Whether loads, or dampers with a force, act on frames."""
        return bool(self._loads or self._forceful)

    @property
    def rated(self) -> int:
        """How many dampers with a force act on frames."""
        return len(self._forceful)

    @property
    def empty(self) -> bool:
        """Whether nothing is on a frame."""
        return not self._links and not self._spots

    # ------------------------------------------------------------------------------------------------- what users ask

    def energies(self, rows: Array) -> Array:
        """T, V (J) and R (W) of the parts on frames, (3, *shape): Koenig's theorem, Goldstein, section 5.3."""

        def evaluate(block: Array) -> Array:
            values = self._local(block, self._constants)
            return np.stack(np.broadcast_arrays(*self.terms(values, np.sqrt, np.zeros(block.shape[1:], block.dtype))))

        return in_blocks(evaluate, rows, 3)

    def symbolic(self) -> Energies:
        """T, V (J) and R (W) as expressions. They grow with every frame, and serve small mechanisms only."""
        return self.terms(np.array(self.expressions, dtype=object), sp.sqrt, sp.S.Zero)

    def forces(self, rows: Array, inputs: Array) -> Array:
        """Q of loads and of dampers with a force on frames (n, *shape).

        ``inputs`` (3 k + m + n, *shape) are those of ``Symbols.inputs``. Source: Kane, Levinson, section 4.4.
        """
        if not self.loaded:
            return np.zeros((self.n, *rows.shape[1:]))
        n = self.n
        arguments = np.concatenate([rows[: 1 + 2 * n], inputs])
        entries = self._entries(arguments, self._constants)

        def evaluate(block: Array) -> Array:
            unit, at = block[: len(rows), None].repeat(n + 1, axis=1), block[len(rows) :]
            given, at = at[: len(arguments)], at[len(arguments) :]
            unit[1 + n : 1 + 2 * n] = np.eye(n, n + 1, 1)[..., None]
            values = self._local(unit, self._constants)
            poses = poses_of(self._links, values)
            return self._generalized(poses, values, at) - self._resisting(poses, values, given)

        return in_blocks(evaluate, np.concatenate([rows, arguments, entries]), n, width=n + 1)

    def resistance(self, rows: Array, inputs: Array) -> Array:
        """The power (W) that dampers with a force on frames dissipate, (*shape); ``inputs`` as those of ``forces``."""

        def evaluate(block: Array) -> Array:
            rates = self.rates(self._local(block[: len(rows)], self._constants), np.sqrt)
            pairs = zip(rates, self._forceful, strict=True)
            powers = [force(np.vstack([block[len(rows) :], x]), self._constants) * x for x, (_, force) in pairs]
            total: Array = np.vstack([np.zeros((1, block.shape[1])), *powers]).sum(axis=0)
            return total

        power: Array = in_blocks(evaluate, np.concatenate([rows, rows[: 1 + 2 * self.n], inputs]), 1)[0]
        return power

    def symbolic_forces(self) -> list[sp.Expr]:
        """Q of loads and of dampers with a force on frames as expressions, (n,)."""
        values = np.array(self.expressions, dtype=object)
        found = self.efforts([sp.sympify(rate) for rate in self.rates(values, sp.sqrt)])
        names = [sp.Dummy(real=True) for _ in found]  # an effort may depend on velocities, but is not differentiated
        power, known = sp.sympify(self.power(values, names, sp.sqrt)), dict(zip(names, found, strict=True))
        return [replaced(power.diff(v), known) for v in self._composition.symbols.qd]

    def rates(self, values: Array, root: Callable[[Any], Any]) -> list[Any]:
        """The rates (m/s) at which the dampers with a force grow longer; ``values`` are those of ``terms``."""
        poses = poses_of(self._links, values)
        return [growth(*element.gap(poses, values), root) for element, _ in self._forceful]

    def efforts(self, rates: Sequence[sp.Expr]) -> list[sp.Expr]:
        """The 3 entries of each load, and the force of each damper with one as an expression of its rate."""
        composition = self._composition
        entries = [x for load in self._loads for x in composition.effort(load)]
        dampers = [x for x in filter(self._framed, composition.mechanism.dampers) if x.force is not None]
        return entries + [composition.written(x.force_at(r)) for x, r in zip(dampers, rates, strict=True)]

    def power(self, values: Array, efforts: Sequence[Any], root: Callable[[Any], Any]) -> Any:
        """The power (W) of the ``efforts`` (N, N.m) at ``values``; the generalized forces Q are its slope along qd."""
        poses, forces = poses_of(self._links, values), efforts[3 * len(self._loads) :]
        total: Any = 0
        for i, load in enumerate(self._loads):
            moved, R = self._moved(load, poses, values)
            vector = np.array(efforts[3 * i : 3 * i + 3], dtype=object)
            total = total + dot(vector if load.axes == WORLD else apply(R, vector), moved)
        for rate, force in zip(self.rates(values, root), forces, strict=True):
            total = total - force * rate
        return total

    def outputs(self, rows: Array, rates: Array) -> dict[str, Array]:
        """The outputs that are quantities on frames, {name: (*shape)}, in SI units; ``rates`` are d/dt of ``rows``.

        Accelerations are complex steps of velocities along the motion.
        """
        names = [name for output in self._outputs for name in output.names]

        def evaluate(block: Array) -> Array:
            here = block[: len(rows)]
            values, moved = (self._local(x, self._constants) for x in (here, here + 1j * STEP * block[len(rows) :]))
            poses, later = poses_of(self._links, values), poses_of(self._links, moved)
            found = [
                self._told.change(output, poses, later, moved)
                if output.quantity in ACCELERATIONS
                else self._told.quantity(output, poses, values, here)
                for output in self._outputs
            ]
            return np.concatenate([np.broadcast_to(x, (len(x), block.shape[1])) for x in found])

        both = np.concatenate([rows, rates])
        return dict(zip(names, in_blocks(evaluate, both, len(names)), strict=True)) if names else {}

    def position(self, rows: Array, name: str) -> Array:
        """The position (m) in world axes of the point or body ``name`` on a frame, (3, *shape)."""

        def evaluate(block: Array) -> Array:
            values = self._local(block, self._constants)
            return self._spots[name].motion(poses_of(self._links, values), values)[0]

        return in_blocks(evaluate, rows, 3)

    # -------------------------------------------------------------------------------------------------- how it is done

    def _framed(self, part: Spring | Damper) -> bool:
        return part.between is not None and any(self._composition.on_frame(end) for end in part.between)

    def _mass(self, body: Body, slots: Slots) -> Mass:
        spot, written = spot_of(*self._composition.mechanism.location(body.name), slots), slots.written
        tensor = None if body.inertia is None else slots.add([written(x) for x in body.inertia])  # type: ignore[union-attr]
        return Mass(spot, slots.add([written(body.mass)]), tensor)

    def _element(self, part: Spring | Damper, slots: Slots) -> Element:
        at = self._composition.mechanism.location
        a, b = (spot_of(*at(str(end)), slots) for end in part.between or ())
        written = self._composition.written
        if isinstance(part, Damper):
            return Element((a, b), slots.add([written(part.damping)]), True)
        length = written(part.length)
        return Element((a, b), slots.add([written(part.stiffness), length]), length == 0)

    def _gravity(self) -> list[sp.Expr]:
        """The vector of the acceleration of gravity."""
        gravity, written = self._composition.mechanism.gravity, self._composition.written
        if gravity is None:
            return [sp.S.Zero] * 3
        return [written(gravity.acceleration) * written(x) for x in gravity.direction or (0, 0, -1)]

    def terms(self, values: Array, root: Callable[[Any], Any], zero: Any) -> Energies:
        """T, V (J) and R (W), (*shape), for ``values`` (k, *shape) of the ``expressions``; ``root``: a square root."""
        poses = poses_of(self._links, values)
        T, V, R = zero, zero, zero
        for body in self._bodies:
            x, v = body.spot.motion(poses, values)
            (mass,) = values[body.mass]
            T = T + mass * dot(v, v) / 2
            V = V - mass * dot(values[self._pull], x)
            if body.inertia is not None:
                pose = poses[body.spot.frame]
                T = T + rotational(apply_transposed(pose.R, pose.w), values[body.inertia]) / 2
        for spring in self._springs:
            gap, _ = spring.gap(poses, values)
            stiffness, length = values[spring.values]
            square = dot(gap, gap) if spring.free else (root(dot(gap, gap)) - length) ** 2
            V = V + stiffness * square / 2
        for damper in self._dampers:
            gap, rate = damper.gap(poses, values)
            (damping,) = values[damper.values]
            R = R + damping * dot(gap, rate) ** 2 / dot(gap, gap) / 2
        return T, V, R

    def _moved(self, load: Load, poses: dict[str, FramePose], values: Array) -> tuple[Array, Array]:
        """The velocity v (m/s) or w (rad/s) along which ``load`` acts, and the axes R (3, 3) of its frame."""
        spot = self._spots[str(load.body if load.point is None else load.point)]
        pose = poses[spot.frame]
        return (pose.w if load.force is None else spot.motion(poses, values)[1]), pose.R

    def _generalized(self, poses: dict[str, FramePose], values: Array, entries: Array) -> Array:
        """Q (n, N) from velocities at zero and unit velocities, (..., n + 1, N), and the ``entries`` of loads."""
        total: Array = np.zeros((self.n, entries.shape[1]))
        for i, load in enumerate(self._loads):
            vector = entries[3 * i : 3 * i + 3]
            moved, R = self._moved(load, poses, values)
            if load.axes != WORLD:
                vector = apply(np.broadcast_to(R, (3, 3, *values.shape[1:]))[:, :, 0], vector)
            moved = np.broadcast_to(moved, (3, *values.shape[1:]))
            total = total + dot(vector[:, None], moved[:, 1:] - moved[:, :1])
        return total

    def _resisting(self, poses: dict[str, FramePose], values: Array, given: Array) -> Array:
        """F drate/dqd, (n, N), of the dampers with a force F; the rates are those at zero and unit velocities.

        ``given``: t, q, qd and the inputs, (1 + 3 k + m + 3 n, N).
        """
        n = self.n
        total: Array = np.zeros((n, given.shape[1]))
        for element, force in self._forceful:
            rates = growth(*element.gap(poses, values), np.sqrt)
            slopes = rates[1:] - rates[:1]
            rate = rates[:1] + (slopes * given[1 + n : 1 + 2 * n]).sum(axis=0)
            total = total + force(np.concatenate([given, rate]), self._constants) * slopes
        return total
