"""The variable table of an FMU: the one place where ports, value references and dependencies are decided.

modelDescription.xml, the tables in C and the simulation read it. Layout: q and qd are states and outputs in one. Their
derivatives are separate locals that share the value references of qd and qdd. For a coordinate without mass q and qd
are outputs and no states, because they follow from the states; with friction on it q is a state, and only qd follows.
Citations are of the FMI 2.0.5 specification.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches

from lag2fmu.codegen import RuntimeTables, Slot
from lag2fmu.codegen.colours import coloured
from lag2fmu.description import names
from lag2fmu.dynamics import EquationsOfMotion, Program
from lag2fmu.dynamics.constraints import ambiguous
from lag2fmu.dynamics.massless import continuous_states, determined
from lag2fmu.dynamics.variables import further_states
from lag2fmu.errors import ExportError
from lag2fmu.fmu.dependencies import dependencies
from lag2fmu.language.units import JOULE, SECOND, WATT, Unit, parse_unit
from lag2fmu.mechanism import Constraint, Coordinate, Mechanism
from lag2fmu.mechanism.norms import norm_constraints
from lag2fmu.mechanism.unit_check import constraint_units

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


@dataclass(frozen=True)
class Variable:
    """One ScalarVariable of type Real; ``start`` and bounds in SI units; ``dependencies`` by name, None if unlisted.

    ``derivative_of`` names the state a variable is the derivative of; ``state`` marks the continuous states.
    """

    name: str
    value_reference: int
    causality: str
    variability: str
    initial: str | None = None
    start: float | None = None
    unit: Unit | None = None
    doc: str = ""
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None
    derivative_of: str | None = None
    state: bool = False
    dependencies: tuple[str, ...] | None = None


@dataclass(frozen=True)
class VariableTable:
    """All variables in the order of modelDescription.xml, and what C needs of them."""

    variables: tuple[Variable, ...]
    tables: RuntimeTables

    def __getitem__(self, name: str) -> Variable:
        """The variable called ``name``; raises KeyError."""
        return next(v for v in self.variables if v.name == name)


class _Builder:
    """Collects slots (value references) and variables (names for them)."""

    def __init__(self) -> None:
        self.slots: list[Slot] = []
        self.variables: list[Variable] = []

    def add(self, variable: Variable, kind: str, index: int) -> None:
        """A variable with a value reference of its own."""
        self.variables.append(replace(variable, value_reference=len(self.slots)))
        output = variable.causality == "output"
        self.slots.append(Slot(variable.name, kind, index, variable.minimum, variable.maximum, output))

    def reference(self, name: str) -> int:
        return next(i for i, slot in enumerate(self.slots) if slot.name == name)


def build_table(equations: EquationsOfMotion, program: Program) -> VariableTable:
    """The variables of the FMU of ``equations``; ``program.outputs`` are outputs beside q and qd.

    Causality, variability and initial are those that FMI 2.0.5, section 2.2.7, allows together.
    """
    mechanism = equations.mechanism
    builder = _Builder()
    builder.add(Variable("time", 0, "independent", "continuous", unit=SECOND, doc="time"), "VARIABLE_TIME", 0)
    _add_states(builder, mechanism)
    for index, variable in enumerate(_inputs(mechanism)):
        builder.add(variable, "VARIABLE_INPUT", index)
    _add_parameters(builder, mechanism)
    _add_calculated(builder, equations, program)
    _add_derivatives(builder, mechanism)
    found = dependencies(equations)
    order = {v.name: i for i, v in enumerate(builder.variables)}
    variables = tuple(
        replace(v, dependencies=tuple(sorted(found[v.name], key=order.__getitem__))) if v.name in found else v
        for v in builder.variables
    )
    return VariableTable(variables, _tables(mechanism, program, builder.slots, variables))


def promotable(equations: EquationsOfMotion, wanted: Sequence[str]) -> frozenset[str]:
    """The local variables that ``wanted`` makes outputs: names, or 'all'; outputs may be named once more.

    Raises ExportError for a name that is neither.
    """
    mechanism = equations.mechanism
    states = {name for q in mechanism.coordinates for name in (q.name, names.velocity(q.name))}
    states |= {z.name for z in further_states(mechanism)}
    known = [names.acceleration(q.name) for q in mechanism.coordinates]
    known += [names.multiplier(c.name) for c in mechanism.constraints]
    known += [name for name, _ in equations.locals() if name not in mechanism.output_names]
    if "all" in wanted:
        wanted = [*known, *(name for name in wanted if name != "all")]
    for name in sorted({*wanted} - {*known, *states, *mechanism.output_names}):
        near = get_close_matches(name, known) or known
        raise ExportError(f"--output {name}: there is no such variable; known are {', '.join(near)}")
    return frozenset(wanted) & frozenset(known)


def _per(unit: Unit | None, other: Unit) -> Unit | None:
    return None if unit is None else unit / other


def _velocity(q: Coordinate, state: bool) -> Variable:
    name = names.velocity(q.name)
    doc = f"velocity of {q.name}"
    unit, initial = _per(q.unit, SECOND), "approx" if q.velocity_given is False else "exact"
    return Variable(name, 0, "output", "continuous", initial, q.velocity, unit, doc, nominal=q.nominal, state=state)


def _add_states(builder: _Builder, mechanism: Mechanism) -> None:
    """Add q, qd and the further states, all of them outputs.

    Those that an equilibrium of a coordinate without mass gives are no states.
    """
    states = set(continuous_states(mechanism))
    for i, q in enumerate(mechanism.coordinates):
        state = Variable(
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
    for i, z in enumerate(further_states(mechanism), 2 * len(mechanism.coordinates)):
        doc = z.doc or f"further state {z.name}"
        state = Variable(
            z.name, 0, "output", "continuous", "exact", z.start, _resolved(z.unit), doc, nominal=z.nominal, state=True
        )
        builder.add(state, "VARIABLE_STATE", i)


def _inputs(mechanism: Mechanism) -> Iterable[Variable]:
    """The inputs in the order of the vector u: Q of every coordinate, plain inputs, motions with their derivatives."""
    for q in mechanism.coordinates:
        unit = None if q.unit is None else JOULE / q.unit
        doc = f"external generalized force on {q.name}"
        yield Variable(names.generalized_force(q.name), 0, "input", "continuous", None, 0.0, unit, doc)
    for u in mechanism.plain_inputs:
        yield Variable(u.name, 0, "input", "continuous", None, u.start, u.unit, u.doc, u.minimum, u.maximum)
    for u in mechanism.motions:
        rates = (names.velocity(u.name), names.acceleration(u.name))
        doc = f"{u.doc or 'prescribed motion'}; to be given with {' and '.join(rates)}"
        yield Variable(u.name, 0, "input", "continuous", None, u.start, u.unit, doc, u.minimum, u.maximum)
        unit = u.unit
        for name, rate in zip(rates, ("velocity", "acceleration"), strict=True):
            unit = _per(unit, SECOND)
            doc = f"{rate} of {u.name}, to be given with it"
            yield Variable(name, 0, "input", "continuous", None, 0.0, unit, doc)


def _add_parameters(builder: _Builder, mechanism: Mechanism) -> None:
    independent = [p for p in mechanism.parameters if p.value is not None]
    fixed = mechanism.fixed_parameters
    for i, p in enumerate(independent):
        variability, kind = _PARAMETER[p.name in fixed]
        variable = Variable(p.name, 0, "parameter", variability, "exact", p.value, p.unit, p.doc, p.minimum, p.maximum)
        builder.add(variable, kind, i)
    for i, (name, (unit, doc)) in enumerate(_SETTINGS.items()):
        variable = Variable(name, 0, "parameter", "fixed", "exact", 0.0, parse_unit(unit), doc, minimum=0.0)
        builder.add(variable, "VARIABLE_SETTING", i)


def _add_calculated(builder: _Builder, equations: EquationsOfMotion, program: Program) -> None:
    mechanism = equations.mechanism
    fixed = mechanism.fixed_parameters
    dependent = {p.name: p for p in mechanism.parameters if p.expression is not None}
    for i, name in enumerate(program.dependent):
        p = dependent[name]
        builder.add(
            Variable(name, 0, "calculatedParameter", _PARAMETER[name in fixed][0], "calculated", None, p.unit, p.doc),
            "VARIABLE_DEPENDENT",
            i,
        )
    for i, q in enumerate(mechanism.coordinates):
        unit, doc = _per(_per(q.unit, SECOND), SECOND), f"acceleration of {q.name}"
        name = names.acceleration(q.name)
        causality = "output" if name in program.outputs else "local"
        variable = Variable(name, 0, causality, "continuous", "calculated", None, unit, doc)
        builder.add(variable, "VARIABLE_ACCELERATION", i)
    _add_multipliers(builder, equations, program)
    outputs = mechanism.output_names
    residuals = {names.residual(c.name): (c, unit) for c, unit in _constraints(mechanism)}
    momenta = {names.momentum(q.name): q for q in mechanism.coordinates}
    for i, name in enumerate(program.locals):
        if name in outputs:
            unit, doc = _resolved(outputs[name].unit), outputs[name].doc
        elif name in momenta:
            q = momenta[name]
            unit, doc = (None if q.unit is None else JOULE * SECOND / q.unit), f"generalized momentum of {q.name}"
        elif name in residuals:
            c, unit = residuals[name]
            doc = f"residual of the {c.kind} constraint {c.name}"
        else:
            unit, doc = (WATT if name == "external_power" else JOULE), _ENERGY_DOCS[name]
        causality = "output" if name in program.outputs else "local"
        builder.add(Variable(name, 0, causality, "continuous", "calculated", None, unit, doc), "VARIABLE_LOCAL", i)


def _constraints(mechanism: Mechanism) -> Iterable[tuple[Constraint, Unit | None]]:
    """The constraints with the units of their expressions."""
    units = constraint_units(mechanism) if mechanism.constraints else {}
    return [(c, units[c.name]) for c in mechanism.constraints]


def _add_multipliers(builder: _Builder, equations: EquationsOfMotion, program: Program) -> None:
    """Add the multipliers. Their unit makes multiplier * expression an energy, or a power if it is nonholonomic."""
    mechanism = equations.mechanism
    loose = ambiguous(mechanism, equations.graph, equations.constraints)
    norms = norm_constraints(mechanism) if mechanism.constraints else frozenset()
    for k, (c, unit) in enumerate(_constraints(mechanism)):
        name, doc = names.multiplier(c.name), f"multiplier of the constraint {c.name}"
        doc += " (a norm: no force belongs to it)" if c.name in norms else ""
        doc += " (not unique, as constraints are redundant: the one of least norm)" if c.name in loose else ""
        causality = "output" if name in program.outputs else "local"
        other = None if unit is None else (JOULE if c.holonomic else WATT) / unit
        variable = Variable(name, 0, causality, "continuous", "calculated", None, other, doc)
        builder.add(variable, "VARIABLE_MULTIPLIER", k)


def _resolved(unit: Unit | str | None) -> Unit | None:
    return parse_unit(unit) if isinstance(unit, str) else unit


def _add_derivatives(builder: _Builder, mechanism: Mechanism) -> None:
    """The variables with the attribute 'derivative': aliases of qd and qdd without start, and dz/dt."""
    pairs = [(q.name, names.velocity(q.name)) for q in mechanism.coordinates]
    pairs += [(names.velocity(q.name), names.acceleration(q.name)) for q in mechanism.coordinates]
    pairs = [pairs[i] for i in continuous_states(mechanism) if i < len(pairs)]
    units = {v.name: v.unit for v in builder.variables}
    for state, rate in pairs:
        builder.variables.append(
            Variable(
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
    for i, z in enumerate(further_states(mechanism)):
        unit, doc = _per(_resolved(z.unit), SECOND), f"time derivative of {z.name}"
        label = names.derivative(z.name)
        slope = Variable(label, 0, "local", "continuous", "calculated", None, unit, doc, derivative_of=z.name)
        builder.add(slope, "VARIABLE_FURTHER_RATE", i)


# ----------------------------------------------------------------------------------------------------------- for C


def _tables(
    mechanism: Mechanism, program: Program, slots: Sequence[Slot], variables: Sequence[Variable]
) -> RuntimeTables:
    q, z = mechanism.coordinates, further_states(mechanism)
    starts: Mapping[str, float] = {v.name: v.start for v in variables if v.start is not None}
    nominal = tuple(c.nominal for c in q)
    return RuntimeTables(
        model_name=mechanism.name,
        slots=tuple(slots),
        coordinate_names=tuple(c.name for c in q),
        start_states=(*(c.start for c in q), *(c.velocity for c in q), *(s.start for s in z)),
        nominal_states=(*nominal, *nominal, *(s.nominal for s in z)),
        given_states=(
            *(c.given is not False for c in q),
            *(c.velocity_given is not False for c in q),
            *(True for _ in z),
        ),
        constraint_names=tuple(c.name for c in mechanism.constraints),
        holonomic=len(mechanism.holonomic),
        continuous_states=continuous_states(mechanism),
        massless=tuple((k, i) for k, i in enumerate(determined(mechanism)) if i is not None),
        colours=coloured(_columns(mechanism, variables)),
        start_inputs=tuple(starts[name] for name in program.inputs),
        motions=tuple(
            program.contains(names.velocity(u.name)) or program.contains(names.acceleration(u.name))
            for u in mechanism.motions
        ),
        start_parameters=tuple(p.value for p in mechanism.parameters if p.value is not None),
        default_solver_step=min(1e-3, mechanism.experiment.step),
        default_duration=mechanism.experiment.stop_time,
        # drift decays in about ten communication steps: a much faster decay would make the equations stiff
        stabilisation=0.1 / mechanism.experiment.step,
        further_names=tuple(s.name for s in z),
    )


def _columns(mechanism: Mechanism, variables: Sequence[Variable]) -> list[Collection[int]]:
    """The states that each acceleration and each derivative of a further state depends on, by structure.

    Where there are constraints these are all states.
    """
    q = [c.name for c in mechanism.coordinates]
    z = [state.name for state in further_states(mechanism)]
    if mechanism.constraints:
        return [range(2 * len(q) + len(z))] * (len(q) + len(z))
    column = {name: i for i, name in enumerate([*q, *map(names.velocity, q), *z])}
    known = {v.name: v.dependencies or () for v in variables}
    rates = [*map(names.acceleration, q), *map(names.derivative, z)]
    return [[column[name] for name in known[rate] if name in column] for rate in rates]
