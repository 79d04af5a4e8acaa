"""Are contacts, stops, frictions, conditions and further states sound? Run once, when the record is built.

Keys are checked first. Then the values of numbers are checked at the parameters' values, and conditions at the start.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator, Mapping

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.events import CONTACTS, IMPACTS, LAWS, Contact, ContactKind, Friction, Stop
from lag2fmu.errors import MechanismError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.language.parts_of import free_names
from lag2fmu.language.vocabulary import TableCall, value_of
from lag2fmu.language.writer import to_quote, to_text
from lag2fmu.mechanism.geometry import values_of
from lag2fmu.mechanism.poses import Poses, poses_of
from lag2fmu.mechanism.scope import Scope
from lag2fmu.mechanism.starts import start_values, value_at
from lag2fmu.mechanism.velocities import slips

_NO_VALUE = (KeyError, ValueError, ArithmeticError)
_TRIALS, _ROUNDING = 8, 1e-9
"""Random places at which an expression is looked at; it is linear up to this part of its terms."""

_OF_ELLIPSOID = 3
"""Radii of an ellipsoid; those of a flat disc are two and 0."""
_OF_PLACES = ("between", "normal", "radius", "length")
_OF_COMPLIANCE = ("stiffness", "damping", "slip_speed")


# ------------------------------------------------------------------------------------------------- what is written


def check_events(m: Description) -> None:
    """Raise MechanismError for keys of contacts, stops and frictions that do not go together."""
    if m.impacts not in IMPACTS:
        raise MechanismError(f"mechanism.impacts: '{m.impacts}' is unknown; give 'sequential' or 'simultaneous'")
    for contact in m.contacts:
        where = f"contacts.{contact.name}"
        if contact.kind is None:
            _check_gap(contact, where)
        else:
            _check_places(m, contact, where)
        _check_law(contact, where)
    for stop in m.stops:
        if stop.lower is None and stop.upper is None:
            raise MechanismError(f"stops.{stop.name}: 'lower' and 'upper' are missing; give at least one of them")
    for state in m.states:
        if not math.isfinite(state.start):
            raise MechanismError(f"states.{state.name}.start: {state.start!r} is not a finite number")
        if not (math.isfinite(state.nominal) and state.nominal > 0):
            raise MechanismError(f"states.{state.name}.nominal: {state.nominal!r} is not positive")


def _check_gap(contact: Contact, where: str) -> None:
    """Raise MechanismError for keys that do not fit a contact that is given by gap and slip."""
    for key in _OF_PLACES:
        if getattr(contact, key) is not None:
            raise MechanismError(f"{where}.{key}: goes with 'kind'; give it, or leave '{key}' out")
    if contact.gap is None:
        raise MechanismError(f"{where}: 'gap' is missing; give it, or a 'kind' with 'between'")
    if isinstance(contact.slip, tuple) and len(contact.slip) > 2:
        raise MechanismError(f"{where}.slip: has {len(contact.slip)} entries; give one, or 2 in space")
    if contact.slip is None and not contact.frictionless:
        key = "friction" if contact.friction != 0 else "static_friction"
        written = to_text(sp.sympify(getattr(contact, key)))
        raise MechanismError(
            f"{where}.{key}: '{written}' without 'slip'; give the relative tangential velocity that friction opposes"
        )


def _check_places(m: Description, contact: Contact, where: str) -> None:
    """Raise MechanismError for keys that do not fit a contact of a kind between two places.

    The places themselves are checked when the gap is made.
    """
    kind = str(contact.kind)
    if kind not in CONTACTS:
        raise MechanismError(f"{where}.kind: '{kind}' is no contact; {suggestion(kind, CONTACTS)}")
    for key in ("gap", "slip"):
        if getattr(contact, key) is not None:
            raise MechanismError(f"{where}: '{key}' and 'kind' exclude each other; leave one out")
    of = CONTACTS[kind]
    if of.entries != m.dimension:
        fitting = ", ".join(name for name, other in CONTACTS.items() if other.entries == m.dimension)
        raise MechanismError(f"{where}.kind: positions have {m.dimension} entries; '{kind}' is none of {fitting}")
    if contact.between is None or len(contact.between) != 2:
        found = "is missing" if contact.between is None else f"has {len(contact.between)} ends"
        raise MechanismError(f"{where}: 'between' {found}; name what touches, then what it touches")
    _check_measures(contact, of, where)
    _check_normal(m, contact, where)


def _check_measures(contact: Contact, of: ContactKind, where: str) -> None:
    """Raise MechanismError unless normal, radii and lengths are given exactly if the kind has them."""
    for key, needed in (("normal", of.normal), ("radius", of.radii > 0), ("length", of.lengths > 0)):
        if getattr(contact, key) is None and needed:
            raise MechanismError(f"{where}: '{key}' is missing")
        if getattr(contact, key) is not None and not needed:
            raise MechanismError(f"{where}.{key}: does not go with '{contact.kind}'; leave it out")
    for key, expected in (("radius", of.radii), ("length", of.lengths)):
        given = getattr(contact, key)
        count = len(given) if isinstance(given, tuple) else 1
        if expected and count != expected:
            raise MechanismError(f"{where}.{key}: has {count} entries; '{contact.kind}' has {expected}")
    if of.radii == _OF_ELLIPSOID and not any(contact.radius):  # type: ignore[arg-type]
        raise MechanismError(f"{where}.radius: all three are 0; give one that is not, or the kind 'point_plane'")


def _check_normal(m: Description, contact: Contact, where: str) -> None:
    """Raise MechanismError for a planar normal out of the plane, and for one that is 0 at the parameters' values."""
    if contact.normal is None:
        return
    planar = m.dimension == 2
    axis = contact.normal
    if planar and (axis == "z" or (not isinstance(axis, str) and sp.sympify(axis[2]) != 0)):
        raise MechanismError(f"{where}.normal: '{axis}' is out of the plane; give 'x', 'y' or a vector of 2 entries")
    numbers = [] if isinstance(axis, str) else [value_at(sp.sympify(x), values_of(m)) for x in axis]
    if numbers and not any(x is None or x for x in numbers):
        shown = list(map(to_text, map(sp.sympify, axis)))
        raise MechanismError(f"{where}.normal: {shown} is the zero vector at the values given, which is no normal")


def _check_law(contact: Contact, where: str) -> None:
    """Raise MechanismError for keys of the other law: an ideal contact has no stiffness, a compliant no restitution."""
    if contact.law not in LAWS:
        raise MechanismError(f"{where}.law: '{contact.law}' is unknown; give one of {', '.join(LAWS)}")
    if contact.law == "ideal":
        for key in _OF_COMPLIANCE:
            if getattr(contact, key) is not None:
                raise MechanismError(f"{where}.{key}: goes with law = 'compliant'; give it, or leave '{key}' out")
        return
    if contact.stiffness is None:
        raise MechanismError(f"{where}: 'stiffness' is missing, which a compliant contact needs")
    if contact.restitution != 0:
        raise MechanismError(f"{where}.restitution: a compliant contact loses energy by its 'damping'; leave it out")
    if contact.static_friction is not None:
        raise MechanismError(
            f"{where}.static_friction: a compliant contact does not stick; leave it out, or take an ideal contact"
        )
    if (contact.friction != 0) != (contact.slip_speed is not None):
        key, other = ("friction", "slip_speed")[:: 1 if contact.friction != 0 else -1]
        raise MechanismError(f"{where}: '{other}' is missing; '{key}' of a compliant contact goes with it")


# ------------------------------------------------------------------------------------------------- what it means


def check_meaning(m: Description, scope: Scope) -> None:
    """Raise MechanismError for slips that are not affine in the velocities, impossible numbers, and bad conditions.

    ``m`` has everything written out, and its names have been checked.
    """
    poses, values = poses_of(m), values_of(m)
    for where, expression in slips(m):
        _check_affine(where, expression, poses, scope)
    for where, expression, low, high, what in _bounded(m):
        value = value_at(poses.resolved(expression), values)
        if value is not None and not low <= value <= high:
            shown = (
                f"{value:g}" if expression.is_number else f"'{to_quote(expression)}' is {value:g} at the values given"
            )
            raise MechanismError(f"{where}: {shown}; {what}")
    for where, less, more in _ordered(m):
        small, large = (value_at(poses.resolved(x), values) for x in (less, more))
        if small is not None and large is not None and small > large:
            raise MechanismError(
                f"{where}: '{to_quote(less)}' is {small:g} and above '{to_quote(more)}', which is {large:g}; change one"
            )
    start = start_values(m)
    for constraint in m.constraints:
        if constraint.while_ is not None:
            _check_condition(f"constraints.{constraint.kind}.{constraint.name}.while", constraint.while_, poses, start)


def _check_affine(where: str, expression: sp.Expr, poses: Poses, scope: Scope) -> None:
    """Raise MechanismError unless ``expression`` is affine in the velocities that it contains.

    It is tried at random points whether f(a) + f(b) = 2 f((a + b)/2).
    """
    whole = poses.resolved(expression)
    rates = sorted(name for name in free_names([whole]) if scope.meaning[name] in ("velocity", "motion velocity"))
    generator = random.Random(5)
    for _ in range(_TRIALS):
        point = {name: generator.uniform(0.2, 1.0) for name in sorted(free_names([whole]))}
        ends = [point | {name: generator.uniform(-1.0, 1.0) for name in rates} for _ in range(2)]
        middle = point | {name: 0.5 * (ends[0][name] + ends[1][name]) for name in rates}
        try:
            a, b, between = (value_of(whole, at) for at in (*ends, middle))
        except _NO_VALUE:
            continue
        if abs(a + b - 2 * between) > _ROUNDING * (abs(a) + abs(b) + 2 * abs(between)):
            raise MechanismError(
                f"{where}: '{to_quote(expression)}' is not affine in the velocities {', '.join(rates)}; give the "
                "relative velocity itself"
            )


def _bounded(m: Description) -> Iterator[tuple[str, sp.Expr, float, float, str]]:
    """(place, expression, smallest, largest, remedy) of numbers that have bounds."""
    coefficient = "Newton's coefficient is from 0 to 1"
    bouncing = [(f"contacts.{c.name}", c.restitution) for c in m.contacts]
    bouncing += [(f"stops.{s.name}", s.restitution) for s in m.stops]
    for where, restitution in bouncing:
        yield f"{where}.restitution", sp.sympify(restitution), 0.0, 1.0 + _ROUNDING, coefficient
    yield from _measures(m)
    for friction in m.frictions:
        for key in ("force", "static"):
            if getattr(friction, key) is not None:
                wanted = "a force of friction is not negative"
                yield f"frictions.{friction.name}.{key}", sp.sympify(getattr(friction, key)), 0.0, math.inf, wanted


def _measures(m: Description) -> Iterator[tuple[str, sp.Expr, float, float, str]]:
    """What ``_bounded`` gives, of contacts."""
    for contact in m.contacts:
        for key, (low, wanted) in _LEAST.items():
            value = getattr(contact, key)
            entries = value if isinstance(value, tuple) else () if value is None else (value,)
            flat = key == "radius" and len(entries) == _OF_ELLIPSOID
            for entry in (x for x in entries if not (flat and x == 0)):
                yield f"contacts.{contact.name}.{key}", sp.sympify(entry), low, math.inf, f"it has to be {wanted}"


_ROUNDING = 1e-9
"""What an expression may be beyond 1 by the rounding of its terms; the engine takes it for 1."""
_ABOVE_ZERO = math.ulp(0.0)
_LEAST = {
    **dict.fromkeys(("friction", "static_friction", "damping"), (0.0, "0 or more")),
    **dict.fromkeys(("stiffness", "slip_speed", "length"), (_ABOVE_ZERO, "positive")),
    "radius": (_ABOVE_ZERO, "positive; what is within a ring has a gap and a slip of its own instead of a kind"),
}
"""{key of a contact: its smallest value, and words for this bound}."""


def _ordered(m: Description) -> Iterator[tuple[str, sp.Expr, sp.Expr]]:
    """(place, smaller one, greater one) of pairs of expressions whose order is prescribed."""
    parts: list[tuple[str, Contact | Stop | Friction, str, str]] = [
        *((f"contacts.{c.name}.static_friction", c, "friction", "static_friction") for c in m.contacts),
        *((f"stops.{s.name}", s, "lower", "upper") for s in m.stops),
        *((f"frictions.{f.name}.static", f, "force", "static") for f in m.frictions),
    ]
    for where, part, less, more in parts:
        if getattr(part, less) is not None and getattr(part, more) is not None:
            yield where, sp.sympify(getattr(part, less)), sp.sympify(getattr(part, more))


def _check_condition(where: str, condition: object, poses: Poses, start: Mapping[str, float]) -> None:
    """Raise MechanismError unless ``condition`` has a value at the start, and is no plain number."""
    whole = poses.resolved(sp.sympify(condition))
    if whole.is_number:
        raise MechanismError(f"{where}: '{condition}' is a number; leave it out, or give what changes its sign")
    if whole.atoms(TableCall) or not free_names([whole]) <= start.keys():
        return
    try:
        value_of(whole, start)
    except _NO_VALUE:
        shown = ", ".join(f"{name} = {start[name]:g}" for name in sorted(free_names([whole])))
        raise MechanismError(
            f"{where}: '{to_quote(sp.sympify(condition))}' cannot be evaluated at the start, where {shown} (SI); give "
            "an expression that has a value always"
        ) from None
