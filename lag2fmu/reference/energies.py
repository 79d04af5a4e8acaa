"""The energies of a mechanism as numbers: T, V, Rayleigh's R and L = T - V, at one state or at a batch of m states.

What callers give and get has the batch as first axis: times (m,), coordinates (m, n). Inside, arrays have the batch as
last axis, (n, m), so that every row is one argument of a vectorised function.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import sympy as sp
from numpy.typing import ArrayLike

from lag2fmu.description.names import acceleration, force, multiplier, velocity
from lag2fmu.description.symbols import Coordinate, Parameter
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.language.vocabulary import TIME, symbol
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.composition import Composition, composition_of
from lag2fmu.reference.constraints import ConstraintFunctions, onward
from lag2fmu.reference.functions import Array, compiled
from lag2fmu.reference.spatial import Spatial
from lag2fmu.reference.state import Floats, InputValues, StateBatch, batch_last


class EnergyFunctions:
    """T, V, L (J) and R (W) of ``mechanism``; ``parameters`` (name -> SI value) replace declared values.

    Everything is composed and compiled when built. Inputs that are not given have their start value, external forces
    Q_<coordinate> are 0. Further states are given among the inputs. A ``composition`` other than the mechanism's own
    may have further parameters, such as the sides of frozen switches. They stand in ``constants`` behind those of the
    mechanism, and are 1 until they are set there. Raises LoadError for a parameter that is unknown, dependent, not
    finite or out of its bounds.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        parameters: Mapping[str, float] | None = None,
        composition: Composition | None = None,
    ) -> None:
        self.mechanism = mechanism
        self.composition = composition or composition_of(mechanism)
        self.n = len(self.composition.symbols.q)
        self.parameters = parameter_values(mechanism, parameters or {})
        s = self.composition.symbols
        self.constants = [np.float64(value) for value in self.parameters.values()]
        self.constants += [np.float64(1.0)] * (len(s.parameters) - len(self.constants))
        self._configuration = (TIME, *s.q, *s.qd, *s.motion, *s.motion_dot)
        c = self.composition
        self._energies = compiled((*self._configuration, *s.parameters), (c.kinetic, c.potential, c.dissipation))
        arguments = (TIME, *s.q, *s.qd, *s.inputs, *s.parameters)
        self._forces = compiled(arguments, c.forces)
        unknowns = [symbol(acceleration(item.name)) for item in mechanism.coordinates]
        unknowns += [symbol(multiplier(item.name)) for item in mechanism.constraints]
        everything = (TIME, *s.q, *s.qd, *s.inputs, *unknowns, *s.parameters)
        touching = [symbol(force(name)) for name in mechanism.unilateral_names]
        of_outputs = (TIME, *s.q, *s.qd, *s.inputs, *unknowns, *touching, *s.parameters)
        self._outputs = compiled(of_outputs, tuple(c.outputs.values()))
        self._further = compiled(everything, c.further)
        self.constraints = ConstraintFunctions(c, self.constants)
        self.spatial = Spatial(c, self.constants)
        starts = {u.name: u.start for u in mechanism.inputs} | {z.name: z.start for z in mechanism.states}
        self._starts = np.array([starts.get(x.name, 0.0) for x in s.inputs])
        self._row = {x.name: i for i, x in enumerate(s.inputs)}
        self._state_rows = [self._row[z.name] for z in mechanism.states if z.name in self._row]
        self._filtered = slice(3 * len(s.motion) - s.filtered, 3 * len(s.motion))
        self._filters = compiled((*s.inputs, *s.parameters), c.further[len(s.further) + 1 :: 2])

    @property
    def input_names(self) -> tuple[str, ...]:
        """The names of the inputs: y, y_dot, y_ddot of motions, plain inputs, Q_<coordinate>, then further states."""
        return tuple(self._row)

    def declared(self) -> StateBatch:
        """The state at t = 0 as it is declared, with guesses where nothing is given; hardly beyond a kink it is at.

        Raises LoadError and SimulationError as ``state`` does.
        """
        coordinates = self.mechanism.coordinates
        q, qd = np.array([c.start for c in coordinates]), np.array([c.velocity for c in coordinates])
        return self.state(0.0, onward(q, qd, self._nominal), qd)

    def start(self, time: float = 0.0, inputs: InputValues | None = None) -> tuple[Floats, Floats]:
        """The start values of q and qd, (n,) each, in SI units: as declared, guesses solved for the constraints.

        Raises SimulationError if the constraints cannot be met.
        """
        coordinates = self.mechanism.coordinates
        q, qd = np.array([c.start for c in coordinates]), np.array([c.velocity for c in coordinates])
        if not self.constraints.m:
            return q, qd
        free = [c.given is False for c in coordinates], [c.velocity_given is False for c in coordinates]
        return self.consistent(q, qd, time, inputs, free)

    def consistent(
        self,
        q: Floats,
        qd: Floats,
        time: float = 0.0,
        inputs: InputValues | None = None,
        free: tuple[list[bool], list[bool]] | None = None,
    ) -> tuple[Floats, Floats]:
        """q and qd, (n,) each, moved onto the constraints, see ``ConstraintFunctions.consistent``.

        ``time`` is in s. Raises SimulationError if the constraints cannot be met.
        """
        return self.constraints.consistent(lambda a, b: self.state(time, a, b, inputs), q, qd, self._nominal, free)

    def all_consistent(
        self, times: Floats, q: Floats, qd: Floats, inputs: Mapping[str, Floats]
    ) -> tuple[Floats, Floats]:
        """q and qd, (b, n) each, at ``times`` (b,) in s, moved onto the constraints; ``inputs`` are (b,) each.

        Raises SimulationError if the constraints cannot be met.
        """
        new_q, new_qd, met = self.constraints.consistent_together(
            lambda a, b: self.state(times, a, b, inputs), q, qd, self._nominal
        )
        for i in np.flatnonzero(~met).tolist():
            there = {name: float(values[i]) for name, values in inputs.items()}
            new_q[i], new_qd[i] = self.consistent(q[i], qd[i], float(times[i]), there)
        return new_q, new_qd

    @property
    def _nominal(self) -> Floats:
        return np.array([c.nominal for c in self.mechanism.coordinates])

    def state(self, t: ArrayLike, q: ArrayLike, qd: ArrayLike, inputs: InputValues | None = None) -> StateBatch:
        """The state with t in s, q and qd (n,) or (m, n), inputs name -> value or (m,).

        Raises LoadError for an unknown input, SimulationError for shapes that do not fit.
        """
        positions, velocities = np.asarray(q, dtype=float), np.asarray(qd, dtype=float)
        if positions.shape != velocities.shape or positions.shape[-1:] != (self.n,):
            raise SimulationError(
                f"q {positions.shape} and qd {velocities.shape} must both end with n = {self.n} coordinates"
            )
        batch = positions.shape[:-1]
        signals = np.empty((len(self._starts), *batch))
        signals[...] = self._starts.reshape(-1, *(1 for _ in batch))
        for name, value in (inputs or {}).items():
            if name not in self._row:
                raise LoadError(
                    f"mechanism '{self.mechanism.name}' has no input '{name}'; known are {', '.join(self._row)}"
                )
            signals[self._row[name]] = value
        self._accelerate(signals)
        time = np.empty(batch)
        time[...] = t
        return StateBatch(time, batch_last(positions), batch_last(velocities), signals)

    def with_states(self, inputs: Floats, z: Floats) -> Floats:
        """``inputs`` (3 k + m + n + f, *batch) with the further states z put in; z holds those of filters too."""
        inputs[self._state_rows] = z
        self._accelerate(inputs)
        return inputs

    def _accelerate(self, inputs: Floats) -> None:
        """Put the accelerations of filtered motions into ``inputs``; they follow from states and targets."""
        if self.composition.symbols.filtered:
            inputs[self._filtered] = self._filters(inputs, self.constants)

    def input_values(self, inputs: Mapping[str, float]) -> Floats:
        """All inputs in the order of ``input_names``, (3 k + m + n,), in SI units.

        An input that is not among ``inputs`` has its start value.
        """
        values: Floats = self._starts.copy()
        for name, value in inputs.items():
            values[self._row[name]] = value
        return values

    def energies(self, state: StateBatch) -> Floats:
        """T, V (J) and R (W) at ``state``: (3, *batch)."""
        rows = self._rows(state)
        values = self._energies(rows, self.constants)
        return values if self.spatial.empty else values + self.spatial.energies(rows)

    def forces(self, state: StateBatch) -> Floats:
        """The non-potential forces Q, (n, *batch), each in J by the unit of its coordinate.

        External forces are included, forces of dissipation R are not.
        """
        values = self._forces(state.rows, self.constants)
        return values if self.spatial.empty else values + self.spatial.forces(self._rows(state), state.inputs)

    def resistance_of_frames(self, state: StateBatch) -> Floats | float:
        """The power, in W, that dampers with a law of force on frames dissipate, (*batch,)."""
        return self.spatial.resistance(self._rows(state), state.inputs) if self.spatial.rated else 0.0

    def outputs(self, state: StateBatch, unknowns: Sequence[Floats], forces: Floats | None = None) -> dict[str, Floats]:
        """The outputs of the mechanism by name, in its order, in SI units, each (*batch).

        ``unknowns`` are the accelerations (n, *batch) and multipliers (m, *batch), ``forces`` those of contacts and
        stops (u, *batch); without them nothing touches.
        """
        if forces is None:
            forces = np.zeros((len(self.mechanism.unilateral_names), *state.rows.shape[1:]))
        rows = np.concatenate([state.rows, *unknowns, forces])
        values = dict(zip(self.composition.outputs, self._outputs(rows, self.constants), strict=True))
        if not self.spatial.empty:
            k, qdd = len(self.composition.symbols.motion), np.broadcast_to(unknowns[0], state.qd.shape)
            rates = np.concatenate([np.ones_like(state.t)[None], state.qd, qdd, state.inputs[k : 3 * k]])
            values |= self.spatial.outputs(self._rows(state), rates)
        return {name: values[name] for name in self.mechanism.output_names}

    def further(self, state: StateBatch, unknowns: Sequence[Floats]) -> Floats:
        """The derivatives of the further states, (f, *batch), in SI units.

        ``unknowns`` are the accelerations (n, *batch) and multipliers (m, *batch).
        """
        return self._further(np.concatenate([state.rows, *unknowns]), self.constants)

    def position(self, state: StateBatch, name: str) -> Floats:
        """The position (m) in the fixed frame of the point or body ``name``: (2 or 3, *batch)."""
        if self.composition.on_frame(name):
            return self.spatial.position(self._rows(state), name)
        arguments = (*self._configuration, *self.composition.symbols.parameters)
        return compiled(arguments, self.composition.place(name))(self._rows(state), self.constants)

    def velocity_part(self) -> Callable[[Array], Array]:
        """A function of rows (t, q, qd, y, y_dot), real or complex, that gives K, U (J) and R (W), (3, *batch).

        L = K - U, where K holds all terms that contain velocities.
        """
        moving, resting = self.composition.velocity_part()
        expressions: tuple[sp.Expr, ...] = (moving, resting, self.composition.dissipation)
        function = compiled((*self._configuration, *self.composition.symbols.parameters), expressions)
        if self.spatial.empty:
            return lambda rows: function(rows, self.constants)
        return lambda rows: function(rows, self.constants) + self.spatial.energies(rows)

    def _rows(self, state: StateBatch) -> Floats:
        """t, q, qd, y, y_dot of ``state``, (1 + 2 n + 2 k, *batch)."""
        return np.ascontiguousarray(state.rows[: len(self._configuration)])


def parameter_values(mechanism: Mechanism, overrides: Mapping[str, float]) -> dict[str, float]:
    """Every parameter's SI value, in the order of ``mechanism``, dependent ones computed from the others.

    Raises LoadError for ``overrides`` that are unknown, dependent, not finite or out of bounds.
    """
    values = _independent_values(mechanism, overrides)
    pending = {p.name: p.expression for p in mechanism.parameters if p.expression is not None}
    while pending:  # the record refuses circles, so that every pass finds a value
        for name, expression in list(pending.items()):
            used = sorted(expression.free_symbols, key=str)
            if {s.name for s in used} <= values.keys():
                row = np.array([[values[s.name]] for s in used]).reshape(len(used), 1)
                values[name] = float(compiled(used, [expression])(row, ())[0, 0])
                if not np.isfinite(values[name]):
                    raise LoadError(f"parameter '{name}' = {expression} is {values[name]} for the values given")
                del pending[name]
    return {p.name: values[p.name] for p in mechanism.parameters}


def _independent_values(mechanism: Mechanism, overrides: Mapping[str, float]) -> dict[str, float]:
    """The values of the parameters that follow from no others; raises LoadError for impossible ``overrides``."""
    known = {p.name: p for p in mechanism.parameters}
    for name, value in overrides.items():
        if name not in known:
            names = ", ".join(known) or "none"
            raise LoadError(f"mechanism '{mechanism.name}' has no parameter '{name}'; known are {names}")
        _check_value(known[name], value)
    return {p.name: float(overrides.get(p.name, p.value)) for p in mechanism.parameters if p.value is not None}


def _check_value(parameter: Parameter, value: float) -> None:
    if parameter.expression is not None:
        raise LoadError(f"parameter '{parameter.name}' follows from others and takes no value {value!r}")
    low, high = _bounds(parameter)
    if not np.isfinite(value) or not low <= value <= high:
        raise LoadError(f"parameter '{parameter.name}': {value!r} is not a finite number within [{low}, {high}]")


def declared_starts(mechanism: Mechanism, overrides: Mapping[str, float]) -> dict[str, float]:
    """{name: SI value} of q, qd and further states at the start, s of them, as declared.

    ``overrides`` {NAME or NAME_dot: SI value} replace declared values. Raises LoadError for a name that is no state,
    and for a value that is not finite or out of its bounds.
    """
    coordinates = mechanism.coordinates
    values = {c.name: c.start for c in coordinates} | {velocity(c.name): c.velocity for c in coordinates}
    values |= {z.name: z.start for z in mechanism.states}
    bounds = {c.name: _bounds(c) for c in coordinates}
    for name, value in overrides.items():
        if name not in values:
            raise LoadError(f"mechanism '{mechanism.name}' has no start value '{name}'; known are {', '.join(values)}")
        low, high = bounds.get(name, (-np.inf, np.inf))
        if not np.isfinite(value) or not low <= value <= high:
            raise LoadError(f"start value '{name}': {value!r} is not a finite number within [{low}, {high}]")
        values[name] = float(value)
    return values


def _bounds(of: Parameter | Coordinate) -> tuple[float, float]:
    return -np.inf if of.minimum is None else of.minimum, np.inf if of.maximum is None else of.maximum
