"""libcosim (Open Simulation Platform) as an importer of co-simulation: alone, and two FMUs coupled."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("libcosimpy", reason="libcosim is not installed: pip install -e '.[importers]'")

from libcosim import SECOND, STEP, Simulation
from stepping import Stepping, bits

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
