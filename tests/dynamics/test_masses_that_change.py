"""Masses and inertias that change with the time: d/dt (m v) has m' v, as T = m(t) v^2 / 2 demands."""

from __future__ import annotations

import numpy as np
import pytest

from lag2fmu.dynamics import derive
from lag2fmu.dynamics.samples import samples
from lag2fmu.formats.text import read
from lag2fmu.reference import Equations

ROCKET = """
[mechanism]
name = "rocket"
[coordinates]
z = { start = 1.0, velocity = 2.0 }
phi = { velocity = 0.5 }
[gravity]
acceleration = "9.81"
[bodies.rocket]
mass = "1000 - 5*t"
inertia = "400 - 2*t"
angle = "phi"
position = [0, "z"]
[forces]
z = "5*(2500 - z_dot)"
phi = "-2*phi_dot"
"""
IN_SPACE = """
[mechanism]
name = "tank"
[coordinates]
x = { velocity = 2.0 }
a = { velocity = 3.0 }
b = { start = 0.3, velocity = 1.0 }
[frames.tank]
origin = ["x", 0, "0.2*sin(t)"]
rotations = [["x", "a"], ["y", "b"]]
[bodies.tank]
frame = "tank"
center = [0.1, 0, "0.3 - 0.01*t"]
mass = "10 - 0.5*t"
inertia = ["10 - 0.5*t", "2 + t", "12 - t", "0.1*t", 0, "0.2"]
"""


def test_a_rocket_is_driven_by_what_leaves_it() -> None:
    """What leaves takes its velocity along: m v' = 5 kg/s * 2500 m/s - m g. Meriam, Kraige, Dynamics, section 4/7."""
    equations = derive(read(ROCKET, "rocket.toml"))
    assert equations.solution is not None
    for at in samples(equations.mechanism, 4):
        z, phi = equations.graph.evaluate(equations.solution.x, at)
        assert z == pytest.approx((12500 + at["Q_z"]) / (1000 - 5 * at["t"]) - 9.81, rel=1e-12)
        assert phi == pytest.approx(at["Q_phi"] / (400 - 2 * at["t"]), rel=1e-12)


def test_a_body_in_space_that_empties_agrees_with_the_independent_path() -> None:
    mechanism = read(IN_SPACE, "tank.toml")
    equations, independent = derive(mechanism), Equations(mechanism)
    assert equations.solution is not None
    for at in samples(mechanism, 4):
        q, qd = (np.array([at[f"{c.name}{end}"] for c in mechanism.coordinates]) for end in ("", "_dot"))
        expected = independent.accelerations(
            at["t"], q, qd, {f"Q_{c.name}": at[f"Q_{c.name}"] for c in mechanism.coordinates}
        )
        assert equations.graph.evaluate(equations.solution.x, at) == pytest.approx(expected, rel=1e-10)
