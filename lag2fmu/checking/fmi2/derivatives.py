"""fmi2GetDirectionalDerivative and the lists of dependencies against central differences of the FMU itself."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass

from lag2fmu.checking.away import Values, give, later_values, lead_away, moved_parameters
from lag2fmu.checking.binding import RefusedError, doubles, references, room
from lag2fmu.checking.differences import (
    STEP,
    Sides,
    contradicted,
    not_listed,
    product_findings,
    to_sides,
    wanted,
    weights,
)
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.fmi2.description import ScalarVariable2
from lag2fmu.checking.fmi2.session import Model2, Session2

_MOST_KNOWNS, _MOST_UNKNOWNS = 12, 60
"""The variables along which, and of which, derivatives are compared: enough to meet each kind."""


@dataclass(frozen=True)
class Mode2:
    """A mode, the groups of ModelStructure whose unknowns are looked at there, and the knowns.

    ``away`` says that it is reached by some steps; where these end elsewhere, ``values`` are set.
    """

    mode: str
    groups: Sequence[str]
    knowns: Sequence[ScalarVariable2]
    away: bool = False
    values: Values = ()

    def reach(self, session: Session2) -> None:
        """Lead a new session there. Raises RefusedError, and RecursionError where events do not come to rest."""
        if self.mode == "Initialization Mode":
            give(session.enter(), self.values)
        else:
            session.start()
            if self.away:
                lead_away(session)

    def unknowns(self, model: Model2) -> list[ScalarVariable2]:
        """The continuous unknowns, not too many of them."""
        listed = (model.description.variable(u.index) for g in self.groups for u in model.description.structure(g))
        return [v for v in listed if v is not None and v.is_continuous][:_MOST_UNKNOWNS]

    def without(self, model: Model2, known: ScalarVariable2) -> set[int]:
        """The indices of the unknowns that have lists of dependencies, but without a certain known."""
        unknowns = (u for group in self.groups for u in model.description.structure(group))
        return {
            u.index for u in unknowns if u.dependencies is not None and known.index not in (u.index, *u.dependencies)
        }


def directional(model: Model2) -> Iterator[Finding]:
    """At the start and later, what varies with a known does so as the FMU says, and lists it as a dependency.

    In Continuous-Time Mode and in Initialization Mode; of co-simulation there is an answer after steps as well.
    Source: FMI 2.0.5 specification, sections 2.1.9 and 2.2.8.
    """
    for place in _places(model):
        for known in place.knowns if place.unknowns(model) else ():
            try:
                found = list(_along(model, place, known))
            except (RefusedError, RecursionError):
                if not place.away:
                    raise
                break  # the point is none that the FMU knows
            yield from found
            if any(f.rule == "directional" and "returned" in f.problem for f in found):
                break
        else:
            yield from _summed(model, place)
    if model.kind == "CoSimulation" and model.can("providesDirectionalDerivative"):
        yield from _after_a_step(model)


def _places(model: Model2) -> Iterator[Mode2]:
    inputs = [v for v in model.description.variables if v.causality == "input" and v.is_continuous]
    exact = [v for v in model.states if v.initial == "exact"]
    initial, first = ("InitialUnknowns",), (exact + inputs)[:_MOST_KNOWNS]
    yield Mode2("Initialization Mode", initial, first)
    if model.kind == "ModelExchange":
        later = (model.states + inputs)[:_MOST_KNOWNS]
        for away in (False, True):
            yield Mode2("Continuous-Time Mode", ("Outputs", "Derivatives"), later, away)
        return
    for elsewhere in (later_values, moved_parameters):
        with suppress(RefusedError, RecursionError):
            yield Mode2("Initialization Mode", initial, first, away=True, values=elsewhere(model))


def _along(model: Model2, place: Mode2, known: ScalarVariable2) -> Iterator[Finding]:
    """What is wrong with the derivatives by one known at one place."""
    unknowns = place.unknowns(model)
    with model.session() as session:
        place.reach(session)
        given = None
        if model.can("providesDirectionalDerivative"):
            try:
                given = _derivative(session, unknowns, [known], [1.0])
            except RefusedError as refused:
                problem = f"for '{known.name}' in {place.mode}, {refused}"
                remedy = "answer for every unknown and known of ModelStructure"
                severe = place.mode == "Continuous-Time Mode"
                yield Finding("directional", model.kind, problem, remedy, "error" if severe else "warning")
                return
        try:
            yield from _compared(session, place, known, given)
        except RefusedError:
            if known.initial != "exact" or place.mode != "Initialization Mode":
                raise
            # a start that was moved alone: by constraints or into a contact


def _summed(model: Model2, place: Mode2) -> Iterator[Finding]:
    """The answer to one call for several knowns is the sum of the answers for each."""
    if model.can("providesDirectionalDerivative") and place.unknowns(model) and len(place.knowns) > 1:
        with suppress(RefusedError, RecursionError), model.session() as session:
            place.reach(session)
            yield from _sum_findings(session, place)


def _sum_findings(session: Session2, place: Mode2) -> Iterator[Finding]:
    unknowns, knowns = place.unknowns(session.model), place.knowns
    columns = [_derivative(session, unknowns, [known], [1.0]) for known in knowns]
    seed = weights(len(knowns))
    given = _derivative(session, unknowns, knowns, seed)
    rows = list(zip(*columns, strict=True))
    yield from product_findings(session.model, place.mode, "GetDirectionalDerivative", rows, seed, given)


def _after_a_step(model: Model2) -> Iterator[Finding]:
    inputs = [v for v in model.description.variables if v.causality == "input" and v.type == "Real"]
    outputs = [v for v in model.description.variables if v.causality == "output" and v.is_continuous]
    if inputs and outputs:
        with model.session() as session:
            if session.start().step():
                _derivative(session, outputs, inputs[:1], [1.0])
    yield from ()


def _derivative(
    session: Session2, unknowns: Sequence[ScalarVariable2], knowns: Sequence[ScalarVariable2], seed: Sequence[float]
) -> list[float]:
    """The derivatives of ``unknowns`` along the ``seed`` of ``knowns`` as the FMU gives them: (len(unknowns),)."""
    values = room(len(unknowns))
    of, by = (references([v.reference for v in variables]) for variables in (unknowns, knowns))
    session.instance.do("GetDirectionalDerivative", of, len(unknowns), by, len(knowns), doubles(seed), values)
    return list(values)[: len(unknowns)]


def _differences(session: Session2, place: Mode2, known: ScalarVariable2, step: float) -> list[Sides] | None:
    """The same by differences; the known gets its value back. None if it cannot be moved."""
    unknowns, states = place.unknowns(session.model), session.model.states
    (value,) = session.get(known)
    here, found = session.numbers(unknowns), []
    for shifted in (value + step, value - step, value):
        if known in states and place.mode == "Continuous-Time Mode":
            x = session.instance.vector("GetContinuousStates", len(states))
            x[states.index(known)] = shifted
            session.move(x)
        elif not session.set(known, [shifted]):
            return None
        found.append(session.numbers(unknowns))
    return to_sides(here, found[0], found[1], step)


def _compared(
    session: Session2, place: Mode2, known: ScalarVariable2, given: Sequence[float] | None
) -> Iterator[Finding]:
    """What differences contradict: the derivatives, where they are ``given``, and the lists of dependencies.

    Raises RefusedError where the FMU has no values beside the known.
    """
    (value,) = session.get(known)
    unknowns = place.unknowns(session.model)
    sizes = session.numbers(unknowns)
    step = STEP * max(abs(value), 1.0)
    fine, coarse = (_differences(session, place, known, h) for h in (step, 2 * step))
    if fine is None or coarse is None:
        return
    unlisted = place.without(session.model, known)
    greatest = max(map(abs, given or ()), default=0.0)
    for i, (v, size) in enumerate(zip(unknowns, sizes, strict=True)):
        if v.index in unlisted:
            if wanted(0.0, size, fine[i], coarse[i]) is not None:
                yield not_listed(v, known, place.mode)
        elif given is not None and (other := wanted(given[i], size, fine[i], coarse[i], greatest)) is not None:
            yield contradicted(session.model, place.mode, (v.name, known.name), given[i], other)
