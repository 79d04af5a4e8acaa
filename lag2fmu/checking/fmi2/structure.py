"""Rules on ModelStructure (FMI 2.0.5, section 2.2.8)."""

from __future__ import annotations

from collections.abc import Iterator

from lag2fmu.archives import DESCRIPTION
from lag2fmu.checking.findings import Finding, Severity
from lag2fmu.checking.fmi2.description import STRUCTURE, Description2, ScalarVariable2, Unknown2


def structure_findings(description: Description2) -> Iterator[Finding]:
    """The broken rules on the three lists and on their dependencies.

    Source: FMI 2.0.5 specification, section 2.2.8 (ModelStructure).
    """
    for group in STRUCTURE:
        yield from _list(description, group)
    yield from _sets(description)
    for unknown in description.unknowns():
        variable = description.variable(unknown.index)
        if variable is None:
            continue
        yield from _form(description, unknown)
        yield from _kinds(description, unknown, variable)
        yield from _knowns(description, unknown, variable)


def _list(description: Description2, group: str) -> Iterator[Finding]:
    """Indices of variables, each once; those of InitialUnknowns in order."""
    seen: set[int] = set()
    last = 0
    for unknown in description.structure(group):
        if description.variable(unknown.index) is None:
            problem = f"there are {len(description.variables)} variables"
            yield Finding("structure-index", unknown.place, problem, "indices count the ScalarVariables from 1")
        elif unknown.index in seen:
            yield Finding("structure-duplicate", unknown.place, "is listed already", "list it once")
        elif group == "InitialUnknowns" and unknown.index < last:
            yield Finding("initial-unknowns-order", unknown.place, f"comes after {last}", "sort them by index")
        seen.add(unknown.index)
        last = unknown.index


# ------------------------------------------------------------------------------------------------------------ sets


def _sets(description: Description2) -> Iterator[Finding]:
    listed = {group: {u.index for u in description.structure(group)} for group in STRUCTURE}
    outputs = {v.index for v in description.variables if v.causality == "output"}
    yield from _compared(description, "Outputs", listed["Outputs"], outputs, "are the variables of causality 'output'")
    yield from _derivatives(description, listed["Derivatives"])
    found = [v for i in listed["Derivatives"] if (v := description.variable(i)) is not None]
    candidates = outputs | {v.index for v in found} | {v.derivative for v in found}
    expected = {
        v.index
        for v in description.variables
        if v.causality == "calculatedParameter" or (v.index in candidates and v.initial in ("approx", "calculated"))
    }
    rule = "are outputs, states, derivatives with initial 'approx' or 'calculated', and calculated parameters"
    yield from _compared(description, "InitialUnknowns", listed["InitialUnknowns"], expected, rule)


def _compared(
    description: Description2, group: str, listed: set[int], expected: set[int], rule: str
) -> Iterator[Finding]:
    for indices, what, remedy in (
        (expected - listed, "lacks", "add them"),
        ({i for i in listed - expected if description.variable(i)}, "should not list", "remove them"),
    ):
        if indices:
            names = [f"'{v.name}' ({i})" for i in sorted(indices) if (v := description.variable(i)) is not None]
            shown = ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")
            rule_name = "outputs" if group == "Outputs" else "initial-unknowns"
            yield Finding(rule_name, f"{DESCRIPTION} <{group}>", f"{what} {shown}", f"{remedy}: these {rule}")


def _derivatives(description: Description2, listed: set[int]) -> Iterator[Finding]:
    owners: dict[int, int] = {}
    for unknown in description.structure("Derivatives"):
        variable = description.variable(unknown.index)
        if variable is None:
            continue
        if not variable.derivative:
            problem = f"'{variable.name}' has no attribute 'derivative'"
            yield Finding("derivatives", unknown.place, problem, "say which state it derives")
        elif owners.setdefault(variable.derivative, variable.index) != variable.index:
            problem = f"its state {variable.derivative} has the derivative {owners[variable.derivative]} already"
            yield Finding("derivatives", unknown.place, problem, "list one derivative of each state")
    if "ModelExchange" not in description.kinds:
        return
    for variable in description.variables:
        if variable.derivative and variable.index not in listed and variable.derivative not in owners:
            problem = "a derivative of model exchange that is not in ModelStructure/Derivatives"
            yield Finding("derivatives-unlisted", variable.place, problem, "list it if it is a state's", "warning")


# ---------------------------------------------------------------------------------------------------- dependencies


def _form(description: Description2, unknown: Unknown2) -> Iterator[Finding]:
    dependencies = unknown.dependencies or ()
    if len(set(dependencies)) < len(dependencies):
        yield Finding("dependencies-duplicate", unknown.place, "a dependency is listed twice", "list it once")
    elif list(dependencies) != sorted(dependencies):
        yield Finding("dependencies-order", unknown.place, "the dependencies are not in order", "sort them by index")
    for index in dependencies:
        if description.variable(index) is None:
            problem = f"the dependency {index} is the index of no variable"
            yield Finding("dependencies-index", unknown.place, problem, "indices count the ScalarVariables from 1")


def _kinds(description: Description2, unknown: Unknown2, variable: ScalarVariable2) -> Iterator[Finding]:
    kinds = unknown.kinds or ()
    if unknown.kinds is not None and len(kinds) != len(unknown.dependencies or ()):
        problem = f"{len(kinds)} dependenciesKind for {len(unknown.dependencies or ())} dependencies"
        yield Finding("kinds-length", unknown.place, problem, "give one for each")
    if unknown.group == "InitialUnknowns" and set(kinds) - {"dependent", "constant"}:
        problem = f"dependenciesKind '{min(set(kinds) - {'dependent', 'constant'})}' in InitialUnknowns"
        yield Finding("kinds-initial", unknown.place, problem, "only 'dependent' and 'constant' may stand there")
    if variable.type != "Real" and set(kinds) & {"constant", "fixed", "tunable"}:
        problem = f"a constant factor for '{variable.name}', which is {variable.type}"
        yield Finding("kinds-type", unknown.place, problem, "factors are for Reals; use 'dependent'", "warning")


def _knowns(description: Description2, unknown: Unknown2, variable: ScalarVariable2) -> Iterator[Finding]:
    """What an unknown may depend on: inputs, time and states; at initialization inputs, time and what is exact."""
    own_state = unknown.index in description.states and unknown.group == "Outputs"
    for index in unknown.dependencies or ():
        known = description.variable(index)
        if known is None or known.causality in ("input", "independent"):
            continue
        if index == unknown.index and not own_state:
            problem = f"'{variable.name}' depends on itself"
            yield Finding("self-dependency", unknown.place, problem, "list what it is computed from")
        elif unknown.group == "InitialUnknowns":
            yield from _initially_known(unknown, known)
        elif index not in description.states and known.variability != "discrete":
            yield _no_known(unknown, known)
    if own_state:
        yield from _state_output(unknown, variable)


def _no_known(unknown: Unknown2, known: ScalarVariable2) -> Finding:
    problem = f"the dependency '{known.name}' ({known.variability} {known.causality}) is no known"
    severity: Severity = "warning" if "arameter" in known.causality else "error"
    return Finding("dependency-known", unknown.place, problem, "list inputs, time and states only", severity)


def _initially_known(unknown: Unknown2, known: ScalarVariable2) -> Iterator[Finding]:
    if known.initial != "exact":
        problem = f"the dependency '{known.name}' has initial='{known.initial}'"
        yield Finding("dependency-known", unknown.place, problem, "list inputs, time and exact variables only")


def _state_output(unknown: Unknown2, variable: ScalarVariable2) -> Iterator[Finding]:
    """A state that is an output lists itself alone, as constant."""
    if unknown.dependencies is not None:
        kinds = dict(zip(unknown.dependencies, unknown.kinds or (), strict=False))
        if unknown.dependencies != (unknown.index,) or kinds.get(unknown.index, "constant") != "constant":
            problem = f"the state '{variable.name}' does not list just itself, as constant"
            remedy = "a state that is an output depends on itself with the factor 1"
            yield Finding("state-output", unknown.place, problem, remedy, "warning")
