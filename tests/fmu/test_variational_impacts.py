"""Variational methods over impacts, dry friction and latches: a step ends at the event, the next one begins behind it.

Expected: the closed forms of the models, the orders of the methods, energies that do not drift.
"""

from collections.abc import Callable
from math import cos, pi

import numpy as np
import pytest

from lag2fmu import simulate
from lag2fmu.fmu import Fmu
from lag2fmu.formats.loading import load, with_values
from lag2fmu.formats.text import read
from lag2fmu.reference import integrate

pytestmark = pytest.mark.fmu

Exported = Callable[..., Fmu]


@pytest.mark.parametrize(("solver", "order", "impacts"), [("verlet", 2, 150), ("lobatto4", 4, 30), ("gauss4", 4, 30)])
def test_the_energy_stays_where_it_is_over_impacts(solver: str, order: int, impacts: int, exported: Exported) -> None:
    """It oscillates by an error of the method's order, no more at the end than at the beginning."""
    stopped = with_values(load("pendulum_with_stop"), {"e": 1.0})
    names = ("total_energy", "hinge_lower_impacts", "hinge_lower_gap")
    ranges = []
    for step in (1e-2, 5e-3):
        fmu = exported(stopped, solver=solver)
        run = simulate(fmu, stop_time=4.0 / 3.0 * impacts, step=0.5, values={"solver_step": step}, outputs=names)
        energy, half = run["total_energy"], len(run.time) // 2
        assert run["hinge_lower_impacts"][-1] == impacts
        assert run["hinge_lower_gap"].min() >= 0.0
        assert np.ptp(energy[half:]) <= 1.05 * np.ptp(energy[:half])
        ranges.append(np.ptp(energy))
    assert np.log2(ranges[0] / ranges[1]) == pytest.approx(order, abs=0.1)


def test_a_ball_comes_to_rest(exported: Exported) -> None:
    """Its arcs are parabolas, which the method has exactly; at rest the contact is a constraint of the action."""
    names = ("y", "floor_mode", "floor_force", "total_energy", "dissipated_energy")
    run = simulate(exported("bouncing_ball", solver="verlet"), stop_time=5.0, step=1e-3, outputs=names)
    assert run.time[run["floor_mode"] != 1][0] == pytest.approx(4.0637, abs=1e-3)
    assert (run["y"][-1], run["floor_force"][-1]) == (0.0, pytest.approx(0.5 * 9.81, rel=1e-12))
    assert np.ptp(run["total_energy"] + run["dissipated_energy"]) < 1e-12


def swing(t: float) -> float:
    """The oscillator with the force 0.3 N against the motion, from 5 m: cosines about +-0.3 m in turn, 8 of them."""
    half = min(int(t / pi), 7)
    amplitude = 5.0 - 0.3 - 0.6 * half
    return (-1.0) ** half * (0.3 + amplitude * cos(min(t, 8 * pi) - half * pi))


def test_dry_friction_turns_and_holds(exported: Exported) -> None:
    """It rests at 0.2 m from 8 pi on, and the energy it takes closes the balance as well as the method can."""
    names, errors = ("x", "x_dot", "floor_mode", "total_energy", "dissipated_energy"), []
    for step in (0.1, 0.05):
        fmu = exported("coulomb_oscillator", solver="gauss4")
        run = simulate(fmu, stop_time=30.0, step=0.5, values={"solver_step": step}, outputs=names)
        moving = run.time < 25.0
        errors.append(max(abs(x - swing(t)) for t, x in zip(run.time[moving], run["x"][moving], strict=True)))
        assert (run["x_dot"][-1], run["floor_mode"][-1]) == (0.0, 2)
        assert run["x"][-1] == pytest.approx(0.2, abs=1e-4)
        assert np.ptp(run["total_energy"] + run["dissipated_energy"]) < 20.0 * errors[-1]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.15)


def test_a_block_sticks_to_a_belt(exported: Exported) -> None:
    """The period of stick and slip, in closed form; verlet's own frequency is off by h^2 w^3/24."""
    fmu = exported("block_on_belt", solver="verlet")
    run = simulate(fmu, stop_time=50.0, step=1e-3, values={"solver_step": 1e-2}, outputs=("belt_mode",))
    slips = run.time[1:][(run["belt_mode"][1:] != 2) & (run["belt_mode"][:-1] == 2)]
    assert np.diff(slips) == pytest.approx(8.902605407814523, abs=1e-3)


def test_a_sphere_slides_and_rolls(exported: Exported) -> None:
    """Friction along the slip in space, with the load of the contact; then rolling, a nonholonomic constraint."""
    names = ("x", "x_dot", "table_mode")
    run = simulate(exported("sliding_sphere", solver="gauss4"), stop_time=1.5, step=1e-3, outputs=names)
    rolls = 2 * 5.0 / (7 * 0.2 * 9.81)
    assert run.time[run["table_mode"] == 2][0] == pytest.approx(rolls, abs=1e-3)
    assert run["x_dot"][-1] == pytest.approx(25.0 / 7.0, rel=1e-6)
    slid = 5.0 * rolls - 0.2 * 9.81 * rolls**2 / 2
    assert run["x"][-1] == pytest.approx(slid + 25.0 / 7.0 * (1.5 - rolls), rel=1e-6)


EGG = """
[mechanism]
name = "egg"
[coordinates]
x = { unit = "m" }
y = { unit = "m" }
z = { unit = "m", start = 0.2 }
e0 = { guess = 1 }
e1 = {}
e2 = {}
e3 = {}
[gravity]
acceleration = 9.81
direction = [0, 0, -1]
[frames.shell]
origin = ["x", "y", "z"]
quaternion = ["e0", "e1", "e2", "e3"]
[bodies.egg]
frame = "shell"
mass = 1
inertia = [0.004, 0.005, 0.003, 0, 0, 0]
[contacts.table]
kind = "ellipsoid_plane"
between = ["shell", "world"]
normal = [0, 0, 1]
radius = [0.1, 0.08, 0.12]
friction = 0.3
restitution = 0.4
"""


@pytest.mark.parametrize("solver", ["gauss4", "verlet"])
def test_an_egg_slides_until_its_slip_is_at_rest(exported: Exported, solver: str) -> None:
    """As with dopri5. Friction would turn round in the step in which the slip ends, which has no solution: five of
    these six starts ended with an error there."""
    mechanism, seen = read(EGG, "egg.toml"), ("x", "y", "table_mode")
    fmus = [exported(mechanism, solver=name) for name in ("dopri5", solver)]
    for seed in range(6):
        random = np.random.default_rng(seed)
        attitude = random.normal(size=4)
        start = {f"e{i}": float(e) for i, e in enumerate(attitude / np.linalg.norm(attitude))}
        start |= {"x_dot": random.normal(), "y_dot": random.normal()}
        truth, run = (simulate(fmu, stop_time=1.0, step=0.005, values=start, outputs=seen) for fmu in fmus)
        assert [run[name][-1] for name in seen] == pytest.approx([truth[name][-1] for name in seen], abs=1e-5)


def test_a_latch_catches_and_lets_go(exported: Exported) -> None:
    """As the direct integration has it."""
    gripper = load("gripper")
    run = simulate(exported("gripper", solver="lobatto4"), step=0.1)
    truth = integrate(gripper, run.time).trajectory
    for coordinate in gripper.coordinates:
        assert run[coordinate.name] == pytest.approx(truth[coordinate.name], abs=1e-9)
