"""Fingerprints: every node evaluated at one random point modulo the prime 2^61 - 1.

Two expressions with equal fingerprints are equal, but for a chance of about (nodes^2 * degree) / 2^61 (Schwartz and
Zippel). Sines and cosines are points of the unit circle and sums of angles are products of such points, so that
sin^2 + cos^2 = 1 and the addition theorems hold. Other functions are random values of their operands' fingerprints.
Source: J. T. Schwartz, J. ACM 27 (1980) 701-717; the same idea for program graphs: W. A. Martin, J. ACM 18 (1971) 549.
"""

from __future__ import annotations

import math
import random
from fractions import Fraction
from typing import TYPE_CHECKING

from lag2fmu.dynamics.operations import ADD, CODE, CONSTANT, DIVIDE, MULTIPLY, NEGATE, SUBTRACT, SYMBOL

if TYPE_CHECKING:
    from lag2fmu.dynamics.graph import Graph

PRIME = (1 << 61) - 1
_SIN, _COS = CODE["sin"], CODE["cos"]
Point = tuple[int, int]
"""(cos, sin) of an angle, as a point of the unit circle modulo PRIME."""


def fingerprint(graph: Graph, code: int, first: object, second: int) -> int:
    """The value modulo PRIME of the node (code, first, second), whose operands are in ``graph`` already."""
    values = graph.fingerprints
    if code == SYMBOL:
        return _random("symbol", first)
    if code == CONSTANT:
        return _constant(first)
    assert isinstance(first, int)
    a = values[first]
    if code == NEGATE:
        return -a % PRIME
    if code == _SIN:
        return _point(graph, first)[1]
    if code == _COS:
        return _point(graph, first)[0]
    b = values[second]
    if code == ADD:
        return (a + b) % PRIME
    if code == SUBTRACT:
        return (a - b) % PRIME
    if code == MULTIPLY:
        return a * b % PRIME
    if code == DIVIDE:
        return a * pow(b, -1, PRIME) % PRIME if b else _random("division", (a, b))
    return _random(code, (a, b))


def _random(kind: object, key: object) -> int:
    """A value that depends on nothing but its arguments (strings seed the generator, whatever the hash seed)."""
    return random.Random(f"{kind} {key}").randrange(1, PRIME)


def _constant(value: object) -> int:
    exact = Fraction(value) if isinstance(value, (float, Fraction)) and math.isfinite(value) else None
    if exact is None or exact.denominator % PRIME == 0:
        return _random("constant", repr(value))
    return exact.numerator * pow(exact.denominator, -1, PRIME) % PRIME


def _point(graph: Graph, angle: int) -> Point:
    """The point of the circle for the node ``angle``; sums, differences and opposites by the addition theorems."""
    known = graph.circle.get(angle)
    if known is None:
        known = graph.circle[angle] = _new_point(graph, angle)
    return known


def _new_point(graph: Graph, angle: int) -> Point:
    code, operands = graph.code[angle], graph.operands(angle)
    if code in (ADD, SUBTRACT):
        (c, s), (d, t) = (_point(graph, operand) for operand in operands)
        t = t if code == ADD else -t
        return (c * d - s * t) % PRIME, (s * d + c * t) % PRIME
    if code == NEGATE:
        c, s = _point(graph, operands[0])
        return c, -s % PRIME
    if angle == graph.zero:
        return 1, 0
    tangent = _random("angle", graph.fingerprints[angle])  # of half the angle
    inverse = pow(1 + tangent * tangent, -1, PRIME)
    return (1 - tangent * tangent) * inverse % PRIME, 2 * tangent * inverse % PRIME
