"""Direct integration of a mechanism by SciPy, with an estimate of its own error and of how starts are amplified.

Two runs are made: one at ``rtol``, which is the result, and one at 10 ``rtol``. Where the inputs have many breaks both
would step from break to break and agree to the last bit, which says nothing about their error: the first one therefore
takes two steps there at least. The second is carried out together
with a run from a start perturbed by 1e-8, on the same steps, so that their difference is the effect of the start and
not of the integration. Method: DOP853, E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I,
section II.5; Radau IIA, same authors, volume II, section IV.8.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from lag2fmu.description.names import acceleration, multiplier, residual, velocity
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.mechanism import Mechanism
from lag2fmu.reference.composition import composition_of
from lag2fmu.reference.equations import Equations
from lag2fmu.reference.signals import Inputs, Signals, signals_of
from lag2fmu.reference.single import SingleState, single_state
from lag2fmu.reference.state import Floats, State
from lag2fmu.reference.trajectory import Trajectory

PERTURBATION = 1e-8
PACES = 20
"""Points of the motion at which the pace of each coordinate is measured."""
DAMPING = 0.1
SCIPY_METHODS = ("DOP853", "Radau")
COMPILED_AFTER = 1000
"""Evaluations of a small mechanism's equations that NumPy does in less time than a compiler takes."""
LONGEST_PART = 0.02
"""The longest step as a part of the run."""
MAX_EVALUATIONS, MAX_WITH_JUMPS = 500_000, 50_000
"""Evaluations of the equations in one run before a method counts as failed: stiff equations stall DOP853, and jumps of
the forces stall every method where they hold the motion, as dry friction does."""


@dataclass(frozen=True, eq=False)
class Reference:
    """A direct integration at m times; SI units.

    ``trajectory``: q, qd, further states, qdd, outputs, multipliers and residuals of constraints, kinetic_energy,
    potential_energy, generalized_energy. ``work`` (m,): integral of Q.qd - qd.dR/dqd - dL/dt in J, so that
    generalized_energy - work is constant. ``scales``: max(range, nominal) of every q, qd (nominal: the same by 1 s) and
    further state. ``error``: |difference| of the runs at rtol and 10 rtol, for q, qd, z; an estimate from above for the
    trajectory. ``amplification`` (m,): A(t), largest ratio until t of the distance of two runs to the distance of their
    starts, in units of the motion: the norm max |difference| / unit over q, qd and z, see ``_units``. ``method`` is
    what was used, ``evaluations`` what it took.
    """

    trajectory: Trajectory
    work: Floats
    scales: Mapping[str, float]
    error: Trajectory
    amplification: Floats
    method: str
    evaluations: int

    @property
    def relative_error(self) -> Floats:
        """The estimated error relative to ``scales``, the worst of q, qd and z: (m,)."""
        worst: Floats = (self.error.values / [self.scales[name] for name in self.error.names]).max(axis=1)
        return worst

    @property
    def growth(self) -> Floats:
        """How much larger than one error of a solver's step the sum of all may be, relative to a hundred of them: (m,).

        The amplification; and at least 1 for every hundred radians that the motion has swung through, for each of them
        adds an error of its own.
        """
        columns = [velocity(c) for c in self.scales if velocity(c) in self.scales]
        turns = np.abs(np.diff(self.trajectory.columns(columns), axis=0)) / [self.scales[name] for name in columns]
        radians = np.pi * np.concatenate([[0.0], np.cumsum(turns, axis=0).max(axis=1)])
        larger: Floats = np.maximum(np.maximum(1.0, self.amplification), radians / 100)
        return larger

    @property
    def balance(self) -> Floats:
        """generalized_energy - its start - work, in J: (m,); zero but for the integration's error."""
        h = self.trajectory["generalized_energy"]
        drift: Floats = h - h[0] - self.work
        return drift


def integrate(
    mechanism: Mechanism,
    times: ArrayLike,
    *,
    parameters: Mapping[str, float] | None = None,
    starts: Mapping[str, float] | None = None,
    inputs: Inputs | None = None,
    rtol: float = 1e-12,
    method: str = "DOP853",
    progress: Callable[[float], None] | None = None,
) -> Reference:
    """Integrate ``mechanism`` from times[0] and report at ``times`` (m,) in s, strictly increasing.

    ``parameters`` and ``starts`` (NAME and NAME_dot of coordinates, further states) replace declared SI values.
    ``inputs``: see ``signals_of``. ``rtol`` in [1e-13, 1e-2] weighs with |x| + nominal. Where DOP853 fails Radau is
    tried. ``progress`` is told the share that is done, 0 to 1. Raises LoadError for unknown or unusable names and
    values, SimulationError with the time reached. Source: Hairer, Norsett, Wanner, Solving Ordinary Differential
    Equations I, section II.5; Hairer, Wanner, volume II, section IV.8.
    """
    grid = _checked_times(times)
    if method not in SCIPY_METHODS or not 1e-13 <= rtol <= 1e-2:
        raise LoadError(
            f"integrate: method '{method}' and rtol {rtol!r}; "
            f"expected one of {', '.join(SCIPY_METHODS)} and 1e-13 to 1e-2"
        )
    equations = Equations(mechanism, parameters)
    signals = signals_of(mechanism, inputs, float(grid[0]))
    run = _Run(equations, signals, grid, _start(equations, starts or {}, float(grid[0]), signals))
    run.check_start()
    run.progress = progress
    for name in SCIPY_METHODS[SCIPY_METHODS.index(method) :]:
        try:
            run.share = 0.0
            raw, evaluations = run.solve(name, rtol, run.start[None], pieces=2)
            fine = run.projected(grid, raw[:, 0])
            scales = _scales(fine, run.nominal)
            units, run.share = _units(run, fine, scales), 0.5
            coarse, more = run.solve(name, 10 * rtol, np.stack([run.start, run.perturbed(units)]), pieces=1)
            return _assembled(run, fine, coarse, (scales, units), name, evaluations + more)
        except SimulationError as error:
            if run.jumps:
                raise SimulationError(f"{error}; {remedy_of_jumps(mechanism)}") from error
            if name == SCIPY_METHODS[-1]:
                raise
    raise AssertionError("unreachable")


def remedy_of_jumps(mechanism: Mechanism) -> str:
    """What to do about forces that jump during the motion, a phrase that names them; empty if there are none."""
    jumps = composition_of(mechanism).jumps()
    if not jumps:
        return ""
    first = jumps[0][jumps[0].index("(") + 1 : -1]
    return (
        f"the forces jump with {', '.join(jumps)}, which no step can pass where they hold the motion: write a smooth "
        f"function instead, such as tanh(({first})/w) with a small width w"
    )


class _Run:
    """One problem: z = (q, qd, further states, work), (s + 1,), from ``start`` over ``times`` (m,)."""

    def __init__(self, equations: Equations, signals: Signals, times: Floats, start: Floats) -> None:
        self.equations, self.signals, self.times, self.n = equations, signals, times, equations.n
        self.start = start
        self.further = [state.name for state in equations.mechanism.states]
        self.size = 2 * self.n + len(self.further)  # s
        # what pulls back onto the constraints, in units of the resolution that the experiment asks for
        self.damping = DAMPING / equations.mechanism.experiment.step if equations.energies.constraints.m else 0.0
        nominal = np.array([c.nominal for c in equations.mechanism.coordinates])
        self.nominal = np.concatenate([nominal, nominal, [z.nominal for z in equations.mechanism.states]])
        self.evaluations, self.end = 0, np.inf
        self.last = float(times[0]), start
        self._before_compiling = COMPILED_AFTER if equations.small else 0
        self._single: SingleState | None = None
        self.progress: Callable[[float], None] | None = None
        self.jumps = equations.energies.composition.jumps()
        self.share = 0.0  # what was done before the run that is going on, which is half of all

    def state(self, t: float, z: Floats) -> State:
        """The state at z (copies, s + 1)."""
        inputs: dict[str, ArrayLike] = {**self._inputs(t), **self.further_of(z)}
        return self.equations.energies.state(t, z[:, : self.n], z[:, self.n : 2 * self.n], inputs)

    def further_of(self, z: Floats) -> dict[str, Floats]:
        """The further states by name, (m,) each, of z (m, s + 1)."""
        return dict(zip(self.further, z[:, 2 * self.n : self.size].T, strict=True))

    def _inputs(self, t: float) -> Mapping[str, float]:
        """The inputs at t; those that jump keep their value until the end of the segment."""
        return self.signals.at(min(t, float(np.nextafter(self.end, -np.inf))))

    def check_start(self) -> None:
        """Raise SimulationError where the mechanism cannot start: M singular, something not finite."""
        state = self.state(float(self.times[0]), self.start[None])
        qdd, _, power = self.equations.rates(state)
        if not (np.isfinite(qdd).all() and np.isfinite(power).all()):
            raise SimulationError(
                f"{self._place(self.times[0])}: no accelerations at the start, {self.equations.weakness(state)}"
            )
        reason = self.equations.weakness(state)
        if "singular" in reason:
            raise SimulationError(f"{self._place(self.times[0])}: {reason}")

    def perturbed(self, units: Floats) -> Floats:
        """The start moved by 1e-8 in the norm of the ``units`` (s,), along a direction without symmetry."""
        direction = np.cos(np.arange(1, self.size + 1))
        moved: Floats = self.start.copy()
        moved[: self.size] += PERTURBATION * units * direction / np.abs(direction).max()
        back: Floats = self.projected(self.times[:1], moved[None])[0]
        return back

    def projected(self, times: Floats, z: Floats) -> Floats:
        """z (m, s + 1) at ``times`` moved onto the constraints; nothing without constraints."""
        if not self.equations.energies.constraints.m:
            return z
        found: Floats = z.copy()
        for row, t in zip(found, times, strict=True):
            inputs = {**self.signals.at(float(t)), **{k: x[0] for k, x in self.further_of(row[None]).items()}}
            q, qd = self.equations.energies.consistent(row[: self.n], row[self.n : 2 * self.n], float(t), inputs)
            row[: 2 * self.n] = [*q, *qd]
        return found

    def solve(self, method: str, rtol: float, start: Floats, pieces: int) -> tuple[Floats, int]:
        """z at the times, (m, copies, s + 1), from ``start`` (copies, s + 1), and the evaluations it took.

        No step is longer than 1 / ``pieces`` of the way to the next break of the inputs, or of LONGEST_PART of the
        whole: what lasts for a short time only is not stepped over.
        """
        weights = np.append(self.nominal, self._energy_scale())
        atol = np.broadcast_to(rtol * weights, start.shape).ravel()
        first, last = self.times[0], self.times[-1]
        breaks = self.signals.breaks
        ends = [*np.unique(breaks[(breaks > first) & (breaks < last)]), last]
        z, t, self.evaluations = start.ravel(), first, 0
        found = [z[None]]
        for self.end in ends if last > first else ():
            inside = self.times[(self.times > t) & (self.times <= self.end)]
            asked = inside if len(inside) and inside[-1] == self.end else np.append(inside, self.end)
            # SciPy refuses steps below 10 units of rounding: a break may be that close to an output time
            longest = min(self.end - t, LONGEST_PART * (last - first)) / pieces
            longest = max(longest, 16 * np.spacing(abs(self.end)))
            values = self._segment(method, (t, self.end), z, t_eval=asked, rtol=rtol, atol=atol, max_step=longest)
            found.append(values[: len(inside)])
            z, t = values[-1], self.end
        return np.concatenate(found).reshape(len(self.times), *start.shape), self.evaluations

    def _segment(self, method: str, span: tuple[float, float], z: Floats, **options: Any) -> Floats:
        """z at the times asked, (times, size), without a break of the inputs in between."""
        from scipy.integrate import solve_ivp

        try:
            solution = solve_ivp(self._slope, span, z, method, **options)
        except _TooLongError as error:
            reason = f"{method} took {self.evaluations - 1} evaluations"
            raise SimulationError(f"{self._place(error.args[0])}: {reason}") from None
        if solution.status != 0:
            # steps have become tiny: the time of the last one tried is the time reached
            reason = self._reason(solution.message)
            raise SimulationError(f"{self._place(self.last[0])}: {method} cannot go on; {reason}")
        values: Floats = solution.y.T
        return values

    def _slope(self, t: float, z: Floats) -> Floats:
        """dz/dt, flat; NaN where there are no accelerations, which makes the method take a shorter step."""
        self.evaluations += 1
        if self.evaluations > (MAX_WITH_JUMPS if self.jumps else MAX_EVALUATIONS):
            raise _TooLongError(t)
        self.last = (t, z)
        if self.progress is not None and self.evaluations % 100 == 0:
            self.progress(self.share + 0.5 * (t - self.times[0]) / (self.times[-1] - self.times[0]))
        copies, n = z.reshape(-1, self.size + 1), self.n
        if self._before_compiling == 0:
            self._single = single_state(self.equations)
        self._before_compiling -= 1
        if self._single is None:
            state = self.state(t, copies)
            qdd, multipliers, power = self.equations.rates(state, self.damping)
            further = self.equations.energies.further(state, (qdd, multipliers))
            return np.concatenate([copies[:, n : 2 * n], qdd.T, further.T, power[:, None]], axis=1).ravel()
        inputs = self.equations.energies.input_values(self._inputs(t))
        slopes = np.empty_like(copies)
        slopes[:, :n] = copies[:, n : 2 * n]
        for copy, slope in zip(copies, slopes, strict=True):
            inputs[len(inputs) - len(self.further) :] = copy[2 * n : self.size]
            qdd, multipliers, slope[self.size] = self._single.rates(t, copy, inputs, self.damping)
            slope[n : 2 * n] = qdd
            if self.further:
                state = State(np.asarray(t), copy[:n], copy[n : 2 * n], inputs)
                slope[2 * n : self.size] = self.equations.energies.further(state, (qdd, multipliers))
        return slopes.ravel()

    def _energy_scale(self) -> float:
        """An energy (J) to weigh the error of the work with: T at nominal velocities."""
        terms = self.equations.terms(self.state(float(self.times[0]), self.start[None]))
        scale = float(0.5 * np.abs(np.diagonal(terms.mass_matrix)[0] * self.nominal[: self.n] ** 2).sum())
        return scale if scale > 0 else 1.0

    def _reason(self, message: str) -> str:
        """Why it stopped: what is wrong with the last state tried, else what SciPy says."""
        t, z = self.last
        state = self.state(t, z.reshape(-1, self.size + 1))
        if np.isfinite(self.equations.rates(state)[0]).all():
            return message
        return self.equations.weakness(state)

    def _place(self, t: float) -> str:
        return f"mechanism '{self.equations.mechanism.name}' at time {float(t)!r} s"


class _TooLongError(Exception):
    """A method took more than MAX_EVALUATIONS evaluations; carries the time reached."""


def _checked_times(times: ArrayLike) -> Floats:
    """``times`` as an array; raises SimulationError unless there is one and they increase."""
    grid = np.atleast_1d(np.asarray(times, dtype=float))
    if grid.ndim != 1 or not len(grid):
        raise SimulationError(f"integrate: times have shape {grid.shape}; give one time or more")
    return Trajectory(grid, (), np.empty((len(grid), 0))).time


def _start(equations: Equations, overrides: Mapping[str, float], time: float, signals: Signals) -> Floats:
    """z at the start, (s + 1,): declared values, ``overrides`` by NAME or NAME_dot; raises LoadError.

    Guesses are solved for the constraints at ``time``.
    """
    mechanism, energies = equations.mechanism, equations.energies
    coordinates = mechanism.coordinates
    values = {c.name: c.start for c in coordinates} | {velocity(c.name): c.velocity for c in coordinates}
    values |= {z.name: z.start for z in mechanism.states}
    bounds = {c.name: (c.minimum, c.maximum) for c in coordinates}
    for name, value in overrides.items():
        if name not in values:
            raise LoadError(f"mechanism '{mechanism.name}' has no start value '{name}'; known are {', '.join(values)}")
        low, high = bounds.get(name, (None, None))
        if not np.isfinite(value) or (low is not None and value < low) or (high is not None and value > high):
            raise LoadError(f"start value '{name}': {value!r} is not a finite number within [{low}, {high}]")
        values[name] = float(value)
    found: Floats = np.array(list(values.values()))
    if energies.constraints.m:
        free = [c.given is False for c in coordinates], [c.velocity_given is False for c in coordinates]
        n, inputs = energies.n, {**signals.at(time), **{z.name: values[z.name] for z in mechanism.states}}
        found[: 2 * n] = np.concatenate(energies.consistent(found[:n], found[n : 2 * n], time, inputs, free))
    return np.append(found, 0.0)


def _scales(z: Floats, nominal: Floats) -> Floats:
    """max(range, nominal) of q, qd and further states over a run z (m, s + 1): (s,)."""
    scales: Floats = np.maximum(np.ptp(z[:, : len(nominal)], axis=0), nominal)
    return scales


def _units(run: _Run, z: Floats, scales: Floats) -> Floats:
    """What distances of two runs are measured in, (s,): the scales, velocities by the pace of their coordinates too.

    A coordinate that is moved by its scale swings with the rate sqrt(|d qdd/dq|) (1/s, the greatest along z (m, s + 1))
    and gets velocities of scale times rate. Without that a fast vibration would look like a growing one.
    """
    n = run.n
    rows = np.unique(np.linspace(0, len(z) - 1, PACES).astype(int))
    times, q, qd = run.times[rows], z[rows, :n], z[rows, n : 2 * n]
    inputs = {**run.signals.sampled(times), **run.further_of(z[rows])}
    changes = []
    for i, change in enumerate(1e-6 * scales[:n]):
        sides = []
        for sign in (1, -1):
            moved = q.copy()
            moved[:, i] += sign * change
            sides.append(run.equations.rates(run.equations.energies.state(times, moved, qd, inputs))[0][i])
        changes.append(np.nanmax(np.nan_to_num(np.abs(sides[0] - sides[1]), posinf=0.0)) / (2 * change))
    speeds = np.maximum(scales[n : 2 * n], scales[:n] * np.sqrt(changes))
    return np.concatenate([scales[:n], speeds, scales[2 * n :]])


def _assembled(
    run: _Run, fine: Floats, coarse: Floats, measures: tuple[Floats, Floats], method: str, evaluations: int
) -> Reference:
    """The record of two runs: ``fine`` (m, s + 1), ``coarse`` (m, 2, s + 1) with the perturbed one.

    ``measures`` are the scales and units of q, qd and further states, (s,) each.
    """
    n, equations, times = run.n, run.equations, run.times
    inputs = {**run.signals.sampled(times), **run.further_of(fine)}
    names = [c.name for c in equations.mechanism.coordinates]
    states = [*names, *map(velocity, names), *run.further]
    q, qd = fine[:, :n], fine[:, n : 2 * n]
    columns = dict(zip(states, fine.T, strict=False))
    columns |= dict(zip(map(acceleration, names), equations.accelerations(times, q, qd, inputs).T, strict=True))
    columns |= equations.outputs(times, q, qd, inputs)
    constraints = equations.energies.constraints.names
    for name, found in ((multiplier, equations.multipliers), (residual, equations.residuals)):
        columns |= dict(zip(map(name, constraints), found(times, q, qd, inputs).T, strict=True))
    for energy in ("kinetic_energy", "potential_energy", "generalized_energy"):
        columns[energy] = getattr(equations, energy)(times, q, qd, inputs)
    scales, units = measures
    distance = (np.abs(coarse[:, 1, : run.size] - coarse[:, 0, : run.size]) / units).max(axis=1)
    return Reference(
        trajectory=Trajectory.of(times, columns),
        work=fine[:, run.size],
        scales=dict(zip(states, scales.tolist(), strict=True)),
        error=Trajectory(times, tuple(states), np.abs(fine - coarse[:, 0])[:, : run.size]),
        amplification=np.maximum.accumulate(distance / distance[0]),
        method=method,
        evaluations=evaluations,
    )
