"""Sums over bodies as outputs: mass centre, momenta and what holds the bodies, beside closed forms."""

from __future__ import annotations

import math

import pytest

from lag2fmu.dynamics import derive
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.reference import Equations

PLANE = """
[mechanism]
name = "dumbbell"
[coordinates]
x = { unit = "m", start = 0.3, velocity = 2.0 }
y = { unit = "m", start = -0.2, velocity = -1.0 }
phi = { unit = "rad", start = 0.5, velocity = 3.0 }
[bodies.disc]
position = ["x", "y"]
angle = "phi"
mass = 2
inertia = 0.7
[bodies.bead]
position = ["x + 0.6*cos(phi)", "y + 0.6*sin(phi)"]
mass = 1
[outputs]
c = { bodies = ["disc", "bead"], quantity = "mass_centre" }
v = { bodies = ["disc", "bead"], quantity = "mass_centre_velocity" }
h = { bodies = ["disc", "bead"], quantity = "angular_momentum" }
"""
ROD = """
[mechanism]
name = "rod"
[coordinates]
phi = { unit = "rad", start = 0.4, velocity = 1.2 }
[frames.rod]
rotations = [["y", "-phi"]]
[bodies.rod]
frame = "rod"
center = [0, 0, -0.5]
mass = 3
inertia = [0.25, 0.25, 0, 0, 0, 0]
[gravity]
acceleration = 10
[outputs]
force = { bodies = ["rod"], frame = "rod", axes = "frame", quantity = "holding_force" }
torque = { bodies = ["rod"], frame = "rod", quantity = "holding_torque" }
"""


def outputs_of(text: str) -> dict[str, float]:
    """All outputs at the start, which are those of the independent path and survive being written."""
    mechanism = read(text, "m.toml")
    assert read(write(mechanism), "m.toml") == mechanism
    equations, independent = derive(mechanism), Equations(mechanism)
    q, qd = independent.energies.start()
    qdd = independent.accelerations(0.0, q, qd)
    values = {"t": 0.0}
    for c, x, v, a in zip(mechanism.coordinates, q, qd, qdd, strict=True):
        values |= {c.name: float(x), f"{c.name}_dot": float(v), f"{c.name}_ddot": float(a)}
    expected = independent.outputs(0.0, q, qd)
    found = dict(
        zip(equations.outputs, equations.graph.evaluate(list(equations.outputs.values()), values), strict=True)
    )
    for name, value in found.items():
        assert value == pytest.approx(float(expected[name]), rel=1e-12, abs=1e-12)
    return found


def test_of_a_dumbbell_in_the_plane() -> None:
    """By the reduced mass: h = (I + m1 m2/(m1 + m2) l^2) phi_dot; the angular momentum has the z entry alone."""
    found, c, s = outputs_of(PLANE), math.cos(0.5), math.sin(0.5)
    assert (found["c_x"], found["c_y"]) == pytest.approx((0.3 + 0.2 * c, -0.2 + 0.2 * s))
    assert (found["v_x"], found["v_y"]) == pytest.approx((2.0 - 0.2 * 3 * s, -1.0 + 0.2 * 3 * c))
    assert found["h_z"] == pytest.approx((0.7 + 2 / 3 * 0.6**2) * 3.0)
    assert len(found) == 5


def test_what_holds_a_swinging_rod() -> None:
    """A rod of 1 m: phi_ddot = -3 g sin(phi) / (2 l), m g sin(phi)/4 across, m (g cos(phi) + phi_dot^2 l/2) along it.

    A hinge without friction holds it by no torque. Source: H. Goldstein, Classical Mechanics, section 5.
    """
    found = outputs_of(ROD)
    assert found["force_x"] == pytest.approx(3 * 10 * math.sin(0.4) / 4)
    assert found["force_z"] == pytest.approx(3 * (10 * math.cos(0.4) + 1.2**2 / 2))
    assert [found[f"torque_{x}"] for x in "xyz"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
