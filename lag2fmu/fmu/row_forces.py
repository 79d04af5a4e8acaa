"""What contacts, stops, dry frictions and latches bear, as variables of the FMU."""

from __future__ import annotations

from collections.abc import Iterator

from lag2fmu.description import names
from lag2fmu.language.units import JOULE, WATT, Unit
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.mechanism.unit_check import units_of


def row_forces(mechanism: Mechanism) -> Iterator[tuple[str, Unit | None, str]]:
    """(name, unit, description) of the force of each row, in the order of ``dynamics.rows``.

    Force times gap is an energy, force times slip velocity a power.
    """
    contacts = mechanism.unilaterals
    for contact in contacts:
        doc = f"force in the normal direction of {contact.name}"
        yield names.row_force(contact.name), _per(JOULE, contact.unit), doc
    slips = [
        (name, slip, f"friction of {contact.name} along its slip")
        for contact in contacts
        for name, slip in zip(names.contact_frictions(contact.name, len(contact.slips)), contact.slips, strict=True)
    ]
    rubbing = [(names.row_force(f.name), f.on, f"dry friction of {f.name}") for f in mechanism.frictions]
    moving = [*slips, *rubbing]
    for (name, _, doc), unit in zip(moving, units_of(mechanism, [on for _, on, _ in moving]), strict=True):
        yield name, _per(WATT, unit), doc
    held = units_of(mechanism, [latch.expression for latch in mechanism.latches])
    for latch, unit in zip(mechanism.latches, held, strict=True):
        of = JOULE if latch.holonomic else WATT
        yield names.multiplier(latch.name), _per(of, unit), f"multiplier of the constraint {latch.name}"


def _per(total: Unit, unit: Unit | None) -> Unit | None:
    return None if unit is None else total / unit
