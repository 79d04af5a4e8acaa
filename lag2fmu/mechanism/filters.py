"""Filtered motions, written out: the input that they follow, and the two states of a critically damped filter.

T^2 y_ddot + 2 T y_dot + y = y_target has both poles at -1/T. Position, velocity and acceleration agree at any time,
whatever the input does. A step of the input moves the mechanism without a jump of its velocity. If the derivatives of
the target are known, the equations use them, see ``dynamics.variables.led``.
Source: K. Ogata, Modern Control Engineering, 5th edition, section 5-3 (second-order systems).
"""

from __future__ import annotations

from dataclasses import replace

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.description import Description
from lag2fmu.description.events import State
from lag2fmu.description.parts import Definition
from lag2fmu.description.symbols import FILTERED, Input
from lag2fmu.errors import MechanismError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.language.parts_of import free_names
from lag2fmu.language.units import SECOND, Unit
from lag2fmu.language.vocabulary import symbol
from lag2fmu.mechanism.geometry import values_of
from lag2fmu.mechanism.starts import value_at


def with_filters(m: Description) -> tuple[Description, dict[str, str]]:
    """``m`` with the targets of its filtered motions as inputs and the filters as further states, and their origins.

    Raises MechanismError for a time constant (s) that is not positive, or contains anything but parameters. Source: K.
    Ogata, Modern Control Engineering, 5th edition, section 5-3.
    """
    filtered = [u for u in m.inputs if u.motion == FILTERED]
    if not filtered:
        return m, {}
    origins: dict[str, str] = {}
    states, definitions = [*m.states], [*m.definitions]
    for u in filtered:
        place, rate, definition = _filter(m, u)
        states += [place, rate]
        definitions.append(definition)
        brought = (f"inputs.{names.target(u.name)}", f"states.{place.name}", f"states.{rate.name}")
        origins |= dict.fromkeys((*brought, f"definitions.{definition.name}"), f"inputs.{u.name}")
    inputs = tuple(_target(u) if u.motion == FILTERED else u for u in m.inputs)
    return replace(m, inputs=inputs, states=tuple(states), definitions=tuple(definitions)), origins


def _target(u: Input) -> Input:
    doc = f"{u.doc or 'prescribed motion'}; {u.name} follows it by a critically damped filter"
    return replace(u, name=names.target(u.name), motion=False, time_constant=None, doc=doc)


def _filter(m: Description, u: Input) -> tuple[State, State, Definition]:
    """The two states, position and velocity, and the definition of the acceleration; they start at rest."""
    T = sp.sympify(u.time_constant)
    where = f"inputs.{u.name}.time_constant"
    unknown = sorted(free_names([T]) - {p.name for p in m.parameters})
    if unknown:
        known = suggestion(unknown[0], [p.name for p in m.parameters])
        raise MechanismError(f"{where}: '{unknown[0]}' is no parameter, of which a time constant is made; {known}")
    value = value_at(T, values_of(m))
    if value is None or not value > 0:
        found = "has no value" if value is None else f"is {value:g} s"
        raise MechanismError(f"{where}: '{T}' {found} at the values given; give a positive one")
    y, y_dot, target = (symbol(name) for name in (u.name, names.velocity(u.name), names.target(u.name)))
    y_ddot = ((target - y) / T - 2 * y_dot) / T
    rate_unit: Unit | None = None if u.unit is None else u.unit / SECOND
    of, acceleration = u.doc or "prescribed motion", names.acceleration(u.name)
    place = State(u.name, u.unit, u.start, y_dot, doc=f"{of}, filtered", moves=u.name)
    moving, told = symbol(acceleration), f"velocity of {u.name}"
    rate = State(names.velocity(u.name), rate_unit, 0.0, moving, doc=told, moves=u.name)
    return place, rate, Definition(acceleration, y_ddot)
