"""Communication steps of any length: from the least number there is, in any order, each one ends where it is to end."""

from __future__ import annotations

import random
from collections.abc import Iterator

import numpy as np
import pytest
from stepping import Stepping
from stepping3 import Stepping3

from lag2fmu.formats.text import read

pytestmark = pytest.mark.fmu

TINY = [5e-324, 4e-320, 1e-310, 1e-300, 1e-200, 1e-100, 1e-40, 1e-31, 1e-29, 1e-25, 1e-20, 1e-17, 1e-15, 1e-12, 1e-8]
"""Lengths (s) on both sides of all that is compared with them."""
USUAL = [1e-3, 1e-2, 5e-2]
SLOW = [
    *[("gripper", solver) for solver in ("dopri5", "radau5", "moreau", "rk4")],
    *[("rocking_block", "radau5"), ("clutch_pair", "ros2"), ("woodpecker", "radau5"), ("coulomb_oscillator", "dop853")],
    *[("double_pendulum", solver) for solver in ("verlet", "lobatto4", "gauss6")],
    *[("four_bar_linkage", "radau5"), ("block_on_belt", "dopri5"), ("crane", "dopri5")],
]
CASES = [("crane", "dopri5", 5), *(pytest.param(*case, 1, marks=pytest.mark.slow) for case in SLOW)]
"""Model, solver, and every which sequence is taken."""
SWITCHED = """
[mechanism]
name = "switched"
[coordinates]
x = { unit = "m", start = 0.0 }
[parameters]
at = { value = 1e-35, unit = "s" }
[bodies.cart]
mass = "1"
position = ["x", "0"]
[forces]
x = "if(t > at, 2, 0)"
"""
FAR = """
[mechanism]
name = "far"
[coordinates]
x = { unit = "m", start = 1000, velocity = 1 }
y = { unit = "m", start = 0.5, velocity = -1 }
z = { unit = "m", start = 0.500000000002, velocity = -1 }
[bodies]
puck = { mass = 1, position = ["x", 0] }
first = { mass = 1, position = [0, "y"] }
second = { mass = 1, position = [0, "z"] }
[contacts]
wall = { gap = "y", restitution = 0.5 }
other = { gap = "z", restitution = 0.5 }
"""


def sequences(seed: int, count: int) -> Iterator[list[float]]:
    """Rows of steps (s): tiny ones first, in the middle, and at random."""
    chance = random.Random(seed)
    for tiny in TINY:
        yield [tiny, 0.01, 0.01]
        yield [0.01, tiny, tiny, 0.01]
    for _ in range(count):
        yield [chance.choice(TINY + 5 * USUAL) for _ in range(12)]


@pytest.mark.parametrize(("model", "solver", "every"), CASES)
def test_every_sequence_ends_where_the_usual_steps_end(model: str, solver: str, every: int, exported) -> None:
    """The states after it are those of one step to that time, as far as both are exact."""
    path = exported(model, solver=solver).path
    bar = 1e-4 if solver in {"dopri5", "dop853", "radau5"} else 0.05
    for steps in list(sequences(1, 8))[::every]:
        with Stepping(path) as fmu, Stepping(path) as other:
            fmu.start()
            other.start()
            for length in steps:
                found = fmu.step(length)  # raises unless it is taken
            for length in (length for length in steps if length >= min(USUAL)):
                expected = other.step(length)
            np.testing.assert_allclose(found, expected, rtol=bar, atol=bar, err_msg=str(steps))


@pytest.mark.parametrize(
    "model", [pytest.param(m, marks=pytest.mark.slow) for m in ("gripper", "crane", "block_on_belt")]
)
@pytest.mark.parametrize("early", [False, True])
@pytest.mark.parametrize("events", [False, True])
def test_every_sequence_ends_by_fmi_3(model: str, events: bool, early: bool, exported) -> None:
    path = exported(model, fmi="3.0").path
    for steps in sequences(2, 8):
        with Stepping3(path, events=events, early=early) as fmu:
            fmu.start()
            times = np.unique(np.cumsum([0.0, *steps]))
            fmu.run(times.tolist(), ["time"])


@pytest.mark.parametrize("first", [1e-34, 1e-36, 1e-28])
def test_a_switch_that_turns_in_a_tiny_step_is_seen(first: float, exported) -> None:
    """At the next step: from there the force acts."""
    with Stepping(exported(read(SWITCHED, "switched")).path) as fmu:
        fmu.start()
        fmu.step(first)
        x, speed = fmu.step(0.5)
        assert speed == pytest.approx(1.0, rel=1e-6)
        assert x == pytest.approx(0.25, rel=1e-6)


def test_no_tiny_step_makes_a_velocity_of_the_rounding_of_a_place(exported) -> None:
    """A puck slides by 1 m/s and is far away, as balls strike walls: over 1e-12 s its place is rounded by .1 m/s."""
    with Stepping(exported(read(FAR, "far.toml"), solver="radau5").path) as fmu:
        fmu.start()
        for length in (0.5 + 1e-12, 1e-12, 3e-12, 0.1):
            found = dict(zip(fmu.states, fmu.step(length), strict=True))
            assert found["x_dot"] == pytest.approx(1.0, rel=1e-11)
        assert found["y_dot"] == found["z_dot"] == pytest.approx(0.5)
