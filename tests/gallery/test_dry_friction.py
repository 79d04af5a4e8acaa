"""Dry friction: sticking and sliding against closed forms (g = 9.81)."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import lag2fmu
from lag2fmu.errors import SimulationError
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Body, Constraint, Contact, Energy, Friction, Mechanism, coordinate, parameter
from lag2fmu.verify.simulate import Run, simulate_fmu

pytestmark = pytest.mark.fmu

G = 9.81
OPEN, STICKS, SLIDES, FORWARD, BACKWARD = 1, 2, 3, 4, 5


@pytest.mark.parametrize("steps", [50, 500])
def test_an_oscillator_stops_where_friction_holds_it(steps: int, motion) -> None:
    """Half swings about F/k and -F/k; after 8 of them it is at 0.2 and stays there without creeping."""
    run = motion("coulomb_oscillator", 30.0, steps, 1e-9, ("x", "x_dot", "floor_mode", "floor_force"))
    half = np.minimum(np.floor(run.time / np.pi), 8.0)
    amplitude = np.where(half < 8, 5.0 - 0.3 - 0.6 * half, 0.0)
    middle = np.where(half < 8, 0.3 * (-1) ** half, 0.2)
    assert run["x"] == pytest.approx(middle + amplitude * np.cos(run.time), abs=1e-7)
    rest = run.time > 8 * np.pi + 1e-8
    moving = (run.time > 0) & ~rest
    assert (run["floor_mode"][rest] == STICKS).all()
    assert (run["x_dot"][rest] == 0.0).all()
    assert np.ptp(run["x"][rest]) == 0.0
    assert (run["floor_mode"][moving] == np.where(half[moving] % 2, FORWARD, BACKWARD)).all()
    assert run["floor_force"][rest] == pytest.approx(np.full(rest.sum(), 0.2), abs=1e-7)


def test_what_holds_is_at_least_what_slides(motion) -> None:
    runs = [motion("block_on_belt", 12.0, 50, F_s=held) for held in (0.5, 0.3)]
    assert runs[0].values.tolist() == runs[1].values.tolist()


def test_a_block_sticks_and_slides_on_a_belt(motion) -> None:
    """Three periods of 2 D/v + (2 pi - 2 atan(D w/v))/w; it sticks for 2 D/v, then slides about F_k/k."""
    D, v, stick = 0.5, 0.2, 5.0
    period = stick + 2 * np.pi - 2 * np.arctan(D / v)
    assert period == pytest.approx(8.902605407814523, abs=1e-14)
    run = motion("block_on_belt", 3 * period, 101, 1e-9, ("x", "x_dot", "belt_mode"))
    since = run.time % period
    sliding = 0.5 + D * np.cos(since - stick) + v * np.sin(since - stick)
    assert run["x"][:-1] == pytest.approx(np.where(since < stick, v * since, sliding)[:-1], abs=1e-7)
    assert run["x"][-1] == pytest.approx(0.0, abs=1e-7)
    assert run["x_dot"][-1] == pytest.approx(v, abs=1e-7)
    assert ((run["belt_mode"] == STICKS) == (since <= stick))[:-1].all()


def test_a_clutch_locks(motion) -> None:
    """At (w1 - w2)/(T/J1 + T/J2), with J1 J2 (w1 - w2)^2/(2 (J1 + J2)) lost; then both turn evenly."""
    run = motion("clutch_pair", 10.0, 300, 1e-9, ("phi1_dot", "phi2_dot", "kinetic_energy", "clutch_mode"))
    common = 100 / 3
    assert run["phi1_dot"] == pytest.approx(np.maximum(100 - 10 * run.time, common), rel=1e-9)
    assert run["phi2_dot"] == pytest.approx(np.minimum(5 * run.time, common), rel=1e-9)
    assert run["kinetic_energy"][0] - run["kinetic_energy"][-1] == pytest.approx(10000 / 3, rel=1e-9)
    for moved, mode in ((-1e-9, FORWARD), (1e-9, STICKS)):
        assert motion("clutch_pair", 20 / 3 + moved, 1, 1e-9, ("clutch_mode",))["clutch_mode"][-1] == mode


@pytest.mark.parametrize(("force", "load"), [(100.0, 5.0), (40.0, 5.0), (100.0, -30.0)])
def test_a_brake_stops_a_drum_and_holds_it(force: float, load: float, motion) -> None:
    """It bears mu r l F/(a - mu c); a load beyond that turns the drum on, or back after it has stopped."""
    bears = 0.4 * 0.15 * 0.5 * force / (0.2 - 0.4 * 0.1)
    stop = 60.0 * 0.4 / (bears - load)
    run = motion("brake", 4.0, 101, 1e-9, ("phi_dot", "shoe_mode", "shoe_force"), F=force, M=load)
    after = np.copysign(max(abs(load) - bears, 0.0), load) / 0.4 * (run.time - stop)
    assert run["phi_dot"] == pytest.approx(np.where(run.time < stop, 60 - 60 * run.time / stop, after), abs=1e-7)
    late = run.time > max(stop, 0) + 1e-9
    assert (run["shoe_mode"][late] == (STICKS if abs(load) <= bears else BACKWARD)).all()


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_a_friction_that_would_push_ends_the_run(kind: str, exported) -> None:
    """The force on the lever falls through 0 at 0.2 s."""
    ramp = {"time": [0.0, 0.4], "F": [100.0, -100.0]}
    with pytest.raises(SimulationError, match=r"at time 0\.2.* dry friction shoe is -.*; expected 0 or more"):
        lag2fmu.simulate(exported("brake"), stop_time=0.4, step=0.01, inputs=ramp, kind=kind)


@pytest.mark.parametrize("spin", [(0.0, 0.0, 0.0), (40.0, -30.0, 20.0), (-100.0, 60.0, -5.0)])
def test_a_sphere_slides_on_a_parabola_and_rolls(spin: tuple[float, float, float], motion) -> None:
    """The point that slides keeps its direction s; it stops after 2 |u|/(7 mu g), and the ball rolls straight on."""
    R, mu, v = 0.03, 0.2, np.array([5.0, 0.0])
    slip = v - R * np.array([spin[1], -spin[0]])
    s, end = slip / np.hypot(*slip), 2 * np.hypot(*slip) / (7 * mu * G)
    starts = {f"e{i}_dot": w / 2 for i, w in enumerate(spin, 1)}
    run = motion("sliding_sphere", 1.5, 60, 1e-10, ("x", "y", "x_dot", "y_dot", "table_mode", "table_force"), **starts)
    t = run.time[:, None]
    sliding = v * t - mu * G * s * t**2 / 2
    rolling = v * end - mu * G * s * end**2 / 2 + (v - mu * G * s * end) * (t - end)
    assert run.columns(["x", "y"]) == pytest.approx(np.where(t < end, sliding, rolling), abs=1e-7)
    assert run.columns(["x_dot", "y_dot"])[-1] == pytest.approx(v - mu * G * s * end, abs=1e-7)
    assert (run["table_mode"][1:] == np.where(run.time[1:] < end, SLIDES, STICKS)).all()
    assert run["table_force"] == pytest.approx(np.full(61, 0.2 * G), rel=1e-7)


def test_rolling_begins_at_five_sevenths(motion) -> None:
    """A ball without spin: v0 = 5, mu = 0.2 gives 2 v0/(7 mu g) = 0.72811998 s."""
    for moved, mode in ((-1e-9, SLIDES), (1e-9, STICKS)):
        run = motion("sliding_sphere", 10 / (1.4 * G) + moved, 1, 1e-9, ("table_mode", "x_dot"))
        assert run["table_mode"][-1] == mode
    assert run["x_dot"][-1] == pytest.approx(25 / 7, abs=1e-8)


def test_a_wheel_locks_and_skids(motion) -> None:
    """The road turns the wheel with mu m g r at most: the brake stops it, then the car slides to rest."""
    mu, m, J, r, T = 0.8, 300.0, 1.2, 0.3, 1000.0
    lock, stop = 100 * J / (T - mu * m * G * r), 30 / (mu * G)
    run = motion("braked_wheel", 5.0, 101, 1e-9, ("x", "x_dot", "phi_dot", "road_mode", "brake_mode"))
    t = np.minimum(run.time, stop)
    assert run["x"] == pytest.approx(30 * t - mu * G * t**2 / 2, abs=1e-6)
    assert run["phi_dot"] == pytest.approx(np.maximum(100 * (1 - run.time / lock), 0.0), abs=1e-7)
    assert (run["x_dot"][run.time > stop] == 0.0).all()
    assert (run["brake_mode"][1:] == np.where(run.time[1:] < lock, FORWARD, STICKS)).all()
    assert (run["road_mode"][1:] == np.where(run.time[1:] < stop, FORWARD, STICKS)).all()


def test_a_wheel_that_is_braked_less_rolls_to_rest(motion) -> None:
    """Below mu g r (m + J/r^2) = 737.7 N.m the car loses T/(r (m + J/r^2)) a second."""
    m, J, r, T = 300.0, 1.2, 0.3, 700.0
    loss = T / (r * (m + J / r**2))
    run = motion("braked_wheel", 5.0, 101, 1e-9, ("x_dot", "phi_dot", "road_mode", "road_friction"), T=T)
    rolling = np.maximum(30 - loss * run.time, 0.0)
    assert run["x_dot"] == pytest.approx(rolling, abs=1e-7)
    assert run["phi_dot"] == pytest.approx(rolling / r, abs=1e-6)
    assert (run["road_mode"] == STICKS).all()
    assert abs(run["road_friction"][1]) == pytest.approx(m * loss, rel=1e-9)


# ------------------------------------------------------------------------------------------------------ falling rod


def test_a_rod_falls_without_friction(motion) -> None:
    """The centre falls straight down: phi_dot^2 = 12 g (sin(phi0) - sin(phi))/(l (1 + 3 cos(phi)^2))."""
    run = motion("falling_rod", 0.5, 50, 1e-10, ("phi", "phi_dot", "x", "foot_mode"), mu=0.0)
    falls = run["phi"] > 1e-3
    assert falls.sum() >= 20
    phi = run["phi"][falls]
    expected = 12 * G * (np.sin(1.2) - np.sin(phi)) / (1 + 3 * np.cos(phi) ** 2)
    assert run["phi_dot"][falls] ** 2 == pytest.approx(expected, abs=1e-6)
    assert run["x"][falls] + np.cos(phi) / 2 == pytest.approx(np.full(len(phi), np.cos(1.2) / 2), abs=1e-8)


def test_a_rod_that_cannot_slide_stops_at_once(motion) -> None:
    """At tan(phi) = 2 nothing can bear a rod that slides toward its centre with mu > 4/3 (Painleve).

    The impact without a collision lasts until the end sticks: the moment of momentum about it stays.
    """
    phi = np.arctan(2.0)
    for mu, stops in ((1.3, False), (1.4, True)):
        starts = {"phi": phi, "x_dot": -1.0, "mu": mu}
        run = motion("falling_rod", 1e-6, 1, 1e-9, ("x_dot", "y_dot", "phi_dot"), **starts)
        expected = [0.0, 0.0, 1.5 * np.sin(phi)] if stops else [-1.0, 0.0, 0.0]
        assert run.values[-1] == pytest.approx(expected, abs=5e-3)


@pytest.mark.parametrize(
    ("spin", "words"),
    [
        (0.0, "sliding friction left no forces that obey their laws (Painleve's paradox; foot"),
        (-6.0, "friction allows two motions (Painleve's paradox; foot"),
    ],
    ids=["none", "two"],
)
def test_the_log_speaks_of_painleves_paradox(spin: float, words: str, exported) -> None:
    """Once: a rod at rest can bear no force; the end of one that spins fast may rise by itself, or be pressed down."""
    sentences: list[str] = []
    values = {"phi": np.arctan(2.0), "phi_dot": spin, "x_dot": -1.0, "mu": 1.4}
    simulate_fmu(exported("falling_rod").path, Run(stop_time=0.02, step=0.01, values=values, warned=sentences.append))
    (sentence,) = sentences
    assert words in sentence


WEDGE = read(
    """
[mechanism]
name = "wedge"
title = "A bead on a straight wire that rises by b is thrown against a rough ceiling 0.1 m above"
[parameters]
b = { value = 0.4, unit = "rad" }
mu = { value = 0.5, unit = "1" }
h = { value = 0.1, unit = "m" }
[coordinates]
s = { unit = "m", velocity = 3.0 }
[bodies]
bead = { mass = 1, position = ["s*cos(b)", "s*sin(b)"] }
[gravity]
acceleration = 9.81
[contacts]
ceiling = { gap = "h - s*sin(b)", slip = "s_dot*cos(b)", friction = "mu" }
""",
    "wedge",
)


@pytest.mark.parametrize(
    ("kind", "solver"), [("co-simulation", "dopri5"), ("model-exchange", "dopri5"), ("co-simulation", "moreau")]
)
@pytest.mark.parametrize("mu", [0.5, 0.4])
def test_a_bead_that_an_impact_wedges_in_stays(kind: str, solver: str, mu: float, exported) -> None:
    """It stays where mu > tan(b) = 0.42, though weight pulls it back along the wire: what the impact has pressed holds
    itself. It would fall back as well if it had not been pressed, so that the log speaks. With less friction it falls.
    """
    sentences: list[str] = []
    fmu = exported(WEDGE, solver=solver).path
    run = simulate_fmu(fmu, Run(0.6, 0.01, 1e-9, values={"mu": mu}, kind=kind, warned=sentences.append))
    top, pull = 0.1 / np.sin(0.4), G * np.sin(0.4)
    meets = (3 - np.sqrt(9 - 2 * pull * top)) / pull
    after = run.time > meets + 2e-3
    falls = 0.0 if mu > np.tan(0.4) else pull / 2 * (run.time - meets) ** 2
    exact = 1e-2 if solver == "moreau" else 1e-6
    assert run["s"][after] == pytest.approx((top - falls * np.ones(len(after)))[after], abs=exact)
    if solver != "moreau":
        assert len(sentences) == (mu > np.tan(0.4))
        assert all("friction allows two motions (Painleve's paradox; ceiling" in sentence for sentence in sentences)


# ------------------------------------------------------------------------------------------------- stack of blocks


@pytest.mark.parametrize(
    ("force", "lower", "upper"),
    [
        (20.0, 0.0, 0.0),
        (40.0, (40 - 0.4 * 6 * G) / 6, (40 - 0.4 * 6 * G) / 6),
        (60.0, (60 - 0.4 * 8 * G) / 4, 0.4 * G),
    ],
    ids=["at rest", "together", "upper slides"],
)
def test_blocks_are_pushed(force: float, lower: float, upper: float, motion) -> None:
    """The floor bears 6 g in all; its friction and that between the blocks say which of them moves."""
    outputs = ("x1", "s", "floor_left_force", "floor_right_force", "upper_left_force", "upper_right_force")
    run = motion("stack_of_blocks", 0.2, 20, 1e-9, outputs, F=force)
    assert run["x1"] == pytest.approx(lower * run.time**2 / 2, abs=1e-8)
    assert run["s"] == pytest.approx(0.15 + (upper - lower) * run.time**2 / 2, abs=1e-8)
    assert run["floor_left_force"] + run["floor_right_force"] == pytest.approx(np.full(21, 6 * G), rel=1e-8)
    assert run["upper_left_force"] + run["upper_right_force"] == pytest.approx(np.full(21, 2 * G), rel=1e-8)
    if force == 20.0:
        assert np.ptp(run.values, axis=0).max() <= 1e-9
        assert run.values[-1, 2:] == pytest.approx([3 * G, 3 * G, G, G], rel=1e-9)


@pytest.mark.parametrize(("mu", "slope"), [(0.5, 1), (1.9, 1), (3.0, 1), (0.5, -1), (1.9, -1)])
def test_a_wedge_presses_on_its_guide_with_its_friction(mu: float, slope: int, exported) -> None:
    """Friction along a slope of 30 degrees lifts it off its guide or presses it there: N = m g/(1 +- mu/2).

    From mu = 2 on it jams at any force where it is pressed.
    """
    x, y = coordinate("x", "m", velocity=100.0), coordinate("y", "m")
    m, a, f = parameter("m", 1.0, "kg"), parameter("a", 0.5, "1"), parameter("mu", 0.5, "1")
    along = sp.sqrt(3) / 2 * x.dot - a * y.dot
    guide = Friction("guide", on=along, force=f * sp.Abs(sp.Symbol("multiplier_floor", real=True)))
    wedge = Mechanism(
        "wedge",
        coordinates=[x, y],
        parameters=[m, a, f],
        bodies=[Body("wedge", m, (x, y))],
        forces={y: -m * sp.Rational(981, 100)},
        constraints=[Constraint("floor", y)],
        frictions=[guide],
    )
    run = lag2fmu.simulate(
        exported(wedge), stop_time=0.1, step=0.05, values={"mu": mu, "a": slope / 2}, outputs=["x_dot"]
    )
    load = G / (1 + slope * mu / 2)
    assert run["x_dot"][-1] == pytest.approx(100 - 0.1 * mu * load * np.sqrt(3) / 2, rel=1e-9)


def test_a_slip_in_space_comes_to_rest_between_two_points_of_the_run(exported) -> None:
    """A puck swings along a line to where it turns; interpolated points of the last step are on the line, too."""
    x, y, z = coordinate("x", "m", start=0.8), coordinate("y", "m", start=0.6), coordinate("z", "m")
    puck = Mechanism(
        "puck",
        coordinates=[x, y, z],
        bodies=[Body("puck", 1.0, (x, y, z))],
        energy=Energy(potential=8 * (x**2 + y**2) + G * z),
        contacts=[Contact("table", gap=z, slip=(x.dot, y.dot), friction=sp.Rational(3, 10))],
    )
    path = exported(puck, solver="dop853").path
    outputs = ("x", "y", "x_dot", "y_dot")
    run = simulate_fmu(path, Run(stop_time=1.2, step=0.0012, outputs=outputs))
    middle, swings = 0.3 * G / 16, run.time < np.pi / 4
    along, across = 0.8 * run["x"] + 0.6 * run["y"], 0.8 * run["y_dot"] - 0.6 * run["x_dot"]
    assert along[swings] == pytest.approx((middle + (1 - middle) * np.cos(4 * run.time))[swings], abs=1e-8)
    assert across == pytest.approx(np.zeros(len(across)), abs=1e-8)


CARRIED = """
[mechanism]
name = "carried"
[coordinates]
x = { unit = "m", velocity = 0.1 }
y = { unit = "m", velocity = 0.1 }
[bodies]
sledge = { mass = 1, position = ["x", 0] }
crate = { mass = 1, position = ["y", 0] }
[forces]
x = -1.45
y = -4.06
[frictions.ground]
on = "x_dot"
force = 1
static = 2
[frictions.bed]
on = "y_dot - x_dot"
force = 1
static = 2
"""


def test_what_holds_goes_on_to_hold_before_what_comes_to_rest(exported) -> None:
    """A sledge turns round with a crate on it. At rest the ground would bear up to 2 N, and the crate broke loose.

    The ground cannot hold both (5.51 N) and slides on, with 1 N. Then the crate needs 1.805 N of the 2 N of its bed.
    """
    fmu = exported(read(CARRIED, "carried.toml"))
    run = lag2fmu.simulate(fmu, stop_time=0.2, step=0.1, outputs=["x_dot", "y_dot", "bed_mode", "bed_force"])
    turned = 0.1 / 3.255
    assert run["x_dot"][-1] == pytest.approx(-2.255 * (0.2 - turned), rel=1e-8)
    assert run["y_dot"][-1] == pytest.approx(-2.255 * (0.2 - turned), rel=1e-8)
    assert run["bed_force"] == pytest.approx([0.805, 1.805, 1.805], rel=1e-8)
    assert (run["bed_mode"] == 2).all()
    assert lag2fmu.validate(fmu, stop_time=0.2).passed


PIECES, PIECE, GRIP = 6, 0.01, 0.3 * np.pi / 6
"""Of a rope around half a drum: how many there are, kg of each, and friction over tension of each."""


def _capstan() -> Mechanism:
    """8 kg and 100 t newtons on one side, 5 kg on the other; each piece of the rope rubs by the tension behind it."""
    rope = range(1, PIECES + 1)
    coordinates = "\n".join(f"s{i} = {{}}" for i in range(PIECES + 2))
    taut = "\n".join(f'r{i} = "s{i} - s{i + 1}"' for i in range(PIECES + 1))
    rubs = "\n".join(f'f{i} = {{ on = "s{i}_dot", force = "{GRIP}*abs(multiplier_r{i})" }}' for i in rope)
    kinetic = " + ".join(["4*s0_dot**2", f"2.5*s{PIECES + 1}_dot**2", *(f"{PIECE / 2}*s{i}_dot**2" for i in rope)])
    return read(
        f'[mechanism]\nname = "capstan"\n[coordinates]\n{coordinates}\n[energy]\nkinetic = "{kinetic}"\n[forces]\n'
        f's0 = "8*{G} + 100*t"\ns{PIECES + 1} = "-5*{G}"\n[constraints.holonomic]\n{taut}\n[frictions]\n{rubs}\n',
        "capstan.toml",
    )


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_pieces_of_a_rope_hold_as_long_as_any_tensions_do(kind: str, exported) -> None:
    """The tensions of a rope at rest are not unique, and what its pieces hold depends on them.

    It slips from 8 g + 100 t = (1 + GRIP)^6 5 g on; then a tension is (1 + GRIP) times the next one, and moves a piece.
    """
    behind, inertia = 5 * G, 5.0
    for _ in range(PIECES):
        behind, inertia = (1 + GRIP) * behind, (1 + GRIP) * inertia + PIECE
    breaks = (behind - 8 * G) / 100
    shown = ("s0_dot", "f1_mode", "f6_mode")
    fmu = exported(_capstan())
    run = simulate_fmu(fmu.path, Run(1.0, 0.05, 1e-8, outputs=shown, kind=kind))
    since = np.maximum(run.time - breaks, 0)
    assert run["s0_dot"] == pytest.approx(50 * since**2 / (8 + inertia), abs=1e-6)
    for name in ("f1_mode", "f6_mode"):
        assert (run[name] == np.where(run.time < breaks, STICKS, FORWARD)).all()
    assert lag2fmu.validate(fmu, stop_time=1.0).passed


RESISTED = {
    "damper": """
        [coordinates]
        x = { unit = "m", velocity = 2.0 }
        [bodies]
        block = { mass = 1, position = ["x", 0] }
        [dampers]
        drag = { rate = "x_dot", force = "0.3*rate*abs(rate)" }
        [frictions]
        guide = { on = "x_dot", force = 0.5 }
        """,
    "damper on a frame": """
        [coordinates]
        x = { unit = "m", velocity = 2.0 }
        [frames]
        sled = { origin = ["x", 0, 0] }
        [points]
        eye = { frame = "sled", position = [0, 0.1, 0] }
        post = { position = [2, 0, 0.5] }
        [bodies]
        block = { mass = 1, frame = "sled" }
        [dampers]
        rope = { between = ["eye", "post"], force = "0.3*rate*abs(rate)" }
        [frictions]
        guide = { on = "x_dot", force = 0.5 }
        """,
    "compliant contact": """
        [coordinates]
        x = { unit = "m", velocity = 2.0 }
        y = { unit = "m", start = 0.1 }
        [gravity]
        acceleration = 9.81
        [bodies]
        ball = { mass = 1, position = ["x", "y"] }
        [contacts.floor]
        kind = "point_line"
        between = ["ball", "world"]
        normal = "y"
        law = "compliant"
        stiffness = 1e4
        damping = 0.5
        [frictions]
        guide = { on = "x_dot", force = 0.5 }
        """,
}


@pytest.mark.parametrize("by", RESISTED)
def test_what_has_a_law_of_force_dissipates_beside_friction(by: str, exported) -> None:
    """Energy and what was dissipated are one sum; forces that only depend on velocities and gaps were left out."""
    fmu = exported(read(f'[mechanism]\nname = "resisted"\n{RESISTED[by]}', "resisted.toml"))
    shown = ("x_dot", "total_energy", "dissipated_energy")
    run = simulate_fmu(fmu.path, Run(2.0, 0.02, 1e-9, outputs=shown))
    whole = run["total_energy"] + run["dissipated_energy"]
    assert run["dissipated_energy"][-1] > 0.9
    assert whole == pytest.approx(np.full(len(whole), whole[0]), abs=1e-7)
    assert lag2fmu.validate(fmu, stop_time=2.0).passed


GUIDED = """
[mechanism]
name = "guided"
[coordinates]
phi = { unit = "rad", start = 4.915 }
psi = { unit = "rad", guess = -0.2 }
x = { unit = "m", guess = 0.8 }
[gravity]
acceleration = 9.81
[bodies]
crank = { mass = 1, inertia = 0.02, position = ["0.1*cos(phi)", "0.1*sin(phi)"], angle = "phi" }
rod = { mass = 0.6, inertia = 0.01, position = ["x - 0.4*cos(psi)", "0.4*sin(psi)"], angle = "-psi" }
slider = { mass = 2, position = ["x", 0] }
[constraints.holonomic]
along = "0.2*cos(phi) + 0.8*cos(psi) - x"
across = "0.2*sin(phi) - 0.8*sin(psi)"
[frictions.guide]
on = "x_dot"
force = "0.3*abs(multiplier_across)"
[stops.end]
of = "x"
upper = "0.2*cos(4.915) + 0.8*cos(asin(0.25*sin(4.915)))"
"""


def test_a_slide_rests_against_its_stop_whatever_its_guide_bears(exported) -> None:
    """Guide and stop hold the same motion, and their shares are told to less than a guide's load is."""
    fmu = exported(read(GUIDED, "guided.toml"))
    for torque in (2, 3, 5, 8):
        for tilt in (-5, -2, 0, 2, 7):
            values = {"Q_phi": torque, "Q_psi": tilt}
            run = simulate_fmu(
                fmu.path,
                Run(0.02, 0.01, outputs=("x_dot", "guide_mode", "guide_force", "multiplier_across"), values=values),
            )
            assert (run["x_dot"] == 0).all()
            assert (run["guide_mode"] == STICKS).all()
            assert (np.abs(run["guide_force"]) <= 0.3 * np.abs(run["multiplier_across"]) * (1 + 1e-9)).all()
