"""Frames composed on the graph: velocities from parent to child in the child's axes, poses in the world's axes.

The velocity v of a frame's origin and its angular velocity omega are vectors in the frame's own axes. From the parent
P to a child at d with the rotation R (r_P = d + R r):

    v = R^T (v_P + omega_P x d + d_dot),    omega = R^T omega_P + (rotation rates about their own axes).

Source: R. Featherstone, Rigid Body Dynamics Algorithms, section 2.8; J. J. Craig, Introduction to Robotics, 5.6.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from lag2fmu.description.places import WORLD, Frame
from lag2fmu.dynamics.parts import Velocity
from lag2fmu.graph.from_sympy import Translator
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.vectors import (
    AxisTurn,
    Vector,
    apply,
    cross,
    minus,
    plus,
    quaternion_product,
    times,
    turn_by_quaternion,
)
from lag2fmu.mechanism.record import Mechanism

Rate = Callable[[Sequence[Node]], Sequence[Node]]
"""A function from nodes, (k,), to their derivatives along a motion, (k,)."""


class Frames:
    """All frames of a mechanism: their velocities (m/s, rad/s) and poses as nodes."""

    def __init__(self, graph: Graph, mechanism: Mechanism, put: Translator) -> None:
        self.g, self.put = graph, put
        self.by_name: dict[str, Frame] = {frame.name: frame for frame in mechanism.frames}
        zero, one = graph.zero, graph.one
        self.unit: tuple[Vector, ...] = ((one, zero, zero), (zero, one, zero), (zero, zero, one))
        self._axes: dict[str, tuple[Vector, ...]] = {WORLD: self.unit}
        self._origin: dict[str, Vector] = {WORLD: (zero, zero, zero)}

    # -------------------------------------------------------------------------------------------------- one frame

    def _turns(self, frame: Frame) -> tuple[AxisTurn, ...]:
        return tuple(AxisTurn(self._unit_axis(axis), self.put(angle)) for axis, angle in frame.rotations)

    def _unit_axis(self, axis: str | Sequence[object]) -> Vector:
        if isinstance(axis, str):
            return self.unit["xyz".index(axis)]
        vector = self.put.vector(tuple(axis))
        norm = self.g.apply("sqrt", self.g.dot(vector, vector))
        return tuple(self.g.divide(x, norm) for x in vector)

    def _down(self, frame: Frame, a: Vector) -> Vector:
        """``a`` from the parent's axes to those of ``frame``"""
        if frame.quaternion is not None:
            return turn_by_quaternion(self.g, self.put.vector(tuple(frame.quaternion)), a, back=True)
        for turn in self._turns(frame):
            a = turn.turn(self.g, a, back=True)
        return a

    def _up(self, frame: Frame, a: Vector) -> Vector:
        """``a`` from the axes of ``frame`` to those of its parent"""
        if frame.quaternion is not None:
            return turn_by_quaternion(self.g, self.put.vector(tuple(frame.quaternion)), a)
        for turn in reversed(self._turns(frame)):
            a = turn.turn(self.g, a)
        return a

    def _angular(self, frame: Frame, parent: Vector, rate: Rate) -> Vector:
        """The angular velocity of ``frame`` in its own axes; ``parent`` is that of its parent, in the parent's axes."""
        g = self.g
        if frame.quaternion is not None:
            e = self.put.vector(tuple(frame.quaternion))
            de = tuple(rate(e))
            own = minus(g, minus(g, times(g, e[0], de[1:]), times(g, de[0], e[1:])), cross(g, e[1:], de[1:]))
            return plus(g, self._down(frame, parent), times(g, g.constant(2), own))
        for turn in self._turns(frame):
            (spin,) = rate([turn.angle])
            parent = plus(g, turn.turn(g, parent, back=True), turn.angular_velocity(g, spin))
        return parent

    # -------------------------------------------------------------------------------------------------- velocities

    def velocities(self, rate: Rate) -> dict[str, Velocity]:
        """{frame: Velocity}, with time derivatives by ``rate``; the world rests.

        Source: R. Featherstone, Rigid Body Dynamics Algorithms, section 2.8; the formula stands in the module's head.
        """
        rest = (self.g.zero,) * 3
        known = {WORLD: Velocity(rest, rest)}
        for name in self.by_name:
            self._extend(name, known, rate)
        return known

    def _extend(self, name: str, known: dict[str, Velocity], rate: Rate) -> None:
        """Add the velocity of ``name``, and before it those of the frames it is on."""
        chain = [name]
        while chain[-1] not in known:
            chain.append(str(self.by_name[chain[-1]].parent))
        for child, parent in zip(reversed(chain[:-1]), reversed(chain[1:]), strict=True):
            frame = self.by_name[child]
            place = self.put.vector(tuple(frame.origin))
            linear = known[parent].at(self.g, place, tuple(rate(place)))
            angular = self._angular(frame, known[parent].angular, rate)
            known[child] = Velocity(self._down(frame, linear), angular)

    def spread(self, vector: Vector) -> dict[str, Vector]:
        """{frame: the ``vector`` (3,) of world axes in its axes}."""
        known = {WORLD: vector}
        for name in self.by_name:
            chain = [name]
            while chain[-1] not in known:
                chain.append(str(self.by_name[chain[-1]].parent))
            for child, parent in zip(reversed(chain[:-1]), reversed(chain[1:]), strict=True):
                known[child] = self._down(self.by_name[child], known[parent])
        return known

    # -------------------------------------------------------------------------------------------------- poses

    def axes(self, name: str) -> tuple[Vector, ...]:
        """The rotation matrix R (3, 3) of a frame, r_world = R r, as its three columns."""
        if name not in self._axes:
            frame = self.by_name[name]
            columns = [self._up(frame, unit) for unit in self.unit]
            self._axes[name] = tuple(self.to_world(str(frame.parent), column) for column in columns)
        return self._axes[name]

    def to_world(self, name: str, a: Vector) -> Vector:
        """The vector ``a`` (3,), given in the axes of the frame ``name``, in world axes."""
        return a if name == WORLD else apply(self.g, tuple(zip(*self.axes(name), strict=True)), a)

    def to_frame(self, name: str, a: Vector) -> Vector:
        """The vector ``a`` (3,), given in world axes, in the axes of the frame ``name``."""
        return a if name == WORLD else apply(self.g, self.axes(name), a)

    def position(self, name: str, place: Vector) -> Vector:
        """The position (3,) in world axes, in m, of a point that is at ``place`` (3,), in m, in the frame ``name``."""
        return plus(self.g, self.origin(name), self.to_world(name, place))

    def origin(self, name: str) -> Vector:
        """The origin (3,) of a frame in world axes, in m."""
        if name not in self._origin:
            frame = self.by_name[name]
            self._origin[name] = self.position(str(frame.parent), self.put.vector(tuple(frame.origin)))
        return self._origin[name]

    def quaternion(self, name: str) -> Vector:
        """The unit quaternion (e0, e1, e2, e3) that turns the world's axes into those of the frame ``name``, (4,).

        It is the product of the quaternions of the rotations. Source: J. Wittenburg, Dynamics of Multibody Systems, 2nd
        edition, chapter 2.
        """
        if name == WORLD:
            return (self.g.one, *(self.g.zero,) * 3)
        frame = self.by_name[name]
        result = self.quaternion(str(frame.parent))
        if frame.quaternion is not None:
            return quaternion_product(self.g, result, self.put.vector(tuple(frame.quaternion)))
        for turn in self._turns(frame):
            result = quaternion_product(self.g, result, turn.quaternion(self.g))
        return result

    def angles(self, name: str) -> Vector:
        """The Cardan angles (3,) about x, y, z of a frame against the world, in rad: R = Rx Ry Rz.

        Singular at y = +-pi/2. Source: J. Wittenburg, Dynamics of Multibody Systems, 2nd edition, chapter 2.
        """
        g, (first, second, third) = self.g, self.axes(name)
        y = g.apply("atan2", third[0], g.apply("sqrt", g.dot(third[1:], third[1:])))
        return (g.apply("atan2", g.negate(third[1]), third[2]), y, g.apply("atan2", g.negate(second[0]), first[0]))
