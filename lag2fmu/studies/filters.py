"""Kalman filters in square-root form, and the smoother, for errors on the manifold of the constraints.

The error of an estimate x (n,) is T e, where T (n, r) is an orthonormal basis of the motions that the constraints leave
free. The covariance of e is S S^T with a triangular S (r, r). Every step ends with an orthogonal transformation of
what stands side by side, so that S S^T stays positive whatever rounding does.
Sources: T. Kailath, A. H. Sayed, B. Hassibi, Linear Estimation, 2000, chapter 12 (array algorithms); S. Sarkka,
Bayesian Filtering and Smoothing, Cambridge 2013, sections 5.2, 6.6 (cubature points) and 8.2 (Rauch, Tung, Striebel).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lag2fmu.analysis.observing import SIMPLEX
from lag2fmu.reference.trajectory import Floats
from lag2fmu.studies.observed import Observed

Rows = NDArray[np.integer[Any]]
"""Indices of outputs that were measured."""


def triangular(*blocks: Floats) -> Floats:
    """The lower triangular L (k, k) with L L^T = A A^T, where A (k, ...) is the ``blocks`` side by side.

    No entry of its diagonal is negative. Source: T. Kailath, A. H. Sayed, B. Hassibi, Linear Estimation, 2000, section
    12.1.
    """
    wide = np.concatenate(blocks, axis=1)
    k = len(wide)
    if wide.shape[1] < k:
        wide = np.concatenate([wide, np.zeros((k, k - wide.shape[1]))], axis=1)
    upper = np.asarray(np.linalg.qr(wide.T, mode="r"))
    found: Floats = (upper * np.where(np.diagonal(upper) < 0, -1.0, 1.0)[:, None]).T
    return found


@dataclass(frozen=True)
class Belief:
    """An estimate x (n,), the basis T (n, r) of its errors, and the root S (r, r) of their covariance."""

    x: Floats
    T: Floats
    S: Floats

    @property
    def deviations(self) -> Floats:
        """The standard deviations of x, (n,)."""
        found: Floats = np.linalg.norm(self.T @ self.S, axis=1)
        return found

    def moved(self, observed: Observed, t: float, e: Floats, S: Floats) -> Belief:
        """The belief at the error e (r,) from this one, with the root S (r, ...) in the basis T of this one."""
        x = observed.projected(t, (self.x + self.T @ e)[None])[0]
        T = observed.basis(t, x)
        return Belief(x, T, triangular(T.T @ self.T @ S))


@dataclass(frozen=True)
class Prediction:
    """The ``belief`` before a sample, and how it depends on the belief after the last one.

    ``gain`` (r, r) maps errors of the belief here to errors there; ``rest`` (r, k) is a root of the covariance that is
    left there if the state here is known.
    """

    belief: Belief
    gain: Floats
    rest: Floats


@dataclass(frozen=True)
class Innovation:
    """What a sample says beyond what was expected: the difference (p,), and the root (p, p) of its covariance."""

    difference: Floats
    root: Floats

    @property
    def squared(self) -> float:
        """The normalised innovation squared, which has a chi-squared distribution of p degrees if all is as assumed."""
        scaled = np.linalg.solve(self.root, self.difference)
        return float(scaled @ scaled)


class Filter(ABC):
    """Predicts and updates beliefs on the state of what is ``observed``."""

    def __init__(self, observed: Observed) -> None:
        self.observed = observed

    @abstractmethod
    def _spread(self, belief: Belief, start: float, end: float) -> tuple[Floats, Floats, Floats, Floats]:
        """From ``start`` to ``end`` (s): x, T there, (r, k) errors there, and (r, k) errors here of the same causes."""

    @abstractmethod
    def _expected(self, belief: Belief, t: float, rows: Rows) -> tuple[Floats, Floats, Floats]:
        """What the outputs ``rows`` are expected to be, (p,), (p, k) errors of it, and (r, k) errors of the state."""

    def predict(self, belief: Belief, start: float, end: float) -> Prediction:
        """The belief at ``end`` (s) that follows from that at ``start``."""
        x, T, there, here = self._spread(belief, start, end)
        r = len(there)
        whole = triangular(np.concatenate([there, here]))
        S, cross, rest = whole[:r, :r], whole[r:, :r], whole[r:, r:]
        gain = np.linalg.lstsq(S.T, cross.T, rcond=None)[0].T
        return Prediction(Belief(x, T, S), gain, rest)

    def update(
        self, belief: Belief, t: float, rows: Rows, measured: Floats, noise: Floats
    ) -> tuple[Belief, Innovation]:
        """The belief after a sample at ``t`` (s): outputs ``rows`` (p,) were ``measured`` (p,) with ``noise`` (p,)."""
        expected, seen, errors = self._expected(belief, t, rows)
        p = len(rows)
        blank = np.zeros((len(errors), p))
        whole = triangular(np.concatenate([np.diag(noise), blank]), np.concatenate([seen, errors]))
        found = Innovation(measured - expected, whole[:p, :p])
        e = whole[p:, :p] @ np.linalg.solve(found.root, found.difference)
        return belief.moved(self.observed, t, e, whole[p:, p:]), found


class Extended(Filter):
    """The extended Kalman filter: errors by exact derivatives at the estimate."""

    def _spread(self, belief: Belief, start: float, end: float) -> tuple[Floats, Floats, Floats, Floats]:
        flow = self.observed.flow(belief.x, start, end)
        T = self.observed.basis(end, flow.x)
        noise = T.T @ flow.noise
        there = np.concatenate([T.T @ flow.derivative @ belief.T @ belief.S, noise], axis=1)
        return flow.x, T, there, np.concatenate([belief.S, np.zeros_like(noise)], axis=1)

    def _expected(self, belief: Belief, t: float, rows: Rows) -> tuple[Floats, Floats, Floats]:
        H = self.observed.output_derivatives(t, belief.x)[rows]
        return self.observed.outputs(t, belief.x[None])[0, rows], H @ belief.T @ belief.S, belief.S


class Unscented(Filter):
    """The unscented Kalman filter with its 2 r points of equal weight, which are cubature points."""

    def _reaches(self, r: int) -> Floats:
        """The places (r, k) of k points along r directions, in standard deviations; of mean 0 and variance 1."""
        return np.asarray(np.sqrt(r) * np.concatenate([np.eye(r), -np.eye(r)], axis=1))

    def _points(self, belief: Belief, t: float) -> tuple[Floats, Floats]:
        """The points on the manifold, (k, n), and their errors by the root of their number, (r, k)."""
        errors = belief.S @ self._reaches(len(belief.S))
        points = belief.x + (belief.T @ errors).T
        return self.observed.projected(t, points), errors / np.sqrt(len(points))

    def _spread(self, belief: Belief, start: float, end: float) -> tuple[Floats, Floats, Floats, Floats]:
        points, here = self._points(belief, start)
        moved = self.observed.moved(points, start, end)
        x = self.observed.projected(end, moved.mean(axis=0)[None])[0]
        T = self.observed.basis(end, x)
        noise = T.T @ self.observed.flow(belief.x, start, end).noise
        there = T.T @ (moved - x).T / np.sqrt(len(moved))
        return x, T, np.concatenate([there, noise], axis=1), np.concatenate([here, np.zeros_like(noise)], axis=1)

    def _expected(self, belief: Belief, t: float, rows: Rows) -> tuple[Floats, Floats, Floats]:
        points, errors = self._points(belief, t)
        found = self.observed.outputs(t, points)[:, rows]
        mean = found.mean(axis=0)
        return mean, (found - mean).T / np.sqrt(len(found)), errors


class Simplex(Unscented):
    """The unscented Kalman filter with r + 1 points of equal weight, the corners of a regular simplex.

    It takes half the time. What is odd in the errors leaves a trace in its means, which pairs of points do not have.
    Source: P. Moireau, D. Chapelle, Reduced-order unscented Kalman filtering, ESAIM: Control, Optimisation and Calculus
    of Variations 17 (2011) 380-405, section 2.
    """

    def _reaches(self, r: int) -> Floats:
        behind = np.arange(1, r + 1)[:, None]
        point = np.arange(r + 1)
        corners = np.where(point < behind, 1.0, np.where(point == behind, -behind, 0.0))
        return np.asarray(np.sqrt((r + 1) / (behind * (behind + 1))) * corners)


FILTERS: dict[str, type[Filter]] = {"ekf": Extended, "ukf": Unscented, SIMPLEX: Simplex}
"""The filters by name."""


def smoothed(observed: Observed, times: Floats, after: list[Belief], between: list[Prediction]) -> list[Belief]:
    """The beliefs (m) that know all samples, from those ``after`` each sample (m) and the predictions ``between``.

    Source: S. Sarkka, Bayesian Filtering and Smoothing, Cambridge 2013, section 8.2 (Rauch, Tung, Striebel).
    """
    found = [after[-1]]
    for t, belief, ahead in zip(times[-2::-1], after[-2::-1], between[::-1], strict=True):
        expected, known = ahead.belief, found[-1]
        e = expected.T.T @ (known.x - expected.x)
        spread = ahead.gain @ (expected.T.T @ known.T @ known.S)
        found.append(belief.moved(observed, float(t), ahead.gain @ e, triangular(ahead.rest, spread)))
    return found[::-1]
