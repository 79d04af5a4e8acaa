"""Calls that both versions forbid: each must be answered by a status, not by a crash, and no call by OK.

Source: FMI 2.0.5, sections 2.1.5 to 2.1.8, 3.2.3 and 4.2.4; FMI 3.0.2, sections 2.3, 3.2 and 4.2.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from ctypes import byref, c_char, c_void_p
from functools import partial
from typing import Any

from lag2fmu.checking.binding import OK, WARNING
from lag2fmu.checking.description import FmuDescription
from lag2fmu.checking.findings import Finding, Severity
from lag2fmu.checking.session import Model, Session
from lag2fmu.checking.trials import Trial

Call = Callable[[Any], int | None]
"""A function that makes a forbidden call in a new session and returns its status; None if it does not apply."""


def _forbidden(what: str, call: Call, severity: Severity, model: Model) -> Iterator[Finding]:
    with model.session() as session:
        status = call(session)
    if status in (OK, WARNING):
        problem = f"{what} is answered as if it were right"
        yield Finding("illegal-call", model.kind, problem, f"return {model.prefix}Error and log why", severity)


def forbidden_trials(calls: Mapping[str, tuple[Call, Severity]]) -> dict[str, Trial]:
    """{label: trial} of the forbidden ``calls`` {words: (call, severity of the finding if the FMU takes it)}."""
    return {what: partial(_forbidden, what, *entry) for what, entry in (COMMON | dict(calls)).items()}


def unused(description: FmuDescription) -> int:
    """A value reference that no variable has."""
    used = {v.reference for v in description.variables}
    return next(n for n in range((1 << 32) - 2, 0, -1) if n not in used)


def plain(function: str, session: Session) -> int:
    """A function without arguments in a new instance."""
    return session.instance.status(function)


def _foreign_state(session: Session) -> int | None:
    if not session.model.serializes:
        return None
    binding = session.model.library.binding
    block, pointer = (c_char * 64)(), c_void_p()
    return session.start().instance.status(f"{binding.deserialize}{binding.state}", block, 64, byref(pointer))


def _terminate_twice(session: Session) -> int:
    session.start().instance.do("Terminate")
    return session.instance.status("Terminate")


COMMON: dict[str, tuple[Call, Severity]] = {
    "a serialized state that is none": (_foreign_state, "warning"),
    "leaving Initialization Mode before it was entered": (partial(plain, "ExitInitializationMode"), "warning"),
    "terminating before initialization": (partial(plain, "Terminate"), "warning"),
    "terminating twice": (_terminate_twice, "warning"),
}
