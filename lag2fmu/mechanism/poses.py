"""Poses of frames relative to each other as expressions, of which the equations of joints are made.

Expressions stay small: only the frames between the two ends of a joint are composed, and turns about the same axis one
after the other become one. Energies are not composed here, but in ``dynamics`` and in ``reference``.

Source: R. Featherstone, Rigid Body Dynamics Algorithms, section 2.8; of quaternions: P. E. Nikravesh, Computer-Aided
Analysis of Mechanical Systems, sections 6.1 and 6.2.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import NamedTuple

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.description import Description
from lag2fmu.description.joints import direction
from lag2fmu.description.parts import Definition
from lag2fmu.description.places import WORLD, Expression, Frame, remedy_for
from lag2fmu.errors import MechanismError
from lag2fmu.language.definitions import written_out
from lag2fmu.language.vocabulary import TIME, symbol
from lag2fmu.mechanism.order import in_order


class Pose(NamedTuple):
    """Origin (3, 1) in m, rotation matrix (3, 3), angular velocity (3, 1) in rad/s, along the axes of the base.

    ``velocity`` (3, 1) is that of the origin, in m/s.
    """

    origin: sp.Matrix
    rotation: sp.Matrix
    angular: sp.Matrix
    velocity: sp.Matrix

    def at(self, place: sp.Matrix) -> sp.Matrix:
        """The point ``place`` (3, 1) of the frame, in the axes of the base, (3, 1), in m."""
        return self.origin + times(self.rotation, place)

    def moved(self, place: sp.Matrix) -> sp.Matrix:
        """The velocity of the point ``place`` (3, 1) of the frame, in the axes of the base, (3, 1), in m/s."""
        return self.velocity + crossed(self.angular, times(self.rotation, place))


def times(a: sp.Matrix, b: sp.Matrix) -> sp.Matrix:
    """The product of ``a`` (n, m) and ``b`` (m, k), (n, k), without the products of zeros.

    SymPy asks of what a zero multiplies whether it is finite, which takes minutes where expressions are long.
    """

    def entry(i: int, j: int) -> sp.Expr:
        return sp.Add(*(a[i, k] * b[k, j] for k in range(a.cols) if a[i, k] != 0 and b[k, j] != 0))

    return sp.Matrix(a.rows, b.cols, entry)


def crossed(a: sp.Matrix, b: sp.Matrix) -> sp.Matrix:
    """The product a x b, (3, 1), without the products of zeros, as in ``times``."""

    def product(i: int, j: int) -> sp.Expr:
        return a[i] * b[j] if a[i] != 0 and b[j] != 0 else sp.S.Zero

    return sp.Matrix([product(i, j) - product(j, i) for i, j in ((1, 2), (2, 0), (0, 1))])


def poses_of(m: Description) -> Poses:
    """The poses of the frames of ``m``, kept for those that were asked for last."""
    return _kept_poses(tuple(m.frames), tuple(m.definitions), (*(q.name for q in m.coordinates), *m.driven))


class Poses:
    """The poses of ``frames``; definitions are written out, and ``moving`` are the names of what has a velocity."""

    def __init__(self, frames: Sequence[Frame], definitions: Sequence[Definition], moving: Sequence[str]) -> None:
        self.frames = {frame.name: frame for frame in frames}
        self._meaning = written_out({d.name: d.expression for d in in_order(definitions, "definitions")})
        self._rates = {symbol(name): symbol(names.velocity(name)) for name in moving}
        self._rates[TIME] = sp.S.One
        self._reached: dict[tuple[str, str], _Reached] = {}

    def resolved(self, expression: Expression) -> sp.Expr:
        """``expression`` with its definitions written out."""
        found = sp.sympify(expression)
        return found.xreplace(self._meaning) if self._meaning else found

    def column(self, place: Iterable[Expression]) -> sp.Matrix:
        """A ``place`` of 2 or 3 entries as (3, 1), definitions written out."""
        entries = [self.resolved(x) for x in place]
        return sp.Matrix([*entries, *[sp.S.Zero] * (3 - len(entries))])

    def rate(self, expression: sp.Expr) -> sp.Expr:
        """The time derivative of an expression in t, q and motions, by the chain rule."""
        used = expression.free_symbols
        return sp.Add(*(expression.diff(x) * rate for x, rate in self._rates.items() if x in used))

    def common(self, a: str, b: str) -> str:
        """The frame next to ``a`` and ``b`` that carries both."""
        below = {frame.name for frame in self.chain(a, WORLD)}
        shared = [frame.name for frame in self.chain(b, WORLD) if frame.name in below]
        return shared[-1] if shared else WORLD

    def chain(self, name: str, base: str) -> list[Frame]:
        """The frames from ``base`` on, without it, to ``name``."""
        chain: list[Frame] = []
        while name != base:
            chain.append(self.frames[name])
            name = str(self.frames[name].parent)
        return chain[::-1]

    def pose(self, name: str, base: str) -> Pose:
        """The frame ``name`` relative to ``base``, which carries it: composed along the frames in between.

        Source: Wittenburg, Dynamics of Multibody Systems, 2nd edition, chapter 2.
        """
        zero = sp.zeros(3, 1)
        reached = _Reached(Pose(zero, sp.eye(3), zero, zero), sp.eye(3), _Turn())
        for frame in self.chain(name, base):
            if (frame.name, base) not in self._reached:
                self._reached[frame.name, base] = self._onward(reached, frame)
            reached = self._reached[frame.name, base]
        return reached.pose

    def _onward(self, reached: _Reached, frame: Frame) -> _Reached:
        """From the parent of ``frame``, which is ``reached``, to the frame."""
        (origin, rotation, angular, velocity), before, last = reached
        own = sp.Matrix([self.resolved(x) for x in frame.origin])
        way = times(rotation, own)
        velocity += crossed(angular, way) + times(rotation, own.applyfunc(self.rate))
        if frame.quaternion is not None:
            e = sp.Matrix([self.resolved(x) for x in frame.quaternion])
            angular += times(rotation, _quaternion_rate(e, e.applyfunc(self.rate)))
            before, last = times(rotation, _quaternion_matrix(e)), _Turn()
        for axis, angle in frame.rotations:
            whole = self.resolved(angle)
            if axis != last.axis:
                before, last = times(before, last.matrix()), _Turn(axis)
            last = _Turn(axis, last.angle + whole)
            angular += times(before, direction(axis)) * self.rate(whole)
        return _Reached(Pose(origin + way, times(before, last.matrix()), angular, velocity), before, last)

    def planar(self, place: sp.Matrix, angle: Expression) -> Pose:
        """The pose in the world of what stands in the plane at ``place`` (3, 1), in m, turned by ``angle`` (rad)."""
        turned = self.resolved(angle)
        c, s = sp.cos(turned), sp.sin(turned)
        turn, angular = sp.Matrix([[c, -s, 0], [s, c, 0], [0, 0, 1]]), sp.Matrix([0, 0, self.rate(turned)])
        return Pose(place, turn, angular, place.applyfunc(self.rate))


@lru_cache(maxsize=8)
def _kept_poses(frames: tuple[Frame, ...], definitions: tuple[Definition, ...], moving: tuple[str, ...]) -> Poses:
    """What was composed once is found again: SymPy takes minutes to compare long expressions that are made twice."""
    return Poses(frames, definitions, moving)


def location_of(m: Description, name: str, where: str) -> tuple[str, tuple[sp.Expr, ...]]:
    """Frame and position of the end ``name``: a point, a body, or the origin of a frame.

    Raises MechanismError with ``where`` if there is none.
    """
    frames = [WORLD, *(frame.name for frame in m.frames)]
    places = {part.name: part for part in m.places}
    if name in places:
        frame, position = m.location(name)
        if name in frames and (frame, any(position)) != (name, False):
            raise MechanismError(f"{where}: '{name}' is a frame, and a point or body elsewhere; rename one of them")
        return frame, position
    if name not in frames:
        known = [*frames, *places]
        raise MechanismError(f"{where}: there is no frame, point or body '{name}'; {remedy_for(name, known)}")
    return name, (sp.S.Zero,) * m.dimension


class _Turn(NamedTuple):
    """A turn by an angle about an axis."""

    axis: object = "z"
    angle: sp.Expr = sp.S.Zero

    def matrix(self) -> sp.Matrix:
        """The rotation matrix, (3, 3), by Rodrigues' formula."""
        u, c, s = direction(self.axis), sp.cos(self.angle), sp.sin(self.angle)  # type: ignore[arg-type]
        return c * sp.eye(3) + s * _crossing(u) + (1 - c) * u * u.T


class _Reached(NamedTuple):
    """A frame on a chain: its ``pose``, whose rotation is ``before``, (3, 3), and then the ``last`` turn."""

    pose: Pose
    before: sp.Matrix
    last: _Turn


def _quaternion_matrix(e: sp.Matrix) -> sp.Matrix:
    """R v = v + 2 e0 e x v + 2 e x (e x v)."""
    cross = _crossing(e[1:])
    return sp.eye(3) + 2 * e[0] * cross + 2 * cross * cross


def _crossing(vector: Iterable[sp.Expr]) -> sp.Matrix:
    """The matrix (3, 3) whose product with v is vector x v."""
    x, y, z = vector
    return sp.Matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def _quaternion_rate(e: sp.Matrix, rate: sp.Matrix) -> sp.Matrix:
    """The angular velocity (3, 1) in the parent's axes, 2 (e0 e_dot - e0_dot e + e x e_dot)."""
    vector, change = sp.Matrix(e[1:]), sp.Matrix(rate[1:])
    return 2 * (e[0] * change - rate[0] * vector + vector.cross(change))
