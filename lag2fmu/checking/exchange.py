"""Trials of model exchange that both versions share: events, vectors beside variables, states that are set."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from time import monotonic

from lag2fmu.checking.binding import bits
from lag2fmu.checking.description import Variable
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.session import MOST_EVENTS, Iteration, Model, Session, endless

_MOST_STEPS, _MOST_EVENTS = 640, 2
"""Steps, and events among them, that a trial looks at."""
_PATIENCE = 3.0
"""Time (s) for a trial to wait for an event."""
_LATE = 1e-9
"""Of a step: times that differ by less are one."""


def events_of_exchange(model: Model) -> Iterator[Finding]:
    """Model exchange: event iterations say what they change, end where nothing changes, and tell times to come.

    Source: FMI 2.0.5 specification, section 3.2.2 (fmi2NewDiscreteStates); FMI 3.0.2 specification, section 2.3.5.
    """
    if model.kind != "ModelExchange":
        return
    begun, events = monotonic(), 0
    with model.session() as session:
        session.start()
        if session.next_event < session.time - _LATE * model.step:
            yield past_event(model, session.next_event, session.time)
        for _ in range(_MOST_STEPS):
            if session.euler():
                found = _iterations(session)
                yield from found
                if found:
                    return
                session.go_on()
                events += 1
            if events >= _MOST_EVENTS or monotonic() > begun + _PATIENCE:
                return


def _iterations(session: Session) -> list[Finding]:
    """What is wrong with the iterations of an event, the first of its kind; Event Mode is entered.

    Raises RecursionError where they do not come to an end.
    """
    session.instance.do("EnterEventMode")
    entered = states_of(session)
    for _ in range(MOST_EVENTS):
        found, told = iteration_findings(session, entered)
        if found is not None:
            return [found]
        if not told.again:
            break
    else:
        raise RecursionError(endless(session.time))
    if told.next_defined and told.next_time < session.time - _LATE * session.model.step:
        return [past_event(session.model, told.next_time, session.time)]
    return []


def past_event(model: Model, event: float, time: float) -> Finding:
    """A time event (s) that is told of at a later ``time`` (s)."""
    problem = f"the next time event is at {event:.17g} s, before t = {time:.17g} s"
    return Finding("next-event", model.kind, problem, "give a time to come")


def iteration_findings(session: Session, entered: Sequence[float]) -> tuple[Finding | None, Iteration]:
    """What is wrong with one event iteration of model exchange, and its results.

    ``entered`` are the states when Event Mode was entered: a change since then may be told of in every iteration, for
    importers that look at the last one only.
    """
    before = states_of(session)
    told = session.update()
    changed = bits(states_of(session)) != bits(before)
    kind = session.model.kind
    if changed and not told.values_changed:
        problem = "an event iteration changes continuous states without valuesOfContinuousStatesChanged"
        remedy = "say so, or the importer goes on from old values"
        return Finding("values-changed", kind, problem, remedy), told
    if told.values_changed and bits(states_of(session)) == bits(entered) and not changed:
        problem = "says valuesOfContinuousStatesChanged where nothing has changed"
        return Finding("values-changed", kind, problem, "say so for real changes only", "warning"), told
    return None, told


def states_of(session: Session) -> list[float]:
    """The continuous states of model exchange; none of co-simulation."""
    if session.model.kind != "ModelExchange":
        return []
    return session.instance.vector("GetContinuousStates", session.model.state_count)


def vector_findings(session: Session, vectors: Sequence[tuple[str, Sequence[Variable]]]) -> Iterator[Finding]:
    """What a function gives as a vector are the values of its variables, in their order: at the start and after steps.

    ``vectors`` are (function without prefix, its variables).
    """
    for _ in range(2):
        differing = [name for name, listed in vectors if _differ(session, name, listed)]
        for name in differing:
            problem = f"{session.model.prefix}{name} differs from the variables in the order of ModelStructure"
            yield Finding("vector-order", session.model.kind, problem, "write the elements in that order")
        if differing:
            return
        session.steps(5)


def _differ(session: Session, function: str, listed: Sequence[Variable]) -> bool:
    if not all(v.type in ("Real", "Float64") for v in listed):
        return False
    single = session.numbers(listed)
    return bits(session.instance.vector(function, len(single))) != bits(single)


def states_set(model: Model) -> Iterator[Finding]:
    """Model exchange: states that are set are read back, and derivatives are those of the new states at once.

    Source: FMI 2.0.5 specification, section 3.2.1; FMI 3.0.2 specification, section 3.2.1 (SetContinuousStates).
    """
    if model.kind != "ModelExchange" or not model.state_count:
        return
    with model.session() as session:
        session.start()
        x = states_of(session)
        other = [value + 0.01 * max(abs(value), 0.1) for value in x]
        before = session.instance.vector(session.rates, len(x))
        session.move(other)
        if bits(states_of(session)) != bits(other):
            problem = f"{model.prefix}GetContinuousStates does not give what was set"
            yield Finding("read-back", model.kind, problem, "keep all states as they are set")
        after = session.instance.vector(session.rates, len(x))
    with model.session() as fresh:
        fresh.start()
        fresh.move(other)
        expected = fresh.instance.vector(fresh.rates, len(x))
    if bits(after) == bits(before) != bits(expected):
        problem = f"{model.prefix}{session.rates} gives old values after new states were set"
        yield Finding("stale", model.kind, problem, "compute values anew where anything they depend on has changed")


def integrator_step(model: Model) -> Iterator[Finding]:
    """Model exchange: a completed integrator step leaves the continuous states as they are.

    Source: FMI 2.0.5 and 3.0.2 specifications, section 3.2.1 (CompletedIntegratorStep).
    """
    if model.kind != "ModelExchange" or not model.state_count:
        return
    with model.session() as session:
        session.start().steps(1)
        before = states_of(session)
        if not session.completed() and bits(states_of(session)) != bits(before):
            problem = f"{model.prefix}CompletedIntegratorStep changes continuous states"
            yield Finding("integrator-step", model.kind, problem, "change states in Event Mode only")
