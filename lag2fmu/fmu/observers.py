"""The variables of an FMU that observes, and what its C code needs.

Beside those of the mechanism there are inputs for what is measured, outputs that tell how well the estimate is known,
and parameters for the noise. The coordinates, velocities and further states are the estimates.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from lag2fmu.codegen.tables import ObserverTable, Slot
from lag2fmu.description.names import OBSERVER
from lag2fmu.errors import ExportError
from lag2fmu.fmu.builder import Builder, VariableTable
from lag2fmu.fmu.model_description import Interface
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.language.units import SECOND, Unit
from lag2fmu.mechanism.record import Mechanism, complete

if TYPE_CHECKING:
    from lag2fmu.analysis.observation import Observation

OBSERVERS_SOLVER = "rk4"
"""The method by which an observer moves its estimate."""


def observed(
    mechanism: Mechanism, solver: str | None, backend: str, profile: str, page: str | None
) -> tuple[Mechanism, str, str]:
    """``mechanism`` under the name of its observer, with the solver and the page that this has.

    Raises ExportError for choices that do not go with an observer, as contacts do not.
    """
    from lag2fmu.analysis.observing import modes_refused

    if solver not in {None, OBSERVERS_SOLVER}:
        raise ExportError(f"--solver {solver}: an observer moves its estimate by {OBSERVERS_SOLVER}; leave it out")
    if backend != "c":
        raise ExportError(f"--backend {backend}: an observer is C code; leave it out, or take lag2fmu.observe")
    if profile != "desktop":
        raise ExportError(f"--profile {profile}: an observer has no bound of its steps yet; leave it out")
    if page == "live":
        raise ExportError("--page live: the page of an observer is static; leave it out")
    if refusal := modes_refused(mechanism):
        raise ExportError(f"{refusal}, by --without friction, stops, contacts")
    return observed_mechanism(mechanism), OBSERVERS_SOLVER, "static"


def observed_mechanism(mechanism: Mechanism) -> Mechanism:
    """``mechanism`` under the name of its observer."""
    d = mechanism.description
    return complete(replace(d, name=d.name + OBSERVER, title=f"{d.title}, observer"))


class _Row(NamedTuple):
    """A variable of the observer, its start in SI units, and its kind in C."""

    variable: ScalarVariable
    kind: str


def observed_table(table: VariableTable, found: Observation) -> VariableTable:
    """``table`` of a mechanism with the variables of an observer of ``found``; estimated parameters are outputs.

    Raises ExportError where a name of the observer is one of the mechanism.
    """
    builder = Builder()
    builder.slots = [_slot(slot, found) for slot in table.tables.slots]
    builder.variables = [_variable(v, found) for v in table.variables]
    units = {v.name: _difference(v.unit) for v in table.variables}
    rows = [*_samples(found, units), *_tuning(found, units), *_beliefs(found, units, _at_start(table, found))]
    known = {v.name for v in table.variables}
    for i, (variable, kind) in enumerate(rows):
        if variable.name in known:
            raise ExportError(f"the observer needs the name '{variable.name}', which the mechanism has; rename that")
        builder.add(variable, kind, i)
        builder.slots[-1] = replace(builder.slots[-1], output=False)  # it has no time derivatives
    tables = table.tables._replace(
        slots=tuple(builder.slots),
        default_solver_step=found.step,
        observer=_observer_table(found, tuple(v.start or 0.0 for v, _ in rows)),
    )
    return VariableTable(tuple(builder.variables), tables)


def observing_interface(interface: Interface) -> Interface:
    """The capabilities of an FMU that observes, of those that FMUs with this ``interface`` have."""
    kept = ("canHandleVariableCommunicationStepSize", "hasEventMode")
    offered = {word: value for word, value in interface.capabilities["CoSimulation"].items() if word in kept}
    return interface._replace(capabilities={"CoSimulation": offered})


def _observer_table(found: Observation, starts: tuple[float, ...]) -> ObserverTable:
    from lag2fmu.analysis.observing import SIMPLEX

    results = [array for array, *_ in found.program.functions[-1].results]
    states, measured = len(found.names) - len(found.estimated), len(found.asked.measure)
    return ObserverTable(
        program=found.program,
        measured=measured,
        bound=results.count("f") - states - measured,
        pivots=results.count("pivots"),
        entries=found.entries,
        estimated=found.estimated,
        noisy=found.noisy,
        starts=starts,
        delayed=bool(found.asked.delays),
        unscented=found.asked.method != "ekf",
        simplex=found.asked.method == SIMPLEX,
    )


# ------------------------------------------------------------------------------------------------------- estimated


def _slot(slot: Slot, found: Observation) -> Slot:
    return replace(slot, kind="VARIABLE_ESTIMATE") if slot.name in found.asked.estimate else slot


def _variable(v: ScalarVariable, found: Observation) -> ScalarVariable:
    """A parameter that is estimated is an output; parameters that follow from others may change with it."""
    if v.name in found.asked.estimate:
        return v._replace(causality="output", variability="continuous", dependencies=())
    if v.causality == "calculatedParameter" and found.asked.estimate:
        return v._replace(causality="local", variability="continuous")
    return v


def _difference(unit: Unit | None) -> Unit | None:
    """The unit of a difference; a unit with an offset has none."""
    return unit if unit is None or not unit.offset else None


# ------------------------------------------------------------------------------------------------------- variables


def _samples(found: Observation, units: Mapping[str, Unit | None]) -> Iterator[_Row]:
    for name, value in zip(found.asked.measure, found.expected.tolist(), strict=True):
        doc = f"what was measured of {name}"
        sample = ScalarVariable(f"{name}_measured", 0, "input", "continuous", None, value, units.get(name), doc)
        yield _Row(sample, "VARIABLE_SAMPLE")
    for name in found.asked.measure:
        doc = f"whether {name}_measured is a sample (0.5 and more) or there is none"
        counts = ScalarVariable(f"{name}_valid", 0, "input", "continuous", None, 1.0, None, doc)
        yield _Row(counts, "VARIABLE_SAMPLE")


def _tuning(found: Observation, units: Mapping[str, Unit | None]) -> Iterator[_Row]:
    asked = found.asked
    for name, size in asked.measure.items():
        doc = f"standard deviation of what is measured of {name}"
        yield _parameter(f"{name}_noise", size, units.get(name), doc, "tunable")
    for name in asked.measure:
        doc = f"time between samples of {name}; 0: one comes with each communication step"
        yield _parameter(f"{name}_sample_time", asked.sample_times.get(name, 0.0), SECOND, doc, "fixed")
    for name in asked.measure if asked.delays else ():
        doc = f"time by which samples of {name} are late"
        yield _parameter(f"{name}_delay", asked.delays.get(name, 0.0), SECOND, doc, "fixed")
    for name, size in zip(found.names, found.deviations.tolist(), strict=True):
        doc = f"standard deviation of {name} at the start"
        yield _parameter(_of_start(name), size, units.get(name), doc, "fixed")
    for name, size in asked.process.items():
        doc = f"density of white noise along {name}, in its SI unit by the root of Hz"
        yield _parameter(f"{name}_density", size, None, doc, "tunable")


def _of_start(name: str) -> str:
    return f"{name}_start_std"


def _parameter(name: str, value: float, unit: Unit | None, doc: str, variability: str) -> _Row:
    least = 1e-300 if name.endswith("_noise") else 0.0
    variable = ScalarVariable(name, 0, "parameter", variability, "exact", value, unit, doc, minimum=least)
    return _Row(variable, "VARIABLE_TUNING" if variability == "tunable" else "VARIABLE_FIXED_TUNING")


def _at_start(table: VariableTable, found: Observation) -> tuple[str, ...]:
    """What deviations depend on at the start: under constraints all that may turn the errors that these allow."""
    starts = tuple(map(_of_start, found.names))
    if not table.tables.constraint_names:
        return starts
    motions = {slot.name for slot in table.tables.slots if _moves(slot, table)}
    turning = [v.name for v in table.variables if v.state or v.causality == "parameter" or v.name in motions]
    return (*turning, *starts)


def _moves(slot: Slot, table: VariableTable) -> bool:
    """Whether an input belongs to a motion; these are the last inputs, three for each."""
    first = len(table.tables.start_inputs) - 3 * len(table.tables.motions)
    return slot.kind == "VARIABLE_INPUT" and slot.index >= first


def _beliefs(found: Observation, units: Mapping[str, Unit | None], starts: tuple[str, ...]) -> Iterator[_Row]:
    measure = tuple(found.asked.measure)
    for name in found.names:
        yield _belief(f"{name}_std", units.get(name), f"standard deviation of {name}", starts)
    for name in measure:
        doc = f"what the last sample of {name} said beyond what was expected; 0: there was none"
        yield _belief(f"{name}_innovation", units.get(name), doc)
    for name in measure:
        yield _belief(f"{name}_innovation_std", units.get(name), f"standard deviation of {name}_innovation")
    doc = "normalised innovation squared of the last samples; on average their number, if all is as assumed"
    yield _belief("innovation_squared", None, doc)
    yield _belief("innovation_degrees", None, "number of the last samples")


def _belief(name: str, unit: Unit | None, doc: str, uses: tuple[str, ...] = ()) -> _Row:
    variable = ScalarVariable(name, 0, "output", "continuous", "calculated", None, unit, doc, dependencies=uses)
    return _Row(variable, "VARIABLE_BELIEF")
