"""The record ``Mechanism``: what the textbook procedure asks for, as data. Its parts are in ``symbols`` and ``parts``.

Numbers of coordinates, parameters and inputs are kept in SI; the unit says how they are shown.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TypeVar

import sympy as sp

from lag2fmu.errors import MechanismError
from lag2fmu.mechanism.check import check
from lag2fmu.mechanism.joint_equations import written_out
from lag2fmu.mechanism.joints import Joint, joined
from lag2fmu.mechanism.loads import with_inputs
from lag2fmu.mechanism.names import check_names, suggestion
from lag2fmu.mechanism.norms import missing_norms
from lag2fmu.mechanism.outputs import Experiment, Output
from lag2fmu.mechanism.parts import KINDS, Constraint, Damper, Definition, Energy, Force, Gravity, Load, Spring
from lag2fmu.mechanism.places import (
    AXES,
    WORLD,
    Body,
    Expression,
    Frame,
    Place,
    Point,
    Rotation,
    Vector,
    expressions_of,
)
from lag2fmu.mechanism.scope import constrained
from lag2fmu.mechanism.symbols import Coordinate, Declared, Input, Parameter, coordinate, parameter, signal

__all__ = [
    "AXES",
    "WORLD",
    "Body",
    "Constraint",
    "Coordinate",
    "Damper",
    "Declared",
    "Definition",
    "Energy",
    "Experiment",
    "Expression",
    "Force",
    "Frame",
    "Gravity",
    "Input",
    "Joint",
    "Load",
    "Mechanism",
    "Output",
    "Parameter",
    "Place",
    "Point",
    "Rotation",
    "Spring",
    "Vector",
    "coordinate",
    "parameter",
    "signal",
]


@dataclass(frozen=True, init=False)
class Mechanism:
    """A mechanism as analytical mechanics describes it; complete and checked when built.

    Built in Python from symbols that ``coordinate``, ``parameter`` and ``signal`` declare, or read from text by
    ``lag2fmu.load``. There are n coordinates and m constraints, the holonomic ones first; expressions compute in SI
    units. Raises MechanismError (UnitError for dimensions when ``strict_units``), naming part and remedy. ``warnings``
    lists what was let pass: mismatching dimensions, inertia tensors that no body has. Source of the procedure: Hand,
    Finch, Analytical Mechanics, section 1.9.
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
    frames: tuple[Frame, ...]
    bodies: tuple[Body, ...]
    points: tuple[Point, ...]
    springs: tuple[Spring, ...]
    dampers: tuple[Damper, ...]
    loads: tuple[Load, ...]
    joints: tuple[Joint, ...]
    constraints: tuple[Constraint, ...]
    outputs: tuple[Output, ...]
    experiment: Experiment
    strict_units: bool
    warnings: tuple[str, ...] = field(default=(), init=False, compare=False, repr=False)

    def __repr__(self) -> str:
        """One line: name, title, how many of what; the text format says everything."""
        kinds = ("coordinates", "parameters", "inputs", "bodies", "constraints")
        counted = ", ".join(f"{len(getattr(self, kind))} {kind}" for kind in kinds if getattr(self, kind))
        return f"<Mechanism {self.name}: {self.title}; {counted}>"

    def _repr_html_(self) -> str:
        """Coordinates, parameters and inputs, for a notebook."""
        from html import escape

        rows = "".join(
            f"<tr><td>{item.name}</td><td>{kind}</td><td>{item.unit.si_name if item.unit else ''}</td>"
            f"<td>{escape(item.doc)}</td></tr>"
            for kind in ("coordinate", "parameter", "input")
            for item in getattr(self, f"{kind}s")
        )
        return f"<p>{escape(repr(self)[1:-1])}</p><table>{rows}</table>"

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
        frames: Iterable[Frame] = (),
        bodies: Iterable[Body] = (),
        points: Iterable[Point] = (),
        springs: Iterable[Spring] = (),
        dampers: Iterable[Damper] = (),
        loads: Iterable[Load] = (),
        joints: Iterable[Joint] = (),
        constraints: Iterable[Constraint] = (),
        outputs: Iterable[Output] = (),
        experiment: Experiment | None = None,
        strict_units: bool = False,
    ) -> None:
        """The keywords are the tables of a .toml file, of which ``lag2fmu new`` writes an example; see the class."""
        bodies, points, joints = tuple(bodies), tuple(points), tuple(joints)
        places: dict[str, Place] = {part.name: part for part in (*bodies, *points)}
        loads, load_inputs = with_inputs(loads, places)
        self._hold(
            name=name,
            title=title or str(name).replace("_", " ").capitalize(),
            source=source,
            coordinates=_with_joints(_records(coordinates, Coordinate, "coordinates"), joints),
            parameters=_records(parameters, Parameter, "parameters"),
            inputs=(*_records(inputs, Input, "inputs"), *load_inputs),
            definitions=tuple(definitions),
            energy=energy or Energy(),
            forces=_forces(forces),
            gravity=gravity if gravity is None or isinstance(gravity, Gravity) else Gravity(gravity),
            frames=joined(frames, (joint.frame for joint in joints if joint.parent is not None), "frames"),
            bodies=bodies,
            points=points,
            springs=tuple(springs),
            dampers=tuple(dampers),
            loads=loads,
            joints=joints,
            constraints=_in_kinds(constraints),
            outputs=_sized(outputs, places),
            experiment=experiment or Experiment(),
            strict_units=strict_units,
        )
        self._complete()

    def _hold(self, **values: object) -> None:
        """Set fields of the frozen record while it is built."""
        for key, value in values.items():
            object.__setattr__(self, key, value)

    def _complete(self) -> None:
        """Add what joints and quaternions bring, check everything, decide which starts are guesses.

        Norms are looked for among the constraints of the joints too, but stand before them.
        """
        own = self.constraints
        brought, reactions = written_out(self)
        self._hold(constraints=_in_kinds(joined(own, brought, "constraints")))
        self._hold(outputs=joined(self.outputs, reactions, "outputs"))
        self._hold(warnings=check(self))
        own = (*own, *missing_norms(self))
        self._hold(constraints=_in_kinds(joined(own, brought, "constraints")))
        self._hold(coordinates=self._decided())
        check_names(self)

    def _decided(self) -> tuple[Coordinate, ...]:
        """The coordinates; starts that nobody gave are guesses where a constraint may determine them."""
        q_bound, qd_bound = constrained(self)
        return tuple(
            replace(
                q,
                given=False if q.given is None and q.name in q_bound else q.given,
                velocity_given=False if q.velocity_given is None and q.name in qd_bound else q.velocity_given,
            )
            for q in self.coordinates
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
        for table in fields(self):
            content = getattr(self, table.name)
            for part in content if isinstance(content, tuple) else (content,):
                label = getattr(part, "name", getattr(part, "coordinate", ""))
                yield from expressions_of(part, f"{table.name}.{label}" if label else table.name)


def _in_kinds(constraints: Iterable[Constraint]) -> tuple[Constraint, ...]:
    """The holonomic ones first."""
    return tuple(sorted(constraints, key=lambda item: KINDS.index(item.kind)))


def _forces(given: Iterable[Force] | Mapping[sp.Symbol, Expression]) -> tuple[Force, ...]:
    """The records of {coordinate: Q}, or as they are."""
    return tuple(Force(str(q), Q) for q, Q in given.items()) if isinstance(given, Mapping) else tuple(given)


def _sized(outputs: Iterable[Output], places: Mapping[str, Place]) -> tuple[Output, ...]:
    """``outputs`` with the number of entries of the place that each shows; 3 where it shows none."""
    of = {name: place.dimension for name, place in places.items()}
    return tuple(replace(output, dimension=of.get(str(output.point), 3)) for output in outputs)


Record = TypeVar("Record", Coordinate, Parameter, Input)
Part = TypeVar("Part", Frame, Place)


def _named(parts: Iterable[Part], name: str, what: str) -> Part:
    """The one of ``parts`` called ``name``; raises MechanismError that there is no ``what``."""
    found = {part.name: part for part in parts}
    if name not in found:
        raise MechanismError(f"there is no {what}; {suggestion(name, found)}")
    return found[name]


def _records(declared: Iterable[Declared | Record], kind: type[Record], table: str) -> tuple[Record, ...]:
    """The records of the symbols or records ``declared``; raises MechanismError for a thing of another kind."""
    records: list[Record] = []
    for item in declared:
        record = item.declaration if isinstance(item, Declared) else item
        if not isinstance(record, kind):
            raise MechanismError(f"{table}: expected a {kind.__name__.lower()}, got {type(record).__name__} '{record}'")
        records.append(record)
    return tuple(records)


def _with_joints(coordinates: tuple[Coordinate, ...], joints: Iterable[Joint]) -> tuple[Coordinate, ...]:
    """``coordinates`` and those of the joints on a parent that are not among them."""
    known = {q.name: q for q in coordinates}
    brought = {q.name: q for joint in joints for q in joint.own_coordinates() if q.name not in known}
    return (*coordinates, *brought.values())
