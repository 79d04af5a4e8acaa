"""Robots as descriptions of mechanisms: a tree of links that joints carry."""

from __future__ import annotations

from pathlib import Path

from lag2fmu.description.description import Description
from lag2fmu.errors import LoadError
from lag2fmu.formats.robots.assembly import description_of
from lag2fmu.formats.robots.mjcf import read_mjcf
from lag2fmu.formats.robots.urdf import read_urdf

READERS = {".urdf": read_urdf, ".xml": read_mjcf}
"""{ending of a file: the function that reads it}."""


def robot(path: Path, *, base: str = "fixed", stops: bool = False) -> Description:
    """The robot in the file ``path`` as the description of a mechanism, in SI units.

    Its ``base`` is "fixed", "floating" or "planar"; with ``stops`` the limits of joints are hard stops. Raises
    LoadError, with file, line and remedy, for a file that cannot be read, and MechanismError for a robot that cannot be
    described. Source: the specifications at http://wiki.ros.org/urdf/XML and https://mujoco.readthedocs.io.
    """
    if path.suffix == ".xml" and base != "fixed":
        raise LoadError(f"{path}: a MJCF file says itself what moves freely; leave base = {base} out")
    return description_of(READERS[path.suffix](path), path.name, base=base, stops=stops)
