"""The record ``Version``: what tells FMUs of one version of FMI from those of another; the physics is the same."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from lag2fmu.fmu.compilers import Platform
from lag2fmu.fmu.model_description import Interface, ModelDescription

CATEGORIES = {
    "logSingularLinearSystems": "states in which the mass matrix is singular",
    "logStatusWarning": "warnings",
    "logStatusDiscard": "calls that could not be done and may be repeated with other values",
    "logStatusError": "errors",
    "logAll": "everything, tolerated calls included",
}
"""The log categories of the gates in C, {name: description}."""


@dataclass(frozen=True)
class Version:
    """A version of FMI by its ``name``, as ``--fmi`` and the attribute fmiVersion have it.

    ``gate`` is the folder of its functions in templates/runtime, and what their names begin with. ``interface`` says
    what its FMUs offer, ``to_xml`` writes modelDescription.xml, ``folders`` are those of a platform in binaries/.
    ``icon`` is where the FMU's picture stands in the archive. ``has_ports``: value references are those of ``ports``,
    and event indicators and clocks are variables.
    ``has_adjoints``: its functions ask for adjoint derivatives.
    """

    name: str
    gate: str
    interface: Interface
    to_xml: Callable[[ModelDescription], bytes]
    folders: Callable[[Platform], tuple[str, ...]]
    icon: str
    has_ports: bool = False
    has_adjoints: bool = False

    @property
    def header(self) -> str:
        """The header that declares the functions of the standard."""
        return f"{self.gate}Functions.h"
