"""Impacts that follow one another without end between several bodies: their limit in closed form, whoever integrates.

In the limit nothing approaches any more and momentum is what it was: the bodies go on together. Sources: S. McNamara,
W. R. Young, Inelastic collapse and clumping in a one-dimensional granular medium, Physics of Fluids A 4 (1992), p. 496;
D. Goldman and others, Absence of inelastic collapse in a realistic three ball model, Physical Review E 57 (1998).
"""

from __future__ import annotations

import numpy as np
import pytest

import lag2fmu
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Mechanism
from lag2fmu.reference.direct_integration import integrate

pytestmark = pytest.mark.fmu

CO_SIMULATION, MODEL_EXCHANGE = {}, {"kind": "model-exchange"}
MASS = np.array([4.0, 1.0, 2.0])


def _train(push: float, way: float, coupling: float = 0.0) -> Mechanism:
    """Two carts touch and stand, a third one strikes them at 1 m/s after this way (m); the first one is pushed (N)."""
    return read(
        f"""
        [mechanism]
        name = "train"
        [coordinates]
        a = {{ unit = "m", start = 0.0 }}
        b = {{ unit = "m", start = 0.1 }}
        c = {{ unit = "m", start = {0.2 + way!r}, velocity = -1.0 }}
        [bodies]
        first = {{ mass = {MASS[0]}, position = ["a", 0] }}
        second = {{ mass = {MASS[1]}, position = ["b", 0] }}
        third = {{ mass = {MASS[2]}, position = ["c", 0] }}
        [forces]
        a = {push!r}
        [contacts]
        coupling = {{ gap = "b - a - 0.1", restitution = {coupling!r} }}
        buffer = {{ gap = "c - b - 0.1", restitution = 0.3 }}
        """,
        "train",
    )


def _velocities(mechanism: Mechanism, way: str, stop: float = 0.01) -> np.ndarray:
    """The last velocities (m/s)."""
    names = ["a_dot", "b_dot", "c_dot"]
    if way == "judge":
        return integrate(mechanism, np.linspace(0.0, stop, 11), rtol=1e-10).trajectory.columns(names)[-1]
    options = MODEL_EXCHANGE if way == "CVode" else CO_SIMULATION
    return lag2fmu.simulate(mechanism, stop_time=stop, step=stop / 10, outputs=names, **options).columns(names)[-1]


WAYS = pytest.mark.parametrize("way", ["co-simulation", "CVode", "judge"])


@WAYS
@pytest.mark.parametrize(("push", "gap"), [(0.0, 0.0), (-1.0, 0.0), (-1e-3, 0.0), (0.0, 1e-4), (-1e-3, 1e-4)])
def test_what_collapses_goes_on_together(push: float, gap: float, way: str) -> None:
    """The coupling bears nothing, and a pull opens it by less than can be seen between two impacts.

    It took part in impacts of the buffer where these counted as one, as if it was pressed: the third cart rebounded.
    """
    together = MASS @ [0, 0, -1] / MASS.sum()
    velocities = _velocities(_train(push, gap), way)
    assert velocities[1:] == pytest.approx(together, abs=1e-6)
    assert velocities[0] == pytest.approx(together + push / MASS[0] * 0.01, abs=1e-6)


@WAYS
def test_what_is_pressed_rebounds_as_one(way: str) -> None:
    """Under load the coupling takes part in the impact, at the start as well."""
    common, rebound = MASS @ [0, 0, -1] / MASS.sum(), 0.3 * MASS[:2].sum() / MASS.sum()
    velocities = _velocities(_train(1.0, 0.0), way)
    assert velocities[2] == pytest.approx(common + rebound, abs=1e-9)
    assert velocities[:2] == pytest.approx(velocities[2] - 0.3 + 0.01 / MASS[:2].sum(), abs=1e-9)


@WAYS
def test_three_balls_collapse(way: str) -> None:
    """With e < 7 - 4 sqrt(3) = 0.0718 impacts of three equal balls never end: each is followed one by one at first."""
    text = """
        [mechanism]
        name = "balls"
        [coordinates]
        a = { unit = "m", start = 0.0, velocity = 1.0 }
        b = { unit = "m", start = 0.2 }
        c = { unit = "m", start = 0.4, velocity = -1.0 }
        [bodies]
        first = { mass = 1, position = ["a", 0] }
        second = { mass = 1, position = ["b", 0] }
        third = { mass = 1, position = ["c", 0] }
        [contacts]
        left = { gap = "b - a - 0.1", restitution = 0.05 }
        right = { gap = "c - b - 0.12", restitution = 0.05 }
        """
    assert _velocities(read(text, "balls"), way, stop=1.0) == pytest.approx([0, 0, 0], abs=1e-8)


def test_a_table_that_rises_meets_what_collapses_on_it(exported) -> None:
    """An impact that CVode finds late is put back in time; when time went on, the table alone did, by 1e-8 m.

    The gap was below 0 then without an event, and the ball fell through the table.
    """
    heights, speeds, masses = (
        (0.202, 0.452, 0.559, 0.876),
        (-0.463, -0.589, -0.597, 0.089),
        (0.265, 0.937, 0.0673, 0.281),
    )
    balls = range(4)
    below = ["(0.0258*sin(23.602*t))", *(f"y{i} - 0.1" for i in balls)]
    text = "\n".join(
        [
            '[mechanism]\nname = "balls"\n[coordinates]',
            *(f'y{i} = {{ unit = "m", start = {heights[i]}, velocity = {speeds[i]} }}' for i in balls),
            "[bodies]",
            *(f'b{i} = {{ mass = {masses[i]}, position = [0, "y{i}"] }}' for i in balls),
            "[contacts]",
            *(f'c{i} = {{ gap = "y{i} - {below[i]}", restitution = {(0.2, 0.3, 0.2, 0.3)[i]} }}' for i in balls),
            "[gravity]\nacceleration = 9.81\n[experiment]\nstop_time = 1.5\nstep = 0.01",
        ]
    )
    fmu, gaps = exported(read(text, "balls")), [f"c{i}_gap" for i in balls]
    run = lag2fmu.simulate(fmu, stop_time=0.34, step=0.01, outputs=gaps, **MODEL_EXCHANGE)
    assert run.columns(gaps).min() > -1e-5


SAFETY_GEAR = """
    [mechanism]
    name = "safety_gear"
    [coordinates]
    y = {{ unit = "m", velocity = -2.0, doc = "height of the car" }}
    u = {{ unit = "m", start = 0.002, doc = "place of the shoe, a wedge on its slope, before its spring" }}
    s = {{ unit = "m", doc = "way of the wedge on the shoe" }}
    [gravity]
    acceleration = 9.81
    [bodies]
    car = {{ mass = 500, position = [0, "y"] }}
    shoe = {{ mass = 5, position = ["u + 0.1", "y"] }}
    wedge = {{ mass = {wedge}, position = ["0.15*s + u", "y + s"] }}
    [springs.seat]
    stiffness = {k}
    elongation = "u - 0.002"
    [dampers.seat]
    damping = {damping}
    rate = "u_dot"
    [forces]
    s = 100.0
    [contacts.rail]
    gap = "0.012 - 0.15*s - u"
    slip = "y_dot + s_dot"
    friction = {friction}
    [stops.travel]
    of = "s"
    lower = 0
    upper = 0.2
"""


# wedge (kg), damping (N.s/m), stiffness (N/m), coefficient of friction: the impacts of the second one shrink to 1e-9 m
GEARS = pytest.mark.parametrize("gear", [(2, 2e3, 2e6, 0.35), (8, 25.0, 2.5e6, 0.6)])


@GEARS
@WAYS
def test_a_wedge_comes_to_rest_between_rail_and_stop(way: str, gear: tuple[float, ...]) -> None:
    wedge, damping, stiffness, friction = gear
    mechanism = read(SAFETY_GEAR.format(wedge=wedge, damping=damping, k=stiffness, friction=friction), "safety_gear")
    times = np.linspace(0.0, 0.2, 21)
    if way == "judge":
        speeds = integrate(mechanism, times, rtol=1e-8).trajectory.columns(["y_dot"])[:, 0]
    else:
        options = MODEL_EXCHANGE if way == "CVode" else CO_SIMULATION
        speeds = lag2fmu.simulate(mechanism, stop_time=0.2, step=0.01, tolerance=1e-8, **options)["y_dot"]
    pressed = stiffness * (0.002 - 0.012 + 0.15 * 0.2)  # by the spring, while the stop holds the wedge
    slows = np.diff(speeds[16:]) / 0.01
    assert slows == pytest.approx(friction * pressed / (505 + wedge) - 9.81, rel=1e-6)
