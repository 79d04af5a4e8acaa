"""Variational integrators under constraints: orders, constraints, invariants over many periods, refusals."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from stepping import Stepping
from sympy import cos, sin

from lag2fmu import export
from lag2fmu.codegen import METHODS, SMOOTH_METHODS
from lag2fmu.dynamics.lagrange import with_derived
from lag2fmu.errors import ExportError
from lag2fmu.formats.loading import load
from lag2fmu.language.expressions import TIME
from lag2fmu.mechanism import Body, Constraint, Energy, Mechanism, coordinate, parameter, signal
from lag2fmu.reference import integrate

pytestmark = pytest.mark.fmu

G = 9.81
LOBATTO = ["verlet", "lobatto4"]


@pytest.fixture(scope="module")
def spherical() -> Mechanism:
    """A bob on a rod of length 1 m in Cartesian coordinates, with air drag c."""
    x, y = coordinate("x", "m", start=0.6), coordinate("y", "m", velocity=1.5)
    z = coordinate("z", "m", guess=-0.8)
    m, rod, c = parameter("m", 2.0, "kg"), parameter("rod", 1.0, "m"), parameter("c", 0.0, "kg/s")
    q = (x, y, z)
    return Mechanism(
        "spherical", coordinates=q, parameters=[m, rod, c], bodies=[Body("bob", m, q)], gravity=G,
        energy=Energy(dissipation=c * sum(u.dot**2 for u in q) / 2),
        constraints=[Constraint("length", sum(u**2 for u in q) - rod**2)],
    )  # fmt: skip


@pytest.fixture(scope="module")
def turning_wire() -> Mechanism:
    """A bead on a straight wire that turns with 2 rad/s, on the ground."""
    x, y = coordinate("x", "m", start=0.5), coordinate("y", "m")
    m, w = parameter("m", 0.3, "kg"), parameter("w", 2.0, "rad/s")
    wire = Constraint("wire", y * cos(w * TIME) - x * sin(w * TIME))
    return Mechanism("turning_wire", coordinates=[x, y], parameters=[m, w], bodies=[Body("bead", m, (x, y))],
                     constraints=[wire])  # fmt: skip


@pytest.fixture(scope="module")
def moved_pendulum() -> Mechanism:
    """A bob whose support is moved along x by the input y0."""
    x, z = coordinate("x", "m", start=0.0), coordinate("z", "m", guess=-1.0)
    m, rod, y0 = parameter("m", 2.0, "kg"), parameter("rod", 1.0, "m"), signal("y0", "m", motion=True)
    return Mechanism("moved_pendulum", coordinates=[x, z], parameters=[m, rod], inputs=[y0], gravity=G,
                     bodies=[Body("bob", m, (x, z))],
                     constraints=[Constraint("length", (x - y0) ** 2 + z**2 - rod**2)])  # fmt: skip


def swing(time: float, angle: float, rate: float, support: float = 0.0, drag: float = 0.0) -> np.ndarray:
    """Angle from the vertical and its rate, of a pendulum of 1 m whose support has the acceleration ``support``."""

    def slope(t: float, u: np.ndarray) -> list[float]:
        return [u[1], -G * np.sin(u[0]) - support * np.cos(u[0]) - drag * u[1]]

    return solve_ivp(slope, (0, time), [angle, rate], "DOP853", rtol=1e-13, atol=1e-13).y[:, -1]


def observed_order(errors: list[float]) -> float:
    return float(np.log2(errors[-2] / errors[-1]))


# -------------------------------------------------------------------------------------------------- orders of accuracy


@pytest.mark.parametrize("drag", [0.0, 0.4])
@pytest.mark.parametrize("solver", LOBATTO)
def test_a_pendulum_moves_as_in_its_angle(solver: str, drag: float, exported, spherical: Mechanism) -> None:
    """In the plane, and with a velocity through it; drag c acts on m l^2."""
    angle, rate = swing(1.7, np.arcsin(0.6), 0.0, drag=drag / 2.0)
    exact, errors = [np.sin(angle), 0.0, -np.cos(angle), rate * np.cos(angle), 0.0, rate * np.sin(angle)], []
    for step in (0.01, 0.005):
        with Stepping(exported(spherical, solver=solver).path) as s:
            s.start({"solver_step": step, "y_dot": 0.0, "c": drag})
            s.step(0.9)
            s.step(0.8)
            x = s.get(["x", "y", "z", "x_dot", "y_dot", "z_dot"])
            errors.append(np.abs(np.subtract(x, exact)).max())
            assert abs(np.dot(x[:3], x[:3]) - 1) < 1e-12
            assert abs(np.dot(x[:3], x[3:])) < 1e-12
    assert observed_order(errors) == pytest.approx(METHODS[solver].order, abs=0.1)


@pytest.mark.parametrize(
    ("model", "step", "solver"),
    [
        *(
            (model, step, solver)
            for model, step in (
                ("four_bar_linkage", 2e-3),
                ("parallel_manipulator", 4e-3),
                ("heavy_top_quaternion", 1e-3),
            )
            for solver in LOBATTO
        ),
        ("four_bar_linkage", 4e-3, "gauss4"),
        ("heavy_top_quaternion", 1e-3, "midpoint"),
        ("rolling_disc", 2e-2, "gauss4"),
    ],
)
def test_observed_orders(model: str, step: float, solver: str, exported) -> None:
    """Of a closed loop, redundant constraints, a quaternion's singular M, rolling; against direct integration."""
    truth, errors = integrate(with_derived(load(model)), [0.0, 0.2], rtol=1e-12).trajectory, []
    for length in (step, step / 2):
        with Stepping(exported(model, solver=solver).path) as s:
            s.start({"solver_step": length}).step(0.2)
            errors.append(max(abs(s.get([name])[0] - truth[name][-1]) for name in s.states))
            residuals = [name for name in s.references if name.startswith("residual_")]
            assert s.get(residuals) == pytest.approx([0.0] * len(residuals), abs=1e-12)
    assert observed_order(errors) == pytest.approx(METHODS[solver].order, abs=0.25)


@pytest.mark.parametrize("solver", LOBATTO)
def test_a_linkage_stays_closed(solver: str, exported) -> None:
    """Written with complex numbers, positions and velocities."""
    l1, l2, d = 0.1, 0.25, 0.2
    with Stepping(exported("four_bar_linkage", solver=solver).path) as s:
        s.start({"solver_step": 1e-3}).step(0.35)
        a, b, c, a_dot, b_dot, c_dot = s.get(["a", "b", "c", "a_dot", "b_dot", "c_dot"])
    turn = np.exp(1j * np.array([a, b, c]))
    assert abs(l1 * turn[0] + l2 * turn[1] + d - l2 * turn[2]) < 1e-12
    assert abs(l1 * turn[0] * a_dot + l2 * turn[1] * b_dot - l2 * turn[2] * c_dot) < 1e-11


@pytest.mark.parametrize("solver", [*LOBATTO, "gauss6"])
def test_a_constraint_that_moves_with_time(solver: str, exported, turning_wire: Mechanism) -> None:
    """r'' = w^2 r along the wire."""
    r, rate = 0.5 * np.cosh(2.0), np.sinh(2.0)
    along, across = np.array([np.cos(2.0), np.sin(2.0)]), np.array([-np.sin(2.0), np.cos(2.0)])
    exact, errors = np.concatenate([r * along, rate * along + 2.0 * r * across]), []
    for step in (0.2, 0.1) if solver == "gauss6" else (0.02, 0.01):
        with Stepping(exported(turning_wire, solver=solver).path) as s:
            s.start({"solver_step": step}).step(1.0)
            x = np.array(s.get(["x", "y", "x_dot", "y_dot"]))
        errors.append(np.abs(x - exact).max())
        assert abs(x[:2] @ across) < 1e-12
        assert abs(x[2:] @ across - 2.0 * (x[:2] @ along)) < 1e-12
    assert observed_order(errors) == pytest.approx(METHODS[solver].order, abs=0.1)


@pytest.mark.parametrize("solver", LOBATTO)
def test_a_constraint_that_is_moved_by_an_input(solver: str, exported, moved_pendulum: Mechanism) -> None:
    """A support with the constant acceleration 3 m/s2: gravity is inclined."""
    angle, rate = swing(1.2, 0.0, 0.0, support=3.0)
    exact, errors = [3.0 * 1.2**2 / 2 + np.sin(angle), -np.cos(angle), 3.6 + rate * np.cos(angle)], []
    for step in (0.02, 0.01):
        with Stepping(exported(moved_pendulum, solver=solver).path) as s:
            s.start({"solver_step": step, "y0_ddot": 3.0})
            y0, y0_dot = s.references["y0"], s.references["y0_dot"]
            for i in range(4):
                t = 0.3 * i
                s.set({"y0": 1.5 * t**2, "y0_dot": 3.0 * t, "y0_ddot": 3.0})
                s.unit.setRealInputDerivatives([y0, y0, y0_dot], [1, 2, 1], [3.0 * t, 3.0, 3.0])
                s.step(0.3)
            errors.append(np.abs(np.subtract(s.get(["x", "z", "x_dot"]), exact)).max())
            assert abs(s.get(["residual_length"])[0]) < 1e-12
    assert observed_order(errors) == pytest.approx(METHODS[solver].order, abs=0.1)


@pytest.mark.parametrize("solver", LOBATTO)
@pytest.mark.parametrize("model", ["four_bar_linkage", "free_body"])
def test_steps_may_be_as_short_as_rounding_lets_them(model: str, solver: str, exported) -> None:
    """Importers that look for events take such steps; constraints then tell velocities to 1e-16 m by h only."""
    truth = integrate(with_derived(load(model)), [0.0, 0.2], rtol=1e-12).trajectory
    with Stepping(exported(model, solver=solver).path) as s:
        s.start({"solver_step": 1e-4}).step(0.1)
        for length in (1e-6, 1e-7, 1e-8, 1e-10, 1e-12, 1e-15):
            s.steps(5, length)
            residuals = [name for name in s.references if name.startswith("residual_")]
            assert s.get(residuals) == pytest.approx([0.0] * len(residuals), abs=1e-14)
        s.step(0.2 - s.time)
        worst = max(abs(s.get([name])[0] - truth[name][-1]) for name in s.states)
    assert worst < {"verlet": 5e-5, "lobatto4": 1e-9}[solver]


# ------------------------------------------------------------------------------------------------- long times, states


def worst_of_tenths(s: Stepping, step: float, count: int, names: list[str]) -> tuple[list[float], list[np.ndarray]]:
    """In each tenth of ``count`` solver steps: the greatest error of the energy in 800 of them, and ``names`` then."""
    (energy,), worst, values = s.get(["total_energy"]), [], []
    for _ in range(10):
        s.step((count // 10 - 800) * step)
        errors = []
        for _ in range(800):
            s.step(step)
            errors.append(abs(s.get(["total_energy"])[0] - energy))
        worst.append(max(errors))
        values.append(np.array(s.get(names)))
    return worst, values


@pytest.mark.slow
@pytest.mark.parametrize("solver", LOBATTO)
def test_energy_of_a_spherical_pendulum_over_10000_periods(solver: str, exported, spherical: Mechanism) -> None:
    """Its error does not grow, the angular momentum about the vertical is kept to rounding."""
    step = 2 * pi / sqrt(G) / 40
    with Stepping(exported(spherical, solver=solver, optimised=True).path) as s:
        s.start({"solver_step": step})
        worst, values = worst_of_tenths(s, step, 400_000, ["x", "y", "x_dot", "y_dot"])
    assert worst[-1] < 1.01 * worst[0]
    assert worst[0] < {"verlet": 0.03, "lobatto4": 1e-5}[solver]
    for x, y, x_dot, y_dot in values:
        assert x * y_dot - y * x_dot == pytest.approx(0.9, abs=1e-11)


def angular_momentum(values: np.ndarray) -> np.ndarray:
    """Of the free body in space, from e0 ... e3 and omega in body axes."""
    w, v, omega = values[0], values[1:4], values[4:]
    L = np.array([5.0, 10.0, 13.0]) * omega
    turned: np.ndarray = L + 2 * np.cross(v, np.cross(v, L) + w * L)
    return turned


@pytest.mark.slow
@pytest.mark.parametrize("solver", LOBATTO)
def test_a_free_body_in_a_quaternion_over_10000_turns(solver: str, exported) -> None:
    """M of the quaternion has rank 3 of 4; energy error bounded, angular momentum in space kept to rounding."""
    step, names = 2 * pi / 1.5 / 40, ["e0", "e1", "e2", "e3", "omega_x", "omega_y", "omega_z"]
    with Stepping(exported("free_body", solver=solver, optimised=True).path) as s:
        s.start({"solver_step": step})
        at_start = angular_momentum(np.array(s.get(names)))
        worst, values = worst_of_tenths(s, step, 400_000, names)
    assert worst[-1] < 1.01 * worst[0]
    assert worst[0] < {"verlet": 0.01, "lobatto4": 2e-6}[solver]
    for found in values:
        assert angular_momentum(found) == pytest.approx(at_start, abs=1e-11)
        assert found[:4] @ found[:4] == pytest.approx(1.0, abs=1e-14)


@pytest.mark.parametrize("model", ["free_body", "four_bar_linkage"])
@pytest.mark.parametrize("solver", LOBATTO)
def test_a_rolled_back_run_repeats_itself_bit_for_bit(solver: str, model: str, exported) -> None:
    with Stepping(exported(model, solver=solver).path) as s:
        s.start()
        s.steps(3, 0.1)
        assert s.repeats(4, 0.1)


def test_momenta_are_new_after_something_was_set(exported, spherical: Mechanism) -> None:
    """The motion does not depend on the mass, its momenta do: a mass that changes on the way changes nothing."""
    ends = []
    for mass in (2.0, 5.0):
        with Stepping(exported(spherical, solver="lobatto4").path) as s:
            s.start({"solver_step": 0.01}).step(0.5)
            s.set({"m": mass})
            ends.append(s.step(0.5))
    assert ends[0] != ends[1]
    assert ends[0] == pytest.approx(ends[1], abs=1e-13)


# ---------------------------------------------------------------------------------------------------------- refusals


@pytest.mark.parametrize("solver", ["verlet", "gauss4"])
def test_what_has_no_mass_is_refused(solver: str, tmp_path) -> None:
    sentence = r"momenta, which do not tell how coordinates without mass move, .* has some \(massless_x\); take one of "
    with pytest.raises(ExportError, match=sentence) as refused:
        export(load("slides_problem_5_small"), tmp_path / "x.fmu", solver=solver)
    offered = str(refused.value).split("take one of ")[1].split(", ")
    assert offered == [name for name in SMOOTH_METHODS if not METHODS[name].variational]
    assert not list(tmp_path.iterdir())


def test_a_mass_matrix_that_becomes_singular_is_said(exported) -> None:
    """y has no inertia at x = 0; the constraint carries it there, but momenta do not tell its velocity."""
    x, y, m = coordinate("x", "m", start=-0.1, velocity=1.0), coordinate("y", "m"), parameter("m", 1.0, "kg")
    waning = Mechanism(
        "waning", coordinates=[x, y], parameters=[m], energy=Energy(m * (x.dot**2 + (y.dot * x) ** 2) / 2),
        constraints=[Constraint("tie", y - 2 * x)],
    )  # fmt: skip
    with Stepping(exported(waning, solver="verlet").path) as s:
        s.start({"x": 0.0, "solver_step": 1e-3})
        with pytest.raises(Exception, match="fmi2DoStep"):
            s.step(0.1)
        assert "the mass matrix becomes singular and does not determine" in s.log[-1][2]
        assert " of y;" in s.log[-1][2]
