"""libcosim (Open Simulation Platform) as an importer of co-simulation: alone, and two FMUs coupled."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("libcosimpy", reason="libcosim is not installed: pip install -e '.[importers]'")

from libcosim import SECOND, STEP, Simulation
from stepping import Stepping, bits
from train import CAR, WAGON_ALONE, K, M, W, X, Y

from lag2fmu import export
from lag2fmu.analysis.observing import Observing
from lag2fmu.formats.loading import load
from lag2fmu.reference import held, integrate
from lag2fmu.reference.trajectory import Trajectory

pytestmark = [pytest.mark.toolchain, pytest.mark.fmu]


@pytest.mark.parametrize("model", ["cart_pole", "double_pendulum", "slides_problem_6", "vertically_driven_pendulum"])
def test_the_same_bits_as_with_fmpy(model: str, exported) -> None:
    """libcosim gives no tolerance, so that the default of the FMU holds; it adds up times in nanoseconds."""
    path = exported(model).path
    simulation = Simulation(one=path)
    with Stepping(path) as host:
        host.start()
        simulation.run(1.0)
        for number in range(100):
            host.time = number * round(STEP * SECOND) / SECOND
            expected = host.step(STEP)
        assert simulation.get("one", host.states) == pytest.approx(expected, rel=1e-12, abs=1e-13)


@pytest.mark.parametrize("model", ["cart_pole", "double_pendulum", "elastic_pendulum"])
def test_error_against_the_direct_integration(model: str, exported) -> None:
    simulation = Simulation(one=exported(model).path)
    simulation.run(5.0)
    expected = integrate(load(model), [0.0, 5.0]).trajectory
    names = [name for q in load(model).coordinates for name in (q.name, f"{q.name}_dot")]
    # the default tolerance is 1e-6; steps reach over communication points, so that they are as long as it allows
    assert simulation.get("one", names) == pytest.approx(expected.columns(names)[-1], abs=3e-5)


def test_start_values_and_inputs(exported) -> None:
    simulation = Simulation(cart=exported("cart_pole").path)
    simulation.initially("cart", "theta", 0.9)
    simulation.initially("cart", "l", 0.7)
    simulation.set("cart", "F", 2.0)
    simulation.run(1.0)
    names = ["x", "theta", "x_dot", "theta_dot"]
    push = Trajectory.of([0.0, 1.0], {"F": [2.0, 2.0]})
    run = integrate(load("cart_pole"), [0.0, 1.0], starts={"theta": 0.9}, parameters={"l": 0.7}, inputs=held(push))
    assert simulation.get("cart", names) == pytest.approx(run.trajectory.columns(names)[-1], abs=1e-5)


MOTION = {"x": "y0", "x_dot": "y0_dot", "x_ddot": "y0_ddot"}


def test_two_fmus_coupled_by_a_motion(exported) -> None:
    """A block on a spring carries the support of a pendulum: the same bits as an own master, step by step."""
    block, pendulum = exported("spring_mass_damper", outputs=("x_ddot",)).path, exported("motion_driven_pendulum").path
    simulation = Simulation(block=block, pendulum=pendulum)
    for output, motion in MOTION.items():
        simulation.connect(("block", output), ("pendulum", motion))
    with Stepping(block) as carrier, Stepping(pendulum) as carried:
        carrier.start()
        carried.start(dict(zip(MOTION.values(), carrier.get(list(MOTION)), strict=True)))
        for number in range(100):
            carrier.time = carried.time = number * round(STEP * SECOND) / SECOND
            carrier.step(STEP)
            carried.step(STEP)
            carried.set(dict(zip(MOTION.values(), carrier.get(list(MOTION)), strict=True)))
        simulation.run(1.0)
        assert simulation.get("block", carrier.states) == pytest.approx(carrier.get(carrier.states), rel=1e-12)
        assert simulation.get("pendulum", carried.states) == pytest.approx(carried.get(carried.states), rel=1e-10)
        with Stepping(pendulum) as resting:
            resting.start()
            assert resting.steps(100, STEP)[-1] != pytest.approx(carried.get(carried.states), rel=1e-2), (
                "the motion acts"
            )


def test_two_instances_of_one_fmu(exported) -> None:
    path = exported("double_pendulum").path
    simulation = Simulation(left=path, right=path)
    simulation.initially("right", "theta1", 1.0)
    simulation.run(1.0)
    names = ["theta1", "theta2", "theta1_dot", "theta2_dot"]
    alone = Simulation(left=path)
    alone.run(1.0)
    assert bits(simulation.get("left", names)) == bits(alone.get("left", names))
    assert np.abs(np.subtract(simulation.get("right", names), simulation.get("left", names))).max() > 0.1


def held_motion(late: bool) -> float:
    """The largest error (m) of the wagon in 1 s by held inputs; ``late``: forces belong to the inputs of the last step.

    Between communication points the cart swings about the held place, and the held force accelerates the wagon.
    """
    w, reduced = np.sqrt(K / M), np.sqrt(K * (M + W) / (M * W))
    x, x_dot, y, y_dot, held_y, force, worst = X, 0.0, Y, 0.0, Y, K * (X - Y), 0.0
    for k in range(1, 101):
        away = x - held_y
        x, x_dot = (
            held_y + away * np.cos(w * STEP) + x_dot / w * np.sin(w * STEP),
            x_dot * np.cos(w * STEP) - away * w * np.sin(w * STEP),
        )
        y, y_dot = y + y_dot * STEP + force / W * STEP**2 / 2, y_dot + force / W * STEP
        force = K * (x - (held_y if late else y))
        held_y = y
        centre = (M * X + W * Y) / (M + W)
        worst = max(worst, abs(y - centre + M / (M + W) * (X - Y) * np.cos(reduced * k * STEP)))
    return worst


def test_forces_that_follow_an_input_come_a_step_late(exported) -> None:
    """The wagon's error is that of forces of the step before: twice that of an importer that sets inputs first."""
    path = exported(CAR).path
    simulation = Simulation(cart=path, wagon=path)
    for name, value in WAGON_ALONE.items():
        simulation.initially("wagon", name, value)
    simulation.connect(("wagon", "x"), ("cart", "y"))
    simulation.connect(("cart", "f"), ("wagon", "F"))
    reduced, centre, worst = np.sqrt(K * (M + W) / (M * W)), (M * X + W * Y) / (M + W), 0.0
    for k in range(1, 101):
        simulation.run(k * STEP)
        exact = centre - M / (M + W) * (X - Y) * np.cos(reduced * k * STEP)
        worst = max(worst, abs(simulation.get("wagon", ["x"])[0] - exact))
    assert worst == pytest.approx(held_motion(late=True), rel=1e-4)
    assert worst / 4 == pytest.approx(2.80e-2, rel=1e-2), "as docs/coupling.md says for a quarter of the distance"
    assert held_motion(late=False) / 4 == pytest.approx(1.43e-2, rel=1e-2)


def test_an_observer_sees_the_plant(exported, tmp_path) -> None:
    """The same bits as an own master, but for the rounding of times; and it comes to the truth from beside it."""
    asked = Observing("ekf", {"x": 0.005, "theta": 0.02}, {"F": 0.1, "x": 0.01})
    plant, eye = exported("cart_pole").path, export("cart_pole", tmp_path / "eye.fmu", observer=asked).path
    simulation = Simulation(plant=plant, eye=eye)
    simulation.initially("eye", "theta_dot", 1.0)
    names = ["x", "theta", "x_dot", "theta_dot", "theta_dot_std", "innovation_squared"]
    for name in ("x", "theta"):
        simulation.connect(("plant", name), ("eye", f"{name}_measured"))
    with Stepping(plant) as seen, Stepping(eye) as seeing:
        seen.start()
        seeing.start({"theta_dot": 1.0})
        for number in range(100):
            seen.time = seeing.time = number * round(STEP * SECOND) / SECOND
            seeing.set({f"{name}_measured": value for name, value in zip(names[:2], seen.get(names[:2]), strict=True)})
            seen.step(STEP)
            seeing.step(STEP)
        simulation.run(1.0)
        assert simulation.get("eye", names) == pytest.approx(seeing.get(names), rel=1e-9, abs=1e-11)
        assert seeing.get(["theta_dot"]) == pytest.approx(seen.get(["theta_dot"]), abs=0.02)
