"""Where things are: frames, bodies and points, the normal form of parts, and how one part refers to another.

Positions are in m, angles in rad; expressions compute in SI.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import sympy as sp

from lag2fmu.description.keys import CONFIGURATION, CONSTANT, GIVEN, Key, key, keys_in
from lag2fmu.description.values import require_flag, require_number, require_text, texts
from lag2fmu.errors import MechanismError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.language.unit_parser import checked_unit
from lag2fmu.language.units import DIMENSIONLESS, KILOGRAM, METRE, RADIAN
from lag2fmu.language.vocabulary import normal_form

Expression: TypeAlias = "sp.Expr | int | float"
Vector = tuple[sp.Expr, ...]

WORLD = "world"
"""The name of the fixed frame, and of its axes."""
_GROUND = ("world", "ground", "origin", "base", "fixed", "earth", "inertial", "o", "n")
"""Words, in small letters, by which the fixed frame is often meant."""

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
    parent: str | Frame = key("part", "The frame it moves in; by default the world.", default=WORLD)
    origin: Sequence[Expression] = key(
        "vector", "3 entries in m, in the parent's axes.", default=(0, 0, 0), names=CONFIGURATION, unit=METRE
    )
    rotations: Sequence[tuple[str | Sequence[Expression], Expression]] = key(
        "rotations", 'Turns about the moving axes, in turn, e.g. [["z", "q1"], ["y", "q2"]].', default=()
    )
    quaternion: Sequence[Expression] | None = key(
        "vector",
        "4 entries, the scalar part first, instead of rotations.",
        default=None,
        names=CONFIGURATION,
        unit=DIMENSIONLESS,
    )

    def __post_init__(self) -> None:
        where = f"frames.{self.name}"
        normalise(self, where)
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
    """A place to which springs, dampers, loads and joints can be attached: a body or a point.

    ``position`` has 2 or 3 entries, in m; ``angle`` is in rad.
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

    ``mass`` is in kg, 0 if only an inertia is given. A body with ``angle`` and ``inertia`` alone is a rotor, which only
    turns and has no place. Without a frame ``position`` holds the 2 or 3 coordinates (m) of the mass centre in the
    fixed frame, r(t, q); ``inertia`` about the mass centre is in kg.m2, ``angle`` in rad, counter-clockwise. A spatial
    body has its mass centre at ``center`` (m), and the inertia tensor (Ixx, Iyy, Izz, Ixy, Ixz, Iyz) about it, in
    kg.m2, both in the axes of its frame. The entries are those of the tensor: Ixy = - integral of x y dm. Without
    inertia a body is a particle. Raises MechanismError for a vector where one expression is expected, and the other
    way round, and for a body without mass and inertia.
    """

    name: str
    mass: Expression = key(
        "expression",
        "In kg; by default 0, beside an inertia. Mass that is lost stays at rest; momentum that leaves is a force.",
        default=None,
        names=GIVEN,
        unit=KILOGRAM,
        order=-1,
    )
    position: Sequence[Expression] | None = key(
        "vector", "The mass centre in m: 2 entries, 3 in space.", default=None, names=CONFIGURATION, unit=METRE
    )
    angle: Expression | None = key(
        "expression", "The angle of a planar body in rad.", default=None, names=CONFIGURATION, unit=RADIAN
    )
    inertia: Expression | Sequence[Expression] | None = key(
        "expression or vector",
        "In kg.m2 about the mass centre; in space [Ixx, Iyy, Izz, Ixy, Ixz, Iyz].",
        default=None,
        names=GIVEN,
        unit=KILOGRAM * METRE * METRE,
        order=-1,
    )
    frame: str | Frame | None = key(
        "part", "The frame a spatial body is fixed to, instead of a position.", default=None
    )
    center: Sequence[Expression] = key(
        "vector",
        "The mass centre in the axes of the frame; by default its origin.",
        default=(0, 0, 0),
        names=CONFIGURATION,
        unit=METRE,
    )

    def __post_init__(self) -> None:
        normalise(self, f"bodies.{self.name}")
        if self.mass is None:
            if self.inertia is None:
                raise MechanismError(f"bodies.{self.name}: 'mass' is missing; give it, or the inertia of what turns")
            object.__setattr__(self, "mass", sp.S.Zero)

    @property
    def placed(self) -> bool:
        """Whether it has a place, which a body that only turns has not."""
        return self.position is not None or self.frame is not None


@dataclass(frozen=True)
class Point(Place):
    """A named point: ``position`` with 2 or 3 entries, in m, in the fixed frame, or with 3 in the axes of ``frame``.

    In the plane it may have an ``angle`` (rad), that of the body it is fixed to, for joints.
    """

    name: str
    position: Sequence[Expression] = key(
        "vector", "2 entries in m, 3 in space or in the axes of the frame.", names=CONFIGURATION, unit=METRE
    )
    frame: str | Frame | None = key(
        "part", "The frame the point is fixed to; by default the world.", default=None, order=-1
    )
    angle: Expression | None = key(
        "expression",
        "In the plane the angle of what it is fixed to, in rad, for joints.",
        default=None,
        names=CONFIGURATION,
        unit=RADIAN,
    )

    def __post_init__(self) -> None:
        normalise(self, f"points.{self.name}")


End = str | Place


def remedy_for(name: str, known: Iterable[str]) -> str:
    """The remedy for an unknown ``name`` of a frame or place, the ``known`` ones being those that could stand there."""
    known = list(known)
    found = suggestion(name, known)
    if name.lower() not in _GROUND or found.startswith("did you mean"):
        return found
    if WORLD in known:
        return f"the ground is called '{WORLD}'"
    return f"a place on the ground is a point of its own, [points.A] with a position; {found}"


# ----------------------------------------------------------------------------------------------------- normal forms


def axes_key(doc: str = "Whose axes the entries are along; by default the world's.") -> Any:
    """The field of the axes that entries are along."""
    return key((WORLD, "frame"), doc, default=WORLD)


_EXPRESSIONS = ("expression", "vector", "expression or vector")


def normalise(part: object, where: str) -> None:
    """Bring the keys of a frozen part to normal form: expressions, references to parts by name, units.

    Sequences become tuples. Raises MechanismError for a value of another kind than that of the key, UnitError for a
    text that is no unit.
    """
    for known in keys_in(part):
        value, place = getattr(part, known.field), f"{where}.{known.name}"
        if value is None and known.default is None:
            continue
        if value is None:
            raise MechanismError(f"{place}: is None; give a value")
        if known.kind in _EXPRESSIONS:
            value = _normal(value, str(known.kind), place)
        elif known.kind == "part" and isinstance(value, (Place, Frame)):
            value = value.name
        elif known.kind == "names":
            value = _names(value, place)
        elif known.kind == "texts":
            value = texts(value, place)
        elif known.kind == "unit":
            value = checked_unit(value, place)
        else:
            _REQUIRED.get("string" if isinstance(known.kind, tuple) else known.kind, _anything)(value, place)
        object.__setattr__(part, known.field, value)


def _anything(value: object, where: str) -> None:
    """Accept a value that is checked elsewhere."""


_REQUIRED = {"number": require_number, "difference": require_number, "string": require_text, "flag": require_flag}
"""{kind of a key: what raises MechanismError for a value of another kind}."""


def _names(value: object, where: str) -> tuple[object, ...]:
    """The names of parts, which may be given themselves; raises MechanismError unless there is a list of them."""
    if isinstance(value, str) or not isinstance(value, Iterable):
        raise MechanismError(f"{where}: expected a list of names, got {value!r}")
    return tuple(getattr(end, "name", end) for end in value)


def _normal(value: object, kind: str, where: str) -> sp.Expr | Vector:
    is_vector = isinstance(value, (tuple, list, sp.MatrixBase))
    if is_vector != (kind == "vector") and kind != "expression or vector":
        expected = "one expression" if is_vector else "a tuple of expressions"
        raise MechanismError(f"{where}: expected {expected}, got {value!r}")
    if isinstance(value, (tuple, list, sp.MatrixBase)):
        if not len(value):
            raise MechanismError(f"{where}: has no entries; give at least one, or leave it out")
        return tuple(normal_form(item, f"{where}[{i}]") for i, item in enumerate(value))
    return normal_form(value, where)


_TURN_AXIS = Key("axis", "", names=CONSTANT)
_TURN_ANGLE = Key("expression", "", names=CONFIGURATION, unit=RADIAN)


def expressions_of(part: object, where: str) -> Iterator[tuple[str, sp.Expr, Key]]:
    """Every expression of ``part`` with its place and key, e.g. ('frames.arm.rotations[0].angle', q1, key)."""
    for known in keys_in(part):
        yield from _expressions(getattr(part, known.field), f"{where}.{known.name}", known)


def _expressions(value: object, where: str, known: Key) -> Iterator[tuple[str, sp.Expr, Key]]:
    if isinstance(value, sp.Expr):
        yield where, value, known
    elif isinstance(value, Rotation):
        yield from _expressions(value.axis, f"{where}.axis", _TURN_AXIS)
        yield from _expressions(value.angle, f"{where}.angle", _TURN_ANGLE)
    elif isinstance(value, tuple):
        for i, entry in enumerate(value):
            yield from _expressions(entry, f"{where}[{i}]", known)
