"""Mechanisms are equal if the same is written; what is kept of one must not stand for another with more equations."""

from __future__ import annotations

import numpy as np
import pytest

from lag2fmu.dynamics.lagrange import with_derived
from lag2fmu.errors import Lag2FmuError
from lag2fmu.formats.loading import load
from lag2fmu.reference import integrate


def test_equilibria_of_what_has_no_mass_are_integrated_though_they_are_not_written() -> None:
    mechanism = load("slides_problem_5_small")
    completed = with_derived(mechanism)
    assert completed == mechanism
    times = np.linspace(0.0, 0.1, 3)
    with pytest.raises(Lag2FmuError):  # its mass matrix is singular
        integrate(mechanism, times)
    reference = integrate(completed, times).trajectory
    assert reference["multiplier_massless_x"] == pytest.approx(0.0, abs=1e-9)
