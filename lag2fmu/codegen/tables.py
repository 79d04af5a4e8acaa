"""The tables of a mechanism that the engine in C reads: value references, numbers, names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import NamedTuple

from lag2fmu.codegen.colours import Colouring
from lag2fmu.dynamics.functions import Program

Vibrations = tuple[tuple[float, int], ...]
"""(angular frequency in rad/s, index of the coordinate that moves most) of each vibration, the fastest first."""


@dataclass(frozen=True)
class Slot:
    """The variable of a value reference: entry ``index`` of the vector of ``kind`` (a VariableKind of the engine).

    ``minimum`` and ``maximum`` are in SI units. The time derivatives of an ``output`` can be asked for.
    """

    name: str
    kind: str
    index: int
    minimum: float | None = None
    maximum: float | None = None
    output: bool = False


class PortTable(NamedTuple):
    """The ports of a mechanism, in the order of their value references.

    Each port is (name, first slot, number of slots, whether an earlier port has the same slots). ``dependencies`` has,
    for each port, the pairs (index of a known that it depends on, whether the known enters with a constant factor).
    """

    ports: tuple[tuple[str, int, int, bool], ...]
    dependencies: tuple[tuple[tuple[int, bool], ...], ...]

    @property
    def first_dependencies(self) -> tuple[int, ...]:
        """The index at which the dependencies of each port begin in the list of all, and the length of this list."""
        return tuple(accumulate(map(len, self.dependencies), initial=0))


class StepBound(NamedTuple):
    """What bounds a step in real time: the ``longest`` communication step (s), and the most ``solver_steps`` in it."""

    longest: float
    solver_steps: int


class ObserverTable(NamedTuple):
    """What an observer works with: ``program`` has the functions of an ``Observation``.

    - ``measured``, ``bound``, ``pivots``: the numbers of what is measured, of residuals, and of pivots.
    - ``entries``: (row, column) of each derivative.
    - ``estimated``: the places of estimated parameters among all of them.
    - ``noisy``: for each density of noise the place of its state, -1 for an input.
    - ``starts``: of the slots of the observer, in SI units, in the order of observer_memory.h.
    - ``delayed``: whether samples may be late. ``unscented``: whether covariances follow from points,
      and ``simplex``: whether these are the corners of a simplex.
    """

    program: Program
    measured: int
    bound: int
    pivots: int
    entries: tuple[tuple[int, int], ...]
    estimated: tuple[int, ...]
    noisy: tuple[int, ...]
    starts: tuple[float, ...]
    delayed: bool
    unscented: bool
    simplex: bool


class RuntimeTables(NamedTuple):
    """The numbers and names of one mechanism; values in SI units, states are (q, qd), slots in value reference order.

    - ``holonomic``: the number of holonomic constraints.
    - ``continuous_states``: the indices of the entries of (q, qd) that are states of the FMU.
    - ``massless``: (index of a constraint, index of the coordinate that it determines) for each coordinate without
      mass; holonomic constraints come first.
    - ``bounded``: (index in q, smallest, greatest value) of coordinates that may leave their range.
    - ``colours``: of the Jacobian of the accelerations by the states.
    - ``vibrations``: those that the solver gets wrong if its steps do not resolve them.
    - ``motions``: for each motion input, whether the equations contain one of its derivatives; motion inputs are the
      last inputs.
    - ``default_solver_step`` (s): the step of methods of fixed step.
    - ``default_duration`` (s): the stop time of the experiment.
    - ``stabilisation`` (1/s): the rate at which the drift of constraints decays.
    - ``unilateral_names``: of contacts and stops; ``friction_names``: of dry frictions.
    - ``further_names``: of the further states, which follow (q, qd).
    - ``ports``: None if the value references are the slots.
    - ``bound``: of steps in real time, which allocate no memory; None where nothing bounds them.
    - ``observer``: what an observer works with; None for FMUs that integrate.
    """

    model_name: str
    slots: tuple[Slot, ...]
    coordinate_names: tuple[str, ...]
    start_states: tuple[float, ...]
    nominal_states: tuple[float, ...]
    given_states: tuple[bool, ...]
    constraint_names: tuple[str, ...]
    holonomic: int
    continuous_states: tuple[int, ...]
    massless: tuple[tuple[int, int], ...]
    colours: Colouring
    start_inputs: tuple[float, ...]
    motions: tuple[bool, ...]
    start_parameters: tuple[float, ...]
    default_solver_step: float
    default_duration: float
    stabilisation: float
    bounded: tuple[tuple[int, float | None, float | None], ...] = ()
    vibrations: Vibrations = ()
    unilateral_names: tuple[str, ...] = ()
    friction_names: tuple[str, ...] = ()
    further_names: tuple[str, ...] = ()
    ports: PortTable | None = None
    bound: StepBound | None = None
    observer: ObserverTable | None = None

    @property
    def element_names(self) -> tuple[str, ...]:
        """The names of all elements with a mode: contacts and stops, then dry frictions."""
        return self.unilateral_names + self.friction_names

    @property
    def further(self) -> int:
        """The number of further states."""
        return len(self.further_names)

    @property
    def massless_positions(self) -> int:
        """The number of coordinates without mass that follow from holonomic constraints."""
        return sum(k < self.holonomic for k, _ in self.massless)

    @property
    def starts(self) -> list[tuple[str, str, Sequence[float]]]:
        """(name in C, size in C, values) of the constant vectors."""
        return [
            ("START_STATES", "N_STATES", self.start_states),
            ("NOMINAL_STATES", "N_STATES", self.nominal_states),
            ("START_INPUTS", "N_SIGNALS", self.start_inputs),
            ("START_PARAMETERS", "SIZE_PARAMETERS", self.start_parameters),
        ]

    @property
    def vectors(self) -> list[tuple[str, list[str]]]:
        """(letter, names of the entries) of the vectors in the generated code."""
        letters = {"x": "VARIABLE_STATE", "u": "VARIABLE_INPUT", "p": "VARIABLE_PARAMETER", "y": "VARIABLE_LOCAL"}
        names = {letter: [s.name for s in self.slots if s.kind == kind] for letter, kind in letters.items()}
        states = {s.index: s.name for s in self.slots if s.kind in ("VARIABLE_STATE", "VARIABLE_MASSLESS")}
        return list({**names, "x": [states[i] for i in sorted(states)]}.items())
