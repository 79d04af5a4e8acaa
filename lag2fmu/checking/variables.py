"""Rules on ModelVariables (FMI 2.0.5, section 2.2.7) that schema and fmpy leave open."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator

from lag2fmu.checking.description import Description, ScalarVariable, number
from lag2fmu.checking.findings import Finding, Severity
from lag2fmu.xml_tree import Element

_BASE = ("kg", "m", "s", "A", "K", "mol", "cd")
"""The base units that a derivative is compared in; rad counts as 1."""


def variable_findings(description: Description) -> Iterator[Finding]:
    """The broken rules on variables, one by one and as sets of aliases.

    Source: FMI 2.0.5 specification, section 2.2.7 (ModelVariables).
    """
    for variable in description.variables:
        yield from _name(variable)
        yield from _initial(variable)
        yield from _values(variable)
        yield from _type(description, variable)
        yield from _unit(description, variable)
        if variable.derivative:
            yield from _derivative(description, variable)
        yield from _settings(description, variable)
    yield from _independent(description)
    aliases: dict[tuple[str, int], list[ScalarVariable]] = defaultdict(list)
    for variable in description.variables:
        base = "Integer" if variable.type == "Enumeration" else variable.type
        aliases[base, variable.reference].append(variable)
    for group in aliases.values():
        if len(group) > 1:
            yield from _aliases(group)


def _name(variable: ScalarVariable) -> Iterator[Finding]:
    if not variable.name.strip():
        yield Finding("name-empty", variable.place, "a variable without a name", "name it")
    elif variable.name != variable.name.strip():
        yield Finding("name-blank", variable.place, "the name begins or ends with a blank", "remove it", "warning")


def _initial(variable: ScalarVariable) -> Iterator[Finding]:
    given = variable.element.attributes.get("initial")
    if given is not None and variable.causality in ("input", "independent"):
        problem = f"initial='{given}' for causality='{variable.causality}'"
        yield Finding("initial-given", variable.place, problem, "leave 'initial' away there")
    if variable.initial == "calculated" and variable.start == "":  # fmpy reports other values itself
        yield Finding("start-forbidden", variable.place, "initial='calculated' with a start value", "remove the start")


def _values(variable: ScalarVariable) -> Iterator[Finding]:
    low, high, start = (variable.number(name) for name in ("min", "max", "start"))
    if low > high:
        yield Finding("min-max", variable.place, f"min = {low:g} is greater than max = {high:g}", "swap them")
    elif start < low or start > high:
        bounds = ", ".join(f"{n} = {x:g}" for n, x in (("min", low), ("max", high)) if not math.isnan(x))
        yield Finding("start-range", variable.place, f"start = {start:g} is outside of {bounds}", "correct one of them")
    if variable.value.get("nominal") and not number(variable.value.get("nominal")) > 0:
        problem = f"nominal='{variable.value.get('nominal')}' is not positive"
        yield Finding("nominal", variable.place, problem, "give the size its values have")


def _type(description: Description, variable: ScalarVariable) -> Iterator[Finding]:
    name = variable.value.attributes.get("declaredType")
    if name is None:
        return
    if variable.declared is None:
        problem = f"declaredType='{name}' is not among the TypeDefinitions"
        yield Finding("type-undefined", variable.place, problem, "define it or remove the attribute")
    elif variable.declared.tag != variable.type:
        problem = f"{variable.type} with declaredType='{name}', which is of {variable.declared.tag}"
        yield Finding("type-kind", variable.place, problem, "declare a type of the same kind")
    elif variable.type == "Enumeration" and variable.start is not None:
        values = {item.get("value") for item in variable.declared.all("Item")}
        if variable.start not in values:
            problem = f"start='{variable.start}' is the value of no item of '{name}'"
            yield Finding("enumeration-start", variable.place, problem, "start with one of the items")


def _unit(description: Description, variable: ScalarVariable) -> Iterator[Finding]:
    unit, shown = variable.attribute("unit"), variable.attribute("displayUnit")
    if variable.value.attributes.get("unit", "absent").strip() == "":
        problem = "unit='' is a unit without a name"
        yield Finding("unit-undefined", variable.place, problem, "leave the unit away for pure numbers")
    elif unit and unit not in description.units:
        yield Finding(
            "unit-undefined", variable.place, f"the unit '{unit}' is not defined", "add it to UnitDefinitions"
        )
    elif shown and not unit:
        yield Finding("display-unit", variable.place, f"displayUnit='{shown}' without a unit", "give the unit too")
    elif shown and shown not in {d.get("name") for d in description.units[unit].all("DisplayUnit")}:
        problem = f"the displayUnit '{shown}' is none of the unit '{unit}'"
        yield Finding("display-unit", variable.place, problem, "add a DisplayUnit with its factor")


def _derivative(description: Description, variable: ScalarVariable) -> Iterator[Finding]:
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
    yield from _derivative_unit(description, state, variable)


def _derivative_unit(description: Description, state: ScalarVariable, variable: ScalarVariable) -> Iterator[Finding]:
    """The unit of a derivative is that of its state per second."""
    units = [description.units.get(v.attribute("unit")) for v in (state, variable)]
    bases = [unit.child("BaseUnit") if unit is not None else None for unit in units]
    if bases[0] is not None and bases[1] is not None and not _is_rate(bases[0], bases[1]):
        names = [v.attribute("unit") for v in (variable, state)]
        problem = f"its unit '{names[0]}' is not that of '{state.name}', '{names[1]}', per second"
        yield Finding("derivative-unit", variable.place, problem, "correct one of them", "warning")


def _is_rate(state: Element, rate: Element) -> bool:
    """Whether the base unit ``rate`` is ``state`` per second."""
    exponents = [{base: number(e.get(base, "0")) for base in _BASE} for e in (state, rate)]
    exponents[0]["s"] -= 1
    factors = [number(e.get("factor", "1")) for e in (state, rate)]
    return exponents[0] == exponents[1] and math.isclose(*factors, rel_tol=1e-6)


def _settings(description: Description, variable: ScalarVariable) -> Iterator[Finding]:
    """Attributes that say something about certain variables only."""
    if variable.value.get("reinit") in ("true", "1") and variable.index not in description.states:
        yield Finding("reinit", variable.place, "reinit for a variable that is no state", "remove it")
    if "canHandleMultipleSetPerTimeInstant" in variable.element.attributes and variable.causality != "input":
        problem = "canHandleMultipleSetPerTimeInstant for a variable that is no input"
        yield Finding("multiple-set", variable.place, problem, "remove it")


def _independent(description: Description) -> Iterator[Finding]:
    independent = [v for v in description.variables if v.causality == "independent"]
    for variable in independent[1:]:
        problem = f"'{independent[0].name}' is an independent variable already"
        yield Finding("independent", variable.place, problem, "keep one")
    for variable in independent:
        if variable.type != "Real":
            yield Finding("independent", variable.place, f"the independent variable is {variable.type}", "make it Real")


def _aliases(group: list[ScalarVariable]) -> Iterator[Finding]:
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


def _alias_values(group: list[ScalarVariable]) -> Iterator[Finding]:
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
