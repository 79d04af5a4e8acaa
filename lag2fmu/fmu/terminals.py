"""terminalsAndIcons.xml: variables that belong together when FMUs are connected (FMI 3.0, 2.4.9; since FMI 2.0.4).

Every coordinate is a terminal like a mechanical flange: its motion is an output, and the force on it is an input. At a
connection the forces add up to zero. Where coordinates are an array, all of them are one terminal. A prescribed motion
is the counterpart: its motion is an input, and the force that carries it is an output, if the FMU has this output. The
place of a port is a terminal of all its variables.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from lag2fmu.description import names
from lag2fmu.description.outputs import QUANTITIES, TURNING
from lag2fmu.description.ports import JOINED, PLACE, bare
from lag2fmu.fmu.model_description import ModelDescription
from lag2fmu.fmu.xml_text import document
from lag2fmu.mechanism.record import Mechanism

_CONNECTED = ("input", "output")
_FORCES = ("force", "torque")
_PLACE_MEMBER = re.compile(rf"({'|'.join(sorted({*_FORCES, *QUANTITIES, *TURNING}))})(_([xyz]|[0-3]{{1,2}}))?")
"""The endings of the names of a port's variables, behind PLACE_."""


class Terminal(NamedTuple):
    """What is connected together: ``members`` {member: variable}; those in ``flows`` add up to zero.

    By the ``rule`` bus members of one name match. By that of places, JOINED, both terminals tell poses and hear forces,
    and what is between them finds the forces that keep an ideal joint closed.
    """

    name: str
    kind: str
    doc: str
    members: Mapping[str, str]
    flows: frozenset[str]
    rule: str = "bus"


def terminals(description: ModelDescription, *, icon: bool) -> bytes:
    """terminalsAndIcons/terminalsAndIcons.xml: the terminals of coordinates, prescribed motions and places.

    With ``icon`` it places the icon that stands beside it: FMI 3.0.2, section 2.4.9.2.
    """
    root = ET.Element("fmiTerminalsAndIcons", {"fmiVersion": "3.0"})
    if icon:
        square = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}
        picture = ET.SubElement(root, "GraphicalRepresentation")
        ET.SubElement(picture, "CoordinateSystem", square | {"suggestedScalingFactorTo_mm": "0.1"})
        ET.SubElement(picture, "Icon", square)
    parent = ET.SubElement(root, "Terminals")
    for terminal in terminals_of(description):
        attributes = {"matchingRule": terminal.rule, "name": terminal.name, "terminalKind": terminal.kind}
        attributes |= {"description": terminal.doc} if terminal.doc else {}
        element = ET.SubElement(parent, "Terminal", attributes)
        for member, variable in terminal.members.items():
            kind = "inflow" if member in terminal.flows else "signal"
            attributes = {"variableName": variable, "memberName": member, "variableKind": kind}
            ET.SubElement(element, "TerminalMemberVariable", attributes)
    return document(root)


def terminals_of(description: ModelDescription) -> tuple[Terminal, ...]:
    """The terminals of the FMU; only inputs and outputs are members of them."""
    m = description.mechanism
    found: list[Terminal] = []
    for terminal in (*_of_coordinates(description), *_of_motions(m), *_of_filtered(m), *_of_places(description)):
        connected = _connected(description)
        members = {member: variable for member, variable in terminal.members.items() if variable in connected}
        name = terminal.name
        while name in (other.name for other in found):
            name += "_"
        found.append(terminal._replace(name=name, members=members))
    return tuple(terminal for terminal in found if terminal.members)


def _connected(description: ModelDescription) -> list[str]:
    """The variables that can be connected by themselves, and arrays."""
    arrays = [port for port in description.ports if port.is_array]
    joined = {v.name for port in arrays for v in port.members}
    scalars = [v.name for v in description.variables if v.causality in _CONNECTED and v.name not in joined]
    return [*scalars, *(port.name for port in arrays if port.one.causality in _CONNECTED)]


def _of_coordinates(description: ModelDescription) -> Iterator[Terminal]:
    arrays = {port.name for port in description.ports if port.is_array}
    if {"q", "qd"} <= arrays:
        members = {"coordinate": "q", "velocity": "qd", "acceleration": "qdd"}
        scalars = {f"force_{c.name}": names.generalized_force(c.name) for c in description.mechanism.coordinates}
        forces = {"force": "Q"} if "Q" in arrays else scalars
        yield Terminal("coordinates", "org.lag2fmu.coordinates", "", members | forces, frozenset(forces))
        return
    for q in description.mechanism.coordinates:
        members = _motion(q.name) | {"force": names.generalized_force(q.name)}
        yield Terminal(q.name, "org.lag2fmu.coordinate", q.doc, members, frozenset({"force"}))


def _motion(name: str) -> dict[str, str]:
    return {"coordinate": name, "velocity": names.velocity(name), "acceleration": names.acceleration(name)}


def _of_motions(m: Mechanism) -> Iterator[Terminal]:
    for motion in m.motions:
        members = _motion(motion.name) | {"force": names.drive(motion.name)}
        yield Terminal(motion.name, "org.lag2fmu.coordinate", motion.doc, members, frozenset({"force"}))


def _of_filtered(m: Mechanism) -> Iterator[Terminal]:
    """Terminals of filtered motions: the target is the input; the states of the filter are no members."""
    docs = {z.name: z.doc for z in m.states}
    for name in m.filtered:
        members = {"coordinate": names.target(name), "force": names.drive(name)}
        yield Terminal(name, "org.lag2fmu.coordinate", docs[name], members, frozenset({"force"}))


def _of_places(description: ModelDescription) -> Iterator[Terminal]:
    """A terminal for each place of the ports; its members have the names of the variables without PLACE_."""
    places = dict.fromkeys(bare(spot) for spots in description.mechanism.ports.listed().values() for spot in spots)
    for place in places:
        rest = [v.name.removeprefix(f"{place}_") for v in description.variables if v.name.startswith(f"{place}_")]
        members = {member: f"{place}_{member}" for member in rest if _PLACE_MEMBER.fullmatch(member)}
        flows = frozenset(member for member in members if member.startswith(_FORCES))
        yield Terminal(f"{place}_port", PLACE, "", members, flows, JOINED)
