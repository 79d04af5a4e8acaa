"""What an observer watches: a mechanism between samples, by its equations and their exact derivatives.

The state x (n,) has coordinates, velocities, further states, and behind them the parameters that are estimated. Between
samples it moves by the classical method of Runge and Kutta, whose derivatives are those of its own steps. White noise
comes in along inputs, states and parameters. Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential
Equations I, sections II.1 (the method) and I.14 (the variational equation).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lag2fmu.analysis.observing import RESOLVED, check_estimated, check_process, residuals_of
from lag2fmu.ensemble.function import StateFunction
from lag2fmu.errors import SimulationError
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.trajectory import Floats, Trajectory
from lag2fmu.studies.reflections import reduced

_MET, _MOST = 1e-13, 20
"""A state is on the manifold if a correction is less than this, relative to 1 + |x|; it is after 3 or 4 corrections."""
MOST_STEPS = 10_000
"""The most steps between two samples."""
_INSTANT = 1e-9
"""A part of a span in which nothing shows, so that ten steps fill one which rounding makes longer."""
_GAUSS = (0.5 - math.sqrt(3) / 6, 0.5 + math.sqrt(3) / 6)
"""The nodes of Gauss's rule of order 4, at which noise comes in."""
_ORDER = 4
"""The terms of the series of exp(A t)."""


@dataclass(frozen=True)
class Flow:
    """A motion over a time: the state x (n,) at its end, its ``derivative`` (n, n) by the state at the begin.

    ``noise`` (n, k) is a root of the covariance that the process adds.
    """

    x: Floats
    derivative: Floats
    noise: Floats


class Observed:
    """The equations of ``mechanism``, what is measured of it, where noise comes in, and the signals that drive it."""

    def __init__(
        self,
        mechanism: Mechanism,
        measured: Sequence[str],
        process: Mapping[str, float],
        estimated: Sequence[str],
        signals: Trajectory | None,
        *,
        hold: bool,
        step: float | None = None,
    ) -> None:
        """``process`` {input, state or parameter: density} is in SI units times the root of s; ``signals`` are inputs.

        ``step`` (s) is the longest solver step; by default it follows from the fastest pole.

        Raises LoadError for names that are unknown, DerivationError for a mechanism that has no plain functions.
        """
        residuals = residuals_of(mechanism)
        self.function = StateFunction(mechanism, outputs=(*measured, *residuals))
        names = self.function.names
        check_estimated(estimated, names["p"], names["x"])
        self.names, self.measured = (*names["x"], *estimated), tuple(measured)
        self.start: Floats = np.concatenate(
            [self.function.start["x"], self.function.start["p"][[names["p"].index(name) for name in estimated]]]
        )
        self._n, self._places = len(names["x"]), [names["p"].index(name) for name in estimated]
        self._outputs = slice(self._n, self._n + len(measured))
        self._bound = len(residuals)
        self._signals, self._hold = signals, hold
        self._driven = [] if signals is None else [names["u"].index(name) for name in signals.names]
        check_process(process, [*self.names, *names["u"]])
        self._longest = step
        self._process = dict(process)
        self._before = math.inf  # s: while it steps to a sample, inputs that are held do not know what comes then

    # ------------------------------------------------------------------------------------------------------ functions

    def _arguments(self, t: float, x: Floats) -> dict[str, Floats]:
        """The arguments of the function at states x (..., n)."""
        u, p = self.function.start["u"].copy(), self.function.start["p"]
        if self._signals is not None:
            time, values = self._signals.time, self._signals.values
            if self._hold:
                t = min(t, self._before)
                u[self._driven] = values[max(0, int(np.searchsorted(time, t, side="right")) - 1)]
            else:
                u[self._driven] = [np.interp(t, time, column) for column in values.T]
        if self._places:
            p = np.broadcast_to(p, (*x.shape[:-1], len(p))).copy()
            p[..., self._places] = x[..., self._n :]
        return {"x": x[..., : self._n], "u": u, "p": p, "t": np.asarray(t)}

    def _slope(self, t: float, x: Floats) -> Floats:
        """dx/dt (..., n) at states x (..., n)."""
        found = np.zeros_like(x)
        found[..., : self._n] = self.function(**self._arguments(t, x))
        if not np.isfinite(found).all():
            raise SimulationError(
                f"observer of '{self.function.mechanism.name}' at time {t:g} s: the equations have no value at the "
                "estimate; give smaller noise of the start and the process, or start nearer to the motion"
            )
        return found

    def _derivatives(self, t: float, x: Floats) -> tuple[Floats, Floats]:
        """The derivatives of rates, outputs and residuals by x, (n + o + c, n), and by the process, (n, k)."""
        found = self.function.jacobians(**self._arguments(t, x))
        whole = np.concatenate([found["x"], found["p"][:, self._places]], axis=1)
        extra = np.zeros((len(self._places), whole.shape[1]))
        G = np.zeros((len(x), len(self._process)))
        for j, (name, size) in enumerate(self._process.items()):
            if name in self.names:
                G[self.names.index(name), j] = size
            else:
                G[: self._n, j] = size * found["u"][: self._n, self.function.names["u"].index(name)]
        return np.concatenate([whole[: self._n], extra, whole[self._n :]]), G

    def outputs(self, t: float, x: Floats) -> Floats:
        """What is measured, (m, o), at states x (m, n)."""
        return self.function.outputs(**self._arguments(t, x))[..., : len(self.measured)]

    def output_derivatives(self, t: float, x: Floats) -> Floats:
        """The derivatives (o, n) of what is measured by x (n,)."""
        n = len(x)
        return self._derivatives(t, x)[0][n : n + len(self.measured)]

    def rates_by_state(self, t: float, x: Floats) -> Floats:
        """The derivatives (n, n) of dx/dt by x (n,)."""
        return self._derivatives(t, x)[0][: len(x)]

    # ------------------------------------------------------------------------------------------------------- manifold

    def basis(self, t: float, x: Floats) -> Floats:
        """An orthonormal basis (n, r) of the changes of x (n,) that the constraints allow to first order."""
        if not self._bound:
            return np.eye(len(x))
        rows, _ = _of_unit_length(self._derivatives(t, x)[0][len(x) + len(self.measured) :])
        Q, _, kept = reduced(rows)
        return Q[:, len(kept) :]

    def projected(self, t: float, points: Floats) -> Floats:
        """The ``points`` (m, n), each moved to the nearest state that meets the constraints; parameters stay.

        Raises SimulationError where none is near.
        """
        return np.array([self._on_manifold(t, x) for x in points]) if self._bound else points

    def _on_manifold(self, t: float, x: Floats) -> Floats:
        """Newton's method with the least correction."""
        x, n, o = x.copy(), self._n, len(self.measured)
        for _ in range(_MOST):
            left = self.function.outputs(**self._arguments(t, x))[o:]
            rows, length = _of_unit_length(self._derivatives(t, x)[0][len(x) + o :, :n])
            Q, L, kept = reduced(rows)
            step = Q[:, : len(kept)] @ np.linalg.solve(L, (left / length)[kept])
            x[:n] -= step
            if np.abs(step).max() <= _MET * (1 + np.abs(x[:n]).max()):
                return x
        raise SimulationError(
            f"observer of '{self.function.mechanism.name}' at time {t:g} s: no state near the estimate meets the "
            "constraints; give smaller noise, or more samples"
        )

    # --------------------------------------------------------------------------------------------------------- motion

    def _steps(self, x: Floats, start: float, end: float) -> int:
        """The number of steps from ``start`` to ``end`` (s)."""
        if self._longest is not None:
            return max(1, math.ceil((end - start) * (1 - _INSTANT) / self._longest))
        fastest = float(np.abs(np.linalg.eigvals(self.rates_by_state(start, x))).max(initial=0.0))
        count = max(1, math.ceil((end - start) * fastest / RESOLVED))
        if count > MOST_STEPS:
            raise SimulationError(
                f"observer of '{self.function.mechanism.name}' at time {start:g} s: the fastest motion, of "
                f"{fastest:.3g} rad/s, takes {count} steps until the next sample; leave out what is that stiff, or "
                "sample more often"
            )
        return count

    def moved(self, points: Floats, start: float, end: float) -> Floats:
        """The states (m, n) at ``end`` (s) that begin at the ``points`` (m, n) at ``start``.

        Raises SimulationError where the equations have no value, and where they are too stiff. Source: E. Hairer, S. P.
        Norsett, G. Wanner, Solving Ordinary Differential Equations I, section II.1.
        """
        count, self._before = self._steps(points.mean(axis=0), start, end), math.nextafter(end, -math.inf)
        h = (end - start) / count
        for i in range(count):
            points = self._step(points, start + i * h, h)[-1]
        self._before = math.inf
        return self.projected(end, points)

    def _step(self, x: Floats, t: float, h: float) -> tuple[Floats, Floats, Floats, Floats]:
        """The states of the second, third and fourth stage and of the end of a step of h (s)."""
        a = self._slope(t, x)
        second = x + h / 2 * a
        b = self._slope(t + h / 2, second)
        third = x + h / 2 * b
        c = self._slope(t + h / 2, third)
        fourth = x + h * c
        d = self._slope(t + h, fourth)
        return second, third, fourth, x + h / 6 * (a + 2 * b + 2 * c + d)

    def flow(self, x: Floats, start: float, end: float) -> Flow:
        """The motion from x (n,) at ``start`` to ``end`` (s), with exact derivatives of its steps.

        Raises SimulationError as ``moved`` does. Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary
        Differential Equations I, section I.14.
        """
        count, one = self._steps(x, start, end), np.eye(len(x))
        h, whole, noise = (end - start) / count, np.eye(len(x)), np.zeros((len(x), 0))
        self._before = math.nextafter(end, -math.inf)
        for i in range(count):
            t = start + i * h
            second, third, fourth, final = self._step(x, t, h)
            A = self.rates_by_state(t, x)
            B, G = self._derivatives(t + h / 2, second)
            B = B[: len(x)]
            C, D = self.rates_by_state(t + h / 2, third), self.rates_by_state(t + h, fourth)
            by_b = B @ (one + h / 2 * A)
            by_c = C @ (one + h / 2 * by_b)
            step = one + h / 6 * (A + 2 * by_b + 2 * by_c + D @ (one + h * by_c))
            fresh = [math.sqrt(h / 2) * _grown(B, (1 - node) * h, G) for node in _GAUSS]
            noise = np.concatenate([step @ noise, *fresh], axis=1)
            if noise.shape[1] > 2 * len(x):
                noise = np.asarray(np.linalg.qr(noise.T, mode="r")).T
            whole, x = step @ whole, final
        self._before = math.inf
        return Flow(self.projected(end, x[None])[0], whole, noise)


def _of_unit_length(rows: Floats) -> tuple[Floats, Floats]:
    """The ``rows`` (m, n) by their lengths, and these (m,); where one is 0 it counts as 1."""
    length = np.linalg.norm(rows, axis=1)
    length = np.where(length > 0, length, 1.0)
    return rows / length[:, None], length


def _grown(A: Floats, t: float, G: Floats) -> Floats:
    """exp(A t) G to the order of the method, for A (n, n) and G (n, k)."""
    found = G
    for k in range(_ORDER, 0, -1):
        found = G + t / k * (A @ found)
    return found
