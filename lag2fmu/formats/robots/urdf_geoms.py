"""The collision geometry of a URDF file, on the ground z = 0."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import count
from pathlib import Path

import numpy as np

from lag2fmu.errors import LoadError
from lag2fmu.formats.robots.ground import Ground
from lag2fmu.formats.robots.meshes import corners, read_mesh
from lag2fmu.formats.robots.poses import JointPose
from lag2fmu.formats.robots.tree import Geom, Touch
from lag2fmu.formats.robots.urdf_elements import UrdfElements
from lag2fmu.xml_tree import XmlElement

FRICTION = 1.0
"""The coefficient that Gazebo and MuJoCo take where nothing is said."""
_SHAPES = ("box", "sphere", "cylinder", "capsule", "mesh")


def touches(reader: UrdfElements, robot: XmlElement, ground: Ground) -> tuple[Touch, ...]:
    """What of ``robot`` touches the ground, the plane z = 0 of the world.

    Raises LoadError, with line and remedy, for a link that has no collision geometry, and for a shape without size.
    """
    geoms = [geom for link in robot.all("link") if ground.takes(link.get("name")) for geom in _geoms(reader, link)]
    having = (link.get("name") for link in robot.all("link") if link.child("collision") is not None)
    ground.check_links(having, reader.where)
    plane = Geom("ground", "", "plane", JointPose(np.zeros(3)))
    return tuple(Touch(geom, plane, FRICTION) for geom in geoms)


def _geoms(reader: UrdfElements, link: XmlElement) -> Iterator[Geom]:
    """The shapes of the <collision> elements of a ``link``."""
    name, elements = link.get("name"), list(link.all("collision"))
    numbers = count(1)
    for element in elements:
        geometry = reader.only(element, "geometry")
        shape = next((c for c in geometry.children if c.tag in _SHAPES), None) if geometry is not None else None
        if shape is None:
            raise reader.error(element, f"of the link '{name}' has no shape; give one of {', '.join(_SHAPES)}")
        label = element.get("name") or (f"{name}_{next(numbers)}" if len(elements) > 1 else name)
        yield _geom(reader, shape, label, name, reader.pose(element))


def _geom(reader: UrdfElements, shape: XmlElement, name: str, link: str, pose: JointPose) -> Geom:
    if shape.tag == "mesh":
        scale = reader.vector(shape, "scale", "1 1 1")
        return Geom(name, link, "points", pose, vertices=corners(read_mesh(_file(reader, shape)) * scale))
    if shape.tag == "box":
        if "size" not in shape.attributes:
            raise reader.error(shape, f"of the link '{link}': the attribute 'size' is missing")
        size = tuple(map(float, reader.vector(shape, "size", "") / 2))
    else:
        size = (reader.number(shape, "radius"),)
        size += () if shape.tag == "sphere" else (reader.number(shape, "length") / 2,)
    if min(size) <= 0.0:
        raise reader.error(shape, f"of the link '{link}' has a size that is not positive; correct it")
    return Geom(name, link, shape.tag, pose, size)


def _file(reader: UrdfElements, mesh: XmlElement) -> Path:
    """The file of a ``mesh``: beside the robot's, or in the package that a folder above it is or holds."""
    name, here = mesh.get("filename"), Path(reader.where).resolve().parent
    if not name:
        raise reader.error(mesh, "the attribute 'filename' is missing")
    found = re.fullmatch(r"(package|model)://([^/]+)/(.+)", name)
    if found is None:
        return here / name.removeprefix("file://")
    package, inside = found[2], found[3]
    tried = [folder / package / inside for folder in (here, *here.parents)]
    place = next((path for path in tried if path.is_file()), None)
    if place is None:
        raise LoadError(
            f"{reader.where}, line {mesh.line}, <mesh>: there is no '{name}' in a folder '{package}' above the robot's "
            "file; put it there, or give a path"
        )
    return place
