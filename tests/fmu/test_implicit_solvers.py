"""Implicit solvers in the FMU: observed orders, energy and momenta over many periods, stiffness, rollback, notices."""

from __future__ import annotations

import re
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from scipy.linalg import expm
from scipy.special import ellipk
from stepping import OK, WARNING, Stepping

from lag2fmu import export, validate
from lag2fmu.codegen import METHODS
from lag2fmu.formats.loading import load, with_values
from lag2fmu.mechanism import Body, Damper, Energy, Mechanism, Spring, coordinate, parameter

pytestmark = pytest.mark.fmu

VARIATIONAL = [name for name, method in METHODS.items() if method.variational]


def orbit() -> Mechanism:
    """Kepler's problem in Cartesian coordinates, e = 0.5: a = 1, period 2 pi, with drag for tests of forces."""
    x, y = coordinate("x", "m", start=0.5), coordinate("y", "m", velocity=np.sqrt(3.0))
    m, c = parameter("m", 2.0, "kg"), parameter("c", 0.0, "kg/s")
    kinetic, potential = m * (x.dot**2 + y.dot**2) / 2, -m / (x**2 + y**2) ** 0.5
    return Mechanism(
        "orbit", coordinates=[x, y], parameters=[m, c], energy=Energy(kinetic, potential, c * (x.dot**2 + y.dot**2) / 2)
    )


@pytest.mark.parametrize("solver", VARIATIONAL)
def test_observed_orders(solver: str, exported, directly) -> None:
    """On a mechanism whose mass matrix changes, so that momenta are not just scaled velocities."""
    truth = directly("double_pendulum").trajectory
    names = ["theta1", "theta2", "theta1_dot", "theta2_dot"]
    exact = np.array([truth[name][200] for name in names])
    order, errors = METHODS[solver].order, []
    steps = (0.02, 0.01) if order < 6 else (0.04, 0.02)
    for step in steps:
        with Stepping(exported("double_pendulum", solver=solver).path) as s:
            s.start({"solver_step": step}).step(2.0)
            errors.append(np.abs(np.array(s.get(names)) - exact).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.15)


@pytest.mark.slow
@pytest.mark.parametrize("solver", ["verlet", "gauss4", "gauss6"])
def test_energy_does_not_drift_over_many_orbits(solver: str, exported) -> None:
    """The error of the energy returns to itself every period; the angular momentum is kept to rounding."""
    period, steps, orbits = 2 * np.pi, 60, 2000
    with Stepping(exported(orbit(), solver=solver).path) as s:
        s.start({"solver_step": period / steps})
        energy, worst = s.get(["total_energy"])[0], []
        for _ in range(10):
            values = []
            for _ in range(orbits // 10 - 3):
                s.step(period)
            for _ in range(3 * steps):
                s.step(period / steps)
                values.append(abs(s.get(["total_energy"])[0] - energy))
            worst.append(max(values))
        x, y, x_dot, y_dot = s.get(["x", "y", "x_dot", "y_dot"])
    assert worst[-1] < 1.05 * worst[0]
    assert worst[0] < {"verlet": 0.1, "gauss4": 2e-3, "gauss6": 1e-4}[solver]
    assert x * y_dot - y * x_dot == pytest.approx(0.5 * np.sqrt(3.0), abs=1e-12)


@pytest.mark.parametrize("solver", ["midpoint", "gauss6"])
def test_forces_and_friction_enter_as_in_the_equations(solver: str, exported) -> None:
    from scipy.integrate import solve_ivp

    def slope(t: float, z: np.ndarray) -> list[float]:
        r3 = (z[0] ** 2 + z[1] ** 2) ** 1.5
        return [z[2], z[3], -z[0] / r3 - 0.05 * z[2] + 0.15, -z[1] / r3 - 0.05 * z[3]]

    truth = solve_ivp(slope, (0, 3), [0.5, 0, 0, np.sqrt(3)], method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    errors = []
    for step in (0.04, 0.02) if solver == "gauss6" else (0.01, 0.005):
        with Stepping(exported(orbit(), solver=solver).path) as s:
            s.start({"solver_step": step, "c": 0.1, "Q_x": 0.3})
            s.steps(3, 1.0)
            errors.append(np.abs(np.array(s.get(["x", "y", "x_dot", "y_dot"])) - truth).max())
    assert np.log2(errors[0] / errors[1]) > METHODS[solver].order - 0.3


def stiff() -> Mechanism:
    """m x'' + c x' + k x = 0 with rates near -10 and -1e5."""
    x = coordinate("x", "m", start=1.0)
    m, c, k = parameter("m", 1.0, "kg"), parameter("c", 100_010.0, "N.s/m"), parameter("k", 1e6, "N/m")
    return Mechanism(
        "stiff", coordinates=[x], parameters=[m, c, k], energy=Energy(m * x.dot**2 / 2, k * x**2 / 2, c * x.dot**2 / 2)
    )


@pytest.mark.parametrize("tolerance", [1e-5, 1e-8])
def test_radau_follows_the_slow_motion_of_a_stiff_mechanism(tolerance: float, exported) -> None:
    A = np.array([[0.0, 1.0], [-1e6, -100_010.0]])
    with Stepping(exported(stiff(), solver="radau5").path) as s:
        s.start(tolerance=tolerance)
        for i in range(1, 6):
            x = s.step(0.1)[0]
            assert x == pytest.approx((expm(A * 0.1 * i) @ [1.0, 0.0])[0], abs=10 * tolerance)


@pytest.mark.parametrize("model", ["double_pendulum", "cart_pole"])
def test_error_of_radau_follows_the_tolerance(model: str, exported, directly) -> None:
    truth = directly(model).trajectory
    tolerances, errors = np.array([1e-4, 1e-6, 1e-8, 1e-10]), []
    for tolerance in tolerances:
        with Stepping(exported(model, solver="radau5").path) as s:
            s.start(tolerance=float(tolerance)).step(2.0)
            errors.append(max(abs(s.get([name])[0] - truth[name][200]) for name in s.states))
    slope = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    assert 0.75 < slope < 1.2
    assert errors[-1] < 1e-8


@pytest.mark.parametrize("solver", ["radau5", "ros2", "verlet", "lobatto4", "midpoint", "gauss4", "gauss6"])
def test_a_rolled_back_run_repeats_itself_bit_for_bit(solver: str, exported) -> None:
    with Stepping(exported("double_pendulum", solver=solver).path) as s:
        s.start()
        s.steps(3, 0.1)
        assert s.repeats(4, 0.1)


def test_a_step_too_long_for_the_iteration_is_said(exported) -> None:
    with Stepping(exported(stiff(), solver="gauss4").path) as s:
        s.start({"solver_step": 0.01})
        with pytest.raises(Exception, match="fmi2DoStep"):
            s.step(0.1)
        assert "not solved by iteration; lower solver_step" in s.log[-1][2]


def test_radau_keeps_constraints(exported) -> None:
    with Stepping(exported(load("slides_problem_5_small"), solver="radau5").path) as s:
        omega = np.sqrt(9.81 / (0.5 + 9.81 / 200))
        s.start(tolerance=1e-9).steps(5, 0.4)
        x, phi = s.get(["x", "phi"])
        assert phi == pytest.approx(0.1 * np.cos(2.0 * omega), abs=1e-7)
        assert 200 * x == pytest.approx(9.81 * phi, abs=1e-12)


# ------------------------------------------------------------------------------- what the log says, and the choice


def told(path: Path, steps: list[float], begin: float = 0.0, **values: float) -> list[str]:
    """What the FMU logs in communication steps of these lengths in s from the time ``begin`` on."""
    with Stepping(path) as s:
        s.start(values, start_time=begin)
        for step in steps:
            s.step(step)
        return [sentence for status, category, sentence in s.log if (status, category) == (WARNING, "logStatusWarning")]


@pytest.mark.parametrize("solver", ["dopri5", "dop853"])
def test_an_explicit_method_says_once_that_the_motion_is_stiff(solver: str, exported) -> None:
    """Overdamped, x decays with 100 /s and 9900 /s: steps stay at the limit of stability after both are gone."""
    path = exported("spring_mass_damper", solver=solver).path
    (sentence,) = told(path, [0.1] * 10, k=1e6, c=1e4)
    assert re.search(f"stiff at time .* bounds the steps of solver {solver}, to .* s there.*--solver radau5", sentence)
    limit = METHODS[solver].stability / 9900.0
    assert float(re.search(r"to (\S+) s there", sentence)[1]) == pytest.approx(limit, rel=0.15)


def test_a_fixed_step_that_is_too_long_is_said_before_the_run_ends_and_can_be_taken_back(exported) -> None:
    """The same motion: 9900 /s by 1 ms is beyond 2.785, each step multiplies what is wrong by 300."""
    with Stepping(exported("spring_mass_damper", solver="rk4").path) as s:
        s.start({"k": 1e6, "c": 1e4})
        saved = s.unit.getFMUState()
        with pytest.raises(Exception, match="discard"):
            s.steps(1000, 1e-3)
        warning, end = s.sentences
        assert re.search(
            r"too stiff at time 0\.02\d* s for a solver step of 0\.001 s.*lower solver_step, or .*ros2", warning
        )
        assert re.search(r"no finite acceleration of x.*lower solver_step, or export with --solver radau5", end)
        assert s.unit.getRealStatus(2) == pytest.approx(float(re.search(r"at time (\S+)", end)[1]), abs=1e-3)
        s.unit.setFMUState(saved)
        s.time = 0.0
        x = [x for x, _ in s.steps(400, 1e-4)]
        assert x[-1] == pytest.approx(x[0] * np.exp(-101.02 * 0.0399), rel=0.01)
        s.unit.freeFMUState(saved)


def on_a_rod() -> Mechanism:
    """A pendulum of 1 m in Cartesian coordinates on a stiff rod with critical damping, let go horizontally."""
    x, y = coordinate("x", "m", start=1.0), coordinate("y", "m")
    m, k = parameter("m", 1.0, "kg"), parameter("k", 1e8, "N/m")
    length = (x**2 + y**2) ** 0.5
    return Mechanism("on_a_rod", coordinates=[x, y], parameters=[m, k], bodies=[Body("bob", m, (x, y))], gravity=9.81,
                     springs=[Spring("rod", k, elongation=length - 1)],
                     dampers=[Damper("rod", 2 * (k * m) ** 0.5, rate=(x * x.dot + y * y.dot) / length)])  # fmt: skip


@pytest.mark.parametrize("stiffness", [1e6, 1e8, 1e10])
def test_what_turns_too_far_for_a_linearly_implicit_method_is_said(stiffness: float, exported) -> None:
    """It is said where results are wrong and only there; against a rigid rod, T = 4 K(1/2) sqrt(l/g): up once more."""
    period = 4 * ellipk(0.5) / np.sqrt(9.81)
    for step in (4e-3, 1e-3, 2.5e-4):
        with Stepping(exported(on_a_rod(), solver="ros2").path) as s:
            s.start({"k": stiffness, "solver_step": step})
            x, y = np.array(s.steps(8, period / 8))[-1][:2]
        warned = [sentence for sentence in s.sentences if "turn too far" in sentence]
        assert len(warned) == (np.hypot(x - 1, y) > 0.1), (step, x, y, s.sentences)
        for sentence in warned:
            assert re.search(
                r"at time 0\.\d+ s for a solver step of .*lower solver_step, or .*--solver radau5", sentence
            )


@pytest.mark.parametrize("solver", ["dopri5", "dop853"])
@pytest.mark.parametrize("values", [{}, {"k": 1e6, "c": 10.0}, {"k": 1e6, "c": 0.0}, {"k": 1e2, "c": 50.0}], ids=str)
def test_fast_oscillations_and_slow_decays_are_not_called_stiff(
    values: dict[str, float], solver: str, exported
) -> None:
    assert told(exported("spring_mass_damper", solver=solver).path, [0.5] * 4, **values) == []


def on_a_hard_spring() -> Mechanism:
    """A slow oscillator whose motion x shakes a block at 1000 rad/s a little."""
    x, y = coordinate("x", "m", start=0.1), coordinate("y", "m", start=0.001)
    m, k, K = parameter("m", 1.0, "kg"), parameter("k", 1.0, "N/m"), parameter("K", 1e6, "N/m")
    springs = [Spring("soft", k, elongation=x), Spring("hard", K, elongation=y - x / 100)]
    bodies = [Body("slow", m, (x, 0)), Body("fast", m, (0, y))]
    return Mechanism("hard_spring", coordinates=[x, y], parameters=[m, k, K], bodies=bodies, springs=springs)


def test_what_is_damped_is_said_at_the_export_and_once_in_the_log(exported) -> None:
    mechanism = on_a_hard_spring()
    for solver, said, values in [
        ("radau5", True, {}),
        ("radau5", False, {"solver_max_step": 2e-4}),
        ("radau5", False, {"K": 9e5}),  # unknown vibrations
        ("radau5", False, {"y": 0.01}),  # whose swing the error control follows
        ("ros2", True, {}),
        ("ros2", False, {"solver_max_step": 2e-4}),
        ("dopri5", False, {}),
    ]:
        fmu = exported(mechanism, solver=solver)
        assert ("damps the vibrations of 1e+03 rad/s (y)" in fmu.solver_choice) == (solver != "dopri5")
        sentences = told(fmu.path, [0.1] * 5, **values)
        assert len(sentences) == said, (solver, values, sentences)
        assert not said or re.search(
            f"solver {solver} damps .*: 1e\\+03 rad/s \\(y\\).*max_step to 0.0003", sentences[0]
        )


@pytest.mark.parametrize("solver", ["verlet", "rk4"])
def test_fixed_steps_that_do_not_resolve_a_vibration_are_noticed(solver: str, exported) -> None:
    fmu = exported(on_a_hard_spring(), solver=solver)
    assert "gets the vibrations of 1e+03 rad/s (y) wrong, or is unstable" in fmu.solver_choice
    (sentence,) = told(fmu.path, [0.01] * 3)
    assert re.search(
        rf"solver {solver} gets vibrations wrong.*: 1e\+03 rad/s \(y\); set solver_step to 0.0003", sentence
    )
    assert told(fmu.path, [0.01] * 3, solver_step=3e-4) == []


def test_a_notice_does_not_change_the_status_and_is_given_without_logging(exported) -> None:
    """Two importers end a run at fmi2Warning, and fmpy asks for no log by default."""
    with Stepping(exported(on_a_hard_spring(), solver="verlet").path) as s:
        s.start()
        assert s.unit.fmi2SetDebugLogging(s.unit.component, 0, 0, None) == OK
        assert s.unit.fmi2DoStep(s.unit.component, 0.0, 0.01, 1) == OK
        assert len(s.sentences) == 1
        with pytest.raises(FMICallException, match="status 3"):
            s.unit.fmi2DoStep(s.unit.component, 5.0, 0.01, 1)
        assert "the communication point is 5 s" in s.sentences[1]


def shaken_blocks(count: int) -> Mechanism:
    """A slow oscillator that shakes blocks at 1000, 1100, 1200, ... rad/s."""
    x, m, k = coordinate("x", "m", start=0.1), parameter("m", 1.0, "kg"), parameter("k", 1.0, "N/m")
    blocks = [coordinate(f"block_{i}", "m", start=0.001) for i in range(count)]
    springs = [Spring(f"hard_{y.name}", (1000.0 + 100 * i) ** 2, elongation=y - x / 100) for i, y in enumerate(blocks)]
    return Mechanism("blocks", coordinates=[x, *blocks], parameters=[m, k],
                     springs=[Spring("soft", k, elongation=x), *springs],
                     bodies=[Body(q.name, m, (q, 0)) for q in (x, *blocks)])  # fmt: skip


def test_of_many_vibrations_that_are_damped_the_fastest_are_said(exported) -> None:
    (sentence,) = told(exported(shaken_blocks(9), solver="ros2").path, [0.1])
    listed = "1.8e+03 rad/s (block_8), 1.7e+03 rad/s (block_7), 1.6e+03 rad/s (block_6) and 6 slower ones; if they"
    assert listed in sentence


def test_an_iteration_that_fails_under_error_control_has_a_remedy_of_its_own(exported) -> None:
    """A step of 1e294 s: whatever fails, the length of the first step and radau5 itself are no remedies."""
    with Stepping(exported("double_pendulum", solver="radau5").path) as s:
        s.start({"solver_max_step": 1e308})
        with pytest.raises(Exception, match="fmi2DoStep"):
            s.step(1e308)
        assert re.search(r"at time 0 the equations of an implicit.* are not solved.*; raise solver_tol", s.sentences[0])
        assert "--solver radau5" not in s.sentences[0]


def test_damping_of_what_is_not_resolved_is_as_announced(exported) -> None:
    """An eighth of a period: ros2 takes 1 % from a vibration in each, radau5 0.03 %: |R(i pi / 4)|^8."""
    for solver, expected in [("ros2", 1 - 0.010065), ("radau5", 1 - 0.000251)]:
        with Stepping(exported(on_a_hard_spring(), solver=solver).path) as s:
            step = 2e-3 * np.pi / 8
            s.start({"y": 0.1, "x": 0.0, "k": 0.0, "solver_step": step, "solver_max_step": step}, tolerance=1e-1)
            s.steps(100, 8 * step)
            y, y_dot = s.get(["y", "y_dot"])
            assert np.hypot(y, y_dot / 1000.0) / 0.1 == pytest.approx(expected**100, rel=0.02)


def test_a_variational_method_says_once_that_its_steps_became_unequal(exported) -> None:
    path = exported("pendulum", solver="verlet").path
    assert told(path, [0.1] * 5 + [0.1 * (1 + 1e-9)]) == []
    assert told(path, [0.1] * 3 + [1e-16, 0.1]) == []  # what an importer's rounding left over
    (sentence,) = told(path, [0.1, 0.1, 0.0123, 0.1])
    assert "solver verlet keeps the energy bounded" in sentence


def test_steps_stay_equal_where_times_are_rounded_coarsely(exported) -> None:
    """After 1e7 s the next double is 1.9e-9 s away, 1e-6 of a step of 1 ms, which still takes one solver step."""
    steps = np.diff(1e7 + 1e-3 * np.arange(50)).tolist()
    assert max(steps) > 1e-3 > min(steps)
    assert told(exported("pendulum", solver="verlet").path, steps, begin=1e7, solver_step=1e-3) == []


def test_the_stability_intervals_are_the_published_ones() -> None:
    """Hairer, Wanner II, section IV.2: 2.785 of the classical method of order 4, 3.3 of Dormand and Prince's."""
    assert METHODS["rk4"].stability == pytest.approx(2.785293563405282, abs=1e-8)
    assert METHODS["dopri5"].stability == pytest.approx(3.3066, abs=1e-4)


def test_the_solver_is_chosen_for_the_motion_at_the_start(tmp_path: Path) -> None:
    fast = with_values(load("spring_mass_damper"), {"k": 1e6, "c": 1e4})
    for mechanism, solver, phrase in [
        (fast, "radau5", "decays of 9.9e+03 /s among 0.1 /s"),
        (with_values(fast, {"c": 10.0}), "dopri5", "not stiff"),
        (load("kepler"), "dopri5", "not stiff"),
    ]:
        fmu = export(mechanism, tmp_path / "x.fmu", compiler="host")
        assert (fmu.description.solver, phrase in fmu.solver_choice) == (solver, True), fmu.solver_choice
        with ZipFile(fmu.path) as archive:
            assert phrase in archive.read("documentation/index.html").decode()
    assert export(fast, tmp_path / "x.fmu", solver="dopri5", compiler="host").description.solver == "dopri5"


def test_a_report_says_which_solver_suits_and_what_the_fmu_warned_of() -> None:
    fast = with_values(load("spring_mass_damper"), {"k": 1e6, "c": 1e4})
    notes = " ".join(validate(fast, stop_time=0.5, solver="dopri5").notes)
    assert "the export takes radau5: the motion is stiff at its start, with decays of 9.9e+03 /s" in notes
    assert "The FMU warned, co-simulation, step" in notes
    assert "stability, not accuracy, bounds the steps" in notes
    assert "warned" not in " ".join(validate(load("pendulum"), stop_time=1.0).notes)
