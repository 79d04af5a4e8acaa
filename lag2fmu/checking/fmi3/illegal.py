"""Calls that FMI 3.0 forbids, beside those that both versions forbid.

Source: FMI 3.0.2, sections 2.2.4 (fmi3Error), 2.3, 3.2 and 4.2.
"""

from __future__ import annotations

from ctypes import byref, c_bool, c_double, c_int, c_int32, c_size_t
from functools import partial
from typing import Any

from lag2fmu.checking.binding import ERROR, OK, doubles, references
from lag2fmu.checking.findings import Severity
from lag2fmu.checking.fmi3.binding import ELEMENTS, Instance3, Manner
from lag2fmu.checking.fmi3.description import Variable3
from lag2fmu.checking.fmi3.session import Session3
from lag2fmu.checking.fmi3.ticks import own_clocks
from lag2fmu.checking.illegal import Call, plain, unused

BEFORE, INITIALIZATION, RUN, END = "Instantiated", "Initialization Mode", "run", "Terminated"


def at_place(session: Session3, place: str) -> Session3:
    """Lead a new session to a state of the standard's machine."""
    if place == INITIALIZATION:
        session.enter()
    elif place != BEFORE:
        session.start()
    if place == END:
        session.instance.do("Terminate")
    return session


def call_at(place: str, function: str, *arguments: Any) -> Call:
    """Call a function at a place, with arguments that are numbers or make C's arrays when they are called."""

    def call(session: Session3) -> int:
        values = [argument() if callable(argument) else argument for argument in arguments]
        return at_place(session, place).instance.status(function, *values)

    return call


def _unknown_reference(verb: str, type_: str, session: Session3) -> int:
    at_place(session, RUN if verb == "Get" else BEFORE)
    which, values = references([unused(session.model.description)]), (ELEMENTS[type_][1] * 1)()
    return session.instance.status(f"{verb}{type_}", which, 1, values, 1)


def _unknown_clock(session: Session3) -> int:
    which = references([unused(session.model.description)])
    return at_place(session, INITIALIZATION).instance.status("GetClock", which, 1, (c_bool * 1)())


def _set_own_clock(session: Session3) -> int | None:
    """A clock that the FMU alone activates, in Event Mode."""
    clocks = own_clocks(session.model)
    if not clocks or not session.has_events:
        return None
    session.start().instance.do("EnterEventMode")
    return session.instance.status("SetClock", references([clocks[0].reference]), 1, (c_bool * 1)(True))


def first(session: Session3, causality: str, variability: str = "") -> Variable3 | None:
    """The first Float64 variable of a kind that can be read and is no state."""
    for v in session.model.of(causality):
        if v.type == "Float64" and variability in ("", v.variability) and v not in session.model.states:
            return v
    return None


def _set(place: str, causality: str, variability: str, session: Session3) -> int | None:
    """Set a variable that must not be set there, to the value it has."""
    v = first(session, causality, variability)
    if v is None:
        return None
    at_place(session, place)
    return session.instance.set(v.type, [v.reference], session.get(v))


def _set_constant(session: Session3) -> int | None:
    v = first(session, "local", "constant") or first(session, "output", "constant")
    return None if v is None else session.instance.set(v.type, [v.reference], [1.0] * v.size)


def _wrong_count(verb: str, less: int, session: Session3) -> int | None:
    """A number of values that is not that of the elements; there is room for more."""
    variables = [v for v in session.model.of("input", "parameter", "output", "local") if v.type == "Float64"]
    variables = sorted(variables, key=lambda v: -v.size)
    v = next((v for v in variables if v.causality in ("input", "parameter") or verb == "Get"), None)
    if v is None or v.size + less < 1:
        return None
    values = doubles([0.0] * (v.size + 8))
    return at_place(session, INITIALIZATION).instance.status(
        f"{verb}Float64", references([v.reference]), 1, values, v.size + less
    )


def _other_type(session: Session3) -> int | None:
    """A Float64 variable by the function of another type."""
    v = next((v for v in session.model.description.variables if v.type == "Float64" and v.size == 1), None)
    if v is None:
        return None
    return at_place(session, INITIALIZATION).instance.status(
        "GetInt32", references([v.reference]), 1, (c_int32 * 2)(), 1
    )


def _initialize_twice(session: Session3) -> int:
    return session.enter().instance.status("EnterInitializationMode", False, 0.0, session.time, False, 0.0)


def _configuration(session: Session3) -> int | None:
    """Configuration Mode without structural parameters."""
    if session.model.of("structuralParameter"):
        return None
    return session.instance.status("EnterConfigurationMode")


def _evaluate(session: Session3) -> int | None:
    if session.model.can("providesEvaluateDiscreteStates"):
        return None
    return at_place(session, RUN).instance.status("EvaluateDiscreteStates")


def made(session: Session3, kind: str, name: str | None = "check", *, events: bool = False, token: bool = True) -> int:
    """Whether an instance that must not be made is refused, as a status."""
    model = session.model
    manner = Manner(events=events or model.usual.events)
    instance = Instance3(model.library, kind, model.description.token if token else None, None, model.log, name, manner)
    alive = instance.alive
    instance.free()
    return OK if alive else ERROR


def _undeclared_kind(session: Session3) -> int | None:
    others = {"ModelExchange", "CoSimulation"} - session.model.description.kinds.keys()
    return made(session, others.pop()) if others else None


def _no_name(name: str | None, session: Session3) -> int:
    return made(session, session.model.kind, name)


def _no_token(session: Session3) -> int:
    return made(session, session.model.kind, token=False)


def _derivative_sizes(function: str, seed: int, sensitivity: int, session: Session3) -> int | None:
    """Sizes of seed and sensitivity that are not those of the elements."""
    flag = "providesDirectionalDerivatives" if "Directional" in function else "providesAdjointDerivatives"
    unknowns = [v for v in session.model.description.listed("InitialUnknown") if v.is_continuous and v.readable]
    known = first(session, "input", "continuous")
    if not session.model.can(flag) or not unknowns or known is None:
        return None
    sizes = [known.size, unknowns[0].size]
    if function == "GetAdjointDerivative":
        sizes.reverse()
    seeds, results = (doubles([1.0] * (n + 8)) for n in sizes)
    which = references([unknowns[0].reference]), 1, references([known.reference]), 1
    return session.enter().instance.status(function, *which, seeds, sizes[0] + seed, results, sizes[1] + sensitivity)


def _derivative_of_unknown(function: str, session: Session3) -> int | None:
    flag = "providesDirectionalDerivatives" if "Directional" in function else "providesAdjointDerivatives"
    known = first(session, "input", "continuous")
    if not session.model.can(flag) or known is None:
        return None
    which = references([unused(session.model.description)]), 1, references([known.reference]), 1
    sizes = (1, known.size) if function == "GetAdjointDerivative" else (known.size, 1)
    seeds, results = (doubles([1.0] * n) for n in sizes)
    return session.enter().instance.status(function, *which, seeds, sizes[0], results, sizes[1])


def update(session: Session3) -> int:
    """An event iteration, as a status."""
    flags, time = [c_bool() for _ in range(5)], c_double()
    return session.instance.status("UpdateDiscreteStates", *map(byref, flags), byref(time))


def _interval(session: Session3) -> int:
    which = references([unused(session.model.description)])
    return session.enter().instance.status("GetIntervalDecimal", which, 1, doubles([0.0]), (c_int * 1)())


def _dependencies_of_unknown(session: Session3) -> int | None:
    if not session.model.can("providesPerElementDependencies"):
        return None
    return session.enter().instance.status(
        "GetNumberOfVariableDependencies", unused(session.model.description), byref(c_size_t())
    )


ANY: dict[str, tuple[Call, Severity]] = {
    **{
        f"reading a {type_} whose value reference does not exist": (partial(_unknown_reference, "Get", type_), "error")
        for type_ in ("Float64", "Int32", "Boolean", "String")
    },
    **{
        f"setting a {type_} whose value reference does not exist": (partial(_unknown_reference, "Set", type_), "error")
        for type_ in ("Float64", "Int64")
    },
    "reading a clock whose value reference does not exist": (_unknown_clock, "error"),
    "setting a clock that is no input": (_set_own_clock, "warning"),
    "reading a Float64 by fmi3GetInt32": (_other_type, "error"),
    "reading more values than there are elements": (partial(_wrong_count, "Get", 1), "error"),
    "reading fewer values than there are elements": (partial(_wrong_count, "Get", -1), "error"),
    "setting more values than there are elements": (partial(_wrong_count, "Set", 1), "error"),
    "setting fewer values than there are elements": (partial(_wrong_count, "Set", -1), "error"),
    "setting a constant": (_set_constant, "error"),
    "setting a fixed parameter after initialization": (partial(_set, RUN, "parameter", "fixed"), "warning"),
    "setting a calculated output": (partial(_set, RUN, "output", "continuous"), "warning"),
    "setting the independent variable": (partial(_set, INITIALIZATION, "independent", ""), "warning"),
    "setting an input in the state Terminated": (partial(_set, END, "input", ""), "warning"),
    "entering Initialization Mode twice": (_initialize_twice, "warning"),
    "entering Configuration Mode without structural parameters": (_configuration, "warning"),
    "leaving Configuration Mode before it was entered": (partial(plain, "ExitConfigurationMode"), "warning"),
    "entering Event Mode before initialization": (partial(plain, "EnterEventMode"), "warning"),
    "an event iteration before initialization": (update, "warning"),
    "evaluating discrete states though that is not provided": (_evaluate, "warning"),
    "activating a model partition": (call_at(RUN, "ActivateModelPartition", 0, 0.0), "warning"),
    "an instance of a kind that is not declared": (_undeclared_kind, "warning"),
    "an instance without a name": (partial(_no_name, ""), "warning"),
    "an instance whose name is a null pointer": (partial(_no_name, None), "warning"),
    "an instance whose instantiationToken is a null pointer": (_no_token, "warning"),
    "the interval of a clock that does not exist": (_interval, "warning"),
    "the dependencies of a value reference that does not exist": (_dependencies_of_unknown, "error"),
    **{
        f"{words} that is too long for {function}": (partial(_derivative_sizes, function, *sizes), "warning")
        for function in ("GetDirectionalDerivative", "GetAdjointDerivative")
        for words, sizes in (("a seed", (1, 0)), ("a sensitivity", (0, 1)))
    },
    **{
        f"a derivative of a value reference that does not exist by {function}": (
            partial(_derivative_of_unknown, function),
            "error",
        )
        for function in ("GetDirectionalDerivative", "GetAdjointDerivative")
    },
}
