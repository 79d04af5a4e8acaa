"""Reading URDF, the XML in which ROS describes robots: http://wiki.ros.org/urdf/XML.

Links with their inertia and what is seen of them, and joints with origin, axis, limit, dynamics and mimic are read;
collision shapes where something touches. Sensors, drives (transmission) and the simulator Gazebo are left out. What
acts on the motion in Gazebo is listed: http://sdformat.org/tutorials?tut=sdformat_urdf_extensions.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from lag2fmu.errors import LoadError
from lag2fmu.formats.robots.ground import Ground
from lag2fmu.formats.robots.poses import Floats, LinkInertia
from lag2fmu.formats.robots.tree import Mimic, Robot, RobotJoint, in_order
from lag2fmu.formats.robots.urdf_elements import UrdfElements
from lag2fmu.formats.robots.urdf_geoms import looks, touches
from lag2fmu.language.identifiers import suggestion
from lag2fmu.xml_tree import XmlElement, parse

MOST_BYTES = 64 << 20
_KINDS = {
    "revolute": "revolute",
    "continuous": "revolute",
    "prismatic": "prismatic",
    "fixed": "fixed",
    "planar": "planar",
    "floating": "floating",
}
_ONE, _BOUNDED = ("revolute", "continuous", "prismatic"), ("revolute", "prismatic")
"""The types of joints that have one coordinate, and those of them that have limits."""
_DUST = 1e-15
"""Moments of a unit mass (m2) below this are rounding errors of the tool that wrote the file; they may be negative."""
_READ = {"link", "joint"}
_SEEN = {"material", "transmission", "gazebo", "sensor", "visual", "collision"}
_CHILDREN = {
    "link": {"inertial", "visual", "collision", "sensor", "gazebo"},
    "joint": {"origin", "parent", "child", "axis", "limit", "dynamics", "mimic", "calibration", "safety_controller"},
}
_OF_GAZEBO = {"gravity", "turnGravityOff", "springStiffness", "dampingFactor", "fluid_density"}
"""The children of <gazebo> that act on the motion."""
_ATTRIBUTES = {
    "dynamics": {"damping", "friction"},
    "limit": {"lower", "upper", "effort", "velocity"},
    "mimic": {"joint", "multiplier", "offset"},
}
"""The children of links and joints, and the attributes of these, that are read or mean nothing for the motion."""


def read_urdf(path: Path, ground: Ground | None = None) -> Robot:
    """The robot in the file ``path``, with what touches by the ``ground``.

    Raises LoadError with file, line, element and remedy.
    """
    try:
        if path.stat().st_size > MOST_BYTES:
            raise LoadError(f"{path}: has {path.stat().st_size} bytes; a robot of more than {MOST_BYTES} is not read")
        content = path.read_bytes()
    except OSError as error:
        raise LoadError(f"{path}: cannot be read: {error.strerror}") from error
    return _UrdfReader(str(path), parse(content, str(path)).root).robot(ground)


class _UrdfReader(UrdfElements):
    """Reads one file; ``where`` names it."""

    def __init__(self, where: str, root: XmlElement) -> None:
        super().__init__(where)
        self._root = root

    def robot(self, ground: Ground | None) -> Robot:
        if self._root.tag != "robot":
            raise self.error(self._root, "is no robot: a URDF file has the element <robot> at its top")
        self._check_written_out()
        links = self._links()
        joints = [self._joint(e, links) for e in self._root.all("joint")]
        self._check_names([j.name for j in joints], "joint")
        root = self._root_of(links, joints)
        ordered = in_order(root, joints)
        if len(ordered) < len(joints):
            names = ", ".join(sorted({j.name for j in joints} - {j.name for j in ordered}))
            raise LoadError(f"{self.where}: the joints {names} make a circle; a URDF robot is a tree of links")
        self._check_mimics(joints)
        touching = () if ground is None else touches(self, self._root, ground)
        name = self._root.get("name") or "robot"
        return Robot(
            name, root, links, ordered, tuple(self._ignored()), touches=touching, looks=looks(self, self._root)
        )

    # ------------------------------------------------------------------------------------------------------- links

    def _links(self) -> dict[str, LinkInertia | None]:
        elements = list(self._root.all("link"))
        for e in elements:
            if not e.get("name"):
                raise self.error(e, "has no name; give it one")
        self._check_names([e.get("name") for e in elements], "link")
        if not elements:
            raise LoadError(f"{self.where}: the robot has no links")
        return {e.get("name"): self._inertia(e) for e in elements}

    def _check_written_out(self) -> None:
        for e in self._root.walk():
            if e.tag.startswith("xacro:") or any("${" in text for text in e.attributes.values()):
                raise self.error(e, "is a macro; write the robot out first: xacro FILE -o robot.urdf")

    def _check_names(self, names: list[str], kind: str) -> None:
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise LoadError(f"{self.where}: two {kind}s are called '{twice}'; rename one")

    def _inertia(self, link: XmlElement) -> LinkInertia | None:
        """The inertia of ``link``; None where it has none, or one of 0."""
        inertial = self.only(link, "inertial")
        if inertial is None:
            return None
        mass_element, tensor_element = self.only(inertial, "mass"), self.only(inertial, "inertia")
        if mass_element is None:
            raise self.error(link, "its <inertial> has no <mass>")
        mass = self.number(mass_element, "value")
        if mass < 0.0:
            raise self.error(link, f"its mass is {mass:g} kg; a mass is not negative")
        pose = self.pose(inertial)
        tensor = np.zeros((3, 3)) if tensor_element is None else self._tensor(tensor_element)
        tensor = np.where(abs(tensor) < _DUST * mass, 0.0, tensor)
        found = LinkInertia(mass, np.zeros(3), tensor).moved(pose.matrix, pose.origin)
        return found if mass or tensor.any() else None

    def _tensor(self, element: XmlElement) -> Floats:
        xx, xy, xz, yy, yz, zz = (
            self.number(element, f"i{axes}", 0.0 if axes in ("xy", "xz", "yz") else None)
            for axes in ("xx", "xy", "xz", "yy", "yz", "zz")
        )
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    # ------------------------------------------------------------------------------------------------------ joints

    def _joint(self, element: XmlElement, links: Mapping[str, LinkInertia | None]) -> RobotJoint:
        if not element.get("name"):
            raise self.error(element, "has no name; give it one")
        kind = element.get("type")
        if kind not in _KINDS:
            raise self.error(element, f"type '{kind}' is unknown; {suggestion(kind, _KINDS)}")
        parent, child = (self._end(element, end, links) for end in ("parent", "child"))
        mimic = self.only(element, "mimic") if kind in _ONE else None
        damping, friction = self._resistances(element)
        lower, upper = self._limits(element) if kind in _BOUNDED else (None, None)
        return RobotJoint(
            element.get("name"),
            _KINDS[kind],
            parent,
            child,
            self.pose(element),
            self._axis(element),
            lower,
            upper,
            damping,
            friction,
            None if mimic is None else self._mimic(mimic),
        )

    def _resistances(self, joint: XmlElement) -> tuple[float, float]:
        """Damping and dry friction of a joint, 0 where they are not given."""
        dynamics = self.only(joint, "dynamics")
        if dynamics is None:
            return 0.0, 0.0
        damping, friction = (self.number(dynamics, name, 0.0) for name in ("damping", "friction"))
        if damping < 0.0 or friction < 0.0:
            raise self.error(joint, f"damping {damping:g} and friction {friction:g} must not be negative")
        return damping, friction

    def _limits(self, joint: XmlElement) -> tuple[float | None, float | None]:
        """The lower and upper limit of a joint; both are None where none or equal ones are given."""
        limit = self.only(joint, "limit")
        if limit is None:
            return None, None
        lower, upper = (self.number(limit, side, 0.0) for side in ("lower", "upper"))
        if lower > upper:
            raise self.error(joint, f"its limits have lower = {lower:g} above upper = {upper:g}; exchange them")
        return (lower, upper) if lower != upper else (None, None)

    def _end(self, joint: XmlElement, tag: str, links: Mapping[str, LinkInertia | None]) -> str:
        element = self.only(joint, tag)
        name = "" if element is None else element.get("link")
        if not name:
            raise self.error(joint, f"has no <{tag} link=...>")
        if name not in links:
            raise self.error(joint, f"<{tag}>: there is no link '{name}'; {suggestion(name, links)}")
        return name

    def _axis(self, joint: XmlElement) -> Floats:
        element = self.only(joint, "axis")
        if element is None or joint.get("type") in ("fixed", "floating"):
            return np.array([1.0, 0.0, 0.0])  # the default of URDF
        axis = self.vector(element, "xyz", "1 0 0")
        length = float(np.linalg.norm(axis))
        if not length:
            raise self.error(joint, "its axis is 0 0 0; give a direction")
        return axis / length

    def _mimic(self, element: XmlElement) -> Mimic:
        factor, offset = self.number(element, "multiplier", 1.0), self.number(element, "offset", 0.0)
        return Mimic(element.get("joint"), factor, offset)

    def _check_mimics(self, joints: list[RobotJoint]) -> None:
        """Raise LoadError for a mimic of no joint, of one with other coordinates, and for circles."""
        known = {j.name: j for j in joints if j.kind in ("revolute", "prismatic")}
        for joint in (j for j in joints if j.mimic is not None):
            passed = [joint.name]
            while (mimic := known[passed[-1]].mimic if passed[-1] in known else None) is not None:
                if mimic.leader not in known:
                    remedy = suggestion(mimic.leader, known)
                    raise LoadError(
                        f"{self.where}: joint '{passed[-1]}' mimics '{mimic.leader}': no such joint; {remedy}"
                    )
                if mimic.leader in passed:
                    raise LoadError(f"{self.where}: the joints {', '.join(passed)} mimic each other in a circle")
                passed.append(mimic.leader)

    # -------------------------------------------------------------------------------------------------------- tree

    def _root_of(self, links: Mapping[str, LinkInertia | None], joints: list[RobotJoint]) -> str:
        carried: dict[str, str] = {}
        for joint in joints:
            if joint.child in carried:
                raise LoadError(
                    f"{self.where}: the link '{joint.child}' is the child of two joints, '{carried[joint.child]}' and "
                    f"'{joint.name}'; a robot is a tree: leave one out and close the loop by a constraint in the text"
                )
            carried[joint.child] = joint.name
        roots = [name for name in links if name not in carried]
        if not roots:
            raise LoadError(f"{self.where}: every link is the child of a joint, so that they make a circle")
        if len(roots) > 1:
            raise LoadError(
                f"{self.where}: {len(roots)} links have no parent ({', '.join(roots)}); a robot has one root: connect "
                "the others by joints, fixed ones perhaps"
            )
        return roots[0]

    def _ignored(self) -> Iterator[str]:
        """What is neither read nor known to be without meaning for the motion."""
        others = {e.tag for e in self._root.children} - _READ - _SEEN
        yield from (f"<{tag}>" for tag in sorted(others))
        for element in (e for e in self._root.children if e.tag in _CHILDREN):
            owner = f"of the {element.tag} {element.get('name')}"
            for child in element.children:
                if child.tag not in _CHILDREN[element.tag]:
                    yield f"<{child.tag}> {owner}"
                for attribute in sorted(child.attributes.keys() - _ATTRIBUTES.get(child.tag, child.attributes.keys())):
                    yield f"{attribute} in the <{child.tag}> {owner}"
        yield from (text for e in self._root.all("joint") for text in self._not_of_its_kind(e))
        yield from (text for e in self._root.all("gazebo") for text in _acting(e))

    def _not_of_its_kind(self, joint: XmlElement) -> Iterator[str]:
        """What is read of other kinds of joints, but not of this one."""
        kind, name = joint.get("type"), joint.get("name")
        if kind not in _ONE and joint.child("mimic") is not None:
            yield f"<mimic> of the joint {name}, which is {kind}"
        if kind in ("planar", "floating") and self._resistances(joint)[1]:
            yield f"friction of the joint {name}, which is {kind}"
        limit = joint.child("limit")
        if kind in ("planar", "floating") and limit is not None and {"lower", "upper"} & limit.attributes.keys():
            yield f"limits of the joint {name}, which is {kind}"


def _acting(gazebo: XmlElement) -> Iterator[str]:
    """What acts on the motion of the link or joint that an element ``gazebo`` is about."""
    for child in (child for child in gazebo.children if child.tag in _OF_GAZEBO):
        yield f"<{child.tag}> of {gazebo.get('reference')} in <gazebo>"
