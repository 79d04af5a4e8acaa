"""Motions that the literature gives in numbers or invariants, of mechanisms that do not come along."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from lag2fmu import simulate
from lag2fmu.errors import SimulationError
from lag2fmu.fmu import Fmu
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Energy, Mechanism, coordinate
from lag2fmu.verify.run import Kind

pytestmark = pytest.mark.fmu

Exported = Callable[..., Fmu]

G = 9.81

KOVALEVSKAYA = """
[mechanism]
name = "kovalevskaya"
[coordinates]
e0 = { guess = 0.9 }
e1 = { start = 0.3 }
e2 = { start = -0.2 }
e3 = { start = 0.1 }
[frames.top]
quaternion = ["e0", "e1", "e2", "e3"]
[gravity]
acceleration = 9.81
[bodies.rotor]
frame = "top"
mass = 1
center = [0.7, 0, 0]
inertia = [1, "1 - 0.7**2", "0.5 - 0.7**2", 0, 0, 0]
[outputs]
w = { frame = "top", quantity = "angular_velocity", axes = "frame" }
turn = { frame = "top", quantity = "rotation" }
"""

BENNETT = """
[mechanism]
name = "bennett"
[parameters]
a = { value = 1, unit = "m" }
b = { expression = "a*sin(1)/sin(0.5)", unit = "m" }
[coordinates]
first = { unit = "rad", start = 0.8, velocity = 1 }
second = { unit = "rad", guess = 2.8, guess_velocity = 0 }
third = { unit = "rad", guess = 5.5, guess_velocity = 0 }
[frames]
base = { origin = ["-b", 0, 0], rotations = [["x", -1]] }
one = { rotations = [["z", "first"]] }
one_end = { parent = "one", origin = ["a", 0, 0], rotations = [["x", 0.5]] }
two = { parent = "one_end", rotations = [["z", "second"]] }
two_end = { parent = "two", origin = ["b", 0, 0], rotations = [["x", 1]] }
three = { parent = "two_end", rotations = [["z", "third"]] }
three_end = { parent = "three", origin = ["a", 0, 0], rotations = [["x", 0.5]] }
[bodies]
crank = { frame = "one", mass = 1, center = ["a/2", 0, 0], inertia = [0.01, 0.1, 0.1, 0, 0, 0] }
coupler = { frame = "two", mass = 1, center = ["b/2", 0, 0], inertia = [0.01, 0.1, 0.1, 0, 0, 0] }
rocker = { frame = "three", mass = 1, center = ["a/2", 0, 0], inertia = [0.01, 0.1, 0.1, 0, 0, 0] }
[joints.last]
kind = "revolute"
between = ["base", "three_end"]
axis = "z"
"""

CHAIN = """
[mechanism]
name = "falling_chain"
[parameters]
L = { value = 2, unit = "m" }
M = { value = 0.5, unit = "kg" }
g = { value = 9.81, unit = "m/s2" }
[coordinates]
x = { unit = "m" }
[energy]
kinetic = "M*(L - x)/L*x_dot**2/4"
potential = "-M*g*(L**2 + 2*L*x - x**2)/(4*L)"
"""

STRING = """
[mechanism]
name = "string"
[coordinates]
x = { unit = "m", velocity = 5.8595221 }
y = { unit = "m", start = -1 }
[gravity]
acceleration = 9.81
[bodies.bob]
mass = 0.1
position = ["x", "y"]
[contacts.string]
gap = "1 - sqrt(x**2 + y**2)"
"""

SWINGING_ATWOOD = """
[mechanism]
name = "swinging_atwood"
[coordinates]
r = { unit = "m", start = 1, velocity = 0.3 }
theta = { unit = "rad", start = 2, velocity = 0.4 }
[gravity]
acceleration = 9.81
[bodies]
swing = { mass = 1, position = ["r*sin(theta)", "-r*cos(theta)"] }
weight = { mass = 3, position = [5, "r - 10"] }
"""


def test_the_pleiades_are_where_the_test_set_has_them(exported: Exported) -> None:
    """Seven stars, some of which pass each other closely: E. Hairer, S. P. Norsett, G. Wanner, section II.10.

    The end is that of F. Mazzia, C. Magherini, Test Set for Initial Value Problem Solvers, 2008.
    """
    starts = np.array([[3, 3, -1, -3, 2, -2, 2], [3, -3, 2, 0, 0, -4, 4]])
    speeds = np.array([[0, 0, 0, 0, 0, 1.75, -1.5], [0, 0, 0, -1.25, 1, 0, 0]])
    stars = [
        [
            coordinate(f"{axis}{i}", start=float(at), velocity=float(v))
            for i, (at, v) in enumerate(zip(*row, strict=True), 1)
        ]
        for axis, row in zip("xy", zip(starts, speeds, strict=True), strict=True)
    ]
    places = list(zip(range(1, 8), *stars, strict=True))
    kinetic = sum(m * (x.dot**2 + y.dot**2) / 2 for m, x, y in places)
    potential = -sum(m * n * ((x - u) ** 2 + (y - v) ** 2) ** -0.5 for m, x, y in places for n, u, v in places if m < n)
    mechanism = Mechanism("pleiades", coordinates=[*stars[0], *stars[1]], energy=Energy(kinetic, potential))
    run = simulate(exported(mechanism), stop_time=3.0, step=0.1, tolerance=1e-12)
    end = [
        *(0.3706139143970502, 3.237284092057233, -3.222559032418324, 0.6597091455775310),
        *(0.3425581707156584, 1.562172101400631, -0.7003092922212495),
        *(-3.943437585517392, -3.271380973972550, 5.225081843456543, -2.590612434977470),
        *(1.198213693392275, -0.2429682344935824, 1.091449240428980),
    ]
    assert [run[q.name][-1] for q in mechanism.coordinates] == pytest.approx(end, abs=1e-9)


def test_kovalevskayas_top_keeps_her_invariant(exported: Exported) -> None:
    """A = B = 2 C, the mass centre in the plane of A and B: S. Kovalevskaya, 1889; gravity is along -z here."""
    run = simulate(exported(read(KOVALEVSKAYA, "top.toml")), stop_time=10.0, step=0.05, tolerance=1e-10)
    c, w = 1 * G * 0.7 / 0.5, run["w_x"] + 1j * run["w_y"]
    invariant = np.abs(w**2 - c * (run["turn_31"] + 1j * run["turn_32"])) ** 2
    assert np.ptp(run["w_z"]) > 1
    assert invariant == pytest.approx(np.full(len(run), invariant[0]), rel=1e-7)


def test_bennetts_linkage_moves_as_he_found(exported: Exported) -> None:
    """Four links and a freedom that Gruebler's count denies; half the angles have a constant product of tangents.

    G. T. Bennett, A new mechanism, Engineering 76, 1903.
    """
    run = simulate(exported(read(BENNETT, "bennett.toml")), stop_time=1.5, step=0.1, tolerance=1e-8)
    product = np.tan(run["first"] / 2) * np.tan(run["second"] / 2)
    assert product == pytest.approx(np.full(len(run), np.sin(0.75) / np.sin(0.25)), rel=1e-7)
    assert np.ptp(run["first"]) > 1


def bennetts_inertia(first: float) -> float:
    """Twice the kinetic energy at one radian a second, by the velocities of the links' rotations and centres."""
    step, half = 1e-30j, first / 2
    ratio = np.sin(0.75) / np.sin(0.25)
    second = 2 * np.arctan2(ratio * np.cos(half), np.sin(half))
    rate = -ratio / (np.sin(half) ** 2 + (ratio * np.cos(half)) ** 2)
    place, turn, b, total = np.zeros(3), np.eye(3), np.sin(1) / np.sin(0.5), 0.0
    for angle, speed, length, twist in ((first, 1, 1, 0.5), (second, rate, b, 1.0), (-first, -1, 1, 0.5)):
        z = angle + speed * step
        turn = turn @ np.array([[np.cos(z), -np.sin(z), 0], [np.sin(z), np.cos(z), 0], [0, 0, 1]])
        center, spin = (place + turn[:, 0] * length / 2).imag / step.imag, turn.real.T @ turn.imag / step.imag
        total += center @ center + [0.01, 0.1, 0.1] @ np.array([spin[2, 1], spin[0, 2], spin[1, 0]]) ** 2
        place = place + turn[:, 0] * length
        turn = turn @ np.array([[1, 0, 0], [0, np.cos(twist), -np.sin(twist)], [0, np.sin(twist), np.cos(twist)]])
    return float(total)


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
@pytest.mark.parametrize("start", [0.8, 1.5, 2.5])
def test_bennetts_linkage_turns_through_its_folded_positions(start: float, kind: Kind, exported: Exported) -> None:
    """Where all links lie in one line, two of its five equations, of which any two suffice, have no slope left."""
    fmu = exported(read(BENNETT, "bennett.toml"))
    rate = lambda _, z: [np.sqrt(bennetts_inertia(start) / bennetts_inertia(z[0]))]  # noqa: E731
    exact = solve_ivp(rate, (0, 20), [start], "DOP853", rtol=1e-12, atol=1e-12).y[0, -1]
    assert exact > start + 4 * np.pi
    for tolerance, bar in ((1e-6, 5e-3), (1e-9, 2e-5)):
        run = simulate(fmu, stop_time=20.0, step=0.05, tolerance=tolerance, kind=kind, values={"first": start})
        assert run["first"][-1] == pytest.approx(exact, abs=bar)
        assert run["third"] == pytest.approx(2 * np.pi - run["first"], abs=100 * tolerance)


def test_bennetts_linkage_is_driven_to_its_folded_position(exported: Exported) -> None:
    """There at a communication point, residuals have no slope to be measured by."""
    text = BENNETT.replace("first = { unit", "# first = { unit").replace('"first"', '"pi/2 + pi*t"')
    fmu = exported(read(text.replace("2.8", "2.64").replace("5.5", "4.712"), "bennett.toml"))
    run = simulate(fmu, stop_time=10.0, step=0.25)
    assert run["third"] == pytest.approx(1.5 * np.pi - np.pi * run.time, abs=1e-12)


def test_a_start_in_a_folded_position_says_so(exported: Exported) -> None:
    fmu = exported(read(BENNETT, "bennett.toml"))
    with pytest.raises(SimulationError, match=r"a constraint has hardly any slope.*start a little beside"):
        simulate(fmu, stop_time=1.0, step=0.1, values={"first": np.pi, "second": 0.0, "third": np.pi})


def test_the_end_of_a_falling_chain_outruns_free_fall(exported: Exported) -> None:
    """In 0.847213 times the time of free fall: C. W. Wong, K. Yasui, Falling chains, Am. J. Phys. 74, 2006."""
    length = 2.0

    def slowness(root: float) -> float:
        u = root**2 / length
        return 2 * np.sqrt((1 - u) / (2 * G * (1 - u / 2)))

    free = np.sqrt(2 * length / G)
    assert quad(slowness, 0, np.sqrt(length))[0] / free == pytest.approx(0.847213, abs=5e-7)
    near = quad(slowness, 0, np.sqrt(0.99 * length))[0]
    run = simulate(exported(read(CHAIN, "chain.toml")), stop_time=near, step=near / 10, tolerance=1e-10)
    assert run["x"][-1] == pytest.approx(0.99 * length, abs=1e-9)


def test_a_string_goes_slack_and_taut_again(exported: Exported) -> None:
    """It goes slack at the sine (v^2 - 2 g l)/(3 g l) of the angle above the horizontal, and stops the bob along it."""
    run = simulate(
        exported(read(STRING, "string.toml")), stop_time=1.5, step=1e-3, tolerance=1e-9, beside=("string_impulse",)
    )
    height = (5.8595221**2 - 2 * G) / (3 * G)
    speed, along = np.sqrt(G * height), np.sqrt(1 - height**2)
    flight = 4 * speed * along / G
    place = np.array([along - speed * height * flight, height + speed * along * flight - G * flight**2 / 2])
    velocity = np.array([-speed * height, speed * along - G * flight])
    assert np.hypot(*place) == pytest.approx(1, abs=1e-12)
    assert run["string_impulse"][-1] == pytest.approx(0.1 * velocity @ place, rel=1e-8)


def test_a_swinging_atwood_machine_of_ratio_three_is_integrable(exported: Exported) -> None:
    """Its second invariant: N. B. Tufillaro, Integrable motion of a swinging Atwood's machine, AJP 54, 1986."""
    run = simulate(exported(read(SWINGING_ATWOOD, "swing.toml")), stop_time=8.0, step=0.1, tolerance=1e-10)
    r, half, turn = run["r"], run["theta"] / 2, run["theta_dot"]
    invariant = r**2 * turn * (run["r_dot"] * np.cos(half) - r * turn / 2 * np.sin(half))
    invariant += G * r**2 * np.sin(half) * np.cos(half) ** 2
    assert invariant == pytest.approx(np.full(len(run), invariant[0]), rel=1e-8)
    assert np.ptp(run["theta"]) > 1
