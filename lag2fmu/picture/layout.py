"""The layout of the picture: the view, the scale, the shapes, and the directions in which things can slide."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from lag2fmu.description.parts import Spring
from lag2fmu.description.places import WORLD
from lag2fmu.errors import DerivationError
from lag2fmu.graph.batches import Floats, Values
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.picture.attachments import attachments, ropes
from lag2fmu.picture.loops import add_loops
from lag2fmu.picture.shapes import BALL, CUBOID, DISC, PARTICLE, ROD, Shape, shape_of
from lag2fmu.picture.skeleton import Skeleton, SkeletonLine
from lag2fmu.picture.surfaces import Surface
from lag2fmu.picture.view import view_of

if TYPE_CHECKING:
    from lag2fmu.picture.pulleys import Pulley

SIZE, DISPLACED = 60.0, 8.0
"""The length of the mechanism, and that of displacements where bodies stand side by side; in units of the picture."""
_FEW, _LARGE = 3, 0.4
"""The most bodies that are all drawn at their own size; and the greatest body among more, in units of the whole
picture."""
GAP, BOX, HUNG = 28.0, (6.2, 3.6), 22.0
"""Distances in units of the picture: between bodies side by side and to walls; half the edges of sliders; between
masses on ropes."""


class Layout:
    """The geometry of a picture; view, unit and shifts are those of the start, also in other postures.

    - ``at_start`` (spots, 2): the spots of the skeleton in the picture.
    - ``rails``: {spot: direction (2,)} of places that move along a line only.
    - ``shapes``: {body: its shape}.
    - ``unit``: metres for a unit of the picture.
    - ``shift``: {spot: (2,)} of bodies that are drawn beside their true place.
    - ``pulley``: the fixed pulley on which all bodies hang, None if they hang on none.
    - ``seen``: the surfaces of visuals; what else would be drawn on their frames is ``covered``.
    """

    def __init__(self, mechanism: Mechanism, seen: Sequence[Surface] = ()) -> None:
        self.mechanism, self.seen = mechanism, seen
        self.covered = frozenset(surface.frame for surface in seen)
        self.skeleton = Skeleton(mechanism)
        add_loops(self.skeleton)
        self.view = view_of(self.skeleton)
        self.values = self.skeleton.start()
        self.positions = self.skeleton.positions(self.values)
        self.attached = list(attachments(self.skeleton))
        self.ropes = list(ropes(self.skeleton))
        self.rails = {i: self.view.flat(along) for i, along in self.skeleton.rails().items()}
        self.shapes = self.shapes_at(self.values, self.positions)
        self.unit = self._unit()
        self.pulley = self._pulley()
        self.shift = self._side_by_side()
        self.at_start = self.at(self.positions)

    def moved(self, values: Mapping[str, float]) -> Layout:
        """The layout at the state ``values``, with the same view, unit and shifts."""
        other = copy(self)
        other.values = {**self.values, **values}
        other.positions = self.skeleton.positions(other.values)
        other.shapes = self.shapes_at(other.values, other.positions)
        other.at_start = self.at(other.positions)
        return other

    def shapes_at(self, values: Values, positions: Floats) -> dict[str, Shape]:
        """{body: its shape} at a state, with the skeleton's ``positions`` (spots, 3) there.

        Among many bodies, one that seems nearly as large as the whole picture is drawn as a particle: its inertia
        includes gears, or is that of no real body.
        """
        plane, bodies = self.view.plane, self.mechanism.placed_bodies
        found = {b.name: shape_of(self.skeleton, b, values, positions, plane) for b in bodies}
        most = self._most if len(found) > _FEW else np.inf
        return {n: s if s.size.max() < most else Shape(PARTICLE, s.center) for n, s in found.items()}

    @cached_property
    def _most(self) -> float:
        """The largest size (m) of a body that is drawn at its own size."""
        spots = sorted({*self.skeleton.place.values(), *self.skeleton.origins.values()})
        return _LARGE * float(np.ptp(self.positions[spots], axis=0).max())

    def _unit(self) -> float:
        """The length (m) of one unit of the picture."""
        s = self.skeleton
        numbers = {*s.place.values(), *s.origins.values(), *(i for link in s.links for i in link.ends)}
        outlines = [self.positions[sorted(numbers)], *(x for shape in self.shapes.values() for x in shape.outline())]
        flat = self.view.flat(np.vstack(outlines))
        reach = float(np.ptp(flat, axis=0).max())
        largest = max((float(shape.size.max()) for shape in self.shapes.values()), default=0.0)
        extent = max(reach, 3 * largest)
        return (extent / (DISPLACED if self._crowded() else SIZE)) or self._travel(sorted(numbers)) / DISPLACED or 1.0

    def _travel(self, spots: list[int]) -> float:
        """The longest displacement (m) of the ``spots`` in the picture, over states around the start and at q = 0."""
        rest = {**self.values, **{c.name: 0.0 for c in self.mechanism.coordinates}}
        moved = [self.skeleton.positions(self.skeleton.samples), self.skeleton.positions(rest)[..., None]]
        flat = self.view.flat(np.moveaxis(np.concatenate(moved, axis=2)[spots], 1, -1))
        known = flat[np.isfinite(flat).all(axis=-1)]
        return float(np.ptp(known, axis=0).max()) if len(known) else 0.0

    def _crowded(self) -> bool:
        """Whether all bodies move along lines, with coordinates that seem to be displacements from rest.

        Coordinates seem so if the bodies start close to each other, or if the difference of two is an elongation.
        """
        if self.skeleton.links or self.skeleton.origins:
            return False
        spots = self._moving()
        if len(spots) < 2 or not set(spots) <= set(self.rails):
            return False
        if any(a is not None and len(a.ends) == 2 and part.between is None for part, a in self.attached):
            return True
        along = np.sort(self.view.flat(self.positions[spots]) @ self.direction(spots[0]))
        return bool(np.diff(along).min() < 0.1 * max(c.nominal for c in self.mechanism.coordinates))

    def _moving(self) -> list[int]:
        """The spots of bodies, and those of points that coordinates move."""
        s = self.skeleton
        bodies = {body.name for body in self.mechanism.placed_bodies}
        return [i for name, i in s.place.items() if name in bodies or np.any(s.spot_slopes[i])]

    def _side_by_side(self) -> dict[int, Floats]:
        """{spot: shift (2,)} of bodies that would cover each other: along the springs that join them, else across."""
        if not self._crowded():
            return {}
        if self.pulley is not None:
            return {i: HUNG * k * np.array([1.0, 0.0]) for k, i in enumerate(self.pulley.masses())}
        spots = list(dict.fromkeys(self._moving()))
        joined = [a.ends for part, a in self.attached if a is not None and len(a.ends) == 2]
        along = self.direction(spots[0])
        step = along if joined else np.array([abs(along[1]), abs(along[0])])
        return {i: GAP * k * step for k, i in enumerate(self._in_order(spots))}

    def _in_order(self, spots: list[int]) -> list[int]:
        """The spots in the order in which the elongations of springs count them, else in the given order."""
        behind: dict[int, set[int]] = {i: set() for i in spots}
        for part, a in self.attached:
            if isinstance(part, Spring) and part.between is None and a is not None and len(a.ends) == 2:
                behind[a.ends[1]].add(a.ends[0])
        found: list[int] = []
        while len(found) < len(spots):
            left = [i for i in spots if i not in found]
            found.append(next((i for i in left if not behind[i] - set(found)), left[0]))
        return found

    def _pulley(self) -> Pulley | None:
        """The fixed pulley, if bodies that go up and down move as if they hung on ropes."""
        if not self._crowded() or self.attached:
            return None
        spots = list(dict.fromkeys(self._moving()))
        if not all(self.upright(i) for i in spots):
            return None
        from lag2fmu.picture.pulleys import hung

        down = self.view.down
        return hung({i: np.asarray(down) @ self.skeleton.spot_slopes[i][:, :, 0] for i in spots})

    @cached_property
    def hidden(self) -> frozenset[int]:
        """The spots of covered frames, and of bodies and points on them."""
        s = self.skeleton
        origins = {s.origins[frame] for frame in self.covered if frame != WORLD}
        return frozenset(origins | {s.place[x.name] for x in self.mechanism.places if str(x.frame) in self.covered})

    @cached_property
    def links(self) -> list[SkeletonLine]:
        """The links that are drawn: no spring or damper has the same ends, and no surfaces cover both."""
        sprung = [set(a.ends) for _, a in self.attached if a is not None]
        return [x for x in self.skeleton.links if set(x.ends) not in sprung and not self.hidden.issuperset(x.ends)]

    def direction(self, spot: int) -> Floats:
        """The direction (2,) in the picture in which the spot can move."""
        moved = self.rails.get(spot, np.array([1.0, 0.0]))
        length = float(np.linalg.norm(moved))
        return moved / length if length > 0 else np.array([1.0, 0.0])

    def at(self, positions: Floats) -> Floats:
        """The ``positions`` (spots, 3) in m as places in the picture, (spots, 2) in its units."""
        flat: Floats = self.view.flat(positions) / self.unit
        for spot, shift in self.shift.items():
            flat[spot] += shift
        return flat

    @cached_property
    def room(self) -> float:
        """The factor for the size of particles: 1, or less where they would cover short links."""
        ends = (self.at_start[list(link.ends)] for link in self.skeleton.links if link.arm)
        lengths = [float(np.linalg.norm(b - a)) for a, b in ends]
        return float(np.clip(max(lengths, default=SIZE) / 12.0, 0.2, 1.0))

    def across(self, spot: int) -> Floats:
        """The unit vector (2,) to the left of ``direction``."""
        along = self.direction(spot)
        return np.array([-along[1], along[0]])

    @property
    def planar(self) -> bool:
        """Whether the mechanism is seen in its plane."""
        return self.view.plane is not None

    def upright(self, spot: int) -> bool:
        """Whether the spot slides up and down, so that no rail carries it."""
        down = self.view.down
        return down is not None and abs(float(self.direction(spot) @ self.view.flat(down))) > 0.9

    def falls(self, spot: int) -> bool:
        """Whether the particle at the spot slides up and down while nothing but gravity and contacts act on it."""
        m = self.mechanism
        held = m.springs or m.dampers or m.frictions or m.forces or m.constraints or m.loads
        return bool(m.contacts) and not held and self.half(spot) > 0 and self.upright(spot)

    def half(self, spot: int) -> float:
        """How far the body at the spot reaches along its rail, in units of the picture."""
        kinds = {self.skeleton.place[n]: shape.kind for n, shape in self.shapes.items()}
        slides = spot in self.rails and kinds.get(spot) == PARTICLE and not self.radius(spot)
        return BOX[0] if slides and self.planar else 0.0

    def radius(self, spot: int) -> float:
        """The radius of the disc, ball or particle of a size at the spot, in units of the picture."""
        shapes = (shape for n, shape in self.shapes.items() if self.skeleton.place[n] == spot)
        return max((shape.size[0] / self.unit for shape in shapes if shape.kind in (DISC, BALL, PARTICLE)), default=0.0)


BACK_TO_FRONT = (BALL, CUBOID, DISC, ROD, PARTICLE)
"""The order in which shapes are drawn, from back to front."""


def drawable(mechanism: Mechanism) -> bool:
    """Whether there are bodies, points or frames: something to draw."""
    return bool(mechanism.places or mechanism.frames)


def layout_of(mechanism: Mechanism, seen: Sequence[Surface] = ()) -> Layout:
    """The layout of ``mechanism``, with the surfaces that are ``seen``, at starts that are taken to meet constraints.

    Raises DerivationError if there is nothing to draw.
    """
    if not drawable(mechanism):
        raise DerivationError(
            f"mechanism '{mechanism.name}' has no bodies or points: there is nothing to draw; "
            'give it a point that moves, e.g. [points.P] position = ["x", "y"]'
        )
    return Layout(mechanism, seen)


def supports(layout: Layout) -> tuple[list[int], list[int]]:
    """(fixed spots at which a link or a spring ends, fixed spots that something only refers to)."""
    s = layout.skeleton
    still = s.still()
    turning = set(s.hinges.values()) & set(s.origins.values())
    starts = {link.ends[0] for link in s.links if link in s.rigid} | turning
    held = {i for _, a in layout.attached if a is not None for i in a.ends if i in s.place.values()}
    pivots = ((starts | held) & still) - set(s.sliders.values())
    return sorted(pivots), sorted({link.ends[0] for link in s.links} & still - pivots)


def rail_of(layout: Layout, spot: int) -> tuple[Floats, Floats, float] | None:
    """(middle (2,), direction (2,), half the length) of the ground under a spot at the start; None if it has none.

    Lengths are in units of the picture.
    """
    depth = layout.radius(spot) or (BOX[1] + 0.2 if layout.half(spot) else 0.0)
    if not depth or not layout.planar or layout.upright(spot):
        return None
    return layout.at_start[spot] - depth * layout.across(spot), layout.direction(spot), max(11.0, 1.2 * depth)
