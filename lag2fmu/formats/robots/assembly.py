"""From a tree of links to a mechanism: a frame for each link that moves, a body in it, and what acts on its joint.

Links on fixed joints are lumped with the one that carries them: their inertia goes into its body, and their origins
become points of its frame. Frames and bodies have the names of links, coordinates those of joints.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import sympy as sp

from lag2fmu.description.events import Friction, Stop
from lag2fmu.description.joints import across
from lag2fmu.description.names import GLOBAL_NAMES
from lag2fmu.description.parts import Damper, Gravity
from lag2fmu.description.places import WORLD, Body, Frame, Point
from lag2fmu.description.symbols import Declared, coordinate, parameter
from lag2fmu.errors import LoadError
from lag2fmu.formats.robots.tree import MOVING, QUARTER, Floats, Inertia, Joint, Mimic, Pose, Robot
from lag2fmu.language.vocabulary import symbol
from lag2fmu.mechanism.record import Mechanism

BASES = ("fixed", "floating", "planar")
_UNITS = {"revolute": "rad", "prismatic": "m"}
_AXES = "xyz"


def mechanism_of(robot: Robot, source: str, *, base: str = "fixed", stops: bool = False) -> Mechanism:
    """``robot`` as a mechanism with gravity 9.81 m/s2 along -z; ``source`` says where it is from.

    The ``base`` stands in the world ("fixed"), moves freely ("floating", by 3 coordinates and a quaternion) or in the
    plane z = 0 ("planar", by x, y and an angle). Limits of joints are bounds of the coordinates, with ``stops`` hard
    stops too. Raises LoadError for names that cannot be told apart, and MechanismError.
    """
    if base not in BASES:
        raise LoadError(f"{source}: base = '{base}' is unknown; give one of {', '.join(BASES)}")
    return _Assembly(robot, source, base, stops).mechanism()


@dataclass
class _Parts:
    """What is collected, joint after joint."""

    coordinates: list[Declared] = field(default_factory=list)
    parameters: list[Declared] = field(default_factory=list)
    frames: list[Frame] = field(default_factory=list)
    points: list[Point] = field(default_factory=list)
    dampers: list[Damper] = field(default_factory=list)
    frictions: list[Friction] = field(default_factory=list)
    stops: list[Stop] = field(default_factory=list)


class _Assembly:
    """The parts of one robot; ``carrier`` {link: (its frame or the world, its place in it)}."""

    def __init__(self, robot: Robot, source: str, base: str, stops: bool) -> None:
        self._robot, self._source, self._base, self._with_stops = robot, source, base, stops
        joints = [j.name for j in robot.joints]
        self._links = _identifiers(robot.links, f"{source}: links")
        self._joints = _identifiers(joints, f"{source}: joints", taken={WORLD, *GLOBAL_NAMES})
        self._known = {j.name: j for j in robot.joints}
        self._parts = _Parts()
        self._lumped: dict[str, list[Inertia]] = defaultdict(list)
        self._carrier: dict[str, tuple[str, Floats, Pose]] = {}

    def mechanism(self) -> Mechanism:
        """The whole; raises MechanismError."""
        robot, parts = self._robot, self._parts
        self._stand(robot.root)
        for joint in robot.joints:
            self._carry(joint)
        g = parameter("g", 9.81, "m/s2", "acceleration of gravity")
        bodies = [self._body(frame, inertias) for frame, inertias in self._lumped.items() if frame != WORLD]
        if not parts.coordinates:
            raise LoadError(f"{self._source}: nothing moves in this robot; give base = floating, or a joint that moves")
        return Mechanism(
            _identifier(robot.name),
            title=f"Robot {robot.name}",
            source=f"imported from {self._source}",
            coordinates=parts.coordinates,
            parameters=[g, *parts.parameters],
            frames=parts.frames,
            bodies=bodies,
            points=parts.points,
            dampers=parts.dampers,
            frictions=parts.frictions,
            stops=parts.stops,
            gravity=Gravity(g, (0, 0, -1)),
            strict_units=True,
        )

    def _stand(self, root: str) -> None:
        """Put the root on the ground, or let it move."""
        name = self._links[root]
        if self._base == "fixed":
            self._carrier[root] = (WORLD, np.eye(3), Pose(np.zeros(3)))
            return
        kind = {"floating": "floating", "planar": "planar"}[self._base]
        base = Joint(name, kind, WORLD, root, Pose(np.zeros(3)), np.array([0.0, 0.0, 1.0]))
        self._move(base, name, WORLD, Pose(np.zeros(3)))
        self._take(root)

    def _take(self, link: str) -> None:
        """Put the inertia of ``link`` where its carrier is."""
        frame, turn, pose = self._carrier[link]
        inertia = self._robot.links[link]
        if inertia is not None:
            self._lumped[frame].append(inertia.moved(turn, pose.origin))

    def _carry(self, joint: Joint) -> None:
        """Let ``joint`` carry its child: in a frame of its own, or lumped with the parent."""
        frame, turn, place = self._carrier[joint.parent]
        pose = Pose(place.origin + turn @ joint.pose.origin, (*place.turns, *joint.pose.turns))
        if joint.kind in MOVING:
            self._move(joint, self._joints[joint.name], frame, pose)
        else:
            self._carrier[joint.child] = (frame, turn @ joint.pose.matrix, pose)
            self._parts.points.append(Point(self._links[joint.child], _numbers(pose.origin), frame))
        self._take(joint.child)

    # ------------------------------------------------------------------------------------------------ moving joints

    def _move(self, joint: Joint, name: str, parent: str, pose: Pose) -> None:
        """The frame of the child of ``joint``, with its coordinates, which are called after ``name``."""
        frame, turns = self._links[joint.child], [(axis, _angle(angle)) for axis, angle in pose.turns]
        origin = _numbers(pose.origin)
        self._carrier[joint.child] = (frame, np.eye(3), Pose(np.zeros(3)))
        if joint.kind == "revolute":
            turning = _turn(joint.axis, self._coordinate(joint, name))
            self._parts.frames.append(Frame(frame, parent, origin, [*turns, turning]))
            return
        if any(origin) or turns:  # what slides does so along the axes of the joint
            mount = f"{frame}_mount"
            self._parts.frames.append(Frame(mount, parent, origin, turns))
            parent = mount
        if joint.kind == "prismatic":
            q = self._coordinate(joint, name)
            self._parts.frames.append(Frame(frame, parent, tuple(x * q for x in _numbers(joint.axis))))
        elif joint.kind == "planar":
            self._slide_in_plane(joint, name, frame, parent)
        else:
            self._float(name, frame, parent)

    def _slide_in_plane(self, joint: Joint, name: str, frame: str, parent: str) -> None:
        """Three degrees of freedom: two along the plane, and an angle about its normal."""
        first, second = across(_axis(joint.axis))
        x, y = (coordinate(f"{name}_{axis}", "m", doc=f"{name} along {axis}") for axis in "xy")
        angle = coordinate(f"{name}_angle", "rad", doc=f"angle of {name}")
        self._parts.coordinates += [x, y, angle]
        self._parts.frames.append(Frame(frame, parent, tuple(first * x + second * y), [_turn(joint.axis, angle)]))

    def _float(self, name: str, frame: str, parent: str) -> None:
        """Six degrees of freedom: the place along the axes of the joint, and a quaternion."""
        place = [coordinate(f"{name}_{axis}", "m", doc=f"{name} along {axis}") for axis in _AXES]
        doc = f"quaternion of {name}"
        scalar = coordinate(f"{name}_e0", "1", guess=1.0, doc=doc)
        quaternion = [scalar, *(coordinate(f"{name}_e{k}", "1", start=0.0, doc=doc) for k in (1, 2, 3))]
        self._parts.coordinates += [*place, *quaternion]
        self._parts.frames.append(Frame(frame, parent, tuple(place), quaternion=quaternion))

    def _coordinate(self, joint: Joint, name: str) -> sp.Expr:
        """What the ``joint`` turns or moves by: its coordinate, or what follows from the joint that it mimics."""
        if joint.mimic is not None:
            return self._follow(joint, joint.mimic)
        unit = _UNITS[joint.kind]
        lower, upper = joint.lower, joint.upper
        start = min(max(joint.start or 0.0, -np.inf if lower is None else lower), np.inf if upper is None else upper)
        q = coordinate(name, unit, start=float(start), minimum=lower, maximum=upper, doc=f"joint {joint.name}")
        self._parts.coordinates.append(q)
        if joint.damping:
            c = self._parameter(f"damping_{name}", joint.damping, "N.s/m" if unit == "m" else "N.m.s/rad")
            self._parts.dampers.append(Damper(name, c, rate=q.dot))
        if joint.friction:
            force = self._parameter(f"friction_{name}", joint.friction, "N" if unit == "m" else "N.m")
            self._parts.frictions.append(Friction(f"friction_of_{name}", on=q.dot, force=force))
        if self._with_stops and (lower, upper) != (None, None):
            self._parts.stops.append(Stop(f"stop_of_{name}", of=q, lower=lower, upper=upper))
        return q

    def _follow(self, joint: Joint, mimic: Mimic) -> sp.Expr:
        """The expression of a ``joint`` that mimics another one, which may do so too."""
        leader, name = self._known[mimic.leader], self._joints[joint.name]
        q = symbol(self._joints[leader.name]) if leader.mimic is None else self._follow(leader, leader.mimic)
        units = _UNITS[joint.kind], _UNITS[leader.kind]
        factor, offset = _number(mimic.factor), _number(mimic.offset)
        if units[0] != units[1]:
            factor = self._parameter(f"ratio_{name}", mimic.factor, "/".join(units))
        if offset:
            offset = self._parameter(f"offset_{name}", mimic.offset, units[0])
        return factor * q + offset

    def _parameter(self, name: str, value: float, unit: str) -> Declared:
        """A parameter; the same one where it was made before, as by a joint that two others mimic."""
        found = next((p for p in self._parts.parameters if p.name == name), None)
        if found is None:
            found = parameter(name, value, unit, name.replace("_", " "))
            self._parts.parameters.append(found)
        return found

    def _body(self, frame: str, inertias: Sequence[Inertia]) -> Body:
        """All that ``frame`` carries as one body."""
        whole = sum(inertias[1:], inertias[0])
        mass = self._parameter(f"mass_{frame}", whole.mass, "kg")
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = whole.tensor
        tensor = _numbers((xx, yy, zz, xy, xz, yz))
        return Body(frame, mass, frame=frame, center=_numbers(whole.center), inertia=tensor if any(tensor) else None)


# ----------------------------------------------------------------------------------------------------- names, numbers


def _identifier(name: str) -> str:
    """``name`` with all that no identifier can hold as underscores."""
    text = re.sub(r"\W", "_", name, flags=re.ASCII)
    return text if text[:1].isalpha() or text[:1] == "_" else f"_{text}"


def _identifiers(names: Iterable[str], where: str, taken: Iterable[str] = ()) -> Mapping[str, str]:
    """{name: identifier}; raises LoadError where two come out alike. What is ``taken`` gets an underscore behind."""
    found: dict[str, str] = {}
    reserved = {*taken, WORLD}
    for name in names:
        text = _identifier(name)
        text = f"{text}_" if text in reserved else text
        other = next((key for key, value in found.items() if value == text), None)
        if other is not None:
            raise LoadError(f"{where}: '{other}' and '{name}' would both be called '{text}'; rename one")
        found[name] = text
    return found


def _number(x: float) -> sp.Expr:
    """``x`` as an exact number where it is a short decimal, so that texts show what was read."""
    return sp.Rational(repr(float(x))) if x else sp.S.Zero


def _numbers(vector: Iterable[float]) -> tuple[sp.Expr, ...]:
    return tuple(_number(float(x)) for x in vector)


def _angle(x: float) -> sp.Expr:
    """``x`` rad, quarter turns exact."""
    quarters = round(x / (np.pi / 2))
    return quarters * sp.pi / 2 if abs(x - quarters * np.pi / 2) < QUARTER else _number(x)


def _axis(axis: Floats) -> str | tuple[sp.Expr, ...]:
    """The letter of an ``axis`` along x, y or z, else its entries."""
    along = [k for k in range(3) if axis[k] == 1.0]
    return _AXES[along[0]] if along else _numbers(axis)


def _turn(axis: Floats, angle: sp.Expr) -> tuple[str | tuple[sp.Expr, ...], sp.Expr]:
    """The turn by ``angle`` about ``axis``; about -x, -y, -z as one by the opposite angle."""
    against = [k for k in range(3) if axis[k] == -1.0]
    return (_AXES[against[0]], -angle) if against else (_axis(axis), angle)
