"""Is a mechanism complete and consistent? Run once, when the record is built."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from graphlib import CycleError, TopologicalSorter
from typing import TYPE_CHECKING, TypeVar

import sympy as sp

from lag2fmu.errors import MechanismError, UnitError
from lag2fmu.mechanism import names
from lag2fmu.mechanism.dimensions import ONE, Dimension, DimensionOf, describe, dimension
from lag2fmu.mechanism.expressions import free_names
from lag2fmu.mechanism.units import JOULE, KILOGRAM, METRE, NEWTON, SECOND, TORQUE, WATT, Unit

if TYPE_CHECKING:
    from lag2fmu.mechanism.record import Coordinate, Damper, Definition, Input, Mechanism, Parameter, Spring, Vector

Part = TypeVar("Part", "Definition", "Parameter")


def check(mechanism: Mechanism) -> tuple[str, ...]:
    """Raise MechanismError for the first fault of ``mechanism``; return its unit mismatches as warnings.

    With ``strict_units`` a mismatch raises UnitError.
    """
    if not mechanism.coordinates:
        raise MechanismError(
            f"coordinates: mechanism '{mechanism.name}' has none; declare at least one generalized coordinate"
        )
    names.check_names(mechanism)
    _check_numbers(mechanism)
    _check_parts(mechanism)
    scope = _Scope(mechanism)
    _check_symbols(mechanism, scope)
    _check_presence(mechanism, scope)
    mismatches = tuple(_mismatches(mechanism))
    if mismatches and mechanism.strict_units:
        raise UnitError(mismatches[0])
    return mismatches


# -------------------------------------------------------------------------------------------------------- numbers


def check_number(where: str, value: float, low: float | None = None, high: float | None = None) -> None:
    """Raise MechanismError unless ``value`` is finite and within [low, high]."""
    if not math.isfinite(value):
        raise MechanismError(f"{where}: {value} is not a finite number")
    if (low is not None and value < low) or (high is not None and value > high):
        bounds = [-math.inf if low is None else low, math.inf if high is None else high]
        raise MechanismError(f"{where}: {value!r} is outside of {bounds}")


def _check_numbers(mechanism: Mechanism) -> None:
    for q in mechanism.coordinates:
        _check_bounds(q, f"coordinates.{q.name}")
        check_number(f"coordinates.{q.name}.start", q.start, q.minimum, q.maximum)
        check_number(f"coordinates.{q.name}.velocity", q.velocity)
        check_number(f"coordinates.{q.name}.nominal", q.nominal)
        if q.nominal <= 0:
            raise MechanismError(f"coordinates.{q.name}.nominal: {q.nominal!r} is not positive")
    for p in mechanism.parameters:
        _check_bounds(p, f"parameters.{p.name}")
        if (p.value is None) == (p.expression is None):
            raise MechanismError(f"parameters.{p.name}: give either a value or an expression")
        if p.value is not None:
            check_number(f"parameters.{p.name}.value", p.value, p.minimum, p.maximum)
    for u in mechanism.inputs:
        _check_bounds(u, f"inputs.{u.name}")
        check_number(f"inputs.{u.name}.start", u.start, u.minimum, u.maximum)
    e = mechanism.experiment
    for label, value in (("stop_time", e.stop_time), ("step", e.step), ("tolerance", e.tolerance)):
        check_number(f"experiment.{label}", value)
        if value <= 0:
            raise MechanismError(f"experiment.{label}: {value!r} is not positive")
    if e.step > e.stop_time:
        raise MechanismError(f"experiment.step: {e.step!r} s is longer than stop_time = {e.stop_time!r} s")


def _check_bounds(part: Coordinate | Parameter | Input, where: str) -> None:
    for label, bound in (("min", part.minimum), ("max", part.maximum)):
        if bound is not None:
            check_number(f"{where}.{label}", bound)
    if part.minimum is not None and part.maximum is not None and part.minimum > part.maximum:
        raise MechanismError(f"{where}: min = {part.minimum!r} is above max = {part.maximum!r}")


# ---------------------------------------------------------------------------------------------------------- parts


def _check_parts(m: Mechanism) -> None:
    """Combinations of keys that belong together, and references between parts."""
    if m.energy.lagrangian is not None and (m.energy.kinetic is not None or m.energy.potential is not None):
        raise MechanismError("energy: 'lagrangian' stands for kinetic and potential; give it alone, or those two")
    dimensions = {len(part.position) for part in m.places}
    if dimensions - {2, 3} or len(dimensions) > 1:
        raise MechanismError(
            f"bodies and points: positions have {sorted(dimensions)} entries; give all of them 2, or all of them 3"
        )
    for body in m.bodies:
        if (body.inertia is None) != (body.angle is None):
            missing = "inertia" if body.inertia is None else "angle"
            raise MechanismError(
                f"bodies.{body.name}: '{missing}' is missing; a rigid body has both, a particle neither"
            )
        if body.angle is not None and len(body.position) == 3:
            raise MechanismError(f"bodies.{body.name}: a body with an angle is planar; give its position 2 entries")
    if (
        m.gravity is not None
        and m.gravity.direction is not None
        and dimensions
        and {len(m.gravity.direction)} != dimensions
    ):
        raise MechanismError(
            f"gravity.direction: has {len(m.gravity.direction)} entries, positions have {dimensions.pop()}"
        )
    for table, parts in (("springs", m.springs), ("dampers", m.dampers)):
        for part in parts:
            _check_element(m, part, f"{table}.{part.name}")
    for load in m.loads:
        _check_load(m, f"loads.{load.name}", load)
    known = [q.name for q in m.coordinates]
    for force in m.forces:
        if force.coordinate not in known:
            raise MechanismError(
                f"forces.{force.coordinate}: there is no such coordinate; known are {', '.join(known)}"
            )


def _check_element(m: Mechanism, part: Spring | Damper, where: str) -> None:
    """A spring or damper acts by an expression or between two different places."""
    key = "elongation" if hasattr(part, "elongation") else "rate"
    if (getattr(part, key) is None) == (part.between is None):
        raise MechanismError(f"{where}: give either '{key}' or 'between'")
    if part.between is None:
        if getattr(part, "length", None) is not None:
            raise MechanismError(f"{where}: 'length' goes with 'between'; subtract it in the elongation instead")
        return
    if len(part.between) != 2:
        raise MechanismError(f"{where}.between: {len(part.between)} ends; name two points or bodies")
    a, b = (_place(m, str(end), f"{where}.between") for end in part.between)
    if a == b:
        raise MechanismError(
            f"{where}.between: '{part.between[0]}' and '{part.between[1]}' are at the same place always"
        )


def _place(m: Mechanism, name: str, where: str) -> Vector:
    """The position (m) of the point or body ``name``; raises MechanismError with ``where`` if there is none."""
    try:
        return m.place(name)
    except MechanismError as error:
        raise MechanismError(f"{where}: {error}") from None


def _check_load(m: Mechanism, where: str, load: object) -> None:
    point, body, force, torque = (getattr(load, key) for key in ("point", "body", "force", "torque"))
    if (force is None) == (torque is None):
        raise MechanismError(f"{where}: give either a force (at a point) or a torque (on a body), or input = true")
    if force is not None:
        place = point if point is not None else body
        if place is None or (point is not None and body is not None):
            raise MechanismError(f"{where}: a force acts at a 'point'; name one")
        position = _place(m, str(place), f"{where}.{'point' if point is not None else 'body'}")
        if len(force) != len(position):
            raise MechanismError(
                f"{where}.force: has {len(force)} entries, the position of '{place}' has {len(position)}"
            )
        return
    if body is None or point is not None:
        raise MechanismError(f"{where}: a torque acts on a 'body'; name one")
    found = next((part for part in m.bodies if part.name == body), None)
    if found is None or found.angle is None:
        raise MechanismError(f"{where}.body: '{body}' is not a rigid body with an angle")


# -------------------------------------------------------------------------------------------------------- symbols


class _Scope:
    """Which names an expression may use, and what each of them is."""

    def __init__(self, m: Mechanism) -> None:
        self.meaning: dict[str, str] = {"t": "time"}
        for q in m.coordinates:
            self.meaning |= {q.name: "coordinate", names.velocity(q.name): "velocity"}
        self.meaning |= {p.name: "parameter" for p in m.parameters}
        for u in m.inputs:
            self.meaning[u.name] = "motion" if u.motion else "input"
            if u.motion:
                self.meaning |= {
                    names.velocity(u.name): "motion velocity",
                    names.acceleration(u.name): "motion acceleration",
                }
        self.meaning |= {d.name: "definition" for d in m.definitions}
        self.uses: dict[str, set[str]] = {}
        """Definition -> the names it uses, definitions written out."""
        for d in in_order(m.definitions, "definitions"):
            self.uses[d.name] = self.names_in(f"definitions.{d.name}", d.expression)

    def names_in(self, where: str, expression: sp.Expr) -> set[str]:
        """The names ``expression`` uses, definitions written out; raises MechanismError for an unknown one."""
        found: set[str] = set()
        for s in sorted(expression.free_symbols, key=str):
            if s.name not in self.meaning:
                remedy = names.suggestion(s.name, self.meaning)
                raise MechanismError(f"{where}: undefined symbol '{s.name}'; {remedy}")
            found |= self.uses.get(s.name, {s.name})
        return found


_CONFIGURATION = {"time", "coordinate", "parameter", "motion"}
_STATE = {*_CONFIGURATION, "velocity", "motion velocity"}
_ANY = {*_STATE, "input", "motion acceleration"}


def _check_symbols(m: Mechanism, scope: _Scope) -> None:
    in_order([p for p in m.parameters if p.expression is not None], "parameters")
    for where, expression in m.expressions():
        allowed = _allowed(where)
        for name in sorted(scope.names_in(where, expression)):
            meaning = scope.meaning[name]
            if meaning not in allowed:
                remedy = "; a signal that moves a support is declared with motion = true" if meaning == "input" else ""
                raise MechanismError(
                    f"{where}: '{name}' is {_article(meaning)} {meaning} and cannot stand here{remedy}"
                )


def _article(noun: str) -> str:
    return "an" if noun[0] in "aeiou" else "a"


def _allowed(where: str) -> set[str]:
    """What kinds of names the expression at ``where`` may use."""
    table, key = where.split(".", maxsplit=1)[0], where.rsplit(".", maxsplit=1)[-1].split("[", maxsplit=1)[0]
    if table == "parameters":
        return {"parameter"}
    if table in ("forces", "loads", "outputs", "definitions"):
        return _ANY
    if key in ("mass", "inertia", "direction"):
        return {"time", "parameter"}
    if table == "energy" or key == "rate":
        return _STATE
    return _CONFIGURATION


def in_order(parts: Iterable[Part], table: str) -> list[Part]:
    """``parts`` (definitions, dependent parameters), each after those it uses; raises MechanismError for a circle."""
    by_name = {part.name: part for part in parts}
    uses = {name: sorted(free_names([part.expression]) & by_name.keys()) for name, part in by_name.items()}
    try:
        return [by_name[name] for name in TopologicalSorter(uses).static_order()]
    except CycleError as error:
        chain: list[str] = error.args[1]
        shown = chain if len(chain) <= 8 else [*chain[:4], "...", *chain[-3:]]
        raise MechanismError(
            f"{table}.{chain[0]}: is defined by itself: {' <- '.join(shown)}; break the circle"
        ) from None


def _check_presence(m: Mechanism, scope: _Scope) -> None:
    """Every coordinate appears in an energy, dissipation or position."""
    used: set[str] = set()
    for where, expression in m.expressions():
        if where.split(".")[0] in ("energy", "bodies", "points", "springs", "dampers"):
            used |= scope.names_in(where, expression)
    for q in m.coordinates:
        if not used & {q.name, names.velocity(q.name)}:
            raise MechanismError(f"coordinates.{q.name}: appears in no energy, body, spring or damper; leave it out")


# -------------------------------------------------------------------------------------------------------- units


def _known_dimensions(m: Mechanism) -> dict[str, Dimension | None]:
    second = dimension(SECOND.exponents)

    def per_second(d: Dimension | None, times: int) -> Dimension | None:
        return None if d is None else tuple(a - times * b for a, b in zip(d, second, strict=True))

    known: dict[str, Dimension | None] = {"t": second}
    parts: list[Coordinate | Parameter | Input] = [*m.coordinates, *m.parameters, *m.inputs]
    for part in parts:
        known[part.name] = d = _dimension_of(part.unit)
        known[names.velocity(part.name)] = per_second(d, 1)
        known[names.acceleration(part.name)] = per_second(d, 2)
    return known


def _dimension_of(unit: Unit | str | None) -> Dimension | None:
    return dimension(unit.exponents) if isinstance(unit, Unit) else None


def _mismatches(m: Mechanism) -> Iterator[str]:
    """One sentence for every expression whose known dimension is not the expected one."""
    known = _known_dimensions(m)
    infer = DimensionOf(known)
    for definition in in_order(m.definitions, "definitions"):
        try:
            known[definition.name] = infer(definition.expression)
        except UnitError as error:
            known[definition.name] = None
            yield f"definitions.{definition.name}: {error}"
    for where, expression, expected in _expectations(m, infer):
        try:
            found = infer(expression)
        except UnitError as error:
            yield f"{where}: {error}"
            continue
        if found is not None and expected is not None and found != expected and not expression.is_zero:
            yield f"{where}: '{expression}' is in {describe(found)}, expected {describe(expected)}"


def _expectations(m: Mechanism, infer: DimensionOf) -> Iterator[tuple[str, sp.Expr, Dimension | None]]:
    """(place, expression, expected dimension) of every expression that should have a certain one."""
    fixed = {
        ("energy", "kinetic"): JOULE, ("energy", "potential"): JOULE, ("energy", "lagrangian"): JOULE,
        ("energy", "dissipation"): WATT, ("bodies", "mass"): KILOGRAM, ("bodies", "position"): METRE,
        ("points", "position"): METRE, ("bodies", "inertia"): KILOGRAM * METRE * METRE, ("springs", "length"): METRE,
        ("gravity", "acceleration"): METRE / SECOND / SECOND, ("loads", "force"): NEWTON, ("loads", "torque"): TORQUE,
    }  # fmt: skip
    declared = {(t, p.name): p.unit for t, ps in (("parameters", m.parameters), ("outputs", m.outputs)) for p in ps}
    coordinates = {q.name: q.unit for q in m.coordinates}
    for where, expression in m.expressions():
        table, key, label = where.split(".")[0], where.split(".")[-1].split("[")[0], where.split(".")[1]
        if (table, key) in fixed:
            yield where, expression, _dimension_of(fixed[table, key])
        elif key in ("angle", "direction"):
            yield where, expression, ONE
        elif (table, label) in declared:
            yield where, expression, _dimension_of(declared[table, label])
        elif table == "forces":
            unit = coordinates[label]
            yield where, expression, None if unit is None else _dimension_of(JOULE / unit)
    yield from _element_expectations(m.springs, JOULE, "elongation", infer)
    yield from _element_expectations(m.dampers, WATT, "rate", infer)


def _element_expectations(
    parts: Iterable[Spring | Damper], total: Unit, key: str, infer: Callable[[sp.Expr], Dimension | None]
) -> Iterator[tuple[str, sp.Expr, Dimension | None]]:
    """stiffness * elongation^2 is an energy, damping * rate^2 a power; between points the elongation is a length."""
    table, constant = ("springs", "stiffness") if key == "elongation" else ("dampers", "damping")
    for part in parts:
        measure = getattr(part, key)
        if measure is None:
            length = METRE if key == "elongation" else METRE / SECOND
            measured: Dimension | None = _dimension_of(length)
        else:
            yield f"{table}.{part.name}.{key}", measure, None
            try:
                measured = infer(measure)
            except UnitError:
                continue
        if measured is not None:
            expected = tuple(a - 2 * b for a, b in zip(dimension(total.exponents), measured, strict=True))
            yield f"{table}.{part.name}.{constant}", getattr(part, constant), expected
