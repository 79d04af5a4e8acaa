"""Coefficients of friction that change with place, speed and time, or differ between contacts that share a load.

The motions are in closed form, whoever integrates.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import spence

import lag2fmu
from lag2fmu.errors import SimulationError
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Mechanism
from lag2fmu.reference.direct_integration import integrate

pytestmark = pytest.mark.fmu

G = 9.81
WAYS = pytest.mark.parametrize("way", ["co-simulation", "model-exchange", "judge"])


def _block(friction: str, speed: float = 0.0, slope: float = 0.0, static: str = "") -> Mechanism:
    """A block of 1 kg with this ``speed`` (m/s) down a ``slope`` (rad)."""
    return read(
        f"""
        [mechanism]
        name = "block"
        [parameters]
        metre = {{ value = 1.0, unit = "m" }}
        second = {{ value = 1.0, unit = "s" }}
        g = {{ value = {G}, unit = "m/s2" }}
        [coordinates]
        x = {{ unit = "m", velocity = {speed} }}
        y = {{ unit = "m" }}
        [gravity]
        acceleration = "g"
        direction = ["sin({slope})", "-cos({slope})"]
        [bodies]
        block = {{ mass = 1, position = ["x", "y"] }}
        [contacts.floor]
        gap = "y"
        slip = "x_dot"
        friction = "{friction}"
        {static and f'static_friction = "{static}"'}
        """,
        "block",
    )


def _motion(mechanism: Mechanism, way: str, stop: float, tolerance: float = 1e-10) -> np.ndarray:
    """Times (s), places (m) and speeds (m/s), (3, 51)."""
    names, times = ["x", "x_dot"], np.linspace(0.0, stop, 51)
    if way == "judge":
        return np.vstack([times, integrate(mechanism, times, rtol=tolerance).trajectory.columns(names).T])
    run = lag2fmu.simulate(mechanism, stop_time=stop, step=stop / 50, tolerance=tolerance, outputs=names, kind=way)
    return np.vstack([run.time, run.columns(names).T])


@WAYS
def test_friction_that_grows_with_the_way_is_a_spring(way: str) -> None:
    """x'' = -g (0.1 + 0.2 x) up to rest, where static friction holds the spring."""
    w, t0, v = np.sqrt(0.2 * G), 0.1 / 0.2, 3.0
    amplitude, end = np.hypot(t0, v / w), np.arctan2(v / w, t0) / w
    t, x, speed = _motion(_block("0.1 + 0.2*x/metre", v), way, 2.0)
    moved = np.minimum(t, end)
    phase = np.arctan2(t0, v / w)
    assert x == pytest.approx(amplitude * np.sin(w * moved + phase) - t0, abs=3e-8)
    assert speed == pytest.approx(np.where(t < end, amplitude * w * np.cos(w * t + phase), 0.0), abs=3e-8)


@WAYS
def test_friction_that_grows_with_the_speed_is_drag(way: str) -> None:
    """v' = -g (0.05 + 0.3 |v|) has an exponential for its motion, which ends."""
    rate, rest, v = 0.3 * G, 0.05 / 0.3, 3.0
    end = np.log((v + rest) / rest) / rate
    t, _, speed = _motion(_block("0.05 + 0.3*abs(x_dot)*second/metre", v), way, 2.0)
    assert speed == pytest.approx(np.where(t < end, (v + rest) * np.exp(-rate * t) - rest, 0.0), abs=3e-8)


@WAYS
def test_friction_overflows_far_behind_the_stop(way: str) -> None:
    """exp(-abs(v)/w) of a side that a solver's trial step has left: w is 3000 times less than the speed at the start.

    The way is the integral of v/(g (0.2 + 0.15 exp(-v/w))) over v, with a dilogarithm.
    """
    v, w = 3.0, 0.001
    block = _block(f"0.2 + 0.15*exp(-abs(x_dot)*second/metre/{w})", v)
    _, x, speed = _motion(block, way, 2.0, tolerance=1e-6)
    assert x[-1] == pytest.approx((v**2 / 2 + w**2 * spence(1.75)) / (0.2 * G), abs=3e-6)
    assert speed[-1] == pytest.approx(0.0, abs=1e-12)


@WAYS
def test_a_patch_of_ice_takes_what_it_takes(way: str) -> None:
    """Energies at the ends of the patch: 12.5 J less 0.4 g 1.5 m, less 0.02 g 1 m, and 0.6 g holds at last."""
    left = 12.5 - G * (0.4 * 1.5 + 0.02 * 1.0)
    _, x, speed = _motion(_block("if(x > 1.5*metre, if(x < 2.5*metre, 0.02, 0.6), 0.4)", 5.0), way, 3.0)
    assert x[-1] == pytest.approx(2.5 + left / (0.6 * G), abs=3e-8)
    before = x < 1.5
    assert speed[before] ** 2 / 2 == pytest.approx(12.5 - 0.4 * G * x[before], abs=3e-7)


@WAYS
def test_a_block_slides_off_as_its_friction_fades(way: str) -> None:
    """It holds up to tan(0.3) = 0.6 - 0.1 t, and then goes g cos(0.3) 0.1 (t - t0)^3/6."""
    begin = (0.6 - np.tan(0.3)) / 0.1
    t, x, _ = _motion(_block("0.6 - 0.1*t/second", slope=0.3), way, 4.0)
    assert x == pytest.approx(G * np.cos(0.3) * 0.1 * np.maximum(t - begin, 0.0) ** 3 / 6, abs=3e-8)


@WAYS
def test_static_friction_fades_alone(way: str) -> None:
    """Held up to tan(0.3) = 0.5 - 0.2 t, the block starts with the acceleration that 0.2 leaves."""
    begin = (0.5 - np.tan(0.3)) / 0.2
    mechanism = _block("0.2", slope=0.3, static="0.5 - 0.2*t/second")
    t, x, _ = _motion(mechanism, way, 2.0)
    assert x == pytest.approx(G * (np.sin(0.3) - 0.2 * np.cos(0.3)) * np.maximum(t - begin, 0) ** 2 / 2, abs=3e-8)


@pytest.mark.parametrize("solver", ["dopri5", "moreau"])
def test_a_coefficient_below_0_ends_the_run(solver: str) -> None:
    with pytest.raises(SimulationError, match=r"the coefficient of friction of floor is -.*max\(0, \.\.\.\)"):
        lag2fmu.simulate(_block("0.5 - x/metre", 4.0), stop_time=1.0, solver=solver)


BELT = """
[mechanism]
name = "belt"
[coordinates]
x = { unit = "m" }
y = { unit = "m" }
[gravity]
acceleration = 9.81
[bodies]
block = { mass = 1, position = ["x", "y"] }
[springs]
driven = { stiffness = 4, elongation = "x - 0.3*cos(1.3*t)" }
"""
RUBS = {
    "contact": """
        [contacts]
        belt = { gap = "y", slip = "x_dot - 0.4", friction = "0.2 + 0.2/(1 + 2*abs(x_dot - 0.4))" }
        """,
    "friction": """
        [contacts]
        floor = { gap = "y" }
        [frictions]
        belt = { on = "x_dot - 0.4", force = "9.81*(0.2 + 0.2/(1 + 2*abs(x_dot - 0.4)))" }
        """,
}
"""Of a block on a belt, whose friction falls with the speed."""


def _stick_slip(times: np.ndarray) -> np.ndarray:
    """Places (m) of the block on the belt, by SciPy between the ends of its slips and of its rests."""

    def pull(t: float, x: float) -> float:
        return 4.0 * (0.3 * np.cos(1.3 * t) - x)

    def rates(t: float, state: np.ndarray) -> list[float]:
        slip = state[1] - 0.4
        return [state[1], pull(t, state[0]) - side * G * (0.2 + 0.2 / (1.0 + 2.0 * side * slip))]

    def stops(t: float, state: np.ndarray) -> float:
        return side * (state[1] - 0.4) if t > since + 1e-3 else 1.0

    def gives_way(t: float, x: float, since: float) -> float:
        return abs(pull(t, x + 0.4 * (t - since))) - 0.4 * G

    stops.terminal = True
    since, state, side, places = 0.0, np.array([0.0, 0.0]), -1.0, np.full(len(times), np.nan)
    while since < times[-1]:
        arc = solve_ivp(rates, (since, times[-1] + 1), state, rtol=1e-11, atol=1e-12, events=stops, dense_output=True)
        there = (times >= since) & (times <= arc.t[-1])
        places[there] = arc.sol(times[there])[0]
        since, x = arc.t[-1], arc.y[0, -1]
        ahead = since + np.arange(0.0, 20.0, 0.01)
        first = int(np.argmax([gives_way(t, x, since) > 0 for t in ahead]))
        end = brentq(gives_way, ahead[first - 1], ahead[first], args=(x, since), xtol=1e-14) if first else since
        there = (times >= since) & (times <= end)
        places[there] = x + 0.4 * (times[there] - since)
        since, state = end, np.array([x + 0.4 * (end - since), 0.4])
        side = np.sign(pull(end, state[0]))
    return places


@WAYS
def test_friction_begins_behind_ice(way: str) -> None:
    """Beyond x = 1 m the coefficient grows as x - 1 m, from rounding below 0, which is a quarter of a swing."""
    w = np.sqrt(G)
    t, x, v = _motion(_block("max(x/metre - 1, 0)", 2.0), way, 5.0)
    phase = np.clip(w * (t - 0.5), 0.0, np.pi / 2)
    assert x == pytest.approx(np.where(t < 0.5, 2 * t, 1 + 2 / w * np.sin(phase)), abs=3e-8)
    assert v == pytest.approx(2 * np.cos(phase), abs=3e-8)


@WAYS
def test_friction_that_begins_at_0(way: str) -> None:
    """Its coefficient is 0.3 t at the time t, so v = v0 - 0.15 g t^2."""
    t, x, v = _motion(_block("0.3*t/second", 2.0), way, 1.0)
    assert v == pytest.approx(2.0 - 0.15 * G * t**2, abs=1e-8)
    assert x == pytest.approx(2.0 * t - 0.05 * G * t**3, abs=1e-8)


@pytest.mark.parametrize(("way", "speed"), [("co-simulation", 2.0), ("judge", 0.0)])
def test_friction_without_bound_has_a_sentence(way: str, speed: float) -> None:
    """That of a curling stone is often written as 1/sqrt(speed), which no stone at rest has."""
    with pytest.raises(SimulationError, match=r"the coefficient of friction of '?floor'? is (inf; .*1e-3|not finite)"):
        _motion(_block("0.1/sqrt(abs(x_dot)*second/metre)", speed), way, 2.0, 1e-6)


def test_dry_friction_without_bound_has_a_sentence() -> None:
    """At rest it is infinite, on whichever side of abs(...) the speed comes to 0."""
    text = """
        [mechanism]
        name = "guide"
        [coordinates]
        x = { velocity = 2.0 }
        [bodies]
        slide = { mass = 19, position = ["x", 0] }
        [frictions.guide]
        on = "x_dot"
        force = "1 + 0.3/abs(x_dot)"
        """
    with pytest.raises(SimulationError, match=r"the force of the dry friction guide is -?inf; expected a .*1e-3"):
        lag2fmu.simulate(read(text, "guide"), stop_time=50.0, step=0.1)


@pytest.mark.parametrize("tolerance", [1e-7, 1e-9, 5e-10])
@pytest.mark.parametrize("solver", ["dopri5", "radau5"])
@pytest.mark.parametrize("rubs", RUBS)
def test_a_block_that_gives_way_slides_from_there_on(rubs: str, solver: str, tolerance: float) -> None:
    """Its acceleration grows from 0, and friction falls as its slip grows."""
    mechanism = read(BELT + RUBS[rubs], "belt")
    run = lag2fmu.simulate(
        mechanism, stop_time=30.0, step=0.05, tolerance=tolerance, outputs=["x"], kind="co-simulation", solver=solver
    )
    assert run["x"] == pytest.approx(_stick_slip(run.time), abs=30 * tolerance)


PADS = """
[mechanism]
name = "pads"
[coordinates]
x = { unit = "m" }
y = { unit = "m" }
[gravity]
acceleration = 9.81
[bodies]
block = { mass = 1, position = ["x", "y"] }
[forces]
x = "2*t"
[contacts]
smooth = { gap = "y", slip = "x_dot", friction = 0.06 }
rough = { gap = "y", slip = "x_dot", friction = 0.6 }
"""


@pytest.mark.parametrize("solver", ["dopri5", "radau5"])
@pytest.mark.parametrize(("kind", "step"), [("co-simulation", 0.1), ("co-simulation", 0.02), ("model-exchange", 0.1)])
def test_two_pads_share_the_load_as_soon_as_they_slide(solver: str, kind: str, step: float) -> None:
    """The rough pad holds all that it can; the smooth one, which bore nothing at last, has its half of the slip."""
    begin = 0.6 * G / 2
    run = lag2fmu.simulate(
        read(PADS, "pads"), stop_time=4.0, step=step, tolerance=1e-9, outputs=["x_dot"], kind=kind, solver=solver
    )
    slides = run.time > begin
    speed = run.time**2 - begin**2 - 0.33 * G * (run.time - begin)
    assert run["x_dot"][slides] == pytest.approx(speed[slides], abs=1e-7)
    assert np.abs(run["x_dot"][~slides]).max() < 1e-10


def test_two_pads_share_the_load_in_the_judge() -> None:
    times = np.linspace(0.0, 4.0, 5)
    speeds = integrate(read(PADS, "pads"), times, rtol=1e-10).trajectory["x_dot"]
    assert speeds[3:] == pytest.approx(
        [9 - (0.3 * G) ** 2 - 0.33 * G * (3 - 0.3 * G), 16 - (0.3 * G) ** 2 - 0.33 * G * (4 - 0.3 * G)], abs=1e-7
    )


FEET = """
[mechanism]
name = "feet"
[coordinates]
x = { unit = "m", velocity = 2.0 }
y = { unit = "m", velocity = 1.0 }
z = { unit = "m" }
[gravity]
acceleration = 9.81
direction = [0, 0, -1]
[bodies]
sled = { mass = 1, position = ["x", "y", "z"] }
[contacts]
ice = { gap = "z", slip = ["x_dot", "y_dot"], friction = 0.1 }
wood = { gap = "z", slip = ["x_dot", "y_dot"], friction = 0.3 }
rubber = { gap = "z", slip = ["x_dot", "y_dot"], friction = 0.5 }
"""


@pytest.mark.parametrize("way", ["co-simulation", "model-exchange", "moreau", "judge"])
def test_feet_that_slide_share_the_load_in_equal_parts(way: str) -> None:
    """Their mean coefficient, 0.3, slows the sled down along its way."""
    mechanism, names, times = read(FEET, "feet"), ["x_dot", "y_dot"], np.linspace(0.0, 0.5, 6)
    if way == "judge":
        speeds = integrate(mechanism, times, rtol=1e-10).trajectory.columns(names)
    else:
        options = {"solver": "moreau"} if way == "moreau" else {"kind": way, "tolerance": 1e-9}
        speeds = lag2fmu.simulate(mechanism, stop_time=0.5, step=0.1, outputs=names, **options).columns(names)
    left = (np.sqrt(5.0) - 0.3 * G * times) / np.sqrt(5.0)
    assert speeds == pytest.approx(left[:, None] * [2.0, 1.0], abs=1e-8)


SLED = """
[mechanism]
name = "sled"
[coordinates]
x = { unit = "m", velocity = 1.0 }
y = { unit = "m" }
z = { unit = "m" }
psi = { unit = "rad", velocity = 3.0 }
roll = { unit = "rad" }
pitch = { unit = "rad" }
[gravity]
acceleration = 9.81
direction = [0, 0, -1]
[frames.deck]
origin = ["x", "y", "z"]
rotations = [["z", "psi"], ["x", "roll"], ["y", "pitch"]]
[bodies]
sled = { mass = 1, frame = "deck", center = [0, 0.09, 0], inertia = [10, 10, 10, 0, 0, 0] }
[points]
right = { frame = "deck", position = [1, 0, 0] }
left = { frame = "deck", position = [-1, 0, 0] }
front = { frame = "deck", position = [0, 0.1, 0] }
rear = { frame = "deck", position = [0, -0.1, 0] }
[contacts]
"""
RUNNERS = {"right": (1.0, 0.0), "left": (-1.0, 0.0), "front": (0.0, 0.1), "rear": (0.0, -0.1)}


def _spinning_sled(stop: float) -> np.ndarray:
    """Velocities (m/s, m/s, rad/s) of the deck: the front runner bears 0.9 of the weight, both sides what is left."""
    feet, loads = np.array([*RUNNERS.values()]), G * np.array([0.05, 0.05, 0.9, 0.0])

    def slope(_: float, at: np.ndarray) -> np.ndarray:
        turn = np.array([[np.cos(at[2]), -np.sin(at[2])], [np.sin(at[2]), np.cos(at[2])]])
        arms = (feet - [0.0, 0.09]) @ turn.T
        slips = at[3:5] + at[5] * np.stack([-arms[:, 1], arms[:, 0]], axis=1)
        forces = -0.1 * loads[:, None] * slips / np.linalg.norm(slips, axis=1)[:, None]
        torque = (arms[:, 0] * forces[:, 1] - arms[:, 1] * forces[:, 0]).sum()
        return np.array([*at[3:], *forces.sum(axis=0), torque / 10])

    start = [0.0, 0.0, 0.0, 1.0 - 3.0 * 0.09, 0.0, 3.0]
    turned, vx, vy, spin = solve_ivp(slope, (0.0, stop), start, rtol=1e-11, atol=1e-12).y[2:, -1]
    return np.array([vx + 0.09 * spin * np.cos(turned), vy + 0.09 * spin * np.sin(turned), spin])


@pytest.mark.parametrize("way", ["co-simulation", "model-exchange", "moreau", "judge"])
def test_a_foot_that_would_pull_bears_nothing(way: str) -> None:
    """By least norm the rear runner of a sled that slides would pull: its mass centre is near the front one."""
    runners = "".join(
        f'{name} = {{ kind = "point_plane", between = ["{name}", "world"], normal = "z", friction = 0.1 }}\n'
        for name in RUNNERS
    )
    mechanism, names = read(SLED + runners, "sled"), ["x_dot", "y_dot", "psi_dot", "front_force", "rear_force"]
    if way == "judge":
        found = integrate(mechanism, np.linspace(0.0, 0.3, 4), rtol=1e-10).trajectory.columns(names)
    else:
        options = {"solver": "moreau"} if way == "moreau" else {"kind": way, "tolerance": 1e-9}
        found = lag2fmu.simulate(mechanism, stop_time=0.3, step=0.1, outputs=names, **options).columns(names)
    assert found[-1, :3] == pytest.approx(_spinning_sled(0.3), abs=3e-4 if way == "moreau" else 1e-8)
    assert found[:, 3:] == pytest.approx(np.tile([0.9 * G, 0.0], (4, 1)), abs=1e-7)
