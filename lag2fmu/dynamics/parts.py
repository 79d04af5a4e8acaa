"""What equations of motion are made of, as nodes: variables, energies, constraints, rows that modes switch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.vectors import (
    Vector,
    cross,
    plus,
)


class Variables(NamedTuple):
    """The variables as nodes: t; q, qd, qdd, Q of n entries each; plain inputs, motions and independent parameters.

    - ``further``: the further states z, (f,).
    - ``further_rates``: their derivatives as nodes, (f,); empty until they are composed.
    - ``filtered``: (position, velocity) of each filtered motion, which are further states.
    - ``multipliers``: one for each constraint, (m,).
    - ``forces``: what the rows bear that modes switch, (R,), see ``RowNumbers``.
    - ``motions``: (y0, y0_dot, y0_ddot) of each motion input.
    - ``rates``: the first, then the second time derivatives of all inputs; empty unless ``Mechanism.has_input_rates``.
    """

    t: Node
    q: tuple[Node, ...]
    qd: tuple[Node, ...]
    qdd: tuple[Node, ...]
    multipliers: tuple[Node, ...]
    forces: tuple[Node, ...]
    Q: tuple[Node, ...]
    plain: tuple[Node, ...]
    motions: tuple[tuple[Node, Node, Node], ...]
    parameters: tuple[Node, ...]
    rates: tuple[Node, ...] = ()
    further: tuple[Node, ...] = ()
    filtered: tuple[tuple[Node, Node], ...] = ()
    further_rates: tuple[Node, ...] = ()

    @property
    def states(self) -> tuple[Node, ...]:
        """The vector x of the generated functions: q, qd and the further states, (2 n + f,)."""
        return (*self.q, *self.qd, *self.further)

    @property
    def unknowns(self) -> tuple[Node, ...]:
        """What the equations of motion determine: accelerations and multipliers, (n + m,)."""
        return (*self.qdd, *self.multipliers)

    @property
    def inputs(self) -> tuple[Node, ...]:
        """All inputs in the order of the FMU: Q, plain inputs, each motion with its derivatives."""
        return (*self.Q, *self.plain, *(node for motion in self.motions for node in motion))

    @property
    def driven(self) -> tuple[tuple[Node, Node], ...]:
        """(position, velocity) of each prescribed motion, in SI units; filtered motions stand behind the others."""
        return (*((y, y_dot) for y, y_dot, _ in self.motions), *self.filtered)

    @property
    def signals(self) -> tuple[Node, ...]:
        """The inputs and behind them their rates."""
        return (*self.inputs, *self.rates)

    def direction(self, graph: Graph, accelerating: bool) -> dict[Node, Node]:
        """The direction of time {variable: its rate}: 1 of t, qd of q, y0_dot of y0, and qdd of qd if ``accelerating``.

        Further states have the rates that are composed so far.
        """
        rates = {self.t: graph.one} | dict(zip(self.q, self.qd, strict=True))
        rates |= zip(self.further, self.further_rates, strict=False)
        if self.rates:
            rates |= dict(zip(self.signals, self.rates, strict=False))
        for y, y_dot, y_ddot in self.motions:
            rates |= {y: y_dot, y_dot: y_ddot}
        return rates | dict(zip(self.qd, self.qdd, strict=True)) if accelerating else rates

    def moves(self, graph: Graph, node: Node) -> bool:
        """Whether ``node`` contains velocities."""
        return bool(graph.depending([node], self.qd))


class Velocity(NamedTuple):
    """The velocity (3,) of a frame's origin (m/s) and its angular velocity (3,) (rad/s), both in the frame's axes."""

    linear: Vector
    angular: Vector

    def at(self, g: Graph, place: Vector, rate: Vector) -> Vector:
        """The velocity (3,) of the point ``place`` (m), which moves with ``rate`` (m/s) in the frame; in its axes."""
        return plus(g, plus(g, self.linear, cross(g, self.angular, place)), rate)


class Inertia(NamedTuple):
    """A mass or moment of inertia ``weight`` that moves along ``place``: T = 1/2 weight (d place/dt)^2.

    ``weight`` in kg or kg.m2, ``place`` in m or rad; ``gravity`` is the acceleration of gravity along ``place``, m/s2.
    """

    weight: Node
    place: Node
    gravity: Node


class RigidInertia(NamedTuple):
    """A spatial body: ``mass`` (kg) and inertia ``tensor`` (3, 3) in kg.m2 about its mass centre, in its frame's axes.

    All vectors are in these axes. ``velocity``: that of the mass centre (m/s) and the angular velocity (rad/s), (3,)
    each. ``shift``: the parts J qd of both, without the parts that prescribed motions make. ``gravity`` (3,): the
    acceleration of gravity, m/s2. T = 1/2 m v.v + 1/2 omega.I.omega.
    Source: Goldstein, Classical Mechanics, section 5.3.
    """

    mass: Node
    tensor: tuple[Vector, ...]
    velocity: Velocity
    shift: Velocity
    gravity: Vector


@dataclass(frozen=True)
class Energies:
    """What the Lagrange equations are made of, as nodes in SI units.

    - ``inertias``: the particles and planar bodies, each mass along every axis and each moment of inertia.
    - ``rigid``: the spatial bodies.
    - ``potential``: V (J) of springs and of the user, as far as it contains no velocities.
    - ``remainder``: the user's other terms of L (J): further kinetic energy, potentials with velocities, or a whole
      Lagrangian.
    - ``dissipation``: R (W); ``resistance``: the power (W) that dampers with a law of force dissipate, which have no R.
    - ``effort``: {place: force} of the loads; the generalized forces are Q = sum force * dplace/dq.
    - ``impetus``: {velocity: force} of the loads on frames; Q = sum force * dvelocity/dqd.
    - ``direct``: forces on the coordinates themselves, (n,), with the external inputs Q.
    - ``on_motions``: forces on the prescribed motions, (k,); their drives have to overcome them.
    - ``split``: whether T and V are told apart.
    - ``carried``: {velocity: inertia} of velocities that vanish along the motion. They get a fictitious inertia that
      makes M regular.
    """

    inertias: tuple[Inertia, ...]
    rigid: tuple[RigidInertia, ...]
    potential: Node
    remainder: Node
    dissipation: Node
    resistance: Node
    effort: dict[Node, Node]
    impetus: dict[Node, Node]
    direct: tuple[Node, ...]
    on_motions: tuple[Node, ...]
    kinetic_energy: Node
    potential_energy: Node
    split: bool
    carried: Mapping[Node, Node] = field(default_factory=dict)

    def lagrangian(self, graph: Graph) -> Node:
        """L = T - V (J) as a node, the inertias included."""
        bodies = graph.subtract(self.kinetic_energy, self.potential_energy)
        return bodies if self.split else graph.add(bodies, self.remainder)


@dataclass(frozen=True)
class Constraints:
    """The constraints as nodes, the h holonomic ones first, m in all.

    ``positions``: phi (h,); ``velocities``: G qd + b (m,); ``accelerations``: gamma (m,); ``jacobian``: G (m, n).
    """

    positions: tuple[Node, ...]
    velocities: tuple[Node, ...]
    accelerations: tuple[Node, ...]
    jacobian: tuple[tuple[Node, ...], ...]

    def __len__(self) -> int:
        return len(self.velocities)

    @property
    def residuals(self) -> tuple[Node, ...]:
        """What each constraint demands to be zero, (m,): phi, or G qd + b of a nonholonomic one."""
        return (*self.positions, *self.velocities[len(self.positions) :])

    def equation(self, k: int) -> tuple[Node, Node, Node]:
        """Residual, velocity and acceleration of the constraint ``k``."""
        return self.residuals[k], self.velocities[k], self.accelerations[k]


class RowNumbers(NamedTuple):
    """The R rows: gaps of the U contacts and stops, their S slips, F dry frictions, then L latches.

    - ``positions``: the gaps (U,), and behind them the positions of the holonomic latches. The holonomic latches stand
      first among latches.
    - ``velocities``, ``accelerations`` (gamma), ``forces`` (the multipliers): (R,).
    - ``jacobian``: (R, n).
    - ``slips``: how many slips each contact has, (U,).
    - ``restitution``, ``friction``, ``static_friction``: (U,), without a unit.
    - ``sliding``, ``holding``: the magnitudes of the forces of the dry frictions when they slide and hold, (F,).
    - ``conditions``: (L,), positive while a latch holds.
    """

    positions: tuple[Node, ...]
    velocities: tuple[Node, ...]
    accelerations: tuple[Node, ...]
    jacobian: tuple[tuple[Node, ...], ...]
    forces: tuple[Node, ...]
    slips: tuple[int, ...]
    restitution: tuple[Node, ...]
    friction: tuple[Node, ...]
    static_friction: tuple[Node, ...]
    sliding: tuple[Node, ...]
    holding: tuple[Node, ...]
    conditions: tuple[Node, ...]

    def __len__(self) -> int:
        return len(self.velocities)

    @property
    def gaps(self) -> tuple[Node, ...]:
        """The gaps, (U,)."""
        return self.positions[: len(self.slips)]

    def symbols(self, graph: Graph) -> set[str]:
        """The names of all variables that the rows depend on, without the forces that rows bear."""
        of_rows = (*self.positions, *self.velocities, *self.accelerations, *(x for row in self.jacobian for x in row))
        of_laws = (*self.restitution, *self.friction, *self.static_friction, *self.sliding, *self.holding)
        return graph.symbols([*of_rows, *of_laws]) - {str(graph.leaf[node]) for node in self.forces}

    @property
    def frictional(self) -> range:
        """The rows that may slide with friction: slips and dry frictions."""
        return range(len(self.slips), len(self.slips) + sum(self.slips) + len(self.sliding))

    @property
    def latches(self) -> range:
        """The rows of latches."""
        return range(self.frictional.stop, len(self))


class Solution(NamedTuple):
    """x of M x = rhs, (n,) nodes, and the pivots, (n,) nodes, positive where M is positive definite."""

    x: tuple[Node, ...]
    pivots: tuple[Node, ...]


Entries = Mapping[tuple[Node, Node], Node]
"""A quadratic form over linear nodes, {(a, b): H_ab} with each pair once."""
