"""Motions with impacts and rolling contacts that the literature solves, written as text."""

from collections.abc import Callable

import numpy as np
import pytest

from lag2fmu import simulate
from lag2fmu.fmu import Fmu
from lag2fmu.formats.text import read
from lag2fmu.reference import Trajectory

pytestmark = pytest.mark.fmu

G = 9.81
Run = Callable[..., Trajectory]

WEDGE = """
[mechanism]
name = "wedge"
[coordinates]
x = { unit = "m", start = 0.3 }
y = { unit = "m", start = 1.5 }
[gravity]
acceleration = 9.81
[bodies.ball]
mass = 1
position = ["x", "y"]
""" + "".join(
    f"""
[contacts.{name}]
kind = "point_line"
between = ["ball", "world"]
normal = [{along}, 1]
restitution = {restitution}
"""
    for name, along, restitution in (("left", 1, 0.7), ("right", -1, 0.5))
)

LADDER = """
[mechanism]
name = "ladder"
[parameters]
l = { value = 2.0, unit = "m" }
[coordinates]
x = { unit = "m", start = 0.479425538604203 }
y = { unit = "m", start = 0.877582561890373 }
a = { unit = "rad", start = 0.5 }
[gravity]
acceleration = 9.81
[bodies.ladder]
mass = 3
inertia = "3*l**2/12"
position = ["x", "y"]
angle = "a"
[contacts.wall]
gap = "x - l/2*sin(a)"
[contacts.floor]
gap = "y - l/2*cos(a)"
"""

PENCIL = """
[mechanism]
name = "pencil"
[parameters]
a = { value = 0.05, unit = "m" }
[coordinates]
x = { unit = "m", velocity = 0.2598076211353316 }
y = { unit = "m", start = 0.043301270189221926, velocity = 0.15 }
c = { unit = "rad", velocity = -6 }
[gravity]
acceleration = 9.81
direction = ["sin(0.2)", "-cos(0.2)"]
[bodies.prism]
mass = 1
inertia = "5/12*a**2"
position = ["x", "y"]
angle = "c"
""" + "".join(
    f"""
[contacts.edge{k}]
gap = "y + a*sin(c + {k}*pi/3)"
slip = "x_dot - a*sin(c + {k}*pi/3)*c_dot"
friction = 5
"""
    for k in range(6)
)

WHEEL = f"""
[mechanism]
name = "wheel"
[coordinates]
x = {{ unit = "m", velocity = {np.cos(np.pi / 8)} }}
y = {{ unit = "m", start = {np.cos(np.pi / 8)}, velocity = {np.sin(np.pi / 8)} }}
c = {{ unit = "rad", velocity = -1 }}
[gravity]
acceleration = 9.81
direction = ["sin(0.15)", "-cos(0.15)"]
[bodies.hub]
mass = 1
inertia = 1e-6
position = ["x", "y"]
angle = "c"
""" + "".join(
    f"""
[contacts.spoke{k}]
gap = "y + sin(c + ({2 * k} - 3)*pi/8)"
slip = "x_dot - sin(c + ({2 * k} - 3)*pi/8)*c_dot"
friction = 20
"""
    for k in range(8)
)

START, SPEED = 0.200310900544287, -0.199832473004977

WALKER = f"""
[mechanism]
name = "walker"
[coordinates]
x = {{ start = {-np.sin(START)}, velocity = {-np.cos(START) * SPEED} }}
y = {{ start = {np.cos(START)}, velocity = {-np.sin(START) * SPEED} }}
a = {{ unit = "rad", start = {START}, velocity = {SPEED} }}
b = {{ unit = "rad", start = {-START}, velocity = {np.cos(2 * START) * SPEED} }}
[gravity]
acceleration = 1
direction = ["sin(0.009)", "-cos(0.009)"]
[bodies.hip]
mass = 1
position = ["x", "y"]
[bodies.foot]
mass = 1e-6
position = ["x + sin(a)", "y - cos(a)"]
[bodies.other]
mass = 1e-6
position = ["x + sin(b)", "y - cos(b)"]
[contacts.stands]
gap = "y - cos(a)"
slip = "x_dot + cos(a)*a_dot"
friction = 10
[contacts.lands]
gap = "y - cos(b) + 0.05*exp(-((a - b)/0.27)**8)"
slip = "x_dot + cos(b)*b_dot"
friction = 10
"""

WELL = """
[mechanism]
name = "well"
[parameters]
R = { value = 0.5, unit = "m" }
r = { value = 0.1, unit = "m" }
[coordinates]
x = { unit = "m", start = 0.4 }
y = { unit = "m", velocity = 2.4 }
z = { unit = "m" }
a = { unit = "rad" }
b = { unit = "rad" }
c = { unit = "rad", velocity = -24 }
[frames.moving]
origin = ["x", "y", "z"]
rotations = [["x", "a"], ["y", "b"], ["z", "c"]]
[gravity]
acceleration = 9.81
[bodies.ball]
frame = "moving"
mass = 1
inertia = ["0.4*r**2", "0.4*r**2", "0.4*r**2", 0, 0, 0]
[definitions]
wx = "a_dot + sin(b)*c_dot"
wy = "cos(a)*b_dot - sin(a)*cos(b)*c_dot"
wz = "sin(a)*b_dot + cos(a)*cos(b)*c_dot"
h = "sqrt(x**2 + y**2)"
[contacts.wall]
gap = "R - r - h"
slip = ["(x*y_dot - y*x_dot)/h + wz*r", "z_dot + r*(wx*y - wy*x)/h"]
friction = 3
"""

DISC = f"""
[mechanism]
name = "disc"
[parameters]
R = {{ value = 0.04, unit = "m" }}
[coordinates]
x = {{ unit = "m" }}
y = {{ unit = "m" }}
z = {{ unit = "m", start = {0.04 * np.sin(0.3)} }}
p = {{ unit = "rad", velocity = {np.sqrt(4 * G / 0.04 / np.sin(0.3))} }}
n = {{ unit = "rad", start = 0.3 }}
s = {{ unit = "rad", velocity = {-np.cos(0.3) * np.sqrt(4 * G / 0.04 / np.sin(0.3))} }}
[frames.disc]
origin = ["x", "y", "z"]
rotations = [["z", "p"], ["x", "n"], ["z", "s"]]
[gravity]
acceleration = 9.81
[bodies.disc]
frame = "disc"
mass = 0.4
inertia = ["0.1*R**2", "0.1*R**2", "0.2*R**2", 0, 0, 0]
[definitions]
w = "s_dot + p_dot*cos(n)"
[contacts.table]
gap = "z - R*sin(n)"
slip = ["x_dot + R*(cos(p)*w - sin(p)*sin(n)*n_dot)", "y_dot + R*(sin(p)*w + cos(p)*sin(n)*n_dot)"]
friction = 0.5
"""


@pytest.fixture
def run(exported: Callable[..., Fmu]) -> Run:
    """``run(text, stop, step, *outputs)``: the run of the FMU of a text at the tolerance 1e-9."""

    def made(text: str, stop: float, step: float, *outputs: str) -> Trajectory:
        fmu = exported(read(text, "published.toml"))
        return simulate(fmu, stop_time=stop, step=step, tolerance=1e-9, outputs=outputs)

    return made


def _bounces(height: float, restitution: float, g: float, times: np.ndarray) -> np.ndarray:
    """The height of a ball that is let go at 0: parabolas between its impacts, and rest behind all of them."""
    begin = np.sqrt(2 * height / g)
    found = np.where(times < begin, height - g * times**2 / 2, 0.0)
    speed = restitution * g * begin
    while speed > 1e-12:
        since, flight = times - begin, 2 * speed / g
        found = np.where((since >= 0) & (since < flight), speed * since - g * since**2 / 2, found)
        begin, speed = begin + flight, restitution * speed
    return found


def test_impacts_accumulate_on_both_sides_of_a_right_wedge(run: Run) -> None:
    """Each side stops the motion across it alone: H. E. Lehtihet, B. N. Miller, Physica D 21, 1986, at 45 degrees."""
    found = run(WEDGE, 6.0, 0.01, "x", "y", "left_mode", "right_mode")
    left, right = (found["y"] + found["x"]) / np.sqrt(2), (found["y"] - found["x"]) / np.sqrt(2)
    assert left == pytest.approx(_bounces(1.8 / np.sqrt(2), 0.7, G / np.sqrt(2), found.time), abs=1e-10)
    assert right == pytest.approx(_bounces(1.2 / np.sqrt(2), 0.5, G / np.sqrt(2), found.time), abs=1e-10)
    assert found["left_mode"][-1] == found["right_mode"][-1] == 3


def test_a_smooth_ladder_leaves_the_wall_at_two_thirds_of_its_height(run: Run) -> None:
    """D. Morin, Introduction to Classical Mechanics, problem 8.3 (leaving the wall)."""
    found = run(LADDER, 1.2, 1e-3, "y", "wall_mode")
    left = int(np.argmax(found["wall_mode"] == 1))
    assert found["y"][left] <= 2 / 3 * found["y"][0] < found["y"][left - 1]


def test_a_hexagonal_prism_rolls_with_eleven_seventeenths_of_its_spin_after_each_impact(run: Run) -> None:
    """Its energy before them tends to m g a sin(theta)/(1 - (11/17)^2): International Physics Olympiad 1998, problem 1.

    From edge to edge it turns about the one that sticks, so that its energy tells its spin at any height.
    """
    found = run(PENCIL, 2.0, 5e-4, "x", "y", "c", "c_dot")
    height = found["y"] * np.cos(0.2) - found["x"] * np.sin(0.2)
    energy = 0.5 * 17 / 12 * 0.05**2 * found["c_dot"] ** 2 + G * height
    falls = np.flatnonzero(np.diff(energy) < -1e-3)
    kinetic = G * 0.05 * np.sin(0.2) / (1 - (11 / 17) ** 2)
    lost = kinetic * (1 - (11 / 17) ** 2)
    assert len(falls) == 11
    assert -np.diff(energy)[falls[-3:]] == pytest.approx([lost] * 3, rel=2e-3)


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_a_rimless_wheel_comes_to_its_steady_speed(
    kind: str, exported: Callable[..., Fmu], caplog: pytest.LogCaptureFixture
) -> None:
    """An impact leaves r = cos(45 deg) of it, a step gives 4 g sin(22.5 deg) sin(slope): T. McGeer, IJRR 9, 1990.

    What the hub's small inertia leaves of the slip after impacts is no slip, and of Painleve's paradox nothing is said.
    """
    wheel = exported(read(WHEEL, "wheel.toml"))
    found = simulate(wheel, stop_time=8.0, step=1e-3, tolerance=1e-8, kind=kind, outputs=("x", "y", "c_dot"))
    height = found["y"] * np.cos(0.15) - found["x"] * np.sin(0.15)
    energy = 0.5 * found["c_dot"] ** 2 + G * height
    falls = np.flatnonzero(np.diff(energy) < -0.1)
    lost = 4 * G * np.sin(np.pi / 8) * np.sin(0.15) / 2
    assert len(falls) > 10
    assert -np.diff(energy)[falls[-3:]] == pytest.approx([lost] * 3, rel=2e-3)
    assert not caplog.records


def test_the_simplest_walker_returns_to_its_start_after_a_step(run: Run) -> None:
    """The long period at the slope 0.009: M. Garcia, A. Chatterjee, A. Ruina, M. Coleman, J. Biomech. Eng. 120, 1998.

    Its feet weigh nothing; here they have a millionth of its mass. The swinging foot may scuff the ground in passing.
    """
    found = run(WALKER, 3.9, 1e-3, "a", "b", "a_dot", "b_dot", "lands_impacts", "stands_mode")
    landed = int(np.argmax(found["lands_impacts"] > 0))
    a, b, a_dot, b_dot = (float(found[name][landed]) for name in ("a", "b", "a_dot", "b_dot"))
    since = (a + b) / (a_dot + b_dot)
    assert 0 < since < 1e-3
    assert found["stands_mode"][landed] == 1
    assert b - since * b_dot == pytest.approx(START, abs=5e-6)
    assert b_dot == pytest.approx(SPEED, abs=2e-4)
    assert a_dot == pytest.approx(np.cos(2 * START) * SPEED, abs=5e-4)


def test_a_ball_in_a_well_rolls_down_and_comes_up_again(run: Run) -> None:
    """At sqrt(2/7) times the rate of its rounds: M. Gualtieri and others, Golfer's dilemma, Am. J. Phys. 74, 2006."""
    found = run(WELL, 5.0, 0.05, "x", "z", "wall_mode", "wall_force")
    rate = 6 * np.sqrt(2 / 7)
    assert found["z"] == pytest.approx(-5 / 7 * G / rate**2 * (1 - np.cos(rate * found.time)), abs=1e-8)
    assert found["x"] == pytest.approx(0.4 * np.cos(6 * found.time), abs=1e-8)
    assert found["wall_force"] == pytest.approx(np.full(101, 14.4), rel=1e-7)
    assert (found["wall_mode"] == 2).all()


def test_a_disc_rolls_around_a_resting_centre(run: Run) -> None:
    """At the rate sqrt(4 g/(R sin(n))) for the inclination n: H. K. Moffatt, Euler's disk, Nature 404, 2000."""
    found = run(DISC, 1.0, 0.05, "x", "p", "n", "table_mode")
    assert found["n"] == pytest.approx(np.full(21, 0.3), abs=1e-12)
    assert found["p"] == pytest.approx(np.sqrt(4 * G / 0.04 / np.sin(0.3)) * found.time, abs=1e-10)
    assert np.abs(found["x"]).max() < 1e-13
    assert (found["table_mode"] == 2).all()
