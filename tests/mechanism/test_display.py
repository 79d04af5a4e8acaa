"""Values given and read in the units that a mechanism declares."""

from __future__ import annotations

import math

import pytest

from lag2fmu.dynamics import derive
from lag2fmu.errors import LoadError
from lag2fmu.formats.loading import load, with_settings
from lag2fmu.formats.text import read
from lag2fmu.mechanism.calculated_units import calculated_units
from lag2fmu.mechanism.display import display_units, shown
from lag2fmu.reference import Trajectory, parse_csv

CRANE = read(
    """
[mechanism]
name = "crane"
[parameters]
p = { value = 2, unit = "bar" }
[coordinates]
alpha = { unit = "deg", start = 20 }
x = { unit = "mm" }
[inputs]
n = { unit = "rpm", start = 1 }
[energy]
kinetic = "alpha_dot**2 + x_dot**2"
[forces]
x = "p*n"
[outputs]
force = { expression = "p*n", unit = "kN" }
""",
    "crane.toml",
)
UNITS = display_units(CRANE)


def test_settings_are_in_declared_units() -> None:
    """30 degrees are pi/6, 2.5 bar 250 kPa, 60 rpm 2 pi rad/s; a unit of one's own is converted."""
    texts = {"alpha": "30", "alpha_dot": "180", "x": "9", "x_dot": "0.5 m/s", "p": "2.5", "n": "60"}
    m = with_settings(CRANE, texts)
    alpha, x = m.coordinates
    assert [alpha.start, alpha.velocity] == pytest.approx([math.pi / 6, math.pi], rel=1e-15)
    assert [x.start, x.velocity, m.parameters[0].value] == [0.009, 0.5, 2.5e5]
    assert m.inputs[0].start == pytest.approx(2 * math.pi, rel=1e-15)
    assert shown("alpha", alpha.start, UNITS) == "30 deg"
    assert shown("n", m.inputs[0].start, UNITS) == "60 rpm"


@pytest.mark.parametrize(
    ("text", "message"),
    [("1,5", r"not a number; write 1.5"), ("3 m", "'m' is no unit of 'alpha', which is in deg"), ("3 foo", "unknown")],
)
def test_settings_in_other_units_are_refused(text: str, message: str) -> None:
    with pytest.raises(LoadError, match=message):
        with_settings(CRANE, {"alpha": text})


def test_csv_carries_the_units_and_is_read_back() -> None:
    run = Trajectory.of(
        [0.0, 0.1], {"alpha": [0.5, math.pi / 6], "x": [0.009, 1e-3], "force": [1e3, -2.5e4], "a": [1, 2]}
    )
    text = run.to_csv(UNITS)
    assert text.splitlines()[0] == "time,alpha [deg],x [mm],force [kN],a"
    assert text.splitlines()[2].split(",")[2:] == ["1.0", "-25.0", "2.0"]
    again = parse_csv(text, units=UNITS)
    assert again.names == run.names
    assert again.values == pytest.approx(run.values, rel=4e-16)
    assert parse_csv("time [ms],x[1]\n0,1\n500,2\n").time.tolist() == [0.0, 0.5]


@pytest.mark.parametrize(
    ("heading", "message"),
    [("x [N]", "'N' is no unit of it; it is in mm"), ("x [foo]", "unknown unit 'foo'")],
)
def test_csv_in_other_units_is_refused(heading: str, message: str) -> None:
    with pytest.raises(LoadError, match=message):
        parse_csv(f"time,{heading}\n0,1\n", units=UNITS)


def test_units_of_what_derivation_adds_do_not_depend_on_what_was_asked_before() -> None:
    """A mechanism counts as the same with and without the equilibria of what has no mass."""
    small = load("slides_problem_5_small")
    assert "multiplier_massless_x" not in calculated_units(small)
    assert "multiplier_massless_x" in calculated_units(derive(small).mechanism)
