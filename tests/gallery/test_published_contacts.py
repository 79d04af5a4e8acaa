"""Motions with contacts that textbooks solve, written as text."""

from collections.abc import Callable

import numpy as np
import pytest

from lag2fmu import simulate
from lag2fmu.fmu import Fmu
from lag2fmu.formats.text import read

pytestmark = pytest.mark.fmu

INCLINE = """
[mechanism]
name = "incline"
[coordinates]
x = { start = 0, velocity = 1.0 }
y = { start = 0 }
z = { start = 0 }
[bodies.block]
mass = 1
position = ["x", "y", "z"]
[forces]
y = "9.81*sin(0.5)"
z = "-9.81*cos(0.5)"
[contacts.plane]
gap = "z"
slip = ["x_dot", "y_dot"]
friction = "tan(0.5)"
"""

SPHERES = """
[mechanism]
name = "sphere_on_sphere"
[coordinates]
x = { start = 0.19866933079506122 }
y = { start = 0.9800665778412416 }
phi = { unit = "rad", start = 0 }
[gravity]
acceleration = 9.81
[bodies.upper]
mass = 1
inertia = "0.4*0.2**2"
position = ["x", "y"]
angle = "phi"
[contacts.touch]
kind = "disc_disc"
between = ["upper", "world"]
radius = [0.2, 0.8]
friction = 1000
"""


def test_across_an_incline_at_the_angle_of_friction_half_the_speed_is_left(exported: Callable[..., Fmu]) -> None:
    """Friction and weight are equal along the plane, so the speed and its part downhill have one sum.

    D. Morin, Introduction to Classical Mechanics, chapter 3, "Sliding sideways on a plane".
    """
    run = simulate(exported(read(INCLINE, "incline.toml")), stop_time=3.0, step=0.1, tolerance=1e-9)
    speed = np.hypot(run["x_dot"], run["y_dot"])
    assert speed + run["y_dot"] == pytest.approx(np.ones(31), abs=1e-8)
    assert run["y_dot"][-1] == pytest.approx(0.5, abs=1e-7)


def test_a_sphere_rolls_off_another_one_at_ten_seventeenths_of_the_height(exported: Callable[..., Fmu]) -> None:
    """It sticks up to there: D. Morin, Introduction to Classical Mechanics, chapter 8, by the balance of energy."""
    run = simulate(
        exported(read(SPHERES, "spheres.toml")), stop_time=1.2, step=2e-4, tolerance=1e-9, outputs=("y", "touch_mode")
    )
    left = int(np.argmax(run["touch_mode"] == 1))
    assert (run["touch_mode"][:left] == 2).all()
    assert run["y"][left] <= 10 / 17 * run["y"][0] <= run["y"][left - 1]
    assert run["y"][left - 1] - run["y"][left] < 6e-4
