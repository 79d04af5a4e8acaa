"""Are observers as sure as they ought to be? 10 models, 1000 noisy runs each, by the equations' own noise.

The truth starts beside the estimate by noise of the covariance that the observer is told, is driven by white noise of
the density that it is told, and is measured with the noise that it is told. At the last sample the normalised squares
of the estimate's error (NEES, n degrees) and of the innovation (NIS, p degrees) are then chi-squared; their means over
the runs have to lie within the bounds that 95 % of such means meet. Y. Bar-Shalom, X. Li, T. Kirubarajan, Estimation
with Applications to Tracking and Navigation, 2001, section 5.4.

Run ``python -m benchmarks.consistency [MODEL ...]``.
"""

from __future__ import annotations

import sys
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

import lag2fmu
from lag2fmu.ensemble.function import StateFunction
from lag2fmu.reference.trajectory import Floats
from lag2fmu.studies.filters import FILTERS, Belief, triangular
from lag2fmu.studies.observed import Observed

RUNS, SAMPLES, BETWEEN, PARTS = 1000, 8, 0.05, 20
"""Runs; samples of each, s between them, and steps of the truth between samples, in which its noise is held."""
SHARE = 0.95


class Case(NamedTuple):
    """What is measured of a ``model``, by standard deviations, and noise along inputs by densities, in SI units."""

    model: str
    measure: dict[str, float]
    process: dict[str, float]
    start: float
    """The standard deviation of all states at the start, by their nominal values."""


CASES = (
    Case("pendulum", {"theta": 0.02}, {"Q_theta": 0.2}, 0.05),
    Case("double_pendulum", {"theta1": 0.02, "theta2": 0.02}, {"Q_theta1": 0.1, "Q_theta2": 0.1}, 0.03),
    Case("cart_pole", {"x": 0.02, "theta": 0.02}, {"F": 0.3, "Q_theta": 0.05}, 0.03),
    Case("spring_mass_damper", {"x": 0.02}, {"Q_x": 0.3}, 0.1),
    Case("elastic_pendulum", {"s": 0.02, "theta": 0.02}, {"Q_s": 0.2, "Q_theta": 0.2}, 0.03),
    Case("furuta_pendulum", {"alpha": 0.02, "beta": 0.02}, {"Q_alpha": 0.02, "Q_beta": 0.02}, 0.03),
    Case("acrobot", {"q1": 0.02, "q2": 0.02}, {"Q_q1": 0.2, "Q_q2": 0.2}, 0.03),
    Case("anharmonic_oscillator", {"x": 0.02}, {"Q_x": 0.1}, 0.05),
    Case("coupled_masses", {"x1": 0.02, "x3": 0.02}, {"Q_x1": 0.2, "Q_x2": 0.2, "Q_x3": 0.2}, 0.05),
    Case("henon_heiles", {"x": 0.01, "y": 0.01}, {"Q_x": 0.02, "Q_y": 0.02}, 0.02),
)
SMALL = 0.2
"""The part of all these noises that is small enough for an extended filter."""
METHODS = (("ekf", SMALL), ("ukf", 1.0), ("ukf-simplex", 1.0))
"""(method, part of the noise)."""


def scaled(case: Case, part: float) -> Case:
    """The ``case`` with ``part`` times all noise."""
    measure = {name: part * size for name, size in case.measure.items()}
    process = {name: part * size for name, size in case.process.items()}
    return Case(case.model, measure, process, part * case.start)


def truth(case: Case, function: StateFunction, start: Floats, noise: np.random.Generator) -> Floats:
    """The states (samples, runs, n) of noisy motions that begin at ``start`` (runs, n)."""
    names, h = function.names["u"], BETWEEN / PARTS
    places = [names.index(name) for name in case.process]
    density = np.array([*case.process.values()])
    x, u, found = start, np.tile(function.start["u"], (len(start), 1)), [start]
    for i in range((SAMPLES - 1) * PARTS):
        t = i * h
        u[:, places] = density * noise.standard_normal((len(start), len(density))) / np.sqrt(h)
        a = function(x, u, t=t)
        b = function(x + h / 2 * a, u, t=t + h / 2)
        c = function(x + h / 2 * b, u, t=t + h / 2)
        d = function(x + h * c, u, t=t + h)
        x = x + h / 6 * (a + 2 * b + 2 * c + d)
        if (i + 1) % PARTS == 0:
            found.append(x)
    return np.array(found)


def squares(case: Case, method: str, runs: int = RUNS, seed: int = 0) -> tuple[float, float, int, int]:
    """Mean NEES and NIS at the last sample, and their degrees of freedom."""
    noise = np.random.default_rng(seed)
    mechanism = lag2fmu.load(case.model)
    observed = Observed(mechanism, tuple(case.measure), case.process, (), None, hold=False, step=BETWEEN / 2)
    chosen, sizes, n = FILTERS[method](observed), np.array([*case.measure.values()]), len(observed.names)
    deviations = np.full(n, case.start)
    motions = truth(case, observed.function, observed.start + deviations * noise.standard_normal((runs, n)), noise)
    errors, innovations = np.empty(runs), np.empty(runs)
    for run in range(runs):
        belief = Belief(observed.start, np.eye(n), triangular(np.diag(deviations)))
        for i, x in enumerate(motions[:, run]):
            t = i * BETWEEN
            if i:
                belief = chosen.predict(belief, t - BETWEEN, t).belief
            sample = observed.outputs(t, x[None])[0] + sizes * noise.standard_normal(len(sizes))
            belief, found = chosen.update(belief, t, np.arange(len(sizes)), sample, sizes)
        left = np.linalg.solve(belief.S, belief.T.T @ (x - belief.x))
        errors[run], innovations[run] = left @ left, found.squared
    return float(errors.mean()), float(innovations.mean()), n, len(sizes)


def bounds(degrees: int, runs: int = RUNS) -> tuple[float, float]:
    """Between these lies the mean of ``runs`` squares of ``degrees`` degrees of freedom with the probability SHARE."""
    low, high = chi2.ppf([(1 - SHARE) / 2, (1 + SHARE) / 2], runs * degrees) / runs
    return float(low), float(high)


def row(case: Case, method: str, part: float, runs: int = RUNS) -> str:
    """A row of the table."""
    nees, nis, n, p = squares(scaled(case, part), method, runs)
    cells = [case.model, method, f"{part:g}"]
    for mean, degrees in ((nees, n), (nis, p)):
        low, high = bounds(degrees, runs)
        cells += [f"{mean:.3f}", f"{low:.3f} ... {high:.3f}", "yes" if low <= mean <= high else "no"]
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    heads = ("model", "method", "noise", "NEES", "bounds", "within", "NIS", "bounds", "within")
    print(f"| {' | '.join(heads)} |")
    print("|---" * len(heads) + "|")
    for case in CASES:
        if not sys.argv[1:] or case.model in sys.argv[1:]:
            print(*(row(case, method, part) for method, part in METHODS), sep="\n", flush=True)
