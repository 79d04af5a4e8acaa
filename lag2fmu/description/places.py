"""Where things are: frames, bodies and points, the normal form of parts, and how one part refers to another.

Positions are in m, angles in rad; expressions compute in SI.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any, NamedTuple, TypeAlias

import sympy as sp

from lag2fmu.errors import MechanismError
from lag2fmu.language.expressions import normal_form

Expression: TypeAlias = "sp.Expr | int | float"
Vector = tuple[sp.Expr, ...]

WORLD = "world"
"""The name of the fixed frame, and of its axes."""

AXES = ("x", "y", "z")


class Rotation(NamedTuple):
    """A turn by ``angle`` (rad) about ``axis``: "x", "y", "z" or a constant vector of 3 entries, of any length."""

    axis: str | Vector
    angle: sp.Expr


@dataclass(frozen=True)
class Frame:
    """A frame that moves relative to its ``parent``: r_world = parent(origin + R r).

    ``origin`` (m) is in the parent's axes. ``rotations`` are turns (axis, angle) about the moving axes in turn,
    R = R1 R2 ...; instead a unit ``quaternion`` (e0, e1, e2, e3) may be given, e0 being its scalar part:
    R v = v + 2 e0 e x v + 2 e x (e x v). Raises MechanismError for axes that are none. Source: Wittenburg, Dynamics of
    Multibody Systems, 2nd edition, chapter 2.
    """

    name: str
    parent: str | Frame = WORLD
    origin: Sequence[Expression] = (0, 0, 0)
    rotations: Sequence[tuple[str | Sequence[Expression], Expression]] = ()
    quaternion: Sequence[Expression] | None = None

    def __post_init__(self) -> None:
        where = f"frames.{self.name}"
        name_parts(self, "parent")
        normalise(self, where, "origin", "quaternion")
        if isinstance(self.rotations, str) or not isinstance(self.rotations, Sequence):
            raise MechanismError(f"{where}.rotations: expected pairs of axis and angle, got {self.rotations!r}")
        turns = tuple(_rotation(item, f"{where}.rotations[{i}]") for i, item in enumerate(self.rotations))
        object.__setattr__(self, "rotations", turns)


def _rotation(item: object, where: str) -> Rotation:
    """The pair (axis, angle) ``item``; raises MechanismError for anything else."""
    if isinstance(item, str) or not isinstance(item, Sequence) or len(item) != 2:
        raise MechanismError(f"{where}: expected a pair of axis and angle, e.g. ('z', q), got {item!r}")
    axis, angle = item
    return Rotation(checked_axis(axis, f"{where}.axis"), normal_form(angle, f"{where}.angle"))


def checked_axis(axis: object, where: str) -> str | Vector:
    """The ``axis`` "x", "y", "z" or 3 expressions in normal form; raises MechanismError for anything else, and zero."""
    if isinstance(axis, str):
        if axis not in AXES:
            raise MechanismError(f"{where}: '{axis}' is no axis; give 'x', 'y', 'z' or a vector of 3 entries")
        return axis
    if not isinstance(axis, (tuple, list, sp.MatrixBase)) or len(axis) != 3:
        raise MechanismError(f"{where}: {axis!r} is no axis; give 'x', 'y', 'z' or a vector of 3 entries")
    entries = tuple(normal_form(x, f"{where}[{i}]") for i, x in enumerate(axis))
    if all(x.is_zero for x in entries):
        raise MechanismError(f"{where}: the zero vector is no axis; give a vector with a direction")
    return entries


class Place:
    """What bodies and points have in common: something can be attached to them.

    ``position`` (2 or 3 entries) in m, ``angle`` in rad.
    """

    name: str
    position: Sequence[Expression] | None
    frame: str | Frame | None
    angle: Expression | None

    @property
    def dimension(self) -> int:
        """The number of entries of its position: 2 in the plane, 3 in space, where all frames are."""
        return 3 if self.frame is not None or self.position is None else len(self.position)


@dataclass(frozen=True)
class Body(Place):
    """A particle, a planar rigid body if ``angle`` and ``inertia`` are given, a spatial body if it has a ``frame``.

    ``mass`` in kg. Without a frame ``position`` holds the 2 or 3 coordinates (m) of the mass centre in the fixed frame,
    r(t, q); ``inertia`` about the mass centre is in kg.m2, ``angle`` in rad, counter-clockwise. A spatial body has its
    mass centre at ``center`` (m) and the inertia tensor (Ixx, Iyy, Izz, Ixy, Ixz, Iyz) about it, both in the axes of
    its frame; the entries are those of the tensor, Ixy = - integral of x y dm. Without inertia it is a particle. Raises
    MechanismError for a vector where one expression is expected, and the other way round.
    """

    name: str
    mass: Expression
    position: Sequence[Expression] | None = None
    angle: Expression | None = None
    inertia: Expression | Sequence[Expression] | None = None
    frame: str | Frame | None = None
    center: Sequence[Expression] = (0, 0, 0)

    def __post_init__(self) -> None:
        name_parts(self, "frame")
        normalise(self, f"bodies.{self.name}", "mass", "position", "angle", "inertia", "center")


@dataclass(frozen=True)
class Point(Place):
    """A named point: ``position`` with 2 or 3 entries, in m, in the fixed frame, or with 3 in the axes of ``frame``.

    In the plane it may have the ``angle`` (rad) of what it is fixed to, for joints.
    """

    name: str
    position: Sequence[Expression]
    frame: str | Frame | None = None
    angle: Expression | None = None

    def __post_init__(self) -> None:
        name_parts(self, "frame")
        normalise(self, f"points.{self.name}", "position", "angle")


End = str | Place


# ----------------------------------------------------------------------------------------------------- normal forms


_VECTORS = frozenset({"position", "origin", "center", "quaternion", "direction", "force"})
_EITHER = frozenset({"inertia", "torque"})


def normalise(part: object, where: str, *names: str) -> None:
    """Bring the expressions ``names`` of a frozen part to normal form; sequences become tuples.

    Raises MechanismError for a vector where one expression is expected, and the other way round.
    """
    for name in names:
        value = getattr(part, name)
        if value is None:
            continue
        is_vector = isinstance(value, (tuple, list, sp.MatrixBase))
        if is_vector != (name in _VECTORS) and name not in _EITHER:
            expected = "one expression" if is_vector else "a tuple of expressions"
            raise MechanismError(f"{where}.{name}: expected {expected}, got {value!r}")
        if is_vector:
            value = tuple(normal_form(item, f"{where}.{name}[{i}]") for i, item in enumerate(value))
        else:
            value = normal_form(value, f"{where}.{name}")
        object.__setattr__(part, name, value)


def name_parts(part: object, *keys: str) -> None:
    """Put the names of the parts that ``keys`` refer to in their place."""
    for key in keys:
        value = getattr(part, key)
        if isinstance(value, (Place, Frame)):
            object.__setattr__(part, key, value.name)


def name_ends(part: Any) -> None:
    """Put the names of the parts that ``part`` is between in their place."""
    if part.between is not None:
        object.__setattr__(part, "between", tuple(getattr(end, "name", end) for end in part.between))


def expressions_of(part: object, where: str) -> Iterator[tuple[str, sp.Expr]]:
    """Every expression of ``part`` with its place, e.g. ('frames.arm.rotations[0].angle', q1)."""
    if isinstance(part, sp.Expr):
        yield where, part
    elif isinstance(part, Rotation):
        yield from expressions_of(part.axis, f"{where}.axis")
        yield from expressions_of(part.angle, f"{where}.angle")
    elif isinstance(part, tuple):
        for i, entry in enumerate(part):
            yield from expressions_of(entry, f"{where}[{i}]")
    elif hasattr(part, "__dataclass_fields__"):
        for item in fields(part):  # type: ignore[arg-type]
            yield from expressions_of(getattr(part, item.name), f"{where}.{item.name}")
