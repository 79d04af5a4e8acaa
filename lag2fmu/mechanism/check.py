"""Is a mechanism complete and consistent? Run once, when the record is built."""

from __future__ import annotations

import math
from collections.abc import Container, Sequence

from lag2fmu.description import names
from lag2fmu.description.description import Description
from lag2fmu.description.outputs import ALONG_AXES, HOLDING, QUANTITIES, TURNING, Output
from lag2fmu.description.parts import Damper, Load, Spring
from lag2fmu.description.places import WORLD, Expression, Vector, remedy_for
from lag2fmu.description.symbols import Coordinate, Input, Parameter
from lag2fmu.description.values import require_number
from lag2fmu.errors import MechanismError, UnitError
from lag2fmu.language.parts_of import free_names
from lag2fmu.mechanism.doubts import doubts
from lag2fmu.mechanism.geometry import check_values
from lag2fmu.mechanism.loads import rigid_place
from lag2fmu.mechanism.name_check import check_names
from lag2fmu.mechanism.scope import Scope, check_constraints, check_presence, check_symbols
from lag2fmu.mechanism.unit_check import mismatches, missing
from lag2fmu.mechanism.velocities import check_velocities


def check(m: Description, brought: Container[str] = ()) -> tuple[Scope, tuple[str, ...]]:
    """The scope of ``m``, whose geometry has been checked, and warnings of what is odd but allowed.

    ``brought`` are the places of the constraints that joints bring. Raises MechanismError for the first fault. With
    ``strict_units`` a mismatch of units raises UnitError.
    """
    if not (m.coordinates or m.driven or m.ports.poses):
        raise MechanismError(
            f"coordinates: mechanism '{m.name}' has none, and no prescribed motion; "
            "declare at least one generalized coordinate"
        )
    check_names(m)
    _check_numbers(m)
    _check_parts(m)
    scope = Scope(m)
    check_symbols(m, scope)
    check_presence(m, scope)
    check_constraints(m, scope)
    check_velocities(m, scope)
    unfit = tuple(mismatches(m, brought))
    faults = (*unfit, *missing(m, brought)) if m.strict_units else ()
    if faults:
        raise UnitError(faults[0])
    warnings = check_values(m, scope.names_in)
    return scope, (*unfit, *warnings, *doubts(m, scope.names_in))


# -------------------------------------------------------------------------------------------------------- numbers


def check_number(where: str, value: float, low: float | None = None, high: float | None = None) -> None:
    """Raise MechanismError unless ``value`` is a finite number within [low, high]."""
    require_number(value, where)
    if not math.isfinite(value):
        raise MechanismError(f"{where}: {value} is not a finite number")
    if (low is not None and value < low) or (high is not None and value > high):
        bounds = [-math.inf if low is None else low, math.inf if high is None else high]
        raise MechanismError(f"{where}: {value!r} is outside of {bounds}")


def check_starts(m: Description) -> None:
    """Raise MechanismError for a start value that is not finite or out of its bounds."""
    for q in m.coordinates:
        check_number(f"coordinates.{q.name}.start", q.start, q.minimum, q.maximum)
        check_number(f"coordinates.{q.name}.velocity", q.velocity)


def _check_numbers(mechanism: Description) -> None:
    for q in mechanism.coordinates:
        _check_bounds(q, f"coordinates.{q.name}")
    check_starts(mechanism)
    for q in mechanism.coordinates:
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
    if e.tolerance >= 1:
        raise MechanismError(f"experiment.tolerance: {e.tolerance!r} is no relative one; give one below 1, as 1e-6")
    if e.step > e.stop_time:
        raise MechanismError(f"experiment.step: {e.step!r} s is longer than stop_time = {e.stop_time!r} s")


def _check_bounds(part: Coordinate | Parameter | Input, where: str) -> None:
    for label, bound in (("min", part.minimum), ("max", part.maximum)):
        if bound is not None:
            check_number(f"{where}.{label}", bound)
    if part.minimum is not None and part.maximum is not None and part.minimum > part.maximum:
        raise MechanismError(f"{where}: min = {part.minimum!r} is above max = {part.maximum!r}")


# ---------------------------------------------------------------------------------------------------------- parts


def _check_parts(m: Description) -> None:
    """Raise MechanismError for keys that do not go together and for references to parts that do not exist."""
    if m.energy.lagrangian is not None and (m.energy.kinetic is not None or m.energy.potential is not None):
        raise MechanismError("energy: 'lagrangian' stands for kinetic and potential; give it alone, or those two")
    for table, parts in (("springs", m.springs), ("dampers", m.dampers)):
        for part in parts:
            _check_element(m, part, f"{table}.{part.name}")
    for damper in m.dampers:
        _check_damper(m, damper, f"dampers.{damper.name}")
    for load in m.loads:
        _check_load(m, f"loads.{load.name}", load)
    for output in m.outputs:
        _check_output(m, f"outputs.{output.name}", output)
    known = [*(q.name for q in m.coordinates), *m.driven]
    for force in m.forces:
        if force.coordinate not in known:
            raise MechanismError(
                f"forces.{force.coordinate}: there is no such coordinate or prescribed motion; "
                f"known are {', '.join(known)}"
            )


def _check_element(m: Description, part: Spring | Damper, where: str) -> None:
    """Raise MechanismError unless a spring or damper acts by an expression, or between two different places."""
    key = "elongation" if hasattr(part, "elongation") else "rate"
    if (getattr(part, key) is None) == (part.between is None):
        raise MechanismError(f"{where}: give either '{key}' or 'between'")
    if part.between is None:
        if getattr(part, "length", None) is not None:
            raise MechanismError(f"{where}: 'length' goes with 'between'; subtract it in the elongation instead")
        return
    if len(part.between) != 2:
        raise MechanismError(f"{where}.between: {len(part.between)} ends; name two points or bodies")
    a, b = (_location(m, str(end), f"{where}.between") for end in part.between)
    if a == b:
        raise MechanismError(
            f"{where}.between: '{part.between[0]}' and '{part.between[1]}' are at the same place always"
        )


def _check_damper(m: Description, damper: Damper, where: str) -> None:
    """Raise MechanismError unless ``damper`` has either a damping or a force.

    In the force the name "rate" is that of the damper; nothing else may have it.
    """
    if (damper.damping is None) == (damper.force is None):
        raise MechanismError(f"{where}: give either 'damping' or 'force'")
    own = names.DAMPER_RATE
    tables = (m.coordinates, m.parameters, m.inputs, m.definitions)
    declared = any(part.name == own for parts in tables for part in parts)
    if damper.force is not None and declared and own in free_names([damper.force]):
        raise MechanismError(
            f"{where}.force: '{own}' is the damper's own rate here, and the mechanism calls something else so too; "
            "rename that"
        )


def _location(m: Description, name: str, where: str) -> tuple[str, Vector]:
    """Frame and position of the point or body ``name``; raises MechanismError with ``where`` if there is none."""
    try:
        return m.location(name)
    except MechanismError as error:
        raise MechanismError(f"{where}: {error}") from None


def _check_load(m: Description, where: str, load: Load) -> None:
    if (load.force is None) == (load.torque is None):
        raise MechanismError(f"{where}: give either a force (at a point) or a torque (on a body), or input = true")
    if load.force is not None:
        _check_force(m, where, load, load.force)
    else:
        _check_torque(m, where, load)


def _check_force(m: Description, where: str, load: Load, force: Sequence[Expression]) -> None:
    """Raise MechanismError unless a force acts at a point or body, with as many entries as the position of this."""
    if (load.point is None) == (load.body is None):
        raise MechanismError(f"{where}: a force acts at a 'point'; name one")
    key, name = ("body", load.body) if load.point is None else ("point", load.point)
    frame, position = _location(m, str(name), f"{where}.{key}")
    _check_axes(where, load, frame != WORLD)
    if len(force) != len(position):
        raise MechanismError(f"{where}.force: has {len(force)} entries, the position of '{name}' has {len(position)}")


def _check_torque(m: Description, where: str, load: Load) -> None:
    """Raise MechanismError unless a torque fits its body: one expression for an angle, 3 entries for a frame."""
    if load.body is None or load.point is not None:
        raise MechanismError(f"{where}: a torque acts on a 'body'; name one")
    body = rigid_place(m, str(load.body), f"{where}.body")
    _check_axes(where, load, body.frame not in (None, WORLD))
    entries = len(load.torque) if isinstance(load.torque, tuple) else None
    wanted = None if body.frame is None else 3
    if entries != wanted:
        asked = "one expression" if wanted is None else "3 entries"
        raise MechanismError(f"{where}.torque: the torque on '{load.body}' has {asked}, got {load.torque}")


def _check_axes(where: str, part: Load | Output, framed: bool) -> None:
    if part.axes not in (WORLD, "frame"):
        raise MechanismError(f"{where}.axes: '{part.axes}' is unknown; give 'world' or 'frame'")
    if part.axes == "frame" and not framed:
        raise MechanismError(f"{where}.axes: there is no frame to take the axes of; give 'world'")


def _measured_by(output: Output, where: str) -> str:
    """The key that says what ``output`` is: 'expression', 'frame', 'point' or 'bodies'.

    Raises MechanismError if there is none, or more than one; a frame may stand beside bodies.
    """
    given = [key for key in ("expression", "frame", "point", "bodies") if getattr(output, key) is not None]
    if given == ["frame", "bodies"]:
        return "bodies"
    if len(given) != 1:
        found = " and ".join(f"'{key}'" for key in given) or "none of them"
        raise MechanismError(f"{where}: give one of 'expression', 'frame', 'point' or 'bodies', got {found}")
    return given[0]


def _check_output(m: Description, where: str, output: Output) -> None:
    """Raise MechanismError unless ``output`` has an expression, or a quantity of a frame, a point or bodies."""
    key = _measured_by(output, where)
    known = _quantities(m, output, key, where)
    if (output.quantity is None) == (key != "expression") or (known and output.quantity not in known):
        wanted = f"give one of {', '.join(known)}" if known else "it goes with 'frame', 'point' or 'bodies'"
        found = "is missing" if output.quantity is None else f"{output.quantity!r} does not fit"
        raise MechanismError(f"{where}.quantity: {found}; {wanted}")
    if key == "bodies" and (output.frame is None) == (output.quantity in HOLDING):
        remedy = "leave it out" if output.frame else "name the frame whose origin it is about"
        raise MechanismError(f"{where}.frame: does not fit to {output.quantity}; {remedy}")
    _check_axes(where, output, output.frame is not None and output.quantity in ALONG_AXES)


def _quantities(m: Description, output: Output, key: str, where: str) -> list[str]:
    """The quantities that ``output`` may show of its part or parts; raises MechanismError if there are no such ones."""
    known = [name for name, (of, _, _) in QUANTITIES.items() if of == key]
    if key == "bodies":
        _check_bodies(m, output, where)
    if output.frame is not None:
        try:
            m.frame(str(output.frame))
        except MechanismError as error:
            raise MechanismError(f"{where}.frame: {error}") from None
    if key == "point":
        turns = any(part.angle is not None for part in (*m.bodies, *m.points) if part.name == str(output.point))
        if not (turns and output.quantity in TURNING):  # a body that only turns has no place
            _location(m, str(output.point), f"{where}.point")
        known += TURNING if turns else ()
    return known


def _check_bodies(m: Description, output: Output, where: str) -> None:
    """Raise MechanismError unless ``output`` is of different bodies that are somewhere and have mass."""
    named, placed = list(map(str, output.bodies or ())), {body.name: body for body in m.placed_bodies}
    if not named or len({*named}) < len(named):
        raise MechanismError(f"{where}.bodies: expected one or more different bodies, got {named}")
    for name in named:
        if name not in placed:
            raise MechanismError(f"{where}.bodies: no body with a place is called '{name}'; {remedy_for(name, placed)}")
    if all(placed[name].mass == 0 for name in named):
        raise MechanismError(f"{where}.bodies: these have no mass; name bodies with mass")
