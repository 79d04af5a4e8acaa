"""Robots as descriptions of mechanisms: a tree of links that joints carry."""

from __future__ import annotations

from pathlib import Path

from lag2fmu.description.record import Description
from lag2fmu.errors import LoadError
from lag2fmu.formats.robots.assembly import description_of
from lag2fmu.formats.robots.mjcf import read_mjcf
from lag2fmu.formats.robots.urdf import read_urdf

READERS = {".urdf": read_urdf, ".xml": read_mjcf}
"""What reads a file of this ending."""


def robot(path: Path, *, base: str = "fixed", stops: bool = False) -> Description:
    """The robot in the file ``path`` as a mechanism is described.

    Its ``base`` is "fixed", "floating" or "planar"; with ``stops`` the limits of joints are hard stops. Raises
    LoadError with file, line and remedy for what cannot be read, MechanismError for what no description can be.
    """
    if path.suffix == ".xml" and base != "fixed":
        raise LoadError(f"{path}: a MJCF file says itself what moves freely; leave base = {base} out")
    return description_of(READERS[path.suffix](path), path.name, base=base, stops=stops)
