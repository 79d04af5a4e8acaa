"""The values of all variables of a mechanism at its start."""

from __future__ import annotations

from lag2fmu.description import names
from lag2fmu.mechanism.record import Mechanism

State = dict[str, float]
"""The values of all variables, by name, in SI units."""


def start_values(mechanism: Mechanism) -> State:
    """The start values of all variables by name (SI); accelerations and external forces are 0."""
    values = {"t": 0.0}
    for c in mechanism.coordinates:
        values |= {c.name: c.start, names.velocity(c.name): c.velocity, names.acceleration(c.name): 0.0}
        values[names.generalized_force(c.name)] = 0.0
    values |= {names.multiplier(c.name): 0.0 for c in mechanism.constraints}
    values |= {state.name: state.start for state in mechanism.states}
    for u in mechanism.inputs:
        values |= {u.name: u.start, names.velocity(u.name): 0.0, names.acceleration(u.name): 0.0}
    if mechanism.has_input_rates:
        first = [names.rate(name) for name in values if name != "t"]
        values |= dict.fromkeys((*first, *map(names.rate, first)), 0.0)
    values |= {p.name: p.value for p in mechanism.parameters if p.value is not None}
    return values
