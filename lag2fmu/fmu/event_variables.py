"""The variables that only FMI 3.0 can declare: event indicators, and clocks that tick at impacts."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

from lag2fmu.description import names
from lag2fmu.dynamics.functions import Program
from lag2fmu.fmu.builder import Builder
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.mechanism.record import Mechanism

CLOCK = "Clock"
"""The type of a variable that ticks."""


def add_event_variables(builder: Builder, mechanism: Mechanism, program: Program, *, clocks: bool) -> None:
    """Add an indicator for each event function, and with ``clocks`` one for each contact or side of a stop.

    An output clock is no unknown at initialization, and has no ``initial``: modelica/fmi-standard, issue 1449.
    """
    for i, (name, doc) in enumerate(_indicators(mechanism, program)):
        indicator = ScalarVariable(name, 0, "local", "continuous", "calculated", doc=doc)
        builder.add(indicator, "VARIABLE_INDICATOR", i)
    for i, contact in enumerate(mechanism.unilaterals if clocks else ()):
        doc = f"ticks at each impact of {contact.name}"
        causality = "output" if names.impact(contact.name) in program.outputs else "local"
        clock = ScalarVariable(names.impact(contact.name), 0, causality, "discrete", doc=doc)
        builder.add(clock._replace(type=CLOCK), "VARIABLE_CLOCK", i)


def event_names(mechanism: Mechanism, program: Program) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The names of the indicators that come to 0 at events, and those of the impacts, in the order of the engine."""
    indicators = tuple(name for name, _ in _indicators(mechanism, program))
    return indicators, tuple(names.impact(contact.name) for contact in mechanism.unilaterals)


def indicator_dependencies(
    mechanism: Mechanism, program: Program, found: Mapping[str, frozenset[str]], known: Collection[str]
) -> dict[str, frozenset[str]]:
    """{indicator: names of states, inputs, parameters and time} of switches, as far as these are ``known`` variables.

    ``found`` {name: names} are the dependencies of calculated variables. The indicators of contacts depend on
    everything and get no list.
    """
    switches = [f for f in program.functions if f.name == "mechanism_switches"]
    nodes = [node for f in switches for *_, node in f.results]
    listed = [name for name, _ in _indicators(mechanism, program)]
    uses = {name: program.graph.symbols([node]) for name, node in zip(listed, nodes, strict=False)}
    named = {name: {"time" if symbol == "t" else symbol for symbol in symbols} for name, symbols in uses.items()}
    of_variables = {name: symbols for name, symbols in named.items() if symbols <= {*known}}
    return {
        name: frozenset().union(*(found.get(symbol, {symbol}) for symbol in symbols))
        for name, symbols in of_variables.items()
    }


def _indicators(mechanism: Mechanism, program: Program) -> Iterator[tuple[str, str]]:
    """(name, description) of the indicators, in the order of the event functions of ``program``."""
    functions = program.event_functions
    for i, function in enumerate(functions[: program.switches]):
        yield names.switch_indicator(i), f"positive or negative as {function.name} is"
    for contact in mechanism.unilaterals:
        yield names.indicator(contact.name), f"0 where {contact.name} closes or opens"
        yield names.slip_indicator(contact.name), f"0 where {contact.name} begins to stick or to slide"
    for friction in mechanism.frictions:
        yield names.slip_indicator(friction.name), f"0 where {friction.name} begins to stick or to slide"
