"""What the C code needs of an FMU's variables: the tables of the runtime."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from lag2fmu.codegen.colours import coloured
from lag2fmu.codegen.tables import RuntimeTables, Slot
from lag2fmu.description import names
from lag2fmu.dynamics.functions import Program
from lag2fmu.dynamics.massless import continuous_states, determined
from lag2fmu.dynamics.variables import integrated_states
from lag2fmu.fmu.elements import element_names
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.mechanism.record import Mechanism


def runtime_tables(
    mechanism: Mechanism, program: Program, slots: Sequence[Slot], variables: Sequence[ScalarVariable]
) -> RuntimeTables:
    """The tables of the C code of ``mechanism``: ``slots`` in value reference order, starts and nominals in SI units.

    ``variables`` are those of the FMU with their dependencies, of which the colours of the Jacobian follow.
    """
    q, z = mechanism.coordinates, integrated_states(mechanism)
    unilaterals, frictions = element_names(mechanism)
    starts: Mapping[str, float] = {v.name: v.start for v in variables if v.start is not None}
    hidden = {u.name: u.start for u in mechanism.inputs}
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
        further_names=tuple(s.name for s in z),
        constraint_names=_constraint_names(mechanism, program),
        unilateral_names=unilaterals,
        friction_names=frictions,
        holonomic=len(mechanism.holonomic) + program.unilaterals + program.offsets,
        continuous_states=continuous_states(mechanism),
        massless=_massless(mechanism, program),
        colours=coloured(_columns(mechanism, variables)),
        start_inputs=tuple(starts.get(name, hidden.get(name, 0.0)) for name in program.inputs),
        motions=tuple(_needs_rates(program, u.name) for u in mechanism.motions),
        start_parameters=_start_parameters(mechanism, program),
        default_solver_step=min(1e-3, mechanism.experiment.step),
        default_duration=mechanism.experiment.stop_time,
        # drift decays in about ten communication steps: a much faster decay would make the equations stiff
        stabilisation=0.1 / mechanism.experiment.step,
    )


def _constraint_names(mechanism: Mechanism, program: Program) -> tuple[str, ...]:
    """What messages call the constraints, rows that modes switch included."""
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
