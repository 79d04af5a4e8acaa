"""Rules on terminalsAndIcons/terminalsAndIcons.xml (FMI 3.0.2, section 2.4.9)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from posixpath import normpath

from lag2fmu.checking.archive import Archive
from lag2fmu.checking.description import number
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.fmi3.description import Description3
from lag2fmu.errors import LoadError
from lag2fmu.xml_tree import XmlElement, parse

_FOLDER = "terminalsAndIcons"
_NAME = f"{_FOLDER}/terminalsAndIcons.xml"
_MATCHING = {"plug", "bus", "sequence", "none"}
_FLOWS = {"inflow", "outflow"}
_CONNECTED = ("input", "output", "parameter", "calculatedParameter")


def terminal_findings(archive: Archive, description: Description3) -> Iterator[Finding]:
    """The broken rules on terminals, icons and how they are drawn.

    Source: FMI 3.0.2 specification, section 2.4.9 (terminals and icons).
    """
    if _NAME not in archive.files:
        return
    try:
        root = parse(archive.read(_NAME), _NAME).root
    except LoadError:  # said by the rule on XML in general
        return
    if root.tag != "fmiTerminalsAndIcons":
        yield Finding("terminals-root", _at(root), f"begins with <{root.tag}>", "begin with <fmiTerminalsAndIcons>")
        return
    own = description.root.get("fmiVersion")
    if root.get("fmiVersion") != own:
        problem = f"fmiVersion='{root.get('fmiVersion')}', but modelDescription.xml says '{own}'"
        yield Finding("terminals-version", _at(root), problem, "write the same in both")
    yield from _pictures(root, archive)
    yield from _siblings(list(root.all("Terminals", "Terminal")), description)


def _at(element: XmlElement) -> str:
    name = element.get("name")
    return f"{_NAME}:{element.line} <{element.tag}>{f' {name!r}' if name else ''}"


def _pictures(root: XmlElement, archive: Archive) -> Iterator[Finding]:
    for system in root.all("GraphicalRepresentation", "CoordinateSystem"):
        x1, y1, x2, y2 = (number(system.get(name)) for name in ("x1", "y1", "x2", "y2"))
        if x1 >= x2 or y1 >= y2:
            problem = "its first corner is not the lower left one"
            yield Finding("coordinate-system", _at(system), problem, "write x1 < x2 and y1 < y2")
    for icon in root.all("GraphicalRepresentation", "Icon"):
        if f"{_FOLDER}/icon.png" not in archive.files:
            yield Finding("icon-missing", _at(icon), f"there is no {_FOLDER}/icon.png", "add it or remove the element")
    for element in root.walk():
        if element.tag == "TerminalGraphicalRepresentation":
            file = normpath(f"{_FOLDER}/{element.get('iconBaseName')}.png")
            if file not in archive.files:
                yield Finding("icon-missing", _at(element), f"there is no {file}", "add the picture of the terminal")


def _siblings(terminals: list[XmlElement], description: Description3) -> Iterator[Finding]:
    """Terminals of one level, and those in them."""
    counts = Counter(t.get("name") for t in terminals)
    for name in (name for name, count in counts.items() if count > 1):
        place = _at(next(t for t in terminals if t.get("name") == name))
        yield Finding("terminal-duplicate", place, f"the terminal '{name}' is defined twice", "rename one")
    for terminal in terminals:
        yield from _terminal(terminal, description)
        yield from _siblings(list(terminal.all("Terminal")), description)


def _terminal(terminal: XmlElement, description: Description3) -> Iterator[Finding]:
    rule = terminal.get("matchingRule")
    if rule not in _MATCHING and "." not in rule:
        problem = f"matchingRule='{rule}' is neither predefined nor a reverse domain"
        yield Finding("terminal-rule", _at(terminal), problem, f"use one of {', '.join(sorted(_MATCHING))}")
    members = list(terminal.all("TerminalMemberVariable"))
    for member in members:
        yield from _member(member, description)
    if rule in ("plug", "bus"):
        yield from _member_names(terminal, members)
    streams = list(terminal.all("TerminalStreamMemberVariable"))
    for stream in streams:
        yield from _stream(stream, description)
    if streams and sum(m.get("variableKind") in _FLOWS for m in members) != 1:
        problem = "a stream without exactly one member that is inflow or outflow"
        yield Finding("terminal-stream", _at(terminal), problem, "give the terminal one flow")


def _member_names(terminal: XmlElement, members: list[XmlElement]) -> Iterator[Finding]:
    """Names by which the members of a plug or a bus are matched."""
    names = Counter(m.get("memberName") for m in members)
    for member in (m for m in members if not m.get("memberName")):
        problem = f"no memberName, which matchingRule='{terminal.get('matchingRule')}' asks for"
        yield Finding("terminal-member-name", _at(member), problem, "name the member")
    for name in (n for n, count in names.items() if n and count > 1):
        yield Finding("terminal-member-name", _at(terminal), f"two members are named '{name}'", "rename one")


def _member(member: XmlElement, description: Description3) -> Iterator[Finding]:
    name, kind = member.get("variableName"), member.get("variableKind")
    variable = description.names.get(name)
    if variable is None:
        problem = f"variableName='{name}' is the name of no variable"
        yield Finding("terminal-variable", _at(member), problem, "name a variable or an alias")
    elif kind in _FLOWS | {"signal"} and variable.causality not in _CONNECTED:
        problem = f"'{name}' is a {variable.causality} variable, which cannot be connected"
        yield Finding("terminal-causality", _at(member), problem, "connect inputs, outputs and parameters")
    if kind not in _FLOWS | {"signal"} and "." not in kind:
        problem = f"variableKind='{kind}' is neither predefined nor a reverse domain"
        yield Finding("terminal-kind", _at(member), problem, "use signal, inflow or outflow", "warning")


def _stream(stream: XmlElement, description: Description3) -> Iterator[Finding]:
    """Inward and outward variable of a stream: both exist, with as many elements."""
    found = {}
    for end, causalities in (("in", ("input", "parameter")), ("out", ("output", "calculatedParameter"))):
        name = stream.get(f"{end}StreamVariableName")
        found[end] = variable = description.names.get(name)
        if variable is None:
            problem = f"{end}StreamVariableName='{name}' is the name of no variable"
            yield Finding("terminal-variable", _at(stream), problem, "name a variable or an alias")
        elif variable.causality not in causalities:
            problem = f"'{name}' is a {variable.causality} variable, not {' or '.join(causalities)}"
            yield Finding("terminal-causality", _at(stream), problem, "name the variable of the right direction")
    if found["in"] is not None and found["out"] is not None and found["in"].size != found["out"].size:
        problem = f"has {found['in'].size} elements inward and {found['out'].size} outward"
        yield Finding("terminal-stream", _at(stream), problem, "give both the same dimensions")
