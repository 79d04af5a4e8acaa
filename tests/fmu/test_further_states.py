"""Further states of first order in FMUs: motors, filters, controllers, against closed forms and direct integration."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from numpy.typing import NDArray
from scipy.linalg import expm
from stepping import Stepping
from sympy import Symbol, cos, sin, sqrt

from lag2fmu import export, linearize, simulate, validate
from lag2fmu.analysis import equilibria
from lag2fmu.codegen import METHODS, SMOOTH_METHODS
from lag2fmu.dynamics import derive
from lag2fmu.fmu import Fmu
from lag2fmu.mechanism import Body, Constraint, Contact, Energy, Mechanism, Spring, State, coordinate, parameter, signal
from lag2fmu.reference import integrate

pytestmark = pytest.mark.fmu
Floats = NDArray[np.float64]

i, T, s, f, z = (Symbol(name, real=True) for name in ("i", "T", "s", "f", "z"))


def controlled_mass() -> Mechanism:
    """m x'' = f with f' = (kp (r - x) + ki s - kd x' - f)/tau and s' = r - x: linear."""
    x, r = coordinate("x", "m", start=0.5), signal("r", "m", start=1.0)
    given = {"m": 2.0, "kp": 30.0, "ki": 10.0, "kd": 12.0, "tau": 0.05}
    m, kp, ki, kd, tau = (parameter(name, value) for name, value in given.items())
    return Mechanism(
        "controlled_mass",
        coordinates=[x],
        parameters=[m, kp, ki, kd, tau],
        inputs=[r],
        energy=Energy(kinetic=m * x.dot**2 / 2),
        forces={x: f},
        states=[
            State("s", "m.s", derivative=r - x),
            State("f", "N", derivative=(kp * (r - x) + ki * s - kd * x.dot - f) / tau),
        ],
    )


MATRIX = np.array(
    [
        [0, 1, 0, 0, 0],
        [0, 0, 0, 0.5, 0],
        [-1, 0, 0, 0, 1],
        [-600, -240, 200, -20, 600],
        [0, 0, 0, 0, 0],
    ],
    dtype=float,
)
"""d(x, x', s, f, r)/dt of ``controlled_mass``."""
LINEAR, SCALES = ("x", "x_dot", "s", "f"), (1.0, 1.0, 1.0, 7.0)


def servo() -> Mechanism:
    """A pendulum on a motor that saturates and warms up: nonlinear in everything."""
    theta, u = coordinate("theta", "rad", start=0.4, velocity=0.3), signal("u", "V", start=3.0)
    R, L, K = parameter("R", 1.5, "Ohm"), parameter("L", 0.1, "H"), parameter("K", 0.6, "N.m/A")
    m, length = parameter("m", 0.3, "kg"), parameter("l", 0.5, "m")
    return Mechanism(
        "servo",
        coordinates=[theta],
        parameters=[R, L, K, m, length],
        inputs=[u],
        bodies=[Body("bob", m, (length * sin(theta), -length * cos(theta)))],
        gravity=9.81,
        forces={theta: K * i * (1 + sin(theta) / 10) - T * theta.dot / 100},
        states=[
            State("i", "A", start=0.2, derivative=(u - R * i - K * theta.dot - i**3 / 50) / L),
            State("T", start=1.0, derivative=R * i**2 / 10 - sin(T) / 5),
        ],
    )


def weighed_pendulum() -> Mechanism:
    """A pendulum in x and y whose rod's force a filter measures: the derivative contains a multiplier."""
    x, y = coordinate("x", "m", start=0.6), coordinate("y", "m", start=-0.8)
    return Mechanism(
        "weighed_pendulum",
        coordinates=[x, y],
        bodies=[Body("bob", 1.5, (x, y))],
        gravity=9.81,
        constraints=[Constraint("rod", x**2 + y**2 - 1)],
        forces={x: -z / 50},
        states=[State("z", start=5.0, derivative=3 * (Symbol("multiplier_rod", real=True) - z))],
    )


def massless_ends() -> Mechanism:
    """A mass between springs whose other ends have no mass and are pulled by further states, one through a damper."""
    x, a, b = coordinate("x", "m", start=0.2), coordinate("a", "m"), coordinate("b", "m")
    return Mechanism(
        "massless_ends",
        coordinates=[x, a, b],
        bodies=[Body("block", 1.0, (x, 0))],
        springs=[
            Spring("of_a", 20.0, elongation=x - a),
            Spring("of_b", 30.0, elongation=x - b),
            Spring("wall", 40.0, elongation=a),
        ],
        forces={a: f, b: z - 5 * b.dot},
        states=[State("f", start=1.0, derivative=-2 * f - 3 * x.dot), State("z", start=0.5, derivative=-x - z)],
    )


@pytest.mark.parametrize("solver", SMOOTH_METHODS)
def test_a_linear_motion_is_the_matrix_exponential(solver: str, exported: Callable[..., Fmu]) -> None:
    fmu = exported(MASS, solver=solver)
    second_order = METHODS[solver].order <= 2
    settings = {"solver_step": 4e-6 if second_order else 2e-4} if METHODS[solver].error_order == 0 else {}
    run = simulate(fmu, stop_time=0.3, step=0.03, tolerance=1e-11, values=settings)
    assert (np.abs(run.columns(LINEAR) - exact(run.time)) / SCALES).max() < 1e-9


def exact(times: Floats) -> Floats:
    """The motion of ``controlled_mass``, (k, 4)."""
    return np.array([(expm(MATRIX * t) @ [0.5, 0, 0, 0, 1])[:4] for t in times])


MASS, SERVO = controlled_mass(), servo()


@pytest.mark.parametrize("solver", ["dopri5", "dop853", "radau5"])
def test_between_the_steps_of_a_solver_further_states_are_as_accurate(
    solver: str, exported: Callable[..., Fmu]
) -> None:
    run = simulate(exported(MASS, solver=solver), stop_time=1.0, step=0.0013, tolerance=1e-8)
    assert np.abs(run.columns(LINEAR) - exact(run.time)).max() < 1e-7


def test_an_importer_integrates_them(exported: Callable[..., Fmu]) -> None:
    run = simulate(exported(MASS), stop_time=1.0, step=0.1, tolerance=1e-10, kind="model-exchange")
    assert np.abs(run.columns(LINEAR) - exact(run.time)).max() < 1e-7


@pytest.mark.parametrize("mechanism", [weighed_pendulum(), massless_ends()], ids=lambda m: m.name)
@pytest.mark.parametrize("solver", ["dopri5", "radau5", "lobatto4"])
def test_constraints_and_what_has_no_mass_go_along(
    mechanism: Mechanism, solver: str, exported: Callable[..., Fmu]
) -> None:
    if solver == "lobatto4" and mechanism.name == "massless_ends":
        pytest.skip("variational methods take no nonholonomic constraints, which a massless end with a damper is")
    settings = {"solver_step": 1e-3} if solver == "lobatto4" else {}
    run = simulate(exported(mechanism, solver=solver), stop_time=1.0, step=0.1, tolerance=1e-10, values=settings)
    found = integrate(derive(mechanism).completed, run.time)
    states = list(found.scales)
    assert np.abs(run.columns(states) - found.trajectory.columns(states)).max() < 1e-7


def test_they_go_through_impacts(exported: Callable[..., Fmu]) -> None:
    """A bouncing ball that a filter of its height pulls: y jumps in its velocity, the filter does not."""
    y = coordinate("y", "m", start=1.0)
    ball = Mechanism(
        "filtered_ball",
        coordinates=[y],
        bodies=[Body("ball", 1.0, (0, y))],
        gravity=9.81,
        contacts=[Contact("floor", gap=y, restitution=0.7)],
        forces={y: -2 * z},
        states=[State("z", "m", start=0.2, derivative=3 * (y - z))],
    )
    run = simulate(exported(ball), stop_time=1.2, step=0.1, tolerance=1e-11)
    found = integrate(derive(ball).completed, run.time)
    names = ["y", "y_dot", "z"]
    assert np.abs(run.columns(names) - found.trajectory.columns(names)).max() < 1e-8
    assert len(found.events) >= 2


def test_validate_agrees(exported: Callable[..., Fmu]) -> None:
    report = validate(exported(SERVO), stop_time=1.0)
    assert report.passed
    assert any("der_i" in check.name or "outputs" in check.name for check in report.checks)


# ----------------------------------------------------------------------------------------------------- derivatives


POINT = {"theta": 0.7, "theta_dot": -0.4, "i": 0.9, "T": 1.3, "u": 2.0}
RATES = ("der_theta_dot", "der_i", "der_T")


def values_at(host: Stepping, point: Mapping[str, float]) -> Floats:
    host.set(point)
    return np.array(host.get(RATES))


def test_directional_derivatives_are_those_of_differences(exported: Callable[..., Fmu]) -> None:
    with Stepping(exported(SERVO).path, "ModelExchange") as host:
        host.start()
        for known in (*POINT, "R", "L"):
            at = {**POINT, "R": 1.5, "L": 0.1}
            h = 1e-6
            sides = [values_at(host, at | {known: at[known] + d}) for d in (h, -h)]
            values_at(host, at)
            assert host.derivative(RATES, {known: 1.0}) == pytest.approx(
                (sides[0] - sides[1]) / (2 * h), rel=1e-7, abs=1e-7
            )
            assert host.derivative(["i", "T"], {known: 1.0}) == [float(known == "i"), float(known == "T")]


def test_the_model_structure_names_what_they_depend_on(exported: Callable[..., Fmu]) -> None:
    table = exported(SERVO).description.variables
    found = {v.name: set(v.dependencies or ()) for v in table}
    assert found["der_i"] == {"u", "R", "i", "K", "theta_dot", "L"}
    assert found["der_T"] == {"R", "i", "T"}
    assert {"i", "T"} < found["theta_ddot"]
    states = {v.name: v for v in table if v.state}
    assert list(states) == ["theta", "theta_dot", "i", "T"]
    assert (states["i"].causality, states["i"].initial, states["i"].start) == ("output", "exact", 0.2)


def test_time_derivatives_of_outputs(exported: Callable[..., Fmu]) -> None:
    """By the step: values a small time before and after, with the input constant."""
    with Stepping(exported(SERVO, solver="gauss6").path) as host:
        host.start({"solver_step": 1e-3})
        host.step(0.2)
        references = [host.references[name] for name in ("i", "T")]
        first, second = (host.unit.getRealOutputDerivatives(references, [order] * 2) for order in (1, 2))
        middle, h = np.array(host.get(["i", "T"])), 1e-3
        ahead = [host.step(h) and np.array(host.get(["i", "T"])) for _ in range(4)]
        slope = (-25 * middle + 48 * ahead[0] - 36 * ahead[1] + 16 * ahead[2] - 3 * ahead[3]) / (12 * h)
        bend = (35 * middle - 104 * ahead[0] + 114 * ahead[1] - 56 * ahead[2] + 11 * ahead[3]) / (12 * h**2)
        assert first == pytest.approx(slope, rel=1e-6)
        assert second == pytest.approx(bend, rel=1e-3)


@pytest.mark.parametrize("solver", ["dopri5", "radau5", "gauss4"])
def test_a_run_is_rolled_back_bit_for_bit(solver: str, exported: Callable[..., Fmu]) -> None:
    with Stepping(exported(SERVO, solver=solver).path) as host:
        host.start({"i": 0.7, "T": 2.0})
        assert host.get(["i", "T"]) == [0.7, 2.0]
        host.steps(5, 0.013)
        assert host.repeats(20, 0.013)


def test_a_derivative_without_value_is_named(exported: Callable[..., Fmu]) -> None:
    x = coordinate("x", "m", start=1.0)
    m = Mechanism(
        "leaking",
        coordinates=[x],
        energy=Energy(kinetic=x.dot**2 / 2),
        forces={x: -z},
        states=[State("z", start=1.0, derivative=-1 - sqrt(z))],
    )
    with Stepping(exported(m).path) as host:
        host.start()
        with pytest.raises(FMICallException):
            host.step(1.0)
        assert "the derivative of the state z is" in host.sentences[-1]


# -------------------------------------------------------------------------------------------------------- analysis


def test_the_linearization_holds_them() -> None:
    about = linearize(MASS)
    assert about.states == LINEAR
    assert pytest.approx(MATRIX[:4, :4]) == about.A
    assert about.B[:, about.inputs.index("r")] == pytest.approx(MATRIX[:4, 4])


def test_constraints_leave_them_free() -> None:
    """Two states of the pendulum on its circle and that of the filter, whose decay is an eigenvalue."""
    equations = derive(weighed_pendulum())
    (rest,) = (item for item in equilibria(equations) if item.q[1] < 0)
    assert rest.q == pytest.approx([0.01, -np.sqrt(1 - 0.01**2)])  # 2 x multiplier = z/50 = multiplier/50
    assert rest.further == pytest.approx([1.5 * 9.81 / (2 * rest.q[1])])
    about = linearize(equations, q=rest.q, qd=np.zeros(2), further=rest.further)
    assert about.states[1:] == ("x_dot", "z")
    assert np.abs(about.eigenvalues + 3).min() < 0.05


def test_an_equilibrium_rests_in_all_states() -> None:
    (rest, *_) = equilibria(derive(MASS))
    assert rest.q == pytest.approx([1.0])
    assert rest.further == pytest.approx([0.0, 0.0], abs=1e-12)


def test_the_python_backend_has_them(exported: Callable[..., Fmu], tmp_path: Path) -> None:
    own = export(SERVO, tmp_path / "servo.fmu", backend="python").path
    runs = [simulate(path, stop_time=0.2, step=0.05, tolerance=1e-9) for path in (own, exported(SERVO).path)]
    names = ["theta", "theta_dot", "i", "T"]
    assert np.abs(runs[0].columns(names) - runs[1].columns(names)).max() < 1e-8
