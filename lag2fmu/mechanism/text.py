"""Reading a mechanism from its text format, TOML (https://toml.io/en/v1.0.0), safely: nothing in the text is evaluated.

The tables are the keywords of ``Mechanism``, their keys the fields of its parts. Numbers are exact until they are
converted to SI, where they are rounded once. ``write.write`` is the inverse.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from decimal import Decimal
from pathlib import Path
from typing import Any, TypeVar

import sympy as sp

from lag2fmu.errors import MechanismError, TextError
from lag2fmu.mechanism.keys import CONSTRAINT, NAMED, SINGLE, TABLES
from lag2fmu.mechanism.parts import KINDS
from lag2fmu.mechanism.record import (
    WORLD,
    Body,
    Constraint,
    Coordinate,
    Damper,
    Definition,
    Energy,
    Experiment,
    Force,
    Frame,
    Gravity,
    Input,
    Joint,
    Load,
    Mechanism,
    Output,
    Parameter,
    Point,
    Spring,
)
from lag2fmu.mechanism.symbols import start_or_guess
from lag2fmu.mechanism.tables import Table
from lag2fmu.mechanism.units import DIMENSIONLESS

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # type: ignore[import-not-found,unused-ignore]

MAX_BYTES = 1_000_000
MAX_KEY_PARTS = 16
_DECIMAL_COMMA = re.compile(r"=\s*([+-]?\d+),(\d+)")


def read_file(path: Path) -> Mechanism:
    """The mechanism in the file ``path``; raises TextError, its message starting with the path."""
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
        content: dict[str, Any] = tomllib.loads(text, parse_float=Decimal)
    except tomllib.TOMLDecodeError as error:
        comma = _DECIMAL_COMMA.search(text)
        remedy = f"; decimals have a point: {comma[1]}.{comma[2]} instead of {comma[1]},{comma[2]}" if comma else ""
        raise TextError(f"no valid TOML: {error}{remedy}") from error
    except RecursionError:
        raise TextError("no valid TOML: arrays or tables are nested too deeply") from None
    except ValueError as error:
        raise TextError(f"no valid TOML: {error}") from error
    return content


# ---------------------------------------------------------------------------------------------------------- tables

Part = TypeVar("Part")


def _mechanism(content: dict[str, Any]) -> Mechanism:
    root = Table("", content, TABLES)
    root.require("mechanism")
    head = root.table("mechanism", SINGLE["mechanism"])
    head.require("name")
    return Mechanism(
        head.text("name") or "",
        title=head.text("title") or "",
        source=head.text("source") or "",
        strict_units=head.flag("strict_units"),
        parameters=_named(root, "parameters", _parameter),
        coordinates=_named(root, "coordinates", _coordinate),
        inputs=_named(root, "inputs", _input),
        definitions=_expressions(root, "definitions", Definition),
        energy=_energy(root),
        forces=_expressions(root, "forces", Force),
        gravity=_gravity(root) if "gravity" in content else None,
        frames=_named(root, "frames", _frame),
        bodies=_named(root, "bodies", _body),
        points=_named(root, "points", _point),
        springs=_named(root, "springs", _spring),
        dampers=_named(root, "dampers", _damper),
        loads=_named(root, "loads", _load),
        joints=_named(root, "joints", _joint),
        constraints=_constraints(root),
        outputs=_named(root, "outputs", _output),
        experiment=_experiment(root),
    )


def _named(root: Table, table: str, build: Callable[[str, Table], Part]) -> list[Part]:
    """The parts of ``table``, one for each of its sub-tables, built by ``build(name, sub-table)``."""
    parts = root.table(table)
    return [build(name, Table(parts.place(name), content, NAMED[table])) for name, content in parts.content.items()]


def _expressions(root: Table, table: str, kind: Callable[[str, Any], Part]) -> list[Part]:
    parts = root.table(table)
    return [kind(name, parts.expression(name)) for name in parts.content]


def _or(value: float | None, default: float) -> float:
    return default if value is None else value


def _parameter(name: str, table: Table) -> Parameter:
    unit = table.unit()
    si = (unit or DIMENSIONLESS).to_si
    doc, expression = table.text("doc") or "", table.expression("expression")
    return Parameter(
        name, table.number("value", si), unit, doc, expression, table.number("min", si), table.number("max", si)
    )


def _coordinate(name: str, table: Table) -> Coordinate:
    unit = table.unit()
    si, rate = (unit or DIMENSIONLESS).to_si, (unit or DIMENSIONLESS).difference_to_si
    start, given = start_or_guess(table.number("start", si), table.number("guess", si), table.where, "start", "guess")
    velocity, velocity_given = start_or_guess(
        table.number("velocity", rate), table.number("guess_velocity", rate), table.where, "velocity", "guess_velocity"
    )
    return Coordinate(
        name,
        unit,
        start=_or(start, si(0.0)),
        velocity=_or(velocity, 0.0),
        nominal=_or(table.number("nominal", rate), rate(1.0)),
        minimum=table.number("min", si),
        maximum=table.number("max", si),
        doc=table.text("doc") or "",
        given=given,
        velocity_given=velocity_given,
    )


def _constraints(root: Table) -> list[Constraint]:
    """An expression alone, or a table with its unit."""
    kinds = root.table("constraints", KINDS)
    found = []
    for kind in kinds.content:
        table = kinds.table(kind)
        for name, content in table.content.items():
            if isinstance(content, dict):
                entry = Table(table.place(name), content, CONSTRAINT)
                found.append(Constraint(name, entry.expression("expression", required=True), kind, entry.unit()))
            else:
                found.append(Constraint(name, table.expression(name), kind))
    return found


def _input(name: str, table: Table) -> Input:
    unit = table.unit()
    si = (unit or DIMENSIONLESS).to_si
    start, doc = _or(table.number("start", si), si(0.0)), table.text("doc") or ""
    return Input(name, unit, start, table.flag("motion"), doc, table.number("min", si), table.number("max", si))


def _energy(root: Table) -> Energy:
    table = root.table("energy", SINGLE["energy"])
    return Energy(**{key: table.expression(key) for key in table.content})


def _gravity(root: Table) -> Gravity:
    table = root.table("gravity", SINGLE["gravity"])
    return Gravity(table.expression("acceleration", required=True), table.vector("direction"))


_ORIGIN = (sp.S.Zero,) * 3


def _frame(name: str, table: Table) -> Frame:
    origin, quaternion = table.vector("origin") or _ORIGIN, table.vector("quaternion")
    return Frame(name, table.text("parent", WORLD) or "", origin, table.rotations("rotations"), quaternion)


def _body(name: str, table: Table) -> Body:
    return Body(
        name,
        table.expression("mass", required=True),
        table.vector("position"),
        table.expression("angle"),
        table.scalar_or_vector("inertia"),
        table.text("frame", None),
        table.vector("center") or _ORIGIN,
    )


def _point(name: str, table: Table) -> Point:
    table.require("position")
    return Point(name, table.vector("position") or (), table.text("frame", None), table.expression("angle"))


def _spring(name: str, table: Table) -> Spring:
    stiffness = table.expression("stiffness", required=True)
    return Spring(name, stiffness, table.expression("elongation"), table.names("between"), table.expression("length"))


def _damper(name: str, table: Table) -> Damper:
    return Damper(name, table.expression("damping", required=True), table.expression("rate"), table.names("between"))


def _load(name: str, table: Table) -> Load:
    point, body, axes = table.text("point", None), table.text("body", None), table.text("axes", WORLD) or ""
    force, torque = table.vector("force"), table.scalar_or_vector("torque")
    return Load(name, point, body, force, torque, table.flag("input"), axes)


def _joint(name: str, table: Table) -> Joint:
    table.require("kind")
    return Joint(
        name,
        table.text("kind") or "",
        table.names("between"),
        table.text("parent", None),
        table.vector("origin") or _ORIGIN,
        table.axis("axis"),
        table.axis("second_axis"),
        table.names("coordinates") or (),
        table.expression("pitch"),
        table.expression("radius"),
        table.expression("ratio"),
        table.flag("reactions"),
        table.text("axes", WORLD) or "",
    )


def _output(name: str, table: Table) -> Output:
    return Output(
        name,
        table.expression("expression"),
        table.unit(),
        table.text("doc") or "",
        table.text("frame", None),
        table.text("point", None),
        table.text("quantity", None),
        table.text("axes", WORLD) or "",
    )


def _experiment(root: Table) -> Experiment:
    table = root.table("experiment", SINGLE["experiment"])
    return Experiment(**{key: _or(table.number(key), getattr(Experiment, key)) for key in SINGLE["experiment"]})
