"""The collection of the variables of an FMU with their value references."""

from __future__ import annotations

from dataclasses import dataclass

from lag2fmu.codegen.tables import RuntimeTables, Slot
from lag2fmu.fmu.scalar_variable import ScalarVariable


class Builder:
    """Collects slots (value references) and variables (names for them)."""

    def __init__(self) -> None:
        """Start without slots and variables."""
        self.slots: list[Slot] = []
        self.variables: list[ScalarVariable] = []

    def add(self, variable: ScalarVariable, kind: str, index: int) -> None:
        """Add ``variable`` with a value reference of its own: the slot of this ``kind`` and ``index`` in C."""
        self.variables.append(variable._replace(value_reference=len(self.slots)))
        output = variable.causality == "output"
        self.slots.append(Slot(variable.name, kind, index, variable.minimum, variable.maximum, output))

    def reference(self, name: str) -> int:
        """The value reference of the variable called ``name``; raises StopIteration."""
        return next(i for i, slot in enumerate(self.slots) if slot.name == name)


@dataclass(frozen=True)
class VariableTable:
    """All variables in the order of modelDescription.xml, and what C needs of them."""

    variables: tuple[ScalarVariable, ...]
    tables: RuntimeTables

    def __getitem__(self, name: str) -> ScalarVariable:
        """The variable called ``name``; raises KeyError."""
        return next(v for v in self.variables if v.name == name)
