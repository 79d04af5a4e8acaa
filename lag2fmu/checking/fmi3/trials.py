"""What is tried on a running FMU of FMI 3.0, in order: legal calls on values and lists, and all trials."""

from __future__ import annotations

import math
from collections.abc import Iterator
from ctypes import byref, c_void_p

from lag2fmu.checking.binding import OK, WARNING, bits, doubles, references
from lag2fmu.checking.description import number
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.fmi3.binding import ELEMENTS, Manner
from lag2fmu.checking.fmi3.derivatives import adjoint, directional
from lag2fmu.checking.fmi3.description import Variable3
from lag2fmu.checking.fmi3.equations import dependencies, equations, output_derivatives
from lag2fmu.checking.fmi3.events import (
    event_mode,
    intermediate_update,
    reset_everywhere,
    same_run,
    saved_in_every_state,
    step_results,
)
from lag2fmu.checking.fmi3.illegal import ANY
from lag2fmu.checking.fmi3.illegal_own import OWN
from lag2fmu.checking.fmi3.session import Model3, Session3
from lag2fmu.checking.fmi3.ticks import ticking
from lag2fmu.checking.illegal import forbidden_trials
from lag2fmu.checking.trials import LEGAL, Trial, free_nothing, version_findings, wrong_token


def instantiate(model: Model3) -> Iterator[Finding]:
    """The version, an instance that is made and freed, and one for an importer that hears nothing.

    Source: FMI 3.0.2 specification, sections 2.2.1 and 2.3.1.
    """
    yield from version_findings(model, "GetVersion", "3.0")
    with model.session():
        pass
    with model.session(manner=Manner(events=model.usual.events, silent=True, logging=False)) as session:
        session.enter()
        session.instance.status("Terminate")  # illegal there: the reason has nowhere to go


def _is_given(v: Variable3) -> bool:
    """Whether a variable has the values of its start attribute until they are computed."""
    return v.readable and bool(v.starts) and v.initial == "exact" and v.type not in ("String", "Binary", "Boolean")


def before_initialization(model: Model3) -> Iterator[Finding]:
    """In the state Instantiated start values can be read, and what is set is read back bit for bit.

    Source: FMI 3.0.2 specification, section 2.3.2 (Instantiated).
    """
    with model.session() as session:
        for v in filter(_is_given, model.description.variables):
            found = session.get(v)
            expected = [number(text) for text in v.starts] * (v.size if len(v.starts) == 1 else 1)
            close = all(math.isclose(a, b, rel_tol=1e-6) for a, b in zip(found, expected, strict=False))
            if not close:
                problem = f"is {found[0]!r} in the state Instantiated, but starts at {v.starts[0]!r}"
                yield Finding("start-instantiated", v.place, problem, "give variables their starts at once")
        for v in model.of("parameter", "input"):
            if _is_given(v):
                yield from _read_back(session, v)


def _read_back(session: Session3, v: Variable3) -> Iterator[Finding]:
    """Set other values of floating point variables, the same of others, and read them."""
    values = session.get(v)
    if v.type == "Float64" and v.causality == "input":
        values = [x + 0.1 for x in values]
    status = session.instance.set(v.type, [v.reference], values)
    if status not in (OK, WARNING):
        problem = f"cannot be set in the state Instantiated: {session.model.log.last()}"
        yield Finding("settable", v.place, problem, "take start values before initialization")
    elif bits(session.get(v)) != bits(values):
        yield Finding("read-back", v.place, "what was set is not what is read", "keep all elements as they are set")


def nothing_asked(model: Model3) -> Iterator[Finding]:
    """Values of no variables can be read and set by the functions of every type.

    Source: FMI 3.0.2 specification, section 2.2.6.2 (getting and setting variable values).
    """
    with model.session() as session:
        session.enter()
        for type_ in ELEMENTS:
            for verb in ("Get", "Set"):
                session.instance.do(f"{verb}{type_}", references([]), 0, (ELEMENTS[type_][1] * 1)(), 0)
    yield from ()


def free_no_state(model: Model3) -> Iterator[Finding]:
    """fmi3FreeFMUState of a null pointer has no effect. Source: FMI 3.0.2 specification, section 2.2.6."""
    if model.saves:
        with model.session() as session:
            session.start().instance.do("FreeFMUState", byref(c_void_p()))
    yield from ()


def after_the_end(model: Model3) -> Iterator[Finding]:
    """In the state Terminated the last values can still be read.

    Source: FMI 3.0.2 specification, section 2.3.8 (Terminated).
    """
    with model.session() as session:
        session.start().steps(2)
        before = session.values()
        session.instance.do("Terminate")
        if bits(session.values()) != bits(before):
            problem = "values change when fmi3Terminate is called"
            yield Finding("terminated", model.kind, problem, "keep the final values")


def log_messages(model: Model3) -> Iterator[Finding]:
    """An error has a reason in the log, with the importer's own pointer, even if logging is off.

    Source: FMI 3.0.2 specification, sections 2.2.4 (fmi3Error) and 2.3.1 (logMessage).
    """
    for logging in (True, False):
        manner = Manner(events=model.usual.events, logging=logging)
        with model.session(manner=manner) as session:
            session.enter()
            before = len(model.log.sentences)
            session.instance.status("GetFloat64", references([(1 << 32) - 2]), 1, doubles([0.0]), 1)
            said = model.log.sentences[before:]
        if not said:
            problem = f"an error is not explained with loggingOn = {'true' if logging else 'false'}"
            remedy = "call logMessage before an error is returned"
            yield Finding("log-reason", model.kind, problem, remedy, "error" if logging else "warning")
        if any(text.endswith("\n") for _, _, text in said):
            problem = "a sentence in the log ends with a line break"
            yield Finding("log-form", model.kind, problem, "leave it to the importer", "warning")
        if manner.environments - {0x1A62}:
            problem = "logMessage does not get the importer's instanceEnvironment"
            yield Finding("environment-pointer", model.kind, problem, "pass it on unchanged")
    with model.session() as session:
        session.instance.do("SetDebugLogging", False, 0, None)
        before = len(model.log.sentences)
        session.start().steps(2)
        if any(status <= WARNING for status, *_ in model.log.sentences[before:]):
            problem = "logs after fmi3SetDebugLogging turned it off"
            yield Finding("log-off", model.kind, problem, "log errors only then", "warning")


def configuration(model: Model3) -> Iterator[Finding]:
    """Structural parameters can be set in Configuration Mode, to what they are.

    Source: FMI 3.0.2 specification, section 2.3.6 (Configuration Mode).
    """
    structural = [v for v in model.of("structuralParameter") if v.type == "UInt64"]
    if structural:
        with model.session() as session:
            session.instance.do("EnterConfigurationMode")
            for v in structural:
                values = session.get(v)
                if session.instance.set(v.type, [v.reference], values) not in (OK, WARNING):
                    problem = f"cannot be set in Configuration Mode: {model.log.last()}"
                    yield Finding("settable", v.place, problem, "take structural parameters there")
            session.instance.do("ExitConfigurationMode")
            session.start().steps(1)


_OWN: dict[str, Trial] = {
    "before initialization": before_initialization,
    "reading and setting nothing": nothing_asked,
    "results of steps": step_results,
    "Event Mode": event_mode,
    "events by the FMU and by the importer": same_run,
    "clocks": ticking,
    "FMU state in every state": saved_in_every_state,
    "reset in every state": reset_everywhere,
    "intermediate update": intermediate_update,
    "after the end": after_the_end,
    "log": log_messages,
    "configuration": configuration,
    "derivatives of outputs": output_derivatives,
    "equations": equations,
    "dependencies": dependencies,
    "directional derivatives": directional,
    "adjoint derivatives": adjoint,
}
_MARGINAL: dict[str, Trial] = {
    "wrong instantiationToken": wrong_token,
    "freeing no instance": free_nothing,
    "freeing no FMU state": free_no_state,
}


def trials_of(kind: str) -> dict[str, Trial]:
    """The trials of ``kind`` in order; none of Scheduled Execution, which needs a scheduler."""
    if kind not in OWN:
        return {}
    return {"instantiate": instantiate} | LEGAL | _OWN | _MARGINAL | forbidden_trials(ANY | OWN[kind])
