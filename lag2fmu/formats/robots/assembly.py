"""From a tree of links to a description: a frame and a body for each link that moves, and the forces of its joint.

Links on fixed joints are lumped with the link that carries them: their inertia goes into its body, and their origins
become points of its frame. One whose mass or force a sensor tells has a body of its own in this frame. Frames and
bodies have the names of links, coordinates those of joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.joints import across
from lag2fmu.description.names import generalized_force, of_constraint, velocity
from lag2fmu.description.parts import Energy, Gravity
from lag2fmu.description.places import AXES, WORLD, Body, Frame, Point
from lag2fmu.description.ports import Ports
from lag2fmu.description.reserved import GLOBAL_NAMES
from lag2fmu.description.symbols import coordinate, parameter
from lag2fmu.errors import LoadError
from lag2fmu.formats.identifiers import identifier, identifiers
from lag2fmu.formats.robots.attachments import attach, lift
from lag2fmu.formats.robots.ground import Ground
from lag2fmu.formats.robots.looking import look
from lag2fmu.formats.robots.measuring import measure
from lag2fmu.formats.robots.naming import Names, coordinates_of, variables_of
from lag2fmu.formats.robots.parts import UNITS, Parts
from lag2fmu.formats.robots.poses import JointPose, LinkInertia
from lag2fmu.formats.robots.standing import standing
from lag2fmu.formats.robots.touching import touch
from lag2fmu.formats.robots.tree import MOVING, Mimic, Robot, RobotJoint
from lag2fmu.formats.robots.turning import act_on_all
from lag2fmu.formats.robots.writing import axis_of, number, numbers, turn, turns_of
from lag2fmu.language.vocabulary import symbol
from lag2fmu.mechanism.units_by_use import with_units

BASES = ("fixed", "floating", "planar")


def description_of(
    robot: Robot, source: Path, *, base: str = "fixed", stops: bool = False, ground: Ground | None = None
) -> Description:
    """``robot`` as a description; ``source`` is its file.

    The ``base`` stands in the world ("fixed"), moves freely ("floating", by 3 coordinates and a quaternion) or in the
    plane z = 0 ("planar", by x, y and an angle). Limits of joints are bounds of the coordinates, and with ``stops``
    also hard stops. What touches by the ``ground`` has contacts. Raises LoadError for names that become equal, and
    MechanismError for a robot that cannot be described.
    """
    if base not in BASES:
        raise LoadError(f"{source.name}: base = '{base}' is unknown; give one of {', '.join(BASES)}")
    return _Assembly(robot, source.name, base, stops).description(ground, source.parent)


_LAST = "the sensor "
_WEIGHTS = ("the actuator ", "the equality ")
"""What is told first where nothing is made of it: nothing drives the robot, and what is joined falls apart."""


def _weight(ignored: str) -> int:
    """The rank of what is ``ignored``, the weightiest first."""
    found = next((k for k, begin in enumerate(_WEIGHTS) if ignored.startswith(begin)), len(_WEIGHTS))
    return found + ignored.startswith(_LAST)


class _Assembly:
    """The parts of one robot."""

    def __init__(self, robot: Robot, source: str, base: str, stops: bool) -> None:
        self._robot, self._source, self._base, self._stops = robot, source, base, stops
        self._links = identifiers(robot.links, f"{source}: links")
        names = identifiers([j.name for j in robot.joints], f"{source}: joints", taken={WORLD, *GLOBAL_NAMES})
        self._known = {j.name: j for j in robot.joints}
        self._parts = Parts(Names())
        for link in self._links.values():
            self._parts.names.entry("places", link)
        for joint in robot.joints:
            frame = self._links[joint.child]
            if joint.kind in ("spherical", "floating"):
                self._parts.names.reserve(of_constraint(f"{frame}_norm"))
            if joint.kind == "floating":  # it has a wrench as inputs
                self._parts.names.reserve(f"{frame}_{kind}_{axis}" for kind in ("force", "torque") for axis in AXES)
        for joint in robot.joints:
            self._parts.joints[joint.name] = self._named(joint, names[joint.name])
        self._paths: dict[str, sp.Expr] = {}
        self._lumped: dict[str, tuple[str, list[LinkInertia]]] = {}  # {body: (its frame, what is in it)}
        self._sensed = {sensor.subtree for sensor in robot.sensors}
        self._floating: list[str] = []  # frames
        self._free: list[tuple[str, ...]] = []  # coordinates of what floats in the world
        self._turned: set[str] = set()  # coordinates along which no force is a port

    def description(self, ground: Ground | None, folder: Path) -> Description:
        """The whole, with files named from ``folder`` on; raises LoadError if nothing moves, and MechanismError."""
        robot, parts = self._robot, self._parts
        self._stand(robot.root)
        for joint in robot.joints:
            self._carry(joint)
        if not parts.coordinates:
            raise LoadError(f"{self._source}: nothing moves in this robot; give base = floating, or a joint that moves")
        attach(robot, parts, stops=self._stops)
        if ground is not None:
            touch(robot, parts, ground)
        measure(robot, parts)
        bodies = [self._body(name, *lumped) for name, lumped in self._lumped.items() if name != WORLD]
        strength = float(np.linalg.norm(robot.gravity))
        g = parameter(parts.names.variable("g"), strength, "m/s2", "acceleration of gravity")
        down = numbers(x / strength for x in robot.gravity) if strength else (0, 0, -1)
        lift(robot, parts, [-x * g for x in down])
        tables: dict[str, Any] = {
            "title": f"Robot {robot.name}",
            "source": f"imported from {self._source}",
            "not_taken": sorted((*robot.ignored, *parts.ignored), key=_weight),
            "coordinates": parts.coordinates,
            "parameters": [g, *parts.parameters],
            "inputs": parts.inputs,
            "states": parts.states,
            "definitions": parts.definitions,
            "energy": Energy(kinetic=sp.Add(*parts.armatures) if parts.armatures else None),
            "forces": parts.forces,
            "loads": parts.loads,
            "frames": parts.frames,
            "bodies": bodies,
            "points": parts.points,
            "visuals": look(robot, parts, folder),
            "springs": parts.springs,
            "dampers": parts.dampers,
            "joints": parts.closures,
            "constraints": parts.constraints,
            "contacts": parts.contacts,
            "frictions": parts.frictions,
            "stops": parts.stops,
            "outputs": parts.outputs,
            "ports": self._ports(),
            "gravity": Gravity(g, down),
        }
        found = Description(identifier(robot.name), strict_units=True, **tables)
        found = standing(found, self._free, placed=self._base != "floating")
        names = [*parts.plain, *map(str, parts.inputs), *(z.name for z in parts.states), *map(str, parts.parameters)]
        return with_units(found, parts.alike, names)  # MJCF gives numbers alone

    def _ports(self) -> Ports:
        """A wrench on what floats, in the place of generalized forces, which mean nothing along a quaternion."""
        if not self._turned:
            return Ports()
        parts, places = self._parts, [f"frames.{frame}" for frame in self._floating]
        forces = [generalized_force(q) for q in map(str, parts.coordinates) if q not in self._turned]
        return Ports(inputs=[*forces, *map(str, parts.inputs)], forces=places, torques=places)

    def _stand(self, root: str) -> None:
        """Put the root on the ground, or let it move."""
        nowhere = JointPose(np.zeros(3))
        self._parts.carriers[root], self._parts.bodies[root] = (WORLD, np.eye(3), nowhere), WORLD
        if self._base != "fixed":
            base = RobotJoint(self._links[root], self._base, WORLD, root, nowhere, np.array([0.0, 0.0, 1.0]))
            self._move(base, self._named(base, self._links[root]), WORLD, nowhere)
        self._take(root)

    def _named(self, joint: RobotJoint, wanted: str) -> str:
        """The name of ``joint``, ``wanted`` where nothing that it brings is taken: ``j`` brings ``j_dot``."""
        return self._parts.names.variable(wanted, lambda name: variables_of(joint, name))

    def _take(self, link: str) -> None:
        """Put the inertia of ``link`` where its carrier is."""
        frame, matrix, pose = self._parts.carriers[link]
        inertia = self._robot.links[link]
        if inertia is not None:
            _, lumped = self._lumped.setdefault(self._parts.bodies[link], (frame, []))
            lumped.append(inertia.moved(matrix, pose.origin))

    def _carry(self, joint: RobotJoint) -> None:
        """Let ``joint`` carry its child: in a frame of its own, or lumped with the parent."""
        frame, matrix, place = self._parts.carriers[joint.parent]
        pose = JointPose(place.origin + matrix @ joint.pose.origin, (*place.turns, *joint.pose.turns))
        if joint.kind in MOVING:
            self._move(joint, self._parts.joints[joint.name], frame, pose)
        else:
            self._parts.carriers[joint.child] = (frame, matrix @ joint.pose.matrix, pose)
            self._parts.points.append(Point(self._links[joint.child], numbers(pose.origin), frame))
            own = joint.child in self._sensed or (frame == WORLD and self._robot.root in self._sensed)
            body = f"{self._links[joint.child]}_body"
            carrying = self._parts.bodies[joint.parent]
            self._parts.bodies[joint.child] = self._parts.names.entry("places", body) if own else carrying
        self._take(joint.child)

    # ------------------------------------------------------------------------------------------------ moving joints

    def _move(self, joint: RobotJoint, name: str, parent: str, pose: JointPose) -> None:
        """The frame of the child of ``joint``, with its coordinates, which are called after ``name``."""
        frame, turns = self._links[joint.child], turns_of(pose)
        origin = numbers(pose.origin)
        self._parts.carriers[joint.child] = (frame, np.eye(3), JointPose(np.zeros(3)))
        self._parts.bodies[joint.child] = frame
        if joint.kind == "revolute":
            turning = turn(joint.axis, self._path(joint, name))
            self._parts.frames.append(Frame(frame, parent, origin, [*turns, turning]))
            return
        if any(origin) or turns:  # sliding is along the axes of the joint
            mount = self._parts.names.entry("places", f"{frame}_mount")
            self._parts.frames.append(Frame(mount, parent, origin, turns))
            parent = mount
        if joint.kind == "prismatic":
            q = self._path(joint, name)
            self._parts.frames.append(Frame(frame, parent, tuple(x * q for x in numbers(joint.axis))))
        elif joint.kind == "planar":
            self._slide_in_plane(joint, name, frame, parent)
        else:
            self._float(joint, name, frame, parent)

    def _slide_in_plane(self, joint: RobotJoint, name: str, frame: str, parent: str) -> None:
        """Three degrees of freedom: two along the plane, and an angle about its normal."""
        first, second = across(axis_of(joint.axis))
        along_x, along_y, turned = coordinates_of(joint, name)
        x, y = (coordinate(q, "m", doc=f"{name} along {axis}") for q, axis in ((along_x, "x"), (along_y, "y")))
        angle = coordinate(turned, "rad", doc=f"angle of {name}")
        self._parts.coordinates += [x, y, angle]
        self._parts.frames.append(Frame(frame, parent, tuple(first * x + second * y), [turn(joint.axis, angle)]))
        act_on_all(joint, name, self._parts)

    def _float(self, joint: RobotJoint, name: str, frame: str, parent: str) -> None:
        """A quaternion and, of a floating joint, the place along its axes."""
        floating = joint.kind == "floating"
        start = joint.start or (*(0.0,) * (3 if floating else 0), 1.0, 0.0, 0.0, 0.0)
        *along, e0, e1, e2, e3 = coordinates_of(joint, name)
        doc = f"quaternion of {name}"
        place = [
            coordinate(q, "m", start=x, doc=f"{name} along {axis}")
            for q, axis, x in zip(along, AXES, start[:3], strict=False)
        ]
        scalar, *vector = start[-4:]
        quaternion = [coordinate(e0, "1", guess=scalar, doc=doc)]
        quaternion += [coordinate(e, "1", start=x, doc=doc) for e, x in zip((e1, e2, e3), vector, strict=True)]
        self._parts.coordinates += [*place, *quaternion]
        self._turned |= {str(q) for q in (*place, *quaternion)}
        self._floating += [frame] if floating else []
        self._free += [tuple(along)] if floating and joint.parent in (WORLD, self._robot.root) else []
        self._parts.frames.append(Frame(frame, parent, tuple(place) or (0, 0, 0), quaternion=quaternion))
        act_on_all(joint, name, self._parts)

    def _path(self, joint: RobotJoint, name: str) -> sp.Expr:
        """The angle or way of ``joint``: its coordinate, or an expression in that of the joint that it mimics."""
        if joint.mimic is not None:
            return self._follow(joint, joint.mimic)
        q = self._parts.coordinate(joint, name)
        self._parts.act(joint, name, q, q.dot, stops=self._stops)
        return q - self._parts.parameter(f"zero_{name}", joint.reference, UNITS[joint.kind]) if joint.reference else q

    def _follow(self, joint: RobotJoint, mimic: Mimic) -> sp.Expr:
        """The expression of a ``joint`` that mimics another one, which may do so too.

        Its resistances act along it. Its limits bound no coordinate of its own, so that only stops can take them.
        """
        if joint.name in self._paths:
            return self._paths[joint.name]
        leader, name = self._known[mimic.leader], self._parts.joints[joint.name]
        q = symbol(self._parts.joints[leader.name]) if leader.mimic is None else self._follow(leader, leader.mimic)
        units = UNITS[joint.kind], UNITS[leader.kind]
        factor, offset = number(mimic.factor), number(mimic.offset)
        if units[0] != units[1]:
            factor = self._parts.parameter(f"ratio_{name}", mimic.factor, "/".join(units))
        if offset:
            offset = self._parts.parameter(f"offset_{name}", mimic.offset, units[0])
        path = self._paths[joint.name] = factor * q + offset
        moving = symbol(self._parts.joints[self._leader(joint)])
        rate = path.diff(moving) * symbol(velocity(moving.name))
        self._parts.act(joint, name, path, rate, stops=self._stops)
        if (joint.lower, joint.upper) != (None, None) and not self._stops:
            self._parts.ignored.append(f"limits of the joint {joint.name}, which mimics another one (stops take them)")
        return path

    def _leader(self, joint: RobotJoint) -> str:
        """The name of the joint that has the coordinate by which ``joint`` moves."""
        while joint.mimic is not None:
            joint = self._known[joint.mimic.leader]
        return joint.name

    def _body(self, name: str, frame: str, inertias: Sequence[LinkInertia]) -> Body:
        """The body ``name`` on ``frame`` with all ``inertias``."""
        whole = sum(inertias[1:], inertias[0])
        mass = self._parts.parameter(f"mass_{name}", whole.mass, "kg")
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = whole.tensor
        tensor = numbers((xx, yy, zz, xy, xz, yz))
        return Body(name, mass, frame=frame, center=numbers(whole.center), inertia=tensor if any(tensor) else None)
