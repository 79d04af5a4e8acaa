"""Rules on the head of modelDescription.xml that FMI 2.0 alone has (FMI 2.0.5, sections 2.2.1 to 2.2.6)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from lag2fmu.checking.findings import Finding
from lag2fmu.checking.fmi2.description import Description2
from lag2fmu.checking.head import at, head_findings, item_findings, type_names


def header_findings(description: Description2) -> Iterator[Finding]:
    """The broken rules on everything before the variables, and on numbers anywhere.

    Source: FMI 2.0.5 specification, sections 2.2.1 to 2.2.6.
    """
    yield from head_findings(description, frozenset({"Real"}))
    for rule in (_attributes, _source_files, _capabilities, _types):
        yield from rule(description)


def _attributes(description: Description2) -> Iterator[Finding]:
    root = description.root
    if root.get("fmiVersion") != "2.0":
        yield Finding("fmi-version", at(root), f"fmiVersion='{root.get('fmiVersion')}'", "write 2.0, for revisions too")
    if "ModelExchange" in description.kinds and "numberOfEventIndicators" not in root.attributes:
        problem = "model exchange without numberOfEventIndicators"
        yield Finding("event-indicators", at(root), problem, "say 0 if there are none", "warning")


def _source_files(description: Description2) -> Iterator[Finding]:
    for element in description.kinds.values():
        files = Counter(f.get("name") for f in element.all("SourceFiles", "File"))
        for file in (f for f, count in files.items() if count > 1):
            yield Finding("source-duplicate", at(element), f"the source file '{file}' is listed twice", "list it once")


def _capabilities(description: Description2) -> Iterator[Finding]:
    for kind, element in description.kinds.items():
        if description.can(kind, "canSerializeFMUstate") and not description.can(kind, "canGetAndSetFMUstate"):
            problem = "canSerializeFMUstate without canGetAndSetFMUstate"
            yield Finding("capabilities", at(element), problem, "declare both or none")
    if set(description.kinds) != {"CoSimulation"}:
        return
    for variable in description.variables:
        places = {"reinit": variable.value, "canHandleMultipleSetPerTimeInstant": variable.element}
        for attribute in (name for name, element in places.items() if name in element.attributes):
            problem = f"{attribute} has a meaning in model exchange only"
            yield Finding("co-simulation-only", variable.place, problem, "remove it from an FMU for co-simulation")


def _types(description: Description2) -> Iterator[Finding]:
    simple = list(description.root.all("TypeDefinitions", "SimpleType"))
    yield from type_names(description, simple)
    for element in simple:
        for kind in element.children:
            yield from item_findings(kind, element.get("name"))
