"""The page that is written from the code: the text format."""

from __future__ import annotations

from collections.abc import Mapping

from lag2fmu.description.description import Description, table_keys
from lag2fmu.description.keys import Key, TableKey, keys_of
from lag2fmu.description.parts import KINDS
from lag2fmu.formats.keys import SINGLE, TABLES
from lag2fmu.language import units, vocabulary

FORMS = {
    "single": "`[{name}]` stands once.",
    "tables": "Each one is a table `[{name}.NAME]`.",
    "lines": "Each one is a line `NAME = {{ ... }}` in `[{name}]`.",
    "expressions": 'Each one is a line `NAME = "expression"` in `[{name}]`.',
    "kinds": 'Each one is a line `NAME = "expression"`, or `NAME = {{ ... }}`, in {kinds}.',
}
"""Form of a table -> where it stands in the text."""

VALUES = {
    "part": "name",
    "difference": "number",
    "flag": "`true` or `false`",
    "file": "path",
    "names": "list of names",
    "vector": "list of expressions",
    "rotations": "list of [axis, angle]",
    "axis": "`x`, `y`, `z` or 3 numbers",
    "settings": "table NAME = value",
    "mechanism": "tables, or a name",
    "columns": "list of columns",
    "units": "list of units",
}
"""Kind of a key -> what is written there; other kinds speak for themselves."""


def page() -> str:
    """The page on the text format, in Markdown."""
    tables = "\n".join(_table(name, of) for name, of in table_keys().items())
    return f"""# The text format

This page is written from the code: from the fields of the records that the reader, the writer and the schema for
editors use too. [First steps](../first-steps.md) introduces the format; `lag2fmu new NAME` writes a commented example.
A mechanism is a file in [TOML](https://toml.io). `[mechanism]` is the only table that a file needs. The column
"Python" is there where the argument of the record in Python has another name.

## Expressions

An expression is a text or a number. It computes in SI units. It may use numbers, `pi`, the time `t`, the names that
the file declares, and `NAME_dot` for the velocity of a coordinate. A prescribed motion `NAME` has `NAME_dot` and
`NAME_ddot`, too. The operators are `+ - * / ** ( )`, the comparisons `< <= > >=`, and `and`, `or`, `not`. The functions
are {_functions()}. Expressions are read and never run as a program.

## Units

A value is given in the unit that stands beside it, and is converted to SI. A unit is a product of powers such as
`N.m`, `N*m`, `kg.m2`, `kg*m^2`, `m/s**2`, and `1` for what has no dimension. The names are {_units()}.

{_mechanism()}
{tables}"""


def _mechanism() -> str:
    form = FORMS["single"].format(name="mechanism")
    return _section("mechanism", TABLES["mechanism"], form, SINGLE["mechanism"], Description)


def _functions() -> str:
    return ", ".join(f"`{name}`" for name in (*vocabulary.FUNCTIONS, "if(condition, a, b)", "smooth(...)"))


def _units() -> str:
    named = [name for name in units.NAMED if name]
    prefixes = ", ".join(f"`{prefix}`" for prefix in units.PREFIXES)
    return f"{', '.join(f'`{name}`' for name in named)}; those of SI take the prefixes {prefixes}"


def _table(name: str, of: TableKey) -> str:
    kinds = " and ".join(f"`[{name}.{kind}]`" for kind in KINDS)
    form = FORMS[of.form].format(name=name, kinds=kinds)
    keys = {} if of.form == "expressions" else keys_of(of.part)
    return _section(name, of.doc, form, keys, of.part)


def _section(name: str, doc: str, form: str, keys: Mapping[str, Key], part: type) -> str:
    head = f"## {name}\n\n{doc} {form} In Python: `{part.__name__}`.\n"
    if not keys:
        return head
    rows = "".join(_row(key) for key in keys.values())
    return f"{head}\n| key | what stands there | default | meaning | Python |\n|---|---|---|---|---|\n{rows}"


def _row(key: Key) -> str:
    value = (
        " or ".join(f"`{word}`" for word in key.kind) if isinstance(key.kind, tuple) else VALUES.get(key.kind, key.kind)
    )
    default = "needed" if key.required else "" if key.default in (None, "", ()) else f"`{_written(key.default)}`"
    python = f"`{key.field}`" if key.field != key.name else ""
    return f"| `{key.name}` | {value} | {default} | {_safe(key.doc)} | {python} |\n"


def _written(value: object) -> str:
    return (
        str(value).lower() if isinstance(value, bool) else str(list(value)) if isinstance(value, tuple) else str(value)
    )


def _safe(text: str) -> str:
    """``text`` without what Markdown would take for more than text."""
    return text.replace("|", "\\|").replace("*", "\\*").replace("[", "\\[").replace("NAME_", "NAME\\_")
