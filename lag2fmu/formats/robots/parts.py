"""The parts of a robot, collected joint after joint until they are a mechanism."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import sympy as sp

from lag2fmu.description.events import Contact, Friction, State, Stop
from lag2fmu.description.joints import Joint
from lag2fmu.description.names import of_friction, of_unilateral, stop_side
from lag2fmu.description.outputs import Output
from lag2fmu.description.parts import Constraint, Damper, Definition, Load, Spring
from lag2fmu.description.places import Frame, Point
from lag2fmu.description.symbols import Declared, coordinate, parameter
from lag2fmu.formats.robots.naming import Names
from lag2fmu.formats.robots.poses import Floats, JointPose
from lag2fmu.formats.robots.tree import RobotJoint
from lag2fmu.language.vocabulary import symbol

UNITS = {"revolute": "rad", "prismatic": "m"}
"""The units of the coordinates of joints that have one coordinate."""

DAMPINGS = {"rad": "N.m.s/rad", "m": "N.s/m"}
_FORCES = {"rad": "N.m", "m": "N"}
STIFFNESSES = {"rad": "N.m/rad", "m": "N/m"}
INERTIAS = {"rad": "kg.m2", "m": "kg"}


class Touched(NamedTuple):
    """What of a link touches by a ``contact``: the ball of a ``radius`` (m) about a ``place`` (3,) in its axes.

    ``plane`` is the geom that it touches, "" if that is none. Of a contact that is not ``ideal`` no force is told.
    """

    contact: str
    place: Floats
    radius: float
    plane: str
    ideal: bool = True


@dataclass
class Parts:
    """The parts, whose ``names`` are taken.

    ``joints`` {name in the file: ours}, ``carriers`` {link: (its frame or the world, its turn and pose in it)},
    ``bodies`` {link: the body that has its mass, or the world}, ``driven`` {actuator: (length, rate, force)} of those
    along joints, ``touched`` {link: what of it touches}. What nothing is made of is ``ignored``. The terms of each sum
    in ``alike`` have one unit; ``plain`` are the names of factors that have none where their use leaves it open.
    """

    names: Names
    joints: dict[str, str] = field(default_factory=dict)
    carriers: dict[str, tuple[str, Floats, JointPose]] = field(default_factory=dict)
    bodies: dict[str, str] = field(default_factory=dict)
    coordinates: list[Declared] = field(default_factory=list)
    parameters: list[Declared] = field(default_factory=list)
    definitions: list[Definition] = field(default_factory=list)
    frames: list[Frame] = field(default_factory=list)
    points: list[Point] = field(default_factory=list)
    dampers: list[Damper] = field(default_factory=list)
    frictions: list[Friction] = field(default_factory=list)
    stops: list[Stop] = field(default_factory=list)
    springs: list[Spring] = field(default_factory=list)
    armatures: list[sp.Expr] = field(default_factory=list)
    inputs: list[Declared] = field(default_factory=list)
    states: list[State] = field(default_factory=list)
    forces: dict[str, sp.Expr] = field(default_factory=dict)
    loads: list[Load] = field(default_factory=list)
    closures: list[Joint] = field(default_factory=list)
    constraints: list[Constraint] = field(default_factory=list)
    contacts: list[Contact] = field(default_factory=list)
    outputs: list[Output] = field(default_factory=list)
    driven: dict[str, tuple[sp.Expr, sp.Expr, sp.Expr]] = field(default_factory=dict)
    touched: dict[str, list[Touched]] = field(default_factory=dict)
    ignored: list[str] = field(default_factory=list)
    alike: list[sp.Expr] = field(default_factory=list)
    plain: list[str] = field(default_factory=list)
    _metre: Declared | None = None

    def parameter(self, wanted: str, value: float, unit: str | None = None, doc: str = "") -> Declared:
        """A new parameter, called as ``wanted`` where that is free."""
        made = parameter(self.names.variable(wanted), value, unit, doc or wanted.replace("_", " "))
        self.parameters.append(made)
        return made

    def metre(self) -> Declared:
        """The unit of the numbers of which a length is computed, as a parameter of 1 m."""
        self._metre = self._metre or self.parameter("metre", 1.0, "m", "the unit of lengths along places")
        return self._metre

    def define(self, wanted: str, expression: sp.Expr) -> sp.Expr:
        """A new name for ``expression``, called as ``wanted`` where that is free; what has no parts stays as it is."""
        if not expression.args:
            return expression
        self.definitions.append(Definition(self.names.variable(wanted), expression))
        return symbol(self.definitions[-1].name)

    def coordinate(self, joint: RobotJoint, name: str) -> Declared:
        """The coordinate ``name`` of a ``joint`` that has one, started within its limits."""
        low = -np.inf if joint.lower is None else joint.lower
        high = np.inf if joint.upper is None else joint.upper
        start = float(min(max(joint.start[0] if joint.start else 0.0, low), high))
        bounds = {"minimum": joint.lower, "maximum": joint.upper}
        q = coordinate(name, UNITS[joint.kind], start=start, doc=f"joint {joint.name}", **bounds)
        self.coordinates.append(q)
        return q

    def act(self, joint: RobotJoint, name: str, path: sp.Expr, rate: sp.Expr, *, stops: bool) -> None:
        """Add damper, dry friction, spring, armature and, with ``stops``, stops along the ``path`` of a ``joint``."""
        unit = UNITS[joint.kind]
        if joint.damping:
            c = self.parameter(f"damping_{name}", joint.damping, DAMPINGS[unit])
            self.dampers.append(Damper(self.names.entry("dampers", name), c, rate=rate))
        if joint.friction:
            force = self.parameter(f"friction_{name}", joint.friction, _FORCES[unit])
            friction = self.names.entry("frictions", f"friction_of_{name}", of_friction)
            self.frictions.append(Friction(friction, on=rate, force=force))
        if joint.stiffness:
            k = self.parameter(f"stiffness_{name}", joint.stiffness, STIFFNESSES[unit])
            rest = self.parameter(f"rest_{name}", joint.rest, unit) if joint.rest else 0
            spring = self.names.entry("springs", f"spring_of_{name}")
            self.springs.append(Spring(spring, k, elongation=path - rest))
        if joint.armature:
            self.armatures.append(self.parameter(f"armature_{name}", joint.armature, INERTIAS[unit]) * rate**2 / 2)
        if stops and (joint.lower, joint.upper) != (None, None):
            self.limit(f"stop_of_{name}", path, (joint.lower, joint.upper))

    def limit(self, name: str, path: sp.Expr, limits: tuple[float | None, float | None]) -> None:
        """Add a stop at the ``limits`` of a ``path``, in its unit."""
        low, high = limits
        self.stops.append(Stop(self.names.entry("stops", name, _of_stop), of=path, lower=low, upper=high))


def _of_stop(name: str) -> list[str]:
    """The names of variables that a stop brings."""
    return [x for side in ("lower", "upper") for x in of_unilateral(stop_side(name, side))]
