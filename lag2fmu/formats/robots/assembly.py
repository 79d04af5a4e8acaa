"""From a tree of links to a description: a frame and a body for each link that moves, and the forces of its joint.

Links on fixed joints are lumped with the link that carries them: their inertia goes into its body, and their origins
become points of its frame. Frames and bodies have the names of links, coordinates those of joints.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import Any

import numpy as np
import sympy as sp

from lag2fmu.description.joints import across
from lag2fmu.description.parts import Energy, Gravity
from lag2fmu.description.places import AXES, WORLD, Body, Frame, Point
from lag2fmu.description.record import Description
from lag2fmu.description.reserved import GLOBAL_NAMES
from lag2fmu.description.symbols import coordinate, parameter
from lag2fmu.errors import LoadError
from lag2fmu.formats.identifiers import identifier, identifiers
from lag2fmu.formats.robots.attachments import attach
from lag2fmu.formats.robots.parts import UNITS, Parts
from lag2fmu.formats.robots.tree import MOVING, Inertia, Joint, Mimic, Pose, Robot
from lag2fmu.formats.robots.turning import act_on_all
from lag2fmu.formats.robots.writing import axis_of, number, numbers, turn, turns_of
from lag2fmu.language.vocabulary import symbol

BASES = ("fixed", "floating", "planar")


def description_of(robot: Robot, source: str, *, base: str = "fixed", stops: bool = False) -> Description:
    """``robot`` as a description; ``source`` says where it is from.

    The ``base`` stands in the world ("fixed"), moves freely ("floating", by 3 coordinates and a quaternion) or in the
    plane z = 0 ("planar", by x, y and an angle). Limits of joints are bounds of the coordinates, and with ``stops``
    also hard stops. Raises LoadError for names that become equal, and MechanismError for a robot that cannot be
    described.
    """
    if base not in BASES:
        raise LoadError(f"{source}: base = '{base}' is unknown; give one of {', '.join(BASES)}")
    return _Assembly(robot, source, base, stops).description()


class _Assembly:
    """The parts of one robot."""

    def __init__(self, robot: Robot, source: str, base: str, stops: bool) -> None:
        self._robot, self._source, self._base, self._stops = robot, source, base, stops
        self._links = identifiers(robot.links, f"{source}: links")
        names = identifiers([j.name for j in robot.joints], f"{source}: joints", taken={WORLD, *GLOBAL_NAMES})
        self._known = {j.name: j for j in robot.joints}
        self._parts = Parts(names)
        self._lumped: dict[str, list[Inertia]] = defaultdict(list)

    def description(self) -> Description:
        """The whole; raises LoadError if nothing moves, and MechanismError."""
        robot, parts = self._robot, self._parts
        self._stand(robot.root)
        for joint in robot.joints:
            self._carry(joint)
        if not parts.coordinates:
            raise LoadError(f"{self._source}: nothing moves in this robot; give base = floating, or a joint that moves")
        attach(robot, parts)
        bodies = [self._body(frame, inertias) for frame, inertias in self._lumped.items() if frame != WORLD]
        strength = float(np.linalg.norm(robot.gravity))
        g = parameter("g", strength, "m/s2", "acceleration of gravity")
        tables: dict[str, Any] = {
            "title": f"Robot {robot.name}",
            "source": f"imported from {self._source}"
            + (f"; not taken: {', '.join(robot.ignored)}" if robot.ignored else ""),
            "coordinates": parts.coordinates,
            "parameters": [g, *parts.parameters],
            "inputs": parts.inputs,
            "energy": Energy(kinetic=sp.Add(*parts.armatures) if parts.armatures else None),
            "forces": parts.forces,
            "loads": parts.loads,
            "frames": parts.frames,
            "bodies": bodies,
            "points": parts.points,
            "springs": parts.springs,
            "dampers": parts.dampers,
            "joints": parts.closures,
            "constraints": parts.constraints,
            "frictions": parts.frictions,
            "stops": parts.stops,
            "gravity": Gravity(g, numbers(x / strength for x in robot.gravity) if strength else (0, 0, -1)),
            "strict_units": True,
        }
        return Description(identifier(robot.name), **tables)

    def _stand(self, root: str) -> None:
        """Put the root on the ground, or let it move."""
        nowhere = Pose(np.zeros(3))
        self._parts.carriers[root] = (WORLD, np.eye(3), nowhere)
        if self._base != "fixed":
            base = Joint(self._links[root], self._base, WORLD, root, nowhere, np.array([0.0, 0.0, 1.0]))
            self._move(base, self._links[root], WORLD, nowhere)
        self._take(root)

    def _take(self, link: str) -> None:
        """Put the inertia of ``link`` where its carrier is."""
        frame, matrix, pose = self._parts.carriers[link]
        inertia = self._robot.links[link]
        if inertia is not None:
            self._lumped[frame].append(inertia.moved(matrix, pose.origin))

    def _carry(self, joint: Joint) -> None:
        """Let ``joint`` carry its child: in a frame of its own, or lumped with the parent."""
        frame, matrix, place = self._parts.carriers[joint.parent]
        pose = Pose(place.origin + matrix @ joint.pose.origin, (*place.turns, *joint.pose.turns))
        if joint.kind in MOVING:
            self._move(joint, self._parts.joints[joint.name], frame, pose)
        else:
            self._parts.carriers[joint.child] = (frame, matrix @ joint.pose.matrix, pose)
            self._parts.points.append(Point(self._links[joint.child], numbers(pose.origin), frame))
        self._take(joint.child)

    # ------------------------------------------------------------------------------------------------ moving joints

    def _move(self, joint: Joint, name: str, parent: str, pose: Pose) -> None:
        """The frame of the child of ``joint``, with its coordinates, which are called after ``name``."""
        frame, turns = self._links[joint.child], turns_of(pose)
        origin = numbers(pose.origin)
        self._parts.carriers[joint.child] = (frame, np.eye(3), Pose(np.zeros(3)))
        if joint.kind == "revolute":
            turning = turn(joint.axis, self._path(joint, name))
            self._parts.frames.append(Frame(frame, parent, origin, [*turns, turning]))
            return
        if any(origin) or turns:  # sliding is along the axes of the joint
            mount = f"{frame}_mount"
            self._parts.frames.append(Frame(mount, parent, origin, turns))
            parent = mount
        if joint.kind == "prismatic":
            q = self._path(joint, name)
            self._parts.frames.append(Frame(frame, parent, tuple(x * q for x in numbers(joint.axis))))
        elif joint.kind == "planar":
            self._slide_in_plane(joint, name, frame, parent)
        else:
            self._float(joint, name, frame, parent)

    def _slide_in_plane(self, joint: Joint, name: str, frame: str, parent: str) -> None:
        """Three degrees of freedom: two along the plane, and an angle about its normal."""
        first, second = across(axis_of(joint.axis))
        x, y = (coordinate(f"{name}_{axis}", "m", doc=f"{name} along {axis}") for axis in "xy")
        angle = coordinate(f"{name}_angle", "rad", doc=f"angle of {name}")
        self._parts.coordinates += [x, y, angle]
        self._parts.frames.append(Frame(frame, parent, tuple(first * x + second * y), [turn(joint.axis, angle)]))

    def _float(self, joint: Joint, name: str, frame: str, parent: str) -> None:
        """A quaternion and, of a floating joint, the place along its axes."""
        floating = joint.kind == "floating"
        start = joint.start or (*(0.0,) * (3 if floating else 0), 1.0, 0.0, 0.0, 0.0)
        place, doc = [], f"quaternion of {name}"
        if floating:
            place = [
                coordinate(f"{name}_{axis}", "m", start=x, doc=f"{name} along {axis}")
                for axis, x in zip(AXES, start[:3], strict=True)
            ]
        scalar, *vector = start[-4:]
        quaternion = [coordinate(f"{name}_e0", "1", guess=scalar, doc=doc)]
        quaternion += [coordinate(f"{name}_e{k}", "1", start=x, doc=doc) for k, x in enumerate(vector, 1)]
        self._parts.coordinates += [*place, *quaternion]
        self._parts.frames.append(Frame(frame, parent, tuple(place) or (0, 0, 0), quaternion=quaternion))
        act_on_all(joint, name, self._parts)

    def _path(self, joint: Joint, name: str) -> sp.Expr:
        """The angle or way of ``joint``: its coordinate, or an expression in that of the joint that it mimics."""
        if joint.mimic is not None:
            return self._follow(joint, joint.mimic)
        q = self._parts.coordinate(joint, name)
        self._parts.act(joint, q, stops=self._stops)
        return q - self._parts.parameter(f"zero_{name}", joint.reference, UNITS[joint.kind]) if joint.reference else q

    def _follow(self, joint: Joint, mimic: Mimic) -> sp.Expr:
        """The expression of a ``joint`` that mimics another one, which may do so too."""
        leader, name = self._known[mimic.leader], self._parts.joints[joint.name]
        q = symbol(self._parts.joints[leader.name]) if leader.mimic is None else self._follow(leader, leader.mimic)
        units = UNITS[joint.kind], UNITS[leader.kind]
        factor, offset = number(mimic.factor), number(mimic.offset)
        if units[0] != units[1]:
            factor = self._parts.parameter(f"ratio_{name}", mimic.factor, "/".join(units))
        if offset:
            offset = self._parts.parameter(f"offset_{name}", mimic.offset, units[0])
        return factor * q + offset

    def _body(self, frame: str, inertias: Sequence[Inertia]) -> Body:
        """One body with all ``inertias`` that ``frame`` carries."""
        whole = sum(inertias[1:], inertias[0])
        mass = self._parts.parameter(f"mass_{frame}", whole.mass, "kg")
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = whole.tensor
        tensor = numbers((xx, yy, zz, xy, xz, yz))
        return Body(frame, mass, frame=frame, center=numbers(whole.center), inertia=tensor if any(tensor) else None)
