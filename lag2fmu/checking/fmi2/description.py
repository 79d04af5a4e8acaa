"""modelDescription.xml of FMI 2.0 as records with places."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from lag2fmu.archives import DESCRIPTION
from lag2fmu.checking.description import NOTHING, FmuDescription, Variable, whole
from lag2fmu.xml_tree import XmlElement

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
class ScalarVariable2(Variable):
    """A ScalarVariable: ``index`` counts from 1."""

    index: int = 0

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
    def derivative(self) -> int:
        """The index of the state it is the derivative of, or 0."""
        return whole(self.value.get("derivative"), 0)

    @property
    def is_continuous(self) -> bool:
        """Whether it is a Real that varies in continuous time."""
        return self.type == "Real" and self.variability == "continuous"


@dataclass(frozen=True)
class Unknown2:
    """An entry of ModelStructure; ``dependencies`` and ``kinds`` are None where the attribute is absent."""

    group: str
    element: XmlElement
    index: int
    dependencies: tuple[int, ...] | None
    kinds: tuple[str, ...] | None

    @property
    def place(self) -> str:
        """Where it stands."""
        return f"{DESCRIPTION}:{self.element.line} {self.group}, index {self.index}"


@dataclass(frozen=True)
class Description2(FmuDescription):
    """modelDescription.xml of FMI 2.0."""

    token_name = "guid"

    @cached_property
    def types(self) -> Mapping[str, XmlElement]:
        """Name -> the element in a SimpleType."""
        return {
            t.get("name"): c
            for t in self.root.all("TypeDefinitions", "SimpleType")
            for c in t.children
            if c.tag in TYPES
        }

    @cached_property
    def variables(self) -> tuple[ScalarVariable2, ...]:
        """The variables in order; the one of index i is ``variables[i - 1]``."""
        found = []
        for index, element in enumerate(self.root.all("ModelVariables", "ScalarVariable"), start=1):
            value = next((c for c in element.children if c.tag in TYPES), NOTHING)
            found.append(ScalarVariable2(element, value, self.types.get(value.get("declaredType")), index=index))
        return tuple(found)

    def variable(self, index: int) -> ScalarVariable2 | None:
        """The variable of ``index``, None if there is none."""
        return self.variables[index - 1] if 1 <= index <= len(self.variables) else None

    @cached_property
    def states(self) -> frozenset[int]:
        """The indices of the continuous states: what variables with the attribute 'derivative' derive."""
        return frozenset(v.derivative for v in self.variables if v.derivative)

    def structure(self, group: str) -> list[Unknown2]:
        """The entries of one of STRUCTURE."""
        return [_unknown(group, e) for e in self.root.all("ModelStructure", group, "Unknown")]

    def unknowns(self) -> Iterator[Unknown2]:
        """All entries of ModelStructure."""
        for group in STRUCTURE:
            yield from self.structure(group)


def _unknown(group: str, element: XmlElement) -> Unknown2:
    dependencies, kinds = (element.attributes.get(name) for name in ("dependencies", "dependenciesKind"))
    return Unknown2(
        group,
        element,
        whole(element.get("index"), 0),
        None if dependencies is None else tuple(whole(text, 0) for text in dependencies.split()),
        None if kinds is None else tuple(kinds.split()),
    )
