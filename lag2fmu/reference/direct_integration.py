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

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from lag2fmu.deadline import seconds_left, within
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.composition import composition_of
from lag2fmu.reference.equations import Equations
from lag2fmu.reference.hybrid.columns import columns_of, groups
from lag2fmu.reference.hybrid.comparison import PERTURBATION, compared, perturbed
from lag2fmu.reference.hybrid.following import Enough, Follower
from lag2fmu.reference.hybrid.kinks import is_hybrid
from lag2fmu.reference.hybrid.run import HybridRun, Track, started
from lag2fmu.reference.hybrid.system import HybridSystem
from lag2fmu.reference.initial_value_problem import SCIPY_METHODS, InitialValueProblem
from lag2fmu.reference.integrated import Reference
from lag2fmu.reference.paces import some_of, swing_rates, velocity_units
from lag2fmu.reference.signals import Inputs, signals_of
from lag2fmu.reference.smooth_runs import SmoothRuns, start_of
from lag2fmu.reference.state import Floats
from lag2fmu.reference.trajectory import Trajectory

RUNS = 3
"""The runs of a hybrid mechanism: at rtol, at 10 rtol, and from a perturbed start."""
PARTED = 10.0
"""In units of the most growth: positions that are farther apart come near no more. Between the times of one impact in
two runs they are apart by about twice as much as before."""
MAX_EVALUATIONS = 500_000
"""The evaluations of the equations in one run after which a method counts as failed."""


def integrate(  # noqa: PLR0913 (the problem, and what is asked of its runs)
    mechanism: Mechanism,
    times: ArrayLike,
    *,
    parameters: Mapping[str, float] | None = None,
    starts: Mapping[str, float] | None = None,
    inputs: Inputs | None = None,
    rtol: float = 1e-12,
    method: str = "DOP853",
    whole: float | None = None,
    most_growth: float = math.inf,
    low: float = 0.0,
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
    - ``most_growth``: the amplification from which on no one compares. Where that of a hybrid mechanism is far greater,
      it is infinite, and the runs that find it end.
    - ``low``: the height of rebounds, in nominal gaps, up to which the run that this one judges leaves them out. So do
      the two runs that find errors, and what that makes of the motion counts as amplified.
    - ``progress``: a function that is told the share that is done, 0 to 1.

    Where the time that the caller gives (``deadline``) is over before, the reference ends at the time reached. Raises
    LoadError for unknown or unusable names and values, SimulationError with the time reached, OutOfTimeError where not
    even the start was settled in time. Source: Hairer,
    Norsett, Wanner, Solving Ordinary Differential Equations I, section II.5; Hairer, Wanner, volume II, section IV.8.
    """
    grid = _checked_times(times)
    if method not in SCIPY_METHODS or not 1e-13 <= rtol <= 1e-2:
        raise LoadError(
            f"integrate: method '{method}' and rtol {rtol!r}; "
            f"expected one of {', '.join(SCIPY_METHODS)} and 1e-13 to 1e-2"
        )
    methods = SCIPY_METHODS[SCIPY_METHODS.index(method) :]
    signals = signals_of(mechanism, inputs, float(grid[0]))
    runs: _Runs
    if is_hybrid(mechanism):
        runs = HybridRuns(
            HybridRun(HybridSystem(mechanism, parameters), signals, grid, whole),
            starts or {},
            rtol,
            most_growth,
            low,
            progress,
        )
    else:
        equations = Equations(mechanism, parameters)
        start = start_of(equations, starts or {}, float(grid[0]), signals)
        problem = InitialValueProblem(equations, signals, grid, start)
        problem.check_start()
        problem.progress, problem.whole = progress, whole or problem.whole
        runs, methods = SmoothRuns(problem, rtol), methods[:1] if problem.jumps else methods
    try:
        return _by_the_first_that_can(methods, runs, len(grid))
    except SimulationError as error:
        remedy = remedy_of_jumps(mechanism)
        raise SimulationError(f"{error}; {remedy}" if remedy else str(error)) from error


class _Runs(Protocol):
    """The runs of which a reference is made."""

    def first(self, method: str, *, last: bool) -> tuple[int, Any]:
        """The first run, in its part of the time: the number of times that it reached, and what it found."""

    def completed(self, method: str, rows: int, found: Any) -> Reference:
        """The reference of the first run, and of the others until where they come."""


def _by_the_first_that_can(methods: Sequence[str], runs: _Runs, m: int) -> Reference:
    """The reference by the first of ``methods`` that does not fail.

    A method that does not reach half of the ``m`` times in the time of its first run may be the wrong one. So the next
    one is tried, and the one that got farther is taken.
    """
    kept: tuple[str, int, Any] | None = None
    for name in methods:
        last = name == methods[-1]
        try:
            rows, found = runs.first(name, last=last)
        except SimulationError:
            if last and kept is None:
                raise
            continue
        if kept is None or rows > kept[1]:
            kept = name, rows, found
        if 2 * rows < m and not last:
            continue
        try:
            return runs.completed(*kept)
        except SimulationError:
            if last:
                raise
            kept = None
    if kept is None:
        raise SimulationError(f"there is no method of integration among {list(methods)}")
    return runs.completed(*kept)


class HybridRuns:
    """The runs with events: at ``rtol``, at 10 ``rtol``, and at 10 ``rtol`` from a start perturbed by 1e-8."""

    def __init__(
        self,
        run: HybridRun,
        starts: Mapping[str, float],
        rtol: float,
        most_growth: float,
        low: float,
        progress: Callable[[float], None] | None,
    ) -> None:
        """``starts`` {NAME or NAME_dot: SI value} replace declared values; ``progress`` is told the share done."""
        self.run, self.rtol, self.low, self.progress, self.grid = run, rtol, low, progress, run.times
        self.most_distance = PARTED * most_growth * PERTURBATION  # in scales
        self.start = started(run, starts)

        self.most = math.inf  # evaluations after which a method has failed

    def first(self, method: str, *, last: bool) -> tuple[int, Track]:
        """The number of times that the run at ``rtol`` reaches in a third of the time, and the run.

        The ``last`` method may need as many evaluations as it likes, if the time has a bound. Raises SimulationError,
        and OutOfTimeError where the start is not settled in time.
        """
        self.run.times = self.grid
        self.most = math.inf if last and seconds_left() < math.inf else MAX_EVALUATIONS
        track = self._track(method, self.rtol, self.start, 0)
        return len(track.modes), track

    def _track(
        self,
        method: str,
        rtol: float,
        start: Floats,
        before: int,
        enough: Enough | None = None,
        kick: Floats | None = None,
    ) -> Track:
        """The run of ``method`` from ``start`` (s,) to the end or until ``enough``, with as many runs ``before``.

        ``kick`` (n,) are the velocities, in SI units, that perturb what becomes free.
        """
        run, progress = self.run, self.progress
        run.progress = None if progress is None else lambda done: progress((before + done) / RUNS)
        with within(seconds_left() / (RUNS - before)):
            low = rtol if rtol == self.rtol else max(rtol, self.low)
            return Follower(run, method, rtol, self.most, self.rtol, low, kick).follow(start, enough)

    def completed(self, method: str, rows: int, found: Track) -> Reference:
        """The reference of the first run, ``found`` at the first ``rows`` times, until where the other two come.

        These end early where the perturbed one has parted from the first. There the reference goes on without them.
        Raises SimulationError, and OutOfTimeError where they do not settle their start in time.
        """
        run = self.run
        run.times = self.grid[:rows]
        scales = np.maximum(np.ptp(found.values[:, : run.size], axis=0), run.nominal)

        def parted(row: int, y: Floats) -> bool:
            distance = np.abs(y[: run.n] - found.values[row, : run.n])
            return bool((distance > self.most_distance * scales[: run.n]).any())

        start = perturbed(run, self.start, scales, found.modes[0])
        moved = self._track(method, 10 * self.rtol, start, 1, parted, PERTURBATION * scales[run.n : 2 * run.n])
        run.times = run.times[: len(moved.modes)]
        coarse = self._track(method, 10 * self.rtol, self.start, 2)
        run.times = run.times[: len(coarse.modes)]
        others = [coarse, moved.until(run.times)]
        if parted(len(coarse.modes) - 1, moved.values[len(coarse.modes) - 1]):
            run.times = self.grid[:rows]
        fine = found.until(run.times)
        return compared(
            run, method, [fine, *others], scales, self._units(fine, scales), columns_of(run, fine), self.low
        )

    def _units(self, track: Track, scales: Floats) -> Floats:
        """The units of the distance of two runs at each time of the ``track``, (m, s), from the ``scales`` (s,).

        While a compliant contact is closed velocities swing fast, and have greater units than where it is open. Where
        rigid contacts or dry friction act, the units are the scales.
        """
        run, system = self.run, self.run.system
        n, units = run.n, np.tile(scales, (len(track.modes), 1))
        if system.elements.k:
            return units
        for sides, group in groups([modes.sides for modes in track.modes]):
            rows = some_of(np.array(group))
            system.elements.set_sides(sides)
            z, times = track.values[rows, : run.size], run.times[rows]
            inputs = {**run.signals.sampled(times), **dict(zip(run.further, z[:, 2 * n :].T, strict=True))}
            rates = swing_rates(system.equations, times, z, inputs, scales)
            units[group, n : 2 * n] = velocity_units(scales, rates)
        return units


def remedy_of_jumps(mechanism: Mechanism) -> str:
    """A phrase that names the forces that jump during the motion, and the remedy; "" if there are none."""
    jumps = composition_of(mechanism).jumps
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
