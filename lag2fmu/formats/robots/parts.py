"""The parts of a robot, collected joint after joint until they are a mechanism."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import sympy as sp

from lag2fmu.description.events import Friction, Stop
from lag2fmu.description.joints import Joint as Closing
from lag2fmu.description.parts import Constraint, Damper, Load, Spring
from lag2fmu.description.places import Frame, Point
from lag2fmu.description.symbols import Declared, coordinate, parameter
from lag2fmu.formats.robots.tree import Floats, Joint, Pose

UNITS = {"revolute": "rad", "prismatic": "m"}
"""The units of the coordinates of joints that have one coordinate."""

DAMPINGS = {"rad": "N.m.s/rad", "m": "N.s/m"}
_FORCES = {"rad": "N.m", "m": "N"}
STIFFNESSES = {"rad": "N.m/rad", "m": "N/m"}
INERTIAS = {"rad": "kg.m2", "m": "kg"}


@dataclass
class Parts:
    """The parts; ``carriers`` {link: (its frame or the world, its turn and pose in it)}, ``joints`` {name: ours}."""

    joints: Mapping[str, str]
    carriers: dict[str, tuple[str, Floats, Pose]] = field(default_factory=dict)
    coordinates: list[Declared] = field(default_factory=list)
    parameters: list[Declared] = field(default_factory=list)
    frames: list[Frame] = field(default_factory=list)
    points: list[Point] = field(default_factory=list)
    dampers: list[Damper] = field(default_factory=list)
    frictions: list[Friction] = field(default_factory=list)
    stops: list[Stop] = field(default_factory=list)
    springs: list[Spring] = field(default_factory=list)
    armatures: list[sp.Expr] = field(default_factory=list)
    inputs: list[Declared] = field(default_factory=list)
    forces: dict[str, sp.Expr] = field(default_factory=dict)
    loads: list[Load] = field(default_factory=list)
    closures: list[Closing] = field(default_factory=list)
    constraints: list[Constraint] = field(default_factory=list)

    def parameter(self, name: str, value: float, unit: str | None) -> Declared:
        """A parameter; it is made once, even if it is asked for twice, as for a joint that two others mimic."""
        found = next((p for p in self.parameters if p.name == name), None)
        if found is None:
            found = parameter(name, value, unit, name.replace("_", " "))
            self.parameters.append(found)
        return found

    def coordinate(self, joint: Joint, name: str) -> Declared:
        """The coordinate ``name`` of a ``joint`` that has one, started within its limits."""
        low = -np.inf if joint.lower is None else joint.lower
        high = np.inf if joint.upper is None else joint.upper
        start = float(min(max(joint.start[0] if joint.start else 0.0, low), high))
        bounds = {"minimum": joint.lower, "maximum": joint.upper}
        q = coordinate(name, UNITS[joint.kind], start=start, doc=f"joint {joint.name}", **bounds)
        self.coordinates.append(q)
        return q

    def act(self, joint: Joint, q: Declared, *, stops: bool) -> None:
        """Add damper, dry friction, spring, armature and, with ``stops``, stops along the coordinate ``q``."""
        name, unit = str(q), UNITS[joint.kind]
        if joint.damping:
            c = self.parameter(f"damping_{name}", joint.damping, DAMPINGS[unit])
            self.dampers.append(Damper(name, c, rate=q.dot))
        if joint.friction:
            force = self.parameter(f"friction_{name}", joint.friction, _FORCES[unit])
            self.frictions.append(Friction(f"friction_of_{name}", on=q.dot, force=force))
        if joint.stiffness:
            k = self.parameter(f"stiffness_{name}", joint.stiffness, STIFFNESSES[unit])
            rest = self.parameter(f"rest_{name}", joint.rest, unit) if joint.rest else 0
            self.springs.append(Spring(f"spring_of_{name}", k, elongation=q - rest))
        if joint.armature:
            self.armatures.append(self.parameter(f"armature_{name}", joint.armature, INERTIAS[unit]) * q.dot**2 / 2)
        if stops and (joint.lower, joint.upper) != (None, None):
            self.stops.append(Stop(f"stop_of_{name}", of=q, lower=joint.lower, upper=joint.upper))
