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

TIPPE_TOP = """
[mechanism]
name = "tippe_top"
[coordinates]
x = { unit = "m" }
y = { unit = "m" }
z = { unit = "m", start = 0.02 }
psi = { unit = "rad" }
theta = { unit = "rad", start = 0.3 }
phi = { unit = "rad", velocity = 150 }
[frames.top]
origin = ["x", "y", "z"]
rotations = [["z", "psi"], ["x", "theta"], ["z", "phi"]]
[gravity]
acceleration = 9.81
[bodies.mass]
frame = "top"
mass = 0.02
center = [0, 0, -0.006]
inertia = [2.5e-6, 2.5e-6, 2.8e-6, 0, 0, 0]
[contacts.table]
kind = "sphere_plane"
between = ["top", "world"]
normal = "z"
radius = 0.02
friction = 0.3
[outputs]
w = { frame = "top", quantity = "angular_velocity", axes = "frame" }
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


def test_a_tippe_top_keeps_jelletts_invariant_while_it_slides_and_rolls(exported: Callable[..., Fmu]) -> None:
    """No force at the contact has a moment about the line from the mass centre to it: J. H. Jellett, 1872.

    The slip comes to rest in the end, where it is as uncertain in its direction as the solver is exact.
    """
    top = exported(read(TIPPE_TOP, "tippe_top.toml"))
    for tolerance, step in ((1e-6, 0.002), (1e-6, 0.1), (1e-8, 0.01)):
        run = simulate(top, stop_time=0.3, step=step, tolerance=tolerance, beside=("table_mode",))
        assert {run["table_mode"][0], run["table_mode"][-1]} == {3, 2}
        up = np.array([np.sin(run["theta"]) * np.sin(run["phi"]), np.sin(run["theta"]) * np.cos(run["phi"])])
        across = 2.5e-6 * (run["w_x"] * up[0] + run["w_y"] * up[1])
        along = 2.8e-6 * run["w_z"] * (0.006 - 0.02 * np.cos(run["theta"]))
        assert along - 0.02 * across == pytest.approx(np.full(len(run), along[0]), rel=100 * tolerance)
