"""Trajectories against closed forms, drives by time and by inputs, and failures."""

import itertools
import re
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import sympy as sp
from mechanisms import charged_particle, driven_pendulum, falling, loaded, oscillator, pendulum
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.special import ellipj, ellipk

from lag2fmu import deadline
from lag2fmu.deadline import OutOfTimeError, within
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.formats.loading import load
from lag2fmu.language.expressions import TIME
from lag2fmu.mechanism import Body, Constraint, Energy, Mechanism, coordinate, parameter, signal
from lag2fmu.reference import Trajectory, held, initial_value_problem, integrate, interpolated
from models.double_pendulum import double_pendulum

t = TIME
TIMES = np.linspace(0, 5, 101)


@pytest.mark.parametrize("start", [0.1, 1.0, 3.0])
def test_pendulum_meets_the_elliptic_period(start: float) -> None:
    """T = 4 K(sin^2(theta0 / 2)) / w0; Landau, Lifshitz, Mechanics, section 11, problem 1."""
    w0, k2 = np.sqrt(9.81 / 0.7), np.sin(start / 2) ** 2
    period = 4 * ellipk(k2) / w0
    reference = integrate(pendulum(start), [0, period / 4, period * 5 / 4], rtol=1e-12)
    theta, speed = reference.trajectory["theta"], reference.trajectory["theta_dot"]
    late = theta[1:] / speed[1:]  # how much earlier it passed the vertical, in s
    assert abs(late).max() < 1e-9
    assert reference.relative_error.max() < 1e-8


def test_pendulum_meets_the_elliptic_function() -> None:
    w0, k = np.sqrt(9.81 / 0.7), np.sin(0.5)
    reference = integrate(pendulum(1.0), TIMES, rtol=1e-12)
    sn, _, _, _ = ellipj(ellipk(k * k) - w0 * TIMES, k * k)
    assert np.abs(reference.trajectory["theta"] - 2 * np.arcsin(k * sn)).max() < 1e-10
    assert np.abs(reference.balance).max() < 1e-9


@pytest.mark.parametrize("method", ["DOP853", "Radau"])
def test_damped_oscillator(method: str) -> None:
    reference = integrate(oscillator(), TIMES, rtol=1e-9, method=method)
    w0, zeta = 5.0, 0.1
    w = w0 * np.sqrt(1 - zeta**2)
    a, b = 0.3, (-0.2 + zeta * w0 * 0.3) / w
    exact = np.exp(-zeta * w0 * TIMES) * (a * np.cos(w * TIMES) + b * np.sin(w * TIMES))
    difference = np.abs(reference.trajectory["x"] - exact)
    assert difference.max() < 1e-7
    assert difference.max() < 3 * reference.error["x"].max() + 1e-12
    assert np.abs(reference.balance).max() < 1e-6
    assert reference.work[-1] < -1.0
    assert reference.method == method


def test_free_fall_from_an_accelerated_support() -> None:
    """In the frame of a support with acceleration a the weight is g + a: e = e0 + (e(0) - e0) cos(w t)."""
    mechanism = falling(t**2)
    reference = integrate(mechanism, TIMES)
    rest, w = 1.5 * (9.81 + 2) / 20, np.sqrt(20 / 1.5)
    assert np.abs(reference.trajectory["e"] - (rest + (0.1 - rest) * np.cos(w * TIMES))).max() < 1e-9
    energy = reference.trajectory["kinetic_energy"] + reference.trajectory["potential_energy"]
    assert np.ptp(energy) > 1.0  # a driven support does work: T + V is not conserved
    assert np.abs(reference.balance).max() < 1e-8 * np.abs(energy).max()


def test_explicit_time_equals_a_motion_input() -> None:
    expected = integrate(driven_pendulum(False), TIMES).trajectory["theta"]
    drives = [
        {"y0": sp.sin(5 * t) / 10},
        {
            "y0": lambda s: np.sin(5 * s) / 10,
            "y0_dot": lambda s: np.cos(5 * s) / 2,
            "y0_ddot": lambda s: -2.5 * np.sin(5 * s),
        },
        lambda s: {"y0": np.sin(5 * s) / 10, "y0_dot": np.cos(5 * s) / 2, "y0_ddot": -2.5 * np.sin(5 * s)},
    ]
    for drive in drives:
        reference = integrate(driven_pendulum(True), TIMES, inputs=drive)
        assert np.abs(reference.trajectory["theta"] - expected).max() < 1e-9
        assert np.abs(reference.balance).max() < 1e-8


def test_a_measured_motion_is_a_spline_of_values_and_rates() -> None:
    """Between, at and beyond the times measured; by scipy's spline."""
    times = np.linspace(0, 2, 21)
    pieces = interpolated(Trajectory(times, ("y0",), np.sin(3 * times)[:, None]), ["y0"], 2.0)
    spline = CubicSpline(times, np.sin(3 * times))
    for at in (*times[:-1], 0.73, 1.999):
        values = [float(spline(at, order)) for order in range(3)]
        assert pieces.values(at) == pytest.approx(values, rel=1e-12, abs=1e-12)
        assert pieces.derivatives(at)[0].tolist() == pieces.values(at)
    for beyond, end in ((-1.0, 0.0), (5.0, 2.0)):
        assert pieces.values(beyond)[0] == pytest.approx(float(spline(end)), rel=1e-12, abs=1e-12)
        assert not pieces.derivatives(beyond)[1:].any()


def test_a_measured_motion_costs_a_step_between_its_times() -> None:
    """One step of 12 evaluations in the second run, two in the first, and those that interpolate: no new start."""
    times = np.linspace(0, 1, 201)
    pieces = interpolated(Trajectory(times, ("y0",), 0.1 * np.sin(5 * times)[:, None]), ["y0"], 1.0)
    reference = integrate(driven_pendulum(True), times[::10], inputs=pieces.signals, rtol=1e-10)
    exact = integrate(driven_pendulum(False), times[::10])
    assert reference.evaluations < 42 * 200
    assert np.abs(reference.trajectory["theta"] - exact.trajectory["theta"]).max() < 1e-6


def test_a_support_at_rest_may_be_a_number() -> None:
    still = integrate(driven_pendulum(True), TIMES).trajectory["theta"]
    raised = integrate(driven_pendulum(True), TIMES, inputs={"y0": 2.0}).trajectory["theta"]
    assert np.abs(raised - still).max() < 1e-9


def test_charged_particle_runs_in_a_circle() -> None:
    """w = q B / m = 3: x = 1 + (2/3) (1 - cos w t)..., y = (2/3) sin w t; V depends on the velocity."""
    reference = integrate(charged_particle(), TIMES).trajectory
    assert np.abs(reference["x"] - (1 + 2 / 3 * (1 - np.cos(3 * TIMES)))).max() < 1e-9
    assert np.abs(reference["y"] - 2 / 3 * np.sin(3 * TIMES)).max() < 1e-9
    assert np.ptp(reference["kinetic_energy"]) < 1e-9
    assert reference["generalized_energy"] == pytest.approx(1.0, abs=1e-9)


def test_double_pendulum_and_its_amplification() -> None:
    calm = integrate(double_pendulum(), np.linspace(0, 10, 101))
    assert 1 <= calm.amplification[-1] < 50
    assert calm.relative_error.max() < 1e-8
    assert (np.diff(calm.amplification) >= 0).all()
    assert calm.amplification[0] == 1
    wild = integrate(
        double_pendulum(), np.linspace(0, 10, 101), starts={"theta1": 2.0, "theta2": 2.5, "theta1_dot": 0.1}
    )
    assert wild.amplification[-1] > 1e3
    assert wild.trajectory["theta1"][0] == 2.0
    assert wild.trajectory["theta1_dot"][0] == 0.1


@pytest.mark.parametrize("rtol", [1e-9, 1e-10])
def test_equal_links_go_on_through_their_singular_positions(rtol: float) -> None:
    """A slider crank with a rod as long as its crank: where the slider is at the pivot, it could stay there instead.

    The motion is x = 2 cos a, b = -a; at 1e-10 rounding had led the rod astray at the fourth passage.
    """
    a, b, x = coordinate("a", start=0.3, velocity=4.0), coordinate("b", guess=-0.3), coordinate("x", guess=1.9)
    rods = [(sp.cos(a) / 2, sp.sin(a) / 2), (sp.cos(a) + sp.cos(b) / 2, sp.sin(a) + sp.sin(b) / 2)]
    bodies = [Body(f"rod{i}", 1, at, q, 0.08) for i, (at, q) in enumerate(zip(rods, (a, b), strict=True))]
    loop = [Constraint("y", sp.sin(a) + sp.sin(b)), Constraint("x", sp.cos(a) + sp.cos(b) - x)]
    crank = Mechanism(
        "crank",
        coordinates=[a, b, x],
        bodies=[*bodies, Body("slider", 0.5, (x, 0))],
        constraints=loop,
        gravity=sp.Float(9.81),
    )
    times = np.linspace(0, 5, 51)

    def slope(_: float, z: np.ndarray) -> list[float]:
        sine, cosine = np.sin(z[0]), np.cos(z[0])
        inertia, rate = 0.66 + 4 * sine**2, 4 * sine * cosine  # 2 T / a_dot^2, and half its slope
        return [z[1], -(rate * z[1] ** 2 + 9.81 * cosine) / inertia]

    exact = solve_ivp(slope, (0, 5), [0.3, 4.0], "DOP853", times, rtol=1e-12, atol=1e-12).y[0]
    assert (np.diff(np.sign(np.cos(exact))) != 0).sum() >= 3
    run = integrate(crank, times, rtol=rtol)
    assert run.trajectory["a"] == pytest.approx(exact, abs=1e-7)
    assert np.abs(run.trajectory["a"] + run.trajectory["b"]).max() < 1e-9


def test_everything_at_once_balances() -> None:
    drive = {"w": sp.sin(2 * t) / 5, "push": np.cos, "Q_theta": 0.3, "free_x": t / 10}
    reference = integrate(loaded(), np.linspace(1.0, 3.0, 21), inputs=drive, parameters={"m": 1.0})
    assert np.abs(reference.balance).max() < 1e-8
    speed = reference.trajectory["x_dot"] + 0.4 * np.cos(2 * reference.trajectory.time)
    assert reference.trajectory["speed"] == pytest.approx(speed, abs=1e-12)


def cart() -> Mechanism:
    """x_ddot = F."""
    x, F = coordinate("x", "m"), signal("F", "N", start=1.0)
    return Mechanism("cart", coordinates=[x], inputs=[F], energy=Energy(kinetic=x.dot**2 / 2), forces={x: F})


def test_inputs_default_to_their_start_and_may_come_from_a_table() -> None:
    assert integrate(cart(), [0, 2]).trajectory["x"][-1] == pytest.approx(2.0)
    ramp = Trajectory.of([0.0, 1.0, 2.0], {"F": [0.0, 1.0, 0.0]})
    assert integrate(cart(), [0, 2], inputs=ramp).trajectory["x_dot"][-1] == pytest.approx(1.0, abs=1e-12)
    assert integrate(cart(), [0, 2], inputs=held(ramp)).trajectory["x_dot"][-1] == pytest.approx(1.0, abs=1e-12)
    assert integrate(cart(), [0, 1, 4], inputs=held(ramp)).trajectory["x"] == pytest.approx([0, 0, 2.5], abs=1e-11)
    assert integrate(cart(), [0, 2], inputs={"F": 0.0, "Q_x": 3.0}).trajectory["x"][-1] == pytest.approx(6.0)


@pytest.mark.parametrize("table", [lambda x: x, held], ids=["linear", "held"])
def test_many_breaks_leave_an_error_to_see(table: object) -> None:
    """Breaks at 0.1 i miss the output times by a bit of rounding, too."""
    wave = Trajectory.of(np.arange(51) * 0.1, {"Q_theta": np.sin(np.arange(51) * 0.4)})
    reference = integrate(pendulum(), np.linspace(0, 5, 51), inputs=table(wave), rtol=1e-10)
    assert 0 < reference.relative_error.max() < 1e-8
    assert np.abs(reference.balance).max() < 1e-8


@pytest.mark.parametrize(
    ("mechanism", "inputs", "message"),
    [
        (cart(), {"G": 1.0}, "no input 'G'; known are F, Q_x"),
        (cart(), {"F": sp.Symbol("x")}, "may depend on t only"),
        (driven_pendulum(True), {"y0": lambda s: s}, "y0_ddot and y0_dot missing"),
        (driven_pendulum(True), lambda s: {"y0": s, "y0_dot": 1.0}, "y0_ddot missing"),
        (driven_pendulum(True), Trajectory.of([0, 1], {"y0": [0, 1]}), "y0_ddot and y0_dot missing"),
        (cart(), held(Trajectory.of([0, 1], {"G": [0, 1]})), "no input 'G'; known are F, Q_x"),
    ],
)
def test_refuses_inputs(mechanism: Mechanism, inputs: object, message: str) -> None:
    with pytest.raises(LoadError, match=message):
        integrate(mechanism, [0, 1], inputs=inputs)


def test_refuses_inputs_that_come_and_go() -> None:
    with pytest.raises(SimulationError, match=r"the inputs are \[\] at time 1\.0 s and \['F'\] at the start"):
        integrate(cart(), [0, 1], inputs=lambda s: {"F": 2.0} if s < 1 else {})


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"times": []}, SimulationError, "one time or more"),
        ({"times": [0, 1, 1]}, SimulationError, "does not come after"),
        ({"starts": {"y": 1.0}}, LoadError, "no start value 'y'; known are x, x_dot"),
        ({"starts": {"x": np.inf}}, LoadError, "'x': inf is not a finite number"),
        ({"rtol": 0.0}, LoadError, "rtol 0.0"),
        ({"method": "Euler"}, LoadError, "method 'Euler'"),
        ({"inputs": {"F": np.nan}}, SimulationError, "input 'F' is nan"),
    ],
)
def test_refuses_what_cannot_be_run(changes: dict, error: type[Exception], message: str) -> None:
    arguments = {"times": [0, 1]} | changes
    with pytest.raises(error, match=message):
        integrate(cart(), arguments.pop("times"), **arguments)


def test_one_time_is_a_run_without_steps() -> None:
    reference = integrate(pendulum(0.3), [2.0])
    assert reference.trajectory["theta"].tolist() == [0.3]
    assert reference.amplification.tolist() == [1.0]


def test_failures_tell_the_time_that_was_reached() -> None:
    x = coordinate("x", start=1.0)
    into_the_centre = Mechanism(
        "into_the_centre", coordinates=[x], energy=Energy(kinetic=x.dot**2 / 2, potential=-1 / x)
    )
    with pytest.raises(SimulationError, match=r"'into_the_centre' at time 1\.1\d* s: Radau cannot go on"):
        integrate(into_the_centre, [0, 2], rtol=1e-5)  # falls into x = 0 at pi / (2 sqrt 2) = 1.11 s
    massless = Mechanism("massless", coordinates=[x], energy=Energy(kinetic=0 * x.dot, potential=x**2))
    with pytest.raises(SimulationError, match=r"at time 0\.0 s: no accelerations at the start, .* singular in x"):
        integrate(massless, [0, 1])


def test_radau_takes_over_from_stiff_equations(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.modules["lag2fmu.reference.initial_value_problem"], "MAX_EVALUATIONS", 20_000)
    x, c = coordinate("x", start=1.0), parameter("c", 1e6)
    stiff = Mechanism(
        "stiff",
        coordinates=[x],
        parameters=[c],
        energy=Energy(kinetic=x.dot**2 / 2, potential=1e6 * x**2 / 2, dissipation=c * x.dot**2 / 2),
    )
    reference = integrate(stiff, [0, 1, 2], rtol=1e-7)
    assert reference.method == "Radau"
    assert reference.trajectory["x"] == pytest.approx(np.exp([0.0, -1, -2]), rel=1e-4)


def test_a_long_vibration_is_not_stiff(monkeypatch: pytest.MonkeyPatch) -> None:
    """With a bound in time the explicit method goes on where it comes far: Radau needs ten times the evaluations."""
    monkeypatch.setattr(initial_value_problem, "MAX_EVALUATIONS", 2_000)
    with deadline.within(60.0):
        reference = integrate(oscillator(), [0, 400.0], rtol=1e-8)
    assert reference.method == "DOP853"
    assert reference.evaluations > 4_000


def test_a_run_that_is_too_long_says_which_stop_time_is_within_reach(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(initial_value_problem, "MAX_EVALUATIONS", 300)
    with pytest.raises(SimulationError, match="took 300 evaluations, as many as one run may take") as caught:
        integrate(oscillator(), [0, 1000.0], rtol=1e-8, whole=5.0)
    found = re.search(r"give a shorter stop time, (\S+) s is within reach", str(caught.value))
    assert found
    assert 0.1 < float(found[1]) < 10
    integrate(oscillator(), [0, float(found[1])], rtol=1e-8, whole=5.0)


@pytest.fixture
def ticks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A clock that goes on by a second each time it is read, so that no test depends on the machine's speed."""
    read = itertools.count().__next__
    monkeypatch.setattr(deadline, "time", SimpleNamespace(thread_time=read, perf_counter=read))


@pytest.mark.usefixtures("ticks")
def test_of_two_methods_the_one_that_comes_farther_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    """The explicit one was dropped where it had taken too many evaluations for the whole of a very long vibration."""
    monkeypatch.setattr(initial_value_problem, "MAX_EVALUATIONS", 2_000)
    with deadline.within(10_000.0):
        reference = integrate(oscillator(), np.arange(100_000.0), rtol=1e-8)
    assert reference.method == "DOP853"
    assert 30 < reference.trajectory.time[-1] < 1000


@pytest.mark.usefixtures("ticks")
def test_a_run_whose_time_is_over_ends_where_it_came() -> None:
    x = coordinate("x", start=1.0)
    fast = Mechanism("fast", coordinates=[x], energy=Energy(kinetic=x.dot**2 / 2, potential=1e10 * x**2 / 2))
    times = np.linspace(0.0, 1.0, 20001)
    with within(10_000.0):
        found = integrate(fast, times, rtol=1e-9)
    reached = len(found.trajectory)
    assert 1 < reached < len(times)
    assert found.trajectory.time == pytest.approx(times[:reached])
    assert found.trajectory["x"] == pytest.approx(np.cos(1e5 * times[:reached]), abs=1e-4)
    assert len(found.amplification) == len(found.work) == reached


def test_a_bound_in_time_reaches_the_laws_of_contact_at_the_start() -> None:
    """Where not even the start was settled, there is nothing to give back."""
    with within(-1.0), pytest.raises(OutOfTimeError):
        integrate(load("stack_of_blocks"), [0.0, 0.1])


@pytest.mark.usefixtures("ticks")
def test_a_hybrid_run_whose_time_is_over_ends_where_it_came() -> None:
    times = np.linspace(0.0, 1000.0, 20001)
    with within(2_000.0):
        found = integrate(load("bouncing_ball"), times, rtol=1e-9)
    assert 0 < len(found.trajectory) < len(times)
    assert found.comparable is not None
    assert len(found.comparable) == len(found.trajectory)
    assert all(event.time <= found.trajectory.time[-1] for event in found.events)
