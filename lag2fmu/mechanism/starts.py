"""The values of all variables that have one at the start."""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.description import Description
from lag2fmu.language.vocabulary import value_of
from lag2fmu.mechanism.geometry import values_of


def start_values(m: Description, *, guesses: bool = False) -> dict[str, float]:
    """{name: SI value} of t, parameters, coordinates, velocities, inputs and further states at the start.

    Motion inputs rest. Coordinates and velocities that constraints determine are among them only with ``guesses``.
    """
    values = values_of(m) | {u.name: u.start for u in m.inputs} | {z.name: z.start for z in m.states}
    for u in m.motions:
        values |= {names.velocity(u.name): 0.0, names.acceleration(u.name): 0.0}
    values |= dict.fromkeys((names.generalized_force(q.name) for q in m.coordinates), 0.0)
    for q in m.coordinates:
        if guesses or q.given is not False:
            values[q.name] = q.start
        if guesses or q.velocity_given is not False:
            values[names.velocity(q.name)] = q.velocity
    return values


def value_at(expression: sp.Expr, values: Mapping[str, float]) -> float | None:
    """The value of ``expression`` at ``values`` {name: SI value}, in SI units; None if it has no value there."""
    try:
        return value_of(expression, values)
    except (KeyError, ValueError, ArithmeticError):
        return None
