"""Trials of what FMI 3.0 tells of the equations: derivatives of outputs, vectors of model exchange, dependencies."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from ctypes import byref, c_int, c_int32, c_size_t, c_uint

from lag2fmu.checking.binding import references, room
from lag2fmu.checking.description import whole
from lag2fmu.checking.exchange import vector_findings
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.fmi3.description import Variable3
from lag2fmu.checking.fmi3.session import Model3, Session3, size_of
from lag2fmu.checking.trials import equation_findings


def output_derivatives(model: Model3) -> Iterator[Finding]:
    """Co-simulation: derivatives of outputs are finite, and those of states are the state derivatives.

    Source: FMI 3.0.2 specification, section 4.2.1 (fmi3GetOutputDerivatives).
    """
    if model.kind != "CoSimulation":
        return
    order = whole(model.description.kinds[model.kind].get("maxOutputDerivativeOrder", "0"), 0)
    outputs = [v for v in model.of("output") if v.is_continuous]
    if order < 1 or not outputs:
        return
    with model.session() as session:
        if not session.start().step():
            return
        for each in range(1, order + 1):
            found = _output_derivatives(session, outputs, each)
            if not all(map(math.isfinite, found)):
                problem = f"a derivative of order {each} of an output is no finite number"
                yield Finding("output-derivatives", model.kind, problem, "declare the order that is given exactly")
        yield from _of_states(session, outputs)


def _of_states(session: Session3, outputs: Sequence[Variable3]) -> Iterator[Finding]:
    """Outputs that are states, whose first derivatives are variables too."""
    first = iter(_output_derivatives(session, outputs, 1))
    rates = {v.derivative: v for v in session.model.description.listed("ContinuousStateDerivative")}
    for v in outputs:
        given = [next(first) for _ in range(v.size)]
        expected = session.get(rates[v.reference]) if v.reference in rates else given
        if not all(math.isclose(a, b, rel_tol=1e-6, abs_tol=1e-9) for a, b in zip(given, expected, strict=False)):
            problem = f"d {v.name} / dt = {given[0]:.6g}, but its state derivative is {expected[0]:.6g}"
            remedy = "give the derivative at the end of the step"
            yield Finding("output-derivatives", session.model.kind, problem, remedy)


def _output_derivatives(session: Session3, outputs: Sequence[Variable3], order: int) -> list[float]:
    values, orders = room(size_of(outputs)), (c_int32 * len(outputs))(*[order] * len(outputs))
    which = references([v.reference for v in outputs])
    session.instance.do("GetOutputDerivatives", which, len(outputs), orders, values, size_of(outputs))
    return list(values)[: size_of(outputs)]


def equations(model: Model3) -> Iterator[Finding]:
    """Model exchange: counts, derivatives, indicators and nominal values, also as variables.

    Source: FMI 3.0.2 specification, sections 2.3.2, 2.3.3 and 3.2.
    """
    if model.kind != "ModelExchange":
        return
    states, indicators = model.states, model.description.listed("EventIndicator")
    with model.session() as session:
        for function, expected in (
            ("GetNumberOfContinuousStates", size_of(states)),
            ("GetNumberOfEventIndicators", size_of(indicators)),
        ):
            if (found := session.instance.count(function)) != expected:
                problem = f"fmi3{function} says {found}, but the variables listed have {expected} elements"
                yield Finding("counts", model.kind, problem, "count the elements of arrays")
                return
        session.start()
        yield from equation_findings(session, "GetContinuousStateDerivatives", size_of(states), size_of(indicators))
        derivatives = model.description.listed("ContinuousStateDerivative")
        yield from vector_findings(
            session,
            [
                ("GetContinuousStates", states),
                ("GetContinuousStateDerivatives", derivatives),
                ("GetEventIndicators", indicators),
            ],
        )


def dependencies(model: Model3) -> Iterator[Finding]:
    """What the FMU says of dependencies while it runs is what modelDescription.xml says.

    Source: FMI 3.0.2 specification, section 2.2.9 (fmi3GetVariableDependencies).
    """
    if not model.can("providesPerElementDependencies"):
        return
    with model.session() as session:
        yield from _dependencies(session.enter(), ("InitialUnknown",))
        session.instance.do("ExitInitializationMode")
        if session.has_events:
            session.rest()
            session.go_on()
        yield from _dependencies(session, ("Output", "ContinuousStateDerivative"))


def _dependencies(session: Session3, groups: Sequence[str]) -> Iterator[Finding]:
    description = session.model.description
    for unknown in (u for group in groups for u in description.structure(group)):
        variable = description.by_reference.get(unknown.reference)
        if variable is None or unknown.dependencies is None or not variable.readable:
            continue
        rows = _dependency_rows(session, variable)
        known = {reference for _, reference, _, _ in rows}
        differing = (known ^ set(unknown.dependencies)) - {variable.reference}  # its own may be left away
        if differing:
            shown = ", ".join(map(str, sorted(differing)[:5]))
            problem = f"fmi3GetVariableDependencies and the attribute differ in the value references {shown}"
            yield Finding("dependencies-differ", unknown.place, problem, "write both from one table")
        for own, reference, other, kind in rows:
            target = description.by_reference.get(reference)
            if target is None or own > variable.size or other > target.size or not 0 <= kind <= 5:
                problem = f"fmi3GetVariableDependencies answers element {own}, reference {reference}, element {other}"
                yield Finding("dependencies-element", unknown.place, problem, "elements count from 1; 0 means all")
                break


def _dependency_rows(session: Session3, variable: Variable3) -> list[tuple[int, int, int, int]]:
    """(element of the variable, value reference of the known, its element, kind) as the FMU tells them.

    Raises RefusedError.
    """
    count = c_size_t()
    session.instance.do("GetNumberOfVariableDependencies", variable.reference, byref(count))
    n = min(count.value, 1 << 20)
    own, other = ((c_size_t * max(n, 1))() for _ in range(2))
    knowns, kinds = (c_uint * max(n, 1))(), (c_int * max(n, 1))()
    session.instance.do("GetVariableDependencies", variable.reference, own, knowns, other, kinds, n)
    return list(zip(own, knowns, other, kinds, strict=True))[:n]
