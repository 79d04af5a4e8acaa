"""modelDescription.xml as records with places, tolerant of faults; malformed elements are left to the schema.

These records are what both versions of the standard share; each version has records derived from them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

from lag2fmu.archives import DESCRIPTION
from lag2fmu.errors import LoadError
from lag2fmu.xml_tree import Document, XmlElement, parse

NOTHING = XmlElement("", {}, 0)
"""Stands for an element that is absent."""


@dataclass(frozen=True)
class Variable:
    """A variable: ``value`` is the element that holds start and bounds, ``declared`` its type among the definitions.

    ``size`` counts its elements, 0 where that is unknown.
    """

    element: XmlElement
    value: XmlElement
    declared: XmlElement | None
    size: int = 1

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
        """Its type as the version calls it."""
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
        """Its variability, with the default of the version."""
        raise NotImplementedError

    @property
    def initial(self) -> str:
        """The attribute 'initial' or its default; '' if it has none."""
        raise NotImplementedError

    @property
    def start(self) -> str | None:
        """The start value as text."""
        return self.value.attributes.get("start")

    @property
    def starts(self) -> list[str]:
        """The start values of the elements as texts, none where there is no start."""
        return [] if self.start is None else [self.start]

    @property
    def readable(self) -> bool:
        """Whether it can be read between events."""
        return True

    @property
    def is_continuous(self) -> bool:
        """Whether it is a number that varies in continuous time."""
        raise NotImplementedError

    def attribute(self, name: str) -> str:
        """An attribute of the type, inherited from the declared type where absent; '' if neither has it."""
        inherited = self.declared.get(name) if self.declared is not None else ""
        return self.value.get(name) or inherited

    def number(self, name: str) -> float:
        """The attribute ``name`` as a number; NaN where there is none."""
        return number(self.attribute(name))


@dataclass(frozen=True)
class FmuDescription:
    """modelDescription.xml."""

    document: Document
    kinds_known: ClassVar[Sequence[str]] = ("ModelExchange", "CoSimulation")
    token_name: ClassVar[str]
    """The attribute by which library and description know each other."""

    @property
    def root(self) -> XmlElement:
        """The root element."""
        return self.document.root

    @property
    def token(self) -> str:
        """The value by which library and description know each other."""
        return self.root.get(self.token_name)

    @cached_property
    def kinds(self) -> Mapping[str, XmlElement]:
        """The declared kinds, such as 'ModelExchange', with their elements."""
        return {tag: element for tag in self.kinds_known if (element := self.root.child(tag)) is not None}

    def can(self, kind: str, capability: str) -> bool:
        """Whether ``kind`` is declared with the flag ``capability``."""
        return kind in self.kinds and self.kinds[kind].get(capability) in ("true", "1")

    @property
    def identifiers(self) -> Mapping[str, str]:
        """{kind: modelIdentifier}."""
        return {kind: element.get("modelIdentifier") for kind, element in self.kinds.items()}

    @cached_property
    def types(self) -> Mapping[str, XmlElement]:
        """{name: the element with the attributes of a declared type}."""
        raise NotImplementedError

    @cached_property
    def units(self) -> Mapping[str, XmlElement]:
        """{name: element Unit}."""
        return {unit.get("name"): unit for unit in self.root.all("UnitDefinitions", "Unit")}

    @cached_property
    def variables(self) -> Sequence[Variable]:
        """The variables in order."""
        raise NotImplementedError


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


def read_document(data: bytes) -> Document:
    """modelDescription.xml from its bytes; raises LoadError if it is no XML or describes no FMU."""
    document = parse(data, DESCRIPTION)
    if document.root.tag != "fmiModelDescription":
        raise LoadError(f"'{DESCRIPTION}' begins with <{document.root.tag}>, not <fmiModelDescription>; it is no FMU")
    return document
