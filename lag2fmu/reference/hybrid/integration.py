"""Direct integration of a hybrid mechanism, with an estimate of its own error and of how starts are amplified.

Three runs are made, each with its own events: at ``rtol``, which is the result; at 10 ``rtol``; and at 10 ``rtol`` from
a start perturbed by 1e-8. They are compared at times at which all of them do the same: between the times of an impact
in two of them their velocities differ by the whole rebound, which says nothing about their errors.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lag2fmu.description.names import velocity
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.constraints import newton
from lag2fmu.reference.hybrid.columns import alike, columns_of
from lag2fmu.reference.hybrid.following import Follower
from lag2fmu.reference.hybrid.modes import Event, Mode, Modes
from lag2fmu.reference.hybrid.run import Run, Track
from lag2fmu.reference.hybrid.system import System
from lag2fmu.reference.signals import Signals
from lag2fmu.reference.state import Floats

PERTURBATION = 1e-8
NEAR = 1e-5
"""States that differ by less than this part of their scales are those of runs that do the same."""


@dataclass(frozen=True, eq=False)
class HybridResult:
    """Columns over m times, work minus dissipated energy (m,) in J, scales (s,) and errors (m, s) of states.

    ``comparable`` (m,): where runs of other accuracy do the same; ``amplification`` (m,) is infinite behind the last
    such time.
    """

    columns: Mapping[str, Floats]
    work: Floats
    scales: Floats
    errors: Floats
    amplification: Floats
    comparable: NDArray[np.bool_]
    events: tuple[Event, ...]
    evaluations: int


def integrate_hybrid(
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
    """The three runs of ``mechanism`` over ``times`` (m,) in s; arguments as of ``integrate``.

    Raises LoadError for unusable starts, SimulationError with the time reached.
    """
    system = System(mechanism, parameters)
    run = Run(system, signals, times)
    tracks: list[Track] = []
    start = started(run, starts)

    def share(done: float) -> None:
        if progress is not None:
            progress((len(tracks) + done) / 3)

    run.progress = share
    tracks.append(Follower(run, method, rtol).follow(start))
    fine = tracks[0]
    scales = np.maximum(np.ptp(fine.values[:, : run.size], axis=0), run.nominal)
    for begin in (start, _perturbed(run, start, scales, fine.modes[0])):
        tracks.append(Follower(run, method, 10 * rtol).follow(begin))
    return _compared(run, tracks, scales)


def started(run: Run, overrides: Mapping[str, float]) -> Floats:
    """q, qd, further states at the start, (s,): declared, ``overrides`` by NAME or NAME_dot, guesses solved for.

    Raises LoadError for names and values that cannot be, SimulationError where constraints cannot be met.
    """
    coordinates, n, system = run.system.mechanism.coordinates, run.n, run.system
    start = _declared(system.mechanism, overrides)
    if not system.constraints.m:
        return start
    run.started(start)  # the sides of kinks there
    free = [c.given is False for c in coordinates], [c.velocity_given is False for c in coordinates]
    t, h = float(run.times[0]), system.constraints.h

    def positions(q: Floats) -> tuple[Floats, Floats]:
        phi, _, _, G = system.constraints(run.state(t, np.concatenate([q, start[n:]])))
        return phi[:h], G[:h] * system.nominal

    def velocities(qd: Floats) -> tuple[Floats, Floats]:
        _, v, _, G = system.constraints(run.state(t, np.concatenate([start[:n], qd, start[2 * n :]])))
        return v, G * system.nominal

    for half, function, flags in ((slice(0, n), positions, free[0]), (slice(n, 2 * n), velocities, free[1])):
        for chosen in (np.array(flags, dtype=bool), np.ones(n, dtype=bool)):
            if len(function(start[half])[0]):
                start[half] = newton(function, start[half], chosen, system.nominal)
        residual, jacobian = function(start[half])
        size = np.maximum(np.abs(jacobian).max(axis=1, initial=0.0), 1e-300)
        if np.max(np.abs(residual) / size, initial=0.0) > 1e-9 * max(1.0, float(np.abs(start[half]).max())):
            raise SimulationError(f"the constraints cannot be met from the start values; residuals: {residual}")
    return start


def _declared(mechanism: Mechanism, overrides: Mapping[str, float]) -> Floats:
    """q, qd, further states, (s,), as they are declared, with ``overrides``; raises LoadError for impossible ones."""
    coordinates = mechanism.coordinates
    values = {c.name: c.start for c in coordinates} | {velocity(c.name): c.velocity for c in coordinates}
    values |= {z.name: z.start for z in mechanism.states}
    for name, value in overrides.items():
        if name not in values:
            raise LoadError(f"mechanism '{mechanism.name}' has no start value '{name}'; known are {', '.join(values)}")
        if not np.isfinite(value):
            raise LoadError(f"start value '{name}': {value!r} is not a finite number")
        values[name] = float(value)
    return np.array(list(values.values()), dtype=float)


def _perturbed(run: Run, start: Floats, scales: Floats, modes: Modes) -> Floats:
    """The ``start`` moved by 1e-8 of the ``scales`` (s,), along a direction without symmetry.

    What is closed at the start stays closed.
    """
    n, system = run.n, run.system
    direction = np.cos(np.arange(1, run.size + 1))
    moved = start + PERTURBATION * scales * direction / np.abs(direction).max()
    t = float(run.times[0])
    system.elements.set_sides(modes.sides)
    gaps = system.elements.rows(run.state(t, start)).gaps
    touching = tuple(Mode.SLIDES if gap <= 1e-9 else Mode.OPEN for gap in gaps)
    still = Modes(touching, tuple(Mode.FORWARD for _ in modes.frictions), modes.held, modes.sides, {}, modes.offsets)
    onto = system.projected(run.state(t, moved), still).q
    both = system.projected(run.state(t, np.concatenate([onto, moved[n:]])), modes)
    return np.concatenate([onto, both.qd, moved[2 * n :]])


def _compared(run: Run, tracks: Sequence[Track], scales: Floats) -> HybridResult:
    """The record of the runs at rtol, 10 rtol, and 10 rtol from the perturbed start."""
    fine, coarse, moved = tracks
    same = alike(fine, coarse) & alike(coarse, moved)
    # touching without a force may count as open or closed: where states agree too, runs do the same
    near = [np.abs(a.values - b.values)[:, : run.size] / scales for a, b in ((fine, coarse), (coarse, moved))]
    same |= (near[0].max(axis=1) < NEAR) & (near[1].max(axis=1) < NEAR)
    same[0] = True
    last = int(np.flatnonzero(same)[-1])
    at = np.maximum.accumulate(np.where(same, np.arange(len(same)), 0))  # the last comparable time up to each
    errors = np.abs(fine.values - coarse.values)[at, : run.size]
    distance = (np.abs(moved.values - coarse.values)[at, : run.size] / scales).max(axis=1)
    amplification = np.maximum.accumulate(distance / max(float(distance[0]), 1e-3 * PERTURBATION))
    amplification[last + 1 :] = np.inf
    return HybridResult(
        columns=columns_of(run, fine),
        work=fine.values[:, run.size] - fine.values[:, run.size + 1],
        scales=scales,
        errors=errors,
        amplification=amplification,
        comparable=same,
        events=fine.events,
        evaluations=sum(track.evaluations for track in tracks),
    )
