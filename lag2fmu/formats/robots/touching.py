"""Contacts of a robot's shapes: points, spheres, ellipsoids and flat discs on planes, spheres and capsules in pairs.

A box touches a plane by its corners, a mesh by those of its hull, a capsule by the spheres at its ends. A cylinder
touches by the lowest point of each rim, on which it rolls, and stands on four points of each face; they are a hundredth
of the radius inside the rim, so that they do not touch while it rolls.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import product
from typing import Any

import numpy as np
import sympy as sp

from lag2fmu.description.events import Contact
from lag2fmu.description.names import of_unilateral
from lag2fmu.description.places import WORLD, Frame, Point
from lag2fmu.formats.identifiers import identifier
from lag2fmu.formats.robots.ground import Ground
from lag2fmu.formats.robots.parts import Parts, Touched
from lag2fmu.formats.robots.poses import Floats, JointPose
from lag2fmu.formats.robots.tree import Geom, Robot, Touch
from lag2fmu.formats.robots.writing import axis_of, number, numbers, turns_of

_INSIDE = 0.99
"""The radius of the points of a cylinder's faces by that of its rims."""
_SINKS, _DAMPING, _SLIP_SPEED = 1e-3, 0.5, 1e-3
"""A compliant contact: how deep the whole robot rests on one point (m), s/m, m/s."""


def touch(robot: Robot, parts: Parts, ground: Ground) -> None:
    """Add to ``parts``, which has all links already, the contacts of what touches in ``robot`` by ``ground``."""
    _Touching(robot, parts, ground).add()


class _Touching:
    def __init__(self, robot: Robot, parts: Parts, ground: Ground) -> None:
        self._robot, self._parts, self._ground = robot, parts, ground
        self._frictions: dict[float, sp.Expr] = {0.0: sp.S.Zero}
        self._planes: dict[tuple[str, float], str] = {}
        self._frames: dict[str, str] = {}

    def add(self) -> None:
        moving = [t for t in self._robot.touches if self._pose(t.first)[0] != self._pose(t.second)[0]]
        law = self._law() if moving else {}
        for touching in moving:
            keys = law | {"friction": self._friction(touching.friction)}
            if keys["friction"] == 0:
                keys.pop("slip_speed", None)
            made = self._on_plane if touching.second.kind == "plane" else self._on_each_other
            self._parts.contacts += made(touching, keys)

    def _law(self) -> dict[str, Any]:
        """The keys that all contacts share."""
        new = self._parts.parameter
        if self._ground.law == "compliant":
            weight = np.linalg.norm(self._robot.gravity) * sum(x.mass for x in self._robot.links.values() if x)
            stiffness = float(f"{(weight or 1.0) / _SINKS**1.5:.3g}")
            return {
                "law": "compliant",
                "stiffness": new("contact_stiffness", stiffness, "N/m^1.5"),
                "damping": new("contact_damping", _DAMPING, "s/m"),
                "slip_speed": new("contact_slip_speed", _SLIP_SPEED, "m/s"),
            }
        if not self._ground.restitution:
            return {}
        return {"restitution": new("contact_restitution", self._ground.restitution, "1")}

    def _friction(self, found: float) -> sp.Expr:
        """The parameter of a coefficient of friction, one for each value; what the file has without stays so."""
        value = found if self._ground.friction is None or not found else self._ground.friction
        if value not in self._frictions:
            self._frictions[value] = self._parts.parameter("contact_friction", value, "1")
        return self._frictions[value]

    def _pose(self, geom: Geom) -> tuple[str, JointPose, Floats]:
        """The frame that carries ``geom``, its pose there, and the matrix (3, 3) of its turns."""
        if not geom.link:
            return WORLD, geom.pose, geom.pose.matrix
        frame, matrix, place = self._parts.carriers[geom.link]
        turn = matrix @ geom.pose.matrix
        return frame, JointPose.of(place.origin + matrix @ geom.pose.origin, turn), turn

    def _point(self, geom: Geom, at: Sequence[float] | Floats, name: str) -> str:
        """A new point at a place (3,) of ``geom``, in its axes."""
        frame, pose, turn = self._pose(geom)
        made = self._parts.names.entry("places", name)
        self._parts.points.append(Point(made, numbers(pose.origin + turn @ np.array(at)), frame))
        return made

    def _frame(self, geom: Geom, at: Sequence[float], name: str) -> str:
        """A new frame at a place (3,) of ``geom``, along its axes."""
        frame, pose, turn = self._pose(geom)
        made = self._parts.names.entry("places", name)
        self._parts.frames.append(Frame(made, frame, numbers(pose.origin + turn @ np.array(at)), turns_of(pose)))
        return made

    def _contact(self, wanted: str, keys: dict[str, Any], **own: Any) -> Contact:
        return Contact(self._parts.names.entry("contacts", wanted, of_unilateral), **own, **keys)

    # ------------------------------------------------------------------------------------------------------- planes

    def _on_plane(self, touching: Touch, keys: dict[str, Any]) -> Iterator[Contact]:
        plane, normal = self._plane(touching.second, touching.margin)
        spots = list(_spots(touching.first))
        name = identifier(touching.first.name)
        for k, (kind, at, radius) in enumerate(spots, 1):
            label = f"{name}_{k}" if len(spots) > 1 else name
            place = partial(self._frame if kind == "ellipsoid_plane" else self._point, touching.first)(at, label)
            keys_of = {} if not radius else {"radius": number(radius[0]) if len(radius) == 1 else numbers(radius)}
            contact = self._contact(label, keys, kind=kind, between=(place, plane), normal=normal, **keys_of)
            self._told(contact, touching.first, at, max(radius, default=0.0), touching.second.name)
            yield contact

    def _plane(self, plane: Geom, margin: float) -> tuple[str, Any]:
        """A point of a ``plane``, raised by ``margin``, and its normal in the world."""
        _, pose, turn = self._pose(plane)
        normal, key = turn[:, 2], (plane.name, margin)
        if key not in self._planes:
            at = pose.origin + margin * normal
            through = abs(normal @ at) <= 1e-12 * np.linalg.norm(at)
            self._planes[key] = WORLD if through else self._point(plane, (0.0, 0.0, margin), identifier(plane.name))
        return self._planes[key], axis_of(np.array([float(x) for x in numbers(normal)]))

    # -------------------------------------------------------------------------------------------------------- pairs

    def _on_each_other(self, touching: Touch, keys: dict[str, Any]) -> Iterator[Contact]:
        pair = (touching.first, touching.second)
        own: dict[str, Any] = {"kind": "_".join(geom.kind for geom in pair)}
        own["between"] = tuple(self._centre(geom) for geom in pair)
        own["radius"] = (number(pair[0].size[0] + touching.margin), number(pair[1].size[0]))
        lengths = [number(2 * geom.size[1]) for geom in pair if geom.kind == "capsule"]
        if lengths:
            own["length"] = lengths[0] if len(lengths) == 1 else tuple(lengths)
        contact = self._contact("_".join(identifier(geom.name) for geom in pair), keys, **own)
        for geom in pair:
            self._told(contact, geom, (0.0, 0.0, 0.0), sum(geom.size), "")
        yield contact

    def _told(self, contact: Contact, geom: Geom, at: Any, radius: float, plane: str) -> None:
        """Note for sensors what of the link of ``geom`` touches a ``plane`` or other geom; ``at`` (3,) in its axes."""
        place = geom.pose.origin + geom.pose.matrix @ np.array(at)
        told = Touched(contact.name, place, radius, plane, ideal=contact.law == "ideal")
        self._parts.touched.setdefault(geom.link, []).append(told)

    def _centre(self, geom: Geom) -> str:
        """The frame of a capsule or the point of a sphere, one for all that it touches."""
        if geom.name not in self._frames:
            made = self._frame if geom.kind == "capsule" else self._point
            self._frames[geom.name] = made(geom, (0.0, 0.0, 0.0), f"{identifier(geom.name)}_centre")
        return self._frames[geom.name]


def _spots(geom: Geom) -> Iterator[tuple[str, Any, tuple[float, ...]]]:
    """(kind of contact, place (3,) in the axes of ``geom``, radii) of all that touches a plane."""
    radius, half = (*geom.size, 0.0, 0.0)[:2]
    if geom.kind == "sphere":
        yield "sphere_plane", (0.0, 0.0, 0.0), (radius,)
    elif geom.kind == "ellipsoid":
        yield "ellipsoid_plane", (0.0, 0.0, 0.0), geom.size
    elif geom.kind == "capsule":
        yield from (("sphere_plane", (0.0, 0.0, z), (radius,)) for z in (-half, half))
    elif geom.kind == "cylinder":
        yield from (("ellipsoid_plane", (0.0, 0.0, z), (radius, radius, 0.0)) for z in (-half, half))
        r = _INSIDE * radius
        inside = ((r, 0.0), (0.0, r), (-r, 0.0), (0.0, -r))
        yield from (("point_plane", (*xy, z), ()) for z in (-half, half) for xy in inside)
    else:
        corners = geom.vertices
        if corners is None:
            corners = np.array([*product((-1.0, 1.0), repeat=3)]) * geom.size
        yield from (("point_plane", at, ()) for at in corners)
