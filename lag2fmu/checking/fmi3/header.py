"""Rules on the head of modelDescription.xml that FMI 3.0 alone has (FMI 3.0.2, sections 2.4.1 to 2.4.6, 4.4)."""

from __future__ import annotations

import re
from collections.abc import Iterator
from difflib import get_close_matches

from lag2fmu.checking.description import number, whole
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.fmi3.description import FLOATS, Description3
from lag2fmu.checking.head import at, head_findings, item_findings, type_names

_VERSION = re.compile(r"3\.(0|[1-9]\d*)(\.(0|[1-9]\d*))?(-[0-9A-Za-z.]+)?")
_REVERSE_DOMAIN = re.compile(r"[A-Za-z0-9_-]+(\.[A-Za-z0-9_-]+)+")

_OF_ALL = (
    "modelIdentifier needsExecutionTool canBeInstantiatedOnlyOncePerProcess canGetAndSetFMUState canSerializeFMUState "
    "providesDirectionalDerivatives providesAdjointDerivatives providesPerElementDependencies"
)
_OF_KINDS = {
    "ModelExchange": "needsCompletedIntegratorStep providesEvaluateDiscreteStates",
    "CoSimulation": "canHandleVariableCommunicationStepSize fixedInternalStepSize maxOutputDerivativeOrder "
    "recommendedIntermediateInputSmoothness providesIntermediateUpdate mightReturnEarlyFromDoStep "
    "canReturnEarlyAfterIntermediateUpdate hasEventMode providesEvaluateDiscreteStates",
    "ScheduledExecution": "",
}
"""The attributes of all kinds and of each, which the schema leaves open (FMI 3.0.2, fmi3InterfaceType.xsd)."""


def header_findings(description: Description3) -> Iterator[Finding]:
    """The broken rules on everything before the variables, and on numbers anywhere.

    Source: FMI 3.0.2 specification, sections 2.4.1 to 2.4.6 and 4.4.
    """
    yield from head_findings(description, FLOATS | {f"{name}Type" for name in FLOATS})
    for rule in (_version, _capabilities, _attributes, _co_simulation, _display_units, _types, _annotations):
        yield from rule(description)


def _version(description: Description3) -> Iterator[Finding]:
    root = description.root
    version = root.get("fmiVersion")
    if not _VERSION.fullmatch(version):
        problem = f"fmiVersion='{version}'"
        yield Finding("fmi-version", at(root), problem, "write 3.0")
    elif version != "3.0":
        problem = f"fmiVersion='{version}' names more than a minor version"
        yield Finding("fmi-version", at(root), problem, "write 3.0, for revisions too", "warning")
    for name in ("guid", "numberOfEventIndicators"):
        if name in root.attributes:
            yield Finding("schema", at(root), f"{name} is an attribute of FMI 2.0", "remove it")


def _capabilities(description: Description3) -> Iterator[Finding]:
    for kind, element in description.kinds.items():
        if description.can(kind, "canSerializeFMUState") and not description.can(kind, "canGetAndSetFMUState"):
            problem = "canSerializeFMUState without canGetAndSetFMUState"
            yield Finding("capabilities", at(element), problem, "declare both or none")
    clocks = [v for v in description.variables if v.type == "Clock"]
    if "ScheduledExecution" in description.kinds:
        for clock in clocks:
            if clock.causality == "input" and not clock.attribute("priority"):
                problem = f"the input clock '{clock.name}' has no priority"
                yield Finding("clock-priority", clock.place, problem, "Scheduled Execution needs one for each")


def _attributes(description: Description3) -> Iterator[Finding]:
    """Attributes of a kind that the standard does not have, such as those that FMI 2.0 spells in another way."""
    for kind, element in description.kinds.items():
        known = f"{_OF_ALL} {_OF_KINDS[kind]}".split()
        for name in element.attributes:
            if name not in known and ":" not in name:
                problem = f"the attribute '{name}', which importers do not know"
                near = get_close_matches(name, known, 1)
                remedy = f"write {near[0]}" if near else "remove it"
                yield Finding("unknown-attribute", at(element), problem, remedy, "warning")


def _co_simulation(description: Description3) -> Iterator[Finding]:
    """The flags of co-simulation among one another."""
    element = description.kinds.get("CoSimulation")
    if element is None:
        return
    returns = description.can("CoSimulation", "canReturnEarlyAfterIntermediateUpdate")
    if returns and not description.can("CoSimulation", "providesIntermediateUpdate"):
        problem = "canReturnEarlyAfterIntermediateUpdate without providesIntermediateUpdate"
        yield Finding("capabilities", at(element), problem, "declare both or none")
    has_events = description.can("CoSimulation", "hasEventMode")
    if not has_events and any(v.type == "Clock" for v in description.variables):
        problem = "there are clocks, but hasEventMode is not true"
        yield Finding("clock-event-mode", at(element), problem, "clocks tick in Event Mode only; declare it")
    if description.can("CoSimulation", "providesEvaluateDiscreteStates") and not has_events:
        problem = "providesEvaluateDiscreteStates without hasEventMode"
        yield Finding("capabilities", at(element), problem, "it is called in Event Mode only", "warning")
    if number(element.get("fixedInternalStepSize", "1")) <= 0:
        problem = f"fixedInternalStepSize='{element.get('fixedInternalStepSize')}' is not positive"
        yield Finding("experiment", at(element), problem, "give the step size of the FMU or leave it away")


def _display_units(description: Description3) -> Iterator[Finding]:
    for shown in description.root.all("UnitDefinitions", "Unit", "DisplayUnit"):
        if shown.get("inverse") in ("true", "1") and number(shown.get("offset", "0")) != 0:
            problem = f"the display unit '{shown.get('name')}' is inverse and has an offset"
            yield Finding("unit-inverse", at(shown), problem, "an inverse unit has no offset")


def _types(description: Description3) -> Iterator[Finding]:
    yield from type_names(description, description.type_elements)
    for element in description.type_elements:
        name = element.get("name")
        yield from item_findings(element, name)
        if number(element.get("min")) > number(element.get("max")):
            yield Finding("min-max", at(element), f"min is greater than max in the type '{name}'", "swap them")
        unit, shown = element.get("unit"), element.get("displayUnit")
        if unit and unit not in description.units:
            problem = f"the unit '{unit}' of the type '{name}' is not defined"
            yield Finding("unit-undefined", at(element), problem, "add it to UnitDefinitions")
        elif shown and not unit:
            problem = f"the type '{name}' has displayUnit='{shown}' without a unit"
            yield Finding("display-unit", at(element), problem, "give the unit too")
        if whole(element.get("maxSize", "1"), 1) == 0:
            problem = f"maxSize='0' of the type '{name}' leaves no room"
            yield Finding("binary-size", at(element), problem, "give the greatest number of bytes")


def _annotations(description: Description3) -> Iterator[Finding]:
    for element in description.root.walk():
        if element.tag == "Annotation" and not _REVERSE_DOMAIN.fullmatch(element.get("type")):
            problem = f"the annotation's type '{element.get('type')}' is no reverse domain"
            yield Finding("annotation", at(element), problem, "e.g. com.acme.layout", "warning")
