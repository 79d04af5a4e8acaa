"""Keys: the name of a part's field in the text format, and everything else that is known about the field.

A key stands once, in the metadata of its dataclass field. The reader, the writer, the schema for editors, the normal
form of parts, the check of names and the check of units derive from it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, field, fields
from functools import cache
from typing import Any, NamedTuple

from lag2fmu.language.units import Unit

CONSTANT = frozenset({"parameter"})
GIVEN = CONSTANT | {"time"}
CONFIGURATION = GIVEN | {"coordinate", "motion"}
STATE = CONFIGURATION | {"velocity", "motion velocity"}
ANY = STATE | {"input", "motion acceleration", "further state"}
BORNE = ANY | {"multiplier", "contact force"}
"""Sets of the kinds of names that expressions may use, each a part of the next one; see ``Scope`` of the mechanism."""

OWN_RATE = "damper's own rate"
"""The kind of the name that only the force of a damper may use."""

OWN = "own"
"""Stands for the unit that the part itself declares."""


class Key(NamedTuple):
    """A key of a table.

    - ``kind``: the kind of values that it takes, one of ``schema.VALUES``; a tuple lists the only strings that it
      takes.
    - ``doc``: a sentence for the editor.
    - ``name``: the key itself; ``field``: the name of the dataclass field.
    - ``default``: the value if the key is absent; numbers are in the unit of the part.
    - ``names``: the kinds of names that its expression may use.
    - ``unit``: the unit that it should have, None for any.
    - ``order``: keys stand in the text by this number, and then in the order of the fields.
    """

    kind: str | tuple[str, ...]
    doc: str
    default: Any = None
    name: str = ""
    field: str = ""
    names: frozenset[str] = frozenset()
    unit: Unit | str | None = None
    order: int = 0

    @property
    def required(self) -> bool:
        """Whether the key must be there."""
        return self.default is MISSING


def key(
    kind: str | tuple[str, ...],
    doc: str,
    *,
    default: Any = MISSING,
    name: str = "",
    names: frozenset[str] = frozenset(),
    unit: Unit | str | None = None,
    order: int = 0,
    compare: bool = True,
) -> Any:
    """The field of a part that the text format has under ``name``, by default the field's own; see ``Key``.

    Without a ``default`` it is required. Without ``compare`` equal parts may differ in it.
    """
    known = Key(kind, doc, default, name, "", names, unit, order)
    return field(default=default, compare=compare, metadata={"key": known})


def unit_key(order: int = 0) -> Any:
    """The field of the unit that a part declares."""
    doc = "A unit, e.g. m, kg.m2, N.m.s/rad, deg; 1: dimensionless; none: no check of dimensions."
    return key("unit", doc, default=None, order=order)


def doc_key(order: int = 0) -> Any:
    """The field of a sentence for the reader."""
    return key("string", "A sentence for the reader.", default="", order=order)


def bound_key(name: str) -> Any:
    """The field of the smallest ("min") or largest ("max") value."""
    which = "Smallest" if name == "min" else "Largest"
    return key("number", f"{which} value, in the unit.", default=None, name=name)


def keys_in(part: Any) -> tuple[Key, ...]:
    """The keys of a part or of a class of parts, in the order of its fields."""
    kind: Any = part if isinstance(part, type) else type(part)
    return _keys_in(kind)


def keys_of(part: Any) -> Mapping[str, Key]:
    """The keys of a part or of a class of parts by name, in the order in which they stand in a text."""
    return {found.name: found for found in sorted(keys_in(part), key=lambda found: found.order)}


@cache
def _keys_in(part: type) -> tuple[Key, ...]:
    found = ((item.name, item.metadata["key"]) for item in fields(part) if "key" in item.metadata)
    return tuple(known._replace(field=field, name=known.name or field) for field, known in found)


class TableKey(NamedTuple):
    """A table of the text: what kind of ``part`` it holds, a sentence for the editor, and its ``form``.

    "single": the keys of one part; "tables": a table [TABLE.NAME] for each part; "lines": a line NAME = { ... } for
    each; "expressions": a line NAME = expression for each; "kinds": lines in a table [constraints.KIND] for each kind.
    """

    part: type
    doc: str
    form: str

    @property
    def many(self) -> bool:
        """Whether it holds any number of parts."""
        return self.form != "single"


def table_key(part: type, form: str, doc: str, *, default: Any = ()) -> Any:
    """The field of a table, see ``TableKey``."""
    return field(default=default, metadata={"table": TableKey(part, doc, form)})
