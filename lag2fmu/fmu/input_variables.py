"""The inputs among the variables of an FMU, in the order of the vector u."""

from __future__ import annotations

from collections.abc import Iterable

from lag2fmu.description import names
from lag2fmu.description.symbols import Input
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.language.units import JOULE, SECOND
from lag2fmu.mechanism.ranges import half_range
from lag2fmu.mechanism.record import Mechanism


def input_variables(mechanism: Mechanism) -> Iterable[ScalarVariable]:
    """The inputs in the order of u: Q of every coordinate, plain inputs, motions with their derivatives."""
    for q in mechanism.coordinates:
        unit = None if q.unit is None else JOULE / q.unit
        doc = f"external generalized force on {q.name}"
        yield ScalarVariable(names.generalized_force(q.name), 0, "input", "continuous", None, 0.0, unit, doc)
    for u in mechanism.plain_inputs:
        yield _input(u, u.doc)
    for u in mechanism.motions:
        rates = (names.velocity(u.name), names.acceleration(u.name))
        doc = f"{u.doc or 'prescribed motion'}; to be given with {' and '.join(rates)}"
        yield _input(u, doc)
        unit = u.unit
        for name, rate in zip(rates, ("velocity", "acceleration"), strict=True):
            unit = None if unit is None else unit / SECOND
            doc = f"{rate} of {u.name}, to be given with it"
            yield ScalarVariable(name, 0, "input", "continuous", None, 0.0, unit, doc)


def _input(u: Input, doc: str) -> ScalarVariable:
    bounds = (u.minimum, u.maximum, half_range(u))
    return ScalarVariable(u.name, 0, "input", "continuous", None, u.start, u.unit, doc, *bounds)
