"""Joints: the record, the kinds, and the frame and coordinates that a joint on a parent brings.

A joint ``between`` two ends is a set of constraints, see ``joint_equations``. A joint on a ``parent`` is a frame that
moves by its own coordinates. Both are written out when the mechanism is built; the text has them as they were given.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import sympy as sp

from lag2fmu.description.keys import CONFIGURATION, CONSTANT, key
from lag2fmu.description.places import (
    AXES,
    WORLD,
    End,
    Expression,
    Frame,
    Vector,
    axes_key,
    checked_axis,
    normalise,
)
from lag2fmu.description.symbols import Coordinate, Declared
from lag2fmu.description.values import require_text
from lag2fmu.errors import MechanismError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.language.units import DIMENSIONLESS, METRE, RADIAN
from lag2fmu.language.vocabulary import symbol, value_of


class Kind(NamedTuple):
    """What a kind of joint is.

    - ``equations``: the groups of constraints between two ends, see ``joint_equations``.
    - ``coordinates``: suffixes of the names of the coordinates of a joint on a parent, None if there is no such form.
    - ``keys``: the keys that describe it.
    - ``planar``: the groups of constraints in the plane, none if there is no such joint.
    """

    equations: tuple[str, ...]
    coordinates: tuple[str, ...] | None
    keys: tuple[str, ...]
    planar: tuple[str, ...] = ()


JOINTS = {
    "revolute": Kind(("point", "axis"), ("angle",), ("axis",), planar=("point",)),
    "prismatic": Kind(("line", "turn"), ("slide",), ("axis",), planar=("line", "turn")),
    "cylindrical": Kind(("line", "axis"), ("angle", "slide"), ("axis",)),
    "screw": Kind(("line", "axis", "thread"), ("angle",), ("axis", "pitch")),
    "planar": Kind(("plane", "axis"), ("x", "y", "angle"), ("axis",)),
    "spherical": Kind(("point",), ("e0", "e1", "e2", "e3"), ()),
    "universal": Kind(("point", "cross"), ("angle_1", "angle_2"), ("axis", "second_axis")),
    "fixed": Kind(("point", "turn"), (), (), planar=("point", "turn")),
    "rolling_disc": Kind(("contact",), None, ("axis", "second_axis", "radius"), planar=("contact",)),
    "rolling_sphere": Kind(("contact",), None, ("axis", "radius")),
    "gear": Kind(("ratio",), None, ("ratio",)),
}
"""The joints by name."""

_UNITS = {"slide": METRE, "x": METRE, "y": METRE, **dict.fromkeys(("e0", "e1", "e2", "e3"), DIMENSIONLESS)}
_KEYS = ("axis", "second_axis", "pitch", "radius", "ratio")
_SPATIAL = {("revolute", "axis"), ("rolling_disc", "second_axis")}


@dataclass(frozen=True)
class Joint:
    """A joint of one of the kinds ``JOINTS``, as constraints ``between`` two ends, or as a frame on a ``parent``.

    An end is a frame (its origin), a point or a body; "world" is a frame. The ``axis`` ("x", "y", "z" or 3 numbers) is
    fixed in the first end, ``second_axis`` in the second end, by default with the same numbers. The meaning of the axes
    depends on the kind:

    - revolute, cylindrical, screw: ``axis`` is the axis of rotation; prismatic: the direction; planar: the normal.
    - universal: ``axis`` is that of the first fork; ``second_axis``, across it, is that of the second fork.
    - rolling_disc, rolling_sphere: ``axis`` is the normal of the plane, out of it, through the first end. The second
      end is the centre, ``second_axis`` is the axis of the disc, and ``radius`` its radius (m).

    In the plane the kinds are revolute, prismatic, fixed, rolling_disc and gear. Ends are then bodies, points with an
    angle, and the "world". A planar disc turns about z, and has no ``second_axis``.

    Joints of the kinds prismatic and fixed keep the axes of both frames parallel. A screw advances by ``pitch`` (m) in
    a turn; a negative pitch is left-handed. A gear is between coordinates, or joints on a parent: the first coordinate
    is ``ratio`` times the second.

    With ``reactions`` there are the outputs NAME_force_x ... (N) and NAME_torque_x ... (N.m): force and torque of the
    joint on the second end, along the ``axes`` of the "world" or of the first end's "frame".

    On a ``parent`` the joint brings the frame NAME at ``origin`` (m) in the parent's axes, and its ``coordinates``,
    unless they are declared. By default these are called NAME_SUFFIX, with suffixes and order of the table ``JOINTS``.
    Raises MechanismError for keys that do not go together. Source: P. E. Nikravesh, Computer-Aided Analysis of
    Mechanical Systems, chapter 7.
    """

    name: str
    kind: str = key(tuple(JOINTS), "What joint it is.")
    between: Sequence[End | Frame | Joint] | None = key(
        "names",
        "Two frames, points or bodies; of a gear two coordinates, or joints that have one.",
        default=None,
    )
    parent: str | Frame | None = key(
        "part", "Instead of between: the frame it stands on; it carries the frame of its own name.", default=None
    )
    origin: Sequence[Expression] = key(
        "vector",
        "With parent: where the joint is, 3 entries in m, in the parent's axes.",
        default=(0, 0, 0),
        names=CONFIGURATION,
        unit=METRE,
    )
    axis: str | Sequence[Expression] | None = key(
        "axis", "Fixed in the first one: x, y, z or 3 numbers; of a plane its normal.", default=None, names=CONSTANT
    )
    second_axis: str | Sequence[Expression] | None = key(
        "axis", "Fixed in the second one; by default the same numbers.", default=None, names=CONSTANT
    )
    coordinates: Sequence[str | Declared] = key(
        "names", "With parent: the names of its coordinates; by default NAME_angle and the like.", default=()
    )
    pitch: Expression | None = key(
        "expression", "Of a screw, in m for a turn.", default=None, names=CONSTANT, unit=METRE
    )
    radius: Expression | None = key(
        "expression", "Of a disc or sphere that rolls, in m.", default=None, names=CONSTANT, unit=METRE
    )
    ratio: Expression | None = key(
        "expression", "Of a gear: the first coordinate over the second.", default=None, names=CONSTANT
    )
    reactions: bool = key(
        "flag", "true: the outputs NAME_force_x ... and NAME_torque_x ..., acting on the second.", default=False
    )
    axes: str = axes_key("Whose axes the reactions are along; frame: that of the first one.")
    declared: tuple[Coordinate, ...] = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        where = f"joints.{self.name}"
        require_text(self.kind, f"{where}.kind")
        if self.kind not in JOINTS:
            raise MechanismError(f"{where}.kind: '{self.kind}' is no joint; {suggestion(self.kind, JOINTS)}")
        coordinates = self.coordinates if isinstance(self.coordinates, Iterable) else ()
        declared = (q.declaration for q in coordinates if isinstance(q, Declared))
        object.__setattr__(self, "declared", tuple(q for q in declared if isinstance(q, Coordinate)))
        normalise(self, where)
        for name in ("axis", "second_axis"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _constant_axis(getattr(self, name), f"{where}.{name}"))
        self._check_form(where)
        self._check_beside(where)
        self._check_keys(where)
        if self.parent is not None:
            self._check_parent(where)

    def _check_form(self, where: str) -> None:
        """Raise MechanismError unless the joint has either two ends or a parent, and known axes."""
        if (self.between is None) == (self.parent is None):
            raise MechanismError(f"{where}: give either 'between', two ends, or 'parent', the frame it stands on")
        if self.between is not None and len(self.between) != 2:
            raise MechanismError(f"{where}.between: {len(self.between)} ends; name two frames, points or bodies")
        if self.axes not in (WORLD, "frame"):
            raise MechanismError(f"{where}.axes: '{self.axes}' is unknown; give 'world' or 'frame'")

    def _check_beside(self, where: str) -> None:
        """Raise MechanismError for keys of a joint between two ends in one on a parent, and the other way round."""
        if self.parent is not None and JOINTS[self.kind].coordinates is None:
            raise MechanismError(f"{where}.parent: '{self.kind}' carries no frame; give 'between' instead")
        if self.between is not None and (self.coordinates or any(self.origin)):
            unfit = "coordinates" if self.coordinates else "origin"
            raise MechanismError(f"{where}.{unfit}: goes with 'parent'; between two ends there are constraints only")
        if self.reactions and (self.parent is not None or self.kind == "gear"):
            instead = "close it by 'between'" if self.parent is not None else f"multiplier_{self.name} is the torque"
            raise MechanismError(f"{where}.reactions: this joint has none; {instead}")

    def _check_keys(self, where: str) -> None:
        """Raise MechanismError for keys that do not fit the kind.

        Some keys are needed in space only, which is checked when the ends are known.
        """
        known = JOINTS[self.kind].keys
        for name in _KEYS:
            twin = name == "second_axis" and self.between is not None and "axis" in JOINTS[self.kind].equations
            if getattr(self, name) is not None and name not in known and not twin:
                raise MechanismError(f"{where}.{name}: does not go with '{self.kind}'; leave it out")
            missing = getattr(self, name) is None and name in known
            later = (self.kind, name) in _SPATIAL and self.parent is None
            if missing and not later:
                raise MechanismError(f"{where}: '{name}' is missing")

    def _check_parent(self, where: str) -> None:
        suffixes = JOINTS[self.kind].coordinates or ()
        if self.coordinates and len(self.coordinates) != len(suffixes):
            listed = ", ".join(suffixes) or "none"
            raise MechanismError(f"{where}.coordinates: {len(self.coordinates)} names; '{self.kind}' has {listed}")
        if self.kind == "universal" and direction(self.axis).cross(direction(self.second_axis)).is_zero_matrix:
            raise MechanismError(f"{where}.second_axis: is parallel to the first one, {self.axis}; give one across it")

    # -------------------------------------------------------------------------------------------- as a frame

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """The names of the coordinates of the joint on a parent, as they are written or by default."""
        suffixes = JOINTS[self.kind].coordinates if self.parent is not None else None
        return tuple(map(str, self.coordinates)) or tuple(f"{self.name}_{suffix}" for suffix in suffixes or ())

    def own_coordinates(self) -> Iterator[Coordinate]:
        """The coordinates of the joint on a parent: as they were declared with it, or by default."""
        declared = {q.name: q for q in self.declared}
        for name, suffix in zip(self.coordinate_names, JOINTS[self.kind].coordinates or (), strict=False):
            default = Coordinate(
                name,
                _UNITS.get(suffix, RADIAN),
                start=float(suffix == "e0"),
                given=False
                if self.kind == "spherical"
                else None,  # the norm of the quaternion determines the first entry
                doc=f"{suffix.replace('_', ' ')} of the joint {self.name}",
            )
            yield declared.get(name, default)

    @property
    def frame(self) -> Frame:
        """The frame that the joint on a parent brings: its place (m) and turns (rad) by the joint's coordinates."""
        q = [symbol(name) for name in self.coordinate_names]
        if self.kind == "spherical":
            return Frame(self.name, str(self.parent), self.origin, quaternion=q)
        u, along = direction(self.axis), sp.zeros(3, 1)
        turns: list[tuple[str | Sequence[Expression], Expression]] = []
        if self.kind in ("revolute", "cylindrical", "screw", "planar"):
            turns = [(self.axis or "z", q[-1] if self.kind == "planar" else q[0])]
        elif self.kind == "universal":
            turns = [(self.axis or "z", q[0]), (self.second_axis or "z", q[1])]
        if self.kind in ("prismatic", "cylindrical"):
            along = u * q[-1]
        elif self.kind == "screw":
            along = u * self.pitch * q[0] / (2 * sp.pi)
        elif self.kind == "planar":
            first, second = across(self.axis)
            along = first * q[0] + second * q[1]
        return Frame(self.name, str(self.parent), tuple(sp.Matrix(self.origin) + along), turns)


# ------------------------------------------------------------------------------------------------------------- axes


def _constant_axis(axis: object, where: str) -> str | Vector:
    found = checked_axis(axis, where)
    if not isinstance(found, str) and not all(x.is_number for x in found):
        raise MechanismError(f"{where}: {list(found)} is not constant; give numbers, and let a frame do the turning")
    return found


def direction(axis: str | Sequence[Expression] | None) -> sp.Matrix:
    """The unit vector of an axis, (3, 1), given by its letter or 3 numbers of any length; z where there is none."""
    if axis is None or isinstance(axis, str):
        return sp.Matrix([int(letter == (axis or "z")) for letter in AXES])
    vector = sp.Matrix(axis)
    return vector / sp.sqrt(vector.dot(vector))


def across(axis: str | Sequence[Expression] | None) -> tuple[sp.Matrix, sp.Matrix]:
    """Two unit vectors (3, 1) that make a right-handed triple with the axis behind them; of z they are x and y."""
    if axis is None or isinstance(axis, str):
        k = AXES.index(axis or "z")
        return direction(AXES[(k + 1) % 3]), direction(AXES[(k + 2) % 3])
    u = direction(axis)
    least = min(range(3), key=lambda k: abs(value_of(u[k])))
    first = direction(tuple(u.cross(direction(AXES[least]))))
    return first, u.cross(first)
