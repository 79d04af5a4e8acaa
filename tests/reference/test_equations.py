"""Equations against closed forms, SymPy's own equations, finite differences and the balance of energy."""

import numpy as np
import pytest
import sympy as sp
from mechanisms import charged_particle, driven_pendulum, falling, loaded, oscillator, pendulum

from lag2fmu.errors import DerivationError, LoadError, SimulationError
from lag2fmu.formats.loading import load
from lag2fmu.language.expressions import FUNCTIONS
from lag2fmu.mechanism import Body, Constraint, Damper, Energy, Load, Mechanism, Point, Spring, coordinate, parameter
from lag2fmu.reference import Equations, sympy_accelerations
from lag2fmu.reference.energies import EnergyFunctions
from lag2fmu.reference.functions import FEW, STEP, compiled
from models.double_pendulum import double_pendulum

INPUTS = {
    "w": 0.3,
    "w_dot": -0.7,
    "w_ddot": 1.9,
    "push": 2.0,
    "hand": -0.4,
    "free_x": 0.6,
    "free_y": 5.0,
    "Q_theta": 0.9,
}
CASES = {
    "pendulum": (pendulum(), {}),
    "oscillator": (oscillator(), {"Q_x": 1.0}),
    "driven": (driven_pendulum(False), {}),
    "motion": (driven_pendulum(True), {"y0": 0.2, "y0_dot": 1.1, "y0_ddot": -3.0}),
    "charged": (charged_particle(), {"Q_y": 0.2}),
    "double_pendulum": (double_pendulum(), {"Q_theta1": 1.0, "Q_theta2": -0.5}),
    "loaded": (loaded(), INPUTS),
}


def states(mechanism: Mechanism, count: int = 20) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random times (m,) in s and q, qd (m, n)."""
    random = np.random.default_rng(7)
    n = len(mechanism.coordinates)
    return random.uniform(0, 5, count), random.uniform(-1.2, 1.2, (count, n)), random.uniform(-2, 2, (count, n))


@pytest.mark.parametrize("case", CASES)
def test_accelerations_agree_with_sympy(case: str) -> None:
    mechanism, inputs = CASES[case]
    symbolic, (t, q, qd) = sympy_accelerations(mechanism), states(mechanism)
    found = Equations(mechanism).accelerations(t, q, qd, inputs)
    expected = np.array([symbolic(*state, inputs) for state in zip(t, q, qd, strict=True)])
    assert found == pytest.approx(expected, rel=1e-11, abs=1e-12)


@pytest.mark.parametrize("case", CASES)
def test_energy_is_balanced_to_rounding(case: str) -> None:
    mechanism, inputs = CASES[case]
    equations, (t, q, qd) = Equations(mechanism), states(mechanism)
    balance = equations.balance(t, q, qd, equations.accelerations(t, q, qd, inputs), inputs)
    assert np.abs(balance.residual).max() < 1e-14 * balance.scale.max()


@pytest.mark.parametrize("case", CASES)
def test_balance_sees_wrong_accelerations(case: str) -> None:
    mechanism, inputs = CASES[case]
    equations, (t, q, qd) = Equations(mechanism), states(mechanism)
    wrong = equations.accelerations(t, q, qd, inputs) * (1 + 1e-6)
    assert np.abs(equations.balance(t, q, qd, wrong, inputs).residual).max() > 1e-9


def test_one_state_and_a_long_batch_agree() -> None:
    equations, (t, q, qd) = Equations(loaded()), states(loaded(), 1500)
    batch = equations.accelerations(t, q, qd, INPUTS)
    for i in (0, 300, 777, 1499):
        assert equations.accelerations(t[i], q[i], qd[i], INPUTS) == pytest.approx(batch[i], rel=1e-12)
    assert equations.mass_matrix(t, q, qd).shape == (1500, 2, 2)
    assert equations.momenta(t[:3], q[:3], qd[:3]).shape == (3, 2)
    assert equations.generalized_energy(0.0, q[0], qd[0]).shape == ()


def test_energies_of_a_pendulum() -> None:
    equations, q, qd = Equations(pendulum(), {"m": 3.0}), np.array([0.6]), np.array([1.7])
    kinetic, potential = 0.5 * 3 * 0.7**2 * 1.7**2, -3 * 9.81 * 0.7 * np.cos(0.6)
    assert equations.kinetic_energy(0, q, qd) == pytest.approx(kinetic, rel=1e-14)
    assert equations.potential_energy(0, q, qd) == pytest.approx(potential, rel=1e-14)
    assert equations.generalized_energy(0, q, qd) == pytest.approx(kinetic + potential, rel=1e-14)
    assert equations.momenta(0, q, qd) == pytest.approx([3 * 0.7**2 * 1.7], rel=1e-14)
    assert equations.outputs(0, q, qd)["x"] == pytest.approx(0.7 * np.sin(0.6), rel=1e-15)


def test_lagrangian_is_added_to_bodies_and_springs() -> None:
    x = coordinate("x", start=0.5)
    both = Mechanism(
        "both",
        coordinates=[x],
        bodies=[Body("b", 2, (0, x))],
        springs=[Spring("s", 8, elongation=x)],
        gravity=10,
        energy=Energy(lagrangian=x.dot**2 - 6 * x),
    )
    # (2 + 2) qdd = -6 - 8 x - 2 * 10
    equations = Equations(both)
    assert equations.accelerations(0, [0.5], [3.0]) == pytest.approx([-(6 + 4 + 20) / 4])
    assert equations.kinetic_energy(0, [0.5], [3.0]) == pytest.approx(18.0)
    assert equations.potential_energy(0, [0.5], [3.0]) == pytest.approx(3 + 1 + 10)


def test_forces_on_a_rod_by_hand() -> None:
    """A rod hinged at the origin: (I + m c^2) a_ddot = the moments of weight, motor, load, spring, dampers."""
    a = coordinate("a")
    m, c, inertia, tip = 1.3, 0.4, 0.09, np.array([0.9 * np.sin(0.7), -0.9 * np.cos(0.7)])
    rod = Mechanism(
        "rod",
        coordinates=[a],
        bodies=[Body("rod", m, (c * sp.sin(a), -c * sp.cos(a)), angle=a, inertia=inertia)],
        points=[Point("tip", (0.9 * sp.sin(a), -0.9 * sp.cos(a))), Point("wall", (2, 1))],
        dampers=[Damper("d", 0.6, between=("tip", "wall")), Damper("hinge", 0.2, rate=a.dot)],
        springs=[Spring("s", 3, between=("wall", "tip"), length=0.5)],
        loads=[Load("pull", point="tip", force=(2, -5)), Load("motor", body="rod", torque=0.8)],
        gravity=9.81,
    )
    along = np.array([0.9 * np.cos(0.7), 0.9 * np.sin(0.7)])  # d tip / da
    gap = tip - [2, 1]
    direction = gap / np.linalg.norm(gap)
    moment = -m * 9.81 * c * np.sin(0.7) + 0.8 + along @ [2, -5]
    moment -= 0.6 * (direction @ along) ** 2 * 1.5 + 0.2 * 1.5 + 3 * (np.linalg.norm(gap) - 0.5) * (direction @ along)
    found = Equations(rod).accelerations(0, [0.7], [1.5])
    assert found == pytest.approx([moment / (inertia + m * c**2)], rel=1e-13)


def test_gravity_in_space_points_down_along_z() -> None:
    x, y, z = (coordinate(name) for name in "xyz")
    free = Mechanism("free", coordinates=[x, y, z], bodies=[Body("b", 2, (x, y, z))], gravity=9.81)
    assert Equations(free).accelerations(0, [1, 2, 3], [4, 5, 6]) == pytest.approx([0, 0, -9.81])


def test_mass_matrix_keeps_its_digits_between_units() -> None:
    a, b = coordinate("a"), coordinate("b")
    exact = 1e-7
    stretched = Mechanism(
        "stretched",
        coordinates=[a, b],
        energy=Energy(kinetic=5e5 * a.dot**2 + 5e-7 * b.dot**2 + exact * a.dot * b.dot, potential=1e9 * a),
    )
    matrix = Equations(stretched).mass_matrix(0, [0, 0], [0, 0])
    assert matrix[0, 1] == pytest.approx(exact, rel=1e-8)
    assert np.diagonal(matrix) == pytest.approx([1e6, 1e-6], rel=1e-15)


def test_a_light_rotor_on_a_huge_crane_keeps_its_inertia() -> None:
    """Entries that differ by 1e28: the rotor's coupling is known relative to the geometric mean of both inertias."""
    x, phi, y = coordinate("x"), coordinate("phi"), coordinate("y")
    kinetic = 5e7 * x.dot**2 + 5e-21 * (phi.dot + x.dot / 10**3) ** 2 + y.dot**2 / 2
    matrix = Equations(Mechanism("crane", coordinates=[x, phi, y], energy=Energy(kinetic=kinetic))).mass_matrix(
        0, [0] * 3, [0] * 3
    )
    assert matrix[1, 1] == pytest.approx(1e-20, rel=1e-12)
    assert matrix[1, [0, 2]] == pytest.approx([1e-23, 0.0], abs=1e-15 * np.sqrt(1e8 * 1e-20))


SAMPLES = {"acos": (0.3, -0.7), "asin": (0.3, -0.7), "log": (0.3, 2.5), "sqrt": (0.3, 2.5)}


@pytest.mark.parametrize("name", [name for name, (count, _) in FUNCTIONS.items() if count == 1])
def test_functions_have_their_derivative_along_the_complex_step(name: str) -> None:
    x = sp.Symbol("x", real=True)
    expression = FUNCTIONS[name][1](x)
    for point in SAMPLES.get(name, (0.3, -1.4, 2.5)):
        value = compiled([x], [expression])(np.array([[point + 1j * STEP]]), ())[0, 0]
        slope = 0.0 if name in ("sign", "heaviside") else float(expression.diff(x).subs(x, point).evalf(20))
        assert value.real == pytest.approx(float(expression.subs(x, point).evalf(20)), rel=4e-16)
        assert value.imag / STEP == pytest.approx(slope, rel=4e-15)


@pytest.mark.parametrize(
    "text", ["x**3", "x**-2", "x**(3/2)", "x**y", "2**x", "atan2(y,x)", "Min(x,y,1)", "Max(x**2,y)"]
)
def test_powers_and_functions_of_two_have_their_derivative(text: str) -> None:
    x, y = sp.symbols("x y", real=True)
    expression = sp.sympify(text, locals={"x": x, "y": y})
    along = {x: 0.8, y: -0.3}
    rows = np.array([[along[x] + 0.6j * STEP], [along[y] + 1.7j * STEP]])
    value = compiled([x, y], [expression])(rows, ())[0, 0]
    step = 1e-6
    ahead, behind = (float(expression.subs({x: 0.8 + s * 0.6, y: -0.3 + s * 1.7})) for s in (step, -step))
    assert value.real == pytest.approx(float(expression.subs(along)), rel=1e-15)
    assert value.imag / STEP == pytest.approx((ahead - behind) / (2 * step), rel=1e-8, abs=1e-9)


def test_values_outside_of_a_function_are_nan_not_complex() -> None:
    x = sp.Symbol("x", real=True)
    rows = np.array([[-0.5 + 1j * STEP]])
    for expression in (sp.sqrt(x), x ** sp.Rational(1, 3), sp.log(x), sp.asin(x - 1)):
        assert np.isnan(compiled([x], [expression])(rows, ())[0, 0].real)
    assert compiled([x], [sp.Heaviside(x)])(np.zeros((1, 1)), ())[0, 0] == 0.5


@pytest.mark.parametrize("step", [0.0, 1j * STEP])
def test_few_points_are_evaluated_like_many(step: complex) -> None:
    """One by one as NumPy's scalars, or as rows: the same values and derivatives, the same NaN."""
    x, y = sp.symbols("x y", real=True)
    two = [sp.atan2(y, x), sp.Min(x, y), sp.Max(x, y), x**y, x**2.5, x**-3, x**3 / y, sp.sqrt(x) * y]
    function = compiled([x, y], [*(f(x) for count, f in FUNCTIONS.values() if count == 1), *two])
    rows = np.array([[0.0, -2.0, 0.5, 1.0, 3.0, -0.25], [1.5, 0.0, -0.5, 1.0, 2.0, 0.25]]) + step
    many = function(rows, ())
    few = np.concatenate([function(rows[:, i : i + 2], ()) for i in range(0, 6, 2)], axis=1)
    assert len(rows.T) > FEW
    np.testing.assert_allclose(few.real, many.real, rtol=1e-14)
    np.testing.assert_allclose(few.imag, many.imag, rtol=1e-14)


def test_names_of_the_user_do_not_meet_those_of_the_code() -> None:
    c0, a1, power = coordinate("c0", start=0.4), parameter("a1", 2.0), parameter("power", 0.5)
    lam = parameter("lambda", 3.0)
    strange = Mechanism(
        "strange",
        coordinates=[c0],
        parameters=[a1, power, lam],
        energy=Energy(kinetic=a1 * c0.dot**2 / 2, potential=lam * sp.sin(c0) + (1 + sp.sin(c0)) ** power),
    )
    expected = -(3 * np.cos(0.4) + 0.5 * np.cos(0.4) * (1 + np.sin(0.4)) ** -0.5) / 2
    assert Equations(strange).accelerations(0, [0.4], [0.0]) == pytest.approx([expected])


def test_refuses_energies_that_are_not_quadratic() -> None:
    x = coordinate("x", start=0.5)
    with pytest.raises(DerivationError, match="not quadratic in the velocities"):
        Equations(Mechanism("cubic", coordinates=[x], energy=Energy(kinetic=x.dot**2 + x.dot**3)))


def test_names_the_coordinates_of_a_singular_mass_matrix() -> None:
    x, y = coordinate("x"), coordinate("y")
    massless = Mechanism("massless", coordinates=[x, y], energy=Energy(kinetic=x.dot**2, potential=y**2))
    with pytest.raises(SimulationError, match="singular in y; "):
        Equations(massless).accelerations(0, [0, 0], [0, 0])


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"nothing": 1.0}, "no parameter 'nothing'; known are m, k, zeta, c"),
        ({"c": 1.0}, "follows from others"),
        ({"m": float("nan")}, "'m': nan is not a finite number"),
        ({"k": -1.0}, r"'c' = .* is nan for the values given"),
    ],
)
def test_refuses_parameters(values: dict[str, float], message: str) -> None:
    with pytest.raises(LoadError, match=message):
        Equations(oscillator(), values)


def test_refuses_unknown_inputs_and_shapes() -> None:
    equations = Equations(falling(0))
    with pytest.raises(LoadError, match="no input 'F'; known are Q_e"):
        equations.accelerations(0, [0.1], [0.0], {"F": 1.0})
    with pytest.raises(SimulationError, match="must both end with n = 1"):
        equations.accelerations(0, [0.1, 0.2], [0.0])
    names = [coordinate(f"q{i}") for i in range(4)]
    four = Mechanism("four", coordinates=names, energy=Energy(kinetic=sum(q.dot**2 for q in names)))
    with pytest.raises(DerivationError, match="has 4 coordinates"):
        sympy_accelerations(four)


def test_states_move_onto_the_constraints_together_as_each_alone() -> None:
    """Near the constraints by full steps; far from them, at the last state, steps are halved for that state alone."""
    energies = EnergyFunctions(load("four_bar_linkage"))
    q, qd = (np.tile(x, (30, 1)) for x in energies.start(0.0))
    random = np.random.default_rng(0)
    for row in q:
        row[:] = row * random.uniform(0, 1) + random.normal(size=3) * random.uniform(0.01, 2)
    before, at = q.copy(), np.zeros(30)
    batch, nominal = (lambda a, b: energies.state(at, a, b)), np.ones(3)
    assert energies.constraints.consistent_together(batch, q, qd, nominal)[2].tolist() == [*[True] * 29, False]
    together = energies.all_consistent(at, q, qd, {})
    assert (q == before).all()
    for i in range(30):
        alone = energies.consistent(q[i], qd[i])
        np.testing.assert_allclose([x[i] for x in together], alone, rtol=0, atol=1e-9)
    assert np.abs(energies.constraints(energies.state(at, *together))[1]).max() < 1e-11


def test_wheels_that_have_turned_far_are_on_their_constraint_up_to_rounding() -> None:
    """After ten minutes at 3000 rpm the last digit of an angle is 3e-11 rad, and a constraint is met no better."""
    energies = EnergyFunctions(gear())
    turned, rates = np.linspace(1e5, 2e5, 200), np.array([300.0, 300.0 / 3.7])
    q, qd = np.column_stack([turned, turned / 3.7]), np.tile(rates, (200, 1))
    batch = lambda a, b: energies.state(np.zeros(200), a, b)  # noqa: E731
    assert energies.constraints.consistent_together(batch, q, qd, np.ones(2))[2].all()
    for row, rate in zip(q, qd, strict=True):
        np.testing.assert_allclose(energies.consistent(row, rate)[0], row, rtol=1e-15)


def gear() -> Mechanism:
    a, b = coordinate("a", "rad"), coordinate("b", "rad")
    mesh = Constraint("mesh", a - sp.Float(3.7) * b)
    return Mechanism("gear", coordinates=[a, b], energy=Energy(kinetic=a.dot**2 + b.dot**2), constraints=[mesh])
