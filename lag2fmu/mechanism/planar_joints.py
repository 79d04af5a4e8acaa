"""Joints between two ends in the plane: which kinds there are, and how the ends lie.

An end is at its position, turned about z by the angle of the body or point; "world" does not turn.
"""

from __future__ import annotations

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.joints import JOINTS, Joint, direction
from lag2fmu.description.places import WORLD
from lag2fmu.errors import MechanismError


def groups_of(m: Description, joint: Joint) -> tuple[str, ...]:
    """The groups of equations of a planar ``joint``.

    Raises MechanismError for a kind that exists in space only, for an axis out of the plane, and for an end without the
    angle that the joint needs. A particle does not turn, so it needs no angle to be guided or fixed.
    """
    where = f"joints.{joint.name}"
    _check_planar(joint, where)
    if joint.kind == "revolute":
        return JOINTS[joint.kind].planar
    first, second = map(str, joint.between or ())
    particles = {part.name for part in m.bodies if part.angle is None}
    may_lack = {"prismatic": {second}, "fixed": {first, second}}.get(joint.kind, set()) & particles
    for name in (first, second):
        if angle_of(m, name) is None and name not in may_lack:
            remedy = "a body has it with an inertia" if name in particles else "give it, 0 if it does not turn"
            raise MechanismError(f"{where}.between: '{name}' has no 'angle', which '{joint.kind}' needs; {remedy}")
    return tuple(group for group in JOINTS[joint.kind].planar if group != "turn" or not may_lack)


def _check_planar(joint: Joint, where: str) -> None:
    """Raise MechanismError for a kind or an axis that there is in space only."""
    if not JOINTS[joint.kind].planar:
        known = ", ".join([*(name for name, kind in JOINTS.items() if kind.planar), "gear"])
        raise MechanismError(
            f"{where}.kind: positions have 2 entries; '{joint.kind}' joins frames, which are spatial; in the plane "
            f"there are {known}"
        )
    if joint.kind == "revolute":
        return
    if joint.axis is not None and direction(joint.axis)[2] != 0:
        raise MechanismError(
            f"{where}.axis: '{joint.axis}' is out of the plane; give 'x', 'y' or a vector of 3 entries, the last one 0"
        )
    if joint.second_axis is not None:
        raise MechanismError(f"{where}.second_axis: in the plane a disc turns about z; leave it out")


def angle_of(m: Description, name: str) -> sp.Expr | None:
    """The angle (rad) of the body or point ``name``; None if it has none."""
    if name == WORLD:
        return sp.S.Zero
    return next((sp.sympify(part.angle) for part in m.places if part.name == name and part.angle is not None), None)


def turn_alike(m: Description, joint: Joint) -> bool:
    """Whether the ends of ``joint`` have the same angle, or an angle does not matter."""
    first, second = (angle_of(m, str(name)) for name in joint.between or ())
    return joint.kind == "revolute" or first == second
