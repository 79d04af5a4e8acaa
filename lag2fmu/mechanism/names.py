"""Names: which ones lag2fmu generates, and the check that the user's names clash with none."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator
from difflib import get_close_matches
from typing import TYPE_CHECKING

from lag2fmu.errors import MechanismError
from lag2fmu.mechanism.expressions import CONSTANTS, FUNCTIONS

if TYPE_CHECKING:
    from lag2fmu.mechanism.record import Mechanism

IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*", re.ASCII)
MAX_NAME = 128
_MASSLESS = "massless_"

SETTINGS = ("solver_tolerance", "solver_step", "solver_max_step")
ENERGIES = ("kinetic_energy", "potential_energy", "total_energy", "generalized_energy")
GLOBAL_NAMES = {
    "t": "the time",
    "time": "the time",
    **dict.fromkeys(CONSTANTS, "a constant"),
    **dict.fromkeys(FUNCTIONS, "a function"),
    **dict.fromkeys(SETTINGS, "a setting of the solver"),
    **dict.fromkeys(ENERGIES, "an energy that is calculated"),
    "external_power": "the power of the external forces",
}


def suggestion(word: str, known: Iterable[str]) -> str:
    """The remedy for an unknown ``word``: the names in ``known`` that are near to it, or else what is known."""
    known = list(known)
    near = get_close_matches(word[:MAX_NAME], known, n=2)
    if near:
        return f"did you mean {' or '.join(repr(name) for name in near)}?"
    return f"known are {', '.join(known[:30])}{', ...' if len(known) > 30 else ''}" if known else "there are none"


def velocity(name: str) -> str:
    """Name of the first time derivative of a coordinate or motion input."""
    return f"{name}_dot"


def acceleration(name: str) -> str:
    """Name of the second time derivative of a coordinate or motion input."""
    return f"{name}_ddot"


def rate(name: str) -> str:
    """Name of the time derivative of an input, which is no variable of the FMU."""
    return f"rate of {name}"


def generalized_force(name: str) -> str:
    """Name of the FMU input for an external generalized force on the coordinate ``name``."""
    return f"Q_{name}"


def momentum(name: str) -> str:
    """Name of the generalized momentum of the coordinate ``name``."""
    return f"p_{name}"


def derivative(name: str) -> str:
    """Name of the variable that carries the FMI attribute ``derivative`` for the state ``name``."""
    return f"der_{name}"


def multiplier(name: str) -> str:
    """Name of the Lagrange multiplier of the constraint ``name``."""
    return f"multiplier_{name}"


def massless(coordinate: str) -> str:
    """Name of the constraint that keeps the forces on a ``coordinate`` without mass in equilibrium."""
    return f"{_MASSLESS}{coordinate}"


def coordinate_of_massless(constraint: str) -> str:
    """The coordinate whose ``massless`` constraint is called ``constraint``."""
    return constraint.removeprefix(_MASSLESS)


def residual(name: str) -> str:
    """Name of the residual of the constraint ``name``: what should be zero."""
    return f"residual_{name}"


def _generated(mechanism: Mechanism) -> Iterator[tuple[str, str]]:
    for q in mechanism.coordinates:
        of = f"of coordinate '{q.name}'"
        yield velocity(q.name), f"the velocity {of}"
        yield acceleration(q.name), f"the acceleration {of}"
        yield generalized_force(q.name), f"the external force {of}"
        yield momentum(q.name), f"the momentum {of}"
        yield derivative(q.name), f"the derivative {of}"
        yield derivative(velocity(q.name)), f"the derivative of the velocity {of}"
    for constraint in mechanism.constraints:
        yield multiplier(constraint.name), f"the multiplier of constraint '{constraint.name}'"
        yield residual(constraint.name), f"the residual of constraint '{constraint.name}'"
    for motion in mechanism.motions:
        yield velocity(motion.name), f"the velocity of motion input '{motion.name}'"
        yield acceleration(motion.name), f"the acceleration of motion input '{motion.name}'"


def _declared(mechanism: Mechanism) -> Iterator[tuple[str, str]]:
    for table in ("coordinates", "parameters", "inputs", "definitions"):
        for part in getattr(mechanism, table):
            yield part.name, f"{table}.{part.name}"
    for output in mechanism.outputs:
        for name in output.names:
            yield name, f"outputs.{output.name}"


def check_names(mechanism: Mechanism) -> None:
    """Raise MechanismError for a name that is no identifier, stands twice, or clashes; both sides are named.

    An output may repeat the name of a definition: it then shows that definition.
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
    for table in ("frames", "springs", "dampers", "loads", "joints", "constraints"):
        _check_unique([part.name for part in getattr(mechanism, table)], table)
    _check_unique([part.name for part in mechanism.places], "bodies and points")
    _check_unique([part.coordinate for part in mechanism.forces], "forces")


def _check_constraint_names(mechanism: Mechanism) -> None:
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


def check_identifier(name: object, where: str) -> None:
    """Raise MechanismError, its message starting with ``where``, unless ``name`` is a letter or _, then digits too."""
    if not isinstance(name, str) or not IDENTIFIER.fullmatch(name) or len(name) > MAX_NAME:
        raise MechanismError(
            f"{where}: {str(name)[:60]!r} is no name; use letters, digits and underscores, not starting with a digit"
        )


def _check_unique(names: list[str], where: str) -> None:
    for name, count in Counter(names).items():
        check_identifier(name, where)
        if count > 1:
            raise MechanismError(f"{where}: the name '{name}' is used twice; rename one")
