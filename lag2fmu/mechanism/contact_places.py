"""Contacts between places as a gap and slip velocities: points, discs and spheres on lines, planes and one another.

The first end touches, the second end is touched. With the vector d from the second to the first, the normal n out of
the second, and the radii r1, r2, the gap is n.d - r1 on a line or plane, and |d| - r1 - r2 on a disc or sphere. That of
an ellipsoid on a plane is n.d - h(n) with its support function h(n) = |(r1 n1, r2 n2, r3 n3)|. The spheres of capsules
stand on their axes where these are nearest to each other. A slip is a relative velocity along a tangent: that of the
first end's material point at the contact, less that of the second end's.

Source: F. Pfeiffer, Ch. Glocker, Multibody Dynamics with Unilateral Contacts, chapter 4; the tangents to a normal that
moves: T. Duff et al., Building an Orthonormal Basis, Revisited, J. Computer Graphics Techniques 6 (2017); the nearest
points of two axes: C. Ericson, Real-Time Collision Detection, section 5.1.9.
"""

from __future__ import annotations

from typing import NamedTuple

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.events import CONTACTS, Contact
from lag2fmu.description.joints import across, direction
from lag2fmu.errors import MechanismError
from lag2fmu.language.rebuilding import call
from lag2fmu.language.vocabulary import Choice, Smooth
from lag2fmu.mechanism.planar_joints import angle_of
from lag2fmu.mechanism.poses import Pose, Poses, crossed, location_of, times

_OF_ELLIPSOID = 3
_FLAT = sp.Rational(1, 10**6)
"""rad; the tilt below which a flat disc has no lowest point. Its gap is wrong by less than this times its radius, the
lowest point by 2 (this / tilt)^2 times its radius: 2e-4 of it at 1e-4, 2e-6 at 1e-3."""
_PARALLEL = sp.Rational(1, 10**12)
"""The square of the sine of an angle below which two axes are parallel."""


class Geometry(NamedTuple):
    """A ``gap`` (m, rad) and 0, 1 or 2 ``slips`` (m/s, rad/s) as expressions; definitions may be written out."""

    gap: sp.Expr
    slips: tuple[sp.Expr, ...]


def geometry_of(m: Description, contact: Contact, poses: Poses) -> Geometry:
    """Gap and slips of ``contact``, which has been checked, as they are written or as they follow from its places.

    Raises MechanismError for places that do not move relative to each other, and for one without an angle that the
    contact needs. Source: F. Pfeiffer, Ch. Glocker, Multibody Dynamics with Unilateral Contacts, chapter 4.
    """
    if contact.kind is None:
        slip = () if contact.slip is None else contact.slip if isinstance(contact.slip, tuple) else (contact.slip,)
        return Geometry(sp.sympify(contact.gap), slip)
    a, b, apart = _ends(m, contact, poses)
    first, second = radii_of(contact)
    if CONTACTS[contact.kind].normal:
        normal, tangents = _fixed(contact, b, m.dimension == 2)
        height, reach = first, first * normal
        if CONTACTS[contact.kind].radii == _OF_ELLIPSOID:
            height, reach = _of_ellipsoid(contact, a, normal)
        gap = times(normal.T, apart)[0] - height
        on_first, on_second = -reach, apart - reach
    else:
        along_a, along_b = _along_axes(contact, a, b, apart)
        apart += along_a - along_b
        distance = sp.sqrt(apart.dot(apart))
        normal = apart / distance
        tangents = [_along_line(normal)] if m.dimension == 2 else _tangents(normal)
        gap = distance - first - second
        on_first, on_second = along_a - first * normal, along_b + second * normal
    if contact.frictionless:
        return Geometry(gap, ())
    slip = a.velocity + crossed(a.angular, on_first) - b.velocity - crossed(b.angular, on_second)
    slips = (times(t.T, slip)[0] for t in tangents)
    return Geometry(gap, tuple(x for x in slips if x != 0))  # robots that move in a plane have one of two


def _of_ellipsoid(contact: Contact, first: Pose, normal: sp.Matrix) -> tuple[sp.Expr, sp.Matrix]:
    """How high the ellipsoid of ``first`` reaches against its ``normal`` (3, 1), and from where, (3, 1), both in m.

    With w = R' n and S = |r w|^2 these are h = sqrt(S) and its gradient by w. A flat disc that lies on the plane has no
    lowest point: its h is S / sqrt(S + f^2), so that the point goes over into the centre on the scale f of angles.
    """
    radii = sp.diag(*(sp.sympify(r) for r in contact.radius or ()))  # type: ignore[union-attr]
    own = times(radii, times(first.rotation.T, normal))
    square = times(own.T, own)[0]
    height = sp.sqrt(square)
    slope = 1 / height
    if any(radii[k, k] == 0 for k in range(3)):
        flat = (_FLAT * radii.trace()) ** 2
        height = square / sp.sqrt(square + flat)
        slope = (square + 2 * flat) / (square + flat) ** sp.Rational(3, 2)
    return height, slope * times(first.rotation, times(radii, own))


def _along_axes(contact: Contact, a: Pose, b: Pose, apart: sp.Matrix) -> tuple[sp.Matrix, sp.Matrix]:
    """From the centre of each end to where its axis is nearest to the other end, (3, 1) in m; 0 without an axis.

    Source: Ericson, section 5.1.9, with unit vectors along the axes.
    """
    lengths = contact.length if isinstance(contact.length, tuple) else (contact.length,)
    if contact.length is None:
        return sp.zeros(3, 1), sp.zeros(3, 1)
    u, v = a.rotation[:, 2], b.rotation[:, 2]
    half = sp.sympify(lengths[0]) / 2
    if len(lengths) == 1:
        return _within(-u.dot(apart), half) * u, sp.zeros(3, 1)
    other, c = sp.sympify(lengths[1]) / 2, u.dot(v)
    on_a, on_b = u.dot(apart), v.dot(apart)
    s = _within((c * on_b - on_a) / (1 - c**2 + _PARALLEL), half)
    t = _within(c * s + on_b, other)
    return _within(c * t - on_a, half) * u, t * v


def _within(x: sp.Expr, most: sp.Expr) -> sp.Expr:
    """``x`` from -most to most; gaps have no kink where it gets there."""
    return Smooth(call(sp.Max, -most, call(sp.Min, most, x)))


def _ends(m: Description, contact: Contact, poses: Poses) -> tuple[Pose, Pose, sp.Matrix]:
    """The poses of both ends, with the places as origins, and the vector from the second place to the first."""
    where = f"contacts.{contact.name}.between"
    name_a, name_b = map(str, contact.between or ())
    (frame_a, place_a), (frame_b, place_b) = (location_of(m, name, where) for name in (name_a, name_b))
    rates = map(poses.rate, poses.column(place_a) - poses.column(place_b))
    rigid = m.dimension == 3 and frame_a == frame_b and not any(rates)
    if name_a == name_b or rigid or place_a == place_b == ():
        raise MechanismError(f"{where}: '{name_a}' and '{name_b}' do not move relative to each other; name two that do")
    if m.dimension == 2:
        _check_angles(m, contact, where)
        a, b = (
            poses.planar(poses.column(place), angle_of(m, name) or sp.S.Zero)
            for name, place in ((name_a, place_a), (name_b, place_b))
        )
    else:
        base = poses.common(frame_a, frame_b)
        a, b = (_pose(poses, frame, place, base) for frame, place in ((frame_a, place_a), (frame_b, place_b)))
    return a, b, a.origin - b.origin


def _pose(poses: Poses, frame: str, place: tuple[sp.Expr, ...], base: str) -> Pose:
    pose, own = poses.pose(frame, base), poses.column(place)
    velocity, own_velocity = pose.moved(own), own.applyfunc(poses.rate)
    if any(own_velocity):
        velocity += times(pose.rotation, own_velocity)
    return pose._replace(origin=pose.at(own), velocity=velocity)


def _check_angles(m: Description, contact: Contact, where: str) -> None:
    """Raise MechanismError for an end whose angle is needed and not given: of a line, and with friction of a disc.

    A particle needs no angle, because it does not turn.
    """
    particles = {part.name for part in m.bodies if part.angle is None}
    first, second = map(str, contact.between or ())
    on_line = CONTACTS[str(contact.kind)].normal
    turning = [second] if on_line else []
    if not contact.frictionless:
        radius_a, radius_b = radii_of(contact)
        turning += [name for name, radius in ((first, radius_a), (second, radius_b)) if radius != 0]
    for name in turning:
        if angle_of(m, name) is None and name not in particles:
            raise MechanismError(f"{where}: '{name}' has no 'angle', which '{contact.kind}' needs; give it, or 0")


def radii_of(contact: Contact) -> tuple[sp.Expr, sp.Expr]:
    """The radii (m) of the first and the second end of a contact with a kind, 0 for an end without one.

    Those of an ellipsoid are three, of which the first two are given.
    """
    radius = contact.radius
    if isinstance(radius, tuple):
        return (radius[0], radius[1]) if len(radius) == 2 else (radius[0], sp.S.Zero)
    one = sp.S.Zero if radius is None else sp.sympify(radius)
    return (sp.S.Zero, one) if str(contact.kind).startswith("point_") else (one, sp.S.Zero)


def _fixed(contact: Contact, second: Pose, planar: bool) -> tuple[sp.Matrix, list[sp.Matrix]]:
    """The normal that is fixed in the ``second`` end, and the tangents to it."""
    axis = contact.normal
    vector = direction(axis) if isinstance(axis, str) else sp.Matrix(axis)
    normal = vector / sp.sqrt(sp.trigsimp(vector.dot(vector)))
    in_space = _tangents if vector.free_symbols else lambda _: across(axis)
    tangents = [_along_line(normal)] if planar else list(in_space(normal))
    return times(second.rotation, normal), [times(second.rotation, tangent) for tangent in tangents]


def _along_line(normal: sp.Matrix) -> sp.Matrix:
    """The tangent in the plane: x for the normal y."""
    return sp.Matrix([normal[1], -normal[0], 0])


def _tangents(normal: sp.Matrix) -> list[sp.Matrix]:
    """Two unit vectors (3, 1) that, with ``normal`` as the third, are right-handed; no direction is singular.

    Source: T. Duff et al., J. Computer Graphics Techniques 6 (2017).
    """
    x, y, z = normal
    side = Choice(z, sp.S.One, sp.S.NegativeOne)
    a = -1 / (side + z)
    return [
        sp.Matrix([1 + side * x**2 * a, side * x * y * a, -side * x]),
        sp.Matrix([x * y * a, side + y**2 * a, -y]),
    ]
