"""The units of what an FMU calculates beside q, qd and the outputs: forces, momenta, multipliers, gaps, impulses.

They follow from units that are known: force times gap is an energy, force times slip velocity is a power, multiplier
times constraint is an energy, or a power if the constraint is nonholonomic.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache

from lag2fmu.description import names
from lag2fmu.description.events import State
from lag2fmu.description.symbols import Coordinate, Input
from lag2fmu.language.unit_parser import parse_unit
from lag2fmu.language.units import JOULE, METRE, SECOND, WATT, Unit
from lag2fmu.mechanism.drives import carried
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.mechanism.unit_check import constraint_units, units_in


def calculated_units(mechanism: Mechanism) -> Mapping[str, Unit | None]:
    """{name: SI unit} of momenta, residuals, multipliers, drives, and of results of contacts, stops and frictions."""
    return _calculated_units(mechanism, mechanism.constraints)


@lru_cache(maxsize=4)
def _calculated_units(mechanism: Mechanism, *_derived: object) -> Mapping[str, Unit | None]:
    """The units of a mechanism with these constraints; without those that derivation adds it counts as the same."""
    found = {names.momentum(q.name): per(JOULE * SECOND, q.unit) for q in mechanism.coordinates}
    units = constraint_units(mechanism) if mechanism.constraints else {}
    for c in mechanism.constraints:
        found[names.residual(c.name)] = units[c.name]
        found[names.multiplier(c.name)] = per(JOULE if c.holonomic else WATT, units[c.name])
    parts: tuple[Input | State | Coordinate, ...] = (*mechanism.coordinates, *mechanism.inputs, *mechanism.states)
    declared = {part.name: part.unit for part in parts}
    for name in carried(mechanism):
        unit = declared[name]
        found[names.drive(name)] = per(JOULE, parse_unit(unit) if isinstance(unit, str) else unit)
        found[names.drive_power(name)] = WATT
    rows = mechanism.unilaterals or mechanism.frictions or mechanism.latches
    return found | dict(_of_rows(mechanism)) if rows else found


def _of_rows(mechanism: Mechanism) -> Iterator[tuple[str, Unit | None]]:
    unit_of, placed = units_in(mechanism), {contact.name for contact in mechanism.contacts if contact.kind is not None}
    for contact in mechanism.unilaterals:
        unit = _turning(contact.unit, "rad")
        yield names.gap(contact.name), unit
        yield names.force(contact.name), per(JOULE, unit)
        yield names.impulse(contact.name), per(JOULE * SECOND, unit)
        for name, slip in zip(names.frictions(contact.name, len(contact.slips)), contact.slips, strict=True):
            rate = METRE / SECOND if contact.name in placed else _turning(unit_of(slip), "rad/s")
            yield name, per(WATT, rate)
    for friction in mechanism.frictions:
        yield names.force(friction.name), per(WATT, _turning(unit_of(friction.on), "rad/s"))
    for latch in mechanism.latches:
        yield names.multiplier(latch.name), per(JOULE if latch.holonomic else WATT, unit_of(latch.expression))


def _turning(unit: Unit | None, angle: str) -> Unit | None:
    """``angle`` if it differs from ``unit`` by rad only, so that the force along it is a torque; else ``unit``."""
    other = parse_unit(angle)
    return other if unit is not None and unit.dimension == other.dimension else unit


def per(total: Unit, unit: Unit | None) -> Unit | None:
    """``total`` / ``unit``; None where there is no unit."""
    return None if unit is None else total / unit
