"""Calls that FMI 3.0 forbids in co-simulation or in model exchange alone: steps, event modes, vectors.

Source: FMI 3.0.2, sections 3.2 and 4.2.
"""

from __future__ import annotations

from ctypes import byref, c_bool, c_double, c_int32
from functools import partial

from lag2fmu.checking.binding import doubles, references
from lag2fmu.checking.description import whole
from lag2fmu.checking.findings import Severity
from lag2fmu.checking.fmi3.illegal import BEFORE, END, INITIALIZATION, RUN, at_place, call_at, first, made, update
from lag2fmu.checking.fmi3.session import Session3, size_of
from lag2fmu.checking.illegal import Call


def _events_not_had(session: Session3) -> int | None:
    """Event Mode asked of an FMU that has none."""
    if session.model.can("hasEventMode"):
        return None
    return made(session, session.model.kind, events=True)


def _do_step(session: Session3, time: float, length: float) -> int:
    flags, reached = [c_bool() for _ in range(3)], c_double()
    return session.instance.status("DoStep", time, length, True, *map(byref, flags), byref(reached))


def _step(place: str, factor: float, session: Session3) -> int:
    at_place(session, place)
    return _do_step(session, session.time, factor * session.model.step)


def _step_elsewhere(session: Session3) -> int:
    """A step that begins far from where the FMU is."""
    session.start()
    return _do_step(session, session.time + 10 * session.model.step, session.model.step)


def _step_past_the_end(session: Session3) -> int:
    session.start(stop_time=session.time + session.model.step)
    return _do_step(session, session.time, 3 * session.model.step)


def _enter_events(session: Session3) -> int | None:
    """Event Mode in an instance that was made without it."""
    return None if session.has_events else session.start().instance.status("EnterEventMode")


def _derivatives_of_order(order: int, session: Session3) -> int | None:
    most = whole(session.model.description.kinds["CoSimulation"].get("maxOutputDerivativeOrder", "0"), 0)
    v = first(session, "output", "continuous")
    if v is None or not session.start().step():
        return None
    orders = (c_int32 * 1)(order if order <= 0 else most + order)
    return session.instance.status(
        "GetOutputDerivatives", references([v.reference]), 1, orders, doubles([0.0] * v.size), v.size
    )


def _vector(function: str, listed: str, session: Session3) -> int:
    """A vector that is one longer than the model's; there is room for it."""
    size = size_of(session.model.states if listed == "states" else session.model.description.listed(listed))
    return session.start().instance.status(function, doubles([1.0] * (size + 64)), size + 1)


OWN: dict[str, dict[str, tuple[Call, Severity]]] = {
    "CoSimulation": {
        "a step before initialization": (partial(_step, BEFORE, 1.0), "warning"),
        "a step in Initialization Mode": (partial(_step, INITIALIZATION, 1.0), "warning"),
        "a step after the end": (partial(_step, END, 1.0), "warning"),
        "a step back in time": (partial(_step, RUN, -1.0), "warning"),
        "a step of no length": (partial(_step, RUN, 0.0), "warning"),
        "a step that begins elsewhere": (_step_elsewhere, "warning"),
        "a step past the stop time": (_step_past_the_end, "warning"),
        "Event Mode where eventModeUsed is false": (_enter_events, "warning"),
        "Event Mode of an FMU without hasEventMode": (_events_not_had, "error"),
        "derivatives of outputs of order 0": (partial(_derivatives_of_order, 0), "warning"),
        "derivatives of outputs beyond maxOutputDerivativeOrder": (partial(_derivatives_of_order, 1), "warning"),
        "setting the time of a co-simulation": (call_at(RUN, "SetTime", 1.0), "warning"),
        "the continuous states of a co-simulation": (
            call_at(RUN, "GetContinuousStates", lambda: doubles([0.0] * 64), 0),
            "warning",
        ),
    },
    "ModelExchange": {
        "a step of model exchange": (partial(_step, RUN, 1.0), "warning"),
        "entering Step Mode of model exchange": (call_at(RUN, "EnterStepMode"), "warning"),
        "an event iteration in Continuous-Time Mode": (
            lambda session: update(session.start()),
            "warning",
        ),
        "entering Continuous-Time Mode twice": (call_at(RUN, "EnterContinuousTimeMode"), "warning"),
        "asking for more derivatives than there are": (
            partial(_vector, "GetContinuousStateDerivatives", "states"),
            "warning",
        ),
        "asking for more states than there are": (partial(_vector, "GetContinuousStates", "states"), "warning"),
        "setting more states than there are": (partial(_vector, "SetContinuousStates", "states"), "warning"),
        "asking for more nominal values than there are": (
            partial(_vector, "GetNominalsOfContinuousStates", "states"),
            "warning",
        ),
        "asking for more event indicators than there are": (
            partial(_vector, "GetEventIndicators", "EventIndicator"),
            "warning",
        ),
    },
}
"""Kind -> what is forbidden in it alone -> the call that does it, and the severity if the FMU takes it."""
