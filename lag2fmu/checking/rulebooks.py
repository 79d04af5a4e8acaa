"""The rulebooks of all versions."""

from __future__ import annotations

from lag2fmu.checking.fmi2.rulebook import FMI2
from lag2fmu.checking.fmi3.rulebook import FMI3
from lag2fmu.checking.rulebook import Rulebook
from lag2fmu.checking.versions import version_of
from lag2fmu.xml_tree import Document

RULEBOOKS: dict[str, Rulebook] = {"2": FMI2, "3": FMI3}
"""{major version: its rules}."""


def rulebook_of(document: Document) -> Rulebook:
    """The rules for the version that modelDescription.xml names; raises LoadError if that is no known one."""
    return RULEBOOKS[version_of(document)]
