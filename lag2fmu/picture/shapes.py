"""The shape of a body, guessed from its mass and inertia: a rod, a disc, a ball or a box of the same moments.

A body that rolls is a disc of its rolling radius, about the place that moves in proportion to the angle.

A uniform rod of length 2 h has I = m h^2/3 across, a disc m r^2/2 about its axis, a ball 2/5 m r^2, a box of half edges
a, b, c m (b^2 + c^2)/3 about the edge a. Source: Landau, Lifshitz, Mechanics, section 32, problem 2.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from lag2fmu.description.places import Body
from lag2fmu.graph.batches import Floats, Values
from lag2fmu.mechanism.contact_places import radii_of
from lag2fmu.picture.skeleton import Skeleton, SkeletonLine

PARTICLE, ROD, DISC, BALL, CUBOID = "particle", "rod", "disc", "ball", "cuboid"


@dataclass(frozen=True, eq=False)
class Shape:
    """A ``kind`` of shape with its ``center`` (3,) and its half edges or radii ``size`` (3,), in m.

    The rows of ``axes`` (3, 3) are the directions of the edges. A rod lies along the first axis, a disc turns about
    it. A particle has a size only if a contact gives it one.
    """

    kind: str
    center: Floats
    size: Floats = field(default_factory=lambda: np.zeros(3))
    axes: Floats = field(default_factory=lambda: np.eye(3))

    def outline(self) -> list[Floats]:
        """Polylines (k, 3) in m that show the extent: the rod, the rim with a spoke, the faces of the cuboid."""
        if self.kind == ROD:
            reach = self.size[0] * self.axes[0]
            return [np.array([self.center - reach, self.center + reach])]
        if self.kind == DISC:
            angle = np.linspace(0.0, 2 * np.pi, 49)
            rim = np.outer(np.cos(angle), self.axes[1]) + np.outer(np.sin(angle), self.axes[2])
            rim = self.center + self.size[0] * rim
            return [rim, np.array([self.center, rim[0]])]
        if self.kind == CUBOID:
            return [self._face(axis, sign) for axis in range(3) for sign in (1, -1)]
        return []

    def _face(self, axis: int, sign: int) -> Floats:
        i, j = (axis + 1) % 3, (axis + 2) % 3
        corners = [(1, 1), (1, -1), (-1, -1), (-1, 1), (1, 1)]
        edges = self.size[:, None] * self.axes
        return np.array([self.center + sign * edges[axis] + a * edges[i] + b * edges[j] for a, b in corners])


def shape_of(skeleton: Skeleton, body: Body, values: Values, positions: Floats, plane: int | None) -> Shape:
    """The shape of ``body`` at a state; ``positions`` (spots, 3) are those of the state, ``plane`` that of the view."""
    center = positions[skeleton.place[body.name]]
    mass = skeleton.masses[body.name]
    if body.inertia is None or mass <= 0:
        return Shape(PARTICLE, center, np.full(3, _touching_radius(skeleton, body, values)))
    if body.frame is None:
        return _planar(skeleton, body, center, mass, values, positions)
    return _spatial(skeleton, body, center, mass, values, positions, plane)


def _planar(skeleton: Skeleton, body: Body, center: Floats, mass: float, values: Values, positions: Floats) -> Shape:
    """A rod along the arm that turns with the body, else a disc; a rolling disc is centred at the place that rolls."""
    gyration = np.sqrt(max(skeleton.number(body.inertia, values), 0.0) / mass)
    link, place = own_link(skeleton, body), skeleton.place[body.name]
    base, end = (place, place) if link is None else link.ends
    radius = _rolling_radius(skeleton, body, base)
    along = positions[end] - positions[base]
    if radius is None and link is not None:
        return Shape(ROD, center, np.array([np.sqrt(3) * gyration, 0, 0]), _frame_on(along))
    angle = skeleton.number(body.angle, values)
    spoke = along / np.linalg.norm(along) if np.any(along) else np.array([-np.sin(angle), np.cos(angle), 0.0])
    axes = np.array([[0.0, 0.0, 1.0], spoke, np.cross([0.0, 0.0, 1.0], spoke)])
    return Shape(DISC, positions[base], np.array([radius or np.sqrt(2) * gyration, 0, 0]), axes)


def _touching_radius(skeleton: Skeleton, body: Body, values: Values) -> float:
    """The largest radius (m) that contacts give a ``body``, 0 where none does."""
    found = [0.0]
    for contact in skeleton.mechanism.contacts:
        ends = zip(map(str, contact.between or ()), radii_of(contact), strict=False)
        found += [float(skeleton.number(radius, values)) for name, radius in ends if name == body.name]
    return max(found)


def own_link(skeleton: Skeleton, body: Body) -> SkeletonLine | None:
    """The arm that ends at the mass centre of ``body`` and turns as the body does; None without such an arm."""
    angle = skeleton.written(body.angle)
    for link in skeleton.links:
        if link.ends[1] != skeleton.place[body.name] or len(link.angles) != 1:
            continue
        (turn,) = link.angles
        if any(not skeleton.moves(angle + sign * turn) for sign in (1, -1)):
            return link
    return None


def _rolling_radius(skeleton: Skeleton, body: Body, spot: int) -> float | None:
    """The radius (m) on which the body rolls along a line; None unless ``spot`` moves in proportion to its angle."""
    moved, turned = skeleton.spot_slopes[spot], skeleton.slopes([skeleton.put(body.angle)])[0]
    if not np.isfinite(moved).all() or np.ptp(moved, axis=2).max() > 0 or np.ptp(turned, axis=1).max() > 0:
        return None
    per_angle = moved[:, :, 0] @ turned[:, 0] / max(float(turned[:, 0] @ turned[:, 0]), 1e-300)
    left = moved[:, :, 0] - np.outer(per_angle, turned[:, 0])
    radius = float(np.linalg.norm(per_angle))
    return radius if radius > 0 and np.abs(left).max() <= 1e-9 * radius else None


def _spatial(
    skeleton: Skeleton, body: Body, center: Floats, mass: float, values: Values, positions: Floats, plane: int | None
) -> Shape:
    xx, yy, zz, xy, xz, yz = skeleton.vector(tuple(body.inertia), values)  # type: ignore[arg-type]
    moments, vectors = np.linalg.eigh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    frame = np.array([positions[i] for i in skeleton.axes[str(body.frame)]])
    principal = vectors.T @ frame  # rows: the principal axes in world axes
    offset = center - positions[skeleton.origins[str(body.frame)]]
    least, middle, greatest = np.maximum(moments, 0.0) / mass
    if plane is None and greatest > 1.45 * middle:
        return Shape(DISC, center, np.array([np.sqrt(2 * greatest), 0, 0]), principal[[2, 0, 1]])
    if least < 0.3 * middle and plane is None:
        return Shape(ROD, center, np.array([np.sqrt(3 * middle), 0, 0]), principal)
    if float(np.linalg.norm(offset)) > 0.3 * np.sqrt(3 * middle):
        return Shape(ROD, center, np.array([np.sqrt(3 * middle), 0, 0]), _frame_on(offset))
    if greatest < 1.1 * least or plane is not None:
        return Shape(BALL, center, np.full(3, np.sqrt(2.5 * middle)))
    half = np.sqrt(np.maximum(1.5 * (least + middle + greatest - 2 * np.array([least, middle, greatest])), 0.0))
    return Shape(CUBOID, center, half, principal)


def _frame_on(along: Floats) -> Floats:
    """Three unit vectors, the first one in the direction ``along``."""
    first = along / np.linalg.norm(along)
    second = np.cross(first, np.eye(3)[int(np.argmin(np.abs(first)))])
    second /= np.linalg.norm(second)
    return np.array([first, second, np.cross(first, second)])
