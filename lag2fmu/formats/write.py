"""Writing a mechanism as text: the inverse of ``text.read``, in the order of the tables of a description."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from decimal import Context, Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import sympy as sp

from lag2fmu.description.description import Description, label_of, table_keys
from lag2fmu.description.keys import keys_of
from lag2fmu.description.outputs import Output
from lag2fmu.description.parts import KINDS, Constraint
from lag2fmu.description.places import WORLD
from lag2fmu.description.ports import NONE, Acting
from lag2fmu.description.subsystems import Part
from lag2fmu.description.symbols import Coordinate
from lag2fmu.description.tables import Table
from lag2fmu.language.units import DIMENSIONLESS, Unit, exact
from lag2fmu.language.writer import number_text, to_text
from lag2fmu.mechanism.assembly import settable
from lag2fmu.mechanism.record import Mechanism

Values = Mapping[str, str | None]
"""Keys of one table with their values as TOML text; None is left out."""


def write(mechanism: Mechanism, folder: Path | None = None) -> str:
    """The description of ``mechanism`` in TOML: ``read(write(mechanism), ...) == mechanism`` exactly.

    For a text in another ``folder`` than before, files of meshes that are there are named from it on.

    Entries that follow from the description are not part of the text, nor are defaults, except those of numbers. The
    text needs no other file but meshes, because it holds the columns of tables and the mechanisms of parts.
    """
    d = mechanism.description
    if folder is not None:
        d = replace(d, visuals=tuple(visual.named_from(folder) for visual in d.visuals))
    return "\n".join(block for block in _blocks(d) if block)


def _blocks(d: Description, prefix: str = "") -> Iterator[str]:
    """The tables of ``d``, their names behind ``prefix``."""
    yield _table(f"{prefix}mechanism", _values(d))
    for name, of in table_keys().items():
        content = getattr(d, name)
        write_all = _of_parts if of.part is Part else _FORMS[of.form]
        yield from write_all(prefix + name, content if of.many else [content] if content is not None else [])


# ----------------------------------------------------------------------------------------------------------- tables


def _sub_tables(name: str, parts: Iterable[Any]) -> list[str]:
    return [_table(f"{name}.{label_of(part)}", _values(part), needed=True) for part in parts]


def _of_parts(name: str, parts: Iterable[Part]) -> list[str]:
    """Each part, and behind it the tables of its mechanism, unless a part before has the same mechanism."""
    blocks, before = [], list[Part]()
    for part in parts:
        same = next((other.name for other in before if other.of == part.of), None)
        values = {"of": None if same is None else _string(same), **_values(part)}
        blocks.append(_table(f"{name}.{part.name}", values, needed=True))
        blocks += _blocks(part.of, f"{name}.{part.name}.of.") if same is None else ()
        before.append(part)
    return blocks


def _lines(name: str, parts: Iterable[Any]) -> list[str]:
    return [_table(name, {label_of(part): _inline(_values(part)) for part in parts})]


def _of_expressions(name: str, parts: Iterable[Any]) -> list[str]:
    return [_table(name, {label_of(part): _expression(part.expression) for part in parts})]


def _of_constraints(name: str, parts: Iterable[Any]) -> list[str]:
    return [
        _table(
            f"{name}.{kind}",
            {c.name: _of_constraint(c) for c in parts if c.kind == kind},
        )
        for kind in KINDS
    ]


def _of_constraint(c: Constraint) -> str:
    return _expression(c.expression) if c.unit is None and c.while_ is None else _inline(_values(c))


_FORMS: dict[str, Callable[[str, list[Any]], list[str]]] = {
    "single": lambda name, parts: [_table(name, _values(part)) for part in parts],
    "tables": _sub_tables,
    "lines": _lines,
    "expressions": _of_expressions,
    "kinds": _of_constraints,
}
"""{form of a ``TableKey``: the function that writes its parts}."""


# ------------------------------------------------------------------------------------------------------------- keys


def _values(part: Any) -> Values:
    """The keys of ``part`` with their values, in the order of the format."""
    unit: Unit = getattr(part, "unit", None) or DIMENSIONLESS
    special = _special(part, unit)
    written: dict[str, str | None] = {}
    for name, known in keys_of(part).items():
        value = getattr(part, known.field)
        if known.kind == "mechanism":
            continue
        if name in special:
            written[name] = special[name]
        elif known.kind == "number":
            written[name] = _number(value, unit)
        elif known.kind == "difference":
            default = None if known.default is None else unit.difference_to_si(known.default)
            written[name] = None if value == default else _difference(value, unit)
        else:
            written_as = _WRITE["string" if isinstance(known.kind, tuple) else known.kind]
            written[name] = None if value is None or value == known.default else written_as(value)
    return written


def _special(part: Any, unit: Unit) -> Values:
    """Starts of a coordinate as given or as guesses, its nominal value if given; no unit where a quantity tells it."""
    if isinstance(part, Coordinate):
        start, rate = _number(part.start, unit), _difference(part.velocity, unit)
        return {
            "start": start if part.given else None,
            "guess": start if part.given is False else None,
            "velocity": rate if part.velocity_given else None,
            "guess_velocity": rate if part.velocity_given is False else None,
            "nominal": _difference(part.nominal, unit) if part.nominal_from == "given" else None,
        }
    if isinstance(part, Part):
        return {"file": None, "set": _settings(part) if part.set else None}  # the mechanism follows
    if isinstance(part, Table):
        return {"file": None}  # the columns hold its content, so that the text needs no other file
    if isinstance(part, Output) and part.quantity is not None and part.unit == part.own_unit:
        return {"unit": None}
    return {}


def _settings(part: Part) -> str:
    """Numbers in the units of the part, expressions as they are."""
    known, written = settable(part.of), {}
    for name, value in part.settings:
        unit, rate = known[name].unit, known[name].rate
        number = _difference if rate else _number
        written[name] = number(float(value), unit) if value.is_number else _string(to_text(value))
    return _inline(written)


def _strings(names: Iterable[object]) -> str:
    return f"[{', '.join(_string(str(name)) for name in names)}]"


def _texts(texts: Iterable[str]) -> str:
    """An array with a line for each text, so that one can be deleted."""
    lines = "".join(f"    {_string(text)},\n" for text in texts)
    return f"[\n{lines}]"


def _choice(names: Iterable[str]) -> str:
    """Names, or the word for none of them."""
    return _strings(names) if names else _string(NONE)


def _acting(entries: Iterable[Acting]) -> str:
    """Places alone where all axes are the world's, else each with its axes."""
    if all(axes == WORLD for _, axes in entries):
        return _strings(place for place, _ in entries)
    return _inline({_string(place) if "." in place else place: _string(axes) for place, axes in entries})


def _columns(entries: Iterable[Any]) -> str:
    """Numbers, or arrays of numbers."""
    return f"[{', '.join(_columns(x) if isinstance(x, tuple) else number_text(x) for x in entries)}]"


def _axis(axis: str | Iterable[sp.Expr]) -> str:
    return _string(axis) if isinstance(axis, str) else _vector(axis)


def _vector(entries: Iterable[sp.Expr]) -> str:
    return f"[{', '.join(_expression(entry) for entry in entries)}]"


# ------------------------------------------------------------------------------------------------------------ TOML


def _table(name: str, entries: Values, *, needed: bool = False) -> str:
    """The table ``name`` with a line for each entry; empty without entries, unless it is ``needed``."""
    lines = [f"{key} = {value}\n" for key, value in entries.items() if value is not None]
    return f"[{name}]\n{''.join(lines)}" if lines or needed else ""


def _inline(entries: Values) -> str:
    pairs = [f"{key} = {value}" for key, value in entries.items() if value is not None]
    return f"{{ {', '.join(pairs)} }}" if pairs else "{}"


def _string(text: str) -> str:
    """A basic string of TOML: JSON's escapes, and the one character more that TOML wants escaped."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _expression(expression: sp.Expr) -> str:
    """A small whole number or decimal bare, anything else as a string."""
    text = to_text(expression)
    return text if text.lstrip("-").replace(".", "", 1).isdigit() and len(text) <= 15 else _string(text)


def _number(value: float | None, unit: Unit) -> str | None:
    """The shortest decimal whose SI value in ``unit`` is exactly ``value``."""
    return None if value is None else _decimal(value, exact(unit.offset), exact(unit.factor), unit.to_si)


def _difference(value: float, unit: Unit) -> str:
    return _decimal(value, Fraction(0), exact(unit.factor), unit.difference_to_si)


def _decimal(value: float, offset: Fraction, factor: Fraction, convert: Callable[[Fraction], float]) -> str:
    """The shortest decimal d with convert(d) == value, near to (value - offset) / factor.

    There is one, because ``convert`` rounds only once; with two roundings there might be none.
    """
    wanted = (Fraction(repr(value)) - offset) / factor
    for digits in _DIGITS:
        decimal = Context(prec=digits).divide(Decimal(wanted.numerator), Decimal(wanted.denominator))
        if convert(Fraction(decimal)) == value:
            break
    short = repr(float(decimal))
    return short if Decimal(short) == decimal else _toml_float(decimal)


_DIGITS: Iterable[int] = (*range(1, 41), 400, 1200)
"""The lengths of decimals that are tried: 1200 digits tell the middle of any two doubles."""


def _toml_float(decimal: Decimal) -> str:
    text = str(decimal).lower()
    return text if "." in text or "e" in text else f"{text}.0"


_WRITE: dict[str, Callable[[Any], str]] = {
    "string": _string,
    "part": _string,
    "unit": lambda unit: _string(unit.name or "1"),
    "flag": lambda _: "true",
    "motion": lambda kind: "true" if kind is True else _string(kind),
    "expression": _expression,
    "vector": _vector,
    "expression or vector": lambda value: _vector(value) if isinstance(value, tuple) else _expression(value),
    "axis": _axis,
    "names": _strings,
    "texts": _texts,
    "choice": _choice,
    "acting": _acting,
    "places": _strings,
    "motions": _strings,
    "columns": _columns,
    "units": lambda units: _strings(unit.name or "1" for unit in units),
    "rotations": lambda turns: f"[{', '.join(f'[{_axis(axis)}, {_expression(angle)}]' for axis, angle in turns)}]",
}
"""{kind of a ``Key``: the function that writes its value}; numbers need the unit of their part, see ``_values``."""
