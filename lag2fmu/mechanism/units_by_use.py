"""Units of quantities that are written without one: those that their use determines."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TypeVar

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.events import State
from lag2fmu.description.symbols import Input, Parameter
from lag2fmu.language.unit_parser import parse_unit
from lag2fmu.mechanism.unit_check import uses_of
from lag2fmu.mechanism.unit_needs import described_in, determined_dimensions

_Declared = TypeVar("_Declared", Parameter, Input, State)


def with_units(m: Description, alike: Sequence[sp.Expr] = (), plain: Iterable[str] = ()) -> Description:
    """``m`` with SI units for parameters, inputs and states that have none, as their use determines them.

    The terms of each sum in ``alike`` have one unit. Of the names in ``plain`` those that are still open then are
    numbers without a dimension, one after the other. Source: as of ``unit_check.missing``.
    """
    own, known, tables, expected = uses_of(m)
    expected += [("", expression, None) for expression in alike]
    determined = determined_dimensions(own, known, tables, expected, plain)
    found = {part.name: parse_unit(described_in("forces.", d)) for part, d in determined}

    def told(parts: Sequence[_Declared]) -> tuple[_Declared, ...]:
        return tuple(replace(part, unit=found[part.name]) if part.name in found else part for part in parts)

    return replace(m, parameters=told(m.parameters), inputs=told(m.inputs), states=told(m.states))
