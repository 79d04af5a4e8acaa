"""The forces that contacts, stops, dry frictions and latches bear, as variables of the FMU."""

from __future__ import annotations

from collections.abc import Iterator

from lag2fmu.description import names
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.calculated_units import calculated_units
from lag2fmu.mechanism.record import Mechanism


def row_forces(mechanism: Mechanism) -> Iterator[tuple[str, Unit | None, str]]:
    """(name, unit, description) of the force of each row, in the order of ``dynamics.rows``."""
    units = calculated_units(mechanism)
    known = [(names.force(c.name), f"force in the normal direction of {c.name}") for c in mechanism.unilaterals]
    for c in mechanism.unilaterals:
        known += [(x, f"friction of {c.name} along its slip") for x in names.frictions(c.name, len(c.slips))]
    known += [(names.force(f.name), f"dry friction of {f.name}") for f in mechanism.frictions]
    for latch in mechanism.latches:
        doc = f"multiplier of the constraint {latch.name}, 0 while it does not hold"
        known.append((names.multiplier(latch.name), doc))
    for name, doc in known:
        yield name, units[name], doc
