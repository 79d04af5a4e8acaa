"""The units in which users give and see the variables of a system."""

from __future__ import annotations

from lag2fmu.errors import ExportError, TextError
from lag2fmu.fmu.contents import read_mechanism
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import display_units
from lag2fmu.systems.network import Network


def units_of_network(network: Network) -> dict[str, Unit]:
    """{COMPONENT.VARIABLE: unit that the user declared} of the FMUs of a system that contain their mechanism."""
    found: dict[str, Unit] = {}
    for name, component in network.components.items():
        if component.controller is None:
            try:
                mechanism = read_mechanism(component.path)
            except (ExportError, TextError):  # an FMU of another tool, or a text that this version cannot read
                continue
            found |= {f"{name}.{variable}": unit for variable, unit in display_units(mechanism).items()}
    return found
