"""Edges and kinks of what bears: a ball rolls off a table at 1 m/s and falls by 1 m; a bead slides on a bent wire."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from lag2fmu import simulate, validate
from lag2fmu.errors import SimulationError
from lag2fmu.fmu import Fmu
from lag2fmu.formats.text import read
from lag2fmu.verify.run import Kind

pytestmark = pytest.mark.fmu

G = 9.81
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
    step = exported(read(BALL + 'gap = "y - if(x < 1, 0, 0.5)"', "edge"))
    with pytest.raises(SimulationError, match=r"time 1 a condition turns in the gap of table, which jumps to -0\.5"):
        simulate(step, stop_time=2, step=1)
    with pytest.raises(SimulationError, match=r"gap of table jumps to -0\.5"):
        validate(step, stop_time=2)


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
