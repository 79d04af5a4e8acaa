"""Rules on ModelVariables that FMI 3.0 alone has (FMI 3.0.2, section 2.4.7), arrays included; clocks stand beside."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator

from lag2fmu.archives import DESCRIPTION
from lag2fmu.checking.description import whole
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.fmi3.clocks import clock_findings
from lag2fmu.checking.fmi3.description import FLOATS, Description3, Variable3
from lag2fmu.checking.variables import combination_findings, common_findings, rate_findings
from lag2fmu.xml_tree import XmlElement

_HEX = re.compile(r"([0-9a-fA-F]{2})*")


def variable_findings(description: Description3) -> Iterator[Finding]:
    """The broken rules on variables and their aliases.

    Source: FMI 3.0.2 specification, section 2.4.7 (ModelVariables).
    """
    for variable in description.variables:
        yield from common_findings(description, variable)
        yield from _kind(variable)
        yield from _start(variable)
        yield from _arrays(description, variable)
        yield from clock_findings(description, variable)
        yield from _settings(description, variable)
        yield from _aliases(description, variable)
        if variable.derivative is not None:
            yield from _derivative(description, variable)
    yield from _unique(description)
    yield from _independent(description)


def _kind(variable: Variable3) -> Iterator[Finding]:
    """Causality, variability and initial."""
    found = list(combination_findings(variable, "2.4.7"))
    yield from found
    if not found and variable.causality == "independent" and "initial" in variable.element.attributes:
        problem = "initial for the independent variable"
        yield Finding("initial-given", variable.place, problem, "leave 'initial' away there")
    if variable.variability == "continuous" and variable.type not in FLOATS:
        problem = f"a continuous variable of type {variable.type}"
        yield Finding("variability", variable.place, problem, "only floating point numbers are continuous")


def _start(variable: Variable3) -> Iterator[Finding]:
    has_start = bool(variable.starts) or variable.start is not None
    if variable.initial in ("exact", "approx") and not has_start:
        problem = f"no start value, but initial='{variable.initial}'"
        yield Finding("start-missing", variable.place, problem, "give it a start value")
    elif has_start and (variable.initial == "calculated" or variable.causality == "independent"):
        kind = "the independent variable" if variable.causality == "independent" else "initial='calculated'"
        yield Finding("start-forbidden", variable.place, f"{kind} with a start value", "remove the start value")
    if variable.type == "Binary":
        for text in variable.starts:
            if not _HEX.fullmatch(text):
                problem = f"the start '{text[:40]}' is no row of hexadecimal bytes"
                yield Finding("binary-start", variable.place, problem, "write two digits for each byte")


def _settings(description: Description3, variable: Variable3) -> Iterator[Finding]:
    """Attributes that say something about certain variables only."""
    element = variable.element
    if element.get("reinit") in ("true", "1") and variable.reference not in description.states:
        yield Finding("reinit", variable.place, "reinit for a variable that is no state", "remove it")
    if "canHandleMultipleSetPerTimeInstant" in element.attributes and variable.causality != "input":
        problem = "canHandleMultipleSetPerTimeInstant for a variable that is no input"
        yield Finding("multiple-set", variable.place, problem, "remove it")
    if element.get("intermediateUpdate") in ("true", "1") and variable.variability != "continuous":
        problem = f"intermediateUpdate for a {variable.variability} variable"
        yield Finding("intermediate-update", variable.place, problem, "only continuous variables have it")


def _aliases(description: Description3, variable: Variable3) -> Iterator[Finding]:
    """The other names of a variable, and their display units."""
    unit = description.units.get(variable.attribute("unit"))
    known = {shown.get("name") for shown in unit.all("DisplayUnit")} if unit is not None else set()
    for alias in variable.aliases:
        place = f"{DESCRIPTION}:{alias.line} '{alias.get('name')}'"
        shown = alias.get("displayUnit")
        if shown and shown not in known:
            problem = f"the displayUnit '{shown}' is none of the unit of '{variable.name}'"
            yield Finding("display-unit", place, problem, "add a DisplayUnit with its factor")
        if not alias.get("name").strip():
            yield Finding("name-empty", place, f"an alias of '{variable.name}' without a name", "name it")


def _derivative(description: Description3, variable: Variable3) -> Iterator[Finding]:
    base = description.by_reference.get(variable.derivative if variable.derivative is not None else -1)
    if base is None or base is variable:
        what = "itself" if base is variable else "no variable"
        problem = f"derivative='{variable.derivative}' is the value reference of {what}"
        yield Finding("derivative", variable.place, problem, "give the value reference of what is derived")
        return
    for v, role in ((variable, "derivative"), (base, "state")):
        if not v.is_continuous:
            problem = f"the {role} '{v.name}' is {v.variability} {v.type}"
            yield Finding("derivative", variable.place, problem, "states and derivatives are continuous floats")
    if base.size != variable.size:
        problem = f"has {variable.size} elements, but '{base.name}', which it derives, {base.size}"
        yield Finding("derivative-size", variable.place, problem, "give both the same dimensions")
    yield from rate_findings(description, base, variable)


def _unique(description: Description3) -> Iterator[Finding]:
    """Names, those of aliases included, and value references that stand twice."""
    places = [(v.name, v.place) for v in description.variables]
    places += [
        (a.get("name"), f"{DESCRIPTION}:{a.line} '{a.get('name')}'") for v in description.variables for a in v.aliases
    ]
    seen: set[str] = set()
    for name, place in places:
        if name in seen:
            problem = f"the name '{name}' is taken already"
            yield Finding("name-duplicate", place, problem, "give each variable and alias a name of its own")
        seen.add(name)
    counts = Counter(v.reference for v in description.variables)
    for variable in description.variables:
        if counts[variable.reference] > 1 and description.by_reference[variable.reference] is not variable:
            other = description.by_reference[variable.reference].name
            problem = f"has the value reference of '{other}'"
            yield Finding("reference-duplicate", variable.place, problem, "give it its own, or make it an Alias")


def _independent(description: Description3) -> Iterator[Finding]:
    independent = [v for v in description.variables if v.causality == "independent"]
    if not independent:
        problem = "no variable has causality='independent'"
        yield Finding("independent", f"{DESCRIPTION} <ModelVariables>", problem, "declare time, a Float64")
    for variable in independent[1:]:
        problem = f"'{independent[0].name}' is an independent variable already"
        yield Finding("independent", variable.place, problem, "keep one")
    for variable in independent:
        if variable.type not in FLOATS or variable.dimensions:
            problem = f"the independent variable is {'an array' if variable.dimensions else variable.type}"
            yield Finding("independent", variable.place, problem, "make it a scalar Float64")


def _arrays(description: Description3, variable: Variable3) -> Iterator[Finding]:
    """The broken rules on the dimensions of a variable and on the number of its start values.

    Source: FMI 3.0.2 specification, section 2.4.7.2 (array variables and structural parameters).
    """
    for dimension in variable.dimensions:
        place = f"{DESCRIPTION}:{dimension.line} '{variable.name}' <Dimension>"
        yield from _dimension(description, dimension, place)
    if variable.causality == "structuralParameter" and variable.dimensions:
        problem = "a structural parameter with dimensions"
        yield Finding("structural-parameter", variable.place, problem, "structural parameters are scalars")
    if variable.size and len(variable.starts) not in (0, 1, variable.size):
        problem = f"{len(variable.starts)} start values for {variable.size} elements"
        yield Finding("start-count", variable.place, problem, "give one for each element, or one for all")


def _dimension(description: Description3, dimension: XmlElement, place: str) -> Iterator[Finding]:
    start, reference = (dimension.attributes.get(name) for name in ("start", "valueReference"))
    if (start is None) == (reference is None):
        problem = "has both start and valueReference" if start is not None else "has neither start nor valueReference"
        yield Finding("dimension", place, problem, "give a fixed size or the parameter that holds it")
    elif start is not None:
        if whole(start, 1) == 0:
            yield Finding("dimension", place, "start='0'", "sizes are positive at the beginning")
    else:
        yield from _sizing(description.by_reference.get(whole(reference or "", -1)), reference or "", place)


def _sizing(parameter: Variable3 | None, reference: str, place: str) -> Iterator[Finding]:
    """The variable that holds the size of a dimension."""
    if parameter is None:
        problem = f"valueReference='{reference}' is that of no variable"
        yield Finding("dimension-parameter", place, problem, "name a structural parameter or a constant")
        return
    if parameter.type != "UInt64":
        problem = f"'{parameter.name}', which holds the size, is {parameter.type}"
        yield Finding("dimension-parameter", place, problem, "make it a UInt64")
    if parameter.causality != "structuralParameter" and parameter.variability != "constant":
        problem = f"'{parameter.name}', which holds the size, is a {parameter.variability} {parameter.causality}"
        yield Finding("dimension-parameter", place, problem, "make it a structural parameter or a constant")
    if parameter.start is not None and whole(parameter.start, 1) == 0:
        problem = f"'{parameter.name}', which holds the size, starts at 0"
        yield Finding("dimension-parameter", place, problem, "sizes are positive at the beginning")
