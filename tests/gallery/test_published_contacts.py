"""Motions with contacts that textbooks solve, written as text."""

from collections.abc import Callable
from math import cos, sin

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from lag2fmu import simulate
from lag2fmu.fmu import Fmu
from lag2fmu.formats.text import read
from lag2fmu.verify.run import Kind

pytestmark = pytest.mark.fmu

G = 9.81

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

BOX = """
[mechanism]
name = "box_on_feet"
[coordinates]
x = { unit = "m" }
y = { unit = "m", start = 0.5 }
turn = { unit = "rad" }
[points]
rear = { position = ["x - 0.5*cos(turn) + 0.5*sin(turn)", "y - 0.5*cos(turn) - 0.5*sin(turn)"] }
front = { position = ["x + 0.5*cos(turn) + 0.5*sin(turn)", "y - 0.5*cos(turn) + 0.5*sin(turn)"] }
[gravity]
acceleration = 10
[bodies.box]
mass = 1
inertia = 0.2
position = ["x", "y"]
angle = "turn"
[forces]
x = "t"
[contacts]
rear = { kind = "point_line", between = ["rear", "world"], normal = "y", friction = 0.3 }
front = { kind = "point_line", between = ["front", "world"], normal = "y", friction = 0.3 }
"""

LADDER = """
[mechanism]
name = "ladder"
[parameters]
l = { value = 2, unit = "m" }
s = { value = 0.1, unit = "m/s" }
[coordinates]
x = { unit = "m", start = 0.5646424733950354 }
y = { unit = "m", start = 0.8253356149096783 }
a = { unit = "rad", start = 0.6 }
[gravity]
acceleration = 9.81
[bodies]
ladder = { mass = 3, inertia = 1, position = ["x", "y"], angle = "a" }
man = { mass = 30, position = ["x + (l/2 - s*t)*sin(a)", "y - (l/2 - s*t)*cos(a)"] }
[contacts]
wall = { gap = "x - l/2*sin(a)", slip = "y_dot - l/2*sin(a)*a_dot", friction = 0.4 }
floor = { gap = "y - l/2*cos(a)", slip = "x_dot + l/2*cos(a)*a_dot", friction = 0.4 }
"""

BILLIARD = """
[mechanism]
name = "billiard"
[coordinates]
x = { unit = "m", start = 0.3, velocity = 1 }
y = { unit = "m", start = 0.1, velocity = 0.77 }
[bodies.ball]
mass = 1
position = ["x", "y"]
[contacts.cushion]
gap = "1 - (x/2)**2 - y**2"
restitution = 1
"""

TABLE = """
[mechanism]
name = "shaken_table"
[parameters]
A = { value = 0.01, unit = "m" }
w = { value = 35, unit = "rad/s" }
[coordinates]
y = { unit = "m", start = 0.02 }
[gravity]
acceleration = 9.81
[bodies.ball]
mass = 1
position = [0, "y"]
[contacts.table]
gap = "y - A*sin(w*t)"
restitution = 0.5
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


def test_a_box_on_two_feet_slips_when_all_friction_is_used_up(exported: Callable[..., Fmu]) -> None:
    """At mu m g, though the feet share it in many ways and the load moves from one to the other (Amontons, 1699).

    Of these ways the forces are those of least norm that stay in their cones: half of the pull each, as long as
    0.5 t <= 0.3 (5 - 0.5 t), and the most that the rear one can bear after that.
    """
    box = exported(read(BOX, "box.toml"))
    names = ("x", "x_dot", "rear_mode", "rear_force", "rear_friction", "front_force", "front_friction")
    for kind in ("co-simulation", "model-exchange"):
        run = simulate(box, stop_time=5.0, step=0.1, tolerance=1e-9, kind=kind, outputs=names)
        rests = run.time < 2.95
        assert (run["rear_mode"][rests] == 2).all()
        assert run["x_dot"] == pytest.approx(np.maximum(run.time - 3, 0) ** 2 / 2, abs=1e-7)
        pull, rear = run.time[rests], 5 - run.time[rests] / 2
        assert run["rear_force"][rests] == pytest.approx(rear, rel=1e-9)
        assert -run["rear_friction"][rests] == pytest.approx(np.minimum(pull / 2, 0.3 * rear), abs=1e-8)
        assert -(run["rear_friction"] + run["front_friction"])[rests] == pytest.approx(pull, abs=1e-8)


def test_a_ladder_between_rough_floor_and_wall_slips_under_who_climbs_it(exported: Callable[..., Fmu]) -> None:
    """When wall and floor both bear all the friction they can: S. L. Loney, Elements of Statics, chapter on friction.

    Then N_floor = W/(1 + mu^2) and N_wall = mu N_floor; moments about the foot give the place of the man.
    """
    length, mu, a, own, man = 2.0, 0.4, 0.6, 3 * G, 30 * G
    wall = mu * (own + man) / (1 + mu**2)
    slips = (wall * length * (np.cos(a) + mu * np.sin(a)) / np.sin(a) - own * length / 2) / man / 0.1
    names = ("a", "wall_force", "wall_friction", "floor_force", "floor_friction", "wall_mode")
    run = simulate(
        exported(read(LADDER, "ladder.toml")), stop_time=slips + 0.3, step=0.01, tolerance=1e-9, outputs=names
    )
    moved = int(np.argmax(run["a"] > 0.6 + 1e-9))
    assert 0 < run.time[moved] - slips < 0.03
    for contact in ("wall", "floor"):
        friction, force = np.abs(run[f"{contact}_friction"]), run[f"{contact}_force"]
        assert (friction <= 0.4 * force + 1e-8 * own).all()


def test_thirty_feet_under_one_body_stick_and_share_its_weight(exported: Callable[..., Fmu]) -> None:
    """Rounding errors of many redundant rows start no slip. Each force is measured by the acceleration it causes.

    Of forces f at the distances p from the centre of mass the least sum of f^2 (1/m + p^2/I) is that of forces
    inversely to that factor.
    """
    m, inertia, feet = 2.0, 0.1, 30
    p = (np.arange(feet) - 14.5) / feet
    text = ['[mechanism]\nname = "feet"\n[coordinates]\nx = {}\nz = {}\na = { unit = "rad" }']
    text += [f'[bodies.plate]\nmass = {m}\ninertia = {inertia}\nposition = ["x", "z"]\nangle = "a"']
    text += [f"[gravity]\nacceleration = {G}"]
    text += [f'[contacts.f{k}]\ngap = "z + {p[k]}*sin(a)"\nslip = "x_dot"\nfriction = 0.5' for k in range(feet)]
    names = ("x", *(f"f{k}_force" for k in range(feet)), *(f"f{k}_mode" for k in range(feet)))
    run = simulate(exported(read("\n".join(text), "feet.toml")), stop_time=1.0, step=0.5, outputs=names)
    parts = 1 / (1 / m + p**2 / inertia)
    assert (run["x"] == 0).all()
    for k in range(feet):
        assert (run[f"f{k}_mode"] == 2).all()
        assert run[f"f{k}_force"] == pytest.approx(m * G * parts[k] / parts.sum(), rel=1e-9)


PULLED = """
[mechanism]
name = "pulled"
[coordinates]
x = {}
y = {}
z = {}
[gravity]
acceleration = 10
[bodies.puck]
mass = 1
position = ["x", "y", "z"]
[contacts.floor]
kind = "point_plane"
between = ["puck", "world"]
normal = "z"
friction = 0.3
[forces]
x = "t"
y = "t**2/3"
"""


def _pulled_puck(begins: float, end: float) -> np.ndarray:
    """x, y and their rates at ``end`` (s). Friction keeps its first direction up to 1e-8 m/s, where nothing turns."""
    first = np.array([begins, begins**2 / 3]) / 3

    def slope(t: float, state: np.ndarray) -> np.ndarray:
        slip = state[2:] + 1e-8 * first
        return np.array([*state[2:], *(np.array([t, t**2 / 3]) - 3 * slip / np.linalg.norm(slip))])

    found: np.ndarray = solve_ivp(slope, (begins, end), np.zeros(4), method="Radau", rtol=1e-9, atol=1e-13).y[:, -1]
    return found


@pytest.mark.parametrize(
    ("solver", "tolerance", "bar"),
    [
        ("dopri5", 1e-6, 1e-6),
        ("dopri5", 1e-9, 2e-9),
        ("dop853", 1e-8, 2e-9),
        ("radau5", 1e-6, 1e-6),
        ("rk4", 1e-6, 1e-5),
    ],
)
def test_a_slip_in_space_begins_when_the_pull_exceeds_friction(
    exported: Callable[..., Fmu], solver: str, tolerance: float, bar: float
) -> None:
    """The pull (t, t^2/3) exceeds 3 N where t^2 (1 + t^2/9) = 9 s^2, and turns while the slip begins."""
    begins = np.sqrt((np.sqrt(1 + 4) - 1) / 2 * 9)
    end = begins + 2
    names = ("x", "y", "x_dot", "y_dot")
    run = simulate(
        exported(read(PULLED, "pulled.toml"), solver=solver),
        stop_time=end,
        step=end / 7,
        tolerance=tolerance,
        outputs=names,
    )
    assert [run[name][-1] for name in names] == pytest.approx(_pulled_puck(begins, end), abs=2 * bar)


TURNTABLE = """
[mechanism]
name = "turntable"
[coordinates]
x = { start = 0.2 }
y = {}
z = {}
[gravity]
acceleration = 9.81
[definitions]
w = "0.5*t"
[bodies.block]
mass = 1
position = ["x", "y", "z"]
[contacts.table]
gap = "z"
slip = ["x_dot + w*y", "y_dot - w*x"]
friction = 0.3
"""


@pytest.mark.parametrize("solver", ["dopri5", "radau5"])
def test_a_block_leaves_its_place_on_a_turntable_that_spins_up(exported: Callable[..., Fmu], solver: str) -> None:
    """It sticks up to the speed w where (w^2 r)^2 + (r/2)^2 = (mu g)^2, and spirals outwards from there."""
    r, limit = 0.2, 0.3 * G
    begins = 2 * np.sqrt(np.sqrt(limit**2 - (r / 2) ** 2) / r)
    along, across = np.exp(0.25j * begins**2) * np.array([1, 1j])
    pull = -((begins / 2) ** 2) * r * along + r / 2 * across

    def slope(t: float, state: np.ndarray) -> np.ndarray:
        place, velocity = state[0] + 1j * state[1], state[2] + 1j * state[3]
        slip = velocity - 0.5j * t * place - 1e-8 * pull / limit
        friction = -limit * slip / abs(slip)
        return np.array([velocity.real, velocity.imag, friction.real, friction.imag])

    at, velocity = r * along, begins / 2 * r * across
    start = [at.real, at.imag, velocity.real, velocity.imag]
    free = solve_ivp(slope, (begins, 9.0), start, method="Radau", rtol=1e-9, atol=1e-13).y[:2, -1]
    table = exported(read(TURNTABLE, "turntable.toml"), solver=solver)
    run = simulate(table, stop_time=9.0, step=0.5, tolerance=1e-8, outputs=("x", "y"))
    assert [run["x"][-1], run["y"][-1]] == pytest.approx(list(free), abs=1e-6)


FOUR_FEET = """
[mechanism]
name = "table"
[parameters]
e = { value = 0, unit = "1" }
pull = { value = 0, unit = "N/s" }
[coordinates]
x = { velocity = 1.0 }
y = { velocity = 0.5 }
z = { start = 0.5 }
a = { unit = "rad" }
b = { unit = "rad" }
c = { unit = "rad", velocity = 2.0 }
[gravity]
acceleration = 10
[forces]
x = "4*pull*t/5"
y = "3*pull*t/5"
[frames.top]
origin = ["x", "y", "z"]
rotations = [["x", "a"], ["y", "b"], ["z", "c"]]
[bodies.box]
mass = 1
inertia = ["1/5", "1/5", "1/5", 0, 0, 0]
frame = "top"
""" + "".join(
    f"""
[points.p{k}]
frame = "top"
position = [{x}, {y}, -0.5]
[contacts.l{k}]
kind = "point_plane"
between = ["p{k}", "world"]
normal = "z"
friction = 0.3
restitution = "e"
"""
    for k, (x, y) in enumerate([(0.5, 0.4), (-0.5, 0.4), (0.5, -0.4), (-0.5, -0.4)], 1)
)


def _sliding_table(_: float, state: np.ndarray) -> np.ndarray:
    """Positions and velocities (x, y, c): feet press with forces that are linear in their places, as a bed of springs.

    The feet at half the height 1/2 bear the weight and the moments of friction, which follows from what they bear.
    """
    c, v = state[2], state[3:]
    turn = np.array([[np.cos(c), -np.sin(c)], [np.sin(c), np.cos(c)]])
    feet = np.array([[0.5, 0.4], [-0.5, 0.4], [0.5, -0.4], [-0.5, -0.4]]) @ turn.T
    slips = v[:2] + v[2] * np.column_stack([-feet[:, 1], feet[:, 0]])
    ways = -0.3 * slips / np.linalg.norm(slips, axis=1)[:, None]
    linear = np.column_stack([np.ones(4), feet])
    balance = np.vstack([np.ones(4), feet.T + 0.5 * ways.T]) @ linear
    friction = (linear @ np.linalg.solve(balance, [10, 0, 0]))[:, None] * ways
    torque = feet[:, 0] @ friction[:, 1] - feet[:, 1] @ friction[:, 0]
    return np.array([*v, *friction.sum(axis=0), torque / 0.2])


@pytest.fixture(scope="module")
def table(exported: Callable[..., Fmu]) -> Fmu:
    """The table on four feet."""
    return exported(read(FOUR_FEET, "table.toml"))


def test_a_table_slides_and_spins_to_rest_on_four_feet(table: Fmu) -> None:
    """Slip and spin end together (Z. Farkas and others, Physical Review Letters 90, 2003), at all four feet at once."""
    free = solve_ivp(_sliding_table, (0.0, 0.46), [0, 0, 0, 1, 0.5, 2], rtol=1e-11, atol=1e-12)
    for step, tolerance in ((0.1, 1e-6), (0.01, 1e-8), (0.004, 1e-5)):
        names = ("x", "y", "c", "x_dot", "y_dot", "c_dot", "l1_mode", "l4_mode")
        run = simulate(table, stop_time=0.6, step=step, tolerance=tolerance, outputs=names)
        assert {run["l1_mode"][-1], run["l4_mode"][-1]} == {2}
        assert np.abs([run[name][-1] for name in names[3:6]]).max() < 1e-12
        assert [run[name][-1] for name in names[:3]] == pytest.approx(free.y[:3, -1], abs=1e-5)


@pytest.mark.parametrize(
    ("z", "a", "c_dot", "x_dot", "y_dot", "e"),
    [
        (0.6059997486360102, -0.06680441720775661, 0.0, 0.0, -0.06881617857544492, 0.1),
        (0.6918707393289782, -0.10991847864419982, -0.7732882141568471, 0.0, -0.09618330775512754, 0.5),
    ],
    ids=["straight", "turning"],
)
def test_a_table_that_drops_on_its_feet_comes_to_rest(
    table: Fmu, z: float, a: float, c_dot: float, x_dot: float, y_dot: float, e: float
) -> None:
    """Two feet still rebound, less than is seen, while two stick: no forces keep all four closed in that motion."""
    start = {"z": z, "a": a, "c_dot": c_dot, "x_dot": x_dot, "y_dot": y_dot, "e": e}
    feet = [f"l{k}_{what}" for what in ("mode", "force", "gap") for k in (1, 2, 3, 4)]
    run = simulate(table, stop_time=3.0, step=0.3, tolerance=1e-6, values=start, outputs=[*feet, "z"])
    assert [run[name][-1] for name in feet[:4]] == [2, 2, 2, 2]
    assert sum(run[name][-1] for name in feet[4:8]) == pytest.approx(10.0, rel=1e-9)
    assert min(run[name].min() for name in feet[8:]) > -1e-9
    assert run["z"][-1] == pytest.approx(0.5, abs=1e-9)


def test_a_table_that_is_pulled_across_its_sides_slides(table: Fmu) -> None:
    """Beyond 3 N the rest of the pull of t N accelerates it; it slides (t - 3)^3/6 m without turning."""
    still = {"x_dot": 0.0, "y_dot": 0.0, "c_dot": 0.0, "pull": 1.0}
    for step, tolerance in ((1.0, 1e-6), (0.01, 1e-8)):
        names = ("x", "y", "c", "l1_mode", "l2_mode", "l3_mode", "l4_mode")
        run = simulate(table, stop_time=4.0, step=step, tolerance=tolerance, values=still, outputs=names)
        assert [run[name][-1] for name in names] == pytest.approx([0.8 / 6, 0.6 / 6, 0, 3, 3, 3, 3], abs=1e-9)


def test_an_impact_lifts_a_foot_whose_rebounds_have_ended(table: Fmu) -> None:
    """One foot is about to rest when another one strikes: what the table loses is what impacts and friction take."""
    start = {"z": 0.6274041761965821, "a": -0.06615827558180837, "b": 0.12945386506107256, "e": 0.3}
    start |= {"x_dot": 0.0, "y_dot": 0.03364921217945033, "c_dot": 0.022136195064149877}
    names = ["total_energy", "dissipated_energy", "l3_impacts"]
    run = simulate(table, stop_time=0.2, step=0.001, tolerance=1e-6, values=start, outputs=names)
    assert run["l3_impacts"][-1] >= 1
    assert np.ptp(run["total_energy"] + run["dissipated_energy"]) < 1e-6


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_a_table_on_four_feet_does_not_creep(kind: Kind, table: Fmu) -> None:
    """Nothing pulls: friction is a rounding error of what the feet bear, and moves the table by nothing in a day."""
    at_rest = {"x_dot": 0.0, "y_dot": 0.0, "c_dot": 0.0}
    run = simulate(table, stop_time=1e5, step=2e4, kind=kind, values=at_rest)
    assert not np.ptp(run.values, axis=0).any()


def test_a_ball_in_an_elliptic_billiard_keeps_the_product_of_its_momenta_about_the_foci(
    exported: Callable[..., Fmu],
) -> None:
    """G. D. Birkhoff, Dynamical Systems, 1927, chapter 8."""
    run = simulate(
        exported(read(BILLIARD, "billiard.toml")),
        stop_time=100.0,
        step=1.0,
        tolerance=1e-9,
        beside=("cushion_impacts",),
    )
    x, y, u, v = (run[name] for name in ("x", "y", "x_dot", "y_dot"))
    product = ((x - np.sqrt(3)) * v - y * u) * ((x + np.sqrt(3)) * v - y * u)
    assert run["cushion_impacts"][-1] == 61
    assert product == pytest.approx(np.full(len(run), product[0]), rel=1e-11)


def test_a_ball_bounces_in_step_with_a_shaken_table(exported: Callable[..., Fmu]) -> None:
    """Once a period, at the phase whose cosine is pi g (1 - e)/(A w^2 (1 + e)): P. J. Holmes, 1982."""
    e, amplitude, w = 0.5, 0.01, 35.0
    phase, launched, period = (
        np.arccos(np.pi * G * (1 - e) / (amplitude * w**2 * (1 + e))),
        np.pi * G / w,
        2 * np.pi / w,
    )
    flown = (2 * np.pi - phase) / w
    y, v = amplitude * np.sin(phase) + launched * flown - G * flown**2 / 2, launched - G * flown
    table = exported(read(TABLE, "table.toml"))
    for kind in ("co-simulation", "model-exchange"):
        run = simulate(
            table, stop_time=30 * period, step=period, tolerance=1e-10, kind=kind, values={"y": y, "y_dot": v}
        )
        assert run["y"] == pytest.approx(np.full(31, y), abs=1e-6)


BOX_IN_SPACE = f"""
[mechanism]
name = "box"
[coordinates]
x = {{ unit = "m" }}
y = {{ unit = "m" }}
z = {{ unit = "m", start = 0.1 }}
rx = {{ unit = "rad" }}
ry = {{ unit = "rad" }}
rz = {{ unit = "rad" }}
[frames.box]
origin = ["x", "y", "z"]
rotations = [["z", "rz"], ["y", "ry"], ["x", "rx"]]
[bodies.box]
frame = "box"
mass = 2
inertia = [0.02, 0.03, 0.04, 0, 0, 0]
[gravity]
acceleration = {G}
direction = [{sin(0.5)!r}, 0, {-cos(0.5)!r}]
"""


def box_on_an_incline() -> str:
    """A free box on four feet, on a plane that is turned by 0.5 rad; friction 0.3 does not hold it."""
    feet = [(x, y) for x in (0.2, -0.2) for y in (0.1, -0.1)]
    points = [f'[points.p{i}]\nframe = "box"\nposition = [{x}, {y}, -0.1]\n' for i, (x, y) in enumerate(feet)]
    contacts = [
        f'[contacts.c{i}]\nkind = "point_plane"\nbetween = ["p{i}", "world"]\nnormal = "z"\nfriction = 0.3\n'
        for i in range(4)
    ]
    return "\n".join([BOX_IN_SPACE, *points, *contacts])


@pytest.mark.parametrize(("solver", "tolerance"), [("dopri5", 1e-6), ("rk4", 1e-9)])
def test_a_box_on_four_feet_slides_straight_down_from_rest(solver: str, tolerance: float, exported) -> None:
    """The first loads leave one foot without any: it begins to slip as the others do."""
    box = exported(read(box_on_an_incline(), "box"), solver=solver)
    run = simulate(box, stop_time=0.3, step=0.1, tolerance=tolerance)
    assert run["x"][-1] == pytest.approx(G * (sin(0.5) - 0.3 * cos(0.5)) * 0.3**2 / 2, rel=1e-9)
    assert (run["y"][-1], run["rz"][-1]) == pytest.approx((0, 0), abs=1e-9)
