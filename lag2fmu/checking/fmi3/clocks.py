"""Rules on clocks, clocked variables and previous values (FMI 3.0.2, sections 2.4.4 and 2.4.7)."""

from __future__ import annotations

from collections.abc import Iterator

from lag2fmu.checking.description import number, whole
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.fmi3.description import Description3, Variable3

_PERIODIC = ("constant", "fixed", "tunable")


def clock_findings(description: Description3, variable: Variable3) -> Iterator[Finding]:
    """The broken rules on a variable as a clock, as one of a clock, and as a clocked state.

    Source: FMI 3.0.2 specification, sections 2.4.4 (ClockType) and 2.4.7.
    """
    if variable.type == "Clock":
        yield from _clock(variable)
        yield from _timing(variable)
    yield from _clocked(description, variable)
    if variable.previous is not None:
        yield from _previous(description, variable)


def _clock(variable: Variable3) -> Iterator[Finding]:
    if variable.causality not in ("input", "output", "local"):
        problem = f"a clock with causality='{variable.causality}'"
        yield Finding("clock-causality", variable.place, problem, "clocks are inputs, outputs or local")
    if variable.variability != "discrete":
        problem = f"a clock with variability='{variable.variability}'"
        yield Finding("clock-variability", variable.place, problem, "clocks are discrete")
    interval = variable.attribute("intervalVariability")
    if variable.causality == "output" and interval and interval != "triggered":
        problem = f"an output clock with intervalVariability='{interval}'"
        yield Finding("clock-output", variable.place, problem, "output clocks are triggered")
    if variable.causality == "output" and variable.attribute("priority"):
        yield Finding("clock-output", variable.place, "an output clock with a priority", "remove the priority")


def _timing(variable: Variable3) -> Iterator[Finding]:
    """Interval and shift of a clock, as decimals or as counters."""
    given = {
        name: number(text)
        for name in ("intervalDecimal", "shiftDecimal", "resolution", "intervalCounter", "shiftCounter")
        if (text := variable.attribute(name))
    }
    kind = variable.attribute("intervalVariability")
    periodic = kind in _PERIODIC
    wrong = [
        (kind == "constant" and "intervalDecimal" not in given, "a constant interval without intervalDecimal"),
        (not periodic and "intervalDecimal" in given, f"intervalDecimal for a clock that is {kind}"),
        (not periodic and {"resolution", "intervalCounter"} & given.keys(), f"counters for a clock that is {kind}"),
        (given.get("intervalDecimal", 1) <= 0, "intervalDecimal is not positive"),
        (given.get("shiftDecimal", 0) < 0, "shiftDecimal is negative"),
        (given.get("shiftDecimal", 0) > 0 and "intervalDecimal" not in given, "shiftDecimal without intervalDecimal"),
        ("intervalCounter" in given and "resolution" not in given, "intervalCounter without resolution"),
        (given.get("intervalCounter", 1) <= 0, "intervalCounter is not positive"),
        (given.get("shiftCounter", 0) > 0 and "intervalCounter" not in given, "shiftCounter without intervalCounter"),
        (
            "intervalCounter" in given and variable.attribute("supportsFraction") not in ("true", "1"),
            "intervalCounter, but supportsFraction is not true",
        ),
    ]
    for found, problem in wrong:
        if found:
            yield Finding("clock-interval", variable.place, problem, "see ClockType in section 2.4.4 of the standard")


def _clocked(description: Description3, variable: Variable3) -> Iterator[Finding]:
    """A variable that belongs to clocks."""
    if "clocks" not in variable.element.attributes:
        return
    if not variable.clocks:
        yield Finding("clocks", variable.place, "clocks='' names no clock", "name one or remove the attribute")
    if variable.variability not in ("discrete", "tunable"):
        problem = f"a {variable.variability} variable with clocks"
        yield Finding("clocks", variable.place, problem, "clocked variables are discrete or tunable")
    for reference in variable.clocks:
        clock = description.by_reference.get(reference)
        if clock is None or clock.type != "Clock":
            what = f"'{clock.name}', which is {clock.type}" if clock is not None else "no variable"
            problem = f"clocks has the value reference {reference} of {what}"
            yield Finding("clocks", variable.place, problem, "list clocks only")
        elif clock is variable:
            yield Finding("clocks", variable.place, "a clock that belongs to itself", "remove it from the list")


def _previous(description: Description3, variable: Variable3) -> Iterator[Finding]:
    """A clocked state and the variable with its previous value."""
    before = description.by_reference.get(whole(variable.element.get("previous"), -1))
    if before is None or before is variable:
        what = "itself" if before is variable else "no variable"
        problem = f"previous='{variable.previous}' is the value reference of {what}"
        yield Finding("previous", variable.place, problem, "name the variable with the previous value")
        return
    if not variable.clocks or variable.variability != "discrete" or variable.type == "Clock":
        problem = "previous for a variable that is not discrete and clocked"
        yield Finding("previous", variable.place, problem, "only clocked states have it")
    if before.type != variable.type or before.variability != "discrete" or before.causality == "input":
        problem = f"the previous value '{before.name}' is {before.variability} {before.causality} {before.type}"
        yield Finding("previous", variable.place, problem, "it is discrete, of the same type, and no input")
    others = [v for v in description.variables if v.previous == variable.previous and v is not variable]
    if others:
        problem = f"'{others[0].name}' has the same previous value"
        yield Finding("previous", variable.place, problem, "give each clocked state its own")
