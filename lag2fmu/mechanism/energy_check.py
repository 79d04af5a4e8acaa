"""Do energies jump? What has masses, potentials or places that jump is refused; kinks without a jump are allowed.

A jump of the energy is an impact, which no force makes: the equations of motion, which have the slopes of the energies
alone, would pass it without a word. Whether a kink is a jump is tried at its border: at random points the margin's root
is found, and the values on both sides are compared at two distances from it.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import pairwise

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.description import Description
from lag2fmu.errors import MechanismError
from lag2fmu.language.parts_of import free_names
from lag2fmu.language.vocabulary import Choice, TableCall, symbol
from lag2fmu.language.writer import to_quote
from lag2fmu.mechanism.geometry import values_of
from lag2fmu.mechanism.poses import Poses, poses_of
from lag2fmu.mechanism.starts import value_at

_JUMPING = (Choice, sp.sign, sp.Heaviside)
_PARTS = ("energy", "bodies", "frames", "gravity")
"""The tables whose entries enter energies, each by itself. Points do so as ends of springs."""

_PLACES = ("position", "angle", "origin", "rotations", "center")
_CORNERS = (*_JUMPING, sp.Abs, sp.Min, sp.Max)

_TRIALS = 12
"""Random states at which energies are looked at."""
_NEAR, _NEARER = 1e-8, 1e-11
"""Distances from a border, as parts of the size of what moves; a jump is the same at both."""
_ROUNDING = 1e-9
"""Values are equal up to this part of them."""
_RANGES = (1.0, 10.0, 100.0, 1e4)
"""In nominal values: the distances from the start, one after the other, within which a border is looked for."""
_CELLS, _BISECTIONS = 24, 80
"""Pieces of a range in which a border is looked for, and the bisections that follow: down to a double's last bit."""

Numbers = dict[str, float]


def check_energies(m: Description) -> None:
    """Raise MechanismError for the first mass, potential, energy or place of ``m`` that jumps during a motion."""
    for where, kink, (mover, place, height) in _jumps(m, _borders, _energies(m, poses_of(m))):
        raise MechanismError(
            f"{where}: '{to_quote(kink)}' makes it jump by {height:.3g} (SI) where {mover} = {place:.6g}, and "
            f"no force makes the energy jump; {_REMEDY}"
        )


def cut_angles(m: Description) -> Iterator[str]:
    """Warnings of potentials, energies and gaps of ``m`` that jump where an angle by atan2 passes from pi to -pi.

    They are no errors: the spring of a joint that never turns so far is right.
    """
    poses = poses_of(m)
    gaps = [(f"contacts.{c.name}.gap", poses.resolved(sp.sympify(c.gap))) for c in m.contacts if c.gap is not None]
    energies = [(where, x) for where, x in _energies(m, poses) if where.startswith(("energy.", "springs."))]
    for where, angle, (mover, place, height) in _jumps(m, _cuts, [*energies, *gaps]):
        remedy = _TURNS if where.endswith(".gap") else _WHOLE_TURNS
        yield (
            f"{where}: jumps by {height:.3g} (SI) where '{to_quote(angle)}' passes from pi to -pi, as at {mover} = "
            f"{place:.6g}; {remedy}"
        )


def bent_places(m: Description) -> Iterator[str]:
    """Warnings of places of ``m`` that have corners, at which what is fixed there changes its speed by itself.

    Coordinates and velocities go on there, so that kinetic energy and momenta jump. They are no errors: the motion may
    not come there.
    """
    poses, known, sizes = poses_of(m), values_of(m), _sizes(m)
    places: dict[str, list[sp.Expr]] = {}
    for entry in m.entries():
        if entry.table in ("bodies", "frames") and entry.key.field in _PLACES:
            places.setdefault(entry.where.partition("[")[0], []).append(poses.resolved(entry.expression))
    for where, entries in places.items():
        for part in sorted(set().union(*(x.atoms(*_CORNERS) for x in entries)), key=str):
            square = sp.Add(*(poses.rate(x) ** 2 for x in entries))
            margin = part.args[0] - part.args[1] if isinstance(part, (sp.Min, sp.Max)) else part.args[0]
            moves = bool(free_names([margin]) & sizes.keys())
            found = _jump(_with_values(square), _with_values(margin), known, sizes) if moves else None
            if found is not None:
                mover, place, height = found
                yield (
                    f"{where}: the square of its rate jumps by {height:.3g} (SI) at the corner of '{to_quote(part)}', "
                    f"as at {mover} = {round(place, 12) + 0.0:.6g}, and no force makes this energy; round the corner "
                    "off, as sqrt(x**2 + w**2) for abs(x) with a small width w"
                )


Borders = Iterator[tuple[sp.Expr, sp.Expr]]
"""(part of an expression, what is 0 where it may jump)"""


_WHOLE_TURNS = (
    "no force does that work: let the motion stay on one side, or measure the angle by a coordinate of its own, which "
    "counts whole turns"
)
_TURNS = (
    "the contact does not see that jump: give each face a contact of its own, or let a condition turn there, as in "
    "if(y >= 0, pi/2 + atan2(-x, y), -pi/2 + atan2(x, -y)) for atan2(y, x)"
)


def _jumps(
    m: Description, borders: Callable[[sp.Expr], Borders], parts: Iterable[tuple[str, sp.Expr]]
) -> Iterator[tuple[str, sp.Expr, tuple[str, float, float]]]:
    """(place of one of ``parts``, what in it jumps, (what moves, where, height of the jump)), in SI units."""
    known = values_of(m)
    sizes = _sizes(m)
    for where, expression in parts:
        for part, margin in borders(expression):
            moves = bool(free_names([margin]) & sizes.keys())
            found = _jump(_with_values(expression), margin, known, sizes) if moves else None
            if found is not None:
                yield where, part, found


_REMEDY = (
    "model a wall as a contact or stop, what catches or lets go as a constraint with 'while', and what changes quickly "
    "by a smooth function, as (1 + tanh(s/w))/2 with a small width w for heaviside(s)"
)


def _borders(expression: sp.Expr) -> Borders:
    """Kinks of ``expression``, and poles as in x/abs(x) and atan(1/x).

    Angles by atan2 and tan are left out: they jump by whole turns, which turns nothing.
    """
    margins = {kink: kink.args[0] for kink in expression.atoms(*_JUMPING)}
    for pole in (e for e in expression.atoms(sp.Pow) if e.exp.could_extract_minus_sign()):
        if not all(a.is_Pow and a.exp.is_even for a in sp.Add.make_args(pole.base)):  # squares change no sign
            margins[pole] = pole.base.args[0] if isinstance(pole.base, sp.Abs) else pole.base
    for part in sorted(margins, key=str):
        yield part, _with_values(margins[part])


def _cuts(expression: sp.Expr) -> Borders:
    """Angles by atan2(y, x) in ``expression``: y, which has a value only where x < 0."""
    for angle in sorted(expression.atoms(sp.atan2), key=str):
        y, x = (_with_values(e) for e in angle.args)
        side = sp.sqrt(-x)
        if not side.has(sp.I) and _differs_by_a_turn(expression, angle):  # with I, x is always positive
            yield angle, y * side


def _differs_by_a_turn(expression: sp.Expr, angle: sp.Expr) -> bool:
    """Whether ``expression`` is another one for ``angle`` = pi and -pi, at random values of all that is in it."""
    sides = [_with_values(expression.xreplace({angle: side})) for side in (sp.pi, -sp.pi)]
    generator = random.Random(7)
    for _ in range(3):
        point = {name: generator.uniform(0.1, 1.0) for name in sorted(free_names(sides))}
        one, other = (value_at(side, point) for side in sides)
        if one is None or other is None or abs(one - other) > _ROUNDING * max(abs(one), abs(other)):
            return True
    return False


def _energies(m: Description, poses: Poses) -> Iterator[tuple[str, sp.Expr]]:
    """(place, expression with definitions written out) of what energies are made of."""
    for spring in m.springs:
        if spring.elongation is not None:
            energy = sp.sympify(spring.stiffness) * sp.sympify(spring.elongation) ** 2 / 2
            yield f"springs.{spring.name}", poses.resolved(energy)
    chosen = {"springs": {spring.name for spring in m.springs if spring.between is not None}}
    chosen["points"] = {str(end) for spring in m.springs for end in spring.between or ()}
    for entry in m.entries():
        entering = entry.table in _PARTS or (entry.table in chosen and entry.part.name in chosen[entry.table])
        if entering and entry.key.field != "dissipation":
            yield entry.where, poses.resolved(entry.expression)


def _sizes(m: Description) -> dict[str, tuple[float, float]]:
    """{name of what moves: (about where it begins, by how much it moves)}, in SI units."""
    sizes = {q.name: (q.start, q.nominal) for q in m.coordinates}
    sizes |= {names.velocity(q.name): (q.velocity, q.nominal) for q in m.coordinates}
    sizes |= {u.name: (u.start, abs(u.start) or 1.0) for u in m.inputs}
    for u in m.motions:
        sizes |= {names.velocity(u.name): (0.0, 1.0), names.acceleration(u.name): (0.0, 1.0)}
    sizes |= {z.name: (z.start, z.nominal) for z in m.states}
    stop = m.experiment.stop_time
    return sizes | {"t": (0.5 * stop, 0.5 * stop)}


def _with_values(expression: sp.Expr) -> sp.Expr:
    """``expression`` with a smooth function in place of tables, which are continuous but have no values here."""
    stand_ins = {
        call: sp.Add(*(sp.sin(x + i + len(call.table)) for i, x in enumerate(call.args)))
        for call in expression.atoms(TableCall)
    }
    return expression.xreplace(stand_ins) if stand_ins else expression


def _jump(
    expression: sp.Expr, margin: sp.Expr, known: Mapping[str, float], sizes: Mapping[str, tuple[float, float]]
) -> tuple[str, float, float] | None:
    """(what moves, where its border is, height of the jump), in SI units; None if no jump is found."""
    used = sorted(free_names([expression, margin]))
    movers = [name for name in used if name in sizes and symbol(name) in margin.free_symbols]
    generator = random.Random(7)
    for trial in range(_TRIALS):
        point = {name: known.get(name, 1.0) for name in used}
        for name in used:
            if name in sizes:
                start, size = sizes[name]
                point[name] = start + size * generator.uniform(-1.0, 1.0)
        shift = generator.random() if trial else 0.0
        for mover in movers:
            border = _border(margin, point, mover, sizes[mover], shift)
            height = None if border is None else _height(expression, point | {mover: border}, mover, sizes[mover][1])
            if border is not None and height is not None:
                return mover, border, height
    return None


def _along(expression: sp.Expr, point: Numbers, mover: str) -> Callable[[float], float | None]:
    """``expression`` as a function of ``mover``, everything else being as at the ``point``; None without a value."""

    def value(x: float) -> float | None:
        found = value_at(expression, point | {mover: x})
        return found if found is not None and math.isfinite(found) else None

    return value


def _border(margin: sp.Expr, point: Numbers, mover: str, of: tuple[float, float], shift: float) -> float | None:
    """Where ``margin`` changes its sign as ``mover`` moves about its start; None if it does not.

    It is looked at in steps, whose places are moved by ``shift`` of a step, so that other ones find short intervals.
    """
    function, (start, size) = _along(margin, point, mover), of
    for part in _RANGES[:1] if mover == "t" else _RANGES:
        places = [start + size * part * (2.0 * (i + shift) / _CELLS - 1.0) for i in range(_CELLS + 1)]
        for (low, at_low), (high, at_high) in pairwise((place, function(place)) for place in places):
            if at_low is not None and at_high is not None and (at_low > 0) != (at_high > 0):
                return _bisected(function, low, high, at_low > 0)
    return None


def _bisected(function: Callable[[float], float | None], low: float, high: float, positive: bool) -> float | None:
    """The place between ``low`` and ``high`` at which ``function``, ``positive`` at ``low``, changes its sign."""
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        value = function(middle)
        if value is None:
            return None
        low, high = (middle, high) if (value > 0) == positive else (low, middle)
    return 0.5 * (low + high)


def _height(expression: sp.Expr, point: Numbers, mover: str, size: float) -> float | None:
    """By how much ``expression`` jumps at the ``point`` as ``mover`` moves on; None if it does not."""
    function, border = _along(expression, point, mover), point[mover]
    unit = max(abs(border), size)
    near = [function(border + s * _NEAR * unit) for s in (-1.0, 1.0)]
    nearer = [function(border + s * _NEARER * unit) for s in (-1.0, 1.0)]
    around = [function(border + s * unit) for s in (-1.0, 1.0)]
    if None in (*near, *nearer):
        return None
    far, close = (abs(b - a) for a, b in (near, nearer))  # type: ignore[operator]
    scale = max(abs(x) for x in (*near, *around) if x is not None)
    return close if 0.5 * far < close < 2.0 * far and close > _ROUNDING * scale else None
