"""Contacts, impacts, dry friction, conditions and switches on the independent path, against closed forms; g = 9.81."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from lag2fmu.errors import SimulationError
from lag2fmu.formats.loading import load
from lag2fmu.formats.text import read
from lag2fmu.language.vocabulary import TIME, Choice, symbol
from lag2fmu.mechanism import (
    Body,
    Constraint,
    Contact,
    Energy,
    Force,
    Friction,
    Mechanism,
    Stop,
    coordinate,
    parameter,
    signal,
)
from lag2fmu.reference import integrate, remedy_of_jumps
from lag2fmu.reference.hybrid.following import Follower
from lag2fmu.reference.hybrid.impacts import all_outcomes
from lag2fmu.reference.hybrid.laws import PLANES, Item
from lag2fmu.reference.hybrid.limits import Limits, nearest
from lag2fmu.reference.hybrid.modes import Mode
from lag2fmu.reference.hybrid.run import HybridRun, Track, started
from lag2fmu.reference.hybrid.search import decided
from lag2fmu.reference.hybrid.system import HybridSystem
from lag2fmu.reference.hybrid.timed import first_descent
from lag2fmu.reference.signals import signals_of
from tests.reference import hybrid_mechanisms as known

pytestmark = pytest.mark.long

G = 9.81


def run(mechanism: Mechanism, end: float, inputs: object = None) -> Track:
    """One run to ``end`` (s), without the further ones that ``integrate`` makes to know its errors."""
    times = np.array([0.0, end])
    problem = HybridRun(HybridSystem(mechanism), signals_of(mechanism, inputs, 0.0), times)
    return Follower(problem, "DOP853", 1e-12, 500_000).follow(started(problem, {}))


def times_of(track: Track, kind: str) -> list[float]:
    return [event.time for event in track.events if event.kind == kind]


def test_bouncing_ball_comes_to_rest() -> None:
    """Impacts every 2 v e^k / g; at rest at t1 (1 + e)/(1 - e)."""
    reference = integrate(known.ball(), np.linspace(0, 5, 51))
    impacts = [event.time for event in reference.events if event.kind == "impact"]
    assert impacts[0] == pytest.approx(0.451523640985731, abs=1e-12)
    assert impacts[9] == pytest.approx(3.578892951020439, abs=1e-11)
    assert reference.events[-1].kind == "closes"
    assert reference.events[-1].time == pytest.approx(4.063712768871579, abs=1e-10)
    columns = reference.trajectory
    assert columns["y"][-1] == pytest.approx(0, abs=1e-15)
    assert columns["floor_force"][-1] == pytest.approx(G, rel=1e-13)
    assert columns["floor_impulse"][10] == pytest.approx(1.8 * np.sqrt(2 * G), rel=1e-12)
    assert columns["floor_mode"][[0, -1]].tolist() == [Mode.OPEN, Mode.SLIDES]
    assert columns["dissipated_energy"][-1] == pytest.approx(G, rel=1e-10)
    assert columns["floor_gap"].min() > -1e-12
    assert np.abs(reference.balance).max() < 1e-9
    assert reference.relative_error.max() < 1e-9


@pytest.mark.parametrize(
    ("impacts", "velocities"), [("sequential", [0, 0, 1]), ("simultaneous", [-1 / 3, 2 / 3, 2 / 3])]
)
def test_newtons_cradle(impacts: str, velocities: list[float]) -> None:
    track = run(known.cradle(impacts), 2.0)
    assert track.values[-1, 3:6] == pytest.approx(velocities, abs=1e-14)
    assert track.values[-1, 7] == pytest.approx(0, abs=1e-14)  # nothing is dissipated


def test_upper_one_of_two_balls_leaves_faster() -> None:
    """2.6 v at a ratio of masses of 9; the floor first, then the balls."""
    track, v = run(known.two_balls(), 0.5), np.sqrt(2 * G)
    assert track.values[-1, 3] + G * (0.5 - v / G) == pytest.approx(2.6 * v, rel=1e-13)
    assert [event.element for event in track.events] == ["floor", "balls"]


def test_number_of_impacts_gives_digits_of_pi() -> None:
    """G. Galperin, Playing pool with pi, Regular and Chaotic Dynamics 8 (2003): 31 at a ratio of masses of 100."""
    track = run(known.blocks_and_wall(100), 20.0)
    assert len(times_of(track, "impact")) == 31
    assert track.values[-1, 5] == pytest.approx(0, abs=1e-11)


def test_coulomb_oscillator() -> None:
    """Amplitudes fall by 2 F/k every half turn; at rest at x = 0.2 after four turns."""
    track = run(known.coulomb_oscillator(), 30.0)
    assert track.values[-1, 0] == pytest.approx(0.2, abs=1e-11)
    assert track.events[-1].time == pytest.approx(8 * np.pi, abs=1e-9)
    assert track.values[-1, 3] == pytest.approx((25 - 0.04) / 2, rel=1e-11)


@pytest.mark.parametrize("start", [-0.35, 0.35])
@pytest.mark.parametrize("element", ["frictions", "contacts"])
def test_static_friction_holds_what_rests_at_the_start(element: str, start: float) -> None:
    """A spring pulls with 0.35 N, more than the sliding force of 0.3 N and less than 0.4 N, which hold."""
    text = f"""
        [mechanism]
        name = "held"
        [coordinates]
        x = {{ unit = "m", start = {start} }}
        y = {{ unit = "m" }}
        [energy]
        kinetic = "(x_dot**2 + y_dot**2)/2"
        potential = "x**2/2 + y"
    """
    rows = {
        "frictions": "[frictions.guide]\non = 'x_dot'\nforce = 0.3\nstatic = 0.4\n[contacts.floor]\ngap = 'y'",
        "contacts": "[contacts.floor]\ngap = 'y'\nslip = 'x_dot'\nfriction = 0.3\nstatic_friction = 0.4",
    }
    assert run(read(text + rows[element], "held"), 1.0).values[-1, 0] == pytest.approx(start, abs=1e-12)


PARALLEL = {
    "frictions": """
[frictions]
guide = { on = "x_dot", force = 2, static = 2.5 }
seal = { on = "x_dot", force = 1 }
""",
    "contact": """
[contacts]
floor = { gap = "y", slip = "x_dot", friction = 0.2, static_friction = 0.25 }
[frictions]
guide = { on = "-x_dot", force = 1.038, static = 1.0475 }
""",
    "stop": """
[frictions]
guide = { on = "x_dot", force = 3, static = 3.5 }
[stops]
wall = { of = "x", lower = 0 }
""",
}
"""Elements along one slip that hold 3.5 N together and rub with 3 N."""


@pytest.mark.parametrize("elements", PARALLEL)
def test_elements_along_one_slip_rest_and_slide_together(elements: str) -> None:
    """A force of 5 t, behind 1 s of 2.4 N, and behind 2 s of 12.4 N - 5 t.

    v' = 5 t - 3 from 0.7 s on, and then -0.6 until rest. One of two frictions slid on at rest with its whole force, so
    that the other one let go soon after the force turned.
    """
    head = "[mechanism]\nname = 'block'\n[coordinates]\nx = {}\ny = {}\n[energy]\n"
    head += "kinetic = '(x_dot**2 + y_dot**2)/2'\n"
    body = "potential = '9.81*y'\n[forces]\nx = 'if(t < 1, 5*t, if(t < 2, 2.4, 12.4 - 5*t))'\n"
    track = run(read(head + body + PARALLEL[elements], "parallel"), 3.3)
    count = 1 + (elements != "stop")
    assert times_of(track, "slides") == pytest.approx([*[0.7] * count, *[3.18] * count], abs=1e-10)
    assert times_of(track, "sticks") == pytest.approx([1.625] * count, abs=1e-10)


def test_errors_of_a_step_are_no_slip() -> None:
    """A load of 1.2 N is held by 1.4 N, whatever the last step leaves of a slip that has come to zero."""
    text = """
        [mechanism]
        name = "stopped"
        [coordinates]
        x = {}
        [energy]
        kinetic = "x_dot**2/2"
        [forces]
        x = "-1.2"
        [frictions]
        guide = { on = "x_dot", force = 1, static = 1.4 }
    """
    mechanism = read(text, "stopped")
    problem = HybridRun(HybridSystem(mechanism), signals_of(mechanism, None, 0.0), np.array([0.0, 1.0]))
    slides = replace(problem.started(np.zeros(2)), frictions=(Mode.FORWARD,))
    settling = Follower(problem, "DOP853", 1e-12, 500_000).settling
    state, modes, _ = settling.settled(problem.state(0.0, np.array([0.0, -1e-7])), slides, frozenset({("friction", 0)}))
    assert modes.frictions == (Mode.STICKS,)
    assert state.qd == pytest.approx([0], abs=1e-15)


def test_a_contact_whose_force_came_to_zero_opens_at_once() -> None:
    """The force m g - 9.81 t of a lifted ball is 1e-11 N where its zero at 1 s was located: it is due to open."""
    text = """
        [mechanism]
        name = "lifted"
        [coordinates]
        y = { }
        [energy]
        kinetic = "y_dot**2/2"
        potential = "9.81*y"
        [forces]
        y = "9.81*t"
        [contacts]
        floor = { gap = "y", restitution = 0 }
    """
    mechanism = read(text, "lifted")
    problem = HybridRun(HybridSystem(mechanism), signals_of(mechanism, None, 0.0), np.array([0.0, 2.0]))
    lies = replace(problem.started(np.zeros(2)), contacts=(Mode.SLIDES,))
    settling = Follower(problem, "DOP853", 1e-12, 500_000).settling
    _, modes, _ = settling.settled(problem.state(1.0 - 1e-12, np.zeros(2)), lies, frozenset({("force", 0)}))
    assert modes.contacts == (Mode.OPEN,)


LIMITED = """
[mechanism]
name = "limited"
[coordinates]
x = { start = 0 }
y = { start = 0 }
[bodies]
slide = { mass = 1, position = ["x", 0] }
block = { mass = 1, position = [0, "y"] }
[forces]
x = "-5"
y = "4*t"
[frictions]
guide = { on = "x_dot", force = 2 }
floor = { on = "y_dot", force = 1 }
[stops]
end = { of = "x", lower = 0 }
"""


def test_a_friction_that_gives_way_leaves_a_stop_with_friction_as_it_is() -> None:
    """The slide is pressed onto its stop, whose force and its friction share the load, while the block breaks away."""
    run = integrate(read(LIMITED, "limited"), np.linspace(0, 1, 11)).trajectory
    assert run["y"][-1] == pytest.approx(4 * 0.75**3 / 6, rel=1e-9)
    assert run["x"] == pytest.approx(0, abs=1e-12)


def test_a_rebound_has_the_friction_of_its_own_velocity() -> None:
    """Friction falls with the speed as exp(-|v|/0.05): by the other sign of v it would hold the slide at once."""
    text = """
    mechanism = { name = "rising" }
    coordinates.y = { start = 1 }
    bodies.slide = { mass = 1, position = [0, "y"] }
    gravity = { acceleration = 9.81 }
    frictions.guide = { on = "y_dot", force = "1 + exp(-abs(y_dot)/0.05)" }
    stops.floor = { of = "y", lower = 0, restitution = 0.6 }
    """

    def slope(t: float, z: list[float]) -> list[float]:
        return [z[1], -9.81 - np.sign(z[1]) * (1 + np.exp(-abs(z[1]) / 0.05))]

    def bottom(t: float, z: list[float]) -> float:
        return z[0]

    bottom.terminal = True  # type: ignore[attr-defined]
    fall = solve_ivp(slope, (0, 1), [1, -1e-300], rtol=1e-11, atol=1e-12, events=bottom)
    run = integrate(read(text, "rising"), np.array([0.0, fall.t[-1] + 0.1])).trajectory
    rise = solve_ivp(slope, (0, 0.1), [0, -0.6 * fall.y[1, -1]], rtol=1e-11, atol=1e-12)
    assert run["y"][-1] == pytest.approx(rise.y[0, -1], rel=1e-8)


def test_an_impact_brings_a_slip_to_rest() -> None:
    """A block falls on the floor, whose friction in the impact stops it: 1.5 N are held by 2 N, although 1 N rub."""
    text = """
        [mechanism]
        name = "fallen"
        [coordinates]
        x = { velocity = 0.1 }
        y = { start = 0.1, velocity = -2 }
        [energy]
        kinetic = "(x_dot**2 + y_dot**2)/2"
        potential = "y"
        [forces]
        x = "1.5"
        [frictions]
        guide = { on = "x_dot", force = 0.6, static = 1.2 }
        [contacts]
        floor = { gap = "y", slip = "x_dot", friction = 0.4, static_friction = 0.8, restitution = 0 }
    """
    track = run(read(text, "fallen"), 1.0)
    assert track.values[-1, 2] == 0


def test_stick_slip_on_a_belt() -> None:
    """2D/v + (2 pi - 2 atan(D w/v))/w with D = (Fs - Fk)/k."""
    assert np.diff(times_of(run(known.belt(), 30.0), "sticks"))[1:] == pytest.approx(8.902605407814523, abs=1e-10)


def test_clutch_locks() -> None:
    track = run(known.clutch(), 10.0)
    assert times_of(track, "sticks") == pytest.approx([20 / 3], abs=1e-11)
    assert track.values[-1, 2:4] == pytest.approx([100 / 3, 100 / 3], abs=1e-11)
    assert track.values[-1, 5] == pytest.approx(10000 / 3, rel=1e-12)


@pytest.mark.parametrize("direction", [0.0, 0.9])
def test_sphere_rolls_after_sliding(direction: float) -> None:
    """From 2 v0/(7 mu g) on at 5/7 v0; the cone of friction is round."""
    track = run(known.sliding_sphere(direction), 2.0)
    assert times_of(track, "sticks") == pytest.approx([10 / (7 * 0.2 * G)], abs=1e-12)
    speeds = 25 / 7 * np.array([np.cos(direction), np.sin(direction)])
    assert track.values[-1, 5:7] == pytest.approx(speeds, abs=1e-10)


def test_block_at_rest_on_an_incline_does_not_creep() -> None:
    """tan 30 degrees is 0.577; 1e5 s."""
    track = run(known.incline(sp.Rational(6, 10)), 1e5)
    assert np.abs(track.values[-1]).max() < 1e-18
    assert track.modes[-1].contacts == (Mode.STICKS,)


def test_block_slides_down_or_comes_to_rest_on_an_incline() -> None:
    """Up it is slowed down by g (sin a + mu cos a), where it rests or, with less friction, slides back."""
    slope, hold = np.radians(30), 0.6
    up = run(known.incline(sp.Rational(6, 10), start=-1.0), 1.0)
    assert times_of(up, "sticks") == pytest.approx([1 / (G * (np.sin(slope) + hold * np.cos(slope)))], abs=1e-12)
    back = run(known.incline(sp.Rational(1, 2), start=-1.0), 1.0)
    first = 1 / (G * (np.sin(slope) + 0.5 * np.cos(slope)))
    down = G * (np.sin(slope) - 0.5 * np.cos(slope)) * (1 - first)
    assert back.values[-1, 2] == pytest.approx(down, rel=1e-11)


def test_stop_of_a_pendulum() -> None:
    """Each impact halves the velocity w with w^2 = 2 g (cos 0.5 - cos 1); energies between impacts are kept."""
    track = run(known.stopped_pendulum(), 6.0)
    impacts = [event.impulse for event in track.events if event.kind == "impact"]
    w = np.sqrt(2 * G * (np.cos(0.5) - np.cos(1.0)))
    assert impacts[:3] == pytest.approx([1.5 * w, 0.75 * w, 0.375 * w], rel=1e-10)


BOWL = """
[mechanism]
name = "bowl"
[coordinates]
x = { start = -1 }
y = { }
[gravity]
acceleration = 9.81
[bodies]
block = { mass = 1, position = ["x", "y"] }
[contacts.bowl]
gap = "1 - sqrt(x**2 + y**2)"
slip = "(x*y_dot - y*x_dot)/sqrt(x**2 + y**2)"
friction = 0.2
"""


def test_a_contact_without_load_that_is_pressed_soon_is_closed() -> None:
    """At the edge of a bowl the force is 0, and grows: the block slides along the bowl and never strikes it."""
    found = integrate(read(BOWL, "bowl.toml"), np.linspace(0, 1, 11))
    assert [(event.time, event.kind) for event in found.events] == [(0.0, "closes")]
    assert found.trajectory["bowl_gap"] == pytest.approx(0, abs=1e-10)


@pytest.mark.parametrize(("friction", "paradox"), [(1.32, False), (1.35, True)])
def test_painleve_begins_at_four_thirds(friction: float, paradox: bool) -> None:
    """At tan phi = 2 the limit (4 + tan^2 phi)/(3 tan phi) has its least value 4/3; then the rod is stopped at once.

    The FMU counts an impact without a collision, and so does its judge.
    """
    track = run(known.falling_rod(friction, float(np.arctan(2))), 1e-3)
    assert bool(times_of(track, "painleve")) == paradox
    assert track.impacts[0] == [1 if paradox else 0]
    slip = track.values[0, 3] - np.sin(np.arctan(2)) * track.values[0, 5]
    assert slip == pytest.approx(0.0 if paradox else 1.0, abs=1e-14)


@pytest.mark.parametrize(("friction", "poisson"), [(0.0, False), (0.1, False), (0.5, True)])
def test_impact_with_friction_never_gains_energy(friction: float, poisson: bool) -> None:
    """Newton's law would gain some at the double pendulum of T. Kane, D. Levinson, Dynamics (1985), section 5.8."""
    track = run(known.double_pendulum_on_floor(friction), 1e-6)
    assert bool(times_of(track, "poisson")) == poisson
    assert track.values[0, 5] > 0


def test_an_expansion_ends_where_it_would_gain_energy() -> None:
    """Two contacts that share friction would bring 1.7 J by Poisson's law, and more by Newton's: all of it is kept."""
    text = """
        mechanism = { name = "wedged", impacts = "simultaneous" }
        energy = { kinetic = "(x_dot**2 + y_dot**2 + z_dot**2)/2" }
        [coordinates]
        x = { velocity = -0.6 }
        y = { velocity = -0.5 }
        z = { velocity = 0.6 }
        [contacts.a]
        gap = "0.9*x - 0.4*y - 0.4*z"
        slip = "-0.8*x_dot + 0.5*y_dot + 0.4*z_dot"
        friction = 0.6
        restitution = 0.9
        [contacts.b]
        gap = "-0.1*x - 0.8*y - 0.7*z"
        slip = "0.2*x_dot - 0.9*y_dot - 0.7*z_dot"
        friction = 1.1
        restitution = 0.2
    """
    track = run(read(text, "wedged"), 1e-6)
    assert times_of(track, "poisson") == [0.0]
    assert np.sum(track.values[0, 3:6] ** 2) / 2 == pytest.approx(0.485, rel=1e-13)
    assert track.values[0, 3] > 0


def test_friction_under_the_force_of_its_own_guide() -> None:
    """The guide bears g/(1 + k^2 + k mu) while the bead slides, which slows it down by (k + mu) times that."""
    k, mu = 0.25, 0.5
    track = run(known.loaded_slider(sp.Rational(1, 4), sp.Rational(1, 2)), 1.0)
    slowed = (k + mu) * G / (1 + k**2 + k * mu)
    assert times_of(track, "sticks") == pytest.approx([2 / slowed], abs=1e-12)
    assert track.values[-1, 0] == pytest.approx(2 / slowed, abs=1e-11)


def test_gripper_takes_and_releases() -> None:
    """Taken, both move on at 1/4 m/s, three quarters of the energy lost."""
    track = run(known.gripper(), 3.0)
    assert [event.kind for event in track.events] == ["holds", "releases"]
    assert [event.time for event in track.events] == pytest.approx([1.0, 2.0], abs=1e-14)
    assert track.values[-1, :2] == pytest.approx([1.5, 0.5], abs=1e-12)
    assert track.values[-1, 5] == pytest.approx(0.375, abs=1e-13)


def test_switches_are_located() -> None:
    """A mass under sign(x) as a restoring force: parabolas of the period 4 sqrt(2 x0), met to rounding."""
    x = coordinate("x", "m", start=1.0)
    mechanism = Mechanism(
        "parabolas", coordinates=[x], bodies=[Body("mass", 1, (x, 0))], forces=[Force(x, -sp.sign(x))]
    )
    period = 4 * np.sqrt(2)
    reference = integrate(mechanism, [0, period, 10 * period])
    assert reference.trajectory["x"] == pytest.approx([1, 1, 1], abs=1e-11)
    assert reference.relative_error.max() < 1e-10


@pytest.mark.parametrize("width", [1e-4, 3e-6, 1e-6])
def test_a_steep_kink_is_passed_once(width: float) -> None:
    """A brake max(-1, min(1, v/w)): v falls by 1 m/s2 to w, then as w exp(-t/w); x = 1/2 - w^2/2 + w^2 (1 - exp(-5)).

    The margin v/w - 1 changes by 1/w a second: at the time nearest to its root it is off by more than rounding.
    """
    x = coordinate("x", "m", velocity=1.0)
    brake = Force(x, -sp.Max(-1, sp.Min(1, x.dot / sp.Float(width))))
    mechanism = Mechanism("brake", coordinates=[x], bodies=[Body("mass", 1, (x, 0))], forces=[brake])
    track = run(mechanism, 1 - width + 5 * width)
    assert track.values[-1, 1] == pytest.approx(width * np.exp(-5), rel=1e-6)
    assert track.values[-1, 0] == pytest.approx(0.5 + width**2 * (0.5 - np.exp(-5)), abs=1e-14)


def test_only_what_jumps_is_named_with_the_remedy() -> None:
    """An if that is continuous at its margin is no jump; one that turns the force round is."""
    x, c = coordinate("x", "m"), parameter("c", 1.0)
    kinds = {
        "if(x_dot > 0, ...)": Choice(x.dot, -c, c),
        "sign(x_dot)": -sp.sign(x.dot),
        "": Choice(2 * x.dot - c, -c, -2 * x.dot),
    }
    for named, force in kinds.items():
        bodies, forces = [Body("b", 1, (x, 0))], [Force(x, force)]
        remedy = remedy_of_jumps(Mechanism("m", coordinates=[x], parameters=[c], bodies=bodies, forces=forces))
        assert remedy.startswith(f"the forces jump with {named}, ") if named else not remedy
        assert "tanh((x_dot)/w)" in remedy or not named


def test_switches_of_inputs_and_time_are_located() -> None:
    """A force max(0, u - 1/2) heaviside(t - 1) with u = t/2 pushes from 1 s on: v = (t - 1)^2/4."""
    x, u = coordinate("x", "m"), signal("u")
    t = sp.Symbol("t", real=True)
    force = sp.Max(0, u - sp.Rational(1, 2)) * sp.Heaviside(t - sp.Rational(6, 5))
    mechanism = Mechanism(
        "ramp", coordinates=[x], inputs=[u], bodies=[Body("mass", 1, (x, 0))], forces=[Force(x, force)]
    )
    track = run(mechanism, 3.0, {"u": t / 2})
    assert track.values[-1, 1] == pytest.approx((4 - 0.04) / 4, abs=1e-12)


@pytest.mark.parametrize(("clock", "count"), [("t", 40), ("c", 100)])
def test_a_condition_that_turns_many_times_within_a_step_of_the_motion(clock: str, count: int) -> None:
    """Short catches; in s seconds between them 1 N draws one of two masses of 1 kg away from the other by s^2/2.

    The motion is a parabola, so that its steps grow to two periods. The condition asks for the time, or for the place c
    of a body with a speed of 1 m/s.
    """
    a, b, c = coordinate("a", "m"), coordinate("b", "m"), coordinate("c", "m", velocity=1)
    t = {"t": sp.Symbol("t", real=True), "c": c}[clock]
    level, omega = sp.Rational(99, 100), 4 * sp.pi
    catch = Constraint("catch", a - b, while_=sp.sin(omega * t) - level)
    bodies = [Body("one", 1, (a, 0)), Body("other", 1, (b, 0)), Body("clock", 1, (c, 0))]
    mechanism = Mechanism("m", coordinates=[a, b, c], bodies=bodies, forces={a: 1}, constraints=[catch])
    end = count / 2 - 0.375
    track = run(mechanism, end)
    first = float(sp.asin(level) / omega)
    between = 0.25 + 2 * first
    assert track.values[-1, 0] - track.values[-1, 1] == pytest.approx(
        (first**2 + (count - 1) * between**2) / 2, abs=1e-9
    )
    assert track.values[-1, 3:5] == pytest.approx([end / 2] * 2, abs=1e-9)


def test_a_broken_power_costs_no_steps_where_it_ends() -> None:
    """Hertz's contact with a loss: it presses by 1.2 k d^1.5 and pushes back by 0.8 k d^1.5, beginning at d = 0."""
    y, k = coordinate("y", "m", start=1.0), 1e5
    push = Force(y, k * sp.Max(0, -y) ** sp.Rational(3, 2) * (1 - sp.sign(y.dot) / 5))
    hertz = Mechanism("hertz", coordinates=[y], bodies=[Body("ball", 1, (0, y))], gravity=G, forces=[push])
    track = run(hertz, 3.0)
    heights = [1.0]
    for _ in range(8):
        depth = brentq(lambda d: G * (heights[-1] + d) - 1.2 * k * d**2.5 / 2.5, 1e-4, 1.0, xtol=1e-15)
        heights.append(0.8 * k * depth**2.5 / 2.5 / G - depth)
    y_end, velocity = track.values[-1][:2]
    assert y_end > 0
    assert np.abs(y_end + velocity**2 / (2 * G) - heights).min() < 1e-9
    assert track.evaluations < 20_000


def test_the_joints_of_a_long_chain_stick_and_slide() -> None:
    """Fourteen frictions have 3^14 modes; at the event at 0.0195 s one that lets go must not hold again at once."""
    chain = load("n_pendulum", {"n": "14"})
    turns = [symbol(f"{c.name}_dot") for c in chain.coordinates]
    rates = [turns[0], *(b - a for a, b in pairwise(turns))]
    chain = replace(chain, frictions=tuple(Friction(f"f{i}", on=rate, force=0.5) for i, rate in enumerate(rates)))
    track = run(chain, 0.03)
    assert times_of(track, "slides")[-1] == pytest.approx(0.0194723, abs=1e-6)
    assert len(track.events) < 20


def test_a_slip_that_is_zero_by_its_lever_turns() -> None:
    """No friction holds a disc at its dead centres, where sin(a) is 0; each half turn takes 2 J of its energy."""
    a = coordinate("a", "rad", start=1.0, velocity=5.0)
    guide = Friction("guide", on=sp.sin(a) * a.dot, force=1)
    disc = Mechanism("disc", coordinates=[a], bodies=[Body("disc", 1, (0, 0), angle=a, inertia=1)], frictions=[guide])
    track = run(disc, 2.0)
    angle, speed = track.values[-1][:2]
    turns = np.floor(angle / np.pi)
    way = 2 * turns + (1 - np.cos(angle - turns * np.pi)) - (1 - np.cos(1.0))
    assert turns == 3
    assert speed**2 / 2 + way == pytest.approx(12.5, abs=1e-9)


def test_a_contact_opens_where_the_forces_on_it_cancel() -> None:
    """A spring pulls a mass off its stop as soon as it pulls more than cos(t) pushes."""
    x, t = coordinate("x", "m", start=0.1), sp.Symbol("t", real=True)
    wall = Stop("wall", of=x, upper=sp.Rational(1, 10))
    push = Force(x, sp.cos(t) - x)
    mass = Mechanism("mass", coordinates=[x], bodies=[Body("mass", 1, (x, 0))], forces=[push], stops=[wall])
    track = run(mass, 3.0)
    leaves = float(np.arccos(0.1))
    assert times_of(track, "opens") == pytest.approx([leaves], abs=1e-9)


STACK = """
mechanism = { name = "stack" }
gravity = { acceleration = 9.81 }
[coordinates]
a = { unit = "m", start = 0.3 }
b = { unit = "m", start = 0.8 }
c = { unit = "m", start = 1.1 }
[bodies]
low = { mass = 3, position = [0, "a"] }
middle = { mass = 2, position = [0, "b"] }
high = { mass = 1, position = [0, "c"] }
[contacts]
ground = { gap = "a", restitution = 0.5 }
under = { gap = "b - a - 0.1", restitution = 0.5 }
top = { gap = "c - b - 0.1", restitution = 0.5 }
"""


def test_three_balls_come_to_rest_on_each_other() -> None:
    """What is left of a low rebound is taken from a ball, and from none of those that bear it."""
    track = run(read(STACK, "stack"), 1.0)
    assert track.values[-1, :6] == pytest.approx([0, 0.1, 0.2, 0, 0, 0], abs=1e-9)


def test_outcomes_of_an_impact_slide_in_space() -> None:
    """Coulomb's friction of the impulse 1 N s against a slip of 0.5 m/s."""
    contact = Item((*PLANES[2], Mode.OPEN), 0, (1, 2), 0.3, 0.3)
    (outcome,) = all_outcomes(np.eye(3), np.array([-1.0, 0.5, 0.0]), [contact], 1.0)
    assert outcome.forces == pytest.approx([1.0, -0.3, 0.0])
    assert outcome.modes == (Mode.SLIDES,)


def test_ends_of_a_capsule_stick_though_their_slips_differ_by_rounding() -> None:
    """Along the line of two ends both have one slip, which they share; across it each has its own."""
    ends = [Item((*PLANES[2], Mode.OPEN), i, (i + 1, i + 2), mu, mu) for i, mu in ((0, 0.6), (3, 0.3))]
    D = np.eye(6)
    D[1, 4] = D[4, 1] = 1
    outcome = decided(D, np.array([-1.0, 0.1, 0.2, -1.0, 0.1 + 1e-13, -0.2]), ends, 0.0)
    assert outcome is not None
    assert outcome.modes == (Mode.STICKS, Mode.STICKS)
    assert outcome.forces[[0, 2, 3, 5]] == pytest.approx([1, -0.2, 1, 0.2], rel=1e-9)
    assert outcome.forces[1] + outcome.forces[4] == pytest.approx(-0.1, rel=1e-9)


def test_a_load_far_beyond_all_others_is_none() -> None:
    """Two feet press on each other along a line that is 2e-9 off the ground: the load that lifts one is no number.

    A limit of 1 by a slope of 1e-3 asks for a load of 1e3; by a slope of 2e-9 rounding decides on the load.
    """
    least, free = np.ones(1), np.ones((1, 1))
    assert nearest(least, free, Limits([(-1.0, np.array([1e-3]), np.zeros((0, 1)))], 1)) == pytest.approx([1e3])
    assert nearest(least, free, Limits([(-1.0, np.array([2e-9]), np.zeros((0, 1)))], 1)) is None


def test_what_is_left_of_a_motion_that_has_ended_contradicts_nothing() -> None:
    """Two frictions along one motion stop it together: both hold, whatever rounding leaves of their accelerations."""
    items = [Item((Mode.STICKS, Mode.FORWARD, Mode.BACKWARD), None, (i,), 1.0, 1.0) for i in range(2)]
    outcome = decided(np.ones((2, 2)), np.array([1e-46, -3e-46]), items, 1e-3)
    assert outcome is not None
    assert outcome.modes == (Mode.STICKS, Mode.STICKS)


def test_a_contact_opens_with_the_friction_beside_it_where_their_event_is_located_early() -> None:
    """A pull of 1 N but for 1e-8 N at a mass of 1 kg: neither opening nor staying met the laws."""
    items = [Item((Mode.OPEN, Mode.SLIDES), 0), Item((Mode.FORWARD, Mode.BACKWARD), None, (1,), 1.0, 1.0)]
    outcome = decided(np.ones((2, 2)), np.full(2, 1 - 1e-8), items, 1.0, [Mode.OPEN, None])
    assert outcome is not None
    assert outcome.modes == (Mode.OPEN, Mode.FORWARD)


BREAKING = """
[mechanism]
name = "breaking"
[coordinates]
low = {}
high = {}
[energy]
kinetic = "(1.926*low_dot**2 + 1.768*high_dot**2)/2"
[forces]
low = 2.448
high = -6.674
[frictions]
guide = { on = "low_dot", force = 0.767, static = 0.843 }
plate = { on = "high_dot - low_dot", force = 4.384, static = 5.029 }
"""


def test_errors_of_a_start_leave_what_rests_at_rest() -> None:
    """The plate would hold 5.02 N, and holds 5.06 N of it as long as the guide bears its static friction: it slips.

    A start that slips along the guide by errors alone has another motion: both blocks go on together.
    """
    reference = integrate(read(BREAKING, "breaking.toml"), np.linspace(0.0, 0.5, 51), rtol=1e-9)
    assert reference.trajectory["high_dot"][-1] < reference.trajectory["low_dot"][-1]
    assert reference.growth.max() < 10


def test_what_a_closed_gap_has_drifted_is_no_impact() -> None:
    """A ball leaves the floor as soon as this falls faster than by gravity: 20 cos(t) = -g."""
    y, t = coordinate("y", "m"), sp.Symbol("t", real=True)
    floor = Contact("floor", gap=y - 20 * (1 - sp.cos(t)))
    ball = Mechanism("ball", coordinates=[y], bodies=[Body("ball", 1, (0, y))], contacts=[floor], gravity=G)
    problem = HybridRun(HybridSystem(ball), signals_of(ball, None, 0.0), np.array([0.0, 3.0]))
    track = Follower(problem, "DOP853", 1e-6, 500_000).follow(started(problem, {}))
    assert times_of(track, "opens") == pytest.approx([np.arccos(-G / 20)], abs=1e-6)
    assert not times_of(track, "impact")


def test_runs_that_have_parted_end_where_no_one_compares() -> None:
    """The perturbed run ends early; the first run goes to the end."""
    wedge, times = known.wedge(), np.linspace(0.0, 12.0, 401)
    whole = integrate(wedge, times)
    part = integrate(wedge, times, most_growth=100.0)
    np.testing.assert_array_equal(part.trajectory.values, whole.trajectory.values)
    assert part.events == whole.events
    assert part.evaluations < 0.7 * whole.evaluations
    compared = whole.growth <= 100
    assert 0.1 < compared.mean() < 0.6
    np.testing.assert_array_equal(part.growth <= 100, compared)
    np.testing.assert_array_equal(part.growth[compared], whole.growth[compared])
    assert np.isinf(part.amplification[-1])


FOLLOWER = """
mechanism = { name = "follower" }
[coordinates]
x = { unit = "m", start = 0.5, velocity = 1 }
y = { unit = "m", start = 0.25, velocity = -0.5 }
[bodies]
cam = { mass = 1, position = ["x", 0] }
follower = { mass = 0.05, position = [0, "y"] }
[forces]
y = -2
[tables.profile]
columns = [[0, 1, 2], [0.5, 0, 0]]
units = ["m", "m"]
[contacts.tip]
gap = "y - profile(x)"
"""
"""The cam's slope of -1/2 ends at x = 1 m. Until then the follower presses it on, (1 + 0.05/4) x_ddot = 2/2."""


@pytest.mark.parametrize(
    "table",
    [
        "columns = [[0, 1, 2], [0.5, 0, 0]]",
        'columns = [[0, 0.5, 1], [0.5, 0.25, 0]]\ninterpolation = "cubic"',
        'columns = [[0, 0.5, 1], [0.5, 0.25, 0]]\ninterpolation = "pchip"',
        "columns = [[0, 1, 2], [0, 1], [[0.5, 0.5], [0, 0], [0, 0]]]",
        'columns = [[0, 0.5, 1], [0, 1], [[0.5, 0.5], [0.25, 0.25], [0, 0]]]\ninterpolation = "cubic"',
    ],
)
def test_a_follower_is_struck_where_the_slope_of_its_table_changes(table: str) -> None:
    push = 1 / 1.0125
    speed = np.sqrt(1 + 2 * push * 0.5)
    text = FOLLOWER.replace("columns = [[0, 1, 2], [0.5, 0, 0]]", table)
    if "[[0.5, 0.5]" in table:
        text = text.replace("profile(x)", "profile(x, 0.5)").replace('["m", "m"]', '["m", "m", "m"]')
    track = run(read(text, "follower.toml"), 0.9)
    (at,) = times_of(track, "impact")
    assert at == pytest.approx((speed - 1) / push, rel=1e-9)
    assert track.values[-1, :4] == pytest.approx([1 + speed * (0.9 - at), 0, speed, 0], abs=1e-9)


BEAD = """
mechanism = { name = "bead" }
[coordinates]
x = { unit = "m", start = 0.5, velocity = 1 }
y = { unit = "m", guess = 0.25, guess_velocity = -0.5 }
[bodies.bead]
mass = 1
position = ["x", "y"]
[gravity]
acceleration = 9.81
[tables.profile]
columns = [[0, 1, 2], [0.5, 0, 0]]
units = ["m", "m"]
[constraints.holonomic]
rail = "y - profile(x)"
"""


DIPPING = """
[mechanism]
name = "dipping"
[coordinates]
y = { velocity = 0.5 }
[bodies]
ball = { mass = 1, position = [0, "y"] }
[contacts.table]
gap = "y + 1e-7 - 0.51*t + 100*t**2"
restitution = 0.5
"""
"""The gap is below 0 for 77 us by 1.5e-7 m at most, at the beginning of a step that is as long as the run allows."""


def test_a_gap_that_closes_for_a_short_while_behind_the_start_of_a_step_is_struck() -> None:
    run = integrate(read(DIPPING, "dipping.toml"), np.linspace(0, 1, 11)).trajectory
    approach = np.sqrt(0.01**2 - 4 * 100 * 1e-7)
    assert run["table_impacts"][-1] == 1
    assert run["y_dot"][-1] - 0.5 == pytest.approx(1.5 * approach, rel=1e-8)


def test_a_bead_keeps_its_velocity_along_a_rail_that_turns() -> None:
    """At the foot of the slope of 1/2 its energy is all in 5/8 x_dot^2; the vertical part of the velocity is lost."""
    reference = integrate(read(BEAD, "bead.toml"), np.linspace(0, 0.6, 61))
    speed = np.sqrt(1 + 9.81 * 0.25 / 0.625)
    assert reference.trajectory["x_dot"][-1] == pytest.approx(speed, rel=1e-9)
    assert reference.trajectory["y_dot"][-1] == pytest.approx(0, abs=1e-9)
    assert reference.relative_error.max() < 1e-8


def test_a_coordinate_may_be_called_as_a_side_was() -> None:
    side = coordinate("side_0", "m", velocity=1.0)
    body = Body("body", mass=1, position=(side, 0))
    mechanism = Mechanism("named", coordinates=[side], bodies=[body], forces={side: sp.Max(side - 1, 0)})
    track = run(mechanism, 2.0)
    assert track.values[-1, :2] == pytest.approx([1 + np.sinh(1), np.cosh(1)], rel=1e-9)


def test_gaps_with_a_kink_are_told_on_both_sides_of_it() -> None:
    y, t = coordinate("y", "m", start=3.0), sp.Symbol("t", real=True)
    table = Contact("table", gap=y - sp.Min(t, 1))
    ball = Mechanism("ball", coordinates=[y], bodies=[Body("ball", 1, (0, y))], contacts=[table])
    times = np.linspace(0, 2, 9)
    assert integrate(ball, times).trajectory["table_gap"] == pytest.approx(3 - np.minimum(times, 1), abs=1e-15)


TURNTABLE = """
mechanism = { name = "turntable" }
gravity = { acceleration = 9.81 }
[coordinates]
x = { unit = "m", start = 0.3 }
y = { unit = "m", velocity = 0.2 }
z = { unit = "m", start = 0.05 }
e0 = { start = 1.0 }
e1 = { velocity = 7.0 }
e2 = {}
e3 = {}
[frames]
table = { rotations = [["z", "3*t"]] }
ball = { origin = ["x", "y", "z"], quaternion = ["e0", "e1", "e2", "e3"] }
[bodies.ball]
frame = "ball"
mass = 0.4
inertia = [4e-4, 4e-4, 4e-4, 0, 0, 0]
[contacts.floor]
kind = "sphere_plane"
between = ["ball", "table"]
normal = "z"
radius = 0.05
friction = 5
"""
"""The ball rolls: its lowest point has the velocity (0, 0.9) m/s of the table."""


def test_a_ball_rolls_in_circles_on_a_turntable() -> None:
    """At 2/7 of its rate. The scalar part of the quaternion has no inertia at the start, but a force."""
    x, y = run(read(TURNTABLE, "turntable"), 0.3).values[-1, :2]
    rate = 2 / 7 * 3
    assert [x, y] == pytest.approx(
        [0.3 - 0.2 / rate * (1 - np.cos(0.3 * rate)), 0.2 / rate * np.sin(0.3 * rate)], abs=1e-9
    )


@pytest.mark.parametrize("name", ["woodpecker", "crane", "sliding_sphere"])
def test_rates_of_many_rows_by_complex_steps_are_those_by_symbols(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Hundreds of contacts have their rates by complex steps; these mechanisms have both."""
    mechanism = load(name)
    written = HybridSystem(mechanism)
    x = np.random.default_rng(1).normal(size=(2, 7, written.n))
    state = written.energies.state(np.zeros(7), *x, None)
    expected = written.elements.rows(state)
    monkeypatch.setattr("lag2fmu.reference.hybrid.elements.MANY", 0)
    found = HybridSystem(mechanism).elements.rows(state)
    for part in ("gaps", "velocities", "gamma", "jacobian", "restitution", "friction", "static"):
        scale = 1 + np.abs(getattr(expected, part)).max(initial=0.0)
        assert getattr(found, part) == pytest.approx(getattr(expected, part), abs=1e-13 * scale)


def test_what_holds_is_told_by_the_name_of_its_friction() -> None:
    """The friction number 0 was told as the contact number 0, or ended in an IndexError without contacts."""
    mechanism = known.belt()
    problem = HybridRun(HybridSystem(mechanism), signals_of(mechanism, None, 0.0), np.array([0.0, 1.0]))
    assert Follower(problem, "DOP853", 1e-9, 1e5)._told("hold", 0) == f"the hold of '{mechanism.frictions[0].name}'"


def test_latches_hand_over_at_one_instant() -> None:
    """A state of 1e6 1/s moves by 1e-9 while the time is rounded: one latch catches as the other lets go.

    After 1e-4 s + ln 2 us x is held, and momentum along y stays: of the velocity 1 m/s of x, y gets 1/5.
    """
    text = """
[mechanism]
name = "handing_over"
[coordinates]
x = { unit = "m", velocity = 1 }
y = { unit = "m" }
[bodies]
a = { mass = 1, position = ["x", 0] }
b = { mass = 1, position = ["y", 0] }
middle = { mass = 1, position = ["(x + y)/2", 0] }
[parameters]
at = { value = 7.6, unit = "s" }
rate = { value = 1e6, unit = "1/s" }
[states.s]
start = -1
derivative = "rate*(if(t > at, 1, -1) - s)"
[constraints.holonomic]
second = { expression = "x", while = "s" }
first = { expression = "y", while = "-s" }
"""
    reference = integrate(read(text, "handing_over.toml"), np.array([7.5999, 7.6001]))
    later = np.log(2) * 1e-6
    assert reference.trajectory["x"][-1] == pytest.approx(1e-4 + later, rel=1e-9)
    assert reference.trajectory["y"][-1] == pytest.approx((1e-4 - later) / 5, rel=1e-9)


def test_slip_in_space_that_begins_while_its_force_turns() -> None:
    """A block is dragged off by a force that grows and turns: while its slip is slow, its direction turns, too.

    m dv/dt = F - mu m g v/|v| is integrated by Radau's method from a speed on, at which it is on its way already.
    """
    mechanism = read(
        """
        mechanism = { name = "dragged" }
        definitions = { pull = "0.4*9.81*(0.99 + t)" }
        gravity = { acceleration = 9.81 }
        bodies = { block = { mass = 1, position = ["x", "y", "z"] } }
        forces = { x = "pull*cos(30*t)", y = "pull*sin(30*t)" }
        contacts = { floor = { gap = "z", slip = ["x_dot", "y_dot"], friction = 0.4 } }
        [coordinates]
        x = {}
        y = {}
        z = {}
        """,
        "dragged.toml",
    )
    begin, end, hold = 0.01, 0.014, 0.4 * G

    def slope(t: float, v: np.ndarray) -> np.ndarray:
        along = np.array([np.cos(30 * t), np.sin(30 * t)])
        return hold * ((0.99 + t) * along - v / np.hypot(*v))

    slow = 1e-12 * np.array([np.cos(30 * begin), np.sin(30 * begin)])
    truth = solve_ivp(slope, (begin, end), slow, method="Radau", rtol=1e-12, atol=1e-16, first_step=1e-10).y[:, -1]
    assert run(mechanism, end).values[-1, 3:5] == pytest.approx(truth, abs=2e-9)


def test_ball_with_its_mass_beside_its_centre_slides_and_rolls() -> None:
    """Errors turn the direction of its slip where that ends: what is left of it is not another slip.

    Where a run took it for one, it began anew at the same time, and the runs at two tolerances differed by 1e-6.
    """
    mechanism = read(
        """
        mechanism = { name = "skewed" }
        gravity = { acceleration = 9.81, direction = [0, 0, -1] }
        frames = { ball = { origin = ["x", "y", "z"], quaternion = ["e0", "e1", "e2", "e3"] } }
        [bodies.sphere]
        frame = "ball"
        mass = 7
        inertia = [0.031, 0.033, 0.034, 0.0005, 0, 0.0003]
        center = [0.003, 0, 0]
        [contacts.lane]
        kind = "sphere_plane"
        between = ["ball", "world"]
        normal = "z"
        radius = 0.108
        friction = 0.2
        [coordinates]
        x = { velocity = 3 }
        y = {}
        z = { start = 0.108 }
        e0 = { start = 1 }
        e1 = { velocity = 5 }
        e2 = {}
        e3 = { velocity = 10 }
        """,
        "skewed.toml",
    )
    assert integrate(mechanism, [0.0, 0.5], rtol=1e-11).relative_error.max() < 1e-8


def test_a_margin_of_the_time_is_looked_at_in_steps_of_its_rounding() -> None:
    """As before a square root whose operand ends with its branch: the times of samples are all equal there."""
    before = float(np.nextafter(1.0, 0.0))
    assert first_descent(lambda t: 1.0 - t, before, 1.0, 0.0, True) == 1.0


def test_what_becomes_free_later_amplifies_errors_of_its_own() -> None:
    """A point on a hill, q_ddot = 16 q + t - 1, lies on a stop for 1 s; until then it knows of no start."""
    q = coordinate("q", "m", start=0.0, nominal=1e-3)
    hill = Energy(kinetic=q.dot**2 / 2, potential=-8 * q**2)
    stop = Stop("stop", of=q, lower=0)
    mechanism = Mechanism("hill", coordinates=[q], energy=hill, forces={q: TIME - 1}, stops=[stop])
    run = integrate(mechanism, np.linspace(0, 3, 61), rtol=1e-10)
    assert [(event.kind, round(event.time, 6)) for event in run.events] == [("closes", 0), ("opens", 1)]
    assert run.amplification[19] < 1
    assert run.amplification[-1] == pytest.approx(np.cosh(8.0), rel=0.1)


def test_a_gap_that_has_no_value_any_more_ends_the_run_with_a_sentence() -> None:
    hill = read(
        """
        [mechanism]
        name = "hill"
        [coordinates]
        x = { unit = "m", start = 19.0, velocity = 5.0 }
        y = { unit = "m", start = 20.0 }
        [gravity]
        acceleration = 9.81
        [bodies.skier]
        mass = 80
        position = ["x", "y"]
        [contacts.slope]
        gap = "y - sqrt(400 - x**2)"
        [contacts.ground]
        gap = "y"
        """,
        "hill",
    )
    with pytest.raises(SimulationError, match=r"'hill' near time 0\.0 s: Radau cannot go on"):
        integrate(hill, np.linspace(0.0, 0.5, 6))
