"""The variables of contacts, stops, dry frictions and latches: forces, modes, counts and impulses."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import NamedTuple

from lag2fmu.description import names
from lag2fmu.fmu.builder import Builder
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.calculated_units import calculated_units
from lag2fmu.mechanism.record import Mechanism


class Enumeration(NamedTuple):
    """An enumeration: ``items`` {name: (value, meaning)}."""

    doc: str
    items: dict[str, tuple[int, str]]


MODE = "ContactMode"
ENUMERATIONS = {
    MODE: Enumeration(
        "how a contact, a stop or a dry friction holds at present",
        {
            "open": (1, "no force acts"),
            "sticks": (2, "the friction holds: the slip velocity is zero"),
            "slides": (3, "closed: without friction, or sliding in a direction of the plane of contact"),
            "slides_forward": (4, "the slip velocity is positive"),
            "slides_backward": (5, "the slip velocity is negative"),
        },
    )
}
"""The types that variables may have beside Real and Integer; the values are those of ElementMode in the engine."""


def element_names(mechanism: Mechanism) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The names of contacts and stops, and those of dry frictions."""
    return tuple(u.name for u in mechanism.unilaterals), tuple(f.name for f in mechanism.frictions)


def element_modes(mechanism: Mechanism) -> dict[str, str]:
    """{element: its mode} of contacts, stops and dry frictions."""
    return {name: names.mode(name) for kind in element_names(mechanism) for name in kind}


def element_variables(mechanism: Mechanism) -> Iterator[tuple[ScalarVariable, str, int]]:
    """(variable, its VariableKind in C, its index there) of the modes, counts and impulses of ``mechanism``.

    Modes are enumerations, the counts of impacts integers, impulses discrete Reals; all of them local.
    """

    def discrete(name: str, doc: str) -> ScalarVariable:
        return ScalarVariable(name, 0, "local", "discrete", "calculated", doc=doc)

    (unilaterals, frictions), units = element_names(mechanism), calculated_units(mechanism)
    for i, name in enumerate((*unilaterals, *frictions)):
        of = f"the dry friction {name}" if i >= len(unilaterals) else name
        yield discrete(names.mode(name), f"how {of} holds")._replace(type=MODE), "VARIABLE_MODE", i
    for i, u in enumerate(mechanism.unilaterals):
        doc = f"number of impacts of {u.name} since the start"
        yield discrete(names.impacts(u.name), doc)._replace(type="Integer", minimum=0.0), "VARIABLE_IMPACTS", i
        name, doc = names.impulse(u.name), f"normal impulse of the last impact of {u.name}, 0 before the first"
        yield discrete(name, doc)._replace(unit=units[name]), "VARIABLE_IMPULSE", i


def add_elements(builder: Builder, mechanism: Mechanism, outputs: Collection[str]) -> None:
    """Add the variables of ``element_variables`` to ``builder``; those named in ``outputs`` are outputs."""
    for variable, kind, index in element_variables(mechanism):
        causality = "output" if variable.name in outputs else "local"
        builder.add(variable._replace(causality=causality), kind, index)


def row_forces(mechanism: Mechanism) -> Iterator[tuple[str, Unit | None, str]]:
    """(name, unit, description) of the force of each row, in the order of ``dynamics.rows``."""
    units = calculated_units(mechanism)
    known = [(names.force(c.name), f"force in the normal direction of {c.name}") for c in mechanism.unilaterals]
    for c in mechanism.unilaterals:
        known += [(x, f"friction of {c.name} along its slip") for x in names.frictions(c.name, len(c.slips))]
    known += [(names.force(f.name), f"dry friction of {f.name}") for f in mechanism.frictions]
    for latch in mechanism.latches:
        doc = f"multiplier of the constraint {latch.name}, 0 while it does not hold"
        known.append((names.multiplier(latch.name), doc))
    for name, doc in known:
        yield name, units[name], doc
