"""Direct integration of a mechanism by SciPy, with an estimate of its own error and of how starts are amplified.

Two runs are made. The first run, at ``rtol``, is the result. The second run is at 10 ``rtol``. If the inputs have many
breaks, both runs might step from break to break and agree to the last bit, which says nothing about their error. So the
first run takes at least two steps between breaks. The second run carries a perturbed run along, on the same steps,
whose start is moved by 1e-8. The difference of these two is the effect of the start and not of the integration. A
hybrid mechanism gets three runs, each with its own events.
Method: DOP853, E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, section II.5; Radau IIA,
same authors, volume II, section IV.8.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from lag2fmu.description.names import acceleration, multiplier, residual, velocity
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.composition import composition_of
from lag2fmu.reference.energies import declared_starts
from lag2fmu.reference.equations import Equations
from lag2fmu.reference.hybrid.columns import columns_of
from lag2fmu.reference.hybrid.comparison import HybridResult, compared, perturbed
from lag2fmu.reference.hybrid.following import Follower
from lag2fmu.reference.hybrid.kinks import is_hybrid
from lag2fmu.reference.hybrid.run import HybridRun, Track
from lag2fmu.reference.hybrid.starting import started
from lag2fmu.reference.hybrid.system import HybridSystem
from lag2fmu.reference.initial_value_problem import SCIPY_METHODS, InitialValueProblem
from lag2fmu.reference.integrated import Reference
from lag2fmu.reference.signals import Inputs, Signals, signals_of
from lag2fmu.reference.state import Floats
from lag2fmu.reference.trajectory import Trajectory

PACES = 20
"""Points of the motion at which the pace of each coordinate is measured."""


def integrate(
    mechanism: Mechanism,
    times: ArrayLike,
    *,
    parameters: Mapping[str, float] | None = None,
    starts: Mapping[str, float] | None = None,
    inputs: Inputs | None = None,
    rtol: float = 1e-12,
    method: str = "DOP853",
    whole: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Reference:
    """Integrate ``mechanism`` from times[0] and report at ``times`` (m,) in s, strictly increasing.

    - ``parameters``, ``starts``: {name: SI value} that replace declared values; starts are called NAME and NAME_dot of
      coordinates, and NAME of further states.
    - ``inputs``: see ``signals_of``.
    - ``rtol``: in [1e-13, 1e-2], relative to |x| + nominal.
    - ``method``: where DOP853 fails, Radau is tried.
    - ``whole``: the length, in s, of the whole run that the times are a part of, by default that of the times. The
      longest step is a part of it.
    - ``progress``: a function that is told the share that is done, 0 to 1.

    Raises LoadError for unknown or unusable names and values, SimulationError with the time reached. Source: Hairer,
    Norsett, Wanner, Solving Ordinary Differential Equations I, section II.5; Hairer, Wanner, volume II, section IV.8.
    """
    grid = _checked_times(times)
    if method not in SCIPY_METHODS or not 1e-13 <= rtol <= 1e-2:
        raise LoadError(
            f"integrate: method '{method}' and rtol {rtol!r}; "
            f"expected one of {', '.join(SCIPY_METHODS)} and 1e-13 to 1e-2"
        )
    signals = signals_of(mechanism, inputs, float(grid[0]))
    if is_hybrid(mechanism):
        return _hybrid(mechanism, grid, signals, (parameters, starts or {}), (method, rtol), progress)
    equations = Equations(mechanism, parameters)
    problem = InitialValueProblem(equations, signals, grid, _start(equations, starts or {}, float(grid[0]), signals))
    problem.check_start()
    problem.progress, problem.whole = progress, whole or problem.whole
    for name in SCIPY_METHODS[SCIPY_METHODS.index(method) :]:
        try:
            problem.share = 0.0
            raw, evaluations = problem.solve(name, rtol, problem.start[None], pieces=2)
            fine = problem.projected(grid, raw[:, 0])
            scales = _scales(fine, problem.nominal)
            units, problem.share = _units(problem, fine, scales), 0.5
            coarse, more = problem.solve(name, 10 * rtol, np.stack([problem.start, problem.perturbed(units)]), pieces=1)
            return _assembled(problem, fine, coarse, (scales, units), name, evaluations + more)
        except SimulationError as error:
            if problem.jumps:
                raise SimulationError(f"{error}; {remedy_of_jumps(mechanism)}") from error
            if name == SCIPY_METHODS[-1]:
                raise
    raise AssertionError("unreachable")


def _hybrid(
    mechanism: Mechanism,
    grid: Floats,
    signals: Signals,
    values: tuple[Mapping[str, float] | None, Mapping[str, float]],
    accuracy: tuple[str, float],
    progress: Callable[[float], None] | None,
) -> Reference:
    """The reference of a hybrid ``mechanism``; ``values``: parameters and starts, ``accuracy``: method and rtol."""
    (parameters, starts), (method, rtol) = values, accuracy
    for name in SCIPY_METHODS[SCIPY_METHODS.index(method) :]:
        try:
            found = _three_runs(
                mechanism,
                grid,
                signals,
                parameters=parameters,
                starts=starts,
                rtol=rtol,
                method=name,
                progress=progress,
            )
        except SimulationError as error:
            if name == SCIPY_METHODS[-1]:
                remedy = remedy_of_jumps(mechanism)
                raise SimulationError(f"{error}; {remedy}" if remedy else str(error)) from error
            continue
        states = [c.name for c in mechanism.coordinates]
        states += [velocity(c) for c in states]
        states += [z.name for z in mechanism.states]
        return Reference(
            trajectory=Trajectory.of(grid, found.columns),
            work=found.work,
            scales=dict(zip(states, found.scales.tolist(), strict=True)),
            error=Trajectory(grid, tuple(states), found.errors),
            amplification=found.amplification,
            method=name,
            evaluations=found.evaluations,
            events=found.events,
            turns=found.turns,
            comparable=found.comparable,
        )
    raise AssertionError("unreachable")


def _three_runs(
    mechanism: Mechanism,
    times: Floats,
    signals: Signals,
    *,
    parameters: Mapping[str, float] | None,
    starts: Mapping[str, float],
    rtol: float,
    method: str,
    progress: Callable[[float], None] | None = None,
) -> HybridResult:
    """Runs at ``rtol``, at 10 ``rtol``, and at 10 ``rtol`` from a start perturbed by 1e-8, compared.

    They go over ``times`` (m,) in s; arguments as of ``integrate``.
    Raises LoadError for unusable starts, SimulationError with the time reached.
    """
    system = HybridSystem(mechanism, parameters)
    run = HybridRun(system, signals, times)
    tracks: list[Track] = []
    start = started(run, starts)

    def share(done: float) -> None:
        if progress is not None:
            progress((len(tracks) + done) / 3)

    run.progress = share
    tracks.append(Follower(run, method, rtol).follow(start))
    fine = tracks[0]
    scales = np.maximum(np.ptp(fine.values[:, : run.size], axis=0), run.nominal)
    for begin in (start, perturbed(run, start, scales, fine.modes[0])):
        tracks.append(Follower(run, method, 10 * rtol).follow(begin))
    return compared(run, tracks, scales, columns_of(run, fine))


def remedy_of_jumps(mechanism: Mechanism) -> str:
    """A phrase that names the forces that jump during the motion, and the remedy; "" if there are none."""
    jumps = composition_of(mechanism).jumps()
    if not jumps:
        return ""
    first, named = jumps[0][1], ", ".join(call for call, _ in jumps)
    return (
        f"the forces jump with {named}, which no step can pass where they hold the motion: declare dry "
        f"friction in [frictions], or write a smooth function, such as tanh(({first})/w) with a small width w"
    )


def _checked_times(times: ArrayLike) -> Floats:
    """``times`` as an array; raises SimulationError unless there is one and they increase."""
    grid = np.atleast_1d(np.asarray(times, dtype=float))
    if grid.ndim != 1 or not len(grid):
        raise SimulationError(f"integrate: times have shape {grid.shape}; give one time or more")
    return Trajectory(grid, (), np.empty((len(grid), 0))).time


def _start(equations: Equations, overrides: Mapping[str, float], time: float, signals: Signals) -> Floats:
    """z at the start, (s + 1,), in SI units; guesses are solved for the constraints at ``time`` (s).

    ``overrides`` {NAME or NAME_dot: SI value} replace declared values. Raises LoadError for those that cannot be used.
    """
    mechanism, energies = equations.mechanism, equations.energies
    coordinates, values = mechanism.coordinates, declared_starts(mechanism, overrides)
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


def _units(problem: InitialValueProblem, z: Floats, scales: Floats) -> Floats:
    """The units of the distance of two runs, (s,): the ``scales`` (s,); those of velocities may be greater.

    A coordinate that is moved by its scale swings at the rate sqrt(|d qdd/dq|), in 1/s, the greatest along z (m, s +
    1). It gets velocities of scale times rate. With smaller units of velocities a fast vibration would look like a
    growing one.
    """
    n = problem.n
    rows = np.unique(np.linspace(0, len(z) - 1, PACES).astype(int))
    times, q, qd = problem.times[rows], z[rows, :n], z[rows, n : 2 * n]
    inputs = {**problem.signals.sampled(times), **problem.further_of(z[rows])}
    changes = []
    for i, change in enumerate(1e-6 * scales[:n]):
        sides = []
        for sign in (1, -1):
            moved = q.copy()
            moved[:, i] += sign * change
            sides.append(problem.equations.rates(problem.equations.energies.state(times, moved, qd, inputs))[0][i])
        changes.append(np.nanmax(np.nan_to_num(np.abs(sides[0] - sides[1]), posinf=0.0)) / (2 * change))
    speeds = np.maximum(scales[n : 2 * n], scales[:n] * np.sqrt(changes))
    return np.concatenate([scales[:n], speeds, scales[2 * n :]])


def _assembled(
    problem: InitialValueProblem,
    fine: Floats,
    coarse: Floats,
    measures: tuple[Floats, Floats],
    method: str,
    evaluations: int,
) -> Reference:
    """The record of two runs: ``fine`` (m, s + 1), ``coarse`` (m, 2, s + 1) with the perturbed one.

    ``measures`` are the scales and units of q, qd and further states, (s,) each.
    """
    n, equations, times = problem.n, problem.equations, problem.times
    inputs = {**problem.signals.sampled(times), **problem.further_of(fine)}
    names = [c.name for c in equations.mechanism.coordinates]
    states = [*names, *map(velocity, names), *problem.further]
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
    distance = (np.abs(coarse[:, 1, : problem.size] - coarse[:, 0, : problem.size]) / units).max(axis=1)
    return Reference(
        trajectory=Trajectory.of(times, columns),
        work=fine[:, problem.size],
        scales=dict(zip(states, scales.tolist(), strict=True)),
        error=Trajectory(times, tuple(states), np.abs(fine - coarse[:, 0])[:, : problem.size]),
        amplification=np.maximum.accumulate(distance / distance[0]),
        method=method,
        evaluations=evaluations,
    )
