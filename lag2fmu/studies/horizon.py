"""Moving-horizon estimation: at each sample the start of a window of samples and the parameters, by least squares.

What is known before the window is the belief of an extended Kalman filter there, the arrival cost. In the window the
motion is that of the equations, without noise. Source: C. V. Rao, J. B. Rawlings, D. Q. Mayne, Constrained state
estimation for nonlinear discrete-time systems, IEEE Trans. Automatic Control 48 (2003) 246-258.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.trajectory import Floats, Trajectory
from lag2fmu.studies.filters import Belief, triangular
from lag2fmu.studies.fits import FreeValue, Measurement
from lag2fmu.studies.library import STATES, compiled
from lag2fmu.studies.measured_runs import MeasuredRuns, are_many
from lag2fmu.studies.observed import Observed
from lag2fmu.studies.requests import scale_of

_TOLERANCE = 1e-10
"""Of the runs."""


class MovingHorizon:
    """Windows of ``horizon`` samples of what is ``observed``."""

    def __init__(
        self, observed: Observed, mechanism: Mechanism, signals: Trajectory | None, horizon: int, *, hold: bool
    ) -> None:
        """``signals`` drive the ``mechanism``; with ``hold`` they are constant between their times.

        Raises LoadError for a mechanism whose given starts depend on each other.
        """
        self._observed, self._signals, self._horizon, self._hold = observed, signals, horizon, hold
        self._library = compiled(mechanism, adjoints=are_many(len(observed.names)))
        kinds, variables = self._library.kinds, self._library.variables
        self._free = [
            i for i, x in enumerate(observed.names) if kinds[x] not in STATES or variables[x].initial == "exact"
        ]
        self._states = [x for x in observed.names if kinds[x] in STATES]
        basis = observed.basis(0.0, observed.projected(0.0, observed.start[None])[0])[self._free]
        if np.linalg.matrix_rank(basis) < len(self._free):
            raise LoadError(
                f"mhe: the given starts of '{mechanism.name}' depend on each other by its constraints; give guesses of "
                "those that follow, or take ekf"
            )

    def beliefs(self, time: Floats, values: Floats, noise: Floats, arrivals: Sequence[Belief]) -> Iterator[Belief]:
        """The belief after each of the samples ``values`` (m, p) at ``time`` (m,) in s, with ``noise`` (p,).

        ``arrivals`` (m) are the beliefs before each of them. Raises SimulationError where a search fails.
        """
        for k in range(len(time)):
            window = slice(max(0, k - self._horizon + 1), k + 1)
            yield self._belief(time[window], values[window], noise, arrivals[window.start])

    def _belief(self, time: Floats, values: Floats, noise: Floats, arrival: Belief) -> Belief:
        """The variables are the errors of the start by the root of their covariance, so that their own weight is 1."""
        from scipy.optimize import least_squares

        centre, basis = arrival.x[self._free], (arrival.T @ arrival.S)[self._free]
        runs = self._runs(time, self._observed.measured, values, arrival.x)
        weights = (1.0 / np.broadcast_to(noise, values.shape))[runs.masks[0]]

        def residuals(z: Floats) -> Floats:
            return np.concatenate([weights * (runs.values_at(centre + basis @ z)[0] - runs.measured), z])

        def slopes(z: Floats) -> Floats:
            return np.concatenate([weights[:, None] * (runs.at(centre + basis @ z)[1] @ basis), np.eye(len(z))])

        start = np.zeros(basis.shape[1])
        reason = runs.values_at(centre)[1]
        found = None if reason else least_squares(residuals, start, slopes, ftol=None, xtol=1e-10, gtol=1e-10)
        if found is None or not found.success:
            why = reason or "the search ended without a minimum"
            raise SimulationError(f"mhe at time {time[-1]:g} s: {why}; give smaller noise, or take ekf")
        root = basis @ np.linalg.inv(np.linalg.qr(slopes(found.x), mode="r"))
        return self._at_end(float(time[-1]), time[0], centre + basis @ found.x, root, arrival.x)

    def _at_end(self, end: float, start: float, point: Floats, root: Floats, x: Floats) -> Belief:
        """The belief at the ``end`` (s) of a window that begins at ``point``, whose covariance has the ``root``."""
        runs = self._runs(np.array([end]), self._states, np.zeros((1, len(self._states))), x, start)
        reached, slopes, reason = runs.at(point)
        if reason:
            raise SimulationError(f"mhe at time {end:g} s: {reason}; give smaller noise, or take ekf")
        parameters = len(x) - len(self._states)
        moved = np.concatenate([reached, point[len(point) - parameters :]])
        answers = np.concatenate([slopes, np.eye(len(point))[len(point) - parameters :]])
        found = self._observed.projected(end, moved[None])[0]
        T = self._observed.basis(end, found)
        return Belief(found, T, triangular(T.T @ answers @ root))

    def _runs(
        self, time: Floats, names: Sequence[str], values: Floats, x: Floats, start: float | None = None
    ) -> MeasuredRuns:
        """Runs that begin near x (n,), and what is measured of them."""
        given = dict(zip(self._observed.names, x.tolist(), strict=True))
        free = [
            FreeValue(name, name, None, given[name], -np.inf, np.inf, scale_of(self._library, name, given))
            for name in (self._observed.names[i] for i in self._free)
        ]
        experiment = Measurement("window", time, tuple(names), values, self._signals, start)
        return MeasuredRuns(self._library, [experiment], free, [given], _TOLERANCE, hold=self._hold)
