"""The keywords of the constructor ``Mechanism``, for type checkers and editors; each is a table of a description."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, TypedDict

from lag2fmu.description.events import Contact, Friction, State, Stop
from lag2fmu.description.joints import Joint
from lag2fmu.description.outputs import Experiment, Output
from lag2fmu.description.parts import Constraint, Damper, Definition, Energy, Force, Gravity, Load, Spring
from lag2fmu.description.places import Body, Expression, Frame, Point
from lag2fmu.description.ports import Ports
from lag2fmu.description.subsystems import Part
from lag2fmu.description.symbols import Coordinate, Declared, Input, Parameter
from lag2fmu.description.tables import Table
from lag2fmu.description.visuals import Visual


class Keywords(TypedDict, total=False):
    """What ``Mechanism`` takes beside the name; ``Description`` says what each table holds.

    Symbols that ``coordinate``, ``parameter`` and ``signal`` return stand for the records that they declare. The keys
    of ``forces`` are coordinates or their names.
    """

    title: str
    source: str
    not_taken: Iterable[str]
    author: str
    version: str
    copyright: str
    license: str
    impacts: str
    parts: Iterable[Part]
    parameters: Iterable[Parameter | Declared]
    coordinates: Iterable[Coordinate | Declared]
    inputs: Iterable[Input | Declared]
    states: Iterable[State]
    tables: Iterable[Table]
    definitions: Iterable[Definition]
    energy: Energy | None
    forces: Iterable[Force] | Mapping[Any, Expression]
    gravity: Gravity | Expression | None
    frames: Iterable[Frame]
    bodies: Iterable[Body]
    points: Iterable[Point]
    visuals: Iterable[Visual]
    springs: Iterable[Spring]
    dampers: Iterable[Damper]
    loads: Iterable[Load]
    joints: Iterable[Joint]
    constraints: Iterable[Constraint]
    contacts: Iterable[Contact]
    stops: Iterable[Stop]
    frictions: Iterable[Friction]
    outputs: Iterable[Output]
    ports: Ports | None
    experiment: Experiment | None
    strict_units: bool
