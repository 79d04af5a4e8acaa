"""Warnings of what a description may say but hardly means: energies that count twice, gravity that does nothing."""

from __future__ import annotations

import math
import re
import zlib
from collections.abc import Callable, Iterable, Iterator

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.names import velocity
from lag2fmu.description.places import Body
from lag2fmu.language.vocabulary import symbol
from lag2fmu.mechanism.order import in_order

NamesIn = Callable[[str, sp.Expr], set[str]]
_SHIFT = 1e-4
"""s; a central difference over it is right to 1e-8."""
_SAME = 1e-6
"""Relative: two energies of the same motion differ by less, those of two motions by more at sampled values."""
_UNIT = 1e-3
"""A direction whose length differs by less is a unit vector that was rounded."""
_NAMED = re.compile(r"\b((?:actuator|contact|equality|joint|link|sensor|tendon) |of (?=\S+ in <gazebo>))([^\s:,]+)")
"""The name of an element in a text on what was not taken."""
_FIRST = 3
"""The most names that are told of the elements to which one text applies."""


def doubts(m: Description, names_in: NamesIn) -> Iterator[str]:
    """Warnings of the description ``m``; ``names_in`` tells what an expression uses, see ``Scope.names_in``."""
    yield from (f"not taken from the imported file: {what}" for what in _by_kind(m.not_taken))
    coordinates = {q.name for q in m.coordinates}
    placed = {
        body.name: [_moves(body, i, names_in) & coordinates for i in range(len(body.position or ()))]
        for body in m.bodies
    }
    yield from _twice(m, placed, names_in)
    yield from _kinetic_twice(m)
    yield from _idle_gravity(m, placed)
    yield from _scaled_gravity(m)
    for force in m.forces:
        if sp.sympify(force.expression).is_zero:
            yield (
                f"forces.{force.coordinate}: is 0, and does nothing; correct it, or leave it out (a velocity is "
                f"{velocity(force.coordinate)}, in Python {force.coordinate}.dot)"
            )


def _by_kind(texts: Iterable[str]) -> Iterator[str]:
    """The ``texts``, where those that differ in the name of an element alone are one, with their number."""
    kinds: dict[str, list[str]] = {}
    for text in texts:
        kinds.setdefault(_NAMED.sub(r"\1", text), []).append(text)
    for alike in kinds.values():
        names = [found[2] for found in map(_NAMED.search, alike[1:]) if found]
        shown = ", ".join(names[:_FIRST]) + (", ..." if len(names) > _FIRST else "")
        yield alike[0] + (f"; the same of {len(names)} more: {shown}" if names else "")


def _moves(body: Body, i: int, names_in: NamesIn) -> set[str]:
    """The names that entry ``i`` of the body's position uses."""
    return names_in(f"bodies.{body.name}.position[{i}]", sp.sympify((body.position or ())[i]))


def _twice(m: Description, placed: dict[str, list[set[str]]], names_in: NamesIn) -> Iterator[str]:
    """Bodies whose energy counts beside a Lagrangian of the same coordinates."""
    whole = m.energy.lagrangian
    if whole is None:
        return
    names = names_in("energy.lagrangian", sp.sympify(whole))
    used = {q.name for q in m.coordinates if {q.name, velocity(q.name)} & names}
    bodies = [name for name, entries in placed.items() if used & set().union(*entries)]
    if bodies:
        yield (
            f"energy.lagrangian: the energies of {', '.join(bodies)} count beside it; leave the bodies out if it is "
            "the whole Lagrangian"
        )


def _kinetic_twice(m: Description) -> Iterator[str]:
    """A kinetic energy that says once more what the bodies have by themselves; frames are not looked into."""
    if m.energy.kinetic is None or any(body.position is None for body in m.bodies):
        return
    total = sum(_kinetic(m, body) for body in m.bodies)
    if total > 0 and abs(_sample(m, m.energy.kinetic) / total - 1) < _SAME:  # not for nan
        names = ", ".join(body.name for body in m.bodies)
        yield f"energy.kinetic: the kinetic energy of {names} counts by itself, and so twice; leave one of them out"


def _kinetic(m: Description, body: Body) -> float:
    """The kinetic energy of ``body``, J, at sampled values, with its velocities as central differences."""

    def rate(place: object) -> float:
        return (_sample(m, place, _SHIFT) - _sample(m, place, -_SHIFT)) / (2 * _SHIFT)

    moving = _sample(m, body.mass) * sum(rate(x) ** 2 for x in body.position or ())
    return (moving + _sample(m, body.inertia or 0) * rate(body.angle or 0) ** 2) / 2


def _sample(m: Description, expression: object, shift: float = 0.0) -> float:
    """``expression`` where each name has a value of its own from 1 to 2 (SI), and a motion goes on from there.

    That is by its velocity times ``shift`` (s). The result is nan where it is no number, as of tables.
    """
    moving = [*(q.name for q in m.coordinates), *(u.name for u in m.inputs if u.motion)]
    shifts = {name: shift * _value(velocity(name)) for name in moving} | {"t": shift}
    values: dict[sp.Symbol, sp.Expr] = {}
    found: sp.Expr = sp.nan
    for name, written in (*_named(m), ("", sp.sympify(expression))):
        new = {str(x) for x in written.free_symbols} - set(map(str, values))
        values |= {symbol(x): sp.Float(_value(x) + shifts.get(x, 0.0)) for x in new}
        found = written.xreplace(values).evalf()
        values[symbol(name or "_")] = found
    return float(found) if found.is_Float or found.is_Integer else math.nan


def _named(m: Description) -> Iterator[tuple[str, sp.Expr]]:
    """The dependent parameters and the definitions, each after those that it uses."""
    for p in in_order([p for p in m.parameters if p.expression is not None], "parameters"):
        yield p.name, sp.sympify(p.expression)
    for d in in_order(m.definitions, "definitions"):
        yield d.name, sp.sympify(d.expression)


def _value(name: str) -> float:
    """A value from 1 to 2 that depends on ``name`` alone."""
    return 1.0 + zlib.crc32(name.encode()) / 2**32


def _idle_gravity(m: Description, placed: dict[str, list[set[str]]]) -> Iterator[str]:
    """Gravity along -z by default, where positions of 3 entries are meant in the plane xy."""
    if m.gravity is None or m.gravity.direction is not None or m.dimension != 3 or not placed:
        return
    if all(len(entries) == 3 and not entries[2] for entries in placed.values()):
        yield (
            "gravity: acts along -z, where no body moves, and does nothing; give its direction, or positions of 2 "
            "entries for a mechanism in the plane"
        )


def _scaled_gravity(m: Description) -> Iterator[str]:
    """A direction of gravity in numbers that is no unit vector."""
    entries = [sp.sympify(x) for x in (m.gravity.direction if m.gravity and m.gravity.direction else ())]
    if not entries or not all(x.is_number for x in entries):
        return
    length = float(sp.sqrt(sum(x**2 for x in entries)))
    if abs(length - 1.0) > _UNIT:
        yield (
            f"gravity: its direction has the length {length:g}, not 1, so that bodies fall with {length:g} times its "
            "acceleration; divide the entries by it"
            if length
            else "gravity: its direction is 0, and does nothing; give a direction, or leave gravity out"
        )
