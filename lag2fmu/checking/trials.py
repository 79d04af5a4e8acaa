"""The trials of a running FMU of either version by legal calls. A trial yields findings.

Crashes and hangs are noticed by the parent process.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from lag2fmu.checking.binding import RefusedError, bits
from lag2fmu.checking.description import Variable, number
from lag2fmu.checking.exchange import events_of_exchange, integrator_step, states_set
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.session import Model, Session
from lag2fmu.checking.setting import lengths, reading, settings, uneven_steps
from lag2fmu.checking.together import together

Trial = Callable[[Any], Iterator[Finding]]
"""Takes the Model of its version."""
STEPS = 10
ONCE = "canBeInstantiatedOnlyOncePerProcess"
ESSENTIAL = ("instantiate", "run")
"""If one of these trials fails, the others are left out, because they would say nothing new."""


def version_findings(model: Model, function: str, expected: str) -> Iterator[Finding]:
    """A finding if the function without arguments gives a version other than ``expected``."""
    found = model.library(function)
    if found != expected.encode():
        problem = f"{model.prefix}{function} says {found!r}"
        yield Finding("version", model.kind, problem, f"return {expected.encode()!r}")


def run(model: Model) -> Iterator[Finding]:
    """A run of some steps: every call is answered, and outputs are finite.

    Source: FMI 2.0.5 specification, sections 3.2.3 and 4.2.4; FMI 3.0.2 specification, sections 3.2 and 4.2.
    """
    with model.session() as session:
        session.start()
        yield from _not_finite(session, model.outputs)
        session.values()
        session.steps(STEPS)
        yield from _not_finite(session, model.outputs)
        yield from _no_items(session)
        session.instance.do("Terminate")


def _not_finite(session: Session, variables: Sequence[Variable]) -> Iterator[Finding]:
    for v in variables:
        for value in session.get(v):
            if not math.isfinite(value):
                problem = f"'{v.name}' is {value} at t = {session.time:g} s"
                yield Finding("value-finite", session.model.kind, problem, "outputs are numbers at the default values")


def _no_items(session: Session) -> Iterator[Finding]:
    """Enumerations whose value is that of no item."""
    for v in session.model.description.variables:
        if v.type == "Enumeration" and v.declared is not None and v.readable:
            items = {item.get("value") for item in v.declared.all("Item")}
            for value in session.get(v):
                if str(value) not in items:
                    problem = f"'{v.name}' is {value} at t = {session.time:g} s, the value of no item"
                    remedy = "list an item for each value it takes"
                    yield Finding("enumeration-value", session.model.kind, problem, remedy)


def start_values(model: Model) -> Iterator[Finding]:
    """After initialization, exact variables have the values that modelDescription.xml gives them.

    Source: FMI 2.0.5 specification, section 2.2.7; FMI 3.0.2 specification, section 2.4.7.
    """
    with model.session() as session:
        session.enter().instance.do("ExitInitializationMode")
        for v in model.description.variables:
            exact = v.initial == "exact" or v.causality == "input"
            if not exact or not v.starts or not v.readable:
                continue
            found = session.get(v)
            starts = v.starts * len(found) if len(v.starts) == 1 else v.starts
            differing = [i for i, pair in enumerate(zip(found, starts, strict=False)) if not _same(v, *pair)]
            if differing:
                value, start = found[differing[0]], starts[differing[0]]
                fixed = v.causality in ("parameter", "input") or v.variability == "constant"
                problem = f"starts at {value!r}, but modelDescription.xml says {start!r}"
                remedy = "build the library from the same values, with 17 digits"
                rounded = isinstance(value, float) and math.isclose(value, number(start), rel_tol=1e-9)
                yield Finding("start-value", v.place, problem, remedy, "error" if fixed and not rounded else "warning")


def _same(v: Variable, found: Any, start: str) -> bool:
    if v.type == "Float32":
        return bool(found == struct.unpack("f", struct.pack("f", number(start)))[0])
    if isinstance(found, float):
        return found == number(start)
    if v.type == "Binary":
        return bool(found.hex() == start.lower())
    if v.type == "Boolean":
        return bool(found) == (start in ("true", "1"))
    return (found or b"").decode("utf-8", "replace") == start if v.type == "String" else str(found) == start


def repeat(model: Model) -> Iterator[Finding]:
    """Two runs one after the other are equal bit for bit, and so is one after a reset.

    Source: FMI 2.0.5 specification, section 2.1.6 (fmi2Reset); FMI 3.0.2 specification, section 2.3.1 (fmi3Reset).
    """
    reset = f"{model.prefix}Reset"
    with model.session() as session:
        first = session.start().steps(STEPS)
        again = None
        try:
            session.instance.do("Reset")
            again = session.start().steps(STEPS)
        except RefusedError as refused:
            problem = f"after {reset}, {refused}"
            yield Finding("reset", model.kind, problem, f"reset to what {model.prefix}Instantiate gives")
    if model.can(ONCE):
        second = first
    else:
        with model.session() as session:
            second = session.start().steps(STEPS)
    if row_bits(first) != row_bits(second):
        problem = "two runs with the same values differ"
        yield Finding("repeat", model.kind, problem, "keep no state outside of the instance", "warning")
    elif again is not None and row_bits(again) != row_bits(first):
        problem = f"a run after {reset} differs from one of a new instance"
        yield Finding("reset", model.kind, problem, f"reset to what {model.prefix}Instantiate gives")


def row_bits(values: list[list[Any]]) -> list[bytes]:
    """The bits of the values after each step of a run."""
    return [bits(row) for row in values]


def instances(model: Model) -> Iterator[Finding]:
    """Two instances that take turns do not disturb each other. Source: FMI 2.0.5 specification, section 2.1.5."""
    if model.can(ONCE):
        return
    with model.session() as alone:
        expected = alone.start().steps(STEPS)
    with model.session("first") as first, model.session("second") as second:
        first.start()
        second.start()
        found: list[list[Any]] = []
        for _ in range(STEPS):
            found += first.steps(1)
            second.steps(2)
    if row_bits(found) != row_bits(expected):
        problem = "an instance computes something else while there is another one"
        remedy = "share nothing, or declare canBeInstantiatedOnlyOncePerProcess"
        yield Finding("instances", model.kind, problem, remedy)


def state(model: Model) -> Iterator[Finding]:
    """A saved FMU state, restored, leads to the same values bit for bit; freeing it clears the pointer.

    Source: FMI 2.0.5 specification, section 2.1.8; FMI 3.0.2 specification, section 2.2.6.
    """
    if not model.saves:
        return
    with model.session() as session:
        session.start().steps(2)
        time, saved = session.time, session.instance.saved()
        expected = [session.values(), *session.steps(STEPS)]
        session.instance.restore(saved)
        session.time = time
        if row_bits([session.values(), *session.steps(STEPS)]) != row_bits(expected):
            problem = "a run from a restored state differs"
            yield Finding("state", model.kind, problem, "save everything, the solver's memory too")
        session.instance.drop(saved)
        if saved.value is not None:
            problem = f"{model.prefix}Free{model.library.binding.state} leaves the pointer"
            yield Finding("state-free", model.kind, problem, "set it to NULL", "warning")


def serialize(model: Model) -> Iterator[Finding]:
    """A serialized FMU state, restored in another instance, leads to the same values bit for bit.

    Source: FMI 2.0.5 specification, section 2.1.8; FMI 3.0.2 specification, section 2.2.6.
    """
    if not model.serializes or model.can(ONCE):
        return
    with model.session("first") as first:
        first.start().steps(2)
        time, saved = first.time, first.instance.saved()
        block = first.instance.serialized(saved)
        first.instance.drop(saved)
        expected = first.steps(STEPS)
    with model.session("second") as second:
        second.start()
        restored = second.instance.deserialized(block)
        second.instance.restore(restored)
        second.time = time
        found = second.steps(STEPS)
        second.instance.drop(restored)
    if row_bits(found) != row_bits(expected):
        problem = "a run from a state that was serialized in another instance differs"
        yield Finding("serialize", model.kind, problem, "write values, not pointers")


def wrong_token(model: Model) -> Iterator[Finding]:
    """An instance for another modelDescription.xml is refused.

    Source: FMI 2.0.5 specification, section 2.1.5; FMI 3.0.2 specification, section 2.3.1.
    """
    instance = model.instance(key="{00000000-0000-0000-0000-000000000000}")
    if instance.alive:
        name = model.description.token_name
        problem = f"{model.prefix}Instantiate accepts a {name} that is not its own"
        yield Finding("wrong-guid", model.kind, problem, "compare it and return NULL if it differs")
    instance.free()


def free_nothing(model: Model) -> Iterator[Finding]:
    """Freeing the instance at a null pointer has no effect.

    Source: FMI 2.0.5 specification, section 2.1.5; FMI 3.0.2 specification, section 2.3.1.
    """
    model.library("FreeInstance", None)
    yield from ()


def equation_findings(session: Session, derivatives: str, states: int, indicators: int) -> Iterator[Finding]:
    """Derivatives and event indicators that are not finite, nominal values that are not positive.

    ``derivatives`` is the function that gives the derivatives; the other two are how many there are.
    """
    kind = session.model.kind
    for function, count in ((derivatives, states), ("GetEventIndicators", indicators)):
        if not all(map(math.isfinite, session.instance.vector(function, count))):
            problem = f"{session.model.prefix}{function} gives what is no finite number at t = {session.time:g} s"
            yield Finding("value-finite", kind, problem, "make the model computable at its default values")
    nominals = session.instance.vector("GetNominalsOfContinuousStates", states)
    if not all(math.isfinite(x) and x > 0 for x in nominals):
        problem = f"nominal values that are not positive: {nominals}"
        yield Finding("nominal", kind, problem, "return 1 where nothing better is known")


LEGAL: dict[str, Trial] = {
    "run": run,
    "start values": start_values,
    "setting values": settings,
    "lengths of steps": lengths,
    "time": uneven_steps,
    "reading values": reading,
    "several values at once": together,
    "events of model exchange": events_of_exchange,
    "setting states": states_set,
    "integrator step": integrator_step,
    "repeat and reset": repeat,
    "several instances": instances,
    "FMU state": state,
    "serialized FMU state": serialize,
}
"""The trials by legal calls that both versions share, in the order in which they are done."""
