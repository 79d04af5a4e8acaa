"""Joints with several velocities, most of which turn by a quaternion: these, and what acts along all of them.

Source: Wittenburg, Dynamics of Multibody Systems, 2nd edition, chapter 2.
"""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from lag2fmu.description.parts import Damper, Spring
from lag2fmu.description.places import AXES
from lag2fmu.formats.robots.parts import DAMPINGS, INERTIAS, STIFFNESSES, Parts
from lag2fmu.formats.robots.tree import RobotJoint
from lag2fmu.formats.robots.writing import number
from lag2fmu.language.vocabulary import Smooth, symbol

_LEAST = sp.Rational("1e-30")
"""Added to the square of a sine: a turn by nothing has a direction then; the others change by less than rounding."""


def velocity(name: str) -> list[sp.Symbol]:
    """The velocity (3 entries) of the floating joint ``name``, along the axes of its parent, in m/s."""
    return [symbol(f"{name}_{axis}_dot") for axis in AXES]


def _rates(joint: RobotJoint, name: str) -> dict[str, list[tuple[str, sp.Expr]]]:
    """{unit: velocities of a ``joint`` called ``name``, with the ends of their names}, lengths first."""
    if joint.kind == "planar":
        return {
            "m": [(axis, symbol(f"{name}_{axis}_dot")) for axis in "xy"],
            "rad": [("z", symbol(f"{name}_angle_dot"))],
        }
    turns = {"rad": [*zip(AXES, angular_velocity(name), strict=True)]}
    return turns if joint.kind == "spherical" else {"m": [*zip(AXES, velocity(name), strict=True)], **turns}


def angular_velocity(name: str, *, in_parent: bool = False) -> list[sp.Expr]:
    """That of the child in its parent (3 entries, rad/s) by the quaternion of the joint ``name``.

    It is along the axes of the child, or of the parent.
    """
    scalar, *vector = (symbol(f"{name}_e{k}") for k in range(4))
    rate, *rates = (symbol(f"{name}_e{k}_dot") for k in range(4))
    e, e_dot = sp.Matrix(vector), sp.Matrix(rates)
    turning = e.cross(e_dot) if in_parent else e_dot.cross(e)
    return [2 * entry for entry in scalar * e_dot - rate * e + turning]


def angle_from(name: str, rest: Sequence[float]) -> sp.Expr:
    """The angle (0 to pi) between the orientation of the joint ``name`` and the quaternion ``rest``."""
    scalar, *vector = (symbol(f"{name}_e{k}") for k in range(4))
    r, *axis = map(number, rest)
    e, a = sp.Matrix(vector), sp.Matrix(axis)
    cosine, sines = r * scalar + a.dot(e), r * e - scalar * a - a.cross(e)
    return 2 * sp.atan2(sp.sqrt(sines.dot(sines) + _LEAST), Smooth(sp.Abs(cosine)))


def act_on_all(joint: RobotJoint, name: str, parts: Parts) -> None:
    """Add to ``parts`` the dampers, springs and armature of a ``joint`` with several velocities, called ``name``.

    It is a planar, spherical or floating one. A planar one has dampers only.
    """
    rates = _rates(joint, name)
    for unit, entries in rates.items():
        suffix = f"{name}_turn" if unit == "rad" and len(rates) == 2 else name
        if joint.damping:
            c = parts.parameter(f"damping_{suffix}", joint.damping, DAMPINGS[unit])
            for axis, x in entries:
                damper = parts.names.entry("dampers", f"damper_{suffix}_{axis}")
                parts.dampers.append(Damper(damper, c, rate=x))
        if joint.stiffness:
            k = parts.parameter(f"stiffness_{suffix}", joint.stiffness, STIFFNESSES[unit])
            for end, x in _elongations(joint, name, unit, parts):
                spring = parts.names.entry("springs", f"spring_of_{suffix}{end}")
                parts.springs.append(Spring(spring, k, elongation=x))
        if joint.armature:
            inertia = parts.parameter(f"armature_{suffix}", joint.armature, INERTIAS[unit])
            parts.armatures.append(inertia * sp.Add(*(x**2 for _, x in entries)) / 2)


def _elongations(joint: RobotJoint, name: str, unit: str, parts: Parts) -> list[tuple[str, sp.Expr]]:
    """What the springs of a ``joint`` are longer than at rest, (end of the name, in m or rad)."""
    if unit == "rad":
        return [("", angle_from(name, joint.start[-4:]))]
    places = zip((f"{name}_{axis}" for axis in AXES), joint.start[:3], strict=True)
    rests = ((place, parts.parameter(f"rest_{place}", rest, "m") if rest else 0) for place, rest in places)
    return [(place.removeprefix(name), symbol(place) - rest) for place, rest in rests]
