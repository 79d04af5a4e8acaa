"""Rules on ModelVariables (FMI 2.0.5, section 2.2.7) that schema and fmpy leave open."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

from lag2fmu.checking.description import number
from lag2fmu.checking.findings import Finding, Severity
from lag2fmu.checking.fmi2.description import Description2, ScalarVariable2
from lag2fmu.checking.variables import combination_findings, common_findings, rate_findings


def variable_findings(description: Description2) -> Iterator[Finding]:
    """The broken rules on variables, one by one and as sets of aliases.

    Source: FMI 2.0.5 specification, section 2.2.7 (ModelVariables).
    """
    for variable in description.variables:
        yield from common_findings(description, variable)
        yield from combination_findings(variable, "2.2.7")
        yield from _initial(variable)
        if variable.derivative:
            yield from _derivative(description, variable)
        yield from _settings(description, variable)
    yield from _independent(description)
    aliases: dict[tuple[str, int], list[ScalarVariable2]] = defaultdict(list)
    for variable in description.variables:
        base = "Integer" if variable.type == "Enumeration" else variable.type
        aliases[base, variable.reference].append(variable)
    for group in aliases.values():
        if len(group) > 1:
            yield from _aliases(group)


def _initial(variable: ScalarVariable2) -> Iterator[Finding]:
    given = variable.element.attributes.get("initial")
    if given is not None and variable.causality in ("input", "independent"):
        problem = f"initial='{given}' for causality='{variable.causality}'"
        yield Finding("initial-given", variable.place, problem, "leave 'initial' away there")
    if variable.initial == "calculated" and variable.start == "":  # fmpy reports other values itself
        yield Finding("start-forbidden", variable.place, "initial='calculated' with a start value", "remove the start")


def _derivative(description: Description2, variable: ScalarVariable2) -> Iterator[Finding]:
    state = description.variable(variable.derivative)
    if state is None or state is variable:
        what = "itself" if state is variable else "no variable"
        problem = f"derivative='{variable.derivative}' is the index of {what}"
        yield Finding("derivative", variable.place, problem, "indices count the ScalarVariables from 1")
        return
    for v, role in ((variable, "derivative"), (state, "state")):
        if v.type != "Real" or v.variability != "continuous":
            problem = f"the {role} '{v.name}' is {v.variability} {v.type}"
            yield Finding("derivative", variable.place, problem, "states and derivatives are continuous Reals")
    if state.causality not in ("local", "output"):
        problem = f"the state '{state.name}' has causality='{state.causality}'"
        yield Finding("derivative", variable.place, problem, "states are local variables or outputs")
    yield from rate_findings(description, state, variable)


def _settings(description: Description2, variable: ScalarVariable2) -> Iterator[Finding]:
    """Attributes that say something about certain variables only."""
    if variable.value.get("reinit") in ("true", "1") and variable.index not in description.states:
        yield Finding("reinit", variable.place, "reinit for a variable that is no state", "remove it")
    if "canHandleMultipleSetPerTimeInstant" in variable.element.attributes and variable.causality != "input":
        problem = "canHandleMultipleSetPerTimeInstant for a variable that is no input"
        yield Finding("multiple-set", variable.place, problem, "remove it")


def _independent(description: Description2) -> Iterator[Finding]:
    independent = [v for v in description.variables if v.causality == "independent"]
    for variable in independent[1:]:
        problem = f"'{independent[0].name}' is an independent variable already"
        yield Finding("independent", variable.place, problem, "keep one")
    for variable in independent:
        if variable.type != "Real":
            yield Finding("independent", variable.place, f"the independent variable is {variable.type}", "make it Real")


def _aliases(group: list[ScalarVariable2]) -> Iterator[Finding]:
    """Variables of one base type and one value reference are one variable with several names."""
    first, *others = group
    settable = [v for v in group if v.causality in ("parameter", "input")]
    for other in others:
        units = first.attribute("unit"), other.attribute("unit")
        if units[0] != units[1]:
            problem = f"has the unit '{units[1]}', but its alias '{first.name}' '{units[0]}'"
            severity: Severity = "error" if all(units) else "warning"
            yield Finding("alias-unit", other.place, problem, "give aliases the same unit", severity)
    yield from _alias_values(group)
    if len(settable) > 1:
        problem = f"'{settable[0].name}' and its alias '{settable[1].name}' can both be set"
        yield Finding("alias-settable", settable[1].place, problem, "at most one is a parameter or input")


def _alias_values(group: list[ScalarVariable2]) -> Iterator[Finding]:
    """Aliases have one value: all of them are constant with one start, or none is and one of them has a start."""
    constants = [v for v in group if v.variability == "constant"]
    started = [v for v in group if v.start is not None]
    if constants and len(constants) < len(group):
        problem = f"'{constants[0].name}' is constant, but not all of its aliases"
        yield Finding("alias-constant", constants[0].place, problem, "give them value references of their own")
    elif constants and len({number(v.start or "") if v.type != "String" else v.start for v in constants}) > 1:
        problem = "constant aliases with different start values"
        yield Finding("alias-constant", constants[0].place, problem, "give them one value")
    elif not constants and len(started) > 1:
        problem = f"'{started[0].name}' and its alias '{started[1].name}' have start values"
        yield Finding("alias-start", started[1].place, problem, "give one of them a start value")
