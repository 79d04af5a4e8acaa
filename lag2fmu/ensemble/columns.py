"""The numbers of quantities and events in compiled code."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches

import numpy as np

from lag2fmu.ensemble.batch import Integers
from lag2fmu.errors import LoadError
from lag2fmu.fmu.builder import VariableTable


def columns_of(table: VariableTable) -> dict[str, int]:
    """{name: index in the vector of quantities, see batch.h} of all quantities that can be asked for."""
    tables = table.tables
    n = len(tables.coordinate_names)
    unknowns = 2 * n + tables.further
    rates = unknowns + n + len(tables.constraint_names)
    local = rates + tables.further
    begins = {
        "VARIABLE_STATE": 0,
        "VARIABLE_MASSLESS": 0,
        "VARIABLE_ACCELERATION": unknowns,
        "VARIABLE_MULTIPLIER": unknowns + n,
        "VARIABLE_FURTHER_RATE": rates,
        "VARIABLE_LOCAL": local,
        "VARIABLE_INPUT": local + sum(slot.kind == "VARIABLE_LOCAL" for slot in tables.slots),
    }
    slots = {v.name: tables.slots[v.value_reference] for v in table.variables}
    return {name: begins[slot.kind] + slot.index for name, slot in slots.items() if slot.kind in begins}


def numbers_of(kind: str, wanted: Sequence[str], table: VariableTable) -> Integers:
    """The indices (k,) of the quantities ``wanted``; raises LoadError, which calls an unknown name a ``kind``."""
    known = columns_of(table)
    for name in wanted:
        if name not in known and any(v.name == name for v in table.variables):
            why = "it is a parameter, or events alone change it"
            raise LoadError(f"the {kind} '{name}' has no values in a batch: {why}; ask for events, or run the FMU")
        if name not in known:
            raise unknown(kind, name, known)
    return np.array([known[name] for name in wanted], dtype=np.int64)


def event_kinds_of(wanted: Sequence[str], events: Mapping[str, int]) -> Integers:
    """The numbers of the events ``wanted``, (k,); raises LoadError for an unknown one."""
    for name in wanted:
        if name not in events:
            raise unknown("event", name, events)
    return np.array([events[name] for name in wanted], dtype=np.int64)


def unknown(kind: str, name: str, known: Iterable[str]) -> LoadError:
    """The error that no ``known`` name of this ``kind`` is ``name``; it suggests similar names."""
    names = list(known)
    near = get_close_matches(name, names) or names[:20]
    return LoadError(f"there is no {kind} '{name}'; known are {', '.join(near) or 'none'}")
