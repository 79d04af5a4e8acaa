"""What is tried on a running FMU by legal calls. A trial yields findings; crashes and hangs are seen outside."""

from __future__ import annotations

import locale
import math
from collections.abc import Callable, Iterator
from ctypes import byref, c_char, c_int, c_size_t, c_void_p
from pathlib import Path
from typing import Any

from lag2fmu.checking.binding import RefusedError, bits, doubles, references
from lag2fmu.checking.description import ScalarVariable, number
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.session import Model, Session

Trial = Callable[[Model], Iterator[Finding]]
STEPS = 10
ONCE = "canBeInstantiatedOnlyOncePerProcess"


def instantiate(model: Model) -> Iterator[Finding]:
    """The versions, and one instance that is made and freed.

    Source: FMI 2.0.5 specification, sections 2.1.4 and 2.1.5.
    """
    for function, expected in (("GetVersion", b"2.0"), ("GetTypesPlatform", b"default")):
        found = model.library(function)
        if found != expected:
            problem = f"fmi2{function} says {found!r}"
            yield Finding("version", model.kind, problem, f"return {expected.decode()!r}")
    with model.session():
        pass


def run(model: Model) -> Iterator[Finding]:
    """A run of some steps: every call is answered, outputs are finite, folder and locale stay as they are.

    Source: FMI 2.0.5 specification, sections 3.2.3 and 4.2.4.
    """
    before = Path.cwd(), locale.setlocale(locale.LC_ALL)
    with model.session() as session:
        session.start()
        yield from _not_finite(session, session.model.outputs)
        session.values()
        session.steps(STEPS)
        yield from _not_finite(session, session.model.outputs)
        yield from _no_items(session)
        session.instance.do("Terminate")
    if (Path.cwd(), locale.setlocale(locale.LC_ALL)) != before:
        problem = "changes the current folder or the locale of the process"
        yield Finding("environment", model.kind, problem, "leave both as they are")


def _not_finite(session: Session, variables: list[ScalarVariable]) -> Iterator[Finding]:
    for v, value in zip(variables, session.instance.get("Real", [v.reference for v in variables]), strict=True):
        if not math.isfinite(value):
            problem = f"'{v.name}' is {value} at t = {session.time:g} s"
            yield Finding("value-finite", session.model.kind, problem, "outputs are numbers at the default values")


def _no_items(session: Session) -> Iterator[Finding]:
    """Enumerations whose value is that of no item."""
    variables = [v for v in session.model.description.variables if v.type == "Enumeration" and v.declared is not None]
    values = session.instance.get("Enumeration", [v.reference for v in variables]) if variables else []
    for v, value in zip(variables, values, strict=True):
        items = {item.get("value") for item in v.declared.all("Item")}  # type: ignore[union-attr]
        if str(value) not in items:
            problem = f"'{v.name}' is {value} at t = {session.time:g} s, the value of no item"
            yield Finding("enumeration-value", session.model.kind, problem, "list an item for each value it takes")


def start_values(model: Model) -> Iterator[Finding]:
    """After initialization, exact variables have the values that modelDescription.xml gives them.

    Source: FMI 2.0.5 specification, section 2.2.7.
    """
    with model.session() as session:
        session.enter().instance.do("ExitInitializationMode")
        for v in model.description.variables:
            exact = v.initial == "exact" or v.causality == "input"
            if not exact or v.start is None:
                continue
            (found,) = session.instance.get(v.type, [v.reference])
            if not _same(v, found):
                fixed = v.causality in ("parameter", "input") or v.variability == "constant"
                problem = f"starts at {found!r}, but modelDescription.xml says {v.start!r}"
                remedy = "build the library from the same values, with 17 digits"
                rounded = v.type == "Real" and math.isclose(found, number(v.start), rel_tol=1e-9)
                yield Finding("start-value", v.place, problem, remedy, "error" if fixed and not rounded else "warning")


def _same(v: ScalarVariable, found: Any) -> bool:
    if v.type == "Real":
        return float(found) == number(v.start or "")
    if v.type == "Boolean":
        return bool(found) == (v.start in ("true", "1"))
    return (found or b"").decode("utf-8", "replace") == v.start if v.type == "String" else str(found) == v.start


def repeat(model: Model) -> Iterator[Finding]:
    """Two runs one after the other are equal bit for bit, and so is one after fmi2Reset.

    Source: FMI 2.0.5 specification, section 2.1.6 (fmi2Reset).
    """
    with model.session() as session:
        first = session.start().steps(STEPS)
        again = None
        try:
            session.instance.do("Reset")
            again = session.start().steps(STEPS)
        except RefusedError as refused:
            yield Finding("reset", model.kind, f"after fmi2Reset, {refused}", "reset to what fmi2Instantiate gives")
    if model.can(ONCE):
        second = first
    else:
        with model.session() as session:
            second = session.start().steps(STEPS)
    if _bits(first) != _bits(second):
        problem = "two runs with the same values differ"
        yield Finding("repeat", model.kind, problem, "keep no state outside of the instance", "warning")
    elif again is not None and _bits(again) != _bits(first):
        problem = "a run after fmi2Reset differs from one of a new instance"
        yield Finding("reset", model.kind, problem, "reset to what fmi2Instantiate gives")


def _bits(values: list[list[Any]]) -> list[bytes]:
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
    if _bits(found) != _bits(expected):
        problem = "an instance computes something else while there is another one"
        remedy = "share nothing, or declare canBeInstantiatedOnlyOncePerProcess"
        yield Finding("instances", model.kind, problem, remedy)


def state(model: Model) -> Iterator[Finding]:
    """A saved FMU state, restored, leads to the same values bit for bit; freeing it clears the pointer.

    Source: FMI 2.0.5 specification, section 2.1.8.
    """
    if not model.can("canGetAndSetFMUstate"):
        return
    with model.session() as session:
        session.start().steps(2)
        time, saved = session.time, c_void_p()
        session.instance.do("GetFMUstate", byref(saved))
        expected = session.steps(STEPS)
        session.instance.do("SetFMUstate", saved)
        session.time = time
        if _bits(session.steps(STEPS)) != _bits(expected):
            problem = "a run from a restored state differs"
            yield Finding("state", model.kind, problem, "save everything, the solver's memory too")
        session.instance.do("FreeFMUstate", byref(saved))
        if saved.value is not None:
            yield Finding("state-free", model.kind, "fmi2FreeFMUstate leaves the pointer", "set it to NULL", "warning")


def serialize(model: Model) -> Iterator[Finding]:
    """A serialized FMU state, restored in another instance, leads to the same values bit for bit.

    Source: FMI 2.0.5 specification, section 2.1.8.
    """
    if not model.can("canSerializeFMUstate") or model.can(ONCE):
        return
    with model.session("first") as first:
        first.start().steps(2)
        time, saved, size = first.time, c_void_p(), c_size_t()
        first.instance.do("GetFMUstate", byref(saved))
        first.instance.do("SerializedFMUstateSize", saved, byref(size))
        block = (c_char * max(size.value, 1))()
        first.instance.do("SerializeFMUstate", saved, block, size)
        first.instance.do("FreeFMUstate", byref(saved))
        expected = first.steps(STEPS)
    with model.session("second") as second:
        second.start()
        restored = c_void_p()
        second.instance.do("DeSerializeFMUstate", block, size, byref(restored))
        second.instance.do("SetFMUstate", restored)
        second.time = time
        found = second.steps(STEPS)
        second.instance.do("FreeFMUstate", byref(restored))
    if _bits(found) != _bits(expected):
        problem = "a run from a state that was serialized in another instance differs"
        yield Finding("serialize", model.kind, problem, "write values, not pointers")


# --------------------------------------------------------------------------------------------------- of one kind only


def signals(model: Model) -> Iterator[Finding]:
    """Co-simulation: derivatives of inputs are taken and those of outputs given, where that is declared.

    Source: FMI 2.0.5 specification, section 4.2.1.
    """
    if model.kind != "CoSimulation":
        return
    order = number(model.description.kinds[model.kind].get("maxOutputDerivativeOrder", "0"))
    inputs = [v.reference for v in model.description.variables if v.causality == "input" and _is_continuous(v)]
    outputs = [v.reference for v in model.outputs if _is_continuous(v)]
    with model.session() as session:
        session.start()
        if model.can("canInterpolateInputs") and inputs:
            zeros, ones = doubles([0.0] * len(inputs)), (c_int * len(inputs))(*[1] * len(inputs))
            session.instance.do("SetRealInputDerivatives", references(inputs), len(inputs), ones, zeros)
        if session.step() and order >= 1 and outputs:
            values, ones = doubles([0.0] * len(outputs)), (c_int * len(outputs))(*[1] * len(outputs))
            session.instance.do("GetRealOutputDerivatives", references(outputs), len(outputs), ones, values)
            if not all(map(math.isfinite, values)):
                problem = "a derivative of an output is no finite number"
                yield Finding("output-derivatives", model.kind, problem, "declare the order that is given exactly")


def _is_continuous(v: ScalarVariable) -> bool:
    return v.type == "Real" and v.variability == "continuous"


def equations(model: Model) -> Iterator[Finding]:
    """Model exchange: derivatives and event indicators are finite, nominal values positive.

    Source: FMI 2.0.5 specification, section 3.2.2.
    """
    if model.kind != "ModelExchange":
        return
    size = len(model.derivatives)
    with model.session() as session:
        session.start()
        for function, count in (("GetDerivatives", size), ("GetEventIndicators", model.indicators)):
            if not all(map(math.isfinite, session.instance.vector(function, count))):
                problem = f"fmi2{function} gives what is no finite number at t = {session.time:g} s"
                yield Finding("value-finite", model.kind, problem, "make the model computable at its default values")
        nominals = session.instance.vector("GetNominalsOfContinuousStates", size)
        if not all(math.isfinite(x) and x > 0 for x in nominals):
            problem = f"nominal values that are not positive: {nominals}"
            yield Finding("nominal", model.kind, problem, "return 1 where nothing better is known")
