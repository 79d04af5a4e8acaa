"""Writing a mechanism as text: the inverse of ``text.read``, in the order in which a mechanism is thought of."""

from __future__ import annotations

import json
from collections.abc import Callable, Container, Iterable, Mapping
from decimal import Context, Decimal
from fractions import Fraction

import sympy as sp

from lag2fmu.mechanism.expressions import to_text
from lag2fmu.mechanism.joint_equations import brought_by_joints
from lag2fmu.mechanism.outputs import QUANTITIES
from lag2fmu.mechanism.parts import KINDS
from lag2fmu.mechanism.record import (
    WORLD,
    Body,
    Coordinate,
    Damper,
    Experiment,
    Frame,
    Input,
    Joint,
    Load,
    Mechanism,
    Output,
    Parameter,
    Rotation,
    Spring,
)
from lag2fmu.mechanism.units import DIMENSIONLESS, Unit, exact

Entries = Mapping[str, str | None]
"""Keys of one table with their values as TOML text; None is left out."""


def write(mechanism: Mechanism) -> str:
    """The text of ``mechanism`` in TOML, such that ``read(write(mechanism), ...) == mechanism`` exactly."""
    m, brought = mechanism, brought_by_joints(mechanism)
    head = {"name": _string(m.name), "title": _string(m.title), "source": _string(m.source) if m.source else None}
    blocks = [
        _table("mechanism", {**head, "strict_units": "true" if m.strict_units else None}),
        _table("parameters", {p.name: _inline(_parameter(p)) for p in m.parameters}),
        _table("coordinates", {q.name: _inline(_coordinate(q)) for q in m.coordinates}),
        _table("inputs", {u.name: _inline(_input(u)) for u in m.inputs}),
        _table("definitions", {d.name: _expression(d.expression) for d in m.definitions}),
        _table("energy", _expressions(m.energy, "kinetic", "potential", "dissipation", "lagrangian")),
        _table("forces", {f.coordinate: _expression(f.expression) for f in m.forces}),
        _table("gravity", _expressions(m.gravity, "acceleration", "direction") if m.gravity else {}),
        *(_table(f"frames.{f.name}", _frame(f)) for f in m.frames if f.name not in brought.frames),
        *(_table(f"bodies.{b.name}", _body(b)) for b in m.bodies),
        *(_table(f"points.{p.name}", {**_names(p, "frame"), **_expressions(p, "position", "angle")}) for p in m.points),
        *(_table(f"springs.{s.name}", _element(s, "stiffness", "elongation", "length")) for s in m.springs),
        *(_table(f"dampers.{d.name}", _element(d, "damping", "rate")) for d in m.dampers),
        *(_table(f"loads.{x.name}", _load(x)) for x in m.loads),
        *(_table(f"joints.{j.name}", _joint(j)) for j in m.joints),
        *(_table(f"constraints.{kind}", _constraints(m, kind, brought.constraints)) for kind in KINDS),
        _table("outputs", {o.name: _inline(_output(o)) for o in m.outputs if o.name not in brought.outputs}),
        _table("experiment", _experiment(m.experiment)),
    ]
    return "\n".join(block for block in blocks if block)


# ----------------------------------------------------------------------------------------------------------- parts


def _parameter(p: Parameter) -> Entries:
    unit = p.unit or DIMENSIONLESS
    value = {
        "value": _number(p.value, unit),
        "expression": _expression(p.expression) if p.expression is not None else None,
    }
    return {**value, "unit": _unit(p.unit), **_bounds(p), "doc": _doc(p.doc)}


def _coordinate(q: Coordinate) -> Entries:
    unit = q.unit or DIMENSIONLESS
    rate = _difference(q.velocity, unit)
    return {
        "unit": _unit(q.unit),
        "guess" if q.given is False else "start": None if q.given is None else _number(q.start, unit),
        "guess_velocity" if q.velocity_given is False else "velocity": None if q.velocity_given is None else rate,
        "nominal": _difference(q.nominal, unit) if q.nominal_from else None,
        **_bounds(q),
        "doc": _doc(q.doc),
    }


def _constraints(m: Mechanism, kind: str, brought: Container[str]) -> Entries:
    return {
        c.name: _expression(c.expression)
        if c.unit is None
        else _inline({"expression": _expression(c.expression), "unit": _unit(_resolved(c.unit))})
        for c in m.constraints
        if c.kind == kind and c.name not in brought
    }


def _input(u: Input) -> Entries:
    start = _number(u.start, u.unit or DIMENSIONLESS)
    return {
        "unit": _unit(u.unit),
        "start": start,
        "motion": "true" if u.motion else None,
        **_bounds(u),
        "doc": _doc(u.doc),
    }


def _bounds(part: Parameter | Coordinate | Input) -> Entries:
    unit = part.unit or DIMENSIONLESS
    return {"min": _number(part.minimum, unit), "max": _number(part.maximum, unit)}


def _frame(f: Frame) -> Entries:
    return {
        "parent": _string(str(f.parent)),
        **_expressions(f, "origin"),
        "rotations": _rotations(f) if f.rotations else None,
        **_expressions(f, "quaternion"),
    }


def _rotations(f: Frame) -> str:
    pairs = (Rotation(*turn) for turn in f.rotations)  # type: ignore[arg-type]
    written = [f"[{_axis(axis)}, {_expression(angle)}]" for axis, angle in pairs]
    return f"[{', '.join(written)}]"


def _body(b: Body) -> Entries:
    if b.frame is None:
        return _expressions(b, "mass", "inertia", "position", "angle")
    return {**_names(b, "frame"), **_expressions(b, "center", "mass", "inertia")}


def _load(x: Load) -> Entries:
    return {**_names(x, "point", "body"), **_expressions(x, "force", "torque"), "axes": _axes(x)}


def _joint(j: Joint) -> Entries:
    ends = {"kind": _string(j.kind), "between": _strings(j.between) if j.between is not None else None}
    origin = _expressions(j, "origin") if any(j.origin) else {}
    axes = {key: None if getattr(j, key) is None else _axis(getattr(j, key)) for key in ("axis", "second_axis")}
    coordinates = _strings(j.coordinates) if j.coordinates else None
    rest = {"reactions": "true" if j.reactions else None, "axes": _axes(j)}
    return {
        **ends,
        **_names(j, "parent"),
        **origin,
        **axes,
        "coordinates": coordinates,
        **_expressions(j, "pitch", "radius", "ratio"),
        **rest,
    }


def _output(o: Output) -> Entries:
    unit = _resolved(o.unit)
    if o.quantity in QUANTITIES and unit == QUANTITIES[o.quantity][2]:
        unit = None
    keys = {**_expressions(o, "expression"), **_names(o, "frame", "point", "quantity"), "axes": _axes(o)}
    return {**keys, "unit": _unit(unit), "doc": _doc(o.doc)}


def _resolved(unit: Unit | str | None) -> Unit | None:
    return unit if isinstance(unit, Unit) else None


def _axes(part: Load | Output | Joint) -> str | None:
    return None if part.axes == WORLD else _string(part.axes)


def _element(part: Spring | Damper, *keys: str) -> Entries:
    between = _strings(part.between) if part.between is not None else None
    first, *rest = keys
    return {**_expressions(part, first), "between": between, **_expressions(part, *rest)}


def _experiment(e: Experiment) -> Entries:
    return {key: _number(getattr(e, key), DIMENSIONLESS) for key in ("stop_time", "step", "tolerance")}


def _names(part: object, *keys: str) -> Entries:
    return {key: _string(getattr(part, key)) if getattr(part, key) is not None else None for key in keys}


def _expressions(part: object, *keys: str) -> Entries:
    """The expressions and vectors called ``keys`` of ``part``; None where there is none."""
    written: dict[str, str | None] = {}
    for key in keys:
        value = getattr(part, key)
        written[key] = None if value is None else _vector(value) if isinstance(value, tuple) else _expression(value)
    return written


def _strings(names: Iterable[object]) -> str:
    return f"[{', '.join(_string(str(name)) for name in names)}]"


def _axis(axis: str | Iterable[sp.Expr]) -> str:
    return _string(axis) if isinstance(axis, str) else _vector(axis)


def _vector(entries: Iterable[sp.Expr]) -> str:
    return f"[{', '.join(_expression(entry) for entry in entries)}]"


# ------------------------------------------------------------------------------------------------------------ TOML


def _table(name: str, entries: Entries) -> str:
    """The table ``name`` with a line for each entry; empty without entries."""
    lines = [f"{key} = {value}\n" for key, value in entries.items() if value is not None]
    return f"[{name}]\n{''.join(lines)}" if lines else ""


def _inline(entries: Entries) -> str:
    pairs = [f"{key} = {value}" for key, value in entries.items() if value is not None]
    return f"{{ {', '.join(pairs)} }}" if pairs else "{}"


def _string(text: str) -> str:
    """A basic string of TOML: JSON's escapes, and the one character more that TOML wants escaped."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _doc(text: str) -> str | None:
    return _string(text) if text else None


def _unit(unit: Unit | None) -> str | None:
    return None if unit is None else _string(unit.name or "1")


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

    Enough digits always suffice because ``convert`` is exact up to one rounding; two floats would not always do.
    """
    wanted = (Fraction(repr(value)) - offset) / factor
    for digits in _DIGITS:
        decimal = Context(prec=digits).divide(Decimal(wanted.numerator), Decimal(wanted.denominator))
        if convert(Fraction(decimal)) == value:
            break
    short = repr(float(decimal))
    return short if Decimal(short) == decimal else _toml_float(decimal)


_DIGITS: Iterable[int] = (*range(1, 41), 400, 1200)


def _toml_float(decimal: Decimal) -> str:
    text = str(decimal).lower()
    return text if "." in text or "e" in text else f"{text}.0"
