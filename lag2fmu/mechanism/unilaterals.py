"""The normal form of contacts and stops: gaps that are never negative, with the slip velocities of friction."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.events import Contact, Stop
from lag2fmu.description.names import stop_side
from lag2fmu.errors import MechanismError
from lag2fmu.language.parts_of import free_names, parts_of
from lag2fmu.language.rebuilding import has_more_nodes
from lag2fmu.language.units import METRE, Unit
from lag2fmu.language.vocabulary import Choice, TableCall
from lag2fmu.language.writer import to_quote
from lag2fmu.mechanism.completed import Unilateral
from lag2fmu.mechanism.contact_places import Geometry, geometry_of
from lag2fmu.mechanism.poses import poses_of
from lag2fmu.mechanism.starts import start_values, value_at
from lag2fmu.mechanism.unit_check import units_in

_ROUNDING = 1e-9
_SOLVED = 1e-6
"""Relative to the terms of a gap: the gap counts as 0 up to it, with starts as they are typed, and with starts that
were solved for constraints."""

_JUDGED = 40
"""Nodes of a gap whose sign SymPy is asked for: of long ones that takes seconds."""

UnitOf = Callable[[sp.Expr], "Unit | None"]


def unilaterals(m: Description) -> Iterator[Unilateral]:
    """Every ideal contact of ``m``, then the sides of each stop, NAME_lower and NAME_upper, if it has them."""
    if not (m.contacts or m.stops):
        return
    unit_of, poses = units_in(m), poses_of(m)
    for contact in m.contacts:
        if contact.law == "ideal":
            yield _of_contact(contact, geometry_of(m, contact, poses), unit_of)
    for stop in m.stops:
        yield from _of_stop(stop, unit_of)


def _of_contact(contact: Contact, geometry: Geometry, unit_of: UnitOf) -> Unilateral:
    friction = sp.sympify(contact.friction)
    return Unilateral(
        contact.name,
        geometry.gap,
        () if contact.frictionless else geometry.slips,
        sp.sympify(contact.restitution),
        friction,
        friction if contact.static_friction is None else sp.sympify(contact.static_friction),
        METRE if contact.kind is not None else unit_of(geometry.gap),
        f"contacts.{contact.name}",
    )


def _of_stop(stop: Stop, unit_of: UnitOf) -> Iterator[Unilateral]:
    of, restitution = sp.sympify(stop.of), sp.sympify(stop.restitution)
    for side, bound, sign in (("lower", stop.lower, 1), ("upper", stop.upper, -1)):
        if bound is not None:
            name, gap = stop_side(stop.name, side), sign * (of - sp.sympify(bound))
            yield Unilateral(name, gap, (), restitution, sp.S.Zero, sp.S.Zero, unit_of(of), f"stops.{stop.name}.{side}")


def check_gaps(m: Description, found: Iterable[Unilateral]) -> None:
    """Raise MechanismError for a gap without a coordinate, one that is never negative, or has no value at the start."""
    _check_sides(m)
    poses, start, coordinates = poses_of(m), start_values(m), {q.name for q in m.coordinates}
    for unilateral in found:
        gap = poses.resolved(unilateral.gap)
        used = free_names([gap])
        if not free_names([_without_steps(gap)]) & coordinates:
            beyond = " outside of conditions" if used & coordinates else ""
            raise MechanismError(
                f"{unilateral.where}: the gap '{to_quote(unilateral.gap)}' contains no coordinate{beyond}, so no force "
                "can keep it open; leave it out or correct it"
            )
        tabled = any(isinstance(part, TableCall) for part in parts_of([gap]))
        if not tabled and used <= start.keys() and value_at(gap, start) is None:
            at = ", ".join(f"{name} = {start[name]:g}" for name in sorted(used))
            raise MechanismError(
                f"{unilateral.where}: the gap '{to_quote(unilateral.gap)}' cannot be evaluated at the start, where "
                f"{at} (SI); start elsewhere, or correct it"
            )


def _check_sides(m: Description) -> None:
    """Raise MechanismError for a gap that is no less than 0 on either side of where it closes, as a distance is."""
    for contact in m.contacts:
        gap = sp.sympify(contact.gap)
        if gap is not None and not has_more_nodes(gap, _JUDGED) and gap.is_nonnegative:
            raise MechanismError(
                f"contacts.{contact.name}: the gap '{to_quote(gap)}' is never below 0, so nothing tells that a body "
                "goes through; give one that is negative where it must not be, as x - 1 instead of abs(x - 1)"
            )


def _without_steps(gap: sp.Expr) -> sp.Expr:
    """The ``gap`` with 1 in place of comparisons, signs and steps, whose values do not change between switches."""
    parts = [*parts_of([gap])]
    steps = [x for x in parts if isinstance(x, (sp.sign, sp.Heaviside)) or (isinstance(x, Choice) and x.is_condition)]
    return gap.xreplace(dict.fromkeys(steps, sp.S.One)) if steps else gap


def _size_of_terms(x: sp.Expr, start: Mapping[str, float]) -> float:
    """The sum of the absolute terms of ``x``, those of its factors included, which bounds its rounding."""
    if x.is_Add:
        return sum(_size_of_terms(term, start) for term in x.args)
    if x.is_Mul:
        return math.prod(_size_of_terms(factor, start) for factor in x.args)
    return abs(value_at(x, start) or 0.0)


def check_open(m: Description, found: Iterable[Unilateral], *, solved: bool = False) -> None:
    """Raise MechanismError for a gap that is negative at the start, beyond rounding.

    Without ``solved``, gaps with coordinates that constraints may still determine are left out. With ``solved``, the
    starts of ``m`` meet the constraints already.
    """
    poses, start, rounding = poses_of(m), start_values(m, guesses=solved), _SOLVED if solved else _ROUNDING
    for unilateral in found:
        gap = poses.resolved(unilateral.gap)
        value = value_at(gap, start)
        if value is not None and value < 0 and value < -rounding * _size_of_terms(gap, start):
            used = free_names([gap])
            moving = [q.name for q in m.coordinates if q.name in used]
            si = "1" if unilateral.unit is None else unilateral.unit.si_name
            unit = "" if si == "1" else f" {si}"
            at = ", ".join(f"{name} = {start[name]:g}" for name in moving[:6])
            raise MechanismError(
                f"{unilateral.where}: the gap is {value:g}{unit} at the start, where {at} (SI); it cannot be negative: "
                "start apart or touching, or turn the sign of what is meant the other way round"
            )
