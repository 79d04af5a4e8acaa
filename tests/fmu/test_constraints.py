"""FMUs of mechanisms with constraints: starts that are solved for, derivatives, motions, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from math import asin, cos, sin, sqrt
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from scipy.integrate import solve_ivp
from stepping import ERROR, Stepping

from lag2fmu import export
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Mechanism

pytestmark = pytest.mark.fmu

SLIDER_CRANK = """
[mechanism]
name = "crank_and_slider"
[parameters]
m = { value = 1.5, unit = "kg" }
l1 = { value = 1.0, unit = "m" }
l2 = { value = 2.0, unit = "m" }
g = { value = 9.81, unit = "m/s2" }
[coordinates]
a = { unit = "rad", start = 0.5, velocity = 1.0 }
b = { unit = "rad", guess = -0.2 }
x = { unit = "m", guess = 2.5 }
[inputs]
F = { unit = "N" }
[gravity]
acceleration = "g"
[bodies.crank]
mass = "m"
inertia = "m*l1**2/12"
position = ["l1/2*cos(a)", "l1/2*sin(a)"]
angle = "a"
[bodies.rod]
mass = "m"
inertia = "m*l2**2/12"
position = ["l1*cos(a) + l2/2*cos(b)", "l1*sin(a) + l2/2*sin(b)"]
angle = "b"
[bodies.slider]
mass = "m"
position = ["x", 0]
[forces]
x = "F"
[constraints.holonomic]
loop_x = "l1*cos(a) + l2*cos(b) - x"
loop_y = "l1*sin(a) + l2*sin(b)"
[outputs]
push = { expression = "-multiplier_loop_x", unit = "N", doc = "what the rod pushes the slider with" }
"""

MOVED = """
[mechanism]
name = "bead_on_a_moved_wire"
[parameters]
m = { value = 0.5, unit = "kg" }
g = { value = 9.81, unit = "m/s2" }
[coordinates]
x = { unit = "m", start = 0.3, velocity = 0.0 }
y = { unit = "m" }
[inputs]
h = { unit = "m", motion = true }
[gravity]
acceleration = "g"
[bodies.bead]
mass = "m"
position = ["x", "y"]
[constraints.holonomic]
wire = "y - h - x**2/2"
"""

SKATE = """
[mechanism]
name = "skate"
[parameters]
m = { value = 1.0, unit = "kg" }
J = { value = 0.2, unit = "kg.m2" }
a = { value = 0.3, unit = "m" }
[coordinates]
x = { unit = "m", start = 0 }
y = { unit = "m", start = 0 }
phi = { unit = "rad", start = 0.2, velocity = 1.0 }
[inputs]
F = { unit = "N" }
[bodies.sled]
mass = "m"
inertia = "J"
position = ["x + a*cos(phi)", "y + a*sin(phi)"]
angle = "phi"
[forces]
x = "F"
[constraints.nonholonomic]
blade = "-x_dot*sin(phi) + y_dot*cos(phi)"
"""

TUMBLING = """
[mechanism]
name = "tumbling"
[parameters]
m = { value = 2.0, unit = "kg" }
[coordinates]
x = { unit = "m" }
e0 = { start = 1, velocity = 0 }
e1 = { start = 0, velocity = 0.1 }
e2 = { start = 0, velocity = 1 }
e3 = { start = 0, velocity = -0.3 }
[frames.body]
origin = ["x", 0, 0]
quaternion = ["e0", "e1", "e2", "e3"]
[bodies.block]
frame = "body"
center = [0.1, 0, 0]
mass = "m"
inertia = [1, 2, 2.5, 0.1, 0, 0]
"""

PARALLELOGRAM = """
[mechanism]
name = "parallelogram"
[parameters]
m = { value = 1.0, unit = "kg" }
l = { value = 1.0, unit = "m" }
d = { value = 0.8, unit = "m" }
g = { value = 9.81, unit = "m/s2" }
[coordinates]
a = { unit = "rad", start = 0.5 }
b = { unit = "rad", guess = 0.4 }
c = { unit = "rad", guess = 0.6 }
x = { unit = "m", guess = 1.2 }
y = { unit = "m", guess = -0.8 }
theta = { unit = "rad", guess = 0.1 }
[gravity]
acceleration = "g"
[bodies.platform]
mass = "m"
inertia = "m*d**2/12"
position = ["x", "y"]
angle = "theta"
[bodies.A]
mass = "m"
position = ["l/2*sin(a)", "-l/2*cos(a)"]
[bodies.B]
mass = "m"
position = ["d + l/2*sin(b)", "-l/2*cos(b)"]
[bodies.C]
mass = "m"
position = ["2*d + l/2*sin(c)", "-l/2*cos(c)"]
[constraints.holonomic]
ax = "l*sin(a) - x + d*cos(theta)"
ay = "-l*cos(a) - y + d*sin(theta)"
bx = "d + l*sin(b) - x"
by = "-l*cos(b) - y"
cx = "2*d + l*sin(c) - x - d*cos(theta)"
cy = "-l*cos(c) - y - d*sin(theta)"
"""

FOLDED = """
[mechanism]
name = "parallelogram_in_line"
[parameters]
m = { value = 1.0, unit = "kg" }
l = { value = 1.0, unit = "m" }
d = { value = 2.0, unit = "m" }
J = { value = 0.1, unit = "kg*m^2" }
g = { value = 9.81, unit = "m/s2" }
[coordinates]
a = { unit = "rad", start = 0.0, velocity = 1.3 }
b = { unit = "rad", start = 0.0, velocity = 0.0 }
c = { unit = "rad", start = 0.0, velocity = 1.3 }
[gravity]
acceleration = "g"
[bodies.crank]
mass = "m"
inertia = "J"
position = ["l/2*cos(a)", "l/2*sin(a)"]
angle = "a"
[bodies.coupler]
mass = "m"
inertia = "J"
position = ["l*cos(a) + d/2*cos(b)", "l*sin(a) + d/2*sin(b)"]
angle = "b"
[bodies.rocker]
mass = "m"
inertia = "J"
position = ["d + l/2*cos(c)", "l/2*sin(c)"]
angle = "c"
[constraints.holonomic]
loop_x = "l*cos(a) + d*cos(b) - l*cos(c) - d"
loop_y = "l*sin(a) + d*sin(b) - l*sin(c)"
"""

LIGHT_ROTOR = """
[mechanism]
name = "light_rotor_on_a_heavy_carriage"
[parameters]
M = { value = 1e8, unit = "kg" }
k = { value = 1e8, unit = "N/m" }
m = { value = 1e-8, unit = "kg" }
J = { value = 1e-12, unit = "kg*m2" }
[coordinates]
x = { unit = "m", start = 0.1 }
e0 = { unit = "1", start = 1.0 }
e1 = { unit = "1", start = 0.0, velocity = 0.5 }
e2 = { unit = "1", start = 0.0, velocity = 0.1 }
e3 = { unit = "1", start = 0.0, velocity = 0.2 }
[energy]
kinetic = "M*x_dot**2/2"
potential = "k*x**2/2"
[frames.rotor]
parent = "world"
origin = ["x", "0", "0"]
quaternion = ["e0", "e1", "e2", "e3"]
[bodies.rotor]
frame = "rotor"
center = ["0", "0", "0"]
mass = "m"
inertia = ["J", "2*J", "2.5*J", "0", "0", "0"]
"""

TEXTS = {"slider": SLIDER_CRANK, "moved": MOVED, "skate": SKATE, "tumbling": TUMBLING, "parallel": PARALLELOGRAM}


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """``fmu(name)``: the FMU of a mechanism of TEXTS, with everything as output, built once."""
    folder, built = tmp_path_factory.mktemp("constrained"), {}

    def build(name: str) -> Path:
        if name not in built:
            mechanism = read(TEXTS[name], name)
            built[name] = export(mechanism, folder / f"{name}.fmu", outputs=["all"]).path
        return built[name]

    return build


@pytest.fixture(scope="module")
def folded() -> Mechanism:
    """A parallelogram whose links lie in one line at the start."""
    return read(FOLDED, "folded")


# ------------------------------------------------------------------------------------------------------------- starts


def closed(a: float, l1: float = 1.0, l2: float = 2.0) -> tuple[float, float]:
    """b and x of the slider-crank for the crank angle a."""
    b = -asin(l1 * sin(a) / l2)
    return b, l1 * cos(a) + l2 * cos(b)


def test_guesses_are_solved_before_anything_is_asked(fmu) -> None:
    with Stepping(fmu("slider")) as s:
        assert s.get(["b", "x"]) == pytest.approx(closed(0.5), abs=1e-14)
        s.unit.setupExperiment(startTime=0.0)
        s.unit.enterInitializationMode()
        for a, l2 in ((1.1, 2.0), (2.5, 2.0), (2.5, 1.7)):
            s.set({"a": a, "l2": l2})
            assert s.get(["b", "x"]) == pytest.approx(closed(a, l2=l2), abs=1e-12)
        rates = s.get(["a_dot", "b_dot", "x_dot"])
        b, _ = closed(2.5, l2=1.7)
        b_dot = -cos(2.5) / (1.7 * cos(b))
        assert rates == pytest.approx([1.0, b_dot, -sin(2.5) - 1.7 * sin(b) * b_dot], abs=1e-12)
        s.unit.exitInitializationMode()
        assert s.get(["residual_loop_x", "residual_loop_y"]) == pytest.approx([0, 0], abs=1e-12)


def test_the_branch_of_the_guess_is_taken(fmu) -> None:
    with Stepping(fmu("slider")) as s:
        s.start({"b": 3.4, "x": -1.5})
        b, x = s.get(["b", "x"])
        assert (b, x) == pytest.approx((np.pi - closed(0.5)[0], cos(0.5) - sqrt(4 - sin(0.5) ** 2)), abs=1e-12)


def test_starts_that_cannot_be_met_are_refused_with_the_residuals(fmu) -> None:
    with Stepping(fmu("slider")) as s:
        with pytest.raises(Exception, match="fmi2ExitInitializationMode"):
            s.start({"l2": 0.3})
        assert s.log[-1][0] == ERROR
        assert "meet the constraints; residuals: loop_x = " in s.log[-1][2]
        s.unit.reset()
        s.start()
        assert s.get(["b"]) == pytest.approx(closed(0.5)[:1], abs=1e-14)


def test_given_starts_are_moved_a_little_or_not_at_all(fmu) -> None:
    with Stepping(fmu("tumbling")) as s:
        s.start({"e0": 1 + 1e-8})
        assert s.get(["e0"]) == pytest.approx([1.0], abs=1e-12)
        assert any("missed the constraints by little and were moved, furthest e0" in text for *_, text in s.log)
        s.unit.reset()
        with pytest.raises(Exception, match="fmi2ExitInitializationMode"):
            s.start({"e0": 1.01})
        assert "residuals: body_norm = 0.0201" in s.log[-1][2]


def test_parameters_in_a_constraint_are_fixed(fmu) -> None:
    with Stepping(fmu("slider")) as s:
        variability = {v.name: v.variability for v in s.description.modelVariables}
        assert [variability[name] for name in ("l1", "l2", "m", "g")] == ["fixed", "fixed", "tunable", "tunable"]
        s.start()
        s.set({"m": 1.0})
        with pytest.raises(Exception, match="fmi2SetReal"):
            s.set({"l2": 3.0})
        assert "fixed" in s.log[-1][2]


# ------------------------------------------------------------------------------------------------------------ running


@pytest.mark.parametrize("name", TEXTS)
def test_constraints_hold_at_communication_points(name: str, fmu) -> None:
    with Stepping(fmu(name)) as s:
        residuals = [v for v in s.references if v.startswith("residual_")]
        s.start(tolerance=1e-5)
        for _ in range(20):
            s.step(0.17)
            assert s.get(residuals) == pytest.approx([0.0] * len(residuals), abs=1e-10)


def test_a_bead_on_a_moved_wire_moves_as_in_its_own_coordinate(fmu) -> None:
    """y = h + x^2/2 put into T and V: (1 + x^2) x_ddot = -x (x_dot^2 + g + h_ddot)."""
    from scipy.integrate import solve_ivp

    def height(t: float) -> list[float]:
        return [0.4 * sin(t) ** 3, 1.2 * sin(t) ** 2 * cos(t), 2.4 * sin(t) * cos(t) ** 2 - 1.2 * sin(t) ** 3]

    def slope(t: float, z: np.ndarray) -> list[float]:
        x, v = z
        return [v, -x * (v**2 + 9.81 + height(t)[2]) / (1 + x**2)]

    truth = solve_ivp(slope, (0, 2), [0.3, 0.0], rtol=1e-12, atol=1e-12).y[0, -1]
    with Stepping(fmu("moved")) as s:
        s.start({"solver_tolerance": 1e-10})
        motion, step = [s.references[name] for name in ("h", "h_dot", "h_ddot")], 1e-3
        for i in range(2000):
            t = i * step
            h, v, a = height(t)
            third = (height(t + 1e-5)[2] - height(t - 1e-5)[2]) / 2e-5
            s.unit.setReal(motion, [h, v, a])
            pairs = [(0, 1, v), (0, 2, a), (0, 3, third), (1, 1, a), (1, 2, third), (2, 1, third)]
            for which, order, value in pairs:
                s.unit.setRealInputDerivatives([motion[which]], [order], [value])
            s.step(step)
        x, y = s.get(["x", "y"])
        assert x == pytest.approx(truth, abs=1e-6)
        assert y - s.get(["h"])[0] == pytest.approx(x**2 / 2, abs=1e-10)


def test_the_crank_moves_as_its_own_equation_says(fmu) -> None:
    """One degree of freedom: 1/2 I(a) a_dot^2 with b(a), x(a) put in, so that h is conserved exactly."""
    m, g = 1.5, 9.81

    def height(a: float) -> float:
        b, _ = closed(a)
        return m * g * (sin(a) / 2 + sin(a) + sin(b))

    def inertia(a: float) -> float:
        b, _ = closed(a)
        rate = -cos(a) / (2 * cos(b))  # db/da
        slider = -sin(a) - 2 * sin(b) * rate
        rod = (-sin(a) - sin(b) * rate) ** 2 + (cos(a) + cos(b) * rate) ** 2
        return m * (1 / 4 + 1 / 12 + rod + 4 * rate**2 / 12 + slider**2)

    energy = inertia(0.5) / 2 + height(0.5)
    with Stepping(fmu("slider")) as s:
        s.start(tolerance=1e-10)
        for _ in range(30):
            s.step(0.1)
            a, a_dot, b, x = s.get(["a", "a_dot", "b", "x"])
            assert (b, x) == pytest.approx(closed(a), abs=1e-11)
            assert inertia(a) * a_dot**2 / 2 + height(a) == pytest.approx(energy, abs=1e-7)


@pytest.mark.parametrize("solver", ["dopri5", "radau5"])
def test_a_start_in_a_fold(solver: str, folded: Mechanism, exported) -> None:
    """All links in one line, where a constraint is lost; by itself the parallelogram is a pendulum that turns about."""
    inertia, weight = 0.2 + 2 * 0.25 + 1.0, 9.81 * 2.0  # of the crank angle, all links taken together
    end = solve_ivp(lambda t, z: (z[1], -weight * cos(z[0]) / inertia), (0, 1), (0.0, 1.3), rtol=1e-11, atol=1e-12)
    for tolerance in (1e-6, 1e-8, 1e-9, 1e-12):
        with Stepping(exported(folded, solver=solver).path) as s:
            s.start(tolerance=tolerance).steps(20, 0.05)  # it comes back through the fold after a third of a second
            a, a_dot = end.y[:, -1]
            found = s.get(["a", "b", "c", "a_dot", "b_dot", "c_dot"])
            assert found == pytest.approx([a, 0.0, a, a_dot, 0.0, a_dot], abs=10 * tolerance + 1e-10)


def test_inertias_may_differ_by_any_factor(exported) -> None:
    """1e20 between carriage and rotor, which tumbles as Euler's equations for a body of unit inertia say."""

    def euler(t: float, z: np.ndarray) -> list[float]:
        (e0, *e), w = z[:4], z[4:]
        e0_dot, e_dot = -np.dot(e, w) / 2, (e0 * w + np.cross(e, w)) / 2  # w in the body's axes
        return [e0_dot, *e_dot, (2 - 2.5) * w[1] * w[2], (2.5 - 1) / 2 * w[2] * w[0], (1 - 2) / 2.5 * w[0] * w[1]]

    start = [1.0, 0.0, 0.0, 0.0, 1.0, 0.2, 0.4]
    truth = solve_ivp(euler, (0, 2), start, method="DOP853", rtol=1e-11, atol=1e-12).y[:4, -1]
    path = exported(read(LIGHT_ROTOR, "light")).path
    for scale in (1.0, 1e-4):
        with Stepping(path) as s:
            s.start({"m": 1e-8 * scale, "J": 1e-12 * scale}, tolerance=1e-9).steps(20, 0.1)
            assert s.get(["x", "e0", "e1", "e2", "e3"]) == pytest.approx([0.1 * cos(2.0), *truth], abs=1e-7)


def test_a_rolled_back_run_repeats_itself(fmu) -> None:
    with Stepping(fmu("parallel")) as s:
        s.start()
        s.steps(3, 0.1)
        state = s.unit.getFMUState()
        first = s.steps(5, 0.07)
        s.unit.setFMUState(state)
        s.time = 0.30000000000000004
        assert s.steps(5, 0.07) == first
        s.unit.freeFMUState(state)


def test_states_that_nobody_reads_are_the_same(fmu) -> None:
    """Interpolation and projection wait until something asks for the states."""
    with Stepping(fmu("parallel")) as read, Stepping(fmu("parallel")) as quiet:
        read.start(tolerance=1e-4)
        quiet.start(tolerance=1e-4)
        for _ in range(60):
            quiet.unit.doStep(read.time, 0.01)
            shown = read.step(0.01)
        assert quiet.get(quiet.states) == shown


def test_model_exchange_stays_on_the_constraints_and_asks_for_help_beyond(fmu) -> None:
    with Stepping(fmu("slider"), "ModelExchange") as s:
        s.start()
        s.set({"x": s.get(["x"])[0] + 1e-9})
        assert s.unit.completedIntegratorStep() == (False, False)
        s.set({"x": s.get(["x"])[0] + 0.05})
        assert s.unit.completedIntegratorStep()[0]
        s.unit.enterEventMode()
        flags = s.unit.newDiscreteStates()
        assert flags[3]  # valuesOfContinuousStatesChanged
        a, b, x = s.get(["a", "b", "x"])
        assert (b, x) == pytest.approx(closed(a), abs=1e-10)
        assert not s.unit.newDiscreteStates()[3]


@pytest.mark.parametrize(("tolerance", "asks"), [(1e-4, False), (1e-10, True)])
def test_the_drift_that_model_exchange_tolerates_follows_solver_tolerance(tolerance: float, asks: bool, fmu) -> None:
    """A thousand times the tolerance, relative to the nominal values."""
    with Stepping(fmu("slider"), "ModelExchange") as s:
        s.start({"solver_tolerance": tolerance}, tolerance=1e-7)
        s.set({"x": s.get(["x"])[0] + 2e-3})
        assert s.unit.completedIntegratorStep() == (asks, False)


# -------------------------------------------------------------------------------------------------------- derivatives


def central(s: Stepping, unknowns: list[str], name: str, h: float = 1e-4) -> np.ndarray:
    """d unknowns / d name by differences of fourth order."""
    (x,) = s.get([name])
    values = []
    for k in (-2, -1, 1, 2):
        s.set({name: x + k * h})
        values.append(np.array(s.get(unknowns)))
    s.set({name: x})
    return (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * h)


@pytest.mark.parametrize("name", TEXTS)
def test_directional_derivatives_go_through_the_constraints(name: str, fmu) -> None:
    with Stepping(fmu(name), "ModelExchange") as s:
        s.start()
        s.set(
            {q: s.get([q])[0] + 1e-5 * i for i, q in enumerate(s.states_of_derivatives, 1)}
        )  # also off the constraints
        # changes of states break the redundancy of constraints, and accelerations then jump; multipliers are not unique
        redundant = name == "parallel"
        unknowns = [v for v in s.references if v.endswith("_ddot") and not v.startswith(("der_", "h_"))]
        unknowns += [] if redundant else [v for v in s.references if v.startswith("multiplier_")]
        inputs = [v.name for v in s.description.modelVariables if v.causality == "input"]
        for known in inputs if redundant else [*s.states_of_derivatives, *inputs]:
            exact, differences = np.array(s.derivative(unknowns, {known: 1.0})), central(s, unknowns, known)
            assert exact == pytest.approx(differences, rel=2e-7, abs=2e-7 * max(1.0, np.abs(exact).max()))


@pytest.mark.parametrize("model", ["bricard", "parallel_manipulator"])
def test_multipliers_of_redundant_constraints_have_the_derivatives_of_least_norm(model: str, exported) -> None:
    """All states and parameters; steps so small that what is redundant stays so."""
    with Stepping(exported(model).path, "ModelExchange") as s:
        s.start()
        unknowns = [v for v in s.references if v.startswith("multiplier_")]
        tunable = [
            v.name for v in s.description.modelVariables if (v.causality, v.variability) == ("parameter", "tunable")
        ]
        for known in [*s.states_of_derivatives, *tunable]:
            exact, differences = np.array(s.derivative(unknowns, {known: 1.0})), central(s, unknowns, known, 1e-6)
            assert np.abs(exact - differences).max() < 1e-6 * max(1.0, np.abs(exact).max()), known


@pytest.mark.parametrize("name", ["slider", "moved"])
def test_directional_derivatives_of_solved_starts(name: str, fmu) -> None:
    knowns = {"slider": ["a", "a_dot", "l1", "l2", "m"], "moved": ["x", "x_dot", "h", "h_dot"]}[name]
    with Stepping(fmu(name)) as s:
        s.unit.setupExperiment(startTime=0.0)
        s.unit.enterInitializationMode()
        unknowns = [v for v in s.references if v.startswith(("b", "y", "multiplier")) or v.endswith("_ddot")]
        unknowns = [v for v in unknowns if not v.startswith(("der_", "h_"))]
        s.get(unknowns)
        for known in knowns:
            exact, differences = np.array(s.derivative(unknowns, {known: 1.0})), central(s, unknowns, known, 1e-3)
            assert exact == pytest.approx(differences, rel=1e-8, abs=1e-8)


@pytest.mark.parametrize("name", ["slider", "skate", "tumbling", "parallel"])
def test_output_derivatives_include_multipliers(name: str, fmu) -> None:
    with Stepping(fmu(name)) as s:
        s.start({"solver_tolerance": 1e-12})
        s.step(0.3)
        outputs = [v.name for v in s.description.modelVariables if v.causality == "output"]
        if name == "parallel":
            outputs = [v for v in outputs if not v.startswith("multiplier_")]  # not unique
        references = [s.references[v] for v in outputs]
        around = []
        state, h = s.unit.getFMUState(), 2e-3
        for k in range(9):
            if k == 4:
                exact = [s.unit.getRealOutputDerivatives(references, [order] * len(outputs)) for order in (1, 2)]
            around.append(s.get(outputs))
            s.step(h)
        s.unit.setFMUState(state)
        s.unit.freeFMUState(state)
        values = np.array(around)
        first = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280]) @ values / h
        weights = [-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560]
        second = np.array(weights) @ values / h**2
        size = np.abs(values).max() + np.abs(first).max()
        assert np.array(exact[0]) == pytest.approx(first, abs=2e-8 * size)
        assert np.array(exact[1]) == pytest.approx(second, abs=2e-6 * size)


@pytest.mark.parametrize(("model", "step"), [("four_bar_linkage", 0.05), ("heavy_top_quaternion", 0.1)])
def test_steps_of_the_importer_that_are_too_long_are_told(model: str, step: float, exported) -> None:
    """Explicit Euler leaves the constraints: not the start is wrong, but the steps are, and shorter ones go through."""
    sentences: list[str] = []
    options = {"solver": "Euler", "fmi_type": "ModelExchange", "validate": False}
    logger = lambda *parts: sentences.append(parts[-1].decode())  # noqa: E731
    path = str(exported(model).path)
    with pytest.raises(FMICallException):
        fmpy.simulate_fmu(path, stop_time=5.0, step_size=step, output_interval=step, logger=logger, **options)
    assert any("its steps are too long: shorten them, take a solver of higher order" in x for x in sentences)
    assert not any("start nearer" in x for x in sentences)
    short = fmpy.simulate_fmu(path, stop_time=0.1, step_size=1e-4, output_interval=0.1, logger=logger, **options)
    assert short["time"][-1] == pytest.approx(0.1)


THREE_RODS = """
[mechanism]
name = "three_rods"
[parameters]
l = { value = 0.4, unit = "m" }
m = { value = 1.0, unit = "kg" }
[coordinates]
a = { unit = "rad", start = 0.6 }
b = { unit = "rad", guess = 0.6 }
c = { unit = "rad", guess = 0.6 }
s = { unit = "rad", guess = 0.0 }
[bodies]
one = { mass = "m", inertia = "m*l**2/12", position = ["l/2*sin(a)", "-l/2*cos(a)"], angle = "a" }
two = { mass = "m", inertia = "m*l**2/12", position = ["l + l/2*sin(b)", "-l/2*cos(b)"], angle = "b" }
three = { mass = "m", inertia = "m*l**2/12", position = ["2*l + l/2*sin(c)", "-l/2*cos(c)"], angle = "c" }
plate = { mass = "m", inertia = "m*l**2/3", position = ["l*sin(a) + l*cos(s)", "-l*cos(a) + l*sin(s)"], angle = "s" }
[gravity]
acceleration = 9.81
[constraints.holonomic]
cx = "l*sin(a) + 2*l*cos(s) - 2*l - l*sin(c)"
cy = "-l*cos(a) + 2*l*sin(s) + l*cos(c)"
bx = "l*sin(a) + l*cos(s) - l - l*sin(b)"
by = "-l*cos(a) + l*sin(s) + l*cos(b)"
"""
"""A plate on three parallel rods moves as a pendulum: 3 m l^2/3 + m l^2 = 2 m l^2, and (3/2 + 1) m g l sin(a)."""


@pytest.mark.parametrize(("tolerance", "bar"), [(1e-5, 5e-3), (1e-6, 5e-4), (1e-8, 1e-5)])
def test_redundant_rows_take_turns(tolerance: float, bar: float, exported) -> None:
    """The rows that are independent at the start are not so where the rods hang, which is a regular position."""
    path = exported(read(THREE_RODS, "three rods")).path
    found = fmpy.simulate_fmu(
        str(path),
        stop_time=3.0,
        output_interval=0.03,
        relative_tolerance=tolerance,
        fmi_type="ModelExchange",
        output=["a", "b"],
    )
    rate = 2.5 * 9.81 / (2.0 * 0.4)
    own = solve_ivp(
        lambda t, y: [y[1], -rate * np.sin(y[0])], (0.0, 3.0), [0.6, 0.0], rtol=1e-11, atol=1e-12, dense_output=True
    )
    assert np.abs(found["a"] - own.sol(found["time"])[0]).max() < bar
    assert np.abs(found["b"] - found["a"]).max() < bar
