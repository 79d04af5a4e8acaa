"""Compliant contacts written out: definitions of gap and forces, dampers that exert them, and outputs.

The force of the penetration d is F = k d^1.5 (1 + c d_dot), and never pulls; it is 0 for d <= 0. Friction opposes the
slip v with mu F v / sqrt(v^2 + v0^2), where v0 is the slip speed. In space v has two entries.

Source: K. H. Hunt, F. R. E. Crossley, Coefficient of Restitution Interpreted as Damping in Vibroimpact, J. Applied
Mechanics 42 (1975) 440-445.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.description import Description
from lag2fmu.description.events import Contact
from lag2fmu.description.outputs import Output
from lag2fmu.description.parts import Damper, Definition
from lag2fmu.language.units import JOULE, METRE
from lag2fmu.language.vocabulary import Choice, Smooth, symbol
from lag2fmu.mechanism.contact_places import geometry_of
from lag2fmu.mechanism.poses import Poses, poses_of
from lag2fmu.mechanism.unit_check import units_in


class Compliant(NamedTuple):
    """The entries that the compliant ``contact`` brings to a description."""

    contact: Contact
    definitions: list[Definition]
    dampers: list[Damper]
    outputs: list[Output]


def compliant_contacts(m: Description) -> Iterator[Compliant]:
    """Every compliant contact of ``m``, which has been checked, with its entries.

    Source: K. H. Hunt, F. R. E. Crossley, J. Applied Mechanics 42 (1975) 440-445.
    """
    contacts = [contact for contact in m.contacts if contact.law == "compliant"]
    if contacts:
        poses = poses_of(m)
        for contact in contacts:
            yield _written_out(m, contact, poses)


def _written_out(m: Description, contact: Contact, poses: Poses) -> Compliant:
    name, geometry = contact.name, geometry_of(m, contact, poses)
    gap, rate = geometry.gap, poses.rate(poses.resolved(geometry.gap))
    damping = sp.sympify(contact.damping or 0)
    force = contact.stiffness * _positive(-gap) ** sp.Rational(3, 2) * _positive(1 - damping * rate)
    pressing = symbol(names.force(name))
    parts = [(names.gap(name), gap, None), (names.force(name), force, rate)]
    if contact.friction != 0:
        speed = sp.sqrt(sum((v**2 for v in geometry.slips), sp.sympify(contact.slip_speed) ** 2))
        labels = names.frictions(name, len(geometry.slips))
        parts += [
            (label, -contact.friction * pressing * slip / speed, slip)
            for label, slip in zip(labels, geometry.slips, strict=True)
        ]
    unit = METRE if contact.kind is not None else units_in(m)(gap)
    newton = None if unit is None else JOULE / unit
    return Compliant(
        contact,
        [Definition(label, expression) for label, expression, _ in parts],
        [Damper(label, rate=along, force=-symbol(label)) for label, _, along in parts if along],  # none along 0
        [
            Output(
                label,
                symbol(label),
                unit if along is None else newton,
                f"{label.removeprefix(name)[1:]} of the contact {name}",
            )
            for label, _, along in parts
        ],
    )


def _positive(x: sp.Expr) -> sp.Expr:
    """max(0, x) with a switch at x = 0 that is located; it is never negative, even before the switch turns."""
    return Choice(x, Smooth(sp.Max(0, x)), sp.S.Zero)
