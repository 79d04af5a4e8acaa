"""Derivatives through steps of one length: of variational methods, whose steps are implicit, of rk4 and of ros2."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import lag2fmu
from lag2fmu.cli import main
from lag2fmu.errors import LoadError
from lag2fmu.formats.loading import as_mechanism
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Body, Mechanism, Spring, coordinate, parameter
from lag2fmu.reference.trajectory import Floats
from lag2fmu.studies.library import StudyLibrary, compiled
from lag2fmu.studies.requests import scale_of
from lag2fmu.studies.sensitivities import Sensitivities, directed_run
from lag2fmu.studies.tape import Tape

pytestmark = pytest.mark.fmu


def test_the_midpoint_rule_of_an_oscillator_has_a_closed_form() -> None:
    """With z = (x, p) a step is the Cayley transform of h J H; its derivatives are complex steps of that."""
    x, k = coordinate("x", "m", start=0.3, velocity=-0.2), parameter("k", 8.0, "N/m")
    block = Mechanism("block", coordinates=[x], parameters=[k], bodies=[Body("b", 2, (x, 0))],
                      springs=[Spring("s", stiffness=k, elongation=x)])  # fmt: skip
    found = lag2fmu.sensitivities(
        block, over=["k", "x", "x_dot"], outputs=["x", "x_dot"], times=[0.5, 1.0], solver="midpoint",
        values={"solver_step": 0.05},
    )  # fmt: skip

    def moved(steps: int, stiffness: complex, start: complex, speed: complex) -> Floats:
        A = 0.025 * np.array([[0, 1], [-stiffness / 2, 0]])
        step = np.linalg.solve(np.eye(2) - A, np.eye(2) + A)
        moved: Floats = np.linalg.matrix_power(step, steps) @ [start, speed]
        return moved

    for i, varied in enumerate(np.eye(3) * 1e-30j):
        ends = [moved(steps, *(np.array([8.0, 0.3, -0.2]) + varied)) for steps in (10, 20)]
        np.testing.assert_allclose(found.derivatives[:, :, i], np.imag(ends) / 1e-30, rtol=1e-12, atol=1e-13)


def test_linearly_implicit_steps_have_their_second_derivatives() -> None:
    """Steps of ROS2 with the Jacobian of a stiff Duffing oscillator written out, differentiated by complex steps."""
    x, k, c = (
        coordinate("x", "m", start=0.9, velocity=0.5),
        parameter("k", 300.0, "N/m^3"),
        parameter("c", 6.0, "kg*s/m^2"),
    )
    block = Mechanism("block", coordinates=[x], parameters=[k, c], bodies=[Body("b", 2, (x, 0))],
                      forces={x: -k * x**3 - c * x.dot**3})  # fmt: skip
    start = np.array([300.0, 6.0, 0.0, 0.9, 0.5])
    over, h = ["k", "c", "Q_x", "x", "x_dot"], 0.05

    def moved(values: Floats, steps: int) -> Floats:
        k, c, force, *z = values
        state, gamma = np.array(z), 1 - np.sqrt(0.5)

        def rate(z: Floats) -> Floats:
            return np.array([z[1], (force - k * z[0] ** 3 - c * z[1] ** 3) / 2])

        for _ in range(steps):
            jacobian = np.array([[0, 1], [-1.5 * k * state[0] ** 2, -1.5 * c * state[1] ** 2]])
            A = np.eye(2) - gamma * h * jacobian
            k1 = np.linalg.solve(A, rate(state))
            k2 = np.linalg.solve(A, rate(state + h * k1) - 2 * k1)
            state = state + h * (3 * k1 + k2) / 2
        return state

    found = lag2fmu.sensitivities(block, over=over, outputs=["x", "x_dot"], times=[0.5, 2.0], solver="ros2",
                                  values={"solver_step": h})  # fmt: skip
    for i, varied in enumerate(np.eye(5) * 1e-30j):
        expected = np.array([moved(start + varied, steps) for steps in (10, 40)])
        np.testing.assert_allclose(found.values, expected.real, rtol=1e-12)
        np.testing.assert_allclose(found.derivatives[:, :, i], expected.imag / 1e-30, rtol=1e-11, atol=1e-12)


SUPPORTED = read(
    """
[mechanism]
name = "supported"
[parameters]
l = { value = 1.0, unit = "m" }
tau = { value = 50, unit = "ms" }
[inputs]
y0 = { unit = "m", motion = "filtered", time_constant = "tau" }
[coordinates]
theta = { unit = "rad", start = 0.5 }
x = { unit = "m", start = 0.5 }
y = { unit = "m", guess = -0.9 }
[energy]
kinetic = "0.5*(l**2*theta_dot**2 + 2*l*sin(theta)*theta_dot*y0_dot) + 0.5*(x_dot**2 + y_dot**2)"
potential = "9.81*(y - l*cos(theta))"
[constraints.holonomic]
rod = "x**2 + (y - y0)**2 - l**2"
""",
    "supported",
)
"""Two pendulums of 1 kg on a support that moves: its further states are in the momenta of one, the rod of the other."""
CASES: list[tuple[str | Mechanism, str, list[str], float]] = [
    ("cart_pole", "verlet", ["theta", "l", "F"], 0.01),
    ("double_pendulum", "lobatto4", ["theta1", "m2", "l1"], 0.01),
    ("four_bar_linkage", "midpoint", ["a", "a_dot", "l2", "rho"], 0.005),
    ("heavy_top_quaternion", "gauss4", ["m", "A", "C"], 0.002),
    ("parallel_manipulator", "gauss4", ["R", "l1"], 0.0025),  # one of its constraints is redundant
    ("whipple_bicycle", "verlet", ["mB", "phi_dot"], 0.01),  # rolls
    ("dc_motor", "gauss6", ["J", "R"], 0.0025),  # has further states
    (SUPPORTED, "gauss4", ["theta", "l", "y0", "y0_dot"], 0.005),
    (SUPPORTED, "verlet", ["x", "y0", "y0_dot"], 0.005),
    ("impact_oscillator", "gauss4", ["k", "d"], 0.005),
    ("bouncing_ball", "rk4", ["y", "e", "g"], 0.01),
    ("double_pendulum", "ros2", ["theta1", "m2", "l1"], 0.01),
    ("four_bar_linkage", "ros2", ["l2"], 0.005),  # whose projection turns
    ("whipple_bicycle", "ros2", ["mB", "phi_dot"], 0.01),
    ("brake", "ros2", ["l", "mu"], 0.005),  # what rubs bears on itself
    ("coulomb_oscillator", "gauss4", ["x", "k", "F"], 0.005),  # rubs
    ("brake", "lobatto4", ["l", "mu"], 0.005),  # what rubs bears on itself
    ("falling_rod", "gauss4", ["mu", "g"], 0.005),  # and slips
    ("sliding_sphere", "gauss4", ["R"], 0.002),  # rubs in space, and then rolls
]
"""Models, solvers, what varies, and solver steps (s)."""
TIMES = np.linspace(0.0, 1.0, 6)


@pytest.mark.parametrize(("model", "solver", "over", "step"), CASES)
def test_derivatives_are_differences_and_go_back(
    model: str | Mechanism, solver: str, over: list[str], step: float
) -> None:
    """Forward ones against extrapolated central differences of the run, adjoint ones against forward ones."""
    library = compiled(model, solver=solver, adjoints=True)
    mechanism = as_mechanism(model)
    outputs = [name for q in mechanism.coordinates for name in (q.name, f"{q.name}_dot")]
    outputs += [*(z.name for z in mechanism.states), "kinetic_energy"]
    found = directed_run(library, over, outputs, values={"solver_step": step}, times=TIMES, tolerance=1e-8)
    assert not found.reason
    slopes = found.result.derivatives
    for i, name in enumerate(over):
        value = library.variables[name].start or 0.0
        h = 3e-4 * (abs(value) or 1.0)

        def moved(change: float, name: str = name, value: float = value) -> Floats:
            values = {"solver_step": step, name: value + change}
            run = directed_run(library, over, outputs, values=values, times=TIMES, tolerance=1e-8)
            assert not run.reason
            return run.result.values

        near, far = ((moved(d) - moved(-d)) / (2 * d) for d in (h, 2 * h))
        size = abs(slopes[:, :, i]).max()
        np.testing.assert_allclose(slopes[:, :, i], (4 * near - far) / 3, atol=1e-6 * size, rtol=0)
    _compare_adjoints(library, over, outputs, step, slopes)


def _compare_adjoints(library: StudyLibrary, over: list[str], outputs: list[str], step: float, slopes: Floats) -> None:
    """A random weighted sum of all outputs, by the tape."""
    values = {library.settable("solver_step"): step}
    tape = Tape(library, len(over))
    seeds = [(library.settable(name), scale_of(library, name, {})) for name in over]
    _, reason = tape.record(values, TIMES, library.readable(outputs), tolerance=1e-8, seeds=seeds)
    weights = np.random.default_rng(0).standard_normal(slopes.shape[:2])
    back, why = tape.gradient(weights)
    assert [reason, why] == ["", ""]
    terms = weights[:, :, None] * slopes
    np.testing.assert_allclose(back, terms.sum(axis=(0, 1)), rtol=0, atol=1e-9 * abs(terms).sum(axis=(0, 1)).max())


@pytest.mark.parametrize(
    ("model", "solver", "said"),
    [
        (
            "bouncing_ball",
            "moreau",
            "'moreau' carries no derivatives: .* contain impacts.*; take dopri5, dop853, rk4, ros2",
        ),
        ("pendulum", "rk5", "'rk5' is no solver that carries derivatives; known are dopri5"),
    ],
)
def test_what_carries_none_is_told_why(model: str, solver: str, said: str) -> None:
    with pytest.raises(LoadError, match=said):
        lag2fmu.sensitivities(model, over=["m"], solver=solver)


def test_what_a_filter_moves_may_stand_in_momenta_and_constraints() -> None:
    """Steps of gauss4 against dop853, whose constraints are accelerations and projections."""
    inputs = {"time": [0.0, 0.31, 0.7, 1.6], "y0_target": [0.0, 0.1, -0.2, 0.1]}

    def moved(solver: str) -> Floats:
        return lag2fmu.sensitivities(SUPPORTED, over=["l"], outputs=["theta", "x", "y"], times=TIMES, solver=solver,
                                     tolerance=1e-10, values={"solver_step": 0.0025}, inputs=inputs).values  # fmt: skip

    np.testing.assert_allclose(moved("gauss4"), moved("dop853"), rtol=0, atol=3e-8)


def test_fits_by_steps_of_one_length_find_what_another_solver_did(tmp_path: Path) -> None:
    """In Python and by the command line; the data are dop853's, from which these steps of gauss4 are 1e-9 apart."""
    times, true = np.linspace(0, 2, 81), {"m": 0.37, "l": 0.9, "c": 0.15}
    force = {"time": times, "F": 2 * np.sin(3 * times)}
    exact = lag2fmu.sensitivities("cart_pole", over=["m"], outputs=["x", "theta"], times=times, tolerance=1e-12,
                                  values=true, inputs=force)  # fmt: skip
    data = {**force, "x": exact["x"], "theta": exact["theta"]}
    found = lag2fmu.calibrate("cart_pole", data, free=list(true), solver="gauss4", values={"solver_step": 0.005})
    assert {name: found[name] for name in true} == pytest.approx(true, rel=1e-8)
    assert {p.name: p.value for p in found.mechanism.parameters}["l"] == found["l"]

    file, out = tmp_path / "data.csv", tmp_path / "found.toml"
    np.savetxt(file, np.transpose(list(data.values())), "%.17g", ",", header=",".join(data), comments="")
    arguments = ["calibrate", "cart_pole", str(file), "--free", "m,l,c", "--solver", "gauss4", "-o", str(out)]
    done = CliRunner().invoke(main, [*arguments, "--set", "solver_step=0.005"])
    assert done.exit_code == 0, done.output
    values = {p.name: p.value for p in lag2fmu.load(out).parameters}
    assert {name: values[name] for name in true} == pytest.approx(true, rel=1e-8)


def test_a_motion_that_strikes_is_refused() -> None:
    """Momenta go on where a held velocity of the support jumps; where none jumps, the derivative is a difference."""
    knots = np.array([0.0, 0.5, 1.0])
    jumping = {"time": knots, "y0": 0 * knots, "y0_dot": np.array([0.0, 0.3, 0.3]), "y0_ddot": 0 * knots}
    steady = jumping | {"y0_dot": np.full(3, 0.3), "y0_ddot": np.array([0.0, 2.0, 0.0])}
    library = compiled("motion_driven_pendulum", solver="verlet")

    def moved(start: float, inputs: dict[str, Floats]) -> Sensitivities:
        values = {"theta": start, "solver_step": 0.002}
        return directed_run(library, ["theta"], ["theta"], values=values, times=np.array([1.0]), tolerance=1e-8,
                            inputs=inputs, hold=True).result  # fmt: skip

    with pytest.raises(LoadError, match=r"'y0_dot' of .* jumps by 0\.3 \(SI\) at 0\.5 s.*'verlet'.*without hold"):
        moved(0.5, jumping)
    difference = (moved(0.5001, steady)["theta"] - moved(0.4999, steady)["theta"]) / 2e-4
    np.testing.assert_allclose(moved(0.5, steady)["theta", "theta"], difference, rtol=1e-7)
