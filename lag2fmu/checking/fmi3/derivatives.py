"""Directional derivatives against differences of the FMU itself, adjoint ones against directional ones."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass

from lag2fmu.checking.away import Values, give, later_values, lead_away, moved_parameters
from lag2fmu.checking.binding import RefusedError
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
from lag2fmu.checking.fmi3.description import Variable3
from lag2fmu.checking.fmi3.session import Model3, Session3, size_of

_MOST_KNOWNS, _MOST_UNKNOWNS = 16, 60
"""The entries along which, and the variables of which, derivatives are compared: enough to meet each kind."""


@dataclass(frozen=True)
class Mode3:
    """A mode in which derivatives are asked for, the unknowns and knowns there, and whether they are ``compared``.

    ``away`` says that it is reached by some steps; where these end elsewhere, ``values`` are set.
    """

    mode: str
    unknowns: Sequence[Variable3]
    knowns: Sequence[Variable3]
    compared: bool
    away: bool = False
    values: Values = ()

    def reach(self, session: Session3) -> None:
        """Lead a new session there. Raises RefusedError, and RecursionError where events do not come to rest."""
        if self.mode == "Initialization Mode":
            give(session.enter(), self.values)
            return
        session.start()
        if self.away:
            lead_away(session)
        if self.mode == "Step Mode":
            session.step()
        elif self.mode == "Event Mode":
            session.instance.do("EnterEventMode")


def _places(model: Model3) -> Iterator[Mode3]:
    """The modes to look at. Knowns that no unknown depends on are left out: importers do not ask for them."""
    description = model.description
    everything = any(u.dependencies is None for u in description.unknowns())
    listed = {r for u in description.unknowns() for r in u.dependencies or ()} | set(description.states)
    inputs = [v for v in model.of("input") if v.is_continuous]
    exact = [v for v in model.states if v.initial == "exact"]
    parameters = [v for v in model.of("parameter") if everything or v.reference in listed]
    first = _numbers(description.listed("InitialUnknown"))
    initial = _few([*exact, *inputs, *parameters])
    yield Mode3("Initialization Mode", first, initial, compared=True)
    later = _numbers([*description.listed("Output"), *description.listed("ContinuousStateDerivative")])
    if model.kind == "ModelExchange":
        for away in (False, True):
            yield Mode3("Continuous-Time Mode", later, _few([*model.states, *inputs]), compared=True, away=away)
        tunable = [v for v in parameters if v.variability == "tunable"]
        yield Mode3("Event Mode", later, _few([*tunable, *inputs]), compared=True)
    else:
        yield Mode3("Step Mode", later, _few([*model.states, *inputs]), compared=False)
        yield from _middle(model, first, initial)


def _middle(model: Model3, unknowns: Sequence[Variable3], knowns: Sequence[Variable3]) -> Iterator[Mode3]:
    """Initialization Mode with the values of the middle of a run, or other parameters, if the FMU comes there."""
    for elsewhere in (later_values, moved_parameters):
        with suppress(RefusedError, RecursionError):
            values = elsewhere(model)
            yield Mode3("Initialization Mode", unknowns, knowns, compared=True, away=True, values=values)


def _numbers(variables: Sequence[Variable3]) -> list[Variable3]:
    """The Float64 variables among some, each once, and not too many of them."""
    found = {v.reference: v for v in variables if v.type == "Float64" and v.variability != "discrete" and v.readable}
    return list(found.values())[:_MOST_UNKNOWNS]


def _few(variables: Sequence[Variable3]) -> list[Variable3]:
    """The first of some Float64 variables with a bounded number of elements in all."""
    found: list[Variable3] = []
    for v in variables:
        if v.type == "Float64" and v.readable and size_of(found) + v.size <= _MOST_KNOWNS:
            found.append(v)
    return found


def directional(model: Model3) -> Iterator[Finding]:
    """fmi3GetDirectionalDerivative in every mode; one call for several knowns is the sum of one for each.

    What varies with a known lists it as a dependency, also where there is no such function.
    Source: FMI 3.0.2 specification, sections 2.2.11 (fmi3GetDirectionalDerivative) and 2.4.8 (dependencies).
    """
    for place in _places(model):
        try:
            for known in place.knowns if place.unknowns and (place.compared or _provided(model)) else ():
                yield from _along(model, place, known)
            if _provided(model):
                yield from _summed(model, place)
        except (RefusedError, RecursionError):
            if not place.away:
                raise  # elsewhere the point may be none that the FMU knows


def _provided(model: Model3) -> bool:
    return model.can("providesDirectionalDerivatives")


def _along(model: Model3, place: Mode3, known: Variable3) -> Iterator[Finding]:
    """The derivatives by the elements of one known."""
    with model.session() as session:
        place.reach(session)
        for element in range(known.size):
            try:
                given = _column(session, place.unknowns, known, element) if _provided(model) else None
            except RefusedError as refused:
                problem = f"for '{known.name}' in {place.mode}, {refused}"
                yield Finding("directional", model.kind, problem, "answer for every unknown and known")
                return
            if place.compared:
                try:
                    yield from _compared(session, place, known, element, given)
                except RefusedError:  # a start that was moved alone: by constraints or into a contact
                    session.instance.do("Reset")
                    place.reach(session)


def _column(session: Session3, unknowns: Sequence[Variable3], known: Variable3, element: int) -> list[float]:
    """The derivatives of the elements of all ``unknowns`` by one element of ``known``."""
    seed = [float(i == element) for i in range(known.size)]
    which = [v.reference for v in unknowns]
    return session.instance.derivative("GetDirectionalDerivative", which, [known.reference], seed, size_of(unknowns))


def _shifted(session: Session3, place: Mode3, known: Variable3, element: int, by: float) -> bool:
    """Move one element of a known; False if the FMU does not take that."""
    states = session.model.states
    if place.mode == "Continuous-Time Mode" and known in states:
        x = session.instance.vector("GetContinuousStates", size_of(states))
        x[size_of(states[: states.index(known)]) + element] += by
        session.move(x)
        return True
    values = session.get(known)
    values[element] += by
    return session.set(known, values)


def _differences(session: Session3, place: Mode3, known: Variable3, element: int, step: float) -> list[Sides] | None:
    """The derivatives by differences; the known gets its value back. None if it cannot be moved."""
    here, found = session.numbers(place.unknowns), []
    for by in (step, -2 * step):
        if not _shifted(session, place, known, element, by):
            return None
        found.append(session.numbers(place.unknowns))
    _shifted(session, place, known, element, step)
    return to_sides(here, found[0], found[1], step)


def _compared(
    session: Session3, place: Mode3, known: Variable3, element: int, given: Sequence[float] | None
) -> Iterator[Finding]:
    """What differences contradict: the derivatives, where they are ``given``, and the lists of dependencies.

    Raises RefusedError where the FMU has no values beside the known.
    """
    sizes = session.numbers(place.unknowns)
    step = STEP * _size(known, session.get(known)[element])
    fine, coarse = (_differences(session, place, known, element, h) for h in (step, 2 * step))
    if fine is None or coarse is None:
        return
    unlisted = _unlisted(session.model, place, known)
    greatest = max(map(abs, given or ()), default=0.0)
    owners = [(v, i) for v in place.unknowns for i in range(v.size)]
    for at, ((v, i), size) in enumerate(zip(owners, sizes, strict=True)):
        if v.reference in unlisted:
            if wanted(0.0, size, fine[at], coarse[at]) is not None:
                yield not_listed(v, known, place.mode)
        elif given is not None and (other := wanted(given[at], size, fine[at], coarse[at], greatest)) is not None:
            names = _element(v, i), _element(known, element)
            yield contradicted(session.model, place.mode, names, given[at], other)


def _unlisted(model: Model3, place: Mode3, known: Variable3) -> set[int]:
    """The unknowns, as value references, that have lists of dependencies for a place, but without a certain known."""
    initial = place.mode == "Initialization Mode"
    return {
        u.reference
        for u in model.description.unknowns()
        if u.dependencies is not None and (u.group == "InitialUnknown") == initial
        if known.reference not in (u.reference, *u.dependencies)
    }


def _size(known: Variable3, value: float) -> float:
    """What a step of a known is relative to: parameters may be as small as they like, others move about 0."""
    return abs(value) or 1.0 if known.causality == "parameter" else max(abs(value), 1.0)


def _element(v: Variable3, index: int) -> str:
    return f"{v.name}[{index + 1}]" if v.dimensions else v.name


def _columns(session: Session3, place: Mode3) -> list[list[float]]:
    """The derivatives by each element of all knowns."""
    return [_column(session, place.unknowns, known, i) for known in place.knowns for i in range(known.size)]


def _summed(model: Model3, place: Mode3) -> Iterator[Finding]:
    """All knowns in one call."""
    if not place.unknowns or len(place.knowns) < 2:
        return
    with model.session() as session:
        place.reach(session)
        try:
            columns = _columns(session, place)
        except RefusedError:  # said already
            return
        seed, which = weights(size_of(place.knowns)), [v.reference for v in place.unknowns]
        knowns = [v.reference for v in place.knowns]
        given = session.instance.derivative("GetDirectionalDerivative", which, knowns, seed, size_of(place.unknowns))
    rows = list(zip(*columns, strict=True))
    yield from product_findings(model, place.mode, "GetDirectionalDerivative", rows, seed, given)


def adjoint(model: Model3) -> Iterator[Finding]:
    """fmi3GetAdjointDerivative is the transpose of fmi3GetDirectionalDerivative.

    Source: FMI 3.0.2 specification, section 2.2.11 (fmi3GetAdjointDerivative).
    """
    if not (model.can("providesAdjointDerivatives") and model.can("providesDirectionalDerivatives")):
        return
    for place in _places(model):
        if not place.unknowns or not place.knowns:
            continue
        with model.session() as session:
            place.reach(session)
            seed = weights(size_of(place.unknowns))
            which, knowns = ([v.reference for v in some] for some in (place.unknowns, place.knowns))
            try:
                columns = _columns(session, place)
                given = session.instance.derivative("GetAdjointDerivative", which, knowns, seed, size_of(place.knowns))
            except RefusedError as refused:
                problem = f"in {place.mode}, {refused}"
                yield Finding("adjoint", model.kind, problem, "answer for every unknown and known")
                continue
        yield from product_findings(model, place.mode, "GetAdjointDerivative", columns, seed, given)
