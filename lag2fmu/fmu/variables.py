"""The variable table of an FMU: the one place where ports, value references and dependencies are decided.

modelDescription.xml, the tables in C and the simulation read it. Layout: q and qd are states and outputs in one. Their
derivatives are separate locals that share the value references of qd and qdd. For a coordinate without mass q and qd
are outputs and no states, because they follow from the states; with friction on it q is a state, and only qd follows.
Citations are of the FMI 2.0.5 specification.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from difflib import get_close_matches

from lag2fmu.description import names
from lag2fmu.description.symbols import Coordinate
from lag2fmu.dynamics.consistent_starts import ambiguous
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.functions import Program
from lag2fmu.dynamics.massless import continuous_states
from lag2fmu.dynamics.variables import integrated_states
from lag2fmu.errors import ExportError
from lag2fmu.fmu.builder import Builder, VariableTable
from lag2fmu.fmu.dependencies import dependencies, start_dependencies
from lag2fmu.fmu.elements import add_elements, element_variables, row_forces
from lag2fmu.fmu.event_variables import add_event_variables, indicator_dependencies
from lag2fmu.fmu.input_variables import input_variables
from lag2fmu.fmu.runtime_tables import runtime_tables
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.language.unit_parser import parse_unit
from lag2fmu.language.units import JOULE, SECOND, WATT, Unit
from lag2fmu.mechanism.calculated_units import calculated_units
from lag2fmu.mechanism.drives import carried
from lag2fmu.mechanism.norms import norm_constraints
from lag2fmu.mechanism.ranges import half_range, positive_parameters
from lag2fmu.mechanism.record import Mechanism

_ENERGY_DOCS = {
    "kinetic_energy": "kinetic energy T",
    "potential_energy": "potential energy V",
    "total_energy": "T + V",
    "generalized_energy": "h = sum qd dL/dqd - L",
    "external_power": "power of the external forces, sum Q qd",
}
_STATE = {True: "VARIABLE_STATE", False: "VARIABLE_MASSLESS"}
_PARAMETER = {False: ("tunable", "VARIABLE_PARAMETER"), True: ("fixed", "VARIABLE_FIXED_PARAMETER")}
_SETTINGS = {
    "solver_tolerance": ("1", "relative tolerance of the solver; 0: as the importer asks, else 1e-6"),
    "solver_step": ("s", "first step of an adaptive solver, step of a fixed-step solver; 0: automatic"),
    "solver_max_step": ("s", "longest step of the solver; 0: a fiftieth of the experiment (fixed steps: no limit)"),
}


def build_table(
    equations: EquationsOfMotion, program: Program, *, events: bool = False, clocks: bool = True
) -> VariableTable:
    """The variables of the FMU of ``equations``; ``program.outputs`` are outputs beside q and qd.

    With ``events`` event indicators and ``clocks`` are among them, which FMI 2.0 cannot declare. Starts and bounds are
    in SI units. Causality, variability and initial are those that the FMI 2.0.5 specification, section 2.2.7, allows
    together.
    """
    mechanism = equations.mechanism
    builder = Builder()
    builder.add(ScalarVariable("time", 0, "independent", "continuous", unit=SECOND, doc="time"), "VARIABLE_TIME", 0)
    _add_states(builder, mechanism, program.outputs)
    hidden = mechanism.hidden_inputs
    for index, variable in enumerate(input_variables(mechanism)):
        if variable.name not in hidden:
            builder.add(variable, "VARIABLE_INPUT", index)
    _add_parameters(builder, mechanism, program)
    _add_calculated(builder, equations, program)
    add_elements(builder, mechanism, program.outputs)
    _add_derivatives(builder, mechanism)
    if events:
        add_event_variables(builder, mechanism, program, clocks=clocks)
    found = dependencies(equations)
    order = {v.name: i for i, v in enumerate(builder.variables)}
    if events:
        found |= indicator_dependencies(mechanism, program, found, order)
    listed = [
        {name: tuple(sorted(uses - hidden, key=order.__getitem__)) for name, uses in some.items()}
        for some in (found, start_dependencies(equations))
    ]
    variables = tuple(
        v._replace(dependencies=listed[0].get(v.name), start_dependencies=listed[1].get(v.name, ()))
        for v in builder.variables
    )
    return VariableTable(variables, runtime_tables(mechanism, program, builder.slots, variables))


def promotable(equations: EquationsOfMotion, wanted: Sequence[str], *, events: bool = False) -> frozenset[str]:
    """The local variables that become outputs, because ``wanted`` (names, or 'all') or the ports say so.

    ``wanted`` may name outputs too. With ``events`` it may also name clocks. They are not among 'all', because fmpy
    0.3.32 takes output clocks for unknowns at initialization. Raises ExportError for any other name.
    """
    mechanism, known = equations.mechanism, _local_names(equations)
    states = {name for q in mechanism.coordinates for name in (q.name, names.velocity(q.name))}
    states |= {z.name for z in mechanism.states}
    if "all" in wanted:
        wanted = [*known, *(name for name in wanted if name != "all")]
    known += [names.impact(c.name) for c in mechanism.unilaterals] if events else []
    for name in sorted({*wanted} - {*known, *states, *mechanism.output_names}):
        near = get_close_matches(name, known) or known
        raise ExportError(f"--output {name}: there is no such variable; known are {', '.join(near)}")
    return (frozenset(wanted) & frozenset(known)) | frozenset(map(names.drive, mechanism.ports.drives))


def _local_names(equations: EquationsOfMotion) -> list[str]:
    """The names of all calculated variables that are no states, outputs or clocks."""
    mechanism = equations.mechanism
    known = [names.acceleration(q.name) for q in mechanism.coordinates]
    known += [names.multiplier(c.name) for c in mechanism.constraints]
    known += [name for name, *_ in row_forces(mechanism)]
    known += [name for name, _ in equations.locals() if name not in mechanism.output_names]
    known += [variable.name for variable, _, _ in element_variables(mechanism)]
    known += [names.DISSIPATED_ENERGY] if mechanism.hybrid else []
    return known


def _per(unit: Unit | None, other: Unit) -> Unit | None:
    return None if unit is None else unit / other


def _velocity(q: Coordinate, state: bool) -> ScalarVariable:
    name = names.velocity(q.name)
    doc = f"velocity of {q.name}"
    unit, initial = _per(q.unit, SECOND), "approx" if q.velocity_given is False else "exact"
    return ScalarVariable(
        name, 0, "output", "continuous", initial, q.velocity, unit, doc, nominal=q.nominal, state=state
    )


def _add_states(builder: Builder, mechanism: Mechanism, outputs: Collection[str]) -> None:
    """Add q, qd and the further states, all of them outputs.

    A coordinate or velocity that follows from an equilibrium, for want of mass, is no state.
    """
    states = set(continuous_states(mechanism))
    for i, q in enumerate(mechanism.coordinates):
        state = ScalarVariable(
            q.name,
            0,
            "output",
            "continuous",
            "approx" if q.given is False else "exact",
            q.start,
            q.unit,
            q.doc or f"generalized coordinate {q.name}",
            q.minimum,
            q.maximum,
            q.nominal,
            state=i in states,
        )
        builder.add(state, _STATE[i in states], i)
    for i, q in enumerate(mechanism.coordinates, len(mechanism.coordinates)):
        builder.add(_velocity(q, i in states), _STATE[i in states], i)
    for i, z in enumerate(integrated_states(mechanism), 2 * len(mechanism.coordinates)):
        doc = z.doc or f"further state {z.name}"
        shown = z.name != names.DISSIPATED_ENERGY or z.name in outputs
        causality = "output" if shown else "local"
        state = ScalarVariable(
            z.name, 0, causality, "continuous", "exact", z.start, _resolved(z.unit), doc, nominal=z.nominal, state=True
        )
        builder.add(state, "VARIABLE_STATE", i)


def _add_parameters(builder: Builder, mechanism: Mechanism, program: Program) -> None:
    """Add the independent parameters, which stand behind the modes in p, and the settings of the solver."""
    independent = [p for p in mechanism.parameters if p.value is not None]
    fixed, positive = mechanism.fixed_parameters, positive_parameters(mechanism)
    for i, p in enumerate(independent, program.masks + program.switches):
        variability, kind = _PARAMETER[p.name in fixed]
        low = 0.0 if p.minimum is None and p.name in positive else p.minimum
        variable = ScalarVariable(
            p.name, 0, "parameter", variability, "exact", p.value, p.unit, p.doc, low, p.maximum, half_range(p)
        )
        builder.add(variable, kind, i)
    for i, (name, (unit, doc)) in enumerate(_SETTINGS.items()):
        variable = ScalarVariable(name, 0, "parameter", "fixed", "exact", 0.0, parse_unit(unit), doc, minimum=0.0)
        builder.add(variable, "VARIABLE_SETTING", i)


def _add_calculated(builder: Builder, equations: EquationsOfMotion, program: Program) -> None:
    _add_dependent(builder, equations.mechanism, program)
    for i, q in enumerate(equations.mechanism.coordinates):
        unit, doc = _per(_per(q.unit, SECOND), SECOND), f"acceleration of {q.name}"
        builder.add(_calculated(names.acceleration(q.name), program, unit, doc), "VARIABLE_ACCELERATION", i)
    _add_multipliers(builder, equations, program)
    _add_row_forces(builder, equations.mechanism, program)
    _add_locals(builder, equations.mechanism, program)


def _calculated(name: str, program: Program, unit: Unit | None, doc: str) -> ScalarVariable:
    """A variable that follows from the state; an output if ``program`` says so, else a local variable."""
    causality = "output" if name in program.outputs else "local"
    return ScalarVariable(name, 0, causality, "continuous", "calculated", None, unit, doc)


def _add_dependent(builder: Builder, mechanism: Mechanism, program: Program) -> None:
    fixed = mechanism.fixed_parameters
    dependent = {p.name: p for p in mechanism.parameters if p.expression is not None}
    for i, name in enumerate(program.dependent):
        p, variability = dependent[name], _PARAMETER[name in fixed][0]
        variable = ScalarVariable(name, 0, "calculatedParameter", variability, "calculated", None, p.unit, p.doc)
        builder.add(variable, "VARIABLE_DEPENDENT", i)


def _add_locals(builder: Builder, mechanism: Mechanism, program: Program) -> None:
    """Add outputs, momenta, drives, residuals and energies, as ``program`` lists them."""
    known = dict(_meanings(mechanism))
    for i, name in enumerate(program.locals):
        unit, doc = known[name]
        builder.add(_calculated(name, program, unit, doc), "VARIABLE_LOCAL", i)


def _meanings(mechanism: Mechanism) -> Iterator[tuple[str, tuple[Unit | None, str]]]:
    """(name, (unit, doc)) of everything that may be among the locals; an output may have the name of another one."""
    units = calculated_units(mechanism)
    yield from ((name, (WATT if name == "external_power" else JOULE, doc)) for name, doc in _ENERGY_DOCS.items())
    docs = {names.gap(contact.name): f"gap of {contact.name}" for contact in mechanism.unilaterals}
    docs |= {names.residual(c.name): f"residual of the {c.kind} constraint {c.name}" for c in mechanism.constraints}
    docs |= {names.drive(x): f"generalized force that carries the motion {x}" for x in carried(mechanism)}
    docs |= {names.drive_power(x): f"power that the drive of {x} puts in" for x in carried(mechanism)}
    docs |= {names.momentum(q.name): f"generalized momentum of {q.name}" for q in mechanism.coordinates}
    yield from ((name, (units[name], doc)) for name, doc in docs.items())
    for name, output in mechanism.output_names.items():
        yield name, (_resolved(output.unit), output.doc)


def _add_multipliers(builder: Builder, equations: EquationsOfMotion, program: Program) -> None:
    """Add the multipliers of the constraints that hold all the time."""
    mechanism = equations.mechanism
    loose = ambiguous(mechanism, equations.graph, equations.constraints)
    norms = norm_constraints(mechanism) if mechanism.constraints else frozenset()
    units = calculated_units(mechanism)
    for k, c in enumerate(mechanism.constraints):
        name, doc = names.multiplier(c.name), f"multiplier of the constraint {c.name}"
        doc += " (a norm: no force belongs to it)" if c.name in norms else ""
        doc += " (not unique, as constraints are redundant: the one of least norm)" if c.name in loose else ""
        builder.add(_calculated(name, program, units[name], doc), "VARIABLE_MULTIPLIER", program.permanent[k])


def _add_row_forces(builder: Builder, mechanism: Mechanism, program: Program) -> None:
    """Add the forces of contacts, stops, dry frictions and latches: the multipliers of their rows."""
    for place, (name, unit, doc) in zip(program.places, row_forces(mechanism), strict=True):
        builder.add(_calculated(name, program, unit, doc), "VARIABLE_MULTIPLIER", place)


def _resolved(unit: Unit | str | None) -> Unit | None:
    return parse_unit(unit) if isinstance(unit, str) else unit


def _add_derivatives(builder: Builder, mechanism: Mechanism) -> None:
    """The variables with the attribute 'derivative': aliases of qd and qdd without start, and dz/dt."""
    pairs = [(q.name, names.velocity(q.name)) for q in mechanism.coordinates]
    pairs += [(names.velocity(q.name), names.acceleration(q.name)) for q in mechanism.coordinates]
    pairs = [pairs[i] for i in continuous_states(mechanism) if i < len(pairs)]
    units = {v.name: v.unit for v in builder.variables}
    for state, rate in pairs:
        builder.variables.append(
            ScalarVariable(
                names.derivative(state),
                builder.reference(rate),
                "local",
                "continuous",
                "calculated",
                unit=units[rate],
                doc=f"time derivative of {state}",
                derivative_of=state,
            )
        )
    for i, z in enumerate(integrated_states(mechanism)):
        unit, doc = _per(_resolved(z.unit), SECOND), f"time derivative of {z.name}"
        label = names.derivative(z.name)
        slope = ScalarVariable(label, 0, "local", "continuous", "calculated", None, unit, doc, derivative_of=z.name)
        builder.add(slope, "VARIABLE_FURTHER_RATE", i)
