"""What the FMUs compute in co-simulation: errors, orders, periods; against direct integration and mathematics."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from chosen import QUICK, SENSITIVE, models
from numpy.typing import NDArray
from scipy.special import ellipk
from stepping import Stepping, bits

import lag2fmu
from lag2fmu.codegen import METHODS
from lag2fmu.description.names import velocity
from lag2fmu.fmu import Fmu
from lag2fmu.formats.loading import bundled, load
from lag2fmu.language.expressions import TIME
from lag2fmu.mechanism import Energy, Mechanism, coordinate, parameter
from lag2fmu.reference import Reference

pytestmark = pytest.mark.fmu

STEPS = (1, 10, 100)
"""Communication steps in thousandths of the duration, which are 0.01 to 1 s where a model lasts 10 s."""
BARS = {1e-6: 1e-4, 1e-10: 1e-8}
"""Tolerance -> largest error that is allowed over the duration."""
ADAPTIVE = [name for name, method in METHODS.items() if method.error_order > 0]
STEPPING_OVER = [name for name in ADAPTIVE if METHODS[name].dense_order > 0]
SMOOTH = ["double_pendulum", "elastic_pendulum", "kepler", "six_axis_arm"]
"""Mechanisms that show how every method converges."""


def states_of(fmu: Fmu) -> list[str]:
    names = [c.name for c in fmu.mechanism.coordinates]
    return [*names, *map(velocity, names)]


def run(fmu: Fmu, step: float, tolerance: float, stop: float = 10.0, **values: float) -> NDArray[np.float64]:
    """The states at the communication points up to ``stop`` (s), (points, 2n)."""
    names = states_of(fmu)
    found = lag2fmu.simulate(fmu, stop_time=stop, step=step, tolerance=tolerance, outputs=names, values=values)
    return found.columns(names)


def error(fmu: Fmu, reference: Reference, points: int, tolerance: float, **values: float) -> float:
    """The largest error at each ``points``-th point of ``reference``, relative to max(range, nominal) of each state."""
    names = states_of(fmu)
    scales = np.array([reference.scales[name] for name in names])
    times, expected = reference.trajectory.time, reference.trajectory.columns(names)[::points]
    found = run(fmu, float(times[points]), tolerance, float(times[-1]), **values)
    return float((np.abs(found - expected) / scales).max())


@pytest.mark.parametrize("model", models(QUICK - SENSITIVE, {*bundled()} - SENSITIVE))
def test_error_against_direct_integration(model: str, exported, directly) -> None:
    """Below its bar for three communication steps, and proportional to the tolerance from 1e-3 to 1e-10."""
    if load(model).hybrid:
        pytest.skip("velocities jump at impacts, whose times differ by the error; tests/gallery has closed forms")
    fmu, reference = exported(model), directly(model)
    assert reference.amplification.max() < 50, "this model belongs into SENSITIVE"
    for tolerance, bar in BARS.items():
        errors = {points: error(fmu, reference, points, tolerance) for points in STEPS}
        assert max(errors.values()) < bar, (tolerance, errors)
    tolerances = 10.0 ** np.arange(-3, -10.5, -0.5)
    lifted = reference.trajectory.time[-1]  # the longest step, which else keeps the errors small
    errors = np.array([error(fmu, reference, 100, tolerance, solver_max_step=lifted) for tolerance in tolerances])
    if errors.max() < 1e-6:
        pytest.skip(f"nearly polynomial: the error is {errors.max():.1g} at a tolerance of 1e-3 already")
    # an error that is not small is not proportional, and one that stays is not decided by the tolerance
    decided = np.append(errors[:-1] > 1.05 * errors[1:], True) & (errors < 1e-2) & (errors > 1e-13)
    if decided.sum() < 5:
        pytest.skip(f"the tolerance decides the steps in {decided.sum()} of {len(errors)} runs only")
    slope = np.polyfit(np.log(tolerances[decided]), np.log(errors[decided]), 1)[0]
    assert 0.8 <= slope <= 1.2, dict(zip(tolerances, errors, strict=True))


@pytest.mark.parametrize(("solver", "step"), [*((s, 1.0) for s in ADAPTIVE), *((s, 0.005) for s in STEPPING_OVER)])
def test_error_is_proportional_to_the_tolerance(solver: str, step: float, exported) -> None:
    """From 1e-3 to 1e-11, at all communication points; short steps are stepped over and interpolated."""
    tolerances, slopes = 10.0 ** np.arange(-3, -11.5, -1.0), []
    for model in SMOOTH:
        exact = run(exported(model, solver="dop853"), step, 1e-13, 5.0)
        scales = np.maximum(np.ptp(exact, axis=0), 1e-3)
        fmu = exported(model, solver=solver)
        found = [run(fmu, step, tolerance, 5.0, solver_max_step=5.0) for tolerance in tolerances]
        errors = [(np.abs(states - exact) / scales).max() for states in found]
        assert max(errors / tolerances) < 1000
        slopes.append(np.polyfit(np.log(tolerances), np.log(errors), 1)[0])
    assert 0.8 <= np.mean(slopes) <= 1.2, slopes
    assert all(0.75 <= slope <= 1.25 for slope in slopes), slopes


LENGTHS = {"ros2": 0.01, "rk4": 0.02, "dopri5": 0.04, "dop853": 0.25}
"""The longest solver step, s, at which the order of a method is measured, where a model lasts 10 s."""
KINDS = ["chaplygin_sleigh", "four_bar_linkage", "motion_driven_pendulum", "slides_problem_1", "slides_problem_5_small"]
CASES = [*((m, "rk4") for m in KINDS), *((m, s) for m in SMOOTH for s in LENGTHS)]


@pytest.mark.parametrize(("model", "solver"), CASES)
def test_order(model: str, solver: str, exported, directly) -> None:
    """Over the first tenth: later, errors of different states cancel and the order shows at tiny steps only."""
    fmu, reference = exported(model, solver=solver), directly(model, 0.1)
    steps = LENGTHS[solver] * reference.trajectory.time[-1] / np.array([1, 2, 4, 8])
    errors = np.array([error(fmu, reference, 500, 0.99, solver_step=h, solver_max_step=h) for h in steps])
    resolved = errors > 2e-12  # by the direct integration
    slope = np.polyfit(np.log(steps[resolved]), np.log(errors[resolved]), 1)[0]
    order = METHODS[solver].order
    # the longest steps of the adaptive ones are not where the highest term of the error is the largest yet
    below, above = (0.45, 1.2) if solver in ADAPTIVE else (0.2, 0.2)
    assert order - below <= slope <= order + above, dict(zip(steps, errors, strict=True))


@pytest.mark.parametrize("tolerance", BARS)
@pytest.mark.parametrize("model", ["cart_pole", "double_pendulum", "elastic_pendulum", "vertically_driven_pendulum"])
def test_result_does_not_depend_on_the_communication_step(model: str, tolerance: float, exported, directly) -> None:
    scales = np.array([directly(model).scales[name] for name in states_of(exported(model))])
    ends = [run(exported(model), step, tolerance)[-1] for step in (1e-3, 2e-3, 1e-2, 0.0625, 0.1, 0.5, 1.0)]
    spread = np.ptp(ends, axis=0) / scales
    assert spread.max() < 100 * tolerance
    assert spread.max() > 0, "the solver steps of short and long communication steps are not the same ones"


# ------------------------------------------------------------------------------------------------------------ periods


def falling_zero_crossings(fmu: Fmu, angle: str, start: float, count: int) -> list[float]:
    """Times (s) where ``angle`` falls through 0, by Newton's method on the length of the last communication step.

    The FMU goes back to its saved state before each try, so that the times are exact up to the error of the motion.
    """
    times: list[float] = []
    with Stepping(fmu.path) as host:
        host.start({angle: start}, tolerance=1e-10)
        above = start
        while len(times) < count:
            before, time = host.unit.getFMUstate(), host.time
            below = host.step(0.05)[0]
            if above > 0 >= below:
                length = 0.05
                for _ in range(6):
                    theta, theta_dot = host.get([angle, velocity(angle)])
                    length -= theta / theta_dot
                    host.unit.setFMUstate(before)
                    host.time = time
                    host.step(length)
                assert abs(host.get([angle])[0]) < 4e-14, "6 rad/s times the rounding of a time of 10 s"
                times.append(host.time)
                below = host.step(0.05)[0]
            above = below
            host.unit.freeFMUstate(before)
    return times


@pytest.mark.parametrize("start", [0.1, 0.5, 2.0, 3.0])
@pytest.mark.parametrize(("model", "angle"), [("pendulum", "theta"), ("n_pendulum", "theta1")])
def test_elliptic_period(model: str, angle: str, start: float, exported) -> None:
    """T = 4 sqrt(l/g) K(sin^2(start/2)); Landau, Lifshitz, Mechanics, section 11, problem 1."""
    fmu = exported(model, n="1") if model == "n_pendulum" else exported(model)
    period = 4 * np.sqrt(1.0 / 9.81) * ellipk(np.sin(start / 2) ** 2)
    times = falling_zero_crossings(fmu, angle, start, 4)
    assert times[0] == pytest.approx(period / 4, rel=1e-8)
    assert np.diff(times) == pytest.approx(period, rel=1e-8)


@pytest.mark.parametrize(("model", "angle"), [("pendulum", "theta"), ("n_pendulum", "theta1")])
def test_the_pendulum_is_back_after_analytic_quarters(model: str, angle: str, exported) -> None:
    fmu = exported(model, n="1") if model == "n_pendulum" else exported(model)
    quarter = np.sqrt(1.0 / 9.81) * ellipk(np.sin(0.25) ** 2)
    fastest = 2 * np.sqrt(9.81) * np.sin(0.25)
    expected = [(0.0, -fastest), (-0.5, 0.0), (0.0, fastest), (0.5, 0.0)]
    with Stepping(fmu.path) as host:
        host.start({angle: 0.5}, tolerance=1e-10)
        for number in range(12):
            assert host.step(quarter) == pytest.approx(expected[number % 4], abs=1e-8)


# --------------------------------------------------------------------------------------------------- solver settings


def test_a_fixed_step_that_does_not_divide_the_communication_step_is_shortened(exported) -> None:
    fmu = exported("double_pendulum", solver="rk4")
    uneven = run(fmu, 0.1, 1e-6, solver_step=0.03)
    assert bits(uneven[-1]) == bits(run(fmu, 0.1, 1e-6, solver_step=0.025)[-1]), (
        "4 equal steps, none longer than 0.03 s"
    )
    assert bits(uneven[-1]) != bits(run(fmu, 0.1, 1e-6, solver_step=0.1 / 3)[-1])


def test_a_fixed_step_longer_than_the_communication_step_is_the_communication_step(exported, directly) -> None:
    fmu = exported("pendulum", solver="rk4")
    assert bits(run(fmu, 0.01, 1e-6, solver_step=5.0)[-1]) == bits(run(fmu, 0.01, 1e-6, solver_step=0.01)[-1])
    assert error(fmu, directly("pendulum"), 1, 1e-6, solver_step=5.0) < 1e-6


def test_a_communication_step_of_ten_solver_steps_takes_ten(exported) -> None:
    fmu = exported("pendulum", solver="rk4")
    with Stepping(fmu.path) as long, Stepping(fmu.path) as short:
        long.start({"solver_step": 0.01})
        short.start({"solver_step": 0.01})
        assert long.step(0.1) == pytest.approx(short.steps(10, 0.01)[-1], rel=1e-14)


def test_solver_tolerance_wins_over_the_importer(exported) -> None:
    fmu = exported("double_pendulum")
    with (
        Stepping(fmu.path) as own,
        Stepping(fmu.path) as asked,
        Stepping(fmu.path) as loose,
        Stepping(fmu.path) as default,
    ):
        own.start({"solver_tolerance": 1e-9}, tolerance=1e-3)
        asked.start(tolerance=1e-9)
        loose.start(tolerance=1e-3)
        default.start()
        assert bits(own.step(5.0)) == bits(asked.step(5.0)) != bits(loose.step(5.0))
        with Stepping(fmu.path) as explicit:
            assert bits(explicit.start(tolerance=1e-6).step(5.0)) == bits(default.step(5.0))


def test_a_longest_step_makes_a_loose_run_exact(exported, directly) -> None:
    fmu, reference = exported("double_pendulum"), directly("double_pendulum")
    assert error(fmu, reference, 100, 1e-2) > 1e-4
    assert error(fmu, reference, 100, 1e-2, solver_max_step=0.005) < 1e-9


def test_a_linearly_implicit_method_takes_stiff_springs_in_its_stride(exported) -> None:
    """k = 1e8, c = 1e5: the overdamped mass creeps with the rate k/c while rk4 at the same step explodes."""
    values = {"k": 1e8, "c": 1e5, "solver_step": 1e-3}
    with Stepping(exported("spring_mass_damper", solver="ros2").path) as host:
        x = host.start(values).steps(50, 1e-3)
    assert np.abs(x[-1]).max() < 1e-6
    with Stepping(exported("spring_mass_damper", solver="rk4").path) as host:
        host.start(values)
        assert np.abs(host.step(2e-3)).max() > 1.0


# ---------------------------------------------------------------------------------------------------- motion inputs


def driven(fmu: Fmu, step: float, sampled_at: float) -> NDArray[np.float64]:
    """theta, theta_dot at 2 s with y0 = A cos(Omega t) held in each step as it is at ``sampled_at`` of the step."""
    amplitude, omega = 0.05, 10.0
    with Stepping(fmu.path) as host:
        host.start(tolerance=1e-11)
        for number in range(round(2.0 / step)):
            t = (number + sampled_at) * step
            host.set(
                {
                    "y0": amplitude * np.cos(omega * t),
                    "y0_dot": -amplitude * omega * np.sin(omega * t),
                    "y0_ddot": -amplitude * omega**2 * np.cos(omega * t),
                }
            )
            found = host.step(step)
    return np.array(found)


@pytest.mark.parametrize(("sampled_at", "order"), [(0.0, 1), (0.5, 2)])
def test_a_driven_motion_converges_to_the_explicit_one(sampled_at: float, order: int, exported) -> None:
    """Held inputs are of order 1 in H where they are sampled at the start of the step, of order 2 at its middle."""
    with Stepping(exported("vertically_driven_pendulum").path) as host:
        explicit = np.array(host.start(tolerance=1e-11).step(2.0))
    steps = np.array([0.02, 0.01, 0.005, 0.0025])
    errors = [np.abs(driven(exported("motion_driven_pendulum"), step, sampled_at) - explicit).max() for step in steps]
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(order, abs=0.1), errors
    assert errors[-1] < {1: 3e-3, 2: 1e-5}[order]


def test_a_resting_support_is_the_plain_pendulum(exported) -> None:
    with Stepping(exported("motion_driven_pendulum").path) as moved, Stepping(exported("pendulum").path) as plain:
        moved.start({"y0": 7.0}, tolerance=1e-10)
        plain.start(tolerance=1e-10)
        assert moved.step(10.0) == pytest.approx(plain.step(10.0), abs=1e-9)
        assert load("motion_driven_pendulum").coordinates == load("pendulum").coordinates


@pytest.fixture(scope="module")
def passing() -> Mechanism:
    """A mass that forces of 0.1 s and 0.05 s (a Gaussian) act on about the time t0, and a hill 0.05 m wide at 5 m."""
    x, t0 = coordinate("x", "m", start=0.0), parameter("t0", 5.0, "s")
    kick, bump, hill = (parameter(name, 0.0) for name in ("kick", "bump", "hill"))
    since = TIME - t0
    return Mechanism(
        "passing",
        coordinates=[x],
        parameters=[t0, kick, bump, hill],
        energy=Energy(kinetic=x.dot**2 / 2, potential=hill * sp.exp(-((x - 5) ** 2) / 0.05**2)),
        forces={x: kick * (sp.Heaviside(since) - sp.Heaviside(since - 0.1)) + bump * sp.exp(-(since**2) / 0.05**2)},
    )


@pytest.mark.parametrize("step", [0.01, 0.1, 10.0])
def test_what_is_short_is_not_stepped_over(step: float, passing: Mechanism, exported) -> None:
    """The velocities are integrals of the forces, whenever they act; from the hill a mass at 1 m/s turns back."""
    cases = {"kick": 0.1, "bump": 0.05 * np.sqrt(np.pi)}
    for t0 in 3.0 + 0.137 * np.arange(20):
        for name, expected in cases.items():
            with Stepping(exported(passing).path) as s:
                s.start({name: 1.0, "t0": t0}).steps(round(10.0 / step), step)
                assert s.get(["x_dot"]) == pytest.approx([expected], abs=5e-4), (name, t0)
    with Stepping(exported(passing).path) as s:
        s.start({"hill": 10.0, "x_dot": 1.0}).steps(round(10.0 / step), step)
        assert s.get(["x_dot"]) == pytest.approx([-1.0], abs=1e-4)


def test_the_longest_step_can_be_lifted(exported) -> None:
    """By solver_max_step, and by an importer whose experiment lasts longer: what is short is then stepped over."""
    x = coordinate("x", "m")
    bump = sp.exp(-(((TIME - 5) / 0.05) ** 2))
    bumped = Mechanism("bumped", coordinates=[x], energy=Energy(kinetic=x.dot**2 / 2), forces={x: bump})
    for values, stop in (({"solver_max_step": 10.0}, None), ({}, 500.0)):
        with Stepping(exported(bumped).path) as s:
            s.start(values, stop_time=stop).steps(1, 10.0)
            assert s.get(["x_dot"]) == pytest.approx([0.0], abs=1e-6)
