"""What is said about starts that the constraints move, and about bounds that stop nothing."""

from __future__ import annotations

import pytest

from lag2fmu import simulate
from lag2fmu.dynamics import derive
from lag2fmu.fmu.advice import moved_starts
from lag2fmu.formats.text import read
from lag2fmu.procedure.steps import procedure

WIRE = """
[mechanism]
name = "wire"
[coordinates]
x = {{ unit = "m", start = 0.5, min = -2.0, max = 3.0 }}
y = {{ unit = "m", {y} }}
[energy]
kinetic = "(x_dot**2 + y_dot**2)/2"
potential = "9.81*y"
[constraints.holonomic]
wire = "y - x**2"
"""


def test_starts_that_the_constraints_move_are_named() -> None:
    """y = x^2 = 0.25 m, whatever is guessed; a guess that is right is not mentioned."""
    for y, expected in (("guess = 0.2", "the constraints move the start to y = 0.25 m"), ("guess = 0.25", "")):
        mechanism = read(WIRE.format(y=y), "wire.toml")
        assert moved_starts(mechanism, derive(mechanism)) == expected


def test_show_says_what_the_constraints_move_and_that_bounds_are_no_stops() -> None:
    text = procedure(read(WIRE.format(y="guess = 0.2"), "wire.toml"))
    assert "starts at 0.25 m, by the constraints" in text
    assert "min -2 m and max 3 m are no stops" in text


def test_a_bound_at_which_a_stop_holds_is_not_said_to_be_none() -> None:
    """The other one still is."""
    stop = "[stops.end]\nof = 'x'\nupper = 3.0\n"
    text = procedure(read(WIRE.format(y="guess = 0.2") + stop, "wire.toml"))
    assert "min -2 m is no stop" in text
    assert "max 3 m" not in text


@pytest.mark.fmu
@pytest.mark.parametrize(("stop", "told"), [("[stops.floor]\nof = 'x'\nlower = 0.0\n", 0), ("", 1)])
def test_a_run_is_warned_of_a_bound_unless_a_stop_holds_there(stop: str, told: int, caplog) -> None:
    """What falls comes to the bound and stays within rounding of it, or passes it."""
    text = "[mechanism]\nname = 'fall'\n[coordinates]\nx = { unit = 'm', start = 0.1, min = 0.0 }\n"
    text += "[energy]\nkinetic = 'x_dot**2/2'\npotential = '9.81*x'\n" + stop
    run = simulate(read(text, "fall.toml"), stop_time=0.3, step=0.01)
    assert bool(min(run["x"]) < -1e-3) is bool(told)
    assert len([record for record in caplog.records if "leaves its range" in record.getMessage()]) == told
