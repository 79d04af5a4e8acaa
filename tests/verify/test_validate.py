"""The comparison finds faults, says where, and knows how far it can compare."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest
from sympy import Heaviside, Min, Rational, cos, sign, sin, symbols, sympify, tanh

import lag2fmu
from lag2fmu.errors import ExportError, LoadError, MechanismError, SimulationError
from lag2fmu.formats.loading import load, with_values
from lag2fmu.formats.text import read
from lag2fmu.language.expressions import TIME
from lag2fmu.mechanism import Body, Constraint, Energy, Experiment, Force, Mechanism, Spring, coordinate, signal
from lag2fmu.reference import Trajectory, integrate
from lag2fmu.verify import Report
from lag2fmu.verify.agreement import on_grid
from lag2fmu.verify.comparison import extent_check
from lag2fmu.verify.pointwise import pointwise_checks
from lag2fmu.verify.task import Task
from lag2fmu.verify.validate import validate_fmu

pytestmark = pytest.mark.fmu

TRAJECTORIES = {"co-simulation", "model exchange"}
ACCELERATIONS = {"accelerations, random states", "accelerations, SymPy's equations"}
OUTPUTS = {"momenta, energy, outputs, random states"}
POINTWISE_ENERGY = "energy: dh/dt - power, every point"
LITTLE = Rational(1001, 1000)
"""A change by a thousandth: too small to be seen in a plot."""

BRISTLES = """
[mechanism]
name = "bristles"
[coordinates]
x = { start = 0.0 }
[definitions]
most = "(1 + 0.5*exp(-(x_dot/1e-3)**2))/1e4"
bends = "x_dot - abs(x_dot)*z/most"
[energy]
kinetic = "x_dot**2/2"
potential = "(x - 0.01*t)**2"
[forces]
x = "-1e4*z - bends - 0.4*x_dot"
[states.z]
start = 0.0
derivative = "bends"
"""
"""LuGre's friction: a block of 1 kg that a spring pulls at 1 cm/s."""


def failed(report: Report) -> set[str]:
    """The names of the checks that failed, those of trajectories without their steps."""
    return {check.name.split(", CVode")[0].split(", step")[0] for check in report.checks if not check.passed}


def compared(exported, model: str, mechanism: Mechanism, **settings) -> Report:
    """The FMU of ``model`` as it is, against another mechanism."""
    return validate_fmu(mechanism, exported(model).path, stop_time=5.0, **settings)


def test_the_untouched_mechanism_passes(exported) -> None:
    report = compared(exported, "cart_pole", load("cart_pole"))
    assert failed(report) == set()
    assert len(report.checks) == 1 + 4 + 2 + 1 + 3 + 1


@pytest.mark.parametrize("name", ["M", "m", "l", "g"])
def test_another_value_of_a_parameter(name: str, exported) -> None:
    """The equations are the same: only what starts from the declared values can differ."""
    mechanism = load("cart_pole")
    value = next(p.value for p in mechanism.parameters if p.name == name)
    report = compared(exported, "cart_pole", with_values(mechanism, {name: 1.001 * value}))
    assert failed(report) & TRAJECTORIES == TRAJECTORIES
    assert not failed(report) & (ACCELERATIONS | OUTPUTS)


@pytest.mark.parametrize("name", ["theta", "theta_dot", "x_dot"])
def test_another_start(name: str, exported) -> None:
    mechanism = load("cart_pole")
    start = {"theta": 0.5005}.get(name, 1e-3)
    found = failed(compared(exported, "cart_pole", with_values(mechanism, {name: start})))
    assert found & TRAJECTORIES == TRAJECTORIES
    assert not found & (ACCELERATIONS | OUTPUTS | {POINTWISE_ENERGY})


def test_another_stiffness_in_the_equations(exported) -> None:
    mechanism = load("slides_problem_3")
    springs = [replace(spring, stiffness=LITTLE * spring.stiffness) for spring in mechanism.springs]
    found = failed(compared(exported, "slides_problem_3", replace(mechanism, springs=springs)))
    assert found == TRAJECTORIES | ACCELERATIONS | OUTPUTS | {POINTWISE_ENERGY}


def test_another_inertia_in_the_equations(exported) -> None:
    mechanism = load("slides_problem_3")
    bodies = [replace(body, inertia=LITTLE * body.inertia) if body.inertia else body for body in mechanism.bodies]
    found = failed(compared(exported, "slides_problem_3", replace(mechanism, bodies=bodies)))
    assert found >= TRAJECTORIES | ACCELERATIONS | OUTPUTS | {POINTWISE_ENERGY}


def test_another_damping_in_the_equations(exported) -> None:
    """Forces without a potential leave momenta and energy alone."""
    mechanism = load("cart_pole")
    dampers = [replace(damper, damping=LITTLE * damper.damping) for damper in mechanism.dampers]
    found = failed(compared(exported, "cart_pole", replace(mechanism, dampers=dampers)))
    assert found >= ACCELERATIONS | {POINTWISE_ENERGY}
    assert not found & OUTPUTS


def test_another_output(exported) -> None:
    mechanism = load("cart_pole")
    outputs = [replace(output, expression=LITTLE * output.expression) for output in mechanism.outputs]
    assert failed(compared(exported, "cart_pole", replace(mechanism, outputs=outputs))) == OUTPUTS


def test_a_force_of_the_wrong_sign(exported) -> None:
    """It shows at random states although no force acts during the run."""
    mechanism = load("cart_pole")
    loads = [replace(item, force=tuple(-f for f in item.force)) for item in mechanism.loads]
    assert failed(compared(exported, "cart_pole", replace(mechanism, loads=loads))) == ACCELERATIONS


def test_a_dependent_parameter_of_another_factor(exported) -> None:
    mechanism = load("cart_pole")
    parameters = [
        p if p.expression is None else replace(p, expression=LITTLE * p.expression) for p in mechanism.parameters
    ]
    found = failed(compared(exported, "cart_pole", replace(mechanism, parameters=parameters)))
    assert found >= ACCELERATIONS | OUTPUTS | {POINTWISE_ENERGY}


def test_a_support_of_another_frequency(exported) -> None:
    mechanism = load("vertically_driven_pendulum")
    found = failed(compared(exported, "vertically_driven_pendulum", with_values(mechanism, {"Omega": 10.01})))
    assert found >= TRAJECTORIES | {POINTWISE_ENERGY}


# ------------------------------------------------------------------------------------------- right models that pass


def test_inputs_with_a_start_are_no_error(exported) -> None:
    """A pushed mass: its momentum is conserved without a push only; d/dt p_x = F, and p_y stays."""
    x, y, F = coordinate("x", "m", start=1.0), coordinate("y", "m", velocity=2.0), signal("F", "N", start=3.0)
    pushed = Mechanism("pushed", coordinates=[x, y], inputs=[F], bodies=[Body("mass", 1.5, (x, y))], forces={x: F})
    report = lag2fmu.validate(exported(pushed), stop_time=2.0)
    assert report.passed, str(report)
    assert [c.name for c in report.checks if c.name.startswith("conserved")] == [
        "conserved: p_y",
    ]


def test_random_states_stay_where_the_mechanism_is_meant(exported) -> None:
    """A rope of 20 m, between 15 and 30 m; the potential has a cube root without a value below 10 m."""
    theta = coordinate("theta", "rad", start=0.3, minimum=0.25, maximum=1.0)
    rope = signal("l", "m", motion=True, start=20.0, minimum=15.0, maximum=30.0)
    bob = Body("bob", 2.0, (rope * sin(theta), -rope * cos(theta)))
    energy = Energy(potential=(rope - 10) ** Rational(1, 3) * theta**2)
    crane = Mechanism("crane", coordinates=[theta], inputs=[rope], bodies=[bob], gravity=9.81, energy=energy)
    report = lag2fmu.validate(exported(crane), stop_time=0.1)
    assert report.passed, str(report)


def test_random_states_stay_within_bounds_that_the_motion_leaves(exported) -> None:
    """A bob on a rod swings from x = 0.6 m beyond -0.5 m; constraints lead out of the bounds as well."""
    x, y = coordinate("x", "m", start=0.6, minimum=-0.5, maximum=0.6), coordinate("y", "m", start=-0.8)
    bob = Body("bob", 1.0, (x, y))
    mechanism = Mechanism("bob", coordinates=[x, y], bodies=[bob], gravity=9.81,
                          constraints=[Constraint("rod", x**2 + y**2 - 1)])  # fmt: skip
    report = lag2fmu.validate(exported(mechanism), stop_time=2.0)
    assert report.passed, str(report)


def test_ill_conditioned_equations_are_compared_as_well_as_they_are_known(exported) -> None:
    """Of two masses of 1 and 1e-9 kg in one sum: rounding alone moves the accelerations by more than 1e-10."""
    a, b = coordinate("a", "m", start=0.1), coordinate("b", "m", start=0.2)
    bodies = [Body("heavy", 1.0, (a + b, 0)), Body("light", 1e-9, (a - b, 0))]
    energy = Energy(potential=a**2 * b**2 / 2 + (a + b) ** 2)
    pair = Mechanism("pair", coordinates=[a, b], bodies=bodies, energy=energy)
    checks = {c.name: c for c in lag2fmu.validate(exported(pair), stop_time=1e-6).checks}
    check = checks["accelerations, random states"]
    assert check.passed
    assert check.bar > 1e-10


def test_what_fails_says_where(exported) -> None:
    mechanism = load("cart_pole")
    outputs = [replace(output, expression=LITTLE * output.expression) for output in mechanism.outputs]
    report = compared(exported, "cart_pole", replace(mechanism, outputs=outputs))
    (detail,) = [check.detail for check in report.checks if not check.passed]
    assert detail in {"largest difference: x_tip", "largest difference: y_tip"}


# ------------------------------------------------------------------------------------------------------------- chaos


def test_a_comparison_that_did_not_happen_is_not_ok(exported) -> None:
    """Errors that grow by 1e5 at once leave nothing to compare at a tolerance of 1e-6."""
    mechanism = load("pendulum")
    task = Task(mechanism, exported("pendulum").path, 2.0, 1e-6, None)
    reference = integrate(mechanism, task.grid(0.01))
    assert not list(extent_check(task, reference))
    wild = replace(reference, amplification=np.where(reference.trajectory.time > 0, 1e5, 1.0))
    (check,) = extent_check(task, wild)
    assert not check.passed
    assert "comparison ends at t = 0 s" in check.detail
    assert "sharper --tolerance" in check.detail


def test_a_fast_vibration_is_no_chaos() -> None:
    """1 mm at 1000 rad/s: x = 1e-3 cos(1000 t) neither grows nor shrinks, whatever its nominal value is."""
    x = coordinate("x", "m", start=1e-3)
    fast = Mechanism("fast", coordinates=[x], energy=Energy(kinetic=x.dot**2 / 2, potential=1e6 * x**2 / 2))
    times = np.linspace(0, 0.05, 501)
    reference = integrate(fast, times, rtol=1e-9)
    assert reference.trajectory["x"] == pytest.approx(1e-3 * np.cos(1000 * times), abs=1e-8)
    assert reference.amplification.max() < 2


def test_a_long_vibration_adds_errors_for_every_radian() -> None:
    x = coordinate("x", "m", start=1.0)
    slow = Mechanism("slow", coordinates=[x], energy=Energy(kinetic=x.dot**2 / 2, potential=x**2 / 2))
    reference = integrate(slow, np.linspace(0, 400, 4001), rtol=1e-8)
    turned = np.hypot(1.0, np.cos(2) / np.cos(1))  # the greatest displacement of the perturbed start, in its first one
    assert reference.growth[-1] == pytest.approx(4 * turned, rel=0.05)  # 400 radians
    assert reference.growth[100] < 2


@pytest.mark.slow
def test_a_chaotic_motion_is_compared_as_long_as_that_means_something(tmp_path) -> None:
    wild = {"theta1": 2.6, "theta2": 2.9}
    report = lag2fmu.validate("double_pendulum", values=wild, stop_time=10.0)
    assert report.passed, str(report)
    assert any(check.name.startswith("co-simulation in windows") for check in report.checks)
    (note,) = [note for note in report.notes if "Errors may grow" in note]
    horizon = float(note.split("t = ")[1].split()[0])
    assert 1.0 < horizon < 6.0
    direct = report.trajectories["direct integration"]
    run = report.trajectories["co-simulation, step 0.01 s"]
    difference = np.abs(run["theta1"] - direct.interpolated(run.time)["theta1"])
    assert difference[run.time < horizon].max() < 1e-2
    assert difference.max() > 0.5, "afterwards the motions have nothing in common"


def test_the_rest_of_a_chaotic_run_is_compared_in_windows(exported) -> None:
    """A torque that acts from t = 4 s on, long after the horizon, is found."""
    wild = with_values(load("double_pendulum"), {"theta1": 2.6, "theta2": 2.9})
    law = sin(symbols("theta1", real=True)) / 50 * (1 + tanh(20 * (TIME - 4))) / 2
    late = replace(wild, strict_units=False, forces=(Force("theta1", law),))
    found = validate_fmu(late, exported(wild).path, stop_time=6.0)
    rows = {check.name: check for check in found.checks}
    assert all(rows[name].passed for name in rows if name.startswith("co-simulation, step"))
    assert not rows["co-simulation in windows, step 0.01 s"].passed
    (note,) = [note for note in found.notes if "Errors may grow" in note]
    assert float(note.split("t = ")[1].split()[0]) < 3.0
    assert float(note.split("%")[0].split()[-1]) > 90


def test_an_fmu_that_is_exact_enough_anyway_is_compared_at_a_sharper_tolerance() -> None:
    """LuGre's bristles multiply errors by 140 in the first step, which asks for a sharper tolerance.

    Communication steps are short enough for both: the FMU does the same, and its run was not compared at all.
    """
    report = lag2fmu.validate(read(BRISTLES, "bristles.toml"), stop_time=0.5)
    assert report.passed, str(report)
    assert [check.name for check in report.checks if "at tolerance" in check.name]


@pytest.mark.slow
def test_the_horizon_grows_with_the_accuracy() -> None:
    wild = {"theta1": 2.6, "theta2": 2.9}
    horizons = []
    for tolerance in (1e-5, 1e-8):
        report = lag2fmu.validate("double_pendulum", values=wild, stop_time=8.0, tolerance=tolerance)
        assert report.passed, str(report)
        notes = [note for note in report.notes if "Errors may grow" in note]
        horizons.append(float(notes[0].split("t = ")[1].split()[0]) if notes else 8.0)
    assert horizons[0] < horizons[1]


# ------------------------------------------------------------------------------------------------------------ inputs


def test_inputs_drive_both_sides(exported) -> None:
    times = np.linspace(0.0, 0.6, 13)
    inputs = Trajectory.of(times, {"F": 3 * np.sin(4 * times), "Q_theta": 0.2 * np.cos(7 * times)})
    report = lag2fmu.validate(exported("cart_pole"), stop_time=0.6, inputs=inputs)
    assert report.passed, str(report)
    without = lag2fmu.simulate(exported("cart_pole"), stop_time=0.6)
    ends = {label: run["x"][-1] for label, run in report.trajectories.items()}
    assert all(abs(end - without["x"][-1]) > 0.05 for end in ends.values()), "the inputs act"
    assert np.ptp(list(ends.values())) < 1e-5, "linear inputs are the same whatever the communication step is"
    report = lag2fmu.validate(exported("cart_pole"), stop_time=0.6, inputs=inputs, hold=True)
    assert report.passed, str(report)
    ends = {label: run["x"][-1] for label, run in report.trajectories.items()}
    held = [ends[label] for label in ends if label.startswith("co-simulation")]
    assert len({round(end, 9) for end in held}) == 3, "inputs held longer are other inputs"


def test_motion_inputs_drive_both_sides(exported) -> None:
    times = np.linspace(0.0, 0.6, 61)
    columns = {"y0": 0.1 * np.sin(5 * times), "y0_dot": 0.5 * np.cos(5 * times), "y0_ddot": -2.5 * np.sin(5 * times)}
    inputs = Trajectory.of(times, columns)
    report = lag2fmu.validate(exported("motion_driven_pendulum"), stop_time=0.6, inputs=inputs, hold=True)
    assert report.passed, str(report)
    names = [check.name for check in report.checks if check.name.startswith("energy")]
    assert names == [POINTWISE_ENERGY], "motions that are held jump, and the energy with them"


def test_a_motion_by_position_alone_drives_both_sides(exported) -> None:
    times = np.linspace(0.0, 0.6, 61)
    inputs = Trajectory.of(times, {"y0": 0.1 * np.sin(5 * times)})
    shares: list[float] = []
    report = lag2fmu.validate(exported("motion_driven_pendulum"), stop_time=0.6, inputs=inputs, progress=shares.append)
    assert report.passed, str(report)
    assert len([check for check in report.checks if check.name.startswith("energy")]) == 2, "a smooth motion"
    assert shares == sorted(shares)
    assert 0.4 < shares[-1] <= 1.0


def test_other_inputs_on_the_two_sides_would_show(exported, monkeypatch) -> None:
    """The reference with inputs of the last step, as if the FMU took them one step late."""
    module = sys.modules["lag2fmu.verify.task"]
    original = module.held
    times = np.linspace(0.0, 0.6, 13)
    late = lambda run, m: original(Trajectory(run.time, run.names, np.roll(run.values, 1, axis=0)), m)  # noqa: E731
    monkeypatch.setattr(module, "held", late)
    inputs = Trajectory.of(times, {"F": 3 * np.sin(4 * times)})
    report = lag2fmu.validate(exported("cart_pole"), stop_time=0.6, inputs=inputs, hold=True)
    assert failed(report) >= TRAJECTORIES


# ------------------------------------------------------------------------------------------------------------ errors


def gear(gap: str, stiffness: float) -> Mechanism:
    """Two wheels with backlash of 0.01 rad, smooth to 1e-4 rad; the flanks deflect by ``gap``; N m/rad."""
    a, c = coordinate("a", "rad", velocity=3.0), coordinate("c", "rad")
    d, b, w = a - c, Rational(1, 100), Rational(1, 10000)
    deflection = sympify(gap, {"d": d, "b": b, "w": w})
    torque = stiffness * deflection + (a.dot - c.dot) / 100
    kinetic = (a.dot**2 + 2 * c.dot**2) / 200
    energy, experiment = Energy(kinetic=kinetic), Experiment(0.2, 0.01)
    return Mechanism("gear", coordinates=[a, c], energy=energy, forces={a: -torque, c: torque}, experiment=experiment)


def test_stiff_smooth_backlash_is_compared_where_it_can_be() -> None:
    """CVode takes more steps to an output than fmpy allows by default."""
    report = lag2fmu.validate(gear("d + (sqrt((d - b)**2 + w**2) - sqrt((d + b)**2 + w**2))/2", 1e6))
    assert report.passed, str(report)
    (chaotic,) = (note for note in report.notes if "Errors may grow" in note)
    assert "a communication step of 0.1 s not at all" in chaotic
    rows = {check.name: check for check in report.checks}
    assert "co-simulation, step 0.1 s" not in rows, "nothing but the start could be compared"
    assert rows["co-simulation, step 0.002 s"].value > 0


def test_random_states_are_those_where_the_equations_are_defined() -> None:
    """exp overflows 0.08 rad beside the motion."""
    report = lag2fmu.validate(gear("w*(log(1 + exp((d - b)/w)) - log(1 + exp((-d - b)/w)))", 1e4))
    assert report.passed, str(report)


def test_dry_friction_is_named_with_a_remedy() -> None:
    """A mass that sticks at 0.2 m: nothing passes the jump of the force, which the FMU says before anyone waits."""
    x = coordinate("x", "m", start=1.0)
    friction = Mechanism(
        "friction",
        coordinates=[x],
        bodies=[Body("mass", 1.0, (x, 0))],
        energy=Energy(potential=5 * x**2),
        forces={x: -2 * sign(x.dot)},
    )
    with pytest.raises(SimulationError, match=r"where x_dot is 0 from both sides.*\[frictions\].* tanh\(s/width\)"):
        lag2fmu.validate(friction)


def test_forces_that_begin_with_the_run_are_compared(exported) -> None:
    """At t = 0 their jumps are behind, in the FMU as in the direct integration, also if rounding hides them."""
    x = coordinate("x", "m")
    pulses = sign(cos(500 * TIME - 1) - cos(1))
    begins = {x: 2 * Heaviside(TIME) + sign(TIME) + pulses}
    pushed = Mechanism("pushed", coordinates=[x], bodies=[Body("mass", 1.0, (x, 0))], forces=begins)
    task = Task(pushed, exported(pushed).path, 1.0, 1e-6, None)
    checks = pointwise_checks(task, integrate(pushed, np.linspace(0.0, 1.0, 11)))
    assert all(check.passed for check in checks), checks


@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
def test_kinks_turn_at_random_states(fmi: str, exported) -> None:
    """A spring that only pushes, compared on both sides of where it lets go."""
    x = coordinate("x", "m", velocity=1.0)
    springs = [Spring("buffer", 20.0, elongation=Min(0, x - Rational(1, 2)))]
    pushed = Mechanism("buffered", coordinates=[x], bodies=[Body("mass", 1.0, (x, 0))], springs=springs)
    task = Task(pushed, exported(pushed, fmi=fmi).path, 1.0, 1e-6, None)
    checks = pointwise_checks(task, integrate(pushed, np.linspace(0.0, 1.0, 11)))
    assert all(check.passed for check in checks), checks


def test_an_fmu_without_a_mechanism(tmp_path) -> None:
    other = tmp_path / "other.fmu"
    other.write_bytes(b"PK")
    with pytest.raises(ExportError, match="is it an FMU of lag2fmu"):
        lag2fmu.validate(other)


def test_values_that_do_not_exist() -> None:
    with pytest.raises(LoadError, match="'theta9'"):
        lag2fmu.validate("double_pendulum", values={"theta9": 1.0})
    with pytest.raises((LoadError, MechanismError), match="l0"):
        lag2fmu.validate("elastic_pendulum", values={"l0": -1.0})
    with pytest.raises(ExportError, match="an FMU: values= and fmi= belong to its export"):
        lag2fmu.validate("any.fmu", values={"l0": 1.0})


def test_the_report_says_what_was_compared(exported) -> None:
    report = lag2fmu.validate(exported("pendulum"), stop_time=1.0, tolerance=1e-8)
    assert report.title == "Mathematical pendulum: FMU against direct integration, 1 s, tolerance 1e-08"
    assert report.coordinates == ("theta",)
    assert list(report.trajectories) == [
        "direct integration",
        "co-simulation, step 0.1 s",
        "co-simulation, step 0.01 s",
        "co-simulation, step 0.002 s",
        "model exchange, CVode of fmpy",
    ]
    bars = {check.name: check.bar for check in report.checks}
    assert bars["co-simulation, step 0.1 s"] == pytest.approx(100 * 1e-8)
    assert all(np.isfinite(check.value) for check in report.checks)


def test_a_short_pulse_is_in_the_direct_integration() -> None:
    """A force of 1 N on 1 kg from 5 s to 5.1 s: the velocity is 0.1 m/s then."""
    x = coordinate("x", "m")
    force = {x: Heaviside(TIME - 5) - Heaviside(TIME - Rational(51, 10))}
    pulse = Mechanism("pulse", coordinates=[x], energy=Energy(kinetic=x.dot**2 / 2), forces=force)
    found = integrate(pulse, [0.0, 10.0], rtol=1e-8).trajectory
    assert found["x_dot"][-1] == pytest.approx(0.1, rel=1e-5)


def test_a_very_short_run_is_compared() -> None:
    """Times are told apart by the steps of the run, not by a part of a second."""
    reference = integrate(load("cart_pole"), np.linspace(0.0, 1e-8, 101))
    assert on_grid(reference, np.linspace(0.0, 1e-8, 11)).tolist() == list(range(0, 101, 10))
    with pytest.raises(SimulationError, match="are not those"):
        on_grid(reference, np.array([0.0, 5.5e-10]))


@pytest.mark.parametrize("jump", [sign(TIME), Heaviside(TIME - 1)])
def test_a_force_that_jumps_at_a_point_of_the_run_has_either_value_there(tmp_path, jump) -> None:
    x = coordinate("x", "m", start=0.3, velocity=0.5)
    pushed = Mechanism("pushed", coordinates=[x], bodies=[Body("b", 1, (x, 0))], forces=[Force(x, jump - x)])
    path = lag2fmu.export(pushed, tmp_path / "pushed.fmu").path
    assert POINTWISE_ENERGY not in failed(validate_fmu(pushed, path, stop_time=2.0))
    stronger = replace(pushed, forces=[Force(x, LITTLE * jump - x)])
    assert POINTWISE_ENERGY in failed(validate_fmu(stronger, path, stop_time=2.0))
