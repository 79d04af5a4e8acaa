"""Fingerprints of sines and cosines: points of the unit circle modulo a prime.

Sums of angles are products of such points, so that sin^2 + cos^2 = 1 and the addition theorems hold.
"""

from __future__ import annotations

from lag2fmu.graph.fingerprint import PRIME, random_mark
from lag2fmu.graph.nodes import Node, Nodes
from lag2fmu.graph.operations import ADD, NEGATE, SUBTRACT

Point = tuple[int, int]
"""(cos, sin) of an angle, as a point of the unit circle modulo PRIME."""


class Circle:
    """The points of the circle for the angles of a graph.

    The points of sums, differences and opposites of angles follow from those of the parts by the addition theorems.
    """

    def __init__(self) -> None:
        self.known: dict[Node, Point] = {}

    def copy(self) -> Circle:
        """The same points, for a copy of the graph."""
        other = Circle()
        other.known = self.known.copy()
        return other

    def point(self, graph: Nodes, angle: Node) -> Point:
        """The point of the node ``angle``."""
        known = self.known.get(angle)
        if known is None:
            known = self.known[angle] = self._new(graph, angle)
        return known

    def _new(self, graph: Nodes, angle: Node) -> Point:
        code, operands = graph.code[angle], graph.operands[angle]
        if code in (ADD, SUBTRACT):
            (c, s), (d, t) = (self.point(graph, operand) for operand in operands)
            t = t if code == ADD else -t
            return (c * d - s * t) % PRIME, (s * d + c * t) % PRIME
        if code == NEGATE:
            c, s = self.point(graph, operands[0])
            return c, -s % PRIME
        if graph.leaf.get(angle) == 0:
            return 1, 0
        tangent = random_mark("angle", [graph.marks[angle]])  # of half the angle
        inverse = pow(1 + tangent * tangent, -1, PRIME)
        return (1 - tangent * tangent) * inverse % PRIME, 2 * tangent * inverse % PRIME
