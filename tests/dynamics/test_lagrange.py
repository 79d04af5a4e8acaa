"""The derived equations against hand-derived ones, the independent path, and by their own structure."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
import sympy as sp
from kkt import solve

from lag2fmu.analysis import analysis_report, linearize
from lag2fmu.codegen.c import c_function
from lag2fmu.description import names
from lag2fmu.dynamics import derive, lower
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.samples import mass_matrices, samples
from lag2fmu.dynamics.starts import start_values
from lag2fmu.dynamics.tangent import differentiate
from lag2fmu.errors import DerivationError
from lag2fmu.formats.loading import bundled, load
from lag2fmu.formats.text import read
from lag2fmu.language.expressions import parse
from lag2fmu.language.vocabulary import value_of
from lag2fmu.mechanism import Body, Energy, Mechanism, coordinate, parameter, signal
from lag2fmu.reference import Equations

NAMES = {name: sp.Symbol(name, real=True) for name in ("Q_slider", "k", "x", "slider")}


def accelerations(equations: EquationsOfMotion, values: dict[str, float]) -> np.ndarray:
    return solve(equations, values)[0]


def random_values(mechanism: Mechanism, generator: random.Random) -> dict[str, float]:
    parameters = {p.name for p in mechanism.parameters}
    return {k: v if k in parameters else v + generator.uniform(-0.5, 0.5) for k, v in start_values(mechanism).items()}


def test_double_pendulum_by_hand() -> None:
    """(m1+m2) l1^2 a1 + m2 l1 l2 (a2 cos d + w2^2 sin d) + (m1+m2) g l1 sin t1 = Q1, and its partner.

    Source: Landau, Lifshitz, Mechanics, section 5, problem 1, differentiated by hand.
    """
    equations = derive(load("double_pendulum"))
    generator = random.Random(1)
    for _ in range(20):
        v = random_values(equations.mechanism, generator)
        m1, m2, l1, l2, g = (v[k] for k in ("m1", "m2", "l1", "l2", "g"))
        t1, t2, w1, w2 = (v[k] for k in ("theta1", "theta2", "theta1_dot", "theta2_dot"))
        d = t1 - t2
        M = [[(m1 + m2) * l1**2, m2 * l1 * l2 * math.cos(d)], [m2 * l1 * l2 * math.cos(d), m2 * l2**2]]
        f = [
            v["Q_theta1"] - m2 * l1 * l2 * w2**2 * math.sin(d) - (m1 + m2) * g * l1 * math.sin(t1),
            v["Q_theta2"] + m2 * l1 * l2 * w1**2 * math.sin(d) - m2 * g * l2 * math.sin(t2),
        ]
        assert accelerations(equations, v) == pytest.approx(np.linalg.solve(M, f), rel=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("name", bundled())
def test_bundled_models_agree_with_the_independent_path(name: str) -> None:
    mechanism = load(name)
    equations = derive(mechanism)
    mechanism = equations.mechanism
    independent = Equations(mechanism)
    generator = random.Random(2)
    coordinates = [c.name for c in mechanism.coordinates]
    for _ in range(5):
        v = random_values(mechanism, generator)
        v |= {str(equations.graph.leaf[rate]): 0.0 for rate in equations.variables.rates}  # inputs are held there
        q, qd = ([v[f(c)] for c in coordinates] for f in (str, names.velocity))
        inputs = {k: v[k] for k in independent.energies.input_names}
        if mechanism.constraints:
            q, qd = independent.energies.consistent(np.array(q), np.array(qd), v["t"], inputs)
            v |= {f(c): x for f, row in ((str, q), (names.velocity, qd)) for c, x in zip(coordinates, row, strict=True)}
        expected = independent.accelerations(v["t"], np.array(q), np.array(qd), inputs)
        assert accelerations(equations, v) == pytest.approx(expected, rel=1e-9, abs=1e-9)
        h = equations.graph.evaluate([equations.energies["generalized_energy"]], v)[0]
        expected_h = float(independent.generalized_energy(v["t"], np.array(q), np.array(qd), inputs))
        assert h == pytest.approx(expected_h, rel=1e-10, abs=1e-10)


@pytest.mark.long
@pytest.mark.parametrize("name", bundled())
def test_tangents_against_central_differences(name: str) -> None:
    """dr of the tangent program against (r(x + e s) - r(x - e s)) / 2e along random seeds s."""
    equations = derive(load(name)).apart()
    g, tangent, generator = equations.graph, differentiate(equations), random.Random(3)
    values = random_values(equations.mechanism, generator)
    program = lower(equations)
    v = equations.variables
    variables = [v.t, *v.states, *v.signals, *v.parameters]
    seeds = {str(g.leaf[node]): generator.uniform(-1, 1) for node in variables}
    own = g.evaluate([*tangent.residual, *tangent.locals], values | {f"d {k}": x for k, x in seeds.items()} | {
        f"d {g.leaf[node]}": 0.0 for node in v.unknowns
    })  # fmt: skip
    c = equations.constraints
    nodes = [*equations.residual, *c.velocities, *c.positions, *(node for _, node in equations.locals())]
    e = 1e-6
    ahead, behind = (
        np.array(g.evaluate(nodes, {k: x + s * e * seeds.get(k, 0.0) for k, x in values.items()})) for s in (1, -1)
    )
    scale = 1 + np.abs(ahead).max()
    assert np.array(own) / scale == pytest.approx((ahead - behind) / (2 * e) / scale, rel=2e-9, abs=2e-9)
    assert len(program.locals) == len(tangent.locals)


def test_lagrangian_as_a_whole_equals_its_parts() -> None:
    x, y = coordinate("x", start=0.3), coordinate("y", start=0.1)
    m, k = parameter("m", 2.0), parameter("k", 3.0)
    kinetic, potential = m * (x.dot**2 + y.dot**2 + x.dot * y.dot) / 2, k * x**2 * y**2
    parts = derive(Mechanism("a", coordinates=[x, y], parameters=[m, k], energy=Energy(kinetic, potential)))
    whole = derive(Mechanism("a", coordinates=[x, y], parameters=[m, k], energy=Energy(lagrangian=kinetic - potential)))
    values = random_values(parts.mechanism, random.Random(4))
    assert accelerations(whole, values) == pytest.approx(accelerations(parts, values), rel=1e-14)
    assert "kinetic_energy" not in whole.energies
    assert "total_energy" in parts.energies


def test_charge_in_a_magnetic_field() -> None:
    """L = m v^2/2 + e B (x vy - y vx)/2: m a = e v x B, and h is the kinetic energy alone."""
    x, y = coordinate("x", start=0.3), coordinate("y")
    m, b = parameter("m", 2.0), parameter("b", 3.0)
    potential = -b * (x * y.dot - y * x.dot) / 2
    energy = Energy(kinetic=m * (x.dot**2 + y.dot**2) / 2, potential=potential)
    equations = derive(Mechanism("charge", coordinates=[x, y], parameters=[m, b], energy=energy))
    values = start_values(equations.mechanism) | {"x_dot": 0.7, "y_dot": -0.2}
    assert accelerations(equations, values) == pytest.approx([1.5 * -0.2, -1.5 * 0.7], rel=1e-14)
    assert "total_energy" not in equations.energies
    h = equations.graph.evaluate([equations.energies["generalized_energy"]], values)
    assert h == [pytest.approx(0.49 + 0.04)]


def test_motion_input_equals_explicit_time() -> None:
    driven, explicit = load("motion_driven_pendulum"), load("vertically_driven_pendulum")
    a, b = derive(driven), derive(explicit)
    parameters = {p.name: p.value for p in explicit.parameters}
    A, Omega = (parameters[k] for k in ("A", "Omega"))
    t = 0.37
    motion = next(u.name for u in driven.motions)
    values = start_values(explicit) | {"t": t, "theta": 0.4, "theta_dot": -0.3}
    moved = {
        motion: A * math.cos(Omega * t),
        f"{motion}_dot": -A * Omega * math.sin(Omega * t),
        f"{motion}_ddot": -A * Omega**2 * math.cos(Omega * t),
    }
    assert accelerations(a, values | moved) == pytest.approx(accelerations(b, values), rel=1e-13)


def test_dependencies_are_those_of_the_coupled_block() -> None:
    x, y, z = (coordinate(n) for n in "xyz")
    m = parameter("m", 1.0)
    kinetic = m * (x.dot**2 + y.dot**2 + x.dot * y.dot + z.dot**2) / 2
    equations = derive(Mechanism("blocks", coordinates=[x, y, z], parameters=[m], energy=Energy(kinetic, y**2 + z**4)))
    found = equations.unknown_dependencies()
    assert found[0] == found[1] == {"m", "y", "Q_x", "Q_y"}
    assert found[2] == {"m", "z", "Q_z"}


def test_the_printed_text_does_not_depend_on_what_was_asked_for_first() -> None:
    """What the accelerations do not need joins the graph late; when it does must not show."""
    texts = []
    for ask in (lambda e: None, lambda e: e.energies, lambda e: e.momenta):
        equations = derive(load("six_axis_arm"))
        before = len(equations.graph)
        ask(equations)
        program = lower(equations)
        assert len(program.graph) > before
        texts.append([c_function(program, function) for function in program.functions])
    assert texts[0] == texts[1] == texts[2]


def test_equations_do_not_grow_when_they_are_read() -> None:
    """Lowering and analyses add nodes to copies; on the equations' own graph a new node is refused."""
    equations = derive(load("cart_pole"))
    count = len(equations.graph)
    lower(equations, variational=True)
    analysis_report(equations.mechanism)
    linearize(equations)
    assert len(equations.graph) == count
    with pytest.raises(TypeError):
        equations.graph.symbol("a stranger")
    assert equations.apart().graph.symbol("a stranger") == count


@pytest.mark.parametrize("name", ["n_pendulum", "six_axis_arm", "kepler", "four_bar_linkage", "charged_particle"])
def test_mass_matrix_in_numbers_is_that_on_the_graph(name: str) -> None:
    """By the coefficients of the velocity graph, and by the nodes that are printed."""
    equations = derive(load(name))
    g, mechanism = equations.graph, equations.mechanism
    states = list(samples(mechanism, 3))
    found = mass_matrices(g, equations.entries, equations.variables.qd, states)
    n = len(mechanism.coordinates)
    for values, M in zip(states, found, strict=True):
        expected = np.reshape(g.evaluate([e for row in equations.mass_matrix for e in row], values), (n, n))
        assert np.allclose(M, expected, rtol=1e-12, atol=1e-13 * np.abs(expected).max())


def test_kinetic_energy_that_is_not_quadratic_is_refused() -> None:
    x = coordinate("x", start=0.1)
    m = parameter("m", 1.0)
    mechanism = Mechanism("quartic", coordinates=[x], parameters=[m], energy=Energy(m * x.dot**2 + x.dot**4, x**2))
    with pytest.raises(DerivationError, match=r"not quadratic in the velocities; supported are T = 1/2"):
        derive(mechanism)


def test_an_apparent_dependence_on_velocities_is_let_pass() -> None:
    x = coordinate("x", start=0.1)
    m = parameter("m", 1.0)
    kinetic = m * (x.dot**2 * sp.sin(x.dot) ** 2 + x.dot**2 * sp.cos(x.dot) ** 2) / 2
    equations = derive(Mechanism("apparent", coordinates=[x], parameters=[m], energy=Energy(kinetic, x**2)))
    assert equations.graph.evaluate([equations.mass_matrix[0][0]], start_values(equations.mechanism)) == [1.0]


def test_a_coordinate_without_mass_is_named() -> None:
    x, slider = coordinate("x"), coordinate("slider")
    m, k = parameter("m", 1.0), parameter("k", 1.0)
    energy = Energy(m * x.dot**2 / 2, k * (x - slider) ** 2 / 2)
    mechanism = Mechanism("massless", coordinates=[x, slider], parameters=[m, k], energy=energy)
    (equilibrium,) = derive(mechanism).mechanism.constraints
    assert equilibrium.name == "massless_slider"
    assert sp.expand(equilibrium.expression - sp.sympify("Q_slider + k*(x - slider)", locals=NAMES)) == 0
    unmoved = Energy(m * x.dot**2 / 2, k * x * slider)
    with pytest.raises(DerivationError, match=r"along slider has no mass, and the force on it depends on no"):
        derive(Mechanism("massless", coordinates=[x, slider], parameters=[m, k], energy=unmoved))


def test_a_start_without_a_finite_value_is_refused() -> None:
    r = coordinate("r", start=0.0)
    mechanism = Mechanism("centre", coordinates=[r], energy=Energy(r.dot**2 / 2, -1 / r))
    with pytest.raises(DerivationError, match=r"forces have no finite value at the start \(r = 0\)"):
        derive(mechanism)


def test_the_expression_without_a_finite_value_is_named() -> None:
    theta, a = coordinate("theta", start=1.0), parameter("a", -1.0)
    bob = Body("bob", 1, (sp.sqrt(a) * sp.sin(theta), sp.cos(theta)))
    with pytest.raises(DerivationError, match=r"mass matrix has no .* bodies.bob.position\[0\], 'sqrt\(a\)\*sin"):
        derive(Mechanism("rooted", coordinates=[theta], parameters=[a], bodies=[bob]))


def test_external_power_is_that_of_the_inputs_alone() -> None:
    x = coordinate("x")
    m, c, F = parameter("m", 1.0), parameter("c", 0.7), signal("F")
    mechanism = Mechanism(
        "pushed",
        coordinates=[x],
        parameters=[m, c],
        inputs=[F],
        bodies=[Body("b", m, (x, 0))],
        forces={x: F - c * x.dot},
    )
    equations = derive(mechanism)
    values = start_values(mechanism) | {"x_dot": 2.0, "F": 3.0, "Q_x": 0.5}
    assert equations.graph.evaluate([equations.energies["external_power"]], values) == [pytest.approx(7.0)]


WITHOUT = {  # {force of an input u: what it is without the input; 0 for terms that have no value then}
    "1/u": "0",
    "log(u)*x": "0",
    "3*x - x/u": "3*x",
    "x_dot*u**-0.5 - x_dot": "-x_dot",
    "sqrt(u - 1) + x": "x",
    "1/(u - x)": "0",
    "if(x > 0, 1/u, -x)": "if(x > 0, 0, -x)",
    "sin(x/u)": "0",
    "x*(1 + 1/u)": "x",
    "x/(1 + u)": "x",
    "x*sqrt(1 + u**2)": "x",
    "x*exp(-u)*cos(u) + u": "x",
    "x**u": "0",
    "asin(u/4)": "0",
    "acos(u/4)*x": "pi/2*x",
    "atan2(u, x)": "0",
    "u/(u + 1)/(u + 2)": "0",
}


@pytest.mark.parametrize(("force", "silent"), WITHOUT.items())
def test_inputs_may_stand_in_denominators_and_logarithms(force: str, silent: str) -> None:
    """The power is finite at any point at which the force is, and that of what the input adds."""
    text = """
[mechanism]
name = "driven"
[coordinates]
x = {{ start = 0.3, velocity = 1.5 }}
[inputs]
u = {{ start = 2.0 }}
[bodies.b]
mass = "1"
position = ["x", "0"]
[forces]
x = "{}"
"""
    mechanism = read(text.format(force), "driven.toml")
    equations = derive(mechanism)
    lower(equations)
    analysis_report(mechanism)
    values = start_values(mechanism) | {"x": 0.3, "x_dot": 1.5, "u": 2.0, "Q_x": 0.0}
    power = equations.graph.evaluate([equations.energies["external_power"]], values)
    of_inputs = value_of(parse(force), values) - value_of(parse(silent), values)
    assert power == [pytest.approx(1.5 * of_inputs, rel=1e-13)]


@pytest.mark.parametrize("inertia", [1e-14, 1e-18])
def test_an_inertia_that_is_lost_in_rounding_is_told_from_none(inertia: float) -> None:
    """A coordinate counted from 0.1 m beside the mass centre: m e^2 + J is m e^2 in double precision."""
    x, y, a = coordinate("x", "m"), coordinate("y", "m"), coordinate("a", "rad")
    e = sp.Rational(1, 10)
    body = Body("disc", 1.0, (x + e * sp.cos(a), y + e * sp.sin(a)), angle=a, inertia=inertia)
    with pytest.raises(DerivationError, match=r"singular to double precision .* Let coordinates begin at mass centres"):
        derive(Mechanism("beside", coordinates=[x, y, a], bodies=[body]))
    derive(Mechanism("centred", coordinates=[x, y, a], bodies=[Body("disc", 1.0, (x, y), angle=a, inertia=inertia)]))


def test_the_latest_equations_are_kept_for_the_same_mechanism() -> None:
    """Who derives twice gets the same record; an equal mechanism is another one, because comparing takes as long."""
    first, equal = load("double_pendulum"), load("double_pendulum")
    kept = derive(first)
    assert derive(first) is kept
    assert derive(first, "elimination") is not kept
    assert derive(equal) is not kept
    assert derive(first) is not kept
