"""Nominal values that nobody gave: small worlds are measured by their own size, large ones are left alone."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp

import lag2fmu
from lag2fmu.description.symbols import Declared
from lag2fmu.dynamics import derive, lower
from lag2fmu.errors import DerivationError
from lag2fmu.formats.loading import load
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.mechanism import Body, Constraint, Contact, Energy, Mechanism, coordinate, parameter
from lag2fmu.procedure.steps import procedure

CANTILEVER, BALANCE = 2 * math.pi * 1e4, 2 * math.pi * 4


def oscillator(x: Declared, omega: float, mass: float = 1e-12, **further: object) -> Mechanism:
    m, k = parameter("m", mass), parameter("k", mass * omega**2)
    energy = Energy(m * x.dot**2 / 2, k * x**2 / 2)
    return Mechanism("small", coordinates=[x], parameters=[m, k], energy=energy, **further)  # type: ignore[arg-type]


def pendulum(start: float, sign: int = 1) -> Mechanism:
    rod, theta = parameter("l", 1.0, "m"), coordinate("theta", "rad", start=start)
    bob = Body("bob", 1, (rod * sp.sin(theta), -sign * rod * sp.cos(theta)))
    return Mechanism("pendulum", coordinates=[theta], parameters=[rod], bodies=[bob], gravity=sp.Float(9.81))


def nominal(mechanism: Mechanism) -> float:
    return derive(mechanism).mechanism.coordinates[0].nominal


@pytest.mark.parametrize(
    ("mechanism", "expected"),
    [
        (oscillator(coordinate("x", "m", start=1e-9), CANTILEVER), 1e-9),
        (oscillator(coordinate("x", "m", velocity=3e-9 * CANTILEVER), CANTILEVER), 1e-8),  # swings by 3e-9 m
        (oscillator(coordinate("x", "m", start=1e-9, nominal=1.0), CANTILEVER), 1.0),  # given
        (oscillator(coordinate("x", "m", minimum=-2e-6, maximum=2e-6), CANTILEVER), 1e-5),
        (oscillator(coordinate("x", "mm", start=1e-3), CANTILEVER), 1e-6),
        (oscillator(coordinate("x", "mm", start=5.0), CANTILEVER), 1e-3),  # 1 in its unit, not more
        (oscillator(coordinate("phi", "rad", start=1e-3), BALANCE), 1e-3),
        (oscillator(coordinate("x", "m"), CANTILEVER), 1.0),  # at rest, of no size
        (pendulum(1e-9), 1e-4),  # not 1e-9: its swings may become large
        (pendulum(1e-9, sign=-1), 1.0),  # it falls
        (pendulum(0.5), 1.0),
    ],
)
def test_the_nominal_value_follows_from_the_mechanism(mechanism: Mechanism, expected: float) -> None:
    assert nominal(mechanism) == pytest.approx(expected, rel=1e-12)


def test_forces_that_come_later_and_weights_count() -> None:
    """A weight sags by m g/k = 1e-3 m; a force of 1e-4 k sin(2 t) begins with 0."""
    x, m, k, g = coordinate("x", "m"), parameter("m", 1.0), parameter("k", 9810.0), parameter("g", 9.81)
    hanging = Energy(m * x.dot**2 / 2, k * x**2 / 2 - m * g * x)
    assert nominal(Mechanism("sag", coordinates=[x], parameters=[m, k, g], energy=hanging)) == pytest.approx(1e-2)
    shaken = {x: sp.Rational(1, 10**4) * sp.Symbol("k") * sp.sin(2 * sp.Symbol("t"))}
    assert nominal(oscillator(x, 100.0, forces=shaken)) == pytest.approx(1e-4)


def test_what_a_constraint_drives_goes_as_far_as_it_is_driven() -> None:
    """A crank that turns by omega t, and a flap that trembles: both angles had the size of the tremble, 1e-4 rad."""
    crank, flap = coordinate("crank", "rad", velocity=150.0), coordinate("flap", "rad", start=1e-6)
    energy = Energy(crank.dot**2 / 2 + flap.dot**2 / 2, 1e6 * flap**2 / 2)
    drive = Constraint("drive", crank - 150 * sp.Symbol("t"))
    found = derive(Mechanism("driven", coordinates=[crank, flap], energy=energy, constraints=[drive]))
    assert [q.nominal for q in found.mechanism.coordinates] == [1.0, 1.0]


def test_coordinates_of_one_dimension_share_a_size() -> None:
    """What the other coordinates swing up is of their size: bar and screw of Wilberforce's pendulum, beats of two."""
    x, y, k = coordinate("x", "m", start=1e-6), coordinate("y", "m"), parameter("k", 100.0)
    energy = Energy(x.dot**2 / 2 + y.dot**2 / 2, k * (x**2 + y**2 + (x - y) ** 2) / 2)
    found = derive(Mechanism("beats", coordinates=[x, y], parameters=[k], energy=energy)).mechanism.coordinates
    assert [q.nominal for q in found] == pytest.approx([1e-6, 1e-6])
    assert [q.nominal for q in derive("wilberforce_pendulum").mechanism.coordinates] == [0.1, 1.0]


def test_bundled_models_keep_their_nominal_values() -> None:
    changed = {}
    for name in ("slides_problem_5_small", "humanoid_planar", "sphere_on_incline", "rattleback", "pendulum", "kepler"):
        given = load(name)
        pairs = zip(given.coordinates, derive(given).mechanism.coordinates, strict=True)
        changed |= {(name, old.name): new.nominal for old, new in pairs if new.nominal != old.nominal}
    assert changed == {("slides_problem_5_small", "phi"): 0.1}


def test_a_cantilever_of_a_picogram_is_right(exported) -> None:
    """x = 1e-9 m cos(omega t) over ten periods; with a nominal value of 1 m it was wrong by 27 %. The FMU says 1e-9."""
    mechanism = oscillator(coordinate("x", "m", start=1e-9), CANTILEVER)
    fmu = exported(mechanism)
    run = lag2fmu.simulate(fmu, stop_time=1e-3, step=2e-5)
    times = np.linspace(0.0, 1e-3, len(run["x"]))
    assert np.abs(run["x"] - 1e-9 * np.cos(CANTILEVER * times)).max() < 2e-5 * 1e-9
    assert {v.name: v.nominal for v in fmu.description.variables}["x"] == pytest.approx(1e-9)
    assert "nominal 1e-09 m, from the linear motion about its start" in procedure(mechanism)
    assert "nominal" not in write(mechanism), "what follows is not part of the text"
    assert derive(read(write(fmu.mechanism), "small.toml")).completed == fmu.mechanism


def test_a_small_rod_is_a_constraint_and_rounding_errors_are_none() -> None:
    """The slopes of x**2 + y**2 - l**2 are 1e-18 m2 about l = 1e-9 m: as small as what cancels in a large one."""
    x, y = coordinate("x", "m", start=6e-10), coordinate("y", "m", start=-8e-10)
    bob = Body("bob", 1e-12, (x, y))
    rod = Constraint("rod", x**2 + y**2 - sp.Float("1e-18"))
    found = derive(Mechanism("small", coordinates=[x, y], bodies=[bob], constraints=[rod]))
    assert [q.nominal for q in found.mechanism.coordinates] == pytest.approx([1e-9, 1e-9])
    nothing = Constraint("rod", sp.sin(x + y) - sp.sin(x) * sp.cos(y) - sp.cos(x) * sp.sin(y) + 1)
    with pytest.raises(DerivationError, match="whatever the coordinates are"):
        derive(Mechanism("none", coordinates=[x, y], bodies=[bob], constraints=[nothing]))


def test_a_ball_of_a_picogram_bounces_and_rests(exported) -> None:
    """Dropped by h with e = 0.8 it rises to 0.64 h and rests at 9 sqrt(2 h/g); it used to stop with an error."""
    h = 1e-12
    y, fall = coordinate("y", "m", start=h), math.sqrt(2 * h / 9.81)
    floor = Contact("floor", gap=y, restitution=0.8)
    bodies = [Body("ball", 1e-12, (0, y))]
    mechanism = Mechanism("speck", coordinates=[y], bodies=bodies, gravity=sp.Float(9.81), contacts=[floor])
    seen = ["y", "floor_mode", "floor_force"]
    run = lag2fmu.simulate(exported(mechanism), stop_time=12 * fall, step=fall / 100, outputs=seen)
    assert run["y"][180] == pytest.approx(0.64 * h, rel=1e-9)
    assert run.time[run["floor_mode"] != 1][0] == pytest.approx(9 * fall, abs=fall / 99)
    assert run["floor_force"][-1] == pytest.approx(9.81e-12, rel=1e-12)


def test_a_switch_has_a_size_although_its_slope_vanishes_at_a_symmetrical_start() -> None:
    """Balls one above the other: how far their normal leans has the slope 0 there, or 4e-16 by rounding.

    With such a size the rounding of a normal that stays level made events without end among three balls in a box.
    """
    text = '[mechanism]\nname = "balls"\n[coordinates]\n'
    for i, height in enumerate((0.3, 3 * 0.3)):
        text += f'x{i} = {{ unit = "m" }}\ny{i} = {{ unit = "m" }}\nz{i} = {{ unit = "m", start = {height} }}\n'
    for i in (0, 1):
        text += f'[bodies.b{i}]\nposition = ["x{i}", "y{i}", "z{i}"]\nmass = 1\n'
    text += '[contacts.c]\nkind = "sphere_sphere"\nbetween = ["b0", "b1"]\nradius = [0.1, 0.1]\nfriction = 0.3\n'
    leans, *_ = lower(derive(read(text, "balls.toml"))).event_functions
    assert "sqrt" in leans.name
    assert 0.1 < leans.nominal < 10
