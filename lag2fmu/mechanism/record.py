"""The record ``Mechanism`` and its parts: what the textbook procedure asks for, as data.

All parts are frozen; their expressions are in the normal form of ``expressions`` and compute in SI units. Numbers of
coordinates, parameters and inputs are kept in SI; the unit says how they are shown.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import TypeAlias, TypeVar

import sympy as sp

from lag2fmu.errors import MechanismError
from lag2fmu.mechanism.expressions import normal_form, symbol
from lag2fmu.mechanism.units import Unit, parse_unit

Expression: TypeAlias = "sp.Expr | int | float"
Vector = tuple[sp.Expr, ...]


@dataclass(frozen=True)
class Coordinate:
    """A generalized coordinate q: start values of q and qd, nominal value and bounds in SI."""

    name: str
    unit: Unit | None = None
    start: float = 0.0
    velocity: float = 0.0
    nominal: float = 1.0
    minimum: float | None = None
    maximum: float | None = None
    doc: str = ""


@dataclass(frozen=True)
class Parameter:
    """A constant of the mechanism: an independent one has a ``value`` (SI), a dependent one an ``expression``."""

    name: str
    value: float | None = None
    unit: Unit | None = None
    doc: str = ""
    expression: sp.Expr | None = None
    minimum: float | None = None
    maximum: float | None = None


@dataclass(frozen=True)
class Input:
    """A signal from outside, start value in SI. A ``motion`` input y0 comes with its derivatives y0_dot and y0_ddot."""

    name: str
    unit: Unit | None = None
    start: float = 0.0
    motion: bool = False
    doc: str = ""
    minimum: float | None = None
    maximum: float | None = None


@dataclass(frozen=True)
class Definition:
    """A name for an expression that other expressions use."""

    name: str
    expression: sp.Expr

    def __post_init__(self) -> None:
        _normalise(self, "definition", "expression")


@dataclass(frozen=True)
class Energy:
    """Energies beside those of bodies and springs, or the whole Lagrangian; ``dissipation`` is Rayleigh's function."""

    kinetic: Expression | None = None
    potential: Expression | None = None
    dissipation: Expression | None = None
    lagrangian: Expression | None = None

    def __post_init__(self) -> None:
        for item in fields(self):
            if getattr(self, item.name) is not None:
                _normalise(self, "energy", item.name)


@dataclass(frozen=True)
class Gravity:
    """Uniform gravity: ``acceleration`` (m/s2) along ``direction`` (2 or 3 entries; by default -y or -z)."""

    acceleration: Expression
    direction: Vector | None = None

    def __post_init__(self) -> None:
        _normalise(self, "gravity", "acceleration", "direction")


@dataclass(frozen=True)
class Body:
    """A particle, or a planar rigid body if ``angle`` and ``inertia`` are given.

    ``position`` holds the 2 or 3 coordinates of the mass centre in the fixed frame, r(t, q), in m; ``mass`` in kg;
    ``inertia`` about the mass centre in kg.m2; ``angle`` in rad, counter-clockwise.
    """

    name: str
    mass: Expression
    position: Sequence[Expression]
    angle: Expression | None = None
    inertia: Expression | None = None

    def __post_init__(self) -> None:
        _normalise(self, f"bodies.{self.name}", "mass", "position", "angle", "inertia")


@dataclass(frozen=True)
class Point:
    """A named point in the fixed frame: ``position`` with 2 or 3 entries, in m."""

    name: str
    position: Sequence[Expression]

    def __post_init__(self) -> None:
        _normalise(self, f"points.{self.name}", "position")


End = str | Body | Point


@dataclass(frozen=True)
class Spring:
    """A linear spring: ``elongation`` as an expression, or ``between`` two points or bodies with natural ``length``."""

    name: str
    stiffness: Expression
    elongation: Expression | None = None
    between: Sequence[End] | None = None
    length: Expression | None = None

    def __post_init__(self) -> None:
        _normalise(self, f"springs.{self.name}", "stiffness", "elongation", "length")
        _name_ends(self)


@dataclass(frozen=True)
class Damper:
    """A linear damper: ``rate`` of elongation as an expression, or ``between`` two points or bodies."""

    name: str
    damping: Expression
    rate: Expression | None = None
    between: Sequence[End] | None = None

    def __post_init__(self) -> None:
        _normalise(self, f"dampers.{self.name}", "damping", "rate")
        _name_ends(self)


@dataclass(frozen=True)
class Force:
    """A generalized non-potential force Q on one coordinate."""

    coordinate: str
    expression: Expression

    def __post_init__(self) -> None:
        object.__setattr__(self, "coordinate", str(self.coordinate))
        _normalise(self, f"forces.{self.coordinate}", "expression")


@dataclass(frozen=True)
class Load:
    """A force (N) at a ``point`` (or at a body's mass centre), or a ``torque`` (N.m) on a planar ``body``.

    With ``input=True`` and no value the load itself becomes FMU inputs: NAME_x, NAME_y (NAME_z), or NAME for a torque.
    """

    name: str
    point: End | None = None
    body: End | None = None
    force: Sequence[Expression] | None = None
    torque: Expression | None = None
    input: bool = False

    def __post_init__(self) -> None:
        _normalise(self, f"loads.{self.name}", "force", "torque")
        for attribute in ("point", "body"):
            end = getattr(self, attribute)
            if end is not None:
                object.__setattr__(self, attribute, _end_name(end))


@dataclass(frozen=True)
class Output:
    """A further output of the FMU, by expression in t, q, qd, inputs and parameters."""

    name: str
    expression: Expression
    unit: Unit | str | None = None
    doc: str = ""

    def __post_init__(self) -> None:
        _normalise(self, f"outputs.{self.name}", "expression")
        object.__setattr__(self, "unit", _unit(self.unit))


@dataclass(frozen=True)
class Experiment:
    """What a default run looks like: stop time and communication step in s, relative tolerance."""

    stop_time: float = 10.0
    step: float = 0.01
    tolerance: float = 1e-6


def _normalise(part: object, where: str, *names: str) -> None:
    """Bring the expressions ``names`` of a frozen part to normal form; sequences become tuples."""
    for name in names:
        value = getattr(part, name)
        if value is None:
            continue
        if isinstance(value, (tuple, list, sp.MatrixBase)):
            value = tuple(normal_form(item, f"{where}.{name}[{i}]") for i, item in enumerate(value))
        else:
            value = normal_form(value, f"{where}.{name}")
        object.__setattr__(part, name, value)


def _end_name(end: End) -> str:
    return end if isinstance(end, str) else end.name


def _name_ends(part: Spring | Damper) -> None:
    if part.between is not None:
        object.__setattr__(part, "between", tuple(_end_name(end) for end in part.between))


def _unit(unit: Unit | str | None) -> Unit | None:
    return parse_unit(unit) if isinstance(unit, str) else unit


# ------------------------------------------------------------------------------------ symbols that carry their record


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


def coordinate(
    name: str,
    unit: str | None = None,
    *,
    start: float = 0.0,
    velocity: float = 0.0,
    nominal: float = 1.0,
    minimum: float | None = None,
    maximum: float | None = None,
    doc: str = "",
) -> Declared:
    """A generalized coordinate, its velocity being ``.dot``; numbers are in ``unit`` (``velocity`` in unit/s)."""
    u = parse_unit(unit or "1")
    rate, size = u.difference_to_si(velocity), u.difference_to_si(nominal)
    u_or_none = _unit(unit)
    return Declared(
        Coordinate(name, u_or_none, u.to_si(start), rate, size, _si(u_or_none, minimum), _si(u_or_none, maximum), doc)
    )


def parameter(
    name: str,
    value: float | sp.Expr,
    unit: str | None = None,
    doc: str = "",
    *,
    minimum: float | None = None,
    maximum: float | None = None,
) -> Declared:
    """A parameter: independent if ``value`` is a number (in ``unit``), dependent if it is an expression (in SI)."""
    u = _unit(unit)
    low, high = _si(u, minimum), _si(u, maximum)
    if isinstance(value, sp.Expr) and value.free_symbols:
        expression = normal_form(value, f"parameters.{name}")
        return Declared(Parameter(name, None, u, doc, expression, low, high))
    return Declared(Parameter(name, _si(u, float(value)), u, doc, None, low, high))


def signal(
    name: str,
    unit: str | None = None,
    *,
    start: float = 0.0,
    motion: bool = False,
    minimum: float | None = None,
    maximum: float | None = None,
    doc: str = "",
) -> Declared:
    """An FMU input for expressions of forces; with ``motion=True`` a prescribed motion with ``.dot`` and ``.ddot``."""
    u = _unit(unit)
    return Declared(Input(name, u, _si(u, start), motion, doc, _si(u, minimum), _si(u, maximum)))


def _si(unit: Unit | None, value: float | None) -> float:
    """SI value of a number given in ``unit`` (None stays None: a bound that is not there)."""
    return value if value is None else float(value) if unit is None else unit.to_si(float(value))  # type: ignore[return-value]


# ------------------------------------------------------------------------------------------------------- the mechanism


@dataclass(frozen=True, init=False)
class Mechanism:
    """A mechanism as analytical mechanics describes it; complete and checked when built.

    Built in Python from symbols that ``coordinate``, ``parameter`` and ``signal`` declare, or read from text by
    ``lag2fmu.load``. Raises MechanismError (UnitError for dimensions when ``strict_units``), naming part and remedy.
    ``warnings`` lists mismatching dimensions that were let pass.
    """

    name: str
    title: str
    source: str
    coordinates: tuple[Coordinate, ...]
    parameters: tuple[Parameter, ...]
    inputs: tuple[Input, ...]
    definitions: tuple[Definition, ...]
    energy: Energy
    forces: tuple[Force, ...]
    gravity: Gravity | None
    bodies: tuple[Body, ...]
    points: tuple[Point, ...]
    springs: tuple[Spring, ...]
    dampers: tuple[Damper, ...]
    loads: tuple[Load, ...]
    outputs: tuple[Output, ...]
    experiment: Experiment
    strict_units: bool
    warnings: tuple[str, ...] = field(init=False, compare=False, repr=False)

    def __init__(  # noqa: PLR0913 (the tables of the text format)
        self,
        name: str,
        *,
        coordinates: Iterable[Declared | Coordinate],
        title: str = "",
        source: str = "",
        parameters: Iterable[Declared | Parameter] = (),
        inputs: Iterable[Declared | Input] = (),
        definitions: Iterable[Definition] = (),
        energy: Energy | None = None,
        forces: Iterable[Force] | Mapping[sp.Symbol, Expression] = (),
        gravity: Gravity | Expression | None = None,
        bodies: Iterable[Body] = (),
        points: Iterable[Point] = (),
        springs: Iterable[Spring] = (),
        dampers: Iterable[Damper] = (),
        loads: Iterable[Load] = (),
        outputs: Iterable[Output] = (),
        experiment: Experiment | None = None,
        strict_units: bool = False,
    ) -> None:
        """See the class and DESIGN of the text format: the keywords are the tables of a .toml file."""
        from lag2fmu.mechanism.check import check

        if isinstance(forces, Mapping):
            forces = [Force(str(q), Q) for q, Q in forces.items()]
        if gravity is not None and not isinstance(gravity, Gravity):
            gravity = Gravity(gravity)
        loads, load_inputs = _expand_loads(loads, bodies := tuple(bodies), points := tuple(points))
        values = {
            "name": name,
            "title": title or str(name).replace("_", " ").capitalize(),
            "source": source,
            "coordinates": _records(coordinates, Coordinate, "coordinates"),
            "parameters": _records(parameters, Parameter, "parameters"),
            "inputs": (*_records(inputs, Input, "inputs"), *load_inputs),
            "definitions": tuple(definitions),
            "energy": energy or Energy(),
            "forces": tuple(forces),
            "gravity": gravity,
            "bodies": bodies,
            "points": points,
            "springs": tuple(springs),
            "dampers": tuple(dampers),
            "loads": loads,
            "outputs": tuple(outputs),
            "experiment": experiment or Experiment(),
            "strict_units": strict_units,
            "warnings": (),
        }
        for key, value in values.items():
            object.__setattr__(self, key, value)
        object.__setattr__(self, "warnings", check(self))

    @property
    def plain_inputs(self) -> tuple[Input, ...]:
        """The inputs that are no prescribed motions."""
        return tuple(item for item in self.inputs if not item.motion)

    @property
    def motions(self) -> tuple[Input, ...]:
        """The prescribed motions."""
        return tuple(item for item in self.inputs if item.motion)

    @property
    def places(self) -> tuple[Body | Point, ...]:
        """The bodies and points: what a spring, damper or force can be attached to."""
        return (*self.bodies, *self.points)

    def place(self, name: str) -> Vector:
        """The position (m) of the point or body called ``name``; raises MechanismError if there is none."""
        for part in self.places:
            if part.name == name:
                return tuple(part.position)
        known = ", ".join(part.name for part in self.places) or "none"
        raise MechanismError(f"there is no point or body '{name}' in mechanism '{self.name}'; known are {known}")

    def expressions(self) -> Iterator[tuple[str, sp.Expr]]:
        """Every expression of the record with its place, e.g. ('bodies.bob.position[0]', x)."""
        for table in fields(self):
            content = getattr(self, table.name)
            parts = content if isinstance(content, tuple) else (content,)
            for part in parts:
                if not isinstance(part, str):
                    label = getattr(part, "name", getattr(part, "coordinate", ""))
                    yield from _expressions_of(part, f"{table.name}.{label}" if label else table.name)


Record = TypeVar("Record", Coordinate, Parameter, Input)


def _records(declared: Iterable[Declared | Record], kind: type[Record], table: str) -> tuple[Record, ...]:
    """The records of the symbols or records ``declared``; raises MechanismError for a thing of another kind."""
    records: list[Record] = []
    for item in declared:
        record = item.declaration if isinstance(item, Declared) else item
        if not isinstance(record, kind):
            raise MechanismError(f"{table}: expected a {kind.__name__.lower()}, got {type(record).__name__} '{record}'")
        records.append(record)
    return tuple(records)


def _expand_loads(
    loads: Iterable[Load], bodies: tuple[Body, ...], points: tuple[Point, ...]
) -> tuple[tuple[Load, ...], tuple[Input, ...]]:
    """Loads that are inputs, written out: the load refers to the inputs it brings."""
    places: tuple[Body | Point, ...] = (*bodies, *points)
    dimension = {part.name: len(part.position) for part in places}
    expanded: list[Load] = []
    inputs: list[Input] = []
    for load in loads:
        if not load.input:
            expanded.append(load)
        elif load.force is not None or load.torque is not None:
            raise MechanismError(f"loads.{load.name}: 'input' and a value exclude each other; leave one out")
        elif load.point is not None:
            names = [f"{load.name}_{axis}" for axis in "xyz"[: dimension.get(str(load.point), 2)]]
            inputs += [
                Input(n, parse_unit("N"), doc=f"force '{load.name}' at {load.point}, along {n[-1]}") for n in names
            ]
            expanded.append(Load(load.name, point=load.point, force=[symbol(n) for n in names]))
        else:
            inputs.append(Input(load.name, parse_unit("N.m"), doc=f"torque on {load.body}"))
            expanded.append(Load(load.name, body=load.body, torque=symbol(load.name)))
    return tuple(expanded), tuple(inputs)


def _expressions_of(part: object, where: str) -> Iterator[tuple[str, sp.Expr]]:
    for item in fields(part) if hasattr(part, "__dataclass_fields__") else ():  # type: ignore[arg-type]
        value = getattr(part, item.name)
        if isinstance(value, sp.Expr):
            yield f"{where}.{item.name}", value
        elif isinstance(value, tuple):
            for i, entry in enumerate(value):
                if isinstance(entry, sp.Expr):
                    yield f"{where}.{item.name}[{i}]", entry
