"""The units in which people read and give values: those that the mechanism declares. Everything else is in SI units."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator, Mapping

from lag2fmu.description import names
from lag2fmu.description.events import State
from lag2fmu.description.symbols import Input, Parameter
from lag2fmu.errors import LoadError, UnitError
from lag2fmu.language import remedies
from lag2fmu.language.unit_parser import parse_unit
from lag2fmu.language.units import DIMENSIONLESS, JOULE, SECOND, WATT, Unit
from lag2fmu.mechanism.calculated_units import calculated_units
from lag2fmu.mechanism.record import Mechanism

_LOGGER = logging.getLogger("lag2fmu")
_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([^\s\d,.].*)?")


def display_units(mechanism: Mechanism) -> dict[str, Unit]:
    """{name: unit} of all variables of an FMU of ``mechanism`` that have a unit: declared units, and their rates."""
    units: dict[str, Unit | None] = {**dict.fromkeys(names.ENERGIES, JOULE), "external_power": WATT}
    units |= {names.DISSIPATED_ENERGY: JOULE, names.derivative(names.DISSIPATED_ENERGY): WATT}
    units |= calculated_units(mechanism)
    units |= dict(zip(names.SETTINGS, (DIMENSIONLESS, SECOND, SECOND), strict=True))
    declared: list[Parameter | Input | State] = [*mechanism.parameters, *mechanism.inputs, *mechanism.states]
    units |= {part.name: _unit(part.unit) for part in declared}
    moving = {q.name: q.unit for q in mechanism.coordinates} | {u.name: u.unit for u in mechanism.motions}
    for name, unit in moving.items():
        first = _rate(unit)
        second = _rate(first)
        units |= {name: unit, names.velocity(name): first, names.acceleration(name): second}
        units |= {names.derivative(name): first, names.derivative(names.velocity(name)): second}
    for z in mechanism.states:
        unit = parse_unit(z.unit) if isinstance(z.unit, str) else z.unit
        units |= {z.name: unit, names.derivative(z.name): _rate(unit)}
    for q in mechanism.coordinates:
        units[names.generalized_force(q.name)] = None if q.unit is None else JOULE / q.unit
    for name, output in mechanism.output_names.items():
        units[name] = _unit(output.unit)
    return {name: unit for name, unit in units.items() if unit is not None}


def _unit(unit: Unit | str | None) -> Unit | None:
    return parse_unit(unit) if isinstance(unit, str) else unit


def _rate(unit: Unit | None) -> Unit | None:
    """``unit`` per second: deg/s for deg, deg/s2 for deg/s; the SI unit if there is no such text, as for degC."""
    if unit is None:
        return None
    try:
        return parse_unit(f"{unit.name}2" if unit.name.endswith("/s") else f"{unit.name or 1}/s")
    except UnitError:
        return unit / SECOND


def named(name: str, units: Mapping[str, Unit]) -> str:
    """``name [unit]``, or the name alone where there is no unit."""
    unit = units[name].name if name in units else ""
    return f"{name} [{unit}]" if unit else name


def value_in_si(name: str, text: str, units: Mapping[str, Unit]) -> float:
    """The SI value of ``text``: a number in the unit of ``name``, or one with its own unit ('30', '0.5 rad').

    Raises LoadError for a text that is no number, and for a unit of another kind.
    """
    match = _NUMBER.fullmatch(text)
    if match is None:
        try:
            return float(text)  # inf and nan are refused where they are used
        except ValueError:
            remedy = remedies.of_number(text)
            raise LoadError(f"setting '{name}={text}': '{text}' is not a number{remedy and f'; {remedy}'}") from None
    number, own = match.groups()
    unit = units.get(name, DIMENSIONLESS)
    if own:
        try:
            given = parse_unit(own)
        except UnitError as error:
            raise LoadError(f"setting '{name}={text}': not a number, nor one with a unit: {error}") from None
        if given.dimension != unit.dimension:
            raise LoadError(f"setting '{name}={text}': '{own}' is no unit of '{name}', which is in {unit.name or '1'}")
        unit = given
    return unit.to_si(float(number))


def shown(name: str, value: float, units: Mapping[str, Unit]) -> str:
    """``value`` (SI) of ``name`` with its unit, e.g. '30 deg'."""
    unit = units.get(name, DIMENSIONLESS)
    return f"{unit.from_si(value):.12g} {unit.name}".strip()


def turned_round(mechanism: Mechanism, values: Mapping[str, float]) -> Iterator[str]:
    """Warnings of lengths that are positive in ``mechanism`` and negative among the ``values`` (SI) set in it.

    Equations do not mind a negative length, as of a pendulum, which then hangs the other way round.
    """
    length = parse_unit("m").dimension
    for p in mechanism.parameters:
        value = values.get(p.name, 0.0)
        if p.unit is not None and p.unit.dimension == length and value < 0 < (p.value or 0.0):
            said = shown(p.name, value, display_units(mechanism))
            yield f"parameters.{p.name}: {said} is negative; a length is not, but a place may be"


def tell_of_lengths(mechanism: Mechanism, values: Mapping[str, float]) -> None:
    """Log a warning of each length of ``mechanism`` that is negative among the ``values`` (SI), which are numbers."""
    for warning in turned_round(mechanism, values):
        _LOGGER.warning("warning: %s", warning)
