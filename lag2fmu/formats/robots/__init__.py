"""Robots as descriptions of mechanisms: a tree of links that joints carry.

Their modules are imported when a robot is read, because most mechanisms are none.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from lag2fmu.description.description import Description
from lag2fmu.errors import LoadError

ENDINGS = (".urdf", ".xml")
"""The endings of the files that ``robot`` reads."""
SOURCES = {".xacro": "a file of macros, which 'xacro' writes out as URDF"}
"""What files are from which those of robots are made, by their endings."""


def robot(
    path: Path,
    *,
    base: str = "fixed",
    stops: bool = False,
    pose: Mapping[str, object] | str | None = None,
    **contacts: object,
) -> Description:
    """The robot in the file ``path`` as the description of a mechanism, in SI units.

    Its ``base`` is "fixed", "floating" or "planar"; with ``stops`` the limits of joints are hard stops. It starts in
    the ``pose``, see ``posed``. ``contacts``: ground, friction, restitution, law and pairs, see ``ground_of``. Raises
    LoadError, with file, line and remedy, for a file that cannot be read or a pose that it cannot take, and
    MechanismError for a robot that cannot be described. Source: the specifications at http://wiki.ros.org/urdf/XML and
    https://mujoco.readthedocs.io.
    """
    if path.suffix == ".xml" and base != "fixed":
        raise LoadError(f"{path}: a MJCF file says itself what moves freely; leave base = {base} out")
    if path.suffix != ".xml" and contacts.get("pairs"):
        raise LoadError(f"{path}: a URDF file does not say which links touch each other; leave pairs out")
    from lag2fmu.formats.robots.assembly import description_of
    from lag2fmu.formats.robots.ground import ground_of
    from lag2fmu.formats.robots.mjcf import read_mjcf
    from lag2fmu.formats.robots.posing import posed
    from lag2fmu.formats.robots.urdf import read_urdf

    read = read_mjcf if path.suffix == ".xml" else read_urdf
    ground = ground_of(contacts, str(path))
    found = posed(read(path, ground), pose or {}, str(path))
    return description_of(found, path, base=base, stops=stops, ground=ground)
