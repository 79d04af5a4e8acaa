"""Trials of clocks: those that an FMU activates itself tick at events and rest afterwards."""

from __future__ import annotations

from collections.abc import Iterator

from lag2fmu.checking.findings import Finding
from lag2fmu.checking.fmi3.binding import Manner
from lag2fmu.checking.fmi3.description import Variable3
from lag2fmu.checking.fmi3.events import advanced
from lag2fmu.checking.fmi3.session import Model3


def own_clocks(model: Model3) -> list[Variable3]:
    """The clocks that the FMU activates itself."""
    return [v for v in model.description.variables if v.type == "Clock" and v.causality != "input"]


def ticking(model: Model3) -> Iterator[Finding]:
    """Clocks of the FMU can be read in Event Mode, and none is active when events have come to rest.

    Source: FMI 3.0.2 specification, section 2.3.5 (fmi3GetClock, fmi3UpdateDiscreteStates).
    """
    clocks = own_clocks(model)
    if not clocks or (model.kind == "CoSimulation" and not model.can("hasEventMode")):
        return
    with model.session(manner=Manner(events=True, early=True)) as session:
        session.start()
        if model.kind == "CoSimulation":
            for _ in advanced(session, 1):
                pass
        else:
            session.steps(2)
        session.instance.do("EnterEventMode")
        for clock in clocks:
            session.get(clock)
        session.rest()
        for clock in clocks:
            if session.get(clock)[0]:
                problem = f"the clock '{clock.name}' is active after the last event iteration"
                remedy = "deactivate clocks in fmi3UpdateDiscreteStates"
                yield Finding("clock-active", model.kind, problem, remedy)
