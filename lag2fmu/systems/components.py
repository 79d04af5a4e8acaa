"""An FMU, of any tool, as the component of a system: its connectors with units, its terminals, its experiment."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from lag2fmu.archives import DESCRIPTION, opened
from lag2fmu.checking.description import FmuDescription, Variable, number, read_document
from lag2fmu.checking.versions import described
from lag2fmu.errors import LoadError
from lag2fmu.language.units import BASE_UNITS
from lag2fmu.systems.controller import Controller
from lag2fmu.xml_tree import XmlElement, parse

_TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"
KINDS, ANY = ("CoSimulation", "ModelExchange"), "any"
"""The kinds of FMI by which FMUs run in a system, the better one first, and the word for either."""
_UNTYPED = ("String", "Binary", "Clock")
"""The types of variables that have no connector."""


@dataclass(frozen=True)
class LinearUnit:
    """A unit: the exponents (8,) of BASE_UNITS, and the conversion of its numbers, SI = factor * number + offset.

    There are no exponents where the description does not say what the unit is made of.
    """

    name: str
    exponents: tuple[int, ...]
    factor: float
    offset: float

    @property
    def dimension(self) -> tuple[int, ...]:
        """The exponents without that of the radian, which counts as 1."""
        return self.exponents[:-1]


class EnumeratedType(NamedTuple):
    """The ``name`` of an enumeration and its ``items``, (name, number) each."""

    name: str
    items: tuple[tuple[str, int], ...]


@dataclass(frozen=True)
class Connector:
    """A variable of an FMU, as the FMU declares it.

    - ``type``, ``unit``: the unit is None if the variable has none.
    - ``sizes``: the lengths of an array's dimensions.
    - ``settable``: whether its start value may be changed, from ``low`` to ``high``.
    - ``enumerated``: what its numbers stand for, None unless its type is Enumeration.
    """

    name: str
    causality: str
    type: str
    unit: LinearUnit | None
    sizes: tuple[str, ...]
    settable: bool
    low: float = -math.inf
    high: float = math.inf
    enumerated: EnumeratedType | None = None


@dataclass(frozen=True)
class ComponentTerminal:
    """Variables that belong together, {member: variable}, as a terminal of a ``kind``.

    ``rule`` says how the members of two terminals are matched. ``inflows`` are the members whose sum over a connection
    is zero, such as forces in balance.
    """

    rule: str
    members: Mapping[str, str]
    inflows: frozenset[str] = frozenset()
    kind: str = ""


@dataclass(frozen=True)
class PeriodicClock:
    """A clock of FMI 3.0, by its ``reference``, that the importer ticks every ``interval`` from ``shift`` on, in s."""

    reference: int
    interval: float
    shift: float


@dataclass(frozen=True)
class Component:
    """An FMU, or a Python function, under the ``name`` that it has in a system.

    - ``kind``: CoSimulation or ModelExchange, by which it runs; Controller for a function.
    - ``stop_time`` (s): that of its experiment, None if it has none.
    - ``texts``: the names of its variables that are texts.
    - ``clocks``: those of its clocks that the importer ticks.
    - ``controller``: the Python function; None for an FMU.
    """

    name: str
    path: Path
    fmi: str
    kind: str
    connectors: Mapping[str, Connector]
    terminals: Mapping[str, ComponentTerminal]
    stop_time: float | None
    texts: frozenset[str] = frozenset()
    controller: Controller | None = None
    clocks: tuple[PeriodicClock, ...] = ()


def component_with(name: str, controller: Controller, connectors: Mapping[str, Connector]) -> Component:
    """The component ``name`` of a ``controller`` whose ``connectors`` are known."""
    path = controller.file or Path(controller.label)
    return Component(name, path, "", "Controller", connectors, {}, None, controller=controller)


def read_component(name: str, path: Path, kind: str = ANY) -> Component:
    """The FMU ``path`` as the component ``name``, by the ``kind`` of FMI that is asked for, ANY or one of KINDS.

    Raises LoadError if it is no FMU of FMI 2.0 or 3.0, or does not offer that kind.
    """
    description, terminals = _described(path)
    kind = _kind(path, description, kind)
    units = {unit_name: linear_unit(element) for unit_name, element in description.units.items()}
    found = (_connector(v, units) for v in description.variables if v.type not in _UNTYPED)
    stop = number(_experiment(description).get("stopTime"))
    return Component(
        name,
        path,
        description.root.get("fmiVersion"),
        kind,
        {connector.name: connector for connector in found},
        {t.get("name"): _terminal(t) for t in terminals},
        stop if stop > 0 else None,
        frozenset(v.name for v in description.variables if v.type == "String"),
        clocks=tuple(_clock(name, v) for v in description.variables if v.type == "Clock" and v.causality == "input"),
    )


def _kind(path: Path, description: FmuDescription, asked: str) -> str:
    """The kind of FMI by which the FMU runs, the one that is ``asked`` for unless that is ANY."""
    offered = [known for known in KINDS if known in description.kinds]
    if not offered:
        raise LoadError(f"'{path}': offers neither co-simulation nor model exchange; no system can hold it")
    if asked not in (*offered, ANY):
        raise LoadError(f"'{path}': is to run by {asked}; it can run here by {' and '.join(offered)}")
    return offered[0] if asked == ANY else asked


def _clock(component: str, v: Variable) -> PeriodicClock:
    """The clock ``v``, an input; raises LoadError unless its description tells a constant interval.

    Source: FMI 3.0.2, section 2.4.7.5.
    """
    said = v.value
    per_second = number(said.get("resolution")) if said.get("resolution") else 1.0
    interval = number(said.get("intervalDecimal")) if said.get("intervalDecimal") else math.nan
    if said.get("intervalCounter"):
        interval = number(said.get("intervalCounter")) / per_second
    shift = number(said.get("shiftDecimal")) if said.get("shiftDecimal") else 0.0
    if said.get("shiftCounter"):
        shift = number(said.get("shiftCounter")) / per_second
    if not (interval > 0 and math.isfinite(interval) and shift >= 0):
        kind = said.get("intervalVariability")
        raise LoadError(
            f"the component '{component}' has the clock '{v.name}', an input with {kind} interval; "
            "clocks whose description tells interval and shift are run"
        )
    return PeriodicClock(v.reference, interval, shift)


def _described(path: Path) -> tuple[FmuDescription, list[XmlElement]]:
    """The description of the FMU ``path``, and its terminals."""
    with opened(path) as archive:
        if DESCRIPTION not in archive.namelist():
            raise LoadError(f"'{path}': there is no {DESCRIPTION} in it; it is no FMU")
        document = read_document(archive.read(DESCRIPTION))
        grouped = parse(archive.read(_TERMINALS), _TERMINALS).root if _TERMINALS in archive.namelist() else None
    try:
        description = described(document)
    except LoadError as error:
        raise LoadError(f"'{path}': {error}") from None
    return description, [] if grouped is None else list(grouped.all("Terminals", "Terminal"))


def _experiment(description: FmuDescription) -> XmlElement:
    return description.root.child("DefaultExperiment") or XmlElement("DefaultExperiment", {}, 0)


def linear_unit(element: XmlElement) -> LinearUnit:
    """The unit that ``element`` defines, in FMI and in SSP alike."""
    base = element.child("BaseUnit")
    if base is None:
        return LinearUnit(element.get("name"), (), 1.0, 0.0)
    exponents = tuple(int(base.get(symbol, "0")) for symbol in BASE_UNITS)
    return LinearUnit(element.get("name"), exponents, float(base.get("factor", "1")), float(base.get("offset", "0")))


def _connector(v: Variable, units: Mapping[str, LinearUnit]) -> Connector:
    sizes = tuple(dimension.get("start") for dimension in v.value.all("Dimension"))
    settable = v.start is not None and v.variability != "constant" and v.causality != "calculatedParameter"
    low, high = v.number("min"), v.number("max")
    bounds = (-math.inf if math.isnan(low) else low, math.inf if math.isnan(high) else high)
    unit, enumerated = units.get(v.attribute("unit")), _enumerated(v) if v.type == "Enumeration" else None
    return Connector(v.name, v.causality, v.type, unit, sizes, settable, *bounds, enumerated)


def _enumerated(v: Variable) -> EnumeratedType:
    items = () if v.declared is None else v.declared.all("Item")
    return EnumeratedType(v.value.get("declaredType"), tuple((i.get("name"), int(i.get("value"))) for i in items))


def _terminal(element: XmlElement) -> ComponentTerminal:
    variables = {m.get("memberName") or m.get("variableName"): m for m in element.all("TerminalMemberVariable")}
    inflows = frozenset(name for name, m in variables.items() if m.get("variableKind") in ("inflow", "outflow"))
    members = {x: m.get("variableName") for x, m in variables.items()}
    return ComponentTerminal(element.get("matchingRule"), members, inflows, element.get("terminalKind"))
