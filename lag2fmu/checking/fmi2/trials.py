"""What is tried on a running FMU of FMI 2.0, in order: legal calls beside what both versions share, and all trials."""

from __future__ import annotations

import math
from collections.abc import Iterator
from ctypes import byref, c_int, c_void_p

from lag2fmu.checking.binding import doubles, references, room
from lag2fmu.checking.description import number
from lag2fmu.checking.exchange import vector_findings
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.fmi2.derivatives import directional
from lag2fmu.checking.fmi2.illegal import ANY, OWN
from lag2fmu.checking.fmi2.session import Model2
from lag2fmu.checking.illegal import forbidden_trials
from lag2fmu.checking.trials import LEGAL, Trial, equation_findings, free_nothing, version_findings, wrong_token


def instantiate(model: Model2) -> Iterator[Finding]:
    """The versions, and one instance that is made and freed.

    Source: FMI 2.0.5 specification, sections 2.1.4 and 2.1.5.
    """
    yield from version_findings(model, "GetVersion", "2.0")
    yield from version_findings(model, "GetTypesPlatform", "default")
    with model.session():
        pass


def free_no_state(model: Model2) -> Iterator[Finding]:
    """fmi2FreeFMUstate of a null pointer has no effect. Source: FMI 2.0.5 specification, section 2.1.8."""
    if model.saves:
        with model.session() as session:
            session.start().instance.do("FreeFMUstate", byref(c_void_p()))
    yield from ()


def read_nothing(model: Model2) -> Iterator[Finding]:
    """The values of no variables can be asked for. Source: FMI 2.0.5 specification, section 2.1.7."""
    with model.session() as session:
        session.start().instance.status("GetReal", references([]), 0, doubles([]))
    yield from ()


def signals(model: Model2) -> Iterator[Finding]:
    """Co-simulation: derivatives of inputs are taken and those of outputs given, where that is declared.

    Source: FMI 2.0.5 specification, section 4.2.1.
    """
    if model.kind != "CoSimulation":
        return
    order = number(model.description.kinds[model.kind].get("maxOutputDerivativeOrder", "0"))
    inputs = [v.reference for v in model.description.variables if v.causality == "input" and v.is_continuous]
    outputs = [v.reference for v in model.outputs if v.is_continuous]
    with model.session() as session:
        session.start()
        if model.can("canInterpolateInputs") and inputs:
            zeros, ones = doubles([0.0] * len(inputs)), (c_int * len(inputs))(*[1] * len(inputs))
            session.instance.do("SetRealInputDerivatives", references(inputs), len(inputs), ones, zeros)
        if session.step() and order >= 1 and outputs:
            values, ones = room(len(outputs)), (c_int * len(outputs))(*[1] * len(outputs))
            session.instance.do("GetRealOutputDerivatives", references(outputs), len(outputs), ones, values)
            if not all(map(math.isfinite, values)):
                problem = "a derivative of an output is no finite number"
                yield Finding("output-derivatives", model.kind, problem, "declare the order that is given exactly")


def equations(model: Model2) -> Iterator[Finding]:
    """Model exchange: derivatives and event indicators are finite, nominal values positive; vectors are in order.

    Source: FMI 2.0.5 specification, section 3.2.2.
    """
    if model.kind == "ModelExchange":
        with model.session() as session:
            session.start()
            yield from equation_findings(session, "GetDerivatives", model.state_count, model.indicator_count)
            yield from vector_findings(
                session, [("GetContinuousStates", model.states), ("GetDerivatives", model.derivatives)]
            )


_OWN: dict[str, Trial] = {
    "derivatives of signals": signals,
    "equations": equations,
    "directional derivatives": directional,
}
_MARGINAL: dict[str, Trial] = {
    "wrong guid": wrong_token,
    "freeing no instance": free_nothing,
    "freeing no FMU state": free_no_state,
    "reading no variable": read_nothing,
}


def trials_of(kind: str) -> dict[str, Trial]:
    """The trials of ``kind`` in order."""
    return {"instantiate": instantiate} | LEGAL | _OWN | _MARGINAL | forbidden_trials(ANY | OWN[kind])
