"""Machines with contacts and dry friction from the literature, written as text."""

from collections.abc import Callable

import numpy as np
import pytest

from lag2fmu import simulate
from lag2fmu.fmu import Fmu
from lag2fmu.formats.text import read

pytestmark = pytest.mark.fmu

CRANK = """
[mechanism]
name = "crank"
[coordinates]
a = { unit = "rad", start = 0.3, velocity = 30 }
[parameters]
r = { value = 0.1, unit = "m" }
l = { value = 0.3, unit = "m" }
[definitions]
x = "r*cos(a) + sqrt(l**2 - r**2*sin(a)**2)"
slope = "-r*sin(a) - r**2*sin(a)*cos(a)/sqrt(l**2 - r**2*sin(a)**2)"
[bodies.wheel]
mass = 1
inertia = 0.005
position = [0, 0]
angle = "a"
[bodies.slider]
mass = 0.5
position = ["x", 0]
[frictions.guide]
on = "slope*a_dot"
force = 2
"""


def _corner(name: str, along: int, across: int) -> str:
    """The contact of a corner of the slider with its side of the guide; (1, 1) is in front, above."""
    height = f"(l1*sin(t1) + l2*sin(t2) + ({along}*a)*sin(t3) + ({across}*b)*cos(t3))"
    turns = f"(({along}*a)*sin(t3) + ({across}*b)*cos(t3))*t3_dot"
    return f"""
[contacts.{name}]
gap = "b + c - {across}*{height}"
slip = "-l1*sin(t1)*t1_dot - l2*sin(t2)*t2_dot - {turns}"
restitution = 0.4
friction = 0.01
"""


CLEARANCE = """
[mechanism]
name = "clearance"
[parameters]
l1 = { value = 0.153, unit = "m" }
l2 = { value = 0.306, unit = "m" }
a = { value = 0.05, unit = "m" }
b = { value = 0.025, unit = "m" }
c = { value = 0.001, unit = "m" }
[coordinates]
t1 = { unit = "rad", velocity = 150 }
t2 = { unit = "rad", velocity = -75 }
t3 = { unit = "rad" }
[gravity]
acceleration = 9.81
[bodies]
crank = { mass = 0.038, inertia = 7.4e-5, position = ["l1/2*cos(t1)", "l1/2*sin(t1)"], angle = "t1" }
[bodies.rod]
mass = 0.038
inertia = 5.9e-4
position = ["l1*cos(t1) + l2/2*cos(t2)", "l1*sin(t1) + l2/2*sin(t2)"]
angle = "t2"
[bodies.slider]
mass = 0.076
inertia = 2.7e-6
position = ["l1*cos(t1) + l2*cos(t2)", "l1*sin(t1) + l2*sin(t2)"]
angle = "t3"
""" + "".join(_corner(f"p{k}", *at) for k, at in enumerate([(-1, 1), (1, 1), (-1, -1), (1, -1)], 1))


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_a_crank_passes_its_dead_centres_against_friction_in_the_guide(kind: str, exported: Callable[..., Fmu]) -> None:
    """The slip is 0 there whatever the speed of the crank. The guide takes the force times the way of the slider."""
    names = ("a", "a_dot", "dissipated_energy", "guide_mode")
    run = simulate(
        exported(read(CRANK, "crank.toml")), stop_time=1.0, step=1e-3, tolerance=1e-8, kind=kind, outputs=names
    )
    a, root = run["a"], np.sqrt(0.09 - 0.01 * np.sin(run["a"]) ** 2)
    x, slope = 0.1 * np.cos(a) + root, -0.1 * np.sin(a) - 0.01 * np.sin(a) * np.cos(a) / root
    turns, half = np.floor_divide(a, np.pi), (a % np.pi > 0) & (np.floor_divide(a, np.pi) % 2 == 1)
    way = 0.2 * turns + np.where(half, x - 0.2, 0.4 - x) - (0.4 - x[0])
    energy = 0.5 * (0.005 + 0.5 * slope**2) * run["a_dot"] ** 2
    assert a[-1] > 5 * np.pi
    assert set(run["guide_mode"]) == {4, 5}
    assert energy + 2 * way == pytest.approx(np.full(len(run), energy[0]), abs=1e-5)
    assert run["dissipated_energy"] == pytest.approx(2 * way, abs=1e-5)


@pytest.mark.parametrize(("kind", "tolerance", "deep"), [("co-simulation", 1e-6, 1e-8), ("model-exchange", 1e-8, 1e-6)])
def test_a_slider_with_clearance_strikes_slides_and_leaves_its_guide(
    kind: str, tolerance: float, deep: float, exported: Callable[..., Fmu]
) -> None:
    """All corners of a side leave it at once, and none of them pulls, also while their last impacts accumulate.

    P. Flores, R. Leine, Ch. Glocker, Modeling and analysis of planar rigid multibody systems with translational
    clearance joints based on the non-smooth dynamics approach, Multibody System Dynamics 23, 2010: their mechanism.
    """
    names = [f"p{k}_{what}" for k in range(1, 5) for what in ("gap", "force", "friction", "impacts")]
    machine = exported(read(CLEARANCE, "clearance.toml"))
    run = simulate(machine, stop_time=0.13, step=1e-4, tolerance=tolerance, kind=kind, outputs=("t1", *names))
    assert run["t1"][-1] > 3 * np.pi
    for k in range(1, 5):
        gap, force = run[f"p{k}_gap"], run[f"p{k}_force"]
        assert gap.min() > -deep
        assert force.min() >= 0 < force.max()
        assert np.abs(force * gap).max() < 10 * deep
        assert (np.abs(run[f"p{k}_friction"]) <= 0.01 * force * (1 + 1e-9)).all()
        assert run[f"p{k}_impacts"][-1] >= 10
