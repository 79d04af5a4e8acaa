"""The tables of the engine in C, made from the variables of an FMU."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from lag2fmu.codegen.colours import coloured
from lag2fmu.codegen.tables import RuntimeTables, Slot
from lag2fmu.description import names
from lag2fmu.dynamics.functions import Program
from lag2fmu.dynamics.massless import continuous_states, determined
from lag2fmu.dynamics.variables import integrated_states
from lag2fmu.fmu.elements import element_names
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.mechanism.ranges import open_bounds
from lag2fmu.mechanism.record import Mechanism


def runtime_tables(
    mechanism: Mechanism, program: Program, slots: Sequence[Slot], variables: Sequence[ScalarVariable]
) -> RuntimeTables:
    """The tables of the C code of ``mechanism``: ``slots`` in value reference order, starts and nominals in SI units.

    ``variables`` are those of the FMU with their dependencies, which determine the colours of the Jacobian.
    """
    unilaterals, frictions = element_names(mechanism)
    states = _states(mechanism)
    return RuntimeTables(
        model_name=mechanism.name,
        slots=tuple(slots),
        coordinate_names=tuple(c.name for c in mechanism.coordinates),
        start_states=tuple(start for start, _, _ in states),
        nominal_states=tuple(nominal for _, nominal, _ in states),
        given_states=tuple(given for _, _, given in states),
        further_names=tuple(s.name for s in integrated_states(mechanism)),
        constraint_names=_constraint_names(mechanism, program),
        unilateral_names=unilaterals,
        friction_names=frictions,
        holonomic=len(mechanism.holonomic) + program.unilaterals + program.offsets,
        continuous_states=continuous_states(mechanism),
        bounded=_bounded(mechanism),
        massless=_massless(mechanism, program),
        colours=coloured(_columns(mechanism, variables)),
        start_inputs=_start_inputs(mechanism, program, variables),
        motions=tuple(_needs_rates(program, u.name) for u in mechanism.motions),
        start_parameters=_start_parameters(mechanism, program),
        default_solver_step=default_solver_step(mechanism),
        default_duration=mechanism.experiment.stop_time,
        # drift decays in about ten communication steps; a much faster decay would make the equations stiff
        stabilisation=0.1 / mechanism.experiment.step,
    )


def default_solver_step(mechanism: Mechanism) -> float:
    """The step (s) of methods of fixed step where the user chooses none."""
    return min(1e-3, mechanism.experiment.step)


def _states(mechanism: Mechanism) -> list[tuple[float, float, bool]]:
    """(start, nominal value, whether the start is given) of q, qd and further states, in SI units."""
    q = mechanism.coordinates
    positions = [(c.start, c.nominal, c.given is not False) for c in q]
    velocities = [(c.velocity, c.nominal, c.velocity_given is not False) for c in q]
    return [*positions, *velocities, *((s.start, s.nominal, True) for s in integrated_states(mechanism))]


def _bounded(mechanism: Mechanism) -> tuple[tuple[int, float | None, float | None], ...]:
    """(index in q, smallest, greatest value) of the coordinates that may leave their range, as no stop holds them."""
    bounds = [open_bounds(q, mechanism.stops) for q in mechanism.coordinates]
    return tuple((k, low, high) for k, (low, high) in enumerate(bounds) if (low, high) != (None, None))


def _start_inputs(mechanism: Mechanism, program: Program, variables: Sequence[ScalarVariable]) -> tuple[float, ...]:
    """The starts of all inputs of ``program``, in SI units; those of hidden inputs are from the mechanism."""
    starts = {u.name: u.start for u in mechanism.inputs}
    starts |= {v.name: v.start for v in variables if v.start is not None}
    return tuple(starts.get(name, 0.0) for name in program.inputs)


def _constraint_names(mechanism: Mechanism, program: Program) -> tuple[str, ...]:
    """The names of the constraints in messages; rows that modes switch are among them."""
    contacts = mechanism.unilaterals
    rows = [
        *(contact.name for contact in contacts),
        *(f"slip of {contact.name}" for contact in contacts for _ in contact.slips),
        *(friction.name for friction in mechanism.frictions),
        *(latch.name for latch in mechanism.latches),
    ]
    named = dict(zip(program.places, rows, strict=True))
    named |= dict(zip(program.permanent, (c.name for c in mechanism.constraints), strict=True))
    return tuple(named[k] for k in range(program.constraints))


def _start_parameters(mechanism: Mechanism, program: Program) -> tuple[float, ...]:
    """p at the start: modes that nothing has settled yet, switches, then the independent parameters."""
    values = (p.value for p in mechanism.parameters if p.value is not None)
    return (*(0.0,) * program.masks, *(1.0,) * program.switches, *values)


def _massless(mechanism: Mechanism, program: Program) -> tuple[tuple[int, int], ...]:
    """(index of a constraint, index of the coordinate without mass that it determines) of each of them."""
    return tuple((program.permanent[k], i) for k, i in enumerate(determined(mechanism)) if i is not None)


def _needs_rates(program: Program, motion: str) -> bool:
    """Whether the equations contain the velocity or the acceleration of the input ``motion``."""
    return program.contains(names.velocity(motion)) or program.contains(names.acceleration(motion))


def _columns(mechanism: Mechanism, variables: Sequence[ScalarVariable]) -> list[Collection[int]]:
    """The states that each acceleration and each derivative of a further state depends on, by structure.

    Where there are constraints these are all states.
    """
    q = [c.name for c in mechanism.coordinates]
    z = [state.name for state in integrated_states(mechanism)]
    if mechanism.constraints or mechanism.hybrid:
        return [range(2 * len(q) + len(z))] * (len(q) + len(z))
    column = {name: i for i, name in enumerate([*q, *map(names.velocity, q), *z])}
    known = {v.name: v.dependencies or () for v in variables}
    rates = [*map(names.acceleration, q), *map(names.derivative, z)]
    return [[column[name] for name in known[rate] if name in column] for rate in rates]
