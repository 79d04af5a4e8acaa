"""An arm of two links that is thrown on a rough floor and comes to lie on it, almost straight before the end.

Feet that stick at its ends have hardly a lever on the height of its joint then: 1e-6 of its length.
"""

from __future__ import annotations

import numpy as np
import pytest

import lag2fmu
from lag2fmu.formats.text import read

pytestmark = pytest.mark.fmu

ARM = read(
    """
[mechanism]
name = "arm"
[parameters]
L = { value = 0.3, unit = "m" }
h = { value = 0.1528, unit = "m", doc = "height of the start" }
[coordinates]
x = { unit = "m", velocity = 1.562 }
y = { unit = "m" }
a = { unit = "rad", start = -0.3646, velocity = -2.734 }
b = { unit = "rad", start = 0.2916, velocity = 1.815 }
[frames.upper]
origin = ["x", "y", 0]
rotations = [["z", "a"]]
[frames.lower]
parent = "upper"
origin = ["L", 0, 0]
rotations = [["z", "b"]]
[bodies]
upper = { mass = 1.452, inertia = [0.001, 0.001, 0.0019, 0, 0, 0], frame = "upper", center = ["0.61*L", 0, 0] }
lower = { mass = 1.394, inertia = [0.001, 0.001, 0.002, 0, 0, 0], frame = "lower", center = ["0.44*L", 0, 0] }
[gravity]
acceleration = 9.81
direction = [-0.134, -1, 0]
[dampers.joint]
damping = 7.362
rate = "b_dot"
[springs.joint]
stiffness = 13.25
elongation = "b + 0.185"
[contacts.left]
gap = "y + h"
slip = "x_dot"
friction = 0.9
[contacts.joint]
gap = "y + L*sin(a) + h"
slip = "x_dot - L*sin(a)*a_dot"
friction = 0.9
[contacts.right]
gap = "y + L*sin(a) + L*sin(a + b) + h"
slip = "x_dot - L*sin(a)*a_dot - L*sin(a + b)*(a_dot + b_dot)"
friction = 0.9
restitution = 0.4
[experiment]
stop_time = 0.5
step = 0.01
""",
    "arm",
)


def test_an_arm_that_falls_flat_comes_to_rest() -> None:
    """Where it lies is what time stepping tells to first order. Feet that held it were told to slip without end."""
    located = lag2fmu.simulate(ARM, solver="dopri5")
    stepped = lag2fmu.simulate(ARM, solver="moreau", values={"solver_step": 2e-5})
    ends = located.columns(["a", "b", "a_dot", "b_dot", "x_dot"])[-1]
    assert ends == pytest.approx(np.zeros(5), abs=1e-8)
    assert located["x"][-1] == pytest.approx(stepped["x"][-1], abs=2e-3)
