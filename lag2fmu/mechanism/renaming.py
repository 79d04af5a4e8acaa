"""The names of a part in the whole: everything that a description declares and refers to gets a prefix."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import fields, replace
from typing import Any

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.description import Description, label_of, table_keys
from lag2fmu.description.keys import OWN_RATE, Key, keys_in
from lag2fmu.description.parts import Force
from lag2fmu.description.places import WORLD, Rotation
from lag2fmu.description.ports import Acting
from lag2fmu.description.symbols import FILTERED
from lag2fmu.errors import MechanismError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.language.vocabulary import TableCall, symbol, table_function
from lag2fmu.mechanism.loads import with_inputs

SHARED = ("parameters", "inputs", "tables")
"""The tables whose entries a part may share with the whole."""


def renamed(d: Description, prefix: str, share: Collection[str]) -> Description:
    """``d`` with ``prefix`` before all names but those in ``share``, and without the entries with these names.

    Raises MechanismError for an expression with a name that ``d`` does not know.
    """
    renaming = _Renaming(d, prefix, frozenset(share))
    tables: dict[str, Any] = {}
    for name, of in table_keys().items():
        content = getattr(d, name)
        if of.many:
            kept = (x for x in content if name not in SHARED or x.name not in share)
            tables[name] = tuple(renaming.record(x, f"{name}.{label_of(x)}") for x in kept)
        else:
            tables[name] = content if content is None else renaming.record(content, name)
    return replace(d, **tables)


class _Renaming:
    """Gives each name of ``d`` its new name."""

    def __init__(self, d: Description, prefix: str, share: frozenset[str]) -> None:
        self.prefix, self.share = prefix, share
        self.known = {"t": "t"}
        moving = [q.name for q in d.coordinates] + [*d.driven]
        for derived in (str, names.velocity, names.acceleration):
            self.known |= {derived(name): derived(self.of(name)) for name in moving}
        self.known |= {names.generalized_force(q.name): names.generalized_force(self.of(q.name)) for q in d.coordinates}
        self.known |= {names.force(name): names.force(self.of(name)) for name in d.unilateral_names}
        plain: list[Any] = [
            *d.parameters,
            *d.plain_inputs,
            *(replace(u, name=names.target(u.name)) for u in d.inputs if u.motion == FILTERED),
            *(u for _, u in with_inputs(d)[1]),
            *d.states,
            *d.definitions,
        ]
        self.known |= {x.name: self.of(x.name) for x in plain}

    def of(self, name: str) -> str:
        """The new name of the declared ``name``."""
        return name if name in self.share else self.prefix + name

    def record(self, record: Any, where: str) -> Any:
        """``record`` under its new name, with everything that it refers to."""
        changes = {k.field: self._value(getattr(record, k.field), k, f"{where}.{k.name}") for k in keys_in(record)}
        own = "coordinate" if isinstance(record, Force) else "name"
        if own in (item.name for item in fields(record)):
            changes[own] = self.of(getattr(record, own))
        return replace(record, **changes)

    def _value(self, value: Any, key: Key, where: str) -> Any:
        if key.kind == "part":
            return self._reference(value)
        if key.kind == "choice":
            return value  # the whole decides which inputs there are
        if key.kind == "acting":
            return tuple(Acting(self._place(place), axes) for place, axes in value)
        if key.kind == "motions":
            return tuple(map(self.of, value))
        if key.kind == "places":
            return tuple(map(self._place, value))
        if key.kind == "names" and value is not None:
            return tuple(map(self._reference, value))
        return mapped(value, lambda x: self._expression(x, key, where))

    def _reference(self, name: str | None) -> str | None:
        return name if name in (None, WORLD) else self.prefix + str(name)

    def _place(self, place: str) -> str:
        """The new name of the ``place`` of a port; the table before it, if there is one, stays."""
        table, dot, name = place.rpartition(".")
        return f"{table}{dot}{self._reference(name)}"

    def _expression(self, expression: sp.Expr, key: Key, where: str) -> sp.Expr:
        new = {s: symbol(self._name(s.name, key, where)) for s in expression.free_symbols}
        calls = expression.atoms(TableCall)
        if calls:
            expression = expression.replace(
                lambda x: isinstance(x, TableCall), lambda x: table_function(self.of(x.table))(*x.args)
            )
        return expression.xreplace(new)

    def _name(self, name: str, key: Key, where: str) -> str:
        if name in self.known:
            return self.known[name]
        if name == names.DAMPER_RATE and OWN_RATE in key.names:
            return name
        bare = names.multiplier("")
        if name.startswith(bare):
            return names.multiplier(self.prefix + name.removeprefix(bare))
        raise MechanismError(f"{where}: undefined symbol '{name}'; {suggestion(name, self.known)}")


def mapped(value: Any, change: Callable[[sp.Expr], sp.Expr]) -> Any:
    """``value`` with ``change`` made to every expression in it."""
    if isinstance(value, sp.Expr):
        return change(value)
    if isinstance(value, Rotation):
        return Rotation(mapped(value.axis, change), mapped(value.angle, change))
    return tuple(mapped(x, change) for x in value) if isinstance(value, tuple) else value
