"""Rules on the head of modelDescription.xml: capabilities, units, types (FMI 2.0.5, sections 2.2.1 to 2.2.6)."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator

from lag2fmu.checking.description import Description, number, whole
from lag2fmu.checking.findings import Finding
from lag2fmu.fmu.pack import DESCRIPTION
from lag2fmu.xml_tree import Element

_TIME = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ")
_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z_0-9]*")
_NUMBERS = {"min", "max", "nominal", "factor", "offset", "startTime", "stopTime", "tolerance", "stepSize"}
"""Attributes that hold a number wherever they stand; 'start' does so in Real only."""


def header_findings(description: Description) -> Iterator[Finding]:
    """The broken rules on everything before the variables, and on numbers anywhere.

    Source: FMI 2.0.5 specification, sections 2.2.1 to 2.2.6.
    """
    for rule in (_attributes, _identifiers, _capabilities, _experiment, _log_categories, _units, _types, _numbers):
        yield from rule(description)


def _at(element: Element) -> str:
    return f"{DESCRIPTION}:{element.line} <{element.tag}>"


def _attributes(description: Description) -> Iterator[Finding]:
    root, at = description.root, _at(description.root)
    encoding = description.document.encoding
    if encoding.lower() != "utf-8":
        said = f"says encoding='{encoding}'" if encoding else "does not say its encoding"
        problem, remedy = f"the document {said}", 'begin with <?xml version="1.0" encoding="UTF-8"?>'
        yield Finding("encoding", f"{DESCRIPTION}:1", problem, remedy, "error" if encoding else "warning")
    if root.get("fmiVersion") != "2.0":
        yield Finding("fmi-version", at, f"fmiVersion='{root.get('fmiVersion')}'", "write 2.0, for revisions too")
    guid = root.get("guid")
    if not guid.strip():
        yield Finding("guid", at, "the guid is empty", "make one anew for each change of the variables")
    elif len(guid) < 16 or guid != guid.strip():
        problem = f"the guid '{guid}' is hardly a fingerprint of this file"
        yield Finding("guid-form", at, problem, "use a GUID or a hash", "warning")
    time = root.attributes.get("generationDateAndTime")
    if time is not None and not _TIME.fullmatch(time):
        problem = f"generationDateAndTime='{time}' is not of the form YYYY-MM-DDThh:mm:ssZ"
        yield Finding("date", at, problem, "write the time in UTC, in whole seconds, with a Z", "warning")
    if "ModelExchange" in description.kinds and "numberOfEventIndicators" not in root.attributes:
        problem = "model exchange without numberOfEventIndicators"
        yield Finding("event-indicators", at, problem, "say 0 if there are none", "warning")


def _identifiers(description: Description) -> Iterator[Finding]:
    for element in description.kinds.values():
        name = element.get("modelIdentifier")
        if not _IDENTIFIER.fullmatch(name):
            problem = f"modelIdentifier='{name}' is no C identifier"
            yield Finding("model-identifier", _at(element), problem, "use letters, digits and '_' only")
        elif len(name) > 64:
            problem = f"the modelIdentifier has {len(name)} characters; paths on Windows end at 260"
            yield Finding("model-identifier-length", _at(element), problem, "use a shorter one", "warning")
        files = Counter(f.get("name") for f in element.all("SourceFiles", "File"))
        for file in (f for f, count in files.items() if count > 1):
            yield Finding("source-duplicate", _at(element), f"the source file '{file}' is listed twice", "list it once")


def _capabilities(description: Description) -> Iterator[Finding]:
    for kind, element in description.kinds.items():
        if description.can(kind, "canSerializeFMUstate") and not description.can(kind, "canGetAndSetFMUstate"):
            problem = "canSerializeFMUstate without canGetAndSetFMUstate"
            yield Finding("capabilities", _at(element), problem, "declare both or none")
    if set(description.kinds) != {"CoSimulation"}:
        return
    for variable in description.variables:
        places = {"reinit": variable.value, "canHandleMultipleSetPerTimeInstant": variable.element}
        for attribute in (name for name, element in places.items() if name in element.attributes):
            problem = f"{attribute} has a meaning in model exchange only"
            yield Finding("co-simulation-only", variable.place, problem, "remove it from an FMU for co-simulation")


def _experiment(description: Description) -> Iterator[Finding]:
    experiment = description.root.child("DefaultExperiment")
    if experiment is None:
        return
    at = _at(experiment)
    start, stop = number(experiment.get("startTime", "0")), number(experiment.get("stopTime"))
    if stop < start:
        yield Finding("stop-time", at, f"the stop time {stop:g} is before the start time {start:g}", "swap them")
    elif stop == start:
        yield Finding("stop-time", at, "the stop time is the start time", "give the run a length", "warning")
    for name in ("stepSize", "tolerance"):
        if number(experiment.get(name)) <= 0:
            problem = f"{name}='{experiment.get(name)}' is not positive"
            yield Finding("experiment", at, problem, "give a positive value or none")


def _duplicates(elements: Iterator[Element], rule: str, what: str) -> Iterator[Finding]:
    seen: set[str] = set()
    for element in elements:
        name = element.get("name")
        if name in seen:
            yield Finding(rule, _at(element), f"the {what} '{name}' is defined twice", "define it once")
        seen.add(name)


def _log_categories(description: Description) -> Iterator[Finding]:
    yield from _duplicates(description.root.all("LogCategories", "Category"), "log-category", "log category")


def _units(description: Description) -> Iterator[Finding]:
    yield from _duplicates(description.root.all("UnitDefinitions", "Unit"), "unit-duplicate", "unit")
    for unit in description.root.all("UnitDefinitions", "Unit"):
        yield from _duplicates(unit.all("DisplayUnit"), "unit-duplicate", "display unit")
        if not unit.get("name").strip():
            yield Finding("unit-name", _at(unit), "a unit without a name", "leave the unit away for pure numbers")
        for element in unit.children:
            if number(element.get("factor", "1")) == 0:
                yield Finding("unit-factor", _at(element), "factor='0' converts all values to one", "give the factor")


def _types(description: Description) -> Iterator[Finding]:
    simple = list(description.root.all("TypeDefinitions", "SimpleType"))
    yield from _duplicates(iter(simple), "type-duplicate", "type")
    names = {v.name for v in description.variables}
    for element in simple:
        if element.get("name") in names:
            problem = f"the type '{element.get('name')}' has the name of a variable"
            yield Finding("type-name", _at(element), problem, "names of types and variables must differ")
        for kind in element.children:
            yield from _duplicates(kind.all("Item"), "enumeration-item", "item")
            values = Counter(whole(item.get("value"), 0) for item in kind.all("Item"))
            for value in (v for v, count in values.items() if count > 1):
                problem = f"two items of '{element.get('name')}' have the value {value}"
                yield Finding("enumeration-item", _at(kind), problem, "give each item a value of its own")
            if not number(kind.get("nominal", "1")) > 0:
                yield Finding("nominal", _at(kind), f"nominal='{kind.get('nominal')}' is not positive", "give its size")


def _numbers(description: Description) -> Iterator[Finding]:
    """NaN and INF are numbers to the schema, but not to importers or the standard."""
    for element in description.root.walk():
        for name, text in element.attributes.items():
            is_number = name in _NUMBERS or (name == "start" and element.tag == "Real")
            if is_number and not math.isfinite(number(text)):
                yield Finding("not-finite", _at(element), f"{name}='{text}' is no finite number", "write a number")
