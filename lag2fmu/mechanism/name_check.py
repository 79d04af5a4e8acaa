"""The check that the user's names are identifiers, stand once and clash with no generated name."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping

from lag2fmu.description.description import Description
from lag2fmu.description.names import (
    DISSIPATED_ENERGY,
    acceleration,
    derivative,
    drive,
    drive_power,
    of_constraint,
    of_coordinate,
    of_friction,
    of_unilateral,
    velocity,
)
from lag2fmu.description.reserved import GLOBAL_NAMES
from lag2fmu.errors import MechanismError
from lag2fmu.language.identifiers import check_identifier
from lag2fmu.mechanism.drives import carried


def _of(brought: Mapping[str, str], owner: str) -> Iterator[tuple[str, str]]:
    """The names that are ``brought`` {name: what it is} by the ``owner``, with a phrase that names both."""
    return ((name, f"the {what} of {owner}") for name, what in brought.items())


def _generated(mechanism: Description) -> Iterator[tuple[str, str]]:
    for q in mechanism.coordinates:
        yield from _of(of_coordinate(q.name), f"coordinate '{q.name}'")
    for constraint in mechanism.constraints:
        yield from _of(of_constraint(constraint.name), f"constraint '{constraint.name}'")
    for motion in mechanism.motions:
        yield velocity(motion.name), f"the velocity of motion input '{motion.name}'"
        yield acceleration(motion.name), f"the acceleration of motion input '{motion.name}'"
    for name in carried(mechanism):
        yield drive(name), f"the force that carries the motion '{name}'"
        yield drive_power(name), f"the power that carries the motion '{name}'"
    moving = {q.name for q in mechanism.coordinates} | {velocity(q.name) for q in mechanism.coordinates}
    for state in (z for z in mechanism.states if z.name not in moving):  # other names clash
        yield derivative(state.name), f"the derivative of the further state '{state.name}'"
    yield from _generated_by_events(mechanism)


def _generated_by_events(mechanism: Description) -> Iterator[tuple[str, str]]:
    unilaterals = mechanism.unilateral_names
    for name in unilaterals:
        yield from _of(of_unilateral(name), f"the contact or stop '{name}'")
    for friction in mechanism.frictions:
        yield from _of(of_friction(friction.name), f"the friction element '{friction.name}'")
    if unilaterals or mechanism.frictions:
        yield DISSIPATED_ENERGY, "the energy that contacts and friction dissipate"


def _declared(mechanism: Description) -> Iterator[tuple[str, str]]:
    for table in ("coordinates", "parameters", "inputs", "states", "tables", "definitions"):
        for part in getattr(mechanism, table):
            yield part.name, f"{table}.{part.name}"
    for output in mechanism.outputs:
        for name in output.names:
            yield name, f"outputs.{output.name}"


def check_names(mechanism: Description) -> None:
    """Raise MechanismError for a name that is no identifier, stands twice, or clashes; both sides are named.

    An output may have the name of a definition, which it then shows.
    """
    check_identifier(mechanism.name, "mechanism.name")
    _check_constraint_names(mechanism)
    taken: dict[str, str] = dict(GLOBAL_NAMES)
    for name, what in _generated(mechanism):
        if name in taken:
            raise MechanismError(f"the name '{name}' is generated twice: {taken[name]}, and {what}; rename one")
        taken[name] = what
    for name, what in _declared(mechanism):
        check_identifier(name, what)
        other = taken.get(name)
        if other is not None and not (what.startswith("outputs.") and other.startswith("definitions.")):
            raise MechanismError(f"{what}: the name '{name}' is already taken by {other}; choose another one")
        taken[name] = what
    acting = ("springs", "dampers", "loads", "joints", "constraints", "contacts", "stops", "frictions")
    for table in ("frames", "visuals", *acting):
        _check_unique([part.name for part in getattr(mechanism, table)], table)
    _check_unique([part.name for part in (*mechanism.bodies, *mechanism.points)], "bodies and points")
    _check_unique([part.coordinate for part in mechanism.forces], "forces")


def _check_constraint_names(mechanism: Description) -> None:
    """Raise MechanismError for two constraints of one name: all kinds share their names."""
    taken: dict[str, str] = {}
    for constraint in mechanism.constraints:
        where = f"constraints.{constraint.kind}.{constraint.name}"
        if constraint.name in taken:
            raise MechanismError(
                f"{where}: {taken[constraint.name]} has the name '{constraint.name}' already, and multiplier and "
                "residual are called after it; rename one"
            )
        taken[constraint.name] = where


def _check_unique(names: list[str], where: str) -> None:
    for name, count in Counter(names).items():
        check_identifier(name, where)
        if count > 1:
            raise MechanismError(f"{where}: the name '{name}' is used twice; rename one")
