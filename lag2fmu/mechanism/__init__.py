"""What a user writes: the record ``Mechanism``, its parts, and the symbols that declare them."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lag2fmu.mechanism.record import (
        Body,
        Constraint,
        Coordinate,
        Damper,
        Definition,
        Energy,
        Experiment,
        Force,
        Frame,
        Gravity,
        Input,
        Joint,
        Load,
        Mechanism,
        Output,
        Parameter,
        Point,
        Rotation,
        Spring,
        coordinate,
        parameter,
        signal,
    )

__all__ = [
    "Body",
    "Constraint",
    "Coordinate",
    "Damper",
    "Definition",
    "Energy",
    "Experiment",
    "Force",
    "Frame",
    "Gravity",
    "Input",
    "Joint",
    "Load",
    "Mechanism",
    "Output",
    "Parameter",
    "Point",
    "Rotation",
    "Spring",
    "coordinate",
    "parameter",
    "signal",
]


def __getattr__(name: str) -> object:
    """Import the record where one of its names is first used: listing models needs no SymPy."""
    if name not in __all__:
        raise AttributeError(f"module 'lag2fmu.mechanism' has no attribute '{name}'")
    return getattr(import_module("lag2fmu.mechanism.record"), name)


def __dir__() -> list[str]:
    return list(__all__)
