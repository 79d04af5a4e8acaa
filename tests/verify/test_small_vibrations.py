"""Vibrations too small to be seen beside the nominal values, as that of a spring that replaces a rod."""

import numpy as np
import pytest
import sympy as sp

import lag2fmu
from lag2fmu.mechanism import Body, Mechanism, Spring, coordinate, parameter
from lag2fmu.reference import integrate


def pendulum(stiffness: float) -> Mechanism:
    """A bob of 1 kg on a spring of length 1 m, which stretches by g / stiffness."""
    r, th = coordinate("r", "m", start=1.0), coordinate("th", "rad", start=1.0)
    k = parameter("k", stiffness, "N/m")
    bob = Body("bob", 1, (r * sp.sin(th), -r * sp.cos(th)))
    spring = Spring("rod", k, r - sp.Float(1))
    return Mechanism(
        "stiff", coordinates=[r, th], parameters=[k], bodies=[bob], springs=[spring], gravity=sp.Float(9.81)
    )


def test_errors_may_add_up_over_the_radians_of_a_small_vibration() -> None:
    """A radian adds an error of a step: 1000 rad/s in .3 s are three times a hundred of them, of r alone."""
    run = integrate(pendulum(1e6), np.linspace(0, 0.3, 31), rtol=1e-8)
    assert run.rates["r"] == pytest.approx(1000, rel=1e-3)
    assert run.growth[-1] < 2.0
    names = ["r", "th", "r_dot", "th_dot"]
    assert run.growths(names, 100.0)[-1] == pytest.approx([3, run.growth[-1], 3, run.growth[-1]], rel=1e-3)
    assert run.growths(names, 2.5)[-1, 0] == 2.5
    assert run.growths(names, 100.0)[0] == pytest.approx(np.ones(4))


def test_errors_of_a_long_swing_grow_with_the_square_of_the_time() -> None:
    """A swing of 1 rad takes longer by 0.12 of its period per rad: errors of energies turn into later swings.

    At times that are farther apart than a swing the radians between them count as well: the pendulum turns by 2.94/s.
    """
    q = coordinate("q", "rad", start=1.0)
    swing = Mechanism(
        "swing", coordinates=[q], bodies=[Body("bob", 1, (sp.sin(q), -sp.cos(q)))], gravity=sp.Float(9.81)
    )
    growth = integrate(swing, np.linspace(0, 200, 81), rtol=1e-6).growth
    assert growth[-1] / growth[40] == pytest.approx(4.0, rel=0.05)
    assert growth[-1] > 2.94 * 200 / 100


@pytest.mark.fmu
def test_a_stiff_spring_without_damping_is_judged() -> None:
    """At 1e7 N/m the right FMU failed at every tolerance, by twice the bar of a velocity of 2 mm/s."""
    report = lag2fmu.validate(pendulum(1e7), stop_time=0.5)
    assert report.passed
