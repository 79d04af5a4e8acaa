"""Calls that FMI 2.0 forbids, beside those that both versions forbid.

Source: FMI 2.0.5, sections 2.1.5 to 2.1.8, 3.2.3 and 4.2.4.
"""

from __future__ import annotations

from ctypes import byref
from functools import partial

from lag2fmu.checking.binding import doubles, references
from lag2fmu.checking.findings import Severity
from lag2fmu.checking.fmi2.binding import EventInfo
from lag2fmu.checking.fmi2.session import Session2
from lag2fmu.checking.illegal import Call, unused


def _read(session: Session2) -> int:
    return session.instance.status("GetReal", references([unused(session.model.description)]), 1, doubles([0.0]))


def _write(session: Session2) -> int:
    return session.instance.status("SetReal", references([unused(session.model.description)]), 1, doubles([0.0]))


def _read_unknown(session: Session2) -> int:
    return _read(session.start())


def _write_unknown(session: Session2) -> int:
    return _write(session)


def _set_constant(session: Session2) -> int | None:
    constants = [v for v in session.model.description.variables if v.variability == "constant" and v.type == "Real"]
    if not constants:
        return None
    return session.instance.status("SetReal", references([constants[0].reference]), 1, doubles([1.0]))


def _set_fixed(session: Session2) -> int | None:
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


def _initialize_twice(session: Session2) -> int:
    return session.enter().instance.status("EnterInitializationMode")


def _step_too_soon(session: Session2) -> int:
    return session.instance.status("DoStep", session.time, session.model.step, 1)


def _step_of(factor: float, session: Session2) -> int:
    session.start()
    return session.instance.status("DoStep", session.time, factor * session.model.step, 1)


def _step_past_the_end(session: Session2) -> int:
    session.start(stop_time=session.time + session.model.step)
    return session.instance.status("DoStep", session.time, 3 * session.model.step, 1)


def _events_too_soon(session: Session2) -> int:
    return session.instance.status("NewDiscreteStates", byref(EventInfo()))


def _too_many(function: str, session: Session2) -> int:
    """A vector that is one longer than the model's; there is room for it."""
    size = len(session.model.derivatives)
    return session.start().instance.status(function, doubles([1.0] * (size + 64)), size + 1)


ANY: dict[str, tuple[Call, Severity]] = {
    "reading a value reference that does not exist": (_read_unknown, "error"),
    "setting a value reference that does not exist": (_write_unknown, "error"),
    "setting a constant": (_set_constant, "warning"),
    "setting a fixed parameter after initialization": (_set_fixed, "warning"),
    "entering Initialization Mode twice": (_initialize_twice, "warning"),
}
OWN: dict[str, dict[str, tuple[Call, Severity]]] = {
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
"""Kind -> what is forbidden in it alone -> the call that does it, and the severity if the FMU takes it."""
