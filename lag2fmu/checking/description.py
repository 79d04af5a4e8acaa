"""modelDescription.xml as records with places, tolerant of faults: what is malformed is left to the schema."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from lag2fmu.errors import LoadError
from lag2fmu.fmu.pack import DESCRIPTION
from lag2fmu.xml_tree import Document, Element, parse

KINDS = ("ModelExchange", "CoSimulation")
TYPES = ("Real", "Integer", "Boolean", "String", "Enumeration")
STRUCTURE = ("Outputs", "Derivatives", "InitialUnknowns")

_INITIAL = {
    ("parameter", "fixed"): "exact",
    ("parameter", "tunable"): "exact",
    ("output", "constant"): "exact",
    ("local", "constant"): "exact",
    ("calculatedParameter", "fixed"): "calculated",
    ("calculatedParameter", "tunable"): "calculated",
    ("output", "discrete"): "calculated",
    ("output", "continuous"): "calculated",
    ("local", "fixed"): "calculated",
    ("local", "tunable"): "calculated",
    ("local", "discrete"): "calculated",
    ("local", "continuous"): "calculated",
}
"""(causality, variability) -> the default of 'initial' (FMI 2.0.5, section 2.2.7)."""


@dataclass(frozen=True)
class ScalarVariable:
    """A ScalarVariable: ``index`` counts from 1; ``initial`` is effective, with its default; ``value`` is its type."""

    index: int
    element: Element
    value: Element
    declared: Element | None

    @property
    def name(self) -> str:
        """Its name."""
        return self.element.get("name")

    @property
    def place(self) -> str:
        """Where it stands."""
        return f"{DESCRIPTION}:{self.element.line} '{self.name}'"

    @property
    def type(self) -> str:
        """One of TYPES."""
        return self.value.tag

    @property
    def reference(self) -> int:
        """The value reference; -1 if it is malformed."""
        return whole(self.element.get("valueReference"), -1)

    @property
    def causality(self) -> str:
        """Its causality, with the default."""
        return self.element.get("causality", "local")

    @property
    def variability(self) -> str:
        """Its variability, with the default."""
        return self.element.get("variability", "continuous")

    @property
    def initial(self) -> str:
        """What 'initial' is or defaults to; '' for inputs and the independent variable.

        The defaults are those of the FMI 2.0.5 specification, section 2.2.7.
        """
        return self.element.get("initial") or _INITIAL.get((self.causality, self.variability), "")

    @property
    def start(self) -> str | None:
        """The start value as text."""
        return self.value.attributes.get("start")

    @property
    def derivative(self) -> int:
        """The index of the state it is the derivative of, or 0."""
        return whole(self.value.get("derivative"), 0)

    def attribute(self, name: str) -> str:
        """An attribute of the type, inherited from the declared type where absent; '' if neither has it."""
        inherited = self.declared.get(name) if self.declared is not None else ""
        return self.value.get(name) or inherited

    def number(self, name: str) -> float:
        """The attribute ``name`` as a number; NaN where there is none."""
        return number(self.attribute(name))


@dataclass(frozen=True)
class Unknown:
    """An entry of ModelStructure; ``dependencies`` and ``kinds`` are None where the attribute is absent."""

    group: str
    element: Element
    index: int
    dependencies: tuple[int, ...] | None
    kinds: tuple[str, ...] | None

    @property
    def place(self) -> str:
        """Where it stands."""
        return f"{DESCRIPTION}:{self.element.line} {self.group}, index {self.index}"


@dataclass(frozen=True)
class Description:
    """modelDescription.xml."""

    document: Document

    @property
    def root(self) -> Element:
        """The root element."""
        return self.document.root

    @cached_property
    def kinds(self) -> Mapping[str, Element]:
        """The declared kinds, 'ModelExchange' and 'CoSimulation', with their elements."""
        return {tag: element for tag in KINDS if (element := self.root.child(tag)) is not None}

    def can(self, kind: str, capability: str) -> bool:
        """Whether ``kind`` is declared with the flag ``capability``."""
        return kind in self.kinds and self.kinds[kind].get(capability) in ("true", "1")

    @property
    def identifiers(self) -> Mapping[str, str]:
        """Kind -> modelIdentifier."""
        return {kind: element.get("modelIdentifier") for kind, element in self.kinds.items()}

    @cached_property
    def types(self) -> Mapping[str, Element]:
        """Name -> the element in a SimpleType."""
        return {
            t.get("name"): c
            for t in self.root.all("TypeDefinitions", "SimpleType")
            for c in t.children
            if c.tag in TYPES
        }

    @cached_property
    def units(self) -> Mapping[str, Element]:
        """Name -> Unit."""
        return {unit.get("name"): unit for unit in self.root.all("UnitDefinitions", "Unit")}

    @cached_property
    def variables(self) -> tuple[ScalarVariable, ...]:
        """The variables in order; the one of index i is ``variables[i - 1]``."""
        nothing = Element("", {}, 0)
        found = []
        for index, element in enumerate(self.root.all("ModelVariables", "ScalarVariable"), start=1):
            value = next((c for c in element.children if c.tag in TYPES), nothing)
            found.append(ScalarVariable(index, element, value, self.types.get(value.get("declaredType"))))
        return tuple(found)

    def variable(self, index: int) -> ScalarVariable | None:
        """The variable of ``index``, None if there is none."""
        return self.variables[index - 1] if 1 <= index <= len(self.variables) else None

    @cached_property
    def states(self) -> frozenset[int]:
        """The indices of the continuous states: what variables with the attribute 'derivative' derive."""
        return frozenset(v.derivative for v in self.variables if v.derivative)

    def structure(self, group: str) -> list[Unknown]:
        """The entries of one of STRUCTURE."""
        return [_unknown(group, e) for e in self.root.all("ModelStructure", group, "Unknown")]

    def unknowns(self) -> Iterator[Unknown]:
        """All entries of ModelStructure."""
        for group in STRUCTURE:
            yield from self.structure(group)


def _unknown(group: str, element: Element) -> Unknown:
    dependencies, kinds = (element.attributes.get(name) for name in ("dependencies", "dependenciesKind"))
    return Unknown(
        group,
        element,
        whole(element.get("index"), 0),
        None if dependencies is None else tuple(whole(text, 0) for text in dependencies.split()),
        None if kinds is None else tuple(kinds.split()),
    )


def whole(text: str, otherwise: int) -> int:
    """``text`` as an integer, or ``otherwise``."""
    try:
        return int(text)
    except ValueError:
        return otherwise


def number(text: str) -> float:
    """``text`` as a number, NaN if it is none."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def read_description(data: bytes) -> Description:
    """modelDescription.xml from its bytes; raises LoadError if it is no XML or not of FMI 2.0."""
    document = parse(data, DESCRIPTION)
    version = document.root.get("fmiVersion")
    if document.root.tag != "fmiModelDescription":
        raise LoadError(f"'{DESCRIPTION}' begins with <{document.root.tag}>, not <fmiModelDescription>; it is no FMU")
    if not version.startswith("2."):
        raise LoadError(f"the FMU is of FMI {version or '(no fmiVersion)'}; 'check' reads FMI 2.0")
    return Description(document)
