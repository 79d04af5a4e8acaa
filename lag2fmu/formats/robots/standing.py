"""Where a robot stands at its start: what floats is raised out of the ground, what still overlaps is left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.events import Contact
from lag2fmu.language.vocabulary import symbol
from lag2fmu.mechanism.contact_places import geometry_of
from lag2fmu.mechanism.poses import Poses
from lag2fmu.mechanism.starts import start_values, value_at

_ROUNDS = 10
_OVERLAP = 1e-12
"""m; a gap of less below 0 is rounding."""


def standing(d: Description, floating: Sequence[tuple[str, ...]]) -> Description:
    """``d`` with starts at which no ideal contact overlaps; ``floating`` are the coordinates (3,) of what floats.

    What floats is raised along the normals of what overlaps. A contact that overlaps after that is left out and told
    by ``not_taken``. Raises MechanismError for a contact that cannot be described.
    """
    poses = Poses(d)
    ideal = [contact for contact in d.contacts if contact.law == "ideal"]
    gaps = {c.name: poses.resolved(geometry_of(d, _smooth(c), poses).gap) for c in ideal}
    for _ in range(_ROUNDS):
        raised = d
        for along in floating:
            own = [gap for gap in gaps.values() if {symbol(name) for name in along} & gap.free_symbols]
            raised = _raised(raised, along, own)
        if raised is d:
            break
        d = raised
    start = start_values(d, guesses=True)
    depths = {name: -value for name, gap in gaps.items() if (value := value_at(gap, start) or 0.0) < -_OVERLAP}
    told = [f"the contact {name}: it overlaps at the start by {depth:.3g} m" for name, depth in depths.items()]
    contacts = tuple(contact for contact in d.contacts if contact.name not in depths)
    return replace(d, contacts=contacts, not_taken=(*d.not_taken, *told))


def _smooth(contact: Contact) -> Contact:
    """The ``contact`` without friction, whose slips take long to write."""
    return replace(contact, friction=0, static_friction=None)


def _raised(d: Description, along: tuple[str, ...], gaps: Sequence[sp.Expr]) -> Description:
    """``d`` with what has the coordinates ``along`` moved out of the deepest of the ``gaps``, if one is below 0."""
    start = start_values(d, guesses=True)
    depths = [-(value_at(gap, start) or 0.0) for gap in gaps]
    if max(depths, default=0.0) <= _OVERLAP:
        return d
    deepest = int(np.argmax(depths))
    normal = np.array([value_at(gaps[deepest].diff(symbol(name)), start) or 0.0 for name in along])
    if not normal @ normal:
        return d
    way = dict(zip(along, depths[deepest] * normal / (normal @ normal), strict=True))
    moved = (replace(q, start=q.start + float(way[q.name])) if q.name in way else q for q in d.coordinates)
    return replace(d, coordinates=tuple(moved))
