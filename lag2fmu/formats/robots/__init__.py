"""Descriptions of robots as mechanisms: a tree of links that joints carry."""

from __future__ import annotations

from pathlib import Path

from lag2fmu.errors import LoadError
from lag2fmu.formats.robots.assembly import mechanism_of
from lag2fmu.formats.robots.mjcf import read_mjcf
from lag2fmu.formats.robots.urdf import read_urdf
from lag2fmu.mechanism.completion import Mechanism

READERS = {".urdf": read_urdf, ".xml": read_mjcf}
"""What reads a file of this ending."""


def robot(path: Path, *, base: str = "fixed", stops: bool = False) -> Mechanism:
    """The robot in the file ``path`` as a mechanism.

    Its ``base`` is "fixed", "floating" or "planar"; with ``stops`` the limits of joints are hard stops. Raises
    LoadError with file, line and remedy for what cannot be read, MechanismError for what no mechanism can be.
    """
    if path.suffix == ".xml" and base != "fixed":
        raise LoadError(f"{path}: a MJCF file says itself what moves freely; leave base = {base} out")
    return mechanism_of(READERS[path.suffix](path), path.name, base=base, stops=stops)
