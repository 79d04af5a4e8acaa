"""Warnings of contacts whose friction is wrong because the gap is no distance, or the slip no tangential velocity.

The force acts along the slope of the gap, and friction is a part of this force. So a gap such as y - x**2 above a curve
does not do: for each metre along the normal it grows by more than a metre. This is tried where it can be told, by
coordinates that move bodies as a whole, along two or three axes at right angles. Along them, where the gap is 0, its
slope and the slip's coefficients are vectors of the same length at right angles to each other.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterable, Iterator, Sequence
from itertools import combinations

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.names import velocity
from lag2fmu.description.places import WORLD, Body
from lag2fmu.language.units import METRE
from lag2fmu.language.vocabulary import symbol, value_of
from lag2fmu.mechanism.completed import Unilateral
from lag2fmu.mechanism.geometry import Values, values_of
from lag2fmu.mechanism.poses import Poses, poses_of

_TRIALS = 6
"""Random places at which gaps are looked at, beside the start."""
_TYPED = 1e-3
"""A length or a cosine that differs by less is one that was rounded."""
_STEPS = 20
"""Newton's method from a random place to where a contact touches."""
_NO_VALUE = (KeyError, ValueError, ArithmeticError)

Vector = tuple[float, ...]
Axes = dict[str, Vector]
"""{coordinate: how it moves bodies, (3,)}"""


def skewed_contacts(m: Description, found: Iterable[Unilateral]) -> Iterator[str]:
    """A warning for each contact among ``found`` whose friction is not the part of the normal force that it should be.

    Contacts of a kind, such as sphere_plane, are right by themselves.
    """
    written = {f"contacts.{contact.name}" for contact in m.contacts if contact.kind is None}
    rubbing = [u for u in found if u.where in written and u.slips and u.unit in (None, METRE)]
    if not rubbing:
        return
    poses, known = poses_of(m), values_of(m)
    frames = _translations(m, poses, known)
    for contact in rubbing:
        rows = [poses.resolved(x) for x in (contact.gap, *contact.slips)]
        told = (_skew(m, contact, rows, [*axes], known) for axes in frames)
        yield from [text for text in told if text is not None][:1]


def _translations(m: Description, poses: Poses, known: Values) -> list[Axes]:
    """The sets of coordinates that move the same bodies along all axes at right angles, and turn none of them."""
    moved: dict[frozenset[str], Axes] = {}
    places = {body.name: _place(body, poses) for body in m.bodies if body.position or body.frame}
    coordinates = [q.name for q in m.coordinates]
    for name in coordinates:
        ways = {
            body: _constant(origin.diff(symbol(name)), turn, name, {*coordinates}, known)
            for body, (origin, turn) in places.items()
            if symbol(name) in origin.free_symbols | turn.free_symbols
        }
        first = next(iter(ways.values()), ())
        if first and all(way and math.dist(way, first) <= _TYPED for way in ways.values()):
            moved.setdefault(frozenset(ways), {})[name] = first
    return [axes for axes in moved.values() if len(axes) == m.dimension and _are_square([*axes.values()], 1.0)]


def _place(body: Body, poses: Poses) -> tuple[sp.Matrix, sp.Matrix]:
    """A point of the body, (3, 1), and what tells how it is turned."""
    if body.frame is not None:
        pose = poses.pose(str(body.frame), WORLD)
        return pose.origin, pose.rotation
    return poses.column(body.position or ()), sp.Matrix([poses.resolved(body.angle or 0)])


def _constant(way: sp.Matrix, turn: sp.Matrix, name: str, coordinates: set[str], known: Values) -> Vector:
    """The value (3,) of how a coordinate moves a body; () if that depends on the motion, or the body turns."""
    if symbol(name) in turn.free_symbols or {str(x) for x in way.free_symbols} & coordinates:
        return ()
    return _values(list(way), known)


def _values(row: Iterable[sp.Expr], at: Values) -> Vector:
    """The values of a ``row`` of expressions in SI units; () if one has none."""
    try:
        return tuple(value_of(x, at) for x in row)
    except _NO_VALUE:
        return ()


def _are_square(rows: Sequence[Vector], length: float) -> bool:
    """Are all ``rows`` of this ``length``, and at right angles to each other?"""
    lengths = all(abs(math.hypot(*row) - length) <= _TYPED * length for row in rows)
    return lengths and not _leaning(rows)


def _leaning(rows: Sequence[Vector]) -> bool:
    """Are two ``rows`` not at right angles?"""
    return any(
        abs(sum(x * y for x, y in zip(a, b, strict=True))) > _TYPED * math.hypot(*a) * math.hypot(*b)
        for a, b in combinations(rows, 2)
    )


def _skew(
    m: Description, contact: Unilateral, rows: Sequence[sp.Expr], names: Sequence[str], known: Values
) -> str | None:
    """The warning of a contact whose ``rows`` are gap and slips; None if friction is right along the axes ``names``."""
    slopes = [[rows[0].diff(symbol(name)) for name in names]]
    slopes += [[row.diff(symbol(velocity(name))) for name in names] for row in rows[1:]]
    for at in _places(m, known):
        if any(slope != 0 for slope in slopes[0]) and _touch(rows[0], slopes[0], names, at):
            found = [vector for row in slopes if any(vector := _values(row, at))]
            if len(found) == len(slopes) and not _are_square(found, math.hypot(*found[0])):
                return _sentence(contact, {name: at[name] for name in names}, found)
    return None


def _places(m: Description, known: Values) -> Iterator[Values]:
    """Values of everything at the start, and at random places about it."""
    chance = random.Random(0)
    for spread in (0.0, *[1.0] * _TRIALS):
        moving = {q.name: q.start + spread * q.nominal * chance.uniform(-1, 1) for q in m.coordinates}
        yield known | moving | {velocity(q.name): q.velocity for q in m.coordinates}


def _touch(gap: sp.Expr, slopes: Sequence[sp.Expr], names: Sequence[str], at: Values) -> bool:
    """Move the coordinates ``names`` of ``at`` along the slopes to where the gap is 0; False if there is none."""
    for _ in range(_STEPS):
        found = _values((gap, *slopes), at)
        if not any(found[1:]):
            return False
        share = found[0] / sum(x * x for x in found[1:])
        moves = [share * x for x in found[1:]]
        at |= {name: at[name] - move for name, move in zip(names, moves, strict=True)}
        if max(map(abs, moves)) <= _TYPED * max(abs(at[name]) for name in names):
            return True
    return False


def _sentence(contact: Unilateral, at: Values, found: Sequence[Vector]) -> str:
    """What is wrong with the slopes ``found`` of gap and slips, where the contact touches ``at`` these coordinates."""
    grows, *slips = (f"{math.hypot(*row):.4g}" for row in found)
    return (
        f"{contact.where}: friction is not {contact.name}_force times its coefficient. Where "
        f"{', '.join(f'{name} = {x:.4g}' for name, x in at.items())}, the gap grows by {grows} m for each metre along "
        f"its normal, and the slip by {' and '.join(slips)} m/s for each m/s"
        f"{', not at right angles to the normal' if _leaning(found) else ''}. Give a distance, as "
        "(y - f)/sqrt(1 + s**2) above a curve y = f of the slope s, and the velocity along it, as "
        "(x_dot + s*y_dot)/sqrt(1 + s**2)"
    )
