"""Rules on a variable that both versions have: name, bounds, type, unit; what schema and fmpy leave open."""

from __future__ import annotations

import math
from collections.abc import Iterator

from lag2fmu.checking.description import FmuDescription, Variable, number
from lag2fmu.checking.findings import Finding
from lag2fmu.xml_tree import XmlElement

_BASE = ("kg", "m", "s", "A", "K", "mol", "cd")
"""The base units that a derivative is compared in; rad counts as 1."""

_FREE = "exact approx calculated"
_ALLOWED = {
    **dict.fromkeys([(c, v) for c in ("structuralParameter", "parameter") for v in ("fixed", "tunable")], "exact"),
    **dict.fromkeys([("input", "discrete"), ("input", "continuous")], "exact"),
    **dict.fromkeys([("output", "constant"), ("local", "constant")], "exact"),
    **dict.fromkeys([(c, v) for c in ("output", "local") for v in ("discrete", "continuous")], _FREE),
    **dict.fromkeys(
        [(c, v) for c in ("calculatedParameter", "local") for v in ("fixed", "tunable")], "approx calculated"
    ),
    ("independent", "continuous"): "",
}
"""(causality, variability) -> what 'initial' may be (FMI 2.0.5, section 2.2.7; FMI 3.0.2, section 2.4.7)."""


def combination_findings(variable: Variable, section: str) -> Iterator[Finding]:
    """Causality, variability and initial that do not go together, by the tables in the ``section`` of the standard.

    Source: FMI 2.0.5 specification, section 2.2.7; FMI 3.0.2 specification, section 2.4.7.
    """
    pair = variable.causality, variable.variability
    remedy = f"see the tables in section {section} of the standard"
    if pair not in _ALLOWED:
        problem = f"causality='{pair[0]}' with variability='{pair[1]}'"
        yield Finding("combination", variable.place, problem, remedy)
    elif variable.initial and variable.initial not in _ALLOWED[pair]:
        problem = f"initial='{variable.initial}' for a {pair[1]} {pair[0]}"
        yield Finding("combination", variable.place, problem, remedy)


def common_findings(description: FmuDescription, variable: Variable) -> Iterator[Finding]:
    """The broken rules on one variable.

    Source: FMI 2.0.5 specification, section 2.2.7; FMI 3.0.2 specification, section 2.4.7.
    """
    yield from _name(variable)
    yield from _values(variable)
    yield from _type(description, variable)
    yield from _unit(description, variable)


def _name(variable: Variable) -> Iterator[Finding]:
    if not variable.name.strip():
        yield Finding("name-empty", variable.place, "a variable without a name", "name it")
    elif variable.name != variable.name.strip():
        yield Finding("name-blank", variable.place, "the name begins or ends with a blank", "remove it", "warning")


def _values(variable: Variable) -> Iterator[Finding]:
    low, high = (variable.number(name) for name in ("min", "max"))
    outside = [x for text in variable.starts if (x := number(text)) < low or x > high]
    if low > high:
        yield Finding("min-max", variable.place, f"min = {low:g} is greater than max = {high:g}", "swap them")
    elif outside:
        bounds = ", ".join(f"{n} = {x:g}" for n, x in (("min", low), ("max", high)) if not math.isnan(x))
        problem = f"start = {outside[0]:g} is outside of {bounds}"
        yield Finding("start-range", variable.place, problem, "correct one of them")
    if variable.value.get("nominal") and not number(variable.value.get("nominal")) > 0:
        problem = f"nominal='{variable.value.get('nominal')}' is not positive"
        yield Finding("nominal", variable.place, problem, "give the size its values have")


def _type(description: FmuDescription, variable: Variable) -> Iterator[Finding]:
    name = variable.value.attributes.get("declaredType")
    if name is None:
        return
    if variable.declared is None:
        problem = f"declaredType='{name}' is not among the TypeDefinitions"
        yield Finding("type-undefined", variable.place, problem, "define it or remove the attribute")
    elif variable.declared.tag.removesuffix("Type") != variable.type:
        problem = f"{variable.type} with declaredType='{name}', which is of {variable.declared.tag}"
        yield Finding("type-kind", variable.place, problem, "declare a type of the same kind")
    elif variable.type == "Enumeration" and variable.start is not None:
        values = {item.get("value") for item in variable.declared.all("Item")}
        if set(variable.starts) - values:
            problem = f"start='{variable.start}' is the value of no item of '{name}'"
            yield Finding("enumeration-start", variable.place, problem, "start with one of the items")


def _unit(description: FmuDescription, variable: Variable) -> Iterator[Finding]:
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


def rate_findings(description: FmuDescription, state: Variable, variable: Variable) -> Iterator[Finding]:
    """The unit of a derivative is that of its state per second."""
    units = [description.units.get(v.attribute("unit")) for v in (state, variable)]
    bases = [unit.child("BaseUnit") if unit is not None else None for unit in units]
    if bases[0] is not None and bases[1] is not None and not _is_rate(bases[0], bases[1]):
        names = [v.attribute("unit") for v in (variable, state)]
        problem = f"its unit '{names[0]}' is not that of '{state.name}', '{names[1]}', per second"
        yield Finding("derivative-unit", variable.place, problem, "correct one of them", "warning")


def _is_rate(state: XmlElement, rate: XmlElement) -> bool:
    """Whether the base unit ``rate`` is ``state`` per second."""
    exponents = [{base: number(e.get(base, "0")) for base in _BASE} for e in (state, rate)]
    exponents[0]["s"] -= 1
    factors = [number(e.get("factor", "1")) for e in (state, rate)]
    return exponents[0] == exponents[1] and math.isclose(*factors, rel_tol=1e-6)
