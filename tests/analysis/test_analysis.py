"""The analysis against closed forms of the book, minimal coordinates, Mathieu's functions and the independent path."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from bicycle import EIGENVALUES
from scipy.special import mathieu_a, mathieu_b

from lag2fmu.analysis import (
    action,
    analysis_report,
    conserved,
    equilibria,
    floquet,
    hamiltonian,
    hamiltonian_form,
    linearize,
    linearized,
    normal_modes,
    poisson_bracket,
    routhian_form,
)
from lag2fmu.analysis.evaluation import resting_inputs
from lag2fmu.dynamics import derive
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.errors import DerivationError
from lag2fmu.formats.loading import load, with_values
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Body, Constraint, Energy, Load, Mechanism, Spring, coordinate, parameter, signal
from lag2fmu.reference import Equations


def frequencies(mechanism: Mechanism, q: list[float] | None = None) -> list[float]:
    """The normal frequencies about the equilibrium found from the start, in rad/s."""
    equations = derive(mechanism)
    place = equilibria(equations)[0].q if q is None else np.array(q)
    return [mode.frequency for mode in normal_modes(linearize(equations, place, 0 * place))]


def names_of(model: str | Mechanism) -> set[str]:
    return {item.name for item in conserved(derive(load(model) if isinstance(model, str) else model))}


# ---------------------------------------------------------------------------------------------- conserved quantities


@pytest.mark.parametrize(
    ("model", "expected"),
    [
        ("pendulum", {"generalized_energy"}),
        ("kepler", {"p_phi", "generalized_energy"}),
        ("spherical_pendulum", {"p_phi", "generalized_energy"}),
        ("heavy_top", {"p_phi", "p_psi", "generalized_energy"}),
        ("symmetrical_top", {"p_phi", "p_psi", "generalized_energy", "angular_momentum_x", "angular_momentum_y"}),
        ("two_bodies", {"generalized_energy", "linear_momentum_x", "linear_momentum_y", "angular_momentum_z"}),
        ("charged_particle", {"p_z", "generalized_energy"}),
        ("triatomic_molecule", {"generalized_energy", "linear_momentum_x"}),
        ("bead_on_hoop", {"generalized_energy"}),
        ("free_body", {"generalized_energy", "angular_momentum_x", "angular_momentum_y", "angular_momentum_z"}),
        ("sphere_on_turntable", {"angular_momentum_x", "angular_momentum_y"}),
        ("circling_support_pendulum", set()),
        ("spring_mass_damper", set()),
        ("cart_pole", set()),
    ],
)
def test_what_is_conserved(model: str, expected: set[str]) -> None:
    """By the symmetries of each Lagrangian; Landau, Lifshitz, Mechanics, sections 6, 7, 9."""
    assert names_of(model) == expected


def test_momenta_of_the_symmetrical_top_are_the_book_s() -> None:
    """p_psi = I3 (phi' cos theta + psi'); p_phi = (I1 sin^2 + I3 cos^2) phi' + I3 psi' cos theta: section 35."""
    found = {item.name: item.expression for item in conserved(derive(load("symmetrical_top")))}
    I1, I3, theta, phi_dot, psi_dot = (sp.Symbol(s, real=True) for s in ("I1", "I3", "theta", "phi_dot", "psi_dot"))
    spin = I3 * (phi_dot * sp.cos(theta) + psi_dot)
    assert sp.simplify(found["p_psi"] - spin) == 0
    assert sp.simplify(found["p_phi"] - spin * sp.cos(theta) - I1 * sp.sin(theta) ** 2 * phi_dot) == 0


def sphere() -> Mechanism:
    """A spherical pendulum in Cartesian coordinates."""
    x, y = coordinate("x", "m", start=0.3, velocity=0.1), coordinate("y", "m", start=0.1, velocity=0.4)
    z, l = coordinate("z", "m", guess=-0.9, guess_velocity=0.0), parameter("l", 1.0, "m")  # noqa: E741
    return Mechanism(
        "sphere",
        coordinates=[x, y, z],
        parameters=[l],
        bodies=[Body("bob", 2.0, (x, y, z))],
        gravity=9.81,
        constraints=[Constraint("rod", x**2 + y**2 + z**2 - l**2)],
    )


def test_constraint_forces_break_what_they_have_a_component_along() -> None:
    """On the sphere the angular momentum about the vertical and the energy are left; the weight is along z."""
    assert names_of(sphere()) == {"angular_momentum_z", "generalized_energy"}


def test_moving_constraints_and_loads_change_the_energy() -> None:
    mechanism = sphere()
    l, t = sp.Symbol("l", real=True), sp.Symbol("t", real=True)  # noqa: E741
    (rod,) = mechanism.constraints
    shaken = replace(rod, expression=rod.expression + l**2 - (l + sp.sin(t) / 10) ** 2)
    moving = replace(mechanism, constraints=[shaken])  # type: ignore[arg-type]
    assert names_of(moving) == {"angular_momentum_z"}
    assert "constraints move" in analysis_report(moving)
    loaded = replace(mechanism, loads=[Load("wind", point="bob", force=(1, 0, 0))])  # type: ignore[arg-type]
    assert names_of(loaded) == set()


# ------------------------------------------------------------------------------------------------- equilibria, modes


def test_equilibria_of_the_double_pendulum() -> None:
    found = {tuple(np.round(e.q / math.pi, 9)) for e in equilibria(derive(load("double_pendulum")))}
    assert found == {(0, 0), (0, 1), (1, 0), (1, 1)}


@pytest.mark.parametrize(
    ("model", "places"),
    [
        ("cart_pole", [[0, 0], [0, math.pi]]),
        ("furuta_pendulum", [[0, 0], [0, math.pi]]),
        ("rolling_disc", [[0, 0, 0, 0, 0], [0, 0, 0, math.pi, 0]]),
    ],
)
def test_of_a_family_of_equilibria_the_one_next_to_the_start_is_named(model: str, places: list[list[float]]) -> None:
    found = equilibria(derive(load(model)))
    np.testing.assert_allclose([e.q for e in found], places, atol=1e-9)


def test_bead_on_hoop_turns_out_at_the_angle_of_the_book() -> None:
    """cos theta = g / (Omega^2 R), where the hoop turns fast enough."""
    equations = derive(load("bead_on_hoop"))
    v = resting_inputs(equations)
    angle = math.acos(v["g"] / (v["Omega"] ** 2 * v["R"]))
    assert any(e.q == pytest.approx([angle], abs=1e-12) for e in equilibria(equations))


def test_no_equilibrium_is_found_where_there_is_none() -> None:
    for model in ("kepler", "falling_body", "double_atwood"):
        assert equilibria(derive(load(model))) == ()


def test_pendulum() -> None:
    assert frequencies(load("pendulum")) == pytest.approx([math.sqrt(9.81)], rel=1e-13)


def test_double_pendulum() -> None:
    """Landau, Lifshitz, Mechanics, section 23, problem 2."""
    mechanism = with_values(load("double_pendulum"), {"m1": 1.3, "m2": 0.4, "l1": 0.7, "l2": 1.1})
    m1, m2, l1, l2, g = 1.3, 0.4, 0.7, 1.1, 9.81
    total, length = m1 + m2, l1 + l2
    root = math.sqrt(total) * math.sqrt(total * length**2 - 4 * m1 * l1 * l2)
    squares = [g / (2 * m1 * l1 * l2) * (total * length + sign * root) for sign in (-1, 1)]
    assert frequencies(mechanism) == pytest.approx(np.sqrt(squares), rel=1e-12)


def test_triatomic_molecule() -> None:
    """Landau, Lifshitz, Mechanics, section 24, problem 1; the shape of the symmetrical vibration is (1, 0, -1)."""
    equations = derive(load("triatomic_molecule"))
    mA, mB, k = (resting_inputs(equations)[s] for s in ("mA", "mB", "k"))
    modes = normal_modes(linearize(equations, equilibria(equations)[0].q, np.zeros(3)))
    expected = [0, math.sqrt(k / mA), math.sqrt(k * (2 * mA + mB) / (mA * mB))]
    assert [m.frequency for m in modes] == pytest.approx(expected, rel=1e-12)
    assert modes[0].shape.real == pytest.approx([1, 1, 1], abs=1e-9)
    assert modes[1].shape.real == pytest.approx([1, 0, -1], abs=1e-9)
    assert modes[2].shape.real == pytest.approx([-mB / (2 * mA), 1, -mB / (2 * mA)], abs=1e-9)


def test_spring_pendulum_and_sliding_support() -> None:
    """sqrt(k/m) with sqrt(g/l), l being the stretched length; sqrt(g (m1 + m2) / (m1 l)) beside free motion."""
    v = resting_inputs(derive(load("elastic_pendulum")))
    length = v["l0"] + v["m"] * v["g"] / v["k"]
    expected = sorted([math.sqrt(v["g"] / length), math.sqrt(v["k"] / v["m"])])
    assert frequencies(load("elastic_pendulum")) == pytest.approx(expected, rel=1e-12)
    v = resting_inputs(derive(load("sliding_support_pendulum")))
    expected = [0.0, math.sqrt(v["g"] * (v["m1"] + v["m2"]) / (v["m1"] * v["l"]))]
    assert frequencies(load("sliding_support_pendulum")) == pytest.approx(expected, rel=1e-12)


def test_damped_and_gyroscopic_motions() -> None:
    """x'' + 2 lambda x' + omega0^2 x = 0 (section 25); Foucault's plane turns with -W: frequencies omega -+ W."""
    equations = derive(load("spring_mass_damper"))
    (mode,) = normal_modes(linearize(equations, np.zeros(1), np.zeros(1)))
    m, k, c = (resting_inputs(equations)[name] for name in ("m", "k", "c"))
    assert mode.eigenvalue == pytest.approx(complex(-c / (2 * m), math.sqrt(k / m - (c / (2 * m)) ** 2)), rel=1e-12)
    equations = derive(load("foucault_pendulum"))
    v = resting_inputs(equations)
    W = v["Omega"] * math.sin(v["lat"])
    assert frequencies(equations.mechanism) == pytest.approx([v["omega"] - W, v["omega"] + W], rel=1e-12)


# ---------------------------------------------------------------------------------------------------- linearization


R, ROD, STIFFNESS, FREE = 0.3, 0.8, 40.0, 0.9


def crank(minimal: bool) -> Mechanism:
    """A slider-crank with a spring at the slider, loaded by gravity: by its angle alone, or with two constraints."""
    theta, F = coordinate("theta", "rad", start=-1.0), signal("F", "N")
    pin = (R * sp.cos(theta), R * sp.sin(theta))
    if minimal:
        x = pin[0] + sp.sqrt(ROD**2 - pin[1] ** 2)
        angle = -sp.asin(pin[1] / ROD)
        coordinates, constraints = [theta], []
    else:
        x, angle = coordinate("x", "m", guess=0.9), coordinate("angle", "rad", guess=0.3)
        coordinates = [theta, x, angle]
        constraints = [
            Constraint("along", pin[0] + ROD * sp.cos(angle) - x),
            Constraint("across", pin[1] + ROD * sp.sin(angle)),
        ]
    middle = (pin[0] + ROD / 2 * sp.cos(angle), pin[1] + ROD / 2 * sp.sin(angle))
    return Mechanism(
        "crank" if minimal else "crank_constrained",
        coordinates=coordinates,
        inputs=[F],
        constraints=constraints,
        bodies=[
            Body("crank", 1.5, (pin[0] / 2, pin[1] / 2), angle=theta, inertia=0.02),
            Body("rod", 0.7, middle, angle=angle, inertia=0.04),
            Body("slider", 2.0, (x, 0)),
        ],
        gravity=9.81,
        springs=[Spring("spring", STIFFNESS, elongation=x - FREE)],
        loads=[Load("push", point="slider", force=(F, 0))],
    )


def test_a_constrained_mechanism_is_that_in_minimal_coordinates() -> None:
    """Equilibrium, A, B and frequencies of a slider-crank, the multipliers' stiffness included."""
    minimal, constrained = derive(crank(True)), derive(crank(False))
    (a,) = (e for e in equilibria(minimal, 1))
    (b,) = (e for e in equilibria(constrained, 1))
    assert b.q[0] == pytest.approx(a.q[0], abs=1e-10)
    assert np.abs(b.multipliers).max() > 1  # the joints carry something
    one, other = linearize(minimal, a.q, np.zeros(1)), linearize(constrained, b.q, np.zeros(3))
    assert other.A.shape == (2, 2)
    # the independent coordinate of the constrained form may be another one: eigenvalues do not depend on it
    assert other.eigenvalues == pytest.approx(one.eigenvalues, rel=1e-9)
    assert [m.frequency for m in normal_modes(other)] == pytest.approx(
        [m.frequency for m in normal_modes(one)], rel=1e-9
    )
    place = other.states[0]
    turn = other.shape[0, 0]  # d theta / d z
    assert other.B[1, other.inputs.index("F")] * turn == pytest.approx(one.B[1, one.inputs.index("F")], rel=1e-9), place


@pytest.mark.parametrize("model", ["furuta_pendulum", "heavy_top", "double_pendulum", "charged_particle"])
def test_linearization_about_a_moving_state_against_the_independent_path(model: str) -> None:
    """A and B by central differences of accelerations of reference/."""
    equations, independent = derive(load(model)), Equations(load(model))
    n = len(equations.forcing)
    generator = np.random.default_rng(5)
    q = np.array([c.start for c in equations.mechanism.coordinates]) + generator.uniform(0.1, 0.4, n)
    qd = np.array([c.velocity for c in equations.mechanism.coordinates]) + generator.uniform(-0.5, 0.5, n)
    found, step, x = linearize(equations, q, qd), 1e-6, np.concatenate([q, qd])
    for i in range(2 * n):
        e = np.zeros(2 * n)
        e[i] = step
        ahead, behind = (independent.accelerations(0.0, (x + s * e)[:n], (x + s * e)[n:]) for s in (1, -1))
        assert found.A[n:, i] == pytest.approx(
            (ahead - behind) / (2 * step), rel=1e-6, abs=1e-6 * np.abs(found.A).max()
        )
    M = independent.mass_matrix(0.0, q, qd)
    assert found.B[n:, :n] == pytest.approx(np.linalg.inv(M), rel=1e-9)


def test_nutation_of_the_heavy_top_about_regular_precession() -> None:
    """I omega^2 = d2/dtheta2 of the effective potential; Landau, Lifshitz, section 35, problem 1; Goldstein, 5-7."""
    equations = derive(load("heavy_top"))
    v = resting_inputs(equations)
    A, C, m, l, g = (v[s] for s in ("A", "C", "m", "l", "g"))  # noqa: E741
    inertia, theta0, spin = A + m * l**2, 0.5, 80.0
    # regular precession: inertia cos(theta) phi'^2 - C omega3 phi' + m g l = 0, omega3 = psi' + phi' cos(theta)
    w = np.roots([(inertia - C) * math.cos(theta0), -C * spin, m * g * l]).min()
    found = linearize(equations, np.array([0, theta0, 0]), np.array([w, 0, spin]))
    p_psi = C * (spin + w * math.cos(theta0))
    p_phi = inertia * math.sin(theta0) ** 2 * w + p_psi * math.cos(theta0)
    x = sp.Symbol("x")
    effective = (p_phi - p_psi * sp.cos(x)) ** 2 / (2 * inertia * sp.sin(x) ** 2) + m * g * l * sp.cos(x)
    assert float(effective.diff(x).subs(x, theta0)) == pytest.approx(0, abs=1e-10)
    assert found.values["theta_ddot"] == pytest.approx(0, abs=1e-9)
    nutation = math.sqrt(float(effective.diff(x, 2).subs(x, theta0)) / inertia)
    assert np.abs(found.eigenvalues.imag).max() == pytest.approx(nutation, rel=1e-9)


@pytest.mark.long
@pytest.mark.parametrize(("speed", "published"), EIGENVALUES)
def test_eigenvalues_of_the_bicycle(speed: float, published: list[complex]) -> None:
    """Nonholonomic, about riding on."""
    equations = derive(load("whipple_bicycle"))
    rates = {"x": speed, "theta_R": -speed / 0.3, "theta_F": -speed / 0.35}
    qd = np.array([rates.get(c.name, 0.0) for c in equations.mechanism.coordinates])
    found = linearize(equations, np.zeros(len(qd)), qd).eigenvalues
    for value in published:
        assert np.abs(found - value).min() < 1e-10


# ---------------------------------------------------------------------------------------------------- small motions


def test_the_small_vibration_form_of_the_double_pendulum_is_the_book_s() -> None:
    """Landau, Lifshitz, Mechanics, section 23, problem 2."""
    form = linearized(load("double_pendulum"))
    m1, m2, l1, l2, g, a, b, u, v = (
        sp.Symbol(s, real=True) for s in ("m1", "m2", "l1", "l2", "g", "theta1", "theta2", "theta1_dot", "theta2_dot")
    )
    kinetic = (m1 + m2) * l1**2 * u**2 / 2 + m2 * l2**2 * v**2 / 2 + m2 * l1 * l2 * u * v
    potential = (m1 + m2) * g * l1 * a**2 / 2 + m2 * g * l2 * b**2 / 2
    assert sp.expand(form.energy.kinetic - kinetic) == 0
    assert sp.expand(form.energy.potential - potential) == 0


@pytest.mark.parametrize(
    "model", ["double_pendulum", "foucault_pendulum", "furuta_pendulum", "slides_problem_6", "elastic_pendulum"]
)
def test_small_motions_have_the_same_matrix(model: str) -> None:
    """A about rest of linearized(m) is A of m about its equilibrium."""
    equations = derive(load(model))
    place = equilibria(equations)[0].q
    small = derive(linearized(load(model)))
    expected = linearize(equations, place, 0 * place).A
    assert (
        pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max()) == linearize(small, 0 * place, 0 * place).A
    )


def test_small_motions_of_a_constrained_mechanism() -> None:
    equations = derive(crank(True))
    place = equilibria(equations)[0].q
    expected = linearize(equations, place, 0 * place).eigenvalues
    small = derive(linearized(crank(False)))
    assert len(small.constraints) == 2
    assert linearize(small, np.zeros(3), np.zeros(3)).eigenvalues == pytest.approx(expected, rel=1e-9)


@pytest.mark.fmu
@pytest.mark.parametrize(
    "mechanism", [load("double_pendulum"), load("foucault_pendulum"), crank(False)], ids=lambda m: m.name
)
def test_small_motions_export_and_validate(mechanism: Mechanism) -> None:
    import lag2fmu

    report = lag2fmu.validate(linearized(mechanism), stop_time=2.0)
    assert report.passed, str(report)


def test_what_is_no_equilibrium_is_refused() -> None:
    with pytest.raises(DerivationError, match=r"no equilibrium .*theta_ddot = -4\.7"):
        linearized(load("pendulum"), [0.5])
    with pytest.raises(DerivationError, match="no equilibrium was found"):
        linearized(load("kepler"))
    with pytest.raises(DerivationError, match="Floquet"):
        linearized(load("vertically_driven_pendulum"))


# ----------------------------------------------------------------------------------------------------------- Floquet


@pytest.mark.long
@pytest.mark.parametrize(
    ("order", "kind", "trace"), [(0, mathieu_a, 2), (1, mathieu_b, -2), (1, mathieu_a, -2), (2, mathieu_b, 2)]
)
def test_kapitza_s_pendulum_on_the_borders_of_mathieu_s_chart(order: int, kind: object, trace: float) -> None:
    """x'' + (a - 2 q cos 2 tau) x = 0, tau = Omega t / 2, |q| = 2 A / l, a = -+ 4 g / (l Omega^2) above and below.

    On the characteristic curves the trace of the monodromy matrix is 2 or -2: Abramowitz and Stegun, 20.3.
    """
    q = 0.4
    a = float(kind(order, q))  # type: ignore[operator]
    Omega = math.sqrt(4 * 9.81 / abs(a))
    mechanism = with_values(load("vertically_driven_pendulum"), {"A": q / 2, "Omega": Omega})
    found = floquet(derive(mechanism), np.array([math.pi if a < 0 else 0.0]))
    assert found.period == pytest.approx(2 * math.pi / Omega, rel=1e-14)
    assert np.trace(found.monodromy) == pytest.approx(trace, abs=1e-8)
    assert np.linalg.det(found.monodromy) == pytest.approx(1, abs=1e-11)  # Liouville


def test_kapitza_s_pendulum_stands_upright_if_driven_fast() -> None:
    """A^2 Omega^2 > 2 g l for fast drives: Landau, Lifshitz, Mechanics, section 30, problem 1."""
    for factor, stable in ((0.9, False), (1.1, True)):
        values = {"A": 0.01, "Omega": factor * math.sqrt(2 * 9.81) / 0.01}
        equations = derive(with_values(load("vertically_driven_pendulum"), values))
        assert floquet(equations, np.array([math.pi])).stable == stable


def test_an_aperiodic_drive_is_told() -> None:
    with pytest.raises(DerivationError, match="the drive is not periodic"):
        floquet(derive(load("shortened_pendulum")), np.zeros(1))
    with pytest.raises(DerivationError, match="does not repeat itself"):
        floquet(derive(load("vertically_driven_pendulum")), np.zeros(1), period=0.5)


# ----------------------------------------------------------------------------------------------------- canonical side


def body_momenta(equations: EquationsOfMotion) -> dict[str, int]:
    """The angular momentum m r x v of a free particle with coordinates x, y, z, as nodes."""
    g, v = equations.graph, equations.variables
    return {
        axis: g.subtract(g.multiply(v.q[j], equations.momenta[k]), g.multiply(v.q[k], equations.momenta[j]))
        for axis, j, k in (("x", 1, 2), ("y", 2, 0), ("z", 0, 1))
    }


def test_poisson_brackets() -> None:
    """{q, p} = 1 and {Mx, My} = Mz, signs as Goldstein's (section 9.7); {I, H} = 0 for what is conserved."""
    equations = derive(load("charged_particle")).apart()
    values = {**resting_inputs(equations), "x": 0.4, "y": -0.3, "z": 0.7, "x_dot": 0.5, "y_dot": 0.2, "z_dot": -0.9}
    g, v = equations.graph, equations.variables
    for i in range(3):
        for j in range(3):
            assert poisson_bracket(equations, v.q[i], equations.momenta[j], values) == pytest.approx(
                float(i == j), abs=1e-14
            )
    M = body_momenta(equations)
    (expected,) = g.evaluate([M["z"]], values)
    assert poisson_bracket(equations, M["x"], M["y"], values) == pytest.approx(expected, rel=1e-12)
    h = equations.energies["generalized_energy"]
    assert poisson_bracket(equations, equations.momenta[2], h, values) == pytest.approx(0, abs=1e-14)
    assert abs(poisson_bracket(equations, equations.momenta[0], h, values)) > 0.01


@pytest.mark.parametrize("model", ["kepler", "heavy_top"])
def test_conserved_quantities_commute_with_h(model: str) -> None:
    equations = derive(load(model))
    values = {**resting_inputs(equations), "theta": 0.7, "theta_dot": 0.3, "phi_dot": 2.0, "r_dot": 0.2}
    for item in conserved(equations):
        own = replace(equations, graph=item.graph)
        h = own.energies["generalized_energy"]
        assert poisson_bracket(own, item.node, h, values) == pytest.approx(0, abs=1e-12)


def test_hamiltonian_in_closed_form_and_in_numbers() -> None:
    H = hamiltonian_form(derive(load("kepler")))
    m, r, alpha, beta, p_r, p_phi = (sp.Symbol(s, real=True) for s in ("m", "r", "alpha", "beta", "p_r", "p_phi"))
    assert sp.simplify(H - (p_r**2 + p_phi**2 / r**2) / (2 * m) + alpha / r - beta / r**2) == 0
    for model in ("double_pendulum", "heavy_top", "charged_particle", "moving_frame", "horizontally_driven_pendulum"):
        equations = derive(load(model))
        values = {**resting_inputs(equations), "t": 0.3, "theta": 0.8}
        momenta = np.array([0.7, -0.4, 0.3])[: len(equations.forcing)]
        symbols = {f"p_{c.name}": p for c, p in zip(equations.mechanism.coordinates, momenta, strict=True)}
        form = hamiltonian_form(equations)
        number = form.subs({s: {**values, **symbols}[s.name] for s in form.free_symbols})
        assert float(number) == pytest.approx(hamiltonian(equations, values, momenta), rel=1e-12)


def test_routhian_of_the_spherical_pendulum() -> None:
    """R = p_phi^2 / (2 m l^2 sin^2) - m l^2 theta'^2 / 2 - m g l cos theta: section 41 on section 14's example."""
    names, R = routhian_form(derive(load("spherical_pendulum")))  # type: ignore[misc]
    m, l, g, theta, rate, p = (sp.Symbol(s, real=True) for s in ("m", "l", "g", "theta", "theta_dot", "p_phi"))  # noqa: E741
    expected = p**2 / (2 * m * l**2 * sp.sin(theta) ** 2) - m * l**2 * rate**2 / 2 - m * g * l * sp.cos(theta)
    assert names == ("phi",)
    assert sp.simplify(R - expected) == 0


def test_action_of_a_free_fall_and_an_oscillator() -> None:
    """S = m omega / (2 sin omega T) ((x0^2 + x1^2) cos omega T - 2 x0 x1): Feynman, Hibbs, problem 2-2."""
    x = coordinate("x", "m", start=1.0)
    m, k, omega = 2.0, 18.0, 3.0
    mechanism = Mechanism(
        "oscillator", coordinates=[x], energy=Energy(kinetic=m * x.dot**2 / 2, potential=k * x**2 / 2)
    )
    t = np.linspace(0, 0.9, 400)
    place = np.cos(omega * t) + 0.3 * np.sin(omega * t)
    rate = omega * (0.3 * np.cos(omega * t) - np.sin(omega * t))
    S = action(derive(mechanism), t, {"x": place, "x_dot": rate, "x_ddot": -(omega**2) * place})
    c, s = math.cos(omega * t[-1]), math.sin(omega * t[-1])
    expected = m * omega / (2 * s) * ((place[0] ** 2 + place[-1] ** 2) * c - 2 * place[0] * place[-1])
    assert S[-1] == pytest.approx(expected, rel=1e-9)


# ------------------------------------------------------------------------------------------------------------ reports


def test_what_does_not_apply_says_so_and_leaves_the_rest() -> None:
    text = analysis_report(load("heavy_top"))
    assert "The mass matrix is singular at the state" in text
    assert "H = " in text
    assert "R = " in text
    text = analysis_report(load("kepler"))
    assert "None was found" in text
    assert "p_phi = m*phi_dot*r**2" in text
    text = analysis_report(load("shortened_pendulum"))
    assert "the drive is not periodic" in text
    assert "There is no cyclic coordinate" in text
    assert "No momentum is conserved" in text


def test_the_report_has_the_modes_in_text_and_latex() -> None:
    assert "mode 1: 2.3972 rad/s, 0.381526 Hz; theta1 0.7071, theta2 1" in analysis_report(load("double_pendulum"))
    latex = analysis_report(load("double_pendulum"), "latex")
    assert latex.count("\\paragraph{") == 6
    assert "\\cos{\\left(\\theta_{1} \\right)}" in latex


@pytest.mark.parametrize(
    "force",
    [
        "heaviside(t - 50) - heaviside(t - 50.1)",
        "exp(-((t - 50)/0.05)**2)",
        "if(abs(x - 20) < 0.1, 1, 0)",
        "(1 - tanh(900*(y - 20))**2)*x_dot",
        "p(t)",
    ],
)
def test_a_force_that_acts_elsewhere_or_later_conserves_nothing(force: str) -> None:
    """At states near the start these forces are 0 to the last bit; between two bodies they cancel everywhere."""
    text = (
        "[mechanism]\nname = 'pulse'\n[coordinates]\nx = { unit = 'm' }\ny = { unit = 'm', start = 1.0 }\n"
        "[bodies.a]\nmass = 1\nposition = ['x', 0]\n[bodies.b]\nmass = 2\nposition = ['y', 0]\n"
        "[tables.p]\ncolumns = [[50, 51, 52], [0, 1, 0]]\n[forces]\nx = '%s'\ny = '%s'\n"
    )
    for onto, expected in (("y - y", set()), (f"-({force})", {"linear_momentum_x"})):
        found = conserved(derive(read(text % (force, onto), "pulse.toml")))
        assert {item.name for item in found} & {"linear_momentum_x"} == expected


def test_a_spring_that_acts_on_one_side_keeps_no_momentum() -> None:
    """Near the start it is slack, and under a constraint momenta are judged by states near the start."""
    text = (
        "[mechanism]\nname = 'slack'\n[coordinates]\nx = { unit = 'm', start = -0.8 }\ny = { unit = 'm' }\n"
        "[energy]\nkinetic = 'x_dot**2 + y_dot**2'\n[springs.stop]\nstiffness = 40\nelongation = 'max(x, 0)'\n"
        "[constraints.holonomic]\nrail = 'y'\n"
    )
    assert {q.name for q in conserved(derive(read(text, "slack.toml")))} == {"generalized_energy", "p_y"}


def test_a_constraint_that_is_flat_near_the_start_keeps_no_momentum() -> None:
    text = (
        "[mechanism]\nname = 'ramp'\n[coordinates]\nx = { unit = 'm', start = -0.7, velocity = 1 }\n"
        "z = { unit = 'm', start = 0 }\n[gravity]\nacceleration = 9.81\n[bodies.bead]\nmass = 1\n"
        "position = ['x', 'z']\n[parameters]\nc = { unit = '1/m', value = 0.4 }\n"
        "[constraints.holonomic]\nramp = 'z - c*max(x, 0)**2'\n"
    )
    assert {q.name for q in conserved(derive(read(text, "ramp.toml")))} == {"generalized_energy"}


def test_nothing_is_called_conserved_where_friction_acts() -> None:
    """The equations that are analysed lack its forces, and the report says so."""
    equations = derive(load("block_on_belt"))
    assert conserved(equations) == ()
    report = analysis_report(load("block_on_belt"))
    assert "contacts, stops, dry friction or latches act" in report
    assert "which this analysis leaves out" in report


def test_nothing_rests_beyond_a_stop() -> None:
    """Newton's method finds the upright rest first, which the stop keeps out of reach."""
    text = """
[mechanism]
name = "arm"
[coordinates]
a = { unit = "rad", start = 2.0 }
[bodies.bob]
mass = 1
position = ["sin(a)", "-cos(a)"]
[gravity]
acceleration = 10
"""
    places = [item.q[0] for item in equilibria(derive(read(text, "arm")))]
    assert sorted(abs(place) for place in places) == pytest.approx([0.0, math.pi], abs=1e-9)
    stop = '[stops.end]\nof = "a"\nlower = "-pi/2"\nupper = 2.5\n'
    assert [item.q[0] for item in equilibria(derive(read(text + stop, "arm")))] == pytest.approx([0.0], abs=1e-9)
