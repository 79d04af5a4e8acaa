"""Warnings of what a description may say but hardly means: energies that count twice, gravity that does nothing."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.names import velocity
from lag2fmu.description.places import Body

NamesIn = Callable[[str, sp.Expr], set[str]]
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
