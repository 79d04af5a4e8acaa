"""Reading a mechanism from its text format, TOML (https://toml.io/en/v1.0.0), safely: nothing in the text is evaluated.

The tables are the fields of ``Description``, and the keys are the fields of its parts; both say which values they take.
Numbers are exact until they are converted to SI units, where they are rounded once. ``write.write`` is the inverse.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from lag2fmu.description.description import Description, table_keys
from lag2fmu.description.keys import Key, keys_of
from lag2fmu.description.parts import KINDS
from lag2fmu.description.places import WORLD
from lag2fmu.description.subsystems import Part
from lag2fmu.description.symbols import Coordinate, start_or_guess
from lag2fmu.description.visuals import Visual
from lag2fmu.errors import LoadError, MechanismError, TextError
from lag2fmu.formats.keys import CONSTRAINT, NAMED, SINGLE, TABLES
from lag2fmu.formats.robots import ENDINGS, robot
from lag2fmu.formats.syntax import parse_toml
from lag2fmu.formats.toml_table import Surroundings, TomlTable
from lag2fmu.language.identifiers import suggestion
from lag2fmu.language.units import DIMENSIONLESS, SECOND, Unit
from lag2fmu.mechanism.assembly import Settable, settable
from lag2fmu.mechanism.record import Mechanism, complete

MAX_BYTES = 1_000_000
MAX_FILES = 8
"""A longer chain of files that name each other counts as a circle."""


def read_file(path: Path) -> Mechanism:
    """The mechanism in the file ``path``; raises TextError, its message starting with the path."""
    return read(_text_in(path), str(path))


def _text_in(path: Path) -> str:
    """The text of the file ``path``; raises TextError, its message starting with the path."""
    try:
        size = path.stat().st_size
        content = b"" if size > MAX_BYTES else path.read_bytes()
    except OSError as error:
        raise TextError(f"{path}: cannot be read: {error.strerror}") from error
    if size > MAX_BYTES:
        raise TextError(f"{path}: has {size} bytes; a mechanism of more than {MAX_BYTES} bytes is not read")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise TextError(
            f"{path}: byte {error.start} ({content[error.start]:#04x}) is not UTF-8; save the file as UTF-8"
        ) from None


def read(text: str, where: str) -> Mechanism:
    """The mechanism that ``text`` describes; ``where`` (a file name) starts the message of every error.

    Raises TextError with file, table and key for whatever is wrong: syntax, a type, a name, a unit, a circle.
    """
    if len(text) > MAX_BYTES:
        raise TextError(f"{where}: has {len(text)} characters; a mechanism of more than {MAX_BYTES} is not read")
    try:
        path = Path(where)
        return complete(_description(parse_toml(text), Surroundings(path.parent, files=(path.absolute(),), known={})))
    except MechanismError as error:
        raise TextError(f"{where}: {error}") from error


# ---------------------------------------------------------------------------------------------------------- tables

_READ: dict[str, Callable[[TomlTable, str], object]] = {
    "string": TomlTable.text,
    "part": TomlTable.text,
    "unit": TomlTable.unit,
    "flag": TomlTable.flag,
    "motion": TomlTable.motion,
    "expression": TomlTable.expression,
    "vector": TomlTable.vector,
    "expression or vector": TomlTable.scalar_or_vector,
    "axis": TomlTable.axis,
    "names": TomlTable.names,
    "texts": TomlTable.choice,
    "choice": TomlTable.choice,
    "acting": TomlTable.acting,
    "places": TomlTable.names,
    "motions": TomlTable.names,
    "rotations": TomlTable.rotations,
    "file": TomlTable.file,
    "columns": TomlTable.columns,
    "units": TomlTable.units,
}
"""{kind of a ``Key``: the function that reads it}; numbers need the unit of their table, see ``_values``."""


def _description(content: object, around: Surroundings, where: str = "") -> Description:
    """The description in the tables ``content``, which stand at ``where`` in a text."""
    tables = content.get("tables", {}) if isinstance(content, dict) else {}
    around = around._replace(tables=tuple(tables) if isinstance(tables, dict) else ())
    _check_tables(content, around.tables, where)
    for key in content if isinstance(content, dict) and not where else ():
        if key in SINGLE["mechanism"] and key not in TABLES:
            raise TextError(f"{key}: stands before the first table; write it below the line [mechanism]")
    root = TomlTable(where, content, TABLES, around)
    root.require("mechanism", '; a mechanism begins with [mechanism] and name = "..."')
    head = _values(Description, root.table("mechanism", SINGLE["mechanism"]))
    written = {name: of for name, of in table_keys().items() if name in root.content}
    parts: dict[str, Any] = {name: _FORMS[of.form](root, name, of.part) for name, of in written.items()}
    return Description(**head, **parts)


def _check_tables(content: object, tables: Iterable[str], where: str) -> None:
    """Raise TextError for a table with the name of a symbol, which would be read as a call without an argument."""
    place = f"{where}." if where else ""
    for group in ("coordinates", "parameters", "inputs", "states", "definitions"):
        declared = content.get(group) if isinstance(content, dict) else None
        for name in sorted(set(tables) & set(declared if isinstance(declared, dict) else ())):
            taken = f"{place}{group}.{name}"
            raise TextError(f"{place}tables.{name}: the name '{name}' is already taken by {taken}; choose another one")


def _single(root: TomlTable, name: str, kind: type) -> object:
    return _part(kind, root.table(name, SINGLE[name]))


def _named(root: TomlTable, name: str, kind: type) -> list[object]:
    """A part for each of the sub-tables."""
    parts = root.table(name)
    subs = {label: parts.table(label, NAMED[name]) for label in parts.content}
    more = {"folder": root.around.folder} if kind is Visual else {}
    return _parts(subs) if kind is Part else [_part(kind, sub, label, **more) for label, sub in subs.items()]


def _expressions(root: TomlTable, name: str, kind: type) -> list[object]:
    """A part for each of the expressions."""
    parts = root.table(name)
    return [kind(label, parts.expression(label)) for label in parts.content]


def _constraints(root: TomlTable, name: str, kind: type) -> list[object]:
    """The constraints in the tables of their kinds; each is an expression, or a table with its unit."""
    kinds = root.table(name, KINDS)
    found = []
    for of in kinds.content:
        table = kinds.table(of)
        for label, content in table.content.items():
            if isinstance(content, dict):
                found.append(_part(kind, table.table(label, CONSTRAINT), label, kind=of))
            else:
                found.append(kind(label, table.expression(label), of))
    return found


_FORMS: dict[str, Callable[[TomlTable, str, type], object]] = {
    "single": _single,
    "tables": _named,
    "lines": _named,
    "expressions": _expressions,
    "kinds": _constraints,
}
"""{form of a ``TableKey``: the function that reads it}."""


def _part(part: type, table: TomlTable, *label: str, **more: object) -> object:
    """The record of the part called ``label``, from its ``table`` and ``more`` fields, which are no keys of it."""
    return part(*label, **_values(part, table), **more)


def _values(part: type, table: TomlTable) -> dict[str, Any]:
    """{field: value} of the keys in ``table``, and of absent numbers whose default is in the unit of the part."""
    keys = keys_of(part)
    for name, known in keys.items():
        if known.required:
            table.require(name)
    unit = (table.unit() if "unit" in keys else None) or DIMENSIONLESS
    convert = {"number": unit.to_si, "difference": unit.difference_to_si}
    values: dict[str, Any] = {}
    for name in filter(table.content.__contains__, keys):
        known = keys[name]
        if known.kind in convert:
            values[known.field] = _quantity(table, name, known, unit)
        else:
            values[known.field] = _READ["string" if isinstance(known.kind, tuple) else known.kind](table, name)
    if part is Coordinate:
        values |= _starts(values, table.where)
    for known in keys.values():
        if known.kind in convert and known.default is not None:
            values.setdefault(known.field, convert[str(known.kind)](known.default))
    return values


def _quantity(table: TomlTable, name: str, known: Key, unit: Unit) -> float | None:
    """The number ``name`` in SI: in the unit of its key, or in that of the part, velocities by s."""
    per = SECOND if known.field in ("velocity", "velocity_given") else None
    return table.quantity(name, known.unit if isinstance(known.unit, Unit) else unit, known.kind == "difference", per)


def _starts(values: dict[str, Any], where: str) -> dict[str, Any]:
    """``values`` of a coordinate with starts and flags that they are given; these fields held the guesses before."""
    found: dict[str, Any] = {"nominal_from": "given" if "nominal" in values else ""}
    for start, given, guess in (("start", "given", "guess"), ("velocity", "velocity_given", "guess_velocity")):
        value, found[given] = start_or_guess(values.get(start), values.get(given), where, start, guess)
        found |= {} if value is None else {start: value}
    return found


# ----------------------------------------------------------------------------------------------------------- parts


def _parts(tables: Mapping[str, TomlTable]) -> list[object]:
    """The parts of a mechanism. The numbers of their settings are in the units that their mechanisms declare."""
    found: dict[str, Part] = {}
    for name, table in tables.items():
        file, of = table.file("file"), _mechanism_of(table, found)
        settings = table.table("set")
        known = settable(of) if settings.content and of is not None else {}
        found[name] = Part(
            name,
            of,
            file,
            {setting: _setting(settings, setting, known.get(setting)) for setting in settings.content},
            table.names("share") or (),
            table.text("parent", WORLD) or WORLD,
        )
    return list(found.values())


def _mechanism_of(table: TomlTable, before: Mapping[str, Part]) -> Description | None:
    """The mechanism of the part in ``table``: that of a file, that of its tables, or that of a part ``before``."""
    file, of = table.file("file"), table.content.get("of")
    if table.where.count(".of.") >= MAX_FILES:
        raise TextError(f"{table.where[:60]}...: parts of parts are nested deeper than {MAX_FILES}")
    if file is not None:
        return _mechanism_in(file, table)
    if isinstance(of, str):
        if of not in before:
            raise TextError(f"{table.place('of')}: there is no part '{of}' before this one; {suggestion(of, before)}")
        same: Description = before[of].of
        return same
    return None if of is None else _description(of, table.around, table.place("of"))


def _setting(settings: TomlTable, name: str, of: Settable | None) -> Any:
    """The SI value of a number in the unit of the parameter or start that it is ``of``; or an expression."""
    if isinstance(settings.content[name], str) or of is None:
        return settings.expression(name)
    return settings.number(name, of.unit.difference_to_si if of.rate else of.unit.to_si)


def _mechanism_in(file: Path, table: TomlTable) -> Description:
    """The mechanism in the ``file`` of the part that ``table`` describes; raises TextError with both places."""
    place, files = table.place("file"), (*table.around.files, file.absolute())
    if file.suffix not in (".toml", *ENDINGS):
        known = f".toml, {' or '.join(ENDINGS)}"
        raise TextError(f"{place}: '{file.name}' is no {known} file; in Python any mechanism can be a part")
    if file.absolute() in table.around.files or len(files) > MAX_FILES:
        listed = " -> ".join(path.name for path in files)
        circle = "is in a circle" if file.absolute() in table.around.files else "is nested too deeply"
        raise TextError(f"{place}: '{file.name}' {circle}: {listed}; leave out one of these parts")
    around = Surroundings(file.parent, files=files, known=table.around.known)
    try:
        if file not in around.known:
            around.known[file] = (
                robot(file) if file.suffix in ENDINGS else _description(parse_toml(_text_in(file)), around)
            )
        return around.known[file]
    except (MechanismError, LoadError) as error:
        text = str(error)
        raise TextError(f"{place}: {text if text.startswith(str(file)) else f'{file}: {text}'}") from error
