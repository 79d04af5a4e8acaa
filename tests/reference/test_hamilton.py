"""Hamilton's equations: against closed forms, and told where momenta determine no velocities."""

from __future__ import annotations

import numpy as np
import pytest
from sympy import cos, sin

from lag2fmu.errors import SimulationError
from lag2fmu.formats.loading import load
from lag2fmu.mechanism import Body, Constraint, Energy, Mechanism, Spring, coordinate
from lag2fmu.reference import integrate, integrate_canonically

TIMES = np.linspace(0, 2, 21)


def test_damped_oscillator_in_closed_form() -> None:
    """x = exp(-t/4) (cos w t + sin(w t) / (4 w)) of x'' + x'/2 + 4 x = 0: Landau, Lifshitz, section 25."""
    x = coordinate("x", "m", start=1.0)
    energy = Energy(dissipation=x.dot**2 / 2)
    mechanism = Mechanism(
        "oscillator",
        coordinates=[x],
        energy=energy,
        bodies=[Body("m", 2, (x, 0))],
        springs=[Spring("k", 8, elongation=x)],
    )
    w = np.sqrt(4 - 1 / 16)
    expected = np.exp(-TIMES / 4) * (np.cos(w * TIMES) + np.sin(w * TIMES) / (4 * w))
    assert integrate_canonically(mechanism, TIMES)["x"] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("model", ["heavy_top", "charged_particle", "horizontally_driven_pendulum", "kepler"])
def test_agrees_with_the_lagrange_equations(model: str) -> None:
    """q and qd, where momenta have parts linear in the velocities, or the time is in them."""
    run = integrate_canonically(load(model), TIMES / 4)
    other = integrate(load(model), TIMES / 4).trajectory
    assert run.values == pytest.approx(other.columns(list(run.names)), rel=1e-7, abs=1e-7)


def test_constraint_forces_act_on_momenta() -> None:
    """A pendulum in Cartesian coordinates is the one by its angle."""
    x, y, theta = (
        coordinate("x", "m", start=sin(1).evalf()),
        coordinate("y", "m", guess=-0.5),
        coordinate("theta", start=1.0),
    )
    tied = Mechanism(
        "tied",
        coordinates=[x, y],
        bodies=[Body("m", 1, (x, y))],
        gravity=9.81,
        constraints=[Constraint("rod", x**2 + y**2 - 1)],
    )
    free = Mechanism("free", coordinates=[theta], bodies=[Body("m", 1, (sin(theta), -cos(theta)))], gravity=9.81)
    angle = integrate(free, TIMES).trajectory["theta"]
    assert integrate_canonically(tied, TIMES)["x"] == pytest.approx(np.sin(angle), abs=1e-7)


def test_singular_mass_matrix_is_told() -> None:
    x, y = coordinate("x", "m", start=1.0), coordinate("y", "m", guess=1.0)
    mechanism = Mechanism(
        "massless", coordinates=[x, y], bodies=[Body("m", 1, (x, 0))], constraints=[Constraint("tie", x - y)]
    )
    with pytest.raises(SimulationError, match="the mass matrix is singular"):
        integrate_canonically(mechanism, TIMES)
