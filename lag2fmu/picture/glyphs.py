"""The shapes that engineers draw: zigzag, pot, hatching, arrows; polylines (k, 2) in the units of the picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]

TURNS, WIDTH = 6, 2.2
"""The number of the zigzag's turns, and half its width in units of the picture."""


def zigzag(a: Points, b: Points) -> list[Points]:
    """A spring from ``a`` to ``b``, straight at its ends."""
    along, across = axes(a, b)
    length = float(np.linalg.norm(b - a))
    lead = min(0.2 * length, 4.0)
    stations = np.linspace(lead, length - lead, 2 * TURNS + 1)
    swings = np.array([0.0, *([1.0, -1.0] * TURNS)[: 2 * TURNS - 1], 0.0])
    half = min(WIDTH, 0.3 * length)
    middle = a + stations[:, None] * along + half * swings[:, None] * across
    return [np.vstack([a, middle, b])]


def pot(a: Points, b: Points) -> list[Points]:
    """A damper from ``a`` to ``b``, (2,) each: a cylinder that is open at one end, and a rod with its piston.

    The result are polylines (k, 2).
    """
    along, across = axes(a, b)
    middle, half, width = (a + b) / 2, min(3.0, 0.2 * float(np.linalg.norm(b - a))), 1.8
    bottom, top = middle - half * along, middle + half * along
    cylinder = [top + width * across, bottom + width * across, bottom - width * across, top - width * across]
    piston = [middle + 0.8 * width * across, middle - 0.8 * width * across]
    return [np.vstack([a, bottom]), np.vstack(cylinder), np.vstack(piston), np.vstack([middle, b])]


def spiral(center: Points, reach: float) -> list[Points]:
    """A torsion spring about ``center`` (2,): a polyline (k, 2)."""
    angle = np.linspace(0.0, 4.5 * np.pi, 60)
    radius = reach * (0.3 + 0.7 * angle / angle[-1])
    return [center + radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])]


def hatched(a: Points, b: Points) -> list[Points]:
    """A wall from ``a`` to ``b``, (2,) each, hatched on its right side: polylines (k, 2)."""
    along, across = axes(a, b)
    length = float(np.linalg.norm(b - a))
    count = max(3, round(length / 1.8))
    strokes = [a + x * along for x in np.linspace(0.08, 1.0, count) * length]
    return [np.vstack([a, b]), *(np.vstack([p, p - 1.7 * across - 1.2 * along]) for p in strokes)]


def support(pivot: Points) -> list[Points]:
    """A fixed hinge at ``pivot`` (2,): a triangle on hatched ground, as polylines (k, 2)."""
    left, right = pivot + np.array([-2.6, -4.2]), pivot + np.array([2.6, -4.2])
    return [np.vstack([pivot, left, right, pivot]), *hatched(left - np.array([1.2, 0.0]), right + np.array([1.2, 0.0]))]


def shoes(center: Points, reach: float, half: float) -> list[Points]:
    """Two brake shoes about ``center`` (2,), each of ``half`` an angle (rad) up and down: closed polylines (k, 2)."""
    angle = np.linspace(-half, half, 12)
    rays = np.column_stack([np.cos(angle), np.sin(angle)])
    shoe = np.vstack([reach * rays, (reach + 1.2) * rays[::-1], reach * rays[:1]])
    return [center + shoe, center - shoe]


def cross(center: Points) -> list[Points]:
    """A cross at a place (2,): polylines (k, 2)."""
    return [center + np.array([[-1.2, 0.0], [1.2, 0.0]]), center + np.array([[0.0, -1.2], [0.0, 1.2]])]


def box(center: Points, along: Points, across: Points) -> Points:
    """A closed rectangle (k, 2) with the half edges ``along`` and ``across``, (2,) each."""
    corners = [(1, 1), (1, -1), (-1, -1), (-1, 1), (1, 1)]
    return np.array([center + a * along + b * across for a, b in corners])


def arrow(a: Points, b: Points, head: float = 2.0) -> list[Points]:
    """An arrow from ``a`` to ``b``, (2,) each: its shaft and its head, closed, polylines (k, 2)."""
    along, across = axes(a, b)
    foot = b - head * along
    return [np.vstack([a, foot]), np.vstack([b, foot + 0.4 * head * across, foot - 0.4 * head * across, b])]


def arc(center: Points, radius: float, first: float, last: float) -> list[Points]:
    """An arrow along a circle from the angle ``first`` to ``last`` (rad): its shaft and its head, closed."""
    angles = np.linspace(first, last, 24)
    points = center + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    head = arrow(points[-1] - 0.01 * (points[-1] - points[-2]), points[-1] + 1.4 * axes(points[-2], points[-1])[0], 1.4)
    return [points, head[1]]


def circle(center: Points, radius: float, count: int = 40) -> Points:
    """A closed polyline (k, 2) around ``center`` (2,)."""
    angle = np.linspace(0.0, 2 * np.pi, count + 1)
    return np.asarray(center + radius * np.column_stack([np.cos(angle), np.sin(angle)]), dtype=np.float64)


def hull(points: Points) -> Points:
    """The closed convex polyline (k, 2) around ``points`` (n, 2): Andrew, Inf. Process. Letters 9 (1979) 216-219."""
    order = points[np.lexsort((points[:, 1], points[:, 0]))]
    sides = []
    for places in (order, order[::-1]):
        side: list[Points] = []
        for c in places:
            while len(side) > 1 and _turn(side[-2], side[-1], c) <= 0.0:
                side.pop()
            side.append(c)
        sides += side[:-1]
    return np.array([*sides, sides[0]]) if sides else points


def _turn(a: Points, b: Points, c: Points) -> float:
    """Positive where the way from ``a`` by ``b`` to ``c`` turns to the left."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def axes(a: Points, b: Points) -> tuple[Points, Points]:
    """The unit vectors (2,) from ``a`` to ``b`` and, a quarter turn to the left, across."""
    length = float(np.linalg.norm(b - a))
    along = (b - a) / length if length > 0 else np.array([1.0, 0.0])
    return along, np.array([-along[1], along[0]])
