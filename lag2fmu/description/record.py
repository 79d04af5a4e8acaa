"""The record ``Description``: what is written about a mechanism, table by table, and nothing else.

Numbers of coordinates, parameters and inputs are kept in SI; the unit says how they are shown.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import KW_ONLY, Field, dataclass, field, fields
from typing import Any, TypeVar

import sympy as sp

from lag2fmu.description.joints import Joint
from lag2fmu.description.names import suggestion
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
from lag2fmu.description.places import WORLD, Body, Frame, Place, Point, Vector, expressions_of
from lag2fmu.description.symbols import Coordinate, Declared, Input, Parameter
from lag2fmu.errors import MechanismError


def table(part: type) -> Any:
    """The field of a table that holds any number of parts of the kind ``part``."""
    return field(default=(), metadata={"part": part})


@dataclass(frozen=True)
class Description:
    """What is written about a mechanism; the text format is its lossless serialisation.

    The keywords are the tables of a .toml file, of which ``lag2fmu new`` writes an example. Tables of parts take any
    iterable, coordinates, parameters and inputs the symbols that declare them too, ``forces`` a mapping {coordinate: Q}
    and ``gravity`` an acceleration (m/s2). Constraints stand in the order of their kinds, the holonomic ones first.
    Raises MechanismError for a part that belongs to another table; ``Mechanism`` checks everything else.
    """

    name: str
    _: KW_ONLY
    title: str = ""
    source: str = ""
    parameters: tuple[Parameter, ...] = table(Parameter)
    coordinates: tuple[Coordinate, ...] = table(Coordinate)
    inputs: tuple[Input, ...] = table(Input)
    definitions: tuple[Definition, ...] = table(Definition)
    energy: Energy = Energy()  # noqa: RUF009 (frozen)
    forces: tuple[Force, ...] = table(Force)
    gravity: Gravity | None = None
    frames: tuple[Frame, ...] = table(Frame)
    bodies: tuple[Body, ...] = table(Body)
    points: tuple[Point, ...] = table(Point)
    springs: tuple[Spring, ...] = table(Spring)
    dampers: tuple[Damper, ...] = table(Damper)
    loads: tuple[Load, ...] = table(Load)
    joints: tuple[Joint, ...] = table(Joint)
    constraints: tuple[Constraint, ...] = table(Constraint)
    outputs: tuple[Output, ...] = table(Output)
    experiment: Experiment = Experiment()  # noqa: RUF009 (frozen)
    strict_units: bool = False

    def __post_init__(self) -> None:
        given, gravity = self.forces, self.gravity
        forces = [Force(str(q), Q) for q, Q in given.items()] if isinstance(given, Mapping) else given
        own = {**vars(self), "forces": forces}
        parts = {item.name: _records(own[item.name], item) for item in fields(Description) if "part" in item.metadata}
        parts["coordinates"] = _with_declared(parts["coordinates"], parts["joints"])
        parts["constraints"] = in_order_of_kinds(parts["constraints"])
        vars(self).update(
            parts,
            title=self.title or str(self.name).replace("_", " ").capitalize(),
            energy=self.energy or Energy(),
            gravity=gravity if gravity is None or isinstance(gravity, Gravity) else Gravity(gravity),
            experiment=self.experiment or Experiment(),
        )

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
        """The prescribed motions."""
        return tuple(item for item in self.inputs if item.motion)

    @property
    def places(self) -> tuple[Place, ...]:
        """The bodies and points: what a spring, damper or force can be attached to."""
        return (*self.bodies, *self.points)

    @property
    def dimension(self) -> int:
        """The number of entries of positions and forces: 2 in the plane, 3 in space or where there are no positions."""
        return 3 if self.frames else next((place.dimension for place in self.places), 3)

    @property
    def output_names(self) -> dict[str, Output]:
        """Every name that the outputs bring (NAME, or NAME_x ... of a quantity) -> its output, with unit and doc."""
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
        """The position (m) in the fixed frame of the point or body ``name``.

        Raises MechanismError if there is none, or if it is on a frame: ``location`` says where, and composing frames
        is left to those who compute with them.
        """
        frame, position = self.location(name)
        if frame != WORLD:
            raise MechanismError(f"'{name}' is on frame '{frame}'; its position is composed along the frames")
        return position

    def expressions(self) -> Iterator[tuple[str, sp.Expr]]:
        """Every expression of the record, in SI units, with its place, e.g. ('bodies.bob.position[0]', x)."""
        for item in fields(Description):
            content = getattr(self, item.name)
            for part in content if isinstance(content, tuple) else (content,):
                label = getattr(part, "name", getattr(part, "coordinate", ""))
                yield from expressions_of(part, f"{item.name}.{label}" if label else item.name)


Part = TypeVar("Part", Frame, Place)


def _named(parts: Iterable[Part], name: str, what: str) -> Part:
    """The one of ``parts`` called ``name``; raises MechanismError that there is no ``what``."""
    found = {part.name: part for part in parts}
    if name not in found:
        raise MechanismError(f"there is no {what}; {suggestion(name, found)}")
    return found[name]


def _records(declared: Iterable[Any], item: Field[Any]) -> tuple[Any, ...]:
    """The records of the symbols or records ``declared`` for the table ``item``; raises MechanismError for others."""
    kind: type = item.metadata["part"]
    records = tuple(part.declaration if isinstance(part, Declared) else part for part in declared)
    for record in records:
        if not isinstance(record, kind):
            expected, found = kind.__name__.lower(), type(record).__name__
            article = "an" if expected[0] in "aeiou" else "a"
            raise MechanismError(f"{item.name}: expected {article} {expected}, got {found} '{record}'")
    return records


def _with_declared(coordinates: tuple[Coordinate, ...], joints: Iterable[Joint]) -> tuple[Coordinate, ...]:
    """``coordinates`` with those that were declared together with a joint on a parent.

    Where there is one, the other coordinates of joints are written down too, so that their order is kept.
    """
    known = {q.name for q in coordinates}
    if all(q.name in known for joint in joints for q in joint.declared):
        return coordinates
    brought = {q.name: q for joint in joints for q in joint.own_coordinates() if q.name not in known}
    return (*coordinates, *brought.values())
