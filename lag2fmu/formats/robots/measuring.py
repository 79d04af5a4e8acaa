"""Sensors as outputs: expressions in coordinates and controls, or quantities of points, frames and bodies."""

from __future__ import annotations

import numpy as np
import sympy as sp

from lag2fmu.description.names import force
from lag2fmu.description.outputs import QUANTITIES, Output
from lag2fmu.description.places import Frame, Point
from lag2fmu.formats.identifiers import identifier
from lag2fmu.formats.robots.lengths import length_of
from lag2fmu.formats.robots.parts import Parts, Touched
from lag2fmu.formats.robots.poses import JointPose
from lag2fmu.formats.robots.tree import Geom, Robot, Sensor, Span, Sum, Wrench
from lag2fmu.formats.robots.writing import numbers, turns_of
from lag2fmu.language.units import NEWTON
from lag2fmu.language.vocabulary import symbol

ROUNDING = 1e-9
"""A zone as large as the shape in it holds it: files round to some digits."""


def measure(robot: Robot, parts: Parts) -> None:
    """Add the sensors of ``robot`` to ``parts``, which has all links and actuators already."""
    for sensor in robot.sensors:
        if sensor.subtree:
            _of_subtree(sensor, robot, parts)
        elif sensor.zone is not None:
            _of_touch(sensor, sensor.zone, parts)
        elif sensor.place is not None:
            _at_place(sensor, *sensor.place, parts)
        elif sensor.quantity == "force" and isinstance(sensor.along, tuple) and sensor.along:
            _driven(sensor, sensor.along, robot, parts)
        elif sensor.along:
            _along(sensor, parts)
        elif sensor.actuator in parts.driven:
            expression = parts.driven[sensor.actuator][("length", "rate", "force").index(sensor.quantity)]
            name = parts.names.variable(identifier(sensor.name))
            parts.outputs.append(Output(name, expression, doc=f"sensor {sensor.name}"))
        else:
            parts.ignored.append(f"the sensor {sensor.name}: its actuator acts between places, or is not taken")
    still = [s.name for s in robot.sensors if s.zone is not None and not parts.touched.get(s.zone.link)]
    if still:
        parts.ignored.append(f"the touch told by {', '.join(still)}: it is 0, as no contact of their bodies is taken")


def _driven(sensor: Sensor, along: Sum, robot: Robot, parts: Parts) -> None:
    """The sum of the actuators' forces along a joint, within its limits."""
    if any(isinstance(actuator.along, (Wrench, Span)) for actuator in robot.actuators):
        parts.ignored.append(f"the sensor {sensor.name}: some actuators act between sites")
        return
    ((joint, _),) = along
    name = parts.names.variable(identifier(sensor.name))
    total = parts.forces.get(parts.joints[joint], sp.S.Zero)
    parts.outputs.append(Output(name, total, doc=f"sensor {sensor.name}"))


def _along(sensor: Sensor, parts: Parts) -> None:
    """The length of joints, or its rate."""
    name = parts.names.variable(identifier(sensor.name))
    at, rate = length_of(sensor.along, name, parts)
    parts.outputs.append(Output(name, rate if sensor.quantity == "rate" else at, doc=f"sensor {sensor.name}"))


def _of_subtree(sensor: Sensor, robot: Robot, parts: Parts) -> None:
    """A sum over the bodies of a link and all that it carries, or what holds them where the link has its joint.

    Nothing is made of a sensor if the bodies have no mass, or if contacts, closed loops or spatial tendons hold them
    too.
    """
    carried = _carried(robot, sensor.subtree)
    bodies = tuple(dict.fromkeys(parts.bodies[link] for link in carried if robot.links[link] is not None))
    if sensor.place and (others := _others_that_hold(robot, carried)):
        parts.ignored.append(f"the sensor {sensor.name}: {others} hold its bodies, too")
        return
    if not bodies:
        parts.ignored.append(f"the sensor {sensor.name}: its bodies have no mass")
        return
    if sensor.place is None:
        name = _named(sensor, parts)
        parts.outputs.append(Output(name, bodies=bodies, quantity=sensor.quantity, doc=f"sensor {sensor.name}"))
    else:
        _at_place(sensor, *sensor.place, parts, bodies)


def _others_that_hold(robot: Robot, carried: set[str]) -> str:
    """What holds the links that are ``carried`` beside their joint, "" if nothing does.

    What spatial tendons exert is no part of MuJoCo's sensors since version 4, and was one before.
    """
    pairs = [{touch.first.link, touch.second.link} for touch in robot.touches]
    pairs += [{closure.first[0], closure.second[0]} for closure in robot.closures]
    if any(len(ends & carried) == 1 for ends in pairs):
        return "contacts and loops"
    lengths = [tendon.length for tendon in robot.tendons if tendon.acts] + [a.along for a in robot.actuators]
    across = [{link in carried for link, _ in x.spots} for x in lengths if isinstance(x, Span)]
    return "spatial tendons" if any(len(sides) > 1 for sides in across) else ""


def _of_touch(sensor: Sensor, zone: Geom, parts: Parts) -> None:
    """The sum of the normal forces of the contacts of a link in a ``zone``: 0 for a link that touches nothing.

    Nothing is made of a sensor where the motion decides whether a contact is in the zone, or a contact is compliant.
    """
    touched = parts.touched.get(zone.link, [])
    inside = [x for x in touched if x.ideal and _holds(zone, x)]
    if not all(x in inside or any(_is_apart(zone, x, y) for y in inside) for x in touched):
        why = (
            "the motion decides which contacts are in its site" if inside else "no ideal contact is always in its site"
        )
        parts.ignored.append(f"the sensor {sensor.name}: {why}")
        return
    total = sp.Add(*(symbol(force(x.contact)) for x in inside))
    name = parts.names.variable(identifier(sensor.name))
    parts.outputs.append(Output(name, total, NEWTON, doc=f"sensor {sensor.name}"))


def _holds(zone: Geom, touched: Touched) -> bool:
    """Whether the whole ball of what is ``touched`` is in the ``zone``."""
    x, (radius, *more) = zone.pose.matrix.T @ (touched.place - zone.pose.origin), zone.size
    reach = touched.radius * (1.0 - ROUNDING)
    if zone.kind == "box":
        return bool((np.abs(x) + reach <= np.array(zone.size) * (1.0 + ROUNDING)).all())
    if zone.kind == "ellipsoid":  # of it the ball that is as near to its surface everywhere
        return bool(np.linalg.norm(x / np.array(zone.size)) + reach / min(zone.size) <= 1.0)
    if zone.kind == "cylinder":
        return bool(np.hypot(x[0], x[1]) + reach <= radius and abs(x[2]) + reach <= more[0])
    along = np.clip(x[2], -more[0], more[0]) if zone.kind == "capsule" else 0.0
    return bool(np.linalg.norm(x - [0.0, 0.0, along]) + reach <= radius)


def _is_apart(zone: Geom, touched: Touched, inside: Touched) -> bool:
    """Whether a contact is never counted by a sensor of the ``zone``, in which another ball is ``inside``.

    MuJoCo counts contacts from which a ray along the normal, out of the link, meets the zone. On a plane the ray goes
    down below it. Neither ball, of radii r and R, is below the plane, and the zone goes no farther from the centre of
    the latter than Z. So the ray cannot meet it if the centres are farther apart than D with D^2 + 2 r R - r^2 = Z^2.
    """
    if not touched.plane or touched.plane != inside.plane:
        return False
    halves = zone.size if zone.kind in ("box", "ellipsoid") else (sum(zone.size),)
    farthest = float(np.linalg.norm(inside.place - zone.pose.origin)) + float(np.linalg.norm(halves))
    apart, r = float(np.linalg.norm(touched.place - inside.place)), touched.radius
    return apart**2 + 2 * r * inside.radius - r**2 > farthest**2


def _carried(robot: Robot, link: str) -> set[str]:
    """The ``link`` and all that it carries."""
    found = {link}
    for joint in robot.joints:  # parents first
        if joint.parent in found:
            found.add(joint.child)
    return found


def _named(sensor: Sensor, parts: Parts) -> str:
    """A free name for the output of a ``sensor`` with several entries."""
    suffixes = QUANTITIES[sensor.quantity][1]
    return parts.names.variable(identifier(sensor.name), lambda x: (x, *(f"{x}_{suffix}" for suffix in suffixes)))


def _at_place(sensor: Sensor, link: str, pose: JointPose, parts: Parts, bodies: tuple[str, ...] | None = None) -> None:
    """A point or a frame at a place of a link, and its quantity, or that of ``bodies`` there."""
    carrier, matrix, where = parts.carriers[link]
    whole = JointPose.of(where.origin + matrix @ pose.origin, matrix @ pose.matrix)
    name = _named(sensor, parts)
    place, doc = parts.names.entry("places", f"{name}_place"), f"sensor {sensor.name}"
    if sensor.quantity == "position":
        parts.points.append(Point(place, numbers(whole.origin), carrier))
        parts.outputs.append(Output(name, point=place, quantity=sensor.quantity, doc=doc))
        return
    parts.frames.append(Frame(place, carrier, numbers(whole.origin), turns_of(whole)))
    axes = sensor.axes
    parts.outputs.append(Output(name, frame=place, bodies=bodies, quantity=sensor.quantity, axes=axes, doc=doc))
