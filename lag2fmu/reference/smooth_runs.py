"""The runs of a direct integration without events: one for the result, two for its error and the growth of starts."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from lag2fmu.deadline import seconds_left, within
from lag2fmu.description.names import acceleration, multiplier, residual, velocity
from lag2fmu.reference.energies import declared_starts
from lag2fmu.reference.equations import Equations
from lag2fmu.reference.initial_value_problem import InitialValueProblem
from lag2fmu.reference.integrated import Reference
from lag2fmu.reference.paces import paths_of, some_of, swing_rates, velocity_units
from lag2fmu.reference.signals import Signals
from lag2fmu.reference.state import Floats
from lag2fmu.reference.trajectory import Trajectory


class SmoothRuns:
    """The runs of a ``problem`` without events: one at ``rtol``, and two side by side at 10 ``rtol``."""

    def __init__(self, problem: InitialValueProblem, rtol: float) -> None:
        self.problem, self.rtol, self.grid = problem, rtol, problem.times

    def first(self, method: str, *, last: bool) -> tuple[int, tuple[Floats, int]]:
        """The number of times that the run at ``rtol`` reaches in half of the time, and what it found.

        The ``last`` method may need as many evaluations as it likes, if the time has a bound. Raises SimulationError.
        """
        problem = self.problem
        problem.times, problem.share = self.grid, 0.0
        if last and not problem.jumps and seconds_left() < math.inf:
            problem.most = math.inf
        with within(seconds_left() / 2):
            raw, evaluations = problem.solve(method, self.rtol, problem.start[None], pieces=2)
        return len(raw), (raw[:, 0], evaluations)

    def completed(self, method: str, rows: int, found: tuple[Floats, int]) -> Reference:
        """The reference of the first run until where the other two come; raises SimulationError.

        ``found`` are z (rows, s + 1) of the first run and its evaluations.
        """
        problem, (raw, evaluations) = self.problem, found
        problem.times = self.grid[:rows]
        fine = problem.projected(problem.times, raw)
        scales = _scales(fine, problem.nominal)
        rates, problem.share = _rates(problem, fine, scales), 0.5
        units = _units(scales, rates)
        starts = np.stack([problem.start, problem.perturbed(units)])
        coarse, more = problem.solve(method, 10 * self.rtol, starts, pieces=1)
        problem.times = problem.times[: len(coarse)]
        return _assembled(problem, fine[: len(coarse)], coarse, (scales, rates), method, evaluations + more)


def start_of(equations: Equations, overrides: Mapping[str, float], time: float, signals: Signals) -> Floats:
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


def _rates(problem: InitialValueProblem, z: Floats, scales: Floats) -> Floats:
    """The rates at which the n coordinates swing at some points of z (m, s + 1), in 1/s: (k, n)."""
    rows = some_of(np.arange(len(z)))
    times, seen = problem.times[rows], z[rows]
    inputs = {**problem.signals.sampled(times), **problem.further_of(seen)}
    return swing_rates(problem.equations, times, seen, inputs, scales)


def _units(scales: Floats, rates: Floats) -> Floats:
    """The units of the distance of two runs, (s,): the ``scales`` (s,), of velocities greater by ``rates`` (k, n)."""
    n = rates.shape[1]
    units: Floats = scales.copy()
    units[n : 2 * n] = velocity_units(scales, rates)
    return units


def _assembled(
    problem: InitialValueProblem,
    fine: Floats,
    coarse: Floats,
    measures: tuple[Floats, Floats],
    method: str,
    evaluations: int,
) -> Reference:
    """The record of two runs: ``fine`` (m, s + 1), ``coarse`` (m, 2, s + 1) with the perturbed one.

    ``measures`` are the scales of q, qd and further states, (s,), and the rates (k, n) of the coordinates.
    """
    n, equations, times = problem.n, problem.equations, problem.times
    inputs = {**problem.signals.sampled(times), **problem.further_of(fine)}
    names = [c.name for c in equations.mechanism.coordinates]
    states = [*names, *map(velocity, names), *problem.further]
    q, qd = fine[:, :n], fine[:, n : 2 * n]
    columns = dict(zip(states, fine.T, strict=False))
    state = equations.energies.state(times, q, qd, inputs)
    qdd, multipliers = equations.solved(state)
    columns |= dict(zip(map(acceleration, names), qdd, strict=True))
    columns |= equations.energies.outputs(state, (qdd, multipliers))
    constraints = equations.energies.constraints.names
    residuals = equations.residuals(times, q, qd, inputs).T
    for name, found in ((multiplier, multipliers), (residual, residuals)):
        columns |= dict(zip(map(name, constraints), found, strict=True))
    for energy in ("kinetic_energy", "potential_energy", "generalized_energy"):
        columns[energy] = getattr(equations, energy)(times, q, qd, inputs)
    (scales, rates), units = measures, _units(*measures)
    distance = (np.abs(coarse[:, 1, : problem.size] - coarse[:, 0, : problem.size]) / units).max(axis=1, initial=0.0)
    return Reference(
        trajectory=Trajectory.of(times, columns),
        work=fine[:, problem.size],
        scales=dict(zip(states, scales.tolist(), strict=True)),
        error=Trajectory(times, tuple(states), np.abs(fine - coarse[:, 0])[:, : problem.size]),
        amplification=np.maximum.accumulate(distance / (distance[0] or 1.0)),
        paths=paths_of(problem.turns, times),
        rates=dict(zip(names, rates.min(axis=0).tolist(), strict=True)),
        method=method,
        evaluations=evaluations,
    )
