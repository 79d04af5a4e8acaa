"""Sensors as outputs: expressions in coordinates and controls, or quantities of points and frames."""

from __future__ import annotations

from lag2fmu.description.outputs import QUANTITIES, Output
from lag2fmu.description.places import Frame, Point
from lag2fmu.formats.identifiers import identifier
from lag2fmu.formats.robots.lengths import length_of
from lag2fmu.formats.robots.parts import Parts
from lag2fmu.formats.robots.poses import JointPose
from lag2fmu.formats.robots.tree import Robot, Sensor
from lag2fmu.formats.robots.writing import numbers, turns_of


def measure(robot: Robot, parts: Parts) -> None:
    """Add the sensors of ``robot`` to ``parts``, which has all links and actuators already."""
    for sensor in robot.sensors:
        if sensor.place is not None:
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


def _at_place(sensor: Sensor, link: str, pose: JointPose, parts: Parts) -> None:
    """A point or a frame at a place of a link, and its quantity."""
    carrier, matrix, where = parts.carriers[link]
    whole = JointPose.of(where.origin + matrix @ pose.origin, matrix @ pose.matrix)
    suffixes = QUANTITIES[sensor.quantity][1]
    name = parts.names.variable(identifier(sensor.name), lambda x: (x, *(f"{x}_{suffix}" for suffix in suffixes)))
    place, doc = parts.names.entry("places", f"{name}_place"), f"sensor {sensor.name}"
    if sensor.quantity == "position":
        parts.points.append(Point(place, numbers(whole.origin), carrier))
        parts.outputs.append(Output(name, point=place, quantity=sensor.quantity, doc=doc))
        return
    parts.frames.append(Frame(place, carrier, numbers(whole.origin), turns_of(whole)))
    axes = "world" if sensor.quantity == "quaternion" else sensor.axes
    parts.outputs.append(Output(name, frame=place, quantity=sensor.quantity, axes=axes, doc=doc))
