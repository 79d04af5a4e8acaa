"""terminalsAndIcons.xml: what belongs together when FMUs are connected (FMI 3.0, section 2.4.9; since FMI 2.0.4).

Every coordinate is a terminal, as a mechanical flange is: its motion goes out, and a force goes in that is in balance
with the forces of what is connected.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

from lag2fmu.description import names
from lag2fmu.fmu.xml_text import document
from lag2fmu.mechanism.record import Mechanism


def terminals(mechanism: Mechanism) -> bytes:
    """terminalsAndIcons/terminalsAndIcons.xml: a terminal for each coordinate, with its velocity and its force."""
    root = ET.Element("fmiTerminalsAndIcons", {"fmiVersion": "3.0"})
    parent = ET.SubElement(root, "Terminals")
    for q in mechanism.coordinates:
        attributes = {"name": q.name, "matchingRule": "bus", "terminalKind": "org.lag2fmu.coordinate"}
        terminal = ET.SubElement(parent, "Terminal", attributes | ({"description": q.doc} if q.doc else {}))
        for member, variable, kind in (
            ("coordinate", q.name, "signal"),
            ("velocity", names.velocity(q.name), "signal"),
            ("force", names.generalized_force(q.name), "inflow"),
        ):
            attributes = {"variableName": variable, "memberName": member, "variableKind": kind}
            ET.SubElement(terminal, "TerminalMemberVariable", attributes)
    return document(root)
