"""Do the units of a mechanism fit? The known dimension of every expression is compared with the expected one."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.description import Description
from lag2fmu.description.events import Contact, State
from lag2fmu.description.keys import OWN
from lag2fmu.description.parts import Definition, Force
from lag2fmu.description.symbols import Coordinate, Input, Parameter
from lag2fmu.errors import UnitError
from lag2fmu.language.dimensions import ONE, Dimension, DimensionOf, describe, dimension
from lag2fmu.language.units import JOULE, METRE, SECOND, WATT, Unit, si_name
from lag2fmu.language.vocabulary import symbol
from lag2fmu.language.writer import to_quote
from lag2fmu.mechanism.order import in_order
from lag2fmu.mechanism.unit_needs import Expected, described_in, needed_units

_RATE_BETWEEN = "rate between points"
"""Stands for the rate of a damper that has no expression of its own; nothing else is called so."""
Known = dict[str, Dimension | None]
Columns = Mapping[str, tuple[Dimension | None, ...]]


@lru_cache(maxsize=64)
def _per_second(d: Dimension | None, times: int) -> Dimension | None:
    second = dimension(SECOND.exponents)
    return None if d is None else tuple(a - times * b for a, b in zip(d, second, strict=True))


def _known_dimensions(m: Description) -> dict[str, Dimension | None]:
    known: dict[str, Dimension | None] = {"t": dimension(SECOND.exponents)}
    parts: list[Coordinate | Parameter | Input] = [*m.coordinates, *m.parameters, *m.inputs]
    known |= {z.name: _dimension_of(z.unit) for z in m.states}
    known |= {
        names.gap(c.name): _dimension_of(METRE) for c in m.contacts if c.law == "compliant" and c.kind is not None
    }
    for c in m.constraints:
        known[names.multiplier(c.name)] = None
    for name in m.unilateral_names:
        known[names.force(name)] = None
    for q in m.coordinates:
        d = _dimension_of(q.unit)
        known[names.generalized_force(q.name)] = None if d is None else _quotient(_dimension_of(JOULE), d)
    for part in parts:
        d = _dimension_of(part.unit)
        known[names.velocity(part.name)] = _per_second(d, 1)
        known[names.acceleration(part.name)] = _per_second(d, 2)
    return known | {part.name: _dimension_of(part.unit) for part in parts}  # a parameter may be called damping_j_dot


def _quotient(a: Dimension | None, b: Dimension) -> Dimension | None:
    return None if a is None else tuple(x - y for x, y in zip(a, b, strict=True))


def _dimension_of(unit: Unit | str | None) -> Dimension | None:
    return dimension(unit.exponents) if isinstance(unit, Unit) else None


def _own_definitions(m: Description) -> list[Definition]:
    """The definitions in order, without those of compliant contacts, which may contain plain numbers."""
    brought = {label for contact in m.contacts for label in _brought_by(contact)}
    return [found for found in in_order(m.definitions, "definitions") if found.name not in brought]


def _brought_by(contact: Contact) -> set[str]:
    """The names of the definitions and dampers of a compliant ``contact``, which is checked as it is written itself."""
    if contact.law != "compliant":
        return set()
    frictions = (*names.frictions(contact.name, 1), *names.frictions(contact.name, 2))
    return {names.gap(contact.name), names.force(contact.name), *frictions}


def _columns(m: Description) -> dict[str, tuple[Dimension | None, ...]]:
    """{table: the dimensions of its arguments and of its value}; None for one without a unit."""
    return {table.name: tuple(map(_dimension_of, table.units)) for table in m.tables if table.units}


def mismatches(m: Description, brought: Container[str] = ()) -> Iterator[str]:
    """One sentence for every expression whose known dimension is not the expected one.

    A plain number stands for a value in SI units and fits everywhere, except beside a quantity in a sum. In the
    constraints ``brought`` by joints it fits there too, because these numbers are entries of places, and in what a
    compliant contact brings, because that is checked as it is written. Raises MechanismError for definitions in a
    circle.
    """
    known, tables = _known_dimensions(m), _columns(m)
    infer = DimensionOf(known, tables)
    for definition in _own_definitions(m):
        try:
            known[definition.name] = infer(definition.expression)
        except UnitError as error:
            known[definition.name] = None
            yield f"definitions.{definition.name}: {error}"
    for where, expression, expected in _expectations(m, infer):
        if where.removesuffix(".expression") not in brought:
            yield from _mismatch(where, expression, expected, infer)
    for damper in m.dampers:
        if damper.force is not None:
            rate = _measured(damper.rate, METRE / SECOND, infer)
            inside = DimensionOf(known | {names.DAMPER_RATE: rate}, tables)
            yield from _mismatch(f"dampers.{damper.name}.force", damper.force, _share(WATT, rate, 1), inside)
    yield from _of_events(m, infer)
    for output in m.outputs:
        given = _dimension_of(output.unit)
        measured = given if output.quantity is None else _dimension_of(output.own_unit)
        if given is not None and measured is not None and given != measured:
            yield f"outputs.{output.name}.unit: the {output.quantity} is in {describe(measured)}, not {describe(given)}"


def missing(m: Description, brought: Container[str] = ()) -> Iterator[str]:
    """One sentence for every quantity without a unit whose use has a dimension; ``brought`` as in ``mismatches``.

    Source: A. Kennedy, Dimension types, ESOP 1994.
    """
    yield from needed_units(*uses_of(m, brought))


def uses_of(m: Description, brought: Container[str] = ()) -> tuple[Description, Known, Columns, list[Expected]]:
    """``m`` with its own definitions alone, what is known of dimensions, and all expressions; see ``needed_units``."""
    known, tables = _known_dimensions(m), _columns(m)
    own = {d.name for d in _own_definitions(m)}
    infer = DimensionOf(known, tables)
    for definition in _own_definitions(m):
        known[definition.name] = _inferred(infer, definition.expression)
    elements = (*_lengths(m), *_in_contacts(m, infer), *_in_elements(m, infer))
    expected = [*_expectations(m, infer), *((where, sp.sympify(x), d) for where, x, d in elements if x is not None)]
    known[_RATE_BETWEEN] = _dimension_of(METRE / SECOND)
    expected += [(where, x, _dimension_of(unit)) for where, x, unit in _energies_and_powers(m)]
    fitting = [(where, x, d) for where, x, d in expected if where.removesuffix(".expression") not in brought]
    return replace(m, definitions=tuple(d for d in m.definitions if d.name in own)), known, tables, fitting


def _energies_and_powers(m: Description) -> Iterator[tuple[str, sp.Expr, Unit]]:
    """(place, expression, its unit) of what elements store and take: it holds of measures of unknown dimension too."""
    between = symbol(_RATE_BETWEEN)
    found: list[tuple[str, object, object, Unit]] = []
    for spring in m.springs:
        square = None if spring.elongation is None else sp.sympify(spring.elongation) ** 2
        found.append((f"springs.{spring.name}.stiffness", spring.stiffness, square, JOULE))
    for damper in m.dampers:
        rate = between if damper.rate is None else sp.sympify(damper.rate)
        found.append((f"dampers.{damper.name}.damping", damper.damping, rate**2, WATT))
        force = None if damper.force is None else damper.force_at(rate)
        found.append((f"dampers.{damper.name}.force", force, rate, WATT))
    for friction in m.frictions:
        found += [(f"frictions.{friction.name}.force", x, friction.on, WATT) for x in (friction.force, friction.static)]
    for where, factor, measure, unit in found:
        if factor is not None and measure is not None and not sp.sympify(factor).is_number:
            yield where, sp.sympify(factor) * sp.sympify(measure), unit


def _mismatch(where: str, expression: sp.Expr, expected: Dimension | None, infer: DimensionOf) -> Iterator[str]:
    """A sentence if the dimension of ``expression`` is known and not the ``expected`` one, or contradicts itself."""
    try:
        found = infer(expression)
    except UnitError as error:
        yield f"{where}: {error}"
        return
    if found is not None and expected is not None and found != expected and not expression.is_number:
        yield (
            f"{where}: '{to_quote(expression)}' is in {described_in(where, found)}, "
            f"expected {described_in(where, expected)}"
        )


def constraint_units(m: Description) -> dict[str, Unit | None]:
    """{constraint: unit of its expression}, as given or as it follows from the names in it; None if unknown."""
    unit_of = units_in(m)
    return {c.name: c.unit if isinstance(c.unit, Unit) else unit_of(sp.sympify(c.expression)) for c in m.constraints}


def units_in(m: Description) -> Callable[[sp.Expr], Unit | None]:
    """The function that infers the unit of an expression of ``m`` from the names in it; None if it is unknown."""
    known, tables = _known_dimensions(m), _columns(m)
    infer = DimensionOf(known, tables)
    for definition in _own_definitions(m):
        known[definition.name] = _inferred(infer, definition.expression)

    def unit_of(expression: sp.Expr) -> Unit | None:
        d = _inferred(infer, expression)
        if d is None or any(e.denominator != 1 for e in d):
            return None
        exponents = (*(int(e) for e in d), 0)
        return Unit(si_name(exponents) or "1", exponents)

    return unit_of


def _inferred(infer: DimensionOf, expression: sp.Expr) -> Dimension | None:
    try:
        return infer(expression)
    except UnitError:
        return None


def _expectations(m: Description, infer: DimensionOf) -> Iterator[tuple[str, sp.Expr, Dimension | None]]:
    """(place, expression, expected dimension) of every expression that should have a certain one."""
    parts: tuple[State | Input | Coordinate, ...] = (*m.states, *m.inputs, *m.coordinates)
    moving = {part.name: part.unit for part in parts}
    for entry in m.entries():
        expected = entry.key.unit
        if isinstance(entry.part, Force):
            unit = moving[entry.part.coordinate]
            expected = JOULE / unit if isinstance(unit, Unit) else None
        elif expected is None and entry.key.kind != "axis":
            continue  # definitions have been inferred, springs and dampers come below
        elif expected == OWN:
            expected = entry.part.unit
        yield entry.where, entry.expression, _dimension_of(expected)
    yield from _expected_of_springs(m, infer)


def _expected_of_springs(m: Description, infer: DimensionOf) -> Iterator[tuple[str, sp.Expr, Dimension | None]]:
    """(place, expression, expected dimension) in springs and dampers.

    stiffness * elongation^2 is an energy, damping * rate^2 is a power.
    """
    for spring in m.springs:
        where = f"springs.{spring.name}"
        elongation = _measured(spring.elongation, METRE, infer)
        if spring.elongation is not None:
            yield f"{where}.elongation", spring.elongation, None
        yield f"{where}.stiffness", spring.stiffness, _share(JOULE, elongation, 2)
    of_contacts = {label for contact in m.contacts for label in _brought_by(contact)}
    for damper in (damper for damper in m.dampers if damper.name not in of_contacts):
        where = f"dampers.{damper.name}"
        rate = _measured(damper.rate, METRE / SECOND, infer)
        if damper.rate is not None:
            yield f"{where}.rate", damper.rate, None
        if damper.damping is not None:
            yield f"{where}.damping", damper.damping, _share(WATT, rate, 2)


def _of_events(m: Description, infer: DimensionOf) -> Iterator[str]:
    """Sentences on contacts, stops, frictions, conditions and further states."""
    for where, length, _ in _lengths(m):
        measure = sp.sympify(length)
        fits = _inferred(infer, measure) in (None, ONE, _dimension_of(METRE))
        yield from _mismatch(where, measure, None if fits else _dimension_of(METRE), infer)
    for where, expression, expected in (*_in_contacts(m, infer), *_in_elements(m, infer)):
        if expression is not None:
            yield from _mismatch(where, sp.sympify(expression), expected, infer)


def _lengths(m: Description) -> list[tuple[str, object, None]]:
    """(place, expression, no single dimension) of what is stopped and of gaps: lengths or angles."""
    gaps = [(f"contacts.{c.name}.gap", c.gap, None) for c in m.contacts if c.gap is not None]
    return [*((f"stops.{s.name}.of", s.of, None) for s in m.stops), *gaps]


def _in_contacts(m: Description, infer: DimensionOf) -> Iterator[tuple[str, object, Dimension | None]]:
    """(place, expression or None, expected dimension) in contacts and stops."""
    for contact in m.contacts:
        where, gap = f"contacts.{contact.name}", _measured(contact.gap, METRE, infer)
        rate = _rate_of(gap)
        for slip in contact.slip if isinstance(contact.slip, tuple) else (contact.slip,):
            yield f"{where}.slip", slip, rate
        yield f"{where}.stiffness", contact.stiffness, _share(JOULE, gap, Fraction(5, 2))  # force / gap^(3/2)
        yield f"{where}.damping", contact.damping, None if rate is None else _quotient(ONE, rate)
        yield f"{where}.slip_speed", contact.slip_speed, rate
    for stop in m.stops:
        of = _inferred(infer, sp.sympify(stop.of))
        yield f"stops.{stop.name}.lower", stop.lower, of
        yield f"stops.{stop.name}.upper", stop.upper, of


def _in_elements(m: Description, infer: DimensionOf) -> Iterator[tuple[str, object, Dimension | None]]:
    """(place, expression or None, expected dimension) in frictions, conditions and further states."""
    for friction in m.frictions:
        where, rate = f"frictions.{friction.name}", _inferred(infer, sp.sympify(friction.on))
        yield f"{where}.on", friction.on, None
        yield f"{where}.force", friction.force, _share(WATT, rate, 1)
        yield f"{where}.static", friction.static, _share(WATT, rate, 1)
    for constraint in m.constraints:
        yield f"constraints.{constraint.kind}.{constraint.name}.while", constraint.while_, None
    for state in m.states:
        yield f"states.{state.name}.derivative", state.derivative, _dimension_of(state.rate_unit)


def _rate_of(d: Dimension | None) -> Dimension | None:
    return None if d is None else _quotient(d, dimension(SECOND.exponents))


def _measured(measure: sp.Expr | None, length: Unit, infer: DimensionOf) -> Dimension | None:
    """The dimension of an elongation or rate, of ``length`` between points; None if it is not known or has a fault."""
    return _dimension_of(length) if measure is None else _inferred(infer, measure)


def _share(total: Unit, measured: Dimension | None, times: int | Fraction) -> Dimension | None:
    """``total`` / ``measured`` ** ``times``; None if what is measured has no known dimension."""
    whole = dimension(total.exponents)
    return None if measured is None else tuple(a - times * b for a, b in zip(whole, measured, strict=True))
