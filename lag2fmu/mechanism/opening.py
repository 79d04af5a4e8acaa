"""A mechanism written out for cutting, and the places where it is cut."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from lag2fmu.description.description import Description, label_of, table_keys
from lag2fmu.description.places import Frame, Point
from lag2fmu.description.ports import Ports
from lag2fmu.errors import MechanismError
from lag2fmu.mechanism.cut import Cut
from lag2fmu.mechanism.frame_cuts import frame_cut_at
from lag2fmu.mechanism.geometry import values_of
from lag2fmu.mechanism.plane_cuts import plane_cut_at
from lag2fmu.mechanism.poses import poses_of
from lag2fmu.mechanism.record import Mechanism


def opened(m: Mechanism) -> Description:
    """``m`` without parts, joints on a parent and ports: they are written out, as frames, coordinates and loads.

    Raises MechanismError for filtered motions.
    """
    if m.filtered:
        raise MechanismError(f"the motion '{m.filtered[0]}' is filtered; a mechanism with filters is not cut")
    brought = {place for place, origin in m.origins.items() if origin.startswith(("joints.", "contacts.", "frames."))}
    tables = {name: getattr(m, name) for name in table_keys() if name not in ("parts", "ports", "joints")}
    for name in ("constraints", "outputs", "dampers", "definitions"):
        tables[name] = tuple(x for x in tables[name] if f"{name}.{label_of(x)}" not in brought)
    joints = tuple(joint for joint in m.joints if joint.between is not None)
    tables["constraints"] += m.latches
    found = replace(m.description, parts=(), joints=joints, ports=Ports(), **tables)
    return found if found.frames else _without_definitions(found)


def _without_definitions(d: Description) -> Description:
    """``d`` with positions and angles of bodies and points in which definitions are written out."""

    def resolved(place: Any) -> Any:
        position = None if place.position is None else tuple(map(poses.resolved, place.position))
        angle = None if place.angle is None else poses.resolved(place.angle)
        return replace(place, position=position, angle=angle)

    poses = poses_of(d)
    return replace(d, bodies=tuple(map(resolved, d.bodies)), points=tuple(map(resolved, d.points)))


def cuts_of(d: Description, at: Iterable[str]) -> tuple[Cut, ...]:
    """The cuts of ``d``, as ``opened`` gives it, at the frames or coordinates ``at``. Raises MechanismError."""
    found = tuple(frame_cut_at(d, name, values_of(d)) if d.frames else plane_cut_at(d, name) for name in at)
    roots = [cut.root for cut in found]
    twice = next((root for i, root in enumerate(roots) if root in roots[:i]), None)
    if twice is not None:
        raise MechanismError(f"--at {twice}: is given twice; leave one out")
    return found


def with_probes(d: Description, cuts: Sequence[Cut]) -> Description:
    """``d`` with outputs PROBE_position_x, ... of pose and velocity of all pieces that are cut off."""
    spots = [cut.measured for cut in cuts]
    return replace(with_places(d, [cut.probe for cut in cuts]), ports=Ports(poses=spots, velocities=spots))


def with_places(d: Description, places: Iterable[Frame | Point]) -> Description:
    """``d`` with more frames and points."""
    found = tuple(places)
    frames = tuple(x for x in found if isinstance(x, Frame))
    points = tuple(x for x in found if isinstance(x, Point))
    return replace(d, frames=(*d.frames, *frames), points=(*d.points, *points))
