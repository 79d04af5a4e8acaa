"""Latches that hand a load over, and conditions on what they hold."""

from __future__ import annotations

import pytest

from lag2fmu import simulate
from lag2fmu.formats.text import read

pytestmark = pytest.mark.fmu

HANDED_OVER = """
[mechanism]
name = "handed_over"
[coordinates]
x = { unit = "m", velocity = 1.0 }
y = { unit = "m" }
[bodies]
a = { mass = 1, position = ["x", 0] }
b = { mass = 1, position = ["y", 0] }
middle = { mass = 1, position = ["(x + y)/2", 0] }
[states.s]
start = -1.0
derivative = "1e6*(if(t > 7.6, 1, -1) - s)"
[constraints.holonomic]
catches = { expression = "x", while = "s" }
lets_go = { expression = "y", while = "-s" }
[experiment]
stop_time = 8.0
"""

LEG = """
[mechanism]
name = "leg"
[coordinates]
x = { unit = "m", velocity = 0.5 }
y = { unit = "m", start = 1.0 }
a = { unit = "rad", velocity = 0.5 }
[gravity]
acceleration = 9.81
[bodies]
hip = { mass = 10, position = ["x", "y"] }
foot = { mass = 0.1, position = ["x - sin(a)", "y - cos(a)"] }
[states.sunk]
derivative = "if(y_dot + sin(a)*a_dot < 0, 1, 0)"
[constraints.holonomic]
across = { expression = "x - sin(a)", while = "1 - t" }
along = { expression = "y - cos(a)", while = "1 - t" }
[experiment]
stop_time = 0.9
step = 0.1
"""


def test_one_latch_lets_go_as_the_other_catches(exported) -> None:
    """s passes 0 so fast that rounding of the time leaves it at 1e-9, and both conditions turn there together.

    p_y = 5/4 y_dot + x_dot/4 stays as x is stopped, so that y_dot = 1/5; both latches at once would stop y, too.
    """
    run = simulate(exported(read(HANDED_OVER, "text")).path, step=0.5)
    assert (run["x_dot"][-1], run["y_dot"][-1]) == pytest.approx((0.0, 0.2), abs=1e-9)


@pytest.mark.parametrize("solver", ["dopri5", "rk4", "verlet"])
def test_a_condition_on_a_velocity_that_a_latch_holds_at_0(exported, solver: str) -> None:
    """The margin is rounding, whose sign means nothing; runs of fixed steps ended, as if it grew beyond all bounds."""
    run = simulate(exported(read(LEG, "text"), solver=solver).path)
    assert run.time[-1] == 0.9
    assert run["a"][-1] == pytest.approx(1.29013, abs=1e-5)
