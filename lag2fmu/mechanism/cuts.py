"""Where a tree of frames can be cut: the joint by which a frame moves on its parent."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.joints import direction
from lag2fmu.description.places import WORLD, Frame, Rotation
from lag2fmu.errors import MechanismError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.language.vocabulary import symbol, value_of
from lag2fmu.mechanism.poses import Poses

_WHY = "which no joint between FMUs does; cut at a frame that turns about one axis, slides along one, or turns freely"


@dataclass(frozen=True)
class Cut:
    """The ``frame`` and the joint on its parent.

    - ``kind`` of the joint, ``axis``: 3 numbers in the axes of both ends.
    - ``coordinates``: those of the joint, which go with it; a single one is 1/``scale`` times the joint's angle (rad)
      or way (m).
    - ``seat``: a new frame on the parent, and ``pin``: one on the frame; both coincide but for the joint's motion.
    """

    frame: str
    kind: str
    axis: tuple[float, float, float]
    coordinates: tuple[str, ...]
    scale: float
    seat: Frame
    pin: Frame


def cut_at(d: Description, name: str, values: Mapping[str, float]) -> Cut:
    """The cut at ``name``: a frame, or the coordinate by which one frame moves.

    ``values``: {parameter: SI value}. Raises MechanismError if there is none, or its joint is no joint between FMUs.
    """
    frame = _frame(d, name)
    where = f"--at {name}"
    if str(frame.parent) == WORLD:
        raise MechanismError(f"{where}: '{frame.name}' stands on the world; there is nothing on the other side of it")
    moving = {symbol(q.name) for q in d.coordinates}
    origin = sp.Matrix([Poses(d).resolved(x) for x in frame.origin])
    turns = tuple(Rotation(turn.axis, Poses(d).resolved(turn.angle)) for turn in _turns(frame))
    turning = [i for i, turn in enumerate(turns) if turn.angle.free_symbols & moving]
    own = sorted({s.name for x in (*origin, *(t.angle for t in turns)) for s in x.free_symbols & moving})
    slides = bool(origin.free_symbols & moving)
    constant = all(x.free_symbols <= {symbol(p) for p in values} | moving for x in (*origin, *(t.angle for t in turns)))
    if frame.quaternion is not None or not constant or (slides and turning):
        raise MechanismError(f"{where}: '{frame.name}' turns by a quaternion, by time, or slides and turns, {_WHY}")
    seat, pin = f"{frame.name}_seat", Frame(f"{frame.name}_pin", frame.name)
    if not own:
        return Cut(frame.name, "fixed", (0.0, 0.0, 1.0), (), 1.0, Frame(seat, frame.parent, origin, turns), pin)
    if len(own) == len(turning) == 3 and not slides:
        still = Frame(seat, frame.parent, origin)
        return Cut(frame.name, "spherical", (0.0, 0.0, 1.0), tuple(own), 1.0, still, pin)
    if len(own) > 1 or len(turning) > 1:
        raise MechanismError(f"{where}: '{frame.name}' moves by {', '.join(own)}, {_WHY}")
    q = symbol(own[0])
    if slides:
        return _sliding(d, frame, q, origin, values)
    (i,) = turning
    axis, scale = _unit(direction(turns[i].axis), values), _slope(turns[i].angle, q, where, values)
    back = tuple(Rotation(a, -angle) for a, angle in reversed(turns[i + 1 :]))
    rest = Rotation(turns[i].axis, turns[i].angle.xreplace({q: sp.S.Zero}))
    still = Frame(seat, frame.parent, origin, (*turns[:i], rest))
    return Cut(frame.name, "revolute", axis, (q.name,), scale, still, Frame(pin.name, frame.name, rotations=back))


def _frame(d: Description, name: str) -> Frame:
    """The frame called ``name``, or the one that moves by the coordinate ``name``."""
    frames = {frame.name: frame for frame in d.frames}
    if name in frames:
        return frames[name]
    coordinates = [q.name for q in d.coordinates]
    found = [frame for frame in d.frames if symbol(name) in _symbols(frame)]
    if name in coordinates and len(found) == 1:
        return found[0]
    if name in coordinates:
        raise MechanismError(f"--at {name}: this coordinate moves {len(found)} frames; name the frame to cut at")
    remedy = suggestion(name, [*frames, *coordinates])
    raise MechanismError(f"--at {name}: there is no frame or coordinate '{name}'; {remedy}")


def _turns(frame: Frame) -> tuple[Rotation, ...]:
    return tuple(Rotation(*turn) for turn in frame.rotations)  # type: ignore[arg-type]


def _symbols(frame: Frame) -> set[sp.Symbol]:
    expressions = (*frame.origin, *(turn.angle for turn in _turns(frame)), *(frame.quaternion or ()))
    return {s for x in expressions for s in sp.sympify(x).free_symbols}


def _sliding(d: Description, frame: Frame, q: sp.Symbol, origin: sp.Matrix, values: Mapping[str, float]) -> Cut:
    """The cut of a ``frame`` whose ``origin`` moves by ``q``."""
    along = origin.diff(q)
    if along.free_symbols & {symbol(x.name) for x in d.coordinates}:
        raise MechanismError(f"--at {frame.name}: it slides along a curve, {_WHY}")
    turned = Poses(d).pose(frame.name, str(frame.parent)).rotation.T * along
    entries = [value_of(x, values) for x in turned]
    scale = math.hypot(*entries)
    axis = _unit(sp.Matrix(entries) / scale, values)
    seat = Frame(f"{frame.name}_seat", frame.parent, origin.xreplace({q: sp.S.Zero}), frame.rotations)
    return Cut(frame.name, "prismatic", axis, (q.name,), scale, seat, Frame(f"{frame.name}_pin", frame.name))


def _unit(vector: sp.Matrix, values: Mapping[str, float]) -> tuple[float, float, float]:
    x, y, z = (value_of(entry, values) for entry in vector)
    return x, y, z


def _slope(angle: sp.Expr, q: sp.Symbol, where: str, values: Mapping[str, float]) -> float:
    """d angle/dq; raises MechanismError unless it is constant."""
    slope = angle.diff(q)
    if q in slope.free_symbols:
        raise MechanismError(f"{where}: the angle {angle} is not proportional to {q}, {_WHY}")
    return value_of(slope, values)
