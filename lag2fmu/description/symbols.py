"""Coordinates, parameters and inputs, and the symbols that declare them in Python."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.keys import CONSTANT, OWN, bound_key, doc_key, key, unit_key
from lag2fmu.description.values import require_number, require_optional_number, require_text
from lag2fmu.errors import MechanismError
from lag2fmu.language.identifiers import check_identifier
from lag2fmu.language.unit_parser import checked_unit, parse_unit
from lag2fmu.language.units import SECOND, Unit
from lag2fmu.language.vocabulary import normal_form, symbol

Expression: TypeAlias = "sp.Expr | int | float"

FILTERED = "filtered"
"""The kind of a prescribed motion that is given by its position alone."""


@dataclass(frozen=True)
class Coordinate:
    """A generalized coordinate q: start values of q and qd, nominal value and bounds in SI units.

    ``start`` is exact if ``given``; otherwise it is a first guess, from which constraints determine the start. The same
    holds for ``velocity`` with ``velocity_given``. If ``given`` is None, nobody gave a start; it is then exact unless a
    constraint determines it. ``nominal_from`` says where the nominal value is from: "given", "" for 1 in the unit, or a
    phrase of the derivation.
    """

    name: str
    unit: Unit | None = unit_key(order=-1)
    start: float = key("number", "Given and exact, in the unit.", default=0.0, order=-1)
    velocity: float = key(
        "difference",
        "Start of the velocity, given and exact, in the unit per s, or a text such as '280 rpm'.",
        default=0.0,
        order=-1,
    )
    nominal: float = key(
        "difference", "Typical size, in the unit; the solvers' errors are measured by it.", default=1.0
    )
    minimum: float | None = bound_key("min")
    maximum: float | None = bound_key("max")
    doc: str = doc_key()
    given: bool | None = key(
        "number",
        "Instead of start: about here, solved for from the constraints.",
        name="guess",
        default=None,
        order=-1,
    )
    velocity_given: bool | None = key(
        "difference",
        "Instead of velocity: about here, solved for from the constraints.",
        name="guess_velocity",
        default=None,
        order=-1,
    )
    nominal_from: str = field(default="", compare=False)


@dataclass(frozen=True)
class Parameter:
    """A constant of the mechanism: an independent one has a ``value`` (SI unit), a dependent one an ``expression``."""

    name: str
    value: float | None = key("number", "In the unit.", default=None, order=-1)
    unit: Unit | None = unit_key()
    doc: str = doc_key()
    expression: sp.Expr | None = key(
        "expression",
        "In other parameters, instead of a value: it follows them.",
        default=None,
        names=CONSTANT,
        unit=OWN,
        order=-1,
    )
    minimum: float | None = bound_key("min")
    maximum: float | None = bound_key("max")


@dataclass(frozen=True)
class Input:
    """A signal from outside, start value in SI units. A ``motion`` input y0 comes with y0_dot and y0_ddot.

    A "filtered" motion comes alone, as y0_target. The mechanism is moved by y0, which follows the target r by a
    critically damped filter with the ``time_constant`` T (s): T^2 y0_ddot + 2 T y0_dot + y0 = r. If the importer gives
    derivatives r', r'' of the target, 2 T r' + T^2 r'' is added to the right side. Raises MechanismError for an unknown
    kind of motion, and for a time constant without a filter.
    """

    name: str
    unit: Unit | None = unit_key()
    start: float = key("number", "Value while nothing is connected, in the unit.", default=0.0)
    motion: bool | str = key(
        "motion",
        'true: a prescribed motion NAME, NAME_dot, NAME_ddot, for positions too; "filtered": NAME_target, smoothed.',
        default=False,
    )
    time_constant: Expression | None = key(
        "expression",
        "Of the filter of a filtered motion, in s: a number, or an expression of parameters.",
        default=None,
        names=CONSTANT,
        unit=SECOND,
    )
    doc: str = doc_key(order=1)
    minimum: float | None = bound_key("min")
    maximum: float | None = bound_key("max")

    def __post_init__(self) -> None:
        where = f"inputs.{self.name}"
        if not isinstance(self.motion, (bool, str)) or self.motion not in (True, False, FILTERED):
            raise MechanismError(f"{where}.motion: {self.motion!r} is no kind of motion; give true or '{FILTERED}'")
        if (self.motion == FILTERED) != (self.time_constant is not None):
            wanted = "is missing; give it in s" if self.time_constant is None else f"goes with motion = '{FILTERED}'"
            raise MechanismError(f"{where}: 'time_constant' {wanted}")
        if self.time_constant is not None:
            object.__setattr__(self, "time_constant", normal_form(self.time_constant, f"{where}.time_constant"))


def names_of(u: Input) -> tuple[str, ...]:
    """The names of the inputs of the FMU that ``u`` stands for: a motion comes with its velocity and acceleration."""
    return (u.name, names.velocity(u.name), names.acceleration(u.name)) if u.motion else (u.name,)


class Declared(sp.Symbol):  # type: ignore[misc]
    """A real symbol that carries the record it was declared with, so that a model is written once.

    It is equal to every symbol declared under the same name; ``Mechanism`` takes the record and keeps plain symbols.
    """

    __slots__ = ("declaration",)
    declaration: Coordinate | Parameter | Input

    def __new__(cls, declaration: Coordinate | Parameter | Input) -> Declared:
        """A new symbol called as ``declaration`` says (SymPy's cache is passed by: it would return an older record)."""
        new: Declared = sp.Symbol.__xnew__(cls, declaration.name, real=True)
        new.declaration = declaration
        return new

    @property
    def dot(self) -> sp.Symbol:
        """The velocity of a coordinate or motion input, NAME_dot."""
        return symbol(f"{self.name}_dot")

    @property
    def ddot(self) -> sp.Symbol:
        """The acceleration of a motion input, NAME_ddot."""
        return symbol(f"{self.name}_ddot")


def coordinate(  # noqa: PLR0913 (the keys of the text format)
    name: str,
    unit: str | None = None,
    *,
    start: float | None = None,
    velocity: float | None = None,
    guess: float | None = None,
    guess_velocity: float | None = None,
    nominal: float | None = None,
    minimum: float | None = None,
    maximum: float | None = None,
    doc: str = "",
) -> Declared:
    """A generalized coordinate, its velocity being ``.dot``; numbers are in ``unit`` (``velocity`` in unit/s).

    ``start`` is given and exact, ``guess`` is where constraints are solved from; raises MechanismError for both. A
    ``nominal`` value that is not given follows from the mechanism, see ``dynamics.nominals``. Raises UnitError for an
    unknown unit, MechanismError for a value of another kind.
    """
    where = f"coordinates.{name}"
    own = _checked(where, name, unit, doc, min=minimum, max=maximum)
    numbers = {"start": start, "guess": guess, "velocity": velocity, "guess_velocity": guess_velocity}
    for key_, number in (numbers | {"nominal": nominal}).items():
        require_optional_number(number, f"{where}.{key_}")
    u = own or parse_unit("1")
    place, given = start_or_guess(start, guess, where, "start", "guess")
    rate, rate_given = start_or_guess(velocity, guess_velocity, where, "velocity", "guess_velocity")
    return Declared(
        Coordinate(
            name,
            own,
            u.to_si(0.0 if place is None else place),
            u.difference_to_si(0.0 if rate is None else rate),
            u.difference_to_si(1.0 if nominal is None else nominal),
            _si(own, minimum),
            _si(own, maximum),
            doc,
            given,
            rate_given,
            "" if nominal is None else "given",
        )
    )


def start_or_guess(
    start: float | None, guess: float | None, where: str, key: str, guess_key: str
) -> tuple[float | None, bool | None]:
    """The value that is given, and whether it is ``start``; raises MechanismError if both are given."""
    if start is not None and guess is not None:
        raise MechanismError(f"{where}: '{key}' and '{guess_key}' exclude each other; leave one out")
    return (start, True) if start is not None else (guess, None if guess is None else False)


def parameter(
    name: str,
    value: float | sp.Expr,
    unit: str | None = None,
    doc: str = "",
    *,
    minimum: float | None = None,
    maximum: float | None = None,
) -> Declared:
    """A parameter: independent if ``value`` is a number (in ``unit``), dependent if it is an expression (in SI).

    Raises UnitError for an unknown unit, MechanismError for a value of another kind.
    """
    where = f"parameters.{name}"
    u = _checked(where, name, unit, doc, min=minimum, max=maximum)
    low, high = _si(u, minimum), _si(u, maximum)
    if isinstance(value, sp.Expr) and value.free_symbols:
        expression = normal_form(value, where)
        return Declared(Parameter(name, None, u, doc, expression, low, high))
    require_number(value, f"{where}.value")
    return Declared(Parameter(name, _si(u, float(value)), u, doc, None, low, high))


def signal(
    name: str,
    unit: str | None = None,
    *,
    start: float = 0.0,
    motion: bool | str = False,
    time_constant: float | sp.Expr | None = None,
    minimum: float | None = None,
    maximum: float | None = None,
    doc: str = "",
) -> Declared:
    """An FMU input for expressions of forces; with ``motion=True`` a prescribed motion with ``.dot`` and ``.ddot``.

    With ``motion="filtered"`` it follows the input NAME_target by a filter with the ``time_constant`` (s).

    Raises UnitError for an unknown unit, MechanismError for a value of another kind.
    """
    where = f"inputs.{name}"
    u = _checked(where, name, unit, doc, min=minimum, max=maximum)
    require_number(start, f"{where}.start")
    low, high = _si(u, minimum), _si(u, maximum)
    return Declared(Input(name, u, _si(u, start), motion, time_constant, doc, low, high))


def _checked(where: str, name: object, unit: object, doc: object, **bounds: object) -> Unit | None:
    """The ``unit`` of a declared symbol; raises MechanismError for a name, text or bound of another kind."""
    if not isinstance(name, str):
        check_identifier(name, where)
    require_text(doc, f"{where}.doc")
    for bound, value in bounds.items():
        require_optional_number(value, f"{where}.{bound}")
    return None if unit is None else checked_unit(unit, f"{where}.unit")


def _si(unit: Unit | None, value: float | None) -> float:
    """SI value of a number given in ``unit`` (None stays None: a bound that is not there)."""
    return value if value is None else float(value) if unit is None else unit.to_si(float(value))  # type: ignore[return-value]
