"""terminalsAndIcons.xml: what belongs together when FMUs are connected (FMI 3.0, section 2.4.9; since FMI 2.0.4).

Every coordinate is a terminal, as a mechanical flange is: its motion goes out, and a force goes in that is in balance
with the forces of what is connected. Where coordinates are an array, all of them are one terminal.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping

from lag2fmu.description import names
from lag2fmu.fmu.model_description import ModelDescription
from lag2fmu.fmu.xml_text import document


def terminals(description: ModelDescription, *, icon: bool) -> bytes:
    """terminalsAndIcons/terminalsAndIcons.xml: a terminal for each coordinate, with its velocity and its force.

    With ``icon`` it places the icon that stands beside it: FMI 3.0.2, section 2.4.9.2.
    """
    root = ET.Element("fmiTerminalsAndIcons", {"fmiVersion": "3.0"})
    if icon:
        square = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}
        picture = ET.SubElement(root, "GraphicalRepresentation")
        ET.SubElement(picture, "CoordinateSystem", square | {"suggestedScalingFactorTo_mm": "0.1"})
        ET.SubElement(picture, "Icon", square)
    parent = ET.SubElement(root, "Terminals")
    arrays = {port.name for port in description.ports if port.is_array}
    joined = {v.name for port in description.ports if port.is_array for v in port.members}
    scalars = {v.name for v in description.variables} - joined
    if {"q", "qd"} <= arrays:
        force = ("Q",) if "Q" in arrays else ()
        _terminal(parent, {"name": "coordinates", "terminalKind": "org.lag2fmu.coordinates"}, ("q", "qd", *force))
        return document(root)
    for q in description.mechanism.coordinates:
        force = (names.generalized_force(q.name),) if names.generalized_force(q.name) in scalars else ()
        attributes = {"name": q.name, "terminalKind": "org.lag2fmu.coordinate"}
        attributes |= {"description": q.doc} if q.doc else {}
        _terminal(parent, attributes, (q.name, names.velocity(q.name), *force))
    return document(root)


def _terminal(parent: ET.Element, attributes: Mapping[str, str], variables: Iterable[str]) -> None:
    """A terminal of a coordinate, its velocity and, where it is a variable by itself, its force."""
    terminal = ET.SubElement(parent, "Terminal", {"matchingRule": "bus", **attributes})
    members = (("coordinate", "signal"), ("velocity", "signal"), ("force", "inflow"))
    for (member, kind), variable in zip(members, variables, strict=False):
        member_attributes = {"variableName": variable, "memberName": member, "variableKind": kind}
        ET.SubElement(terminal, "TerminalMemberVariable", member_attributes)
