"""Where a robot stands at its start: what floats is put on the ground, what still overlaps is left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.events import Contact
from lag2fmu.description.names import force
from lag2fmu.language.parts_of import free_names
from lag2fmu.language.vocabulary import symbol
from lag2fmu.mechanism.contact_places import geometry_of
from lag2fmu.mechanism.poses import Poses
from lag2fmu.mechanism.starts import start_values, value_at

_ROUNDS = 10
_OVERLAP = 1e-12
"""m; a gap of less below 0 is rounding."""


def standing(d: Description, floating: Sequence[tuple[str, ...]], *, placed: bool = True) -> Description:
    """``d`` with starts at which no ideal contact overlaps; ``floating`` are the coordinates (3,) of what floats.

    What floats is raised along the normals of what overlaps. The first of it goes down, too, until it touches, if it is
    not ``placed``. A contact that overlaps after that is left out and told by ``not_taken``. One whose gap nothing
    changes is left out, too, and told if it touches. Raises MechanismError for a contact that cannot be described.
    """
    poses = Poses(d)
    rigid = [c for c in d.contacts if c.law == "ideal" or not placed]
    gaps = {c.name: poses.resolved(geometry_of(d, _smooth(c), poses).gap) for c in rigid}
    d = _raised(d, floating, list(gaps.values()), placed)
    start = start_values(d, guesses=True)
    depths = {name: -value for name, gap in gaps.items() if (value := value_at(gap, start) or 0.0) < -_OVERLAP}
    left = {c.name for c in d.contacts if c.law == "ideal"} & depths.keys()
    moving = {q.name for q in d.coordinates}
    still = {name for name, gap in gaps.items() if free_names([gap]).isdisjoint(moving)} - left
    told = [f"the contact {name}: it overlaps at the start by {depths[name]:.3g} m" for name in depths if name in left]
    touching = [name for name in sorted(still) if (value_at(gaps[name], start) or 0.0) <= _OVERLAP]
    told += [f"the contact {name}: it touches in all poses" for name in touching]
    contacts = tuple(c for c in d.contacts if c.name not in left | still)
    gone = {symbol(force(name)): sp.S.Zero for name in left | still}
    outputs = tuple(
        x if x.expression is None else replace(x, expression=sp.sympify(x.expression).xreplace(gone)) for x in d.outputs
    )
    return replace(d, contacts=contacts, outputs=outputs, not_taken=(*d.not_taken, *told))


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
