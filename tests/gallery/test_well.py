"""Motion in one dimension: its course, its period, and the potential found again from the periods."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

pytestmark = pytest.mark.fmu

m, U0, a = 1.0, 2.0, 0.5


def test_potential_well(motion) -> None:
    """sinh(x/a) = sqrt(U0/|E| - 1) sin(2 pi t/T), T = 2 pi a sqrt(m/(2 |E|)): Mechanics, section 11, problem 2b."""
    energy = U0 - 1.5**2 / 2  # |E|
    run = motion("potential_well", 4.0)
    phase = np.sqrt(2 * energy / m) / a * run.time
    assert run["x"] == pytest.approx(a * np.arcsinh(np.sqrt(U0 / energy - 1) * np.sin(phase)), abs=1e-8)


def test_a_particle_leaves_the_well(motion) -> None:
    """For E > 0 the sine becomes a hyperbolic one."""
    energy = 2.5**2 / 2 - U0
    run = motion("potential_well", 4.0, x_dot=2.5)
    phase = np.sqrt(2 * energy / m) / a * run.time
    assert run["x"] == pytest.approx(a * np.arcsinh(np.sqrt(U0 / energy + 1) * np.sinh(phase)), rel=1e-8, abs=1e-9)


def test_the_potential_is_recovered_from_the_period(motion) -> None:
    """x(U) = integral of T(E)/sqrt(U - E) dE/(2 pi sqrt(2 m)) over 0 ... U: Mechanics, section 12, U even in x.

    Energies count from the bottom. T is measured: twice the time until the FMU passes the middle again.
    """

    def period(energy: float) -> float:
        longest = 2 * np.pi * a * np.sqrt(m / (2 * (U0 - energy)))
        run = motion("potential_well", 0.6 * longest, steps=600, tolerance=1e-11, x_dot=float(np.sqrt(2 * energy / m)))
        passes = CubicHermiteSpline(run.time, run["x"], run["x_dot"]).roots(extrapolate=False)
        return 2 * float(passes[passes > 0.1 * longest][0])

    nodes, weights = np.polynomial.legendre.leggauss(16)
    s, w = np.pi / 4 * (nodes + 1), np.pi / 4 * weights  # E = U sin(s)^2
    for U in (0.4, 1.2):
        periods = np.array([period(U * np.sin(x) ** 2) for x in s])
        recovered = np.sqrt(U) / (np.pi * np.sqrt(2 * m)) * (w * periods * np.sin(s)).sum()
        assert recovered == pytest.approx(a * np.arccosh(np.sqrt(U0 / (U0 - U))), rel=1e-8)
