"""modelDescription.xml of FMI 3.0 as records with places."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import prod

from lag2fmu.archives import DESCRIPTION
from lag2fmu.checking.description import FmuDescription, Variable, whole
from lag2fmu.xml_tree import XmlElement

FLOATS = frozenset({"Float32", "Float64"})
INTEGERS = ("Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64")
TYPES = (*sorted(FLOATS), *INTEGERS, "Boolean", "String", "Binary", "Enumeration", "Clock")
STRUCTURE = ("Output", "ContinuousStateDerivative", "ClockedState", "InitialUnknown", "EventIndicator")

PARAMETERS = ("parameter", "calculatedParameter", "structuralParameter")
_MOST_ELEMENTS = 1 << 24
"""Elements of an array that are counted; what has more counts as having no size."""


@dataclass(frozen=True)
class Variable3(Variable):
    """A variable of FMI 3.0: its element holds everything."""

    @property
    def variability(self) -> str:
        """Its variability, with the default of the FMI 3.0.2 specification, section 2.4.7."""
        if given := self.element.get("variability"):
            return given
        if self.causality in PARAMETERS:
            return "fixed"
        return "continuous" if self.type in FLOATS else "discrete"

    @property
    def initial(self) -> str:
        """What 'initial' is or defaults to; '' for clocks and the independent variable.

        The defaults are those of the FMI 3.0.2 specification, section 2.4.7 (table of 'initial').
        """
        if self.causality == "independent" or self.type == "Clock":
            return ""
        exact = self.causality in ("parameter", "structuralParameter", "input") or self.variability == "constant"
        return self.element.get("initial") or ("exact" if exact else "calculated")

    @property
    def starts(self) -> list[str]:
        """The start values of the elements as texts, none where there is no start."""
        if self.type in ("String", "Binary"):
            return [start.get("value") for start in self.element.all("Start")]
        return (self.start or "").split()

    @property
    def readable(self) -> bool:
        """Whether it can be read between events: it is no clock, belongs to none, and its size is known."""
        return self.type != "Clock" and "clocks" not in self.element.attributes and self.size > 0

    @property
    def is_continuous(self) -> bool:
        """Whether it is of floating point numbers that vary in continuous time."""
        return self.type in FLOATS and self.variability == "continuous"

    @property
    def dimensions(self) -> list[XmlElement]:
        """Its dimensions; none for a scalar."""
        return list(self.element.all("Dimension"))

    @property
    def clocks(self) -> list[int]:
        """The value references of the clocks that it belongs to."""
        return numbers_of(self.element.get("clocks"))

    @property
    def derivative(self) -> int | None:
        """The value reference of the variable that it is the derivative of."""
        return self._reference("derivative")

    @property
    def previous(self) -> int | None:
        """The value reference of the variable with its previous value."""
        return self._reference("previous")

    def _reference(self, name: str) -> int | None:
        text = self.element.attributes.get(name)
        return None if text is None else whole(text, -1)

    @property
    def aliases(self) -> list[XmlElement]:
        """Its other names."""
        return list(self.element.all("Alias"))


@dataclass(frozen=True)
class Unknown3:
    """An entry of ModelStructure; ``dependencies`` and ``kinds`` are None where the attribute is absent."""

    group: str
    element: XmlElement
    reference: int
    dependencies: tuple[int, ...] | None
    kinds: tuple[str, ...] | None

    @property
    def place(self) -> str:
        """Where it stands."""
        return f"{DESCRIPTION}:{self.element.line} {self.group}, value reference {self.reference}"


@dataclass(frozen=True)
class Description3(FmuDescription):
    """modelDescription.xml of FMI 3.0."""

    kinds_known = ("ModelExchange", "CoSimulation", "ScheduledExecution")
    token_name = "instantiationToken"

    @cached_property
    def type_elements(self) -> list[XmlElement]:
        """The definitions of types."""
        definitions = self.root.child("TypeDefinitions")
        return [t for t in definitions.children if t.tag.endswith("Type")] if definitions is not None else []

    @cached_property
    def types(self) -> Mapping[str, XmlElement]:
        """Name -> the definition of a type."""
        return {t.get("name"): t for t in self.type_elements}

    @cached_property
    def variables(self) -> tuple[Variable3, ...]:
        """The variables in order."""
        listed = self.root.child("ModelVariables")
        elements = [e for e in listed.children if e.tag in TYPES] if listed is not None else []
        starts = {e.get("valueReference"): whole(e.get("start"), 0) for e in elements if e.tag == "UInt64"}
        found = []
        for element in elements:
            sizes = [_length(d, starts) for d in element.all("Dimension")]
            size = prod(sizes) if all(0 < n <= _MOST_ELEMENTS for n in sizes) else 0
            declared = self.types.get(element.get("declaredType"))
            found.append(Variable3(element, element, declared, size if size <= _MOST_ELEMENTS else 0))
        return tuple(found)

    @cached_property
    def by_reference(self) -> Mapping[int, Variable3]:
        """Value reference -> variable, the first if there are several."""
        return {v.reference: v for v in reversed(self.variables)}

    @cached_property
    def names(self) -> Mapping[str, Variable3]:
        """Name of a variable or of an alias -> variable."""
        others = {alias.get("name"): v for v in self.variables for alias in v.aliases}
        return others | {v.name: v for v in self.variables}

    def structure(self, group: str) -> list[Unknown3]:
        """The entries of one of STRUCTURE."""
        return [_unknown(group, e) for e in self.root.all("ModelStructure", group)]

    def unknowns(self) -> Iterator[Unknown3]:
        """All entries of ModelStructure."""
        for group in STRUCTURE:
            yield from self.structure(group)

    def listed(self, group: str) -> list[Variable3]:
        """The variables in one of STRUCTURE, in its order."""
        found = (self.by_reference.get(u.reference) for u in self.structure(group))
        return [v for v in found if v is not None]

    @cached_property
    def states(self) -> tuple[int, ...]:
        """The value references of the continuous states, in the order of ModelStructure."""
        derivatives = self.listed("ContinuousStateDerivative")
        return tuple(v.derivative for v in derivatives if v.derivative is not None)


def _length(dimension: XmlElement, starts: Mapping[str, int]) -> int:
    """The number of elements along a dimension; 0 where that is unknown."""
    return whole(dimension.get("start", "x"), starts.get(dimension.get("valueReference"), 0))


def _unknown(group: str, element: XmlElement) -> Unknown3:
    dependencies, kinds = (element.attributes.get(name) for name in ("dependencies", "dependenciesKind"))
    return Unknown3(
        group,
        element,
        whole(element.get("valueReference"), -1),
        None if dependencies is None else tuple(numbers_of(dependencies)),
        None if kinds is None else tuple(kinds.split()),
    )


def numbers_of(text: str) -> list[int]:
    """The whole numbers in a list; -1 for what is none."""
    return [whole(part, -1) for part in text.split()]
