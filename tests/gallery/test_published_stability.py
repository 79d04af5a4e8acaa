"""Where small motions become unstable, and what they answer, by formulas of the literature; no FMU is built."""

import re

import numpy as np
import pytest

from lag2fmu import equilibria, linearize
from lag2fmu.analysis.state_space import StateSpace
from lag2fmu.formats.text import read

FOLLOWER = """
[mechanism]
name = "follower"
[parameters]
P = { value = 1, unit = "N" }
[coordinates]
a = { unit = "rad" }
b = { unit = "rad" }
[bodies]
lower = { mass = 2, position = ["sin(a)", "cos(a)"] }
upper = { mass = 1, position = ["sin(a) + sin(b)", "cos(a) + cos(b)"] }
[springs]
foot = { stiffness = 1, elongation = "a" }
knee = { stiffness = 1, elongation = "b - a" }
[loads.follower]
body = "upper"
force = ["-P*sin(b)", "-P*cos(b)"]
"""

ROTOR = """
[mechanism]
name = "rotor"
[parameters]
w = { value = 1, unit = "rad/s" }
[coordinates]
x = { unit = "m" }
y = { unit = "m" }
[bodies.disc]
mass = 2
position = ["x", "y"]
[energy]
potential = "8000*(x**2 + y**2)/2"
dissipation = "3*(x_dot**2 + y_dot**2)/2 + 2*((x_dot + w*y)**2 + (y_dot - w*x)**2)/2"
"""

SADDLE = """
[mechanism]
name = "saddle"
[parameters]
w = { value = 1, unit = "rad/s" }
[coordinates]
x = { unit = "m" }
y = { unit = "m" }
[bodies.ball]
mass = 1
position = ["x*cos(w*t) - y*sin(w*t)", "x*sin(w*t) + y*cos(w*t)"]
[energy]
potential = "(x**2 - y**2)/2"
"""

ABSORBER = """
[mechanism]
name = "absorber"
[parameters]
mu = { value = 0.05, unit = "1" }
c = { value = 0.01, unit = "N.s/m" }
[coordinates]
x = { unit = "m" }
y = { unit = "m" }
[inputs]
F = { unit = "N" }
[bodies]
great = { mass = 1, position = ["x", 0] }
small = { mass = "mu", position = ["y", 0] }
[springs]
ground = { stiffness = 1, elongation = "x" }
between = { stiffness = "mu/(1 + mu)**2", elongation = "y - x" }
[dampers.between]
damping = "c"
rate = "y_dot - x_dot"
[forces]
x = "F"
"""

DAMPED = (
    FOLLOWER
    + """
[dampers]
foot = { damping = 1e-4, rate = "a_dot" }
knee = { damping = 1e-4, rate = "b_dot - a_dot" }
"""
)

DISC = """
[mechanism]
name = "disc_on_a_shaft"
[parameters]
spin = { value = 10, unit = "rad/s" }
[coordinates]
a = { unit = "rad" }
b = { unit = "rad" }
turn = { unit = "rad" }
[frames.disc]
rotations = [["x", "a"], ["y", "b"], ["z", "turn + spin*t"]]
[bodies.disc]
frame = "disc"
mass = 1
inertia = [0.5, 0.5, 0.9, 0, 0, 0]
[energy]
potential = "200*(a**2 + b**2)/2"
"""


def small_motions(text: str, name: str, value: float) -> StateSpace:
    """The linearization at the start, where the parameter ``name`` is ``value``."""
    changed = re.sub(rf"^{name} = {{ value = [^,]+", f"{name} = {{ value = {float(value)!r}", text, flags=re.MULTILINE)
    return linearize(read(changed, "small.toml")).state_space()


def growth(text: str, name: str, value: float) -> float:
    """The greatest real part of the poles, in 1/s."""
    return float(np.linalg.eigvals(small_motions(text, name, value).A).real.max())


def test_a_follower_force_makes_two_rods_flutter() -> None:
    """At P = (7/2 - sqrt(2)) k/l, though no equilibrium beside the straight one exists: H. Ziegler, 1952."""
    critical = 3.5 - np.sqrt(2)
    assert growth(FOLLOWER, "P", 0.999 * critical) < 1e-12
    assert growth(FOLLOWER, "P", 1.001 * critical) > 0.01


def test_damping_that_turns_makes_a_shaft_whirl() -> None:
    """Above sqrt(k/m) (1 + c_outer/c_turning): A. T. Kimball, 1924; D. M. Smith, 1933."""
    critical = np.sqrt(8000 / 2) * (1 + 3 / 2)
    assert growth(ROTOR, "w", 0.999 * critical) < 0 < growth(ROTOR, "w", 1.001 * critical)
    assert growth(ROTOR, "w", critical) == pytest.approx(0, abs=1e-9)


def test_a_saddle_that_turns_fast_enough_holds_a_ball() -> None:
    """From w^2 = k/m on: L. E. J. Brouwer, 1918; the frequencies are sqrt(w^2 +- k/m) below and above it."""
    assert growth(SADDLE, "w", 0.9) == pytest.approx(np.sqrt(1 - 0.9**2), abs=1e-12)
    assert growth(SADDLE, "w", 1.1) < 1e-12
    frequencies = np.unique(np.abs(np.linalg.eigvals(small_motions(SADDLE, "w", 1.1).A).imag).round(9))
    assert frequencies == pytest.approx([np.sqrt(1.1**2 - 1), np.sqrt(1.1**2 + 1)], abs=1e-8)


@pytest.mark.parametrize("damping", [0.001, 0.012, 0.1])
def test_an_absorber_has_two_points_that_no_damping_moves(damping: float) -> None:
    """Both as high as sqrt(1 + 2/mu), where it is tuned to 1/(1 + mu): J. P. Den Hartog, Mechanical Vibrations."""
    mu = 0.05
    system = small_motions(ABSORBER, "c", damping)
    row = [output.name for output in system.outputs].index("x")
    column = [signal.name for signal in system.inputs].index("F")
    for side in (-1, 1):
        w = np.sqrt((1 + side * np.sqrt(mu / (2 + mu))) / (1 + mu))
        answer = system.C @ np.linalg.solve(1j * w * np.eye(4) - system.A, system.B) + system.D
        assert abs(answer[row, column]) == pytest.approx(np.sqrt(1 + 2 / mu), rel=1e-10)


def test_little_damping_lowers_the_load_at_which_a_follower_force_makes_rods_flutter() -> None:
    """To 41/28 k/l, from 7/2 - sqrt(2) without any: G. Herrmann, I.-C. Jong, J. Applied Mechanics 32, 1965."""
    critical = 41 / 28
    assert growth(DAMPED, "P", 0.9999 * critical) < 0 < growth(DAMPED, "P", 1.0001 * critical)


@pytest.mark.parametrize("spin", [0.0, 10.0, 80.0])
def test_a_disc_on_a_shaft_whirls_forward_faster_than_backward(spin: float) -> None:
    """A w^2 -+ C spin w - k = 0: A. Stodola, 1918; as in Campbell's diagram."""
    values = np.linalg.eigvals(small_motions(DISC, "spin", spin).A)
    found = np.sort(np.abs(values.imag[values.imag > 1e-3]))
    half = 0.9 * spin / (2 * 0.5)
    whirl = np.sqrt(half**2 + 200 / 0.5)
    assert found == pytest.approx([whirl - half, whirl + half], rel=1e-6)


def test_a_chain_hangs_with_slopes_in_equal_steps() -> None:
    """Links of one weight: the tangents of their angles are an arithmetic progression. P. Varignon, 1725."""
    n = 6
    ends = [
        (" + ".join(f"cos(a{k})" for k in range(i + 1)), " + ".join(f"sin(a{k})" for k in range(i + 1)))
        for i in range(n)
    ]
    lines = ["[mechanism]", 'name = "chain"', "[gravity]", "acceleration = 9.81", "[coordinates]"]
    lines += [f'a{i} = {{ unit = "rad", guess = {0.4 * (i - 2.5)} }}' for i in range(n)]
    lines += ["[bodies]", *(f'b{i} = {{ mass = 1, position = ["{x}", "{y}"] }}' for i, (x, y) in enumerate(ends[:-1]))]
    lines += ["[constraints.holonomic]", f'x = "{ends[-1][0]} - 4.5"', f'y = "{ends[-1][1]}"']
    slopes = np.tan(equilibria(read("\n".join(lines), "chain.toml"))[0].q)
    assert np.diff(slopes) == pytest.approx(np.full(n - 1, slopes[1] - slopes[0]), abs=1e-9)
    assert slopes[1] - slopes[0] > 0.1
