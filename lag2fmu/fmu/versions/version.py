"""The record ``Version``: everything in which FMUs of two versions of FMI differ; the physics is the same."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from lag2fmu.fmu.model_description import Interface, ModelDescription
from lag2fmu.fmu.platforms import Platform

CATEGORIES = {
    "logSingularLinearSystems": "states in which the mass matrix is singular",
    "logStatusWarning": "warnings",
    "logStatusDiscard": "calls that could not be done and may be repeated with other values",
    "logStatusError": "errors",
    "logAll": "everything, tolerated calls included",
}
"""The log categories of the gates in C, {name: description}."""


class Version(NamedTuple):
    """A version of FMI by its ``name``, as ``--fmi`` and the attribute fmiVersion have it.

    - ``gate``: the folder of its functions in templates/engine, and the beginning of their names.
    - ``interface``: the capabilities of its FMUs.
    - ``to_xml``: writes modelDescription.xml.
    - ``folders``: the folders of a platform in binaries/.
    - ``icon``: the name of the FMU's picture in the archive.
    - ``has_ports``: value references are those of ``ports``, and event indicators and clocks are variables.
    - ``has_adjoints``: its functions ask for adjoint derivatives.
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
