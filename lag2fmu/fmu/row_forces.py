"""What contacts, stops, dry frictions and latches bear, as variables of the FMU."""

from __future__ import annotations

from collections.abc import Iterator

from lag2fmu.description import names
from lag2fmu.language.units import JOULE, WATT, Unit
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.mechanism.unit_check import units_in


def row_forces(mechanism: Mechanism) -> Iterator[tuple[str, Unit | None, str]]:
    """(name, unit, description) of the force of each row, in the order of ``dynamics.rows``.

    Force times gap is an energy, force times slip velocity a power.
    """
    contacts, unit_of = mechanism.unilaterals, units_in(mechanism)
    for contact in contacts:
        doc = f"force in the normal direction of {contact.name}"
        yield names.force(contact.name), _per(JOULE, contact.unit), doc
    slips = [
        (name, slip, f"friction of {contact.name} along its slip")
        for contact in contacts
        for name, slip in zip(names.frictions(contact.name, len(contact.slips)), contact.slips, strict=True)
    ]
    rubbing = [(names.force(f.name), f.on, f"dry friction of {f.name}") for f in mechanism.frictions]
    for name, on, doc in [*slips, *rubbing]:
        yield name, _per(WATT, unit_of(on)), doc
    for latch in mechanism.latches:
        of = JOULE if latch.holonomic else WATT
        doc = f"multiplier of the constraint {latch.name}, 0 while it does not hold"
        yield names.multiplier(latch.name), _per(of, unit_of(latch.expression)), doc


def _per(total: Unit, unit: Unit | None) -> Unit | None:
    return None if unit is None else total / unit
