"""Linearizations within the modes of contacts, stops, dry frictions and latches: closed forms, and differences."""

from __future__ import annotations

import numpy as np
import pytest

import lag2fmu
from lag2fmu.analysis.evaluation import at, operating_inputs
from lag2fmu.analysis.present_modes import solved, within_modes
from lag2fmu.dynamics import derive
from lag2fmu.errors import DerivationError
from lag2fmu.formats.loading import load
from lag2fmu.mechanism import (
    Body,
    Constraint,
    Contact,
    Friction,
    Mechanism,
    Spring,
    Stop,
    coordinate,
    parameter,
    signal,
)

G = 9.81


def block(friction: float, velocity: float = 0.0, height: float = 0.0) -> Mechanism:
    """2 kg on a floor, drawn to x = 0 by 50 N/m from x = 0.1 m, and down by 3 N/m x."""
    x, y, F = coordinate("x", "m", start=0.1, velocity=velocity), coordinate("y", "m", start=height), signal("F", "N")
    mu = parameter("mu", friction)
    return Mechanism(
        "block",
        coordinates=[x, y],
        parameters=[mu],
        inputs=[F],
        bodies=[Body("b", 2, (x, y))],
        gravity=G,
        springs=[Spring("s", 50, elongation=x)],
        contacts=[Contact("floor", gap=y, slip=x.dot, friction=mu)],
        forces={x: F, y: -3 * x},
    )


@pytest.mark.parametrize(
    ("friction", "velocity", "way"), [(0.1, 1.0, 1), (0.1, -1.0, -1), (0.1, 0.0, -1), (0.0, 0.0, 0)]
)
def test_a_block_that_slides_bears_friction_that_follows_its_load(friction: float, velocity: float, way: int) -> None:
    """2 x" = F + Q_x - 50 x - way mu (2 g + 3 x - Q_y); what starts from rest slides where it is drawn."""
    found = lag2fmu.linearize(block(friction, velocity), outputs=["x"]).state_space()
    drag = way * friction
    assert [x.name for x in found.states] == ["x", "x_dot"]
    assert pytest.approx(np.array([[0, 1], [-25 - 1.5 * drag, 0]]), rel=1e-12) == found.A
    assert pytest.approx(np.array([[0, 0, 0], [0.5, drag / 2, 0.5]]), rel=1e-12) == found.B
    assert found.drift == pytest.approx([velocity, -2.5 - drag * (G + 0.15)], rel=1e-12)


def test_what_sticks_or_is_in_the_air() -> None:
    stuck = lag2fmu.linearize(block(0.9)).state_space()
    assert [x.name for x in stuck.states] == ["x"]  # a velocity that is 0 leaves the place free
    assert stuck.A == stuck.drift == 0
    air = lag2fmu.linearize(block(0.9, height=0.1), outputs=["floor_gap"]).state_space(["Q_y"])
    assert [x.name for x in air.states] == ["x", "y", "x_dot", "y_dot"]
    assert air.drift == pytest.approx([0, 0, -2.5, -G - 0.15])
    assert air.C.tolist() == [[0, 1, 0, 0]]


def test_stops_dry_friction_and_latches() -> None:
    """A mass on a stop, held by a latch to another one that rubs: together 3 kg and the rail's 7 N sgn."""
    x, y, z = (coordinate(n, "m", start=s, velocity=v) for n, s, v in (("x", 0, 0.5), ("y", 0, 0.5), ("z", 1, 0)))
    F = signal("F", "N", start=-5.0)
    mechanism = Mechanism(
        "m",
        coordinates=[x, y, z],
        inputs=[F],
        bodies=[Body("a", 1, (x, 0)), Body("b", 2, (y, 0)), Body("c", 4, (z, 0))],
        springs=[Spring("s", 12, elongation=x), Spring("t", 9, elongation=z - 2)],
        constraints=[Constraint("grip", x - y, while_=1 - x)],
        stops=[Stop("wall", of=z, lower=-3, upper=1)],
        frictions=[Friction("rail", on=y.dot, force=7 + 2 * x)],
        forces={z: F},
    )
    found = lag2fmu.linearize(mechanism, outputs=["x", "y", "z"]).state_space()
    place = found.states[0].name
    assert place in "xy"
    assert [s.name for s in found.states] == [place, f"{place}_dot"]
    assert pytest.approx(np.array([[0, 1], [-14 / 3, 0]]), rel=1e-12) == found.A
    assert pytest.approx(np.array([[1, 0], [1, 0], [0, 0]]), abs=1e-12) == found.C
    away = lag2fmu.linearize(mechanism, inputs={"F": -20.0}).state_space()
    assert len(away.states) == 4  # drawn from the stop
    assert away.poles[0].frequency == pytest.approx(1.5, rel=1e-9)


def test_two_frictions_on_one_velocity_add_up() -> None:
    x = coordinate("x", "m", velocity=1.0)
    rubs = [Friction("a", on=x.dot, force=1 + x), Friction("b", on=x.dot, force=2 + 3 * x)]
    found = lag2fmu.linearize(Mechanism("m", coordinates=[x], bodies=[Body("b", 2, (x, 0))], frictions=rubs))
    assert found.A.tolist() == [[0, 1], [-2, 0]]
    assert found.drift.tolist() == [1, -1.5]


def test_a_sphere_that_slides_in_two_directions_against_differences() -> None:
    """The way of friction turns with the slip; differences of the accelerations of the same mode."""
    equations = derive(load("sliding_sphere"))
    n = len(equations.forcing)
    q = np.array([c.start for c in equations.mechanism.coordinates])
    qd = np.array([c.velocity for c in equations.mechanism.coordinates])
    values = {**operating_inputs(equations), "t": 0.0}
    found = lag2fmu.linearize(equations)
    within, step = within_modes(equations, at(equations, values, q, qd)), 1e-6
    for k in range(found.A.shape[0]):
        ahead, behind = (
            solved(within, at(equations, values, q + s * found.shape[:n, k], qd + s * found.shape[n:, k]))[0]
            for s in (step, -step)
        )
        rows = [i for i, name in enumerate(found.states) if name.endswith("_dot")]
        names = [f"{c.name}_dot" for c in equations.mechanism.coordinates]
        slope = dict(zip(names, (ahead - behind) / (2 * step), strict=True))
        expected = [slope[found.states[i]] for i in rows]
        assert found.A[rows, k] == pytest.approx(expected, abs=2e-7 * np.abs(found.A).max())


def test_states_without_modes_are_named() -> None:
    x = coordinate("x", "m", velocity=-1.0)
    ball = Mechanism("ball", coordinates=[x], bodies=[Body("b", 1, (0, x))], contacts=[Contact("floor", gap=x)])
    with pytest.raises(DerivationError, match=r"contacts\.floor: it hits with 1 \(SI\) at the state"):
        lag2fmu.linearize(ball)
    with pytest.raises(DerivationError, match=r"contacts\.floor: it overlaps by 0\.1 \(SI\) at the state"):
        lag2fmu.linearize(ball, q=np.array([-0.1]), qd=np.zeros(1))
