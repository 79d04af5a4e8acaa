"""Trials of what is new in FMI 3.0: Event Mode and early return of co-simulation, updates in the middle of a step.

An event is the same, whoever handles it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from time import monotonic

from lag2fmu.checking.exchange import iteration_findings, past_event, states_of
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.fmi3.binding import ENVIRONMENT, Manner, Update
from lag2fmu.checking.fmi3.session import Model3, Session3, StepResults
from lag2fmu.checking.trials import STEPS, row_bits

_MOST_CALLS, _MOST_EVENTS = 80, 2
"""Calls of DoStep, and events among them, that a trial looks at."""
_PATIENCE = 3.0
"""Time (s) for a trial to wait for an event, or for a run."""
_BAR = 1e-3
"""Relative to the greatest value of an output and 1: how far outputs of two runs may be apart. Steps that begin at
events differ by the solver's error, which events amplify."""

Rows = list[tuple[float, list[float]]]


def step_results(model: Model3) -> Iterator[Finding]:
    """Co-simulation: what DoStep tells is what the importer said it can handle.

    Source: FMI 3.0.2 specification, section 4.2.1 (fmi3DoStep).
    """
    if model.kind != "CoSimulation":
        return
    manners = [model.usual]
    if model.can("hasEventMode"):
        manners += [Manner(events=True), Manner(events=True, early=True)]
    for manner in manners:
        with model.session(manner=manner) as session:
            for done in advanced(session.start(), _MOST_EVENTS):
                if found := next(_step_findings(model, manner, done), None):
                    yield found
                    break
                if done.event:
                    session.handle()


def advanced(session: Session3, events: int) -> Iterator[StepResults]:
    """Steps of co-simulation until there were some ``events``, the run ends, or time is up."""
    begun = monotonic()
    for _ in range(_MOST_CALLS):
        done = session.advance(session.model.step)
        yield done
        events -= done.event
        if events <= 0 or done.end or monotonic() > begun + _PATIENCE:
            return


def _step_findings(model: Model3, manner: Manner, done: StepResults) -> Iterator[Finding]:
    span = done.asked - done.begun
    if done.event and not manner.events:
        problem = "signals an event to an importer that handles none"
        yield Finding("event-signal", model.kind, problem, "handle events inside where eventModeUsed is false")
    if done.early and not manner.early:
        problem = "returns early to an importer that does not allow it"
        yield Finding("early-return", model.kind, problem, "go to the end of the step where it is not allowed")
    elif done.early and not model.can("mightReturnEarlyFromDoStep"):
        problem = "returns early, but mightReturnEarlyFromDoStep is not true"
        yield Finding("early-return", model.kind, problem, "declare it")
    if done.early and not done.begun - 1e-9 * span <= done.reached < done.asked:
        problem = f"returns early at {done.reached:.17g} s from a step from {done.begun:.17g} to {done.asked:.17g} s"
        yield Finding("last-time", model.kind, problem, "lastSuccessfulTime is where the step ended")
    loose = "fixedInternalStepSize" in model.description.kinds[model.kind].attributes
    if not done.early and not loose and not math.isclose(done.reached, done.asked, rel_tol=1e-9, abs_tol=1e-9 * span):
        problem = f"says lastSuccessfulTime = {done.reached:.17g} at the end of a step to {done.asked:.17g} s"
        yield Finding("last-time", model.kind, problem, "lastSuccessfulTime is where the step ended")


def event_mode(model: Model3) -> Iterator[Finding]:
    """Event Mode can be entered between steps, comes to rest at once where nothing happens, and keeps the values.

    Source: FMI 3.0.2 specification, sections 2.3.5 (Event Mode), 3.2.1 and 4.2.1.
    """
    if model.kind == "CoSimulation" and not model.can("hasEventMode"):
        return
    manner = Manner(events=True, early=True)
    with model.session(manner=manner) as session:
        session.start().steps(1)
        session.instance.do("EnterEventMode")
        entered = states_of(session)
        first = session.rest()
        if first.next_defined and first.next_time < session.time - 1e-9 * model.step:
            yield past_event(model, first.next_time, session.time)
        yield from _second_iteration(session, entered)
        for v in model.of("input"):
            if v.type == "Float64":
                session.instance.set(v.type, [v.reference], session.get(v))
        session.go_on()
        session.steps(1)


def _second_iteration(session: Session3, entered: list[float]) -> Iterator[Finding]:
    """An iteration after events have come to rest changes nothing and says so."""
    if session.model.kind == "ModelExchange":
        found, told = iteration_findings(session, entered)
        again = told.again
        if found is not None:
            yield found
    else:
        again = session.update().again
    if again:
        problem = "asks for another event iteration after the last one asked for none"
        yield Finding("event-rest", session.model.kind, problem, "clear discreteStatesNeedUpdate when nothing happens")


def saved_in_every_state(model: Model3) -> Iterator[Finding]:
    """A state that is saved before, in and after Initialization Mode and in Event Mode leads to the same run.

    Source: FMI 3.0.2 specification, sections 2.2.6 and 2.3.1.
    """
    if not model.saves:
        return
    manner = Manner(events=model.kind == "ModelExchange" or model.can("hasEventMode"))
    places = ["Instantiated", "Initialization Mode", *(["Event Mode"] if manner.events else [])]
    for place in places:
        with model.session(manner=manner) as session:
            _go_to(session, place)
            time, saved = session.time, session.instance.saved()
            expected = _go_on_from(session, place)
            session.instance.restore(saved)
            session.time = time
            if row_bits(_go_on_from(session, place)) != row_bits(expected):
                problem = f"a run from a state that was saved in {place} differs"
                yield Finding("state", model.kind, problem, "save everything, the mode too")
            session.instance.drop(saved)


def _go_to(session: Session3, place: str) -> None:
    if place == "Initialization Mode":
        session.enter()
    elif place == "Event Mode":
        session.start().steps(2)
        if session.model.kind == "CoSimulation":
            for _ in advanced(session, 1):
                pass
        session.instance.do("EnterEventMode")


def _go_on_from(session: Session3, place: str) -> list[list[object]]:
    if place == "Instantiated":
        session.enter()
    if place == "Event Mode":
        session.rest()
        session.go_on()
    else:
        session.instance.do("ExitInitializationMode")
        if session.has_events:
            session.rest()
            session.go_on()
    return session.steps(3)


def reset_everywhere(model: Model3) -> Iterator[Finding]:
    """fmi3Reset leads back from every state, and the run afterwards is that of a new instance.

    Source: FMI 3.0.2 specification, section 2.3.1 (fmi3Reset).
    """
    manner = Manner(events=model.kind == "ModelExchange" or model.can("hasEventMode"))
    with model.session(manner=manner) as session:
        expected = session.start().steps(STEPS)
        session.instance.do("Terminate")
        for place in ("Instantiated", "Initialization Mode", "Event Mode" if manner.events else "Instantiated"):
            session.instance.do("Reset")
            _go_to(session, place)
        session.instance.do("Reset")
        if row_bits(session.start().steps(STEPS)) != row_bits(expected):
            problem = "a run after fmi3Reset in other states differs from one of a new instance"
            yield Finding("reset", model.kind, problem, "reset to what fmi3Instantiate gives")


def intermediate_update(model: Model3) -> Iterator[Finding]:
    """Co-simulation: the FMU calls back within its steps, and returns early where that is asked and allowed.

    Source: FMI 3.0.2 specification, section 4.2.2 (Intermediate Update Mode).
    """
    if model.kind != "CoSimulation":
        return
    heard: list[Update] = []

    def hear(update: Update) -> bool:
        heard.append(update)
        return False

    wanted = [v.reference for v in model.of("output") if v.element.get("intermediateUpdate") == "true" and v.size == 1]
    manner = Manner(model.usual.events, update=hear, required=wanted)
    with model.session(manner=manner) as session:
        begun = session.start().time
        session.steps(2)
        yield from _updates(model, [u.time for u in heard], begun, session.time)
    if any(u.can_return for u in heard):
        problem = "offers an early return to an importer that does not allow it"
        yield Finding("early-return", model.kind, problem, "say canReturnEarly only where earlyReturnAllowed is true")
    if manner.environments - {ENVIRONMENT}:
        problem = "intermediateUpdate does not get the importer's instanceEnvironment"
        yield Finding("environment-pointer", model.kind, problem, "pass it on unchanged")
    if model.can("canReturnEarlyAfterIntermediateUpdate"):
        yield from _asked_to_return(model)


def _updates(model: Model3, times: list[float], begun: float, ended: float) -> Iterator[Finding]:
    """Whether the FMU called back as it declares, and at times (s) within its steps."""
    declared, slack = model.can("providesIntermediateUpdate"), 1e-9 * (ended - begun)
    if times and not declared:
        problem = "calls intermediateUpdate, but providesIntermediateUpdate is not true"
        yield Finding("intermediate-update", model.kind, problem, "declare it")
    elif declared and not times:
        problem = "does not call intermediateUpdate in two steps, but providesIntermediateUpdate is true"
        yield Finding("intermediate-update", model.kind, problem, "call it at the ends of solver steps", "warning")
    if times != sorted(times) or any(not begun - slack <= t <= ended + slack for t in times):
        problem = "calls intermediateUpdate at times that go back or lie outside of the step"
        yield Finding("intermediate-time", model.kind, problem, "give the time that the solver has reached")


def _asked_to_return(model: Model3) -> Iterator[Finding]:
    """The importer asks to return early as soon as it is offered."""
    asked: list[float] = []

    def update(said: Update) -> bool:
        if said.can_return:
            asked.append(said.time)
        return said.can_return

    with model.session(manner=Manner(model.usual.events, early=True, update=update)) as session:
        session.start()
        done = session.advance(model.step)
    if asked and asked[0] < done.asked - 1e-9 * (done.asked - done.begun) and not done.early:
        problem = f"goes on to the end of the step, though the importer asked to return at {asked[0]:.17g} s"
        yield Finding("early-return", model.kind, problem, "return where canReturnEarly was said and it is asked")


def same_run(model: Model3) -> Iterator[Finding]:
    """Outputs at communication points do not depend on whether the FMU or the importer handles events.

    A run with Event Mode returns early at events; without early return events may wait for the end of a step.
    Source: FMI 3.0.2 specification, section 4.2.1 (eventModeUsed, earlyReturnAllowed).
    """
    if model.kind != "CoSimulation" or not (model.can("hasEventMode") and model.can("mightReturnEarlyFromDoStep")):
        return
    inside, outside = (_run(model, Manner(events=by, early=by)) for by in (False, True))
    names = [(v, i) for v in model.outputs for i in range(v.size)]
    for column, (v, i) in enumerate(names):
        size = max([1.0, *(abs(row[column]) for _, row in inside)])
        for (t, alone), (_, led) in zip(inside, outside, strict=False):
            if not abs(alone[column] - led[column]) <= _BAR * size:
                element = f", element {i + 1}," if v.size > 1 else ""
                problem = (
                    f"{element} is {alone[column]:.9g} at t = {t:.9g} s without Event Mode, {led[column]:.9g} with"
                )
                yield Finding("event-run", v.place, problem.lstrip(", "), "let an event do the same in both", "warning")
                return


def _run(model: Model3, manner: Manner) -> Rows:
    """Times (s) and outputs after each step; shorter if the FMU ends the run or time is up."""
    rows: Rows = []
    begun = monotonic()
    with model.session(manner=manner) as session:
        session.start()
        while len(rows) < _MOST_CALLS and monotonic() < begun + _PATIENCE and session.step():
            rows.append((session.time, session.numbers(model.outputs)))
    return rows
