"""Rules on the head of modelDescription.xml that both versions have: experiment, units, types, numbers."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator

from lag2fmu.archives import DESCRIPTION
from lag2fmu.checking.description import FmuDescription, number, whole
from lag2fmu.checking.findings import Finding
from lag2fmu.xml_tree import XmlElement

_TIME = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ")
_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z_0-9]*")
_NUMBERS = {"min", "max", "nominal", "factor", "offset", "startTime", "stopTime", "tolerance", "stepSize"}
"""Attributes that hold a number wherever they stand; 'start' does so in floating point variables only."""


def head_findings(description: FmuDescription, floats: frozenset[str]) -> Iterator[Finding]:
    """The broken rules on the head, and on numbers anywhere; ``floats`` are the tags of floating point variables.

    Source: FMI 2.0.5 specification, sections 2.2.1 to 2.2.6; FMI 3.0.2 specification, section 2.4.
    """
    for rule in (_document, _identifiers, _experiment, _log_categories, _units):
        yield from rule(description)
    yield from _numbers(description, floats)


def at(element: XmlElement) -> str:
    """Where an element of the head stands."""
    return f"{DESCRIPTION}:{element.line} <{element.tag}>"


def _document(description: FmuDescription) -> Iterator[Finding]:
    """Encoding, fingerprint and date."""
    root = description.root
    encoding = description.document.encoding
    if encoding.lower() != "utf-8":
        said = f"says encoding='{encoding}'" if encoding else "does not say its encoding"
        problem, remedy = f"the document {said}", 'begin with <?xml version="1.0" encoding="UTF-8"?>'
        yield Finding("encoding", f"{DESCRIPTION}:1", problem, remedy, "error" if encoding else "warning")
    name, token = description.token_name, description.token
    if not token.strip():
        yield Finding("guid", at(root), f"the {name} is empty", "make one anew for each change of the variables")
    elif len(token) < 16 or token != token.strip():
        problem = f"the {name} '{token}' is hardly a fingerprint of this file"
        yield Finding("guid-form", at(root), problem, "use a GUID or a hash", "warning")
    time = root.attributes.get("generationDateAndTime")
    if time is not None and not _TIME.fullmatch(time):
        problem = f"generationDateAndTime='{time}' is not of the form YYYY-MM-DDThh:mm:ssZ"
        yield Finding("date", at(root), problem, "write the time in UTC, in whole seconds, with a Z", "warning")


def _identifiers(description: FmuDescription) -> Iterator[Finding]:
    for element in description.kinds.values():
        name = element.get("modelIdentifier")
        if not _IDENTIFIER.fullmatch(name):
            problem = f"modelIdentifier='{name}' is no C identifier"
            yield Finding("model-identifier", at(element), problem, "use letters, digits and '_' only")
        elif len(name) > 64:
            problem = f"the modelIdentifier has {len(name)} characters; paths on Windows end at 260"
            yield Finding("model-identifier-length", at(element), problem, "use a shorter one", "warning")


def _experiment(description: FmuDescription) -> Iterator[Finding]:
    experiment = description.root.child("DefaultExperiment")
    if experiment is None:
        return
    place = at(experiment)
    start, stop = number(experiment.get("startTime", "0")), number(experiment.get("stopTime"))
    if stop < start:
        yield Finding("stop-time", place, f"the stop time {stop:g} is before the start time {start:g}", "swap them")
    elif stop == start:
        yield Finding("stop-time", place, "the stop time is the start time", "give the run a length", "warning")
    for name in ("stepSize", "tolerance"):
        if number(experiment.get(name)) <= 0:
            problem = f"{name}='{experiment.get(name)}' is not positive"
            yield Finding("experiment", place, problem, "give a positive value or none")


def duplicates(elements: Iterator[XmlElement], rule: str, what: str) -> Iterator[Finding]:
    """Elements whose name another one has already; ``what`` is what they are."""
    seen: set[str] = set()
    for element in elements:
        name = element.get("name")
        if name in seen:
            yield Finding(rule, at(element), f"the {what} '{name}' is defined twice", "define it once")
        seen.add(name)


def _log_categories(description: FmuDescription) -> Iterator[Finding]:
    yield from duplicates(description.root.all("LogCategories", "Category"), "log-category", "log category")


def _units(description: FmuDescription) -> Iterator[Finding]:
    yield from duplicates(description.root.all("UnitDefinitions", "Unit"), "unit-duplicate", "unit")
    for unit in description.root.all("UnitDefinitions", "Unit"):
        yield from duplicates(unit.all("DisplayUnit"), "unit-duplicate", "display unit")
        if not unit.get("name").strip():
            yield Finding("unit-name", at(unit), "a unit without a name", "leave the unit away for pure numbers")
        for element in unit.children:
            if number(element.get("factor", "1")) == 0:
                yield Finding("unit-factor", at(element), "factor='0' converts all values to one", "give the factor")


def item_findings(kind: XmlElement, name: str) -> Iterator[Finding]:
    """The broken rules on the items of the enumeration ``name`` and on the nominal value of a type."""
    yield from duplicates(kind.all("Item"), "enumeration-item", "item")
    values = Counter(whole(item.get("value"), 0) for item in kind.all("Item"))
    for value in (v for v, count in values.items() if count > 1):
        problem = f"two items of '{name}' have the value {value}"
        yield Finding("enumeration-item", at(kind), problem, "give each item a value of its own")
    if not number(kind.get("nominal", "1")) > 0:
        yield Finding("nominal", at(kind), f"nominal='{kind.get('nominal')}' is not positive", "give its size")


def _numbers(description: FmuDescription, floats: frozenset[str]) -> Iterator[Finding]:
    """NaN and INF are numbers to the schema, but not to importers or the standard."""
    for element in description.root.walk():
        for name, text in element.attributes.items():
            is_number = name in _NUMBERS or (name == "start" and element.tag in floats)
            if is_number and not all(math.isfinite(number(part)) for part in text.split() or [text]):
                yield Finding("not-finite", at(element), f"{name}='{text}' is no finite number", "write a number")


def type_names(description: FmuDescription, types: list[XmlElement]) -> Iterator[Finding]:
    """Names of types that are not unique among types and variables."""
    yield from duplicates(iter(types), "type-duplicate", "type")
    names = {v.name for v in description.variables}
    for element in types:
        if element.get("name") in names:
            problem = f"the type '{element.get('name')}' has the name of a variable"
            yield Finding("type-name", at(element), problem, "names of types and variables must differ")
