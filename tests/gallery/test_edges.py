"""Edges and kinks of what bears.

A ball rolls off a table at 1 m/s and falls by 1 m; a bead slides on a bent wire; a capsule comes to lie along a rail.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from fmpy.fmi2 import FMU2Model
from scipy.integrate import quad, solve_ivp

from lag2fmu import simulate, validate
from lag2fmu.errors import SimulationError
from lag2fmu.fmu import Fmu
from lag2fmu.formats.text import read
from lag2fmu.reference.direct_integration import integrate
from lag2fmu.verify.run import Kind

pytestmark = pytest.mark.fmu

G = 9.81
CS: Kind = "co-simulation"
FALL = (2 / G) ** 0.5
"""The time (s) of a fall by 1 m."""

BALL = """
[mechanism]
name = "edge"
[coordinates]
x = { unit = "m", start = 0, velocity = 1 }
y = { unit = "m", start = 0 }
[gravity]
acceleration = 9.81
[bodies.ball]
mass = 1
position = ["x", "y"]
[contacts.floor]
gap = "y + 1"
restitution = 0.5
[contacts.table]
"""
TABLES = {"jumps": 'gap = "y + if(x < 1, 0, 1)"', "turns": 'gap = "max(y, x - 1)"'}


WIRE = """
[mechanism]
name = "wire"
[coordinates]
x = { unit = "m", start = -0.5 }
y = { unit = "m", guess = -1.0 }
z = { unit = "m", guess = 1.0 }
[gravity]
acceleration = 9.81
[bodies.bead]
mass = 1
position = ["x", "y"]
[bodies.second]
mass = 1
position = ["z", 0]
[constraints.holonomic]
wire = "y - if(z > 0, 2*z**2, z**2)"
tied = "z - x"
"""


CORNER = """
[mechanism]
name = "corner"
[coordinates]
x = { unit = "m", start = -0.7, velocity = 1 }
z = { unit = "m", guess = 0 }
[gravity]
acceleration = 9.81
[bodies.slide]
mass = 1
position = ["x", 0]
[bodies.lifted]
mass = 2
position = [0, "z"]
[constraints.holonomic]
ramp = "z - 0.15*max(x, 0)"
"""
LAND = """
[mechanism]
name = "land"
[coordinates]
x = { unit = "m", start = 0.5, velocity = 1 }
z = { unit = "m", start = 0.2, velocity = 1.3 }
y = { unit = "m", guess = 0.2 }
[gravity]
acceleration = 9.81
direction = [0, 0, -1]
[bodies.bead]
mass = 1
position = ["x", "z", "y"]
[tables.height]
columns = [[0, 0.6, 1.1, 2], [0, 0.5, 1], [[0.5, 0.3, 0.2], [0.2, 0.1, 0.05], [0, 0.1, -0.1], [-0.1, -0.2, -0.5]]]
units = ["m", "m", "m"]
[constraints.holonomic]
ground = "y - height(x, z)"
"""
CAM = """
[mechanism]
name = "cam"
[coordinates]
x = { unit = "m", start = -1, velocity = 1 }
z = { unit = "m" }
[bodies.follower]
mass = 1
position = ["x", "z + {rise}"]
[bodies.cam]
mass = 2
position = [0, "z"]
"""
CAPSULE = """
[mechanism]
name = "capsule"
[coordinates]
z = { unit = "m", start = 0.5 }
a = { unit = "rad", start = 0.1 }
[gravity]
acceleration = 9.81
direction = [0, 0, -1]
[frames.rod]
origin = [0, 0, "z"]
rotations = [["y", "pi/2 + a"]]
[frames.rail]
origin = [0, 0, 0]
rotations = [["y", "pi/2"]]
[bodies.own]
frame = "rod"
mass = 1
inertia = [0.02, 0.02, 0.002, 0, 0, 0]
"""
ALONG = """
[contacts.along]
kind = "capsule_capsule"
between = ["rod", "rail"]
radius = [0.05, 0.05]
length = [0.4, 2]
"""
PLANK = """
[mechanism]
name = "plank"
[coordinates]
z = { unit = "m", start = 0.5 }
a = { unit = "rad", start = 0.3 }
[gravity]
acceleration = 9.81
direction = [0, -1]
[bodies.own]
mass = 1
inertia = 0.02
angle = "a"
position = [0, "z"]
[contacts.floor]
gap = "z - 0.1 - 0.2*abs(sin(a))"
"""
VEE = """
[mechanism]
name = "vee"
[coordinates]
x = { unit = "m", start = 0, velocity = -1 }
y = { unit = "m", start = 0, velocity = 0.5 }
[gravity]
acceleration = 9.81
[bodies.bead]
mass = 1
position = ["x", "y"]
[constraints.holonomic]
wire = "y - 0.5*abs(x)"
"""
END = """
[points.{name}]
frame = "rod"
position = [0, 0, {place}]
[contacts.{name}]
kind = "capsule_sphere"
between = ["rail", "{name}"]
radius = [0.05, 0.05]
length = 2
"""


@pytest.fixture(scope="module", params=TABLES)
def table(request: pytest.FixtureRequest, exported: Callable[..., Fmu]) -> Fmu:
    """The FMU whose gap jumps at the edge, or turns into the distance from the table's side. About 1 s."""
    return exported(read(BALL + TABLES[request.param], "edge"))


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_a_ball_falls_off_the_edge_of_a_table(table: Fmu, kind: Kind) -> None:
    last = simulate(table, stop_time=1.8, step=0.6, tolerance=1e-9, kind=kind)
    since = 0.8 - FALL
    assert last["x"][-1] == pytest.approx(1.8, abs=1e-7)
    assert last["y"][-1] == pytest.approx(-1 + G * FALL / 2 * since - G / 2 * since**2, abs=1e-7)


def test_the_independent_path_sees_the_ball_fall(table: Fmu) -> None:
    assert validate(table, stop_time=1.2).passed


def test_a_step_up_is_refused(exported: Callable[..., Fmu]) -> None:
    """The FMU says so, alone and in a validation; the judge's own integration finds the step as well."""
    mechanism = read(BALL + 'gap = "y - if(x < 1, 0, 0.5)"', "edge")
    step = exported(mechanism)
    jumps = r"a condition turns in the gap of table, which jumps to -0\.5"
    with pytest.raises(SimulationError, match=f"time 1 {jumps}"):
        simulate(step, stop_time=2, step=1)
    with pytest.raises(SimulationError, match=jumps):
        validate(step, stop_time=2)
    with pytest.raises(SimulationError, match=r"gap of table jumps to -0\.5"):
        integrate(mechanism, np.linspace(0, 2, 3))


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_a_start_is_solved_on_its_own_side_of_a_kink(exported: Callable[..., Fmu], kind: Kind) -> None:
    """A bead on two parabolas starts at rest behind the kink, in front of which the guess is: it rises as high again.

    The wire under the guess was solved for, and the bead left where no wire is, without a word.
    """
    run = simulate(exported(read(WIRE, "wire.toml")), stop_time=1.2, step=0.002, tolerance=1e-8, kind=kind)
    assert run["y"] == pytest.approx((1 + (run["x"] > 0)) * run["x"] ** 2, abs=3e-5)
    assert run["y"][0] == 0.25
    assert run["x"].max() == pytest.approx(0.125**0.5, abs=1e-5)


def test_a_kink_of_a_constraint_is_validated(exported: Callable[..., Fmu]) -> None:
    assert validate(exported(read(WIRE, "wire.toml")), stop_time=0.6).passed


def test_a_corner_of_a_constraint_is_an_impact(exported: Callable[..., Fmu]) -> None:
    """The slide jerks 2 kg up at the foot of the ramp; on the way back the constraint stops these, and it goes on.

    In model exchange the velocities were those before the corner until positions had drifted off.
    """
    corner, after = exported(read(CORNER, "corner.toml")), 1 / (1 + 2 * 0.15**2)
    for kind in ("co-simulation", "model-exchange"):
        run = simulate(corner, stop_time=1.6, step=0.1, tolerance=1e-8, kind=kind)
        assert run["x_dot"][run.time > 0.75][0] == pytest.approx(after - 0.1 * 2 * 0.15 * G * after, abs=1e-6)
        assert run["x_dot"][-1] == pytest.approx(-after, abs=1e-6)
    assert validate(corner, stop_time=1.6).passed


def test_a_bead_crosses_the_borders_of_a_table_of_two_arguments(exported: Callable[..., Fmu]) -> None:
    """It is struck at each of the five borders, once.

    In model exchange positions that were moved back onto the ground passed the border at x = 1.1 m again.
    """
    land = exported(read(LAND, "land.toml"))
    runs = [simulate(land, stop_time=0.6, step=0.1, tolerance=1e-8, kind=kind) for kind in (CS, "model-exchange")]
    assert runs[1]["y_dot"] == pytest.approx(runs[0]["y_dot"], abs=1e-6)
    assert validate(land, stop_time=1.2).passed


@pytest.mark.parametrize(("rise", "slope"), [("if(x > 0, x**2, 3*x**2)", -6), ("x*abs(x)", 2)])
def test_a_place_with_a_kink_moves_on_both_sides_of_it(rise: str, slope: float, exported: Callable[..., Fmu]) -> None:
    """Momentum along z and energy are kept; before, such places could not be derived."""
    cam = exported(read(CAM.replace("{rise}", rise), "cam.toml"))
    run = simulate(cam, stop_time=3, step=0.1, tolerance=1e-9, beside=("total_energy", "p_z"))
    assert run["x"][-1] > 1
    assert run["p_z"] == pytest.approx(slope, abs=1e-6)
    assert run["total_energy"] == pytest.approx((1 + slope**2) / 2, abs=1e-6)


def test_a_closed_contact_that_jumps_to_the_other_end_ends_the_run(exported: Callable[..., Fmu]) -> None:
    """Half of the energy was gone behind the kink: the projection onto the closed gap had taken it."""
    with pytest.raises(SimulationError, match=r"have a kink.* a contact for each of its ends"):
        simulate(exported(read(CAPSULE + ALONG, "capsule.toml")), stop_time=0.5, step=0.1)


BLADE = """
[mechanism]
name = "blade"
[coordinates]
x = { unit = "m", guess_velocity = 0.3 }
y = { unit = "m", start = -1.0, guess_velocity = 0.2 }
th = { unit = "rad", start = 1.0, velocity = -2.0 }
[bodies]
skate = { mass = 1, inertia = 0.1, position = ["x", "y"], angle = "th" }
[constraints.nonholonomic]
edge = "-sin(th)*x_dot + cos(th)*y_dot"
[stops.bank]
of = "y"
lower = "-1 + 0.2*t"
"""


def test_a_blade_across_a_bank_that_pushes_comes_to_a_dead_centre(exported: Callable[..., Fmu]) -> None:
    """x' = y'/tan(th) grows beyond all bounds at t = 0.5, where the blade lies along the bank; there is no kink."""
    with pytest.raises(SimulationError, match=r"time 0\.49.* come to a dead centre, behind which the velocity x_dot"):
        simulate(exported(read(BLADE, "blade.toml")), stop_time=1.0, step=0.1)


def test_a_capsule_with_a_contact_at_each_end_comes_to_rest_on_a_rail(exported: Callable[..., Fmu]) -> None:
    """When it lies flat: with J < m (l/2)^2 a blow on the end that rises presses the other one down."""
    ends = END.format(name="head", place=0.2) + END.format(name="foot", place=-0.2)
    run = simulate(
        exported(read(CAPSULE + ends, "capsule.toml")), stop_time=0.5, step=0.1, beside=("dissipated_energy",)
    )
    assert run["z"][-1] == pytest.approx(0.1, abs=1e-9)
    assert abs(run["z_dot"][-1]) + abs(run["a_dot"][-1]) + abs(run["a"][-1]) < 1e-9
    assert run["dissipated_energy"][-1] == pytest.approx(0.4 * G, rel=1e-6)


def test_a_gap_to_the_lower_corner_says_that_each_corner_needs_a_contact(exported: Callable[..., Fmu]) -> None:
    with pytest.raises(SimulationError, match=r"sin\(a\) is 0 .* if a gap contains it, .* each of its ends or corners"):
        simulate(exported(read(PLANK, "plank.toml")), stop_time=1.0, step=0.1)


@pytest.mark.parametrize("way", [-1, 1])
def test_a_start_at_a_corner_takes_the_side_to_which_it_goes(way: int, exported: Callable[..., Fmu]) -> None:
    """It was refused, as if the wire were level there. The bead climbs at 1.118 m/s along a slope of 1 : 2."""
    fmu = exported(read(VEE.replace("velocity = -1", f"velocity = {way}"), "vee.toml"))
    run = simulate(fmu, stop_time=0.1, step=0.1)
    assert run["x"][-1] == pytest.approx(way * (0.1 - 0.5 * 0.4 * G * 0.1**2), rel=1e-6)
    assert validate(fmu, stop_time=0.2).passed


@pytest.mark.parametrize(
    ("solver", "kind"),
    [(name, CS) for name in ("dopri5", "rk4", "verlet", "gauss4", "radau5")] + [("rk4", "model-exchange")],
)
def test_a_kink_that_steps_pass_ends_the_run(solver: str, kind: Kind, exported: Callable[..., Fmu]) -> None:
    """With rk4, and in model exchange, it went on with an eighth of the energy."""
    vee = VEE.replace("0.5*abs(x)", "0.5*smooth(abs(x))").replace("start = 0, velocity = -1", "start = 1")
    fmu = exported(read(vee.replace("start = 0, velocity = 0.5", "guess = 0.5"), "vee.toml"), solver=solver)
    with pytest.raises(SimulationError, match=r"time 0\.[78].* have a kink"):
        simulate(fmu, stop_time=1.0, step=0.1, kind=kind)


def test_a_coarse_step_past_no_kink_is_none(exported: Callable[..., Fmu]) -> None:
    """However far the projection moves its result: here by a tenth of the velocity, in five steps a turn."""
    circle = VEE.replace("y - 0.5*abs(x)", "x**2 + y**2 - 1").replace("velocity = -1", "velocity = 6")
    circle = circle.replace("start = 0, velocity = 0.5", "guess = -1").replace(
        "acceleration = 9.81", "acceleration = 0"
    )
    simulate(exported(read(circle, "circle.toml"), solver="rk4"), stop_time=1.0, step=0.2, values={"solver_step": 0.2})


ROD_ON_AN_EDGE = """
[mechanism]
name = "rod_on_an_edge"
[parameters]
L = { value = 1, unit = "m" }
m = { value = 1, unit = "kg" }
[coordinates]
x = { unit = "m", start = 0.15 }
y = { unit = "m" }
theta = { unit = "rad" }
[gravity]
acceleration = 9.81
[bodies.rod]
mass = "m"
inertia = "m*L**2/12"
position = ["x", "y"]
angle = "-theta"
[contacts.edge]
gap = "y*cos(theta) + x*sin(theta)"
slip = "cos(theta)*x_dot - sin(theta)*y_dot"
friction = 0.4
"""


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6])
def test_a_rod_slides_off_the_edge_of_a_table_in_model_exchange(
    tolerance: float, exported: Callable[..., Fmu], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The gap opens with the third power of the time, in which CVode is wrong by more: each error was an event.

    It slips where tan(theta) = mu/(1 + 36 (d/L)^2), and is then followed by equations of its own.
    """

    def rates(_: float, z: np.ndarray) -> list[float]:
        turns = z[0] * (G * np.cos(z[1]) - 2 * z[2] * z[3]) / (1 / 12 + z[0] ** 2)
        return [z[2], z[3], z[0] * z[3] ** 2 + G * np.sin(z[1]) - 0.4 * bears(0, z), turns]

    def bears(_: float, z: np.ndarray) -> float:
        return (G * np.cos(z[1]) - 2 * z[2] * z[3]) / (1 + 12 * z[0] ** 2)

    bears.terminal = True  # type: ignore[attr-defined]
    d, slips = 0.15, np.arctan(0.4 / (1 + 36 * 0.15**2))
    turned = lambda a: np.sqrt(2 * G * d * np.sin(a) / (1 / 12 + d**2))  # noqa: E731
    time = quad(lambda root: 2 * root / turned(root**2), 0, np.sqrt(slips))[0]
    start = [d, slips, 0, turned(slips)]
    found = solve_ivp(rates, (0, 1), start, "DOP853", rtol=1e-12, atol=1e-12, events=bears)
    s, theta, away, spin = found.y[:, -1]
    fall = 0.55 - time - found.t[-1]
    along, up = np.array([np.cos(theta), -np.sin(theta)]), np.array([np.sin(theta), np.cos(theta)])
    place = s * along + fall * (away * along - s * spin * up) - [0, G * fall**2 / 2]
    fmu = exported(read(ROD_ON_AN_EDGE, "rod.toml"))
    events: list[FMU2Model] = []
    enter = FMU2Model.enterEventMode
    monkeypatch.setattr(FMU2Model, "enterEventMode", lambda unit: (events.append(unit), enter(unit)))
    run = simulate(fmu, stop_time=0.55, step=0.05, tolerance=tolerance, kind="model-exchange")
    assert len(events) < 10
    end = [run[name][-1] for name in ("x", "y", "theta")]
    assert end == pytest.approx([*place, theta + spin * fall], abs=100 * tolerance)
