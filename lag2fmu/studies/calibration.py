"""Calibration: parameters and starts from measurements, by least squares with exact derivatives.

The noise of each measured column is given, or estimated from its residuals. Then columns are first weighed by their own
spread, and in further rounds by their estimated noise. Source: G. A. F. Seber, C. J. Wild, Nonlinear Regression, 1989,
sections 2.1 (least squares, asymptotic confidence), 2.8.8 and 11.2 (several responses, iterated weights).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from lag2fmu.description.names import SETTINGS, generalized_force
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.formats.loading import as_mechanism, with_values
from lag2fmu.mechanism.display import display_units
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.progress import telling
from lag2fmu.reference.trajectory import Floats
from lag2fmu.studies.calibrated import SINGULAR, Calibration, summed_up, told
from lag2fmu.studies.fits import Fit
from lag2fmu.studies.free_values import free_values
from lag2fmu.studies.library import compiled
from lag2fmu.studies.measured_runs import MeasuredRuns, are_many
from lag2fmu.studies.measurements import Data, measurements_of
from lag2fmu.verify.plan import check_tolerance

TOLERANCE = 1e-8
_ROUNDS = 4
"""How often the noise is estimated anew at most; it settles after two or three rounds."""
_SETTLED = 1e-3
"""A relative change of the estimated noise that makes no difference."""
_NEAR = 1e-3
"""A search by gradients ends so near to the minimum, in standard errors; rounding in runs is below it."""
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
    if are_many(len(sought)):
        library = compiled(mechanism, solver=solver, adjoints=True)
    problem = _Problem(
        MeasuredRuns(library, experiments, sought, common, check_tolerance(tolerance), hold=hold, progress=progress)
    )
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
    """The runs of all experiments, and which of the ``columns`` each measured value belongs to."""

    def __init__(self, runs: MeasuredRuns) -> None:
        self.runs, self.measured, self.sought = runs, runs.measured, runs.sought
        self.columns = list(dict.fromkeys(name for e in runs.experiments for name in e.names))
        owners = [np.broadcast_to([self.columns.index(n) for n in e.names], e.values.shape) for e in runs.experiments]
        self.column_of = np.concatenate([o[m] for o, m in zip(owners, runs.masks, strict=True)])

    def residuals(self, point: Floats) -> Floats:
        """What the values at ``point`` (p,) differ by from those that were measured, (n,)."""
        return np.asarray(self.runs.values_at(point)[0] - self.measured)


def _solved(problem: _Problem, known: Mapping[str, float], mechanism: Mechanism) -> Calibration:
    """The calibration; the noise of a column that is not ``known`` is estimated from its residuals."""
    point = np.array([x.start for x in problem.sought])
    _, reason = problem.runs.values_at(point)
    if reason:
        raise SimulationError(f"'{problem.runs.library.name}': the run at the first guess failed: {reason}")
    estimated = np.array([name not in known for name in problem.columns])
    noise = np.array([known.get(name, 1.0) for name in problem.columns])
    spread = np.array([_spread(problem.measured[problem.column_of == j]) for j in range(len(noise))])
    noise[estimated] = spread[estimated]
    for _ in range(_ROUNDS):
        point = _minimized(problem, point, noise)
        before, noise = noise, np.where(estimated, _left(problem, point, noise), noise)
        if len(noise) == 1 or not (abs(noise - before) > _SETTLED * before).any():
            break
    fits = [Fit(e, _fitted(problem, point, i)) for i, e in enumerate(problem.runs.experiments)]
    _, slopes, _ = problem.runs.at(point)
    residuals = problem.residuals(point) / noise[problem.column_of]
    estimates = tuple(replace(x, start=float(p)) for x, p in zip(problem.sought, point, strict=True))
    first = {x.name: x.start for x in estimates if x.experiment in (None, 0)}
    return summed_up(
        estimates,
        slopes / noise[problem.column_of, None],
        residuals,
        dict(zip(problem.columns, noise.tolist(), strict=True)),
        tuple(fits),
        with_values(mechanism, {**_of_mechanism(problem.runs, mechanism), **first}),
    )


def _of_mechanism(runs: MeasuredRuns, mechanism: Mechanism) -> dict[str, float]:
    """The values (SI) of the first experiment without those of its run, steps of the solver and generalized forces."""
    of_run = {*SETTINGS, *(generalized_force(q.name) for q in mechanism.coordinates)}
    return {name: value for name, value in runs.values[0].items() if name not in of_run}


def _spread(values: Floats) -> float:
    """A first guess of the noise of a column: the spread of its ``values``."""
    spread = float(np.std(values)) if len(values) > 1 else 0.0
    return spread or float(abs(values).max(initial=0.0)) or 1.0


def _left(problem: _Problem, point: Floats, noise: Floats) -> Floats:
    """The standard deviation of the residuals of each column, (columns,), with its share of the degrees of freedom."""
    residuals = problem.residuals(point)
    share = 1 - len(problem.sought) / len(residuals)
    if share <= 0:
        return noise
    found = np.array([np.sqrt((residuals[problem.column_of == j] ** 2).mean() / share) for j in range(len(noise))])
    scale = np.array([_spread(problem.measured[problem.column_of == j]) for j in range(len(noise))])
    return np.asarray(np.maximum(found, 10 * problem.runs.tolerance * scale))


def _minimized(problem: _Problem, point: Floats, noise: Floats) -> Floats:
    """The least sum of squares near ``point``; raises SimulationError if the search does not end."""
    weights = 1.0 / noise[problem.column_of]
    scale, low, high, first = (
        np.array([getattr(x, part) for x in problem.sought]) for part in ("scale", "low", "high", "start")
    )
    found = _within(problem, point, weights, scale, low, high) if problem.runs.many else None
    if found is not None:
        return found
    return _by_slopes(problem, point, weights, scale, (low, high), np.clip(first, low, high))


def _by_slopes(
    problem: _Problem, point: Floats, weights: Floats, scale: Floats, bounds: tuple[Floats, Floats], first: Floats
) -> Floats:
    """The least sum of squares, by the derivatives of all values; raises SimulationError if the search does not end.

    Directions that the data say nothing of stay at the ``first`` point, held by a weight that no other one feels.
    """
    from scipy.optimize import least_squares

    def slopes(p: Floats) -> Floats:
        return np.asarray(weights[:, None] * problem.runs.at(p)[1] * scale)

    hold = _HELD * float(np.linalg.norm(slopes(point), 2)) or 1.0
    found = least_squares(
        lambda p: np.concatenate([weights * problem.residuals(p), hold * (p - first) / scale]),
        np.clip(point, *bounds),
        jac=lambda p: np.vstack([told(slopes(p)), hold * np.eye(len(p))]) / scale,
        bounds=bounds,
        x_scale=scale,
        ftol=1e-12,
        xtol=1e-10,
        gtol=1e-12,
        max_nfev=200 * len(point),
    )
    if not found.success:
        raise SimulationError(
            f"'{problem.runs.library.name}': the search found no minimum in {found.nfev} runs, with {len(weights)} "
            f"values measured and {len(point)} sought; seek fewer, or give bounds or better first values"
        )
    return np.asarray(found.x)


def _within(
    problem: _Problem, point: Floats, weights: Floats, scale: Floats, low: Floats, high: Floats
) -> Floats | None:
    """The least sum of squares within bounds, by gradients; None where the search does not end.

    What leaves its bounds is held there, as long as the squares would be less outside.
    """
    point, free = np.clip(point, low, high), np.ones(len(point), dtype=bool)
    slopes = weights[:, None] * problem.runs.at(point)[1]
    while free.any():
        found = _by_gradients(problem, point, weights, slopes, np.where(free, scale, 0.0))
        if found is None:
            return None
        point, out = np.clip(found, low, high), free & ((found <= low) | (found >= high))
        if not out.any():
            break
        free &= ~out
    slope = problem.runs.weighed(point, weights**2 * problem.residuals(point))
    outwards = np.where(point <= low, slope, -slope)[~free]
    return point if (outwards >= 0).all() else None


def _by_gradients(problem: _Problem, point: Floats, weights: Floats, slopes: Floats, scale: Floats) -> Floats | None:
    """The least sum of squares, by its gradients alone; None where the search does not end.

    The variables are the determined directions of ``slopes`` (n, p), those near ``point`` by the noise, each by its
    standard error: second derivatives are near one, as far as the model is near linear. Values whose
    ``scale`` is 0 stay. Source: J. Nocedal, S. J. Wright, Numerical Optimization, 2nd edition, sections 7.2 and 10.3.
    """
    from scipy.optimize import minimize

    _, sizes, rows = np.linalg.svd(slopes * scale, full_matrices=False)
    told = sizes > SINGULAR * sizes.max(initial=0.0)
    basis = scale[:, None] * rows[told].T / sizes[told]
    unit = float(np.linalg.norm(basis.T @ problem.runs.weighed(point, weights**2 * problem.residuals(point)))) or 1.0

    def cost(z: Floats) -> tuple[float, Floats]:
        p = point + basis @ (unit * z)
        left = weights * problem.residuals(p)
        slope = basis.T @ problem.runs.weighed(p, weights * left)
        if not (np.isfinite(left).all() and np.isfinite(slope).all()):
            raise SimulationError(f"'{problem.runs.library.name}': a run of the search failed")
        return float(left @ left) / 2 / unit**2, slope / unit

    try:
        found = minimize(cost, np.zeros(basis.shape[1]), jac=True, method="L-BFGS-B",
                         options={"gtol": _NEAR / unit, "ftol": 0.0, "maxcor": 30, "maxiter": 200})  # fmt: skip
    except SimulationError:
        return None
    met = unit * float(np.abs(found.jac).max(initial=0.0)) <= 10 * _NEAR
    return point + basis @ (unit * found.x) if met else None


def _fitted(problem: _Problem, point: Floats, experiment: int) -> Floats:
    """The values of the calibrated model in one experiment, (m, k), in SI units; NaN where nothing was measured."""
    mask = problem.runs.masks[experiment]
    first = sum(int(m.sum()) for m in problem.runs.masks[:experiment])
    found = np.full(mask.shape, np.nan)
    found[mask] = problem.runs.values_at(point)[0][first : first + int(mask.sum())]
    return found
