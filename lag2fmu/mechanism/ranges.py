"""Ranges: masses, inertias, radii and lengths of springs are never negative; half a range is a nominal value.

A bound of a coordinate is no stop, unless one holds there.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.events import Stop
from lag2fmu.description.symbols import Coordinate, Input, Parameter

Bounds = tuple[float | None, float | None]
"""The least and the greatest value in SI units, None without."""


def half_range(part: Input | Parameter) -> float | None:
    """Half of the range of ``part`` in SI units, which serves as its nominal value; None if it has no range."""
    if part.minimum is None or part.maximum is None or part.minimum == part.maximum:
        return None
    return (part.maximum - part.minimum) / 2


def open_bounds(q: Coordinate, stops: Iterable[Stop]) -> Bounds:
    """The bounds of ``q`` at which none of the ``stops`` holds it."""
    held = [stop for stop in stops if str(stop.of) == q.name]
    ends = ((q.minimum, [stop.lower for stop in held]), (q.maximum, [stop.upper for stop in held]))
    low, high = (None if x is None or sp.Float(x) in map(_value, at) else x for x, at in ends)
    return low, high


def _value(end: object) -> sp.Expr:
    """The ``end`` of a stop as a floating point number where it is one."""
    return sp.sympify(end).evalf() if end is not None else sp.nan


def positive_parameters(m: Description) -> frozenset[str]:
    """The names of the parameters that cannot be negative.

    Each is by itself a mass, a moment of inertia, a radius or a spring's length. A parameter whose value is negative
    is left out.
    """
    names = {str(x) for x in _sizes(m) if x.is_Symbol}
    return frozenset(p.name for p in m.parameters if p.name in names and p.value is not None and p.value >= 0)


def _sizes(m: Description) -> Iterator[sp.Expr]:
    """The expressions of masses, moments of inertia, radii and lengths of springs."""
    for body in m.bodies:
        yield sp.sympify(body.mass)
        if body.inertia is not None:
            # the diagonal of a tensor stands first
            yield from map(sp.sympify, body.inertia[:3] if isinstance(body.inertia, tuple) else [body.inertia])
    for spring in m.springs:
        if spring.between is not None and spring.length is not None:
            yield sp.sympify(spring.length)
    for part in (*m.contacts, *m.joints):
        radius = getattr(part, "radius", None)
        if radius is not None:
            yield sp.sympify(radius)
