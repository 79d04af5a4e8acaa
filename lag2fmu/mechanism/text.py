"""Reading a mechanism from its text format, TOML (https://toml.io/en/v1.0.0), safely: nothing in the text is evaluated.

The tables are the keywords of ``Mechanism``, their keys the fields of its parts. Numbers are exact until they are
converted to SI, where they are rounded once. ``write.write`` is the inverse.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeVar

import sympy as sp

from lag2fmu.errors import MechanismError, TextError, UnitError
from lag2fmu.mechanism.expressions import parse
from lag2fmu.mechanism.names import suggestion
from lag2fmu.mechanism.record import (
    Body,
    Coordinate,
    Damper,
    Definition,
    Energy,
    Experiment,
    Force,
    Gravity,
    Input,
    Load,
    Mechanism,
    Output,
    Parameter,
    Point,
    Spring,
)
from lag2fmu.mechanism.units import DIMENSIONLESS, Unit, parse_unit

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

MAX_BYTES = 1_000_000
MAX_EXPONENT, MAX_BITS, MAX_NUMBER, MAX_KEY_PARTS = 330, 1024, 1600, 16

_LATER_TABLES = ("frames", "constraints")
_TABLES = (
    *("mechanism", "parameters", "coordinates", "inputs", "definitions", "energy", "forces", "gravity"),
    *("bodies", "points", "springs", "dampers", "loads", "outputs", "experiment"),
)


def read_file(path: Path) -> Mechanism:
    """The mechanism in the file ``path``; raises TextError, its message starting with the path, also for a file too large."""
    try:
        size = path.stat().st_size
        content = b"" if size > MAX_BYTES else path.read_bytes()
    except OSError as error:
        raise TextError(f"{path}: cannot be read: {error.strerror}") from error
    if size > MAX_BYTES:
        raise TextError(f"{path}: has {size} bytes; a mechanism of more than {MAX_BYTES} bytes is not read")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise TextError(
            f"{path}: byte {error.start} ({content[error.start]:#04x}) is not UTF-8; save the file as UTF-8"
        ) from None
    return read(text, str(path))


def read(text: str, where: str) -> Mechanism:
    """The mechanism that ``text`` describes; ``where`` (a file name) starts the message of every error.

    Raises TextError with file, table and key for whatever is wrong: syntax, a type, a name, a unit, a circle.
    """
    if len(text) > MAX_BYTES:
        raise TextError(f"{where}: has {len(text)} characters; a mechanism of more than {MAX_BYTES} is not read")
    try:
        return _mechanism(_parse_toml(text))
    except MechanismError as error:
        raise TextError(f"{where}: {error}") from error


def _parse_toml(text: str) -> dict[str, Any]:
    """The tables of ``text`` with exact numbers (int, Decimal); raises TextError with line and column."""
    for number, line in enumerate(text.splitlines(), 1):
        if line.split("=", 1)[0].count(".") > MAX_KEY_PARTS and not line.lstrip().startswith("#"):
            raise TextError(f"line {number}: a key of more than {MAX_KEY_PARTS} parts")
    try:
        return tomllib.loads(text, parse_float=Decimal)
    except tomllib.TOMLDecodeError as error:
        raise TextError(f"no valid TOML: {error}") from error
    except RecursionError:
        raise TextError("no valid TOML: arrays or tables are nested too deeply") from None
    except ValueError as error:
        raise TextError(f"no valid TOML: {error}") from error


# ---------------------------------------------------------------------------------------------------------- values


class _Table:
    """One table of the text with its place; hands out each entry in the type it should have, or raises TextError."""

    def __init__(
        self, where: str, content: object, keys: Iterable[str] | None = None, later: Iterable[str] = ()
    ) -> None:
        """``keys`` are the ones that may stand here (None: any), ``later`` those of a later version."""
        if not isinstance(content, dict):
            raise TextError(f"{where}: expected a table {{ ... }}, got {_describe(content)}")
        self.where, self.content = where, content
        known = content if keys is None else tuple(keys)
        for key in content:
            if key in later:
                raise TextError(f"{self.place(key)}: not supported yet in this version of lag2fmu")
            if key not in known:
                raise TextError(f"{self.place(key)}: unknown key; {suggestion(key, known)}")

    def place(self, key: str) -> str:
        short = key if len(key) <= 60 else f"{key[:57]}..."
        return f"{self.where}.{short}" if self.where else short

    def table(self, key: str, keys: Iterable[str] | None = None) -> _Table:
        """The table ``key``, empty if it is not there."""
        return _Table(self.place(key), self.content.get(key, {}), keys)

    def text(self, key: str, default: str | None = "") -> str | None:
        value = self.content.get(key, default)
        if key in self.content and not isinstance(value, str):
            raise TextError(f"{self.place(key)}: expected a string, got {_describe(value)}")
        return value

    def flag(self, key: str) -> bool:
        value = self.content.get(key, False)
        if not isinstance(value, bool):
            raise TextError(f"{self.place(key)}: expected true or false, got {_describe(value)}")
        return value

    def number(self, key: str, convert: Callable[[Fraction], float] = float) -> float | None:
        """The number ``key`` passed through ``convert`` (to SI); None if it is not there."""
        return convert(_fraction(self.content[key], self.place(key))) if key in self.content else None

    def unit(self) -> Unit | None:
        text = self.text("unit", None)
        try:
            return None if text is None else parse_unit(text)
        except UnitError as error:
            raise TextError(f"{self.place('unit')}: {error}") from error

    def require(self, key: str) -> None:
        if key not in self.content:
            raise TextError(f"{self.where or 'the file'}: '{key}' is missing")

    def expression(self, key: str, required: bool = False) -> sp.Expr | None:
        """The expression ``key``, a string or a number; None if it is not there and not required."""
        if required:
            self.require(key)
        return _expression(self.content[key], self.place(key)) if key in self.content else None

    def vector(self, key: str) -> tuple[sp.Expr, ...] | None:
        value = self._array(key, "expressions")
        return value and tuple(_expression(item, f"{self.place(key)}[{i}]") for i, item in enumerate(value))

    def names(self, key: str) -> tuple[str, ...] | None:
        value = self._array(key, "names")
        for i, item in enumerate(value or ()):
            if not isinstance(item, str):
                raise TextError(f"{self.place(key)}[{i}]: expected a name, got {_describe(item)}")
        return value

    def _array(self, key: str, entries: str) -> tuple[Any, ...] | None:
        value = self.content.get(key)
        if key in self.content and not isinstance(value, list):
            raise TextError(f"{self.place(key)}: expected an array of {entries}, got {_describe(value)}")
        if value == []:
            raise TextError(f"{self.place(key)}: the array is empty")
        return None if value is None else tuple(value)


def _describe(value: object) -> str:
    kinds = {
        bool: "a boolean",
        str: "the string",
        int: "the number",
        Decimal: "the number",
        list: "an array",
        dict: "a table",
    }
    kind = kinds.get(type(value), "the date or time")
    if isinstance(value, (list, dict)):
        return kind
    if isinstance(value, int) and not isinstance(value, bool) and value.bit_length() > MAX_BITS:
        return f"the number {hex(value)[:20]}..."
    shown = str(value).lower() if isinstance(value, bool) else repr(value) if isinstance(value, str) else str(value)
    return f"{kind} {shown if len(shown) <= 40 else shown[:37] + '...'}"


def _fraction(value: object, where: str) -> Fraction:
    """``value`` exactly; raises TextError for another type, for inf, nan and what no float holds."""
    if isinstance(value, bool) or not isinstance(value, (int, Decimal)):
        raise TextError(f"{where}: expected a number, got {_describe(value)}")
    if isinstance(value, Decimal) and not value.is_finite():
        raise TextError(f"{where}: {value} is not a finite number")
    if not value:
        return Fraction(0)
    if isinstance(value, int):
        too_large = value.bit_length() > MAX_BITS
    else:
        too_large = abs(value.adjusted()) > MAX_EXPONENT or len(value.as_tuple().digits) > MAX_NUMBER
    if too_large:
        raise TextError(f"{where}: {_describe(value)} has too many digits or is outside of the range of floats")
    return Fraction(value)


def _expression(value: object, where: str) -> sp.Expr:
    """A string parsed or a number taken; raises TextError or ExpressionError with ``where``."""
    if isinstance(value, str):
        return parse(value, where=where)
    if isinstance(value, bool) or not isinstance(value, (int, Decimal)):
        raise TextError(f"{where}: expected an expression (a string or a number), got {_describe(value)}")
    _fraction(value, where)
    return parse(str(value), where=where)


# ---------------------------------------------------------------------------------------------------------- tables

Part = TypeVar("Part")


def _mechanism(content: dict[str, Any]) -> Mechanism:
    root = _Table("", content, _TABLES, _LATER_TABLES)
    root.require("mechanism")
    head = root.table("mechanism", ("name", "title", "source", "strict_units"))
    head.require("name")
    return Mechanism(
        head.text("name") or "",
        title=head.text("title") or "",
        source=head.text("source") or "",
        strict_units=head.flag("strict_units"),
        parameters=_named(root, "parameters", _parameter, ("value", "expression", "unit", "doc", "min", "max")),
        coordinates=_named(
            root,
            "coordinates",
            _coordinate,
            ("unit", "start", "velocity", "nominal", "min", "max", "doc"),
            ("guess", "guess_velocity"),
        ),
        inputs=_named(root, "inputs", _input, ("unit", "start", "motion", "min", "max", "doc")),
        definitions=_expressions(root, "definitions", Definition),
        energy=_energy(root),
        forces=_expressions(root, "forces", Force),
        gravity=_gravity(root) if "gravity" in content else None,
        bodies=_named(root, "bodies", _body, ("mass", "inertia", "position", "angle"), ("frame", "center")),
        points=_named(root, "points", _point, ("position",), ("frame",)),
        springs=_named(root, "springs", _spring, ("stiffness", "elongation", "between", "length")),
        dampers=_named(root, "dampers", _damper, ("damping", "rate", "between")),
        loads=_named(root, "loads", _load, ("point", "body", "force", "torque", "input"), ("axes",)),
        outputs=_named(root, "outputs", _output, ("expression", "unit", "doc")),
        experiment=_experiment(root),
    )


def _named(
    root: _Table, table: str, build: Callable[[str, _Table], Part], keys: tuple[str, ...], later: tuple[str, ...] = ()
) -> list[Part]:
    """The parts of ``table``, one for each of its sub-tables, built by ``build(name, sub-table)``."""
    parts = root.table(table)
    return [build(name, _Table(parts.place(name), content, keys, later)) for name, content in parts.content.items()]


def _expressions(root: _Table, table: str, kind: Callable[[str, Any], Part]) -> list[Part]:
    parts = root.table(table)
    return [kind(name, parts.expression(name)) for name in parts.content]


def _or(value: float | None, default: float) -> float:
    return default if value is None else value


def _parameter(name: str, table: _Table) -> Parameter:
    unit = table.unit()
    si = (unit or DIMENSIONLESS).to_si
    doc, expression = table.text("doc") or "", table.expression("expression")
    return Parameter(
        name, table.number("value", si), unit, doc, expression, table.number("min", si), table.number("max", si)
    )


def _coordinate(name: str, table: _Table) -> Coordinate:
    unit = table.unit()
    si, rate = (unit or DIMENSIONLESS).to_si, (unit or DIMENSIONLESS).difference_to_si
    return Coordinate(
        name,
        unit,
        start=_or(table.number("start", si), si(0.0)),
        velocity=_or(table.number("velocity", rate), 0.0),
        nominal=_or(table.number("nominal", rate), rate(1.0)),
        minimum=table.number("min", si),
        maximum=table.number("max", si),
        doc=table.text("doc") or "",
    )


def _input(name: str, table: _Table) -> Input:
    unit = table.unit()
    si = (unit or DIMENSIONLESS).to_si
    start, doc = _or(table.number("start", si), si(0.0)), table.text("doc") or ""
    return Input(name, unit, start, table.flag("motion"), doc, table.number("min", si), table.number("max", si))


def _energy(root: _Table) -> Energy:
    table = root.table("energy", ("kinetic", "potential", "dissipation", "lagrangian"))
    return Energy(**{key: table.expression(key) for key in table.content})


def _gravity(root: _Table) -> Gravity:
    table = root.table("gravity", ("acceleration", "direction"))
    return Gravity(table.expression("acceleration", required=True), table.vector("direction"))


def _position(table: _Table) -> tuple[sp.Expr, ...]:
    table.require("position")
    return table.vector("position") or ()


def _body(name: str, table: _Table) -> Body:
    mass = table.expression("mass", required=True)
    return Body(name, mass, _position(table), angle=table.expression("angle"), inertia=table.expression("inertia"))


def _point(name: str, table: _Table) -> Point:
    return Point(name, _position(table))


def _spring(name: str, table: _Table) -> Spring:
    stiffness = table.expression("stiffness", required=True)
    return Spring(name, stiffness, table.expression("elongation"), table.names("between"), table.expression("length"))


def _damper(name: str, table: _Table) -> Damper:
    return Damper(name, table.expression("damping", required=True), table.expression("rate"), table.names("between"))


def _load(name: str, table: _Table) -> Load:
    point, body = table.text("point", None), table.text("body", None)
    return Load(name, point, body, table.vector("force"), table.expression("torque"), table.flag("input"))


def _output(name: str, table: _Table) -> Output:
    return Output(name, table.expression("expression", required=True), table.unit(), table.text("doc") or "")


def _experiment(root: _Table) -> Experiment:
    keys = ("stop_time", "step", "tolerance")
    table = root.table("experiment", keys)
    return Experiment(**{key: _or(table.number(key), getattr(Experiment, key)) for key in keys})
