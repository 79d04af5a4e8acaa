"""Calls that the standard forbids: each must be answered by a status, not by a crash, and no call by fmi2OK.

Source: FMI 2.0.5, sections 2.1.5 to 2.1.8, 3.2.3 and 4.2.4.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from ctypes import byref, c_char, c_void_p
from functools import partial

from lag2fmu.checking.binding import OK, WARNING, EventInfo, doubles, references
from lag2fmu.checking.findings import Finding, Severity
from lag2fmu.checking.session import Model, Session
from lag2fmu.checking.trials import Trial

Call = Callable[[Session], int | None]
"""Does what is forbidden in a new session and returns the status; None if the FMU offers no occasion."""


def wrong_guid(model: Model) -> Iterator[Finding]:
    """An instance for another modelDescription.xml is refused. Source: FMI 2.0.5 specification, section 2.1.5."""
    with model.instance(guid="{00000000-0000-0000-0000-000000000000}") as instance:
        if instance.alive:
            problem = "fmi2Instantiate accepts a guid that is not its own"
            yield Finding("wrong-guid", model.kind, problem, "compare it and return NULL if it differs")


def free_nothing(model: Model) -> Iterator[Finding]:
    """fmi2FreeInstance of a null pointer has no effect. Source: FMI 2.0.5 specification, section 2.1.5."""
    model.library("FreeInstance", None)
    yield from ()


def free_no_state(model: Model) -> Iterator[Finding]:
    """fmi2FreeFMUstate of a null pointer has no effect. Source: FMI 2.0.5 specification, section 2.1.8."""
    if model.can("canGetAndSetFMUstate"):
        with model.session() as session:
            session.start().instance.do("FreeFMUstate", byref(c_void_p()))
    yield from ()


def read_nothing(model: Model) -> Iterator[Finding]:
    """The values of no variables can be asked for. Source: FMI 2.0.5 specification, section 2.1.7."""
    with model.session() as session:
        session.start().instance.status("GetReal", references([]), 0, doubles([]))
    yield from ()


def _forbidden(what: str, call: Call, severity: Severity, model: Model) -> Iterator[Finding]:
    with model.session() as session:
        status = call(session)
    if status in (OK, WARNING):
        problem = f"{what} is answered as if it were right"
        yield Finding("illegal-call", model.kind, problem, "return fmi2Error and log why", severity)


def _read(session: Session) -> int:
    return session.instance.status("GetReal", references([_unused(session)]), 1, doubles([0.0]))


def _write(session: Session) -> int:
    return session.instance.status("SetReal", references([_unused(session)]), 1, doubles([0.0]))


def _unused(session: Session) -> int:
    used = {v.reference for v in session.model.description.variables}
    return next(n for n in range((1 << 32) - 2, 0, -1) if n not in used)


def _read_unknown(session: Session) -> int:
    return _read(session.start())


def _write_unknown(session: Session) -> int:
    return _write(session)


def _set_constant(session: Session) -> int | None:
    constants = [v for v in session.model.description.variables if v.variability == "constant" and v.type == "Real"]
    if not constants:
        return None
    return session.instance.status("SetReal", references([constants[0].reference]), 1, doubles([1.0]))


def _set_fixed(session: Session) -> int | None:
    """A fixed parameter after initialization, to the value it has."""
    fixed = [
        v
        for v in session.model.description.variables
        if (v.causality, v.variability, v.type) == ("parameter", "fixed", "Real")
    ]
    if not fixed:
        return None
    which = [fixed[0].reference]
    values = session.start().instance.get("Real", which)
    return session.instance.status("SetReal", references(which), 1, doubles(values))


def _foreign_state(session: Session) -> int | None:
    if not session.model.can("canSerializeFMUstate"):
        return None
    return session.start().instance.status("DeSerializeFMUstate", (c_char * 64)(), 64, byref(c_void_p()))


def _plain(function: str, session: Session) -> int:
    """A function without arguments in a new instance."""
    return session.instance.status(function)


def _terminate_twice(session: Session) -> int:
    session.start().instance.do("Terminate")
    return session.instance.status("Terminate")


def _initialize_twice(session: Session) -> int:
    return session.enter().instance.status("EnterInitializationMode")


def _step_too_soon(session: Session) -> int:
    return session.instance.status("DoStep", session.time, session.model.step, 1)


def _step_of(factor: float, session: Session) -> int:
    session.start()
    return session.instance.status("DoStep", session.time, factor * session.model.step, 1)


def _step_past_the_end(session: Session) -> int:
    session.start(stop_time=session.time + session.model.step)
    return session.instance.status("DoStep", session.time, 3 * session.model.step, 1)


def _events_too_soon(session: Session) -> int:
    return session.instance.status("NewDiscreteStates", byref(EventInfo()))


def _too_many(function: str, session: Session) -> int:
    """A vector that is one longer than the model's; there is room for it."""
    size = len(session.model.derivatives)
    return session.start().instance.status(function, doubles([1.0] * (size + 64)), size + 1)


_ANY: dict[str, tuple[Call, Severity]] = {
    "reading a value reference that does not exist": (_read_unknown, "error"),
    "setting a value reference that does not exist": (_write_unknown, "error"),
    "setting a constant": (_set_constant, "warning"),
    "setting a fixed parameter after initialization": (_set_fixed, "warning"),
    "a serialized state that is none": (_foreign_state, "warning"),
    "leaving Initialization Mode before it was entered": (partial(_plain, "ExitInitializationMode"), "warning"),
    "entering Initialization Mode twice": (_initialize_twice, "warning"),
    "terminating before initialization": (partial(_plain, "Terminate"), "warning"),
    "terminating twice": (_terminate_twice, "warning"),
}
_OWN: dict[str, dict[str, tuple[Call, Severity]]] = {
    "CoSimulation": {
        "a step before initialization": (_step_too_soon, "warning"),
        "a step back in time": (partial(_step_of, -1.0), "warning"),
        "a step of no length": (partial(_step_of, 0.0), "warning"),
        "a step past the stop time": (_step_past_the_end, "warning"),
    },
    "ModelExchange": {
        "an event iteration before initialization": (_events_too_soon, "warning"),
        "asking for more derivatives than there are": (partial(_too_many, "GetDerivatives"), "warning"),
        "asking for more states than there are": (partial(_too_many, "GetContinuousStates"), "warning"),
        "setting more states than there are": (partial(_too_many, "SetContinuousStates"), "warning"),
    },
}
"""What is forbidden -> the call that does it, and the severity of the finding if the FMU takes it."""


def forbidden_trials(kind: str) -> dict[str, Trial]:
    """What is forbidden in ``kind`` -> its trial.

    Source: FMI 2.0.5 specification, the tables of sections 3.2.3 and 4.2.4.
    """
    return {what: partial(_forbidden, what, *entry) for what, entry in (_ANY | _OWN[kind]).items()}
