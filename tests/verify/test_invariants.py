"""Conserved quantities are watched along a run, and Hamilton's equations beside it."""

from __future__ import annotations

import numpy as np
import pytest

from lag2fmu.dynamics import derive
from lag2fmu.formats.loading import load, with_values
from lag2fmu.reference import Reference, Trajectory, integrate
from lag2fmu.verify.invariants import action_note, drift_checks, hamilton_checks

TIMES = np.linspace(0, 2, 101)
BAR = 1e-6


@pytest.fixture(scope="module")
def kepler() -> Reference:
    return integrate(load("kepler"), TIMES)


def drifts(reference: Reference, run: Trajectory) -> dict[str, float]:
    checks = drift_checks(derive(load("kepler")), run, reference, np.arange(len(TIMES)), 2.0, BAR)
    return {check.name: check.value for check in checks}


def test_a_momentum_that_is_kept_and_one_that_is_not(kepler: Reference) -> None:
    """A turning rate that is wrong by a part of 10^4 at the end is seen."""
    assert drifts(kepler, kepler.trajectory)["conserved: p_phi"] < 1e-11
    run = kepler.trajectory
    wrong = {name: run[name] * (1 + (1e-4 * TIMES / 2 if name == "phi_dot" else 0)) for name in run.names}
    found = drifts(kepler, Trajectory.of(TIMES, wrong))
    # amplification of starts is taken out, so that less than 1e-4 is left
    assert BAR < found["conserved: p_phi"] < 1.01e-4


def test_hamilton_s_equations_find_another_motion(kepler: Reference) -> None:
    (check,), notes = hamilton_checks(derive(load("kepler")), kepler, 2.0, BAR)
    assert check.passed
    assert not notes
    other = integrate(load("kepler"), TIMES, parameters={"alpha": 1.001})
    (check,), _ = hamilton_checks(derive(load("kepler")), other, 2.0, BAR)
    assert not check.passed


def test_stiff_mechanisms_are_compared_too() -> None:
    """Decays of 10 /s and 1e7 /s, which an explicit method would follow in millions of steps; against exp(-10 t)."""
    block = with_values(load("spring_mass_damper"), {"m": 1.0, "k": 1e8, "c": 1e7 + 10, "x": 0.1, "x_dot": -1.0})
    reference = integrate(block, TIMES, method="Radau")
    assert reference.trajectory["x"] == pytest.approx(0.1 * np.exp(-10 * TIMES), abs=1e-10)
    (check,), notes = hamilton_checks(derive(block), reference, 2.0, BAR)
    assert check.passed
    assert not notes


def test_a_singular_mass_matrix_is_a_note() -> None:
    mechanism = derive(load("slides_problem_5_small")).mechanism
    reference = integrate(mechanism, np.linspace(0, 0.2, 21))
    checks, notes = hamilton_checks(derive(mechanism), reference, 0.2, BAR)
    assert not checks
    assert "the mass matrix is singular" in notes[0]


def test_the_action_is_told(kepler: Reference) -> None:
    """Against the integral of T - V by Simpson's rule."""
    from scipy.integrate import simpson

    run = kepler.trajectory
    expected = simpson(run["kinetic_energy"] - run["potential_energy"], x=TIMES)
    number = float(action_note(derive(load("kepler")), kepler).split(" is ")[1].split()[0])
    assert number == pytest.approx(expected, rel=1e-4)
