"""Calibration: parameters and starts from measurements, by least squares with exact derivatives.

The noise of each measured column is given, or estimated from its residuals. Then columns are first weighed by their own
spread, and in further rounds by their estimated noise. Source: G. A. F. Seber, C. J. Wild, Nonlinear Regression, 1989,
sections 2.1 (least squares, asymptotic confidence), 2.8.8 and 11.2 (several responses, iterated weights).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.formats.loading import as_mechanism, with_values
from lag2fmu.mechanism.display import display_units
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.progress import telling
from lag2fmu.reference.trajectory import Floats
from lag2fmu.studies.calibrated import Calibration, summed_up, told
from lag2fmu.studies.fits import Fit, FreeValue, Measurement
from lag2fmu.studies.free_values import free_values
from lag2fmu.studies.library import Study, StudyLibrary, compiled
from lag2fmu.studies.measurements import Data, measurements_of
from lag2fmu.studies.sensitivities import directed_run
from lag2fmu.verify.plan import check_tolerance

TOLERANCE = 1e-8
_ROUNDS = 4
"""At most so often the noise is estimated anew; it settles after two or three rounds."""
_SETTLED = 1e-3
"""A relative change of the estimated noise that makes no difference."""
_HELD = 1e-7
"""The weight, as part of the greatest effect, that holds what the data say nothing of; all else has 10 times it."""


@telling("estimating")
def calibrate(  # noqa: PLR0913 (choices of the user)
    model: object,
    data: Data | Sequence[Data],
    *,
    free: Sequence[str],
    values: Mapping[str, float] | Sequence[Mapping[str, float]] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    noise: Mapping[str, float] | None = None,
    hold: bool = False,
    tolerance: float = TOLERANCE,
    solver: str | None = None,
    progress: Callable[[int], None] | None = None,
) -> Calibration:
    """Estimate the parameters and starts ``free`` of ``model`` from the measured ``data`` of one or more experiments.

    Columns of ``data`` are named as variables. Columns of inputs drive the run; with ``hold`` they are constant between
    their times. All other columns (m,) were measured. Free parameters are the same in all experiments; each experiment
    has its own free starts. The search begins at ``values`` (SI units; one mapping, or one for each experiment).
    Without a value it begins at the first measured value of a start, or at the value of the model. ``bounds`` (SI
    units) are added to those of the model; masses, stiffnesses and dampings stay positive. ``noise`` {column: standard
    deviation} is given, in SI units, where it is known. ``progress`` is told the number of runs so far; how many the
    search takes is known at its end only.

    Raises LoadError for bad arguments and data, SimulationError where runs or the search fail. Source: G. A. F. Seber,
    C. J. Wild, Nonlinear Regression, 1989, sections 2.1 and 11.2.
    """
    mechanism = as_mechanism(model)
    library = compiled(mechanism, solver=solver)
    experiments = measurements_of(data, library, display_units(mechanism))
    common = _values_of(values, len(experiments))
    sought = free_values(library, mechanism, free, experiments, common, bounds or {})
    problem = _Problem(library, experiments, sought, common, check_tolerance(tolerance), hold)
    problem.progress = progress
    known = _known_noise(noise or {}, problem.columns)
    return _solved(problem, known, mechanism)


def _values_of(
    values: Mapping[str, float] | Sequence[Mapping[str, float]] | None, count: int
) -> list[Mapping[str, float]]:
    """The values of each experiment; raises LoadError for another number of them."""
    if values is None or isinstance(values, Mapping):
        return [values or {}] * count
    if len(values) != count:
        raise LoadError(f"there are values for {len(values)} experiments, but data of {count}")
    return list(values)


def _known_noise(noise: Mapping[str, float], columns: Sequence[str]) -> dict[str, float]:
    for name, size in noise.items():
        if name not in columns:
            raise LoadError(f"the noise of '{name}' is given, but it was not measured; there are {', '.join(columns)}")
        if not (0 < size < np.inf):
            raise LoadError(f"the noise of '{name}' is {size!r}; give a positive standard deviation")
    return dict(noise)


class _Problem:
    """The residuals (n,) of all measured values, and their derivatives (n, p) by the p free values."""

    def __init__(
        self,
        library: StudyLibrary,
        experiments: Sequence[Measurement],
        sought: Sequence[FreeValue],
        values: Sequence[Mapping[str, float]],
        tolerance: float,
        hold: bool,
    ) -> None:
        self.library, self.experiments, self.sought = library, experiments, sought
        self.values, self.tolerance, self.hold = values, tolerance, hold
        self.columns = list(dict.fromkeys(name for e in experiments for name in e.names))
        owners = [np.broadcast_to([self.columns.index(n) for n in e.names], e.values.shape) for e in experiments]
        self.masks = [np.isfinite(e.values) for e in experiments]
        self.column_of = np.concatenate([o[m] for o, m in zip(owners, self.masks, strict=True)])
        self.measured = np.concatenate([e.values[m] for e, m in zip(experiments, self.masks, strict=True)])
        self._studies = [Study(library, len(self.names(i))) for i in range(len(experiments))]
        self._last: tuple[bytes, Floats, Floats, str] | None = None
        self.progress: Callable[[int], None] | None = None
        self._runs = 0

    def names(self, experiment: int) -> list[str]:
        """The names of the values that are free in one experiment."""
        return [x.name for x in self.sought if x.experiment in (None, experiment)]

    def at(self, point: Floats) -> tuple[Floats, Floats, str]:
        """The values (n,) that would be measured, their derivatives (n, p), and "" or why there are none."""
        key = point.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = (key, *self._run(point))
        return self._last[1:]

    def _run(self, point: Floats) -> tuple[Floats, Floats, str]:
        values, slopes = np.full(len(self.measured), np.nan), np.zeros((len(self.measured), len(self.sought)))
        row = 0
        for i, (experiment, mask) in enumerate(zip(self.experiments, self.masks, strict=True)):
            places = [j for j, x in enumerate(self.sought) if x.experiment in (None, i)]
            given = {**self.values[i], **{self.sought[j].name: float(point[j]) for j in places}}
            found = directed_run(
                self.library,
                self.names(i),
                experiment.names,
                values=given,
                times=experiment.time,
                start=float(experiment.time[0]),
                tolerance=self.tolerance,
                inputs=experiment.inputs,
                hold=self.hold,
                study=self._studies[i],
            )
            self._runs += 1
            if self.progress is not None:
                self.progress(self._runs)
            if found.reason:
                return values, slopes, f"{experiment.label}: {found.reason}"
            end = row + int(mask.sum())
            values[row:end] = found.result.values[mask]
            slopes[row:end, places] = found.result.derivatives[mask]
            row = end
        return values, slopes, ""


def _solved(problem: _Problem, known: Mapping[str, float], mechanism: Mechanism) -> Calibration:
    """The calibration; the noise of a column that is not ``known`` is estimated from its residuals."""
    point = np.array([x.start for x in problem.sought])
    _, _, reason = problem.at(point)
    if reason:
        raise SimulationError(f"'{problem.library.name}': the run at the first guess failed: {reason}")
    estimated = np.array([name not in known for name in problem.columns])
    noise = np.array([known.get(name, 1.0) for name in problem.columns])
    spread = np.array([_spread(problem.measured[problem.column_of == j]) for j in range(len(noise))])
    noise[estimated] = spread[estimated]
    for _ in range(_ROUNDS):
        point = _minimized(problem, point, noise)
        before, noise = noise, np.where(estimated, _left(problem, point, noise), noise)
        if len(noise) == 1 or not (abs(noise - before) > _SETTLED * before).any():
            break
    fits = [Fit(e, _fitted(problem, point, i)) for i, e in enumerate(problem.experiments)]
    _, slopes, _ = problem.at(point)
    residuals = (problem.at(point)[0] - problem.measured) / noise[problem.column_of]
    estimates = tuple(replace(x, start=float(p)) for x, p in zip(problem.sought, point, strict=True))
    first = {x.name: x.start for x in estimates if x.experiment in (None, 0)}
    return summed_up(
        estimates,
        slopes / noise[problem.column_of, None],
        residuals,
        dict(zip(problem.columns, noise.tolist(), strict=True)),
        tuple(fits),
        with_values(mechanism, {**problem.values[0], **first}),
    )


def _spread(values: Floats) -> float:
    """A first guess of the noise of a column: the spread of its ``values``."""
    spread = float(np.std(values)) if len(values) > 1 else 0.0
    return spread or float(abs(values).max(initial=0.0)) or 1.0


def _left(problem: _Problem, point: Floats, noise: Floats) -> Floats:
    """The standard deviation of the residuals of each column, (columns,), with its share of the degrees of freedom."""
    residuals = problem.at(point)[0] - problem.measured
    share = 1 - len(problem.sought) / len(residuals)
    if share <= 0:
        return noise
    found = np.array([np.sqrt((residuals[problem.column_of == j] ** 2).mean() / share) for j in range(len(noise))])
    scale = np.array([_spread(problem.measured[problem.column_of == j]) for j in range(len(noise))])
    return np.asarray(np.maximum(found, 10 * problem.tolerance * scale))


def _minimized(problem: _Problem, point: Floats, noise: Floats) -> Floats:
    """The least sum of squares near ``point``; raises SimulationError if the search does not end.

    Directions that the data say nothing of stay where the search began, held by a weight that no other one feels.
    """
    from scipy.optimize import least_squares

    weights = 1.0 / noise[problem.column_of]
    scale = np.array([x.scale for x in problem.sought])
    low, high = (np.array([getattr(x, side) for x in problem.sought]) for side in ("low", "high"))
    first = np.clip([x.start for x in problem.sought], low, high)

    def slopes(p: Floats) -> Floats:
        return np.asarray(weights[:, None] * problem.at(p)[1] * scale)

    hold = _HELD * float(np.linalg.norm(slopes(point), 2)) or 1.0
    found = least_squares(
        lambda p: np.concatenate([weights * (problem.at(p)[0] - problem.measured), hold * (p - first) / scale]),
        np.clip(point, low, high),
        jac=lambda p: np.vstack([told(slopes(p)), hold * np.eye(len(p))]) / scale,
        bounds=(low, high),
        x_scale=scale,
        ftol=1e-12,
        xtol=1e-10,
        gtol=1e-12,
        max_nfev=200 * len(point),
    )
    if not found.success:
        raise SimulationError(f"'{problem.library.name}': the search ended without a minimum: {found.message}")
    return np.asarray(found.x)


def _fitted(problem: _Problem, point: Floats, experiment: int) -> Floats:
    """The values of the calibrated model in one experiment, (m, k), in SI units; NaN where nothing was measured."""
    mask = problem.masks[experiment]
    first = sum(int(m.sum()) for m in problem.masks[:experiment])
    found = np.full(mask.shape, np.nan)
    found[mask] = problem.at(point)[0][first : first + int(mask.sum())]
    return found
