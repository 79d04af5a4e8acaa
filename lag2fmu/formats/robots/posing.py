"""The pose in which a robot starts: values of its joints, in the place of those in its file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from lag2fmu.errors import LoadError
from lag2fmu.formats.robots.tree import Robot, RobotJoint
from lag2fmu.language.identifiers import suggestion

_ONE = ("revolute", "prismatic")


def posed(robot: Robot, pose: Mapping[str, object] | str, source: str) -> Robot:
    """``robot`` with its joints started at the ``pose``: {joint: rad or m}, or the same as text, JOINT=VALUE,...

    Raises LoadError for an unknown joint, one that has no coordinate of its own, and a value that is no number or
    beyond the limits of its joint.
    """
    if not isinstance(pose, (Mapping, str)):
        raise LoadError(f"{source}: pose = {pose!r}; give {{joint: rad or m}}, or a text as 'knee=0.8,hip=-0.4'")
    given = dict(pose) if isinstance(pose, Mapping) else _pairs(pose, source)
    if not given:
        return robot
    known = {joint.name: joint for joint in robot.joints if joint.kind in _ONE and joint.mimic is None}
    for name in given:
        if name not in known:
            raise LoadError(f"{source}: pose: no joint '{name}' has a coordinate of its own; {suggestion(name, known)}")
    starts = {name: _start(known[name], value, source) for name, value in given.items()}
    joints = (replace(j, start=(starts[j.name],)) if j.name in starts else j for j in robot.joints)
    return replace(robot, joints=tuple(joints))


def _pairs(text: str, source: str) -> dict[str, object]:
    """JOINT=VALUE,... as a mapping; raises LoadError for another form."""
    pairs: dict[str, object] = {}
    for item in filter(None, (part.strip() for part in text.split(","))):
        name, equals, value = (part.strip() for part in item.partition("="))
        if not (name and equals and value):
            raise LoadError(f"{source}: pose: '{item}' is no JOINT=VALUE; give the angles of joints in rad, or m")
        pairs[name] = value
    return pairs


def _start(joint: RobotJoint, value: object, source: str) -> float:
    try:
        start = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise LoadError(f"{source}: pose: {joint.name} = {value!r} is no number; give rad, or m") from None
    low = -math.inf if joint.lower is None else joint.lower
    high = math.inf if joint.upper is None else joint.upper
    if not low <= start <= high or math.isinf(start):
        bounds = f"its limits, {low:g} to {high:g}"
        raise LoadError(f"{source}: pose: {joint.name} = {start:g} is not within {bounds}; give a value between them")
    return start
