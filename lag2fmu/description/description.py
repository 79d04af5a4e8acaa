"""The record ``Description``: a mechanism as it is written, table by table, without anything that follows.

Numbers of coordinates, parameters and inputs are kept in SI; the unit says how they are shown.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import KW_ONLY, dataclass, fields
from functools import cache
from typing import Any, NamedTuple, TypeVar

import sympy as sp

from lag2fmu.description.events import IMPACTS, Contact, Friction, State, Stop
from lag2fmu.description.joints import Joint
from lag2fmu.description.keys import Key, TableKey, key, table_key
from lag2fmu.description.names import stop_side
from lag2fmu.description.outputs import Experiment, Output
from lag2fmu.description.parts import (
    Constraint,
    Damper,
    Definition,
    Energy,
    Force,
    Gravity,
    Load,
    Spring,
    in_order_of_kinds,
)
from lag2fmu.description.places import WORLD, Body, Frame, Place, Point, Vector, expressions_of, normalise, remedy_for
from lag2fmu.description.ports import Ports
from lag2fmu.description.subsystems import Part
from lag2fmu.description.symbols import FILTERED, Coordinate, Declared, Input, Parameter
from lag2fmu.description.tables import Table
from lag2fmu.description.values import kind_and_name, require_record
from lag2fmu.description.visuals import Visual
from lag2fmu.errors import MechanismError
from lag2fmu.language.identifiers import check_identifier

IMPRINT = ("author", "version", "copyright", "license")
"""The keys that say who is behind a mechanism; attributes of modelDescription.xml have the same names."""


class Entry(NamedTuple):
    """An ``expression`` of a ``part``, with the ``table`` and the ``key`` under which it stands, and its place."""

    table: str
    part: Any
    key: Key
    where: str
    expression: sp.Expr


@dataclass(frozen=True)
class Description:
    """A mechanism as it is written; the text format is its lossless serialisation.

    The keywords are the tables of a .toml file, of which ``lag2fmu new`` writes an example. Tables of parts take any
    iterable. Coordinates, parameters and inputs may also be given by the symbols that declare them, ``forces`` as a
    mapping {coordinate: Q}, and ``gravity`` as an acceleration (m/s2). Constraints are put in the order of their kinds,
    the holonomic ones first. Raises MechanismError for a part that belongs to another table; ``Mechanism`` checks
    everything else.
    """

    name: str = key("string", "An identifier; the name of the FMU.")
    _: KW_ONLY
    title: str = key("string", "What it is, in a few words.", default="")
    source: str = key("string", "Where equations and values come from.", default="")
    not_taken: tuple[str, ...] = key("texts", "What the imported file has, and nothing here is made of.", default=())
    author: str = key("string", "Who wrote it.", default="")
    version: str = key("string", "Its version, e.g. 1.2.", default="")
    copyright: str = key("string", "Whose it is, e.g. (c) 2026 A. Lovelace.", default="")
    license: str = key("string", "Under which terms others may use it, e.g. BSD-3-Clause.", default="")
    impacts: str = key(
        IMPACTS, "How contacts share an impact: in rounds, or in one problem over all that touch.", default="sequential"
    )
    parts: tuple[Part, ...] = table_key(
        Part, "tables", "Mechanisms that this one is made of; their names become PART_NAME."
    )
    parameters: tuple[Parameter, ...] = table_key(
        Parameter, "lines", "Constants of the mechanism: NAME = { value = ..., unit = ... }."
    )
    coordinates: tuple[Coordinate, ...] = table_key(
        Coordinate, "lines", "Generalized coordinates q; NAME_dot is the velocity of NAME."
    )
    inputs: tuple[Input, ...] = table_key(Input, "lines", "Signals from outside that expressions may use.")
    states: tuple[State, ...] = table_key(
        State, "lines", "Further states of first order: NAME = { derivative = ..., start = ..., unit = ... }."
    )
    tables: tuple[Table, ...] = table_key(
        Table, "tables", "Measured data as functions of one or two arguments: NAME(x) in expressions."
    )
    definitions: tuple[Definition, ...] = table_key(
        Definition, "expressions", "Names for expressions that others use, in any order."
    )
    energy: Energy = table_key(
        Energy,
        "single",
        "Energies beside those of bodies and springs, which add theirs; or the whole Lagrangian.",
        default=Energy(),
    )
    forces: tuple[Force, ...] = table_key(
        Force, "expressions", "Generalized non-potential force on a coordinate or prescribed motion: NAME = expression."
    )
    gravity: Gravity | None = table_key(Gravity, "single", "Uniform gravity on all bodies.", default=None)
    frames: tuple[Frame, ...] = table_key(Frame, "tables", "Frames that move in space.")
    bodies: tuple[Body, ...] = table_key(
        Body, "tables", "Bodies: particles (no inertia), planar bodies (position and angle), spatial ones (frame)."
    )
    points: tuple[Point, ...] = table_key(Point, "tables", "Points that springs, dampers, loads and outputs refer to.")
    visuals: tuple[Visual, ...] = table_key(Visual, "tables", "What is seen on frames, for pictures alone.")
    springs: tuple[Spring, ...] = table_key(Spring, "tables", "Springs, by the elongation or between two places.")
    dampers: tuple[Damper, ...] = table_key(Damper, "tables", "Dampers, by the rate or between two points or bodies.")
    loads: tuple[Load, ...] = table_key(Load, "tables", "Forces at points and torques on bodies.")
    joints: tuple[Joint, ...] = table_key(
        Joint,
        "tables",
        "Joints between frames, points and bodies, as constraints; or on a parent, as a frame that they carry.",
    )
    constraints: tuple[Constraint, ...] = table_key(
        Constraint, "kinds", "Equations that hold always or at times, each written as an expression that is zero."
    )
    contacts: tuple[Contact, ...] = table_key(Contact, "tables", "Unilateral contacts, by gap and slip or two places.")
    stops: tuple[Stop, ...] = table_key(Stop, "tables", "Hard limits of expressions.")
    frictions: tuple[Friction, ...] = table_key(Friction, "tables", "Dry friction along relative velocities.")
    outputs: tuple[Output, ...] = table_key(Output, "lines", "Further outputs of the FMU.")
    ports: Ports = table_key(
        Ports, "single", "Which inputs the FMU has; forces and torques at places in, their motion out.", default=Ports()
    )
    experiment: Experiment = table_key(Experiment, "single", "What a default run looks like.", default=Experiment())
    strict_units: bool = key("flag", "true: units that are missing or do not match are an error.", default=False)

    def __post_init__(self) -> None:
        normalise(self, "mechanism")
        for single, empty in (("energy", Energy()), ("ports", Ports()), ("experiment", Experiment())):
            vars(self).update({single: empty if getattr(self, single) is None else getattr(self, single)})
            require_record(getattr(self, single), type(empty), single)
        given, gravity = self.forces, self.gravity
        forces = [Force(str(q), Q) for q, Q in given.items()] if isinstance(given, Mapping) else given
        own = {**vars(self), "forces": forces}
        tables = {name: _records(own[name], name, of.part) for name, of in table_keys().items() if of.many}
        tables["coordinates"] = _with_declared(tables["coordinates"], tables["joints"], tables["inputs"])
        tables["constraints"] = in_order_of_kinds(tables["constraints"])
        vars(self).update(
            tables,
            title=self.title or str(self.name).replace("_", " ").capitalize(),
            gravity=gravity if gravity is None or isinstance(gravity, Gravity) else Gravity(gravity),
        )

    @property
    def imprint(self) -> dict[str, str]:
        """{word: text} of author, version, copyright and license, as far as given."""
        return {word: text for word in IMPRINT if (text := getattr(self, word))}

    @property
    def provenance(self) -> str:
        """The source, with what was not taken from it."""
        left_out = ", ".join(self.not_taken)
        return f"{self.source}; not taken: {left_out}".removeprefix("; ") if left_out else self.source

    @property
    def holonomic(self) -> tuple[Constraint, ...]:
        """The constraints on the coordinates; in ``constraints`` they come first."""
        return tuple(item for item in self.constraints if item.holonomic)

    @property
    def plain_inputs(self) -> tuple[Input, ...]:
        """The inputs that are no prescribed motions."""
        return tuple(item for item in self.inputs if not item.motion)

    @property
    def motions(self) -> tuple[Input, ...]:
        """The prescribed motions that come with velocity and acceleration."""
        return tuple(item for item in self.inputs if item.motion is True)

    @property
    def driven(self) -> tuple[str, ...]:
        """The names of all prescribed motions, filtered ones behind: positions may contain them."""
        return (*(item.name for item in self.motions), *self.filtered)

    @property
    def filtered(self) -> tuple[str, ...]:
        """The names of the filtered motions: of inputs as they are written, of further states in a Mechanism."""
        written = [item.name for item in self.inputs if item.motion == FILTERED]
        return (*written, *(state.name for state in self.states if state.moves == state.name))

    @property
    def unilateral_names(self) -> tuple[str, ...]:
        """The names of the ideal contacts, and of the sides of stops."""
        sides = [(stop, side) for stop in self.stops for side in ("lower", "upper")]
        ideal = [contact.name for contact in self.contacts if contact.law == "ideal"]
        return (*ideal, *(stop_side(s.name, side) for s, side in sides if getattr(s, side) is not None))

    @property
    def places(self) -> tuple[Place, ...]:
        """The bodies and points: what a spring, damper or force can be attached to."""
        return (*self.placed_bodies, *self.points)

    @property
    def placed_bodies(self) -> tuple[Body, ...]:
        """The bodies that are somewhere, without those that only turn."""
        return tuple(body for body in self.bodies if body.placed)

    @property
    def dimension(self) -> int:
        """The number of entries of positions and forces: 2 in the plane, 3 in space or where there are no positions."""
        return 3 if self.frames else next((place.dimension for place in self.places), 3)

    @property
    def output_names(self) -> dict[str, Output]:
        """{name: its output} of all names of outputs: NAME, or NAME_x ... of a quantity."""
        return {name: output for output in self.outputs for name in output.names}

    def frame(self, name: str) -> Frame:
        """The frame called ``name``; raises MechanismError if there is none ("world" is none: it does not move)."""
        return _named(self.frames, name, f"frame '{name}' in mechanism '{self.name}'")

    def location(self, name: str) -> tuple[str, Vector]:
        """Frame and position (m, in its axes) of the point or body ``name``; the frame is "world" for a fixed one.

        Of a body it is the mass centre. Raises MechanismError if there is no such point or body.
        """
        part = _named(self.places, name, f"point or body '{name}' in mechanism '{self.name}'")
        if isinstance(part, Body) and part.frame is not None:
            return str(part.frame), tuple(part.center)
        return str(part.frame or WORLD), tuple(part.position or ())

    def place(self, name: str) -> Vector:
        """The position (m) of the body or point ``name`` in the world; raises MechanismError if it is on a frame."""
        frame, position = self.location(name)
        if frame != WORLD:
            raise MechanismError(f"'{name}' is on frame '{frame}'; its position is composed along the frames")
        return position

    def entries(self) -> Iterator[Entry]:
        """Every expression of the record, in SI units, with what it belongs to."""
        for name, of in table_keys().items():
            content = getattr(self, name)
            for part in content if of.many else [] if content is None else [content]:
                label = f"{name}.{_key_of(part)}" if of.many else name
                for where, expression, known in expressions_of(part, label):
                    yield Entry(name, part, known, where, expression)

    def expressions(self) -> Iterator[tuple[str, sp.Expr]]:
        """Every expression of the record, in SI units, with its place, e.g. ('bodies.bob.position[0]', x)."""
        for entry in self.entries():
            yield entry.where, entry.expression


@cache
def table_keys() -> dict[str, TableKey]:
    """The tables of a description by name, in the order in which they stand in a text."""
    return {item.name: item.metadata["table"] for item in fields(Description) if "table" in item.metadata}


def label_of(part: Any) -> str:
    """The name under which ``part`` stands in its table; a force stands under that of its coordinate."""
    return str(part.coordinate if isinstance(part, Force) else part.name)


def _key_of(part: Any) -> str:
    """Where ``part`` stands in its table; a constraint stands in the table of its kind."""
    return f"{part.kind}.{part.name}" if isinstance(part, Constraint) else label_of(part)


Named = TypeVar("Named", Frame, Place)


def _named(parts: Iterable[Named], name: str, what: str) -> Named:
    """The part of ``parts`` called ``name``; raises MechanismError, which calls it ``what``, if there is none."""
    found = {part.name: part for part in parts}
    if name not in found:
        raise MechanismError(f"there is no {what}; {remedy_for(name, found)}")
    return found[name]


def _records(declared: Iterable[Any], name: str, kind: type) -> tuple[Any, ...]:
    """The records of the symbols or records ``declared``; raises MechanismError for a thing of another kind."""
    if not isinstance(declared, Iterable):
        raise MechanismError(f"{name}: expected a list, got {kind_and_name(declared)}; put square brackets around it")
    records = tuple(part.declaration if isinstance(part, Declared) else part for part in declared)
    for record in records:
        require_record(record, kind, name)
        if not isinstance(getattr(record, "name", ""), str):
            check_identifier(record.name, f"{name}.{record.name}")
    return records


def _with_declared(coordinates: tuple[Coordinate, ...], joints: Any, inputs: Any) -> tuple[Coordinate, ...]:
    """``coordinates`` with those that were declared together with a joint on a parent, but for prescribed motions.

    If there is one, the other coordinates of joints are written down too, so that their order is kept.
    """
    known = {q.name for q in coordinates} | {u.name for u in inputs if u.motion}
    if all(q.name in known for joint in joints for q in joint.declared):
        return coordinates
    brought = {q.name: q for joint in joints for q in joint.own_coordinates() if q.name not in known}
    return (*coordinates, *brought.values())
