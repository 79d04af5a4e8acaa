"""Where a part is in the whole: its world becomes a frame of the whole, or in the plane the axes of a point or body.

Places move with this frame. Directions along the world's axes, of gravity, loads and outputs, stay along these.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.places import WORLD, Body, Place, Point, remedy_for
from lag2fmu.errors import MechanismError


def placed(d: Description, parent: str, whole: Description) -> Description:
    """``d`` with its world at the frame, point or body ``parent`` of the ``whole``.

    Raises MechanismError for an unknown ``parent``, for places of another dimension, and for energies that ``d`` states
    itself, because these belong to a world that does not move.
    """
    if parent == WORLD:
        return d
    frames = [x.name for x in whole.frames] + [x.name for x in whole.joints if x.parent is not None]
    planar = {x.name: x for x in whole.places if x.dimension == 2}
    if parent not in frames and parent not in planar:
        known = [WORLD, *frames, *planar]
        raise MechanismError(
            f"parent: there is no frame, nor a point or body in the plane, called '{parent}' in the whole or in a part "
            f"before this one; {remedy_for(parent, known)}"
        )
    _check_energies(d, parent)
    ends = _with_ends(d, parent)
    change = _on_frame if parent in frames else _in_axes
    at: Any = parent if parent in frames else planar[parent]
    return replace(
        ends,
        bodies=tuple(change(x, f"bodies.{x.name}", at) for x in d.bodies),
        points=tuple(change(x, f"points.{x.name}", at) for x in d.points),
    )


def _check_energies(d: Description, parent: str) -> None:
    """Raise MechanismError for an energy that is written in the part's own world."""
    for name in ("kinetic", "potential", "lagrangian"):
        if getattr(d.energy, name) is not None:
            raise MechanismError(
                f"energy.{name}: it counts in a world that does not move, and '{parent}' does; "
                "describe bodies, springs and gravity instead"
            )


def _with_ends(d: Description, parent: str) -> Description:
    """``d`` with ``parent`` in place of the world, in frames, joints, contacts and visuals."""
    return replace(
        d,
        frames=tuple(replace(x, parent=_moved(x.parent, parent)) for x in d.frames),
        joints=tuple(
            replace(x, parent=_moved(x.parent, parent), between=x.between and _ends(x.between, parent))
            for x in d.joints
        ),
        contacts=tuple(replace(x, between=x.between and _ends(x.between, parent)) for x in d.contacts),
        visuals=tuple(replace(x, frame=_moved(x.frame, parent)) for x in d.visuals),
    )


def _moved(name: Any, parent: str) -> Any:
    return parent if name == WORLD else name


def _ends(ends: Any, parent: str) -> tuple[Any, ...]:
    return tuple(_moved(end, parent) for end in ends)


def _on_frame(part: Any, where: str, frame: str) -> Any:
    """The body or point ``part`` in space, on ``frame`` if it was in the world."""
    if part.frame is not None:
        return replace(part, frame=_moved(part.frame, frame))
    if part.position is None or part.dimension == 2:
        what = "only turns" if part.position is None else "is planar"
        raise MechanismError(f"{where}: it {what}, and the parent '{frame}' is a frame in space; give it a frame")
    if isinstance(part, Point):
        return replace(part, frame=frame)
    return replace(part, frame=frame, center=part.position, position=None)


def _in_axes(part: Body | Point, where: str, at: Place) -> Any:
    """The planar body or point ``part``, moved and turned by the place ``at``."""
    if part.frame is not None or (part.position is not None and part.dimension != 2):
        raise MechanismError(f"{where}: it is in space, and the parent is in the plane; give a frame as the parent")
    turn = sp.S.Zero if at.angle is None else sp.sympify(at.angle)
    angle = None if part.angle is None else part.angle + turn
    if part.position is None:
        return replace(part, angle=angle)
    (x0, y0), (x, y), c, s = at.position or (), part.position, sp.cos(turn), sp.sin(turn)
    return replace(part, position=(x0 + c * x - s * y, y0 + s * x + c * y), angle=angle)
