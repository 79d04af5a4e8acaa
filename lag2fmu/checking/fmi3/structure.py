"""Rules on ModelStructure (FMI 3.0.2, section 2.4.8)."""

from __future__ import annotations

from collections.abc import Iterator

from lag2fmu.archives import DESCRIPTION
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.fmi3.description import FLOATS, STRUCTURE, Description3, Unknown3, Variable3


def structure_findings(description: Description3) -> Iterator[Finding]:
    """The broken rules on the five lists and on their dependencies.

    Source: FMI 3.0.2 specification, section 2.4.8 (ModelStructure).
    """
    for group in STRUCTURE:
        yield from _list(description, group)
    yield from _outputs(description)
    yield from _initial_unknowns(description)
    yield from _derivatives(description)
    yield from _clocked_states(description)
    yield from _indicators(description)
    for unknown in description.unknowns():
        variable = description.by_reference.get(unknown.reference)
        if variable is not None:
            yield from _form(description, unknown)
            yield from _kinds(unknown, variable)
            yield from _knowns(description, unknown, variable)


def _list(description: Description3, group: str) -> Iterator[Finding]:
    """Value references of variables, each once."""
    seen: set[int] = set()
    for unknown in description.structure(group):
        if unknown.reference not in description.by_reference:
            problem = "no variable has this value reference"
            yield Finding("structure-reference", unknown.place, problem, "list value references, not indices")
        elif unknown.reference in seen:
            yield Finding("structure-duplicate", unknown.place, "is listed already", "list it once")
        seen.add(unknown.reference)


# ------------------------------------------------------------------------------------------------------------ sets


def _outputs(description: Description3) -> Iterator[Finding]:
    expected = {v.reference for v in description.variables if v.causality == "output"}
    listed = {u.reference for u in description.structure("Output")}
    yield from _missing(description, "Output", expected - listed, "list each variable of causality 'output'")
    yield from _surplus(description, "Output", listed - expected, "only variables of causality 'output' stand here")


def _initial_unknowns(description: Description3) -> Iterator[Finding]:
    derivatives = {v.reference for v in description.listed("ContinuousStateDerivative")}
    candidates = derivatives | set(description.states)
    expected = {
        v.reference
        for v in description.variables
        if v.causality == "calculatedParameter"
        or ((v.causality == "output" or v.reference in candidates) and v.initial in ("approx", "calculated"))
    }
    listed = {u.reference for u in description.structure("InitialUnknown")}
    free = {v.reference for v in description.variables if v.type == "Clock" or "clocks" in v.element.attributes}
    rule = "these are outputs, states and derivatives with initial 'approx' or 'calculated', and calculated parameters"
    yield from _missing(description, "InitialUnknown", expected - listed - free, f"add them: {rule}")
    yield from _surplus(description, "InitialUnknown", listed - expected - free, f"remove them: {rule}")


def _missing(description: Description3, group: str, references: set[int], remedy: str) -> Iterator[Finding]:
    if references:
        place = f"{DESCRIPTION} <{group}>"
        yield Finding(_rule(group), place, f"lacks {_shown(description, references)}", remedy)


def _surplus(description: Description3, group: str, references: set[int], remedy: str) -> Iterator[Finding]:
    known = {r for r in references if r in description.by_reference}
    if known:
        place = f"{DESCRIPTION} <{group}>"
        yield Finding(_rule(group), place, f"should not list {_shown(description, known)}", remedy)


def _rule(group: str) -> str:
    return "outputs" if group == "Output" else "initial-unknowns"


def _shown(description: Description3, references: set[int]) -> str:
    names = [f"'{description.by_reference[r].name}' ({r})" for r in sorted(references)]
    return ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")


def _derivatives(description: Description3) -> Iterator[Finding]:
    """The derivatives of the continuous states."""
    owners: dict[int, int] = {}
    for unknown in description.structure("ContinuousStateDerivative"):
        variable = description.by_reference.get(unknown.reference)
        if variable is None:
            continue
        if variable.derivative is None:
            problem = f"'{variable.name}' has no attribute 'derivative'"
            yield Finding("derivatives", unknown.place, problem, "say which state it derives")
            continue
        if owners.setdefault(variable.derivative, variable.reference) != variable.reference:
            problem = f"its state {variable.derivative} has the derivative {owners[variable.derivative]} already"
            yield Finding("derivatives", unknown.place, problem, "list one derivative of each state")
        state = description.by_reference.get(variable.derivative)
        if state is not None and state.causality not in ("local", "output"):
            problem = f"the state '{state.name}' has causality='{state.causality}'"
            yield Finding("derivatives", unknown.place, problem, "states are local variables or outputs")


def _clocked_states(description: Description3) -> Iterator[Finding]:
    listed = {u.reference for u in description.structure("ClockedState")}
    for unknown in description.structure("ClockedState"):
        variable = description.by_reference.get(unknown.reference)
        if variable is not None and variable.previous is None:
            problem = f"'{variable.name}' has no attribute 'previous'"
            yield Finding("clocked-state", unknown.place, problem, "name the variable with its previous value")
    for variable in description.variables:
        if variable.previous is not None and variable.reference not in listed:
            problem = "has a previous value, but is no ClockedState of ModelStructure"
            yield Finding("clocked-state", variable.place, problem, "list it")


def _indicators(description: Description3) -> Iterator[Finding]:
    for unknown in description.structure("EventIndicator"):
        variable = description.by_reference.get(unknown.reference)
        if variable is None:
            continue
        if not variable.is_continuous:
            problem = f"the event indicator '{variable.name}' is {variable.variability} {variable.type}"
            yield Finding("event-indicator", unknown.place, problem, "indicators are continuous floats")
        elif variable.causality not in ("local", "output"):
            problem = f"the event indicator '{variable.name}' has causality='{variable.causality}'"
            yield Finding("event-indicator", unknown.place, problem, "indicators are local variables or outputs")


# ---------------------------------------------------------------------------------------------------- dependencies


def _form(description: Description3, unknown: Unknown3) -> Iterator[Finding]:
    dependencies = unknown.dependencies or ()
    if len(set(dependencies)) < len(dependencies):
        yield Finding("dependencies-duplicate", unknown.place, "a dependency is listed twice", "list it once")
    for reference in dependencies:
        if reference not in description.by_reference:
            problem = f"no variable has the value reference {reference} of a dependency"
            yield Finding("dependencies-reference", unknown.place, problem, "list value references, not indices")


def _kinds(unknown: Unknown3, variable: Variable3) -> Iterator[Finding]:
    if unknown.kinds is None:
        return
    kinds = unknown.kinds
    if unknown.dependencies is None:
        yield Finding("kinds-length", unknown.place, "dependenciesKind without dependencies", "give both or none")
    elif len(kinds) != len(unknown.dependencies):
        problem = f"{len(kinds)} dependenciesKind for {len(unknown.dependencies)} dependencies"
        yield Finding("kinds-length", unknown.place, problem, "give one for each")
    if unknown.group == "InitialUnknown" and (others := set(kinds) - {"dependent", "constant"}):
        problem = f"dependenciesKind '{min(others)}' of an InitialUnknown"
        yield Finding("kinds-initial", unknown.place, problem, "only 'dependent' and 'constant' may stand there")
    if variable.type not in FLOATS and set(kinds) - {"dependent"}:
        problem = f"a factor for '{variable.name}', which is {variable.type}"
        remedy = "factors are for floating point numbers; use 'dependent'"
        yield Finding("kinds-type", unknown.place, problem, remedy, "warning")


def _knowns(description: Description3, unknown: Unknown3, variable: Variable3) -> Iterator[Finding]:
    """What an unknown may depend on: inputs, parameters, time and states; at initialization what is exact."""
    states = set(description.states)
    for reference in unknown.dependencies or ():
        known = description.by_reference.get(reference)
        if known is None or known.causality in ("input", "independent") or known.type == "Clock":
            continue
        if known is variable:
            if unknown.group == "InitialUnknown" or reference not in states | _clocked(description):
                problem = f"'{variable.name}' depends on itself"
                yield Finding("self-dependency", unknown.place, problem, "list what it is computed from")
        elif unknown.group == "InitialUnknown":
            if known.initial != "exact":
                problem = f"the dependency '{known.name}' has initial='{known.initial}'"
                yield Finding("dependency-known", unknown.place, problem, "list inputs, time and exact variables only")
        elif not (
            reference in states or known.causality in ("parameter", "structuralParameter") or _is_discrete(known)
        ):
            problem = f"the dependency '{known.name}' ({known.variability} {known.causality}) is no known"
            yield Finding("dependency-known", unknown.place, problem, "list inputs, parameters, time and states only")


def _is_discrete(known: Variable3) -> bool:
    """Whether it may be a discrete state, which nothing declares where there are no clocks."""
    return known.variability == "discrete" and known.causality in ("local", "output")


def _clocked(description: Description3) -> set[int]:
    return {u.reference for u in description.structure("ClockedState")}
