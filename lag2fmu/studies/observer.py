"""Observers on recorded data: estimates of all states, and of parameters, from what was measured of some variables.

Between samples the equations of the mechanism move the estimate, at samples the measurements correct it. The error
lives on the manifold of the constraints, so that each estimate meets them to rounding. The methods stand in
``filters``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lag2fmu.analysis.observing import check_noise, doubt_of, hidden_states, known_starts, modes_refused
from lag2fmu.description import names
from lag2fmu.description.symbols import names_of
from lag2fmu.errors import DerivationError, LoadError
from lag2fmu.formats.loading import as_mechanism
from lag2fmu.language.given import check_mapping, within
from lag2fmu.language.identifiers import suggestion
from lag2fmu.mechanism.display import display_units
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.progress import telling
from lag2fmu.reference.trajectory import Floats, Trajectory
from lag2fmu.studies.estimates import Estimates
from lag2fmu.studies.filters import (
    FILTERS,
    Belief,
    Extended,
    Filter,
    Innovation,
    Prediction,
    Rows,
    smoothed,
    triangular,
)
from lag2fmu.studies.horizon import MovingHorizon
from lag2fmu.studies.measurements import Data, check_times, columns_of, inputs_of
from lag2fmu.studies.observed import Observed

HORIZON = 10
"""The samples of a window, if the user gives no number."""


@telling("observing")
def observe(  # noqa: PLR0913 (choices of the user)
    model: object,
    data: Data,
    *,
    measure: Mapping[str, float],
    process: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    estimate: Sequence[str] = (),
    values: Mapping[str, float] | None = None,
    delays: Mapping[str, float] | None = None,
    method: str = "ekf",
    smooth: bool = False,
    hold: bool = False,
    step: float | None = None,
    horizon: int = HORIZON,
) -> Estimates:
    """Estimate the states of ``model`` at the times of ``data`` from the columns that ``measure`` names.

    All numbers are in SI units.

    - ``measure`` {variable: standard deviation}: any variable, positions and forces of constraints too. NaN is a gap.
    - ``process`` {input, state or parameter: density}: white noise, of which a state wanders by density * sqrt(s).
    - ``start`` {state or parameter: standard deviation}: how well its start is known; by default to its nominal value,
      a parameter to a tenth of its value.
    - ``estimate``: parameters that are estimated too.
    - ``values``: other parameters and starts of the model, from which the estimates begin.
    - ``delays`` {variable: s}: samples of it belong to an earlier time.
    - ``method``: "ekf", "ukf", "ukf-simplex" or "mhe", least squares over the last ``horizon`` samples, with an ekf
      before them; ``smooth``: whether estimates know later samples too.
    - ``hold``: whether inputs are constant between their times; by default they are linear.
    - ``step``: the longest solver step (s); by default the fastest pole is resolved.

    Columns of ``data`` that are inputs drive the model. Raises LoadError for bad arguments and data, DerivationError
    for a model with events, SimulationError where the estimate leaves what the equations know. Source: S. Sarkka,
    Bayesian Filtering and Smoothing, Cambridge 2013, chapters 5, 6 and 8.
    """
    check_method(method, horizon, smooth=smooth)
    if step is not None and not within(step, above=0):
        raise LoadError(f"step: {step!r} s; give a positive time")
    mechanism = as_mechanism(model, values)
    if refusal := modes_refused(mechanism):
        raise DerivationError(refusal)
    check_noise(measure, delays or {})
    check_mapping("start", start or {})
    samples = _samples(data, mechanism, measure, delays or {})
    observed = Observed(mechanism, tuple(measure), process or {}, estimate, samples.signals, hold=hold, step=step)
    begin = _begin(observed, mechanism, samples, start or {})
    samples = samples._replace(warnings=(*samples.warnings, *_not_shown(observed, begin, float(samples.time[0]))))
    noise = np.array([*measure.values()], dtype=np.float64)
    run = _run(FILTERS.get(method, Extended)(observed), begin, samples, noise)
    beliefs = smoothed(observed, samples.time, run.after, run.between) if smooth else run.after
    if method == MOVING_HORIZON:
        windows = MovingHorizon(observed, mechanism, samples.signals, horizon, hold=hold)
        arrivals = [begin, *(ahead.belief for ahead in run.between)]
        beliefs = [*windows.beliefs(samples.time, samples.values, noise, arrivals)]
    return _estimates(observed, samples, run, beliefs, mechanism, smooth=smooth)


def check_method(method: str, horizon: int, *, smooth: bool) -> None:
    """Raise LoadError for a ``method`` that is unknown, for what does not go with it, and for no ``horizon``."""
    known = (*FILTERS, MOVING_HORIZON)
    if method not in known:
        raise LoadError(f"there is no observer '{method}'; known are {', '.join(known)}")
    if method == MOVING_HORIZON and smooth:
        raise LoadError("mhe estimates from the samples of its horizon; leave out smooth, or take ekf")
    if not isinstance(horizon, (int, np.integer)) or not horizon >= 1:
        raise LoadError(f"horizon: {horizon!r}; give the number of samples, a whole one of at least 1")


MOVING_HORIZON = "mhe"
_SAME = 1e-12
"""Relative to the span of all times: times that are nearer to each other are one, as a delay is subtracted with
rounding."""


class _Samples(NamedTuple):
    """Times (m,) in s, what was measured at them (m, p) with NaN as gaps, the inputs, and sentences on the data."""

    time: Floats
    values: Floats
    signals: Trajectory | None
    warnings: tuple[str, ...]


class _Filtered(NamedTuple):
    """The beliefs after each sample, the predictions between them, and the innovations with the columns they had."""

    after: list[Belief]
    between: list[Prediction]
    innovations: list[tuple[Rows, Innovation] | None]


# ----------------------------------------------------------------------------------------------------------------- data


def _samples(data: Data, mechanism: Mechanism, measure: Mapping[str, float], delays: Mapping[str, float]) -> _Samples:
    """The samples of ``data``; raises LoadError for times that go back, missing columns, and inputs with gaps."""
    label, time, columns = columns_of(data, 1, display_units(mechanism))
    check_times(label, time)
    _check_measured(label, columns, measure)
    known = {names.generalized_force(q.name) for q in mechanism.coordinates}
    known |= {name for u in mechanism.inputs for name in names_of(u)}
    driving = {name: column for name, column in columns.items() if name in known and name not in measure}
    unused = [name for name in columns if name not in measure and name not in driving]
    warnings = [f"{label}: not used: {', '.join(unused)}"] if unused else []
    signals = inputs_of(label, time, driving)
    return _delayed(time, {name: columns[name] for name in measure}, delays, signals, warnings)


def _check_measured(label: str, columns: Mapping[str, Floats], measure: Mapping[str, float]) -> None:
    """Raise LoadError for a measured name without a column, and for values that are infinite."""
    for name in measure:
        if name not in columns:
            raise LoadError(f"{label}: there is no column '{name}' to measure; {suggestion(name, columns)}")
        if np.isinf(columns[name]).any():
            raise LoadError(f"{label}: '{name}' is infinite somewhere; a missing value is NaN or an empty cell")


def _delayed(
    time: Floats,
    columns: Mapping[str, Floats],
    delays: Mapping[str, float],
    signals: Trajectory | None,
    warnings: list[str],
) -> _Samples:
    """The samples at the times to which they belong; those before the first time are left out, which is said."""
    near = _SAME * float(np.ptp(time))
    shifted = {name: _moved_to(time, time - delays.get(name, 0.0), near) for name in columns}
    there = [times[np.isfinite(columns[name])] for name, times in shifted.items()]  # a gap makes no step end
    grid = np.unique(np.concatenate([time, *there]))
    grid = grid[grid >= time[0]]
    grid = grid[np.concatenate([[True], np.diff(grid) > near])]
    found = np.full((len(grid), len(columns)), np.nan)
    for j, (name, column) in enumerate(columns.items()):
        early = (shifted[name] < time[0]) & np.isfinite(column)
        inside = np.isfinite(column) & ~early
        found[_nearest(grid, shifted[name][inside]), j] = column[inside]
        if early.any():
            warnings.append(f"{np.sum(early)} samples of {name} belong to times before the first one; left out")
    if not np.isfinite(found).any():
        raise LoadError("there is no measured value in the data; nothing can be estimated from it")
    return _Samples(grid, found, signals, tuple(warnings))


def _nearest(grid: Floats, times: Floats) -> NDArray[np.intp]:
    """For each of the ``times`` (m,) the index of the nearest one of the ``grid`` (g,), which increases."""
    return np.rint(np.interp(times, grid, np.arange(len(grid)))).astype(np.intp)


def _moved_to(grid: Floats, times: Floats, near: float) -> Floats:
    """The ``times`` (m,), of which those that are ``near`` (s) one of the ``grid`` (g,) become that."""
    nearest = grid[_nearest(grid, times)]
    return np.where(np.abs(times - nearest) <= near, nearest, times)


# ------------------------------------------------------------------------------------------------------------------ run


def _begin(observed: Observed, mechanism: Mechanism, samples: _Samples, start: Mapping[str, float]) -> Belief:
    """The belief before the first sample; raises LoadError for standard deviations of what is not estimated."""
    for name, size in start.items():
        if name not in observed.names:
            raise LoadError(f"start '{name}' is not estimated; {suggestion(name, observed.names)}")
        if not within(size, least=0):
            raise LoadError(f"start '{name}': {size!r} is no standard deviation; give one that is not negative")
    default = known_starts(mechanism, observed.names, observed.start).tolist()
    sizes = np.array([start.get(name, size) for name, size in zip(observed.names, default, strict=True)])
    t = float(samples.time[0])
    x = observed.projected(t, observed.start[None])[0]
    T = observed.basis(t, x)
    return Belief(x, T, triangular(T.T * sizes))


def _not_shown(observed: Observed, begin: Belief, t: float) -> Iterator[str]:
    """A sentence on the states of which the samples say nothing, by the equations linearized at the start."""
    A, H = observed.rates_by_state(t, begin.x), observed.output_derivatives(t, begin.x)
    hidden = hidden_states(observed.names, A, H, begin.T)
    if hidden:
        yield doubt_of(hidden)


def _run(chosen: Filter, belief: Belief, samples: _Samples, noise: Floats) -> _Filtered:
    run = _Filtered([], [], [])
    for i, t in enumerate(samples.time.tolist()):
        if i:
            run.between.append(chosen.predict(belief, float(samples.time[i - 1]), t))
            belief = run.between[-1].belief
        rows = np.flatnonzero(np.isfinite(samples.values[i]))
        innovation = None
        if len(rows):
            belief, found = chosen.update(belief, t, rows, samples.values[i, rows], noise[rows])
            innovation = rows, found
        run.after.append(belief)
        run.innovations.append(innovation)
    return run


def _estimates(
    observed: Observed, samples: _Samples, run: _Filtered, beliefs: list[Belief], mechanism: Mechanism, *, smooth: bool
) -> Estimates:
    shape = samples.values.shape
    innovations, sizes, squared, degrees = np.full(shape, np.nan), np.full(shape, np.nan), *np.zeros((2, shape[0]))
    for i, item in enumerate(run.innovations):
        if item is not None:
            rows, found = item
            innovations[i, rows], sizes[i, rows] = found.difference, np.linalg.norm(found.root, axis=1)
            squared[i], degrees[i] = found.squared, len(rows)
    return Estimates(
        time=samples.time,
        names=observed.names,
        values=np.array([belief.x for belief in beliefs]),
        deviations=np.array([belief.deviations for belief in beliefs]),
        measured=observed.measured,
        samples=samples.values,
        innovations=innovations,
        innovation_deviations=sizes,
        squared=squared,
        degrees=degrees,
        smoothed=smooth,
        warnings=samples.warnings,
        units=display_units(mechanism),
    )
