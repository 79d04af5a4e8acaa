"""The tables and keys of the text format as the reader and the schema for editors take them, from the parts' fields."""

from __future__ import annotations

from lag2fmu.description.description import Description, table_keys
from lag2fmu.description.keys import keys_of
from lag2fmu.description.parts import Constraint

TABLES = {"mechanism": "What the mechanism is."} | {name: of.doc for name, of in table_keys().items()}
"""{table: a sentence on it}."""

SINGLE = {"mechanism": keys_of(Description)} | {
    name: keys_of(of.part) for name, of in table_keys().items() if of.form == "single"
}
"""{table that stands once: its keys}."""

NAMED = {name: keys_of(of.part) for name, of in table_keys().items() if of.form in ("tables", "lines")}
"""{table with a sub-table for each name: the keys of a sub-table}."""

EXPRESSIONS = tuple(name for name, of in table_keys().items() if of.form == "expressions")
"""Tables of one expression for each name."""

CONSTRAINT = keys_of(Constraint)
"""The keys of a constraint that is more than an expression."""
