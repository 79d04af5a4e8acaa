"""Slips in space: a cube turns to rest on four feet, a puck is struck, a point is pulled loose or shaken."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from stepping import Stepping

from lag2fmu import simulate
from lag2fmu.fmu import Fmu
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Mechanism
from lag2fmu.verify.run import Kind

pytestmark = pytest.mark.fmu

Array = NDArray[np.float64]
G, MU, HALF, INERTIA = 9.81, 0.5, 0.1, 0.01
CORNERS = HALF * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
CUBE = f"""
[mechanism]
name = "cube"
[coordinates]
x = {{ unit = "m" }}
y = {{ unit = "m" }}
z = {{ unit = "m", start = {HALF} }}
e0 = {{ guess = 1 }}
e1 = {{}}
e2 = {{}}
e3 = {{}}
[gravity]
acceleration = {G}
direction = [0, 0, -1]
[frames.cube]
origin = ["x", "y", "z"]
quaternion = ["e0", "e1", "e2", "e3"]
[bodies.cube]
frame = "cube"
mass = 1
inertia = [{INERTIA}, {INERTIA}, {INERTIA}, 0, 0, 0]
""" + "".join(
    f"""
[points.p{k}]
frame = "cube"
position = {place}
[contacts.c{k}]
kind = "point_plane"
between = ["p{k}", "world"]
normal = "z"
friction = {MU}
restitution = 0.3
"""
    for k, place in enumerate(CORNERS.tolist(), 1)
)

PUCK = f"""
[mechanism]
name = "puck"
[coordinates]
x = {{ unit = "m" }}
y = {{ unit = "m" }}
z = {{ unit = "m" }}
u = {{ unit = "m", start = -5 }}
w = {{ unit = "m", start = 5 }}
[bodies]
puck = {{ mass = 1, position = ["x", "y", "z"] }}
beside = {{ mass = 1, position = [0, "u", 0] }}
before = {{ mass = 1, position = ["w", 0, 0] }}
[forces]
x = "1.001*{MU * G}"
z = "-{G}"
[contacts]
table = {{ gap = "z", slip = ["x_dot", "y_dot"], friction = {MU} }}
side = {{ gap = "y - u", restitution = 1 }}
front = {{ gap = "w - x", restitution = 1 }}
"""

POINT = """
[mechanism]
name = "point"
[coordinates]
x = { unit = "m" }
y = { unit = "m" }
z = { unit = "m" }
[bodies.point]
mass = 1
position = ["x", "y", "z"]
[contacts.ground]
gap = "z"
"""
PULLED = """
slip = ["x_dot", "y_dot"]
friction = 0.1
[forces]
x = "(0.9 + t)*cos(10*t)"
y = "(0.9 + t)*sin(10*t)"
z = -10
"""
SHAKEN = """
slip = ["x_dot - 0.4*cos(200*t)", "y_dot"]
friction = 0.3
[forces]
y = -1
z = -10
"""


@pytest.fixture(scope="module")
def cube() -> Mechanism:
    """One mechanism, so that its FMU is built once."""
    return read(CUBE, "cube.toml")


@pytest.fixture(scope="module")
def puck() -> Mechanism:
    """A puck on a table that is pushed a little more than friction bears, and two strikers that are far away."""
    return read(PUCK, "puck.toml")


def feet_rates(_: float, state: Array) -> Array:
    """The rates of x, y, the angle and their rates of a cube on four feet that all slide.

    Feet that give way alike bear loads whose sums along both diagonals are equal.
    """
    c, s = np.cos(state[2]), np.sin(state[2])
    arms = CORNERS[::2, :2] @ np.array([[c, s], [-s, c]])
    slips = state[3:5] + state[5] * np.stack([-arms[:, 1], arms[:, 0]], axis=1)
    ways = slips / np.linalg.norm(slips, axis=1)[:, None]
    moments = arms - HALF * MU * ways
    loads = np.linalg.solve(np.array([np.ones(4), *moments.T, [1, -1, -1, 1]]), [G, 0, 0, 0])
    assert loads.min() > 0
    drags = -MU * loads[:, None] * ways
    turning = (arms[:, 0] * drags[:, 1] - arms[:, 1] * drags[:, 0]).sum() / INERTIA
    return np.array([*state[3:], *drags.sum(axis=0), turning])


@pytest.mark.parametrize(("vx", "vy", "turning"), [(-0.24, 0.07, 6.7), (0.07, -0.06, 4.3), (0.11, -0.16, 2.3)])
def test_a_turning_cube_on_four_feet_comes_to_rest_at_once(
    exported: Callable[..., Fmu], cube: Mechanism, vx: float, vy: float, turning: float
) -> None:
    """Sliding and turning end at one time, where the slips of all feet are slower than the errors of the states.

    Goyal, Ruina, Papadopoulos, Planar sliding with dry friction, Wear 1991.
    """

    def pace(_: float, state: Array) -> float:
        return float(np.abs(state[3:5]).max() + HALF * abs(state[5])) - 1e-5

    pace.terminal = True  # type: ignore[attr-defined]
    slide = solve_ivp(
        feet_rates, (0, 1), [0, 0, 0, vx, vy, turning], method="DOP853", rtol=1e-9, atol=1e-12, events=pace
    )
    start = {"x_dot": vx, "y_dot": vy, "e3_dot": turning / 2}
    run = simulate(
        exported(cube), stop_time=0.2, step=0.1, values=start, outputs=("x", "y", "e0", "e3", "kinetic_energy")
    )
    assert run["kinetic_energy"][-1] == 0.0
    assert [run["x"][-1], run["y"][-1]] == pytest.approx(slide.y[:2, -1], abs=2e-6)
    assert 2 * np.arctan2(run["e3"][-1], run["e0"][-1]) == pytest.approx(slide.y[2, -1], abs=2e-5)


@pytest.mark.parametrize(
    ("striker", "struck"),
    [({"u": -0.01, "u_dot": 1.0}, [1e-5 * MU * G, 1.0]), ({"w": 0.01, "w_dot": -1.0}, [-1.0, 0.0])],
    ids=["from the side", "from the front"],
)
def test_a_puck_that_begins_to_slip_is_struck(
    exported: Callable[..., Fmu], puck: Mechanism, striker: dict[str, float], struck: list[float]
) -> None:
    """The impact of another contact gives a slip, which had not yet a direction by itself, a new one."""
    run = simulate(exported(puck), stop_time=0.16, step=0.01, tolerance=1e-6, values=striker)

    def rates(_: float, v: Array) -> Array:
        return np.asarray(MU * G * (np.array([1.001, 0.0]) - v / np.linalg.norm(v)))

    slide = solve_ivp(rates, (0, 0.15), struck, rtol=1e-11, atol=1e-13)
    assert [run["x_dot"][-1], run["y_dot"][-1]] == pytest.approx(slide.y[:, -1], abs=1e-5)


@pytest.mark.parametrize(("kind", "most"), [("co-simulation", 1e-5), ("model-exchange", 6e-5)])
def test_a_point_that_a_turning_force_pulls_loose(exported: Callable[..., Fmu], kind: Kind, most: float) -> None:
    """Friction of 1 N holds until 0.1 s, and turns the slow slip stiffly into the direction of the force.

    fmpy's CVode kept the Jacobian of the slow slip in model exchange, and velocities were wrong by 9e-4 m/s. Below
    1e-10 m/s the reference slips along the force.
    """
    begin = 0.1 + 1.4e-5
    run = simulate(exported(read(POINT + PULLED, "pulled.toml")), stop_time=0.4, step=0.01, tolerance=1e-6, kind=kind)

    def rates(t: float, state: Array) -> Array:
        """The rates of the speed u and its direction."""
        speed, direction = state
        force, turned = 0.9 + t, 10 * t - direction
        return np.array([force * np.cos(turned) - 1, force * np.sin(turned) / speed])

    times = run.time[run.time > begin]
    speed, direction = solve_ivp(rates, (begin, 0.4), [1e-10, 10 * begin], "Radau", times, rtol=1e-10, atol=1e-14).y
    assert run["x_dot"][-len(times) :] == pytest.approx(speed * np.cos(direction), abs=most)
    assert run["y_dot"][-len(times) :] == pytest.approx(speed * np.sin(direction), abs=most)


def test_a_point_creeps_down_a_slope_that_is_shaken_across(exported: Callable[..., Fmu]) -> None:
    """Its slip turns round every 16 ms, and is never slow.

    Where it had turned by 60 degrees in a step, the friction at the end of this step was that of beyond 90 degrees, and
    1 of 100 turns gave an error of 200 tolerances.
    """
    run = simulate(exported(read(POINT + SHAKEN, "shaken.toml")), stop_time=2, step=0.01, tolerance=1e-6)

    def rates(t: float, v: Array) -> Array:
        slip = np.array([v[0] - 0.4 * np.cos(200 * t), v[1]])
        return np.asarray(np.array([0.0, -1.0]) - 3 * slip / np.hypot(*slip))

    creep = solve_ivp(rates, (0, 2), [0, 0], "DOP853", run.time, rtol=1e-10, atol=1e-12, max_step=2e-3).y
    assert run["x_dot"] == pytest.approx(creep[0], abs=5e-6)
    assert run["y_dot"] == pytest.approx(creep[1], abs=5e-6)


def test_a_slip_in_space_has_turned_away_before_its_friction_turns(exported: Callable[..., Fmu]) -> None:
    """The sign of friction turns at 90 degrees from the direction of the mode. A fast slip gets an event before.

    Where inertia makes friction push the slip back over that sign, as in a disk that rolls and slips, an importer with
    a sharp tolerance could not get past it and took steps of 1e-12 s without an end.
    """
    with Stepping(exported(read(POINT + PULLED, "pulled.toml")).path, "ModelExchange") as fmu:
        fmu.start({"x_dot": 1.0})
        assert fmu.due([0, 0, 0, *slip(50), 0, 0]) == []
        assert fmu.due([0, 0, 0, *slip(70), 0, 0]) == [1]
        assert fmu.rates()[3:5] == pytest.approx([0.9 - np.cos(np.radians(70)), -np.sin(np.radians(70))], abs=1e-9)


def slip(angle: float) -> tuple[float, float]:
    """The velocity (m/s) of a slip of 1 m/s at an ``angle`` (degrees)."""
    return float(np.cos(np.radians(angle))), float(np.sin(np.radians(angle)))
