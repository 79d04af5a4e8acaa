"""Ranges that nobody gave, as masses, inertias, radii and lengths of springs are not negative, and half of a range."""

from __future__ import annotations

from collections.abc import Iterator

import sympy as sp

from lag2fmu.description.record import Description
from lag2fmu.description.symbols import Input, Parameter


def half_range(part: Input | Parameter) -> float | None:
    """Half of the range of ``part`` in SI units, a nominal value as coordinates have it; None where it has none."""
    if part.minimum is None or part.maximum is None or part.minimum == part.maximum:
        return None
    return (part.maximum - part.minimum) / 2


def positive_parameters(m: Description) -> frozenset[str]:
    """The names of the parameters that are, by themselves, a mass, a moment of inertia, a radius or a spring's length.

    A parameter that is negative already is none of them.
    """
    names = {str(x) for x in _sizes(m) if x.is_Symbol}
    return frozenset(p.name for p in m.parameters if p.name in names and p.value is not None and p.value >= 0)


def _sizes(m: Description) -> Iterator[sp.Expr]:
    """The expressions of such quantities."""
    for body in m.bodies:
        yield sp.sympify(body.mass)
        if body.inertia is not None:
            # of a tensor the diagonal, which stands first
            yield from map(sp.sympify, body.inertia[:3] if isinstance(body.inertia, tuple) else [body.inertia])
    for spring in m.springs:
        if spring.between is not None and spring.length is not None:
            yield sp.sympify(spring.length)
    for part in (*m.contacts, *m.joints):
        radius = getattr(part, "radius", None)
        if radius is not None:
            yield sp.sympify(radius)
