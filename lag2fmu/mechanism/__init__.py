"""The record ``Mechanism``, and the names of its parts and symbols, which the room description declares."""

from lag2fmu.description.events import Contact, Friction, State, Stop
from lag2fmu.description.joints import Joint
from lag2fmu.description.outputs import Experiment, Output
from lag2fmu.description.parts import Constraint, Damper, Definition, Energy, Force, Gravity, Load, Spring
from lag2fmu.description.places import Body, Frame, Point, Rotation
from lag2fmu.description.ports import Ports
from lag2fmu.description.subsystems import Part
from lag2fmu.description.symbols import Coordinate, Input, Parameter, coordinate, parameter, signal
from lag2fmu.description.tables import Table
from lag2fmu.language.vocabulary import Choice, Smooth
from lag2fmu.mechanism.record import Mechanism, complete

__all__ = [
    "Body",
    "Choice",
    "Constraint",
    "Contact",
    "Coordinate",
    "Damper",
    "Definition",
    "Energy",
    "Experiment",
    "Force",
    "Frame",
    "Friction",
    "Gravity",
    "Input",
    "Joint",
    "Load",
    "Mechanism",
    "Output",
    "Parameter",
    "Part",
    "Point",
    "Ports",
    "Rotation",
    "Smooth",
    "Spring",
    "State",
    "Stop",
    "Table",
    "complete",
    "coordinate",
    "parameter",
    "signal",
]
