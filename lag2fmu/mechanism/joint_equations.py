"""Joints between two ends as constraints, chosen such that the multipliers are forces and torques of the joint.

A constraint has the rate F.(v_b - v_a) + T.(omega_b - omega_a), with the velocities of both bodies at the joint. Its
multiplier times F is the force on the second body, its multiplier times T is the torque. The first body gets the
opposite force and torque.

Source: P. E. Nikravesh, Computer-Aided Analysis of Mechanical Systems, chapter 7 (dot products of vectors fixed in two
bodies); rolling: J. I. Neimark, N. A. Fufaev, Dynamics of Nonholonomic Systems, AMS 1972, chapter I.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.joints import JOINTS, Joint, across, direction
from lag2fmu.description.names import multiplier
from lag2fmu.description.outputs import Output
from lag2fmu.description.parts import Constraint
from lag2fmu.description.places import AXES, WORLD
from lag2fmu.errors import MechanismError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.language.units import NEWTON, TORQUE
from lag2fmu.language.vocabulary import symbol, value_of
from lag2fmu.mechanism.geometry import values_of
from lag2fmu.mechanism.norms import vanishes
from lag2fmu.mechanism.planar_joints import angle_of, groups_of, turn_alike
from lag2fmu.mechanism.poses import Pose, Poses, location_of, poses_of

_NOTHING = sp.zeros(3, 1)


class Equation(NamedTuple):
    """``expression`` = 0, and the force F and torque T of a unit multiplier, (3, 1) each, in the axes of the base.

    ``suffix`` ends the name of the constraint; ``kind`` is that of a Constraint.
    """

    suffix: str
    expression: sp.Expr
    force: sp.Matrix = _NOTHING
    torque: sp.Matrix = _NOTHING
    kind: str = "holonomic"


class Side(NamedTuple):
    """One of the two ends of a joint: its frame, its place on this frame, and the pose of the frame in the base."""

    name: str
    frame: str
    place: sp.Matrix
    pose: Pose

    @property
    def position(self) -> sp.Matrix:
        """The place of the end (3, 1), in m, in the axes of the base."""
        return self.pose.at(self.place)


def written_out(m: Description) -> Iterator[tuple[Joint, list[Constraint], list[Output]]]:
    """Every joint of ``m`` between two ends, with its constraints and its reactions as outputs.

    Equations that hold for all values of the coordinates are left out: frames that only turn about z, for example, meet
    the equations along z by themselves. The geometry of ``m`` has been checked. Raises MechanismError for ends and
    values that do not fit. Source: P. E. Nikravesh, Computer-Aided Analysis of Mechanical Systems, chapter 7.
    """
    closing = [joint for joint in m.joints if joint.between is not None]
    if not closing:
        return
    poses, values = poses_of(m), values_of(m)
    for joint in closing:
        _check_values(joint, values)
        if joint.kind == "gear":
            yield joint, [_ratio(m, joint)], []
            continue
        between = _Between(m, joint, poses)
        equations = list(between.equations())
        needed = [e for e in equations if not vanishes(e.expression)]
        if joint.reactions:
            _refuse_unknown(joint, equations, needed)
        reactions = list(between.reactions(equations)) if joint.reactions else []
        yield joint, [Constraint(_named(joint, e), e.expression, e.kind) for e in needed], reactions


def _named(joint: Joint, equation: Equation) -> str:
    return f"{joint.name}_{equation.suffix}"


def _check_values(joint: Joint, values: Mapping[str, float]) -> None:
    """Raise MechanismError if, at the parameters' values, a radius is not positive, or a pitch or ratio is zero."""
    for key in ("radius", "pitch", "ratio"):
        expression = getattr(joint, key)
        if expression is None:
            continue
        try:
            value = value_of(expression, values)
        except (KeyError, ValueError, ArithmeticError):
            continue  # the check of names reports an unknown name
        if value == 0 or (key == "radius" and value < 0):
            wanted = "a positive length" if key == "radius" else "a number that is not zero"
            raise MechanismError(f"joints.{joint.name}.{key}: '{expression}' is {value!r}; give {wanted}")


# ------------------------------------------------------------------------------------------------------------- ends


class _Between:
    """The equations of one joint between two ends."""

    def __init__(self, m: Description, joint: Joint, poses: Poses) -> None:
        self.m, self.joint, self.poses = m, joint, poses
        name_a, name_b = map(str, joint.between or ())
        where = f"joints.{joint.name}.between"
        (frame_a, place_a), (frame_b, place_b) = (location_of(m, name, where) for name in (name_a, name_b))
        self.planar = m.dimension == 2
        self.groups = groups_of(m, joint) if self.planar else JOINTS[joint.kind].equations
        self._check_keys()
        if frame_a == frame_b:
            self._check_apart(frame_a, same_place=place_a == place_b)
        self.base = poses.common(frame_a, frame_b)
        self.a, self.b = self._end(name_a, frame_a, place_a), self._end(name_b, frame_b, place_b)
        self.apart = self.b.position - self.a.position
        twin = joint.axis if joint.second_axis is None else joint.second_axis
        normals = [n for n in across(joint.axis) if n[2] == 0 or not self.planar]
        self.normals = [self.a.pose.rotation * n for n in normals]
        self.u, self.s = self.a.pose.rotation * direction(joint.axis), self.b.pose.rotation * direction(twin)
        self.twin_normal = self.b.pose.rotation * across(twin)[0]

    def _check_keys(self) -> None:
        """Raise MechanismError for a key that is missing in space."""
        missing = [key for key in JOINTS[self.joint.kind].keys if getattr(self.joint, key) is None]
        if not self.planar and missing:
            raise MechanismError(f"joints.{self.joint.name}: '{missing[0]}' is missing")

    def _check_apart(self, frame: str, same_place: bool) -> None:
        """Raise MechanismError unless the ends, which are both on ``frame``, can move relative to each other."""
        a, b = map(str, self.joint.between or ())
        free = self.joint.kind == "spherical" or (self.planar and a != b)
        same = same_place and (not self.planar or turn_alike(self.m, self.joint))
        if same or not free or frame != WORLD:
            both = f"are both on '{frame}'" if a != b else "are the same"
            raise MechanismError(
                f"joints.{self.joint.name}.between: '{a}' and '{b}' {both}; name two that move differently"
            )

    def _end(self, name: str, frame: str, place: tuple[sp.Expr, ...]) -> Side:
        column = self.poses.column(place)
        if self.planar:
            return Side(name, frame, _NOTHING, self.poses.planar(column, angle_of(self.m, name) or sp.S.Zero))
        return Side(name, frame, column, self.poses.pose(frame, self.base))

    def equations(self) -> Iterator[Equation]:
        """All equations of the joint, also those that hold for all values of the coordinates."""
        for group in self.groups:
            yield from getattr(self, f"_{group}")()

    def _point(self) -> Iterator[Equation]:
        """The equations of a point: the two places coincide."""
        for k, letter in enumerate(AXES[: self.m.dimension]):
            yield Equation(letter, self.apart[k], sp.Matrix(sp.eye(3)[:, k]))

    def _line(self) -> Iterator[Equation]:
        """The second place is on the axis."""
        for k, n in enumerate(self.normals, 1):
            yield Equation(f"across_{k}", n.dot(self.apart), n)

    def _plane(self) -> Iterator[Equation]:
        yield Equation("normal", self.u.dot(self.apart), self.u)

    def _axis(self) -> Iterator[Equation]:
        """The axes are parallel."""
        for k, n in enumerate(self.normals, 1):
            yield Equation(f"axis_{k}", n.dot(self.s), torque=self.s.cross(n))

    def _turn(self) -> Iterator[Equation]:
        """The axes of both frames are parallel."""
        for k in range(1 if self.planar else 3):
            x, y = self.a.pose.rotation[:, k], self.b.pose.rotation[:, (k + 1) % 3]
            yield Equation(f"turn_{AXES[(k + 2) % 3]}", x.dot(y), torque=y.cross(x))

    def _cross(self) -> Iterator[Equation]:
        """The axes are perpendicular."""
        yield Equation("cross", self.u.dot(self.s), torque=self.s.cross(self.u))

    def _thread(self) -> Iterator[Equation]:
        """sin(2 pi way/pitch - angle) = 0, which has no jump after any number of turns."""
        n, k = self.twin_normal, 2 * sp.pi / self.joint.pitch
        cosine, sine = self.normals[0].dot(n), self.normals[1].dot(n)
        way = k * self.u.dot(self.apart)
        slope = sp.cos(way) * cosine + sp.sin(way) * sine  # 1 or -1: the slope of the sine at its zeros
        yield Equation("thread", sp.sin(way) * cosine - sp.cos(way) * sine, k * slope * self.u, -slope * self.u)

    def _contact(self) -> Iterator[Equation]:
        """The lowest point of the disc or sphere is in the plane and has the plane's velocity there."""
        down = -self.u
        if self.joint.kind == "rolling_disc" and not self.planar:
            inside = self.u - self.u.dot(self.s) * self.s
            down = -inside / sp.sqrt(inside.dot(inside))
        arm, (a, b) = self.joint.radius * down, (self.a.pose.angular, self.b.pose.angular)
        yield Equation("normal", self.u.dot(self.apart + arm), self.u)
        centre, foot = (end.position.applyfunc(self.poses.rate) for end in (self.b, self.a))
        slip = centre + b.cross(arm) - foot - a.cross(self.apart + arm)
        for k, t in enumerate(self.normals, 1):
            yield Equation(f"slip_{k}", t.dot(slip), t, kind="nonholonomic")

    def reactions(self, equations: list[Equation]) -> Iterator[Output]:
        """Force and torque on the second end, where the joint bears any."""
        joint, base = self.joint, self.base
        along = self.a.pose.rotation.T if joint.axes == "frame" else self.poses.pose(base, WORLD).rotation
        for what, unit, vectors in (
            ("force", NEWTON, [e.force for e in equations]),
            ("torque", TORQUE, [e.torque for e in equations]),
        ):
            if all(vector.is_zero_matrix for vector in vectors):
                continue
            total = sp.zeros(3, 1)
            for e, vector in zip(equations, vectors, strict=True):
                total += symbol(multiplier(_named(joint, e))) * vector
            kept = slice(0, self.m.dimension) if what == "force" or not self.planar else slice(2, 3)
            for letter, entry in zip(AXES[kept], list(along * total)[kept], strict=True):
                doc = f"{what} of the joint {joint.name} on {self.b.name}, along {letter}"
                yield Output(f"{joint.name}_{what}_{letter}", entry, unit, doc)


def _ratio(m: Description, joint: Joint) -> Constraint:
    """The constraint that the first coordinate is ``ratio`` times the second."""
    coordinates = [*(q.name for q in m.coordinates), *m.driven]
    carrying = {other.name: other.coordinate_names for other in m.joints if other.coordinate_names}
    found = []
    for end in map(str, joint.between or ()):
        name = end if end in coordinates else carrying[end][0] if end in carrying else None
        if name is None:
            remedy = suggestion(end, [*coordinates, *carrying])
            raise MechanismError(
                f"joints.{joint.name}.between: '{end}' is no coordinate, nor a joint with one; {remedy}"
            )
        found.append(symbol(name))
    if found[0] == found[1]:
        raise MechanismError(f"joints.{joint.name}.between: both are the coordinate '{found[0]}'; name two")
    return Constraint(joint.name, found[0] - joint.ratio * found[1])


def _refuse_unknown(joint: Joint, equations: list[Equation], needed: list[Equation]) -> None:
    """Raise MechanismError for a reaction that is undetermined: an equation that always holds has no multiplier."""
    for e in equations:
        if e not in needed:
            left = ", ".join(multiplier(_named(joint, other)) for other in needed) or "nothing"
            raise MechanismError(
                f"joints.{joint.name}.reactions: the coordinates meet '{e.suffix}' by themselves, so that what acts "
                f"there is unknown; read {left}, or describe the bodies with more coordinates"
            )
