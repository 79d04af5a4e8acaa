"""The shapes in a URDF file: what touches the ground z = 0, and what is seen."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import count
from pathlib import Path

import numpy as np

from lag2fmu.description.visuals import find_file
from lag2fmu.errors import LoadError
from lag2fmu.formats.robots.ground import Ground
from lag2fmu.formats.robots.meshes import corners, read_mesh
from lag2fmu.formats.robots.poses import JointPose
from lag2fmu.formats.robots.tree import Geom, Look, Touch
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


def looks(reader: UrdfElements, robot: XmlElement) -> tuple[Look, ...]:
    """What is seen of the links of ``robot``; raises LoadError for a shape without size or a mesh without a file."""
    named = {m.get("name"): _color(reader, m) for m in robot.all("material")}
    found = [(link.get("name"), link.all("visual")) for link in robot.all("link")]
    return tuple(
        x for name, seen in found for k, e in enumerate(seen) for x in _look(reader, e, f"{name}_{k}", name, named)
    )


def _look(reader: UrdfElements, element: XmlElement, name: str, link: str, named: Mapping[str, str]) -> Iterator[Look]:
    """The <visual> ``element`` of a ``link``, nothing without a shape; ``named`` are the colors of materials."""
    shape, material = _shape(reader, element), reader.only(element, "material")
    if shape is None:
        return
    color = "" if material is None else _color(reader, material) or named.get(material.get("name"), "")
    name, pose = element.get("name") or name.removesuffix("_0"), reader.pose(element)
    if shape.tag != "mesh":
        size = _size(reader, shape, link)
        yield Look(name, link, shape.tag, pose, size, color=color)
    elif not shape.get("filename"):
        raise reader.error(shape, "the attribute 'filename' is missing")
    else:
        scale = tuple(map(float, reader.vector(shape, "scale", "1 1 1")))
        yield Look(name, link, shape.tag, pose, () if set(scale) == {1.0} else scale, shape.get("filename"), color)


def _color(reader: UrdfElements, material: XmlElement) -> str:
    """The color of a ``material`` as #rrggbb, "" where it has none or none between 0 and 1."""
    element = material.child("color")
    try:
        shares = [] if element is None else [float(x) for x in element.get("rgba").split()]
    except ValueError:
        return ""
    fit = len(shares) == 4 and all(0.0 <= x <= 1.0 for x in shares)
    return "#" + "".join(f"{round(255 * x):02x}" for x in shares[:3]) if fit else ""


def _shape(reader: UrdfElements, element: XmlElement) -> XmlElement | None:
    """The shape in the <geometry> of an ``element``, None without."""
    geometry = reader.only(element, "geometry")
    return next((c for c in geometry.children if c.tag in _SHAPES), None) if geometry is not None else None


def _geoms(reader: UrdfElements, link: XmlElement) -> Iterator[Geom]:
    """The shapes of the <collision> elements of a ``link``."""
    name, elements = link.get("name"), list(link.all("collision"))
    numbers = count(1)
    for element in elements:
        shape = _shape(reader, element)
        if shape is None:
            raise reader.error(element, f"of the link '{name}' has no shape; give one of {', '.join(_SHAPES)}")
        label = element.get("name") or (f"{name}_{next(numbers)}" if len(elements) > 1 else name)
        yield _geom(reader, shape, label, name, reader.pose(element))


def _geom(reader: UrdfElements, shape: XmlElement, name: str, link: str, pose: JointPose) -> Geom:
    if shape.tag == "mesh":
        scale = reader.vector(shape, "scale", "1 1 1")
        return Geom(name, link, "points", pose, vertices=corners(read_mesh(_file(reader, shape)) * scale))
    size = _size(reader, shape, link)
    halves = tuple(x / 2 for x in size) if shape.tag == "box" else (size[0], *(x / 2 for x in size[1:]))
    return Geom(name, link, shape.tag, pose, halves)


def _size(reader: UrdfElements, shape: XmlElement, link: str) -> tuple[float, ...]:
    """The edges of a box, else the radius and, unless of a sphere, the length, in m."""
    if shape.tag == "box":
        if "size" not in shape.attributes:
            raise reader.error(shape, f"of the link '{link}': the attribute 'size' is missing")
        size = tuple(map(float, reader.vector(shape, "size", "")))
    else:
        size = (reader.number(shape, "radius"),)
        size += () if shape.tag == "sphere" else (reader.number(shape, "length"),)
    if min(size) <= 0.0:
        raise reader.error(shape, f"of the link '{link}' has a size that is not positive; correct it")
    return size


def _file(reader: UrdfElements, mesh: XmlElement) -> Path:
    """The file of a ``mesh``: beside the robot's, or in the package that a folder above it is or holds."""
    name = mesh.get("filename")
    if not name:
        raise reader.error(mesh, "the attribute 'filename' is missing")
    folder = Path(reader.where).parent
    place = find_file(name, folder)
    if place is None and "://" in name:
        package = name.partition("://")[2].partition("/")[0]
        raise LoadError(
            f"{reader.where}, line {mesh.line}, <mesh>: there is no '{name}' in a folder '{package}' above the robot's "
            "file; put it there, or give a path"
        )
    return place or folder / name
