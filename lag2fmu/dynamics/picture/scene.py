"""The scene: a mechanism in its start position as strokes, discs and labels in the plane, for whoever draws it.

Pure data without a drawing library: the page in the FMU and the plots show the same scene. Lengths are in units of the
picture, some 60 of which are as long as the mechanism; y points up.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from copy import copy
from dataclasses import dataclass, field, replace

import numpy as np

from lag2fmu.dynamics.analysis.evaluation import Floats, Values
from lag2fmu.dynamics.picture import glyphs
from lag2fmu.dynamics.picture.attachments import Attachment, attachments
from lag2fmu.dynamics.picture.labels import Label, Wish, placed, pretty
from lag2fmu.dynamics.picture.shapes import BALL, BOX, DISC, PARTICLE, ROD, Shape, shape_of
from lag2fmu.dynamics.picture.skeleton import Skeleton
from lag2fmu.dynamics.picture.view import View, view_of
from lag2fmu.errors import DerivationError
from lag2fmu.mechanism import Damper, Load, Mechanism, Spring
from lag2fmu.mechanism.expressions import to_text

SIZE = 60.0
"""The length of the mechanism in the picture."""
_GAP, _BOX = 28.0, (6.2, 3.6)
"""Between bodies drawn side by side and to walls; half the edges of what slides."""
_FEW, _MANY = 4, 16
"""Springs and dampers that have a letter in a hinge; labels that are written large."""


_SIDES = np.array([[1.2, 0.0], [-1.2, 0.0], [0.0, 1.2], [0.0, -1.2]])
"""Where the edges of a rod are beside its middle line."""


@dataclass(frozen=True)
class Style:
    """How a stroke looks: colour of line and ``fill`` ('' for none), ``width`` in units, dashed or not."""

    color: str
    width: float
    fill: str = ""
    dashed: bool = False


STYLES: Mapping[str, Style] = {
    "ground": Style("#7d8b99", 0.35),
    "axis": Style("#9aa7b4", 0.4, "#9aa7b4"),
    "guide": Style("#9aa7b4", 0.35, dashed=True),
    "link": Style("#44525f", 0.9),
    "rod edge": Style("#27435c", 2.7),
    "rod": Style("#a9c6df", 2.0),
    "shape": Style("#27435c", 0.5, "#cfdfec"),
    "mass": Style("#27435c", 0.5, "#4c86b8"),
    "center": Style("#27435c", 0.3, "#27435c"),
    "joint": Style("#44525f", 0.5, "#ffffff"),
    "spring": Style("#c05f1f", 0.55),
    "damper": Style("#6b4fa0", 0.55),
    "load": Style("#b3261e", 0.6, "#b3261e"),
    "gravity": Style("#5a6b7b", 0.55, "#5a6b7b"),
    "coordinate": Style("#1d7a4c", 0.45, "#1d7a4c"),
    "name": Style("#1b2733", 0.3),
}


@dataclass(frozen=True)
class Stroke:
    """A polyline of ``part``; it is filled where its style fills and it is closed."""

    part: str
    style: str
    points: tuple[tuple[float, float], ...]

    @property
    def closed(self) -> bool:
        """Whether it ends where it begins."""
        return len(self.points) > 3 and self.points[0] == self.points[-1]


@dataclass(frozen=True)
class Disc:
    """A filled circle of ``part``."""

    part: str
    style: str
    center: tuple[float, float]
    radius: float


@dataclass(frozen=True)
class Scene:
    """What is to be drawn, back to front, within ``box`` (left, bottom, right, top); ``notes`` are sentences below.

    ``unit``: metres for one unit of the picture.
    """

    title: str
    marks: tuple[Stroke | Disc, ...]
    labels: tuple[Label, ...]
    notes: tuple[str, ...]
    box: tuple[float, float, float, float]
    unit: float

    def parts(self) -> frozenset[str]:
        """What is drawn, e.g. 'bodies.bob' and 'springs.wall'."""
        return frozenset(mark.part for mark in self.marks)


def drawable(mechanism: Mechanism) -> bool:
    """Whether there are bodies, points or frames: something to draw."""
    return bool(mechanism.places or mechanism.frames)


def scene_of(mechanism: Mechanism) -> Scene:
    """The scene of ``mechanism`` at its start values, which are taken to meet the constraints.

    Raises DerivationError if there is nothing to draw.
    """
    if not drawable(mechanism):
        raise DerivationError(
            f"mechanism '{mechanism.name}' has no bodies or points: there is nothing to draw; "
            'add what moves as a point, e.g. [points.P] position = ["x", "y"]'
        )
    return Drawing(mechanism).scene()


@dataclass
class Drawing:
    """Puts a scene together; view, unit and shifts stay the same for other postures."""

    mechanism: Mechanism
    marks: list[Stroke | Disc] = field(default_factory=list)
    wishes: list[Wish] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Look at the start: view, scale, bodies that have to be drawn side by side."""
        self.skeleton = Skeleton(self.mechanism)
        self.view: View = view_of(self.skeleton)
        self.values = self.skeleton.start()
        self.positions = self.skeleton.positions(self.values)
        self.attached = list(attachments(self.skeleton))
        found = {i: self.skeleton.rail(i) for i in {*self.skeleton.place.values(), *self.skeleton.sliders.values()}}
        self.rails = {i: self.view.flat(along) for i, along in sorted(found.items()) if along is not None}
        self.shapes = self.shapes_at(self.values, self.positions)
        self.unit = self._unit()
        self.shift = self._side_by_side()

    # ------------------------------------------------------------------------------------------------ size and places

    def shapes_at(self, values: Values, positions: Floats) -> dict[str, Shape]:
        """{body: its shape} at a state, with the skeleton's ``positions`` (spots, 3) there."""
        plane = self.view.plane
        return {b.name: shape_of(self.skeleton, b, values, positions, plane) for b in self.mechanism.bodies}

    def _unit(self) -> float:
        """Metres for one unit."""
        s = self.skeleton
        numbers = {*s.place.values(), *s.origins.values(), *(i for link in s.links for i in link.ends)}
        outlines = [self.positions[sorted(numbers)], *(x for shape in self.shapes.values() for x in shape.outline())]
        flat = self.view.flat(np.vstack(outlines))
        reach = float(np.ptp(flat, axis=0).max())
        largest = max((float(shape.size.max()) for shape in self.shapes.values()), default=0.0)
        extent = max(reach, 3 * largest)
        return (extent / (8.0 if self._crowded() else SIZE)) or 1.0

    def _crowded(self) -> bool:
        """Whether all there is are bodies on lines whose coordinates seem to be displacements from where they rest.

        They start close to each other, or the difference of two coordinates is an elongation.
        """
        s = self.skeleton
        spots = list(s.place.values())
        if s.links or s.origins or len(spots) < 2 or not set(spots) <= set(self.rails):
            return False
        if any(a is not None and len(a.ends) == 2 and part.between is None for part, a in self.attached):
            return True
        along = np.sort(self.view.flat(self.positions[spots]) @ self._direction(spots[0]))
        return bool(np.diff(along).min() < 0.1 * max(c.nominal for c in self.mechanism.coordinates))

    def _side_by_side(self) -> dict[int, Floats]:
        """{spot: shift (2,)} of bodies that would be drawn over each other: along what joins them, else across."""
        if not self._crowded():
            return {}
        spots = list(dict.fromkeys(self.skeleton.place.values()))
        joined = any(a is not None and len(a.ends) == 2 for _, a in self.attached)
        along = self._direction(spots[0])
        step = along if joined else np.array([abs(along[1]), abs(along[0])])
        self.notes.append("Coordinates are displacements: the bodies are drawn side by side.")
        return {i: _GAP * k * step for k, i in enumerate(spots)}

    def _direction(self, spot: int) -> Floats:
        """In which direction (2,) of the picture the spot can move."""
        moved = self.rails.get(spot, np.array([1.0, 0.0]))
        length = float(np.linalg.norm(moved))
        return moved / length if length > 0 else np.array([1.0, 0.0])

    def at(self, positions: Floats) -> Floats:
        """The spots (spots, 3) in the picture, (spots, 2)."""
        flat: Floats = self.view.flat(positions) / self.unit
        for spot, shift in self.shift.items():
            flat[spot] += shift
        return flat

    # ------------------------------------------------------------------------------------------------ marks

    def stroke(self, part: str, style: str, lines: Iterable[Floats]) -> None:
        """Add polylines (k, 2)."""
        for line in lines:
            points = tuple((round(float(x), 3) + 0.0, round(float(y), 3) + 0.0) for x, y in line)
            self.marks.append(Stroke(part, style, points))

    def disc(self, part: str, style: str, center: Floats, radius: float) -> None:
        """Add a filled circle."""
        x, y = (round(float(c), 3) + 0.0 for c in center)
        self.marks.append(Disc(part, style, (x, y), round(radius, 3)))

    def name(self, part: str, style: str, text: str, near: Floats, away: float = 2.0, inside: bool = False) -> None:
        """Ask for a label."""
        self.wishes.append(Wish(part, style, text, (float(near[0]), float(near[1])), 3.2, away, inside))

    # ------------------------------------------------------------------------------------------------ the parts

    def scene(self) -> Scene:
        """Everything, back to front."""
        flat = self.at(self.positions)
        self._grounds(flat)
        self._links(flat)
        self.bodies(flat, self.shapes)
        self._points(flat)
        for part, attachment in self.attached:
            self._attached(part, attachment, flat)
        self._coordinates(flat)
        self._frames(flat)
        for load in self.mechanism.loads:
            self._load(load, flat)
        self._gravity()
        self._constraints()
        return self._finished()

    def _grounds(self, flat: Floats) -> None:
        s = self.skeleton
        moved = s.positions(s.samples())
        still = {i for i in range(len(moved)) if float(np.ptp(moved[i], axis=1).max()) == 0.0}
        turning = set(s.hinges.values()) & set(s.origins.values())
        starts = {link.ends[0] for link in s.links if s.rigid(link)} | turning
        ends = {i for _, a in self.attached if a is not None for i in a.ends}
        springs = {i for i in ends if i in s.place.values()} & still
        pivots = [i for i in sorted((starts & still) | springs) if not self._joined(i, flat)]
        for i in pivots:
            self.stroke("ground", "ground", glyphs.support(flat[i]))
        for i in sorted({link.ends[0] for link in s.links} & still - set(pivots)):
            cross = [flat[i] + np.array([[-1.2, 0], [1.2, 0]]), flat[i] + np.array([[0, -1.2], [0, 1.2]])]
            self.stroke("ground", "axis", cross)
        for coordinate, i in s.sliders.items():
            self._rail(coordinate, i, flat[i], self._direction(i))

    def _joined(self, spot: int, flat: Floats) -> bool:
        """Whether a slider carries the spot already."""
        return spot in self.skeleton.sliders.values()

    def _rail(self, coordinate: str, spot: int, place: Floats, along: Floats) -> None:
        upright = self.view.down is not None and abs(along @ self.view.flat(self.view.down)) > 0.9
        depth = self._radius(spot) or (_BOX[1] + 0.2 if self._half(spot) else 0.0)
        if depth and self.view.plane is not None and not upright:
            across = np.array([-along[1], along[0]])
            middle = place - depth * across
            reach = max(11.0, 1.2 * depth)
            self.stroke(
                f"coordinates.{coordinate}", "ground", glyphs.hatched(middle - reach * along, middle + reach * along)
            )

    def _links(self, flat: Floats) -> None:
        seen: set[tuple[tuple[float, float], ...]] = set()
        for link in self.skeleton.links:
            ends = flat[list(link.ends)]
            key = tuple(sorted((round(float(x), 3), round(float(y), 3)) for x, y in ends))
            if key[0] == key[1] or key in seen:
                continue
            seen.add(key)
            sprung = any(a is not None and set(a.ends) == set(link.ends) for _, a in self.attached)
            if not sprung:
                self.stroke(f"links.{link.part}", "link" if self.skeleton.rigid(link) else "guide", [ends])

    def bodies(self, flat: Floats, shapes: Mapping[str, Shape]) -> None:
        """All bodies at one state."""
        heaviest = max((self.skeleton.number(b.mass) for b in self.mechanism.bodies), default=1.0) or 1.0
        order = {BALL: 0, BOX: 0, DISC: 1, ROD: 2, PARTICLE: 3}
        for body in sorted(self.mechanism.bodies, key=lambda b: order[shapes[b.name].kind]):
            share = max(self.skeleton.number(body.mass), 0.0) / heaviest
            spot = self.skeleton.place[body.name]
            self._body(f"bodies.{body.name}", shapes[body.name], spot, flat[spot], 1.3 + 1.4 * share ** (1 / 3))
        named = len(self.mechanism.bodies) <= 8
        for body in self.mechanism.bodies if named else ():
            self.name(f"bodies.{body.name}", "name", body.name, flat[self.skeleton.place[body.name]], 3.2, inside=True)

    def _body(self, part: str, shape: Shape, spot: int, center: Floats, radius: float) -> None:
        shift = self.shift.get(spot, 0.0)
        lines = [self.view.flat(line) / self.unit + shift for line in shape.outline()]
        if shape.kind == PARTICLE and spot in self.rails and self.view.plane is not None:
            along = self._direction(spot)
            across = np.array([-along[1], along[0]])
            corners = [(1, 1), (1, -1), (-1, -1), (-1, 1), (1, 1)]
            self.stroke(
                part, "shape", [np.array([center + a * _BOX[0] * along + b * _BOX[1] * across for a, b in corners])]
            )
        elif shape.kind == PARTICLE:
            self.disc(part, "mass", center, radius)
        elif shape.kind == ROD:
            self.stroke(part, "rod edge", lines)
            self.stroke(part, "rod", lines)
            self.disc(part, "center", center, 0.7)
        elif shape.kind == BALL:
            self.disc(part, "shape", center, max(float(shape.size[0]) / self.unit, 1.6))
            self.disc(part, "center", center, 0.7)
        else:
            facing = lines if shape.kind == DISC else self._facing(shape, lines)
            self.stroke(part, "shape", facing)
            self.disc(part, "center", center, 0.7)

    def _facing(self, shape: Shape, lines: list[Floats]) -> list[Floats]:
        """The faces of a box that the viewer sees."""
        towards = shape.axes @ self.view.normal
        faces = [(axis, sign) for axis in range(3) for sign in (1, -1)]
        return [line for (axis, sign), line in zip(faces, lines, strict=True) if sign * towards[axis] > 1e-9]

    def _points(self, flat: Floats) -> None:
        s = self.skeleton
        joints = {link.ends[0] for link in s.links if link.arm} - set(s.place.values())
        for i in sorted(joints):
            if not any(np.allclose(flat[i], flat[s.place[b.name]], atol=0.5) for b in self.mechanism.bodies):
                self.disc("joint", "joint", flat[i], 1.0)
        for point in self.mechanism.points:
            self.disc(f"points.{point.name}", "joint", flat[s.place[point.name]], 0.8)
            self.name(f"points.{point.name}", "name", pretty(point.name), flat[s.place[point.name]])

    def posture(self, values: Values) -> tuple[Stroke | Disc, ...]:
        """Links and bodies alone, at another state, to be drawn over the scene."""
        positions = self.skeleton.positions(values)
        ghost = copy(self)
        ghost.marks, ghost.wishes, flat = [], [], self.at(positions)
        ghost._links(flat)
        ghost.bodies(flat, self.shapes_at(values, positions))
        return tuple(ghost.marks)

    # ------------------------------------------------------------------------------------------------ forces

    def _attached(self, part: Spring | Damper, attachment: Attachment | None, flat: Floats) -> None:
        kind = "spring" if isinstance(part, Spring) else "damper"
        label, letter = f"{kind}s.{part.name}", part.stiffness if isinstance(part, Spring) else part.damping
        text = to_text(letter)
        text = pretty(text if len(text) <= 9 else part.name)
        if attachment is None:
            written = part.elongation if isinstance(part, Spring) else part.rate
            self.notes.append(f"Not drawn: {kind} {part.name}, {to_text(written)}.")
            return
        if attachment.hinge is not None:
            self._at_hinge(label, kind, text, flat[attachment.hinge])
            return
        a, b = self._ends(attachment, flat, kind)
        self.stroke(label, kind, glyphs.zigzag(a, b) if kind == "spring" else glyphs.pot(a, b))
        self.name(label, kind, text, (a + b) / 2, 3.4)

    def _at_hinge(self, label: str, kind: str, text: str, center: Floats) -> None:
        """A torsion spring as a spiral, a damper in a hinge as a ring."""
        many = len(self.attached) > _FEW
        reach = 1.9 if many else 3.2
        lines = glyphs.spiral(center, reach) if kind == "spring" else [glyphs.circle(center, 0.8 * reach)]
        self.stroke(label, kind, lines)
        if not many:
            self.name(label, kind, text, center, reach + 0.6)

    def _ends(self, attachment: Attachment, flat: Floats, kind: str) -> tuple[Floats, Floats]:
        """Both ends in the picture; a wall is put at a distance, with parallel parts beside each other."""
        aside = self._aside(attachment)
        if attachment.along is None:
            a, b = flat[list(attachment.ends)]
            along = (b - a) / max(float(np.linalg.norm(b - a)), 1e-9)
            across = np.array([-along[1], along[0]])
            sliding = [self._half(i) for i in attachment.ends]
            return a + sliding[0] * along + aside * across, b - sliding[1] * along + aside * across
        along = self.view.flat(np.array(attachment.along))
        along = along / max(float(np.linalg.norm(along)), 1e-9)
        across = np.array([-along[1], along[0]])
        if attachment.link is not None:
            a, b = flat[list(attachment.link)]
            place, half = a + attachment.share * (b - a), 0.0
        else:
            place, half = flat[attachment.ends[0]], self._half(attachment.ends[0])
        start = place + half * along + aside * across
        reach = self._radius(attachment.ends[0]) if attachment.ends else 0.0
        wall = start + (_GAP - half + reach) * along
        self.stroke("ground", "ground", glyphs.hatched(wall - 3.0 * across, wall + 3.0 * across))
        return start, wall

    def _half(self, spot: int) -> float:
        """How far the body at the spot reaches along its rail."""
        kinds = {self.skeleton.place[n]: shape.kind for n, shape in self.shapes.items()}
        slides = spot in self.rails and kinds.get(spot) == PARTICLE
        return _BOX[0] if slides and self.view.plane is not None else 0.0

    def _radius(self, spot: int) -> float:
        """The radius of the disc or ball at the spot."""
        shapes = (shape for n, shape in self.shapes.items() if self.skeleton.place[n] == spot)
        return max((shape.size[0] / self.unit for shape in shapes if shape.kind in (DISC, BALL)), default=0.0)

    def _aside(self, attachment: Attachment) -> float:
        """Across the line, for a spring and a damper between the same ends."""
        same = [
            a
            for _, a in self.attached
            if a is not None and (a.ends, a.along, a.link) == (attachment.ends, attachment.along, attachment.link)
        ]
        if len(same) < 2 or attachment.hinge is not None:
            return 0.0
        return 4.6 * (next(k for k, a in enumerate(same) if a is attachment) - (len(same) - 1) / 2)

    def _load(self, load: Load, flat: Floats) -> None:
        part, target = f"loads.{load.name}", str(load.point if load.point is not None else load.body)
        place = flat[self.skeleton.place[target]]
        if load.force is None and not isinstance(load.torque, tuple):
            self.stroke(part, "load", glyphs.arc(place, 5.5, -0.6, 1.6))
            self.name(part, "load", pretty(load.name), place + np.array([5.5, 0.0]))
            return
        vector = self._direction_of(load, target)
        if float(np.linalg.norm(vector)) < 0.2:
            self.disc(part, "load", place, 1.0)
            self.name(part, "load", pretty(load.name), place)
            return
        along = vector / float(np.linalg.norm(vector))
        reach = self._half(self.skeleton.place[target]) or 3.0
        tail, head = place + reach * along, place + (reach + 12.0) * along
        self.stroke(part, "load", glyphs.arrow(tail, head))
        self.name(part, "load", pretty(load.name), head)

    def _direction_of(self, load: Load, target: str) -> Floats:
        """The direction (2,) in which a load pulls when its inputs are positive, not too far from the start."""
        entries = tuple(load.force if load.force is not None else load.torque or ())  # type: ignore[arg-type]
        pulling = {u.name: 1.0 for u in self.mechanism.plain_inputs if not u.start}
        for time in (0.0, 0.37):
            vector = np.zeros(3)
            vector[: len(entries)] = self.skeleton.vector(entries, {**self.values, **pulling, "t": time})
            frame, _ = self.mechanism.location(target)
            if load.axes == "frame" and frame in self.skeleton.axes:
                vector = vector @ self.positions[list(self.skeleton.axes[frame])]
            if np.any(vector):
                return self.view.flat(vector / float(np.linalg.norm(vector)))
        return np.zeros(2)

    # ------------------------------------------------------------------------------------------------ annotations

    def _coordinates(self, flat: Floats) -> None:
        s = self.skeleton
        names = {c.name for c in self.mechanism.coordinates} | {u.name for u in self.mechanism.motions}
        turning: dict[int, list[str]] = {}
        for name, i in s.hinges.items():
            if name in names:
                turning.setdefault(i, []).append(name)
        for i, group in turning.items():
            label = f"coordinates.{group[0]}"
            reach = 1.0
            if self.view.plane is not None and len(turning) <= 8:
                reach = 9.5 if self._half(i) else 5.0
                swing = glyphs.arc(flat[i], reach, *self._swing(i, flat))
                self.stroke(label, "coordinate", swing)
                self.name(label, "coordinate", pretty(", ".join(group)), swing[0][12], 1.0)
                continue
            self.name(label, "coordinate", pretty(", ".join(group)), flat[i], reach + 0.5)
        for name, i in s.sliders.items():
            if name in names and name not in s.hinges:
                along = self._direction(i)
                beside = max(_BOX[1], self._radius(i)) + 3.0
                start = flat[i] + np.array([-along[1], along[0]]) * beside
                self.stroke(f"coordinates.{name}", "coordinate", glyphs.arrow(start, start + 8.0 * along, 1.6))
                self.name(f"coordinates.{name}", "coordinate", pretty(name), start + 8.0 * along, 1.0)
        for together, i in s.floating.items():
            self.name(f"coordinates.{together}", "coordinate", pretty(together), flat[i], 3.0)

    def _swing(self, spot: int, flat: Floats) -> tuple[float, float]:
        """The angles (rad) between which the arrow about a hinge runs: beside the link that turns there, its way."""
        for link in self.skeleton.links:
            if link.ends[0] == spot:
                along = flat[link.ends[1]] - flat[spot]
                angle = float(np.arctan2(along[1], along[0]))
                return angle + 0.25, angle + 1.1
        return 0.4, 2.0

    def _frames(self, flat: Floats) -> None:
        if self.view.plane is not None or len(self.mechanism.frames) > 8:
            return
        for name, axes in self.skeleton.axes.items():
            origin = flat[self.skeleton.origins[name]]
            for number in axes:
                tip = origin + 5.0 * self.view.flat(self.positions[number])
                if float(np.linalg.norm(tip - origin)) > 0.8:
                    self.stroke(f"frames.{name}", "axis", glyphs.arrow(origin, tip, 1.2))

    def _gravity(self) -> None:
        gravity, down = self.mechanism.gravity, self.view.down
        along = None if down is None else self.view.flat(down)
        left, bottom, right, top = _bounds(self.marks)
        corner = np.array([right + 5.0, top])
        if gravity is not None and along is not None and float(np.linalg.norm(along)) > 0.2:
            self.stroke("gravity", "gravity", glyphs.arrow(corner, corner + 9.0 * along))
            text = to_text(gravity.acceleration)
            self.name("gravity", "gravity", pretty(text if len(text) <= 9 else "g"), corner + 4.5 * along, 1.2)
        origin = np.array([left - 7.0, bottom])
        for axis in range(3):
            along = self.view.flat(np.eye(3)[axis])
            if float(np.linalg.norm(along)) > 0.1:
                self.stroke("world", "axis", glyphs.arrow(origin, origin + 7.0 * along, 1.4))
                self.name("world", "axis", "xyz"[axis], origin + 7.0 * along, 0.4)

    def _constraints(self) -> None:
        shown = [c.name for c in self.mechanism.constraints]
        if shown:
            rest = f" and {len(shown) - 8} more" if len(shown) > 8 else ""
            self.notes.append(f"Constraints: {', '.join(shown[:8])}{rest}.")

    def _finished(self) -> Scene:
        size = 3.2 if len(self.wishes) <= _MANY else 2.5
        wishes = [replace(w, size=size) for w in self.wishes]
        strokes = [m for m in self.marks if isinstance(m, Stroke)]
        lines = [np.array(m.points) for m in strokes]
        lines += [line + side for line, m in zip(lines, strokes, strict=True) if m.style == "rod" for side in _SIDES]
        lines += [glyphs.circle(np.array(m.center), m.radius, 16) for m in self.marks if isinstance(m, Disc)]
        labels = tuple(placed(wishes, lines))
        left, bottom, right, top = _bounds(self.marks, labels)
        return Scene(
            self.mechanism.title,
            tuple(self.marks),
            labels,
            tuple(self.notes),
            (left - 2.0, bottom - 2.0, right + 2.0, top + 2.0),
            self.unit,
        )


def _bounds(marks: Iterable[Stroke | Disc], labels: Iterable[Label] = ()) -> tuple[float, float, float, float]:
    """Left, bottom, right and top of what is drawn."""
    low, high = [], []
    for mark in marks:
        points = np.array(mark.points if isinstance(mark, Stroke) else [mark.center])
        reach = 0.0 if isinstance(mark, Stroke) else mark.radius
        low.append(points.min(axis=0) - reach)
        high.append(points.max(axis=0) + reach)
    for label in labels:
        half = np.array([0.3 * len(label.text), 0.6]) * label.size
        low.append(np.array(label.at) - half)
        high.append(np.array(label.at) + half)
    (left, bottom), (right, top) = np.min(low, axis=0), np.max(high, axis=0)
    return float(left), float(bottom), float(right), float(top)
