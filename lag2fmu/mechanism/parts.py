"""The parts of a mechanism beside its variables and outputs: energies, frames, bodies, springs, dampers, loads.

All are frozen; their expressions are in the normal form of ``expressions`` and compute in SI units. Parts refer to each
other by name; Python may give the part itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any, NamedTuple, TypeAlias

import sympy as sp

from lag2fmu.errors import MechanismError
from lag2fmu.mechanism import names
from lag2fmu.mechanism.expressions import normal_form
from lag2fmu.mechanism.units import Unit, parse_unit

Expression: TypeAlias = "sp.Expr | int | float"
Vector = tuple[sp.Expr, ...]

WORLD = "world"
"""The name of the fixed frame, and of its axes."""

AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Definition:
    """A name for an expression that other expressions use."""

    name: str
    expression: sp.Expr

    def __post_init__(self) -> None:
        normalise(self, "definition", "expression")


@dataclass(frozen=True)
class Energy:
    """Energies beside those of bodies and springs, or the whole Lagrangian; ``dissipation`` is Rayleigh's function."""

    kinetic: Expression | None = None
    potential: Expression | None = None
    dissipation: Expression | None = None
    lagrangian: Expression | None = None

    def __post_init__(self) -> None:
        for item in fields(self):
            if getattr(self, item.name) is not None:
                normalise(self, "energy", item.name)


@dataclass(frozen=True)
class Gravity:
    """Uniform gravity: ``acceleration`` (m/s2) along ``direction`` (2 or 3 entries; by default -y or -z)."""

    acceleration: Expression
    direction: Vector | None = None

    def __post_init__(self) -> None:
        normalise(self, "gravity", "acceleration", "direction")


# --------------------------------------------------------------------------------------------------------- geometry


class Rotation(NamedTuple):
    """A turn by ``angle`` (rad) about ``axis``: "x", "y", "z" or a constant vector of 3 entries, of any length."""

    axis: str | Vector
    angle: sp.Expr


@dataclass(frozen=True)
class Frame:
    """A frame that moves relative to its ``parent``: r_world = parent(origin + R r).

    ``origin`` (m) is in the parent's axes. ``rotations`` are turns (axis, angle) about the moving axes in turn,
    R = R1 R2 ...; instead a unit ``quaternion`` (e0, e1, e2, e3) may be given, e0 being its scalar part:
    R v = v + 2 e0 e x v + 2 e x (e x v).
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
    """What bodies and points have in common: something can be attached to them."""

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
    its frame; the entries are those of the tensor, Ixy = - integral of x y dm. Without inertia it is a particle.
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


# ----------------------------------------------------------------------------------------------------------- forces


@dataclass(frozen=True)
class Spring:
    """A linear spring: ``elongation`` as an expression, or ``between`` two points or bodies with natural ``length``."""

    name: str
    stiffness: Expression
    elongation: Expression | None = None
    between: Sequence[End] | None = None
    length: Expression | None = None

    def __post_init__(self) -> None:
        normalise(self, f"springs.{self.name}", "stiffness", "elongation", "length")
        name_ends(self)


@dataclass(frozen=True)
class Damper:
    """A linear damper: ``rate`` of elongation as an expression, or ``between`` two points or bodies."""

    name: str
    damping: Expression
    rate: Expression | None = None
    between: Sequence[End] | None = None

    def __post_init__(self) -> None:
        normalise(self, f"dampers.{self.name}", "damping", "rate")
        name_ends(self)


@dataclass(frozen=True)
class Force:
    """A generalized non-potential force Q on one coordinate."""

    coordinate: str
    expression: Expression

    def __post_init__(self) -> None:
        object.__setattr__(self, "coordinate", str(self.coordinate))
        normalise(self, f"forces.{self.coordinate}", "expression")


@dataclass(frozen=True)
class Load:
    """A force (N) at a ``point`` (or at a body's mass centre), or a ``torque`` (N.m) on a ``body``.

    The torque on a planar body is one expression, on a spatial one (of a frame) 3. The entries are along the ``axes``
    of the "world" or of the "frame" of point or body. With ``input=True`` and no value the load itself becomes FMU
    inputs: NAME_x, NAME_y (NAME_z) for a force, NAME for a planar torque, NAME_x, NAME_y, NAME_z for a spatial one.
    """

    name: str
    point: End | None = None
    body: End | None = None
    force: Sequence[Expression] | None = None
    torque: Expression | Sequence[Expression] | None = None
    input: bool = False
    axes: str = WORLD

    def __post_init__(self) -> None:
        normalise(self, f"loads.{self.name}", "force", "torque")
        name_parts(self, "point", "body")


# ------------------------------------------------------------------------------------------------------ constraints


KINDS = ("holonomic", "equilibrium", "nonholonomic", "damped_equilibrium")


@dataclass(frozen=True)
class Constraint:
    """``expression`` = 0: holonomic in t, q and motions, or nonholonomic and affine in the velocities.

    An ``equilibrium`` is that of the forces on a coordinate without mass, which may contain all inputs: it ties the
    coordinates without a force of its own; a ``damped_equilibrium`` ties velocities. The derivation finds them.

    ``unit`` is that of the expression; None: what follows from the units of the names in it.
    """

    name: str
    expression: Expression
    kind: str = "holonomic"
    unit: Unit | str | None = None

    def __post_init__(self) -> None:
        normalise(self, f"constraints.{self.name}", "expression")
        if self.kind not in KINDS:
            raise MechanismError(f"constraints.{self.name}: '{self.kind}' is no kind; give one of {', '.join(KINDS)}")
        object.__setattr__(self, "unit", parse_unit(self.unit) if isinstance(self.unit, str) else self.unit)

    @property
    def holonomic(self) -> bool:
        """Whether it restricts the coordinates themselves, not only the velocities."""
        return self.kind in KINDS[:2]

    @property
    def massless(self) -> bool:
        """Whether it is the equilibrium of forces on something without mass."""
        return self.kind.endswith("equilibrium")

    @property
    def coordinate(self) -> str | None:
        """The coordinate without mass that it is solved for, with friction its velocity; None for other kinds."""
        return names.coordinate_of_massless(self.name) if self.massless else None


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
