"""Sensors as outputs: expressions in coordinates and controls, or quantities of points, frames and bodies."""

from __future__ import annotations

from lag2fmu.description.outputs import QUANTITIES, Output
from lag2fmu.description.places import WORLD, Frame, Point
from lag2fmu.formats.identifiers import identifier
from lag2fmu.formats.robots.lengths import length_of
from lag2fmu.formats.robots.parts import Parts
from lag2fmu.formats.robots.poses import JointPose
from lag2fmu.formats.robots.tree import Robot, Sensor
from lag2fmu.formats.robots.writing import numbers, turns_of


def measure(robot: Robot, parts: Parts) -> None:
    """Add the sensors of ``robot`` to ``parts``, which has all links and actuators already."""
    for sensor in robot.sensors:
        if sensor.subtree:
            _of_subtree(sensor, robot, parts)
        elif sensor.place is not None:
            _at_place(sensor, *sensor.place, parts)
        elif sensor.along:
            _along(sensor, parts)
        elif sensor.actuator in parts.driven:
            expression = parts.driven[sensor.actuator][("length", "rate", "force").index(sensor.quantity)]
            name = parts.names.variable(identifier(sensor.name))
            parts.outputs.append(Output(name, expression, doc=f"sensor {sensor.name}"))
        else:
            parts.ignored.append(f"the sensor {sensor.name}")


def _along(sensor: Sensor, parts: Parts) -> None:
    """The length of joints, or its rate."""
    name = parts.names.variable(identifier(sensor.name))
    at, rate = length_of(sensor.along, name, parts)
    parts.outputs.append(Output(name, rate if sensor.quantity == "rate" else at, doc=f"sensor {sensor.name}"))


def _of_subtree(sensor: Sensor, robot: Robot, parts: Parts) -> None:
    """A sum over the bodies of a link and all that it carries, or what holds them where the link has its joint.

    Nothing is made of a sensor if some of the bodies do not move at all, or if contacts or closed loops hold them too.
    """
    carried = _carried(robot, sensor.subtree)
    bodies = tuple(dict.fromkeys(parts.bodies[link] for link in carried if robot.links[link] is not None))
    others = [{touch.first.link, touch.second.link} for touch in robot.touches]
    others += [{closure.first[0], closure.second[0]} for closure in robot.closures]
    if not bodies or WORLD in bodies or (sensor.place and any(len(ends & carried) == 1 for ends in others)):
        parts.ignored.append(f"the sensor {sensor.name}")
        return
    if sensor.place is None:
        name = _named(sensor, parts)
        parts.outputs.append(Output(name, bodies=bodies, quantity=sensor.quantity, doc=f"sensor {sensor.name}"))
    else:
        _at_place(sensor, *sensor.place, parts, bodies)


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
    axes = "world" if sensor.quantity == "quaternion" else sensor.axes
    parts.outputs.append(Output(name, frame=place, bodies=bodies, quantity=sensor.quantity, axes=axes, doc=doc))
