"""Levers, reversals and accumulating impacts against closed forms (g = 9.81), whoever integrates."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from late_hosts import EULER, RK4, fixed_steps
from machines import mechanism

import lag2fmu
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Body, Contact, Energy, Mechanism, coordinate

pytestmark = pytest.mark.fmu

G, MODEL_EXCHANGE = 9.81, {"kind": "model-exchange"}
OPEN, STICKS = 1, 2


def _yoke_speed(angle: float, start: float, energy: float, torque: float, force: float, inertia: float) -> float:
    """rad/s at ``angle``: friction takes F r |cos| from dead centre to dead centre, r = 0.1 m."""

    def way(a: float) -> float:
        return 0.1 * (2 * np.floor(a / np.pi) + 1 - np.cos(a % np.pi))

    return float(np.sqrt(2 * (energy + torque * (angle - start) - force * (way(angle) - way(start))) / inertia))


@pytest.mark.parametrize("way", ["co-simulation", "CVode", "RK4", "Euler"])
def test_friction_never_drives_a_crank_past_its_dead_centres(way: str, exported) -> None:
    """Some twenty dead centres; a bias of the indicator grew by a factor of -4 at each of them."""
    values = {"a": 1.0, "a_dot": 12.0, "T": 2.0, "F": 15.0, "J": 0.2}
    fmu, names = exported(mechanism("yoke")), ["a", "a_dot", "slide_force", "slip"]
    if way in ("RK4", "Euler"):
        method, step = (RK4, 2e-3) if way == "RK4" else (EULER, 2e-4)
        rows, _ = fixed_steps(fmu.path, values, names, 4.0, step, method, round(0.004 / step))
    else:
        options = MODEL_EXCHANGE if way == "CVode" else {}
        run = lag2fmu.simulate(fmu, stop_time=4, step=0.004, tolerance=1e-9, values=values, outputs=names, **options)
        rows = run.columns(names)
    a, a_dot, force, slip = rows.T
    expected = [_yoke_speed(angle, 1.0, 0.1 * 144, 2.0, 15.0, 0.2) for angle in a]
    assert a[-1] > 15 * np.pi
    assert a_dot == pytest.approx(expected, rel={"RK4": 2e-4, "Euler": 4e-2, "CVode": 1e-6}.get(way, 1e-7))
    assert (force * slip <= 0.15 * np.abs(a_dot) * 5e-3).all()


def test_a_crank_creeps_out_of_its_dead_centre_against_friction(exported) -> None:
    """The slide waited there without friction until its slip was 1e-9 m/s, for a fiftieth of a slow motion."""
    values = {"a": np.pi, "a_dot": 0.0, "T": 0.0159, "F": 32.8, "J": 0.286}
    run = lag2fmu.simulate(
        exported(mechanism("yoke")), stop_time=0.05, step=0.002, values=values, outputs=["a", "a_dot", "slide_mode"]
    )
    expected = [_yoke_speed(angle, np.pi, 0.0, 0.0159, 32.8, 0.286) for angle in run["a"]]
    assert run["a_dot"] == pytest.approx(expected, abs=5e-8)
    assert (run["slide_mode"][run.time > 0.005] != STICKS).all()


@pytest.mark.parametrize("start", [0.0, np.pi])
@pytest.mark.parametrize("options", [{}, MODEL_EXCHANGE], ids=["co-simulation", "CVode"])
def test_a_loop_turns_out_of_its_dead_centre(start: float, options: dict, exported) -> None:
    """No friction on the slide holds it there: torque times angle is kinetic energy and friction times way."""
    values = {"a": start, "F": 60.0, "J": 0.1, "m": 1.0, "T": 8.0, "S": 1.0, "F_b": 0.0}
    names = ["a", "x", "a_dot", "kinetic_energy", "dissipated_energy", "slide_mode", "slide_force"]
    run = lag2fmu.simulate(
        exported(mechanism("loop")), stop_time=1, step=0.001, tolerance=1e-9, values=values, outputs=names, **options
    )
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(run["x"])))])
    assert run["a"][-1] > start + 10
    assert run["dissipated_energy"] == pytest.approx(60 * way, abs=2e-2)  # the sum of ways misses what turns between
    assert run["kinetic_energy"] + run["dissipated_energy"] == pytest.approx(8 * (run["a"] - start), abs=1e-5)
    assert np.abs(run["slide_force"]).max() <= 60 * (1 + 1e-9)
    assert (run["slide_mode"][2:] != STICKS).all()


def test_an_oscillator_rests_where_events_are_seen_late(exported) -> None:
    """At x = 0.2 after eight half swings, by RK4 at 0.01 s; it ended with a speed of 2.86 m/s."""
    rows, _ = fixed_steps(exported("coulomb_oscillator").path, {}, ["x", "x_dot"], 30.0, 0.01, RK4, 500)
    assert rows[-1] == pytest.approx([0.2, 0.0], abs=1e-3)


@pytest.mark.parametrize(("restitution", "step"), [(0.8, 1e-3), (0.5, 1e-2), (0.95, 1e-2)])
def test_a_ball_comes_to_rest_where_events_are_seen_late(restitution: float, step: float, exported) -> None:
    """From 1 m, in time and with its energy, by RK4; each late impact lifted the ball, which bounced on for ever."""
    names = ["floor_mode", "total_energy", "dissipated_energy"]
    values, stop = {"e": restitution}, 5.0
    rows, _ = fixed_steps(exported("bouncing_ball").path, values, names, stop, step, RK4)
    modes, *energies = rows.T
    rests = np.sqrt(2 / 9.81) * (1 + restitution) / (1 - restitution)
    assert np.count_nonzero(modes == OPEN) * step == pytest.approx(min(rests, stop), abs=5 * step)
    assert sum(energies) == pytest.approx(0.5 * 9.81, rel=1e-3)


def test_a_sphere_rolls_where_events_are_seen_late(exported) -> None:
    """From 0.728 s on at 5/7 of its first speed, by RK4 at 1 ms; its slip turned round in each step without an end."""
    rows, _ = fixed_steps(exported("sliding_sphere").path, {}, ["table_mode", "x_dot"], 0.74, 1e-3, RK4)
    modes, speeds = rows[730:].T
    assert (modes == STICKS).all()
    assert speeds == pytest.approx(25 / 7, rel=1e-4)


def test_a_woodpecker_climbs_down_where_events_are_seen_late(exported) -> None:
    """By RK4 at 1 ms, beside co-simulation; it climbed up."""
    fmu = exported("woodpecker")
    rows, _ = fixed_steps(fmu.path, {}, ["y"], 2.0, 1e-3, RK4, 2000)
    assert rows[-1][0] == pytest.approx(lag2fmu.simulate(fmu, stop_time=2, step=2, outputs=["y"])["y"][-1], rel=0.1)


@pytest.fixture(scope="module")
def thrown() -> Mechanism:
    """A ball that is thrown along a floor from 1 m."""
    x, y = coordinate("x", "m", velocity=10.0), coordinate("y", "m", start=1.0)
    floor = Contact("floor", gap=y, slip=x.dot, friction=sp.Rational(1, 10), restitution=sp.Rational(4, 5))
    return Mechanism(
        "thrown",
        coordinates=[x, y],
        bodies=[Body("ball", 1, (x, y))],
        energy=Energy(potential=sp.Rational(981, 100) * y),
        contacts=[floor],
    )


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize(("options", "bar"), [({}, 1e-12), (MODEL_EXCHANGE, 1e-8)], ids=["co-simulation", "CVode"])
def test_accumulating_impacts_take_friction_once(
    tolerance: float, options: dict, bar: float, thrown: Mechanism, exported
) -> None:
    """From flight to rest the normal impulse is m g t, whatever the number of impacts: x_dot = 10 - mu g t."""
    run = lag2fmu.simulate(exported(thrown), stop_time=5, step=5, tolerance=tolerance, outputs=["x_dot"], **options)
    assert run["x_dot"][-1] == pytest.approx(10 - 0.1 * G * 5, abs=bar)


@pytest.mark.parametrize("options", [{}, MODEL_EXCHANGE], ids=["co-simulation", "CVode"])
def test_impacts_on_a_block_that_rests_accumulate(options: dict, exported) -> None:
    """A ball, e = 0.5, falls 0.1 m on a block: at rest after 3 sqrt(0.2/g) s, by as many impacts as on the floor.

    In model exchange it jumped on by 1e-9 m/s without end.
    """
    low, high, alone = (coordinate(name, "m", start=y) for name, y in (("low", 0.0), ("high", 0.1), ("alone", 0.1)))
    gaps = {"ground": low, "top": high - low, "floor": alone}
    stack = Mechanism(
        "stack",
        coordinates=[low, high, alone],
        bodies=[Body(y.name, m, (i, y)) for i, (y, m) in enumerate([(low, 2), (high, 1), (alone, 1)])],
        gravity=sp.Rational(981, 100),
        contacts=[Contact(name, gap=gap, restitution=sp.Rational(1, 2)) for name, gap in gaps.items()],
    )
    outputs, rest = ["top_impacts", "floor_impacts", "top_gap", "top_mode"], 3 * np.sqrt(0.2 / G)
    run = lag2fmu.simulate(exported(stack), stop_time=rest + 2e-6, outputs=outputs, **options)
    assert run["top_impacts"][-1] == run["floor_impacts"][-1]
    assert run["top_gap"][-1] == pytest.approx(0.0, abs=1e-15)
    assert run["top_mode"][-1] == 3


SLOW = """
[mechanism]
name = "slow"
[parameters]
g = { value = 9.81e-12 }
[coordinates]
y = { start = 0.1 }
[energy]
kinetic = "y_dot**2/2"
potential = "g*y"
[forces]
y = "g*t/2e6"
[contacts]
floor = { gap = "y", restitution = 0.5 }
[experiment]
stop_time = 2.1e6
step = 1e3
"""


def test_the_time_that_accumulating_impacts_leave_is_no_rounding_of_a_force(exported) -> None:
    """A ball that came to rest rises from 2e6 s on: y = g t^3/12 in units of 1e6 s. It was held down by 0.02 g."""
    run = lag2fmu.simulate(exported(read(SLOW, "slow.toml")), outputs=["y", "floor_force", "floor_impacts"])
    assert run["floor_impacts"][-1] > 5
    assert run["floor_force"].min() == 0
    assert run["y"][-1] == pytest.approx(G * 0.1**3 / 12, rel=1e-9)


SHARED = """
[mechanism]
name = "shared"
[parameters]
F = { value = 0.0 }
B = { value = 1.0 }
X = { value = 0.0 }
Y = { value = 0.0 }
[coordinates]
u = {}
x = {}
y = {}
z = {}
[energy]
kinetic = "(u_dot**2 + x_dot**2 + y_dot**2 + z_dot**2)/2"
potential = "10*z"
[forces]
u = "F"
x = "X"
y = "Y"
[contacts]
table = { gap = "z", slip = ["x_dot", "y_dot"], friction = 0.5 }
[frictions]
guide = { on = "u_dot", force = 6 }
seal = { on = "u_dot", force = 5 }
brush = { on = "u_dot", force = "B" }
along = { on = "x_dot", force = 2 }
across = { on = "y_dot", force = 1 }
"""


@pytest.mark.parametrize(
    ("load", "brush", "slider", "block"),
    [(11.88, 1.0, 3 * [0.04], 0.01), (11.97, 1.0, 3 * [0.01], 0.04), (0.0, 0.02, [0.12, 0.12, 0.02], 0.05)],
)
def test_each_group_of_shared_loads_has_its_own_margin(
    load: float, brush: float, slider: list[float], block: float, exported
) -> None:
    """Three frictions of a slider share F, a table and two guides what pushes a block: 12 - F = 3 t, |T| = 5 - t.

    The greatest least margins: those of the other group were the ones of any loads, and jumped from time to time. Where
    they exceed the least one by 1 % of the weight, 10 N, no more is told.
    """
    table = np.array([0.6, 0.8]) * (5 - block)
    values = {"F": load, "B": brush, "X": table[0] + 2 - block, "Y": table[1] + 1 - block}
    _, indicators = fixed_steps(exported(read(SHARED, "shared.toml")).path, values, [], 0.1, 0.1, EULER)
    assert indicators[:, 1:] == pytest.approx(np.tile([block, *slider, block, block], (2, 1)), abs=1e-7)


@pytest.mark.parametrize(("load", "shares"), [(2.7, (0.9, 0.9, 0.9)), (9.0, (4, 4, 1)), (11.4, (5.4, 5, 1))])
def test_shared_loads_are_those_of_least_norm(load: float, shares: tuple[float, ...], exported) -> None:
    """Equal forces of 6, 5 and 1 N at most, less where one of them bears no more."""
    names = [f"{name}_force" for name in ("guide", "seal", "brush")]
    rows, _ = fixed_steps(exported(read(SHARED, "shared.toml")).path, {"F": load}, names, 0.1, 0.1, EULER)
    assert -rows == pytest.approx(np.tile(shares, (2, 1)), abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("family", "stop"), [("engaged", 1.0), ("loop", 0.5)])
def test_the_direct_integration_passes_dead_centres_too(family: str, stop: float) -> None:
    """The clutch engages while the crank is at rest in its dead centre; a crank passes six others until 0.5 s."""
    report = lag2fmu.validate(mechanism(family), stop_time=stop)
    assert report.outcome == "ok", str(report)


CORNER = """
[mechanism]
name = "corner"
[parameters]
mu = { value = 0 }
[coordinates]
x = { start = 0.5 }
y = { start = 0.3 }
z = { start = 0.4 }
[bodies]
point = { mass = 2, position = ["x", "y", "z"] }
[forces]
x = "-7"
y = "-9"
z = "-8"
[contacts]
floor = { gap = "z", slip = ["x_dot", "y_dot"], friction = "mu" }
wall = { gap = "x", slip = ["y_dot", "z_dot"], friction = "mu" }
side = { gap = "y", slip = "x_dot", friction = "mu" }
"""


def test_a_corner_without_friction_bears_by_its_faces_alone(exported) -> None:
    """Contacts that stuck at a limit of 0 shared the load that other faces bear, and the run ended there."""
    forces = {"floor_force": 8, "wall_force": 7, "side_force": 9}
    rubs = ["floor_friction_1", "floor_friction_2", "wall_friction_1", "wall_friction_2", "side_friction"]
    run = lag2fmu.simulate(exported(read(CORNER, "corner.toml")), stop_time=1, step=0.05, outputs=["x", *forces, *rubs])
    assert run["x"] == pytest.approx(np.maximum(0.5 - 7 / 4 * run.time**2, 0), abs=1e-9)
    assert run.columns(list(forces))[-1] == pytest.approx(list(forces.values()), rel=1e-9)
    assert (run.columns(rubs)[-1] == 0).all()


PRESSED = """
[mechanism]
name = "pressed"
[coordinates]
x = { velocity = 1 }
y = { start = 0 }
[bodies]
block = { mass = 1, position = ["x", "y"] }
[forces]
y = "-10"
[contacts.floor]
gap = "y"
slip = "x_dot"
friction = 0.5
[frictions.guide]
on = "y_dot"
force = 0.5
"""


@pytest.mark.parametrize("way", ["co-simulation", "CVode"])
def test_what_a_floor_holds_leaves_nothing_to_a_friction_beside_it(way: str, exported) -> None:
    """The block slides on while the guide, whose share of the weight would be beyond its limit, bears nothing."""
    options = MODEL_EXCHANGE if way == "CVode" else {}
    names = ["x", "x_dot", "floor_force", "guide_force"]
    run = lag2fmu.simulate(exported(read(PRESSED, "p.toml")), stop_time=0.5, step=0.01, outputs=names, **options)
    slides, time = run.time < 0.195, np.minimum(run.time, 0.2)
    exact = 1e-6 if way == "CVode" else 1e-12
    assert run["x_dot"] == pytest.approx(1 - 5 * time, abs=exact)
    assert run["x"] == pytest.approx(time - 2.5 * time**2, abs=exact)
    assert run["floor_force"][slides] == pytest.approx(10)
    assert (run["guide_force"][slides] == 0).all()
    assert (run["floor_force"] + run["guide_force"])[-1] == pytest.approx(10)


LEAP = """
[mechanism]
name = "leap"
[coordinates]
x = { velocity = 2 }
y = {}
[energy]
kinetic = "(x_dot**2 + y_dot**2)/2"
potential = "9.81*y"
[contacts.track]
gap = "y + 2*smooth(max(x - 1, 0))**2"
"""


@pytest.mark.parametrize(
    ("solver", "kind"), [*((s, "co-simulation") for s in ("dopri5", "rk4", "radau5")), ("dopri5", "model-exchange")]
)
def test_a_bead_leaves_its_track_where_its_force_jumps_below_zero(solver: str, kind: str, exported) -> None:
    """The curvature of the track jumps where x = 1, at 0.5 s, and solver steps may pass this place."""
    fmu = exported(read(LEAP, "leap.toml"), solver=solver)
    run = lag2fmu.simulate(fmu, stop_time=0.8, step=0.03, outputs=["y", "track_force"], kind=kind)
    assert run["y"] == pytest.approx(-G / 2 * np.maximum(run.time - 0.5, 0) ** 2, abs=1e-6)
    assert run["track_force"] == pytest.approx(np.where(run.time < 0.5, G, 0))
    assert lag2fmu.validate(fmu, stop_time=0.8).passed
