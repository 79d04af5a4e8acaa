"""The tables of a mechanism that the runtime in C reads: value references, numbers, names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

from lag2fmu.codegen.colours import Colouring

Vibrations = tuple[tuple[float, int], ...]
"""(frequency in rad/s, number of the coordinate that moves most) of vibrations, the fastest first."""


@dataclass(frozen=True)
class Slot:
    """What a value reference stands for: ``index`` in the vector of ``kind`` (a VariableKind of the runtime).

    ``minimum`` and ``maximum`` in SI units; ``output``: its time derivatives can be asked for.
    """

    name: str
    kind: str
    index: int
    minimum: float | None = None
    maximum: float | None = None
    output: bool = False


@dataclass(frozen=True)
class PortTable:
    """What value references stand for: (name, first slot, number of slots, whether these have a port before) of each.

    ``dependencies`` has for each of them the (index of the known, whether it enters with a constant factor) that it
    depends on.
    """

    ports: tuple[tuple[str, int, int, bool], ...]
    dependencies: tuple[tuple[tuple[int, bool], ...], ...]

    @property
    def first_dependencies(self) -> tuple[int, ...]:
        """Where the dependencies of each port begin in the list of all, and the end of the list."""
        return tuple(accumulate(map(len, self.dependencies), initial=0))


@dataclass(frozen=True)
class RuntimeTables:
    """The numbers and names of one mechanism; values in SI units, states are (q, qd), slots in value reference order.

    ``holonomic`` is the number of holonomic constraints. ``continuous_states`` are the indices of those entries of
    (q, qd) that are states of the FMU. ``massless`` has a pair (index of a constraint, index of the coordinate) for
    each coordinate without mass: the constraint determines the coordinate; holonomic ones come first. ``colours`` are
    those of the Jacobian of the accelerations by the states. ``vibrations`` are those that the solver gets wrong if its
    steps do not resolve them. ``motions`` says for each motion input whether the equations contain one of its
    derivatives; motion inputs are the last inputs. ``default_solver_step`` (s) is the step of methods of fixed step,
    ``default_duration`` (s) the stop time of the experiment. ``stabilisation`` (1/s) is the rate at which the drift of
    constraints decays.
    ``unilateral_names`` are those of contacts and stops, ``friction_names`` those of dry frictions.
    ``further_names`` are the further states, which stand behind (q, qd). ``ports`` is None where value references are
    the slots.
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
    vibrations: Vibrations = ()
    unilateral_names: tuple[str, ...] = ()
    friction_names: tuple[str, ...] = ()
    further_names: tuple[str, ...] = ()
    ports: PortTable | None = None

    @property
    def element_names(self) -> tuple[str, ...]:
        """What has a mode: contacts and stops, then dry frictions."""
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
    def bounded(self) -> list[Slot]:
        """The coordinates with a range."""
        kinds, n = ("VARIABLE_STATE", "VARIABLE_MASSLESS"), len(self.coordinate_names)
        slots = [s for s in self.slots if s.kind in kinds and s.index < n]
        return [s for s in slots if (s.minimum, s.maximum) != (None, None)]

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
