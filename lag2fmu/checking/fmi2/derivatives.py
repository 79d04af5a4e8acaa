"""fmi2GetDirectionalDerivative against central differences of the FMU itself."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from lag2fmu.checking.binding import RefusedError, doubles, references
from lag2fmu.checking.differences import STEP, Sides, to_sides, wanted
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.fmi2.description import ScalarVariable
from lag2fmu.checking.fmi2.session import Model2, Session2

_MOST_KNOWNS, _MOST_UNKNOWNS = 12, 60


def directional(model: Model2) -> Iterator[Finding]:
    """In Continuous-Time Mode or, for co-simulation, in Initialization Mode; there is an answer after steps as well.

    Source: FMI 2.0.5 specification, section 2.1.9.
    """
    if not model.can("providesDirectionalDerivative"):
        return
    knowns, unknowns = _knowns(model), _unknowns(model)
    for known in knowns if unknowns else ():
        with model.session() as session:
            session.enter() if model.kind == "CoSimulation" else session.start()
            try:
                given = _derivative(session, unknowns, known)
            except RefusedError as refused:
                where = "in Initialization Mode" if model.kind == "CoSimulation" else "in Continuous-Time Mode"
                problem = f"for '{known.name}' {where}, {refused}"
                remedy = "answer for every unknown and known of ModelStructure"
                severe = model.kind == "ModelExchange"
                yield Finding("directional", model.kind, problem, remedy, "error" if severe else "warning")
                break
            try:
                yield from _compared(session, unknowns, known, given)
            except RefusedError:
                if known.initial != "exact" or model.kind != "CoSimulation":
                    raise
                # a start that was moved alone: by constraints or into a contact
    if model.kind == "CoSimulation":
        yield from _after_a_step(model)


def _after_a_step(model: Model2) -> Iterator[Finding]:
    inputs = [v for v in model.description.variables if v.causality == "input" and v.type == "Real"]
    outputs = [v for v in model.description.variables if v.causality == "output" and v.is_continuous]
    if inputs and outputs:
        with model.session() as session:
            if session.start().step():
                _derivative(session, outputs, inputs[0])
    yield from ()


def _knowns(model: Model2) -> list[ScalarVariable]:
    """States and continuous inputs; in Initialization Mode states that are exact."""
    description = model.description
    inputs = [
        v
        for v in description.variables
        if v.causality == "input" and v.type == "Real" and v.variability == "continuous"
    ]
    states = [s for d in model.derivatives if (s := description.variable(d.derivative)) is not None]
    if model.kind == "CoSimulation":
        states = [s for s in states if s.initial == "exact"]
    return (states + inputs)[:_MOST_KNOWNS]


def _unknowns(model: Model2) -> list[ScalarVariable]:
    """Continuous outputs and derivatives; in Initialization Mode those that are not exact."""
    groups = ("InitialUnknowns",) if model.kind == "CoSimulation" else ("Outputs", "Derivatives")
    listed = (model.description.variable(u.index) for group in groups for u in model.description.structure(group))
    found = [v for v in listed if v is not None and v.type == "Real" and v.variability == "continuous"]
    return found[:_MOST_UNKNOWNS]


def _derivative(session: Session2, unknowns: Sequence[ScalarVariable], known: ScalarVariable) -> list[float]:
    """The derivatives of ``unknowns`` by ``known`` as the FMU gives them: (len(unknowns),)."""
    values = doubles([0.0] * len(unknowns))
    which = references([v.reference for v in unknowns])
    session.instance.do(
        "GetDirectionalDerivative", which, len(unknowns), references([known.reference]), 1, doubles([1.0]), values
    )
    return list(values)[: len(unknowns)]


def _differences(
    session: Session2, unknowns: Sequence[ScalarVariable], known: ScalarVariable, step: float
) -> list[Sides]:
    """The same by differences; the known gets its value back."""
    which, model = [v.reference for v in unknowns], session.model
    (value,) = session.instance.get("Real", [known.reference])
    states = [model.description.variable(d.derivative) for d in model.derivatives]
    here, found = session.instance.get("Real", which), []
    for shifted in (value + step, value - step, value):
        if known in states and model.kind == "ModelExchange":
            x = session.instance.vector("GetContinuousStates", len(states))
            x[states.index(known)] = shifted
            session.instance.do("SetContinuousStates", doubles(x), len(x))
        else:
            session.instance.set_reals([known.reference], [shifted])
        found.append(session.instance.get("Real", which))
    return to_sides(here, found[0], found[1], step)


def _compared(
    session: Session2, unknowns: Sequence[ScalarVariable], known: ScalarVariable, given: Sequence[float]
) -> Iterator[Finding]:
    """The derivatives that differences contradict; raises RefusedError where the FMU has no values beside the known."""
    (value,) = session.instance.get("Real", [known.reference])
    sizes = session.instance.get("Real", [v.reference for v in unknowns])
    step = STEP * max(abs(value), 1.0)
    listed = {u.index: u.dependencies for u in session.model.description.unknowns() if u.dependencies is not None}
    fine, coarse = (_differences(session, unknowns, known, h) for h in (step, 2 * step))
    for v, size, own, near, far in zip(unknowns, sizes, given, fine, coarse, strict=True):
        other = wanted(own, size, near, far)
        if other is None:
            continue
        if known.index not in listed.get(v.index, (known.index,)):
            problem = f"'{v.name}' varies with '{known.name}', which is not among its dependencies"
            yield Finding("dependency-missing", v.place, problem, "list it", "warning")
        else:
            problem = f"d {v.name} / d {known.name} = {own:.6g}, but differences give {other:.6g}"
            yield Finding("directional", session.model.kind, problem, "check the derivative and the dependencies")
