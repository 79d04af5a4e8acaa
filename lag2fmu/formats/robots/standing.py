"""Where a robot stands at its start: what floats is put on the ground, what still overlaps is left out."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.events import Contact
from lag2fmu.description.names import force
from lag2fmu.language.parts_of import free_names
from lag2fmu.language.vocabulary import symbol
from lag2fmu.mechanism.contact_places import geometry_of
from lag2fmu.mechanism.poses import poses_of
from lag2fmu.mechanism.starts import start_values, value_at

_ROUNDS = 10
"""The most moves of what floats: what stands on another body that moves has to move again."""
_OVERLAP = 1e-12
"""m; a gap of less below 0 is rounding."""


def standing(d: Description, floating: Sequence[tuple[str, ...]], *, placed: bool = True) -> Description:
    """``d`` with starts at which no ideal contact overlaps; ``floating`` are the coordinates (3,) of what floats.

    What floats is raised along the normals of what overlaps. The first of it goes down, too, until it touches, if it is
    not ``placed``. A contact that overlaps after that is left out and told by ``not_taken``. One whose gap nothing
    changes is left out, too, and told if it touches. Raises MechanismError for a contact that cannot be described.
    """
    poses = poses_of(d)
    rigid = [c for c in d.contacts if c.law == "ideal" or not placed]
    gaps = {c.name: poses.resolved(geometry_of(d, _smooth(c), poses).gap) for c in rigid}
    return _that_can_touch(_raised(d, floating, list(gaps.values()), placed), gaps)


def _that_can_touch(d: Description, gaps: Mapping[str, sp.Expr]) -> Description:
    """``d`` without contacts whose ``gaps`` {name: expression} are negative at the start, or without a coordinate."""
    start = start_values(d, guesses=True)
    ideal, moving = {c.name for c in d.contacts if c.law == "ideal"}, {q.name for q in d.coordinates}
    at_start = {name: value_at(gap, start) or 0.0 for name, gap in gaps.items()}
    left = [name for name, gap in at_start.items() if name in ideal and gap < -_OVERLAP]
    still = [name for name, gap in gaps.items() if name not in left and free_names([gap]).isdisjoint(moving)]
    told = [f"the contact {name}: it overlaps at the start by {-at_start[name]:.3g} m" for name in left]
    told += [f"the contact {name}: it touches in all poses" for name in still if at_start[name] <= _OVERLAP]
    return replace(_without(d, {*left, *still}), not_taken=(*d.not_taken, *told))


def _without(d: Description, contacts: Collection[str]) -> Description:
    """``d`` without these ``contacts``, whose forces are 0 in outputs."""
    none = {symbol(force(name)): sp.S.Zero for name in contacts}
    told = {x.name: sp.sympify(x.expression).xreplace(none) for x in d.outputs if x.expression is not None}
    outputs = tuple(replace(x, expression=told.get(x.name)) for x in d.outputs)
    return replace(d, contacts=tuple(c for c in d.contacts if c.name not in contacts), outputs=outputs)


def _raised(d: Description, floating: Sequence[tuple[str, ...]], gaps: Sequence[sp.Expr], placed: bool) -> Description:
    """``d`` with what is ``floating`` moved until none of the ``gaps`` is below 0, or that goes on no further."""
    names = [free_names([gap]) for gap in gaps]
    for _ in range(_ROUNDS):
        raised = d
        for along in floating:
            own = [gap for gap, known in zip(gaps, names, strict=True) if not known.isdisjoint(along)]
            raised = _moved(raised, along, own, _OVERLAP if placed else -np.inf)
            placed = True
        if raised is d:
            break
        d = raised
    return d


def _smooth(contact: Contact) -> Contact:
    """The ``contact`` without friction, whose slips take long to write."""
    return replace(contact, friction=0, static_friction=None)


def _moved(d: Description, along: tuple[str, ...], gaps: Sequence[sp.Expr], least: float) -> Description:
    """``d`` with what has the coordinates ``along`` moved to where the deepest of the ``gaps`` is 0.

    It stays where it is if none is deeper than ``least`` (m).
    """
    start = start_values(d, guesses=True)
    depths = [-(value_at(gap, start) or 0.0) for gap in gaps]
    if max(depths, default=-np.inf) <= least:
        return d
    deepest = int(np.argmax(depths))
    normal = np.array([value_at(gaps[deepest].diff(symbol(name)), start) or 0.0 for name in along])
    if not normal @ normal:
        return d
    way = dict(zip(along, depths[deepest] * normal / (normal @ normal), strict=True))
    moved = (replace(q, start=q.start + float(way[q.name])) if q.name in way else q for q in d.coordinates)
    return replace(d, coordinates=tuple(moved))
