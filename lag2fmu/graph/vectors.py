"""Vectors of 3 nodes, and rotations of them, on the graph."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from lag2fmu.graph.graph import Graph, Node

Vector = tuple[Node, ...]
"""The nodes (d,) of a vector; d is 3, or 2 for the positions of a planar mechanism."""


def plus(g: Graph, a: Vector, b: Vector) -> Vector:
    """a + b, (d,)"""
    return tuple(g.add(x, y) for x, y in zip(a, b, strict=True))


def minus(g: Graph, a: Vector, b: Vector) -> Vector:
    """a - b, (d,)"""
    return tuple(g.subtract(x, y) for x, y in zip(a, b, strict=True))


def times(g: Graph, factor: Node, a: Vector) -> Vector:
    """factor * a, (d,)"""
    return tuple(g.multiply(factor, x) for x in a)


def cross(g: Graph, a: Vector, b: Vector) -> Vector:
    """a x b, (3,)"""
    return tuple(g.subtract(g.multiply(a[i], b[j]), g.multiply(a[j], b[i])) for i, j in ((1, 2), (2, 0), (0, 1)))


def apply(g: Graph, matrix: Sequence[Vector], a: Vector) -> Vector:
    """The product (k,) of a ``matrix`` (k, d), given by rows, and a vector ``a`` (d,)."""
    return tuple(g.dot(row, a) for row in matrix)


class AxisTurn(NamedTuple):
    """A rotation about the unit vector ``axis`` ((3,) nodes) by ``angle``, in rad."""

    axis: Vector
    angle: Node

    def turn(self, g: Graph, a: Vector, back: bool = False) -> Vector:
        """R a (3,), from the turned axes to the old ones; with ``back`` R^T a, from the old axes to the turned ones.

        ``a`` is (3,). Rodrigues' formula is R a = a cos + n x a sin + n (n.a)(1 - cos) for the axis n; about a
        coordinate axis it becomes a plane rotation. Source: Goldstein, Classical Mechanics, section 4.7 (finite
        rotations).
        """
        sine, cosine = g.apply("sin", self.angle), g.apply("cos", self.angle)
        sine = g.negate(sine) if back else sine
        if sorted(self.axis) == sorted((g.one, g.zero, g.zero)):
            k = self.axis.index(g.one)
            i, j = (k + 1) % 3, (k + 2) % 3
            turned = list(a)
            turned[i] = g.subtract(g.multiply(cosine, a[i]), g.multiply(sine, a[j]))
            turned[j] = g.add(g.multiply(sine, a[i]), g.multiply(cosine, a[j]))
            return tuple(turned)
        along = g.multiply(g.dot(self.axis, a), g.subtract(g.one, cosine))
        in_plane = plus(g, times(g, cosine, a), times(g, sine, cross(g, self.axis, a)))
        return plus(g, in_plane, times(g, along, self.axis))

    def angular_velocity(self, g: Graph, rate: Node) -> Vector:
        """The angular velocity (3,) in rad/s of the turned axes relative to the old ones, for a ``rate`` in rad/s.

        Its components are the same in both systems of axes.
        """
        return times(g, rate, self.axis)

    def quaternion(self, g: Graph) -> Vector:
        """(cos angle/2, axis sin angle/2), (4,): Goldstein, section 4.5 (Euler parameters)"""
        half = g.multiply(g.constant_half, self.angle)
        return (g.apply("cos", half), *times(g, g.apply("sin", half), self.axis))


def turn_by_quaternion(g: Graph, e: Vector, a: Vector, back: bool = False) -> Vector:
    """R a (R^T a with ``back``), (3,), for the unit quaternion (e0, e): a + 2 e0 e x a + 2 e x (e x a).

    Source: J. B. Kuipers, Quaternions and Rotation Sequences, chapter 5.
    """
    e0 = g.negate(e[0]) if back else e[0]
    once = cross(g, e[1:], a)
    both = plus(g, times(g, e0, once), cross(g, e[1:], once))
    return plus(g, a, times(g, g.constant(2), both))


def quaternion_product(g: Graph, a: Vector, b: Vector) -> Vector:
    """The product a b (4,) of quaternions (4,), scalar first: the rotation b followed by the rotation a."""
    scalar = g.subtract(g.multiply(a[0], b[0]), g.dot(a[1:], b[1:]))
    vector = plus(g, times(g, a[0], b[1:]), times(g, b[0], a[1:]))
    return (scalar, *plus(g, vector, cross(g, a[1:], b[1:])))
