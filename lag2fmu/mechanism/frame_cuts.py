"""Where a tree of frames can be cut: the joint by which a frame moves on its parent."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import NoReturn, cast

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.joints import direction
from lag2fmu.description.places import AXES, WORLD, Frame, Rotation
from lag2fmu.description.symbols import Coordinate
from lag2fmu.errors import MechanismError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.language.units import DIMENSIONLESS, METRE
from lag2fmu.language.vocabulary import symbol, value_of
from lag2fmu.mechanism.cut import Axis, Cut, Part
from lag2fmu.mechanism.poses import poses_of

_WHY = "which no joint between FMUs does; cut at a frame that turns about one axis, slides along one, or turns freely"


class FrameCut(Cut):
    """A cut between a frame and its parent."""

    @property
    def probe(self) -> Frame:
        """A frame on the root."""
        return Frame(self.measured, self.root)

    def freed(self, part: Part) -> Part:
        """The root moves by three coordinates and a quaternion; what it carries is as before."""
        if not isinstance(part, Frame) or part.name != self.root:
            return part
        place = [symbol(f"{self.root}_free_{x}") for x in AXES]
        free = Frame(self.root, WORLD, place, quaternion=[symbol(f"{self.root}_free_e{i}") for i in range(4)])
        return cast("Part", free)

    def free_coordinates(self, start: Mapping[str, float]) -> Iterator[Coordinate]:
        """Place and quaternion of the root.

        e' = (0, omega) e/2 with omega in the world's axes: P. E. Nikravesh, Computer-Aided Analysis of Mechanical
        Systems, section 6.6.
        """

        def of(quantity: str, ends: Iterable[object]) -> list[float]:
            return [start[f"{self.measured}_{quantity}_{end}"] for end in ends]

        for x, place, speed in zip(AXES, of("position", AXES), of("velocity", AXES), strict=True):
            yield Coordinate(f"{self.root}_free_{x}", METRE, place, speed, doc=f"place of {self.root}, {x}")
        (a, b, c, d), (u, v, w) = of("quaternion", range(4)), of("angular_velocity", AXES)
        rates = -(b * u + c * v + d * w), a * u + v * d - w * c, a * v + w * b - u * d, a * w + u * c - v * b
        for i, (e, rate) in enumerate(zip((a, b, c, d), rates, strict=True)):
            name, doc = f"{self.root}_free_e{i}", f"quaternion of {self.root}"
            yield Coordinate(name, DIMENSIONLESS, e, rate / 2, doc=doc, given=True, velocity_given=True)


def frame_cut_at(d: Description, name: str, values: Mapping[str, float]) -> Cut:
    """The cut at ``name``: a frame, or the coordinate by which one frame moves.

    ``values``: {parameter: SI value}. Raises MechanismError if there is none, or its joint is no joint between FMUs.
    """
    return _Mount(d, _frame(d, name), values).cut()


class _Mount:
    """How a ``frame`` stands on its parent: origin and turns, and the coordinates in them."""

    def __init__(self, d: Description, frame: Frame, values: Mapping[str, float]) -> None:
        """Raises MechanismError where time is in them, or something besides coordinates in a quaternion."""
        poses, self.d, self.frame, self.values = poses_of(d), d, frame, values
        self.moving = {symbol(q.name) for q in d.coordinates}
        self.origin = sp.Matrix([poses.resolved(x) for x in frame.origin])
        self.turns = tuple(Rotation(turn.axis, poses.resolved(turn.angle)) for turn in _turns(frame))
        self.quaternion = tuple(map(sp.sympify, frame.quaternion or ()))
        expressions = (*self.origin, *(turn.angle for turn in self.turns), *self.quaternion)
        used = {s for x in expressions for s in x.free_symbols}
        self.own = sorted(s.name for s in used & self.moving)
        alone = {*self.quaternion} <= self.moving
        if not (alone and {s.name for s in used - self.moving} <= values.keys() - {"t"}):
            self._refuse("moves by itself, or by expressions in a quaternion")

    @property
    def turning(self) -> list[int]:
        """Which of the turns move."""
        return [i for i, turn in enumerate(self.turns) if turn.angle.free_symbols & self.moving]

    def _refuse(self, how: str) -> NoReturn:
        raise MechanismError(f"--at {self.frame.name}: it {how}, {_WHY}")

    def cut(self) -> Cut:
        """The joint: fixed, revolute, prismatic or spherical. Raises MechanismError for any other."""
        slides = bool(self.origin.free_symbols & self.moving)
        if slides and not self.turning and len(self.own) == 1:
            return self._prismatic()
        if not slides and len(self.own) == len(self.turning) == 1:
            return self._revolute()
        free = len(self.own) == len(self.quaternion or self.turning) and len(self.own) in (0, 3, 4)
        if slides or not free:
            self._refuse(f"moves by {', '.join(self.own)}")
        kind, turns = ("spherical", ()) if self.own else ("fixed", self.turns)
        return self._of(kind, (0.0, 0.0, 1.0), 1.0, self.origin, turns)

    def _of(
        self,
        kind: str,
        axis: Axis,
        scale: float,
        origin: sp.Matrix,
        turns: tuple[Rotation, ...],
        back: tuple[Rotation, ...] = (),
    ) -> Cut:
        """The cut whose seat is at ``origin``, turned by ``turns``; the pin is turned ``back`` in the frame."""
        name = self.frame.name
        seat = Frame(f"{name}_seat", self.frame.parent, tuple(origin), turns)
        pin = Frame(f"{name}_pin", name, rotations=back)
        return FrameCut(name, kind, axis, tuple(self.own), scale, seat, pin, self._carried())

    def _carried(self) -> frozenset[str]:
        """The names of the frame and of all that stand on it."""
        found = {self.frame.name}
        while more := {f.name for f in self.d.frames if str(f.parent) in found} - found:
            found |= more
        return frozenset(found)

    def _revolute(self) -> Cut:
        (i,), q = self.turning, symbol(self.own[0])
        axis, angle = self.turns[i]
        slope = angle.diff(q)
        if slope.free_symbols & self.moving:
            self._refuse(f"turns by {angle}, which is not proportional to {q}")
        still = (*self.turns[:i], Rotation(axis, angle.xreplace({q: sp.S.Zero})))
        back = tuple(Rotation(a, -b) for a, b in reversed(self.turns[i + 1 :]))
        return self._of("revolute", self._unit(direction(axis)), value_of(slope, self.values), self.origin, still, back)

    def _prismatic(self) -> Cut:
        q = symbol(self.own[0])
        along = self.origin.diff(q)
        if along.free_symbols & self.moving:
            self._refuse("slides along a curve")
        turned = poses_of(self.d).pose(self.frame.name, str(self.frame.parent)).rotation.T * along
        entries = [value_of(x, self.values) for x in turned]
        scale = math.hypot(*entries)
        axis = self._unit(sp.Matrix(entries) / scale)
        return self._of("prismatic", axis, scale, self.origin.xreplace({q: sp.S.Zero}), self.turns)

    def _unit(self, vector: sp.Matrix) -> Axis:
        x, y, z = (value_of(entry, self.values) for entry in vector)
        return x, y, z


def _frame(d: Description, name: str) -> Frame:
    """The frame called ``name``, or the one that moves by the coordinate ``name``."""
    frames = {frame.name: frame for frame in d.frames}
    if name in frames:
        return frames[name]
    coordinates = [q.name for q in d.coordinates]
    found = [frame for frame in d.frames if symbol(name) in _symbols(frame)]
    if name in coordinates and len(found) == 1:
        return found[0]
    if name in coordinates:
        raise MechanismError(f"--at {name}: this coordinate moves {len(found)} frames; name the frame to cut at")
    remedy = suggestion(name, [*frames, *coordinates])
    raise MechanismError(f"--at {name}: there is no frame or coordinate '{name}'; {remedy}")


def _turns(frame: Frame) -> tuple[Rotation, ...]:
    return tuple(Rotation(*turn) for turn in frame.rotations)  # type: ignore[arg-type]


def _symbols(frame: Frame) -> set[sp.Symbol]:
    expressions = (*frame.origin, *(turn.angle for turn in _turns(frame)), *(frame.quaternion or ()))
    return {s for x in expressions for s in sp.sympify(x).free_symbols}
