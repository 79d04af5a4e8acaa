"""The record of a variable of the FMU, and what collects them with their value references."""

from __future__ import annotations

from dataclasses import dataclass, replace

from lag2fmu.codegen import Slot
from lag2fmu.language.units import Unit


@dataclass(frozen=True)
class Variable:
    """One ScalarVariable; ``start`` and bounds in SI units; ``dependencies`` by name, None if unlisted.

    ``derivative_of`` names the state a variable is the derivative of; ``state`` marks the continuous states. ``type``
    is Real, Integer or the name of an enumeration among ENUMERATIONS.
    """

    name: str
    value_reference: int
    causality: str
    variability: str
    initial: str | None = None
    start: float | None = None
    unit: Unit | None = None
    doc: str = ""
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None
    derivative_of: str | None = None
    state: bool = False
    dependencies: tuple[str, ...] | None = None
    type: str = "Real"


class Builder:
    """Collects slots (value references) and variables (names for them)."""

    def __init__(self) -> None:
        """Start without any."""
        self.slots: list[Slot] = []
        self.variables: list[Variable] = []

    def add(self, variable: Variable, kind: str, index: int) -> None:
        """A variable with a value reference of its own."""
        self.variables.append(replace(variable, value_reference=len(self.slots)))
        output = variable.causality == "output"
        self.slots.append(Slot(variable.name, kind, index, variable.minimum, variable.maximum, output))

    def reference(self, name: str) -> int:
        """The value reference of the variable called ``name``; raises StopIteration."""
        return next(i for i, slot in enumerate(self.slots) if slot.name == name)
