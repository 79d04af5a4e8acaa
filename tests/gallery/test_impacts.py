"""Impacts: balls, pendulums, a block and an oscillator against closed forms (g = 9.81)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Model
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ellipj, ellipk
from stepping import Stepping

import lag2fmu
from lag2fmu.errors import SimulationError
from lag2fmu.formats.loading import load
from lag2fmu.formats.text import read
from lag2fmu.verify.located import located
from lag2fmu.verify.run import Run

pytestmark = pytest.mark.fmu

G = 9.81
OPEN, STICKS, SLIDES = 1, 2, 3


# ------------------------------------------------------------------------------------------------- bouncing ball


def ball(t: float, h: float = 1.0, e: float = 0.8) -> float:
    """The height: arcs between the impacts, at rest from t1 (1 + e)/(1 - e) on."""
    t1 = np.sqrt(2 * h / G)
    if t < t1:
        return h - G * t**2 / 2
    if t >= t1 * (1 + e) / (1 - e):
        return 0.0
    start, part = t1, e
    while t >= start + 2 * part * t1:
        start, part = start + 2 * part * t1, part * e
    return part * G * t1 * (t - start) - G * (t - start) ** 2 / 2


@pytest.mark.parametrize("steps", [50, 500, 5000])
def test_a_ball_bounces_and_rests(steps: int, motion) -> None:
    """Whatever the communication step; at rest the floor bears the weight, and nothing creeps."""
    run = motion("bouncing_ball", 5.0, steps, 1e-9, ("y", "y_dot", "floor_force", "floor_mode", "floor_impulse"))
    assert run["y"] == pytest.approx([ball(t) for t in run.time], abs=1e-8)
    rest = run.time > 4.063712768871579
    assert (run["floor_mode"] == np.where(rest, SLIDES, OPEN)).all()
    assert run["floor_force"] == pytest.approx(np.where(rest, 0.5 * G, 0.0), abs=1e-9)
    assert (run["y_dot"][rest] == 0.0).all()
    assert np.ptp(run["y"][rest]) == 0.0


@pytest.mark.parametrize(("time", "impacts"), [(0.451523640985731, 1), (3.578892951020439, 10)], ids=["first", "tenth"])
def test_impacts_are_located(time: float, impacts: int, motion) -> None:
    for moved, expected in ((-1e-9, impacts - 1), (1e-9, impacts)):
        run = motion("bouncing_ball", time + moved, 1, 1e-9, ("floor_impacts",))
        assert run["floor_impacts"][-1] == expected


# ------------------------------------------------------------------------------------------------- Newton's cradle


def swing(t: np.ndarray, start: float, frequency: float) -> np.ndarray:
    """A pendulum let go at the angle ``start`` > 0, by Jacobi's elliptic functions (Landau, Lifshitz, section 11)."""
    k = np.sin(start / 2)
    return 2 * np.arcsin(k * ellipj(ellipk(k**2) - frequency * t, k**2)[0])


def test_a_cradle_passes_the_motion_on(motion) -> None:
    """One ball swings out on the left, then one on the right, as if there were a single pendulum."""
    run = motion("newtons_cradle", 3.0, 100)
    alone = -swing(run.time, 0.6, np.sqrt(G / 0.3))
    assert run["a"] == pytest.approx(np.minimum(alone, 0.0), abs=1e-7)
    assert run["b"] == pytest.approx(np.zeros(101), abs=1e-7)
    assert run["c"] == pytest.approx(np.maximum(alone, 0.0), abs=1e-7)


def test_a_cradle_whose_impacts_are_simultaneous(exported) -> None:
    """Moreau's law for all that touch at once: the velocities after it are -1/3, 2/3, 2/3 of that of the first ball."""
    cradle = exported(replace(load("newtons_cradle"), impacts="simultaneous"))
    frequency = np.sqrt(G / 0.3)
    strike = ellipk(np.sin(0.3) ** 2) / frequency
    run = lag2fmu.simulate(cradle, stop_time=strike + 1e-6, step=strike + 1e-6, tolerance=1e-10)
    speed = 2 * frequency * np.sin(0.3)
    after = [run[f"{name}_dot"][-1] / speed for name in "abc"]
    assert after == pytest.approx([-1 / 3, 2 / 3, 2 / 3], abs=1e-7)


@pytest.mark.parametrize("step", [0.002, 0.04])
def test_the_motion_ends_where_a_contact_loses_its_lever(exported, step: float) -> None:
    """The first ball pushes the second one up to where both strings are level; there the force has no bound."""
    with Stepping(exported("newtons_cradle").path) as s:
        s.start({"solver_tolerance": 1e-10})
        s.set({"Q_a": 100.0})
        (energy,) = s.get(["total_energy"])
        with pytest.raises(FMICallException, match="discard"):
            s.steps(round(0.04 / step), step)
        (_, _, sentence), *_ = s.log
        assert "left: gap or force grows beyond all bounds or turns ever faster" in sentence
        assert s.get(["a", "b"]) == pytest.approx([np.pi / 2, np.pi / 2], abs=1e-5)
        a, a_dot, b_dot, after = s.get(["a", "a_dot", "b_dot", "total_energy"])
        assert a_dot == pytest.approx(b_dot, rel=1e-7)
        assert after - energy == pytest.approx(100.0 * (a + 0.6), rel=1e-9)


# ------------------------------------------------------------------------------------------------- rocking block


def test_a_block_rocks_and_loses_energy_as_housner_says(motion) -> None:
    """The angle is greatest a quarter of a swing after each impact; cos(alpha - theta) tells the energy there."""
    b, h = 0.1, 0.4
    alpha, p2 = np.arctan(b / h), 3 * G / (4 * np.hypot(b, h))
    kept = (1 - 1.5 * np.sin(alpha) ** 2) ** 2

    def quarter(top: float) -> float:
        """From theta = top to 0: theta = top (1 - u^2) takes the root at the top away."""

        def rate(u: float) -> float:
            theta = top * (1 - u**2)
            return 2 * top * u / np.sqrt(2 * p2 * (np.cos(alpha - top) - np.cos(alpha - theta)))

        return quad(rate, 0.0, 1.0, epsabs=1e-13, epsrel=1e-13)[0]

    tops = [0.15]
    for _ in range(3):
        tops.append(alpha - np.arccos(np.cos(alpha) + kept * (np.cos(alpha - tops[-1]) - np.cos(alpha))))
    time = 0.0
    for number, (before, top) in enumerate(pairwise(tops), start=1):
        time += quarter(before) + quarter(top)
        run = motion("rocking_block", time, 1, 1e-10, ("theta", "theta_dot"))
        assert run["theta"][-1] == pytest.approx((-1) ** number * top, abs=1e-7)
        assert run["theta_dot"][-1] == pytest.approx(0.0, abs=1e-6)


def test_edges_that_lift_each_other_come_to_rest(motion) -> None:
    """A plate upside down: rebounds become less than rounding of its height, and then there are none. About 1 ms."""
    outputs = ("A_impacts", "A_mode", "B_mode", "y", "theta", "dissipated_energy")
    run = motion("rocking_block", 3.0, 1, 1e-6, outputs, theta=3.0, h=0.1, mu=3.0)
    assert run["A_impacts"][-1] < 20
    assert run["A_mode"][-1] == run["B_mode"][-1] == STICKS
    heights = run["y"] + 0.1 * np.sin(run["theta"]) + 0.1 * np.cos(run["theta"])
    assert run["dissipated_energy"][-1] == pytest.approx(10.0 * G * (heights[0] - heights[-1]), abs=1e-6)


# ------------------------------------------------------------------------------------------------- impact oscillator


def test_an_oscillator_strikes_once_a_period(motion) -> None:
    """Phase and speed of the impacts follow from x and its velocity being periodic up to the factor -e."""
    Omega, e, w = 2.2, 0.8, 1.0
    period, a = 2 * np.pi / Omega, 1 / (1 - Omega**2)
    S, C = np.sin(w * period), np.cos(w * period)
    speed = abs(a) / np.hypot((1 - e) / (2 * Omega), (1 + e) * S / (2 * w * (1 - C)))
    b, c = -speed * (1 + e) * S / (2 * w * (1 - C)), -speed * (1 + e) / (2 * w)
    phase = np.arctan2(-speed * (1 - e) / (2 * a * Omega), -b / a)
    strike = phase % (2 * np.pi) / Omega

    def position(t: np.ndarray) -> np.ndarray:
        since = (t - strike) % period
        return a * np.cos(Omega * t) + b * np.cos(w * since) + c * np.sin(w * since)

    since = -strike % period
    velocity = -b * w * np.sin(w * since) + c * w * np.cos(w * since)
    run = motion("impact_oscillator", 10 * period, 101, 1e-10, x=float(position(np.array(0.0))), x_dot=float(velocity))
    assert run["x"] == pytest.approx(position(run.time), abs=1e-7)


# ------------------------------------------------------------------------------------------------- pendulum and stop


def test_a_pendulum_strikes_a_wall(motion) -> None:
    """sin(theta_max/2) falls by e at each impact; at the turning points the run meets the angle, at rest."""
    time, top, quarter = 0.0, 2.0, lambda top: ellipk(np.sin(top / 2) ** 2) / np.sqrt(G)
    for _ in range(3):
        after = 2 * np.arcsin(0.7 * np.sin(top / 2))
        time += quarter(top) + quarter(after)
        run = motion("pendulum_with_stop", time, 3)
        assert (run["theta"][-1], run["theta_dot"][-1]) == pytest.approx((after, 0.0), abs=1e-7)
        top = after


# ------------------------------------------------------------------------------------------------- backlash


def next_zero(function: Callable[[np.ndarray], np.ndarray], stop: float) -> float:
    """Where ``function`` of the time comes down to 0 after it was positive; ``stop`` if it does not before."""
    fine = np.linspace(0.0, stop, 2 + int(stop / 1e-5))
    values = function(fine)
    first = np.argmax(values > 1e-12)
    down = first + np.argmax(values[first:] <= 0.0)
    if values[down] > 0.0:
        return stop
    return brentq(function, fine[down - 1], fine[down], xtol=1e-15)


PLAY = 0.002


def joint(t: np.ndarray) -> np.ndarray:
    """Position, velocity and acceleration of the rod's end, (3, times)."""
    l1, l2, w = 0.05, 0.12, 10.0
    c, s = np.cos(w * t), np.sin(w * t)
    rod = np.sqrt(l2**2 - (l1 * s) ** 2)
    rate = -(l1**2) * w * s * c / rod
    second = -((l1 * w) ** 2 * (c**2 - s**2) + rate**2) / rod
    return np.array([l1 * c + rod, -l1 * w * s + rate, -l1 * w**2 * c + second])


def slider(times: np.ndarray) -> np.ndarray:
    """A mass between the sides of a joint, which push it as long as they accelerate it, and else let it fly on."""
    found, start, x, v, side = np.empty(len(times)), 0.0, joint(0.0)[0], 0.0, 0.0
    while start < times[-1]:
        gap = lambda t, start=start, x=x, v=v: PLAY - abs(x + v * t - joint(start + t)[0])  # noqa: E731
        push = lambda t, start=start, side=side: -side * joint(start + t)[2]  # noqa: E731
        length = next_zero(push if side else gap, times[-1] - start + 1e-3)
        later = times[times >= start]
        found[times >= start] = joint(later)[0] + side * PLAY if side else x + v * (later - start)
        at, moved = start + length, x + v * length
        end, speed, acceleration = joint(at)
        touched = side or np.sign(moved - end)
        start, x, v = at, end + touched * PLAY, speed
        side = 0.0 if side or touched * acceleration >= 0 else touched
    return found


def test_a_slider_with_backlash_is_pushed_and_flies(motion) -> None:
    """Without rebound: each side takes the slider along as long as it accelerates it."""
    run = motion("backlash_slider_crank", 1.0, 500, outputs=("x", "play_lower_impacts", "play_upper_impacts"), e=0.0)
    assert run["play_lower_impacts"][-1] + run["play_upper_impacts"][-1] >= 3
    assert run["x"] == pytest.approx(slider(run.time), abs=1e-7)


# ------------------------------------------------------------------------------------------------- hopping leg


BODY, FOOT, STIFFNESS, LENGTH = 8.0, 0.5, 4000.0, 0.5


def standing(y: float, v: float, t: np.ndarray) -> np.ndarray:
    """The heights and velocities of body and foot, (y, v, z, v_z), over the foot on the ground."""
    w, middle = np.sqrt(STIFFNESS / BODY), LENGTH - BODY * G / STIFFNESS
    c, s = np.cos(w * t), np.sin(w * t)
    return np.array([middle + (y - middle) * c + v / w * s, v * c - (y - middle) * w * s, 0 * t, 0 * t])


def flying(y: float, v: float, t: np.ndarray) -> np.ndarray:
    """The same in the air, where they swing about their centre of mass; the foot starts at rest on the ground."""
    w, share = np.sqrt(STIFFNESS * (1 / BODY + 1 / FOOT)), FOOT / (BODY + FOOT)
    c, s, u = np.cos(w * t), np.sin(w * t), y - LENGTH
    length, rate = LENGTH + u * c + v / w * s, v * c - u * w * s
    height, rise = (1 - share) * y + (1 - share) * v * t - G * t**2 / 2, (1 - share) * v - G * t
    high, up = height + share * length, rise + share * rate
    return np.array([high, up, high - length, up - rate])


def hopping(times: np.ndarray) -> np.ndarray:
    """The body's height, phase after phase: the foot is lifted when the spring pulls more than it weighs."""
    found, start, y, v = np.empty(len(times)), 0.0, 0.4, 0.0
    lifted = LENGTH + FOOT * G / STIFFNESS
    stands = True
    while start < times[-1]:
        phase = standing if stands else flying
        end = (
            (lambda t, y=y, v=v: lifted - standing(y, v, t)[0]) if stands else (lambda t, y=y, v=v: flying(y, v, t)[2])
        )
        length = next_zero(end, times[-1] - start + 1e-3)
        found[times >= start] = phase(y, v, times[times >= start] - start)[0]
        start, (y, v, *_) = start + length, phase(y, v, length)
        stands = not stands and y < lifted
    return found


def test_a_leg_hops(motion) -> None:
    run = motion("hopper_leg", 1.0, 50, outputs=("y", "ground_impacts"))
    assert run["ground_impacts"][-1] >= 2
    assert run["y"] == pytest.approx(hopping(run.time), abs=1e-6)


@pytest.mark.parametrize("foot", [0.3, 1.0, 1.8])
def test_stiff_legs_leave_the_ground(foot: float, motion) -> None:
    """The force of the ground comes down to 0 amid its rounding, which is great beside its nominal value of 1 N.

    From there on the centre of mass flies. 0.1 s for 60 runs.
    """
    for stiffness in np.geomspace(1e4, 1e6, 20):
        w, sunk = np.sqrt(stiffness / BODY), (BODY + foot) * G / stiffness
        start = LENGTH - BODY * G / stiffness - 1.5 * sunk
        lift = np.arccos(-1 / 1.5) / w
        height, speed = LENGTH + foot * G / stiffness, 1.5 * sunk * w * np.sin(w * lift)
        values = {"k": stiffness, "m": foot, "y": start}
        run = motion("hopper_leg", 1.001 * lift, 1, outputs=("y", "z", "ground_mode"), **values)
        t = 0.001 * lift
        centre = (BODY * run["y"][-1] + foot * run["z"][-1]) / (BODY + foot)
        assert run["ground_mode"][-1] == OPEN
        assert centre == pytest.approx(BODY * (height + speed * t) / (BODY + foot) - G * t**2 / 2, abs=1e-10)


@pytest.mark.parametrize("restitution", [-0.1, 1.25, 2.0])
def test_a_restitution_without_meaning_is_refused(restitution: float, motion) -> None:
    """The reason is told, too, where the FMU is taken up again after another one was loaded."""
    motion("bouncing_ball", 1.0)
    motion("hopper_leg", 0.1)
    with pytest.raises(SimulationError, match=rf"restitution of floor is {restitution:g}; expected 0 to 1"):
        motion("bouncing_ball", 1.0, e=restitution)


# ---------------------------------------------------------------------------------------------- model exchange


CONTACTS = {
    "newtons_cradle": ["left", "right"],
    "impact_oscillator": ["wall_upper"],
    "rocking_block": ["A", "B"],
    "woodpecker": ["beak", "bottom", "top"],
}


@pytest.mark.slow
@pytest.mark.parametrize("model", CONTACTS)
def test_cvode_sees_each_impact_once(model: str, exported, monkeypatch: pytest.MonkeyPatch) -> None:
    """As many as in co-simulation, and no two events at one time, though CVode finds them a little inside."""
    times, enter, set_time = [0.0], FMU2Model.enterEventMode, FMU2Model.setTime
    events: list[float] = []
    monkeypatch.setattr(FMU2Model, "setTime", lambda unit, t: (times.append(t), set_time(unit, t)))
    monkeypatch.setattr(FMU2Model, "enterEventMode", lambda unit: (events.append(times[-1]), enter(unit)))
    path, outputs = exported(model).path, [f"{name}_impacts" for name in CONTACTS[model]]
    inside, outside = (
        lag2fmu.simulate(path, tolerance=1e-9, outputs=outputs, kind=kind)
        for kind in ("co-simulation", "model-exchange")
    )
    assert outside.values[-1].tolist() == inside.values[-1].tolist()
    assert inside.values[-1].max() > 0
    assert np.diff(events).min() > 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-9])
def test_cvode_sees_the_end_of_a_contact_once(tolerance: float, exported, monkeypatch: pytest.MonkeyPatch) -> None:
    """A slider that leaves the side of its play touches it for a time in the errors of CVode: no event comes of it."""
    events: list[FMU2Model] = []
    enter = FMU2Model.enterEventMode
    monkeypatch.setattr(FMU2Model, "enterEventMode", lambda unit: (events.append(unit), enter(unit)))
    outputs = ["play_lower_impacts", "play_upper_impacts"]
    path = exported("backlash_slider_crank").path
    run = lag2fmu.simulate(path, tolerance=tolerance, outputs=outputs, kind="model-exchange")
    assert run.values[-1].tolist() == [3.0, 3.0]
    assert len(events) <= 16, "of 6 impacts and 5 ends of contact; a force may come to 0 a second time"


def test_edges_that_lift_each_other_gain_no_height_in_model_exchange(exported) -> None:
    """An edge that the other one's impact lifts lands where it touches, not a tolerance below. About 0.7 s."""
    outputs = ["total_energy", "dissipated_energy", "A_impacts", "A_gap", "B_gap"]
    path = exported("rocking_block").path
    run = lag2fmu.simulate(path, stop_time=3.0, tolerance=1e-9, outputs=outputs, kind="model-exchange")
    energy = run["total_energy"] + run["dissipated_energy"]
    assert run["A_impacts"][-1] >= 2
    assert np.ptp(energy) < 3e-7 * energy[0]
    assert min(run["A_gap"].min(), run["B_gap"].min()) > -1e-8


TEETH = """
[mechanism]
name = "teeth"
[coordinates]
a = { unit = "rad" }
b = { unit = "rad" }
[bodies]
pinion = { mass = 1, inertia = 0.1, position = [0, 0], angle = "a" }
wheel = { mass = 1, inertia = 1, position = [1, 0], angle = "b" }
[forces]
a = "2*sin(3*t)"
b = "-0.3*b_dot"
[stops.teeth]
of = "a - 3*b"
lower = -0.02
upper = 0.02
restitution = 0.6
"""


def test_teeth_that_have_parted_rebound_no_higher_in_model_exchange(exported) -> None:
    """After they part, the first impact is found a tolerance inside, the next ones are not. About 1 s."""
    fmu = exported(read(TEETH, "teeth"))
    outputs = ["a", "teeth_lower_impacts", "teeth_upper_impacts", "teeth_upper_mode"]
    inside, outside = (
        lag2fmu.simulate(fmu, stop_time=3.0, step=0.5, tolerance=1e-9, outputs=outputs, kind=kind)
        for kind in ("co-simulation", "model-exchange")
    )
    assert inside["teeth_upper_mode"][-1] == outside["teeth_upper_mode"][-1] == 3, "the rebounds have ended"
    assert outside["a"] == pytest.approx(inside["a"], abs=1e-5)
    assert outside.values[-1, 1:3].max() < 50, "CVode counts fewer of the last, low ones than co-simulation does"


def test_impacts_are_when_gaps_were_0_in_model_exchange(exported) -> None:
    """An importer finds each impact 1e-9 m inside. 39 of them lifted the ball by 2e-8 m. About 1 s."""
    run = lag2fmu.simulate(
        exported("bouncing_ball"), stop_time=4.05, step=0.05, tolerance=1e-12, outputs=["y"], kind="model-exchange"
    )
    assert run["y"][-1] == pytest.approx(ball(4.05), abs=5e-10)


YO_YO = """
[mechanism]
name = "yo_yo"
[coordinates]
y = { unit = "m" }
phi = { unit = "rad", start = -10 }
[gravity]
acceleration = 9.81
direction = [0, 1]
[bodies.wheel]
mass = 0.1
inertia = 4.5e-5
position = [0, "y"]
angle = "phi"
[contacts]
winds = { gap = "0.05 + 0.005*phi - y" }
unwinds = { gap = "0.05 - 0.005*phi - y" }
"""


def test_a_yo_yo_comes_to_rest_in_model_exchange(exported) -> None:
    """Each time the string is unwound k = 17/19 of the speed is left: rest at t1 (1 + k)/(1 - k) = 18 t1 = 7.92 s.

    The string's two sides lift each other, 5e-9 m for ever, and CVode made 20 000 steps for it. About 0.5 s.
    """
    run = lag2fmu.simulate(
        exported(read(YO_YO, "yo_yo")), stop_time=9, step=0.5, tolerance=1e-8, outputs=["phi"], kind="model-exchange"
    )
    t1 = np.sqrt(2 * 0.05 * 19 / G)
    assert 18 * t1 == pytest.approx(7.92, abs=0.005)
    assert abs(run["phi"][run.time < 7.9][-1]) > 1e-5
    assert abs(run["phi"][-1]) < 1e-12


ROPE = """
[mechanism]
name = "rope"
[coordinates]
a = { unit = "m", start = 1 }
b = { unit = "m" }
[gravity]
acceleration = 9.81
[bodies]
heavy = { mass = 3, position = [0, "a"] }
light = { mass = 2, position = [1, "b"] }
[stops.rope]
of = "a + b"
lower = 1
[contacts.floor]
gap = "a"
"""


def test_a_rope_and_a_floor_that_jerk_in_turn_come_to_rest_in_model_exchange(exported) -> None:
    """The heavy body of Atwood's machine lands, and the light one falls back into the rope and lifts it again.

    v, the speed of the first landing, falls by 2/5 each time: fall 2 v/g, lift 2 v (2/5)/(g/5). About 0.5 s.
    """
    fmu = exported(read(ROPE, "rope"))
    first = np.sqrt(2 / (9.81 / 5))
    rest = first + (2 * first / 5 + 4 * first / 5) / (1 - 2 / 5)
    outputs = ["floor_mode", "rope_lower_mode", "floor_impacts", "rope_lower_force"]
    for kind in ("co-simulation", "model-exchange"):
        run = lag2fmu.simulate(fmu, stop_time=3.5, step=0.01, tolerance=1e-9, outputs=outputs, kind=kind)
        moving = (run["floor_mode"] == 1) | (run["rope_lower_mode"] == 1)
        assert run.time[moving][-1] == pytest.approx(rest, abs=0.011)
        assert run["floor_impacts"][-1] < 30
        assert run["rope_lower_force"][-1] == pytest.approx(2 * 9.81)


SHAKEN = """
[mechanism]
name = "shaken"
[coordinates]
y = { unit = "m" }
[gravity]
acceleration = 2
[bodies]
ball = { mass = 1, position = [0, "y"] }
[forces]
y = "3*sin(5*t)"
[contacts.floor]
gap = "y"
restitution = 0.3
"""


def test_a_gap_closes_at_0_wherever_it_opened_and_steps_end(exported) -> None:
    """A force that ends in rounding opens the gap; steps are halved towards each impact that follows. About 1 s."""
    run = Run(stop_time=4, step=0.01, tolerance=1e-8, outputs=["y", "floor_impacts"])
    found = located(exported(read(SHAKEN, "shaken")).path, run, ["floor_impacts"], ())
    assert found["floor_impacts"][-1] > 10
    assert found["y"].min() > -1e-12
